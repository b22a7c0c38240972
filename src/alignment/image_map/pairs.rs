//! Pairs in normalised coordinates, and the weighted least-squares fit of one form to some of them.
//!
//! Both point sets are moved to their centre and scaled to spread 1, so that the corner of the matrix is
//! never 0 there: the centre of points on one side of the horizon is on that side too. The scale form
//! keeps its origin, since it has no offset.

use nalgebra::{DMatrix, Matrix2, Matrix3, SMatrix, SVector, Vector2};

use super::normalise::{Frame, project, with_unit_corner};
use super::{Error, Model, NoiseIn, Pair, projective};
use crate::alignment::consensus::{Regression, mix};
use crate::fit::{self, Jacobian, Noise, Problem};

/// All pairs, normalised.
pub(super) struct Pairs<'a> {
    rows: &'a [Pair],
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
}

/// The entries of the normalised matrix that a form leaves free, row order.
fn entries(model: Model) -> &'static [(usize, usize)] {
    const ALL: [(usize, usize); 8] =
        [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)];
    match model {
        Model::Scale => &[(0, 0), (1, 1)],
        Model::Affine => &ALL[..6],
        _ => &ALL,
    }
}

fn unpack(model: Model, x: &[f64]) -> Matrix3<f64> {
    let mut m = Matrix3::zeros();
    m[(2, 2)] = 1.0;
    for (&(i, j), v) in entries(model).iter().zip(x) {
        m[(i, j)] = *v;
    }
    m
}

fn pack(model: Model, m: &Matrix3<f64>) -> Vec<f64> {
    entries(model).iter().map(|&at| m[at] / m[(2, 2)]).collect()
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
        Self { rows: pairs, model, noise, real, twin, points, area }
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

    /// Rows, whiteners and weights for a fit around `m`.
    fn linearised(&self, m: &Matrix3<f64>, rows: &[(usize, f64)]) -> Option<Part<'_>> {
        let mut part = Part { pairs: self, rows: Vec::with_capacity(rows.len()) };
        for &(row, weight) in rows {
            let (_, derivative, _) = project(m, self.points[row].1)?;
            let whitener = self.whitener(&derivative) * (self.real.size * weight.sqrt());
            part.rows.push((row, whitener));
        }
        Some(part)
    }

    /// The normal equations around `m` with its whiteners, in px: matrix (lower triangle, unused
    /// parameters with a 1), gradient, and the sum of squares.
    fn normal(&self, m: &Matrix3<f64>, rows: &[(usize, f64)]) -> Option<(Normal, Gradient, f64)> {
        let k = self.model.dof();
        let mut normal = Normal::zeros();
        let mut gradient = Gradient::zeros();
        let mut sum = 0.0;
        for &(row, weight) in rows {
            let (u, v) = self.points[row];
            let (p, derivative, _) = project(m, v)?;
            let whitener = self.whitener(&derivative) * self.real.size;
            let e = whitener * (p - u);
            sum += weight * e.norm_squared();
            let (a, b) = row_jacobian(self.model, m, v, &whitener)?;
            for j in 0..k {
                let (aj, bj) = (weight * a[j], weight * b[j]);
                gradient[j] += aj * e.x + bj * e.y;
                for i in j..k {
                    normal[(i, j)] += aj * a[i] + bj * b[i];
                }
            }
        }
        for i in k..8 {
            normal[(i, i)] = 1.0;
        }
        Some((normal, gradient, sum))
    }

    /// One Gauss–Newton step. The search takes hundreds, so nothing is allocated here.
    fn gauss_newton(&self, m: &Matrix3<f64>, rows: &[(usize, f64)]) -> Option<Matrix3<f64>> {
        let (normal, gradient, _) = self.normal(m, rows)?;
        let step = normal.cholesky()?.solve(&gradient);
        let mut next = *m;
        for (&at, d) in entries(self.model).iter().zip(step.iter()) {
            next[at] -= d;
        }
        next.iter().all(|x| x.is_finite()).then_some(next)
    }

    /// Gauss–Newton to rest, or `None` where it does not come to rest on its own.
    fn at_rest(&self, start: &Matrix3<f64>, rows: &[(usize, f64)]) -> Option<Matrix3<f64>> {
        let mut m = *start;
        for _ in 0..8 {
            let next = self.gauss_newton(&m, rows)?;
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
    fn damped(&self, start: Matrix3<f64>, rows: &[(usize, f64)]) -> Result<Matrix3<f64>, Error> {
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

    fn start(&self, rows: &[usize]) -> Option<Matrix3<f64>> {
        projective::linear(self.model, rows.iter().map(|&i| self.points[i]))
    }

    /// Fits without rejecting anything.
    pub(super) fn fit(&self, rows: &[usize]) -> Result<Map, Error> {
        // A start needs no more than a few thousand rows.
        let some: Vec<usize> = rows.iter().copied().step_by(1 + rows.len() / 2000).collect();
        let start =
            self.start(&some).ok_or(Error::Degenerate { model: self.model.name(), free: 1 })?;
        self.polish(start, rows)
    }

    /// Fits to the end, starting at a normalised matrix, and works out the uncertainty.
    pub(super) fn polish(&self, start: Matrix3<f64>, rows: &[usize]) -> Result<Map, Error> {
        let degenerate = |free| Error::Degenerate { model: self.model.name(), free };
        let weighted: Vec<(usize, f64)> = rows.iter().map(|&i| (i, 1.0)).collect();
        let m = match self.at_rest(&start, &weighted) {
            Some(m) => m,
            None => self.damped(start, &weighted)?,
        };
        let (normal, _, sum) = self.normal(&m, &weighted).ok_or_else(|| degenerate(1))?;
        let k = self.model.dof();
        let normal = DMatrix::from_fn(k, k, |i, j| normal[(i.max(j), i.min(j))]);
        // Columns scaled to length 1, as `fit` does it.
        let length = normal.diagonal().map(|d| d.max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(k, k, |i, j| normal[(i, j)] / (length[i] * length[j]));
        let values = scaled.symmetric_eigenvalues();
        let conditioning = (values.min().max(0.0) / values.max()).sqrt();
        // A direction seen a hundred thousand times less sharply than the sharpest is free.
        let free = values.iter().filter(|v| v.max(0.0).sqrt() < 1e-5 * values.max().sqrt()).count();
        if free > 0 {
            return Err(degenerate(free));
        }
        let unit = normal.try_inverse().ok_or_else(|| degenerate(1))?;
        let told = (2 * rows.len()).saturating_sub(k);
        let noise2 = if told > 0 { sum / told as f64 } else { 0.0 };
        let (leave_one_out_px, worst) =
            if told > 0 { self.leave_one_out(&m, &unit, rows) } else { (None, None) };
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
            sum,
        })
    }

    /// Errors of each row as predicted from all others, to first order (PRESS): `(I - H)⁻¹ e` with `H`
    /// the row's leverage; `unit` is the covariance at a noise of 1 px.
    fn leave_one_out(
        &self,
        m: &Matrix3<f64>,
        unit: &DMatrix<f64>,
        rows: &[usize],
    ) -> (Option<f64>, Option<(usize, f64)>) {
        let k = self.model.dof();
        let mut c = Normal::zeros();
        c.view_mut((0, 0), (k, k)).copy_from(unit);
        let (mut sum, mut worst) = (0.0, None::<(usize, f64)>);
        for &row in rows {
            let (u, v) = self.points[row];
            let Some((p, derivative, _)) = project(m, v) else { return (None, None) };
            let whitener = self.whitener(&derivative) * self.real.size;
            let Some((a, b)) = row_jacobian(self.model, m, v, &whitener) else {
                return (None, None);
            };
            let (a, b) = (Gradient::from(a), Gradient::from(b));
            let (ca, cb) = (c * a, c * b);
            let leverage = Matrix2::new(a.dot(&ca), a.dot(&cb), b.dot(&ca), b.dot(&cb));
            let rest = Matrix2::identity() - leverage;
            // A row that alone holds a direction cannot be predicted from the others.
            if rest.determinant() < 1e-9 {
                return (None, None);
            }
            let (Some(rest), Some(colour)) = (rest.try_inverse(), whitener.try_inverse()) else {
                return (None, None);
            };
            let e = (colour * (rest * (whitener * (p - u)))).norm() * self.real.size;
            sum += e * e;
            if worst.is_none_or(|(_, w)| e > w) {
                worst = Some((row, e));
            }
        }
        (Some((sum / rows.len() as f64).sqrt()), worst)
    }
}

type Normal = SMatrix<f64, 8, 8>;
type Gradient = SVector<f64, 8>;

impl Regression for Pairs<'_> {
    type Model = Matrix3<f64>;

    fn len(&self) -> usize {
        self.rows.len()
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
        let p = self.rows[row];
        [p.real.u, p.real.v, p.twin.u, p.twin.v].iter().fold(0, |key, v| mix(key ^ v.to_bits()))
    }
    fn through(&self, rows: &[usize]) -> Option<Matrix3<f64>> {
        match self.model {
            Model::Projective => projective::through_four(&[
                self.points[rows[0]],
                self.points[rows[1]],
                self.points[rows[2]],
                self.points[rows[3]],
            ]),
            _ => self.start(rows),
        }
    }
    fn error2(&self, m: &Matrix3<f64>, row: usize) -> f64 {
        let (u, v) = self.points[row];
        let Some((p, derivative, _)) = project(m, v) else { return f64::INFINITY };
        let e = (p - u) * self.real.size;
        match self.noise {
            NoiseIn::Real => e.norm_squared(),
            NoiseIn::Both => {
                let j = derivative * (self.real.size / self.twin.size);
                // eᵀ (I + J Jᵀ)⁻¹ e, written out: this is the innermost loop.
                let a = 1.0 + j[(0, 0)] * j[(0, 0)] + j[(0, 1)] * j[(0, 1)];
                let b = j[(0, 0)] * j[(1, 0)] + j[(0, 1)] * j[(1, 1)];
                let d = 1.0 + j[(1, 0)] * j[(1, 0)] + j[(1, 1)] * j[(1, 1)];
                (d * e.x * e.x - 2.0 * b * e.x * e.y + a * e.y * e.y) / (a * d - b * b)
            }
        }
    }
    fn refit(&self, m: &Matrix3<f64>, rows: &[(usize, f64)]) -> Option<Matrix3<f64>> {
        // Expectation–maximisation repeats anyway; one step each is enough.
        self.gauss_newton(m, rows)
    }
}

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
    let columns: &[usize] = match model {
        Model::Scale => &[0, 4],
        Model::Affine => &[0, 1, 2, 3, 4, 5],
        _ => &[0, 1, 2, 3, 4, 5, 6, 7],
    };
    let (mut a, mut b) = ([0.0; 8], [0.0; 8]);
    for (k, &c) in columns.iter().enumerate() {
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
        let at = entries(self.model);
        let corner = raw[(2, 2)];
        let mut j = DMatrix::zeros(at.len(), at.len());
        for (column, &(p, q)) in at.iter().enumerate() {
            // d raw / d x_pq = left[:, p] · right[q, :], then the quotient rule for the corner.
            let d = left.column(p) * right.row(q);
            for (row, &(a, b)) in at.iter().enumerate() {
                j[(row, column)] = (d[(a, b)] - m[(a, b)] * d[(2, 2)]) / corner;
            }
        }
        Ok((m, &j * &self.covariance * j.transpose()))
    }
}
