//! Pairs in normalised coordinates, and the weighted least-squares fit of one form to some of them.
//!
//! Both point sets are moved to their centre and scaled to spread 1, so that the corner of the matrix is
//! never 0 there: the centre of points on one side of the horizon is on that side too. The scale form
//! keeps its origin, since it has no offset.

use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2};

use super::columns::{Columns, Normal, Scale, Sums};
use super::normalise::{Frame, project, with_unit_corner};
use super::{Error, Model, NoiseIn, Pair, projective};
use crate::alignment::consensus::{Regression, mix};
use crate::fit::{self, Jacobian, Noise, Problem};

/// All pairs, normalised.
pub(super) struct Pairs<'a> {
    given: &'a [Pair],
    pub(super) model: Model,
    noise: NoiseIn,
    real: Frame,
    twin: Frame,
    /// `(u, v)` in normalised coordinates.
    points: Vec<(Vector2<f64>, Vector2<f64>)>,
    area: f64,
}

/// A fitted form with what it needs to be described.
pub(super) struct Map {
    pub(super) model: Model,
    normalised: Matrix3<f64>,
    real: Frame,
    twin: Frame,
    covariance: DMatrix<f64>,
    pub(super) noise_px: f64,
    pub(super) conditioning: f64,
    pub(super) leave_one_out_px: Option<f64>,
    pub(super) worst: Option<(usize, f64)>,
    /// Sum of squared whitened errors, px².
    pub(super) sum: f64,
    /// Area that outliers may lie in, px².
    pub(super) area: f64,
}

/// The entries of the normalised matrix that a form leaves free, counted row by row.
fn indices(model: Model) -> &'static [usize] {
    match model {
        Model::Scale => &[0, 4],
        Model::Affine => &[0, 1, 2, 3, 4, 5],
        _ => &[0, 1, 2, 3, 4, 5, 6, 7],
    }
}

fn unpack(model: Model, x: &[f64]) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    m[(2, 2)] = 1.0;
    for (&k, v) in indices(model).iter().zip(x) {
        m[(k / 3, k % 3)] = *v;
    }
    m
}

fn pack(model: Model, m: &Matrix3<f64>) -> Vec<f64> {
    indices(model).iter().map(|&k| m[(k / 3, k % 3)] / m[(2, 2)]).collect()
}

impl<'a> Pairs<'a> {
    pub(super) fn new(pairs: &'a [Pair], model: Model, noise: NoiseIn) -> Self {
        let keep = model == Model::Scale;
        let real = Frame::of(pairs.iter().map(|p| p.real), keep);
        let twin = Frame::of(pairs.iter().map(|p| p.twin), keep);
        let points =
            pairs.iter().map(|p| (real.normalise(p.real), twin.normalise(p.twin))).collect();
        let (mut low, mut high) =
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for p in pairs {
            let u = Vector2::new(p.real.u, p.real.v);
            low = low.inf(&u);
            high = high.sup(&u);
        }
        let side = high - low;
        // A line of points still has room for outliers beside it.
        let area = side.x.max(0.1 * side.y).max(1.0) * side.y.max(0.1 * side.x).max(1.0);
        Self { given: pairs, model, noise, real, twin, points, area }
    }

    /// The inverse Cholesky factor of the error's covariance (in units of the noise), for errors in px.
    fn whitener(&self, derivative: &Matrix2<f64>) -> Matrix2<f64> {
        match self.noise {
            NoiseIn::Real => Matrix2::identity(),
            NoiseIn::Both => {
                let j = derivative * (self.real.size / self.twin.size);
                let s = Matrix2::identity() + j * j.transpose();
                // Lower Cholesky factor [[a, 0], [b, c]] of S, inverted.
                let a = s[(0, 0)].sqrt();
                let b = s[(1, 0)] / a;
                let c = (s[(1, 1)] - b * b).max(1e-300).sqrt();
                Matrix2::new(1.0 / a, 0.0, -b / (a * c), 1.0 / c)
            }
        }
    }

    /// Rows and whiteners for a fit around `m`.
    fn linearised(&self, m: &Matrix3<f64>, rows: &[usize]) -> Option<Part<'_>> {
        let mut part = Part { pairs: self, rows: Vec::with_capacity(rows.len()) };
        for &row in rows {
            let (_, derivative, _) = project(m, self.points[row].1)?;
            let whitener = self.whitener(&derivative) * self.real.size;
            part.rows.push((row, whitener));
        }
        Some(part)
    }

    /// What errors are measured in.
    fn scale(&self) -> Scale {
        let twin = match self.noise {
            NoiseIn::Real => 0.0,
            NoiseIn::Both => self.real.size / self.twin.size,
        };
        Scale { real: self.real.size, twin }
    }

    /// One Gauss–Newton step from what the rows say.
    fn gauss_newton(&self, m: &Matrix3<f64>, sums: &Sums) -> Option<Matrix3<f64>> {
        let free = indices(self.model);
        let is_free = |k: usize| free.contains(&k);
        let mut normal = sums.normal;
        let mut gradient = sums.gradient;
        for k in (0..8).filter(|&k| !is_free(k)) {
            normal.row_mut(k).fill(0.0);
            normal.column_mut(k).fill(0.0);
            normal[(k, k)] = 1.0;
            gradient[k] = 0.0;
        }
        let step = normal.cholesky()?.solve(&gradient);
        let mut next = *m;
        for &k in free {
            next[(k / 3, k % 3)] -= step[k];
        }
        next.iter().all(|x| x.is_finite()).then_some(next)
    }

    /// Gauss–Newton to rest, or `None` where it does not come to rest on its own.
    fn at_rest(
        &self,
        start: &Matrix3<f64>,
        columns: &Columns,
        ones: &[f64],
    ) -> Option<Matrix3<f64>> {
        let mut m = *start;
        for _ in 0..8 {
            let sums = columns.sums(&m, self.scale(), ones)?;
            let next = self.gauss_newton(&m, &sums)?;
            let moved = (next - m).amax();
            m = next;
            // 1e-10 of the spread is 1e-7 px in any picture.
            if moved < 1e-10 {
                return Some(m);
            }
        }
        None
    }

    /// Levenberg–Marquardt with the whiteners renewed, for starts that Gauss–Newton cannot use.
    fn damped(&self, start: Matrix3<f64>, rows: &[usize]) -> Result<Matrix3<f64>, Error> {
        let options = fit::Options { noise: Noise::Known, ..fit::Options::default() };
        let mut m = start;
        for _ in 0..4 {
            let degenerate = Error::Degenerate { model: self.model.name(), free: 1 };
            let part = self.linearised(&m, rows).ok_or(degenerate)?;
            let result = fit::solve(&part, &pack(self.model, &m), &options)?;
            let next = unpack(self.model, &result.x);
            let moved = (next - m).amax();
            m = next;
            if moved < 1e-10 {
                break;
            }
        }
        Ok(m)
    }

    fn start(&self, rows: &[usize]) -> Result<Matrix3<f64>, Error> {
        projective::linear(self.model, rows.iter().map(|&i| self.points[i])).map_err(|unfit| {
            match unfit {
                // Four in general position determine the one map that there is; of more, noise may be what has no front.
                projective::Unfit::Behind if self.points.len() == 4 => Error::Crossed { given: 4 },
                _ => Error::Degenerate { model: self.model.name(), free: 1 },
            }
        })
    }

    /// Fits without rejecting anything.
    pub(super) fn fit(&self, rows: &[usize]) -> Result<Map, Error> {
        // A start needs no more than a few thousand rows.
        let some: Vec<usize> = rows.iter().copied().step_by(1 + rows.len() / 2000).collect();
        self.polish(self.start(&some)?, rows)
    }

    /// Fits to the end, starting at a normalised matrix, and works out the uncertainty.
    pub(super) fn polish(&self, start: Matrix3<f64>, rows: &[usize]) -> Result<Map, Error> {
        let degenerate = |free| Error::Degenerate { model: self.model.name(), free };
        let columns = self.rows(rows);
        let ones = vec![1.0; rows.len()];
        let m = match self.at_rest(&start, &columns, &ones) {
            Some(m) => m,
            None => self.damped(start, rows)?,
        };
        let sums = columns.sums(&m, self.scale(), &ones).ok_or_else(|| degenerate(1))?;
        let free = indices(self.model);
        let k = free.len();
        let normal = DMatrix::from_fn(k, k, |i, j| sums.normal[(free[i], free[j])]);
        // Columns scaled to length 1, as `fit` does it.
        let length = normal.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(k, k, |i, j| normal[(i, j)] / (length[i] * length[j]));
        let values = scaled.symmetric_eigenvalues();
        let conditioning = (values.min().max(0.0) / values.max()).sqrt();
        // A direction seen a hundred thousand times less sharply than the sharpest is free.
        let n_free =
            values.iter().filter(|v| v.max(0.0).sqrt() < 1e-5 * values.max().sqrt()).count();
        if n_free > 0 {
            return Err(degenerate(n_free));
        }
        let unit = normal.try_inverse().ok_or_else(|| degenerate(1))?;
        let told = (2 * rows.len()).saturating_sub(k);
        let noise2 = if told > 0 { sums.square / told as f64 } else { 0.0 };
        let (leave_one_out_px, worst) =
            if told > 0 { self.leave_one_out(&m, &unit, rows, &columns) } else { (None, None) };
        Ok(Map {
            model: self.model,
            normalised: m,
            real: self.real,
            twin: self.twin,
            covariance: unit * noise2,
            noise_px: noise2.sqrt(),
            conditioning,
            leave_one_out_px,
            worst,
            sum: sums.square,
            area: self.area,
        })
    }

    /// Root mean square of the errors of rows as predicted from all others, and the largest, px; `unit` is the covariance at
    /// a noise of 1 px. A row that alone holds a direction cannot be predicted from the others.
    fn leave_one_out(
        &self,
        m: &Matrix3<f64>,
        unit: &DMatrix<f64>,
        rows: &[usize],
        columns: &Columns,
    ) -> (Option<f64>, Option<(usize, f64)>) {
        let mut c = Normal::zeros();
        for (i, &row) in indices(self.model).iter().enumerate() {
            for (j, &column) in indices(self.model).iter().enumerate() {
                c[(row, column)] = unit[(i, j)];
            }
        }
        let (mut sum, mut worst) = (0.0, None::<(usize, f64)>);
        for (&row, e2) in rows.iter().zip(columns.left_out(m, self.scale(), &c)) {
            sum += e2;
            if worst.is_none_or(|(_, largest)| e2 > largest) {
                worst = Some((row, e2));
            }
        }
        if !sum.is_finite() {
            return (None, None);
        }
        let root = (sum / rows.len() as f64).sqrt();
        (Some(root), worst.map(|(row, e2)| (row, e2.sqrt())))
    }
}

impl Regression for Pairs<'_> {
    type Model = Matrix3<f64>;
    type Rows = Columns;

    fn len(&self) -> usize {
        self.points.len()
    }
    fn minimal(&self) -> usize {
        self.model.minimal()
    }
    fn dimension(&self) -> usize {
        2
    }
    fn volume(&self) -> f64 {
        self.area
    }
    fn floor(&self) -> f64 {
        FLOOR_PX
    }
    fn key(&self, row: usize) -> u64 {
        let p = self.given[row];
        // Odd factors keep all bits; one scramble at the end spreads them.
        let [a, b, c, d] = [p.real.u, p.real.v, p.twin.u, p.twin.v].map(f64::to_bits);
        let half = |x: u64, y: u64| {
            x.wrapping_mul(FACTORS[0]) ^ y.rotate_left(32).wrapping_mul(FACTORS[1])
        };
        mix(half(a, b).wrapping_mul(FACTORS[2]) ^ half(c, d))
    }
    fn rows(&self, rows: &[usize]) -> Columns {
        Columns::of(rows.iter().map(|&i| self.points[i]))
    }
    fn through(&self, rows: &[usize]) -> Option<Matrix3<f64>> {
        match self.model {
            Model::Projective => projective::through_four(&[
                self.points[rows[0]],
                self.points[rows[1]],
                self.points[rows[2]],
                self.points[rows[3]],
            ]),
            _ => self.start(rows).ok(),
        }
    }
    fn errors2(&self, m: &Matrix3<f64>, rows: &Columns, out: &mut Vec<f64>) {
        rows.errors2(m, self.scale(), out);
    }
    fn refit(&self, m: &Matrix3<f64>, rows: &Columns, weights: &[f64]) -> Option<Matrix3<f64>> {
        // Expectation–maximisation repeats anyway; one step each is enough.
        self.gauss_newton(m, &rows.sums(m, self.scale(), weights)?)
    }
}

/// Odd numbers without pattern: the factors of splitmix64 and of Weyl's sequence in it (Steele, Lea and Flood 2014).
const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb];

/// No picture is measured better than this; data without noise would make the likelihood infinite.
pub(super) const FLOOR_PX: f64 = 1e-3;

/// The whitened derivatives of one pair's error by the free entries of the normalised matrix.
fn row_jacobian(
    model: Model,
    m: &Matrix3<f64>,
    v: Vector2<f64>,
    whitener: &Matrix2<f64>,
) -> Option<([f64; 8], [f64; 8])> {
    let (p, _, w) = project(m, v)?;
    let (x, y, one) = (v.x / w, v.y / w, 1.0 / w);
    let full = [
        [x, y, one, 0.0, 0.0, 0.0, -p.x * x, -p.x * y],
        [0.0, 0.0, 0.0, x, y, one, -p.y * x, -p.y * y],
    ];
    let (mut a, mut b) = ([0.0; 8], [0.0; 8]);
    for (k, &c) in indices(model).iter().enumerate() {
        a[k] = whitener[(0, 0)] * full[0][c] + whitener[(0, 1)] * full[1][c];
        b[k] = whitener[(1, 0)] * full[0][c] + whitener[(1, 1)] * full[1][c];
    }
    Some((a, b))
}

/// The rows of one fit with their whiteners frozen.
struct Part<'a> {
    pairs: &'a Pairs<'a>,
    rows: Vec<(usize, Matrix2<f64>)>,
}

impl Problem for Part<'_> {
    fn n_residuals(&self) -> usize {
        2 * self.rows.len()
    }
    fn block(&self) -> usize {
        2
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let m = unpack(self.pairs.model, x);
        for ((row, whitener), r) in self.rows.iter().zip(r.chunks_exact_mut(2)) {
            let (u, v) = self.pairs.points[*row];
            let e =
                project(&m, v).map_or(Vector2::repeat(f64::INFINITY), |(p, ..)| whitener * (p - u));
            r[0] = e.x;
            r[1] = e.y;
        }
    }
    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        let model = self.pairs.model;
        let m = unpack(model, x);
        let k = model.dof();
        for (at, (row, whitener)) in self.rows.iter().enumerate() {
            let v = self.pairs.points[*row].1;
            if let Some((a, b)) = row_jacobian(model, &m, v, whitener) {
                j.row_mut(2 * at).copy_from_slice(&a[..k]);
                j.row_mut(2 * at + 1).copy_from_slice(&b[..k]);
            }
        }
        true
    }
}

impl Map {
    /// `M` in pixels with a 1 in its corner, and the covariance of its free entries.
    pub(super) fn in_pixels(&self) -> Result<(Matrix3<f64>, DMatrix<f64>), Error> {
        let (left, right) = (self.real.matrix(), self.twin.inverse());
        let raw = left * self.normalised * right;
        let m = with_unit_corner(raw)?;
        if m.determinant().abs() <= 1e-14 * m.amax().powi(2) {
            return Err(Error::Singular);
        }
        let at = indices(self.model);
        let corner = raw[(2, 2)];
        let mut j = DMatrix::zeros(at.len(), at.len());
        for (column, &pq) in at.iter().enumerate() {
            // d raw / d x_pq = left[:, p] · right[q, :], then the quotient rule for the corner.
            let d = left.column(pq / 3) * right.row(pq % 3);
            for (row, &ab) in at.iter().enumerate() {
                let (a, b) = (ab / 3, ab % 3);
                j[(row, column)] = (d[(a, b)] - m[(a, b)] * d[(2, 2)]) / corner;
            }
        }
        Ok((m, &j * &self.covariance * j.transpose()))
    }
}
