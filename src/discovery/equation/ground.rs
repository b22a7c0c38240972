//! What the candidates are made from: how far states, rates and signals go along the recordings.

use super::candidates::{Ground, Range};
use super::columns::Data;
use super::compile::Compiled;
use super::fitting::Fitted;
use super::hypothesis::Question;
use super::score::lines;
use super::simulate::simulate;
use crate::language::ast::ModelItem;

impl Question<'_> {
    /// What the candidates are made from, at a fitted model.
    pub(super) fn ground<'m>(&'m self, fitted: &'m Fitted, model: &'m ModelItem) -> Ground<'m> {
        let compiled = &fitted.compiled;
        let bench = &self.bench;
        let n = compiled.states.len();
        let columns = self.along(fitted);
        let paths: Vec<Vec<f64>> = (0..n).map(|s| self.path(compiled, s, &columns)).collect();
        let of = |column: &Vec<f64>| Range::of(column.iter().copied());
        let over = |pick: &dyn Fn(&Data) -> &Vec<f64>| {
            let all: Vec<f64> = bench.train.iter().flat_map(|d| pick(d).iter().copied()).collect();
            Range::of(all.into_iter())
        };
        let duration =
            bench.train.iter().map(|d| d.time[d.n_rows() - 1] - d.time[0]).fold(0.0, f64::max);
        let step = bench.train.first().map_or(1.0, |data| data.step);
        Ground {
            model,
            given: &self.given,
            compiled,
            states: columns[..n].iter().map(of).collect(),
            rates: columns[n..].iter().map(of).collect(),
            turns: paths.iter().map(|path| turns(path)).collect(),
            still: paths.iter().map(|path| still(path)).collect(),
            inputs: (0..compiled.inputs.len()).map(|i| over(&|d| &d.inputs[i])).collect(),
            outputs: (0..compiled.outputs.len()).map(|o| over(&|d| &d.outputs[o])).collect(),
            step,
            row: bench.row,
            duration,
            stretch: bench.rows.map_or(duration, |rows| duration.min(rows as f64 * step)),
            lines: self.hums(fitted),
        }
    }

    /// How a state goes, or the one that it is the rate of: as measured where that is, since a model that lacks
    /// something may go elsewhere, else as simulated.
    fn path(&self, compiled: &Compiled, state: usize, columns: &[Vec<f64>]) -> Vec<f64> {
        let n = compiled.states.len();
        let own = compiled.state_regs[state];
        let place = (0..n).find(|q| *q != state && compiled.rates[*q] == own).unwrap_or(state);
        match compiled.outputs.iter().position(|output| output.state == Some(place)) {
            Some(o) => self.bench.train.iter().flat_map(|d| d.outputs[o].iter().copied()).collect(),
            None => columns[place].clone(),
        }
    }

    /// States, then their rates, along the recordings: a model whose outputs they are.
    pub(super) fn along(&self, fitted: &Fitted) -> Vec<Vec<f64>> {
        let (compiled, bench) = (&fitted.compiled, &self.bench);
        let probe = compiled.probing(compiled.state_regs.iter().chain(&compiled.rates).copied());
        let n = 2 * compiled.states.len();
        let mut columns = vec![Vec::new(); n];
        let windows = bench.task(compiled).windows;
        for (w, start) in windows.iter().zip(&fitted.train.point.starts) {
            let mut out = vec![0.0; w.rows.len() * n];
            let (data, params) = (&bench.train[w.data], &fitted.train.point.params);
            let run = simulate(&probe, data, w.rows.clone(), bench.scheme, params, start, &mut out);
            if run.is_ok() {
                for (k, column) in columns.iter_mut().enumerate() {
                    column.extend(out.iter().skip(k).step_by(n).copied());
                }
            }
        }
        columns
    }

    /// Lines of the residual's spectrum that the motion itself does not have, Hz.
    fn hums(&self, fitted: &Fitted) -> Vec<f64> {
        let (bench, all) = (&self.bench, &fitted.train.residuals);
        let (Some(first), Some(left)) = (bench.train.first(), all.first()) else {
            return Vec::new();
        };
        let windows = bench.task(&fitted.compiled).windows;
        // Windows share their edges; each row counts once.
        let (mut rows, mut kept) = (Vec::new(), Vec::new());
        let run = windows.iter().take_while(|w| w.data == 0).flat_map(|w| w.rows.clone());
        for (at, row) in run.enumerate().take(left.len()) {
            if rows.last() != Some(&row) {
                rows.push(row);
                kept.push(at);
            }
        }
        if rows.len() < 2 {
            return Vec::new();
        }
        let measured = |column: &[f64]| -> Vec<f64> { rows.iter().map(|r| column[*r]).collect() };
        let missed = |left: &[f64]| -> Vec<f64> { kept.iter().map(|at| left[*at]).collect() };
        let time = measured(&first.time);
        let longest = windows.iter().map(|w| w.rows.len()).max().unwrap_or(0);
        let run = longest as f64 * first.step;
        let mut found = lines(&time, &missed(left), 4);
        // What does not come round a few times in a run cannot be told from a drift.
        found.retain(|f| f * run >= 3.0);
        if found.is_empty() {
            return found;
        }
        let apart = 2.0 / (time[time.len() - 1] - time[0]).max(1e-300);
        let strongest = |column: &[f64]| lines(&time, column, STRONGEST);
        let mut own: Vec<f64> =
            first.inputs.iter().flat_map(|input| strongest(&measured(input))).collect();
        let mut seen = Vec::new();
        for (output, left) in first.outputs.iter().zip(all) {
            let output = measured(output);
            // What the model says is what was measured less what it misses of it.
            let said: Vec<f64> = output.iter().zip(missed(left)).map(|(y, r)| y - r).collect();
            own.extend(strongest(&said));
            seen.extend(strongest(&output));
        }
        found.retain(|f| !is_of_motion(*f, &own, &seen, apart));
        found.truncate(2);
        found
    }
}

/// How many of a signal's lines are looked at.
const STRONGEST: usize = 6;

/// A law that bends makes lines at so many times those of a motion.
const MOST_TIMES: u8 = 5;

/// Whether a line is one of the motion's, all in Hz: `own` are those of the inputs and of what the model says of the outputs,
/// `seen` those of the outputs as measured, where a hum that drives them stands as well, and lines of a law that the model
/// lacks at whole multiples of its own. Lines within `apart` are one.
fn is_of_motion(line: f64, own: &[f64], seen: &[f64], apart: f64) -> bool {
    let is_near = |other: f64| (line - other).abs() <= apart;
    let is_multiple = |f: &f64| (2..=MOST_TIMES).any(|times| is_near(f64::from(times) * f));
    let is_seen = || seen.iter().any(|f| is_near(*f));
    own.iter().any(|f| is_near(*f)) || is_seen() && own.iter().any(is_multiple)
}

/// The part of the time that a signal stands still: goes less than a fiftieth as far in a fiftieth of the time as it
/// does where it is fastest.
fn still(values: &[f64]) -> f64 {
    let apart = (values.len() / 50).max(1);
    let gone: Vec<f64> =
        values.iter().zip(values.iter().skip(apart)).map(|(a, b)| (b - a).abs()).collect();
    let farthest = gone.iter().copied().fold(0.0, f64::max);
    let near = gone.iter().filter(|way| **way <= 0.02 * farthest).count();
    near as f64 / gone.len().max(1) as f64
}

/// How often a signal turns round: goes back by a twentieth of all the way there is.
fn turns(values: &[f64]) -> usize {
    let range = Range::of(values.iter().copied());
    let back = 0.05 * (range.high - range.low);
    let Some(first) = values.first() else { return 0 };
    let (mut farthest, mut way, mut count) = (*first, 0.0, 0);
    for value in values {
        let gone = value - farthest;
        if way * gone > 0.0 {
            farthest = *value;
        } else if gone.abs() > back {
            count += usize::from(way != 0.0);
            (farthest, way) = (*value, gone.signum());
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::{is_of_motion, still, turns};

    #[test]
    fn a_wave_turns_twice_a_period_and_a_fall_never() {
        let wave: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.031_415_9).sin()).collect();
        assert_eq!(turns(&wave), 10);
        let thrown: Vec<f64> = (0..50).map(|i| 0.1 - 0.01 * f64::from(i * i)).collect();
        assert_eq!(turns(&thrown), 0);
        assert!(still(&thrown) < 0.1, "{}", still(&thrown));
    }

    /// A hum that drives an output puts its line there, and was taken for the motion's own.
    #[test]
    fn a_line_that_only_the_measurement_has_is_no_line_of_the_motion() {
        let (own, seen) = ([0.275, 0.575], [0.575, 1.3, 1.15]);
        assert!(!is_of_motion(1.3, &own, &seen, 0.05));
        assert!(is_of_motion(0.56, &own, &seen, 0.05));
        assert!(is_of_motion(1.15, &own, &seen, 0.05), "a multiple that is measured");
        assert!(!is_of_motion(1.725, &own, &seen, 0.05), "a multiple that is not");
    }

    #[test]
    fn what_slides_to_a_stop_comes_to_rest() {
        let slid: Vec<f64> = (0..100).map(|i| -f64::from(100 - i.min(80)).powi(2)).collect();
        assert!(still(&slid) > 0.1, "{}", still(&slid));
    }
}
