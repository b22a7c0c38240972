//! The servos of arm and jaws as the engine takes them, and in how many parts it takes a step.
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

/// Parts of a step, in each of which the engine works out mass matrix and constraints anew.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts {
    /// While something touches the arm.
    pub(super) touched: usize,
    /// While it moves alone.
    pub(super) alone: usize,
}

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
        // Motors are gone through one after the other, as contacts are.
        let is_alone = !self.touched && servos.iter().all(|servo| servo.is_spring);
        let parts = self.divide(is_alone);
        let half = 0.5 * settings.dt / parts as f64;
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

    /// Chooses in how many parts the next step is taken, and returns it.
    pub(super) fn divide(&mut self, is_alone: bool) -> usize {
        let parts = if is_alone { self.parts.alone } else { self.parts.touched };
        self.parameters.num_solver_iterations = parts;
        parts
    }

    /// Returns whether the engine solved or foresaw a contact of what the arm moves in the last step, with whatever it is:
    /// what else there is and whether it sleeps makes no difference to an arm that nothing touches.
    pub(super) fn is_touched(&self) -> bool {
        let moved = self.links.iter().skip(1);
        let mut colliders = moved.flat_map(|link| self.bodies[*link].colliders());
        colliders.any(|&collider| {
            let mut pairs = self.narrow_phase.contact_pairs_with(collider);
            pairs.any(|pair| {
                let mut manifolds = pair.solver_manifolds().iter();
                manifolds.any(|manifold| !manifold.data.solver_contacts.is_empty())
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::tests::around;
    use super::super::{Physics, to_engine};
    use crate::motion::Robot;
    use crate::twin::Settings;
    use crate::world::{ObjectState, Pose, Shape, object, scene};

    /// Sleep would make a motion another one when it begins later.
    #[test]
    fn only_what_touches_the_arm_makes_its_steps_finer() {
        let robot = Robot::gen3();
        let thing = object::vessel(Shape::Cylinder { radius: 0.03, height: 0.1 }, 1e-4);
        let (name, stands) = (thing.name.clone(), Some(Pose::upright(0.6, 0.0, 1e-4, 0.0)));
        let objects = vec![ObjectState { name, world_from_object: stands, std: 0.0, water: None }];
        let (state, settings) = (around(&robot, objects), Settings::for_arm(&robot));
        let mut world = Physics::new(&robot, &scene::bare(vec![thing]), &state, &settings).unwrap();
        let thing = world.objects[0].unwrap();
        let hand = world.body_pose(*world.tree.hand.last().unwrap()).translation.vector;
        let mut parts = |at: Option<Vector3<f64>>| {
            if let Some(at) = at {
                world.bodies[thing].set_translation(to_engine(&at), true);
            }
            world.aim_arm(&state.q, &vec![0.0; state.q.len()], &settings);
            world.step(0.0);
            (world.parameters.num_solver_iterations, world.bodies[thing].is_sleeping())
        };
        let (alone, touched) = (settings.iterations_alone, settings.solver_iterations);
        assert!(alone < touched);
        let standing: Vec<_> = (0..200).map(|_| parts(None)).collect();
        assert!(standing.iter().all(|(parts, _)| *parts == alone));
        assert!(!standing[0].1 && standing[199].1, "it falls asleep");
        assert_eq!(parts(Some(hand)).0, touched);
        assert_eq!(parts(Some(Vector3::new(0.0, 0.0, 3.0))), (alone, false));
    }
}
