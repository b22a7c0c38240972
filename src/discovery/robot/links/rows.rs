//! What each row that a torque sensor read says of the links' numbers, and sums over rows.

use nalgebra::DMatrix;

use super::super::simulate::Model;
use super::super::term::{Law, Term};
use crate::discovery::selection::{Block, Hypothesis};

/// Returns by how much each residual of the data fitted falls for one unit more of each number of each body, beside the effects of
/// a hypothesis: a sensor's gain shows in it, too.
pub(super) fn of_bodies(models: &[Model], blocks: &[Block], h: &Hypothesis<Term>) -> Vec<Vec<f64>> {
    let mut found = Vec::new();
    for columns in models.iter().map(Model::body_columns) {
        found.resize(columns.len(), Vec::new());
        found.iter_mut().zip(columns).for_each(|(all, one)| all.extend(one));
    }
    let Some(model) = models.first() else { return found };
    let channels = &model.course.data.channels;
    let mut from = model.own().len();
    for term in &h.terms {
        let gain = h.parameters[from];
        from += term.law.specs().len();
        let is_felt = |block: &Block| channels[block.sensor].index == term.joint;
        if term.law == Law::TorqueGain {
            for block in blocks.iter().filter(|block| is_felt(block)) {
                let scaled = found.iter_mut().flat_map(|column| &mut column[block.rows.clone()]);
                scaled.for_each(|value| *value *= gain);
            }
        }
    }
    found
}

/// Returns the products of all pairs of columns.
pub(super) fn products(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    let all = faer::MatRef::from_column_major_slice(a.as_slice(), rows, n);
    let products = all.transpose() * all;
    DMatrix::from_fn(n, n, |i, k| products[(i, k)])
}
