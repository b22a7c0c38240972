//! Everything fitted together: camera, board, the size of the squares, the camera's own numbers, and two kinds of noise.
//!
//! The residual of a picture is where its flange seems to be against where the robot says: three turns and three shifts. Its
//! covariance has two parts. The corners' comes from the picture and is known for every direction (a board's distance is known
//! worse than its place across the line of sight); the robot's is one standard deviation for turns and one for
//! shifts, which the residuals tell. So corners weigh as in a fit of their reprojection, and a robot that is worse than its
//! corners is not asked for more than it has. Corners of a picture enter through its pose and covariance, which is the same
//! to first order; the camera's numbers move with all pictures at once, held by their own covariance.
//!
//! Source: Triggs et al., "Bundle Adjustment", 2000, §6 (reduced systems).

use nalgebra::{
    DMatrix, Isometry3, Matrix6, SVector, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::board::{self, Sight};
use super::noise::{self, FINEST};
use super::start::Start;
use super::types::{Known, Mount, Noise, off};
use crate::alignment::boards::Target;
use crate::alignment::reprojection::INTRINSIC;
use crate::fit::{self, Fit, Prior, Problem};
use crate::world::Intrinsics;

/// Where the camera's parameters begin: turn about its own axes, shift along its carrier's.
pub(super) const CAMERA: usize = 0;
/// Where the board's begin.
pub(super) const BOARD: usize = 6;
/// The logarithm of the size of the squares, over what it was at first.
pub(super) const SCALE: usize = 12;
/// Where the camera's own numbers begin, in units of their standard deviations, made independent.
const INSIDE: usize = 13;

/// A picture farther off than this, in standard deviations of its six numbers together, is left out. Chosen: 36 is
/// exceeded by a χ² of six with a probability of 3e-6.
pub(super) const CUT: f64 = 6.0;

/// All pictures and what is known beforehand.
pub(super) struct Refine<'a> {
    pub(super) mount: Mount,
    pub(super) robot: &'a [Isometry3<f64>],
    pub(super) sights: &'a [Sight],
    pub(super) board: &'a Target,
    pub(super) intrinsics: Intrinsics,
    /// Directions of the camera's numbers, one standard deviation long.
    inside: Vec<SVector<f64, INTRINSIC>>,
    /// Noise of a corner's coordinate, px.
    pub(super) corner: f64,
}

/// An answer and what belongs to it.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) camera: Isometry3<f64>,
    pub(super) board: Isometry3<f64>,
    pub(super) scale: f64,
    pub(super) noise: Noise,
    /// The parameters are changes from this.
    pub(super) from: (Isometry3<f64>, Isometry3<f64>, f64),
    pub(super) fit: Fit,
    whiten: Vec<Matrix6<f64>>,
    outliers: Vec<usize>,
    is_free: bool,
}

impl Fitted {
    pub(super) fn is_used(&self, picture: usize) -> bool {
        !self.outliers.contains(&picture)
    }

    /// Standard deviations of three parameters.
    pub(super) fn std(&self, from: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.fit.std(from + i))
    }
}

/// The least-squares problem at one set of weights.
struct Weighted<'a> {
    all: &'a Refine<'a>,
    from: (Isometry3<f64>, Isometry3<f64>, f64),
    whiten: &'a [Matrix6<f64>],
}

impl Problem for Weighted<'_> {
    fn n_residuals(&self) -> usize {
        6 * self.whiten.len()
    }

    fn block(&self) -> usize {
        6
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let (camera, board, scale) = moved(&self.from, x);
        for (i, (r, whiten)) in r.chunks_exact_mut(6).zip(self.whiten).enumerate() {
            let seen = self.all.seen(i, x, scale);
            let e = whiten * six(&off(self.all.mount, &self.all.robot[i], &camera, &board, &seen));
            r.copy_from_slice(e.as_slice());
        }
    }
}

/// A motion as turn and shift.
fn six(e: &Isometry3<f64>) -> Vector6<f64> {
    let (w, t) = (e.rotation.scaled_axis(), e.translation.vector);
    Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z)
}

/// Camera, board and scale at some parameters.
fn moved(
    from: &(Isometry3<f64>, Isometry3<f64>, f64),
    x: &[f64],
) -> (Isometry3<f64>, Isometry3<f64>, f64) {
    let pose = |start: &Isometry3<f64>, p: &[f64]| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(p[0], p[1], p[2]));
        let place = start.translation.vector + Vector3::new(p[3], p[4], p[5]);
        Isometry3::from_parts(Translation3::from(place), start.rotation * turn)
    };
    (pose(&from.0, &x[CAMERA..]), pose(&from.1, &x[BOARD..]), from.2 * x[SCALE].exp())
}

impl<'a> Refine<'a> {
    pub(super) fn new(
        mount: Mount,
        robot: &'a [Isometry3<f64>],
        sights: &'a [Sight],
        camera: &Known,
        target: &'a Target,
    ) -> Self {
        let corner = board::noise(sights);
        let inside = independent(camera);
        Self { mount, robot, sights, board: target, intrinsics: camera.intrinsics, inside, corner }
    }

    /// The camera's numbers, less those that were given.
    fn change(&self, x: &[f64]) -> SVector<f64, INTRINSIC> {
        self.inside.iter().zip(&x[INSIDE..]).map(|(direction, u)| direction * *u).sum()
    }

    /// Returns the camera's numbers at some parameters.
    pub(super) fn inside(&self, x: &[f64]) -> Intrinsics {
        let (d, k) = (self.change(x), self.intrinsics);
        Intrinsics {
            fx: k.fx + d[0],
            fy: k.fy + d[1],
            cx: k.cx + d[2],
            cy: k.cy + d[3],
            skew: k.skew + d[4],
            k1: k.k1 + d[5],
            k2: k.k2 + d[6],
            p1: k.p1 + d[7],
            p2: k.p2 + d[8],
            k3: k.k3 + d[9],
            k4: k.k4 + d[10],
            ..k
        }
    }

    /// Where a picture was taken from, in board coordinates.
    pub(super) fn seen(&self, picture: usize, x: &[f64], scale: f64) -> Isometry3<f64> {
        let sight = &self.sights[picture];
        sight.moved(&(sight.by_camera * self.change(x)), scale)
    }

    /// What a picture's residual is off by, turn and shift.
    pub(super) fn residual(&self, fitted: &Fitted, picture: usize) -> Vector6<f64> {
        self.against(fitted, picture, picture)
    }

    /// What a picture would be off by with another picture's row of the table.
    pub(super) fn against(&self, fitted: &Fitted, picture: usize, row: usize) -> Vector6<f64> {
        let seen = self.seen(picture, &fitted.fit.x, fitted.scale);
        six(&off(self.mount, &self.robot[row], &fitted.camera, &fitted.board, &seen))
    }

    /// How long what a picture would be off by with a row of the table is, in standard deviations. What its corners leave open, the
    /// distance most, lies in other directions of that row's flange than of its own.
    pub(super) fn length(&self, fitted: &Fitted, picture: usize, row: usize) -> f64 {
        let corners = self.corners(&fitted.from, &fitted.fit.x, picture, row);
        (whitening(&corners, fitted.noise) * self.against(fitted, picture, row)).norm()
    }

    /// Fits; with `is_free` the size of the squares too.
    ///
    /// # Errors
    ///
    /// As [`fit::solve`].
    pub(super) fn fit(
        &self,
        start: &Start,
        lever: f64,
        is_free: bool,
    ) -> Result<Fitted, fit::Error> {
        let scale = if is_free { start.scale } else { 1.0 };
        let from = (start.camera, start.board, scale);
        // A scale that is held while it is off spoils the first guess of the noise.
        let spoilt = if is_free { 0.0 } else { (start.scale - 1.0).abs() * lever };
        let mut noise = Noise {
            rotation: start.rotation.max(FINEST.rotation),
            position: start.position.max(spoilt).max(FINEST.position),
        };
        let mut x = vec![0.0; INSIDE + self.inside.len()];
        let options = self.options(is_free);
        let mut last = None;
        // The noise settles to a hundredth in four to fifteen rounds.
        for _ in 0..40 {
            let whiten = self.whitened(&from, &x, noise);
            let problem = Weighted { all: self, from, whiten: &whiten };
            let found = fit::solve_rejecting(&problem, &x, &options, CUT)?;
            x.clone_from(&found.fit.x);
            let (camera, board, scale) = moved(&from, &x);
            let (fit, outliers) = (found.fit, found.outliers);
            let fitted =
                Fitted { camera, board, scale, noise, from, fit, whiten, outliers, is_free };
            let next = self.noise(&fitted);
            let settled = |a: f64, b: f64| (a / b - 1.0).abs() < 0.01;
            let is_settled =
                settled(next.rotation, noise.rotation) && settled(next.position, noise.position);
            last = Some(fitted);
            if is_settled {
                break;
            }
            noise = next;
        }
        last.ok_or(fit::Error::NotFinite { residual: 0 })
    }

    /// Fits again without one picture more, the noise as it is.
    ///
    /// # Errors
    ///
    /// As [`fit::solve`].
    pub(super) fn without(&self, fitted: &Fitted, picture: usize) -> Result<Fitted, fit::Error> {
        let weight = |i| if fitted.is_used(i) && i != picture { 1.0 } else { 0.0 };
        let weights = (0..self.robot.len()).map(weight).collect();
        let options = fit::Options { weights, ..self.options(fitted.is_free) };
        let problem = Weighted { all: self, from: fitted.from, whiten: &fitted.whiten };
        let fit = fit::solve(&problem, &fitted.fit.x, &options)?;
        let (camera, board, scale) = moved(&fitted.from, &fit.x);
        Ok(Fitted { camera, board, scale, fit, ..fitted.clone() })
    }

    fn options(&self, is_free: bool) -> fit::Options {
        let prior = |k| Prior { parameter: INSIDE + k, mean: 0.0, std: 1.0 };
        fit::Options {
            noise: fit::Noise::Known,
            fixed: if is_free { Vec::new() } else { vec![SCALE] },
            priors: (0..self.inside.len()).map(prior).collect(),
            ..fit::Options::default()
        }
    }

    /// For each picture, what makes its residual one of six independent numbers of variance 1.
    fn whitened(
        &self,
        from: &(Isometry3<f64>, Isometry3<f64>, f64),
        x: &[f64],
        noise: Noise,
    ) -> Vec<Matrix6<f64>> {
        let each = (0..self.robot.len()).map(|i| whitening(&self.corners(from, x, i, i), noise));
        each.collect()
    }

    /// The part that comes from the corners of the covariance of what a picture is off by with a row of the table.
    fn corners(
        &self,
        from: &(Isometry3<f64>, Isometry3<f64>, f64),
        x: &[f64],
        picture: usize,
        row: usize,
    ) -> Matrix6<f64> {
        let (camera, board, scale) = moved(from, x);
        let sight = &self.sights[picture];
        let at = |change: Vector6<f64>| {
            let seen = sight.moved(&(sight.by_camera * self.change(x) + change), scale);
            six(&off(self.mount, &self.robot[row], &camera, &board, &seen))
        };
        // Central differences; a step of 1e-5 rad or m is far above rounding and far below any bend.
        let h = 1e-5;
        let mut slope = Matrix6::zeros();
        for k in 0..6 {
            let mut step = Vector6::zeros();
            step[k] = h;
            slope.set_column(k, &((at(step) - at(-step)) / (2.0 * h)));
        }
        slope * sight.covariance * slope.transpose() * self.corner.powi(2)
    }

    /// The robot's noise, better known by the residuals.
    fn noise(&self, fitted: &Fitted) -> Noise {
        let used: Vec<usize> = (0..self.robot.len()).filter(|&i| fitted.is_used(i)).collect();
        let of = |&i: &usize| {
            (self.residual(fitted, i), self.corners(&fitted.from, &fitted.fit.x, i, i))
        };
        let pictures: Vec<_> = used.iter().map(of).collect();
        let n = 6.0 * used.len() as f64;
        // Camera and board take 12 of the residuals, the squares one more.
        let taken = if fitted.is_free { 13.0 } else { 12.0 };
        noise::better(&pictures, fitted.noise, (1.0 - taken / n).max(1.0 / n))
    }
}

/// What makes a residual six independent numbers of variance 1, from the corners' part of its covariance and the robot's noise.
fn whitening(corners: &Matrix6<f64>, noise: Noise) -> Matrix6<f64> {
    let mut covariance = *corners;
    for k in 0..3 {
        covariance[(k, k)] += noise.rotation.powi(2);
        covariance[(3 + k, 3 + k)] += noise.position.powi(2);
    }
    let lower = covariance.cholesky().map(|c| c.l());
    lower.and_then(Matrix6::try_inverse).unwrap_or_else(Matrix6::identity)
}

/// Independent directions of the camera's numbers, each one standard deviation long.
fn independent(camera: &Known) -> Vec<SVector<f64, INTRINSIC>> {
    let std: Vec<f64> = (0..INTRINSIC).map(|i| camera.covariance[(i, i)].max(0.0).sqrt()).collect();
    let open: Vec<usize> = (0..INTRINSIC).filter(|&i| std[i] > 0.0 && std[i].is_finite()).collect();
    if open.is_empty() {
        return Vec::new();
    }
    let correlation = DMatrix::from_fn(open.len(), open.len(), |a, b| {
        camera.covariance[(open[a], open[b])] / (std[open[a]] * std[open[b]])
    });
    let eigen = correlation.symmetric_eigen();
    let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let all = directions.filter(|(value, _)| **value > 1e-12).map(|(value, vector)| {
        let mut direction = SVector::<f64, INTRINSIC>::zeros();
        for (v, &i) in vector.iter().zip(&open) {
            direction[i] = v * value.sqrt() * std[i];
        }
        direction
    });
    all.collect()
}
