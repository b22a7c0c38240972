//! Effects with a name that show beside links that are free: a spring, a zero, a tilt or a sensor's gain that no other links stand for.
//!
//! Where links are off and something else is missing as well, links that are identified by themselves take the place of a part of
//! it, and what is left looks like effects that are not there. So what has a name joins the free links one by one, as long as it
//! pays and the recordings held out bear it out. Nothing is named by this: the links that go with it are what a search begins with,
//! and the search has to find it again.

use std::ops::Range;

use rayon::prelude::*;

use super::super::chain::Body;
use super::super::term::{Law, Term};
use super::fit::{Fit, Parts, Problem};
use super::freed::Freed;
use super::gains::{MATTERS, PAYS, Shown, shown};
use super::own::Links;

/// So many join at most. Chosen: what is off at more places than that is told by the search.
const MOST: usize = 4;

/// What shows beside free links, with the links that go with it.
#[derive(Debug)]
pub(in super::super) struct Beside {
    pub(in super::super) terms: Vec<Term>,
    pub(in super::super) links: Links,
}

/// What is fitted beside the bodies, with what joined it.
struct Grown {
    /// What there is to be explained, with the gains that joined.
    problem: Problem,
    list: Vec<Range<usize>>,
    terms: Vec<Term>,
    fit: Fit,
}

/// One effect more.
enum Step {
    /// One that is a few of the numbers.
    Numbers(Range<usize>, Fit),
    Gain(Shown),
}

impl Grown {
    /// Begins with free bodies beside the numbers of `list`.
    fn from(problem: &Problem, parts: &Parts, list: &[Range<usize>]) -> Option<Self> {
        let list: Vec<_> = std::iter::once(&parts.bodies).chain(list).cloned().collect();
        let problem = problem.bearing(parts, &list)?;
        let fit = problem.fit(&parts.only(&list))?;
        Some(Self { problem, list, terms: Vec::new(), fit })
    }

    /// Lets the effect join that explains most, if one pays.
    fn grow(&mut self, parts: &Parts, has_gains: bool) -> bool {
        let without = self.problem.evidence(&self.fit);
        let left = |fit: &Fit, problem: &Problem| problem.judged(&fit.x, &self.fit.weights);
        let here = left(&self.fit, &self.problem);
        let pays = |explained: f64, fit: &Fit, problem: &Problem| {
            let sensors = fit.weights.iter().zip(&self.fit.weights);
            let takes_away = sensors.into_iter().any(|(with, without)| *with < MATTERS * without);
            explained > PAYS && takes_away && left(fit, problem) < here
        };
        let effects: Vec<_> = parts.each_named().filter(|one| !self.list.contains(one)).collect();
        let numbers = effects.into_par_iter().filter_map(|effect| {
            let with = [&self.list[..], std::slice::from_ref(&effect)].concat();
            let fit = self.problem.fit(&parts.only(&with))?;
            let explained = without - self.problem.evidence(&fit);
            pays(explained, &fit, &self.problem).then_some((explained, Step::Numbers(effect, fit)))
        });
        let mut steps: Vec<(f64, Step)> = numbers.collect();
        if has_gains {
            let gains = shown(&self.problem, parts, &self.list, &self.fit).into_iter();
            let new = gains.filter(|gain| !self.terms.contains(&gain.term()));
            let new = new.filter(|gain| pays(gain.explained, &gain.fit, &gain.problem));
            steps.extend(new.map(|gain| (gain.explained, Step::Gain(gain))));
        }
        match steps.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, Step::Numbers(effect, fit))) => {
                self.terms.push(parts.effect(&effect));
                self.list.push(effect);
                self.fit = fit;
            }
            Some((_, Step::Gain(gain))) => {
                self.terms.push(gain.term());
                (self.problem, self.fit) = (gain.problem, gain.fit);
            }
            None => return false,
        }
        true
    }
}

/// What shows beside free links, with the bodies that go with it.
pub(super) struct Shows {
    terms: Vec<Term>,
    freed: Freed,
}

impl Shows {
    pub(super) fn freed(&self) -> &Freed {
        &self.freed
    }

    /// Returns what is left of the recordings held out.
    pub(super) fn left(&self, weights: &[f64]) -> f64 {
        self.freed.judged(weights)
    }

    /// Returns whether it is nothing but a gain, which is looked for by itself.
    pub(super) fn is_one_gain(&self) -> bool {
        matches!(self.terms[..], [Term { law: Law::TorqueGain, .. }])
    }

    /// Returns it as a search begins with it.
    pub(super) fn told(self, bodies: &[Body]) -> Beside {
        Beside { terms: self.terms, links: self.freed.links(bodies, true) }
    }
}

/// Returns what shows beside free links and the numbers of each of `lists`.
pub(super) fn shows(
    problem: &Problem,
    parts: &Parts,
    bodies: &[Body],
    lists: &[Vec<Range<usize>>],
    has_gains: bool,
) -> Vec<Shows> {
    let of = |list: &Vec<Range<usize>>| {
        let mut grown = Grown::from(problem, parts, list)?;
        while grown.terms.len() < MOST && grown.grow(parts, has_gains) {}
        let Grown { problem, list, terms, .. } = grown;
        let freed = Freed::of(&problem, bodies, parts, &list[1..])?;
        Some(Shows { terms, freed })
    };
    lists.iter().filter_map(of).collect()
}

/// Returns which of them is to be taken; `None` where nothing shows.
pub(super) fn taken(mut all: Vec<Shows>) -> Option<Shows> {
    let freed: Vec<&Freed> = all.iter().map(Shows::freed).collect();
    let best = Freed::best(&freed)?;
    let best = all.swap_remove(best);
    (!best.terms.is_empty()).then_some(best)
}
