//! Inverse kinematics of any chain, numerically, from one start.
//!
//! Source: Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", T-RO 2011 (damping
//! scaled by the error).

use std::f64::consts::PI;

use nalgebra::Vector6;
use rand::RngExt;
use rand::rngs::StdRng;

use super::cholesky;
use super::frames::Frame;
use super::kinematics::frame_error;
use super::normal;
use super::robot::Robot;

/// A numerical solution counts when position (m) and rotation (rad) are off by less.
const EXACT: f64 = 1e-10;
/// Iterations from one start: Sugihara's method needs about 20 on the arms tried.
const ITERATIONS: usize = 80;

/// How far from the target an arm may end that cannot come nearer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Give {
    /// m.
    pub(super) position: f64,
    /// rad.
    pub(super) rotation: f64,
}

impl Give {
    /// Nothing but rounding.
    pub(super) const NOTHING: Self = Self { position: EXACT, rotation: EXACT };

    fn allows(self, error: &Vector6<f64>) -> bool {
        error.fixed_rows::<3>(0).norm() < self.position
            && error.fixed_rows::<3>(3).norm() < self.rotation
    }
}

/// Runs Levenberg-Marquardt from `q`, inside `ranges` if there are any, rad; returns whether it ended on the target, or where
/// it comes no nearer as near as `give` allows.
pub(super) fn descend(
    robot: &Robot,
    target: &Frame,
    q: &mut [f64],
    ranges: Option<&[(f64, f64)]>,
    give: Give,
) -> bool {
    let n = robot.n_joints();
    let mut jacobian = vec![0.0; 6 * n];
    let (mut normal, mut step) = (vec![0.0; n * n], vec![0.0; n]);
    let mut best = f64::INFINITY;
    let mut stalled = 0;
    for _ in 0..ITERATIONS {
        let error = frame_error(&robot.jacobian_into(q, &mut jacobian), target);
        if error.amax() < EXACT {
            return true;
        }
        let size = 0.5 * error.norm_squared();
        stalled = if size < 0.9 * best { 0 } else { stalled + 1 };
        best = best.min(size);
        if stalled > 12 {
            return give.allows(&error);
        }
        normal::equations(&jacobian, error.as_slice(), &mut normal, &mut step);
        for i in 0..n {
            // Sugihara (13): the damping vanishes with the error, so the end is quadratic.
            normal[i * n + i] += size + 1e-14;
        }
        if !cholesky::solve(&mut normal, &mut step) {
            return false;
        }
        let longest = step.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let scale = (1.0 / longest).min(1.0);
        for i in 0..n {
            q[i] += scale * step[i];
            if let Some(ranges) = ranges {
                q[i] = q[i].clamp(ranges[i].0, ranges[i].1);
            }
        }
    }
    false
}

/// Draws joint positions, uniformly inside the limits; a full turn where there are none.
pub(super) fn random_configuration(robot: &Robot, random: &mut StdRng) -> Vec<f64> {
    robot
        .joints()
        .iter()
        .map(|joint| {
            let (low, high) = (joint.lower.max(-PI), joint.upper.min(PI));
            if low < high { random.random_range(low..high) } else { low }
        })
        .collect()
}
