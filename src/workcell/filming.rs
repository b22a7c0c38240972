//! How a run is filmed: small pictures of camera and twin at a steady rate while the arm moves.
//!
//! On each control tick it is asked whether a picture is due, and the shutter is opened; drawing and encoding are the
//! album's, beside the run. Nothing that is measured or decided rests on these pictures, so they change no number.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::arm::{Feedback, Film};
use crate::execution::twin_arm::SharedTwin;
use crate::trace::{Event, Observer, Tryout};
use crate::twin::Twin;
use crate::twin::render::{ArmLook, View};
use crate::world::Camera;

use super::album::{Job, Moment};
use super::picture;

/// From one picture to the next, s of the arm's time, where somebody looks on or the arm takes the time of a real one.
/// Chosen: a stream from a jar is seen to begin and to end, and a pour of 30 s makes 3 MB.
pub(super) const OFTEN: f64 = 0.2;
/// The same where nobody waits for an arm: at [`OFTEN`] the pictures took 9 s of a pour's 31 s of processor time. With
/// twice as long a stream is seen once.
pub(super) const SELDOM: f64 = 0.5;
/// Width of the pictures, px.
pub(super) const WIDTH: u32 = 480;
/// Ticks are not quite where they are counted, s.
const EARLY: f64 = 1e-3;

/// What a twin looked like at one moment of a rehearsal.
#[derive(Debug, Clone)]
pub struct Glimpse {
    /// When, s since its step began.
    elapsed: f64,
    view: View,
    /// Water in its vessels, by name, m³.
    water: Vec<(String, f64)>,
    /// Water on its table, m³.
    spilt: f64,
}

impl Glimpse {
    pub(super) fn of(twin: &Twin, look: &ArmLook, elapsed: f64) -> Self {
        let state = twin.state();
        let water =
            state.objects.iter().filter_map(|object| Some((object.name.clone(), object.water?)));
        let water = water.collect();
        Self { elapsed, view: picture::view(twin, look), water, spilt: state.spilt.unwrap_or(0.0) }
    }
}

/// From one picture of a rehearsal to the next, for who looks on, in glimpses: two seconds of its time.
const SHOWN: usize = 10;

/// A rehearsal as it is shown to who looks on.
#[derive(Clone)]
pub struct Shown {
    pub(super) album: Sender<Job>,
    /// The camera it is drawn through, small.
    pub(super) camera: Camera,
    pub(super) number: usize,
    pub(super) of: usize,
    pub(super) name: String,
}

impl Shown {
    /// Tells how it goes, or how it went.
    pub(super) fn tell(&self, view: Option<View>, went: Option<Result<(), String>>) {
        let Self { album, camera, number, of, name } = self;
        let (number, of, name, picture) = (*number, *of, name.clone(), None);
        let told = Tryout { number, of, name, picture, went };
        let drawn = view.map(|view| (*camera, view));
        // A thread that is gone has panicked, which the album passes on.
        let _ = album.send(Job::Tryout(Box::new((drawn, told))));
    }
}

/// Watches a rehearsal and keeps what it looked like.
pub(super) struct Glances {
    twin: SharedTwin,
    look: ArmLook,
    /// Who is shown it, if anybody.
    shown: Option<Shown>,
    /// Whether it is kept for the film.
    is_kept: bool,
    /// Glimpses so far.
    seen: usize,
    /// When the step began, and when the next glance is due, s.
    begin: f64,
    due: f64,
    kept: Vec<Glimpse>,
}

impl Glances {
    pub(super) fn new(
        twin: SharedTwin,
        look: ArmLook,
        shown: Option<Shown>,
        is_kept: bool,
    ) -> Self {
        let (due, kept) = (f64::NEG_INFINITY, Vec::new());
        Self { twin, look, shown, is_kept, seen: 0, begin: 0.0, due, kept }
    }

    /// Begins a step and returns what was kept of the one before.
    pub(super) fn next_step(&mut self, time: f64) -> Vec<Glimpse> {
        (self.begin, self.due) = (time, time);
        std::mem::take(&mut self.kept)
    }
}

impl Observer for Glances {
    fn event(&mut self, event: &Event) {
        let Event::Tick(feedback) = event else { return };
        let is_wanted = self.is_kept || self.shown.is_some();
        if is_wanted && is_due(&mut self.due, OFTEN, feedback) {
            let twin = self.twin.lock().unwrap_or_else(PoisonError::into_inner);
            let glimpse = Glimpse::of(&twin, &self.look, feedback.time - self.begin);
            if self.seen.is_multiple_of(SHOWN)
                && let Some(shown) = &self.shown
            {
                shown.tell(Some(glimpse.view.clone()), None);
            }
            self.seen += 1;
            if self.is_kept {
                self.kept.push(glimpse);
            }
        }
    }
}

/// Whether a picture is due, and when the next will be.
fn is_due(due: &mut f64, every: f64, feedback: &Feedback) -> bool {
    let is_due = feedback.time >= *due - EARLY;
    if is_due {
        *due = due.max(feedback.time - EARLY) + every;
    }
    is_due
}

/// How many moments may wait to be drawn where time does not wait for them: half a second's.
const BEHIND: usize = 2;

/// A step that is filmed.
struct Take {
    step: usize,
    /// When it began, s.
    begin: f64,
    /// The camera as the twin's pictures are drawn through it, small.
    camera: Camera,
    /// How the rehearsal of the step looked.
    glimpses: Vec<Glimpse>,
}

/// Films the steps of a run; one that is handed out twice films once.
#[derive(Clone)]
pub(super) struct Filming(Arc<Mutex<Reel>>);

struct Reel {
    film: Option<Box<dyn Film>>,
    album: Sender<Job>,
    take: Option<Take>,
    due: f64,
    /// From one picture to the next, s.
    every: f64,
    number: usize,
    /// Moments that wait to be drawn, where what is late is left out; elsewhere nothing is counted.
    waiting: Option<Arc<AtomicUsize>>,
}

impl Filming {
    /// Films by `film`, where there is a camera that does, for an album. An arm that takes the time of a real one is
    /// filmed as far as a busy machine keeps up, so that pictures are of now; any other is filmed whole, and seldom unless
    /// it is watched.
    pub(super) fn new(
        film: Option<Box<dyn Film>>,
        album: Sender<Job>,
        (is_real_time, is_watched): (bool, bool),
    ) -> Self {
        let every = if is_real_time || is_watched { OFTEN } else { SELDOM };
        let (due, waiting) = (f64::NEG_INFINITY, is_real_time.then(Arc::default));
        let reel = Reel { film, album, take: None, due, every, number: 0, waiting };
        Self(Arc::new(Mutex::new(reel)))
    }

    /// Films a step from `begin`, s, on, beside the glimpses of its rehearsal.
    pub(super) fn begin(&self, step: usize, begin: f64, camera: &Camera, glimpses: &[Glimpse]) {
        let (camera, _) = camera.resized(WIDTH);
        self.lock().take = Some(Take { step, begin, camera, glimpses: glimpses.to_vec() });
    }

    /// Films no more until the next step begins.
    pub(super) fn end(&self) {
        self.lock().take = None;
    }

    fn lock(&self) -> MutexGuard<'_, Reel> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Filming {
    fn event(&mut self, event: &Event) {
        let Event::Tick(feedback) = event else { return };
        let mut reel = self.lock();
        let Reel { film, album, take: Some(take), due, every, number, waiting } = &mut *reel else {
            return;
        };
        let is_late = waiting.as_ref().is_some_and(|n| n.load(Ordering::SeqCst) >= BEHIND);
        if is_late || !is_due(due, *every, feedback) {
            return;
        }
        if let Some(waiting) = waiting {
            waiting.fetch_add(1, Ordering::SeqCst);
        }
        *number += 1;
        let elapsed = feedback.time - take.begin;
        let seen =
            take.glimpses.partition_point(|glimpse| glimpse.elapsed <= elapsed + OFTEN / 2.0);
        let twin = seen.checked_sub(1).and_then(|at| take.glimpses.get(at));
        let (water, spilt) =
            twin.map_or((Vec::new(), 0.0), |twin| (twin.water.clone(), twin.spilt));
        let moment = Moment {
            number: *number,
            time: feedback.time,
            step: take.step,
            real: film.as_mut().and_then(|film| film.shoot(WIDTH)),
            twin: twin.map(|twin| (take.camera, twin.view.clone())),
            water,
            spilt,
            waiting: waiting.clone(),
        };
        // A thread that is gone has panicked, which the album passes on.
        let _ = album.send(Job::Moment(Box::new(moment)));
    }
}
