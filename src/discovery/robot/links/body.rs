//! A body's ten numbers, which torques are linear in: changed, read, and kept such that there could be such a body.

use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3, Vector4};

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

/// A load is no farther from the last body's frame, m.
pub(super) const FAR_OUT: f64 = 1.0;

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

/// Returns what mass (kg) and moment (kg·m) of a load are in a body's ten numbers, near a mass at a point with these: a matrix for
/// them, exact for that one, since the inertia `(|h|² 1 - h hᵀ) / m` is of degree one in both. Where that would be far out, a
/// load has no inertia.
pub(super) fn point([mass, moment @ ..]: [f64; 4]) -> DMatrix<f64> {
    let h = Vector3::from(moment);
    let mut numbers = DMatrix::<f64>::identity(NUMBERS, 4);
    if mass <= 0.0 || h.norm() > FAR_OUT * mass {
        return numbers;
    }
    let at = h / mass;
    for (row, (i, k)) in (4..).zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
        let is_same = f64::from(u8::from(i == k));
        numbers[(row, 0)] = at[i] * at[k] - is_same * at.norm_squared();
        numbers[(row, 1 + i)] -= at[k];
        numbers[(row, 1 + k)] -= at[i];
        for axis in 0..3 {
            numbers[(row, 1 + axis)] += 2.0 * is_same * at[axis];
        }
    }
    numbers
}

/// The least part of its spread that a body surely has in any direction.
const LEAST: f64 = 1e-3;

/// A body's pseudo-inertia by the changes of its numbers, in units of its mass and size.
pub(super) struct Pseudo {
    /// Without any.
    pub(super) own: Matrix4<f64>,
    /// For one unit of each.
    pub(super) by: [Matrix4<f64>; NUMBERS],
}

impl Pseudo {
    /// Returns that of a body; `None` of one without a mass.
    pub(super) fn of(body: &Body) -> Option<Self> {
        let size = size(body);
        if size <= 0.0 {
            return None;
        }
        let scale = Vector4::new(1.0 / size, 1.0 / size, 1.0 / size, 1.0);
        let scale = scale * scale.transpose() / body.mass;
        let own = pseudo(body);
        let by = std::array::from_fn(|number| {
            let mut changed = body.clone();
            change(&mut changed, number, 1.0);
            (pseudo(&changed) - own).component_mul(&scale)
        });
        Some(Self { own: own.component_mul(&scale), by })
    }

    /// Returns it with changes.
    pub(super) fn with(&self, changes: &[f64]) -> Matrix4<f64> {
        self.by.iter().zip(changes).fold(self.own, |sum, (by, change)| sum + by * *change)
    }
}

/// Returns the change nearest to `changes` with which the body surely could be: its mass is spread by something in every direction.
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
    use super::super::super::chain::{Chain, PointMass};
    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;

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
    fn a_load_has_the_inertia_of_a_mass_at_a_point() {
        let chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        let body = chain.bodies.len() - 1;
        let borne = |[mass, moment @ ..]: [f64; 4]| {
            let mut loaded = chain.clone();
            loaded.add_point(&PointMass { body, mass, moment: Vector3::from(moment) });
            let (own, new) = (numbers(&chain.bodies[body]), numbers(&loaded.bodies[body]));
            DMatrix::from_fn(NUMBERS, 1, |k, _| new[k] - own[k])
        };
        let load = [1.5, 0.15, -0.12, 0.2];
        let by = point(load);
        let exact = (&by * DMatrix::from_column_slice(4, 1, &load) - borne(load)).amax();
        assert!(exact < 1e-12, "{exact}");
        for k in 0..4 {
            let [more, less] = [1e-5, -1e-5].map(|step| {
                let mut near = load;
                near[k] += step;
                borne(near)
            });
            let off = ((more - less) / 2e-5 - by.columns(k, 1)).amax();
            assert!(off < 1e-6, "{k}: {off}");
        }
        // A moment without a mass is nowhere.
        assert!(point([1e-3, 0.1, 0.0, 0.0]).rows(4, 6).amax() <= 0.0);
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
