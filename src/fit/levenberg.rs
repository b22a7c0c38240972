//! Levenberg–Marquardt on the normal equations, with bounds, priors and a robust loss.
//!
//! Source: Madsen, Nielsen and Tingleff 2004, Algorithm 3.16 (damping after Nielsen); the robust loss
//! enters by iteratively reweighted least squares.

use nalgebra::{DMatrix, DVector};

use super::normal::{Normal, cholesky_solve, eigen, scaled};
use super::{
    Conditioning, Convergence, Direction, Error, Fit, Jacobian, Noise, Options, Prior, Problem,
    Wrong,
};

/// The problem with its options checked and its storage laid out.
struct Work<'a, P: Problem> {
    problem: &'a P,
    options: &'a Options,
    free: Vec<usize>,
    priors: Vec<Prior>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    block: usize,
}

/// Finds the parameters that fit best, starting at `x0`.
///
/// # Errors
///
/// [`Error::TooFew`], [`Error::NotFinite`] at `x0`, or [`Error::Option`] for an index out of range, a
/// prior or loss constant that is not above 0, or a list of the wrong length.
pub fn solve<P: Problem>(problem: &P, x0: &[f64], options: &Options) -> Result<Fit, Error> {
    let work = Work::new(problem, x0, options)?;
    let mut x: Vec<f64> = work.clamped(x0);
    let m = problem.n_residuals();
    let n = work.free.len();
    let mut r = vec![0.0; m];
    problem.residuals(&x, &mut r);
    if let Some(residual) = r.iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite { residual });
    }
    let mut cost = work.cost(&x, &r);
    let mut jacobian = Jacobian::zeros(m, x.len());
    let mut normal = Normal::zeros(n);
    let mut trial_r = vec![0.0; m];
    let (mut lambda, mut nu) = (1e-4, 2.0);
    let mut convergence = Convergence::IterationLimit;
    let mut iterations = 0;
    let mut stale = true;
    while iterations < options.max_iterations && n > 0 {
        if stale {
            work.linearise(&x, &r, &mut jacobian, &mut normal);
            work.add_priors(&x, &mut normal);
            stale = false;
        }
        iterations += 1;
        let length = normal.column_lengths();
        let Some(step) = work.step(&x, &normal, &length, lambda) else {
            lambda = (lambda * nu).max(1e-12);
            nu *= 2.0;
            if lambda > 1e20 {
                convergence = Convergence::Stalled;
                break;
            }
            continue;
        };
        let mut trial = x.clone();
        for (k, &i) in work.free.iter().enumerate() {
            trial[i] = (x[i] + step[k]).clamp(work.lower[i], work.upper[i]);
        }
        problem.residuals(&trial, &mut trial_r);
        let trial_cost = work.cost(&trial, &trial_r);
        let moved = step.component_mul(&length).norm();
        let size = work
            .free
            .iter()
            .zip(length.iter())
            .map(|(&i, l)| (x[i] * l).powi(2))
            .sum::<f64>()
            .sqrt();
        if trial_cost.is_finite() && trial_cost <= cost {
            // Predicted fall of the quadratic model: ½ δᵀ(λ D δ - g).
            let damped: f64 =
                step.iter().zip(length.iter()).map(|(d, l)| lambda * (d * l).powi(2)).sum();
            let predicted = 0.5 * (damped - step.dot(&normal.g));
            let gain = if predicted > 0.0 { (cost - trial_cost) / predicted } else { 1.0 };
            let fall = cost - trial_cost;
            x = trial;
            std::mem::swap(&mut r, &mut trial_r);
            let before = cost;
            cost = trial_cost;
            lambda *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(1.0 / 10.0, 2.0);
            lambda = lambda.max(1e-15);
            nu = 2.0;
            stale = true;
            if moved <= options.step_tolerance * (size + options.step_tolerance) {
                convergence = Convergence::Step;
                break;
            }
            if fall <= options.cost_tolerance * before && gain > 0.25 {
                convergence = Convergence::Cost;
                break;
            }
        } else {
            if moved <= options.step_tolerance * (size + options.step_tolerance) {
                convergence = Convergence::Step;
                break;
            }
            lambda *= nu;
            nu *= 2.0;
            if lambda > 1e20 {
                convergence = Convergence::Stalled;
                break;
            }
        }
    }
    if n == 0 {
        convergence = Convergence::Step;
    }
    work.linearise(&x, &r, &mut jacobian, &mut normal);
    Ok(work.finish(x, r, cost, iterations, convergence, normal))
}

impl<'a, P: Problem> Work<'a, P> {
    fn new(problem: &'a P, x0: &[f64], options: &'a Options) -> Result<Self, Error> {
        let n = x0.len();
        let block = problem.block().max(1);
        let wrong = |option, why: Wrong| Err(Error::Option { option, why });
        let outside = |index: usize| Wrong::NoParameter { index, n };
        if let Some(&i) = options.fixed.iter().find(|&&i| i >= n) {
            return wrong("fixed", outside(i));
        }
        if !options.scales.is_empty() && options.scales.len() != n {
            return wrong("scales", Wrong::PerParameter { given: options.scales.len(), n });
        }
        let n_blocks = problem.n_residuals().div_ceil(block);
        if !options.weights.is_empty() && options.weights.len() != n_blocks {
            let given = options.weights.len();
            return wrong("weights", Wrong::PerBlock { given, n: n_blocks });
        }
        if let Some(w) = options.weights.iter().find(|w| !w.is_finite() || **w < 0.0) {
            return wrong("weights", Wrong::Weight(*w));
        }
        if let Some(c) = options.loss.constant()
            && !(c.is_finite() && c > 0.0)
        {
            return wrong("loss", Wrong::Constant(c));
        }
        let free: Vec<usize> = (0..n).filter(|i| !options.fixed.contains(i)).collect();
        let mut priors = Vec::new();
        for prior in &options.priors {
            if prior.parameter >= n {
                return wrong("priors", outside(prior.parameter));
            }
            if !(prior.std > 0.0 && prior.mean.is_finite()) {
                return wrong("priors", Wrong::Prior { mean: prior.mean, std: prior.std });
            }
            if prior.std.is_finite() && !options.fixed.contains(&prior.parameter) {
                priors.push(*prior);
            }
        }
        let mut lower = vec![f64::NEG_INFINITY; n];
        let mut upper = vec![f64::INFINITY; n];
        for bound in &options.bounds {
            if bound.parameter >= n {
                return wrong("bounds", outside(bound.parameter));
            }
            if bound.lower.is_nan() || bound.upper.is_nan() || bound.lower > bound.upper {
                let (lower, upper) = (bound.lower, bound.upper);
                return wrong("bounds", Wrong::Empty { lower, upper });
            }
            lower[bound.parameter] = lower[bound.parameter].max(bound.lower);
            upper[bound.parameter] = upper[bound.parameter].min(bound.upper);
            if lower[bound.parameter] > upper[bound.parameter] {
                return wrong("bounds", Wrong::NoneLeft(bound.parameter));
            }
        }
        let work = Self { problem, options, free, priors, lower, upper, block };
        let residuals =
            (0..problem.n_residuals()).filter(|&i| work.weight(i / block) > 0.0).count();
        if residuals + work.priors.len() < work.free.len() {
            return Err(Error::TooFew {
                residuals,
                priors: work.priors.len(),
                parameters: work.free.len(),
            });
        }
        Ok(work)
    }

    fn clamped(&self, x: &[f64]) -> Vec<f64> {
        x.iter().enumerate().map(|(i, v)| v.clamp(self.lower[i], self.upper[i])).collect()
    }

    /// The given weight of a block.
    fn weight(&self, block: usize) -> f64 {
        self.options.weights.get(block).copied().unwrap_or(1.0)
    }

    /// Squared, weighted length of every block.
    fn blocks<'b>(&'b self, r: &'b [f64]) -> impl Iterator<Item = f64> + 'b {
        r.chunks(self.block).enumerate().map(|(b, chunk)| {
            let w = self.weight(b);
            if w > 0.0 { w * chunk.iter().map(|v| v * v).sum::<f64>() } else { 0.0 }
        })
    }

    fn cost(&self, x: &[f64], r: &[f64]) -> f64 {
        let data: f64 = self.blocks(r).map(|s2| self.options.loss.value(s2)).sum();
        let prior: f64 =
            self.priors.iter().map(|p| ((x[p.parameter] - p.mean) / p.std).powi(2)).sum();
        0.5 * (data + prior)
    }

    /// Fills the Jacobian and the normal equations of the data alone.
    fn linearise(&self, x: &[f64], r: &[f64], jacobian: &mut Jacobian, normal: &mut Normal) {
        jacobian.clear();
        if !self.problem.jacobian(x, jacobian) {
            self.differentiate(x, jacobian);
        }
        normal.clear();
        for (b, s2) in self.blocks(r).enumerate() {
            let weight = self.weight(b) * self.options.loss.weight(s2);
            let from = b * self.block;
            for (i, residual) in r.iter().enumerate().skip(from).take(self.block) {
                normal.add(jacobian.row(i), &self.free, *residual, weight);
            }
        }
    }

    fn add_priors(&self, x: &[f64], normal: &mut Normal) {
        for prior in &self.priors {
            let k = self.free.binary_search(&prior.parameter).expect("priors are on free ones");
            let information = prior.std.powi(-2);
            normal.a[(k, k)] += information;
            normal.g[k] += information * (x[prior.parameter] - prior.mean);
        }
    }

    /// Central differences; one-sided where a bound or the model's domain is in the way.
    fn differentiate(&self, x: &[f64], jacobian: &mut Jacobian) {
        let m = self.problem.n_residuals();
        let (mut ahead, mut behind) = (vec![0.0; m], vec![0.0; m]);
        let mut at = x.to_vec();
        for &i in &self.free {
            let scale = self.options.scales.get(i).copied().unwrap_or_else(|| x[i].abs().max(1.0));
            let h = f64::EPSILON.cbrt() * scale;
            let up = (x[i] + h).min(self.upper[i]);
            let down = (x[i] - h).max(self.lower[i]);
            at[i] = up;
            self.problem.residuals(&at, &mut ahead);
            at[i] = down;
            self.problem.residuals(&at, &mut behind);
            at[i] = x[i];
            let width = up - down;
            for (row, (a, b)) in ahead.iter().zip(&behind).enumerate() {
                let slope = (a - b) / width;
                jacobian.row_mut(row)[i] = if slope.is_finite() { slope } else { 0.0 };
            }
        }
    }

    /// The damped step over the free parameters; those held by a bound stay.
    fn step(
        &self,
        x: &[f64],
        normal: &Normal,
        length: &DVector<f64>,
        lambda: f64,
    ) -> Option<DVector<f64>> {
        let mut a = scaled(&normal.a, length);
        let mut b = -normal.g.component_div(length);
        for (k, &i) in self.free.iter().enumerate() {
            a[(k, k)] += lambda;
            let held =
                (x[i] <= self.lower[i] && b[k] < 0.0) || (x[i] >= self.upper[i] && b[k] > 0.0);
            if held {
                a.row_mut(k).fill(0.0);
                a.column_mut(k).fill(0.0);
                a[(k, k)] = 1.0;
                b[k] = 0.0;
            }
        }
        cholesky_solve(&a, &b).map(|step| step.component_div(length))
    }

    fn finish(
        &self,
        x: Vec<f64>,
        r: Vec<f64>,
        cost: f64,
        iterations: usize,
        convergence: Convergence,
        mut normal: Normal,
    ) -> Fit {
        let n = self.free.len();
        let loss = self.options.loss;
        let tolerance = self.options.rank_tolerance.powi(2);
        let (ratio, unobservable) = if n > 0 { self.unobservable(&normal) } else { (1.0, vec![]) };
        self.add_priors(&x, &mut normal);

        // Scale of the noise. Under a robust loss: Huber 1981, eq. 7.6.
        let (mut used, mut sum, mut psi2, mut slope, mut mean_weight) =
            (0_usize, 0.0, 0.0, 0.0, 0.0);
        let mut robust_weights = Vec::with_capacity(r.len().div_ceil(self.block));
        for (b, s2) in self.blocks(&r).enumerate() {
            let weight = loss.weight(s2);
            robust_weights.push(weight);
            if self.weight(b) > 0.0 {
                let from = b * self.block;
                let d = self.block.min(r.len() - from);
                used += d;
                sum += r[from..from + d].iter().map(|v| v * v).sum::<f64>();
                psi2 += weight * weight * s2;
                slope += (d - 1) as f64 * weight + loss.influence_slope(s2);
                mean_weight += d as f64 * weight;
            }
        }
        let count = used.max(1) as f64;
        let redundancy = used + self.priors.len();
        let noise2 = (redundancy > n).then(|| {
            let slope = if loss.is_none() { 1.0 } else { (slope / count).max(0.05) };
            psi2 / (redundancy - n) as f64 / (slope * slope)
        });
        let factor = match self.options.noise {
            Noise::Known => 1.0,
            Noise::Estimated => noise2.unwrap_or(0.0) * mean_weight / count,
        };

        let mut covariance = DMatrix::zeros(x.len(), x.len());
        let mut undetermined = Vec::new();
        if n > 0 {
            let length = normal.column_lengths();
            let (values, vectors) = eigen(&scaled(&normal.a, &length));
            let largest = values.max().max(f64::MIN_POSITIVE);
            let mut lost = vec![0.0; n];
            let mut inverse = DMatrix::<f64>::zeros(n, n);
            for (value, vector) in values.iter().zip(vectors.column_iter()) {
                if *value > tolerance * largest {
                    inverse.ger(1.0 / value, &vector, &vector, 1.0);
                } else {
                    for (l, v) in lost.iter_mut().zip(vector.iter()) {
                        *l += v * v;
                    }
                }
            }
            for (k, &i) in self.free.iter().enumerate() {
                if lost[k] > 1e-4 {
                    undetermined.push(i);
                }
            }
            for (k, &i) in self.free.iter().enumerate() {
                for (l, &j) in self.free.iter().enumerate() {
                    if lost[k] <= 1e-4 && lost[l] <= 1e-4 {
                        covariance[(i, j)] = factor * inverse[(k, l)] / (length[k] * length[l]);
                    }
                }
            }
        }
        Fit {
            x,
            covariance,
            cost,
            rms: (sum / count).sqrt(),
            noise_std: noise2.map(f64::sqrt),
            iterations,
            convergence,
            conditioning: Conditioning { ratio, unobservable, undetermined },
            residuals: r,
            robust_weights,
        }
    }

    /// The directions that the data alone leave free, and the least singular value over the largest.
    fn unobservable(&self, data: &Normal) -> (f64, Vec<Direction>) {
        let (values, vectors) = eigen(&scaled(&data.a, &data.column_lengths()));
        let largest = values.max().max(f64::MIN_POSITIVE);
        let mut directions = Vec::new();
        for (value, vector) in values.iter().zip(vectors.column_iter()) {
            let singular_value = (value.max(0.0) / largest).sqrt();
            if singular_value > self.options.rank_tolerance {
                continue;
            }
            let mut parameters: Vec<(usize, f64)> = self
                .free
                .iter()
                .zip(vector.iter())
                .filter(|(_, v)| v.abs() >= 0.1)
                .map(|(&i, &v)| (i, v))
                .collect();
            parameters.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
            directions.push(Direction { singular_value, parameters });
        }
        directions.sort_by(|a, b| a.singular_value.total_cmp(&b.singular_value));
        ((values.min().max(0.0) / largest).sqrt(), directions)
    }
}
