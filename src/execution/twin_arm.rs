//! `Arm` over the twin, and the twin as a body whose whole state is known.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::twin::Twin;
use crate::world::WorldState;

use super::body::Body;
use super::body::Sight;
use super::wording;
use crate::arm::ticked::{Plant, Ticked};
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

/// The twin as a body: nothing is hidden, nothing needs correcting.
pub struct TwinBody {
    arm: TwinArm,
    twin: SharedTwin,
}

impl TwinBody {
    /// Takes a twin in a context.
    pub fn new(twin: SharedTwin) -> Self {
        Self { arm: Ticked::new(TwinPlant(twin.clone())), twin }
    }
}

/// Everything is known in the twin, at any time.
struct TwinSight(SharedTwin);

impl Sight for TwinSight {
    fn state(&mut self, _feedback: &Feedback) -> WorldState {
        lock(&self.0).state()
    }

    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        Some(touch(&self.0, a, b))
    }
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
        Box::new(TwinSight(self.twin.clone()))
    }

    fn state(&mut self) -> Result<WorldState, DeviceError> {
        Ok(lock(&self.twin).state())
    }

    fn look(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn gripped(&mut self, _grip: Grip, _aim: Option<&str>) -> Result<(), DeviceError> {
        Ok(())
    }

    fn weighed(&mut self, _mass: f64) {}

    fn drips(&mut self, o: &str) -> bool {
        lock(&self.twin).clinging(o) > 0.0
    }

    fn contact(&mut self, a: &str, b: &str) -> Option<bool> {
        Some(touch(&self.twin, a, b))
    }
}
