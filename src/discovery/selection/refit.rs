//! The fit of some effects together, and how well they then do on data held out.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::screen::sum_of_squares;
use super::{Hypothesis, ParameterSpec, Residuals, Set};
use crate::fit;

pub(super) fn all_specs<G: Residuals>(gap: &G, terms: &[G::Term]) -> Vec<ParameterSpec> {
    let mut specs: Vec<ParameterSpec> = gap.nuisance().into_iter().map(|(spec, _)| spec).collect();
    for term in terms {
        specs.extend(gap.specs(term));
    }
    specs
}

/// Returns for every parameter whether it is the model's own or of an effect related to one of `near`: the
/// others say nothing about the same data.
pub(super) fn near_parameters<G: Residuals>(
    gap: &G,
    terms: &[G::Term],
    near: &[G::Term],
) -> Vec<bool> {
    let stay = gap.shapes_stay();
    let mut moves = vec![true; gap.nuisance().len()];
    for term in terms {
        let is_near = near.iter().any(|other| other == term || gap.related(other, term));
        let specs = gap.specs(term);
        moves.extend(specs.iter().map(|spec| is_near && !(stay && spec.neutral.is_none())));
    }
    moves
}

/// Returns whether two lists hold the same effects.
pub(super) fn same_terms<T: PartialEq>(a: &[T], b: &[T]) -> bool {
    a.len() == b.len() && a.iter().all(|term| b.contains(term))
}

/// Returns where the parameters of an effect begin.
pub(super) fn begins<G: Residuals>(gap: &G, best: &Hypothesis<G::Term>, at: usize) -> usize {
    let before = best.terms[..at].iter().map(|term| gap.specs(term).len());
    gap.nuisance().len() + before.sum::<usize>()
}

/// Returns for every parameter whether it may move.
pub(super) fn movable<G: Residuals>(gap: &G, specs: &[ParameterSpec]) -> Vec<bool> {
    let (stay, own) = (gap.shapes_stay(), gap.nuisance().len());
    specs.iter().enumerate().map(|(i, spec)| i < own || !stay || spec.neutral.is_some()).collect()
}

/// Derivatives of the residuals, one column per parameter that moves; one-sided, towards the inside of its
/// range.
pub(super) fn columns<G: Residuals>(
    gap: &G,
    terms: &[G::Term],
    parameters: &[f64],
    specs: &[ParameterSpec],
    moves: &[bool],
    residuals: &[f64],
) -> Option<Vec<Vec<f64>>> {
    (0..parameters.len())
        .into_par_iter()
        .filter(|i| moves[*i])
        .map(|i| {
            let mut moved = parameters.to_vec();
            let mut step = 0.1 * specs[i].scale;
            if moved[i] + step > specs[i].range.1 {
                step = -step;
            }
            moved[i] += step;
            let at = gap.residuals(Set::Train, terms, &moved)?;
            Some(at.iter().zip(residuals).map(|(a, r)| (a - r) / step).collect())
        })
        .collect()
}

/// Returns by how much the residuals on the data fitted rise with each parameter of a hypothesis.
pub fn rises<G: Residuals>(gap: &G, h: &Hypothesis<G::Term>) -> Option<Vec<Vec<f64>>> {
    let here = gap.residuals(Set::Train, &h.terms, &h.parameters)?;
    let moves = vec![true; h.parameters.len()];
    columns(gap, &h.terms, &h.parameters, &all_specs(gap, &h.terms), &moves, &here)
}

/// The residuals on the data fitted as a least-squares problem.
struct Problem<'a, G: Residuals> {
    gap: &'a G,
    terms: &'a [G::Term],
    specs: &'a [ParameterSpec],
    /// Which parameters are fitted.
    moves: &'a [bool],
    n: usize,
}

impl<G: Residuals> fit::Problem for Problem<'_, G> {
    fn n_residuals(&self) -> usize {
        self.n
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        match self.gap.residuals(Set::Train, self.terms, x) {
            Some(values) => r.copy_from_slice(&values),
            None => r.fill(f64::NAN),
        }
    }

    fn jacobian(&self, x: &[f64], j: &mut fit::Jacobian) -> bool {
        let Some(here) = self.gap.residuals(Set::Train, self.terms, x) else { return false };
        let Some(columns) = columns(self.gap, self.terms, x, self.specs, self.moves, &here) else {
            return false;
        };
        for row in 0..self.n {
            let to = j.row_mut(row).iter_mut().zip(self.moves).filter(|(_, moves)| **moves);
            for ((to, _), column) in to.zip(&columns) {
                *to = column[row];
            }
        }
        true
    }
}

/// Residuals beyond this many standard deviations steer less while a rough effect is located.
const ROUGH: f64 = 2.0;

/// Fits all effects together, where some stayed as they were while others joined or were left out: nobody knows yet how sure their
/// numbers are.
pub(super) fn together<G: Residuals>(gap: &G, h: Hypothesis<G::Term>) -> Hypothesis<G::Term> {
    if (0..h.parameters.len()).all(|i| h.covariance[(i, i)] > 0.0) {
        return h;
    }
    match refit(gap, h.terms.clone(), h.parameters.clone(), h.surcharges.clone()) {
        Some(fitted) => Hypothesis { gains: h.gains, ..fitted },
        None => h,
    }
}

/// Fits the parameters of some effects on the data fitted and evaluates them on the data held out.
pub fn refit<G: Residuals>(
    gap: &G,
    terms: Vec<G::Term>,
    start: Vec<f64>,
    surcharges: Vec<f64>,
) -> Option<Hypothesis<G::Term>> {
    let moves = movable(gap, &all_specs(gap, &terms));
    refit_some(gap, terms, start, surcharges, &moves)
}

/// The same with the parameters that do not move left as they are.
pub(super) fn refit_some<G: Residuals>(
    gap: &G,
    terms: Vec<G::Term>,
    start: Vec<f64>,
    surcharges: Vec<f64>,
    moves: &[bool],
) -> Option<Hypothesis<G::Term>> {
    let specs = all_specs(gap, &terms);
    let first = gap.residuals(Set::Train, &terms, &start)?;
    let count = gap.count(Set::Train);
    let (parameters, covariance, train) = if moves.contains(&true) {
        let problem = Problem { gap, terms: &terms, specs: &specs, moves, n: first.len() };
        let bounds = specs
            .iter()
            .enumerate()
            .filter(|(_, spec)| spec.range.0.is_finite() || spec.range.1.is_finite());
        let options = fit::Options {
            noise: fit::Noise::Known,
            fixed: (0..moves.len()).filter(|i| !moves[*i]).collect(),
            max_iterations: 30,
            // A thousandth of a standard deviation is nothing; a misfit of 0.01 is nothing.
            step_tolerance: 1e-6,
            cost_tolerance: 5e-7,
            bounds: bounds
                .map(|(parameter, spec)| fit::Bound {
                    parameter,
                    lower: spec.range.0,
                    upper: spec.range.1,
                })
                .collect(),
            ..fit::Options::default()
        };
        let mut start = start;
        if terms.last().is_some_and(|term| gap.is_rough(term)) {
            let robust = fit::Options { loss: fit::Loss::Huber(ROUGH), ..options.clone() };
            start = fit::solve(&problem, &start, &robust).ok()?.x;
        }
        let fit = fit::solve(&problem, &start, &options).ok()?;
        let train = sum_of_squares(&fit.residuals);
        (fit.x, fit.covariance, train)
    } else {
        let train = sum_of_squares(&first);
        let n = start.len();
        (start, DMatrix::zeros(n, n), train)
    };
    let heldout = gap
        .residuals(Set::Heldout, &terms, &parameters)
        .map_or(f64::INFINITY, |residuals| sum_of_squares(&residuals));
    let gains = vec![0.0; terms.len()];
    let unseen = f64::NAN;
    Some(Hypothesis {
        terms,
        parameters,
        covariance,
        train,
        heldout,
        unseen,
        surcharges,
        gains,
        count,
    })
}
