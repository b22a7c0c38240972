//! A compiled model run along a recording.
//!
//! Inputs are held from row to row, or joined by straight lines or smooth curves ([`Hold`]); between two
//! rows the state is carried by a fixed number of classical Runge–Kutta steps, so that a simulation is a
//! smooth function of its parameters and can be differentiated. Where a `sign` or a `step` is about to
//! turn over, the steps are shorter: its ramp is far narrower than a step.

use std::ops::Range;

use super::columns::Data;
use super::compile::Compiled;
use super::integrate::{Rates, Work, rk4};
use super::number::{Dual, Number};

/// What an input does between two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// It keeps the value of the row before: a command from a computer.
    Zero,
    /// It follows a straight line: something measured.
    Line,
    /// It follows a cubic through the rows around: something smooth.
    Curve,
}

/// A state that is no longer a finite number.
#[derive(Debug, Clone, PartialEq)]
pub struct BlowUp {
    /// Which state, or which output of a model without states.
    pub what: String,
    /// When, s.
    pub t: f64,
}

/// Beyond this a state counts as infinite.
const TOO_LARGE: f64 = 1e15;

/// How to run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    /// What inputs do between rows.
    pub hold: Hold,
    /// Runge–Kutta steps per usual step of the recording.
    pub substeps: usize,
    /// By how much later than written an input acts, s: below one row a matter of how the recording was
    /// taken, not of the machine.
    pub shift: f64,
}

/// The rates of a model between two rows.
struct Between<'a, N> {
    model: &'a Compiled,
    data: &'a Data,
    frame: &'a mut [N],
    row: usize,
    /// The row whose value a held input has.
    held: usize,
    /// Where the step begins that is taken, and its length, s; 0 before the first.
    step: (f64, f64),
    scheme: Scheme,
}

impl<N: Number> Between<'_, N> {
    /// Puts inputs and time at `t` into their registers; `s` is the part of the way to the next row.
    #[inline(never)]
    fn drive(&mut self, t: f64, s: f64) {
        let (model, data, row) = (self.model, self.data, self.row);
        let Scheme { hold, shift, .. } = self.scheme;
        // Exactly 0 unless a shift was chosen.
        let shifted = shift.abs() > 0.0;
        for (i, (reg, column)) in model.input_regs.iter().zip(&data.inputs).enumerate() {
            let value = match hold {
                Hold::Zero => column[self.held],
                Hold::Line if !shifted && row + 1 < column.len() => {
                    column[row] + s * (column[row + 1] - column[row])
                }
                _ => data.input_at(i, t - shift, hold == Hold::Curve).0,
            };
            self.frame[usize::from(*reg)] = N::constant(value);
        }
        for &(reg, input, by) in &model.delays {
            let by = self.frame[usize::from(by)];
            let (late, (from, h)) = (by.value(), self.step);
            let is_middle = h > 0.0 && (t - from - 0.5 * h).abs() < 0.25 * h;
            let (value, slope) = match hold {
                Hold::Zero if is_middle => data.held_amid(input, (from, h), late),
                Hold::Zero => data.held_about(input, t - late),
                Hold::Line => data.line_about(input, t - late),
                Hold::Curve => data.input_at(input, t - late, true),
            };
            self.frame[usize::from(reg)] = by.chain(value, -slope);
        }
        self.frame[usize::from(model.time_reg)] = N::constant(t);
    }
}

impl<N: Number> Rates<N> for Between<'_, N> {
    #[inline(never)]
    fn rates(&mut self, t: f64, x: &[N], dx: &mut [N]) {
        let (from, to) = (self.data.time[self.row], self.data.time[self.row + 1]);
        // The next row's value of a held input begins at the next row.
        let s = ((t - from) / (to - from)).clamp(0.0, 1.0);
        self.drive(t, s);
        let model = self.model;
        for (reg, value) in model.state_regs.iter().zip(x) {
            self.frame[usize::from(*reg)] = *value;
        }
        model.program.run(&model.program.rates, self.frame, &model.widths);
        for (to, reg) in dx.iter_mut().zip(&model.rates) {
            *to = self.frame[usize::from(*reg)];
        }
    }
}

/// The row whose value a held input has at the instant of a row.
fn held_at(row: usize, shift: f64) -> usize {
    if shift > 0.0 { row.saturating_sub(1) } else { row }
}

/// The way from a row to the next, cut where a held input that acts within a row takes its next value:
/// which row's value, from, to.
fn pieces(data: &Data, row: usize, scheme: Scheme) -> impl Iterator<Item = (usize, f64, f64)> {
    let (from, to) = (data.time[row], data.time[row + 1]);
    let first = held_at(row, scheme.shift);
    let cut = if scheme.hold == Hold::Zero && scheme.shift.abs() > 0.0 {
        let after = if scheme.shift > 0.0 { from + scheme.shift } else { to + scheme.shift };
        after.clamp(from, to)
    } else {
        to
    };
    let second = (first + 1).min(data.n_rows() - 1);
    [(first, from, cut), (second, cut, to)].into_iter().filter(|(_, from, to)| to > from)
}

/// Short steps for each step in which a `sign` or a `step` may turn over.
const SHORT_STEPS: usize = 8;

/// Watches what stands in each `sign` and `step`.
struct Turns {
    before: Vec<f64>,
    /// Length of the last step, s; 0 before the first.
    last: f64,
}

impl Turns {
    fn of(model: &Compiled) -> Self {
        Self { before: vec![0.0; model.sites.len()], last: 0.0 }
    }

    /// Into how many parts the step of length `h` at `t` is cut, and whether the rates at its beginning are left in `rates`.
    fn parts<N: Number>(
        &mut self,
        f: &mut Between<'_, N>,
        t: f64,
        h: f64,
        x: &[N],
        rates: &mut [N],
    ) -> (usize, bool) {
        let model = f.model;
        if self.before.is_empty() {
            return (1, false);
        }
        f.rates(t, x, rates);
        let mut near = self.last <= 0.0;
        for ((before, reg), width) in self.before.iter_mut().zip(&model.sites).zip(&model.widths) {
            let now = f.frame[usize::from(*reg)].value();
            // As far as it went in the last step, and twice that, it may go in this one.
            near |=
                now.abs() < 2.0 * (now - *before).abs() * h / self.last.max(1e-300) + 4.0 * width;
            *before = now;
        }
        self.last = h;
        (if near { SHORT_STEPS } else { 1 }, true)
    }
}

/// The registers of a model with its constants and parameters, and what follows from those alone.
fn frame<N: Number>(model: &Compiled, params: &[N]) -> Vec<N> {
    let mut frame = vec![N::constant(0.0); model.program.n_registers];
    for &(reg, value) in &model.program.constants {
        frame[usize::from(reg)] = N::constant(value);
    }
    for (reg, value) in model.param_regs.iter().zip(params) {
        frame[usize::from(*reg)] = *value;
    }
    model.program.run(&model.program.once, &mut frame, &model.widths);
    frame
}

/// What a model says where it is put, not where it goes by itself: the rates of its states and then its outputs, row by row,
/// with the states given, one column each.
pub(super) fn said_at(
    model: &Compiled,
    data: &Data,
    rows: Range<usize>,
    scheme: Scheme,
    params: &[f64],
    states: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let read: Vec<_> = model.outputs.iter().map(|output| output.reg).collect();
    let probe = model.probing(model.rates.iter().copied().chain(read));
    let mut said = vec![Vec::with_capacity(rows.len()); probe.outputs.len()];
    let mut frame = frame(&probe, params);
    let mut f = Between {
        model: &probe,
        data,
        frame: &mut frame,
        row: rows.start,
        held: rows.start,
        step: (0.0, 0.0),
        scheme,
    };
    for (i, row) in rows.enumerate() {
        f.row = row;
        f.held = held_at(row, scheme.shift);
        f.drive(data.time[row], 0.0);
        for (reg, column) in probe.state_regs.iter().zip(states) {
            f.frame[usize::from(*reg)] = column[i];
        }
        probe.program.run(&probe.program.outputs, f.frame, &probe.widths);
        for (column, output) in said.iter_mut().zip(&probe.outputs) {
            column.push(f.frame[usize::from(output.reg)]);
        }
    }
    said
}

/// Runs a model over rows of a recording and writes its outputs, row by row.
///
/// `params` are the free parameters; `start` holds the first value of each state, `None` where the model
/// gives it. `out` has one entry per row and output. Returns the state after the last row.
///
/// # Errors
///
/// [`BlowUp`] when a state is no longer a finite number.
pub fn simulate<N: Number>(
    model: &Compiled,
    data: &Data,
    rows: Range<usize>,
    scheme: Scheme,
    params: &[N],
    start: &[Option<N>],
    out: &mut [N],
) -> Result<Vec<N>, BlowUp> {
    let n_out = model.outputs.len();
    let mut frame = frame(model, params);
    let mut x: Vec<N> = model
        .states
        .iter()
        .enumerate()
        .map(|(i, state)| {
            start.get(i).copied().flatten().unwrap_or_else(|| {
                state.fixed.map_or(N::constant(0.0), |reg| frame[usize::from(reg)])
            })
        })
        .collect();
    let mut work = Work::new(x.len());
    let mut f = Between {
        model,
        data,
        frame: &mut frame,
        row: rows.start,
        held: rows.start,
        step: (0.0, 0.0),
        scheme,
    };
    let mut turns = Turns::of(model);
    for row in rows.clone() {
        let t = data.time[row];
        f.row = row;
        f.held = held_at(row, scheme.shift);
        f.drive(t, 0.0);
        for (reg, value) in model.state_regs.iter().zip(&x) {
            f.frame[usize::from(*reg)] = *value;
        }
        model.program.run(&model.program.outputs, f.frame, &model.widths);
        let at = (row - rows.start) * n_out;
        for (to, output) in out[at..at + n_out].iter_mut().zip(&model.outputs) {
            *to = f.frame[usize::from(output.reg)];
            if !to.value().is_finite() {
                return Err(BlowUp { what: output.name.clone(), t });
            }
        }
        if row + 1 == rows.end || x.is_empty() {
            continue;
        }
        for (held, from, to) in pieces(data, row, scheme) {
            f.held = held;
            let n = (scheme.substeps as f64 * ((to - from) / data.step).max(0.2)).ceil().max(1.0);
            let h = (to - from) / n;
            for i in 0..n as usize {
                let at = from + i as f64 * h;
                let (parts, begun) = turns.parts(&mut f, at, h, &x, work.first());
                let part = h / parts as f64;
                for j in 0..parts {
                    let (from, begun) = (at + j as f64 * part, begun && j == 0);
                    f.step = (from, part);
                    rk4(&mut f, (from, part), begun, &mut x, &mut work);
                }
            }
        }
        if let Some(i) = x.iter().position(|v| v.value().is_nan() || v.value().abs() >= TOO_LARGE) {
            return Err(BlowUp { what: model.states[i].name.clone(), t: data.time[row + 1] });
        }
    }
    late_outputs(model, &data.time[rows], &frame, out);
    Ok(x)
}

/// Shifts the outputs whose sensor is late.
fn late_outputs<N: Number>(model: &Compiled, time: &[f64], frame: &[N], out: &mut [N]) {
    let n_out = model.outputs.len();
    for (o, output) in model.outputs.iter().enumerate() {
        let Some(by) = output.delay.map(|reg| frame[usize::from(reg)]) else { continue };
        let series: Vec<N> = out.iter().skip(o).step_by(n_out).copied().collect();
        let n = series.len();
        if n < 2 {
            continue;
        }
        for i in 0..n {
            let t = time[i] - by.value();
            let j = time.partition_point(|v| *v <= t).clamp(1, n - 1) - 1;
            let dt = time[j + 1] - time[j];
            // Before the first row the first slope goes on: the past of a stretch is not known.
            let s = (t - time[j]) / dt;
            let slope = (series[j + 1].value() - series[j].value()) / dt;
            let value = series[j].scaled(1.0 - s) + series[j + 1].scaled(s);
            out[i * n_out + o] = value + by.chain(0.0, -slope);
        }
    }
}

/// Most derivatives carried at a time.
const LANES: usize = 8;

/// As [`simulate`], with the derivatives of every output with respect to the parameters, unless those are
/// `fixed`, and the free first values, in that order: `jacobian[row·n_out + o][k]` flattened.
///
/// # Errors
///
/// [`BlowUp`] when a state is no longer a finite number.
pub fn simulate_with_derivatives(
    model: &Compiled,
    data: &Data,
    rows: Range<usize>,
    scheme: Scheme,
    (params, fixed): (&[f64], bool),
    start: &[Option<f64>],
    jacobian: &mut Vec<f64>,
) -> Result<Vec<f64>, BlowUp> {
    let n_values = rows.len() * model.outputs.len();
    let n_params = if fixed { 0 } else { params.len() };
    let n = n_params + start.iter().flatten().count();
    jacobian.clear();
    jacobian.resize(n_values * n, 0.0);
    let mut of =
        Derivatives { params, n_params, start, n, first: 0, values: vec![0.0; n_values], jacobian };
    while of.first < n.max(1) {
        // What is not wanted is not carried along.
        match n - of.first {
            0..=2 => of.lanes::<2>(model, data, rows.clone(), scheme)?,
            3..=4 => of.lanes::<4>(model, data, rows.clone(), scheme)?,
            _ => of.lanes::<LANES>(model, data, rows.clone(), scheme)?,
        }
        of.first += LANES;
    }
    Ok(of.values)
}

/// The derivatives of a simulation's outputs, filled some columns at a time.
struct Derivatives<'a> {
    params: &'a [f64],
    /// Parameters that are free: all or none.
    n_params: usize,
    start: &'a [Option<f64>],
    /// Columns: free parameters, then free first values.
    n: usize,
    /// The column that comes next.
    first: usize,
    values: Vec<f64>,
    jacobian: &'a mut Vec<f64>,
}

impl Derivatives<'_> {
    /// Fills the next `N` columns, or those that are left.
    fn lanes<const N: usize>(
        &mut self,
        model: &Compiled,
        data: &Data,
        rows: Range<usize>,
        scheme: Scheme,
    ) -> Result<(), BlowUp> {
        let variable = |v: f64, column: usize| {
            Dual::<N>::variable(v, column.checked_sub(self.first).unwrap_or(N), 1.0)
        };
        let params: Vec<_> = (0..)
            .zip(self.params)
            .map(|(k, v)| if k < self.n_params { variable(*v, k) } else { Dual::constant(*v) })
            .collect();
        let mut columns = self.n_params..;
        let start: Vec<_> = self
            .start
            .iter()
            .map(|v| v.and_then(|v| columns.next().map(|column| variable(v, column))))
            .collect();
        let mut out = vec![Dual::<N>::constant(0.0); self.values.len()];
        simulate(model, data, rows, scheme, &params, &start, &mut out)?;
        let n_filled = N.min(self.n - self.first);
        for (i, dual) in out.iter().enumerate() {
            self.values[i] = dual.v;
            let at = i * self.n + self.first;
            self.jacobian[at..at + n_filled].copy_from_slice(&dual.d[..n_filled]);
        }
        Ok(())
    }
}

/// The usual size of what stands in each `sign` and `step` along a recording: root mean square.
pub(super) fn site_sizes(
    model: &Compiled,
    data: &Data,
    rows: Range<usize>,
    scheme: Scheme,
    params: &[f64],
    start: &[Option<f64>],
) -> Option<Vec<f64>> {
    if model.sites.is_empty() {
        return Some(Vec::new());
    }
    let probe = model.probing(model.sites.iter().copied());
    let n = model.sites.len();
    let mut out = vec![0.0; rows.len() * n];
    simulate(&probe, data, rows, scheme, params, start, &mut out).ok()?;
    Some(
        (0..n)
            .map(|s| {
                super::columns::rms(&out.iter().skip(s).step_by(n).copied().collect::<Vec<_>>())
            })
            .collect(),
    )
}
