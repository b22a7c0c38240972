//! A set of effects fitted together, and how two such sets compare.
//!
//! An effect must pay four times: by the Bayesian information criterion on the data fitted, with residuals
//! counted by how independent they are, a charge for every candidate tried and one for how rare it is; by a
//! smaller gap on data held out; by explaining more than the part of what is explained already that the laws
//! named so far may get wrong; and by taking a good part of what is left.

use std::f64::consts::{PI, TAU};

use super::candidates::{Candidate, price};
use super::edit::{NewParam, Patch};
use super::estimate::{Estimate, rows_that};
use super::fitting::{Bench, Fitted};
use super::score::{twice_log_ratio, whiteness};
use crate::discovery::finding::{MATTERS, Split};
use crate::language::ast::ModelItem;

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
        let held = held.set_aside();
        let whites = [
            fitted.train.residuals.iter().map(|r| whiteness(r)).collect(),
            held.residuals.iter().map(|r| whiteness(&rows_that(r, false))).collect(),
        ];
        Self { effects, fitted, held, whites }
    }

    /// What its effects cost for how rare they are.
    fn price(&self) -> f64 {
        self.effects.iter().map(|e| price(e.candidate.kind)).sum()
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
    /// Fall of the information criterion on the data fitted, prices included.
    pub bic: f64,
    /// What of it was charged for the choice among many.
    pub charge: f64,
    /// Twice the log likelihood ratio on the data held out.
    pub held: f64,
    /// Part by which the root mean square on held-out data falls.
    pub held_rms: f64,
    /// The same on those of them that decide nothing.
    pub told: f64,
    /// What the richer one explains more, as a part of what the poorer one explains: root mean squares,
    /// the smaller of both sets of data.
    pub part: f64,
    /// Part by which what is left beyond the noise falls: root mean squares, the smaller of both sets of data.
    pub taken: f64,
    /// The part that must be taken for an effect to be named.
    pub needed: f64,
}

impl Gain {
    /// All that speaks for the richer model: nothing is fitted to the held-out data but first values, so
    /// what it gains there counts in full.
    pub fn evidence(&self) -> f64 {
        self.bic + self.held
    }

    /// Whether it is enough for an effect to be named: the data fitted and those held out both speak for it, and
    /// together for the choice among many as well.
    pub fn pays(&self) -> bool {
        let fitted = self.bic + self.charge;
        let is_agreed = self.evidence() >= LEAST_EVIDENCE && fitted > 0.0 && self.held > 1.0;
        is_agreed && self.part > IMPERFECTION && self.taken > self.needed
    }
}

/// Least evidence for an effect to be named: "very strong" on the scale of Kass and Raftery, 1995.
pub const LEAST_EVIDENCE: f64 = 10.0;
/// Most of something.
pub const MOST: f64 = 0.5;
/// Residuals of which less than this part is independent follow themselves.
const COLOURED: f64 = 0.3;
/// A law is right to this part and no better: a smooth `sign`, an input between two rows, a coefficient
/// that is no constant. What explains less than this part of what is explained already is not named.
pub const IMPERFECTION: f64 = 0.02;
/// What is left is no error of measurement where it is this many times as large as the noise is known to be: one that forgets
/// itself within ten rows is four times what its differences from row to row show of it.
const FAR_ABOVE: f64 = 10.0;
/// Held-out data that are described worse than the fitted ones by more than this factor, beyond what a law may
/// get wrong, are of another machine, or show what the fitted ones do not.
const FAR_WORSE: f64 = 2.0;

/// What a search needs to know.
#[derive(Debug, Clone)]
pub struct Question<'a> {
    /// The recordings, and how models are run on them.
    pub bench: Bench,
    /// The model's name.
    pub name: &'a str,
    /// The model as it was given.
    pub given: ModelItem,
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
        self.gain_among(poor, rich, n_tried, &rich.whites)
    }

    /// As [`Self::gain`], with residuals as independent as `whites` says: those that are compared with each other
    /// count the same rows.
    pub fn gain_among(
        &self,
        poor: &Hypothesis,
        rich: &Hypothesis,
        n_tried: usize,
        whites: &[Vec<f64>; 2],
    ) -> Gain {
        let effective = |sums: &[(f64, usize)], set: usize| -> Vec<f64> {
            whites[set].iter().zip(sums).map(|(w, (_, n))| w * *n as f64).collect()
        };
        let on_train = effective(&rich.fitted.train.sums, 0);
        let total: f64 = on_train.iter().sum();
        let (before, after) = (&poor.fitted.train, &rich.fitted.train);
        let ratio = twice_log_ratio(&before.sums, &after.sums, &on_train, &self.floors);
        let extra = rich.n_free() as f64 - poor.n_free() as f64;
        let charge = 2.0 * (n_tried.max(1) as f64).ln();
        let bic = ratio - extra * total.max(2.0).ln() - charge - (rich.price() - poor.price());
        let on_held = effective(&rich.held.sums, 1);
        let held = twice_log_ratio(&poor.held.sums, &rich.held.sums, &on_held, &self.floors);
        let sizes = |h: &Hypothesis| [self.size(&h.fitted.train), self.size(&h.held)];
        let (was, is) = (sizes(poor), sizes(rich));
        let least = |of: &dyn Fn(usize) -> f64| f64::min(of(0), of(1));
        let part = least(&|set| {
            let (was, is) = (was[set].powi(2), is[set].powi(2));
            // What is left when all that could be explained is explained may be the poorer one's size.
            // Of what runs away without the first effect no more than the signal can be explained.
            let explained = (self.whole[set] - was).clamp(0.0, 1.0);
            ((was - is).max(0.0) / explained.max(1e-300)).sqrt()
        });
        let beyond = [[&poor.fitted.train, &rich.fitted.train], [&poor.held, &rich.held]]
            .map(|pair| pair.map(|e| self.beyond(e)));
        let taken = least(&|set| 1.0 - beyond[set][1] / beyond[set][0].max(1e-300));
        // Below what a law may get wrong lies a bit of everything: a name must be most of that, or all but noise.
        let is_coloured = rich.whites.iter().flatten().any(|white| *white < COLOURED);
        let is_below = was[0].max(was[1]) < IMPERFECTION && is_coloured && !self.is_white(rich);
        let needed = if is_below { MOST } else { MATTERS };
        let told = 1.0 - self.told(rich).heldout / self.told(poor).heldout.max(1e-300);
        let held_rms = 1.0 - is[1] / was[1].max(1e-300);
        Gain { bic, charge, held, held_rms, told, part, taken, needed }
    }

    /// What is left of an estimate beyond the noise, in units of the scales.
    pub fn beyond(&self, estimate: &Estimate) -> f64 {
        (self.size(estimate).powi(2) - self.noise_floor().powi(2)).max(0.0).sqrt()
    }

    /// Root mean square of an estimate's residuals over outputs, in units of the scales.
    pub fn size(&self, estimate: &Estimate) -> f64 {
        self.over_outputs(&estimate.rms())
    }

    /// The sizes of what a hypothesis leaves that are told: of the data fitted, and of those that decided nothing.
    pub fn told(&self, h: &Hypothesis) -> Split {
        Split {
            train: self.size(&h.fitted.train),
            heldout: self.over_outputs(&h.held.rms_unseen()),
        }
    }

    /// Root mean square over outputs of sizes in their units, in units of the scales.
    pub(super) fn over_outputs(&self, of: &[f64]) -> f64 {
        let sum: f64 = of.iter().zip(&self.bench.scales).map(|(r, s)| (r / s).powi(2)).sum();
        (sum / self.bench.scales.len().max(1) as f64).sqrt()
    }

    /// Noise of the held-out data over outputs, in units of the scales.
    pub fn noise_floor(&self) -> f64 {
        let noise = self.bench.held.first().map_or(&[][..], |d| &d.noise);
        let sum: f64 = noise.iter().zip(&self.bench.scales).map(|(n, s)| (n / s).powi(2)).sum();
        (sum / self.bench.scales.len().max(1) as f64).sqrt()
    }

    /// Whether the data held out are described far worse than the fitted ones.
    pub fn is_far_worse(&self, h: &Hypothesis) -> bool {
        self.size(&h.held) > FAR_WORSE * self.size(&h.fitted.train) + IMPERFECTION
    }

    /// Whether the data held out show hardly anything of what the fitted ones show to be missing: their gap beyond the noise is the
    /// smaller one by so much that no effect could be seen to take a part of it.
    pub fn is_unshown(&self, h: &Hypothesis) -> bool {
        let (train, held) = (self.beyond(&h.fitted.train), self.beyond(&h.held));
        train > IMPERFECTION && held < MATTERS * train
    }

    /// Whether what is left looks like noise: as small as the noise is known to be, or white; or of another colour,
    /// if it is small beside the signal, not far above the noise, and follows nothing that the model has.
    pub fn is_noise(&self, h: &Hypothesis) -> bool {
        let sets = [&h.fitted.train, &h.held];
        let is_small = || sets.iter().all(|e| self.size(e) < MATTERS && !self.is_far_above(e));
        !self.is_far_worse(h) && (self.is_white(h) || is_small() && !self.follows_something(h))
    }

    /// Whether what is left of some output is more than a law may get wrong, and far above its noise, where that is known.
    pub fn is_far_above(&self, estimate: &Estimate) -> bool {
        let noise = &self.bench.train[0].noise;
        let mut outputs = estimate.rms().into_iter().zip(noise.iter().zip(&self.bench.scales));
        outputs.any(|(rms, (noise, scale))| {
            rms > IMPERFECTION * scale && *noise > 0.0 && rms > FAR_ABOVE * noise
        })
    }

    /// Whether what is left is as small as the noise is known to be, or white.
    fn is_white(&self, h: &Hypothesis) -> bool {
        let noise = &self.bench.train[0].noise;
        let rms = h.fitted.train.rms();
        (0..rms.len()).all(|o| {
            let (white, held) = (h.whites[0][o], h.whites[1][o]);
            let small = rms[o] <= 1.2 * noise[o];
            // What is mostly noise may still follow itself a little.
            small
                || (white > COLOURED && held > COLOURED && rms[o] <= 3.0 * noise[o])
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
    let mut params: Vec<NewParam> = patch
        .params
        .iter()
        .map(|p| {
            let found = at.compiled.params.iter().position(|q| q.name == p.name);
            let value = found.map_or(p.value, |i| at.train.point.params[i]);
            let std = found.filter(|_| keep).map(|i| at.train.std[i]);
            NewParam { value, std, ..p.clone() }
        })
        .collect();
    upright(&mut params);
    Patch { params, ..patch.clone() }
}

/// Turns a wave by half a turn that came out with a negative amplitude: it is the same one, and told with a positive one and a phase
/// within one turn.
fn upright(params: &mut [NewParam]) {
    let of = |role: &str| params.iter().position(|param| param.role == role);
    let (Some(amplitude), Some(phase)) = (of("amplitude"), of("phase")) else { return };
    if params[amplitude].value < 0.0 {
        params[amplitude].value = -params[amplitude].value;
        params[phase].value += PI;
    }
    params[phase].value = params[phase].value.rem_euclid(TAU);
}

#[cfg(test)]
mod tests {
    use super::super::edit::model_in;
    use super::super::estimate::Point;
    use super::super::made::bench;
    use super::*;

    const TEXT: &str = "model m {\n input u\n state x = 0\n x' = u - x\n output x = x\n}\n";

    /// Whether the data held out do not show what is missing on those fitted: root mean squares in units of the signal, where noise
    /// is 0.001.
    fn is_unshown(train: f64, held: f64) -> bool {
        let bench = bench(TEXT);
        let compiled = bench.prepare(TEXT, "m").unwrap();
        let point = Point { params: Vec::new(), starts: vec![vec![None]] };
        let fit = bench.task(&compiled).judge(&point).unwrap();
        let fitted = Fitted { text: TEXT.into(), compiled, train: fit };
        let given = model_in(TEXT, "m").unwrap();
        let (floors, refused, whole) = (vec![0.0], Vec::new(), [1.0; 2]);
        let question = Question { bench, name: "m", given, floors, refused, whole };
        let mut plain = question.judged(Vec::new(), fitted, None).unwrap();
        plain.fitted.train.sums = vec![(60.0 * train * train, 60)];
        plain.held.sums = vec![(40.0 * held * held, 40)];
        question.is_unshown(&plain)
    }

    /// Of a hum of amplitude 0.25 and phase 1.0 half of the recordings told -0.249 and 4.147.
    #[test]
    fn a_wave_is_told_with_a_positive_amplitude() {
        let number = |role: &'static str, value: f64| NewParam {
            role,
            name: role.into(),
            dimension: None,
            range: None,
            neutral: None,
            value,
            std: None,
        };
        let told = |amplitude, phase| {
            let mut params = [number("amplitude", amplitude), number("phase", phase)];
            upright(&mut params);
            params.map(|param| param.value)
        };
        let is_wave = |[a, b]: [f64; 2]| (a - 0.25).abs() < 1e-12 && (b - 1.0).abs() < 1e-12;
        assert!(is_wave(told(-0.25, 1.0 + PI)) && is_wave(told(0.25, 1.0 - TAU)));
        assert!(is_wave(told(0.25, 1.0)) && is_wave(told(-0.25, 1.0 - PI)));
        let mut alone = [number("amplitude", -0.25)];
        upright(&mut alone);
        assert!(alone[0].value < 0.0, "no wave without a phase");
    }

    /// A second held out of a flight, in which nothing moved fast, was called a gap of 0.672 % where noise is 0.672 %.
    #[test]
    fn what_is_held_out_may_show_nothing_of_a_gap() {
        assert!(is_unshown(0.4, 1e-3));
        assert!(!is_unshown(0.4, 0.2));
        assert!(!is_unshown(1e-3, 1e-3), "nothing is missing");
    }
}
