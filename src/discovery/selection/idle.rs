//! Which numbers of an effect do nothing: those that the data do not show, however they are chosen.
//!
//! The roll of a base does nothing to an arm that moves in a vertical plane but for the square of it, which acts alike either
//! way. Such a number stays where it begins, and what it costs does not decide between two effects.

use super::refit::begins;
use super::{Hypothesis, ParameterSpec, Residuals, Set, sum_of_squares};

/// Where a number is moved by its scale and all residuals together change by less than this, in squares of their noise, it does
/// nothing. Chosen: a thousand times what is small, yet visible, is less than its standard deviation.
const NOTHING: f64 = 1e-6;

/// Where they change by more than this one way, they do the other way. Chosen: the noise of one residual.
const VISIBLE: f64 = 1.0;

/// Returns whether residuals that change by `there` with a step of one number hold still about where it stands; `back` works out
/// how they change with the same step the other way, or that there is none.
pub(super) fn holds_still(there: &[f64], back: impl FnOnce() -> Option<Vec<f64>>) -> bool {
    let square = sum_of_squares(there);
    if !(NOTHING..=VISIBLE).contains(&square) {
        return square < NOTHING;
    }
    // What is even in a number changes as much either way.
    back().is_some_and(|back| {
        let odd: Vec<f64> = there.iter().zip(&back).map(|(a, b)| 0.5 * (a - b)).collect();
        sum_of_squares(&odd) < NOTHING
    })
}

/// Returns how many numbers of the effect at `at` do nothing, to the data fitted and to those held out.
pub(super) fn idle<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, at: usize) -> usize {
    let specs = gap.specs(&h.terms[at]).into_iter().zip(begins(gap, h, at)..);
    let does_nothing = |(spec, i): &(ParameterSpec, usize)| {
        [Set::Train, Set::Heldout].into_iter().all(|set| is_idle(gap, h, (spec, *i), set))
    };
    specs.filter(does_nothing).count()
}

/// Returns whether the number at `i` does nothing to a set, about where its effect is not there, or where its shape stands.
fn is_idle<G: Residuals>(
    gap: &G,
    h: &Hypothesis<G::Term>,
    (spec, i): (&ParameterSpec, usize),
    set: Set,
) -> bool {
    let about = spec.neutral.unwrap_or(h.parameters[i]);
    let with = |value: f64| {
        let mut parameters = h.parameters.clone();
        parameters[i] = value;
        let is_within = value >= spec.range.0 && value <= spec.range.1;
        if is_within { gap.residuals(set, &h.terms, &parameters) } else { None }
    };
    let Some(here) = with(about) else { return false };
    let change = |by: f64| -> Option<Vec<f64>> {
        Some(with(about + by)?.iter().zip(&here).map(|(a, b)| a - b).collect())
    };
    match (change(spec.scale), change(-spec.scale)) {
        (Some(up), down) => holds_still(&up, || down),
        (None, Some(down)) => holds_still(&down, || None),
        (None, None) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_acts_by_its_square_alone_holds_still() {
        let (up, down) = (vec![1e-2; 100], vec![-1e-2; 100]);
        assert!(holds_still(&up, || Some(up.clone())));
        assert!(!holds_still(&up, || Some(down)));
        // Where there is no other way, what is there counts.
        assert!(!holds_still(&up, || None));
        assert!(holds_still(&[1e-5; 100], || None));
        assert!(!holds_still(&[1.0; 100], || Some(vec![1.0; 100])));
    }
}
