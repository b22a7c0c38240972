//! The first fit of a model as it is given: many starts, short stretches first, then as long as its memory.

use rand::{RngExt, SeedableRng, rngs::StdRng};

use super::columns::{Data, rms};
use super::compile::Compiled;
use super::estimate::{Estimate, Point};
use super::fitting::{Bench, FEWEST, Fitted};
use super::simulate::{BlowUp, simulate_with_derivatives};

/// Why nothing could be fitted at all.
#[derive(Debug, Clone, PartialEq)]
pub struct NoFit {
    /// Where the model blew up, if it did.
    pub blow_up: Option<BlowUp>,
}

/// Where a fit of the whole model begins, or how far one has come.
#[derive(Debug, Clone)]
struct Start {
    /// Free parameters, in the model's units.
    params: Vec<f64>,
    /// First values of the states where the model leaves them free.
    states: Vec<f64>,
}

/// Fits the model as it is, starting from nothing: many starts, short windows first.
///
/// # Errors
///
/// [`NoFit`] when the model blows up from every start.
pub fn baseline(bench: &mut Bench, text: &str, name: &str, seed: u64) -> Result<Fitted, NoFit> {
    let compiled = bench.prepare(text, name).ok_or(NoFit { blow_up: None })?;
    let starts = starts(bench, &compiled, seed);
    let mut blow_up = None;
    let found = approached(&near(bench), &compiled, starts, &mut blow_up);
    let Some(first) = found.first() else { return Err(NoFit { blow_up }) };
    bench.rows = if fades(bench, &compiled, first) { None } else { Some(cut(bench)) };
    let best = best(bench, &compiled, &found, &mut blow_up);
    let (compiled, train) = best.ok_or(NoFit { blow_up })?;
    let mut fitted = Fitted { text: text.into(), compiled, train };
    while bench.lengthen(&mut fitted) {}
    bench.settle(&mut fitted);
    Ok(fitted)
}

/// Where to start: at what the model says, at parts and multiples of it, and where it says nothing at sizes drawn at random.
fn starts(bench: &Bench, compiled: &Compiled, seed: u64) -> Vec<Start> {
    let measured: f64 = bench
        .train
        .iter()
        .flat_map(|d| d.outputs.iter().map(|o| rms(o)))
        .fold(0.0, f64::max)
        .max(1e-9);
    let mut starts: Vec<Start> = Vec::new();
    let hidden = |by: f64| vec![by * measured; compiled.states.len()];
    let given =
        |or: f64| -> Vec<f64> { compiled.params.iter().map(|p| p.guess.unwrap_or(or)).collect() };
    for by in [0.0, 0.5, 1.0] {
        starts.push(Start { params: given(0.1), states: hidden(by) });
    }
    if !compiled.params.is_empty() {
        for by in [0.25, 4.0] {
            let params = given(0.1).iter().map(|v| v * by).collect();
            starts.push(Start { params, states: hidden(0.5) });
        }
    }
    if compiled.params.iter().any(|p| p.guess.is_none()) {
        for or in [1e-3, 1e-2, 1.0, 10.0, 100.0] {
            starts.push(Start { params: given(or), states: hidden(0.5) });
        }
        let mut rng = StdRng::seed_from_u64(seed);
        for _ in 0..40 {
            let params = drawn(compiled, &mut rng);
            starts.push(Start { params, states: hidden(rng.random_range(0.0..2.0)) });
        }
    }
    for Start { params, .. } in &mut starts {
        for (v, p) in params.iter_mut().zip(&compiled.params) {
            if let Some([low, high]) = p.range {
                *v = v.clamp(low, high);
            }
            if bench.anchored.contains(&p.name) {
                *v = p.guess.unwrap_or(*v);
            }
        }
    }
    starts
}

/// Draws the parameters of which the model says nothing; all sizes are as likely, and most signs are plus.
fn drawn(compiled: &Compiled, rng: &mut StdRng) -> Vec<f64> {
    compiled
        .params
        .iter()
        .map(|p| {
            let size = 10.0_f64.powf(rng.random_range(-3.5..1.5));
            let sign = if rng.random_range(0.0..1.0) < 0.15 { -1.0 } else { 1.0 };
            p.guess.unwrap_or(sign * size)
        })
        .collect()
}

/// Returns the bench with few rows in short windows, which make the way from a far start nearly straight.
fn near(bench: &Bench) -> Bench {
    let n_rows: usize = bench.train.iter().map(Data::n_rows).sum();
    let short = Bench {
        train: bench
            .train
            .iter()
            .map(|d| d.thinned((n_rows / 1500).max(1).min(d.thinning((n_rows / 1500).max(1)))))
            .collect(),
        ..bench.clone()
    };
    let short_rows: usize = short.train.iter().map(Data::n_rows).sum();
    let short_rows = short_rows.min(bench.most_rows);
    Bench { rows: Some((short_rows / 30).max(12)), ..short }
}

/// Fits a little from every start; returns the six that came nearest, nearest first.
fn approached(
    near: &Bench,
    compiled: &Compiled,
    starts: Vec<Start>,
    blow_up: &mut Option<BlowUp>,
) -> Vec<Start> {
    let mut found: Vec<(f64, Start)> = Vec::new();
    for Start { params, states } in starts {
        let mut model = compiled.clone();
        let point = Point { params, starts: near.task(&model).starts(&states) };
        near.set_ramps(&mut model, &point);
        let task = near.task(&model);
        match task.judge(&point) {
            Ok(_) => {}
            Err(error) => {
                blow_up.get_or_insert(error);
                continue;
            }
        }
        let fitted =
            if compiled.params.is_empty() && point.starts.iter().flatten().flatten().count() == 0 {
                task.judge(&point).ok()
            } else {
                task.fit(&point, 12).ok()
            };
        if let Some(fit) = fitted
            && fit.residuals.iter().all(|r| !r.is_empty())
        {
            let first: Vec<f64> = (0..compiled.states.len())
                .map(|s| fit.point.starts.first().and_then(|w| w[s]).unwrap_or(states[s]))
                .collect();
            found.push((cost(near, &fit), Start { params: fit.point.params, states: first }));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(6);
    found.into_iter().map(|(_, start)| start).collect()
}

/// Fits on from each of `found`; returns the best model with its fit.
fn best(
    bench: &Bench,
    compiled: &Compiled,
    found: &[Start],
    blow_up: &mut Option<BlowUp>,
) -> Option<(Compiled, Estimate)> {
    let mut best: Option<(f64, Compiled, Estimate)> = None;
    for Start { params, states } in found {
        let mut model = compiled.clone();
        let point = Point { params: params.clone(), starts: bench.task(&model).starts(states) };
        bench.set_ramps(&mut model, &point);
        let task = bench.task(&model);
        let free = point.params.len() + point.starts.iter().flatten().flatten().count();
        let fit = if free == 0 {
            match task.judge(&point) {
                Ok(fit) => Some(fit),
                Err(error) => {
                    blow_up.get_or_insert(error);
                    None
                }
            }
        } else {
            task.fit(&point, 60).ok().filter(|f| f.residuals.iter().all(|r| !r.is_empty()))
        };
        if let Some(fit) = fit {
            let cost = cost(bench, &fit);
            if best.as_ref().is_none_or(|(b, ..)| cost < *b * (1.0 - 1e-9)) {
                best = Some((cost, model, fit));
            }
        }
    }
    best.map(|(_, model, fit)| (model, fit))
}

/// How much a fit leaves of all outputs, each in units of its scale, in squares.
fn cost(bench: &Bench, fit: &Estimate) -> f64 {
    fit.rms().iter().zip(&bench.scales).map(|(r, s)| (r / s).powi(2)).sum()
}

/// Rows of a window for a model whose memory does not fade.
fn cut(bench: &Bench) -> usize {
    let longest = bench.train.iter().map(Data::n_rows).max().unwrap_or(0);
    let share = bench.most_rows / bench.train.len().max(1);
    (longest / 10).min(share / FEWEST).max(40)
}

/// Whether what a state is at first no longer matters at the end of a recording.
fn fades(bench: &Bench, model: &Compiled, Start { params, states: first }: &Start) -> bool {
    if model.states.is_empty() {
        return true;
    }
    let through = Bench { rows: None, ..bench.clone() };
    let mut model = model.clone();
    let point = Point { params: params.clone(), starts: through.task(&model).starts(first) };
    through.set_ramps(&mut model, &point);
    let task = through.task(&model);
    let longest = (0..task.windows.len()).max_by_key(|i| task.windows[*i].rows.len());
    let Some(window) = longest.map(|i| &task.windows[i]) else { return true };
    let start: Vec<Option<f64>> =
        first.iter().map(|v| Some(if *v == 0.0 { 1e-3 } else { *v })).collect();
    let mut jacobian = Vec::new();
    let run = simulate_with_derivatives(
        &model,
        &bench.train[window.data],
        window.rows.clone(),
        bench.scheme,
        (params, false),
        &start,
        &mut jacobian,
    );
    if run.is_err() {
        return false;
    }
    let (n_out, n) = (model.outputs.len(), params.len() + start.len());
    let size = |row: usize| -> f64 {
        (0..n_out)
            .flat_map(|o| (params.len()..n).map(move |k| (o, k)))
            .map(|(o, k)| (jacobian[(row * n_out + o) * n + k] / bench.scales[o]).abs())
            .fold(0.0, f64::max)
    };
    let rows = window.rows.len();
    let peak = (0..rows).map(size).fold(0.0, f64::max);
    let end = (rows - rows / 5 - 1..rows).map(size).fold(0.0, f64::max);
    end.is_finite() && end <= 0.05 * peak
}
