//! Which way gravity points in the torques of a recording: as the sidecar says, elsewhere, or nowhere.
//!
//! An arm on a wall or a ceiling, and torques from which a controller has taken the weight already, are no effects of the
//! arm: searched for effects they yield a list of absurd ones. Strong evidence is asked for, as in [`super::plausible`]. A base
//! that leans by a few degrees is an effect, and is left to the search.

use nalgebra::{Matrix3, Vector3};

use super::channels::{Channel, Quantity};
use super::error::Misfit;
use super::plausible::{SURE, beyond, norm};
use super::simulate::Model;
use crate::discovery::recording::sidecar::TorqueSensor;

/// Another gravity is further off than this part of the one that was said.
const ELSEWHERE: f64 = 0.3;

/// Weaker than this part of it, none is left; of this part more or less, it is as strong.
const AS_STRONG: f64 = 0.15;

/// Of what no gravity or another explains, the root mean square falls to this part in every joint that bears weight.
const LEFT: f64 = 1.0 / 3.0;

/// So many joints bear weight that what they show together is no fault of one of them.
const ENOUGH: usize = 2;

/// A direction in which gravity is known worse than this part of it says nothing.
const KNOWN: f64 = 0.02;

/// A component below this part of gravity is taken for none.
const SQUARE: f64 = 0.05;

/// So many rows are looked at, evenly over the recording.
const ROWS: usize = 600;

/// What the model needs at a joint, what the torque sensor shows beyond that, and what a gravity of 1 m/s² along each axis of
/// the base would add: N·m, of rows looked at, what rubs and what is always there taken out of all of them.
struct Shown {
    needed: Vec<f64>,
    residual: Vec<f64>,
    weight: [Vec<f64>; 3],
    noise: f64,
}

/// Returns what is wrong with the gravity that was said, if the torques of several joints show another.
pub(super) fn other(model: &Model) -> Option<Misfit> {
    let said = model.arm.chain.gravity;
    let shown = shown(model);
    let more = fitted(&shown, said.norm())?;
    let enough = |shown: &&Shown| {
        let weight = added(shown, &more);
        norm(&weight) > SURE * shown.noise * (weight.len() as f64).sqrt()
    };
    let bearing: Vec<&Shown> = shown.iter().filter(enough).collect();
    let is_elsewhere = more.norm() > ELSEWHERE * said.norm();
    let (mut left, mut turned) = (0.0, 0.0);
    for shown in &bearing {
        let pairs = shown.residual.iter().zip(added(shown, &more));
        let beyond: Vec<f64> = pairs.map(|(residual, weight)| residual - weight).collect();
        if norm(&beyond) > LEFT * norm(&shown.residual) {
            return None;
        }
        // What a sensor that counts the other way round would leave.
        let pairs = shown.residual.iter().zip(&shown.needed);
        let against: Vec<f64> = pairs.map(|(residual, needed)| residual + 2.0 * needed).collect();
        left += (norm(&beyond) / shown.noise).powi(2);
        turned += (norm(&against) / shown.noise).powi(2);
    }
    if bearing.len() < ENOUGH || !is_elsewhere || turned < left {
        return None;
    }
    let gravity = said + more;
    let strength = gravity.norm() / said.norm();
    if strength < AS_STRONG {
        return Some(Misfit::Weightless { joints: bearing.len() });
    }
    let is_as_strong = (strength - 1.0).abs() < AS_STRONG;
    let gravity = along_axes(&gravity).normalize() * said.norm();
    is_as_strong.then(|| Misfit::Mounted { joints: bearing.len(), gravity: gravity.into() })
}

/// Returns a direction without the components that are hardly any: most arms stand, hang or are mounted square.
fn along_axes(direction: &Vector3<f64>) -> Vector3<f64> {
    direction.map(|part| if part.abs() < SQUARE * direction.norm() { 0.0 } else { part })
}

/// Returns the gravity (m/s², base axes) beyond the one that was said that leaves least, along the directions in which it is
/// known.
fn fitted(shown: &[Shown], said: f64) -> Option<Vector3<f64>> {
    let (mut normal, mut along, mut whole, mut rows) =
        (Matrix3::zeros(), Vector3::zeros(), 0.0, 0.0);
    for shown in shown {
        for (row, residual) in shown.residual.iter().enumerate() {
            let weight = Vector3::from_fn(|axis, _| shown.weight[axis][row]) / shown.noise;
            let residual = residual / shown.noise;
            normal += weight * weight.transpose();
            along += weight * residual;
            whole += residual * residual;
            rows += 1.0;
        }
    }
    let eigen = normal.symmetric_eigen();
    let parts = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let parts: Vec<(f64, f64, Vector3<f64>)> = parts
        .filter(|(value, _)| **value > 1e-9 * eigen.eigenvalues.max())
        .map(|(value, direction)| (*value, direction.dot(&along), direction.into_owned()))
        .collect();
    let explained: f64 = parts.iter().map(|(value, along, _)| along * along / value).sum();
    let variance = ((whole - explained) / rows).max(1.0);
    let is_known = |value: f64| (variance / value).sqrt() < KNOWN * said;
    let known = parts.iter().filter(|(value, ..)| is_known(*value));
    let more: Vector3<f64> = known.map(|(value, along, axis)| axis * (along / value)).sum();
    (more.norm() > 0.0).then_some(more)
}

/// Returns what more gravity (m/s², base axes) adds to a torque, N·m.
fn added(shown: &Shown, more: &Vector3<f64>) -> Vec<f64> {
    let [x, y, z] = &shown.weight;
    let parts = x.iter().zip(y).zip(z);
    parts.map(|((x, y), z)| x * more.x + y * more.y + z * more.z).collect()
}

/// Returns what every torque sensor shows along the motion of a recording.
fn shown(model: &Model) -> Vec<Shown> {
    let (course, arm) = (&model.course, &model.arm);
    let n = arm.chain.n();
    let at = |values: &[f64]| -> Vec<Vec<f64>> {
        (0..n).map(|joint| course.at_rows(values, joint)).collect()
    };
    let [q, dq, ddq] = [&course.plant.q, &course.plant.dq, &course.plant.ddq].map(|v| at(v));
    let judged = course.first_row..course.last_row.min(course.data.n_rows());
    let step = judged.len().div_ceil(ROWS).max(1);
    let rows: Vec<usize> = judged.step_by(step).collect();
    let still = vec![0.0; n];
    let mut torques = vec![vec![0.0; n]; 4];
    let mut needed = vec![vec![Vec::with_capacity(rows.len()); n]; 4];
    for &row in &rows {
        let of = |values: &[Vec<f64>]| -> Vec<f64> { values.iter().map(|v| v[row]).collect() };
        let (q, dq, ddq) = (of(&q), of(&dq), of(&ddq));
        arm.chain.inverse(&q, &dq, &ddq, &mut torques[3]);
        for axis in 0..3 {
            let mut unit = Vector3::zeros();
            unit[axis] = 1.0;
            arm.chain.inverse_under(&unit, &q, &still, &still, &mut torques[axis]);
        }
        for joint in 0..n {
            if arm.torque_sensor == TorqueSensor::Motor {
                torques[3][joint] += arm.armature[joint] * ddq[joint];
            }
            for (needed, torque) in needed.iter_mut().zip(&torques) {
                needed[joint].push(torque[joint]);
            }
        }
    }
    let sensors = course
        .data
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Torque && channel.noise > 0.0);
    let of_sensor = |channel: &Channel| {
        let joint = channel.index;
        let dry: Vec<f64> = rows.iter().map(|row| dq[joint][*row].signum()).collect();
        let always = vec![1.0; rows.len()];
        let steady = beyond(&dry, &always);
        let fluid: Vec<f64> = rows.iter().map(|row| dq[joint][*row]).collect();
        let fluid = beyond(&beyond(&fluid, &always), &steady);
        let free = |values: &[f64]| beyond(&beyond(&beyond(values, &always), &steady), &fluid);
        let measured = rows.iter().zip(&needed[3][joint]);
        let residual: Vec<f64> = measured.map(|(row, need)| channel.values[*row] - need).collect();
        let [x, y, z, needed] = [0, 1, 2, 3].map(|of| free(&needed[of][joint]));
        Shown { needed, residual: free(&residual), weight: [x, y, z], noise: channel.noise }
    };
    sensors.map(of_sensor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints whose weight is told apart by how they turn, of which `part` of gravity along z is missing and `side` along x is more.
    fn sensors(part: f64, side: f64) -> Vec<Shown> {
        let of = |turn: f64| {
            let angle = |row: u32| turn * (0.02 * f64::from(row)).sin();
            let [x, z] =
                [f64::sin, f64::cos].map(|of| (0..500).map(|row| of(angle(row))).collect());
            let [x, z]: [Vec<f64>; 2] = [x, z];
            let noise = |row: usize| 0.01 * (7.3 * row as f64).sin();
            let rows = x.iter().zip(&z).enumerate();
            let residual =
                rows.map(|(row, (x, z))| 9.81 * part * z + side * x + noise(row)).collect();
            Shown { needed: Vec::new(), residual, weight: [x, vec![0.0; 500], z], noise: 0.01 }
        };
        vec![of(1.0), of(2.0)]
    }

    #[test]
    fn the_gravity_that_is_missing_is_found_where_it_shows() {
        let more = fitted(&sensors(1.0, 0.0), 9.81).unwrap();
        assert!((more - Vector3::new(0.0, 0.0, 9.81)).norm() < 0.05, "{more}");
        let more = fitted(&sensors(1.0, -9.81), 9.81).unwrap();
        assert!((more - Vector3::new(-9.81, 0.0, 9.81)).norm() < 0.05, "{more}");
        // A joint that never turns tells only what it weighs as it stands.
        let mut still = sensors(0.5, 3.0);
        for shown in &mut still {
            shown.weight[0].fill(0.0);
        }
        assert!(fitted(&still, 9.81).unwrap().x.abs() < 1e-9);
    }
}
