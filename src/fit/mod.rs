//! Robust non-linear least squares: an estimate, its covariance, and what the data could not tell.
//!
//! A [`Problem`] says what the residuals are; [`solve`] finds the parameters that make
//! `½ Σ ρ(‖r_b‖²) + ½ Σ ((x_i - μ_i)/s_i)²` least, where `ρ` is a robust [`Loss`] on blocks of residuals
//! and the second sum are the [`Prior`]s. Alignment, motion and discovery share this solver. It knows
//! nothing of cameras or arms, reads no clock and draws no random number: the same problem gives the
//! same bits.
//!
//! Residuals should be in units of their own standard deviation when priors or a robust loss are used,
//! since both compare a residual with 1. Where the noise is unknown, [`Noise::Estimated`] takes it from
//! the residuals.
//!
//! Source: Madsen, Nielsen and Tingleff, *Methods for Non-Linear Least Squares Problems*, 2004, §3.2;
//! Huber, *Robust Statistics*, 1981, §7.6 (covariance under a robust loss).

mod error;
mod loss;
mod normal;
mod levenberg;
mod reject;

use nalgebra::DMatrix;

pub use error::{Error, Wrong};
pub use levenberg::solve;
pub use loss::Loss;
pub use reject::{Rejection, solve_rejecting};

/// A least-squares problem: what the residuals are, given the parameters.
pub trait Problem {
    /// Returns how many residuals there are.
    fn n_residuals(&self) -> usize;

    /// Writes the residuals at `x`. A residual that is not finite makes the solver take a smaller step.
    fn residuals(&self, x: &[f64], r: &mut [f64]);

    /// Writes the derivatives of the residuals at `x` and returns `true`; the default returns `false`
    /// and leaves them to central differences. The Jacobian comes filled with zeros.
    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        let _ = (x, j);
        false
    }

    /// Returns how many neighbouring residuals belong together (2 for a pixel, 3 for a point): the
    /// robust loss and the weights see a block's length, so that they do not depend on its axes.
    fn block(&self) -> usize {
        1
    }
}

/// A [`Problem`] made of a closure, differentiated numerically.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<F> {
    /// Number of residuals.
    pub n: usize,
    /// Residuals per block.
    pub block: usize,
    /// Writes the residuals (second argument) at the parameters (first argument).
    pub function: F,
}

impl<F: Fn(&[f64], &mut [f64])> Residuals<F> {
    /// Returns the problem of `n` single residuals written by `function(x, r)`.
    pub fn new(n: usize, function: F) -> Self {
        Self { n, block: 1, function }
    }
}

impl<F: Fn(&[f64], &mut [f64])> Problem for Residuals<F> {
    fn n_residuals(&self) -> usize {
        self.n
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        (self.function)(x, r);
    }
    fn block(&self) -> usize {
        self.block
    }
}

/// The derivatives of the residuals, one row per residual, one column per parameter.
#[derive(Debug, Clone)]
pub struct Jacobian {
    n_columns: usize,
    entries: Vec<f64>,
}

impl Jacobian {
    /// Returns a Jacobian of zeros.
    pub fn zeros(n_rows: usize, n_columns: usize) -> Self {
        Self { n_columns, entries: vec![0.0; n_rows * n_columns] }
    }

    /// Returns the derivatives of one residual.
    pub fn row(&self, residual: usize) -> &[f64] {
        &self.entries[residual * self.n_columns..(residual + 1) * self.n_columns]
    }

    /// As [`Self::row`], to write them.
    pub fn row_mut(&mut self, residual: usize) -> &mut [f64] {
        &mut self.entries[residual * self.n_columns..(residual + 1) * self.n_columns]
    }

    fn clear(&mut self) {
        self.entries.fill(0.0);
    }
}

/// Something known of a parameter before measuring: `x ~ N(mean, std²)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Index of the parameter.
    pub parameter: usize,
    /// Its expected value.
    pub mean: f64,
    /// Its standard deviation before measuring, above 0.
    pub std: f64,
}

/// Limits of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Index of the parameter.
    pub parameter: usize,
    /// Least value allowed.
    pub lower: f64,
    /// Greatest value allowed.
    pub upper: f64,
}

/// Where the scale of the noise comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Noise {
    /// Residuals are in units of their own standard deviation.
    Known,
    /// One unknown standard deviation for all residuals, taken from the fit.
    #[default]
    Estimated,
}

/// How to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The robust loss.
    pub loss: Loss,
    /// Where the scale of the covariance comes from.
    pub noise: Noise,
    /// Most steps to try.
    pub max_iterations: usize,
    /// Stop when a step is shorter than this part of `x` (in scaled parameters).
    pub step_tolerance: f64,
    /// Stop when a step lowers the cost by less than this part of it.
    pub cost_tolerance: f64,
    /// Indices of parameters that stay as they start.
    pub fixed: Vec<usize>,
    /// Limits.
    pub bounds: Vec<Bound>,
    /// What is known beforehand.
    pub priors: Vec<Prior>,
    /// One weight per block of residuals, the inverse of a variance; empty for all 1. A block of
    /// weight 0 is as good as absent.
    pub weights: Vec<f64>,
    /// Typical size of a change of each parameter, for numerical derivatives; empty for `max(|x|, 1)`.
    pub scales: Vec<f64>,
    /// A direction whose singular value is below this part of the largest one (columns of the
    /// Jacobian scaled to length 1) counts as unobservable.
    pub rank_tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            loss: Loss::None,
            noise: Noise::Estimated,
            max_iterations: 100,
            step_tolerance: 1e-10,
            cost_tolerance: 1e-13,
            fixed: Vec::new(),
            bounds: Vec::new(),
            priors: Vec::new(),
            weights: Vec::new(),
            scales: Vec::new(),
            // The normal equations square the condition number; below 1e-6 their rounding shows.
            rank_tolerance: 1e-6,
        }
    }
}

/// Why the solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convergence {
    /// The steps became too small to matter.
    Step,
    /// The cost no longer fell.
    Cost,
    /// No step of any length lowered the cost: it is at its least to machine precision.
    Stalled,
    /// The iterations ran out.
    IterationLimit,
}

/// A direction in parameter space along which the residuals do not change.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Its singular value as a part of the largest.
    pub singular_value: f64,
    /// The parameters it moves, most first, with their share (in units of the column scale, squares sum
    /// to at most 1); shares below 0.1 are left out.
    pub parameters: Vec<(usize, f64)>,
}

/// What the data say and what they do not.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioning {
    /// Least singular value over the largest, of the data alone, columns scaled to length 1.
    pub ratio: f64,
    /// Directions that the data alone do not determine. With priors they keep their prior value.
    pub unobservable: Vec<Direction>,
    /// Parameters that neither data nor priors determine.
    pub undetermined: Vec<usize>,
}

/// The result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub x: Vec<f64>,
    /// Their covariance; rows of fixed and of undetermined parameters are 0, see [`Self::std`].
    pub covariance: DMatrix<f64>,
    /// `½ Σ ρ + ½ Σ priors` at `x`.
    pub cost: f64,
    /// Root mean square of the residuals whose weight is not 0.
    pub rms: f64,
    /// Standard deviation of one residual as estimated from the fit, `None` without redundancy.
    pub noise_std: Option<f64>,
    /// Steps tried.
    pub iterations: usize,
    /// Why it stopped.
    pub convergence: Convergence,
    /// What the data say and what they do not.
    pub conditioning: Conditioning,
    /// The residuals at `x`.
    pub residuals: Vec<f64>,
    /// The weight that the robust loss gave each block, 1 for a clean one.
    pub robust_weights: Vec<f64>,
}

impl Fit {
    /// Returns the standard deviation of a parameter; infinite when nothing determines it.
    pub fn std(&self, parameter: usize) -> f64 {
        if self.conditioning.undetermined.contains(&parameter) {
            f64::INFINITY
        } else {
            self.covariance[(parameter, parameter)].max(0.0).sqrt()
        }
    }

    /// Returns whether the solver came to rest rather than running out of iterations.
    pub fn converged(&self) -> bool {
        self.convergence != Convergence::IterationLimit
    }
}
