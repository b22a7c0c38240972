//! Starting values: the map through four pairs, and the linear fits to any number.

use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector2, Vector3};

use super::Model;

type Point = Vector2<f64>;

/// Returns the projective map through four pairs `(u, v)`, `None` when three of either side are nearly
/// on one line or the map would turn part of the sample over the horizon.
///
/// Each side is the image of the standard basis under `A = [λ1 p1, λ2 p2, λ3 p3]` with
/// `A (1, 1, 1)ᵀ = p4`; the map is `A_u A_v⁻¹`.
pub(super) fn through_four(sample: &[(Point, Point); 4]) -> Option<Matrix3<f64>> {
    let (real, whole_real) = areas(&sample.map(|(u, _)| u))?;
    let (twin, whole_twin) = areas(&sample.map(|(_, v)| v))?;
    // The homogeneous coordinates of the four are as `real[i] / twin[i]` to `whole_real / whole_twin`: all must have the
    // same sign (Chum, Werner and Matas, "Epipolar geometry estimation via RANSAC benefits from the oriented epipolar
    // constraint", ICPR 2004, for the plane). Most samples with an outlier end here.
    let side = whole_real * whole_twin;
    if real.iter().zip(&twin).any(|(u, v)| u * v * side <= 0.0) {
        return None;
    }
    let corner = |k: usize, side: fn(&(Point, Point)) -> Point, weight: f64| {
        let p = side(&sample[k]);
        Vector3::new(p.x, p.y, 1.0) * weight
    };
    // Columns of A_u over those of A_v, without dividing by the whole.
    let u = Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|k| {
        corner(k, |pair| pair.0, real[k] / twin[k])
    }));
    // The inverse of the matrix whose columns are the twin's points has their cross products as rows, over the whole.
    let v: [Vector3<f64>; 3] = std::array::from_fn(|k| corner(k, |pair| pair.1, 1.0));
    let inverse = Matrix3::from_rows(&[
        v[1].cross(&v[2]).transpose(),
        v[2].cross(&v[0]).transpose(),
        v[0].cross(&v[1]).transpose(),
    ]);
    let m = upright(u * inverse, sample.iter().map(|(_, v)| *v))?;
    m.iter().all(|x| x.is_finite()).then_some(m)
}

/// Twice the areas of the triangles that the fourth point makes with the sides opposite each of the others, and of the
/// triangle without it; `None` when three points are nearly on one line.
fn areas(p: &[Point; 4]) -> Option<([f64; 3], f64)> {
    let area = |a: Point, b: Point, c: Point| (b - a).perp(&(c - a));
    let parts = [area(p[3], p[1], p[2]), area(p[0], p[3], p[2]), area(p[0], p[1], p[3])];
    let whole = area(p[0], p[1], p[2]);
    // Points have spread 1 here; a thinner triangle says nothing about the direction across it.
    let is_thin = |x: f64| x.abs() < 1e-7;
    (!is_thin(whole) && !parts.iter().any(|x| is_thin(*x))).then_some((parts, whole))
}

/// Scales the matrix so that its corner is 1 and all points lie on the positive side of the horizon.
fn upright(m: Matrix3<f64>, points: impl Iterator<Item = Point>) -> Option<Matrix3<f64>> {
    let corner = m[(2, 2)];
    if corner.abs() < 1e-12 * m.amax() {
        return None;
    }
    let m = m / corner;
    for v in points {
        if m[(2, 0)] * v.x + m[(2, 1)] * v.y + 1.0 <= 1e-9 {
            return None;
        }
    }
    Some(m)
}

/// Why there is no linear fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unfit {
    /// A family of maps fits as well.
    Family,
    /// The one that fits sends some of the points over its horizon.
    Behind,
}

/// Returns the linear fit of a form to pairs `(u, v)` in normalised coordinates, or why there is none.
pub(super) fn linear(
    model: Model,
    pairs: impl Iterator<Item = (Point, Point)> + Clone,
) -> Result<Matrix3<f64>, Unfit> {
    let found = match model {
        Model::Scale => {
            let (mut uv, mut vv) = (Vector2::<f64>::zeros(), Vector2::<f64>::zeros());
            for (u, v) in pairs {
                uv += u.component_mul(&v);
                vv += v.component_mul(&v);
            }
            (vv.x > 1e-12 && vv.y > 1e-12)
                .then(|| Matrix3::from_diagonal(&Vector3::new(uv.x / vv.x, uv.y / vv.y, 1.0)))
        }
        Model::Affine => {
            let (mut normal, mut right) = (Matrix3::zeros(), SMatrix::<f64, 3, 2>::zeros());
            for (u, v) in pairs {
                let v = Vector3::new(v.x, v.y, 1.0);
                normal += v * v.transpose();
                right += v * u.transpose();
            }
            let inverse = normal.try_inverse().filter(|i| i.amax() < 1e12);
            let inverse = inverse.ok_or(Unfit::Family)?;
            let a = (inverse * right).transpose();
            let mut m = Matrix3::identity();
            m.fixed_view_mut::<2, 3>(0, 0).copy_from(&a);
            Some(m)
        }
        _ => {
            let m = dlt(pairs.clone()).ok_or(Unfit::Family)?;
            return upright(m, pairs.map(|(_, v)| v)).ok_or(Unfit::Behind);
        }
    };
    found.ok_or(Unfit::Family)
}

/// The direct linear transform on normalised points: the eigenvector of the least eigenvalue of `AᵀA`.
fn dlt(pairs: impl Iterator<Item = (Point, Point)> + Clone) -> Option<Matrix3<f64>> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (u, v) in pairs {
        let a = SMatrix::<f64, 9, 1>::from_column_slice(&[
            v.x,
            v.y,
            1.0,
            0.0,
            0.0,
            0.0,
            -u.x * v.x,
            -u.x * v.y,
            -u.x,
        ]);
        let b = SMatrix::<f64, 9, 1>::from_column_slice(&[
            0.0,
            0.0,
            0.0,
            v.x,
            v.y,
            1.0,
            -u.y * v.x,
            -u.y * v.y,
            -u.y,
        ]);
        normal += a * a.transpose() + b * b.transpose();
    }
    let eigen = SymmetricEigen::new(normal);
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    // A second vanishing eigenvalue: a family of maps fits equally well.
    if eigen.eigenvalues[order[1]] < 1e-11 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]))
}
