//! Evidence drawn anew: would the same be said of other stretches of the recordings?
//!
//! A set of residuals is cut into stretches, and each is given a weight at random, 1 in the mean; the sums of squares of an
//! explanation are then those of the stretches so weighed. Every stretch keeps some weight: what is seen once and clearly, such
//! as a jar lifted off a scale, is seen in every draw. What was fitted stays as it was, so that a hundred draws cost no more
//! than one evaluation; the share of draws in which a name still wins is its stability. It says how much hangs on a few
//! stretches, not how the numbers themselves would change.
//!
//! Source: Rubin, "The Bayesian Bootstrap", 1981, for the weights; Künsch, "The Jackknife and the Bootstrap for General
//! Stationary Observations", 1989, for stretches; Kishino, Miyata and Hasegawa, "Maximum Likelihood Inference of Protein
//! Phylogeny", 1990, for drawing without a fit.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Stretches of one set of data: long beside what relates one row to the next, and enough of them to draw from.
pub const STRETCHES: usize = 20;

/// How often is drawn.
pub const DRAWS: usize = 100;

/// The weight of each stretch.
pub type Draw = [f64; STRETCHES];

/// A piece of a recording that decides nothing has at least so many rows, where there are as many.
const LEAST_PIECE: usize = 10;

/// Returns whether a row held out decides nothing and is only told of: the last third of every stretch, or of fewer ones of short
/// recordings.
pub fn is_unseen(row: usize, rows: usize) -> bool {
    let stretches = (rows / (3 * LEAST_PIECE)).clamp(1, STRETCHES);
    (row * 3 * stretches / rows.max(1)) % 3 == 2
}

/// The same for readings that say nothing of each other: every third.
pub fn is_unseen_alone(reading: usize) -> bool {
    reading % 3 == 2
}

/// Returns the sum of squares of each stretch, of equally many values but for rounding. Fewer values than stretches are spread
/// over them evenly: what was read once cannot be drawn otherwise, and counts in every draw for what it is.
pub fn sums(values: &[f64]) -> Draw {
    let n = values.len();
    if n < STRETCHES {
        return spread(values);
    }
    std::array::from_fn(|k| {
        let own = &values[k * n / STRETCHES..(k + 1) * n / STRETCHES];
        own.iter().map(|value| value * value).sum()
    })
}

/// Returns the squares of fewer values than stretches, each in equal parts over as much of them as is its own.
fn spread(values: &[f64]) -> Draw {
    let own = STRETCHES as f64 / values.len().max(1) as f64;
    std::array::from_fn(|k| {
        let part = |(i, value): (usize, &f64)| {
            let (from, to) = (i as f64 * own, (i + 1) as f64 * own);
            let shared = (to.min((k + 1) as f64) - from.max(k as f64)).max(0.0);
            value * value * shared / own
        };
        values.iter().enumerate().map(part).sum()
    })
}

/// Returns the sum of squares of stretches so weighed.
pub fn drawn(sums: &Draw, draw: &Draw) -> f64 {
    sums.iter().zip(draw).map(|(sum, weight)| sum * weight).sum()
}

/// Returns the draws of the data fitted and held out: always the same.
pub fn draws() -> Vec<[Draw; 2]> {
    let mut chance = StdRng::seed_from_u64(1);
    let mut draw = || {
        // Gaps between uniform numbers, by exponential ones.
        let parts: Draw = std::array::from_fn(|_| -chance.random_range(f64::EPSILON..1.0).ln());
        let whole: f64 = parts.iter().sum();
        parts.map(|part| part * STRETCHES as f64 / whole)
    };
    (0..DRAWS).map(|_| [draw(), draw()]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_the_rows_decides_nothing_in_every_stretch() {
        for rows in [20, 61, 600, 12_345] {
            let unseen: Vec<bool> = (0..rows).map(|row| is_unseen(row, rows)).collect();
            let part = unseen.iter().filter(|unseen| **unseen).count() as f64 / unseen.len() as f64;
            assert!((0.28..0.36).contains(&part), "{part} of {rows}");
            let stretches = unseen.chunks(rows.div_ceil(rows.div_ceil(40).min(STRETCHES)));
            let has_both = |one: &[bool]| one.contains(&true) && one.contains(&false);
            assert!(stretches.into_iter().all(has_both), "{rows}");
        }
        assert!(!is_unseen(0, 1));
    }

    #[test]
    fn all_stretches_together_are_everything() {
        for n in [0, 1, 7, 19, 20, 107] {
            let values: Vec<f64> = (0..n).map(|i| f64::from(i) + 0.5).collect();
            let whole: f64 = values.iter().map(|value| value * value).sum();
            let drawn = drawn(&sums(&values), &[1.0; STRETCHES]);
            assert!((drawn - whole).abs() <= 1e-9 * whole, "{n}: {drawn} of {whole}");
        }
    }

    #[test]
    fn what_was_read_once_is_in_every_draw() {
        let once = sums(&[5.0]);
        for [fitted, held_out] in draws() {
            assert!((drawn(&once, &fitted) - 25.0).abs() < 1e-9);
            assert!((drawn(&once, &held_out) - 25.0).abs() < 1e-9);
        }
    }

    /// The share of draws in which gains by stretch are above some charge.
    fn share(gains: &Draw, charge: f64) -> f64 {
        let wins = draws().iter().filter(|[fitted, _]| drawn(gains, fitted) > charge).count();
        wins as f64 / DRAWS as f64
    }

    #[test]
    fn what_is_clear_once_is_steady_and_what_is_doubtful_is_not() {
        let mut once = [0.0; STRETCHES];
        once[3] = 1000.0;
        assert!(share(&once, 10.0) > 0.9);
        // One stretch speaks for it by 12, of which 10 are charged: it must weigh no less than 10/12, e^(-10/12) of the draws.
        once[3] = 12.0;
        let doubtful = share(&once, 10.0);
        assert!((0.3..0.6).contains(&doubtful), "{doubtful}");
        assert!((share(&[1.0; STRETCHES], 10.0) - 1.0).abs() < 1e-12);
    }
}
