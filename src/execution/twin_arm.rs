//! `Arm` over the twin, and the twin as a body whose whole state is known, but for where what somebody took is.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::twin::Twin;
use crate::world::WorldState;

use super::body::Body;
use super::body::Sight;
use super::wording;
use crate::arm::ticked::{Brake, Plant, Ticked};
use crate::arm::{Arm, DeviceError, Feedback, Grip};

/// A twin that several handles share: its arm, and those who ask for its state.
pub type SharedTwin = Arc<Mutex<Twin>>;

/// The arm of a twin.
pub type TwinArm = Ticked<TwinPlant>;

/// A twin as something that is stepped.
pub struct TwinPlant(SharedTwin);

fn lock(twin: &SharedTwin) -> MutexGuard<'_, Twin> {
    twin.lock().unwrap_or_else(PoisonError::into_inner)
}

fn broken(error: impl std::fmt::Display) -> DeviceError {
    DeviceError::Unavailable(wording::twin_failed(error))
}

impl Plant for TwinPlant {
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError> {
        lock(&self.0).command(q, dq).map_err(broken)
    }

    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError> {
        lock(&self.0).grip(opening, speed, force).map_err(broken)
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        lock(&self.0).run(seconds).map_err(broken)
    }

    fn offers(&mut self, on: bool) {
        lock(&self.0).offer(on);
    }

    fn report(&mut self) -> Feedback {
        let twin = lock(&self.0);
        Feedback {
            time: twin.time(),
            q_cmd: Vec::new(),
            q: twin.q(),
            dq: twin.dq(),
            tau: twin.torques_felt(),
            opening: twin.opening(),
            mass: None,
            moving: Vec::new(),
        }
    }
}

/// The twin as a body: nothing is hidden but what has been given away, nothing needs correcting.
pub struct TwinBody {
    arm: TwinArm,
    twin: SharedTwin,
    /// What somebody took, and no look has shown since.
    given: BTreeSet<String>,
}

impl TwinBody {
    /// Takes a twin in a context.
    pub fn new(twin: SharedTwin) -> Self {
        let brakes = Brake::of(lock(&twin).robot());
        Self { arm: Ticked::new(TwinPlant(twin.clone()), brakes), twin, given: BTreeSet::new() }
    }
}

/// What is known in the twin is known at any time.
struct TwinSight {
    twin: SharedTwin,
    given: BTreeSet<String>,
}

impl Sight for TwinSight {
    fn state(&mut self, _feedback: &Feedback) -> WorldState {
        known(&self.twin, &self.given)
    }

    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        Some(touch(&self.twin, a, b))
    }
}

/// Returns the world of the twin, without the places of what was given away: as on an arm, nobody knows them.
fn known(twin: &SharedTwin, given: &BTreeSet<String>) -> WorldState {
    let mut state = lock(twin).state();
    let held = state.held.clone();
    let is_away = |name: &String| given.contains(name) && held.as_ref() != Some(name);
    for object in state.objects.iter_mut().filter(|object| is_away(&object.name)) {
        object.world_from_object = None;
        object.std = f64::INFINITY;
    }
    state
}

/// Returns whether two things touch; the gripper touches what any of its jaws touches.
fn touch(twin: &SharedTwin, a: &str, b: &str) -> bool {
    let twin = lock(twin);
    let jaws: Vec<String> = twin.robot().jaw_links().map(str::to_owned).collect();
    let parts = |name: &str| match name {
        "gripper" => jaws.clone(),
        other => vec![other.to_owned()],
    };
    parts(a).iter().any(|a| parts(b).iter().any(|b| twin.contacts(a, b)))
}

impl Body for TwinBody {
    fn arm(&mut self) -> &mut dyn Arm {
        &mut self.arm
    }

    fn sight(&self) -> Box<dyn Sight> {
        Box::new(TwinSight { twin: self.twin.clone(), given: self.given.clone() })
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        Ok(known(&self.twin, &self.given))
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        // What stands on something is seen again.
        let scene = lock(&self.twin).scene().clone();
        let twin = &self.twin;
        self.given.retain(|name| {
            let others = scene.objects.iter().map(|other| other.name.as_str());
            let mut below = others.filter(|other| *other != name.as_str()).chain(["table"]);
            !below.any(|other| touch(twin, name, other))
        });
        Ok(())
    }

    fn gripped(&mut self, _grip: Grip, aim: Option<&str>) -> Result<(), DeviceError> {
        if let Some(aim) = aim {
            self.given.remove(aim);
        }
        Ok(())
    }

    fn given(&mut self, o: &str) {
        self.given.insert(o.to_owned());
    }

    fn weighed(&mut self, _mass: f64) {}

    fn drips(&mut self, o: &str) -> bool {
        lock(&self.twin).clinging(o) > 0.0
    }

    fn contact(&mut self, a: &str, b: &str) -> Option<bool> {
        Some(touch(&self.twin, a, b))
    }
}
