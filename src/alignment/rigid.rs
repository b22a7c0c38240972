//! The turn between two clouds of points that belong together.
//!
//! Source: Umeyama, "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", 1991.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Returns the turn that carries the first points of some pairs nearest to the second, each about their middle; `None` for
/// points on a line, about which any turn does.
pub fn turn_between(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<UnitQuaternion<f64>> {
    let (from, to) = middles(pairs);
    let cross = pairs.iter().map(|(a, b)| (b - to) * (a - from).transpose()).sum::<Matrix3<f64>>();
    let svd = cross.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    if svd.singular_values[1] <= 1e-9 * svd.singular_values[0] {
        return None;
    }
    let sign = (u * v_t).determinant().signum();
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    Some(Rotation3::from_matrix_unchecked(turn).into())
}

/// Returns the rigid motion that carries the first points of some pairs nearest to the second; `None` as for
/// [`turn_between`].
pub fn motion_between(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Isometry3<f64>> {
    let turn = turn_between(pairs)?;
    let (from, to) = middles(pairs);
    Some(Isometry3::from_parts(Translation3::from(to - turn * from), turn))
}

/// Returns the mean of the first points and of the second.
fn middles(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> (Vector3<f64>, Vector3<f64>) {
    let n = pairs.len().max(1) as f64;
    let from = pairs.iter().map(|pair| pair.0).sum::<Vector3<f64>>() / n;
    let to = pairs.iter().map(|pair| pair.1).sum::<Vector3<f64>>() / n;
    (from, to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_found_from_where_it_carries_points() {
        let motion = Isometry3::new(Vector3::new(0.3, -1.0, 2.0), Vector3::new(0.4, 1.1, -2.0));
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.0, 0.7, 0.0], [0.2, 0.1, 0.9]];
        let pairs = points.map(|p| {
            let p = Vector3::from(p);
            (p, (motion * nalgebra::Point3::from(p)).coords)
        });
        let found = motion_between(&pairs).unwrap();
        assert!((found.translation.vector - motion.translation.vector).norm() < 1e-12);
        assert!(found.rotation.angle_to(&motion.rotation) < 1e-12);
        let line = [0.0, 1.0, 2.0].map(|x| (Vector3::x() * x, Vector3::y() * x));
        assert!(motion_between(&line).is_none());
    }
}
