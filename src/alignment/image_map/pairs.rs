//! Pairs in normalised coordinates, and the weighted least-squares fit of one form to some of them.
//!
//! Both point sets are moved to their centre and scaled to spread 1, so that the corner of the matrix is
//! never 0 there: the centre of points on one side of the horizon is on that side too. The scale form
//! keeps its origin, since it has no offset.

use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2};

use super::{Error, Model, NoiseIn, Pair, projective};
use crate::alignment::consensus::{Regression, mix};
use crate::fit::{self, Jacobian, Noise, Problem};
use crate::world::Pixel;

/// `n = (pixel - centre) / size`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    centre: Vector2<f64>,
    size: f64,
}

impl Frame {
    fn of(pixels: impl Iterator<Item = Pixel> + Clone, keep_origin: bool) -> Self {
        let n = pixels.clone().count().max(1) as f64;
        let centre = if keep_origin {
            Vector2::zeros()
        } else {
            pixels.clone().map(|p| Vector2::new(p.u, p.v)).sum::<Vector2<f64>>() / n
        };
        let square = pixels.map(|p| (Vector2::new(p.u, p.v) - centre).norm_squared()).sum::<f64>();
        let size = (square / (2.0 * n)).sqrt();
        Self { centre, size: if size > 0.0 { size } else { 1.0 } }
    }

    fn normalise(&self, p: Pixel) -> Vector2<f64> {
        (Vector2::new(p.u, p.v) - self.centre) / self.size
    }

    /// Pixel from normalised.
    fn matrix(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, self.size);
        Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }

    fn inverse(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, self.size);
        Matrix3::new(1.0 / s, 0.0, -c.x / s, 0.0, 1.0 / s, -c.y / s, 0.0, 0.0, 1.0)
    }
}

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

/// Divides by the corner.
pub(super) fn with_unit_corner(m: Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let corner = m[(2, 2)];
    // Rounding leaves about 1e-16 of the largest entry where the corner should be 0.
    if corner.abs() <= 1e-13 * m.amax() || !corner.is_finite() {
        return Err(Error::OriginAtInfinity);
    }
    Ok(m / corner)
}

/// The map of one normalised point: image, and its derivative.
fn project(m: &Matrix3<f64>, v: Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>, f64)> {
    let w = m[(2, 0)] * v.x + m[(2, 1)] * v.y + m[(2, 2)];
    if w <= 1e-9 {
        return None;
    }
    let x = (m[(0, 0)] * v.x + m[(0, 1)] * v.y + m[(0, 2)]) / w;
    let y = (m[(1, 0)] * v.x + m[(1, 1)] * v.y + m[(1, 2)]) / w;
    let d = Matrix2::new(
        m[(0, 0)] - x * m[(2, 0)],
        m[(0, 1)] - x * m[(2, 1)],
        m[(1, 0)] - y * m[(2, 0)],
        m[(1, 1)] - y * m[(2, 1)],
    ) / w;
    Some((Vector2::new(x, y), d, w))
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

    fn start(&self, rows: &[usize]) -> Option<Matrix3<f64>> {
        projective::linear(self.model, rows.iter().map(|&i| self.points[i]))
    }

    /// Fits without rejecting anything.
    pub(super) fn fit(&self, rows: &[usize]) -> Result<Map, Error> {
        let start =
            self.start(rows).ok_or(Error::Degenerate { model: self.model.name(), free: 1 })?;
        self.polish(start, rows)
    }

    /// Fits to the end, starting at a normalised matrix, and works out the uncertainty.
    pub(super) fn polish(&self, start: Matrix3<f64>, rows: &[usize]) -> Result<Map, Error> {
        let weighted: Vec<(usize, f64)> = rows.iter().map(|&i| (i, 1.0)).collect();
        let degenerate = |free| Error::Degenerate { model: self.model.name(), free };
        let options = fit::Options { noise: Noise::Known, ..fit::Options::default() };
        let mut m = start;
        let mut round = 0;
        let (part, result) = loop {
            let part = self.linearised(&m, &weighted).ok_or_else(|| degenerate(1))?;
            let result = fit::solve(&part, &pack(self.model, &m), &options)?;
            let next = unpack(self.model, &result.x);
            let moved = (next - m).amax();
            m = next;
            round += 1;
            // The whitening changes little: the second round moves in the seventh digit.
            if moved < 1e-9 || round == 4 || self.noise == NoiseIn::Real {
                break (part, result);
            }
        };
        let free = result.conditioning.unobservable.len();
        if free > 0 || result.conditioning.ratio < 1e-5 {
            return Err(degenerate(free.max(1)));
        }
        let sum = result.residuals.iter().map(|r| r * r).sum::<f64>();
        let told = (2 * rows.len()).saturating_sub(self.model.dof());
        let noise2 = if told > 0 { sum / told as f64 } else { 0.0 };
        let (leave_one_out_px, worst) = part.leave_one_out(&result, told);
        Ok(Map {
            model: self.model,
            normalised: m,
            real: self.real,
            twin: self.twin,
            covariance: result.covariance * noise2,
            noise_px: noise2.sqrt(),
            conditioning: result.conditioning.ratio,
            leave_one_out_px,
            worst,
            sum,
        })
    }
}

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
        let part = self.linearised(m, rows)?;
        // Expectation–maximisation repeats anyway; a few steps each are enough.
        let options =
            fit::Options { max_iterations: 3, noise: Noise::Known, ..fit::Options::default() };
        let result = fit::solve(&part, &pack(self.model, m), &options).ok()?;
        Some(unpack(self.model, &result.x))
    }
}

/// No picture is measured better than this; data without noise would make the likelihood infinite.
pub(super) const FLOOR_PX: f64 = 1e-3;

/// The rows of one fit with their whiteners frozen.
struct Part<'a> {
    pairs: &'a Pairs<'a>,
    rows: Vec<(usize, Matrix2<f64>)>,
}

impl Part<'_> {
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

    /// Errors of each row as predicted from all others, to first order (PRESS): `(I - H)⁻¹ e` with `H`
    /// the row's leverage.
    fn leave_one_out(&self, result: &fit::Fit, told: usize) -> (Option<f64>, Option<(usize, f64)>) {
        if told == 0 {
            return (None, None);
        }
        let model = self.pairs.model;
        let m = unpack(model, &result.x);
        let k = model.dof();
        let (mut sum, mut worst) = (0.0, None::<(usize, f64)>);
        for (at, (row, whitener)) in self.rows.iter().enumerate() {
            let v = self.pairs.points[*row].1;
            let Some((a, b)) = Self::row_jacobian(model, &m, v, whitener) else {
                return (None, None);
            };
            let quad = |p: &[f64; 8], q: &[f64; 8]| {
                let c = &result.covariance;
                (0..k).map(|i| (0..k).map(|j| p[i] * c[(i, j)] * q[j]).sum::<f64>()).sum::<f64>()
            };
            let leverage = Matrix2::new(quad(&a, &a), quad(&a, &b), quad(&a, &b), quad(&b, &b));
            let rest = Matrix2::identity() - leverage;
            let e = Vector2::new(result.residuals[2 * at], result.residuals[2 * at + 1]);
            // A row that alone holds a direction cannot be predicted from the others.
            if rest.determinant() < 1e-9 {
                return (None, None);
            }
            let (Some(rest), Some(colour)) = (rest.try_inverse(), whitener.try_inverse()) else {
                return (None, None);
            };
            let e = (colour * (rest * e)).norm() * self.pairs.real.size;
            sum += e * e;
            if worst.is_none_or(|(_, w)| e > w) {
                worst = Some((*row, e));
            }
        }
        (Some((sum / self.rows.len() as f64).sqrt()), worst)
    }
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
            if let Some((a, b)) = Self::row_jacobian(model, &m, v, whitener) {
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

/// Refuses points that are all one, or on one line where the model needs two dimensions.
pub(super) fn check_spread(pairs: &[Pair], rows: &[usize], model: Model) -> Result<(), Error> {
    type Side = (&'static str, fn(&Pair) -> Pixel);
    let sides: [Side; 2] = [("real points", |p| p.real), ("twin points", |p| p.twin)];
    for (what, side) in sides {
        let n = rows.len() as f64;
        let points = rows.iter().map(|&i| side(&pairs[i])).map(|p| Vector2::new(p.u, p.v));
        let mean = points.clone().sum::<Vector2<f64>>() / n;
        let scatter = points.map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix2<f64>>() / n;
        let spread = scatter.trace().max(0.0).sqrt();
        if model == Model::Scale {
            continue;
        }
        if spread < 1e-6 {
            return Err(Error::Coincident { what, spread, unit: "px" });
        }
        let across = scatter.symmetric_eigenvalues().min().max(0.0).sqrt();
        if across < 1e-6 * spread {
            return Err(Error::Collinear { what, ratio: across / spread });
        }
    }
    Ok(())
}
