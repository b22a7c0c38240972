//! Whether a clock that runs too fast or too slow says the same as what was found.
//!
//! Where nothing drives a model, times that are all too long by one factor, as those of a video of another frame rate, look like
//! another gravity, another stiffness or another scale of a sensor. No effect is named for that: what the machine lacks and what its
//! recording lacks are told apart by who knows the camera.

use super::columns::Data;
use super::estimate::{Estimate, Task};
use super::fitting::{Bench, Fitted};
use super::hypothesis::{Hypothesis, Question};
use super::rivals::WORSE;
use super::score::twice_log_ratio;
use crate::discovery::finding::TIE;

/// Logarithms of the factors that are tried, to either side: up to nine times, beyond a slow motion of eight times.
const WIDEST: f64 = 2.2;
/// From one of them to the next.
const APART: f64 = 0.2;
/// How often the bottom between three of them is taken, each time of nearer ones.
const NEARER: usize = 6;
/// Iterations in which first values and free parameters follow.
const FOLLOWED: usize = 12;

/// Another clock, along which the model as it was given explains the data fitted as well as what was found does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    /// How many times as long as written times would be.
    pub(super) factor: f64,
    /// Whether it predicts the data held out as well. What is no law of the machine has to, however few rows count.
    pub(super) predicts: bool,
}

impl Question<'_> {
    /// Returns the clock along which the model as it was given explains the data fitted as well as the one effect found does; `None`
    /// where there is none, or something drives the model.
    pub(super) fn clock(&self, nominal: &Hypothesis, shown: &Hypothesis) -> Option<Clock> {
        let compiled = &nominal.fitted.compiled;
        let is_asked = shown.effects.len() == 1 && !self.bench.is_spent();
        if !is_asked || !compiled.inputs.is_empty() || compiled.states.is_empty() {
            return None;
        }
        self.pace(&nominal.fitted, shown)
    }

    fn pace(&self, own: &Fitted, shown: &Hypothesis) -> Option<Clock> {
        let train = &shown.fitted.train;
        let fit = |log: f64| -> Option<Estimate> {
            let paced = at_pace(&self.bench, log.exp());
            // Rounding must not cut otherwise what is only stretched.
            let windows = self.bench.task(&own.compiled).windows;
            let task = Task { windows, ..paced.task(&own.compiled) };
            let found = task.fit(&own.train.point, FOLLOWED).ok()?;
            found.residuals.iter().all(|left| !left.is_empty()).then_some(found)
        };
        // What is left, by output in units of what the effect leaves.
        let left = |log: f64| -> f64 {
            let part = |((there, _), (here, _)): (&(f64, usize), &(f64, usize))| {
                there / here.max(f64::MIN_POSITIVE)
            };
            let all = |found: Estimate| found.sums.iter().zip(&train.sums).map(part).sum::<f64>();
            fit(log).map_or(f64::INFINITY, all)
        };
        let n = (WIDEST / APART).round() as i32;
        let tried = (-n..=n).map(|k| f64::from(k) * APART).map(|log| (left(log), log));
        let (mut here, mut log) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut by = APART;
        for _ in 0..NEARER {
            let (less, more) = (left(log - by), left(log + by));
            let bend = less - 2.0 * here + more;
            let step = if bend > 0.0 { 0.5 * by * (less - more) / bend } else { 0.0 };
            let there = log + step.clamp(-by, by);
            let next = left(there);
            if next < here {
                (here, log) = (next, there);
            }
            by *= 0.2;
        }
        let counts = train.sums.iter().map(|(_, n)| *n as f64);
        let effective: Vec<f64> = shown.whites[0].iter().zip(counts).map(|(w, n)| w * n).collect();
        let found = fit(log)?;
        let behind = twice_log_ratio(&found.sums, &train.sums, &effective, &self.floors);
        if behind >= TIE {
            return None;
        }
        let (factor, fitted) = (log.exp(), Fitted { train: found, ..own.clone() });
        Some(Clock { factor, predicts: self.predicts(factor, fitted, shown) })
    }

    /// Returns whether the model as it was given, `fitted` along another clock, predicts the data held out as well as what was found.
    fn predicts(&self, factor: f64, fitted: Fitted, shown: &Hypothesis) -> bool {
        let near = Some((&shown.fitted.compiled, &shown.held));
        let held = at_pace(&self.bench, factor).held_out(&fitted, near);
        let paced = held.map(|held| Hypothesis::of(Vec::new(), fitted, held));
        let most = (1.0 + WORSE) * self.size(&shown.held);
        paced.is_some_and(|paced| self.size(&paced.held) < most)
    }
}

/// The recordings with every time so many times what is written.
fn at_pace(bench: &Bench, factor: f64) -> Bench {
    let paced = |data: &Data| Data {
        time: data.time.iter().map(|t| factor * t).collect(),
        step: factor * data.step,
        ..data.clone()
    };
    Bench {
        train: bench.train.iter().map(paced).collect(),
        held: bench.held.iter().map(paced).collect(),
        row: factor * bench.row,
        ..bench.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::edit::model_in;
    use super::super::estimate::Point;
    use super::super::made::unseen;
    use super::*;

    const FALLS: &str =
        "model m {\n state y = free, v = free\n y' = v\n v' = -9.81\n output y = y\n}\n";
    const SCALED: &str = "model m {\n param k = free ~ 0.7\n state y = free, v = free\n y' = v\n v' = -9.81\n output y = k*(y)\n}\n";
    const DRAGGED: &str = "model m {\n param k = free ~ 0.4\n state y = free, v = free\n y' = v\n v' = -9.81 - k*v\n output y = y\n}\n";

    /// How else times would have to be for what was seen to be a free fall, where `text` explains it with one number.
    fn pace(text: &str, seen: fn(f64) -> f64) -> Option<Clock> {
        pace_without(text, 0, 1.0, seen)
    }

    /// As [`pace`], with so many rows missing in the middle, and so much less left of the squares held out by what was found.
    fn pace_without(text: &str, missing: u32, less: f64, seen: fn(f64) -> f64) -> Option<Clock> {
        let mut bench = unseen(60, 1e-3, |_| 0.0);
        for data in bench.train.iter_mut().chain(&mut bench.held) {
            data.inputs.clear();
            let rows = (0..60).map(|row| if row < 30 { row } else { row + missing });
            data.time = rows.map(|row| 0.1 * f64::from(row)).collect();
            let noise = (0..60).map(|row| 1e-3 * (37.0 * f64::from(row)).sin());
            let seen = data.time.iter().map(|t| seen(*t));
            data.outputs[0] = seen.zip(noise).map(|(value, noise)| value + noise).collect();
        }
        let fitted = |text: &str, params: Vec<f64>| {
            let compiled = bench.prepare(text, "m").unwrap();
            let point = Point { params, starts: vec![vec![Some(1.0), Some(2.0)]] };
            let train = bench.task(&compiled).fit(&point, 60).unwrap();
            Fitted { text: text.into(), compiled, train }
        };
        let (own, found) = (fitted(FALLS, Vec::new()), fitted(text, vec![0.5]));
        let given = model_in(FALLS, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let mut shown = question.judged(Vec::new(), found, None).unwrap();
        shown.held.sums.iter_mut().for_each(|(sum, _)| *sum *= less);
        question.pace(&own, &shown)
    }

    #[test]
    fn a_scale_of_a_fall_may_be_a_clocks() {
        let found = pace(SCALED, |t| 1.0 + 1.6 * t - 4.905 * (0.8 * t).powi(2)).unwrap();
        assert!((found.factor - 0.8).abs() < 1e-3 && found.predicts, "{found:?}");
    }

    #[test]
    fn a_clock_that_predicts_worse_is_no_doubt() {
        let falls = |t: f64| 1.0 + 1.6 * t - 4.905 * (0.8 * t).powi(2);
        let found = pace_without(SCALED, 0, 0.5, falls).unwrap();
        assert!((found.factor - 0.8).abs() < 1e-3 && !found.predicts, "{found:?}");
    }

    /// A step of five usual ones is no gap and six are one; times stretched by a factor said otherwise by rounding, and a stretch
    /// had no first values.
    #[test]
    fn a_clock_cuts_no_recording_otherwise() {
        let falls = |t: f64| 1.0 + 1.6 * t - 4.905 * (0.8 * t).powi(2);
        let found = pace_without(SCALED, 4, 1.0, falls).unwrap();
        assert!((found.factor - 0.8).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_drag_is_no_clocks() {
        let falls = |t: f64| {
            let settled = -9.81 / 0.4;
            1.0 + settled * t + (2.0 - settled) / 0.4 * (1.0 - (-0.4 * t).exp())
        };
        assert_eq!(pace(DRAGGED, falls), None);
    }
}
