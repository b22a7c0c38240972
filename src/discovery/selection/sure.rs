//! Whether an effect is larger than it is uncertain, beside all others and with every shape free.
//!
//! When it joined it was; a shape that was fitted since, or what joined after it, may say the same by other numbers. An offset and a
//! ripple of an order of about one are such a pair: each as large as one likes, if the other is.

use super::refit::begins;
use super::{Hypothesis, Outcome, Residuals};

/// An effect smaller than this many of its own standard deviations is not there: where two of its numbers
/// trade against each other, both are as large as one likes and neither says anything.
pub(super) const DETERMINED: f64 = 2.0;

/// Numbers trade against each other if they are correlated by more than this.
const TRADES: f64 = 0.9;

/// Returns which effect to leave out where the size of one is not sure: of it and those that trade against it the one without which
/// most is explained.
pub(super) fn least_sure<G: Residuals>(gap: &G, outcome: &Outcome<G::Term>) -> Option<usize> {
    if !gap.asks_for_size() {
        return None;
    }
    let best = &Hypothesis { covariance: gap.covariance(&outcome.best), ..outcome.best.clone() };
    let rest = |at: &usize| outcome.without[*at].criterion();
    let weaker = |a: &usize, b: &usize| rest(a).total_cmp(&rest(b));
    let all = 0..best.terms.len();
    let unsure = all.clone().filter(|at| !is_sure(gap, best, *at)).min_by(weaker)?;
    all.filter(|at| *at == unsure || trade(gap, best, *at, unsure)).min_by(weaker)
}

/// Returns where the numbers of an effect stand that are nothing where it is not there, how far each is from that, and its scale.
fn sizes<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, at: usize) -> Vec<(usize, f64, f64)> {
    let specs = gap.specs(&h.terms[at]).into_iter().zip(begins(gap, h, at)..);
    let own = specs.filter_map(|(spec, i)| Some((i, h.parameters[i] - spec.neutral?, spec.scale)));
    own.collect()
}

/// Returns whether a number of an effect, or all of them together as the amplitude of a wave is, exceeds what it is uncertain by,
/// and so does the one that the others stand on.
fn is_sure<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, at: usize) -> bool {
    let sizes = sizes(gap, h, at);
    let exceeds = |size: f64, variance: f64| size.abs() > DETERMINED * variance.max(0.0).sqrt();
    let by_itself = |&(i, size, _): &(usize, f64, f64)| exceeds(size, h.covariance[(i, i)]);
    // In units of the scales, along the way from nothing.
    let whole = sizes.iter().map(|(_, size, scale)| (size / scale).powi(2)).sum::<f64>().sqrt();
    let part = |&(_, size, scale): &(usize, f64, f64)| size / (scale * scale * whole);
    let pairs = sizes.iter().flat_map(|a| sizes.iter().map(move |b| (a, b)));
    let variance = pairs.map(|(a, b)| part(a) * part(b) * h.covariance[(a.0, b.0)]).sum::<f64>();
    let base = gap.base(&h.terms[at]).map(|place| begins(gap, h, at) + place);
    let stands = |own: &(usize, f64, f64)| base != Some(own.0) || by_itself(own);
    let is_there = sizes.is_empty() || sizes.iter().any(by_itself) || exceeds(whole, variance);
    is_there && sizes.iter().all(stands)
}

/// Returns whether a number of one effect trades against one of another.
fn trade<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>, a: usize, b: usize) -> bool {
    let others = sizes(gap, h, b);
    let covariance = |i: usize, k: usize| h.covariance[(i, k)];
    sizes(gap, h, a).iter().any(|(i, ..)| {
        others.iter().any(|(k, ..)| {
            let both = (covariance(*i, *i) * covariance(*k, *k)).sqrt();
            covariance(*i, *k).abs() > TRADES * both
        })
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::super::{Candidate, ParameterSpec, Set};
    use super::*;

    /// Effects of one number; the third is a wave, of two and its order, the fourth a level with a peak on it.
    struct Sizes;

    impl Residuals for Sizes {
        type Term = u8;

        fn specs(&self, term: &u8) -> Vec<ParameterSpec> {
            let size = |neutral| ParameterSpec {
                name: "size",
                unit: "",
                scale: 1.0,
                range: (-1e9, 1e9),
                neutral,
                least: 0.0,
            };
            let of_one = vec![size(Some(0.0))];
            match term {
                2 => vec![size(Some(0.0)), size(Some(0.0)), size(None)],
                3 => vec![size(Some(0.0)), size(Some(0.0))],
                _ => of_one,
            }
        }

        fn residuals(&self, _: Set, _: &[u8], _: &[f64]) -> Option<Vec<f64>> {
            None
        }

        fn count(&self, _: Set) -> usize {
            1
        }

        fn candidates(&self, _: &[u8], _: &[f64], _: Option<&u8>) -> Vec<Candidate<u8>> {
            Vec::new()
        }

        fn asks_for_size(&self) -> bool {
            true
        }

        fn base(&self, term: &u8) -> Option<usize> {
            (*term == 3).then_some(0)
        }
    }

    /// What a hypothesis of these terms leaves, and more without each of them.
    fn outcome(
        terms: Vec<u8>,
        parameters: Vec<f64>,
        covariance: DMatrix<f64>,
        without: [f64; 2],
    ) -> Outcome<u8> {
        let nothing = Hypothesis { count: 1, ..Hypothesis::nothing() };
        let best = Hypothesis { terms, parameters, covariance, train: 1.0, ..nothing.clone() };
        let without = without.map(|train| Hypothesis { train, ..nothing.clone() }).to_vec();
        Outcome { nothing, best, without, rivals: Vec::new(), stability: vec![1.0; 2] }
    }

    #[test]
    fn of_two_that_trade_the_one_that_gains_less_is_left_out() {
        let of = |between| DMatrix::from_row_slice(2, 2, &[4.0, between, between, 4.0]);
        let found = |without| {
            let outcome = outcome(vec![0, 1], vec![1.0, 5.0], of(-3.9), without);
            least_sure(&Sizes, &outcome)
        };
        assert_eq!(found([300.0, 100.0]), Some(1));
        assert_eq!(found([100.0, 300.0]), Some(0));
        // What does not trade stays, and what is larger than its uncertainty as well.
        let apart = outcome(vec![0, 1], vec![1.0, 5.0], of(0.0), [3e2, 1e2]);
        assert_eq!(least_sure(&Sizes, &apart), Some(0));
        let sure = outcome(vec![0, 1], vec![7.0, 5.0], of(-3.9), [3e2, 1e2]);
        assert_eq!(least_sure(&Sizes, &sure), None);
    }

    #[test]
    fn a_peak_on_a_level_of_nothing_is_none() {
        let found = |level| {
            let (parameters, covariance) = (vec![90.0, level, 9.0], DMatrix::identity(3, 3));
            least_sure(&Sizes, &outcome(vec![0, 3], parameters, covariance, [3e2, 1e2]))
        };
        assert_eq!(found(4.0), None);
        assert_eq!(found(0.5), Some(1));
    }

    /// A wave whose phase is unsure, because its order is, still has an amplitude.
    #[test]
    fn a_wave_is_as_sure_as_its_amplitude() {
        let covariance = |along: f64| {
            let mut covariance = DMatrix::<f64>::identity(4, 4) * (along + 9.0);
            (covariance[(1, 2)], covariance[(2, 1)]) = (along - 9.0, along - 9.0);
            covariance
        };
        let found = |along| {
            let parameters = vec![90.0, 4.0, 4.0, 12.0];
            least_sure(&Sizes, &outcome(vec![0, 2], parameters, covariance(along), [3e2, 1e2]))
        };
        assert_eq!(found(0.01), None);
        assert_eq!(found(9.0), Some(1));
    }
}
