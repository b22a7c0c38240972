//! A fisheye's distortion: how far from the middle the angle from the optical axis is shown.
//!
//! Where a pinhole shows the angle `θ` at `tan θ`, a fisheye shows it at about `θ`, so that the whole half-space before it has room:
//! `θ_d = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)`, `x_d = x θ_d / r`, `y_d = y θ_d / r` with `r² = x² + y²` and `θ = atan r`
//! (`OpenCV`'s `fisheye`, Kalibr's `equidistant`). Normalised coordinates end at a right angle from the axis; [`angle`] and
//! [`shown_at`] go on.
//!
//! Source: Kannala and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye lenses",
//! PAMI 2006; `OpenCV`, "Fisheye camera model".

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::camera::FOLD;

/// Normalised coordinates are given up to this angle from the axis, rad (89°): `r = 57`; at a right angle they have no end.
pub(super) const WIDEST: f64 = 1.5533;

/// Below this radius `θ/r` is 1 to rounding: it differs by `r²/3`.
const MIDDLE: f64 = 1e-8;

/// Returns where an angle from the axis is shown, and the slope of that.
fn shown(k: [f64; 4], angle: f64) -> (f64, f64) {
    let t = angle * angle;
    let value = angle * (1.0 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
    let slope = 1.0 + t * (3.0 * k[0] + t * (5.0 * k[1] + t * (7.0 * k[2] + t * 9.0 * k[3])));
    (value, slope)
}

/// Returns whether all angles up to one are shown one after the other.
pub(super) fn grows_to(k: [f64; 4], angle: f64) -> bool {
    (0..=64).all(|i| shown(k, angle * f64::from(i) / 64.0).1 > FOLD)
}

/// Returns the angle from the axis, rad, of what is shown at a distance from the middle: from 0 to half a turn. Past the fold of the
/// polynomial it stays there.
pub(super) fn angle(k: [f64; 4], far: f64) -> f64 {
    // The polynomial may turn; walk from the middle, so that the first one that fits is found.
    let mut angle = 0.0_f64;
    for _ in 0..50 {
        let (value, slope) = shown(k, angle);
        if slope < FOLD {
            break;
        }
        let step = ((far - value) / slope).clamp(-STEP, STEP);
        angle = (angle + step).clamp(0.0, PI);
        if step.abs() < 1e-15 {
            break;
        }
    }
    angle
}

/// Longest step of the search, rad. Chosen: a lens bends little within it.
const STEP: f64 = 0.25;

/// Applies the distortion to normalised coordinates.
pub(super) fn distort(k: [f64; 4], n: Vector2<f64>) -> Vector2<f64> {
    let r = n.norm();
    if r < MIDDLE { n } else { n * (shown(k, r.atan()).0 / r) }
}

/// Returns the derivatives of [`distort`] by the normalised coordinates.
pub(super) fn slope(k: [f64; 4], n: Vector2<f64>) -> Matrix2<f64> {
    let r2 = n.norm_squared();
    let r = r2.sqrt();
    if r < MIDDLE {
        return Matrix2::identity();
    }
    let (value, slope) = shown(k, r.atan());
    let factor = value / r;
    let by_radius = slope / (1.0 + r2);
    Matrix2::identity() * factor + n * n.transpose() * ((by_radius - factor) / r2)
}

/// Returns where a point of the camera's frame is shown, distorted coordinates, wherever it is but straight behind.
pub(super) fn shown_at(k: [f64; 4], p: Vector3<f64>) -> Option<Vector2<f64>> {
    let r = p.xy().norm();
    if r < MIDDLE * p.z.abs() {
        return (p.z > 0.0).then(|| p.xy() / p.z);
    }
    (r > 0.0).then(|| p.xy() * (shown(k, r.atan2(p.z)).0 / r))
}

/// Returns the derivatives of [`shown_at`] by the point.
pub(super) fn shown_slope(k: [f64; 4], p: Vector3<f64>) -> Matrix2x3<f64> {
    let r = p.xy().norm();
    if r < MIDDLE * p.z.abs() {
        return Matrix2x3::new(1.0 / p.z, 0.0, 0.0, 0.0, 1.0 / p.z, 0.0);
    }
    let (value, slope) = shown(k, r.atan2(p.z));
    let (outwards, far2) = (p.xy() / r, p.norm_squared());
    let along = outwards * outwards.transpose();
    let by_xy = (Matrix2::identity() - along) * (value / r) + along * (slope * p.z / far2);
    let by_z = -outwards * (slope * r / far2);
    Matrix2x3::from_columns(&[by_xy.column(0).into(), by_xy.column(1).into(), by_z])
}

/// Returns the derivatives of [`shown_at`] by `k1` to `k4`.
pub(super) fn by_terms(p: Vector3<f64>) -> [Vector2<f64>; 4] {
    let r = p.xy().norm();
    if r < MIDDLE * p.z.abs() {
        return [Vector2::zeros(); 4];
    }
    let angle = r.atan2(p.z);
    let (outwards, t) = (p.xy() / r, angle * angle);
    let mut power = angle;
    [0; 4].map(|_| {
        power *= t;
        outwards * power
    })
}

/// Removes the distortion; what is shown at [`WIDEST`] or beyond is put there.
pub(super) fn undistort(k: [f64; 4], d: Vector2<f64>) -> Vector2<f64> {
    let far = d.norm();
    if far < MIDDLE { d } else { d * (angle(k, far).min(WIDEST).tan() / far) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::world::{Intrinsics, LensModel, Pixel};

    /// Numbers of `cv2.fisheye.projectPoints` (OpenCV 4.14) for f = 300, (320, 240), k = (0.05, -0.02, 0.01, -0.003).
    #[test]
    fn a_fisheye_is_opencvs_and_is_undone_to_where_it_looks_sideways() {
        let mut k = Intrinsics::centred(300.0, 641, 481);
        (k.k1, k.k2, k.k3, k.k4, k.model) = (0.05, -0.02, 0.01, -0.003, LensModel::Fisheye);
        for ([x, y], [u, v]) in CV2 {
            let n = Vector2::new(x, y);
            let pixel = k.pixel(n);
            assert!(pixel.distance(Pixel::new(u, v)) < 1e-6, "{pixel:?} {u} {v}");
            assert!((k.normalise(pixel) - n).norm() < 1e-9 * (1.0 + n.norm_squared()), "{n:?}");
            let direction = Vector3::new(x, y, 1.0).normalize();
            assert!((k.direction(pixel) - direction).norm() < 1e-12);
            let h = 1e-6;
            for (axis, step) in [Vector2::new(h, 0.0), Vector2::new(0.0, h)].iter().enumerate() {
                let by = (k.distort(n + step) - k.distort(n - step)) / (2.0 * h);
                assert!((by - k.distortion_slope(n).column(axis)).norm() < 1e-8, "{n:?}");
            }
        }
        // Behind the camera: 100 degrees from the axis.
        let mut wide = k;
        (wide.k1, wide.k2, wide.k3, wide.k4) = (0.0, 0.0, 0.0, 0.0);
        let back = wide.direction(Pixel::new(320.0 + 300.0 * 100_f64.to_radians(), 240.0));
        assert!((back.z - 100_f64.to_radians().cos()).abs() < 1e-12 && back.x > 0.9);
        let p = Vector3::new(0.5, -0.4, -0.1);
        let d = k.shown(p).unwrap();
        let (slope, _) = k.shown_slopes(p);
        for (axis, step) in Matrix3::identity().column_iter().enumerate() {
            let by = (k.shown(p + step * 1e-6).unwrap() - d) / 1e-6;
            assert!((by - slope.column(axis)).norm() < 1e-5, "{axis}");
        }
        let pixel = Pixel::new(k.fx * d.x + k.cx, k.fy * d.y + k.cy);
        assert!((k.direction(pixel) - p.normalize()).norm() < 1e-9);
    }

    /// `x = X/Z` and `y = Y/Z`, and where `OpenCV` puts them, px.
    const CV2: [([f64; 2], [f64; 2]); 4] = [
        ([0.1, -0.05], [349.894_356_278, 225.052_821_861]),
        ([0.8, 0.6], [513.235_321_450, 384.926_491_087]),
        ([-2.0, 1.5], [20.891_064_041, 464.331_701_969]),
        ([5.0, -8.0], [564.702_626_243, -151.524_201_989]),
    ];
}
