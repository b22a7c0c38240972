//! Fit, find the measurements that do not belong, and fit again without them.
//!
//! The robust pass only decides which blocks are outliers; the answer and its covariance come from plain
//! least squares on the rest, so that they mean what they say.

use super::{Error, Fit, Loss, Options, Problem, solve};

/// A fit and the blocks that were left out of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejection {
    /// The fit to the blocks that were kept.
    pub fit: Fit,
    /// The blocks left out, in order.
    pub outliers: Vec<usize>,
}

/// Solves with residuals in units of their standard deviation and without outliers.
///
/// A block of `d` residuals is left out when it is longer than `cut` (in standard deviations, or in
/// multiples of what the median block says when that is more, so that a noise estimate that is too small
/// does not reject everything). At most half of the blocks are left out.
///
/// # Errors
///
/// As [`solve`].
pub fn solve_rejecting<P: Problem>(
    problem: &P,
    x0: &[f64],
    options: &Options,
    cut: f64,
) -> Result<Rejection, Error> {
    let block = problem.block().max(1);
    let n_blocks = problem.n_residuals().div_ceil(block);
    let given: Vec<f64> =
        (0..n_blocks).map(|b| options.weights.get(b).copied().unwrap_or(1.0)).collect();
    // First Huber, which has one minimum near the start, then Cauchy, which forgets far outliers.
    let mut robust = options.clone();
    robust.loss = Loss::Huber(2.0);
    let start = solve(problem, x0, &robust)?;
    robust.loss = Loss::Cauchy(2.0);
    let start = solve(problem, &start.x, &robust)?;
    let lengths = |fit: &Fit| -> Vec<f64> {
        fit.residuals
            .chunks(block)
            .zip(&given)
            .map(|(c, w)| (w * c.iter().map(|v| v * v).sum::<f64>()).sqrt())
            .collect()
    };
    let mut options = options.clone();
    options.loss = Loss::None;
    let mut fit = start;
    let mut outliers: Option<Vec<usize>> = None;
    for _ in 0..5 {
        let length = lengths(&fit);
        let mut sorted: Vec<f64> =
            length.iter().zip(&given).filter(|(_, w)| **w > 0.0).map(|(l, _)| *l).collect();
        sorted.sort_by(f64::total_cmp);
        // Median length of a d-dimensional standard normal vector: 0.674, 1.177, 1.538 for d = 1, 2, 3.
        let typical = match block {
            1 => 0.674,
            2 => 1.177,
            3 => 1.538,
            d => (d as f64 - 2.0 / 3.0).sqrt(),
        };
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let limit = cut * (median / typical).max(1.0);
        let now: Vec<usize> =
            (0..n_blocks).filter(|&b| given[b] > 0.0 && length[b] > limit).collect();
        if outliers.as_ref() == Some(&now) {
            break;
        }
        options.weights = given
            .iter()
            .enumerate()
            .map(|(b, w)| if now.contains(&b) { 0.0 } else { *w })
            .collect();
        outliers = Some(now);
        fit = solve(problem, &fit.x, &options)?;
    }
    Ok(Rejection { fit, outliers: outliers.unwrap_or_default() })
}
