//! The links' numbers once more, beside the effects that were found.
//!
//! What was identified before any effect was looked for stood for a part of those. Beside them, as they were found and free to
//! become more or less, links and effects share what the recordings say.

use nalgebra::DMatrix;

use super::super::chain::Body;
use super::super::explain::ArmGap;
use super::super::term::Term;
use super::body::spread;
use super::columns::summed;
use super::consistent::consistent;
use super::fit::Problem;
use super::freed::{far, told};
use super::own::Links;
use super::rows::of_bodies;
use crate::discovery::selection::{Hypothesis, Residuals as _, Set, rises};

/// Returns the links that fit beside the effects of `h`, which were found in `gap`, where the arm has `links` in the place of the
/// `filed` bodies; `None` where that cannot be told.
pub(in super::super) fn settled(
    gap: &ArmGap,
    (filed, links): (&[Body], &Links),
    h: &Hypothesis<Term>,
) -> Option<Links> {
    let bodies = of_bodies(&gap.train, &gap.blocks(Set::Train), h);
    let shown = (0..h.parameters.len()).filter(|i| h.covariance[(*i, *i)] > 0.0);
    let rises = rises(gap, h)?;
    let falls: Vec<Vec<f64>> = shown.map(|i| rises[i].iter().map(|rise| -rise).collect()).collect();
    // What the file's numbers would leave, as far as it is linear in them.
    let mut here = gap.residuals(Set::Train, &h.terms, &h.parameters)?;
    for (column, change) in bodies.iter().zip(links.changes.as_flattened()) {
        here.iter_mut().zip(column).for_each(|(left, by)| *left += by * change);
    }
    let columns: Vec<&Vec<f64>> = bodies.iter().chain(&falls).collect();
    let mut prior: Vec<f64> = filed.iter().flat_map(spread).collect();
    prior.resize(columns.len(), f64::INFINITY);
    let train = summed(gap, Set::Train, &here, &columns)?;
    let is_up = vec![false; prior.len()];
    let problem = Problem { train, heldout: Vec::new(), prior, is_up };
    let n = problem.prior.len();
    let free = problem.fit(&DMatrix::identity(n, n))?;
    let changes = consistent(&problem, filed, &free)?;
    let told = told(filed, &changes, &free, &problem.prior);
    let far = far(filed, &told);
    let Links { has_load, is_better, .. } = *links;
    Some(Links { changes, told, far, has_load, is_better })
}
