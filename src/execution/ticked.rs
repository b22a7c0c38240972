//! One arm over anything that is stepped through time: the twin and the lab.
//!
//! A [`Plant`] takes joint targets and is advanced tick by tick; [`Ticked`] makes an [`Arm`] of it, so that
//! following, gripping, waiting and stopping are written once.

use super::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use super::limits::Cleared;

/// Something with an arm that is stepped through time.
pub trait Plant: Send {
    /// Sends joint positions, rad, and speeds, rad/s.
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError>;

    /// Sends the fingers to `opening` m at `speed` m/s with at most `force` N.
    fn aim(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), DeviceError>;

    /// Lets `seconds` pass.
    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError>;

    /// Returns what the arm reports; `q_cmd` is filled in by [`Ticked`].
    fn report(&mut self) -> Feedback;
}

/// Control period, s.
const PERIOD: f64 = 0.004;
/// After the last command of a motion the arm is given this long to get there, s.
const SETTLE: f64 = 0.2;
/// Fingers that move less than this in a tenth of a second are at rest, m: above the encoder's noise.
const STILL: f64 = 3e-4;

/// The arm of a plant.
pub struct Ticked<P> {
    plant: P,
    q_cmd: Vec<f64>,
}

impl<P: Plant> Ticked<P> {
    /// Takes hold of the arm where it stands.
    pub fn new(mut plant: P) -> Self {
        let q_cmd = plant.report().q;
        Self { plant, q_cmd }
    }

    fn run(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
        mut command: impl FnMut(f64) -> Option<(Vec<f64>, Vec<f64>)>,
    ) -> Result<(), DeviceError> {
        let ticks = (seconds / PERIOD).ceil() as usize;
        for tick in 0..ticks {
            if cancel.is_cancelled() {
                self.stop();
                return Err(DeviceError::Stopped);
            }
            if let Some((q, dq)) = command(tick as f64 * PERIOD) {
                self.plant.command(&q, &dq)?;
                self.q_cmd = q;
            }
            self.plant.advance(PERIOD)?;
            watch(&self.feedback()?);
        }
        Ok(())
    }
}

impl<P: Plant> Arm for Ticked<P> {
    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        Ok(Feedback { q_cmd: self.q_cmd.clone(), ..self.plant.report() })
    }

    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let trajectory = trajectory.trajectory();
        let duration = trajectory.duration();
        self.run(duration + SETTLE, cancel, watch, |t| {
            let at = trajectory.sample(t.min(duration));
            Some((at.q, at.dq))
        })
    }

    fn grip(
        &mut self,
        opening: f64,
        speed: f64,
        force: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        self.plant.aim(opening, speed, force)?;
        let mut last = self.plant.report().opening;
        let mut still = 0;
        // At most five seconds: the slowest fingers need two.
        for _ in 0..50 {
            self.run(0.1, cancel, watch, |_| None)?;
            let now = self.plant.report().opening;
            still = if (now - last).abs() < STILL { still + 1 } else { 0 };
            last = now;
            if still >= 3 {
                break;
            }
        }
        Ok(Grip { opening: last, stalled: (last - opening).abs() > 3e-3 })
    }

    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.run(seconds, cancel, watch, |_| None)
    }

    fn stop(&mut self) {
        let q = self.plant.report().q;
        // A plant that refuses its own position is broken; there is nothing left to stop it with.
        let _ = self.plant.command(&q, &vec![0.0; q.len()]);
        self.q_cmd = q;
    }
}
