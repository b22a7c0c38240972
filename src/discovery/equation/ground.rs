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
        let step = bench.train.first().map_or(1.0, Data::step);
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
        let bench = &self.bench;
        let (Some(first), Some(r)) = (bench.train.first(), fitted.train.residuals.first()) else {
            return Vec::new();
        };
        let windows = bench.task(&fitted.compiled).windows;
        // Windows share their edges; each row counts once.
        let (mut rows, mut left) = (Vec::new(), Vec::new());
        let run = windows.iter().take_while(|w| w.data == 0).flat_map(|w| w.rows.clone());
        for (row, value) in run.zip(r) {
            if rows.last() != Some(&row) {
                rows.push(row);
                left.push(*value);
            }
        }
        if rows.len() < 2 {
            return Vec::new();
        }
        let at = |column: &[f64]| -> Vec<f64> { rows.iter().map(|row| column[*row]).collect() };
        let time = at(&first.time);
        let longest = windows.iter().map(|w| w.rows.len()).max().unwrap_or(0);
        let run = longest as f64 * first.step();
        let mut found = lines(&time, &left, 4);
        // What does not come round a few times in a run cannot be told from a drift.
        found.retain(|f| f * run >= 3.0);
        if found.is_empty() {
            return found;
        }
        let apart = 2.0 / (time[time.len() - 1] - time[0]).max(1e-300);
        let of_motion: Vec<f64> = first
            .inputs
            .iter()
            .chain(&first.outputs)
            .flat_map(|column| lines(&time, &at(column), 6))
            .collect();
        found.retain(|f| of_motion.iter().all(|g| (f - g).abs() > apart));
        found.truncate(2);
        found
    }
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
    use super::{still, turns};

    #[test]
    fn a_wave_turns_twice_a_period_and_a_fall_never() {
        let wave: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.031_415_9).sin()).collect();
        assert_eq!(turns(&wave), 10);
        let thrown: Vec<f64> = (0..50).map(|i| 0.1 - 0.01 * f64::from(i * i)).collect();
        assert_eq!(turns(&thrown), 0);
        assert!(still(&thrown) < 0.1, "{}", still(&thrown));
    }

    #[test]
    fn what_slides_to_a_stop_comes_to_rest() {
        let slid: Vec<f64> = (0..100).map(|i| -f64::from(100 - i.min(80)).powi(2)).collect();
        assert!(still(&slid) > 0.1, "{}", still(&slid));
    }
}
