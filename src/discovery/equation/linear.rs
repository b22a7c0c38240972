//! Linear regression with some columns taken out once and others tried one by one.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Added to the diagonal of the scaled normal equations: far below what data determine.
const RIDGE: f64 = 1e-10;

/// A residual with the part that the known columns explain taken out.
pub(super) struct Regression {
    /// Orthogonal to the known columns.
    residual: Vec<f64>,
    known: Vec<Vec<f64>>,
    factor: Option<Cholesky<f64, Dyn>>,
}

/// The sum of products.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Regression {
    /// Takes the known columns out; `None` when they determine nothing at all.
    pub(super) fn new(known: &[&[f64]], residual: &[f64]) -> Option<Self> {
        let scaled: Vec<Vec<f64>> = known
            .iter()
            .filter_map(|column| {
                let size = dot(column, column).sqrt();
                (size > 0.0 && size.is_finite()).then(|| column.iter().map(|v| v / size).collect())
            })
            .collect();
        let n = scaled.len();
        let factor = if n == 0 {
            None
        } else {
            let mut normal = DMatrix::from_fn(n, n, |i, j| dot(&scaled[i], &scaled[j]));
            for i in 0..n {
                normal[(i, i)] += RIDGE;
            }
            Some(normal.cholesky()?)
        };
        let mut regression = Self { residual: Vec::new(), known: scaled, factor };
        regression.residual = regression.beyond(residual);
        Some(regression)
    }

    /// What of a column the known ones cannot make.
    pub(super) fn beyond(&self, column: &[f64]) -> Vec<f64> {
        let mut rest = column.to_vec();
        let Some(factor) = &self.factor else { return rest };
        // Twice, for the digits that the first pass loses.
        for _ in 0..2 {
            let g =
                DVector::from_iterator(self.known.len(), self.known.iter().map(|k| dot(k, &rest)));
            let by = factor.solve(&g);
            for (known, by) in self.known.iter().zip(by.iter()) {
                rest.iter_mut().zip(known).for_each(|(r, k)| *r -= by * k);
            }
        }
        rest
    }

    /// The sum of squares that is left when a column joins.
    pub(super) fn left_with(&self, column: &[f64]) -> f64 {
        let total = dot(&self.residual, &self.residual);
        let own = self.beyond(column);
        let size = dot(&own, &own);
        // A column that the known ones make up says nothing.
        if size <= 1e-12 * dot(column, column) || !size.is_finite() {
            return total;
        }
        total - dot(&own, &self.residual).powi(2) / size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_explained_is_taken_out_and_what_joins_explains_the_rest() {
        let one = [1.0, 1.0, 1.0, 1.0];
        let line = [0.0, 1.0, 2.0, 3.0];
        let bend = [0.0, 1.0, 4.0, 9.0];
        let y: Vec<f64> = (0..4).map(|i| 2.0 - line[i] + 0.5 * bend[i]).collect();
        let regression = Regression::new(&[&one, &line], &y).unwrap();
        // The square beyond a straight line through four points: 1, -1, -1, 1.
        assert!(regression.beyond(&bend).iter().all(|v| (v.abs() - 1.0).abs() < 1e-8));
        assert!(regression.left_with(&bend) < 1e-12);
        assert!((regression.left_with(&line) - 1.0).abs() < 1e-8, "says nothing new");
    }
}
