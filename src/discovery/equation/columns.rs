//! What was measured, as the columns a model asks for.
//!
//! Angles that wrap at a turn are unrolled, gaps in time cut a recording into stretches, and long
//! recordings are thinned where nothing is lost. Nothing is filtered or differentiated.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::super::recording::{Recording, noise, usual_step};
use super::compile::Compiled;
use super::wording;
use crate::units::Dimension;

/// A recording as a model sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// The recording's name.
    pub name: String,
    /// When each row was taken, s.
    pub time: Vec<f64>,
    /// The usual step of time ([`usual_step`]), s.
    pub step: f64,
    /// One column per input, in SI.
    pub inputs: Vec<Vec<f64>>,
    /// One column per output, in SI.
    pub outputs: Vec<Vec<f64>>,
    /// Standard deviation of the noise of each output.
    pub noise: Vec<f64>,
    /// Whether it begins where a motion begins, so that a model's first values hold there.
    pub begins: bool,
}

/// A jump of time longer than this many usual steps is a gap.
const GAP: f64 = 5.0;
/// By this part a jump may be longer and no gap: times written with nine digits are as exact.
const ROUNDING: f64 = 1e-6;

impl Data {
    /// Takes the columns of a model's inputs and outputs out of a recording.
    ///
    /// # Errors
    ///
    /// As [`Recording::column`] when one is missing, in another unit, or not a number.
    pub fn from_recording(
        recording: &Recording,
        model: &Compiled,
    ) -> Result<(Self, Vec<String>), super::super::recording::Error> {
        let mut notes = Vec::new();
        let mut read = |name: &str, dimension: Option<Dimension>| {
            let given = recording.columns.iter().find(|c| c.name == name);
            let own = given.and_then(|c| c.unit).map(|u| u.dimension);
            // A column in rad serves a model in plain numbers, and the other way round.
            let asked = match (dimension, own) {
                (Some(asked), Some(own)) if plain(asked) == plain(own) => own,
                (Some(asked), _) => asked,
                (None, Some(own)) => own,
                (None, None) => Dimension::NONE,
            };
            let mut values = recording.column(name, asked)?.to_vec();
            if asked == Dimension::ANGLE {
                let turns = unroll(&mut values);
                if turns > 0 {
                    notes.push(wording::unrolled(&recording.name, name, turns));
                }
            }
            Ok(values)
        };
        let inputs = model
            .inputs
            .iter()
            .map(|(name, dimension)| read(name, *dimension))
            .collect::<Result<Vec<_>, _>>()?;
        let outputs = model
            .outputs
            .iter()
            .map(|output| read(&output.name, output.dimension))
            .collect::<Result<Vec<_>, _>>()?;
        let noise = outputs.iter().map(|values| noise::estimate(&recording.time, values)).collect();
        // Seconds since 1970 leave no digits for a step; the first row is as good a beginning.
        let first = recording.time[0];
        let origin = if first.abs() > 1e6 { first } else { 0.0 };
        let time: Vec<f64> = recording.time.iter().map(|t| t - origin).collect();
        let (name, step) = (recording.name.clone(), usual_step(&time));
        Ok((Self { name, time, step, inputs, outputs, noise, begins: true }, notes))
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.time.len()
    }

    /// The rows of each stretch without a gap in time.
    pub fn stretches(&self) -> Vec<Range<usize>> {
        let limit = GAP * self.step * (1.0 + ROUNDING);
        let mut out = Vec::new();
        let mut from = 0;
        for i in 1..self.n_rows() {
            if self.time[i] - self.time[i - 1] > limit {
                out.push(from..i);
                from = i;
            }
        }
        out.push(from..self.n_rows());
        out.retain(|r| r.len() >= 3);
        out
    }

    /// Rows `range` as data of their own.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> Self {
        let cut = |columns: &[Vec<f64>]| -> Vec<Vec<f64>> {
            columns.iter().map(|c| c[range.clone()].to_vec()).collect()
        };
        let time = self.time[range.clone()].to_vec();
        Self {
            name: self.name.clone(),
            step: usual_step(&time),
            time,
            inputs: cut(&self.inputs),
            outputs: cut(&self.outputs),
            noise: self.noise.clone(),
            begins: self.begins && range.start == 0,
        }
    }

    /// The input at any time, between rows along a straight line or a cubic, and its slope.
    pub(super) fn input_at(&self, input: usize, t: f64, curved: bool) -> (f64, f64) {
        let values = &self.inputs[input];
        if curved { curve(&self.time, values, t) } else { interpolate(&self.time, values, t) }
    }

    /// Averages over blocks of `k` rows; stretches are kept apart.
    #[must_use]
    pub fn thinned(&self, k: usize) -> Self {
        if k < 2 {
            return self.clone();
        }
        let blocks: Vec<Range<usize>> = self
            .stretches()
            .into_iter()
            .flat_map(|r| {
                r.clone().step_by(k).map(move |i| i..(i + k).min(r.end)).collect::<Vec<_>>()
            })
            .filter(|b| b.len() * 2 >= k)
            .collect();
        let average = |values: &[f64]| -> Vec<f64> {
            blocks.iter().map(|b| mean(&values[b.clone()])).collect()
        };
        let time = average(&self.time);
        Self {
            name: self.name.clone(),
            step: usual_step(&time),
            time,
            inputs: self.inputs.iter().map(|c| average(c)).collect(),
            outputs: self.outputs.iter().map(|c| average(c)).collect(),
            noise: self.noise.iter().map(|n| n / (k as f64).sqrt()).collect(),
            begins: self.begins,
        }
    }

    /// The largest thinning up to `most` that a straight line between the rows that are left undoes, to
    /// a hundredth of each column's size or to its noise.
    pub fn thinning(&self, most: usize) -> usize {
        let mut k = most.max(1);
        while k > 1 {
            let thin = self.thinned(k);
            let fits = |full: &[f64], thin_values: &[f64]| {
                let size = std(full);
                let floor = 1.5 * noise::estimate(&self.time, full);
                let rest: Vec<f64> = full
                    .iter()
                    .zip(&self.time)
                    .map(|(v, t)| v - interpolate(&thin.time, thin_values, *t).0)
                    .collect();
                rms(&rest) <= (0.01 * size).max(floor) || size < 1e-300
            };
            let outputs = self.outputs.iter().zip(&thin.outputs).all(|(a, b)| fits(a, b));
            let inputs = self.inputs.iter().zip(&thin.inputs).all(|(a, b)| {
                let rest: Vec<f64> = a
                    .iter()
                    .zip(&self.time)
                    .map(|(v, t)| v - interpolate(&thin.time, b, *t).0)
                    .collect();
                rms(&rest) <= 0.3 * std(a) || std(a) < 1e-300
            });
            if outputs && inputs && thin.n_rows() >= 60 {
                return k;
            }
            k = (k * 2 / 3).min(k - 1);
        }
        1
    }
}

/// A dimension without its angle, which counts as a number.
fn plain(dimension: Dimension) -> Dimension {
    Dimension { angle: 0, ..dimension }
}

/// Value and slope of a column at a time; before the first row and after the last it stands still.
pub(super) fn interpolate(time: &[f64], values: &[f64], t: f64) -> (f64, f64) {
    let n = time.len();
    if n == 0 || t <= time[0] {
        return (values.first().copied().unwrap_or(0.0), 0.0);
    }
    if t >= time[n - 1] {
        return (values[n - 1], 0.0);
    }
    let i = place(time, t);
    let slope = (values[i + 1] - values[i]) / (time[i + 1] - time[i]);
    (values[i] + slope * (t - time[i]), slope)
}

/// The row before a time that lies between the first row and the last.
pub(super) fn place(time: &[f64], t: f64) -> usize {
    let n = time.len();
    // Rows are nearly even, so the place is nearly known.
    let guess = ((t - time[0]) / (time[n - 1] - time[0]) * (n - 1) as f64) as usize;
    let i = guess.min(n - 2);
    if time[i] <= t && t <= time[i + 1] {
        return i;
    }
    time.partition_point(|v| *v <= t).clamp(1, n - 1) - 1
}

/// Value and slope on the cubic whose slopes at the rows are those of parabolas through their
/// neighbours.
///
/// Source: Catmull and Rom, "A Class of Local Interpolating Splines", 1974.
fn curve(time: &[f64], values: &[f64], t: f64) -> (f64, f64) {
    let n = time.len();
    if n < 4 || t <= time[0] || t >= time[n - 1] {
        return interpolate(time, values, t);
    }
    let i = place(time, t);
    let chord = |j: usize| (values[j + 1] - values[j]) / (time[j + 1] - time[j]);
    let slope = |j: usize| {
        if j == 0 || j + 1 == n {
            return chord(j.min(n - 2));
        }
        let (a, b) = (time[j] - time[j - 1], time[j + 1] - time[j]);
        (b * chord(j - 1) + a * chord(j)) / (a + b)
    };
    let h = time[i + 1] - time[i];
    let s = (t - time[i]) / h;
    let (from, to, c) = (slope(i), slope(i + 1), chord(i));
    // Hermite's cubic by its differences from the chord.
    let (a, b) = (from - c, to - c);
    let bend = s * (1.0 - s) * (a * (1.0 - s) - b * s);
    let bent = a * (1.0 - s) * (1.0 - 3.0 * s) + b * s * (3.0 * s - 2.0);
    (values[i] + h * (c * s + bend), c + bent)
}

/// A wrapped angle stays inside one turn. A column that spans more turns than this has none to take out, and what jumps in it is
/// fast, or lacks rows; what is over one turn leaves room for noise. Chosen.
const ONE_TURN: f64 = 1.05;

/// Takes jumps of a whole turn out of an angle that was wrapped; returns how many.
fn unroll(values: &mut [f64]) -> usize {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if high - low > ONE_TURN * TAU {
        return 0;
    }
    let (mut turns, mut count) = (0.0, 0);
    let mut before = values.first().copied().unwrap_or(0.0);
    for value in values.iter_mut() {
        let jump = *value - before;
        before = *value;
        // Nothing turns by nearly a whole turn between two samples.
        if jump.abs() > 1.5 * PI {
            turns -= TAU * (jump / TAU).round();
            count += 1;
        }
        *value += turns;
    }
    count
}

/// Mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / (values.len().max(1) as f64)
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / (values.len().max(1) as f64)).sqrt()
}

/// Standard deviation about the mean.
pub fn std(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len().max(1) as f64)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By how much the steps of a column differ from `step` once it is unrolled, at most, and how often it wrapped.
    fn unrolled(mut values: Vec<f64>, step: f64) -> (f64, usize) {
        let turns = unroll(&mut values);
        let off = values.windows(2).map(|pair| (pair[1] - pair[0] - step).abs());
        (off.fold(0.0, f64::max), turns)
    }

    #[test]
    fn an_angle_that_wraps_is_unrolled() {
        let wrapped = (0..60).map(|row| (0.3 * f64::from(row)).rem_euclid(TAU) - PI).collect();
        let (off, turns) = unrolled(wrapped, 0.3);
        assert!(turns == 2 && off < 1e-9, "{turns} times, {off}");
    }

    /// A motor at 250 rad/s was wound back by a turn wherever a row of 10 ms was missing.
    #[test]
    fn a_fast_angle_of_many_turns_is_left_as_it_is() {
        let rows = (0..60).filter(|row| row % 7 != 3);
        let (off, turns) = unrolled(rows.map(|row| 2.5 * f64::from(row)).collect(), 2.5);
        assert!(turns == 0 && (off - 2.5).abs() < 1e-9, "{turns} times, {off}");
    }
}
