//! What a search of an arm's recordings found, and whether it is told.

use super::driven::is_driven;
use super::explain::ArmGap;
use super::links::own::Links;
use super::term::Term;
use crate::discovery::finding::{ESTIMATED, MATTERS, SIGNIFICANT, above_noise, shrink};
use crate::discovery::selection::{self, Hypothesis, Outcome, Residuals as _};

/// So many effects are a list.
const LIST: usize = 3;

/// What the search found, beside which numbers.
pub(super) struct Found {
    pub(super) outcome: Outcome<Term>,
    /// The gap it was fitted to, where that is not all of the recordings.
    pub(super) fitted: Option<ArmGap>,
    /// The links' numbers, where the file's are left.
    pub(super) own: Option<Links>,
    /// The gap with the file's, then.
    pub(super) filed: Option<ArmGap>,
}

impl Found {
    /// Returns the model as it was, with what it leaves.
    fn as_it_was<'a>(&'a self, gap: &'a ArmGap) -> (&'a ArmGap, Hypothesis<Term>) {
        let mut nothing = self.outcome.nothing.clone();
        if let Some(filed) = &self.filed {
            selection::judge(filed, &mut nothing);
        }
        (self.filed.as_ref().unwrap_or(gap), nothing)
    }

    /// Returns whether what was found leaves more than noise of the data that decided nothing, and more than the model as it was.
    pub(super) fn is_worse(&self, gap: &ArmGap) -> bool {
        let (before, nothing) = self.as_it_was(gap);
        let left = selection::split(gap, &self.outcome.best).heldout;
        let rows = gap.count(selection::reported(gap));
        let is_more = left > selection::split(before, &nothing).heldout;
        is_more && above_noise(left.powi(2) * rows as f64, rows) > SIGNIFICANT
    }

    /// Returns whether what was found in a simulation with the controller takes next to nothing of the gap.
    pub(super) fn is_little(&self, gap: &ArmGap) -> bool {
        if !is_driven(gap) {
            return false;
        }
        let (before, nothing) = self.as_it_was(gap);
        let best = &self.outcome.best;
        let was = selection::split(before, &nothing).heldout;
        let left = selection::split(gap, best).heldout;
        takes_little(best.terms.len(), (was, left), gap.count(selection::reported(gap)))
    }

    /// Returns the model as it was with nothing found.
    pub(super) fn without(self, gap: ArmGap) -> (ArmGap, Self) {
        let (_, nothing) = self.as_it_was(&gap);
        let gap = self.filed.unwrap_or(gap);
        let fitted = gap.is_along().then(|| gap.for_search());
        let (without, rivals, stability) = (Vec::new(), Vec::new(), Vec::new());
        let outcome = Outcome { best: nothing.clone(), nothing, without, rivals, stability };
        (gap, Self { outcome, fitted, own: None, filed: None })
    }
}

/// Returns whether a list of effects takes next to nothing of a gap that is as small as noise is known, in units of it, and yet
/// is none: names that stand against each other, for a way of following that has no name. An effect or two that take as little may
/// be there.
fn takes_little(n_effects: usize, (was, left): (f64, f64), rows: usize) -> bool {
    n_effects >= LIST
        && left < ESTIMATED
        && shrink(was, left, 1.0) < MATTERS
        && above_noise(left.powi(2) * rows as f64, rows) > SIGNIFICANT
}

#[cfg(test)]
mod tests {
    use super::takes_little;

    /// An arm that fed torque forward, told as one that does not: seven names, and 1.07 noises before and after.
    #[test]
    fn a_list_that_takes_a_thirtieth_of_the_gap_is_none() {
        assert!(takes_little(5, (1.07, 1.0676), 14_000));
        assert!(!takes_little(2, (1.07, 1.0676), 14_000), "a small effect may be there");
        assert!(!takes_little(5, (1.07, 1.02), 14_000), "most of it is explained");
        assert!(!takes_little(5, (1.005, 1.004), 14_000), "what is left is noise");
        assert!(!takes_little(5, (4.0, 3.9), 14_000), "much is left, and names are a lead");
    }
}
