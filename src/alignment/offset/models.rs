//! The forms of `D` about the centre of the points, and the fit of one of them to some rows.
//!
//! With `c` the centre of the real points, `s` their spread and `n = (p_r - c)/s`, every form is
//! `p_s = c + t + s·L(n)` in parameters that are 0 for "no offset": rigid `L = exp([w]×) n`, similarity
//! `(1 + k) exp([w]×) n`, affine `(I + A) n`, full `((I + A) n - n₀) / (1 + g·n)` likewise.

use nalgebra::{DMatrix, Matrix3, Matrix4, UnitQuaternion, Vector3};

use super::{Error, FLOOR_M, Model, Pair, Trust};
use crate::alignment::consensus::{Regression, mix};
use crate::alignment::rigid::turn_between;
use crate::fit::{self, Noise, Prior, Residuals};

pub(super) struct Pairs<'a> {
    rows: &'a [Pair],
    model: Model,
    shrink: f64,
    centre: Vector3<f64>,
    size: f64,
    volume: f64,
}

/// A fitted form.
pub(super) struct Fitted {
    pub(super) d: Matrix4<f64>,
    pub(super) rms: f64,
    pub(super) noise: f64,
    pub(super) leave_one_out: Option<f64>,
    pub(super) worst: Option<(usize, f64)>,
    pub(super) unobservable: Vec<String>,
    pub(super) n_free: usize,
    pub(super) covariance_at_centre: DMatrix<f64>,
    pub(super) trust: Trust,
}

/// Names of the parameters of each form, in order.
fn names(model: Model) -> &'static [&'static str] {
    match model {
        Model::Translation | Model::Auto => &["x", "y", "z"],
        Model::Rigid => &["x", "y", "z", "turn_x", "turn_y", "turn_z"],
        Model::Similarity => &["x", "y", "z", "turn_x", "turn_y", "turn_z", "scale"],
        Model::Affine | Model::Full => &[
            "x", "y", "z", "d11", "d12", "d13", "d21", "d22", "d23", "d31", "d32", "d33", "d41",
            "d42", "d43",
        ],
    }
}

/// `D` of parameters about a centre: shifts in units of the spread, the rest without unit.
pub(super) fn matrix(model: Model, centre: Vector3<f64>, size: f64, x: &[f64]) -> Matrix4<f64> {
    let mut d = Matrix4::identity();
    let linear = match model {
        Model::Translation | Model::Auto => Matrix3::identity(),
        Model::Rigid | Model::Similarity => {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x[3], x[4], x[5]));
            let scale = if model == Model::Similarity { 1.0 + x[6] } else { 1.0 };
            turn.to_rotation_matrix().into_inner() * scale
        }
        Model::Affine | Model::Full => Matrix3::identity() + Matrix3::from_row_slice(&x[3..12]),
    };
    d.fixed_view_mut::<3, 3>(0, 0).copy_from(&linear);
    for i in 0..3 {
        d[(i, 3)] = x[i];
    }
    if model == Model::Full {
        for i in 0..3 {
            d[(3, i)] = x[12 + i];
        }
    }
    // From normalised coordinates, centred alike on both sides, to metres.
    let mut out = Matrix4::identity() * size;
    out[(3, 3)] = 1.0;
    let mut into = Matrix4::identity() / size;
    into[(3, 3)] = 1.0;
    for i in 0..3 {
        out[(i, 3)] = centre[i];
        into[(i, 3)] = -centre[i] / size;
    }
    let d = out * d * into;
    d / d[(3, 3)]
}

impl<'a> Pairs<'a> {
    pub(super) fn new(pairs: &'a [Pair], model: Model, shrink: f64) -> Self {
        let n = pairs.len().max(1) as f64;
        let centre = pairs.iter().map(|p| p.real).sum::<Vector3<f64>>() / n;
        let square = pairs.iter().map(|p| (p.real - centre).norm_squared()).sum::<f64>() / n;
        let size = square.sqrt();
        // Outliers lie anywhere in the space that is worked in, at least a decimetre across.
        let volume = (4.0 * size).max(0.1).powi(3);
        Self {
            rows: pairs,
            model,
            shrink,
            centre,
            size: if size > 0.0 { size } else { 1.0 },
            volume,
        }
    }

    /// Root mean square distance of the real points from their centre, m.
    pub(super) fn spread(&self) -> f64 {
        let n = self.rows.len().max(1) as f64;
        let square = self.rows.iter().map(|p| (p.real - self.centre).norm_squared()).sum::<f64>();
        (square / n).sqrt()
    }

    /// `D` of parameters.
    pub(super) fn matrix(&self, x: &[f64]) -> Matrix4<f64> {
        matrix(self.model, self.centre, self.size, x)
    }

    fn solve(
        &self,
        rows: &[(usize, f64)],
        sigma: f64,
        start: &[f64],
    ) -> Result<fit::Fit, fit::Error> {
        let problem = Residuals {
            n: 3 * rows.len(),
            block: 3,
            function: |x: &[f64], r: &mut [f64]| {
                let d = self.matrix(x);
                for ((row, _), r) in rows.iter().zip(r.chunks_exact_mut(3)) {
                    let pair = &self.rows[*row];
                    let e = super::apply(&d, pair.real)
                        .map_or(Vector3::repeat(f64::INFINITY), |p| (p - pair.said) / sigma);
                    r.copy_from_slice(e.as_slice());
                }
            },
        };
        // A shift needs no prior; what turns and stretches is near that of the identity.
        let priors = (3..start.len())
            .map(|parameter| Prior { parameter, mean: 0.0, std: self.prior(parameter) })
            .collect();
        let options = fit::Options {
            priors,
            noise: Noise::Known,
            weights: rows.iter().map(|(_, w)| *w).collect(),
            ..fit::Options::default()
        };
        fit::solve(&problem, start, &options)
    }

    fn prior(&self, parameter: usize) -> f64 {
        match self.model {
            // A robot's frame may be turned by tens of degrees, not its length.
            Model::Rigid | Model::Similarity if parameter < 6 => 10.0 * self.shrink,
            // Perspective over the size of the workspace is smaller still than stretch.
            Model::Full if parameter >= 12 => 0.2 * self.shrink,
            _ => self.shrink,
        }
    }

    /// Fits without rejecting anything: once to learn the noise, once more with the priors in its units.
    pub(super) fn fit(&self, rows: &[usize]) -> Result<Fitted, Error> {
        let weighted: Vec<(usize, f64)> = rows.iter().map(|&i| (i, 1.0)).collect();
        let n = self.model.dof();
        let mut sigma = (1e-3 * self.size).max(FLOOR_M);
        let mut x = self.start(rows);
        let mut result = self.solve(&weighted, sigma, &x)?;
        for _ in 0..4 {
            x.clone_from(&result.x);
            let sum: f64 = result.residuals.iter().map(|r| r * r).sum::<f64>() * sigma * sigma;
            let told = (3 * rows.len()).saturating_sub(n);
            // Without redundancy the first guess of the noise has to do.
            let next = if told > 0 { (sum / told as f64).sqrt().max(FLOOR_M) } else { sigma };
            let still = (next / sigma - 1.0).abs() < 1e-3;
            sigma = next;
            result = self.solve(&weighted, sigma, &x)?;
            if still {
                break;
            }
        }
        let d = self.matrix(&result.x);
        if !d.iter().all(|v| v.is_finite()) || d.determinant().abs() < 1e-12 {
            return Err(Error::Singular);
        }
        let count = rows.len() as f64;
        let sum = result.residuals.iter().map(|r| r * r).sum::<f64>() * sigma * sigma;
        let told = (3 * rows.len()).saturating_sub(n) > 0;
        let (leave_one_out, worst) = self.leave_one_out(&result, &weighted, sigma, told);
        let (unobservable, n_free) = self.unobservable(&result);
        Ok(Fitted {
            d,
            rms: (sum / count).sqrt(),
            noise: if told { sigma } else { 0.0 },
            leave_one_out,
            worst,
            unobservable,
            n_free,
            // At the centre D p_r moves with the shift alone.
            covariance_at_centre: result.covariance.view((0, 0), (3, 3)) * self.size.powi(2),
            trust: Trust {
                model: self.model,
                centre: self.centre,
                size: self.size,
                reach: rows
                    .iter()
                    .map(|&i| (self.rows[i].real - self.centre).norm())
                    .fold(0.0, f64::max),
                x: result.x,
                covariance: result.covariance,
                told,
            },
        })
    }

    /// What only the prior holds: directions the data do not see, or see less sharply than it.
    fn unobservable(&self, result: &fit::Fit) -> (Vec<String>, usize) {
        let names = names(self.model);
        let mut said: Vec<String> = Vec::new();
        for (parameter, name) in names.iter().enumerate().take(result.x.len()).skip(3) {
            let prior = self.prior(parameter);
            if result.std(parameter) > 0.9 * prior {
                said.push((*name).to_string());
            }
        }
        let n_free = said.len().max(result.conditioning.unobservable.len());
        for direction in &result.conditioning.unobservable {
            for (parameter, _) in &direction.parameters {
                let name = names[*parameter].to_string();
                if !said.contains(&name) {
                    said.push(name);
                }
            }
        }
        (said, n_free)
    }

    /// Leave-one-out errors to first order, `(I - H)⁻¹ e`, `H` by differences.
    fn leave_one_out(
        &self,
        result: &fit::Fit,
        rows: &[(usize, f64)],
        sigma: f64,
        told: bool,
    ) -> (Option<f64>, Option<(usize, f64)>) {
        if !told || rows.len() < 2 {
            return (None, None);
        }
        let n = result.x.len();
        let (mut sum, mut worst) = (0.0, None::<(usize, f64)>);
        for (at, (row, _)) in rows.iter().enumerate() {
            let real = self.rows[*row].real;
            let mut j = DMatrix::zeros(3, n);
            let h = 1e-6;
            for c in 0..n {
                let step = |by: f64| {
                    let mut x = result.x.clone();
                    x[c] += by;
                    super::apply(&self.matrix(&x), real)
                };
                let (Some(up), Some(down)) = (step(h), step(-h)) else { return (None, None) };
                j.set_column(c, &((up - down) / (2.0 * h * sigma)));
            }
            let leverage = &j * &result.covariance * j.transpose();
            let rest = DMatrix::identity(3, 3) - leverage;
            let e = DMatrix::from_column_slice(3, 1, &result.residuals[3 * at..3 * at + 3]);
            if rest.determinant() < 1e-9 {
                return (None, None);
            }
            let Some(inverse) = rest.try_inverse() else { return (None, None) };
            let e = (inverse * e).norm() * sigma;
            sum += e * e;
            if worst.is_none_or(|(_, w)| e > w) {
                worst = Some((*row, e));
            }
        }
        (Some((sum / rows.len() as f64).sqrt()), worst)
    }

    /// Starting values: Umeyama's closed form where the form turns, the identity's zeros elsewhere
    /// (those forms are linear, or nearly so).
    fn start(&self, rows: &[usize]) -> Vec<f64> {
        let mut x = vec![0.0; self.model.dof()];
        let n = rows.len().max(1) as f64;
        let real = rows.iter().map(|&i| self.rows[i].real).sum::<Vector3<f64>>() / n;
        let said = rows.iter().map(|&i| self.rows[i].said).sum::<Vector3<f64>>() / n;
        let mut turn = UnitQuaternion::identity();
        if matches!(self.model, Model::Rigid | Model::Similarity) {
            let pairs: Vec<_> =
                rows.iter().map(|&i| (self.rows[i].real, self.rows[i].said)).collect();
            // With points on a line the turn about it is any; the identity's is 0.
            turn = turn_between(&pairs).unwrap_or(turn);
            x[3..6].copy_from_slice(turn.scaled_axis().as_slice());
        }
        let shift = (said - self.centre - turn * (real - self.centre)) / self.size;
        x[..3].copy_from_slice(shift.as_slice());
        x
    }
}

impl Regression for Pairs<'_> {
    type Model = Vec<f64>;
    type Rows = Vec<usize>;

    fn len(&self) -> usize {
        self.rows.len()
    }
    fn minimal(&self) -> usize {
        self.model.minimal()
    }
    fn dimension(&self) -> usize {
        3
    }
    fn volume(&self) -> f64 {
        self.volume
    }
    fn floor(&self) -> f64 {
        FLOOR_M
    }
    fn key(&self, row: usize) -> u64 {
        let p = &self.rows[row];
        p.said.iter().chain(p.real.iter()).fold(0, |key, v| mix(key ^ v.to_bits()))
    }
    fn through(&self, rows: &[usize]) -> Option<Vec<f64>> {
        let start = self.start(rows);
        if matches!(self.model, Model::Affine | Model::Full) {
            return self.refit(&start, &rows.to_vec(), &vec![1.0; rows.len()]);
        }
        start.iter().all(|v| v.is_finite()).then_some(start)
    }
    fn rows(&self, rows: &[usize]) -> Vec<usize> {
        rows.to_vec()
    }
    fn errors2(&self, x: &Vec<f64>, rows: &Vec<usize>, out: &mut Vec<f64>) {
        let d = self.matrix(x);
        out.extend(rows.iter().map(|&row| {
            let pair = &self.rows[row];
            super::apply(&d, pair.real).map_or(f64::INFINITY, |p| (p - pair.said).norm_squared())
        }));
    }
    fn refit(&self, x: &Vec<f64>, rows: &Vec<usize>, weights: &[f64]) -> Option<Vec<f64>> {
        // The search has no use for sharp priors: a thousandth of the size stands for the noise.
        let sigma = (1e-3 * self.size).max(FLOOR_M);
        let weighted = rows.iter().copied().zip(weights.iter().copied());
        // Rows of no weight cost time and change nothing.
        let weighted: Vec<(usize, f64)> = weighted.filter(|(_, w)| *w > 0.0).collect();
        self.solve(&weighted, sigma, x).ok().map(|fit| fit.x)
    }
}
