//! Regression 2: what is inside the camera (Eq. 4 to 6), from points of known position and their pixels.
//!
//! [`calibrate`] takes views. Where all extrinsics are known, `u = fx (X/Z) + cx` and `v = fy (Y/Z) + cy`
//! are two straight lines, polished together with the distortion. Where none are, every view is one of a
//! planar target (z = 0) and the camera comes from Zhang's closed form, or of a fisheye from a search of the focal length
//! (`fisheye.rs`), polished over all poses. Which terms
//! a lens needs is [`lens::choose`]'s question, what views lack [`coverage`]'s. Finding
//! the one camera of the scene from a rough guess is [`crate::alignment::camera_fit`]'s work.
//!
//! Source: Zhang, "A Flexible New Technique for Camera Calibration", PAMI 2000, §3 and Appendix B.

pub mod coverage;
mod fisheye;
mod gross;
pub mod lens;
pub mod strays;
mod zhang;

use nalgebra::{Matrix3, SVector, Vector2, Vector3};

use super::reprojection::{INTRINSIC, LENS, POSE, Reprojection, Seen};
use super::{Error, TooAlike};
use crate::fit::{self, Fit, Noise, Prior};
use crate::world::{Intrinsics, LensModel, Pixel, Point, Pose, frame};

/// What one picture shows of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Its name in files and messages.
    pub name: String,
    /// Points in world (or target) coordinates and where they appear.
    pub points: Vec<(Point<frame::World>, Pixel)>,
    /// Where the camera stood, if known.
    pub world_from_camera: Option<Pose<frame::World, frame::Camera>>,
}

/// Which terms of the lens to fit; the others are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Distortion {
    /// None: a pinhole.
    None,
    /// `k1`.
    K1,
    /// `k1` and `k2`.
    #[default]
    K1K2,
    /// `k1`, `k2` and `k3`.
    K1K2K3,
    /// `k1`, and the tangential `p1` and `p2`.
    K1P1P2,
    /// `k1`, `k2`, `p1` and `p2`.
    K1K2P1P2,
    /// All five.
    K1K2P1P2K3,
    /// A fisheye that shows angles as they are.
    FisheyeNone,
    /// A fisheye with `k1`.
    FisheyeK1,
    /// A fisheye with `k1` and `k2`.
    FisheyeK1K2,
    /// A fisheye with `k1`, `k2` and `k3`.
    FisheyeK1K2K3,
    /// A fisheye with all four terms.
    Fisheye,
}

impl Distortion {
    /// All choices: those of Brown's lens, then those of a fisheye, each with fewer terms first.
    pub const ALL: [Self; 12] = [
        Self::None,
        Self::K1,
        Self::K1K2,
        Self::K1K2K3,
        Self::K1P1P2,
        Self::K1K2P1P2,
        Self::K1K2P1P2K3,
        Self::FisheyeNone,
        Self::FisheyeK1,
        Self::FisheyeK1K2,
        Self::FisheyeK1K2K3,
        Self::Fisheye,
    ];

    /// Returns the choice of that name on the command line.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|choice| choice.name() == name)
    }

    /// Returns its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::K1 => "k1",
            Self::K1K2 => "k1k2",
            Self::K1K2K3 => "k1k2k3",
            Self::K1P1P2 => "k1p1p2",
            Self::K1K2P1P2 => "k1k2p1p2",
            Self::K1K2P1P2K3 => "k1k2p1p2k3",
            Self::FisheyeNone => "fisheye-none",
            Self::FisheyeK1 => "fisheye-k1",
            Self::FisheyeK1K2 => "fisheye-k1k2",
            Self::FisheyeK1K2K3 => "fisheye-k1k2k3",
            Self::Fisheye => "fisheye",
        }
    }

    /// Returns what the terms mean.
    pub fn model(self) -> LensModel {
        match self {
            Self::FisheyeNone
            | Self::FisheyeK1
            | Self::FisheyeK1K2
            | Self::FisheyeK1K2K3
            | Self::Fisheye => LensModel::Fisheye,
            _ => LensModel::Brown,
        }
    }

    /// Whether `p1` and `p2` are fitted.
    pub fn is_tangential(self) -> bool {
        self.terms()[2]
    }

    /// Returns which of `k1, k2, p1, p2, k3, k4` are fitted.
    pub fn terms(self) -> [bool; INTRINSIC - LENS] {
        let named: &[&str] = match self {
            Self::None | Self::FisheyeNone => &[],
            Self::K1 | Self::FisheyeK1 => &["k1"],
            Self::K1K2 | Self::FisheyeK1K2 => &["k1", "k2"],
            Self::K1K2K3 | Self::FisheyeK1K2K3 => &["k1", "k2", "k3"],
            Self::K1P1P2 => &["k1", "p1", "p2"],
            Self::K1K2P1P2 => &["k1", "k2", "p1", "p2"],
            Self::K1K2P1P2K3 => &["k1", "k2", "p1", "p2", "k3"],
            Self::Fisheye => &["k1", "k2", "k3", "k4"],
        };
        std::array::from_fn(|term| named.contains(&NAMES[LENS + term]))
    }
}

/// How well the extrinsics are known, when they are to be refined as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtrinsicsPrior {
    /// Standard deviation of where the camera stands, per axis, m.
    pub position: f64,
    /// Standard deviation of its direction, per axis, rad.
    pub rotation: f64,
}

/// How to calibrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Which distortion to fit.
    pub distortion: Distortion,
    /// Whether to fit a skew; `None` for yes with three or more planar views and no otherwise.
    pub skew: Option<bool>,
    /// With known extrinsics, refine them too, as far as this allows.
    pub refine_extrinsics: Option<ExtrinsicsPrior>,
    /// Expected noise of a pixel coordinate, px: weighs pixels against the prior on the extrinsics.
    pub sigma_px: f64,
    /// Width and height of the pictures, px; needed for a single planar view only.
    pub image_size: Option<(u32, u32)>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            distortion: Distortion::K1K2,
            skew: None,
            refine_extrinsics: None,
            sigma_px: 0.5,
            image_size: None,
        }
    }
}

/// How far the points spread in normalised coordinates: the lever of the two straight-line fits,
/// `var(fx) = σ² / (N var(X/Z))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leverage {
    /// Standard deviation of `X/Z`.
    pub std_x: f64,
    /// Standard deviation of `Y/Z`.
    pub std_y: f64,
    /// Mean of `X/Z`; the correlation of `fx` and `cx` follows it.
    pub mean_x: f64,
    /// Mean of `Y/Z`.
    pub mean_y: f64,
}

/// One view after calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFit {
    /// Its name.
    pub name: String,
    /// Where the target was seen from.
    pub camera_from_world: Pose<frame::Camera, frame::World>,
    /// Root mean square reprojection error of its points, px.
    pub rms_px: f64,
    /// How far the camera moved from the extrinsics given, m (0 where none were).
    pub moved_m: f64,
    /// How far it turned, rad.
    pub turned_rad: f64,
}

/// The camera and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The camera; width and height are 0 where no image size was given.
    pub intrinsics: Intrinsics,
    /// Standard deviations of [`NAMES`]: px, and 1 for the lens's terms; 0 for what was not fitted.
    pub std: [f64; INTRINSIC],
    /// Covariance of [`NAMES`].
    pub covariance: nalgebra::SMatrix<f64, INTRINSIC, INTRINSIC>,
    /// Where each point of each view appears less where it was seen, px, in the order given.
    pub residuals: Vec<Vec<Vector2<f64>>>,
    /// Root mean square reprojection error per point, px.
    pub rms_px: f64,
    /// Standard deviation of the noise of one pixel coordinate, px.
    pub noise_px: f64,
    /// The views in the order given.
    pub views: Vec<ViewFit>,
    /// The lever of the straight-line fits; `None` for planar targets without extrinsics.
    pub leverage: Option<Leverage>,
    /// Least singular value over the largest of the scaled problem.
    pub conditioning: f64,
}

/// Finds what is inside the camera.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`], [`Error::NoLeverage`], [`Error::BehindCamera`],
/// [`Error::OffPlane`], [`Error::Views`], [`Error::ImageSize`], and [`Error::Length`] when only some of
/// the views have extrinsics.
pub fn calibrate(views: &[View], options: &Options) -> Result<Calibration, Error> {
    let n: usize = views.iter().map(|v| v.points.len()).sum();
    if views.is_empty() || n == 0 {
        return Err(Error::TooFew { what: "the camera", of: "points", needed: 4, given: n });
    }
    let rows = views.iter().flat_map(|v| &v.points);
    for (row, (point, pixel)) in rows.enumerate() {
        let p = point.coords();
        if ![p.x, p.y, p.z, pixel.u, pixel.v].iter().all(|v| v.is_finite()) {
            return Err(Error::NotFinite { what: "the points", row });
        }
    }
    let known = views.iter().filter(|v| v.world_from_camera.is_some()).count();
    if known == views.len() {
        with_extrinsics(views, options)
    } else if known == 0 {
        zhang::planar(views, options)
    } else {
        Err(Error::Length { what: "views with extrinsics", given: known, expected: views.len() })
    }
}

/// Below this spread of `X/Z` one pixel of noise is a whole focal length at f = 1000 px.
const LEAST_SPREAD: f64 = 1e-3;

fn with_extrinsics(views: &[View], options: &Options) -> Result<Calibration, Error> {
    let poses: Vec<_> = views.iter().filter_map(|v| v.world_from_camera).collect();
    let mut normalised = Vec::new();
    for (view, pose) in views.iter().zip(&poses) {
        let camera_from_world = pose.inverse();
        for (point, pixel) in &view.points {
            let p = (camera_from_world * *point).coords();
            if p.z <= 1e-9 {
                return Err(Error::BehindCamera { row: normalised.len() });
            }
            normalised.push((Vector2::new(p.x / p.z, p.y / p.z), *pixel));
        }
    }
    let skew = options.skew.unwrap_or(false);
    let needed = if skew { 4 } else { 3 };
    if normalised.len() < needed {
        let given = normalised.len();
        return Err(Error::TooFew { what: "the camera", of: "points", needed, given });
    }
    let n = normalised.len() as f64;
    let mean = normalised.iter().map(|(p, _)| p).sum::<Vector2<f64>>() / n;
    let spread = |axis: usize| {
        (normalised.iter().map(|(p, _)| (p[axis] - mean[axis]).powi(2)).sum::<f64>() / n).sqrt()
    };
    let leverage = Leverage { std_x: spread(0), std_y: spread(1), mean_x: mean.x, mean_y: mean.y };
    for (axis, spread) in [('X', leverage.std_x), ('Y', leverage.std_y)] {
        if spread < LEAST_SPREAD {
            let relative = 100.0 / (1000.0 * spread.max(1e-12) * n.sqrt());
            return Err(Error::NoLeverage { axis, spread, relative });
        }
    }
    // Two straight lines: u against X/Z and v against Y/Z.
    let line = |axis: usize, value: fn(&Pixel) -> f64| {
        let centre = normalised.iter().map(|(_, p)| value(p)).sum::<f64>() / n;
        let slope = normalised
            .iter()
            .map(|(x, p)| (x[axis] - mean[axis]) * (value(p) - centre))
            .sum::<f64>()
            / normalised.iter().map(|(x, _)| (x[axis] - mean[axis]).powi(2)).sum::<f64>();
        (slope, centre - slope * mean[axis])
    };
    let ((fx, cx), (fy, cy)) = (line(0, |p| p.u), line(1, |p| p.v));
    let (width, height) = options.image_size.unwrap_or((0, 0));
    let start = Intrinsics { fx, fy, cx, cy, width, height, ..Intrinsics::centred(fx, 0, 0) };
    let mut fixed = Vec::new();
    let mut priors = Vec::new();
    for view in 0..poses.len() {
        let first = INTRINSIC + POSE * view;
        match options.refine_extrinsics {
            None => fixed.extend(first..first + POSE),
            Some(prior) => {
                for k in 0..3 {
                    let (turn, shift) = (first + k, first + 3 + k);
                    priors.push(Prior { parameter: turn, mean: 0.0, std: prior.rotation });
                    priors.push(Prior { parameter: shift, mean: 0.0, std: prior.position });
                }
            }
        }
    }
    if !skew {
        fixed.push(4);
    }
    let mut calibration = polish(views, poses, &start, fixed, priors, None, options)?;
    calibration.leverage = Some(leverage);
    Ok(calibration)
}

/// Levenberg–Marquardt over everything, and the answer.
fn polish(
    views: &[View],
    poses: Vec<Pose<frame::World, frame::Camera>>,
    start: &Intrinsics,
    mut fixed: Vec<usize>,
    priors: Vec<Prior>,
    aspect: Option<f64>,
    options: &Options,
) -> Result<Calibration, Error> {
    let terms = options.distortion.terms();
    fixed.extend((0..terms.len()).filter(|&term| !terms[term]).map(|term| LENS + term));
    if aspect.is_some() {
        fixed.push(1);
    }
    let sigma = options.sigma_px;
    let seen = views
        .iter()
        .enumerate()
        .flat_map(|(view, v)| {
            v.points.iter().map(move |(point, pixel)| Seen {
                view,
                point: point.coords(),
                pixel: *pixel,
                sigma,
            })
        })
        .collect();
    let size = options.image_size.unwrap_or((0, 0));
    let lens = options.distortion.model();
    let problem = Reprojection { seen, poses, aspect, size, lens };
    // Without priors the size of sigma cancels and the noise is taken from the residuals.
    let noise = if priors.is_empty() { Noise::Estimated } else { Noise::Known };
    let solver =
        fit::Options { fixed, priors, noise, max_iterations: 200, ..fit::Options::default() };
    let fit = fit::solve(&problem, &problem.start(start), &solver)?;
    if let Some(direction) = fit.conditioning.unobservable.first()
        && !fit.conditioning.undetermined.is_empty()
    {
        return Err(Error::Views { views: views.len(), why: name_direction(direction) });
    }
    Ok(summary(views, &problem, &fit, sigma))
}

/// Names of the intrinsic parameters, in order.
pub const NAMES: [&str; INTRINSIC] =
    ["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3", "k4"];

/// How far the principal point of one view of a plane, which is assumed, is off the picture's centre, as a part of the picture's
/// width, one standard deviation per axis. Chosen between published cameras: Zhang's is off by 2.4 % across and 5.2 % down, that
/// of the left pictures of `OpenCV` by 3.6 % and 0.6 %.
const OFF_CENTRE: f64 = 0.025;

/// What is inside a camera in the order of [`NAMES`].
fn numbers(k: &Intrinsics) -> SVector<f64, INTRINSIC> {
    [k.fx, k.fy, k.cx, k.cy, k.skew, k.k1, k.k2, k.p1, k.p2, k.k3, k.k4].into()
}

fn name_direction(direction: &fit::Direction) -> TooAlike {
    let names: Vec<&'static str> = direction
        .parameters
        .iter()
        .map(|(i, _)| NAMES.get(*i).copied().unwrap_or("a pose"))
        .take(4)
        .collect();
    TooAlike::Unseen(names)
}

fn summary(views: &[View], problem: &Reprojection, fit: &Fit, sigma: f64) -> Calibration {
    let intrinsics = problem.intrinsics(&fit.x);
    let mut covariance = nalgebra::SMatrix::<f64, INTRINSIC, INTRINSIC>::zeros();
    covariance.copy_from(&fit.covariance.view((0, 0), (INTRINSIC, INTRINSIC)));
    if problem.aspect.is_some() {
        // fy follows fx.
        let a = intrinsics.fy / intrinsics.fx;
        let row = covariance.row(0) * a;
        covariance.row_mut(1).copy_from(&row);
        let column = covariance.column(0) * a;
        covariance.column_mut(1).copy_from(&column);
    }
    let mut std = [0.0; INTRINSIC];
    for (i, s) in std.iter_mut().enumerate() {
        *s = covariance[(i, i)].max(0.0).sqrt();
    }
    let squares: Vec<f64> = fit
        .residuals
        .chunks_exact(2)
        .map(|r| (r[0] * r[0] + r[1] * r[1]) * sigma * sigma)
        .collect();
    let mut rest = fit.residuals.chunks_exact(2).map(|r| Vector2::new(r[0], r[1]) * sigma);
    let residuals =
        views.iter().map(|view| rest.by_ref().take(view.points.len()).collect()).collect();
    let mut from = 0;
    let fits = views
        .iter()
        .enumerate()
        .map(|(i, view)| {
            let part = &squares[from..from + view.points.len()];
            from += view.points.len();
            let pose = problem.pose(&fit.x, i);
            let given = view.world_from_camera.unwrap_or(pose);
            ViewFit {
                name: view.name.clone(),
                camera_from_world: pose.inverse(),
                rms_px: (part.iter().sum::<f64>() / part.len().max(1) as f64).sqrt(),
                moved_m: (pose.origin() - given.origin()).norm(),
                turned_rad: pose.rotation().angle_to(&given.rotation()),
            }
        })
        .collect();
    Calibration {
        intrinsics,
        std,
        covariance,
        residuals,
        rms_px: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
        noise_px: fit.noise_std.unwrap_or(0.0) * sigma,
        views: fits,
        leverage: None,
        conditioning: fit.conditioning.ratio,
    }
}

/// Returns where a plane z = 0 was seen from, given its homography (pixel from plane, the plane in front
/// of the camera) and the camera's matrix.
pub(super) fn pose_from_homography(
    k: &Matrix3<f64>,
    h: &Matrix3<f64>,
) -> Option<Pose<frame::World, frame::Camera>> {
    let a = k.try_inverse()? * h;
    let scale = 2.0 / (a.column(0).norm() + a.column(1).norm());
    let mut a = a * scale;
    // The plane is in front of the camera.
    if a[(2, 2)] < 0.0 {
        a = -a;
    }
    let (r1, r2): (Vector3<f64>, Vector3<f64>) = (a.column(0).into(), a.column(1).into());
    let rough = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    let svd = rough.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    if rotation.determinant() <= 0.0 || !rotation.iter().all(|v| v.is_finite()) {
        return None;
    }
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(rotation);
    let camera_from_world: Pose<frame::Camera, frame::World> =
        Pose::from_parts(a.column(2).into(), rotation.into());
    Some(camera_from_world.inverse())
}
