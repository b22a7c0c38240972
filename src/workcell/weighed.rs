//! What the hand bore in a run, by the torques its recording holds: as `arm.weigh()` weighs, afterwards.
//!
//! The torques of the hand standing before the thing, fingers still open, are the tare: they take the sensors' own
//! errors out, and most of what the arm's model does not know.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::discovery::recording::Recording;
use crate::execution::plan::{gravity_torque, mass_of};
use crate::motion::Robot;
use crate::units::Dimension;

/// The arm has stood still for so long when it is weighed, s.
const STILL: f64 = 0.45;

/// Fingers that have closed by so much are closing, m.
const CLOSING: f64 = 1e-3;

/// Faster than this a joint does not stand still, rad.
const MOVED: f64 = 2e-3;

/// Returns the mass in the hand, kg, at rest just before `at` (s), when it took hold during `grasp`; `None` if the
/// recording does not say.
pub(super) fn borne(arm: &Recording, robot: &Robot, grasp: [f64; 2], at: f64) -> Option<f64> {
    let joints = robot.n_joints();
    let column = |name| arm.group(name, joints, Dimension::ANGLE).ok().flatten();
    let q = column("q")?;
    let tau = arm.group("tau", joints, Dimension::TORQUE).ok().flatten()?;
    let opening = arm.column("gripper", Dimension::LENGTH).ok()?;
    let row = |time: f64| arm.time.partition_point(|t| *t < time);
    let widest = *opening.get(row(grasp[0]))?;
    let closes = (row(grasp[0])..row(grasp[1])).find(|i| opening[*i] < widest - CLOSING)?;
    let robot = Arc::new(robot.clone());
    // Mean angles at rest before a time, and the mean torques beyond those of an empty hand.
    let rest = |time: f64| -> Option<(Vec<f64>, Vec<f64>)> {
        let rows = row(time - STILL)..row(time);
        let n = rows.len();
        if n < 3 {
            return None;
        }
        let mean = |values: &[f64]| values[rows.clone()].iter().sum::<f64>() / n as f64;
        let moved = |values: &[f64]| (values[rows.end - 1] - values[rows.start]).abs() > MOVED;
        if q.iter().any(|joint| moved(joint)) {
            return None;
        }
        let angles: Vec<f64> = q.iter().map(|joint| mean(joint)).collect();
        let model = gravity_torque(&robot, &angles);
        let excess = tau.iter().zip(model).map(|(joint, model)| mean(joint) - model).collect();
        Some((angles, excess))
    };
    let (_, tare) = rest(arm.time[closes] - 0.02)?;
    let (angles, mut excess) = rest(at)?;
    for (joint, tare) in excess.iter_mut().zip(&tare) {
        *joint -= tare;
    }
    // A recording does not say where in the hand it hangs.
    Some(mass_of(&robot, &angles, &excess, &Vector3::zeros()))
}
