//! How sure what was chosen is: whether other stretches of the data choose it as well, and what each name takes away.

use rayon::prelude::*;

use super::refit::begins;
use super::rounds::FAR;
use super::weighing::{pays, weighed};
use super::{Hypothesis, Options, Outcome, Residuals, Rival, Set, sum_of_squares};
use crate::discovery::finding::{Split, Step};
use crate::discovery::resample::{self, Draw, STRETCHES};

/// A hypothesis as if only some stretches had been measured.
struct Drawn<T> {
    hypothesis: Hypothesis<T>,
    /// Sums of squares by stretch, on the data fitted and held out; a stretch takes the same part of every sensor's rows.
    sums: [Draw; 2],
}

impl<T: Clone + PartialEq + Send + Sync> Drawn<T> {
    fn of<G: Residuals<Term = T>>(gap: &G, h: &Hypothesis<T>) -> Self {
        let sums = [Set::Train, Set::Heldout].map(|set| {
            let Some(residuals) = gap.residuals(set, &h.terms, &h.parameters) else {
                return [f64::INFINITY; STRETCHES];
            };
            let blocks = gap.blocks(set);
            let mut all = [0.0; STRETCHES];
            let whole = std::iter::once(0..residuals.len()).filter(|_| blocks.is_empty());
            for rows in blocks.iter().map(|block| block.rows.clone()).chain(whole) {
                let own = resample::sums(&residuals[rows]);
                all.iter_mut().zip(own).for_each(|(to, own)| *to += own);
            }
            all
        });
        Self { hypothesis: h.clone(), sums }
    }

    fn draw(&mut self, draw: &[Draw; 2]) -> &Hypothesis<T> {
        let of = |set: usize| resample::drawn(&self.sums[set], &draw[set]);
        (self.hypothesis.train, self.hypothesis.heldout) = (of(0), of(1));
        &self.hypothesis
    }
}

/// Works out for each effect chosen, and for each rival that comes near, the share of draws in which it pays and nothing
/// else explains more in its place.
pub(super) fn steadied<G: Residuals>(gap: &G, outcome: &mut Outcome<G::Term>, options: &Options) {
    let Outcome { best, without, rivals, stability, .. } = outcome;
    let mut chosen = Drawn::of(gap, best);
    *stability = vec![0.0; best.terms.len()];
    for at in 0..best.terms.len() {
        let mut rest = Drawn::of(gap, &without[at]);
        let is_near = |r: &&mut Rival<_>| r.instead_of == at && r.behind < FAR * options.tie;
        let mut near: Vec<_> = rivals.iter_mut().filter(is_near).collect();
        let mut others: Vec<_> = near.iter().map(|r| Drawn::of(gap, &r.hypothesis)).collect();
        let mut wins = vec![0_usize; near.len() + 1];
        for draw in resample::draws() {
            let rest = rest.draw(&draw);
            let others = others.iter_mut().map(|other| other.draw(&draw));
            let others = others.map(|h| (h, h.terms.len() - 1));
            let all = std::iter::once((chosen.draw(&draw), at)).chain(others);
            let weighed = all.map(|(h, site)| (weighed(gap, h, options), h, site));
            let winner = weighed.enumerate().min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
            if let Some((winner, (_, h, site))) = winner
                && pays(gap, h, site, rest, options)
            {
                wins[winner] += 1;
            }
        }
        let share = |wins: usize| wins as f64 / resample::DRAWS as f64;
        stability[at] = share(wins[0]);
        near.iter_mut().zip(&wins[1..]).for_each(|(rival, wins)| rival.stability = share(*wins));
    }
}

/// A name is one if at least this share of draws name it, or what it cannot be told from: what more than half of them leave
/// out predicts worse (Barbieri and Berger, "Optimal Predictive Model Selection", 2004).
const MEDIAN: f64 = 0.5;

/// Returns the effect that fewest draws name, if more than half of them do not.
pub(super) fn least_steady<T>(outcome: &Outcome<T>) -> Option<usize> {
    let named = |at: usize| {
        let rivals = outcome.rivals.iter().filter(|rival| rival.instead_of == at);
        outcome.stability[at] + rivals.map(|rival| rival.stability).sum::<f64>()
    };
    let least = (0..outcome.stability.len()).min_by(|a, b| named(*a).total_cmp(&named(*b)))?;
    (named(least) < MEDIAN).then_some(least)
}

/// Returns the data that what is told of those held out is read off: what decides nothing, or all of them where they are too
/// few to set some aside.
pub fn reported<G: Residuals>(gap: &G) -> Set {
    if gap.count(Set::Unseen) > 0 { Set::Unseen } else { Set::Heldout }
}

/// Works out what a hypothesis leaves of all data.
pub fn judge<G: Residuals>(gap: &G, h: &mut Hypothesis<G::Term>) {
    let left = |set| square(gap, set, &h.terms, &h.parameters);
    (h.train, h.heldout, h.unseen) = (left(Set::Train), left(Set::Heldout), left(reported(gap)));
    h.count = gap.count(Set::Train);
}

/// Judges one effect that was found otherwise than by a search, beside nothing.
pub fn judged<G: Residuals>(
    gap: &G,
    mut best: Hypothesis<G::Term>,
    options: &Options,
) -> Outcome<G::Term> {
    let mut nothing = Hypothesis::nothing();
    judge(gap, &mut nothing);
    judge(gap, &mut best);
    let (without, rivals) = (vec![nothing.clone()], Vec::new());
    let mut outcome = Outcome { nothing, best, without, rivals, stability: Vec::new() };
    steadied(gap, &mut outcome, options);
    outcome
}

/// The same for all that is told of an outcome: rivals that are far behind are told by their names.
pub(super) fn judge_told<G: Residuals>(gap: &G, outcome: &mut Outcome<G::Term>, options: &Options) {
    told(outcome, options).into_par_iter().for_each(|hypothesis| judge(gap, hypothesis));
}

/// Returns the hypotheses of which something is told.
fn told<'o, T>(outcome: &'o mut Outcome<T>, options: &Options) -> Vec<&'o mut Hypothesis<T>> {
    let ties = outcome.rivals.iter_mut().filter(|rival| rival.behind < options.tie);
    let chosen = [&mut outcome.nothing, &mut outcome.best].into_iter().chain(&mut outcome.without);
    chosen.chain(ties.map(|rival| &mut rival.hypothesis)).collect()
}

/// Works out what all that is told of an outcome leaves of the data that decide nothing.
pub(super) fn judge_all<G: Residuals>(gap: &G, outcome: &mut Outcome<G::Term>, options: &Options) {
    told(outcome, options)
        .into_par_iter()
        .for_each(|h| h.unseen = square(gap, reported(gap), &h.terms, &h.parameters));
}

fn square<G: Residuals>(gap: &G, set: Set, terms: &[G::Term], parameters: &[f64]) -> f64 {
    gap.residuals(set, terms, parameters).map_or(f64::INFINITY, |left| sum_of_squares(&left))
}

/// Returns the root mean square of residuals of a set, from the sum of their squares.
pub(super) fn rms<G: Residuals>(gap: &G, set: Set, sum: f64) -> f64 {
    (sum / gap.count(set).max(1) as f64).sqrt()
}

/// Returns the root mean square of what a hypothesis leaves of the data fitted and of those held out, in units of noise.
pub fn split<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>) -> Split {
    Split { train: rms(gap, Set::Train, h.train), heldout: rms(gap, reported(gap), h.unseen) }
}

/// The same without any effect.
pub fn left<G: Residuals>(gap: &G) -> Split {
    let own: Vec<f64> = gap.nuisance().iter().map(|(_, value)| *value).collect();
    split_at(gap, &[], &own)
}

/// Returns what is left before any name, and after each is written into the model as it was fitted, the largest first; `told`
/// says the name of an effect and its place, or nothing of what counts as a number of the model and is in it from the beginning.
pub fn path<G: Residuals>(
    gap: &G,
    outcome: &Outcome<G::Term>,
    told: impl Fn(&G::Term) -> Option<(String, String)>,
) -> (Split, Vec<Step>) {
    let Outcome { best, without, .. } = outcome;
    let mut order: Vec<(usize, Option<(String, String)>)> =
        best.terms.iter().map(told).enumerate().collect();
    order.sort_by(|(a, of_a), (b, of_b)| {
        let largest = || without[*b].criterion().total_cmp(&without[*a].criterion());
        of_a.is_some().cmp(&of_b.is_some()).then_with(largest)
    });
    let mut terms = Vec::new();
    let mut parameters = best.parameters[..gap.nuisance().len()].to_vec();
    let (mut before, mut steps) = (None, Vec::new());
    for (at, told) in order {
        if told.is_some() && before.is_none() {
            before = Some(split_at(gap, &terms, &parameters));
        }
        let from = begins(gap, best, at);
        terms.push(best.terms[at].clone());
        parameters
            .extend_from_slice(&best.parameters[from..from + gap.specs(&best.terms[at]).len()]);
        if let Some((name, at)) = told {
            steps.push(Step { name, at, gap: split_at(gap, &terms, &parameters) });
        }
    }
    (before.unwrap_or_else(|| split_at(gap, &terms, &parameters)), steps)
}

/// What is left of the data fitted and of those held out with these effects as they are.
fn split_at<G: Residuals>(gap: &G, terms: &[G::Term], parameters: &[f64]) -> Split {
    let of = |set| rms(gap, set, square(gap, set, terms, parameters));
    Split { train: of(Set::Train), heldout: of(reported(gap)) }
}
