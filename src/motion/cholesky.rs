//! Small symmetric systems, solved in place: the steps of Newton's method in the inner loops, and what a push gives an arm.
//!
//! No root is taken: each would hold up all that follows.
//!
//! Source: Golub and Van Loan, *Matrix Computations*, 4th edition, §4.1.2.

#![expect(clippy::inline_always, reason = "unrolled only where the size is known")]

/// Solves `A x = b`, by `L D Lᵀ`, for a symmetric positive definite `A`, n × n by columns, of which the lower half is read.
///
/// `b` becomes `x`, and `A` its factors. Returns whether `A` was positive definite; if not, both are spoilt.
pub(crate) fn solve(a: &mut [f64], b: &mut [f64]) -> bool {
    match b.len() {
        // The sizes of most arms: loops of known length are unrolled.
        6 => factor_sized(6, a) && solve_sized(6, a, b),
        7 => factor_sized(7, a) && solve_sized(7, a, b),
        n => factor_sized(n, a) && solve_sized(n, a, b),
    }
}

/// Writes the factors of a symmetric positive definite matrix, n × n by columns, over its lower half, to be solved with
/// any number of times by [`solve_with`]. Returns whether it was positive definite; if not, it is spoilt.
pub(crate) fn factor(a: &mut [f64], n: usize) -> bool {
    match n {
        // Those of an arm and its two jaws.
        8 => factor_sized(8, a),
        9 => factor_sized(9, a),
        n => factor_sized(n, a),
    }
}

/// Solves with what [`factor`] left of a matrix; `b` becomes `x`.
pub(crate) fn solve_with(factors: &[f64], b: &mut [f64]) {
    match b.len() {
        8 => solve_sized(8, factors, b),
        9 => solve_sized(9, factors, b),
        n => solve_sized(n, factors, b),
    };
}

#[inline(always)]
fn factor_sized(n: usize, a: &mut [f64]) -> bool {
    let a = &mut a[..n * n];
    for j in 0..n {
        let pivot = a[j * n + j];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let scale = 1.0 / pivot;
        a[j * n + j] = scale;
        for k in j + 1..n {
            let factor = a[j * n + k] * scale;
            for i in k..n {
                a[k * n + i] -= factor * a[j * n + i];
            }
        }
    }
    true
}

/// The pivots' reciprocals stand for them, and columns are not divided by them. Always says that it did.
#[inline(always)]
fn solve_sized(n: usize, a: &[f64], b: &mut [f64]) -> bool {
    let (a, b) = (&a[..n * n], &mut b[..n]);
    for j in 0..n {
        let share = b[j] * a[j * n + j];
        for i in j + 1..n {
            b[i] -= a[j * n + i] * share;
        }
    }
    for j in (0..n).rev() {
        for i in j + 1..n {
            b[j] -= a[j * n + i] * b[i];
        }
        b[j] *= a[j * n + j];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_and_an_indefinite_one_is_refused() {
        // A = L L', x = (1, -2, 3).
        let a = [4.0, 2.0, -2.0, 2.0, 10.0, 5.0, -2.0, 5.0, 9.0];
        let mut b = [4.0 - 4.0 - 6.0, 2.0 - 20.0 + 15.0, -2.0 - 10.0 + 27.0];
        assert!(solve(&mut a.clone(), &mut b));
        for (found, expected) in b.iter().zip([1.0, -2.0, 3.0]) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        let (mut factors, mut again) =
            (a, [4.0 - 4.0 - 6.0, 2.0 - 20.0 + 15.0, -2.0 - 10.0 + 27.0]);
        assert!(factor(&mut factors, 3));
        solve_with(&factors, &mut again);
        assert_eq!(again.map(f64::to_bits), b.map(f64::to_bits), "in one go and in two");
        assert!(!solve(&mut [1.0, 2.0, 2.0, 1.0], &mut [1.0, 1.0]));
        assert!(!solve(&mut [0.0], &mut [1.0]));
    }
}
