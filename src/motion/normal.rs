//! The normal equations of a step towards a pose: `JᵀJ` and `Jᵀ e` of a Jacobian of six numbers a joint.
//!
//! Source: Nocedal and Wright, *Numerical Optimization*, 2006, §10.2.

#![expect(clippy::inline_always, reason = "unrolled only where the size is known")]

use super::widest::widest;

/// Writes the lower half of `JᵀJ` into `normal`, n × n by columns, and `Jᵀ e` into `step`.
pub(super) fn equations(jacobian: &[f64], error: &[f64], normal: &mut [f64], step: &mut [f64]) {
    widest(
        #[inline(always)]
        || match step.len() {
            // The sizes of most arms.
            6 => sized(6, jacobian, error, normal, step),
            7 => sized(7, jacobian, error, normal, step),
            n => sized(n, jacobian, error, normal, step),
        },
    );
}

#[inline(always)]
fn sized(n: usize, jacobian: &[f64], error: &[f64], normal: &mut [f64], step: &mut [f64]) {
    let (jacobian, error) = (&jacobian[..6 * n], &error[..6]);
    let (normal, step) = (&mut normal[..n * n], &mut step[..n]);
    for i in 0..n {
        let column = &jacobian[6 * i..6 * i + 6];
        step[i] = dot(column, error);
        for j in 0..=i {
            normal[j * n + i] = dot(column, &jacobian[6 * j..6 * j + 6]);
        }
    }
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}
