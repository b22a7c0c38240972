//! Noise and wrong matches, told by a model that can bend as no effect can: what even that does not explain is either
//! noise or a point matched to something else.
//!
//! The model adds to the known camera a polynomial of the picture of fifth degree in each channel (every lens within
//! it: `k1`, `k2`, `p1`, `p2`, focal lengths, principal point), and what depends on depth and time: where the camera
//! stands, how the table lies, delays. It is fitted with a loss that far points hardly pull. It is never told to
//! anyone: with few points it would explain noise, so its degree follows their number.
//!
//! Source: Huber, *Robust Statistics*, 1981; the median as a measure of scale: Rousseeuw and Croux, 1993.

use nalgebra::Vector2;

use super::bent::Bent;
use super::term::Law;
use super::views::{Data, nudge};
use crate::fit::{self, Jacobian, Loss, Prior, Problem};

/// Highest degree of the polynomial.
const DEGREE: u8 = 5;

/// At most this part of the residuals may be spent on parameters.
const SPEND: f64 = 0.6;

/// A point farther off than this many standard deviations is a wrong match: of clean ones, 4 in 100 000.
const CUT: f64 = 4.5;

/// Even a perfect camera has the rounding of the numbers in the file, px.
const FLOOR: f64 = 1e-6;

/// Median length of a two-dimensional normal vector.
const MEDIAN_OF_PAIR: f64 = 1.177_410;

/// What the flexible model says.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterEstimate {
    /// Standard deviation of a pixel coordinate, px; `None` if nothing is left to tell it from.
    pub sigma: Option<f64>,
    /// Indices of the wrong matches.
    pub wrong: Vec<usize>,
}

struct General<'a> {
    data: &'a Data,
    /// Effects known, with their parameters.
    known: (&'a [Law], &'a [f64]),
    /// Laws of the flexible model.
    laws: Vec<Law>,
    /// Parameters of the laws.
    n_law: usize,
    /// Values of the polynomial's terms, a row of [`Data::sights`] each.
    shapes: Vec<Vec<f64>>,
    /// Where each view's pose begins among the parameters; empty when poses are known.
    poses: Vec<usize>,
    n: usize,
    scales: Vec<f64>,
    sigma: f64,
}

impl<'a> General<'a> {
    fn new(data: &'a Data, known: (&'a [Law], &'a [f64])) -> Self {
        let mut laws = Vec::new();
        if data.posed {
            laws.push(Law::Shift([true; 6]));
            if data.sights.iter().filter(|sight| sight.on_table()).count() >= 4 {
                laws.push(Law::Table(true, true));
            }
        }
        if !data.tracks.is_empty() {
            laws.extend([Law::Delay, Law::Shutter]);
        }
        let specs: Vec<_> = laws.iter().flat_map(|law| law.specs(data.extent)).collect();
        let n_law = specs.len();
        let pose_parameters = if data.posed { 0 } else { 6 * data.views.len() };
        let budget = SPEND * 2.0 * data.sights.len() as f64 - (n_law + pose_parameters) as f64;
        let terms = |degree: u8| usize::from((degree + 1) * (degree + 2) / 2);
        let degree = (1..=DEGREE).rev().find(|degree| 2.0 * terms(*degree) as f64 <= budget);
        let shapes = shapes(data, known, degree.unwrap_or(0));
        let n_shape = shapes.first().map_or(0, Vec::len);
        let first_pose = n_law + 2 * n_shape;
        let poses = if data.posed {
            Vec::new()
        } else {
            (0..data.views.len()).map(|view| first_pose + 6 * view).collect()
        };
        let mut scales: Vec<f64> = specs.iter().map(|spec| spec.scale).collect();
        scales.resize(first_pose, 1.0);
        scales.resize(first_pose + pose_parameters, 1e-3);
        let n = scales.len();
        Self { data, known, laws, n_law, shapes, poses, n, scales, sigma: 1.0 }
    }

    fn bent(&self, x: &[f64]) -> Bent {
        let laws = [self.known.0, &self.laws].concat();
        let parameters = [self.known.1, &x[..self.n_law]].concat();
        Bent::new(&self.data.lens, self.data.up(), &laws, &parameters)
    }

    /// Model minus measured of a sight without the polynomial, in standard deviations.
    fn bare(&self, bent: &Bent, x: &[f64], at: usize) -> Vector2<f64> {
        let sight = &self.data.sights[at];
        let mut pose = self.data.views[sight.view].camera_from_world;
        if let Some(&from) = self.poses.get(sight.view) {
            pose = nudge(&x[from..from + 6]) * pose;
        }
        self.data.pixel(bent, &pose, sight).map_or_else(
            || Vector2::repeat(f64::INFINITY),
            |pixel| (pixel - sight.pixel) / self.sigma,
        )
    }

    /// Scale of the residuals from their median, allowing for the parameters spent; px.
    fn scale(&self, lengths: &mut [f64]) -> f64 {
        lengths.sort_by(f64::total_cmp);
        let median = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
        let residuals = 2.0 * lengths.len() as f64;
        let left = (residuals - self.n as f64).max(1.0);
        self.sigma * median / MEDIAN_OF_PAIR * (residuals / left).sqrt()
    }
}

/// Returns the polynomial's terms at every sight, each of size 1 at the edge of the picture.
fn shapes(data: &Data, known: (&[Law], &[f64]), degree: u8) -> Vec<Vec<f64>> {
    let bent = Bent::new(&data.lens, data.up(), known.0, known.1);
    data.sights
        .iter()
        .map(|sight| {
            let point = data.place(&bent, sight);
            let pose = &data.views[sight.view].camera_from_world;
            let c = pose.transform_point(&point.into());
            let (x, y) = (c.x / c.z / data.extent, c.y / c.z / data.extent);
            let mut terms = Vec::new();
            for total in 0..=degree {
                for j in 0..=total {
                    terms.push(x.powi(i32::from(total - j)) * y.powi(i32::from(j)));
                }
            }
            terms
        })
        .collect()
}

impl Problem for General<'_> {
    fn n_residuals(&self) -> usize {
        2 * self.data.sights.len()
    }

    fn block(&self) -> usize {
        2
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let bent = self.bent(x);
        for (at, r) in r.chunks_exact_mut(2).enumerate() {
            let mut value = self.bare(&bent, x, at);
            let terms = &self.shapes[at];
            for (i, term) in terms.iter().enumerate() {
                value.x += term * x[self.n_law + i] / self.sigma;
                value.y += term * x[self.n_law + terms.len() + i] / self.sigma;
            }
            r.copy_from_slice(value.as_slice());
        }
    }

    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        let rows = self.data.sights.len();
        let bent = self.bent(x);
        let here: Vec<Vector2<f64>> = (0..rows).map(|at| self.bare(&bent, x, at)).collect();
        for i in 0..self.n_law {
            let mut moved = x.to_vec();
            let step = 0.01 * self.scales[i];
            moved[i] += step;
            let bent = self.bent(&moved);
            for (at, here) in here.iter().enumerate() {
                let slope = (self.bare(&bent, &moved, at) - here) / step;
                j.row_mut(2 * at)[i] = slope.x;
                j.row_mut(2 * at + 1)[i] = slope.y;
            }
        }
        for (at, here) in here.iter().enumerate() {
            let terms = &self.shapes[at];
            for (i, term) in terms.iter().enumerate() {
                j.row_mut(2 * at)[self.n_law + i] = term / self.sigma;
                j.row_mut(2 * at + 1)[self.n_law + terms.len() + i] = term / self.sigma;
            }
            let Some(&from) = self.poses.get(self.data.sights[at].view) else { continue };
            for i in from..from + 6 {
                let mut moved = x.to_vec();
                moved[i] += 1e-6;
                let slope = (self.bare(&bent, &moved, at) - here) / 1e-6;
                j.row_mut(2 * at)[i] = slope.x;
                j.row_mut(2 * at + 1)[i] = slope.y;
            }
        }
        true
    }
}

/// Tells noise and wrong matches, and moves the first guesses of the poses to where this fit has them.
///
/// # Errors
///
/// As [`fit::solve`].
pub fn tell(data: &mut Data, known: (&[Law], &[f64])) -> Result<ParameterEstimate, fit::Error> {
    let copy = data.clone();
    let mut general = General::new(&copy, known);
    let rows = copy.sights.len();
    let n_shape = general.shapes.first().map_or(0, Vec::len);
    // Weak knowledge keeps apart what the points cannot: a turned camera and a bent picture.
    let prior = |parameter: usize, std: f64| Prior { parameter, mean: 0.0, std };
    let mut priors: Vec<Prior> =
        (0..general.n_law).map(|i| prior(i, 300.0 * general.scales[i])).collect();
    priors.extend((0..2 * n_shape).map(|i| prior(general.n_law + i, 1e3)));
    priors.extend(general.poses.iter().flat_map(|from| (0..6).map(move |i| prior(from + i, 1.0))));
    let mut options = fit::Options {
        loss: Loss::Cauchy(2.0),
        noise: fit::Noise::Known,
        max_iterations: 15,
        step_tolerance: 1e-6,
        cost_tolerance: 1e-6,
        priors,
        ..fit::Options::default()
    };
    let lengths = |r: &[f64]| -> Vec<f64> { r.chunks_exact(2).map(|c| c[0].hypot(c[1])).collect() };
    let mut x = vec![0.0; general.n];
    let mut r = vec![0.0; 2 * rows];
    general.residuals(&x, &mut r);
    let mut found = lengths(&r);
    for _ in 0..8 {
        let scale = general.scale(&mut found).max(FLOOR);
        let settled = (scale / general.sigma - 1.0).abs() < 0.02;
        general.sigma = scale;
        if settled {
            break;
        }
        let fit = fit::solve(&general, &x, &options)?;
        x = fit.x;
        found = lengths(&fit.residuals);
    }
    options.loss = Loss::None;
    let mut wrong: Vec<usize> = Vec::new();
    for _ in 0..4 {
        general.residuals(&x, &mut r);
        let found = lengths(&r);
        let now: Vec<usize> = (0..rows).filter(|&at| found[at] > CUT).collect();
        if now.len() * 2 > rows {
            break;
        }
        options.weights = (0..rows).map(|at| if now.contains(&at) { 0.0 } else { 1.0 }).collect();
        let fit = fit::solve(&general, &x, &options)?;
        x = fit.x;
        let settled = now == wrong;
        wrong = now;
        let kept: Vec<f64> = lengths(&fit.residuals)
            .into_iter()
            .enumerate()
            .filter(|(at, _)| !wrong.contains(at))
            .map(|(_, length)| length)
            .collect();
        let left = (2 * kept.len()).saturating_sub(general.n);
        if left > 0 {
            let square: f64 = kept.iter().map(|length| length * length).sum();
            general.sigma = (general.sigma * (square / left as f64).sqrt()).max(FLOOR);
        }
        if settled {
            break;
        }
    }
    let left = (2 * (rows - wrong.len())).saturating_sub(general.n);
    let sigma = (left >= 6).then_some(general.sigma);
    let poses: Vec<_> = general.poses.iter().map(|&from| nudge(&x[from..from + 6])).collect();
    drop(general);
    for (view, moved) in data.views.iter_mut().zip(poses) {
        view.camera_from_world = moved * view.camera_from_world;
    }
    for &at in &wrong {
        data.sights[at].wrong = true;
    }
    Ok(ParameterEstimate { sigma, wrong })
}
