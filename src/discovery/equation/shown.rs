//! What shows an effect in a model's equations: what is left of the rates and the outputs without it, along the motion of the
//! model with it.
//!
//! What an effect adds is what the two models say differently at the same states. What is left with it is, of an output, measured
//! minus model, and of the rate of a state that is an output, or the rate of one, the divided differences of that: means over a
//! span, with the weights of a B-spline, so that nothing measured is differentiated. The same weights average what the effect
//! adds and the states. Where no rate that is measured shows it, the model is run without it from the same first values.
//!
//! Source: Larsen and `McCleary`, "The Use of Partial Residual Plots in Regression Analysis", 1972; Messenger and Bortz, "Weak
//! `SINDy`", 2021, for integrals instead of derivatives.

use std::ops::Range;

use super::columns::{Data, rms};
use super::compile::{Compiled, FreeParam, Output};
use super::edit::apply;
use super::estimate::Point;
use super::hypothesis::{Hypothesis, Question, with_values};
use super::simulate::{Scheme, said_at, simulate};
use super::unknown::UNKNOWN;
use crate::discovery::why::{Left, Seen, Shown, State, Why, why};
use crate::units::Dimension;

const TIME: &str = "time";
/// Half the width of a jump that is drawn as one.
const SHARP: f64 = 1e-9;
/// A span is long enough when noise scatters its means by this part of what the effect adds: points then lie visibly on a curve.
const CLEAR: f64 = 0.2;
/// Of a window a span is this part at most, so that what an effect adds at one state is not averaged with all others.
const MOST_SPAN: usize = 8;

/// A window of the data fitted or held out, with what the model does in it.
struct Run<'a> {
    data: &'a Data,
    rows: Range<usize>,
    held_out: bool,
    /// The model's states, one column each.
    states: Vec<Vec<f64>>,
    /// Its rates, then its outputs.
    said: Vec<Vec<f64>>,
    /// What of those the effect adds.
    adds: Vec<Vec<f64>>,
    /// Measured minus model, one column per output.
    left: Vec<Vec<f64>>,
    /// The same without the effect, run from the same first values; empty when it runs away.
    left_without: Vec<Vec<f64>>,
}

/// A channel in which an effect may be seen.
#[derive(Clone, Copy)]
enum Sight {
    /// The rate of a state, by differences of an output over some rows to each side, once or twice.
    Rate { state: usize, output: usize, order: usize, reach: usize },
    /// An output along the motion with the effect.
    Output(usize),
    /// An output where the model goes by itself.
    RunOff(usize),
}

impl Sight {
    /// Means of a column with the weights that this channel's values have.
    fn means(self, time: &[f64], values: &[f64]) -> Vec<f64> {
        match self {
            Self::Rate { order, reach, .. } => means(time, values, order, reach),
            _ => values.to_vec(),
        }
    }
}

impl Run<'_> {
    fn time(&self) -> &[f64] {
        &self.data.time[self.rows.clone()]
    }

    /// What is left of a channel with the effect, and without it.
    fn left(&self, sight: Sight) -> [Vec<f64>; 2] {
        let plus = |left: Vec<f64>, adds: &[f64]| {
            let without = left.iter().zip(adds).map(|(left, adds)| left + adds).collect();
            [left, without]
        };
        match sight {
            Sight::Rate { state, output, order, reach } => plus(
                differences(self.time(), &self.left[output], order, reach),
                &sight.means(self.time(), &self.adds[state]),
            ),
            Sight::Output(o) => plus(self.left[o].clone(), &self.adds[self.states.len() + o]),
            Sight::RunOff(o) => [self.left[o].clone(), self.left_without[o].clone()],
        }
    }
}

impl Question<'_> {
    /// Shows why some effects of a hypothesis are named, together.
    pub(super) fn why(
        &self,
        nominal: &Hypothesis,
        whole: &Hypothesis,
        which: Range<usize>,
    ) -> Option<Why> {
        let candidate = &whole.effects.get(which.start)?.candidate;
        let mut text = nominal.fitted.text.clone();
        for (_, other) in whole.effects.iter().enumerate().filter(|(i, _)| !which.contains(i)) {
            text = apply(&text, self.name, &with_values(&other.patch, &whole.fitted, false))?;
        }
        let without = exact(&self.bench.prepare(&text, self.name)?);
        let runs = self.runs(whole, &without);
        let model = &whole.fitted.compiled;
        let sights = self.sights(model, &runs);
        let of = |run: &Run, sight: Sight| {
            let (channel, unit, noise) = self.channel(model, sight);
            run.left(sight).map(|values| Left {
                channel: channel.clone(),
                unit: unit.clone(),
                noise,
                held_out: vec![run.held_out; values.len()],
                values,
            })
        };
        let all: Vec<(&Run, Sight)> =
            runs.iter().flat_map(|run| sights.iter().map(move |sight| (run, *sight))).collect();
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for (run, sight) in &all {
            let [one, other] = of(run, *sight);
            with.push(one);
            without.push(other);
        }
        let seen = Seen { channel: None, state: acts_by(candidate.kind, &candidate.at) };
        let (name, at) = (candidate.kind.to_owned(), candidate.at.clone());
        let shown = Shown { name, at, seen, without, with };
        let mut why = why(&shown, |k| states(model, all[k].0, all[k].1))?;
        let own = sights.iter().find(|sight| self.channel(model, **sight).0 == why.channel);
        if let Some(Sight::Rate { reach, .. }) = own {
            why.mean_over = Some(2.0 * *reach as f64 * self.step());
        }
        Some(why)
    }

    fn step(&self) -> f64 {
        self.bench.train.first().map_or(1.0, |data| data.step)
    }

    /// Runs a hypothesis, and what it says without some of its effects.
    fn runs(&self, whole: &Hypothesis, without: &Compiled) -> Vec<Run<'_>> {
        let (bench, model) = (&self.bench, &whole.fitted.compiled);
        let sets = [(&bench.train, &whole.fitted.train, false), (&bench.held, &whole.held, true)];
        let mut found = Vec::new();
        for (data, estimate, held_out) in sets {
            let mut row = 0;
            let windows = bench.task_on(model, data).windows;
            for (window, start) in windows.into_iter().zip(&estimate.point.starts) {
                let own = row..row + window.rows.len();
                row = own.end;
                let pair = Pair { model, without, scheme: bench.scheme, at: &estimate.point };
                let left = estimate.residuals.iter();
                let left = left.map(|all| all.get(own.clone()).map(<[f64]>::to_vec)).collect();
                let left: Option<Vec<Vec<f64>>> = left;
                let data = &data[window.data];
                found.extend(left.and_then(|left| {
                    pair.run(
                        Run {
                            data,
                            rows: window.rows,
                            held_out,
                            left,
                            states: Vec::new(),
                            said: Vec::new(),
                            adds: Vec::new(),
                            left_without: Vec::new(),
                        },
                        start,
                    )
                }));
            }
        }
        found
    }

    /// Returns the channels that show the effect: rates and outputs to which it adds and that are measured; where there are
    /// none, the outputs of the model that goes by itself.
    fn sights(&self, model: &Compiled, runs: &[Run]) -> Vec<Sight> {
        let n = model.states.len();
        let size = |k: usize| {
            let all: Vec<f64> = runs.iter().flat_map(|run| run.adds[k].iter().copied()).collect();
            rms(&all)
        };
        let shortest = runs.iter().map(|run| run.rows.len()).min().unwrap_or(0);
        let longest = (shortest / MOST_SPAN).max(1);
        let rate = |state: usize| {
            let (output, order) = measured(model, state)?;
            let clear = |reach: &usize| {
                let scatter = scatter(order, *reach as f64 * self.step());
                scatter * self.noise(output) <= CLEAR * size(state)
            };
            let reach = (1..longest).find(clear).unwrap_or(longest);
            (size(state) > 0.0).then_some(Sight::Rate { state, output, order, reach })
        };
        let outputs = 0..model.outputs.len();
        let read = outputs.clone().filter(|o| size(n + o) > 0.0).map(Sight::Output);
        let found: Vec<Sight> = (0..n).filter_map(rate).chain(read).collect();
        if !found.is_empty() || runs.iter().any(|run| run.left_without.is_empty()) {
            return found;
        }
        outputs.map(Sight::RunOff).collect()
    }

    /// Noise of an output.
    fn noise(&self, output: usize) -> f64 {
        self.bench.train.first().map_or(0.0, |data| data.noise[output])
    }

    /// A channel's name, unit and noise.
    fn channel(&self, model: &Compiled, sight: Sight) -> (String, String, f64) {
        match sight {
            Sight::Rate { state, output, order, reach } => {
                let name = &model.states[state].name;
                let noise = scatter(order, reach as f64 * self.step()) * self.noise(output);
                (rate_of(name), per_time(model, name), noise)
            }
            Sight::Output(o) | Sight::RunOff(o) => {
                let output = &model.outputs[o];
                (output.name.clone(), unit(output.dimension), self.noise(o))
            }
        }
    }
}

/// The states that a channel of a run may depend on: inputs and how fast they change, the model's states, what it says of
/// outputs, its rates, time.
fn states(model: &Compiled, run: &Run, sight: Sight) -> Vec<State> {
    let time = run.time();
    let state = |name: String, unit: String, values: &[f64]| State {
        name,
        unit,
        values: sight.means(time, values),
    };
    let mut found = Vec::new();
    for ((name, dimension), column) in model.inputs.iter().zip(&run.data.inputs) {
        let rows = &column[run.rows.clone()];
        found.push(state(name.clone(), unit(*dimension), rows));
        found.push(state(rate_of(name), per_time(model, name), &slopes(time, rows)));
    }
    for (own, column) in model.states.iter().zip(&run.states) {
        found.push(state(own.name.clone(), unit(model.units.of(&own.name)), column));
    }
    for (output, column) in model.outputs.iter().zip(&run.said[model.states.len()..]) {
        found.push(state(output.name.clone(), unit(output.dimension), column));
        found.push(state(
            rate_of(&output.name),
            per_time(model, &output.name),
            &slopes(time, column),
        ));
    }
    for (own, column) in model.states.iter().zip(&run.said) {
        found.push(state(rate_of(&own.name), per_time(model, &own.name), column));
    }
    found.push(state(TIME.into(), "s".into(), time));
    found
}

/// A model with an effect and without it.
struct Pair<'a> {
    model: &'a Compiled,
    without: &'a Compiled,
    scheme: Scheme,
    at: &'a Point,
}

impl Pair<'_> {
    /// Runs the model through a window, and says what it is without the effect at the same states.
    fn run<'d>(&self, run: Run<'d>, start: &[Option<f64>]) -> Option<Run<'d>> {
        let (model, without, params) = (self.model, self.without, &self.at.params);
        let (data, rows, n) = (run.data, run.rows.clone(), model.states.len());
        let probe = model.probing(model.state_regs.iter().copied());
        let mut out = vec![0.0; rows.len() * n];
        simulate(&probe, data, rows.clone(), self.scheme, params, start, &mut out).ok()?;
        let states: Vec<Vec<f64>> = (0..n).map(|s| column(&out, s, n)).collect();
        let said = said_at(&exact(model), data, rows.clone(), self.scheme, params, &states);
        // The model without it has fewer states and parameters; what it has is called the same.
        let place = |name: &str| model.states.iter().position(|state| state.name == name);
        let shared: Vec<usize> =
            without.states.iter().map(|state| place(&state.name)).collect::<Option<_>>()?;
        let fewer = inherited(without, model, self.at);
        let there: Vec<Vec<f64>> = shared.iter().map(|s| states[*s].clone()).collect();
        let less = said_at(without, data, rows.clone(), self.scheme, &fewer, &there);
        let rate = |s: usize| {
            // A state of the effect's own is not measured.
            let of = shared.iter().position(|own| *own == s);
            of.map_or_else(|| vec![0.0; rows.len()], |k| minus(&said[s], &less[k]))
        };
        let outputs = said[n..].iter().zip(&less[without.states.len()..]);
        let adds = (0..n).map(rate).chain(outputs.map(|(with, less)| minus(with, less))).collect();
        let starts: Vec<Option<f64>> =
            shared.iter().map(|s| start.get(*s).copied().flatten()).collect();
        let n_out = without.outputs.len();
        let mut alone = vec![0.0; rows.len() * n_out];
        let went = simulate(without, data, rows.clone(), self.scheme, &fewer, &starts, &mut alone);
        let left_without = match went {
            Ok(_) => (0..n_out)
                .map(|o| minus(&data.outputs[o][rows.clone()], &column(&alone, o, n_out)))
                .collect(),
            Err(_) => Vec::new(),
        };
        Some(Run { states, said, adds, left_without, ..run })
    }
}

/// One of `n` columns that stand row by row.
fn column(values: &[f64], at: usize, n: usize) -> Vec<f64> {
    values.iter().skip(at).step_by(n).copied().collect()
}

fn minus(with: &[f64], less: &[f64]) -> Vec<f64> {
    with.iter().zip(less).map(|(a, b)| a - b).collect()
}

/// The values of a model's parameters in another that has them as well.
fn inherited(model: &Compiled, from: &Compiled, at: &Point) -> Vec<f64> {
    let value = |param: &FreeParam| {
        let place = from.params.iter().position(|own| own.name == param.name);
        place.map_or(param.guess.unwrap_or(0.0), |k| at.params[k])
    };
    model.params.iter().map(value).collect()
}

/// The model with jumps where it is run with ramps.
fn exact(model: &Compiled) -> Compiled {
    let mut exact = model.clone();
    exact.widths = vec![SHARP; exact.sites.len()];
    exact
}

/// The state by which an effect of an equation acts; `None` where the data say.
fn acts_by(kind: &str, at: &str) -> Option<String> {
    match kind {
        "periodic_disturbance" | "output_drift" => Some(TIME.into()),
        // What is late stays behind by how fast it changes.
        "input_delay" | "sensor_delay" | "lag" => Some(format!("{at}'")),
        UNKNOWN => None,
        _ => Some(at.into()),
    }
}

/// The output by whose differences the rate of a state is measured, and of which order they are.
fn measured(model: &Compiled, state: usize) -> Option<(usize, usize)> {
    let read = |wanted: usize| {
        let is_it = |output: &Output| output.state == Some(wanted) && output.delay.is_none();
        model.outputs.iter().position(is_it)
    };
    if let Some(output) = read(state) {
        return Some((output, 1));
    }
    let own = model.state_regs[state];
    let place = (0..model.states.len()).find(|q| *q != state && model.rates[*q] == own)?;
    Some((read(place)?, 2))
}

fn unit(dimension: Option<Dimension>) -> String {
    dimension.map(Dimension::si).unwrap_or_default()
}

/// The unit of how fast something changes.
fn per_time(model: &Compiled, name: &str) -> String {
    unit(model.units.of(name).map(|dimension| dimension / Dimension::TIME))
}

/// The name of how fast something changes.
fn rate_of(name: &str) -> String {
    format!("{name}'")
}

/// By how much noise of 1 scatters a difference of some order over `span` to each side.
fn scatter(order: usize, span: f64) -> f64 {
    match order {
        1 => 2.0_f64.sqrt() / (2.0 * span),
        _ => 6.0_f64.sqrt() / (span * span),
    }
}

/// Divided differences of order 1 or 2 over `reach` rows to each side, as rates.
fn differences(time: &[f64], values: &[f64], order: usize, reach: usize) -> Vec<f64> {
    let slope = |a: usize, b: usize| (values[b] - values[a]) / (time[b] - time[a]);
    (reach..values.len().saturating_sub(reach))
        .map(|row| {
            let (a, b) = (row - reach, row + reach);
            if order == 1 {
                slope(a, b)
            } else {
                2.0 * (slope(row, b) - slope(a, row)) / (time[b] - time[a])
            }
        })
        .collect()
}

/// Means over `reach` rows to each side with the weights by which differences of an order average a rate: all the same, or
/// falling to both sides.
fn means(time: &[f64], values: &[f64], order: usize, reach: usize) -> Vec<f64> {
    (reach..values.len().saturating_sub(reach))
        .map(|row| {
            let (from, at, to) = (time[row - reach], time[row], time[row + reach]);
            let weight = |t: f64| match order {
                1 => 1.0,
                _ if t < at => (t - from) / (at - from),
                _ => (to - t) / (to - at),
            };
            let (mut sum, mut all) = (0.0, 0.0);
            for k in row - reach..row + reach {
                let h = time[k + 1] - time[k];
                let (a, b) = (weight(time[k]), weight(time[k + 1]));
                sum += 0.5 * h * (a * values[k] + b * values[k + 1]);
                all += 0.5 * h * (a + b);
            }
            sum / all
        })
        .collect()
}

/// Slopes of a column, row by row.
fn slopes(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let slope = |row: usize| {
        let (a, b) = (row.saturating_sub(1), (row + 1).min(last));
        if b > a { (values[b] - values[a]) / (time[b] - time[a]) } else { 0.0 }
    };
    (0..values.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_means_of_the_rate() {
        // Uneven rows; for a parabola both are exact.
        let time: Vec<f64> =
            (0..40).map(|k| f64::from(k) * 0.1 + 0.02 * f64::from(k % 3)).collect();
        let place: Vec<f64> = time.iter().map(|t| 1.5 * t * t).collect();
        let speed: Vec<f64> = time.iter().map(|t| 3.0 * t).collect();
        for (a, b) in differences(&time, &place, 1, 4).iter().zip(means(&time, &speed, 1, 4)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        for value in differences(&time, &place, 2, 4) {
            assert!((value - 3.0).abs() < 1e-9, "{value}");
        }
        let even: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
        let cubic: Vec<f64> = even.iter().map(|t| t * t * t).collect();
        let rate: Vec<f64> = even.iter().map(|t| 6.0 * t).collect();
        for (a, b) in differences(&even, &cubic, 2, 3).iter().zip(means(&even, &rate, 2, 3)) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
}
