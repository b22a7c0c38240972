//! Free parameters and first values from recordings: output error over one or many stretches.
//!
//! A model whose memory fades is run once through a recording; one that integrates (a cart, a pendulum
//! without friction) would carry every small disturbance on for ever, so its recording is cut into
//! windows with first values of their own (multiple shooting). The residuals are in units of each
//! output's scale; [`crate::fit`] does the rest.
//!
//! Source: Ljung, *System Identification*, 2nd ed., 1999, §7.5; Bock, "Recent Advances in Parameter
//! Identification Techniques for ODE", 1983 (multiple shooting).

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::discovery::resample::is_unseen;
use crate::fit::{self, Bound, Fit, Jacobian, Loss, Noise, Options, Problem};

use super::columns::Data;
use super::compile::Compiled;
use super::simulate::{BlowUp, Scheme, simulate, simulate_with_derivatives};
use super::windows::Window;

/// A fitting task: a model, the recordings, how they are cut and weighed.
#[derive(Debug, Clone)]
pub struct Task<'a> {
    /// The model.
    pub model: &'a Compiled,
    /// The recordings.
    pub data: &'a [Data],
    /// The stretches that are run.
    pub windows: Vec<Window>,
    /// How they are run.
    pub scheme: Scheme,
    /// The scale of each output's residual.
    pub scales: Vec<f64>,
    /// Whether first values that the model gives are estimated all the same.
    pub all_starts_free: bool,
    /// Whether the parameters stay as they are, so that first values alone are estimated.
    pub params_fixed: bool,
    /// Of the parameters that are estimated those that stay as they are.
    pub held: Vec<usize>,
    /// Counts the steps that are run, each as often as it has derivatives.
    pub work: &'a AtomicU64,
}

/// Parameters and first values.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The free parameters.
    pub params: Vec<f64>,
    /// For each window, the first value of each state; `None` where the model gives it.
    pub starts: Vec<Vec<Option<f64>>>,
}

/// A fitted point with what the data say about it.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Where.
    pub point: Point,
    /// Standard deviations of the free parameters; infinite where the data do not tell.
    pub std: Vec<f64>,
    /// Sum of squares and number of the residuals of each output, in its own unit.
    pub sums: Vec<(f64, usize)>,
    /// The same of rows held out that decide nothing; none of data that are fitted.
    pub unseen: Vec<(f64, usize)>,
    /// Measured minus model by output, rows of all windows in a row.
    pub residuals: Vec<Vec<f64>>,
    /// Parameters that the data do not determine, with what they trade against.
    pub undetermined: Vec<String>,
}

impl Estimate {
    /// Root mean square of each output's residuals.
    pub fn rms(&self) -> Vec<f64> {
        rms(&self.sums)
    }

    /// The same of the rows that decide nothing.
    pub fn rms_unseen(&self) -> Vec<f64> {
        rms(&self.unseen)
    }

    /// Returns the estimate of data that are held out, of which a part decides nothing.
    #[must_use]
    pub fn set_aside(mut self) -> Self {
        let of = |unseen: bool| -> Vec<Vec<f64>> {
            self.residuals.iter().map(|all| rows_that(all, unseen)).collect()
        };
        (self.sums, self.unseen) = (sums(&of(false)), sums(&of(true)));
        self
    }
}

impl Task<'_> {
    /// Whether a state's first value is estimated in a window.
    pub fn is_free(&self, window: &Window, state: usize) -> bool {
        let begins = window.rows.start == 0 && self.data[window.data].begins;
        self.all_starts_free || !begins || self.model.states[state].fixed.is_none()
    }

    /// First values as far as the measurements show them: a state that is an output is read off, a state
    /// that is the rate of one is its slope, others keep `other` or are 0.
    pub fn starts(&self, other: &[f64]) -> Vec<Vec<Option<f64>>> {
        let read: Vec<Vec<f64>> = self.windows.iter().map(|w| self.read_start(w, other)).collect();
        self.windows
            .iter()
            .zip(read)
            .map(|(w, values)| {
                values
                    .into_iter()
                    .enumerate()
                    .map(|(s, v)| self.is_free(w, s).then_some(v))
                    .collect()
            })
            .collect()
    }

    fn read_start(&self, window: &Window, other: &[f64]) -> Vec<f64> {
        let (model, data) = (self.model, &self.data[window.data]);
        let measured = |state: usize| model.outputs.iter().position(|o| o.state == Some(state));
        let rows = window.rows.clone();
        let few = rows.start..(rows.start + 5).min(rows.end);
        (0..model.states.len())
            .map(|s| {
                let clamp =
                    |v: f64| model.states[s].range.map_or(v, |[low, high]| v.clamp(low, high));
                if let Some(o) = measured(s) {
                    return clamp(data.outputs[o][rows.start]);
                }
                // `q' = v` with q measured: v is its slope.
                let of = (0..model.states.len()).find(|&q| model.rates[q] == model.state_regs[s]);
                if let Some(o) = of.and_then(measured) {
                    return clamp(slope(&data.time[few.clone()], &data.outputs[o][few.clone()]));
                }
                clamp(model.states[s].guess.unwrap_or_else(|| other.get(s).copied().unwrap_or(0.0)))
            })
            .collect()
    }

    /// Number of parameters that are estimated.
    pub fn n_params(&self) -> usize {
        if self.params_fixed { 0 } else { self.model.params.len() }
    }

    /// Free values in the order the solver sees them.
    fn flat(&self, point: &Point) -> Vec<f64> {
        let starts = point.starts.iter().flatten().filter_map(|v| *v);
        point.params.iter().take(self.n_params()).copied().chain(starts).collect()
    }

    fn point(&self, x: &[f64], like: &Point) -> Point {
        let n = self.n_params();
        let mut rest = x[n..].iter();
        let starts = like
            .starts
            .iter()
            .map(|w| w.iter().map(|v| v.map(|v| rest.next().copied().unwrap_or(v))).collect())
            .collect();
        let params = if self.params_fixed { like.params.clone() } else { x[..n].to_vec() };
        Point { params, starts }
    }

    fn n_rows(&self) -> usize {
        self.windows.iter().map(|w| w.rows.len()).sum()
    }

    /// Runs the model at a point; outputs row by row, windows in a row.
    ///
    /// # Errors
    ///
    /// [`BlowUp`] from the first window whose states are no longer finite.
    pub fn run(&self, point: &Point) -> Result<Vec<f64>, BlowUp> {
        self.count(1);
        let n_out = self.model.outputs.len();
        let parts: Vec<Result<Vec<f64>, BlowUp>> = self
            .windows
            .par_iter()
            .zip(&point.starts)
            .map(|(w, start)| {
                let mut out = vec![0.0; w.rows.len() * n_out];
                simulate(
                    self.model,
                    &self.data[w.data],
                    w.rows.clone(),
                    self.scheme,
                    &point.params,
                    start,
                    &mut out,
                )?;
                Ok(out)
            })
            .collect();
        let mut all = Vec::with_capacity(self.n_rows() * n_out);
        for part in parts {
            all.extend(part?);
        }
        Ok(all)
    }

    fn count(&self, columns: usize) {
        let steps = self.n_rows() * self.scheme.substeps * columns;
        self.work.fetch_add(steps as u64, Ordering::Relaxed);
    }

    /// Measured minus model by output.
    ///
    /// # Errors
    ///
    /// As [`Self::run`].
    pub fn residuals(&self, point: &Point) -> Result<Vec<Vec<f64>>, BlowUp> {
        let n_out = self.model.outputs.len();
        let values = self.run(point)?;
        let mut out = vec![Vec::with_capacity(self.n_rows()); n_out];
        let mut at = 0;
        for w in &self.windows {
            for row in w.rows.clone() {
                for (o, column) in out.iter_mut().enumerate() {
                    column.push(self.data[w.data].outputs[o][row] - values[at + o]);
                }
                at += n_out;
            }
        }
        Ok(out)
    }

    /// Fits the free parameters and first values, starting at `point`.
    ///
    /// # Errors
    ///
    /// [`fit::Error`] when the model blows up at the start or there is too little data.
    pub fn fit(&self, point: &Point, max_iterations: usize) -> Result<Estimate, fit::Error> {
        let x0 = self.flat(point);
        let problem = Shooting { task: self, like: point };
        let mut bounds = Vec::new();
        for (i, param) in self.model.params.iter().take(self.n_params()).enumerate() {
            if let Some([lower, upper]) = param.range {
                bounds.push(Bound { parameter: i, lower, upper });
            }
        }
        let mut index = self.n_params();
        for start in &point.starts {
            for (s, _) in start.iter().enumerate().filter(|(_, v)| v.is_some()) {
                if let Some([lower, upper]) = self.model.states[s].range {
                    bounds.push(Bound { parameter: index, lower, upper });
                }
                index += 1;
            }
        }
        let options = Options {
            loss: Loss::Huber(6.0),
            noise: Noise::Estimated,
            max_iterations,
            step_tolerance: 1e-7,
            cost_tolerance: 1e-7,
            fixed: self.held.clone(),
            bounds,
            ..Options::default()
        };
        let fit = fit::solve(&problem, &x0, &options)?;
        Ok(self.estimate(&fit, point))
    }

    /// The residuals at a point, model minus measured in units of the scales, and their derivatives, one
    /// column per parameter and free first value; `None` when the model blows up.
    pub fn linearised(&self, point: &Point) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
        let problem = Shooting { task: self, like: point };
        let x = self.flat(point);
        let n = problem.n_residuals();
        let mut residuals = vec![0.0; n];
        problem.residuals(&x, &mut residuals);
        let mut jacobian = Jacobian::zeros(n, x.len());
        if residuals.iter().any(|r| !r.is_finite()) || !problem.jacobian(&x, &mut jacobian) {
            return None;
        }
        let mut columns = vec![Vec::with_capacity(n); x.len()];
        for row in 0..n {
            for (column, value) in columns.iter_mut().zip(jacobian.row_mut(row).iter()) {
                column.push(*value);
            }
        }
        Some((residuals, columns))
    }

    /// Judges a point as it is.
    ///
    /// # Errors
    ///
    /// [`BlowUp`] when the model does.
    pub fn judge(&self, point: &Point) -> Result<Estimate, BlowUp> {
        let residuals = self.residuals(point)?;
        Ok(Estimate {
            sums: sums(&residuals),
            unseen: Vec::new(),
            std: vec![0.0; point.params.len()],
            point: point.clone(),
            residuals,
            undetermined: Vec::new(),
        })
    }

    fn estimate(&self, fit: &Fit, like: &Point) -> Estimate {
        let point = self.point(&fit.x, like);
        let n = self.n_params();
        let residuals =
            self.residuals(&point).unwrap_or_else(|_| vec![Vec::new(); self.model.outputs.len()]);
        let mut undetermined = Vec::new();
        for direction in &fit.conditioning.unobservable {
            let names: Vec<&str> = direction
                .parameters
                .iter()
                .filter(|(i, _)| *i < n)
                .map(|(i, _)| self.model.params[*i].name.as_str())
                .collect();
            if !names.is_empty() {
                undetermined.push(names.join(", "));
            }
        }
        Estimate {
            std: (0..point.params.len()).map(|i| if i < n { fit.std(i) } else { 0.0 }).collect(),
            sums: sums(&residuals),
            unseen: Vec::new(),
            point,
            residuals,
            undetermined,
        }
    }
}

fn rms(sums: &[(f64, usize)]) -> Vec<f64> {
    sums.iter().map(|(ss, n)| (ss / (*n).max(1) as f64).sqrt()).collect()
}

/// Returns the residuals of data held out that decide nothing, or the others.
pub fn rows_that(residuals: &[f64], unseen: bool) -> Vec<f64> {
    let n = residuals.len();
    let rows = residuals.iter().enumerate();
    rows.filter(|(row, _)| is_unseen(*row, n) == unseen).map(|(_, value)| *value).collect()
}

fn sums(residuals: &[Vec<f64>]) -> Vec<(f64, usize)> {
    residuals.iter().map(|r| (r.iter().map(|v| v * v).sum(), r.len())).collect()
}

/// Slope of a straight line through a few points.
fn slope(time: &[f64], values: &[f64]) -> f64 {
    let (tm, vm) = (super::columns::mean(time), super::columns::mean(values));
    let (mut a, mut b) = (0.0, 0.0);
    for (t, v) in time.iter().zip(values) {
        a += (t - tm) * (v - vm);
        b += (t - tm).powi(2);
    }
    if b > 0.0 { a / b } else { 0.0 }
}

/// The residuals of a task as a least-squares problem.
struct Shooting<'a> {
    task: &'a Task<'a>,
    like: &'a Point,
}

impl Problem for Shooting<'_> {
    fn n_residuals(&self) -> usize {
        self.task.n_rows() * self.task.model.outputs.len()
    }

    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let point = self.task.point(x, self.like);
        let Ok(values) = self.task.run(&point) else {
            r.fill(f64::NAN);
            return;
        };
        let n_out = self.task.model.outputs.len();
        let mut at = 0;
        for w in &self.task.windows {
            for row in w.rows.clone() {
                for o in 0..n_out {
                    let measured = self.task.data[w.data].outputs[o][row];
                    r[at] = (values[at] - measured) / self.task.scales[o];
                    at += 1;
                }
            }
        }
    }

    fn jacobian(&self, x: &[f64], j: &mut Jacobian) -> bool {
        let task = self.task;
        let point = task.point(x, self.like);
        let n_params = task.n_params();
        task.count(1 + task.model.params.len() + task.model.states.len());
        let n_out = task.model.outputs.len();
        let parts: Vec<Option<Vec<f64>>> = task
            .windows
            .par_iter()
            .zip(&point.starts)
            .map(|(w, start)| {
                let mut part = Vec::new();
                simulate_with_derivatives(
                    task.model,
                    &task.data[w.data],
                    w.rows.clone(),
                    task.scheme,
                    (&point.params, task.params_fixed),
                    start,
                    &mut part,
                )
                .ok()?;
                Some(part)
            })
            .collect();
        let (mut row, mut first) = (0, n_params);
        for ((w, start), part) in task.windows.iter().zip(&point.starts).zip(parts) {
            let Some(part) = part else { return false };
            let n_free = start.iter().flatten().count();
            let n = n_params + n_free;
            for i in 0..w.rows.len() * n_out {
                let by = 1.0 / task.scales[i % n_out];
                let to = j.row_mut(row);
                for k in 0..n {
                    let column = if k < n_params { k } else { first + k - n_params };
                    let d = part[i * n + k] * by;
                    to[column] = if d.is_finite() { d } else { 0.0 };
                }
                row += 1;
            }
            first += n_free;
        }
        true
    }
}
