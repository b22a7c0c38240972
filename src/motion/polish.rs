//! The last digits of a solution of inverse kinematics: Newton's method on six joints, the others held.
//!
//! Source: Nocedal and Wright, *Numerical Optimization*, 2006, §10.3 (damped where the plain step is wild).

use nalgebra::SMatrix;

use super::frames::Frame;
use super::kinematics::frame_error;
use super::robot::Robot;

/// A solution is exact when position (m) and rotation (rad) are off by less.
pub(super) const EXACT: f64 = 1e-11;
/// Joints at most.
const MOST: usize = 7;

/// Moves six joints of `q` until the tip is at the target; returns whether it is.
#[inline(never)]
pub(super) fn polish(robot: &Robot, target: &Frame, q: &mut [f64], six: &[usize; 6]) -> bool {
    let mut jacobian = [0.0; 6 * MOST];
    let jacobian = &mut jacobian[..6 * q.len()];
    // Where two roots meet a step leaves half of what is off.
    for _ in 0..14 {
        let tip = robot.jacobian_into(q, jacobian);
        let error = frame_error(&tip, target);
        if error.amax() < EXACT {
            return true;
        }
        let square = SMatrix::<f64, 6, 6>::from_fn(|i, j| jacobian[6 * six[j] + i]);
        // Beside a singular pose the plain step may be wild; the damping is far below any other effect.
        let damping = 1e-3 * error.norm_squared() + 1e-18;
        let step = square.lu().solve(&error).filter(|step| step.amax() < 0.2).or_else(|| {
            let normal = square.transpose() * square;
            let damped = normal + SMatrix::<f64, 6, 6>::identity() * damping;
            damped.cholesky().map(|factor| factor.solve(&(square.transpose() * error)))
        });
        let Some(step) = step else { return false };
        for (k, &i) in six.iter().enumerate() {
            q[i] += step[k];
        }
    }
    frame_error(&robot.tip_frame(q), target).amax() < 1e-9
}
