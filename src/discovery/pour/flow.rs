//! How water leaves a tilted vessel, and where it goes.
//!
//! Quasi-static: what stands above a level plane through the lip runs out as over a weir whose discharge is left open.
//! The first of it may cling to the lip; that drains exponentially once the vessel is upright, into the other vessel
//! only while the lip is over it. A thick liquid leaves the more slowly the thinner the sheet over the lip, and what a
//! full vessel is given runs over. What a vessel holds, the weir's law and the thick sheet's are the twin's.

use super::pour_record::Pour;

/// A vessel tilted by less than this is upright, rad; as in the twin.
const UPRIGHT: f64 = 0.5;

/// What the model leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flow {
    /// What the vessel holds at first, m³.
    pub(super) volume: f64,
    /// How fast water leaves over what a sharp-crested weir lets through.
    pub(super) discharge: f64,
    /// From the lip to the scale's reading, s.
    pub(super) delay: f64,
    /// Tilt beyond what was measured, rad.
    pub(super) lean: f64,
    /// Water that clings to the lip, m³, and the time constant of its draining, s.
    pub(super) film: (f64, f64),
    /// Viscosity beyond that of water, Pa·s.
    pub(super) viscosity: f64,
    /// What the other vessel holds at first, m³.
    pub(super) there: f64,
    /// What the other vessel holds when it is full, m³.
    pub(super) brim: f64,
}

/// Longest step of the integration, s.
const STEP: f64 = 0.02;
/// Steps between two rows at most: over a gap of more than 20 s the steps are longer.
const MOST_STEPS: f64 = 1e3;

/// Returns the volume in the other vessel at each row of the pour, and what is beside both at its end, m³.
pub(super) fn arrived(pour: &Pour, flow: &Flow) -> (Vec<f64>, f64) {
    let (mut left, mut film, mut there, mut was_full) = (flow.volume, 0.0, flow.there, false);
    let mut beside = 0.0;
    let mut out: Vec<f64> = Vec::with_capacity(pour.time.len());
    let mut curve: Vec<(f64, f64)> = vec![(pour.time[0], there)];
    for row in 1..pour.time.len() {
        let span = pour.time[row] - pour.time[row - 1];
        let steps = (span / STEP).ceil().clamp(1.0, MOST_STEPS);
        let h = span / steps;
        for k in 0..steps as usize {
            let part = (k as f64 + 0.5) / steps;
            let between = |values: &[f64]| values[row - 1] + part * (values[row] - values[row - 1]);
            let tilt = between(&pour.tilt);
            let over = between(&pour.inside) > 0.0;
            // As if the time constant stood still for a step, so that none is too short for it.
            let above = (left - pour.hold.at(tilt + flow.lean)).max(0.0);
            let lean = tilt + flow.lean;
            let pace = above / (flow.discharge * pour.hold.outflow(lean, above))
                + pour.hold.lag(flow.viscosity, lean, above);
            let mut leaves = if above > 0.0 { above * (1.0 - (-h / pace).exp()) } else { 0.0 };
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
