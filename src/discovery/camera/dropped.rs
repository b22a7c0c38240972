//! The doubt of a lens of which `k1` alone is told: a `k2` that the points do not pay for is small, not nothing, and moves the
//! other numbers.
//!
//! All is fitted again with `k2`. Its covariance and how far the numbers are from those told go into their doubt, weighed by
//! Akaike's criterion, which asks how well a model predicts rather than whether it is true; likewise in
//! [`crate::alignment::intrinsics::lens`].
//!
//! Source: Burnham and Anderson, *Model Selection and Multimodel Inference*, 2002, §4.3.

use nalgebra::DMatrix;

use super::explain::CameraGap;
use super::term::Law;
use crate::discovery::selection::{self, Hypothesis};

/// Standard deviation of `k2` before the points are looked at. Chosen: published lenses have 0.1 and 0.2 (`OpenCV`'s
/// chessboards, Zhang's camera).
const K2: f64 = 0.2;

/// Returns the hypothesis with the doubt of a `k2` that was left out; as it is where none was.
pub(super) fn doubted(gap: &CameraGap, fitted: Hypothesis<Law>) -> Hypothesis<Law> {
    let Some(at) = fitted.terms.iter().position(|law| *law == Law::Radial(false)) else {
        return fitted;
    };
    // `k2` stands behind the numbers of the laws up to this one.
    let k2: usize = fitted.terms[..=at].iter().map(|law| law.specs(gap.data.extent).len()).sum();
    let (mut terms, mut start) = (fitted.terms.clone(), fitted.parameters.clone());
    terms[at] = Law::Radial(true);
    start.insert(k2, 0.0);
    let beside = selection::refit(gap, terms, start, fitted.surcharges.clone())
        .filter(|beside| selection::is_sensible(gap, beside));
    let Some(beside) = beside else { return fitted };
    // What is known of `k2` beforehand: one measurement of it more.
    let its_own = beside.covariance.column(k2).into_owned();
    let drawn = &its_own / (its_own[k2] + K2 * K2);
    let covariance = &beside.covariance - &drawn * its_own.transpose();
    let ahead = 0.5 * (fitted.train - beside.train) - 1.0;
    let weight = 1.0 / (1.0 + (-ahead).exp());
    let there = |i: usize| if i < k2 { i } else { i + 1 };
    let off = |i: usize| {
        let there = there(i);
        beside.parameters[there] - drawn[there] * beside.parameters[k2] - fitted.parameters[i]
    };
    let n = fitted.parameters.len();
    let covariance = DMatrix::from_fn(n, n, |row, column| {
        let other = covariance[(there(row), there(column))] + off(row) * off(column);
        (1.0 - weight) * fitted.covariance[(row, column)] + weight * other
    });
    Hypothesis { covariance, ..fitted }
}
