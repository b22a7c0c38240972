//! The camera of the scene from one picture: a rough guess, made true by points of known position.
//!
//! The points are the table's marks (z = 0) and, where there are any, points above the table. A single
//! view of a plane leaves the principal point and the focal length loosely held, so each parameter has a
//! prior about the guess, and what only the prior holds is named. [`Refine::pose_only`] and
//! [`Refine::intrinsics_only`] keep the rest as guessed: regressions 1 or 2 switched off.
//!
//! Fitting starts from the guess and from both poses that a plane's homography allows, so that a guess
//! that is far off still ends at the right one of them.
//!
//! Source: Hartley and Zisserman, 2nd ed., §7.2–7.4; Schweighofer and Pinz, "Robust Pose Estimation from
//! a Planar Target", PAMI 2006 (the two poses).

use nalgebra::{DMatrix, Matrix2, Unit, UnitQuaternion, Vector2, Vector3};

use super::Error;
use super::image_map::{self, Model, Pair};
use super::intrinsics::{NAMES, pose_from_homography};
use super::reprojection::{INTRINSIC, POSE, Reprojection, Seen};
use crate::fit::{self, Noise, Prior};
use crate::world::{Camera, Intrinsics, Pixel, Point, Pose, frame};

/// A point of known position and where the picture shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Where it is.
    pub point: Point<frame::World>,
    /// Where it appears.
    pub pixel: Pixel,
    /// Standard deviation of the pixel, per coordinate, px.
    pub sigma: f64,
}

/// What is known of the camera before looking: standard deviations about the guess; infinite for
/// nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Of where it stands, per axis, m.
    pub position: f64,
    /// Of its direction, per axis, rad.
    pub rotation: f64,
    /// Of the focal length, as a part of it.
    pub focal: f64,
    /// Of the principal point, per axis, px.
    pub principal: f64,
    /// Of `k1`.
    pub k1: f64,
    /// Of `k2`.
    pub k2: f64,
}

impl Default for Priors {
    /// A camera set up by hand: anywhere, but with a lens and a sensor as they are usually made.
    fn default() -> Self {
        Self {
            position: f64::INFINITY,
            rotation: f64::INFINITY,
            focal: 0.3,
            principal: 20.0,
            k1: 0.3,
            k2: 0.1,
        }
    }
}

/// How far a place and a length on the table are off with a camera of which only this much is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation of the place, in the worst direction, m.
    pub place: f64,
    /// Standard deviation of a length, the worse of two directions, as a part of it.
    pub length: f64,
}

impl Priors {
    /// A camera that stands where a scene guesses: a tripod put down by eye, as the laboratory's settings draw it.
    pub fn by_eye() -> Self {
        Self { position: 0.025, rotation: 2.0_f64.to_radians(), focal: 0.05, ..Self::default() }
    }

    /// Returns what these standard deviations of `camera` come to at a place of the table, m; infinite where a camera so far
    /// off no longer sees it. The lens's bending is left aside.
    pub fn on_table(&self, camera: &Camera, at: Vector2<f64>) -> Spread {
        self.spread(camera, at).unwrap_or(Spread { place: f64::INFINITY, length: f64::INFINITY })
    }

    fn spread(&self, camera: &Camera, at: Vector2<f64>) -> Option<Spread> {
        /// Half of a length that is looked at, m: of a thing that a hand can take.
        const HALF: f64 = 0.05;
        let ends: [Vector2<f64>; 5] =
            [Vector2::x(), -Vector2::x(), Vector2::y(), -Vector2::y(), Vector2::zeros()];
        let mut pixels = [Pixel::new(0.0, 0.0); 5];
        for (pixel, end) in pixels.iter_mut().zip(&ends) {
            let on_table = (at + HALF * end).push(0.0);
            *pixel = camera.project(Point::<frame::World>::from(on_table))?;
        }
        let mut of_place = Matrix2::<f64>::zeros();
        let mut of_length = Vector2::<f64>::zeros();
        for nudged in self.nudged(camera) {
            let mut seen = [Vector2::<f64>::zeros(); 5];
            for (seen, pixel) in seen.iter_mut().zip(&pixels) {
                *seen = nudged.on_plane(*pixel, 0.0)?.coords().xy();
            }
            let off = seen[4] - at;
            of_place += off * off.transpose();
            for (axis, sum) in of_length.iter_mut().enumerate() {
                let length = (seen[2 * axis] - seen[2 * axis + 1]).norm();
                *sum += (length / (2.0 * HALF) - 1.0).powi(2);
            }
        }
        let place = of_place.symmetric_eigenvalues().max().max(0.0).sqrt();
        Some(Spread { place, length: of_length.max().sqrt() })
    }

    /// The camera with one number after another off by its standard deviation: place, direction, focal length, centre.
    fn nudged(&self, camera: &Camera) -> Vec<Camera> {
        let pose = camera.world_from_camera;
        let mut all = Vec::new();
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let turn = UnitQuaternion::from_scaled_axis(self.rotation * axis);
            let moved = Pose::from_parts(pose.origin() + self.position * axis, pose.rotation());
            let turned = Pose::from_parts(pose.origin(), pose.rotation() * turn);
            all.push(Camera { world_from_camera: moved, ..*camera });
            all.push(Camera { world_from_camera: turned, ..*camera });
        }
        let [mut zoomed, mut right, mut down] = [*camera; 3];
        zoomed.intrinsics.fx *= 1.0 + self.focal;
        zoomed.intrinsics.fy *= 1.0 + self.focal;
        right.intrinsics.cx += self.principal;
        down.intrinsics.cy += self.principal;
        all.extend([zoomed, right, down]);
        all
    }
}

/// What to refine; what is `false` stays as guessed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each names a parameter that may be free")]
pub struct Refine {
    /// Where the camera stands and looks.
    pub pose: bool,
    /// The focal length; the pixels' aspect stays as guessed.
    pub focal: bool,
    /// The principal point.
    pub principal: bool,
    /// The first radial distortion.
    pub k1: bool,
    /// The second radial distortion.
    pub k2: bool,
    /// What is known beforehand.
    pub priors: Priors,
    /// Whether sightings may be outliers.
    pub robust: bool,
}

impl Refine {
    /// Everything but `k2`.
    pub fn all() -> Self {
        Self {
            pose: true,
            focal: true,
            principal: true,
            k1: true,
            k2: false,
            priors: Priors::default(),
            robust: true,
        }
    }

    /// Only where the camera stands and looks.
    pub fn pose_only() -> Self {
        Self { focal: false, principal: false, k1: false, ..Self::all() }
    }

    /// Only what is inside the camera. The principal point stays as guessed: with the pose believed it would
    /// take up the camera's turn, and it would be the pose that is fitted, by another name.
    pub fn intrinsics_only() -> Self {
        Self { pose: false, principal: false, ..Self::all() }
    }
}

/// The parameters in the order of [`CameraFit::covariance`]: turns about the camera's axes in
/// rad, shifts along the world's in m.
pub const PARAMETERS: [&str; INTRINSIC + POSE] = [
    NAMES[0], NAMES[1], NAMES[2], NAMES[3], NAMES[4], NAMES[5], NAMES[6], NAMES[7], NAMES[8],
    NAMES[9], NAMES[10], "turn_x", "turn_y", "turn_z", "x", "y", "z",
];

/// The camera and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFit {
    /// The camera.
    pub camera: Camera,
    /// Standard deviations of [`PARAMETERS`]; 0 for what was kept.
    pub std: [f64; INTRINSIC + POSE],
    /// Covariance of [`PARAMETERS`].
    pub covariance: DMatrix<f64>,
    /// Root mean square reprojection error of the sightings kept, px.
    pub rms_px: f64,
    /// The residuals over what the sightings' sigmas promise: near 1 when all is as said. Above 1 the
    /// covariance is widened by it.
    pub chi: f64,
    /// Sightings left out, in order.
    pub outliers: Vec<usize>,
    /// Parameters that the points hardly determine: the answer is mostly the guess.
    pub unobservable: Vec<&'static str>,
    /// How far the camera moved from the guess, m.
    pub moved_m: f64,
    /// How far it turned, rad.
    pub turned_rad: f64,
}

impl CameraFit {
    /// Returns the covariance (m²) of the point where a pixel's ray meets the horizontal plane at `z` m,
    /// as far as it comes from the camera; `None` when the ray never meets it.
    pub fn plane_covariance(&self, pixel: Pixel, z: f64) -> Option<Matrix2<f64>> {
        let n = INTRINSIC + POSE;
        let mut j = DMatrix::zeros(2, n);
        for i in 0..n {
            let h = 1e-3 * self.std[i];
            if h <= 0.0 {
                continue;
            }
            let at = |step: f64| self.nudged(i, step).on_plane(pixel, z).map(|p| p.coords());
            let slope = (at(h)? - at(-h)?) / (2.0 * h);
            (j[(0, i)], j[(1, i)]) = (slope.x, slope.y);
        }
        let c = &j * &self.covariance * j.transpose();
        Some(Matrix2::new(c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]))
    }

    /// The camera with one parameter changed.
    fn nudged(&self, parameter: usize, step: f64) -> Camera {
        let problem = Reprojection {
            seen: Vec::new(),
            poses: vec![self.camera.world_from_camera],
            aspect: None,
            size: (self.camera.intrinsics.width, self.camera.intrinsics.height),
            lens: self.camera.intrinsics.model,
        };
        let mut x = problem.start(&self.camera.intrinsics);
        x[parameter] += step;
        Camera { intrinsics: problem.intrinsics(&x), world_from_camera: problem.pose(&x, 0) }
    }
}

/// A parameter is called unobservable when the data narrow its prior by less than this.
const HARDLY: f64 = 0.9;
/// A sighting farther off than this many standard deviations is left out: 1 in 3000 clean ones.
const CUT: f64 = 4.0;

/// Refines a guess of the camera so that known points appear where they were seen.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`], [`Error::BehindCamera`] when the guess (with the pose kept)
/// looks away from a point, and [`Error::Degenerate`] when neither points nor priors hold a parameter.
pub fn refine_camera(
    guess: &Camera,
    sightings: &[Sighting],
    refine: &Refine,
) -> Result<CameraFit, Error> {
    for (row, s) in sightings.iter().enumerate() {
        let p = s.point.coords();
        let finite = [p.x, p.y, p.z, s.pixel.u, s.pixel.v].iter().all(|v| v.is_finite());
        if !(finite && s.sigma > 0.0 && s.sigma.is_finite()) {
            return Err(Error::NotFinite { what: "the sightings", row });
        }
    }
    let needed = if refine.pose { 4 } else { 2 };
    if sightings.len() < needed {
        let given = sightings.len();
        return Err(Error::TooFew { what: "the camera", of: "points", needed, given });
    }
    let k = guess.intrinsics;
    let problem = Reprojection {
        seen: sightings
            .iter()
            .map(|s| Seen { view: 0, point: s.point.coords(), pixel: s.pixel, sigma: s.sigma })
            .collect(),
        poses: vec![guess.world_from_camera],
        aspect: Some(k.fx / k.fy),
        size: (k.width, k.height),
        lens: k.model,
    };
    let options = options(&k, refine);
    let mut starts = vec![guess.world_from_camera];
    if refine.pose {
        starts.extend(plane_poses(&k, sightings));
    }
    let mut best: Option<(f64, fit::Rejection)> = None;
    let mut refused = None;
    for pose in starts {
        let mut x = problem.start(&k);
        problem.set_pose(&mut x, 0, &pose);
        let found = if refine.robust {
            fit::solve_rejecting(&problem, &x, &options, CUT)
        } else {
            fit::solve(&problem, &x, &options)
                .map(|fit| fit::Rejection { fit, outliers: Vec::new() })
        };
        match found {
            Ok(found) => {
                // A sighting left out costs as much as one at the limit.
                let cost = found.fit.cost + 0.5 * CUT * CUT * found.outliers.len() as f64;
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, found));
                }
            }
            Err(fit::Error::NotFinite { residual }) => {
                refused = Some(Error::BehindCamera { row: residual / 2 });
            }
            Err(error) => refused = Some(error.into()),
        }
    }
    match (best, refused) {
        (Some((_, found)), _) => summary(guess, &problem, &found, &options),
        (None, Some(error)) => Err(error),
        (None, None) => Err(Error::Degenerate { model: "the camera", free: 1 }),
    }
}

fn options(k: &Intrinsics, refine: &Refine) -> fit::Options {
    // fy follows fx, and one view of a plane cannot tell skew.
    // The lens's further terms stay as guessed: one view does not tell them.
    let mut fixed = vec![1, 4, 7, 8, 9, 10];
    let mut priors = Vec::new();
    let p = refine.priors;
    let mut free = |on: bool, parameter: usize, mean: f64, std: f64| {
        if on {
            priors.push(Prior { parameter, mean, std });
        } else {
            fixed.push(parameter);
        }
    };
    free(refine.focal, 0, k.fx, p.focal * k.fx);
    free(refine.principal, 2, k.cx, p.principal);
    free(refine.principal, 3, k.cy, p.principal);
    free(refine.k1, 5, k.k1, p.k1);
    free(refine.k2, 6, k.k2, p.k2);
    for axis in 0..3 {
        free(refine.pose, INTRINSIC + axis, 0.0, p.rotation);
        free(refine.pose, INTRINSIC + 3 + axis, 0.0, p.position);
    }
    fixed.sort_unstable();
    fit::Options {
        fixed,
        priors,
        noise: Noise::Known,
        max_iterations: 200,
        ..fit::Options::default()
    }
}

/// The two poses that a picture of the plane z = 0 allows, with the guessed camera's inside.
fn plane_poses(k: &Intrinsics, sightings: &[Sighting]) -> Vec<Pose<frame::World, frame::Camera>> {
    let on_plane: Vec<&Sighting> =
        sightings.iter().filter(|s| s.point.coords().z.abs() < 1e-9).collect();
    let pairs: Vec<Pair> = on_plane
        .iter()
        .map(|s| {
            // Undistorted, in pixels of the same pinhole, so that the noise keeps its unit.
            let n = k.normalise(s.pixel);
            let p = s.point.coords();
            let real = Pixel::new(k.fx * n.x + k.skew * n.y + k.cx, k.fy * n.y + k.cy);
            Pair { real, twin: Pixel::new(p.x, p.y) }
        })
        .collect();
    let options = image_map::Options { noise: image_map::NoiseIn::Real, ..Default::default() };
    let Ok(map) = image_map::fit_map(&pairs, Model::Projective, &options) else {
        return Vec::new();
    };
    let Some(pose) = pose_from_homography(&k.matrix(), &map.m) else { return Vec::new() };
    // The other pose turns the plane's normal to the other side of the ray to the points' centre.
    let centre = on_plane.iter().map(|s| s.point.coords()).sum::<Vector3<f64>>()
        / on_plane.len().max(1) as f64;
    let ray = (centre - pose.origin()).normalize();
    let normal = Vector3::z();
    let axis = ray.cross(&normal);
    let mut poses = vec![pose];
    if axis.norm() > 1e-6 {
        let angle = (-ray.dot(&normal)).clamp(-1.0, 1.0).acos();
        let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), 2.0 * angle);
        for turn in [turn, turn.inverse()] {
            let eye = centre + turn * (pose.origin() - centre);
            poses.push(Pose::from_parts(eye, turn * pose.rotation()));
        }
    }
    poses
}

fn summary(
    guess: &Camera,
    problem: &Reprojection,
    found: &fit::Rejection,
    options: &fit::Options,
) -> Result<CameraFit, Error> {
    let fit = &found.fit;
    if !fit.conditioning.undetermined.is_empty() {
        let free = fit.conditioning.undetermined.len();
        return Err(Error::Degenerate { model: "the camera", free });
    }
    let camera = Camera {
        intrinsics: problem.intrinsics(&fit.x),
        world_from_camera: problem.pose(&fit.x, 0),
    };
    let kept: Vec<usize> =
        (0..problem.seen.len()).filter(|i| !found.outliers.contains(i)).collect();
    let (mut squares, mut whitened) = (0.0, 0.0);
    for &i in &kept {
        let e = Vector2::new(fit.residuals[2 * i], fit.residuals[2 * i + 1]).norm_squared();
        whitened += e;
        squares += e * problem.seen[i].sigma.powi(2);
    }
    // Parameters beyond the finite priors are what the data had to pay for.
    let free = INTRINSIC + POSE - options.fixed.len();
    let held = options.priors.iter().filter(|p| p.std.is_finite()).count();
    let told = (2 * kept.len() + held).saturating_sub(free);
    let chi = if told > 0 { (whitened / told as f64).sqrt() } else { 1.0 };
    let mut covariance = &fit.covariance * chi.max(1.0).powi(2);
    let a = camera.intrinsics.fy / camera.intrinsics.fx;
    let row = covariance.row(0) * a;
    covariance.row_mut(1).copy_from(&row);
    let column = covariance.column(0) * a;
    covariance.column_mut(1).copy_from(&column);
    let mut std = [0.0; INTRINSIC + POSE];
    for (i, s) in std.iter_mut().enumerate() {
        *s = covariance[(i, i)].max(0.0).sqrt();
    }
    let mut unobservable: Vec<&'static str> = options
        .priors
        .iter()
        .filter(|p| p.std.is_finite() && fit.std(p.parameter) > HARDLY * p.std)
        .map(|p| PARAMETERS[p.parameter])
        .collect();
    for direction in &fit.conditioning.unobservable {
        for (i, _) in &direction.parameters {
            if !unobservable.contains(&PARAMETERS[*i]) {
                unobservable.push(PARAMETERS[*i]);
            }
        }
    }
    let (from, to) = (guess.world_from_camera, camera.world_from_camera);
    Ok(CameraFit {
        camera,
        std,
        covariance,
        rms_px: (squares / kept.len().max(1) as f64).sqrt(),
        chi,
        outliers: found.outliers.clone(),
        unobservable,
        moved_m: (to.origin() - from.origin()).norm(),
        turned_rad: to.rotation().angle_to(&from.rotation()),
    })
}
