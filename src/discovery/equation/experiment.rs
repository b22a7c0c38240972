//! The input that would tell rivals apart: several kinds are tried in simulation, the best is kept.
//!
//! Source: Hunter and Reiner, "Designs for Discriminating Between Two Rival Models", 1965: measure where
//! the rivals differ most, each fitted as well as it can be.

use std::fmt::{self, Write as _};

use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::candidates::velocities;
use super::columns::Data;
use super::estimate::{Point, Task};
use super::hypothesis::{Hypothesis, Question};
use super::linear::{Regression, dot};
use crate::units::Dimension;

/// An input that tells rivals apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Separating {
    /// What it is like.
    pub(super) input: Input,
    /// By how many standard deviations of the noise the nearest rival that it settles would stand off.
    pub(super) sigma: f64,
    /// How many of the rivals it settles.
    pub(super) settled: usize,
    /// Time and inputs as a table.
    pub(super) csv: String,
}

/// What an input is like, in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Input {
    shape: Shape,
    /// Whether it goes as far the other way.
    both_ways: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shape {
    Steps,
    Sweep,
    Growing,
    Waves,
    Ramp,
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.shape {
            Shape::Steps => "steps to random levels over the whole range",
            Shape::Sweep => "a sweep from slow to fast over the whole range",
            Shape::Growing => "slow waves that grow from none to the whole range",
            Shape::Waves => "fast waves about levels that change",
            Shape::Ramp => "standstill, then a slow ramp over the whole range and back",
        })?;
        f.write_str(if self.both_ways { ", and as far the other way" } else { "" })
    }
}

/// A kind of input: its part of the range over time, 0 to 1.
struct Kind {
    shape: Shape,
    part: fn(f64, &mut StdRng, &mut f64) -> f64,
}

/// The kinds; the first argument is the part of the time that is over, the last what was drawn last.
const KINDS: [Kind; 5] = [
    Kind { shape: Shape::Steps, part: steps },
    Kind { shape: Shape::Sweep, part: sweep },
    Kind { shape: Shape::Growing, part: growing },
    Kind { shape: Shape::Waves, part: waves },
    Kind { shape: Shape::Ramp, part: ramp },
];

fn steps(_: f64, rng: &mut StdRng, held: &mut f64) -> f64 {
    if rng.random_range(0.0..1.0) < 0.04 {
        *held = rng.random_range(0.0..1.0);
    }
    *held
}

fn sweep(part: f64, _: &mut StdRng, _: &mut f64) -> f64 {
    // From 2 turns in the recording's time to 60.
    0.5 + 0.5 * (std::f64::consts::TAU * part * (2.0 + 29.0 * part)).sin()
}

fn growing(part: f64, _: &mut StdRng, _: &mut f64) -> f64 {
    0.5 + 0.5 * part * (std::f64::consts::TAU * 8.0 * part).sin()
}

fn waves(part: f64, rng: &mut StdRng, held: &mut f64) -> f64 {
    if rng.random_range(0.0..1.0) < 0.01 {
        *held = rng.random_range(0.2..0.8);
    }
    (*held + 0.2 * (std::f64::consts::TAU * 40.0 * part).sin()).clamp(0.0, 1.0)
}

fn ramp(part: f64, _: &mut StdRng, _: &mut f64) -> f64 {
    (3.0 * (part - 0.2).abs().min(0.9 - part).max(0.0) / 0.7).clamp(0.0, 1.0)
}

/// Squared distance, in standard deviations, that settles a doubt: ten in the criterion and the price of a
/// parameter.
const SETTLES: f64 = 16.0;
/// Longest experiment, in rows.
const MOST_ROWS: usize = 1500;

impl Question<'_> {
    /// The input that tells the most rivals from `best`, within the recorded range if one there tells as many;
    /// `None` when none does.
    pub(super) fn separating(
        &self,
        best: &Hypothesis,
        rivals: &[&Hypothesis],
    ) -> Option<Separating> {
        let mut found: Option<Separating> = None;
        for both_ways in [false, true] {
            // What the machine has never been told is asked for only where it can go both ways, and only if
            // what it has been told settles less.
            if both_ways && !self.goes_both_ways(best) {
                continue;
            }
            for (seed, kind) in (1_u64..).zip(&KINDS) {
                let Some(data) = self.planned(kind, seed, both_ways) else { continue };
                let apart: Vec<f64> = rivals
                    .iter()
                    .map(|rival| self.apart(best, rival, &data).unwrap_or(0.0))
                    .filter(|apart| *apart > SETTLES)
                    .collect();
                let Some(least) = apart.iter().copied().min_by(f64::total_cmp) else { continue };
                let (settled, sigma) = (apart.len(), least.sqrt());
                let better = found.as_ref().is_none_or(|f| {
                    settled > f.settled || !both_ways && settled == f.settled && sigma > f.sigma
                });
                if better {
                    let input = Input { shape: kind.shape, both_ways };
                    let csv = table(best, &data);
                    found = Some(Separating { input, sigma, settled, csv });
                }
            }
        }
        found
    }

    /// Whether inputs that went one way only drive something that moves, and so could as well drive it back.
    fn goes_both_ways(&self, best: &Hypothesis) -> bool {
        let Some(model) = super::edit::model_in(&best.fitted.text, self.name) else { return false };
        let ground = self.ground(&best.fitted, &model);
        ground.inputs.iter().any(|range| !range.changes_sign()) && !velocities(&ground).is_empty()
    }

    /// A recording yet to be made: time and inputs, all at once.
    fn planned(&self, kind: &Kind, seed: u64, both_ways: bool) -> Option<Data> {
        let like = self.bench.train.first()?;
        if like.inputs.is_empty() {
            return None;
        }
        let n = like.n_rows().min(MOST_ROWS);
        let step = like.step;
        let mut rng = StdRng::seed_from_u64(seed);
        let inputs = like
            .inputs
            .iter()
            .map(|column| {
                let low = column.iter().copied().fold(f64::INFINITY, f64::min);
                let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let (low, high) =
                    if both_ways { (low.min(-high), high.max(-low)) } else { (low, high) };
                let mut held = 0.5;
                (0..n)
                    .map(|i| {
                        let part = i as f64 / n as f64;
                        low + (high - low) * (kind.part)(part, &mut rng, &mut held)
                    })
                    .collect()
            })
            .collect();
        Some(Data {
            name: "planned".into(),
            time: (0..n).map(|i| i as f64 * step).collect(),
            step,
            inputs,
            outputs: vec![vec![0.0; n]; like.outputs.len()],
            noise: like.noise.clone(),
            begins: false,
        })
    }

    /// Squared distance between what two models say of planned inputs, in standard deviations of what is left
    /// of the gap, after the rival is fitted to the other as well as it can be.
    fn apart(&self, best: &Hypothesis, rival: &Hypothesis, data: &Data) -> Option<f64> {
        let data = std::slice::from_ref(data);
        let task = |h: &Hypothesis, model| -> (Task<'_>, Point) {
            let task = Task { all_starts_free: true, ..self.bench.task_on(model, data) };
            let first = h.fitted.train.point.starts.first().cloned().unwrap_or_default();
            let other: Vec<f64> = first.iter().map(|v| v.unwrap_or(0.0)).collect();
            let starts =
                task.windows.iter().map(|_| other.iter().copied().map(Some).collect()).collect();
            (task, Point { params: h.fitted.train.point.params.clone(), starts })
        };
        let (best_task, best_point) = task(best, &best.fitted.compiled);
        let said = best_task.run(&best_point).ok()?;
        let (rival_task, rival_point) = task(rival, &rival.fitted.compiled);
        let answered = rival_task.run(&rival_point).ok()?;
        let (_, mut columns) = rival_task.linearised(&rival_point)?;
        let n_out = self.bench.scales.len();
        let rms = best.fitted.train.rms();
        let noise = |o: usize| rms[o].max(self.bench.train[0].noise[o]).max(1e-300);
        let mut difference: Vec<f64> = said.iter().zip(&answered).map(|(a, b)| a - b).collect();
        for (i, value) in difference.iter_mut().enumerate() {
            *value /= noise(i % n_out);
        }
        for column in &mut columns {
            for (i, value) in column.iter_mut().enumerate() {
                *value *= self.bench.scales[i % n_out] / noise(i % n_out);
            }
        }
        let known: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let left = Regression::new(&known, &difference)?.beyond(&difference);
        Some(dot(&left, &left))
    }
}

/// Time and inputs with their units.
fn table(best: &Hypothesis, data: &Data) -> String {
    let mut text = String::from("t[s]");
    for (name, dimension) in &best.fitted.compiled.inputs {
        let unit = dimension.map(Dimension::si).filter(|unit| !unit.is_empty());
        let _ = write!(text, ",{name}{}", unit.map_or(String::new(), |u| format!("[{u}]")));
    }
    text.push('\n');
    for (row, time) in data.time.iter().enumerate() {
        let _ = write!(text, "{time:.6}");
        for column in &data.inputs {
            let _ = write!(text, ",{:.9}", column[row]);
        }
        text.push('\n');
    }
    text
}
