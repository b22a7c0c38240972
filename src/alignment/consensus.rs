//! Which measurements agree: robust estimation without a threshold to tune.
//!
//! Inliers scatter about the model with one unknown standard deviation `σ`; outliers lie anywhere in the
//! volume that is measured. Hypotheses come from minimal samples and are scored by the likelihood of that
//! mixture, with `σ` and the share of inliers at their best for each hypothesis, so that no pixel
//! threshold is needed. The best few are refined by expectation–maximisation. [`image_map`] and
//! [`offset`] use it; they say how a model is made and how far a measurement is from it.
//!
//! Everything is seeded, and the sample that hypotheses are drawn from is chosen by the value of the
//! measurements rather than their order: the same rows in another order give the same answer.
//!
//! Source: Torr and Zisserman, "MLESAC", CVIU 2000; the scale-free score in the spirit of Moisan and
//! Stival, "A Probabilistic Criterion to Detect Rigid Point Matches", IJCV 2004 (a-contrario RANSAC).
//!
//! [`image_map`]: crate::alignment::image_map
//! [`offset`]: crate::alignment::offset

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// A regression as the consensus search sees it.
pub trait Regression {
    /// The model.
    type Model: Clone;
    /// Returns how many measurements there are.
    fn len(&self) -> usize;
    /// Returns whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns how many measurements determine a model.
    fn minimal(&self) -> usize;
    /// Returns the dimension of an error (2 for pixels, 3 for points).
    fn dimension(&self) -> usize;
    /// Returns the volume that outliers may lie in, in the units of the error to the power of its
    /// dimension.
    fn volume(&self) -> f64;
    /// Returns the least standard deviation that is believed.
    fn floor(&self) -> f64;
    /// Returns a key that orders measurements by value, not by row.
    fn key(&self, row: usize) -> u64;
    /// Returns the model through a minimal sample, `None` when the sample is degenerate.
    fn through(&self, rows: &[usize]) -> Option<Self::Model>;
    /// Returns the squared error of a measurement; infinite where the model has no value.
    fn error2(&self, model: &Self::Model, row: usize) -> f64;
    /// Returns the model that fits weighted rows best, starting from `model`.
    fn refit(&self, model: &Self::Model, rows: &[(usize, f64)]) -> Option<Self::Model>;
}

/// What the measurements agree on.
#[derive(Debug, Clone)]
pub struct Consensus<M> {
    /// The model, fitted to the rows that agree.
    pub model: M,
    /// Standard deviation of the rows that agree, per coordinate.
    pub sigma: f64,
    /// Share of rows that agree.
    pub share: f64,
    /// Rows that agree, in order.
    pub inliers: Vec<usize>,
}

/// Hypotheses are scored on at most this many rows: enough to tell good from bad.
const SCORED: usize = 200;
/// Refinement before the last round looks at no more rows than this.
const REFINED: usize = 1500;
/// How often the search may miss: the chance that no sample is free of outliers.
const MISS: f64 = 1e-7;

/// Finds the model that most measurements agree on, or `None` when every sample is degenerate.
///
/// `seed` decides which minimal samples are tried.
pub fn search<R: Regression>(regression: &R, seed: u64) -> Option<Consensus<R::Model>> {
    let n = regression.len();
    let minimal = regression.minimal();
    if n < minimal {
        return None;
    }
    let rows = ordered(regression, seed);
    let scored = &rows[..rows.len().min(SCORED)];
    let mut best: Vec<(f64, R::Model)> = Vec::new();
    let mut errors = Vec::with_capacity(scored.len());
    let mut random = StdRng::seed_from_u64(seed);
    let mut sample = vec![0; minimal];
    let mut wanted = 3000;
    let mut tried = 0;
    while tried < wanted {
        tried += 1;
        draw(&mut random, rows.len(), &mut sample);
        let picked: Vec<usize> = sample.iter().map(|&i| rows[i]).collect();
        let Some(model) = regression.through(&picked) else { continue };
        let score = score(regression, &model, scored, &mut errors);
        if best.len() < 3 || score.value > best[best.len() - 1].0 {
            if best.first().is_none_or(|first| score.value > first.0) {
                // At least 40, since a sample may be clean and still badly spread.
                let clean = score.share.powf(minimal as f64).clamp(1e-9, 1.0 - 1e-9);
                let enough = MISS.ln() / (1.0 - clean).ln();
                wanted = (enough.ceil() as usize).clamp(40, 3000);
            }
            best.push((score.value, model));
            best.sort_by(|a, b| b.0.total_cmp(&a.0));
            best.truncate(3);
        }
    }
    let some = &rows[..rows.len().min(REFINED)];
    let mut refined: Option<(f64, R::Model, Score)> = None;
    for (_, start) in best {
        let first = score(regression, &start, scored, &mut errors);
        let (model, last) = refine(regression, start, first, scored, 6);
        let value = likelihood(regression, &model, scored, last);
        if refined.as_ref().is_none_or(|(v, ..)| value > *v) {
            refined = Some((value, model, last));
        }
    }
    let (_, model, state) = refined?;
    let (model, state) = refine(regression, model, state, some, 10);
    let all: Vec<usize> = (0..n).collect();
    let rounds = usize::from(n > REFINED);
    let (model, state) = refine(regression, model, state, &all, rounds);
    settle(regression, model, state, &all)
}

/// Rows in an order that depends on their values and the seed only.
fn ordered<R: Regression>(regression: &R, seed: u64) -> Vec<usize> {
    let mut keyed: Vec<(u64, usize)> =
        (0..regression.len()).map(|i| (mix(regression.key(i) ^ seed), i)).collect();
    if keyed.len() > REFINED {
        keyed.select_nth_unstable(REFINED);
        keyed.truncate(REFINED);
    }
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Scrambles bits (splitmix64, Steele, Lea and Flood 2014).
pub(super) fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Fills `sample` with different numbers below `n`.
fn draw(random: &mut StdRng, n: usize, sample: &mut [usize]) {
    for i in 0..sample.len() {
        loop {
            let candidate = random.random_range(0..n);
            if !sample[..i].contains(&candidate) {
                sample[i] = candidate;
                break;
            }
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Score {
    value: f64,
    sigma: f64,
    share: f64,
}

/// The log-likelihood gained over "all are outliers", at the best number of inliers.
///
/// With the errors sorted, taking the `k` smallest as inliers gives `σ² = Σ e² / (d (k - m))`; the
/// `m` rows of the sample fit by construction and gain nothing.
fn score<R: Regression>(
    regression: &R,
    model: &R::Model,
    rows: &[usize],
    errors: &mut Vec<f64>,
) -> Score {
    let d = regression.dimension() as f64;
    let m = regression.minimal();
    let (n, floor2, log_volume) =
        (rows.len(), regression.floor().powi(2), regression.volume().ln());
    errors.clear();
    errors.extend(rows.iter().map(|&i| regression.error2(model, i)));
    errors.sort_unstable_by(f64::total_cmp);
    let mut best = Score { value: f64::NEG_INFINITY, sigma: regression.floor(), share: 0.0 };
    let mut sum = 0.0;
    for (i, e2) in errors.iter().enumerate() {
        if !e2.is_finite() {
            break;
        }
        sum += e2;
        let k = i + 1;
        if k < m || (k == m && n > m) {
            continue;
        }
        let told = (k - m).max(1) as f64;
        let sigma2 = (sum / (d * told)).max(floor2);
        let share = (k as f64 + 1.0) / (n as f64 + 2.0);
        let gain = log_volume
            - 0.5 * d * (std::f64::consts::TAU * sigma2).ln()
            - 0.5 * (sum / sigma2) / told
            + share.ln();
        let value = told * gain + (n - k) as f64 * (1.0 - share).ln();
        if value > best.value {
            best = Score { value, sigma: sigma2.sqrt(), share };
        }
    }
    best
}

/// The chance that a row with squared error `e2` is an inlier.
fn responsibility<R: Regression>(regression: &R, state: Score, e2: f64) -> f64 {
    let inlier = log_inlier(regression, state, e2);
    let outlier = (1.0 - state.share).ln() - regression.volume().ln();
    1.0 / (1.0 + (outlier - inlier).exp())
}

fn log_inlier<R: Regression>(regression: &R, state: Score, e2: f64) -> f64 {
    let d = regression.dimension() as f64;
    let sigma2 = state.sigma.powi(2);
    state.share.ln() - 0.5 * d * (std::f64::consts::TAU * sigma2).ln() - 0.5 * e2 / sigma2
}

fn likelihood<R: Regression>(
    regression: &R,
    model: &R::Model,
    rows: &[usize],
    state: Score,
) -> f64 {
    let outlier = (1.0 - state.share).ln() - regression.volume().ln();
    rows.iter()
        .map(|&i| {
            let inlier = log_inlier(regression, state, regression.error2(model, i));
            let top = inlier.max(outlier);
            top + ((inlier - top).exp() + (outlier - top).exp()).ln()
        })
        .sum()
}

/// Expectation–maximisation over model, `σ` and share.
fn refine<R: Regression>(
    regression: &R,
    mut model: R::Model,
    mut state: Score,
    rows: &[usize],
    rounds: usize,
) -> (R::Model, Score) {
    let d = regression.dimension() as f64;
    let m = regression.minimal() as f64;
    for _ in 0..rounds {
        let mut weights = Vec::with_capacity(rows.len());
        let mut total = 0.0;
        for &i in rows {
            let w = responsibility(regression, state, regression.error2(&model, i));
            // Rows of no weight cost time and change nothing.
            if w > 1e-6 {
                weights.push((i, w));
                total += w;
            }
        }
        if total < m {
            break;
        }
        let Some(next) = regression.refit(&model, &weights) else { break };
        let sum: f64 = weights.iter().map(|&(i, w)| w * regression.error2(&next, i)).sum();
        if !sum.is_finite() {
            break;
        }
        model = next;
        let sigma = (sum / (d * (total - m).max(1.0))).sqrt().max(regression.floor());
        let share = (total + 1.0) / (rows.len() as f64 + 2.0);
        let still = (sigma / state.sigma - 1.0).abs() < 1e-4 && (share - state.share).abs() < 1e-4;
        state = Score { value: state.value, sigma, share };
        if still {
            break;
        }
    }
    (model, state)
}

/// Decides who is in, refits on them with equal weights, and checks the decision against that model.
fn settle<R: Regression>(
    regression: &R,
    mut model: R::Model,
    mut state: Score,
    rows: &[usize],
) -> Option<Consensus<R::Model>> {
    let d = regression.dimension() as f64;
    let m = regression.minimal();
    let mut inliers: Vec<usize> = Vec::new();
    for _ in 0..6 {
        let now: Vec<usize> = rows
            .iter()
            .copied()
            .filter(|&i| responsibility(regression, state, regression.error2(&model, i)) >= 0.5)
            .collect();
        if now.len() < m || now == inliers {
            break;
        }
        let weights: Vec<(usize, f64)> = now.iter().map(|&i| (i, 1.0)).collect();
        let Some(next) = regression.refit(&model, &weights) else { break };
        let sum: f64 = now.iter().map(|&i| regression.error2(&next, i)).sum();
        if !sum.is_finite() {
            break;
        }
        model = next;
        let told = now.len().saturating_sub(m).max(1) as f64;
        state.sigma = (sum / (d * told)).sqrt().max(regression.floor());
        state.share = (now.len() as f64 + 1.0) / (rows.len() as f64 + 2.0);
        inliers = now;
    }
    (!inliers.is_empty()).then_some(Consensus {
        model,
        sigma: state.sigma,
        share: state.share,
        inliers,
    })
}
