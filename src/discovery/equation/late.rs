//! What is late is compared where its past is known.
//!
//! A late input asks for what it was before the first row, and a late sensor for what there was to be seen; neither was measured, and
//! what stands for it is a guess. Where dynamics are linear the two are the same, and what tells them apart must not be that guess.

use super::columns::Data;
use super::estimate::Estimate;
use super::hypothesis::{Chosen, Hypothesis, Question, with_values};
use super::windows::windows;
use crate::discovery::resample::is_unseen;

/// What is later by a time that is one of its numbers.
const LATE: [&str; 2] = ["input_delay", "sensor_delay"];
/// Of a window at most one row in so many is left out for its past.
const LEFT_OUT: usize = 4;

impl Question<'_> {
    /// Two hypotheses and what they extend as if nothing had been measured in the first seconds of each window, as many as their
    /// effects `own` and `other` are late; `None` where neither is late.
    pub(super) fn past_known(
        &self,
        without: &Hypothesis,
        (best, own): (&Hypothesis, &Chosen),
        (rival, other): (&Hypothesis, &Chosen),
    ) -> Option<[Hypothesis; 3]> {
        let past = lateness(best, own).max(lateness(rival, other));
        (past > 0.0).then(|| [without, best, rival].map(|h| self.after(h, past)))
    }

    /// A hypothesis as if nothing had been measured in the first `past` seconds of each window.
    fn after(&self, hypothesis: &Hypothesis, past: f64) -> Hypothesis {
        let mut after = hypothesis.clone();
        let (train, held) = (&hypothesis.fitted.train, &hypothesis.held);
        after.fitted.train.sums = self.sums_after(train, &self.bench.train, past, |_, _| true);
        after.held.sums =
            self.sums_after(held, &self.bench.held, past, |row, rows| !is_unseen(row, rows));
        after
    }

    /// The sums of squares of an estimate without the first `past` seconds of each window, of rows that `has_say`.
    fn sums_after(
        &self,
        of: &Estimate,
        data: &[Data],
        past: f64,
        has_say: fn(usize, usize) -> bool,
    ) -> Vec<(f64, usize)> {
        let windows = windows(data, self.bench.rows, self.bench.most_rows);
        let rows: usize = windows.iter().map(|w| w.rows.len()).sum();
        let mut kept = Vec::with_capacity(rows);
        for window in &windows {
            let (time, from) = (&data[window.data].time, window.rows.start);
            let most = window.rows.len() / LEFT_OUT;
            let is_known = |row: usize| row - from >= most || time[row] - time[from] >= past;
            kept.extend(window.rows.clone().map(is_known));
        }
        let of_output = |left: &Vec<f64>| {
            let told = left.iter().zip(&kept).enumerate();
            let told = told.filter(|(row, (_, kept))| **kept && has_say(*row, rows));
            told.fold((0.0, 0), |(sum, n), (_, (value, _))| (sum + value * value, n + 1))
        };
        of.residuals.iter().map(of_output).collect()
    }
}

/// By how many seconds an effect is late; 0 of one that is not.
fn lateness(at: &Hypothesis, effect: &Chosen) -> f64 {
    if !LATE.contains(&effect.candidate.kind) {
        return 0.0;
    }
    let patch = with_values(&effect.patch, &at.fitted, false);
    let delay = patch.params.iter().find(|param| param.role == "delay");
    delay.map_or(0.0, |param| param.value.max(0.0))
}
