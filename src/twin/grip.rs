//! Where the jaws are going, and how they begin to. What they touch and hold is `physics`.

use super::{Error, GripperSettings, Twin};

/// Where the jaws are going.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grip {
    /// Where each jaw is aimed now, m from the middle.
    pub(super) aim: f64,
    /// Where each jaw should come to, m from the middle.
    pub(super) goal: f64,
    /// How fast each jaw goes there, m/s.
    pub(super) speed: f64,
    /// Largest force of each jaw, N.
    pub(super) force: f64,
}

impl Grip {
    /// Moves the aim by a step of `dt` s; returns how fast it went, m/s outwards.
    pub(super) fn step(&mut self, dt: f64) -> f64 {
        let left = self.goal - self.aim;
        let stride = if self.speed > 0.0 { self.speed * dt } else { f64::INFINITY };
        let move_by = left.clamp(-stride, stride);
        self.aim += move_by;
        if stride.is_finite() { move_by / dt } else { 0.0 }
    }

    /// Returns where a jaw that is `here` (m) is aimed when it is told to go on at a speed (m/s, outwards): where it was, but
    /// no farther than where spring and damper together press with all they may.
    ///
    /// Aimed at where it is, it would let go of what it presses on within one step: contacts that are gone through one after
    /// the other do not follow that, and what was held is thrown aside by what it was pressed together.
    fn unwound(&self, here: f64, speed: f64, servo: &GripperSettings) -> f64 {
        if servo.kp <= 0.0 {
            return here;
        }
        let [inmost, outmost] =
            [-self.force, self.force].map(|force| here + (force - servo.kd * speed) / servo.kp);
        self.aim.max(inmost).min(outmost)
    }
}

impl Twin {
    /// Sends the jaws to an opening (m between the pads) at a speed of the opening (m/s), each pressing
    /// with at most `force` N on what is in the way.
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`]; the order before stays in force then.
    pub fn grip(&mut self, opening: f64, speed: f64, force: f64) -> Result<(), Error> {
        if ![opening, speed, force].iter().all(|value| value.is_finite()) {
            return Err(Error::NotFinite { what: "grip".into(), time: self.time() });
        }
        let here = self.physics.jaws()[0];
        let goal = opening.clamp(0.0, self.robot.max_opening()) / 2.0;
        let speed = speed.abs() / 2.0;
        let aim = self.grip.unwound(here, speed.copysign(goal - here), &self.settings.gripper);
        self.grip = Grip { aim, goal, speed, force: force.abs() };
        Ok(())
    }
}
