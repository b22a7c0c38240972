//! How sure what was chosen is: whether other stretches of the data choose it as well, and what each name takes away.

use rayon::prelude::*;

use super::refit::begins;
use super::rounds::FAR;
use super::weighing::{forgiven, pays, weighed};
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
/// else explains more in its place, but for a law of which the one chosen is a special case.
pub(super) fn steadied<G: Residuals>(gap: &G, outcome: &mut Outcome<G::Term>, options: &Options) {
    let Outcome { best, without, rivals, stability, .. } = outcome;
    let mut chosen = Drawn::of(gap, best);
    *stability = vec![0.0; best.terms.len()];
    for at in 0..best.terms.len() {
        let mut rest = Drawn::of(gap, &without[at]);
        let is_near = |r: &&mut Rival<_>| r.instead_of == at && r.behind < FAR * options.tie;
        let mut near: Vec<_> = rivals.iter_mut().filter(is_near).collect();
        let mut others: Vec<_> = near.iter().map(|r| Drawn::of(gap, &r.hypothesis)).collect();
        let credit = |r: &&mut Rival<_>| forgiven(gap, &r.hypothesis, (&*best, at), options);
        let credits: Vec<f64> = near.iter().map(credit).collect();
        let mut wins = vec![0_usize; near.len() + 1];
        for draw in resample::draws() {
            let rest = rest.draw(&draw);
            let others = others.iter_mut().map(|other| other.draw(&draw));
            let others = others.zip(&credits).map(|(h, credit)| (h, h.terms.len() - 1, *credit));
            let all = std::iter::once((chosen.draw(&draw), at, 0.0)).chain(others);
            let weighed = all.map(|(h, site, credit)| (weighed(gap, h, options) - credit, h, site));
            let winner = weighed.enumerate().min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
            if let Some((winner, (_, h, site))) = winner
                && pays(gap, h, site, rest, options)
            {
                // The law that contains the one chosen names it as well.
                let is_of_chosen = gap.contains(&h.terms[site], &best.terms[at]);
                wins[if is_of_chosen { 0 } else { winner }] += 1;
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

#[cfg(test)]
mod tests {
    use super::super::weighing::behind;
    use super::super::{Candidate, ParameterSpec, refit};
    use super::*;

    /// Rows of each set: as many in every stretch, whose shapes and noise have nothing in common.
    const ROWS: usize = 20 * STRETCHES;

    /// A level of 1, and so much of a square wave. Effect 0 is the level, effect 1 the level with a wave on it.
    struct Levels {
        wave: f64,
        contains: bool,
        is_likelier: bool,
        /// Whether the wave is of no effect.
        is_idle: bool,
    }

    impl Residuals for Levels {
        type Term = usize;

        fn specs(&self, term: &usize) -> Vec<ParameterSpec> {
            let (range, neutral, least) = ((-1e3, 1e3), Some(0.0), 0.0);
            let size = ParameterSpec { name: "size", unit: "", scale: 1.0, range, neutral, least };
            vec![size; 1 + term]
        }

        fn residuals(&self, _: Set, _: &[usize], parameters: &[f64]) -> Option<Vec<f64>> {
            let of = |at: usize| parameters.get(at).copied().unwrap_or(0.0);
            let sign = |is_up: bool| if is_up { 1.0 } else { -1.0 };
            let row = |row: usize| {
                let own = if self.is_idle { 0.0 } else { of(1) };
                let wave = (self.wave - own) * sign(row % 4 < 2);
                1.0 - of(0) + wave + sign(row.is_multiple_of(2))
            };
            Some((0..ROWS).map(row).collect())
        }

        fn count(&self, set: Set) -> usize {
            if set == Set::Unseen { 0 } else { ROWS }
        }

        fn candidates(&self, _: &[usize], _: &[f64], _: Option<&usize>) -> Vec<Candidate<usize>> {
            Vec::new()
        }

        fn contains(&self, general: &usize, special: &usize) -> bool {
            self.contains && general > special
        }

        fn is_likelier(&self, other: &usize, chosen: &usize) -> bool {
            self.is_likelier && other > chosen
        }
    }

    /// What is said of the level, beside the level with a wave as its rival: how far behind that is, and the shares of both.
    fn told(gap: &Levels) -> (f64, [f64; 2]) {
        let fitted = |terms: &[usize], n: usize| {
            refit(gap, terms.to_vec(), vec![0.0; n], vec![0.0; terms.len()]).unwrap()
        };
        let (nothing, best, other) = (fitted(&[], 0), fitted(&[0], 1), fitted(&[1], 2));
        let behind = behind(gap, &other, (&best, 0), &Options::default());
        let rivals = vec![Rival { instead_of: 0, hypothesis: other, behind, stability: 0.0 }];
        let without = vec![nothing.clone()];
        let mut outcome = Outcome { nothing, best, without, rivals, stability: Vec::new() };
        steadied(gap, &mut outcome, &Options::default());
        (behind, [outcome.stability[0], outcome.rivals[0].stability])
    }

    fn is_near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-3
    }

    #[test]
    fn draws_that_name_the_general_law_name_its_special_case() {
        let gap = |contains| Levels { wave: 0.1, contains, is_likelier: false, is_idle: false };
        let (behind, [own, other]) = told(&gap(false));
        assert!(behind < 0.0 && is_near(own, 0.0) && is_near(other, 1.0), "{behind}");
        let (behind, [own, other]) = told(&gap(true));
        assert!(behind > 0.0 && is_near(own, 1.0) && is_near(other, 0.0), "{behind}");
    }

    #[test]
    fn the_price_of_its_numbers_does_not_speak_against_what_is_likelier() {
        let gap =
            |is_likelier, is_idle| Levels { wave: 0.0, contains: false, is_likelier, is_idle };
        let price = (ROWS as f64).ln();
        assert!(is_near(told(&gap(false, false)).0, price));
        assert!(is_near(told(&gap(true, false)).0, 0.0));
        // Nor does that of a number that does nothing.
        assert!(is_near(told(&gap(false, true)).0, 0.0));
    }
}
