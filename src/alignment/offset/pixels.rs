//! The offset from one camera: the arm visits points and reports them, the camera says at which pixel the
//! tool's marker was.
//!
//! A pixel is a ray, not a point; but a rigid offset of many points changes their picture in six ways, and
//! a turn or a shift along the line of sight shows as a change of size. What shows little is held by a
//! prior about "no offset", and the covariance says how little.

use nalgebra::{Matrix3, Matrix4, UnitQuaternion, Vector3};

use super::{Error, LEAST_SPREAD, Model};
use crate::fit::{self, Noise, Prior, Residuals};
use crate::world::{Camera, Pixel, Point, Pose, frame};

/// One stop of the touch-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Where the arm says its marker is, in world coordinates, m.
    pub reported: Vector3<f64>,
    /// Where the camera sees the marker.
    pub pixel: Pixel,
    /// Standard deviation of the pixel, per coordinate, px.
    pub sigma: f64,
}

/// What is known of the offset beforehand: standard deviations about none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Of the shift at the centre of the points, per axis, m.
    pub shift: f64,
    /// Of the turn, per axis, rad.
    pub turn: f64,
}

impl Default for Priors {
    /// An arm that was set up with care: 2 cm and 2°.
    fn default() -> Self {
        Self { shift: 0.02, turn: 0.035 }
    }
}

/// The offset and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelOffset {
    /// [`Model::Translation`] or [`Model::Rigid`].
    pub model: Model,
    /// `D`, said from real (Eq. 7): where to send the arm so that it comes to a real place.
    pub d: Matrix4<f64>,
    /// `D⁻¹` as a pose: where the arm really is when it reports a place.
    pub real_from_reported: Pose<frame::World, frame::World>,
    /// Centre of the reported points, m.
    pub centre: Vector3<f64>,
    /// How far the arm really is from what it reports, at the centre, m.
    pub shift: Vector3<f64>,
    /// Covariance of [`Self::shift`], mm².
    pub covariance_mm2: Matrix3<f64>,
    /// The turn as an axis times an angle, rad.
    pub turn: Vector3<f64>,
    /// Standard deviation of the turn about x, y and z, rad.
    pub turn_std: Vector3<f64>,
    /// Root mean square reprojection error of the sightings kept, before the fit, px.
    pub rms_before_px: f64,
    /// The same after it, px.
    pub rms_px: f64,
    /// Residuals over what the sigmas promise; above 1 the covariance is widened by it.
    pub chi: f64,
    /// Reprojection error of each sighting after the fit, px.
    pub residuals_px: Vec<f64>,
    /// Sightings left out, in order.
    pub outliers: Vec<usize>,
    /// Of `x y z turn_x turn_y turn_z`, what the pictures hardly determine.
    pub unobservable: Vec<&'static str>,
}

const NAMES: [&str; 6] = ["x", "y", "z", "turn_x", "turn_y", "turn_z"];
/// A sighting farther off than this many standard deviations is left out: 1 in 3000 clean ones.
const CUT: f64 = 4.0;

/// Finds the offset from reported points and the pixels where the camera saw them.
///
/// The camera is taken as true; calibrate it first.
///
/// # Errors
///
/// [`Error::TooFew`] below 2 sightings for a translation and 4 for a rigid offset, [`Error::Coincident`]
/// when a turn is asked of points within a centimetre, [`Error::NotFinite`], [`Error::BehindCamera`], and
/// [`Error::NoSuchModel`] for other models.
pub fn fit_offset_from_pixels(
    sightings: &[Sighting],
    camera: &Camera,
    model: Model,
    priors: &Priors,
) -> Result<PixelOffset, Error> {
    let needed = match model {
        Model::Translation => 2,
        Model::Rigid => 4,
        _ => {
            return Err(Error::NoSuchModel {
                what: "the offset from pixels",
                model: model.name(),
                instead: "`translation` or `rigid`",
            });
        }
    };
    let given = sightings.len();
    if given < needed {
        return Err(Error::TooFew { what: model.name(), of: "sightings", needed, given });
    }
    for (row, s) in sightings.iter().enumerate() {
        let finite = s.reported.iter().chain([&s.pixel.u, &s.pixel.v]).all(|v| v.is_finite());
        if !(finite && s.sigma > 0.0 && s.sigma.is_finite()) {
            return Err(Error::NotFinite { what: "the sightings", row });
        }
    }
    let n = given as f64;
    let centre = sightings.iter().map(|s| s.reported).sum::<Vector3<f64>>() / n;
    let square = sightings.iter().map(|s| (s.reported - centre).norm_squared()).sum::<f64>() / n;
    let spread = square.sqrt();
    if model == Model::Rigid && spread < LEAST_SPREAD {
        return Err(Error::Coincident { what: "reported points", spread, unit: "m" });
    }
    let problem = Residuals {
        n: 2 * given,
        block: 2,
        function: |x: &[f64], r: &mut [f64]| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
            let shift = Vector3::new(x[0], x[1], x[2]);
            for (s, r) in sightings.iter().zip(r.chunks_exact_mut(2)) {
                let real = centre + shift + turn * (s.reported - centre);
                match camera.project(Point::from(real)) {
                    Some(p) => {
                        r[0] = (p.u - s.pixel.u) / s.sigma;
                        r[1] = (p.v - s.pixel.v) / s.sigma;
                    }
                    None => r.fill(f64::INFINITY),
                }
            }
        },
    };
    let prior = |i: usize| if i < 3 { priors.shift } else { priors.turn };
    let options = fit::Options {
        priors: (0..6).map(|i| Prior { parameter: i, mean: 0.0, std: prior(i) }).collect(),
        fixed: if model == Model::Translation { vec![3, 4, 5] } else { Vec::new() },
        noise: Noise::Known,
        ..fit::Options::default()
    };
    let mut before = vec![0.0; 2 * given];
    fit::Problem::residuals(&problem, &[0.0; 6], &mut before);
    if let Some(at) = before.iter().position(|r| !r.is_finite()) {
        return Err(Error::BehindCamera { row: at / 2 });
    }
    // With fewer than two spare sightings nobody can say which one is wrong.
    let found = if given >= needed + 2 {
        fit::solve_rejecting(&problem, &[0.0; 6], &options, CUT)?
    } else {
        let fit = fit::solve(&problem, &[0.0; 6], &options)?;
        fit::Rejection { fit, outliers: Vec::new() }
    };
    let fit = &found.fit;
    let length = |r: &[f64], i: usize| sightings[i].sigma * r[2 * i].hypot(r[2 * i + 1]);
    let kept: Vec<usize> = (0..given).filter(|i| !found.outliers.contains(i)).collect();
    let rms = |r: &[f64]| {
        let sum: f64 = kept.iter().map(|&i| length(r, i).powi(2)).sum();
        (sum / kept.len().max(1) as f64).sqrt()
    };
    let whitened: f64 =
        kept.iter().map(|&i| fit.residuals[2 * i].powi(2) + fit.residuals[2 * i + 1].powi(2)).sum();
    // Priors count as measurements: as many as there are parameters.
    let chi = (whitened / (2 * kept.len()).max(1) as f64).sqrt();
    let widen = chi.max(1.0);
    let shift = Vector3::new(fit.x[0], fit.x[1], fit.x[2]);
    let turn = Vector3::new(fit.x[3], fit.x[4], fit.x[5]);
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    let real_from_reported: Pose<frame::World, frame::World> =
        Pose::from_parts(centre + shift - rotation * centre, rotation);
    let mut covariance_mm2 = Matrix3::zeros();
    covariance_mm2.copy_from(&(fit.covariance.view((0, 0), (3, 3)) * (1e6 * widen * widen)));
    let unobservable = (0..6)
        .filter(|i| !options.fixed.contains(i) && fit.std(*i) > 0.9 * prior(*i))
        .map(|i| NAMES[i])
        .collect();
    Ok(PixelOffset {
        model,
        d: real_from_reported.inverse().isometry().to_homogeneous(),
        real_from_reported,
        centre,
        shift,
        covariance_mm2,
        turn,
        turn_std: Vector3::new(fit.std(3), fit.std(4), fit.std(5)) * widen,
        rms_before_px: rms(&before),
        rms_px: rms(&fit.residuals),
        chi,
        residuals_px: (0..given).map(|i| length(&fit.residuals, i)).collect(),
        outliers: found.outliers.clone(),
        unobservable,
    })
}
