//! A small linear program: the largest of a linear objective of a few unknowns under many bounds, from a point inside.
//!
//! Along the objective's slope until a bound is met, then along that bound, and so on; a bound that holds it back is let go.
//! What is returned keeps every bound, also where the steps run out before the optimum.
//!
//! Source: Nocedal and Wright, *Numerical Optimization*, 2006, §16.5, the active-set method, of a linear objective.

#![expect(clippy::inline_always, reason = "what is not inlined into the job misses the registers")]

use super::lanes::Wide;
use super::quad::Quad;
use super::slopes::Four;

/// Steps at most; corners of the Gen3's paths take 8 to 20.
const STEPS: usize = 40;
/// Slopes and multipliers below this share are none.
const NONE: f64 = 1e-9;

/// Bounds `row · unknowns <= most`, kept four by four: each unknown's share of four rows.
pub(super) struct Bounds<const N: usize> {
    rows: Vec<[Four; N]>,
    most: Vec<Four>,
    /// What is left of each, and how it changes along a way; kept as memory to work in.
    left: Vec<Four>,
    along: Vec<Four>,
}

impl<const N: usize> Bounds<N> {
    pub(super) fn with_capacity(fours: usize) -> Self {
        let four = || Vec::with_capacity(fours);
        Self { rows: Vec::with_capacity(fours), most: four(), left: four(), along: four() }
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.most.clear();
    }

    /// Adds four bounds. A row of noughts bounds nothing where `most` is no less than nought.
    #[inline(always)]
    pub(super) fn push<S: Wide>(&mut self, rows: &[Quad<S>; N], most: Quad<S>) {
        let mut lanes = [[0.0; 4]; N];
        for (lanes, row) in lanes.iter_mut().zip(rows) {
            *lanes = row.lanes();
        }
        self.rows.push(lanes);
        self.most.push(most.lanes());
    }

    /// Adds bounds one by one.
    pub(super) fn push_each(&mut self, each: &[([f64; N], f64)]) {
        for four in each.chunks(4) {
            let (mut rows, mut most) = ([[0.0; 4]; N], [0.0; 4]);
            for (lane, (row, limit)) in four.iter().enumerate() {
                rows.iter_mut().zip(row).for_each(|(rows, x)| rows[lane] = *x);
                most[lane] = *limit;
            }
            self.rows.push(rows);
            self.most.push(most);
        }
    }

    fn row(&self, at: usize) -> [f64; N] {
        self.rows[at / 4].map(|four| four[at % 4])
    }

    /// Moves `x`, which keeps all bounds, to where `slope · x` is largest.
    #[inline(always)]
    pub(super) fn climb<S: Wide>(&mut self, simd: S, slope: &[f64; N], x: &mut [f64; N]) {
        self.left.clear();
        for (rows, most) in self.rows.iter().zip(&self.most) {
            self.left.push((Quad::of(simd, *most) - times(simd, rows, x)).lanes());
        }
        let mut held = Held::along(slope);
        for _ in 0..STEPS {
            if dot(&held.way, &held.way) <= NONE * NONE * dot(slope, slope) {
                // Nothing leads on along what is held; a bound that holds it back is let go.
                match held.least() {
                    Some((at, multiplier)) if multiplier < -NONE => held.let_go(slope, at),
                    _ => return,
                }
                continue;
            }
            let way = held.way;
            let (mut far, mut met) = (f64::INFINITY, None);
            self.along.clear();
            for (k, (rows, left)) in self.rows.iter().zip(&self.left).enumerate() {
                let along = times(simd, rows, &way);
                self.along.push(along.lanes());
                if Quad::of(simd, *left).below(along * Quad::all(simd, far)).is_nowhere() {
                    continue;
                }
                for (lane, (left, along)) in left.iter().zip(along.lanes()).enumerate() {
                    let at = 4 * k + lane;
                    if along * far > *left && along > 0.0 && !held.holds(at) {
                        (far, met) = (left.max(0.0) / along, Some(at));
                    }
                }
            }
            let Some(met) = met.filter(|_| held.n < N) else { return };
            let share = Quad::all(simd, far);
            for (left, along) in self.left.iter_mut().zip(&self.along) {
                *left = (Quad::of(simd, *left) - share * Quad::of(simd, *along)).lanes();
            }
            for (x, way) in x.iter_mut().zip(&way) {
                *x += far * way;
            }
            held.hold(met, self.row(met));
        }
    }
}

/// Four rows times a vector.
#[inline(always)]
fn times<S: Wide, const N: usize>(simd: S, rows: &[Four; N], vector: &[f64; N]) -> Quad<S> {
    let mut sum = Quad::all(simd, 0.0);
    for (four, x) in rows.iter().zip(vector) {
        sum = sum + Quad::all(simd, *x) * Quad::of(simd, *four);
    }
    sum
}

/// The bounds that are held, and what of a slope lies along all of them.
///
/// Their rows are kept as sums of a basis of unit vectors at right angles, by Gram and Schmidt: a triangle of shares.
struct Held<const N: usize> {
    n: usize,
    at: [usize; N],
    rows: [[f64; N]; N],
    basis: [[f64; N]; N],
    triangle: [[f64; N]; N],
    /// The slope's share of each of the basis.
    shares: [f64; N],
    way: [f64; N],
}

impl<const N: usize> Held<N> {
    /// Holds nothing yet.
    fn along(slope: &[f64; N]) -> Self {
        let none = [[0.0; N]; N];
        let (rows, basis, triangle) = (none, none, none);
        Self { n: 0, at: [0; N], rows, basis, triangle, shares: [0.0; N], way: *slope }
    }

    fn holds(&self, at: usize) -> bool {
        self.at[..self.n].contains(&at)
    }

    /// Holds one more bound; there are fewer than `N`.
    fn hold(&mut self, at: usize, row: [f64; N]) {
        let n = self.n;
        let mut own = row;
        for j in 0..n {
            self.triangle[n][j] = dot(&own, &self.basis[j]);
            own = minus(&own, self.triangle[n][j], &self.basis[j]);
        }
        let size = dot(&own, &own).sqrt();
        self.triangle[n][n] = size;
        if size > 0.0 {
            own = own.map(|x| x / size);
        }
        self.shares[n] = dot(&self.way, &own);
        self.way = minus(&self.way, self.shares[n], &own);
        (self.at[n], self.rows[n], self.basis[n], self.n) = (at, row, own, n + 1);
    }

    /// Lets one bound go; the last takes its place.
    fn let_go(&mut self, slope: &[f64; N], which: usize) {
        let (n, at, rows) = (self.n - 1, self.at, self.rows);
        (self.n, self.way) = (0, *slope);
        for k in 0..n {
            let from = if k == which { n } else { k };
            self.hold(at[from], rows[from]);
        }
    }

    /// Returns which bound holds the slope back least, and how much.
    fn least(&self) -> Option<(usize, f64)> {
        let mut shares = self.shares;
        for k in (0..self.n).rev() {
            let size = self.triangle[k][k];
            shares[k] = if size > 0.0 { shares[k] / size } else { 0.0 };
            for j in 0..k {
                shares[j] -= shares[k] * self.triangle[k][j];
            }
        }
        shares[..self.n].iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
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
    use super::super::lanes::{Job, run};
    use super::*;

    struct Climb<'b>(&'b mut Bounds<2>, [f64; 2]);

    impl Job for Climb<'_> {
        type Found = [f64; 2];

        #[inline(always)]
        fn with<S: Wide>(self, simd: S) -> [f64; 2] {
            let mut x = [0.0; 2];
            self.0.climb(simd, &self.1, &mut x);
            x
        }
    }

    /// Random programs of two unknowns, against every corner of what is allowed.
    #[test]
    fn the_optimum_is_the_best_corner() {
        use rand::rngs::StdRng;
        use rand::{RngExt, SeedableRng};
        let mut random = StdRng::seed_from_u64(1);
        for _ in 0..200 {
            let mut each = vec![];
            for _ in 0..11 {
                let row = [random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
                each.push((row, random.random_range(0.1..1.0)));
            }
            each.extend([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|row| (row, 5.0)));
            let mut bounds = Bounds::<2>::with_capacity(4);
            bounds.push_each(&each);
            let slope = [random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
            let x = run(Climb(&mut bounds, slope));
            let n = each.len();
            let keeps = |x: &[f64; 2]| each.iter().all(|(row, most)| dot(row, x) <= most + 1e-9);
            assert!(keeps(&x));
            for a in 0..n {
                for b in 0..a {
                    let ((p, f), (q, g)) = (each[a], each[b]);
                    let det = p[0] * q[1] - p[1] * q[0];
                    let corner = [(f * q[1] - g * p[1]) / det, (g * p[0] - f * q[0]) / det];
                    assert!(!keeps(&corner) || dot(&slope, &corner) <= dot(&slope, &x) + 1e-6);
                }
            }
        }
    }
}
