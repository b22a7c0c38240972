//! A small linear program: the largest of a linear objective of a few unknowns under many bounds, from a point inside.
//!
//! Along the objective's slope until a bound is met, then along that bound, and so on; a bound that holds it back is let go.
//! What is returned keeps every bound, also where the steps run out before the optimum.
//!
//! Source: Nocedal and Wright, *Numerical Optimization*, 2006, §16.5, the active-set method, of a linear objective.

/// Steps at most; corners of the Gen3's paths take 8 to 20.
const STEPS: usize = 40;
/// Slopes and multipliers below this share are none.
const NONE: f64 = 1e-9;

/// Bounds `row · unknowns <= most`, kept column by column.
pub(super) struct Bounds<const N: usize> {
    columns: [Vec<f64>; N],
    most: Vec<f64>,
}

impl<const N: usize> Bounds<N> {
    pub(super) fn with_capacity(rows: usize) -> Self {
        let columns = std::array::from_fn(|_| Vec::with_capacity(rows));
        Self { columns, most: Vec::with_capacity(rows) }
    }

    pub(super) fn clear(&mut self) {
        self.columns.iter_mut().for_each(Vec::clear);
        self.most.clear();
    }

    pub(super) fn push(&mut self, row: &[f64; N], most: f64) {
        for (column, x) in self.columns.iter_mut().zip(row) {
            column.push(*x);
        }
        self.most.push(most);
    }

    /// Each row times a vector.
    fn times(&self, vector: &[f64; N], out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.most.len(), 0.0);
        for (column, x) in self.columns.iter().zip(vector) {
            for (out, row) in out.iter_mut().zip(column) {
                *out += x * row;
            }
        }
    }

    fn row(&self, at: usize) -> [f64; N] {
        std::array::from_fn(|k| self.columns[k][at])
    }

    /// Moves `x`, which keeps all bounds, to where `slope · x` is largest.
    pub(super) fn climb(&self, slope: &[f64; N], x: &mut [f64; N]) {
        let (mut left, mut along) = (Vec::new(), Vec::new());
        self.times(x, &mut left);
        for (left, most) in left.iter_mut().zip(&self.most) {
            *left = most - *left;
        }
        let mut held: Vec<usize> = Vec::with_capacity(N);
        for _ in 0..STEPS {
            let (way, multipliers) = self.way(slope, &held);
            if dot(&way, &way) <= NONE * NONE * dot(slope, slope) {
                // Nothing leads on along what is held; a bound that holds it back is let go.
                let least = multipliers.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
                match least {
                    Some((at, multiplier)) if *multiplier < -NONE => held.swap_remove(at),
                    _ => return,
                };
                continue;
            }
            self.times(&way, &mut along);
            let (mut far, mut met) = (f64::INFINITY, None);
            for (at, (left, along)) in left.iter().zip(&along).enumerate() {
                if *along * far > *left && *along > 0.0 && !held.contains(&at) {
                    (far, met) = (left.max(0.0) / along, Some(at));
                }
            }
            let Some(met) = met.filter(|_| held.len() < N) else { return };
            for (left, along) in left.iter_mut().zip(&along) {
                *left -= far * along;
            }
            for (x, way) in x.iter_mut().zip(&way) {
                *x += far * way;
            }
            held.push(met);
        }
    }

    /// Returns the part of a slope along all bounds that are held, and how much each of them holds it back.
    fn way(&self, slope: &[f64; N], held: &[usize]) -> ([f64; N], Vec<f64>) {
        let mut basis: Vec<[f64; N]> = Vec::with_capacity(N);
        // Rows as sums of the basis, triangular.
        let mut upper = vec![[0.0; N]; held.len()];
        let mut way = *slope;
        let mut shares = vec![0.0; held.len()];
        for (k, &at) in held.iter().enumerate() {
            let mut own = self.row(at);
            for (j, other) in basis.iter().enumerate() {
                upper[k][j] = dot(&own, other);
                own = minus(&own, upper[k][j], other);
            }
            let size = dot(&own, &own).sqrt();
            upper[k][k] = size;
            let own = if size > 0.0 { own.map(|x| x / size) } else { own };
            shares[k] = dot(&way, &own);
            way = minus(&way, shares[k], &own);
            basis.push(own);
        }
        for k in (0..held.len()).rev() {
            shares[k] = if upper[k][k] > 0.0 { shares[k] / upper[k][k] } else { 0.0 };
            for j in 0..k {
                shares[j] -= shares[k] * upper[k][j];
            }
        }
        (way, shares)
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus<const N: usize>(a: &[f64; N], share: f64, b: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|k| a[k] - share * b[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random programs of two unknowns, against every corner of what is allowed.
    #[test]
    fn the_optimum_is_the_best_corner() {
        use rand::rngs::StdRng;
        use rand::{RngExt, SeedableRng};
        let mut random = StdRng::seed_from_u64(1);
        for _ in 0..200 {
            let mut bounds = Bounds::<2>::with_capacity(12);
            for _ in 0..12 {
                let row = [random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
                bounds.push(&row, random.random_range(0.1..1.0));
            }
            for row in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
                bounds.push(&row, 5.0);
            }
            let slope = [random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
            let mut x = [0.0; 2];
            bounds.climb(&slope, &mut x);
            let n = bounds.most.len();
            let keeps =
                |x: &[f64; 2]| (0..n).all(|k| dot(&bounds.row(k), x) <= bounds.most[k] + 1e-9);
            assert!(keeps(&x));
            for a in 0..n {
                for b in 0..a {
                    let (p, q) = (bounds.row(a), bounds.row(b));
                    let det = p[0] * q[1] - p[1] * q[0];
                    let [f, g] = [bounds.most[a], bounds.most[b]];
                    let corner = [(f * q[1] - g * p[1]) / det, (g * p[0] - f * q[0]) / det];
                    assert!(!keeps(&corner) || dot(&slope, &corner) <= dot(&slope, &x) + 1e-6);
                }
            }
        }
    }
}
