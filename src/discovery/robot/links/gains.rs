//! A torque sensor or a drive that shows more or less than there is, told from links that weigh otherwise.
//!
//! One joint's torque alone cannot tell: links that are heavier and friction that is larger look the same. But the links
//! beyond a joint are felt by the joints before it as well, so that a gain fits both only if it is one.
//! How all joints together are off nobody can tell without a load that is known.

use std::ops::Range;

use rayon::prelude::*;

use super::super::term::{Law, SENSIBLE_GAIN, Term};
use super::fit::{Fit, Parts, Problem};
use super::own::Links;
use crate::discovery::selection::{Hypothesis, Rival};

/// How much more a gain must explain than the other numbers do by themselves, in -2 ln of the odds.
pub(super) const PAYS: f64 = 20.0;
/// It must take away a tenth of what is left of some sensor, in squares.
pub(super) const MATTERS: f64 = 0.9;
/// The gains between which the first look is taken, as logarithms.
const LOOK: f64 = 0.1;
/// Logarithms nearer to each other are one.
const SAME: f64 = 1e-3;
/// How often the parabola through the three best looks is followed.
const STEPS: usize = 4;

/// A torque sensor that shows more or less than there is, by a factor.
#[derive(Debug)]
pub(in super::super) struct Gain {
    pub(in super::super) joint: usize,
    pub(in super::super) factor: f64,
    /// One standard deviation of it.
    pub(in super::super) std: f64,
    /// The bodies that go with it.
    pub(in super::super) links: Links,
    /// How much it explains beside them, in -2 ln of the odds.
    pub(in super::super) explained: f64,
}

impl Gain {
    /// Returns it in the place of the gain chosen, which is the effect of a hypothesis at `at` and explains `chosen`.
    pub(in super::super) fn instead_of(
        &self,
        chosen: f64,
        at: usize,
        h: &Hypothesis<Term>,
    ) -> Rival<Term> {
        let behind = chosen - self.explained;
        let own = h.parameters.len() - h.terms.iter().map(|t| t.law.specs().len()).sum::<usize>();
        let before: usize = h.terms[..at].iter().map(|term| term.law.specs().len()).sum();
        let mut other = h.clone();
        let last = h.parameters.len() - 1;
        other.terms.remove(at);
        other.parameters.remove(own + before);
        other.terms.push(Term { law: Law::TorqueGain, joint: self.joint });
        other.parameters.push(self.factor);
        let covariance = std::mem::take(&mut other.covariance)
            .remove_row(own + before)
            .remove_column(own + before);
        other.covariance = covariance.insert_row(last, 0.0).insert_column(last, 0.0);
        other.covariance[(last, last)] = self.std.powi(2);
        other.train += behind;
        Rival { instead_of: at, hypothesis: other, behind, stability: 0.0 }
    }
}

/// A gain that fits with the numbers that go with it.
pub(super) struct Shown {
    pub(super) joint: usize,
    pub(super) gain: f64,
    /// One standard deviation of it, by how fast it explains less beside it.
    pub(super) std: f64,
    /// What is left to be explained with it.
    pub(super) problem: Problem,
    /// The fit of the numbers beside it.
    pub(super) fit: Fit,
    /// How much it explains, in -2 ln of the odds.
    pub(super) explained: f64,
}

impl Shown {
    /// Returns it as an effect.
    pub(super) fn term(&self) -> Term {
        Term { law: Law::TorqueGain, joint: self.joint }
    }
}

/// Returns the gains that pay beside the numbers of `list`, the best first; `plain` is the fit without any.
pub(super) fn shown(
    problem: &Problem,
    parts: &Parts,
    list: &[Range<usize>],
    plain: &Fit,
) -> Vec<Shown> {
    let directions = parts.only(list);
    let without = problem.evidence(plain);
    let with = |joint: usize, gain: f64| -> Option<Shown> {
        let problem = problem.with_gain(joint, gain, parts);
        let fit = problem.fit(&directions)?;
        let explained = without - problem.evidence(&fit);
        Some(Shown { joint, gain, std: 0.0, problem, fit, explained })
    };
    let best = |joint: usize| -> Option<Shown> {
        let mut looks: Vec<Shown> =
            [-LOOK, 0.0, LOOK].into_iter().filter_map(|log| with(joint, log.exp())).collect();
        for _ in 0..STEPS {
            let Some(next) = next(&looks) else { break };
            looks.push(with(joint, next.exp())?);
        }
        let bend = Parabola::of(&looks)?.bend;
        let mut best = looks.into_iter().max_by(|a, b| a.explained.total_cmp(&b.explained))?;
        best.std = best.gain / (-bend).max(0.0).sqrt();
        Some(best)
    };
    let takes_away = |found: &Shown| {
        let sensors = found.fit.weights.iter().zip(&plain.weights);
        sensors.into_iter().any(|(with, without)| *with < MATTERS * without)
    };
    let joints: Vec<usize> = problem.train.iter().map(|sums| sums.joint).collect();
    let found = joints.into_par_iter().filter_map(best).filter(|found| {
        found.explained > PAYS && SENSIBLE_GAIN.contains(&found.gain) && takes_away(found)
    });
    let mut found: Vec<Shown> = found.collect();
    found.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    found
}

/// The parabola through the best look and those beside it, over the logarithm of the gain.
struct Parabola {
    at: [f64; 3],
    bend: f64,
    /// Where its slope is none.
    top: f64,
    /// On which side it is higher.
    side: f64,
}

impl Parabola {
    fn of(looks: &[Shown]) -> Option<Self> {
        let mut at: Vec<(f64, f64)> = looks.iter().map(|l| (l.gain.ln(), l.explained)).collect();
        at.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = (0..at.len()).max_by(|a, b| at[*a].1.total_cmp(&at[*b].1))?;
        let middle = best.clamp(1, at.len().checked_sub(2)?.max(1));
        let [(a, fa), (b, fb), (c, fc)] = *at.get(middle - 1..middle + 2)?.first_chunk()?;
        let (left, right) = ((fb - fa) / (b - a), (fc - fb) / (c - b));
        let bend = (right - left) / (c - a);
        let top = 0.5 * (a + b) - 0.5 * left / bend;
        Some(Self { at: [a, b, c], bend, top, side: (fc - fa).signum() })
    }
}

/// Returns where to look next, as a logarithm; `None` where somebody has looked.
fn next(looks: &[Shown]) -> Option<f64> {
    let Parabola { at: [a, b, c], bend, top, side } = Parabola::of(looks)?;
    let width = c - a;
    // Where it bends upwards there is no top, but a side that is higher.
    let to = if bend < 0.0 { top } else { b + width * side };
    let (low, high) = (SENSIBLE_GAIN.start.ln(), SENSIBLE_GAIN.end.ln());
    let to = to.clamp(a - width, c + width).clamp(low, high);
    looks.iter().all(|look| (look.gain.ln() - to).abs() > SAME).then_some(to)
}
