//! An arm that goes exactly where it is sent, on an empty table: for working on the protocol alone.
//!
//! No friction, no delay, no noise. The fingers may be told to meet something of a given width.

use crate::arm::ticked::Plant;
use crate::arm::{DeviceError, Feedback};

/// Widest opening of the Robotiq 2F-85, m.
const WIDEST: f64 = 0.085;

/// An arm that is always where it was last sent.
#[derive(Debug, Clone)]
pub struct Ideal {
    time: f64,
    q: Vec<f64>,
    dq: Vec<f64>,
    opening: f64,
    goal: f64,
    speed: f64,
    /// Width of what is between the fingers, m.
    object: f64,
}

impl Ideal {
    /// Returns an arm that rests at `q`, rad, with its fingers open.
    pub fn new(q: &[f64]) -> Self {
        Self {
            time: 0.0,
            q: q.to_vec(),
            dq: vec![0.0; q.len()],
            opening: WIDEST,
            goal: WIDEST,
            speed: 0.0,
            object: 0.0,
        }
    }

    /// Puts something of this width, m, between the fingers.
    #[must_use]
    pub fn with_object(mut self, width: f64) -> Self {
        self.object = width;
        self
    }
}

impl Plant for Ideal {
    fn command(&mut self, q: &[f64], dq: &[f64]) -> Result<(), DeviceError> {
        self.q = q.to_vec();
        self.dq = dq.to_vec();
        Ok(())
    }

    fn aim(&mut self, opening: f64, speed: f64, _force: f64) -> Result<(), DeviceError> {
        (self.goal, self.speed) = (opening.clamp(0.0, WIDEST), speed.abs());
        Ok(())
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        self.time += seconds;
        let way = self.speed * seconds;
        let next = self.opening + (self.goal - self.opening).clamp(-way, way);
        self.opening = if next < self.opening { next.max(self.object) } else { next };
        Ok(())
    }

    fn is_ideal(&self) -> bool {
        true
    }

    fn report(&mut self) -> Feedback {
        Feedback {
            time: self.time,
            q_cmd: Vec::new(),
            q: self.q.clone(),
            dq: self.dq.clone(),
            tau: vec![0.0; self.q.len()],
            opening: self.opening,
            mass: None,
            moving: Vec::new(),
        }
    }
}
