//! What low-level servoing asks of the joints, one by one: a position, a speed, or a torque.
//!
//! A joint with a torque moves as the arm's rigid bodies do under it, against a little viscous friction; the
//! others are carried along by their own commands. There is no gravity compensation, as in the arm: a torque
//! of zero lets a joint fall. Rotors are not published and have no inertia here.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §6.2, for the equation of motion.

use nalgebra::{DMatrix, DVector};

use crate::motion::dynamics::{Bodies, Dynamics};

use super::cyclic::{JOINT_LIMIT_HIGH, JOINT_LIMIT_LOW, MAXIMUM_VELOCITY};
use super::servo::{Happened, Motion, Servo, TICK};

/// Viscous friction of a joint, N·m·s/rad; chosen.
const FRICTION: f64 = 1.0;

/// A position may be so far beyond a joint's range, rad: what the wire rounds.
const ROUNDED: f64 = 1e-3;
/// How fast positions lead a joint is smoothed over so long, s: they come unevenly. A joint that is led faster than this times its limit turns too
/// fast. Both chosen: the arm's thresholds are not published.
const SMOOTHED: f64 = 0.2;
const TOO_FAST: f64 = 1.5;

/// What a cycle asks of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Drive {
    /// To be there, rad.
    Position(f64),
    /// To turn so fast, rad/s.
    Speed(f64),
    /// To be pushed so hard, N·m.
    Torque(f64),
}

impl Servo {
    /// Returns the joints' next positions, rad, and speeds, rad/s.
    pub(super) fn driven(&self, drives: &[Drive]) -> (Vec<f64>, Vec<f64>) {
        let pushed = self.pushed(drives);
        let one = |(i, drive): (usize, &Drive)| {
            let (before, dq, most) = (self.q_cmd[i], self.dq_cmd[i], self.limits.velocity[i]);
            match *drive {
                // What the servo is told of speed is what the positions did, smoothed over a few cycles.
                Drive::Position(q) => {
                    (q, (dq + 0.2 * ((q - before) / TICK - dq)).clamp(-most, most))
                }
                Drive::Speed(wanted) => {
                    let step = self.limits.acceleration[i] * TICK;
                    let speed = dq + (wanted.clamp(-most, most) - dq).clamp(-step, step);
                    let speed = self.braked(i, speed);
                    (before + speed * TICK, speed)
                }
                Drive::Torque(_) => {
                    let speed = self.braked(i, pushed[i].clamp(-most, most));
                    (before + speed * TICK, speed)
                }
            }
        };
        drives.iter().enumerate().map(one).unzip()
    }

    /// Takes in where joints are sent next, rad; returns which of them a stream of positions leads out of its range or, in an ideal arm, faster
    /// than it can turn. Another arm falls behind such a stream.
    pub(super) fn over_limit(&mut self, q: &[f64]) -> Option<Happened> {
        let Motion::Stream(drives) = self.motion() else { return None };
        let are_led: Vec<bool> =
            drives.iter().map(|drive| matches!(drive, Drive::Position(_))).collect();
        let mut over = None;
        for (i, joint) in self.robot.joints().iter().enumerate().filter(|(i, _)| are_led[*i]) {
            let step = q[i] - self.q_cmd[i];
            self.led[i] += TICK / SMOOTHED * (step / TICK - self.led[i]);
            let bit = if q[i] > joint.upper + ROUNDED && step > 0.0 {
                JOINT_LIMIT_HIGH
            } else if q[i] < joint.lower - ROUNDED && step < 0.0 {
                JOINT_LIMIT_LOW
            } else if self.is_ideal && self.led[i].abs() > TOO_FAST * joint.velocity {
                MAXIMUM_VELOCITY
            } else {
                continue;
            };
            over = over.or(Some(Happened::OverLimit(i, bit)));
        }
        over
    }

    /// Returns the speeds, rad/s, that joints with a torque have after a tick; the others' are as they were.
    fn pushed(&self, drives: &[Drive]) -> Vec<f64> {
        let mut next = self.dq_cmd.clone();
        let free: Vec<(usize, f64)> = drives
            .iter()
            .enumerate()
            .filter_map(|(i, drive)| match drive {
                Drive::Torque(torque) => Some((i, *torque)),
                Drive::Position(_) | Drive::Speed(_) => None,
            })
            .collect();
        if free.is_empty() {
            return next;
        }
        let dynamics = Dynamics::new(&self.robot, Bodies::All);
        let (Ok(mass), Ok(bias)) =
            (dynamics.mass_matrix(&self.q_cmd), dynamics.bias(&self.q_cmd, &self.dq_cmd))
        else {
            return next;
        };
        // Friction at the end of the tick, not at its beginning: light joints stay stable.
        let n = free.len();
        let effort = DVector::from_iterator(
            n,
            free.iter().map(|&(i, torque)| torque - bias[i] - FRICTION * self.dq_cmd[i]),
        );
        let inertia = DMatrix::from_fn(n, n, |a, b| {
            let friction = if a == b { FRICTION * TICK } else { 0.0 };
            mass[(free[a].0, free[b].0)] + friction
        });
        let Some(factor) = inertia.cholesky() else { return next };
        let acceleration = factor.solve(&effort);
        for (k, &(i, _)) in free.iter().enumerate() {
            next[i] += acceleration[k] * TICK;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::plant::Ideal;
    use super::*;
    use crate::motion::robot::Robot;

    /// Leads a joint (from 0) of an ideal arm by so much a tick, deg; returns what happens first, and where the joint was sent then, deg.
    fn led(joint: usize, by: f64, ticks: usize) -> (Option<Happened>, f64) {
        let robot = Arc::new(Robot::gen3());
        let mut q = robot.pose("home").unwrap().to_vec();
        let mut servo = Servo::new(robot, Box::new(Ideal::new(&q)));
        for _ in 0..ticks {
            q[joint] += by.to_radians();
            servo.stream(q.iter().copied().map(Drive::Position).collect());
            let happened = servo.tick().into_iter().next();
            if happened.is_some() {
                return (happened, servo.q_cmd[joint].to_degrees());
            }
        }
        (None, servo.q_cmd[joint].to_degrees())
    }

    /// They were followed to the end of the world.
    #[test]
    fn positions_beyond_a_range_are_not_followed() {
        let (happened, at) = led(1, 0.1, 2000);
        assert_eq!(happened, Some(Happened::OverLimit(1, JOINT_LIMIT_HIGH)));
        assert!((at - 128.3).abs() < 0.3, "{at}");
        let (happened, at) = led(1, -0.1, 2000);
        assert_eq!(happened, Some(Happened::OverLimit(1, JOINT_LIMIT_LOW)));
        assert!((at + 128.3).abs() < 0.3, "{at}");
    }

    /// Joint 7 turns at 70 deg/s.
    #[test]
    fn positions_that_run_away_from_a_joint_are_not_followed() {
        assert_eq!(led(6, 0.14, 2000).0, None);
        let (happened, _) = led(6, 0.4, 200);
        assert_eq!(happened, Some(Happened::OverLimit(6, MAXIMUM_VELOCITY)));
    }
}
