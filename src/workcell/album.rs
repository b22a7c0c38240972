//! The pictures of a run, drawn and encoded beside it: the arm does not wait for them.
//!
//! A few that wait are drawn and coded side by side, since coding one takes one processor; the run's observers are told of
//! each in the order in which they were asked for. What a picture shows is fixed when it is asked for; here it is only
//! drawn. Where pictures are kept is the recorder's to know.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use image::RgbImage;
use rayon::prelude::*;

use crate::arm::{Shot, SmallShot};
use crate::trace::{Event, Still, Tryout, small_jpeg};
use crate::twin::render::View;
use crate::world::Camera;

use super::picture;
use super::roles::{Fan, tell};

/// How many pictures are drawn side by side at most, each of up to 30 MB while it is drawn. Chosen: twice the processors of a
/// small machine, so that one that takes long keeps none waiting.
const AT_ONCE: usize = 4;

/// What is to be done.
pub(super) enum Job {
    /// Draw a picture and tell of it.
    Draw { name: String, shot: Shot, drawn: Sender<RgbImage> },
    /// Tell of an earlier picture by another name too; where it is the newest of its kind, it is kept by that one.
    Again { name: String, of: String, is_newest: bool },
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

    /// Asks for the newest picture of the camera or of the twin under another name.
    pub(super) fn again(&self, name: String, of: String) {
        self.send(Job::Again { name, of, is_newest: false });
    }

    /// The same for a picture that takes its place: nothing has changed.
    pub(super) fn same(&self, name: String, of: String) {
        self.send(Job::Again { name, of, is_newest: true });
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

/// A job as far as it needs nobody else: drawn and coded.
enum Done {
    Drawn { name: String, image: RgbImage, event: Event, drawn: Sender<RgbImage> },
    Again { name: String, of: String, is_newest: bool },
    Told(Event),
    End,
}

impl Job {
    fn done(self) -> Done {
        match self {
            Self::Draw { name, shot, drawn } => {
                let image = shot();
                let event = Event::picture(name.as_str(), &image);
                Done::Drawn { name, image, event, drawn }
            }
            Self::Again { name, of, is_newest } => Done::Again { name, of, is_newest },
            Self::Moment(moment) => Done::Told(Event::Still(Arc::new(moment.drawn()))),
            Self::Tryout(shown) => {
                let (drawn, told) = *shown;
                let picture = drawn.map(|(camera, view)| small(&camera, &view));
                Done::Told(Event::Tryout(Arc::new(Tryout { picture, ..told })))
            }
            Self::End => Done::End,
        }
    }
}

fn small(camera: &Camera, view: &View) -> Vec<u8> {
    small_jpeg(&picture::draw_small(camera, view))
}

/// Returns whose picture it is: the camera's or the twin's.
fn whose(name: &str) -> Option<&str> {
    name.rsplit('-').next()
}

/// The pictures that may be asked for again: the newest of the camera and of the twin.
#[derive(Default)]
struct Known {
    newest: Newest,
    /// The same as files, each with its names.
    files: Vec<(Vec<String>, Arc<[u8]>)>,
}

impl Known {
    /// Tells of what was done; returns whether there is more to do.
    fn tell(&mut self, done: Done, fan: &Mutex<Fan>) -> bool {
        match done {
            Done::Drawn { name, image, event, drawn } => {
                self.newest.retain(|(other, _)| whose(other) != whose(&name));
                self.files.retain(|(names, _)| whose(&names[0]) != whose(&name));
                self.newest.push((name, image.clone()));
                tell(fan, &event);
                if let Event::Picture { name, jpeg } = event {
                    self.files.push((vec![name], jpeg));
                }
                // Few wait for it.
                let _ = drawn.send(image);
            }
            Done::Again { name, of, is_newest } => {
                let found = self.files.iter_mut().find(|(names, _)| names.contains(&of));
                let Some((names, jpeg)) = found else { return true };
                names.push(name.clone());
                tell(fan, &Event::Picture { name: name.clone(), jpeg: jpeg.clone() });
                let newest = self.newest.iter_mut().find(|(other, _)| whose(other) == whose(&name));
                if let Some((newest, _)) = newest.filter(|_| is_newest) {
                    *newest = name;
                }
            }
            Done::Told(event) => tell(fan, &event),
            Done::End => return false,
        }
        true
    }
}

fn work(todo: &Receiver<Job>, fan: &Mutex<Fan>) -> Newest {
    let mut known = Known::default();
    while let Ok(first) = todo.recv() {
        let few: Vec<Job> =
            std::iter::once(first).chain(todo.try_iter().take(AT_ONCE - 1)).collect();
        let few: Vec<Done> = few.into_par_iter().map(Job::done).collect();
        if !few.into_iter().all(|done| known.tell(done, fan)) {
            break;
        }
    }
    known.newest
}
