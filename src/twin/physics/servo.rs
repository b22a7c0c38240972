//! The servos of arm and jaws as the engine takes them.
//!
//! A servo is a spring and a damper between a joint and where it should be, with a largest torque. The engine has two forms
//! of it: a motor, one more constraint that is gone through in turn with all others and ends at the largest torque, and a
//! spring in the mass matrix, which is solved for with all joints at once and has no end. A joint of the arm has the second
//! while it needs less torque than there is: friction and contacts are then solved against what an arm that is held gives
//! way by, in one part of a step as well as in many. Else it has the first, as jaws do, which press with all they may.
//!
//! Either pulls through a whole part of a step with what its spring says at the end of it. A servo that follows a motion would
//! lag by half a part, and go another way in few parts than in many; so its target is moved ahead by as much.

use super::{Joint, Physics};
use crate::twin::Settings;

/// How a joint is driven in this step.
struct Servo {
    joint: Joint,
    kp: f64,
    kd: f64,
    /// Whether it needs less torque than it has.
    is_spring: bool,
    /// Speed of the joint now, rad/s.
    speed: f64,
}

impl Physics {
    /// Sets position (rad) and speed (rad/s) the arm's servos aim at.
    pub fn aim_arm(&mut self, q: &[f64], dq: &[f64], settings: &Settings) {
        let arm = &settings.arm;
        let servo = |(i, joint): (usize, &Joint)| {
            let (kp, kd) = (arm.kp[i], arm.kd[i]);
            let (now, speed) = (self.coordinate(joint), self.speed(joint));
            let needs = kp * (q[i] - now) + kd * (dq[i] - speed);
            // Without stiffness a spring has no rest that would carry the speed to aim at.
            let is_spring = kp > 0.0 && needs.abs() < joint.effort;
            Servo { joint: *joint, kp, kd, is_spring, speed }
        };
        let servos: Vec<Servo> = self.arm.iter().enumerate().map(servo).collect();
        let half = 0.5 * settings.dt / settings.solver_iterations as f64;
        for (i, servo) in servos.iter().enumerate() {
            let &Servo { ref joint, kp, kd, is_spring, speed } = servo;
            let ahead = half * speed;
            let axis = joint.axis;
            let (multibody, link) =
                self.multibody_joints.get_mut(joint.handle).expect("never removed");
            let Some(link) = multibody.link_mut(link) else { continue };
            if is_spring {
                link.joint.data.motor_axes.remove(axis.into());
                link.joint.set_spring(axis as usize, kp, q[i] + ahead + kd / kp * dq[i]);
            } else {
                // The engine's motor aims at where its target will be at the end of the part.
                let target = q[i] + ahead - 2.0 * half * dq[i];
                link.joint.data.set_motor(axis, target, dq[i], kp, kd);
                link.joint.set_spring(axis as usize, 0.0, 0.0);
            }
            let dof = link.assembly_id();
            multibody.damping_mut()[dof] = arm.viscous[i] + if is_spring { kd } else { 0.0 };
        }
    }

    /// Sets where each jaw should be (m from the middle), how fast it goes there (m/s), and with how
    /// much force at most (N).
    pub fn aim_jaws(&mut self, position: f64, speed: f64, force: f64, settings: &Settings) {
        let (kp, kd) = (settings.gripper.kp, settings.gripper.kd);
        for joint in &self.jaws {
            let (multibody, link) =
                self.multibody_joints.get_mut(joint.handle).expect("never removed");
            if let Some(link) = multibody.link_mut(link) {
                link.joint.data.set_motor(joint.axis, position, speed, kp, kd);
                link.joint.data.set_motor_max_force(joint.axis, force);
            }
        }
    }
}
