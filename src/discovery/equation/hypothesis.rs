//! A set of effects fitted together, and how two such sets compare.
//!
//! An effect must pay three times: by the Bayesian information criterion on the data fitted, with residuals
//! counted by how independent they are and a charge for every candidate tried; by a smaller gap on data
//! held out; and by explaining more than the part of what is explained already that the laws named so
//! far may get wrong.

use super::candidates::Candidate;
use super::data::mean;
use super::edit::{NewParam, Patch};
use super::estimate::Estimate;
use super::fitting::{Bench, Fitted};
use super::score::{twice_log_ratio, whiteness};

/// An effect with the patch that was fitted.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Name, place, equation.
    pub candidate: Candidate,
    /// The patch, with the values of its start.
    pub patch: Patch,
}

/// A set of effects fitted together.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// The effects, in the order they were added.
    pub effects: Vec<Chosen>,
    /// The model with them, fitted.
    pub fitted: Fitted,
    /// The same on held-out data.
    pub held: Estimate,
    /// The independent part of the residuals by output, on the data fitted and held out.
    pub whites: [Vec<f64>; 2],
}

impl Hypothesis {
    /// Sets of effects on the data held out.
    pub fn of(effects: Vec<Chosen>, fitted: Fitted, held: Estimate) -> Self {
        let whites =
            [&fitted.train, &held].map(|e| e.residuals.iter().map(|r| whiteness(r)).collect());
        Self { effects, fitted, held, whites }
    }

    /// How many values were estimated on the data fitted.
    pub fn n_free(&self) -> usize {
        let starts = self.fitted.train.point.starts.iter().flatten().flatten().count();
        self.fitted.compiled.params.len() + starts
    }
}

/// How one hypothesis compares with another that it extends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Fall of the information criterion on the data fitted.
    pub bic: f64,
    /// Twice the log likelihood ratio on the data held out.
    pub held: f64,
    /// Part by which the root mean square on held-out data falls.
    pub held_rms: f64,
    /// The same on the data fitted.
    pub train_rms: f64,
    /// How white the residuals of the richer one are on held-out data.
    pub white: f64,
    /// What the richer one explains more, as a part of what the poorer one explains: root mean squares,
    /// the smaller of both sets of data.
    pub part: f64,
}

impl Gain {
    /// Nothing gained.
    pub const NONE: Self =
        Self { bic: 0.0, held: 0.0, held_rms: 0.0, train_rms: 0.0, white: 1.0, part: 0.0 };

    /// All that speaks for the richer model: nothing is fitted to the held-out data but first values, so
    /// what it gains there counts in full.
    pub fn evidence(&self) -> f64 {
        self.bic + self.held
    }

    /// Whether it is enough for an effect to be named.
    pub fn pays(&self) -> bool {
        let needed = LEAST_SHRINK * (1.0 - self.white).clamp(0.0, 1.0);
        self.evidence() >= LEAST_EVIDENCE
            && self.held > 1.0
            && self.part > IMPERFECTION
            && self.held_rms > needed
            && self.train_rms > needed.min(0.5 * LEAST_SHRINK)
    }
}

/// Least evidence for an effect to be named: "very strong" on the scale of Kass and Raftery, 1995.
pub const LEAST_EVIDENCE: f64 = 10.0;
/// Least part by which the held-out gap must fall where what is left is not noise.
pub const LEAST_SHRINK: f64 = 0.04;
/// A law is right to this part and no better: a smooth `sign`, an input between two rows, a coefficient
/// that is no constant. What explains less than this part of what is explained already is not named.
pub const IMPERFECTION: f64 = 0.02;
/// Two explanations this near each other in criterion are not told apart.
pub const TIE: f64 = 6.0;

/// What a search needs to know.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// The recordings, and how models are run on them.
    pub bench: Bench,
    /// The model's name.
    pub name: &'a str,
    /// Mean squares below which nothing is gained, by output.
    pub floors: Vec<f64>,
    /// Effects, with their places, that came out as nothing.
    pub refused: Vec<(&'static str, String)>,
    /// Squared sizes of the gap of the model as given, on the data fitted and held out.
    pub whole: [f64; 2],
}

impl Question<'_> {
    /// Compares `rich` with `poor`.
    pub fn gain(&self, poor: &Hypothesis, rich: &Hypothesis, n_tried: usize) -> Gain {
        let effective = |h: &Hypothesis, set: usize| -> Vec<f64> {
            let sums = if set == 0 { &h.fitted.train.sums } else { &h.held.sums };
            h.whites[set].iter().zip(sums).map(|(w, (_, n))| w * *n as f64).collect()
        };
        let on_train = effective(rich, 0);
        let total: f64 = on_train.iter().sum();
        let (before, after) = (&poor.fitted.train, &rich.fitted.train);
        let ratio = twice_log_ratio(&before.sums, &after.sums, &on_train, &self.floors);
        let extra = rich.n_free() as f64 - poor.n_free() as f64;
        let bic = ratio - extra * total.max(2.0).ln() - 2.0 * (n_tried.max(1) as f64).ln();
        let held =
            twice_log_ratio(&poor.held.sums, &rich.held.sums, &effective(rich, 1), &self.floors);
        let sizes = |h: &Hypothesis| [self.size(&h.fitted.train), self.size(&h.held)];
        let (was, is) = (sizes(poor), sizes(rich));
        let part = (0..2)
            .map(|set| {
                let (was, is) = (was[set].powi(2), is[set].powi(2));
                // What is left when all that could be explained is explained may be the poorer one's size.
                let explained = (self.whole[set] - was).max(0.0);
                ((was - is).max(0.0) / explained.max(1e-300)).sqrt()
            })
            .fold(f64::INFINITY, f64::min);
        Gain {
            bic,
            held,
            held_rms: 1.0 - is[1] / was[1].max(1e-300),
            train_rms: 1.0 - is[0] / was[0].max(1e-300),
            white: mean(&rich.whites[1]),
            part,
        }
    }

    /// Root mean square of an estimate's residuals over outputs, in units of the scales.
    pub fn size(&self, estimate: &Estimate) -> f64 {
        let sum: f64 =
            estimate.rms().iter().zip(&self.bench.scales).map(|(r, s)| (r / s).powi(2)).sum();
        (sum / self.bench.scales.len().max(1) as f64).sqrt()
    }

    /// Noise of the held-out data over outputs, in units of the scales.
    pub fn noise_floor(&self) -> f64 {
        let noise = self.bench.held.first().map_or(&[][..], |d| &d.noise);
        let sum: f64 = noise.iter().zip(&self.bench.scales).map(|(n, s)| (n / s).powi(2)).sum();
        (sum / self.bench.scales.len().max(1) as f64).sqrt()
    }

    /// Whether what is left looks like noise: white, or as small as the noise is known to be.
    pub fn is_noise(&self, h: &Hypothesis) -> bool {
        let noise = &self.bench.train[0].noise;
        let rms = h.fitted.train.rms();
        (0..rms.len()).all(|o| {
            let (white, held) = (h.whites[0][o], h.whites[1][o]);
            let small = rms[o] <= 1.2 * noise[o];
            // What is mostly noise may still follow itself a little.
            small
                || (white > 0.3 && held > 0.3 && rms[o] <= 3.0 * noise[o])
                || (white > 0.6 && held > 0.6)
        })
    }

    /// Judges a fitted model on the held-out data; `near` is a hypothesis whose first values there are a
    /// good beginning.
    pub fn judged(
        &self,
        effects: Vec<Chosen>,
        fitted: Fitted,
        near: Option<&Hypothesis>,
    ) -> Option<Hypothesis> {
        let held = self.bench.held_out(&fitted, near.map(|h| (&h.fitted.compiled, &h.held)))?;
        Some(Hypothesis::of(effects, fitted, held))
    }

    /// The model with some effects written into the text as given, values beginning as fitted in `at`.
    pub fn rebuilt(
        &self,
        nominal: &Hypothesis,
        effects: &[Chosen],
        at: &Hypothesis,
        iterations: usize,
    ) -> Option<Hypothesis> {
        let mut text = nominal.fitted.text.clone();
        for effect in effects {
            let patch = with_values(&effect.patch, &at.fitted, false);
            text = super::edit::apply(&text, self.name, &patch)?;
        }
        let fitted = self.bench.fit(&text, self.name, &at.fitted, iterations)?;
        self.judged(effects.to_vec(), fitted, Some(at))
    }
}

/// A patch with the values that were fitted; with deviations when it is to be kept.
pub fn with_values(patch: &Patch, at: &Fitted, keep: bool) -> Patch {
    let params = patch
        .params
        .iter()
        .map(|p| {
            let found = at.compiled.params.iter().position(|q| q.name == p.name);
            let value = found.map_or(p.value, |i| at.train.point.params[i]);
            let std = found.filter(|_| keep).map(|i| at.train.std[i]);
            NewParam { value, std, ..p.clone() }
        })
        .collect();
    Patch { params, ..patch.clone() }
}
