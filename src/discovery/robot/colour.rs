//! Coloured noise, which is larger than differences of rows say, told from what is missing.
//!
//! Not a test of what it follows: that is the search's, and this is asked only where the search found nothing.

use super::channels::Quantity;
use super::explain::{ArmGap, WithKnown};
use super::simulate::Model;
use super::term::Term;
use crate::discovery::finding::MATTERS;
use crate::discovery::selection::{Hypothesis, sum_of_squares};

/// The parts of a recording that are compared, and how much more than the middle one the largest holds, in squares, of what
/// is there throughout.
const PARTS: usize = 10;
const THROUGHOUT: f64 = 5.0;
/// How much more one set of recordings may hold than the other, in squares.
const ALIKE: f64 = 2.0;

/// How many times sooner than the motion noise forgets what it was: what follows angles and speeds changes as they do.
const SOONER: usize = 8;

/// Returns which part of the signal what is left is, in root mean squares, if it looks like noise: there throughout, in the
/// recordings held out as in those fitted, and small beside the signal or forgotten much sooner than the motion.
pub(super) fn coloured_noise(gap: &ArmGap, h: &Hypothesis<Term>) -> Option<f64> {
    let with = gap.with_known(&h.terms, &h.parameters);
    let sizes = |models: &[Model]| {
        let all: Option<Vec<Sizes>> = models.iter().map(|model| Sizes::of(model, &with)).collect();
        Some(all?.into_iter().fold(Sizes::default(), Sizes::and))
    };
    let (train, heldout) = (sizes(&gap.train)?, sizes(&gap.heldout)?);
    let alike = train.mean() / heldout.mean().max(1e-300);
    let both = train.and(heldout);
    let part = (both.left / both.signal.max(1e-300)).sqrt();
    let is_of_its_own = part < MATTERS || both.forgets;
    let is_noise = both.is_throughout && is_of_its_own && (1.0 / ALIKE..ALIKE).contains(&alike);
    is_noise.then_some(part)
}

/// Sums of squares over the channels of recordings, in units of their noise.
#[derive(Clone, Copy)]
struct Sizes {
    left: f64,
    signal: f64,
    rows: usize,
    /// Whether every part of every recording holds about as much.
    is_throughout: bool,
    /// Whether what is left of every recording is forgotten much sooner than its motion.
    forgets: bool,
}

impl Default for Sizes {
    fn default() -> Self {
        Self { left: 0.0, signal: 0.0, rows: 0, is_throughout: true, forgets: true }
    }
}

impl Sizes {
    fn of(model: &Model, with: &WithKnown) -> Option<Self> {
        let left = with.residuals(model)?;
        let data = &model.course.data;
        let rows = data.n_rows();
        let predicted = data.channels.iter().filter(|c| model.is_predicted(c.quantity));
        let mut found = Self::default();
        let mut parts = [0.0; PARTS];
        let mut all_left = Vec::new();
        for (at, channel) in predicted.enumerate() {
            let judged = model.course.first_row..model.course.last_row;
            let left = &left[at * rows..(at + 1) * rows][judged.clone()];
            let read = judged.filter(|row| channel.is_read(*row));
            let values: Vec<f64> = read.map(|row| channel.values[row]).collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            found.left += sum_of_squares(left);
            found.signal +=
                values.iter().map(|v| ((v - mean) / channel.noise).powi(2)).sum::<f64>();
            found.rows += values.len();
            let length = left.len().div_ceil(PARTS).max(1);
            for (sum, part) in parts.iter_mut().zip(left.chunks(length)) {
                *sum += sum_of_squares(part);
            }
            all_left.push(left.to_vec());
        }
        let angles = data.channels.iter().filter(|c| c.quantity == Quantity::Position);
        let motion = angles.map(|channel| {
            let values = &channel.values[model.course.first_row..model.course.last_row];
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            values.iter().map(|value| value - mean).collect()
        });
        let motion: Vec<Vec<f64>> = motion.collect();
        found.forgets = SOONER * memory(&all_left) <= memory(&motion);
        parts.sort_by(f64::total_cmp);
        found.is_throughout = parts[PARTS - 1] <= THROUGHOUT * parts[PARTS / 2];
        Some(found)
    }

    fn mean(&self) -> f64 {
        self.left / self.rows.max(1) as f64
    }

    fn and(self, other: Self) -> Self {
        Self {
            left: self.left + other.left,
            signal: self.signal + other.signal,
            rows: self.rows + other.rows,
            is_throughout: self.is_throughout && other.is_throughout,
            forgets: self.forgets && other.forgets,
        }
    }
}

/// Returns after how many rows several channels have forgotten half of what they had in common with the row before; what is white of
/// them has nothing in common with it, and does not count.
fn memory(channels: &[Vec<f64>]) -> usize {
    let longest = channels.iter().map(Vec::len).max().unwrap_or(0) / 2;
    let common = |lag: usize| -> f64 {
        let of = |values: &Vec<f64>| -> f64 {
            let later = values.iter().skip(lag);
            values.iter().zip(later).map(|(now, later)| now * later).sum()
        };
        channels.iter().map(of).sum()
    };
    let next = common(1);
    let mut lag = 1;
    while lag < longest && common(lag) > 0.5 * next {
        lag = (lag + 1).max(lag * 9 / 8);
    }
    lag
}

#[cfg(test)]
mod tests {
    use super::memory;

    /// Noise that is pulled back to nothing within so many rows, and a swing in which every row has as much white noise.
    #[test]
    fn noise_forgets_sooner_than_what_follows_a_motion() {
        let chance = |i: usize| {
            let x = (i as f64 * 12.9898).sin() * 43758.547;
            3.5 * (x - x.floor() - 0.5)
        };
        let mut value = 0.0;
        let coloured = |i: usize| {
            value = 0.9 * value + 0.44 * chance(i);
            value
        };
        let coloured: Vec<f64> = (0..2000).map(coloured).collect();
        let swing = |i: usize| (i as f64 * 0.01).sin();
        let motion: Vec<f64> = (0..2000).map(swing).collect();
        let buried: Vec<f64> = (0..2000).map(|i| swing(i) + chance(i)).collect();
        let (short, long, within) = (memory(&[coloured]), memory(&[motion]), memory(&[buried]));
        assert!((4..14).contains(&short), "{short} rows");
        assert!((90..125).contains(&long), "{long} rows");
        assert!(8 * short <= long && 8 * within > long, "{short}, {within} and {long} rows");
    }
}
