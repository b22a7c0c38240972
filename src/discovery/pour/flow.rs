//! How water leaves a tilted vessel, and where it goes.
//!
//! Quasi-static: what stands above a level plane through the lip runs out with a short time constant.
//! `V' = -(V - V_hold(tilt))/pace` where positive. The first of it may cling to the lip; that drains
//! exponentially once the vessel is upright, into the other vessel only while the lip is over it. A thick
//! liquid leaves the more slowly the thinner the sheet over the lip, and what a full vessel is given runs over.
//!
//! Source of the sheet's law, `Q = w ρ g h³ s / (3 μ)` for a slope `s`: Bird, Stewart and Lightfoot, *Transport Phenomena*,
//! 2nd ed. 2002, §2.2, a film falling down an inclined wall.

use std::f64::consts::FRAC_PI_2;

use crate::motion::dynamics::GRAVITY;
use crate::world::{Object, Shape};

use super::data::{DENSITY, Pour};

/// A vessel tilted by less than this is upright, rad; as in the twin.
const UPRIGHT: f64 = 0.5;

/// Slices of the vessel, and steps of the tilt, of the table of what it holds.
const SLICES: usize = 200;
const STEPS: usize = 360;

/// What a vessel holds at a tilt, and how wide the water is then.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    /// m³ at even steps of the tilt from upright to level.
    volume: Vec<f64>,
    /// The water's surface then, m².
    surface: Vec<f64>,
    /// How wide the lip is, m: the side of a box, the radius of a round vessel.
    lip: f64,
    /// How long the wall is that the liquid leaves along, m.
    wall: f64,
}

impl Hold {
    /// Tabulates a vessel; `None` for an object that holds nothing.
    ///
    /// Water stands up to a plane through the lip's lowest edge. A box tilts about an edge.
    pub(super) fn of(object: &Object) -> Option<Self> {
        let inside = object.inside()?;
        let height = object.shape.height() - object.cavity?.wall;
        let (reach, lip, width): (f64, f64, Box<dyn Fn(f64) -> f64>) = match inside {
            Shape::Cuboid { size } => (size.x, size.y, Box::new(move |_| size.y)),
            Shape::Cylinder { radius, .. } => (
                2.0 * radius,
                radius,
                Box::new(move |s| 2.0 * (radius * radius - (radius - s).powi(2)).max(0.0).sqrt()),
            ),
        };
        let sum = |reach: f64, of: &dyn Fn(f64) -> f64| -> f64 {
            let slice = reach / SLICES as f64;
            (0..SLICES).map(|i| of((i as f64 + 0.5) * slice) * slice).sum()
        };
        let angle = |i: usize| FRAC_PI_2 * i as f64 / STEPS as f64;
        let volume = |tilt: f64| {
            let slope = tilt.tan();
            sum(reach, &|s| (height - s * slope).clamp(0.0, height) * width(s))
        };
        let surface = |tilt: f64| {
            // Level, the surface is the wall that lies below; a hundredth of a degree short of that is as good.
            let tilt = tilt.min(FRAC_PI_2 - 2e-4);
            sum(reach.min(height / tilt.tan()), &width) / tilt.cos()
        };
        let mut volumes: Vec<f64> = (0..STEPS).map(|i| volume(angle(i))).collect();
        volumes.push(0.0);
        let surface = (0..=STEPS).map(|i| surface(angle(i))).collect();
        Some(Self { volume: volumes, surface, lip, wall: height })
    }

    /// Returns what is held at a tilt, m³.
    pub(super) fn at(&self, tilt: f64) -> f64 {
        between(&self.volume, tilt)
    }

    /// Returns how long a time constant a liquid's viscosity (Pa·s) adds when so much of it (m³) stands above
    /// the lip, s.
    fn lag(&self, viscosity: f64, tilt: f64, above: f64) -> f64 {
        if viscosity <= 0.0 || above <= 0.0 {
            return 0.0;
        }
        let head = above / between(&self.surface, tilt);
        // On its last stretch the surface falls by the head while the wall falls away, or rises, by the cosine of
        // the tilt; on a level wall only the head itself drives it.
        let slope = tilt.cos().abs() + head / self.wall;
        above * 3.0 * viscosity / (self.lip * DENSITY * GRAVITY * head.powi(3) * slope)
    }
}

/// Returns a table's value at a tilt; beyond level it is that of level.
fn between(table: &[f64], tilt: f64) -> f64 {
    let at = (tilt.abs() / FRAC_PI_2 * STEPS as f64).min(STEPS as f64);
    let i = (at as usize).min(STEPS - 1);
    table[i] + (at - i as f64) * (table[i + 1] - table[i])
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
    /// Viscosity beyond that of water, Pa·s.
    pub(super) viscosity: f64,
    /// What the other vessel holds when it is full, m³.
    pub(super) brim: f64,
}

/// Longest step of the integration, s.
const STEP: f64 = 0.02;

/// Returns the volume in the other vessel at each row of the pour, and what is beside both at its end, m³.
pub(super) fn arrived(pour: &Pour, flow: &Flow) -> (Vec<f64>, f64) {
    let (mut left, mut film, mut there, mut was_full) = (flow.volume, 0.0, 0.0, false);
    let mut beside = 0.0;
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
            let pace = flow.pace + pour.hold.lag(flow.viscosity, tilt + flow.lean, above);
            let mut leaves = above * (1.0 - (-h / pace).exp());
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
            let stays = if over { leaves.min((flow.brim - there).max(0.0)) } else { 0.0 };
            there += stays;
            beside += leaves - stays;
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
    (out, beside)
}
