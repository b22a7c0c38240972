//! Holding something out until somebody pulls at it: the one thing that opens the fingers is a pull that the joints felt.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;

use super::super::error::ActionError;
use super::super::plan::{force_at, gravity_torque};
use super::super::refusal::Refusal;
use super::ActionContext;
use crate::arm::{DeviceError, Feedback};
use crate::motion::Robot;

/// How long the torques are read at rest before, s, as before a touch.
const REST: f64 = 0.5;
/// A pull lasts: readings of which the mean is taken, 0.2 s of 250 a second. A knock is over sooner.
const READINGS: usize = 50;
/// A pull may point towards the palm by this much of its strength, as a cosine: who pushes the thing at the arm does not take it.
const TOWARDS_PALM: f64 = -0.5;

/// What the joints feel of somebody who pulls.
struct Pull {
    robot: Arc<Robot>,
    /// Torques beyond the model's at rest, N·m.
    rest: Vec<f64>,
    /// Where the hand points, in the base.
    ahead: Vector3<f64>,
    /// N.
    threshold: f64,
    recent: VecDeque<Vector3<f64>>,
    felt: bool,
}

impl Pull {
    fn sees(&mut self, feedback: &Feedback) -> bool {
        let model = gravity_torque(&self.robot, &feedback.q);
        let excess: Vec<f64> = (feedback.tau.iter().zip(&model))
            .zip(&self.rest)
            .map(|((tau, model), rest)| tau - model - rest)
            .collect();
        // What it takes to hold still is against what pulls.
        let pulls = force_at(&self.robot, &feedback.q, &excess).map(|holds| -holds);
        self.recent.push_back(pulls.unwrap_or_default());
        if self.recent.len() > READINGS {
            self.recent.pop_front();
        }
        let mean = self.recent.iter().sum::<Vector3<f64>>() / self.recent.len() as f64;
        let is_strong = self.recent.len() == READINGS && mean.norm() >= self.threshold;
        self.felt |= is_strong && mean.dot(&self.ahead) >= TOWARDS_PALM * mean.norm();
        self.felt
    }
}

impl ActionContext {
    /// `arm.offer(o, force, seconds)`: holds `o` out still until somebody pulls at it with `force` N for a fifth of a
    /// second; returns how long that took, s.
    ///
    /// # Errors
    ///
    /// [`Refusal::NobodyPulled`] when nobody does within `seconds`: the fingers hold it as before.
    pub fn offer(&mut self, o: &str, force: f64, seconds: f64) -> Result<f64, ActionError> {
        if self.body.state()?.held.as_deref() != Some(o) {
            return Err(Refusal::NotHeld(o.to_owned()).into());
        }
        let (_, rest) = self.torque_excess(REST)?;
        self.run.rest = Some(rest.clone());
        let robot = self.setting.cell.robot.clone();
        self.found()?;
        let ahead = self.in_base(&self.setting.cell.tool_pose(&self.run.q).axis(2));
        let mut pull =
            Pull { robot, rest, ahead, threshold: force, recent: VecDeque::new(), felt: false };
        let begin = self.body.arm().feedback()?.time;
        self.body.arm().offers(true);
        let done = self.act(seconds, |arm, stop, watch| {
            let felt = stop.child();
            let done = arm.wait(seconds, &felt, &mut |feedback| {
                watch(feedback);
                if pull.sees(feedback) {
                    felt.cancel();
                }
            });
            match done {
                Err(DeviceError::Stopped) if !stop.is_cancelled() => Ok(()),
                done => done,
            }
        });
        self.body.arm().offers(false);
        self.find_arm()?;
        done?;
        if !pull.felt {
            return Err(Refusal::NobodyPulled { object: o.to_owned(), seconds }.into());
        }
        Ok(self.body.arm().feedback()?.time - begin)
    }
}
