//! Which state what is left of a sensor depends on, whatever the curve: for what has no name, a place to look at.
//!
//! The correlation ratio of what is left over each state: the part of its variance that means over bins take away. Source: Pearson,
//! "On the General Theory of Skew Correlation and Non-linear Regression", 1905.

use super::channels::{Channel, Quantity};
use super::simulate::Model;
use super::wording;
use crate::discovery::finding::{self, Finding, Verdict};
use crate::discovery::{Against, Trace, rms_judged};

/// Bins of equally many rows; fewer of time, in which any slow motion looks the same as what depends on it.
const BINS: usize = 24;
const BINS_OF_TIME: usize = 6;
pub(super) const TIME: &str = "time";

/// Least part that a state takes away to be told.
const PART: f64 = 0.1;
/// Times its noise that a sensor leaves at least.
const BEYOND: f64 = 1.5;

/// Returns the state on which what is left of a channel, one number a row and 0 where it is not judged, depends most; `None`
/// where little is left or it depends on none.
pub(super) fn against(model: &Model, channel: &Channel, left: &[f64]) -> Option<Against> {
    let judged: Vec<usize> = (0..left.len()).filter(|row| left[*row].abs() > 0.0).collect();
    let rows = judged.len().max(1) as f64;
    let mean = judged.iter().map(|row| left[*row]).sum::<f64>() / rows;
    // A constant depends on nothing.
    let square: f64 = judged.iter().map(|row| (left[*row] - mean).powi(2)).sum();
    if judged.len() < BINS * BINS || (square / rows).sqrt() < BEYOND * channel.noise {
        return None;
    }
    let ratio = |state: &str, values: &[f64]| {
        let mut order = judged.clone();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let n_bins = if state == TIME { BINS_OF_TIME } else { BINS };
        let bins = order.chunks(order.len().div_ceil(n_bins));
        let of_bin = |rows: &[usize]| {
            let sum: f64 = rows.iter().map(|row| left[*row] - mean).sum();
            sum.powi(2) / rows.len() as f64
        };
        bins.map(of_bin).sum::<f64>() / square
    };
    let states = states(model, channel).into_iter();
    let rated = states.map(|(state, unit, values)| (ratio(&state, &values), state, unit, values));
    let (part, state, unit, values) = rated.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (part > PART).then_some(Against { state, unit: unit.into(), part, values })
}

/// The states a channel may depend on, row by row, with their units: of its own joint, or of all for the tip.
pub(super) fn states(model: &Model, channel: &Channel) -> Vec<(String, &'static str, Vec<f64>)> {
    let plant = &model.course.plant;
    let time = &model.course.data.time;
    let joints = match channel.quantity {
        Quantity::Tip => 0..plant.n,
        _ => channel.index..channel.index + 1,
    };
    let begin = time.first().copied().unwrap_or(0.0);
    let mut found = vec![(TIME.to_owned(), "s", time.iter().map(|t| t - begin).collect())];
    for joint in joints {
        let mut add = |name: String, unit, values: &[f64]| {
            found.push((name, unit, model.course.at_rows(values, joint)));
        };
        let of = |what: &str| format!("{what}_{}", joint + 1);
        let [way, speed, acceleration, load] = if model.arm.chain.slides(joint) {
            ["m", "m/s", "m/s^2", "N"]
        } else {
            ["rad", "rad/s", "rad/s^2", "N*m"]
        };
        add(of("q"), way, &plant.q);
        add(of("dq"), speed, &plant.dq);
        add(of("ddq"), acceleration, &plant.ddq);
        add(wording::load_at(joint), load, &plant.bias);
    }
    found
}

/// Channels that are told at most, and how many times its noise one of them leaves where the others are explained.
const HINTS: usize = 3;
const MUCH: f64 = 3.0;

/// Says of the channels with the largest gaps on what the rest of them depends most: where to look when nothing has a name,
/// or names have left much.
pub(super) fn hints(finding: &Finding, traces: &[Trace]) -> Vec<String> {
    let is_open = matches!(finding.verdict, Verdict::Unknown | Verdict::ModelInadequate);
    let is_much = |trace: &&Trace| is_open || rms_judged(trace.after.iter()) > MUCH * trace.noise;
    let of = |place: &finding::Channel| {
        let mut own = traces.iter().filter(|trace| trace.channel == place.channel).filter(is_much);
        let against = own.find_map(|trace| trace.against.as_ref())?;
        Some(wording::depends_on(&place.channel, &against.state, against.part))
    };
    finding.places.iter().filter_map(of).take(HINTS).collect()
}
