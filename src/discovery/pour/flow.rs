//! How water leaves a tilted vessel, and where it goes.
//!
//! Quasi-static: what stands above a level plane through the lip runs out with a short time constant.
//! `V' = -(V - V_hold(tilt))/pace` where positive. The first of it may cling to the lip; that drains
//! exponentially once the vessel is upright, into the other vessel only while the lip is over it.

use crate::world::{Object, Shape};

use super::data::Pour;

/// A vessel tilted by less than this is upright, rad; as in the twin.
const UPRIGHT: f64 = 0.5;

/// Slices of the vessel, and steps of the tilt, of the table of what it holds.
const SLICES: usize = 200;
const STEPS: usize = 360;

/// What a vessel holds at a tilt.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    /// m³ at even steps of the tilt from upright to level.
    table: Vec<f64>,
}

impl Hold {
    /// Tabulates a vessel; `None` for an object that holds nothing.
    ///
    /// Water stands up to a plane through the lip's lowest edge. A box tilts about an edge.
    pub(super) fn of(object: &Object) -> Option<Self> {
        let inside = object.inside()?;
        let height = object.shape.height() - object.cavity?.wall;
        let (reach, width): (f64, Box<dyn Fn(f64) -> f64>) = match inside {
            Shape::Cuboid { size } => (size.x, Box::new(move |_| size.y)),
            Shape::Cylinder { radius, .. } => (
                2.0 * radius,
                Box::new(move |s| 2.0 * (radius * radius - (radius - s).powi(2)).max(0.0).sqrt()),
            ),
        };
        let slice = reach / SLICES as f64;
        let volume = |tilt: f64| -> f64 {
            let slope = tilt.tan();
            (0..SLICES)
                .map(|i| {
                    let s = (i as f64 + 0.5) * slice;
                    (height - s * slope).clamp(0.0, height) * width(s) * slice
                })
                .sum()
        };
        let angle = |i: usize| std::f64::consts::FRAC_PI_2 * i as f64 / STEPS as f64;
        let mut table: Vec<f64> = (0..STEPS).map(|i| volume(angle(i))).collect();
        table.push(0.0);
        Some(Self { table })
    }

    /// Returns what is held at a tilt, m³.
    pub(super) fn at(&self, tilt: f64) -> f64 {
        let at = tilt.abs() / std::f64::consts::FRAC_PI_2 * STEPS as f64;
        if at >= STEPS as f64 {
            return 0.0;
        }
        let i = at as usize;
        self.table[i] + (at - i as f64) * (self.table[i + 1] - self.table[i])
    }
}

/// What the model leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flow {
    /// What the vessel holds at first, m³.
    pub(super) volume: f64,
    /// Time constant of the flow, s.
    pub(super) pace: f64,
    /// From the lip to the scale's reading, s.
    pub(super) delay: f64,
    /// Tilt beyond what was measured, rad.
    pub(super) lean: f64,
    /// Water that clings to the lip, m³, and the time constant of its draining, s.
    pub(super) film: (f64, f64),
}

/// Longest step of the integration, s.
const STEP: f64 = 0.02;

/// Returns the volume in the other vessel at each row of the pour, m³.
pub(super) fn arrived(pour: &Pour, flow: &Flow) -> Vec<f64> {
    let (mut left, mut film, mut there, mut was_full) = (flow.volume, 0.0, 0.0, false);
    let mut out: Vec<f64> = Vec::with_capacity(pour.time.len());
    let mut curve: Vec<(f64, f64)> = vec![(pour.time[0], 0.0)];
    for row in 1..pour.time.len() {
        let span = pour.time[row] - pour.time[row - 1];
        let steps = (span / STEP).ceil().max(1.0);
        let h = span / steps;
        for k in 0..steps as usize {
            let part = (k as f64 + 0.5) / steps;
            let between = |values: &[f64]| values[row - 1] + part * (values[row] - values[row - 1]);
            let tilt = between(&pour.tilt);
            let over = between(&pour.inside) > 0.0;
            // Exact for a tilt that stands still, so that no pace is too short for the step.
            let above = (left - pour.hold.at(tilt + flow.lean)).max(0.0);
            let mut leaves = above * (1.0 - (-h / flow.pace).exp());
            left -= leaves;
            if !was_full {
                let clings = leaves.min(flow.film.0 - film);
                film += clings;
                leaves -= clings;
                was_full = film >= flow.film.0;
            }
            if tilt.abs() < UPRIGHT && film > 0.0 {
                let drains = film * (1.0 - (-h / flow.film.1).exp());
                film -= drains;
                leaves += drains;
                was_full = true;
            }
            if over {
                there += leaves;
            }
            curve.push((pour.time[row - 1] + (k + 1) as f64 * h, there));
        }
    }
    let mut at = 0;
    for time in &pour.time {
        let wanted = time - flow.delay;
        while at + 2 < curve.len() && curve[at + 1].0 < wanted {
            at += 1;
        }
        let ((t0, v0), (t1, v1)) = (curve[at], curve[(at + 1).min(curve.len() - 1)]);
        let part = if t1 > t0 { ((wanted - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 0.0 };
        out.push(v0 + part * (v1 - v0));
    }
    out
}
