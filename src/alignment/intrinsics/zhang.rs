//! Zhang's closed form: the camera from homographies of a plane, then its polish.

use nalgebra::{DMatrix, Matrix3, SVector, Vector2, Vector3};

use super::gross::pairs;
use super::{
    Calibration, Error, OFF_CENTRE, Options, View, fisheye, numbers, polish, pose_from_homography,
};
use crate::alignment::TooAlike;
use crate::alignment::image_map::{self, Model, NoiseIn};
use crate::alignment::reprojection::INTRINSIC;
use crate::world::{Intrinsics, LensModel, Pixel, Pose, frame};

/// Calibrates from views of a planar target at z = 0 whose poses are unknown.
pub(super) fn planar(views: &[View], options: &Options) -> Result<Calibration, Error> {
    let mut row = 0;
    for view in views {
        for (point, _) in &view.points {
            let z = point.coords().z;
            if z.abs() > 1e-9 {
                return Err(Error::OffPlane { row, z });
            }
            row += 1;
        }
    }
    let map = image_map::Options { robust: false, noise: NoiseIn::Real, seed: 0 };
    let single = views.len() == 1;
    let skew = options.skew.unwrap_or(views.len() >= 3);
    if skew && views.len() < 3 {
        let why = TooAlike::Skew;
        return Err(Error::Views { views: views.len(), why });
    }
    if options.distortion.model() == LensModel::Fisheye {
        let (start, poses) = fisheye::start(views, centre(views, options))?;
        return polished(views, poses, &start, skew, options);
    }
    let mut homographies = Vec::new();
    for view in views {
        homographies.push(image_map::fit_map(&pairs(view), Model::Projective, &map)?.m);
    }
    let k = if single {
        one_view(&homographies[0], options)?
    } else {
        // Noise or a strong lens can leave the full closed form without a real solution; fewer unknowns
        // still give a start, and the polish frees the rest.
        let full = closed_form(&homographies, skew)?;
        let plain = if full.is_none() { closed_form(&homographies, false)? } else { None };
        full.or(plain)
            .or_else(|| square_pixels(&homographies, centre(views, options)))
            .ok_or(Error::Views { views: views.len(), why: TooAlike::NoFocalLength })?
    };
    let (width, height) = options.image_size.unwrap_or((0, 0));
    let start = Intrinsics {
        fx: k[(0, 0)],
        fy: k[(1, 1)],
        cx: k[(0, 2)],
        cy: k[(1, 2)],
        // A skew that is not fitted is 0; the closed form only keeps it small.
        skew: if skew { k[(0, 1)] } else { 0.0 },
        k1: 0.0,
        k2: 0.0,
        p1: 0.0,
        p2: 0.0,
        k3: 0.0,
        k4: 0.0,
        model: options.distortion.model(),
        width,
        height,
    };
    let poses = homographies
        .iter()
        .map(|h| pose_from_homography(&k, h))
        .collect::<Option<Vec<_>>>()
        .ok_or(Error::Views { views: views.len(), why: TooAlike::NotInFront })?;
    polished(views, poses, &start, skew, options)
}

/// The polish, and whether it is a calibration.
fn polished(
    views: &[View],
    poses: Vec<Pose<frame::World, frame::Camera>>,
    start: &Intrinsics,
    skew: bool,
    options: &Options,
) -> Result<Calibration, Error> {
    let single = views.len() == 1;
    if single && options.image_size.is_none() {
        return Err(Error::ImageSize);
    }
    let mut fixed = Vec::new();
    if !skew {
        fixed.push(4);
    }
    let aspect = single.then_some(1.0);
    if single {
        fixed.extend([2, 3]);
    }
    let mut calibration = polish(views, poses, start, fixed.clone(), Vec::new(), aspect, options)?;
    if single {
        doubt_the_centre(&mut calibration, views, &fixed, options)?;
    }
    let k = &calibration.intrinsics;
    let unsure = (calibration.std[0] / k.fx).max(calibration.std[1] / k.fy).abs();
    if unsure > UNSURE {
        let why = TooAlike::Unsure(unsure);
        return Err(Error::Views { views: views.len(), why });
    }
    Ok(calibration)
}

/// Adds to the doubt of one view's numbers that the principal point, which is taken as the picture's centre, is off it: how
/// much each changes where it is assumed a pixel farther on, times [`OFF_CENTRE`].
fn doubt_the_centre(
    calibration: &mut Calibration,
    views: &[View],
    fixed: &[usize],
    options: &Options,
) -> Result<(), Error> {
    let k = calibration.intrinsics;
    let pose = calibration.views[0].camera_from_world.inverse();
    let with = |shift: Vector2<f64>| {
        let start = Intrinsics { cx: k.cx + shift.x, cy: k.cy + shift.y, ..k };
        let fit =
            polish(views, vec![pose], &start, fixed.to_vec(), Vec::new(), Some(1.0), options)?;
        Ok::<_, Error>(numbers(&fit.intrinsics))
    };
    let is_fitted =
        SVector::<f64, INTRINSIC>::from_fn(|i, _| f64::from(u8::from(calibration.std[i] > 0.0)));
    let off = OFF_CENTRE * f64::from(k.width);
    for shift in [Vector2::x(), Vector2::y()] {
        let slope = (with(shift)? - with(-shift)?) * 0.5;
        let by = slope.component_mul(&is_fitted) * off;
        calibration.covariance += by * by.transpose();
    }
    let covariance = calibration.covariance;
    calibration.std = std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt());
    Ok(())
}

/// A focal length less certain than this is no calibration.
const UNSURE: f64 = 0.2;

/// The principal point to start from: the picture's centre, or where the points are.
fn centre(views: &[View], options: &Options) -> (f64, f64) {
    if let Some((width, height)) = options.image_size {
        return ((f64::from(width) - 1.0) / 2.0, (f64::from(height) - 1.0) / 2.0);
    }
    let pixels: Vec<Pixel> =
        views.iter().flat_map(|v| v.points.iter().map(|(_, pixel)| *pixel)).collect();
    let n = pixels.len().max(1) as f64;
    (pixels.iter().map(|p| p.u).sum::<f64>() / n, pixels.iter().map(|p| p.v).sum::<f64>() / n)
}

/// The focal length from one view, square pixels and the principal point in the centre of the picture.
fn one_view(h: &Matrix3<f64>, options: &Options) -> Result<Matrix3<f64>, Error> {
    let (width, height) = options.image_size.ok_or(Error::ImageSize)?;
    let middle = ((f64::from(width) - 1.0) / 2.0, (f64::from(height) - 1.0) / 2.0);
    square_pixels(std::slice::from_ref(h), middle)
        .ok_or(Error::Views { views: 1, why: TooAlike::FaceOn })
}

/// The focal length with square pixels and the principal point given, `None` when the planes are seen
/// face-on.
///
/// The axes of a plane are at right angles and equally long: two equations in `1/f²` per view.
fn square_pixels(homographies: &[Matrix3<f64>], (cx, cy): (f64, f64)) -> Option<Matrix3<f64>> {
    let (mut along, mut square, mut tilt) = (0.0, 0.0, 0.0_f64);
    for h in homographies {
        let c = Matrix3::new(1.0, 0.0, -cx, 0.0, 1.0, -cy, 0.0, 0.0, 1.0) * h;
        let c = c / c.column(0).norm().max(c.column(1).norm());
        let (a, b): (Vector3<f64>, Vector3<f64>) = (c.column(0).into(), c.column(1).into());
        let right = (a.x * b.x + a.y * b.y, -a.z * b.z);
        let equal = (a.x * a.x + a.y * a.y - b.x * b.x - b.y * b.y, b.z * b.z - a.z * a.z);
        along += right.0 * right.1 + equal.0 * equal.1;
        square += right.0 * right.0 + equal.0 * equal.0;
        tilt = tilt.max(a.z.hypot(b.z));
    }
    let w = along / square;
    // Columns have length 1 in pixels, so a tilt of 1e-9 per pixel is rounding.
    if !(w > 0.0 && w.is_finite() && tilt > 1e-9) {
        return None;
    }
    let f = 1.0 / w.sqrt();
    Some(Matrix3::new(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0))
}

/// Zhang 2000, Eq. 9 and Appendix B, in pixels scaled to about 1; `None` when noise or a strong lens
/// leaves no real solution.
fn closed_form(homographies: &[Matrix3<f64>], skew: bool) -> Result<Option<Matrix3<f64>>, Error> {
    let views = homographies.len();
    // Where the target's origin and its surroundings appear says how large the picture is, roughly.
    let centre: Vector3<f64> =
        homographies.iter().map(|h| h.column(2) / h[(2, 2)]).sum::<Vector3<f64>>() / views as f64;
    let size = centre.x.abs().max(centre.y.abs()).max(100.0);
    let normal = Matrix3::new(
        1.0 / size,
        0.0,
        -centre.x / size,
        0.0,
        1.0 / size,
        -centre.y / size,
        0.0,
        0.0,
        1.0,
    );
    let mut v = DMatrix::zeros(2 * views + usize::from(!skew), 6);
    for (i, h) in homographies.iter().enumerate() {
        // Columns of the plane are in metres; their length says nothing here.
        let h = normal * h;
        let h = h / h.column(0).norm().max(h.column(1).norm());
        let pair = |a: usize, b: usize| {
            let (p, q) = (h.column(a), h.column(b));
            [
                p[0] * q[0],
                p[0] * q[1] + p[1] * q[0],
                p[1] * q[1],
                p[2] * q[0] + p[0] * q[2],
                p[2] * q[1] + p[1] * q[2],
                p[2] * q[2],
            ]
        };
        let (v12, v11, v22) = (pair(0, 1), pair(0, 0), pair(1, 1));
        for c in 0..6 {
            v[(2 * i, c)] = v12[c];
            v[(2 * i + 1, c)] = v11[c] - v22[c];
        }
    }
    if !skew {
        v[(2 * views, 1)] = 1.0;
    }
    // Fewer rows than columns would hide the null space from a thin decomposition.
    let eigen = nalgebra::SymmetricEigen::new(v.transpose() * &v);
    let mut order: Vec<usize> = (0..6).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    if eigen.eigenvalues[order[1]] < 1e-12 * eigen.eigenvalues[order[5]] {
        let why = TooAlike::Parallel;
        return Err(Error::Views { views, why });
    }
    let b = eigen.eigenvectors.column(order[0]).clone_owned();
    let b = if b[0] < 0.0 { -b } else { b };
    let minor = b[0] * b[2] - b[1] * b[1];
    let v0 = (b[1] * b[3] - b[0] * b[4]) / minor;
    let lambda = b[5] - (b[3] * b[3] + v0 * (b[1] * b[3] - b[0] * b[4])) / b[0];
    let (alpha2, beta2) = (lambda / b[0], lambda * b[0] / minor);
    if !(alpha2 > 0.0 && beta2 > 0.0) {
        return Ok(None);
    }
    let (alpha, beta) = (alpha2.sqrt(), beta2.sqrt());
    let gamma = -b[1] * alpha2 * beta / lambda;
    let u0 = gamma * v0 / beta - b[3] * alpha2 / lambda;
    let k = Matrix3::new(alpha, gamma, u0, 0.0, beta, v0, 0.0, 0.0, 1.0);
    let back = Matrix3::new(size, 0.0, centre.x, 0.0, size, centre.y, 0.0, 0.0, 1.0);
    let k = back * k;
    Ok(k.iter().all(|x| x.is_finite()).then_some(k))
}
