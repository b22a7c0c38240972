//! Where measured and model disagree: channel by channel, and what the residual follows.

use std::collections::BTreeMap;

use super::channels::{Channel, Quantity};
use super::explain::ArmGap;
use super::simulate::Model;
use super::term::Term;
use super::wording;
use crate::discovery::finding::{self, NEAR_NOISE};
use crate::discovery::selection::{self, Hypothesis, Residuals as _, sum_of_squares};
use crate::discovery::wording::keep;
use crate::units::significant;

/// Says how much of the gap each channel carries and what its residual follows; `parameters` are the simulation's own, then
/// those of effects.
pub(super) fn places(gap: &ArmGap, terms: &[Term], parameters: &[f64]) -> Vec<finding::Channel> {
    struct Sum {
        unit: &'static str,
        square: f64,
        noise: f64,
        excess: f64,
        rows: usize,
        follows: (f64, String),
    }
    let mut sums: BTreeMap<(Quantity, usize), (String, Sum)> = BTreeMap::new();
    let with = gap.with_known(terms, parameters);
    for model in gap.train.iter().chain(&gap.heldout) {
        let Some(residuals) = with.residuals(model) else { continue };
        let data = &model.course.data;
        let rows = data.n_rows();
        let first = model.course.first_row;
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        for (at, channel) in predicted.enumerate() {
            let part = &residuals[at * rows + first..at * rows + model.course.last_row];
            let square = sum_of_squares(part);
            let entry = sums.entry((channel.quantity, channel.index)).or_insert_with(|| {
                let sum = Sum {
                    unit: model.unit(channel),
                    square: 0.0,
                    noise: channel.noise,
                    excess: 0.0,
                    rows: 0,
                    follows: (0.0, String::new()),
                };
                (channel.name.clone(), sum)
            });
            let sum = &mut entry.1;
            sum.square += square * channel.noise.powi(2);
            let read = (first..model.course.last_row).filter(|row| channel.is_read(*row)).count();
            sum.excess += square - read as f64;
            sum.rows += read;
            let follows = follows(model, channel, part);
            if follows.0 > sum.follows.0 {
                sum.follows = follows;
            }
        }
    }
    let total: f64 = sums.values().map(|(_, sum)| sum.excess.max(0.0)).sum();
    let mut places: Vec<finding::Channel> = sums
        .into_values()
        .map(|(name, sum)| {
            // Within three standard deviations of χ² it is noise.
            let excess = sum.excess > 3.0 * (2.0 * sum.rows as f64).sqrt();
            finding::Channel {
                channel: name,
                rms: (sum.square / sum.rows.max(1) as f64).sqrt(),
                noise: sum.noise,
                unit: sum.unit.into(),
                share: if total > 0.0 { sum.excess.max(0.0) / total } else { 0.0 },
                concentrated_in: if excess {
                    sum.follows.1
                } else {
                    wording::NOTHING_BEYOND_NOISE.into()
                },
                heldout: None,
            }
        })
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}

/// Channels that are told at most, and the least part of the rest that one holds.
const TOLD: usize = 3;
const PART: f64 = 0.1;

/// Says where most of what is left is, and what it follows there.
pub(super) fn most_of(left: &[finding::Channel]) -> String {
    let told = left.iter().filter(|place| place.share > PART).take(TOLD);
    let told: Vec<String> = told
        .map(|place| {
            let part = significant(100.0 * place.share, 2);
            format!("{} ({part} %, follows {})", place.channel, place.concentrated_in)
        })
        .collect();
    told.join(", ")
}

/// A channel of which more than this part stays, and which is left with this many times its noise, is not described.
const STAYS: (f64, f64) = (0.5, 5.0);

/// Returns the channels of which most stays.
pub(super) fn staying<'a>(
    before: &[finding::Channel],
    left: &'a [finding::Channel],
) -> Vec<&'a str> {
    let stays = |place: &&finding::Channel| {
        let was = before.iter().find(|other| other.channel == place.channel);
        place.rms > STAYS.1 * place.noise && was.is_some_and(|was| place.rms > STAYS.0 * was.rms)
    };
    left.iter().filter(stays).map(|place| place.channel.as_str()).collect()
}

/// Says which channels a hypothesis leaves well above their noise where the data held out are told, those that stand out most
/// first; nothing where there are none.
pub(super) fn kept(gap: &ArmGap, best: &Hypothesis<Term>) -> String {
    let set = selection::reported(gap);
    let left = gap.residuals(set, &best.terms, &best.parameters);
    let (Some(left), Some(model)) = (left, gap.models(set).first()) else { return String::new() };
    let mut sums: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
    for block in gap.blocks(set) {
        let sum = sums.entry(block.sensor).or_default();
        // Rows that are not judged are zero.
        for value in left[block.rows].iter().filter(|value| value.abs() > 0.0) {
            *sum = (sum.0 + value * value, sum.1 + 1);
        }
    }
    let channels = &model.course.data.channels;
    let noises = sums.into_iter().map(|(at, (sum, rows))| (at, (sum / rows.max(1) as f64).sqrt()));
    let mut above: Vec<(usize, f64)> = noises.filter(|(_, noises)| *noises > NEAR_NOISE).collect();
    above.sort_by(|a, b| b.1.total_cmp(&a.1));
    let told = above.iter().take(TOLD).filter_map(|(at, noises)| {
        let channel = channels.get(*at)?;
        Some((&*channel.name, noises * channel.noise, channel.noise, model.unit(channel)))
    });
    keep(&told.collect::<Vec<_>>())
}

/// Returns what the residual of a channel follows most, with the part it explains.
fn follows(model: &Model, channel: &Channel, part: &[f64]) -> (f64, String) {
    let course = &model.course;
    let (data, plant) = (&course.data, &course.plant);
    let n = plant.n;
    let first = course.first_row;
    let at = |values: &[f64], joint: usize| -> Vec<f64> {
        course.at_rows(values, joint)[first..course.last_row].to_vec()
    };
    let own = channel.quantity != Quantity::Tip;
    let joints: Vec<usize> = if own { vec![channel.index] } else { (0..n).collect() };
    let mut features: Vec<(String, Vec<f64>)> = vec![
        ("a constant".into(), vec![1.0; part.len()]),
        (
            "time".into(),
            data.time[first..course.last_row].iter().map(|t| t - data.time[0]).collect(),
        ),
    ];
    for j in joints {
        let (q, dq, ddq) = (at(&plant.q, j), at(&plant.dq, j), at(&plant.ddq, j));
        let load = at(&plant.bias, j);
        let name = |what: &str| what.replace('#', &format!("_{}", j + 1));
        features.push((name("sign(dq#)"), dq.iter().map(|v| (v / 5e-3).tanh()).collect()));
        features.push((name("dq#"), dq.clone()));
        features.push((name("dq#*abs(dq#)"), dq.iter().map(|v| v * v.abs()).collect()));
        features.push((name("ddq#"), ddq));
        features.push((name("q#"), q));
        features.push((wording::load_at(j), load));
    }
    let total = sum_of_squares(part).max(1e-300);
    let mut best = (0.0, String::from("no single state"));
    for (name, values) in features {
        let norm = sum_of_squares(&values);
        if norm <= 0.0 {
            continue;
        }
        let along: f64 = values.iter().zip(part).map(|(v, r)| v * r).sum();
        let explained = along * along / norm / total;
        if explained > best.0 {
            best = (explained, name);
        }
    }
    let (explained, name) = best;
    let when = segments(model, part);
    let text = if explained > 0.3 {
        format!("{name}, {when}")
    } else {
        format!("no single state, {when}")
    };
    (explained.max(1e-6), text)
}

/// Says in which stretches of time the residual is large.
fn segments(model: &Model, part: &[f64]) -> String {
    let data = &model.course.data;
    let first = model.course.first_row;
    let total = sum_of_squares(part).max(1e-300);
    let quarter = part.len().div_ceil(4).max(1);
    let shares: Vec<f64> =
        part.chunks(quarter).map(|chunk| sum_of_squares(chunk) / total).collect();
    match shares.iter().position(|share| *share > 0.7) {
        Some(at) => {
            let from = data.time[first + at * quarter];
            let to = data.time[(first + (at + 1) * quarter).min(data.n_rows()) - 1];
            format!("mostly from {from:.1} s to {to:.1} s")
        }
        None => "all segments".into(),
    }
}
