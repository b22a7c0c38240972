//! How far an offset is known, among the points that were touched and away from them.
//!
//! The standard deviation of `D p` follows from the covariance of the form's parameters. What the points leave free is as
//! unsure as the prior that holds it, so ± grows with the distance from the points as fast as nobody measured it.

use nalgebra::{DMatrix, Vector3};

use super::models::matrix;
use super::{Model, OffsetFit, apply};

/// The parameters of a form with their covariance, and where its points are.
#[derive(Debug, Clone, PartialEq)]
pub struct Trust {
    pub(super) model: Model,
    /// Centre and root mean square distance from it of the real points, m, in which the form is written.
    pub(super) centre: Vector3<f64>,
    pub(super) size: f64,
    /// Distance of the farthest kept point from the centre, m.
    pub(super) reach: f64,
    pub(super) x: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Whether the noise was told by the points.
    pub(super) told: bool,
}

/// How far the offset is known somewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Distance from the centre of the points, m.
    pub from_centre: f64,
    /// The same over that of the farthest point; more than 1 is away from all of them.
    pub reach: f64,
    /// Where, m.
    pub at: Vector3<f64>,
    /// Standard deviation of the corrected position (root of the sum over the axes), m.
    pub std: f64,
}

/// Distances at which it is told, over that of the farthest point: the centre, the farthest, and two and four times as far,
/// which is the other side of a table that was touched on one quarter of it.
const REACHES: [f64; 4] = [0.0, 1.0, 2.0, 4.0];
/// Step of the differences, of parameters without unit that are at most about 1.
const STEP: f64 = 1e-6;

impl OffsetFit {
    /// Returns how far the offset is known at a real point, m; `None` without redundancy, and beyond a full form's horizon.
    pub fn known_at(&self, real: Vector3<f64>) -> Option<Known> {
        let Trust { model, centre, size, reach, x, covariance, told } = &self.trust;
        if !told {
            return None;
        }
        let mut jacobian = DMatrix::zeros(3, x.len());
        let mut moved = x.clone();
        for (k, &value) in x.iter().enumerate() {
            let mut at = |value: f64| {
                moved[k] = value;
                apply(&matrix(*model, *centre, *size, &moved), real)
            };
            let (up, down) = (at(value + STEP)?, at(value - STEP)?);
            moved[k] = value;
            jacobian.set_column(k, &((up - down) / (2.0 * STEP)));
        }
        let std = (&jacobian * covariance * jacobian.transpose()).trace().max(0.0).sqrt();
        let from_centre = (real - centre).norm();
        let reach = if *reach > 0.0 { from_centre / reach } else { 0.0 };
        Some(Known { from_centre, reach, at: real, std })
    }

    /// Returns how far the offset is known at the centre of the points, at the distance of the farthest, and at two and four
    /// times that distance, there where along an axis it is known worst; nothing without redundancy.
    pub fn known(&self) -> Vec<Known> {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let worst = |times: f64| {
            let around = axes.iter().flat_map(|axis| [*axis, -axis]);
            let places = around.filter_map(|axis| {
                self.known_at(self.trust.centre + axis * (times * self.trust.reach))
            });
            places.max_by(|a, b| a.std.total_cmp(&b.std))
        };
        REACHES.into_iter().filter_map(worst).collect()
    }
}
