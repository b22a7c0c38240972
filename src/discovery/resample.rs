//! Evidence drawn anew: would the same be said of other stretches of the recordings?
//!
//! A set of residuals is cut into stretches, which are drawn as often as there are, with some twice and some not at
//! all; the sums of squares of an explanation are then those of the stretches drawn. What was fitted stays as it was,
//! so that a hundred draws cost no more than one evaluation; the share of draws in which a name still wins is its
//! stability. It says how much hangs on a few stretches, not how the numbers themselves would change.
//!
//! Source: Künsch, "The Jackknife and the Bootstrap for General Stationary Observations", 1989, for drawing stretches;
//! Kishino, Miyata and Hasegawa, "Maximum Likelihood Inference of Protein Phylogeny", 1990, for drawing without a fit.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Stretches of one set of data: long beside what relates one row to the next, and enough of them to draw from.
pub const STRETCHES: usize = 20;

/// How often is drawn.
pub const DRAWS: usize = 100;

/// How often each stretch was drawn.
pub type Draw = [f64; STRETCHES];

/// Returns the sum of squares of each stretch, of equally many values but for rounding.
pub fn sums(values: &[f64]) -> Draw {
    let n = values.len();
    std::array::from_fn(|k| {
        let own = &values[k * n / STRETCHES..(k + 1) * n / STRETCHES];
        own.iter().map(|value| value * value).sum()
    })
}

/// Returns the sum of squares of what was drawn.
pub fn drawn(sums: &Draw, draw: &Draw) -> f64 {
    sums.iter().zip(draw).map(|(sum, times)| sum * times).sum()
}

/// Returns the draws of the data fitted and held out: always the same.
pub fn draws() -> Vec<[Draw; 2]> {
    let mut chance = StdRng::seed_from_u64(1);
    let mut draw = || {
        let mut times = [0.0; STRETCHES];
        for _ in 0..STRETCHES {
            times[chance.random_range(0..STRETCHES)] += 1.0;
        }
        times
    };
    (0..DRAWS).map(|_| [draw(), draw()]).collect()
}

/// Returns the share of draws for which something holds.
pub fn share(holds: impl FnMut(&[Draw; 2]) -> bool) -> f64 {
    let draws = draws();
    let count = draws.len() as f64;
    draws.iter().map(holds).filter(|holds| *holds).count() as f64 / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_stretches_together_are_everything() {
        let values: Vec<f64> = (0..107).map(f64::from).collect();
        let whole: f64 = values.iter().map(|value| value * value).sum();
        assert!((drawn(&sums(&values), &[1.0; STRETCHES]) - whole).abs() < 1e-9 * whole);
    }

    #[test]
    fn what_rests_on_one_stretch_is_not_steady() {
        // One stretch speaks for something by 10, all others against it by 0.1 each.
        let mut gains = [-0.1; STRETCHES];
        gains[3] = 10.0;
        // It is drawn at least once with probability 1 - (1 - 1/20)^20 = 0.64.
        let lone = share(|[fitted, _]| drawn(&gains, fitted) > 0.0);
        assert!((0.5..0.78).contains(&lone), "{lone}");
        let everywhere =
            share(|[fitted, held]| drawn(&[1.0; STRETCHES], fitted) > 0.0 && held[0] >= 0.0);
        assert!((everywhere - 1.0).abs() < 1e-12);
    }
}
