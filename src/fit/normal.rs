//! The normal equations: `A = Jᵀ W J`, solved, inverted and taken apart.
//!
//! Columns are scaled to length 1 before anything is factored, so that metres and pixels compare. Small
//! matrices go through nalgebra, large ones (many views, many joints) through faer.

use faer::linalg::solvers::Solve;
use nalgebra::{DMatrix, DVector};

/// From this size on faer is the faster of the two (measured at 16 to 64 on two cores).
const LARGE: usize = 24;

/// `A = Jᵀ W J` over the free parameters, lower triangle, and `g = Jᵀ W r`.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) a: DMatrix<f64>,
    pub(super) g: DVector<f64>,
    /// Scratch: the columns in which a row is not 0.
    nonzero: Vec<usize>,
    /// Scratch: their values.
    values: Vec<f64>,
}

impl Normal {
    pub(super) fn zeros(n: usize) -> Self {
        Self {
            a: DMatrix::zeros(n, n),
            g: DVector::zeros(n),
            nonzero: Vec::with_capacity(n),
            values: Vec::with_capacity(n),
        }
    }

    pub(super) fn clear(&mut self) {
        self.a.fill(0.0);
        self.g.fill(0.0);
    }

    /// Adds one residual. Rows of calibration problems are mostly zeros (a view sees its own pose
    /// only), so the zeros are skipped.
    pub(super) fn add(&mut self, row: &[f64], free: &[usize], residual: f64, weight: f64) {
        if weight <= 0.0 {
            return;
        }
        self.nonzero.clear();
        self.values.clear();
        for (k, &column) in free.iter().enumerate() {
            let value = row[column];
            if value.abs() > 0.0 {
                self.nonzero.push(k);
                self.values.push(value);
            }
        }
        let n = self.a.nrows();
        let a = self.a.as_mut_slice();
        for (i, &k) in self.nonzero.iter().enumerate() {
            let scaled = weight * self.values[i];
            self.g[k] += scaled * residual;
            // Column-major: column k, rows k and below.
            let column = &mut a[k * n..(k + 1) * n];
            for (&l, value) in self.nonzero[i..].iter().zip(&self.values[i..]) {
                column[l] += scaled * value;
            }
        }
    }

    /// Returns the lengths of the columns of `√W J`; 1 for a column of zeros.
    pub(super) fn column_lengths(&self) -> DVector<f64> {
        self.a.diagonal().map(|d| if d > 0.0 { d.sqrt() } else { 1.0 })
    }
}

/// Returns the full symmetric matrix with rows and columns divided by `scale`.
pub(super) fn scaled(a: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| {
        let lower = if i >= j { a[(i, j)] } else { a[(j, i)] };
        lower / (scale[i] * scale[j])
    })
}

/// Solves `A x = b` for a symmetric positive definite `A`, or returns `None` when it is not.
pub(super) fn cholesky_solve(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let n = a.nrows();
    let x = if n < LARGE {
        a.clone().cholesky()?.solve(b)
    } else {
        let a = faer::Mat::from_fn(n, n, |i, j| a[(i, j)]);
        let b = faer::Mat::from_fn(n, 1, |i, _| b[i]);
        let x = a.llt(faer::Side::Lower).ok()?.solve(&b);
        DVector::from_fn(n, |i, _| x[(i, 0)])
    };
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix.
pub(super) fn eigen(a: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let n = a.nrows();
    if n >= LARGE {
        let copy = faer::Mat::from_fn(n, n, |i, j| a[(i, j)]);
        if let Ok(e) = copy.self_adjoint_eigen(faer::Side::Lower) {
            let values = e.S().column_vector();
            let vectors = e.U();
            return (
                DVector::from_fn(n, |i, _| values[i]),
                DMatrix::from_fn(n, n, |i, j| vectors[(i, j)]),
            );
        }
    }
    let e = nalgebra::SymmetricEigen::new(a.clone());
    (e.eigenvalues, e.eigenvectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spd(n: usize) -> DMatrix<f64> {
        let b = DMatrix::from_fn(n + 3, n, |i, j| ((i * 7 + j * 13) as f64 * 0.37).sin());
        b.transpose() * b + DMatrix::identity(n, n) * 0.1
    }

    #[test]
    fn both_libraries_solve_and_diagonalise() {
        for n in [3, LARGE - 1, LARGE, 60] {
            let a = spd(n);
            let x = DVector::from_fn(n, |i, _| (i as f64 * 0.3).cos());
            let solved = cholesky_solve(&a, &(&a * &x)).unwrap();
            assert!((solved - x).norm() < 1e-8, "n = {n}");
            let (values, vectors) = eigen(&a);
            let back = &vectors * DMatrix::from_diagonal(&values) * vectors.transpose();
            assert!((back - a).norm() < 1e-9, "n = {n}");
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut a = spd(4);
        a[(2, 2)] = -5.0;
        assert!(cholesky_solve(&a, &DVector::zeros(4)).is_none());
    }
}
