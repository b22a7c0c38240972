//! Which measurements agree: robust estimation without a threshold to tune.
//!
//! Inliers scatter about the model with one unknown standard deviation `σ`; outliers lie anywhere in the
//! volume that is measured. Hypotheses come from minimal samples and are scored by the likelihood of that
//! mixture, with `σ` and the share of inliers at their best for each hypothesis, so that no pixel
//! threshold is needed. A hypothesis is dropped after a few measurements when too few of them agree with it; the best
//! two are refined by expectation–maximisation. [`image_map`] and [`offset`] use it; they say how a model is made and how
//! far measurements are from it.
//!
//! Everything is seeded, and the sample that hypotheses are drawn from is chosen by the value of the
//! measurements rather than their order: the same rows in another order give the same answer.
//!
//! Source: Torr and Zisserman, "MLESAC", CVIU 2000; the scale-free score in the spirit of Moisan and
//! Stival, "A Probabilistic Criterion to Detect Rigid Point Matches", IJCV 2004 (a-contrario RANSAC); Capel, "An
//! effective bail-out test for RANSAC consensus scoring", BMVC 2005; Chum and Matas, "Matching with PROSAC", CVPR 2005.
//!
//! [`image_map`]: crate::alignment::image_map
//! [`offset`]: crate::alignment::offset

mod judge;
mod samples;

use rand::SeedableRng;
use rand::rngs::StdRng;

use judge::{Judge, Score};
use samples::Samples;

/// A regression as the consensus search sees it.
pub trait Regression {
    /// The model.
    type Model: Clone;
    /// Some of the measurements, put together so that they can be looked at quickly.
    type Rows;
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
    /// Returns some of the measurements put together.
    fn rows(&self, rows: &[usize]) -> Self::Rows;
    /// Appends the squared error of each measurement; infinite where the model has no value.
    fn errors2(&self, model: &Self::Model, rows: &Self::Rows, out: &mut Vec<f64>);
    /// Returns the model that fits rows best, a weight each, starting from `model`.
    fn refit(&self, model: &Self::Model, rows: &Self::Rows, weights: &[f64])
    -> Option<Self::Model>;
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

/// Hypotheses are scored on at most this many rows. Measured (`benches/map.rs`): with half of them one search of 200 with 30 %
/// of 1000 pairs wrong starts its refinement from a worse map; twice as many take 20 µs more.
const SCORED: usize = 256;
/// After so many of them a hypothesis may be dropped.
const GLANCED: usize = 64;
/// Samples are drawn from no more rows than this, and no more are refined on before the last rounds.
const DRAWN: usize = 512;
/// With more rows than this the refinement looks at a part of them first.
const MANY: usize = 4096;
/// How many hypotheses are made at most, and at least, since a sample may be clean and still badly spread.
const TRIES: usize = 3000;
const LEAST_TRIES: usize = 40;
/// How often the search may miss: the chance that no sample is free of outliers.
const MISS: f64 = 1e-7;

/// Finds the model that most measurements agree on, or `None` when every sample is degenerate.
///
/// `seed` decides which minimal samples are tried. `scores`, one a measurement where there are any, say which are likelier
/// right: samples of those with high scores come first (PROSAC). They change how soon a model is found, not which is best.
pub fn search<R: Regression>(
    regression: &R,
    scores: Option<&[f64]>,
    seed: u64,
) -> Option<Consensus<R::Model>> {
    let n = regression.len();
    let minimal = regression.minimal();
    if n < minimal {
        return None;
    }
    let drawn = ordered(regression, if n > MANY { MANY / 2 } else { DRAWN }, seed);
    let scored = &drawn[..drawn.len().min(SCORED)];
    let judge = Judge::new(regression, scored.len());
    let mut look = Look::new(regression, scored);
    let best = hypotheses(regression, &judge, &mut look, &drawn, scores, seed);
    let rows = regression.rows(scored);
    let mut work = Work::default();
    let refined = best.into_iter().map(|(state, model)| {
        let (model, state) = refine(regression, &judge, model, state, &rows, 4, &mut work);
        let value = judge.likelihood(regression, &model, &rows, state, &mut work);
        (value, model, state)
    });
    let (_, mut model, mut state) = refined.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    if n > MANY {
        let some = regression.rows(&drawn);
        (model, state) = refine(regression, &judge, model, state, &some, 6, &mut work);
    }
    let all: Vec<usize> = (0..n).collect();
    let rows = regression.rows(&all);
    let rounds = if n > MANY { 1 } else { 4 };
    let (model, state) = refine(regression, &judge, model, state, &rows, rounds, &mut work);
    settle(regression, &judge, model, state, &rows, &mut work)
}

/// The two best hypotheses, best first.
fn hypotheses<R: Regression>(
    regression: &R,
    judge: &Judge,
    look: &mut Look<R>,
    drawn: &[usize],
    scores: Option<&[f64]>,
    seed: u64,
) -> Vec<(Score, R::Model)> {
    let mut best: Vec<(Score, R::Model)> = Vec::new();
    let mut random = StdRng::seed_from_u64(seed);
    let mut samples = Samples::new(regression, drawn, scores, seed);
    let mut picked = vec![0; regression.minimal()];
    let mut wanted = TRIES;
    let mut tried = 0;
    while tried < wanted {
        tried += 1;
        samples.draw(&mut random, &mut picked);
        let Some(model) = regression.through(&picked) else { continue };
        let Some(score) = look.at(regression, judge, &model, best.first().map(|b| b.0)) else {
            continue;
        };
        if best.len() == 2 && score.value <= best[1].0.value {
            continue;
        }
        if best.first().is_none_or(|(first, _)| score.value > first.value) {
            let share = samples.share(regression, judge, &model, score).max(score.share);
            let clean = share.powf(picked.len() as f64).clamp(1e-9, 1.0 - 1e-9);
            let enough = MISS.ln() / (1.0 - clean).ln();
            wanted = (enough.ceil() as usize).clamp(LEAST_TRIES, TRIES);
        }
        best.push((score, model));
        best.sort_by(|a, b| b.0.value.total_cmp(&a.0.value));
        best.truncate(2);
    }
    best
}

/// Rows in an order that depends on their values and the seed only, at most `most` of them.
fn ordered<R: Regression>(regression: &R, most: usize, seed: u64) -> Vec<usize> {
    let mut keyed: Vec<(u64, usize)> =
        (0..regression.len()).map(|i| (mix(regression.key(i) ^ seed), i)).collect();
    if keyed.len() > most {
        keyed.select_nth_unstable(most);
        keyed.truncate(most);
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

/// The rows that hypotheses are scored on: a few first, the others only for what may be the best.
struct Look<R: Regression> {
    first: R::Rows,
    others: R::Rows,
    /// How many are in the first.
    n_first: usize,
    errors: Vec<f64>,
}

impl<R: Regression> Look<R> {
    fn new(regression: &R, scored: &[usize]) -> Self {
        let (first, others) = scored.split_at(scored.len().min(GLANCED));
        let n_first = first.len();
        let (first, others) = (regression.rows(first), regression.rows(others));
        Self { first, others, n_first, errors: Vec::new() }
    }

    /// Returns the score of a model, `None` when it is plainly worse than the best so far.
    fn at(
        &mut self,
        regression: &R,
        judge: &Judge,
        model: &R::Model,
        best: Option<Score>,
    ) -> Option<Score> {
        self.errors.clear();
        regression.errors2(model, &self.first, &mut self.errors);
        if let Some(best) = best
            && self.n_first == GLANCED
        {
            // Of the first rows so many agree with the best, less three standard deviations of that number. A better
            // model from a worse spread sample may scatter twice as much before it is refined: of a two-dimensional
            // error 99 % are within three standard deviations.
            let near = judge.floor2.max((6.0 * best.sigma).powi(2));
            let agree = self.errors.iter().filter(|e2| **e2 < near).count() as f64;
            let n = GLANCED as f64;
            let spread = (n * best.share * (1.0 - best.share)).sqrt();
            if agree < n * best.share - 3.0 * spread {
                return None;
            }
        }
        regression.errors2(model, &self.others, &mut self.errors);
        Some(judge.score(&mut self.errors))
    }
}

/// Memory that is used again.
#[derive(Default)]
struct Work {
    errors: Vec<f64>,
    weights: Vec<f64>,
}

/// Expectation–maximisation over model, `σ` and share. `σ` is that of the model before the step, which at rest is the same.
fn refine<R: Regression>(
    regression: &R,
    judge: &Judge,
    mut model: R::Model,
    mut state: Score,
    rows: &R::Rows,
    rounds: usize,
    work: &mut Work,
) -> (R::Model, Score) {
    let m = judge.m as f64;
    for _ in 0..rounds {
        work.errors.clear();
        regression.errors2(&model, rows, &mut work.errors);
        let (zero, outlier) = judge.densities(state);
        let per = -0.5 / state.sigma.powi(2);
        work.weights.clear();
        work.weights.extend(work.errors.iter().map(|e2| {
            // The chance that the row is an inlier. Rows of no weight cost time and change nothing: e^-14 is 1e-6.
            let odds = zero + per * e2 - outlier;
            if odds < -14.0 { 0.0 } else { 1.0 / (1.0 + (-odds).exp()) }
        }));
        let total: f64 = work.weights.iter().sum();
        if total < m {
            break;
        }
        let weighted = work.weights.iter().zip(&work.errors).filter(|(w, _)| **w > 0.0);
        let sum: f64 = weighted.map(|(w, e2)| w * e2).sum();
        let Some(next) = regression.refit(&model, rows, &work.weights) else { break };
        if !sum.is_finite() {
            break;
        }
        model = next;
        let sigma = (sum / (judge.d * (total - m).max(1.0))).sqrt().max(judge.floor);
        let share = (total + 1.0) / (work.errors.len() as f64 + 2.0);
        let still = (sigma / state.sigma - 1.0).abs() < 1e-3 && (share - state.share).abs() < 1e-3;
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
    judge: &Judge,
    mut model: R::Model,
    mut state: Score,
    rows: &R::Rows,
    work: &mut Work,
) -> Option<Consensus<R::Model>> {
    let mut count = 0;
    work.weights.clear();
    work.errors.clear();
    regression.errors2(&model, rows, &mut work.errors);
    let n = work.errors.len();
    work.weights.resize(n, 0.0);
    for _ in 0..6 {
        let even = judge.even(state);
        let (mut now, mut changed) = (0, false);
        for (weight, e2) in work.weights.iter_mut().zip(&work.errors) {
            let next = f64::from(u8::from(*e2 <= even));
            changed |= next.to_bits() != weight.to_bits();
            *weight = next;
            now += usize::from(*e2 <= even);
        }
        if now < judge.m {
            break;
        }
        count = now;
        if !changed {
            break;
        }
        let Some(next) = regression.refit(&model, rows, &work.weights) else { break };
        let mut errors = std::mem::take(&mut work.errors);
        errors.clear();
        regression.errors2(&next, rows, &mut errors);
        work.errors = errors;
        let kept = work.weights.iter().zip(&work.errors).filter(|(w, _)| **w > 0.0);
        let sum: f64 = kept.map(|(_, e2)| e2).sum();
        if !sum.is_finite() {
            break;
        }
        model = next;
        let told = now.saturating_sub(judge.m).max(1) as f64;
        state.sigma = (sum / (judge.d * told)).sqrt().max(judge.floor);
        state.share = (now as f64 + 1.0) / (n as f64 + 2.0);
    }
    let kept = work.weights.iter().enumerate().filter(|(_, w)| **w > 0.0);
    (count > 0).then(|| Consensus {
        model,
        sigma: state.sigma,
        share: state.share,
        inliers: kept.map(|(i, _)| i).collect(),
    })
}
