//! What encoders and torque sensors in the joints say, and what the joints carry; without noise, which is the laboratory's.

use nalgebra::Vector3;

use super::Twin;
use crate::motion::dynamics::{Bodies, Dynamics};

/// What it takes to carry and accelerate links, gripper and the held object with its water, N·m, base first.
#[derive(Debug, Clone)]
pub(super) struct Load {
    /// With the acceleration of the last step.
    pub(super) now: Vec<f64>,
    /// With the acceleration that the speeds of every other step say.
    every_other: Vec<f64>,
}

impl Twin {
    /// Returns what the joints' encoders say, base first, rad: the angles on the motors' side.
    pub fn encoders(&self) -> Vec<f64> {
        let mut q = self.q();
        let tau = &self.load().now;
        for (i, q) in q.iter_mut().enumerate() {
            *q += self.settings.arm.compliance[i] * tau[i];
        }
        q
    }

    /// Returns what torque sensors in the joints say, base first, N·m: what it takes to carry and
    /// accelerate links, gripper and the held object with its water.
    ///
    /// Positive as the joint turns. Contacts other than the grasp are not in it.
    pub fn torques(&self) -> Vec<f64> {
        self.load().now.clone()
    }

    /// Returns the same as sensors feel it that look at every other step, N·m: with the acceleration that the speeds of
    /// every other step say, brought to now by their second differences.
    ///
    /// A servo that is told where to be every other step pushes harder in one than in the other, in proportion to the
    /// speed; who looks at one step alone takes that for friction. A mean over two would be late by two milliseconds.
    pub fn torques_sensed(&self) -> Vec<f64> {
        self.with_pushes(self.load().every_other.clone())
    }

    /// Returns what ideal torque sensors say, N·m: as [`Self::torques`], and what pushes on the hand or on what it holds.
    /// What touches the arm elsewhere is not felt.
    pub fn torques_felt(&self) -> Vec<f64> {
        self.with_pushes(self.torques())
    }

    /// Returns what it takes to carry and accelerate links, gripper and the held object with its water, N·m, base first, with
    /// the acceleration of [`Self::torques_sensed`]. What pushes on the hand is not in it.
    pub fn torques_carried(&self) -> Vec<f64> {
        self.load().every_other.clone()
    }

    fn with_pushes(&self, mut tau: Vec<f64>) -> Vec<f64> {
        let mut pushes = self.physics.pushes(self.payload(), self.settings.dt);
        pushes.extend(self.pulled);
        if pushes.is_empty() {
            return tau;
        }
        let q = self.q();
        let (Ok(jacobian), Ok(tip)) = (self.robot.jacobian(&q), self.robot.forward(&q)) else {
            return tau;
        };
        let base_from_world = self.scene.world_from_base.inverse();
        for (point, force) in pushes {
            let at = base_from_world.isometry() * nalgebra::Point3::from(point);
            let force = base_from_world.rotation() * force;
            let moment = (at.coords - tip.origin()).cross(&force);
            for (joint, tau) in tau.iter_mut().enumerate() {
                let column = jacobian.column(joint);
                let moves = Vector3::new(column[0], column[1], column[2]);
                let turns = Vector3::new(column[3], column[4], column[5]);
                *tau -= moves.dot(&force) + turns.dot(&moment);
            }
        }
        tau
    }

    /// What the hand carries: of what it holds, not the tray of a drawer, which its case carries.
    fn payload(&self) -> Option<usize> {
        self.held_index()
            .filter(|&held| self.scene.drawer(&self.scene.objects[held].name).is_none())
    }

    /// Returns what the joints carry now: worked out once an instant, since servo, encoders and sensors all ask.
    pub(super) fn load(&self) -> &Load {
        self.load.get_or_init(|| {
            let gravity = self.scene.world_from_base.rotation().inverse() * self.settings.gravity;
            let mut arm = Dynamics::at_opening(&self.robot, Bodies::All, self.opening())
                .with_gravity(gravity);
            if let Some(object) = self.payload()
                && let Some(inertial) = self.physics.object_inertia(object)
                && let Some(pose) = self.physics.object_pose(object)
            {
                let tip_from_object = self.physics.link_pose(self.robot.tip()).inverse() * pose;
                arm = arm.with_payload(inertial.seen_from(&tip_from_object));
            }
            let (q, (dq, ddq)) = (self.q(), &self.motion);
            // Only joints that are nowhere have no torques; the step that brought them there said so.
            let at = |ddq: &[f64]| {
                let tau = arm.inverse(&q, dq, ddq);
                tau.map_or_else(|_| vec![f64::NAN; dq.len()], |tau| tau.as_slice().to_vec())
            };
            let [_, two, _, four] = &self.earlier;
            let span = 4.0 * self.settings.dt;
            let speeds = dq.iter().zip(two).zip(four);
            let sensed = speeds.map(|((now, two), four)| (3.0 * now - 4.0 * two + four) / span);
            Load { now: at(ddq), every_other: at(&sensed.collect::<Vec<f64>>()) }
        })
    }
}
