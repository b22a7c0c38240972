//! What low-level servoing asks of the joints, one by one: a position, a speed, or a torque.
//!
//! A joint with a torque moves as the arm's rigid bodies do under it, against a little viscous friction; the
//! others are carried along by their own commands. There is no gravity compensation, as in the arm: a torque
//! of zero lets a joint fall. Rotors are not published and have no inertia here.
//!
//! Source: Featherstone, *Rigid Body Dynamics Algorithms*, 2008, §6.2, for the equation of motion.

use nalgebra::{DMatrix, DVector};

use crate::motion::dynamics::{Bodies, Dynamics};

use super::servo::{Servo, TICK};

/// Viscous friction of a joint, N·m·s/rad; chosen.
const FRICTION: f64 = 1.0;

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
