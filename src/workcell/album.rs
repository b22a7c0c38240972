//! The pictures of a run, drawn and encoded beside it: the arm does not wait for them.
//!
//! One thread draws them in the order they were asked for and tells the run's observers of each. What a picture
//! shows is fixed when it is asked for; here it is only drawn. Where pictures are kept is the recorder's to know.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use image::RgbImage;

use crate::arm::{Shot, SmallShot};
use crate::trace::{Event, Still, Tryout, small_jpeg};
use crate::twin::render::View;
use crate::world::Camera;

use super::picture;
use super::roles::{Fan, tell};

/// How many pictures back one may be asked for again: real and twin of the step before.
const BACK: usize = 2;

/// What is to be done.
pub(super) enum Job {
    /// Draw a picture and tell of it.
    Draw { name: String, shot: Shot, drawn: Sender<RgbImage> },
    /// Tell of an earlier picture by another name.
    Again { name: String, of: String },
    /// Draw a moment of the film and tell of it.
    Moment(Box<Moment>),
    /// Draw how a rehearsal goes and tell of it.
    Tryout(Box<(Option<(Camera, View)>, Tryout)>),
    /// There is no more.
    End,
}

/// A moment of the film that is not drawn yet: as [`Still`], with what its pictures are drawn of.
pub(super) struct Moment {
    pub(super) number: usize,
    pub(super) time: f64,
    pub(super) step: usize,
    pub(super) real: Option<SmallShot>,
    pub(super) twin: Option<(Camera, View)>,
    pub(super) water: Vec<(String, f64)>,
    pub(super) spilt: f64,
    /// Counts those that wait, where somebody asks.
    pub(super) waiting: Option<Arc<AtomicUsize>>,
}

impl Moment {
    fn drawn(self) -> Still {
        let Self { number, time, step, real, twin, water, spilt, waiting } = self;
        let real = real.and_then(|shot| shot()).map(|image| small_jpeg(&image));
        let twin = twin.map(|(camera, view)| small(&camera, &view));
        if let Some(waiting) = waiting {
            waiting.fetch_sub(1, Ordering::SeqCst);
        }
        Still { number, time, step, real, twin, water, spilt }
    }
}

/// A picture that is being drawn.
pub(super) struct Pending(Receiver<RgbImage>);

impl Pending {
    /// Waits until it is drawn and told of; `None` when it never will be.
    pub(super) fn wait(self) -> Option<RgbImage> {
        self.0.recv().ok()
    }
}

/// The last picture of the camera and of the twin, by name, as they were drawn.
pub(super) type Newest = Vec<(String, RgbImage)>;

/// The pictures of one run.
pub(super) struct Album {
    jobs: Sender<Job>,
    worker: Option<JoinHandle<Newest>>,
}

impl Album {
    /// Begins an album whose pictures `fan` is told of.
    pub(super) fn new(fan: Arc<Mutex<Fan>>) -> Self {
        let (jobs, todo) = channel();
        let worker = std::thread::spawn(move || work(&todo, &fan));
        Self { jobs, worker: Some(worker) }
    }

    /// Asks for a picture under a name without ending.
    pub(super) fn add(&self, name: String, shot: Shot) -> Pending {
        let (drawn, pending) = channel();
        self.send(Job::Draw { name, shot, drawn });
        Pending(pending)
    }

    /// Asks for one of the last pictures under another name.
    pub(super) fn again(&self, name: String, of: String) {
        self.send(Job::Again { name, of });
    }

    /// Returns where moments of the film are sent to.
    pub(super) fn jobs(&self) -> Sender<Job> {
        self.jobs.clone()
    }

    /// A thread that is gone has panicked, which [`Self::finish`] passes on.
    fn send(&self, job: Job) {
        let _ = self.jobs.send(job);
    }

    /// Waits until all pictures are drawn and told of; returns the last ones.
    pub(super) fn finish(mut self) -> Newest {
        self.send(Job::End);
        let ended = self.worker.take().map(JoinHandle::join);
        ended.map_or_else(Vec::new, |newest| newest.unwrap_or_else(|panic| resume_unwind(panic)))
    }
}

impl Drop for Album {
    fn drop(&mut self) {
        self.send(Job::End);
        if let Some(worker) = self.worker.take() {
            // A run that ends early has its own reason to tell.
            let _ = worker.join();
        }
    }
}

fn small(camera: &Camera, view: &View) -> Vec<u8> {
    small_jpeg(&picture::draw_small(camera, view))
}

fn work(todo: &Receiver<Job>, fan: &Mutex<Fan>) -> Newest {
    let whose = |name: &str| name.rsplit('-').next().map(str::to_owned);
    let mut newest = Newest::new();
    let mut last: Vec<(String, Arc<[u8]>)> = Vec::new();
    while let Ok(job) = todo.recv() {
        match job {
            Job::Draw { name, shot, drawn } => {
                let image = shot();
                newest.retain(|(other, _)| whose(other) != whose(&name));
                newest.push((name.clone(), image.clone()));
                let event = Event::picture(name, &image);
                tell(fan, &event);
                if let Event::Picture { name, jpeg } = event {
                    last.truncate(BACK - 1);
                    last.insert(0, (name, jpeg));
                }
                // Few wait for it.
                let _ = drawn.send(image);
            }
            Job::Again { name, of } => {
                if let Some((_, jpeg)) = last.iter().find(|(name, _)| *name == of) {
                    tell(fan, &Event::Picture { name, jpeg: jpeg.clone() });
                }
            }
            Job::Moment(moment) => tell(fan, &Event::Still(Arc::new(moment.drawn()))),
            Job::Tryout(shown) => {
                let (drawn, told) = *shown;
                let picture = drawn.map(|(camera, view)| small(&camera, &view));
                tell(fan, &Event::Tryout(Arc::new(Tryout { picture, ..told })));
            }
            Job::End => break,
        }
    }
    newest
}
