//! Whether all rows, as the sensors read them, bear out what a search named.
//!
//! Where residuals are not white a search weighs each sensor by how much of it no effect explains. What takes from a sensor that
//! weighs much and gives to one that weighs little pays there, and may leave more of the data than there was without it: a load
//! of 30 g was named so, by which the criterion rose by 4903. Such a name is left out again, the others are fitted anew.

use rayon::prelude::*;

use super::rounds::FAR;
use super::search::left_out;
use super::steady::{judge, judge_told, steadied};
use super::weighing::{behind, is_sensible};
use super::{Hypothesis, Options, Outcome, Residuals};

/// Judges an outcome by all rows of `gap`, and leaves out what they speak against, one at a time; `fitted` is what was searched in.
pub fn upheld<G: Residuals>(
    gap: &G,
    fitted: &G,
    mut outcome: Outcome<G::Term>,
    options: &Options,
) -> Outcome<G::Term> {
    judge_told(gap, &mut outcome, options);
    while let Some(at) = refuted(&outcome, options) {
        let Some(rest) = left_out(fitted, &outcome.best, at) else { break };
        let mut all = rest.clone();
        judge(gap, &mut all);
        if is_refuted(&outcome.best, &all, options) {
            outcome = narrowed(fitted, outcome, (at, rest), options);
            judge_told(gap, &mut outcome, options);
        } else {
            // What it was compared with was fitted beside other effects.
            outcome.without[at] = all;
        }
    }
    outcome
}

/// Returns the effect of which the data say the least, of those that they speak against.
fn refuted<T>(outcome: &Outcome<T>, options: &Options) -> Option<usize> {
    let Outcome { best, without, .. } = outcome;
    let against = (0..best.terms.len()).filter(|at| is_refuted(best, &without[*at], options));
    against.min_by(|a, b| without[*a].criterion().total_cmp(&without[*b].criterion()))
}

/// Returns whether the data speak against what `with` has and `without` has not: the criterion does not fall, or what was held
/// out, and does exercise it, is explained worse.
fn is_refuted<T>(with: &Hypothesis<T>, without: &Hypothesis<T>, options: &Options) -> bool {
    without.criterion() <= with.criterion()
        || with.heldout > without.heldout + options.least_heldout
}

/// Returns an outcome without the effect at `at`, beside the `rest` that is left of its explanation.
fn narrowed<G: Residuals>(
    fitted: &G,
    mut outcome: Outcome<G::Term>,
    (at, rest): (usize, Hypothesis<G::Term>),
    options: &Options,
) -> Outcome<G::Term> {
    let out = outcome.best.terms[at].clone();
    outcome.keep(&rest.terms);
    outcome.best = rest;
    let Outcome { nothing, best, without, rivals, .. } = &mut outcome;
    let beside = |at: usize| left_out(fitted, best, at).unwrap_or_else(|| nothing.clone());
    *without = (0..best.terms.len()).into_par_iter().map(beside).collect();
    // Those far behind are told by their names.
    rivals.retain_mut(|rival| {
        if rival.behind >= FAR * options.tie {
            return true;
        }
        let place = rival.hypothesis.terms.iter().position(|term| *term == out);
        let again = place.and_then(|place| left_out(fitted, &rival.hypothesis, place));
        let Some(again) = again.filter(|again| is_sensible(fitted, again)) else { return false };
        rival.behind = behind(fitted, &again, (&*best, rival.instead_of), options);
        rival.hypothesis = again;
        true
    });
    rivals.sort_by(|a, b| a.behind.total_cmp(&b.behind));
    steadied(fitted, &mut outcome, options);
    outcome
}

#[cfg(test)]
mod tests {
    use super::super::{Candidate, ParameterSpec, Set, refit};
    use super::*;

    /// Rows of each sensor.
    const ROWS: usize = 50;

    /// Three sensors, the first and the last of which are off by 1. Effect 0 takes from the first as much as it gives twice to the
    /// second; effect 1 is an offset of the third.
    struct Bench {
        noise: [f64; 3],
    }

    impl Residuals for Bench {
        type Term = usize;

        fn specs(&self, _: &usize) -> Vec<ParameterSpec> {
            let range = (-10.0, 10.0);
            let (neutral, least) = (Some(0.0), 0.0);
            vec![ParameterSpec { name: "much", unit: "", scale: 1.0, range, neutral, least }]
        }

        fn residuals(&self, _: Set, terms: &[usize], parameters: &[f64]) -> Option<Vec<f64>> {
            let much = |effect: usize| {
                terms.iter().position(|term| *term == effect).map_or(0.0, |at| parameters[at])
            };
            let left = [1.0 - much(0), 2.0 * much(0), 1.0 - much(1)];
            Some((0..3 * ROWS).map(|row| left[row % 3] / self.noise[row % 3]).collect())
        }

        fn count(&self, _: Set) -> usize {
            3 * ROWS
        }

        fn candidates(&self, _: &[usize], _: &[f64], _: Option<&usize>) -> Vec<Candidate<usize>> {
            Vec::new()
        }
    }

    /// What `fitted` says of these effects.
    fn outcome(fitted: &Bench, effects: &[usize]) -> Outcome<usize> {
        let n = effects.len();
        let nothing = refit(fitted, Vec::new(), Vec::new(), Vec::new()).unwrap();
        let best = refit(fitted, effects.to_vec(), vec![0.0; n], vec![0.0; n]).unwrap();
        let without = (0..n).map(|at| left_out(fitted, &best, at).unwrap()).collect();
        Outcome { nothing, best, without, rivals: Vec::new(), stability: vec![1.0; n] }
    }

    #[test]
    fn what_pays_only_by_the_weights_of_the_search_is_not_named() {
        let options = Options::default();
        let (gap, fitted) = (Bench { noise: [1.0; 3] }, Bench { noise: [1.0, 10.0, 1.0] });
        let searched = outcome(&fitted, &[0, 1]);
        assert!(
            searched.worth(0).0.delta_bic > 0.0,
            "it pays where the second sensor weighs little"
        );
        let told = upheld(&gap, &fitted, searched, &options);
        assert_eq!(told.best.terms, [1]);
        assert!((told.best.parameters[0] - 1.0).abs() < 1e-6);
        let (evidence, stability) = told.worth(0);
        assert!(evidence.delta_bic > 0.0 && evidence.heldout_gain > 0.9, "{evidence:?}");
        assert!((stability - 1.0).abs() < 1e-9);
        // Alone it leaves nothing to be named.
        let told = upheld(&gap, &fitted, outcome(&fitted, &[0]), &options);
        assert!(told.best.terms.is_empty() && told.without.is_empty());
    }

    #[test]
    fn what_pays_by_both_stays() {
        let fitted = Bench { noise: [1.0; 3] };
        let told = upheld(&fitted, &fitted, outcome(&fitted, &[1]), &Options::default());
        assert_eq!(told.best.terms, [1]);
    }
}
