//! Whether names say by themselves what they were named for.
//!
//! A formula is told and not written into the model. Laws with several numbers each are as flexible as powers are, so that together,
//! and with powers that take back what they do elsewhere, they follow a dent in one spot of a picture: a focal length ten times
//! too long was named so, beside the formula that cancels it. Where something without a name is at work, a name is one only if,
//! written into the model as it was fitted, it explains data without any formula; and names that leave most of the gap are none.
//! Where nothing but exact laws is missing, they leave noise, and names may well make up for each other.

use super::refit::begins;
use super::steady::{judge, rms};
use super::weighing::pays;
use super::{Hypothesis, Options, Outcome, Residuals, Set};
use crate::discovery::finding::{ESTIMATED, EXPLAINED, SIGNIFICANT, above_noise, shrink};

/// A misfit this many standard deviations of χ² above its expectation is likely none of noise.
const LIKELY: f64 = 2.0;

/// Returns which name to leave out where something without one is at work: the first that does not pay beside the larger ones
/// alone, or, where all of them leave most of the gap, the smallest.
pub(super) fn least_borne<G: Residuals>(
    gap: &G,
    outcome: &Outcome<G::Term>,
    options: &Options,
) -> Option<usize> {
    let Outcome { nothing, best, without, .. } = outcome;
    let is_noise = !is_gap(gap, Set::Train, best.train) && !is_gap(gap, Set::Heldout, best.heldout);
    let has_formula = best.surcharges.iter().any(|surcharge| *surcharge > 0.0);
    if !gap.names_stand_alone() || (is_noise && !has_formula) {
        return None;
    }
    let mut names: Vec<usize> =
        (0..best.terms.len()).filter(|at| best.surcharges[*at] <= 0.0).collect();
    names.sort_by(|a, b| without[*b].criterion().total_cmp(&without[*a].criterion()));
    let mut written = as_fitted(gap, best, &[]);
    for (last, at) in names.iter().enumerate() {
        let with = as_fitted(gap, best, &names[..=last]);
        if !pays(gap, &with, last, &written, options) {
            return Some(*at);
        }
        written = with;
    }
    let is_most = is_noise || explained(gap, nothing, &written) >= EXPLAINED;
    names.last().copied().filter(|_| !is_most)
}

/// Returns some effects of a hypothesis without the others, as they were fitted beside them.
fn as_fitted<G: Residuals>(
    gap: &G,
    best: &Hypothesis<G::Term>,
    kept: &[usize],
) -> Hypothesis<G::Term> {
    let mut h = Hypothesis::nothing();
    h.parameters.extend_from_slice(&best.parameters[..gap.nuisance().len()]);
    for &at in kept {
        let from = begins(gap, best, at);
        let to = from + gap.specs(&best.terms[at]).len();
        h.parameters.extend_from_slice(&best.parameters[from..to]);
        h.terms.push(best.terms[at].clone());
        h.surcharges.push(best.surcharges[at]);
        h.gains.push(0.0);
    }
    judge(gap, &mut h);
    h
}

/// Returns whether a sum of squares that is left of a set is more than noise: sure of it, or, where rows are few, likely and more
/// than an error of the noise itself.
fn is_gap<G: Residuals>(gap: &G, set: Set, left: f64) -> bool {
    let above = above_noise(left, gap.count(set));
    above >= SIGNIFICANT || (above >= LIKELY && rms(gap, set, left) >= ESTIMATED)
}

/// Returns which part of the gap a hypothesis explains: on the data held out, or, where those show none, on the data fitted.
fn explained<G: Residuals>(gap: &G, nothing: &Hypothesis<G::Term>, h: &Hypothesis<G::Term>) -> f64 {
    let of = |set, before, after| shrink(rms(gap, set, before), rms(gap, set, after), 1.0);
    if is_gap(gap, Set::Heldout, nothing.heldout) {
        of(Set::Heldout, nothing.heldout, h.heldout)
    } else {
        of(Set::Train, nothing.train, h.train)
    }
}

#[cfg(test)]
mod tests {
    use super::super::search::left_out;
    use super::super::{Candidate, ParameterSpec, refit};
    use super::*;

    /// Rows of each shape.
    const ROWS: usize = 50;

    /// A gap of some sizes along three shapes that do not overlap. Effects 0, 1 and 2 act along one shape each; 3 acts along the
    /// first two at once.
    struct Shapes {
        gap: [f64; 3],
        stand: bool,
    }

    impl Residuals for Shapes {
        type Term = usize;

        fn specs(&self, _: &usize) -> Vec<ParameterSpec> {
            let (range, neutral) = ((-1e3, 1e3), Some(0.0));
            vec![ParameterSpec { name: "size", unit: "", scale: 1.0, range, neutral, least: 0.0 }]
        }

        fn residuals(&self, _: Set, terms: &[usize], parameters: &[f64]) -> Option<Vec<f64>> {
            let mut left = self.gap;
            for (term, size) in terms.iter().zip(parameters) {
                let acts = |shape: usize| if *term == 3 { shape < 2 } else { shape == *term };
                let along = left.iter_mut().enumerate().filter(|(shape, _)| acts(*shape));
                along.for_each(|(_, left)| *left -= size);
            }
            // Noise of one standard deviation.
            let noise = |row: usize| if row.is_multiple_of(2) { 1.0 } else { -1.0 };
            Some((0..3 * ROWS).map(|row| left[row / ROWS] + noise(row)).collect())
        }

        fn count(&self, set: Set) -> usize {
            if set == Set::Unseen { 0 } else { 3 * ROWS }
        }

        fn candidates(&self, _: &[usize], _: &[f64], _: Option<&usize>) -> Vec<Candidate<usize>> {
            Vec::new()
        }

        fn names_stand_alone(&self) -> bool {
            self.stand
        }
    }

    /// Which effect is left out of some, those of them that are formulas with a surcharge.
    fn found(gap: &Shapes, terms: &[usize], formulas: &[usize]) -> Option<usize> {
        let own = |terms: &[usize]| -> Vec<f64> {
            terms.iter().map(|term| if formulas.contains(term) { 20.0 } else { 0.0 }).collect()
        };
        let fitted = |terms: &[usize]| {
            refit(gap, terms.to_vec(), vec![0.0; terms.len()], own(terms)).unwrap()
        };
        let (nothing, best) = (fitted(&[]), fitted(terms));
        let without = (0..terms.len()).map(|at| left_out(gap, &best, at).unwrap()).collect();
        let stability = vec![1.0; terms.len()];
        let outcome = Outcome { nothing, best, without, rivals: Vec::new(), stability };
        least_borne(gap, &outcome, &Options::default())
    }

    #[test]
    fn a_name_that_a_formula_cancels_is_none() {
        // Along both shapes by 8, and by -11 along the second.
        let gap = |stand| Shapes { gap: [8.0, -3.0, 0.0], stand };
        assert_eq!(found(&gap(true), &[1, 3], &[1]), Some(1));
        assert_eq!(found(&gap(false), &[1, 3], &[1]), None);
        // A name that explains by itself stays beside a formula.
        assert_eq!(found(&gap(true), &[0, 1], &[1]), None);
    }

    #[test]
    fn names_that_make_up_for_each_other_leave_noise() {
        let gap = |rest| Shapes { gap: [8.0, -3.0, rest], stand: true };
        assert_eq!(found(&gap(0.0), &[1, 3], &[]), None);
        // What is left of the third shape says that something else is at work.
        assert_eq!(found(&gap(4.0), &[1, 3], &[]), Some(1));
    }

    #[test]
    fn names_that_leave_most_of_the_gap_are_none() {
        let gap = |rest| Shapes { gap: [4.0, 3.0, rest], stand: true };
        assert_eq!(found(&gap(8.0), &[0, 1], &[]), Some(1));
        assert_eq!(found(&gap(2.0), &[0, 1], &[]), None);
        // A formula that explains the rest leaves the names what they are.
        assert_eq!(found(&gap(8.0), &[0, 1, 2], &[2]), None);
        assert_eq!(found(&gap(8.0), &[2], &[2]), None);
    }
}
