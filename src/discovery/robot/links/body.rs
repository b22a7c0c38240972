//! A body's ten numbers, which torques are linear in: changed, read, and kept such that there could be such a body.

use nalgebra::{Matrix3, Matrix4, Vector4};

use super::super::chain::Body;

/// Numbers of a body: mass, moment (3), inertia (6).
pub(in super::super) const NUMBERS: usize = 10;
pub(super) const NAMES: [(&str, &str); NUMBERS] = [
    ("mass", "kg"),
    ("moment_x", "kg*m"),
    ("moment_y", "kg*m"),
    ("moment_z", "kg*m"),
    ("ixx", "kg*m^2"),
    ("ixy", "kg*m^2"),
    ("ixz", "kg*m^2"),
    ("iyy", "kg*m^2"),
    ("iyz", "kg*m^2"),
    ("izz", "kg*m^2"),
];

/// How far a file's numbers usually are off, as a part of the mass, of the mass times its spread, and so on.
const USUAL: f64 = 0.1;
/// Adds a change to a number of a body.
pub(in super::super) fn change(body: &mut Body, number: usize, by: f64) {
    match number {
        0 => body.mass += by,
        1..=3 => body.moment[number - 1] += by,
        _ => {
            let (i, j) = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)][number - 4];
            body.inertia[(i, j)] += by;
            if i != j {
                body.inertia[(j, i)] += by;
            }
        }
    }
}

/// Returns the numbers of a body.
pub(super) fn numbers(body: &Body) -> [f64; NUMBERS] {
    let (h, i) = (&body.moment, &body.inertia);
    [body.mass, h.x, h.y, h.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]
}

/// Returns a body's size about its origin, m, by its inertia, which its centre is part of; 0 for none.
fn size(body: &Body) -> f64 {
    if body.mass > 0.0 { (0.5 * body.inertia.trace().max(0.0) / body.mass).sqrt() } else { 0.0 }
}

/// How far each number of a body may be off: one standard deviation of what a file usually is.
pub(super) fn spread(body: &Body) -> [f64; NUMBERS] {
    let size = size(body);
    let unit = USUAL * body.mass.max(0.0);
    std::array::from_fn(|number| match number {
        0 => unit,
        1..=3 => unit * size,
        _ => unit * size * size,
    })
}

/// Returns a body's pseudo-inertia, which is positive for every body that could be: `∫ [r; 1] [r; 1]ᵀ dm`.
fn pseudo(body: &Body) -> Matrix4<f64> {
    let spread = Matrix3::identity() * (0.5 * body.inertia.trace()) - body.inertia;
    let mut pseudo = Matrix4::zeros();
    pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&spread);
    pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&body.moment);
    pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&body.moment.transpose());
    pseudo[(3, 3)] = body.mass;
    pseudo
}

/// The least part of its spread that a body has in any direction.
const LEAST: f64 = 1e-4;

/// Returns the change nearest to `changes` with which the body could be: its mass is spread by something in every direction.
pub(super) fn nearest(body: &Body, changes: &[f64; NUMBERS]) -> [f64; NUMBERS] {
    let size = size(body);
    if size <= 0.0 {
        return [0.0; NUMBERS];
    }
    let mut changed = body.clone();
    changes.iter().enumerate().for_each(|(k, by)| change(&mut changed, k, *by));
    // In units of the body's size all numbers are of one kind.
    let scale = Vector4::new(1.0 / size, 1.0 / size, 1.0 / size, 1.0);
    let pseudo = pseudo(&changed).component_mul(&(scale * scale.transpose()));
    let least = LEAST * body.mass;
    let mut split = pseudo.symmetric_eigen();
    if split.eigenvalues.min() >= least {
        return *changes;
    }
    split.eigenvalues.apply(|value| *value = value.max(least));
    let mended = split.recompose().component_div(&(scale * scale.transpose()));
    let spread = mended.fixed_view::<3, 3>(0, 0).into_owned();
    changed.mass = mended[(3, 3)];
    changed.moment = mended.fixed_view::<3, 1>(0, 3).into_owned();
    changed.inertia = Matrix3::identity() * spread.trace() - spread;
    let (own, new) = (numbers(body), numbers(&changed));
    std::array::from_fn(|k| new[k] - own[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;
    use nalgebra::Vector3;

    use super::super::super::chain::Chain;

    fn changed(body: &Body, changes: &[f64; NUMBERS]) -> Body {
        let mut changed = body.clone();
        changes.iter().enumerate().for_each(|(k, by)| change(&mut changed, k, *by));
        changed
    }

    #[test]
    fn a_body_that_could_be_stays_and_one_that_could_not_is_mended() {
        let chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        for body in &chain.bodies {
            let own = numbers(body);
            let heavier = own.map(|number| 0.1 * number);
            let kept = nearest(body, &heavier);
            let is_kept = kept.iter().zip(&heavier).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(is_kept, "{}: {kept:?}", body.name);
            // Lighter than nothing, and a moment that no such mass has.
            let mut absurd = [0.0; NUMBERS];
            absurd[0] = -2.0 * own[0];
            absurd[1] = 5.0 * own[0];
            let mended = changed(body, &nearest(body, &absurd));
            let least = pseudo(&mended).symmetric_eigenvalues().min();
            assert!(mended.mass > 0.0 && least > 0.0, "{}: {least}", body.name);
        }
    }

    #[test]
    fn numbers_are_read_back_as_they_were_changed() {
        let chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        let body = &chain.bodies[2];
        let by: [f64; NUMBERS] = std::array::from_fn(|k| 0.001 * (k as f64 + 1.0));
        let (own, new) = (numbers(body), numbers(&changed(body, &by)));
        for k in 0..NUMBERS {
            assert!((new[k] - own[k] - by[k]).abs() < 1e-12, "{}", NAMES[k].0);
        }
    }
}
