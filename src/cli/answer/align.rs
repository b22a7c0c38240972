//! The regressions' answers as `INTERFACES.md` fixes them for `trueup align map|intrinsics|offset --json`.
//!
//! Rows in `outliers` are counted from 0, as in the table's data. Keys beyond those fixed there are the
//! same numbers a person is shown.

use nalgebra::{DMatrix, Matrix3, Matrix4};
use serde::Serialize;

use crate::alignment::image_map::{Compared, Grid, MapFit, Warning};
use crate::alignment::intrinsics::strays::Stray;
use crate::alignment::intrinsics::{Calibration, NAMES};
use crate::alignment::offset::{Known, OffsetFit};
use crate::report::aligned::{self, MIRRORED};
use crate::world::{LensModel, Pose, frame};

/// The row predicted worst from all others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// Which row, from 0.
    pub row: usize,
    /// By how much, px for regression 1 and m for regression 3.
    pub error: f64,
}

/// One form beside the others, regression 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapCompared {
    /// The form.
    pub model: &'static str,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Mean square error, px².
    pub mse_px: f64,
    /// Error of rows predicted from the others, px.
    pub leave_one_out_px: Option<f64>,
    /// `-BIC/2`; more is better.
    pub evidence: f64,
}

/// What to beware of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WarningAnswer {
    /// Its name, such as `small_patch`.
    pub code: &'static str,
    /// In words.
    pub message: String,
}

impl WarningAnswer {
    /// Of an offset that no arm has.
    fn mirrored() -> Self {
        Self { code: "mirrored", message: MIRRORED.into() }
    }

    /// What to beware of an offset.
    fn of_offset(fit: &OffsetFit) -> Vec<Self> {
        let untested = fit.untested.map(|closer| Self {
            code: "untested",
            message: aligned::untested(closer.name(), fit.kept),
        });
        fit.is_mirrored().then(Self::mirrored).into_iter().chain(untested).collect()
    }
}

/// How far the map is known over the twin's picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UncertaintyAnswer {
    /// Columns of the grid, px of the twin's picture.
    pub u_px: Vec<f64>,
    /// Its rows, px of the twin's picture.
    pub v_px: Vec<f64>,
    /// Standard deviation of where a pixel is mapped to, px of the real picture, a list a row; null beyond the horizon.
    pub std_px: Vec<Vec<Option<f64>>>,
}

/// `align map`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapAnswer {
    /// The form.
    pub model: &'static str,
    /// `M`, rows.
    #[serde(rename = "M")]
    pub m: [[f64; 3]; 3],
    /// Root mean square error, px.
    pub rms_px: f64,
    /// Mean square error, px².
    pub mse_px: f64,
    /// Standard deviation of the errors' lengths, px.
    pub std_px: f64,
    /// Noise of one coordinate, px.
    pub noise_px: f64,
    /// Rows left out, from 0.
    pub outliers: Vec<usize>,
    /// Error of rows predicted from the others, px.
    pub leave_one_out_px: Option<f64>,
    /// The row predicted worst, px.
    pub worst: Option<Worst>,
    /// Covariance of the free entries of `M`, row order.
    pub covariance: Vec<Vec<f64>>,
    /// Least singular value over the largest.
    pub conditioning: f64,
    /// The forms side by side.
    pub compared: Vec<MapCompared>,
    /// Why this form.
    pub reason: String,
    /// What to beware of; empty where nothing is.
    pub warnings: Vec<WarningAnswer>,
    /// How far it is known over the twin's picture, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<UncertaintyAnswer>,
    /// Time that the fit took, without reading and comparing, µs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_us: Option<f64>,
}

impl MapAnswer {
    /// Adds how far the map can be trusted.
    #[must_use]
    pub fn trusted(self, grid: Option<Grid>, warnings: &[Warning]) -> Self {
        let known = |Grid { u_px, v_px, std_px }| UncertaintyAnswer { u_px, v_px, std_px };
        let warnings = warnings.iter();
        let warnings = warnings.map(|w| WarningAnswer { code: w.code(), message: w.to_string() });
        Self { uncertainty: grid.map(known), warnings: warnings.collect(), ..self }
    }

    /// Adds the forms side by side.
    #[must_use]
    pub fn beside(self, compared: &[Compared]) -> Self {
        Self { compared: beside(compared), ..self }
    }
}

fn beside(compared: &[Compared]) -> Vec<MapCompared> {
    let one = |c: &Compared| MapCompared {
        model: c.model.name(),
        dof: c.model.dof(),
        mse_px: c.mse_px,
        leave_one_out_px: c.leave_one_out_px,
        evidence: c.evidence,
    };
    compared.iter().map(one).collect()
}

impl From<&MapFit> for MapAnswer {
    fn from(fit: &MapFit) -> Self {
        Self {
            model: fit.model.name(),
            m: rows3(&fit.m),
            rms_px: fit.rms_px,
            mse_px: fit.mse_px,
            std_px: fit.std_px,
            noise_px: fit.noise_px,
            outliers: fit.outliers.clone(),
            leave_one_out_px: fit.leave_one_out_px,
            worst: fit.worst.map(|(row, error)| Worst { row, error }),
            covariance: rows(&fit.covariance),
            conditioning: fit.conditioning,
            compared: beside(&fit.compared),
            reason: fit.reason.clone(),
            warnings: Vec::new(),
            uncertainty: None,
            time_us: None,
        }
    }
}

/// One standard deviation of each intrinsic parameter; 0 for what was not fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntrinsicsStd {
    /// px.
    pub fx_px: f64,
    /// px.
    pub fy_px: f64,
    /// px.
    pub cx_px: f64,
    /// px.
    pub cy_px: f64,
    /// px.
    pub skew_px: f64,
    /// Without unit.
    pub k1: f64,
    /// Without unit.
    pub k2: f64,
    /// Without unit.
    pub p1: f64,
    /// Without unit.
    pub p2: f64,
    /// Without unit.
    pub k3: f64,
    /// Without unit; of a fisheye only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k4: Option<f64>,
}

/// One view, regression 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewAnswer {
    /// Its name.
    pub view: String,
    /// Where the points were seen from.
    pub camera_from_world: Pose<frame::Camera, frame::World>,
    /// Root mean square reprojection error, px.
    pub rms_px: f64,
    /// How far the camera moved from the extrinsics given, m.
    pub moved_m: f64,
    /// How far it turned from them, rad.
    pub turned_rad: f64,
}

/// A point that disagrees with all others, regression 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StrayAnswer {
    /// Its view's name.
    pub view: String,
    /// Which point of the view, from 0.
    pub point: usize,
    /// How far it is from where the camera shows it, px.
    pub off_px: f64,
}

/// The lever of the straight-line fits, regression 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeverageAnswer {
    /// Standard deviation of `X/Z`.
    pub std_x_over_z: f64,
    /// Standard deviation of `Y/Z`.
    pub std_y_over_z: f64,
}

/// `align intrinsics`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntrinsicsAnswer {
    /// Focal length along u, px.
    pub fx_px: f64,
    /// Focal length along v, px.
    pub fy_px: f64,
    /// Principal point, u, px.
    pub cx_px: f64,
    /// Principal point, v, px.
    pub cy_px: f64,
    /// Skew, px.
    pub skew_px: f64,
    /// First radial distortion.
    pub k1: f64,
    /// Second radial distortion.
    pub k2: f64,
    /// First tangential distortion.
    pub p1: f64,
    /// Second tangential distortion.
    pub p2: f64,
    /// Third radial distortion.
    pub k3: f64,
    /// Fourth radial distortion, of a fisheye.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k4: Option<f64>,
    /// What the terms mean.
    pub model: LensModel,
    /// Width and height of the pictures, px, where known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_px: Option<[u32; 2]>,
    /// Standard deviations.
    pub std: IntrinsicsStd,
    /// Root mean square reprojection error per point, px.
    pub rms_px: f64,
    /// Noise of one coordinate, px.
    pub noise_px: f64,
    /// The views.
    pub views: Vec<ViewAnswer>,
    /// Points left out, where they were looked for; empty where none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outliers: Option<Vec<StrayAnswer>>,
    /// The lever, where extrinsics were given.
    pub leverage: Option<LeverageAnswer>,
    /// Covariance in the order of `parameters`.
    pub covariance: Vec<Vec<f64>>,
    /// Names of the rows of `covariance`.
    pub parameters: [&'static str; NAMES.len()],
}

impl IntrinsicsAnswer {
    /// Adds the points that were left out.
    #[must_use]
    pub fn without(self, strays: &[Stray]) -> Self {
        let one = |stray: &Stray| StrayAnswer {
            view: self.views[stray.view].view.clone(),
            point: stray.point,
            off_px: stray.off_px,
        };
        Self { outliers: Some(strays.iter().map(one).collect()), ..self }
    }
}

impl From<&Calibration> for IntrinsicsAnswer {
    fn from(fit: &Calibration) -> Self {
        let k = &fit.intrinsics;
        let [fx_px, fy_px, cx_px, cy_px, skew_px, k1, k2, p1, p2, k3, k4] = fit.std;
        let is_fisheye = k.model == LensModel::Fisheye;
        Self {
            fx_px: k.fx,
            fy_px: k.fy,
            cx_px: k.cx,
            cy_px: k.cy,
            skew_px: k.skew,
            k1: k.k1,
            k2: k.k2,
            p1: k.p1,
            p2: k.p2,
            k3: k.k3,
            k4: is_fisheye.then_some(k.k4),
            model: k.model,
            image_px: (k.width > 0 && k.height > 0).then_some([k.width, k.height]),
            std: IntrinsicsStd {
                fx_px,
                fy_px,
                cx_px,
                cy_px,
                skew_px,
                k1,
                k2,
                p1,
                p2,
                k3,
                k4: is_fisheye.then_some(k4),
            },
            rms_px: fit.rms_px,
            noise_px: fit.noise_px,
            views: fit
                .views
                .iter()
                .map(|v| ViewAnswer {
                    view: v.name.clone(),
                    camera_from_world: v.camera_from_world,
                    rms_px: v.rms_px,
                    moved_m: v.moved_m,
                    turned_rad: v.turned_rad,
                })
                .collect(),
            outliers: None,
            leverage: fit
                .leverage
                .map(|l| LeverageAnswer { std_x_over_z: l.std_x, std_y_over_z: l.std_y }),
            covariance: fit.covariance.row_iter().map(|r| r.iter().copied().collect()).collect(),
            parameters: NAMES,
        }
    }
}

/// One form beside the others, regression 3.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OffsetCompared {
    /// The form.
    pub model: &'static str,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Root mean square error, m.
    pub rms_m: f64,
    /// Error of rows predicted from the others, m.
    pub leave_one_out_m: Option<f64>,
    /// `-BIC/2`; more is better.
    pub evidence: f64,
}

/// How far the offset is known somewhere.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownAnswer {
    /// Distance from the centre of the points, m.
    pub from_centre_m: f64,
    /// The same over that of the farthest point; more than 1 is away from all of them.
    pub reach: f64,
    /// Where at this distance it is known worst, m.
    pub at_m: [f64; 3],
    /// Standard deviation of the corrected position there (root of the sum over the axes), m.
    pub std_m: f64,
}

impl From<&Known> for KnownAnswer {
    fn from(known: &Known) -> Self {
        let &Known { from_centre: from_centre_m, reach, at, std: std_m } = known;
        Self { from_centre_m, reach, at_m: at.into(), std_m }
    }
}

/// `align offset`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OffsetAnswer {
    /// The form.
    pub model: &'static str,
    /// `D`, rows.
    #[serde(rename = "D")]
    pub d: [[f64; 4]; 4],
    /// Root mean square error, m.
    pub rms_m: f64,
    /// Noise of one coordinate, m.
    pub noise_m: f64,
    /// Error of rows predicted from the others, m.
    pub leave_one_out_m: Option<f64>,
    /// The row predicted worst, m.
    pub worst: Option<Worst>,
    /// Rows left out, from 0.
    pub outliers: Vec<usize>,
    /// What the points leave free; it keeps the value of "no offset".
    pub unobservable: Vec<String>,
    /// What a person should know before relying on it.
    pub warnings: Vec<WarningAnswer>,
    /// How far the offset is known, among the points and away from them; nothing without redundancy.
    pub known: Vec<KnownAnswer>,
    /// The forms side by side.
    pub compared: Vec<OffsetCompared>,
}

impl From<&OffsetFit> for OffsetAnswer {
    fn from(fit: &OffsetFit) -> Self {
        Self {
            model: fit.model.name(),
            d: rows4(&fit.d),
            rms_m: fit.rms_m,
            noise_m: fit.noise_m,
            leave_one_out_m: fit.leave_one_out_m,
            worst: fit.worst.map(|(row, error)| Worst { row, error }),
            outliers: fit.outliers.clone(),
            unobservable: fit.unobservable.clone(),
            warnings: WarningAnswer::of_offset(fit),
            known: fit.known().iter().map(KnownAnswer::from).collect(),
            compared: fit
                .compared
                .iter()
                .map(|c| OffsetCompared {
                    model: c.model.name(),
                    dof: c.model.dof(),
                    rms_m: c.rms_m,
                    leave_one_out_m: c.leave_one_out_m,
                    evidence: c.evidence,
                })
                .collect(),
        }
    }
}

fn rows3(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    m.transpose().into()
}

fn rows4(m: &Matrix4<f64>) -> [[f64; 4]; 4] {
    m.transpose().into()
}

fn rows(m: &DMatrix<f64>) -> Vec<Vec<f64>> {
    m.row_iter().map(|r| r.iter().copied().collect()).collect()
}
