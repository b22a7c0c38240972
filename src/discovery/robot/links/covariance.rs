//! How uncertain effects are beside links whose numbers are known as well as the recordings tell them, and not better.
//!
//! A search takes the links that were identified before it for granted; what of an effect other links could do as well is uncertain
//! all the same.

use nalgebra::DMatrix;

use super::super::simulate::Model;
use super::super::term::Term;
use super::body::spread;
use super::rows::{of_bodies, products};
use crate::discovery::selection::{Block, Hypothesis};

/// Returns the covariance of the parameters of a hypothesis beside links that are free about theirs, as far as files usually are
/// off; `None` where they cannot be told apart. What the motion does not show stays without a variance. The residuals of `models`, which
/// the sensors read in `blocks`, rise with the parameters as `rises` says.
pub(in super::super) fn covariance(
    models: &[Model],
    blocks: &[Block],
    h: &Hypothesis<Term>,
    rises: &[Vec<f64>],
) -> Option<DMatrix<f64>> {
    let shown: Vec<usize> =
        (0..h.parameters.len()).filter(|i| h.covariance[(*i, *i)] > 0.0).collect();
    let bodies = &models.first()?.arm.chain.bodies;
    let prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
    let links = of_bodies(models, blocks, h);
    let open: Vec<usize> = (0..prior.len()).filter(|i| prior[*i] > 0.0).collect();
    let rows = rises.first()?.len();
    let columns = open.len() + shown.len();
    // A link's number counts in units of what files are off by.
    let a = DMatrix::from_fn(rows, columns, |row, k| match open.get(k) {
        Some(&i) => -links[i][row] * prior[i],
        None => rises[shown[k - open.len()]][row],
    });
    let mut form = products(&a);
    (0..open.len()).for_each(|k| form[(k, k)] += 1.0);
    // Parameters have scales of their own.
    let scale: Vec<f64> = form.diagonal().iter().map(|d| d.max(1e-300).sqrt().recip()).collect();
    let scaled = DMatrix::from_fn(columns, columns, |i, k| form[(i, k)] * scale[i] * scale[k]);
    let inverse = scaled.cholesky()?.inverse();
    let mut covariance = DMatrix::zeros(h.parameters.len(), h.parameters.len());
    for (a, &i) in shown.iter().enumerate() {
        for (b, &k) in shown.iter().enumerate() {
            let (a, b) = (open.len() + a, open.len() + b);
            covariance[(i, k)] = inverse[(a, b)] * scale[a] * scale[b];
        }
    }
    Some(covariance)
}
