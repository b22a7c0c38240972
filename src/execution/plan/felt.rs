//! What the joints feel of a load or a push, and the mass or force that explains it: forces are in the base, by least squares over all
//! joints.
//!
//! Nothing is measured here: torques come from the arm's feedback, as those above what holding still takes.

use std::sync::Arc;

use nalgebra::{DVector, Matrix3, Vector3};

use crate::motion::dynamics::{Bodies, Dynamics, GRAVITY};
use crate::motion::robot::Robot;

/// The least square of the torques, (N·m/kg)², by which a mass can be told from them: a lever of 3 µm. Anything between
/// rounding (1e-30) and the levers of an arm (a square of 1 is a lever of 0.1 m) would do.
const LEAST_LEVER: f64 = 1e-9;

/// Returns the joint torques, N·m, that hold the arm and its gripper still at `q`.
pub fn gravity_torque(robot: &Arc<Robot>, q: &[f64]) -> Vec<f64> {
    let torques = Dynamics::new(robot, Bodies::All).gravity_torques(q);
    torques.map_or_else(|_| vec![0.0; q.len()], |torques: DVector<f64>| torques.as_slice().to_vec())
}

/// Returns the joint torques, N·m, that it takes at `q` to push with one newton along `way` (in the base) `at` this place
/// in the frame of the tool, m; zeros for a wrong number of joints.
fn push_torque(robot: &Arc<Robot>, q: &[f64], at: &Vector3<f64>, way: &Vector3<f64>) -> Vec<f64> {
    let (Ok(jacobian), Ok(flange)) = (robot.jacobian(q), robot.forward(q)) else {
        return vec![0.0; q.len()];
    };
    // The Jacobian is about the flange; the tool is ahead of it.
    let tool = robot.flange_from_tool();
    let ahead = flange.rotation() * (tool.origin() + tool.rotation() * at);
    (0..q.len())
        .map(|joint| {
            let column = jacobian.column(joint);
            let turn = Vector3::new(column[3], column[4], column[5]);
            let moves = Vector3::new(column[0], column[1], column[2]) + turn.cross(&ahead);
            moves.dot(way)
        })
        .collect()
}

/// Returns the force, N, with which the hand pushes along `way` (in the base) when holding still takes so much more
/// torque (N·m) at `q`: the least-squares one over all joints; `None` where no joint would feel it.
pub fn force_of(robot: &Arc<Robot>, q: &[f64], excess: &[f64], way: &Vector3<f64>) -> Option<f64> {
    let column = push_torque(robot, q, &Vector3::zeros(), way);
    let along: f64 = column.iter().zip(excess).map(|(c, e)| c * e).sum();
    let norm: f64 = column.iter().map(|c| c * c).sum();
    (norm > LEAST_LEVER).then(|| along / norm)
}

/// Returns the force, N in the base, with which the hand pushes when holding still takes so much more torque (N·m) at `q`: the
/// least-squares one over all joints; `None` where some direction is not felt.
pub fn force_at(robot: &Arc<Robot>, q: &[f64], excess: &[f64]) -> Option<Vector3<f64>> {
    let columns = [Vector3::x(), Vector3::y(), Vector3::z()]
        .map(|way| push_torque(robot, q, &Vector3::zeros(), &way));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal = Matrix3::from_fn(|i, j| dot(&columns[i], &columns[j]));
    let right = Vector3::from_fn(|i, _| dot(&columns[i], excess));
    // A direction with a lever of a centimetre is felt; one with less is noise.
    if normal.symmetric_eigenvalues().min() < 1e-4 {
        return None;
    }
    normal.cholesky().map(|normal| normal.solve(&right))
}

/// Returns the mass, kg, that takes so much more torque (N·m) at `q` than an empty hand when it hangs `at` this place
/// in the frame of the tool, m: the least-squares one over all joints.
pub fn mass_of(robot: &Arc<Robot>, q: &[f64], excess: &[f64], at: &Vector3<f64>) -> f64 {
    let column = push_torque(robot, q, at, &Vector3::z());
    let along: f64 = column.iter().zip(excess).map(|(c, e)| c * e).sum();
    let norm: f64 = column.iter().map(|c| c * c).sum::<f64>() * GRAVITY;
    if norm > LEAST_LEVER { along / norm } else { 0.0 }
}
