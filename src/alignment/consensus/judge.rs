//! The likelihood that models are judged by: inliers about the model with one unknown deviation, outliers anywhere.

use super::{Regression, Work};

/// How good a model is at its best mixture: the log-likelihood, and the mixture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    pub(super) value: f64,
    /// Standard deviation of inliers, per coordinate.
    pub(super) sigma: f64,
    /// Share of inliers.
    pub(super) share: f64,
}

/// Errors of more rows than this are counted in classes instead of sorted.
const SORTED: usize = 64;
/// Classes of squared errors, four to a factor of two: 64 factors of two from the square of half the floor on.
const CLASSES: usize = 256;

/// The mixture of inliers and outliers that models are judged by.
pub(super) struct Judge {
    pub(super) d: f64,
    pub(super) m: usize,
    pub(super) floor: f64,
    pub(super) floor2: f64,
    log_volume: f64,
    /// Logarithms of the share of inliers and of outliers when so many of the scored rows are inliers.
    log_share: Vec<(f64, f64)>,
}

impl Judge {
    pub(super) fn new<R: Regression>(regression: &R, n: usize) -> Self {
        let share = |k: usize| (k as f64 + 1.0) / (n as f64 + 2.0);
        Self {
            d: regression.dimension() as f64,
            m: regression.minimal(),
            floor: regression.floor(),
            floor2: regression.floor().powi(2),
            log_volume: regression.volume().ln(),
            log_share: (0..=n).map(|k| (share(k).ln(), (1.0 - share(k)).ln())).collect(),
        }
    }

    /// The log-likelihood gained over "all are outliers", at the best number of inliers.
    ///
    /// With the errors sorted, taking the `k` smallest as inliers gives `σ² = Σ e² / (d (k - m))`; the
    /// `m` rows of the sample fit by construction and gain nothing.
    pub(super) fn score(&self, errors: &mut [f64]) -> Score {
        let n = errors.len();
        if n <= SORTED {
            errors.sort_unstable_by(f64::total_cmp);
            return self.best_cut(n, errors.iter().map(|e2| (1, *e2)));
        }
        // Bits of a positive number from two below its exponent on: classes a factor of 2^(1/4) or so wide.
        let class = |e2: f64| (e2.to_bits() >> 50) as usize;
        let lowest = class(0.25 * self.floor2);
        let mut classes = [(0_usize, 0.0_f64); CLASSES];
        for &e2 in errors.iter() {
            let at = class(e2).saturating_sub(lowest);
            if let Some((count, sum)) = classes.get_mut(at) {
                *count += 1;
                *sum += e2;
            }
        }
        self.best_cut(n, classes.into_iter().filter(|(count, _)| *count > 0))
    }

    /// The best number of inliers of `n` rows whose errors come in groups, smallest first: how many, and their sum.
    fn best_cut(&self, n: usize, groups: impl Iterator<Item = (usize, f64)>) -> Score {
        let mut best = Score { value: f64::NEG_INFINITY, sigma: self.floor, share: 0.0 };
        let (mut sum, mut k) = (0.0, 0);
        for (count, e2) in groups {
            if !e2.is_finite() {
                break;
            }
            sum += e2;
            k += count;
            if k < self.m || (k == self.m && n > self.m) {
                continue;
            }
            let told = (k - self.m).max(1) as f64;
            let sigma2 = (sum / (self.d * told)).max(self.floor2);
            let (log_in, log_out) = self.log_share[k];
            let gain = self.log_volume
                - 0.5 * self.d * (std::f64::consts::TAU * sigma2).ln()
                - 0.5 * (sum / sigma2) / told
                + log_in;
            let value = told * gain + (n - k) as f64 * log_out;
            if value > best.value {
                let share = (k as f64 + 1.0) / (n as f64 + 2.0);
                best = Score { value, sigma: sigma2.sqrt(), share };
            }
        }
        best
    }

    /// Logarithm of the density of inliers at an error of 0 and of outliers, each with its share.
    pub(super) fn densities(&self, state: Score) -> (f64, f64) {
        let inlier =
            state.share.ln() - 0.5 * self.d * (std::f64::consts::TAU * state.sigma.powi(2)).ln();
        (inlier, (1.0 - state.share).ln() - self.log_volume)
    }

    /// The squared error at which a row is as likely an inlier as an outlier.
    pub(super) fn even(&self, state: Score) -> f64 {
        let (inlier, outlier) = self.densities(state);
        2.0 * state.sigma.powi(2) * (inlier - outlier)
    }

    pub(super) fn likelihood<R: Regression>(
        &self,
        regression: &R,
        model: &R::Model,
        rows: &R::Rows,
        state: Score,
        work: &mut Work,
    ) -> f64 {
        let (zero, outlier) = self.densities(state);
        work.errors.clear();
        regression.errors2(model, rows, &mut work.errors);
        let each = work.errors.iter().map(|e2| {
            let inlier = zero - 0.5 * e2 / state.sigma.powi(2);
            let top = inlier.max(outlier);
            top + ((inlier - top).exp() + (outlier - top).exp()).ln()
        });
        each.sum()
    }
}
