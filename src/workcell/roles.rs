//! What a [`WorkCell`](super::WorkCell) is made of, by role: what it was opened with, what its twin is built of, what it
//! has learnt, who watches and answers, and what people may do to it at any time.

use std::sync::{Arc, Mutex, PoisonError};

use crate::arm::Cancel;
use crate::execution::calibrate::Switches;
use crate::execution::cell::Cell;
use crate::execution::conduct::Dial;
use crate::language::Library;
use crate::trace::{Event, Observer};
use crate::twin::Settings;
use crate::twin::render::ArmLook;
use crate::vqa::Endpoint;

use super::fork::Moments;
use super::known::Known;
use super::leader::SharedLead;
use super::{Learnt, Setting, Stdlib};

/// What the cell was opened with.
#[derive(Clone)]
pub(super) struct Setup {
    pub(super) library: Library,
    pub(super) stdlib: Stdlib,
    /// Where scene and robot were found.
    pub(super) setting: Setting,
    /// `lab`, `twin`, or where the arm is.
    pub(super) robot_name: String,
    /// What the twin's chance comes from.
    pub(super) seed: u64,
    pub(super) switches: Switches,
    /// How many candidates are rehearsed for one attempt.
    pub(super) candidates: usize,
    /// Whether the arm takes the time of a real one.
    pub(super) is_real_time: bool,
    /// Seconds since some instant.
    pub(super) clock: fn() -> f64,
}

/// What the twin is built of.
pub(super) struct Model {
    /// Arm, scene and limits, as the regressions in force found them.
    pub(super) cell: Cell,
    pub(super) look: ArmLook,
    pub(super) settings: Settings,
    /// The effects that were named before.
    pub(super) known: Known,
}

impl Model {
    /// Takes the cell as the regressions found it: the twin is built of the same arm that is sent.
    pub(super) fn adapt(&mut self, cell: Cell) {
        self.look = ArmLook::new(&cell.robot);
        self.cell = cell;
    }
}

/// What the cell has learnt since it was opened, and from earlier runs.
#[derive(Default)]
pub(super) struct Experience {
    pub(super) is_camera_aligned: bool,
    /// Whether things were looked for through the camera as it is aligned: a look may have been stopped.
    pub(super) has_looked: bool,
    pub(super) is_robot_aligned: bool,
    pub(super) learnt: Learnt,
    /// What actions remembered after each step of the last run.
    pub(super) moments: Moments,
}

/// Who watches, decides and answers.
#[derive(Default)]
pub(super) struct Audience {
    pub(super) fan: Arc<Mutex<Fan>>,
    pub(super) lead: Option<SharedLead>,
    pub(super) answerer: Option<Endpoint>,
    /// Whether who watches is shown how rehearsals go.
    pub(super) sees_rehearsals: bool,
}

impl Audience {
    pub(super) fn tell(&self, event: &Event) {
        tell(&self.fan, event);
    }

    pub(super) fn phase(&self, name: &str, detail: &str) {
        self.tell(&Event::Phase { name: name.into(), detail: detail.into() });
    }

    pub(super) fn note(&self, text: &str) {
        self.tell(&Event::note(text));
    }

    pub(super) fn detail(&self, text: &str) {
        self.tell(&Event::detail(text));
    }

    /// Lets someone else watch as well.
    pub(super) fn add(&self, observer: Box<dyn Observer + Send>) {
        self.fan.lock().unwrap_or_else(PoisonError::into_inner).0.push(observer);
    }

    /// Lets someone watch from now on, in place of all who watched before.
    pub(super) fn is(&self, observers: Vec<Box<dyn Observer + Send>>) {
        *self.fan.lock().unwrap_or_else(PoisonError::into_inner) = Fan(observers);
    }
}

/// What people may do at any time, from any thread.
#[derive(Clone, Default)]
pub(super) struct Controls {
    /// The wish to stop.
    pub(super) cancel: Cancel,
    /// How much of the planned speed the arm uses.
    pub(super) dial: Dial,
}

/// Several observers as one.
#[derive(Default)]
pub struct Fan(pub Vec<Box<dyn Observer + Send>>);

impl Observer for Fan {
    fn event(&mut self, event: &Event) {
        for observer in &mut self.0 {
            observer.event(event);
        }
    }
}

/// Tells a shared observer.
pub(super) fn tell(fan: &Mutex<Fan>, event: &Event) {
    fan.lock().unwrap_or_else(PoisonError::into_inner).event(event);
}
