//! A checked model → the flat `Program` that is run.
//!
//! What it has of inputs, states, parameters and outputs, and when each operation runs; how a formula becomes operations
//! is in `registers`.

use crate::language::ast::{Expr, ExprKind, ModelItem, Name, StartValue};
use crate::language::{Diagnostic, ModelUnits, check_model};
use crate::units::Dimension;

use super::error::Unrunnable;
use super::program::{Program, Reg};
use super::registers::{ON_PARAMS, ON_TIME, Registers};

/// A parameter that the data give.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParam {
    /// Its name.
    pub name: String,
    /// Where to start, if the model says.
    pub guess: Option<f64>,
    /// What it may be.
    pub range: Option<[f64; 2]>,
}

/// A state and where it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Its name.
    pub name: String,
    /// The register with its first value, when the model gives one.
    pub(super) fixed: Option<Reg>,
    /// A guess, when it is free and the model has one.
    pub guess: Option<f64>,
    /// What its first value may be.
    pub range: Option<[f64; 2]>,
}

/// Something measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its dimension, if known.
    pub dimension: Option<Dimension>,
    /// What it is equal to.
    pub(super) reg: Reg,
    /// By how much the sensor is late.
    pub(super) delay: Option<Reg>,
    /// The state it is, when it is just one state.
    pub state: Option<usize>,
}

/// A model ready to run.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// Its name.
    pub name: String,
    /// Inputs with their dimension, if known.
    pub inputs: Vec<(String, Option<Dimension>)>,
    /// Free parameters in order.
    pub params: Vec<FreeParam>,
    /// States in order.
    pub states: Vec<State>,
    /// Outputs in order.
    pub outputs: Vec<Output>,
    /// What is known of units.
    pub units: ModelUnits,
    pub(super) program: Program,
    pub(super) rates: Vec<Reg>,
    pub(super) param_regs: Vec<Reg>,
    pub(super) state_regs: Vec<Reg>,
    pub(super) input_regs: Vec<Reg>,
    /// Delayed inputs: register, which input, register of the delay.
    pub(super) delays: Vec<(Reg, usize, Reg)>,
    pub(super) time_reg: Reg,
    /// Arguments of `sign` and `step`, whose ramps are a part of their usual size.
    pub(super) sites: Vec<Reg>,
    /// Half-widths of those ramps.
    pub(super) widths: Vec<f64>,
}

impl Compiled {
    /// The same model with other registers for outputs; everything is computed at every row, for some of it
    /// may belong to the rates alone.
    pub(super) fn probing(&self, registers: impl Iterator<Item = Reg>) -> Self {
        let mut probe = self.clone();
        probe.outputs = registers
            .map(|reg| Output {
                name: String::new(),
                dimension: None,
                reg,
                delay: None,
                state: None,
            })
            .collect();
        let mut all = self.program.outputs.clone();
        all.extend(&self.program.rates);
        all.sort_unstable();
        all.dedup();
        probe.program.outputs = all;
        probe
    }
}

/// Compiles a model.
///
/// # Errors
///
/// What is wrong with it.
pub fn compile(model: &ModelItem) -> Result<Compiled, Vec<Diagnostic>> {
    let (units, found) = check_model(model);
    if found.iter().any(Diagnostic::is_error) {
        return Err(found);
    }
    Maker::new(model, units).make().map_err(|found| vec![*found])
}

struct Maker<'a> {
    model: &'a ModelItem,
    units: ModelUnits,
    registers: Registers<'a>,
}

impl<'a> Maker<'a> {
    fn new(model: &'a ModelItem, units: ModelUnits) -> Self {
        Self { model, units, registers: Registers::new(model) }
    }

    /// Lays everything out; the order decides which register is whose.
    fn make(mut self) -> Result<Compiled, Box<Diagnostic>> {
        let model = self.model;
        let input_regs = self.varying(model.inputs.iter().map(|input| &input.name));
        let state_regs = self.varying(model.states.iter().map(|state| &state.name));
        let time_reg = self.registers.register(ON_TIME);
        self.registers.names.entry("t".into()).or_insert(time_reg);
        let (params, param_regs) = self.params()?;
        let states = self.states()?;
        let rates = self.rates()?;
        let outputs = self.outputs()?;
        if self.registers.are_too_many() {
            return Err(Unrunnable::TooLarge.at(model.name.span));
        }
        let (once, at_stages, at_rows) = self.schedule(&states, &rates, &outputs);
        let inputs =
            model.inputs.iter().map(|i| (i.name.text.clone(), self.units.of(&i.name.text)));
        let inputs = inputs.collect();
        let Registers { constants, ops, depends, delays, sites, .. } = self.registers;
        Ok(Compiled {
            name: model.name.text.clone(),
            inputs,
            params,
            states,
            outputs,
            widths: vec![1e-9; sites.len()],
            units: self.units,
            program: Program {
                once,
                rates: at_stages,
                outputs: at_rows,
                constants,
                ops,
                n_registers: depends.len(),
            },
            rates,
            param_regs,
            state_regs,
            input_regs,
            delays,
            time_reg,
            sites,
        })
    }

    /// Gives names that change over time a register each.
    fn varying<'n>(&mut self, names: impl Iterator<Item = &'n Name>) -> Vec<Reg> {
        names
            .map(|name| {
                let reg = self.registers.register(ON_TIME);
                self.registers.names.insert(name.text.clone(), reg);
                reg
            })
            .collect()
    }

    /// Lays parameters out; returns the free ones and their registers.
    fn params(&mut self) -> Result<(Vec<FreeParam>, Vec<Reg>), Box<Diagnostic>> {
        let (mut params, mut param_regs) = (Vec::new(), Vec::new());
        for param in &self.model.params {
            let reg = match &param.value {
                StartValue::Fixed(formula) => self.registers.expr(formula)?,
                StartValue::Free(guess) => {
                    let reg = self.registers.register(ON_PARAMS);
                    params.push(FreeParam {
                        name: param.name.text.clone(),
                        guess: guess.map(|g| g.quantity.value),
                        range: param.range.map(|r| r.map(|l| l.quantity.value)),
                    });
                    param_regs.push(reg);
                    reg
                }
            };
            self.registers.names.insert(param.name.text.clone(), reg);
        }
        Ok((params, param_regs))
    }

    /// Lays out where states start.
    fn states(&mut self) -> Result<Vec<State>, Box<Diagnostic>> {
        let mut states = Vec::new();
        for state in &self.model.states {
            let (fixed, guess) = match &state.value {
                StartValue::Fixed(formula) => (Some(self.registers.expr(formula)?), None),
                StartValue::Free(guess) => (None, guess.map(|g| g.quantity.value)),
            };
            let range = state.range.map(|r| r.map(|l| l.quantity.value));
            states.push(State { name: state.name.text.clone(), fixed, guess, range });
        }
        Ok(states)
    }

    /// Lays out how states change.
    fn rates(&mut self) -> Result<Vec<Reg>, Box<Diagnostic>> {
        let mut rates = Vec::new();
        for state in &self.model.states {
            let mut equations = self.model.equations.iter();
            let equation = equations.find(|e| e.name.text == state.name.text);
            let Some(equation) = equation else { continue };
            rates.push(self.registers.expr(&equation.formula)?);
        }
        Ok(rates)
    }

    /// Lays out what is measured.
    fn outputs(&mut self) -> Result<Vec<Output>, Box<Diagnostic>> {
        let model = self.model;
        let mut outputs = Vec::new();
        for output in &model.outputs {
            let (inner, by) = late(&output.formula);
            let state = match &inner.kind {
                ExprKind::Name(n) => model.states.iter().position(|s| s.name.text == *n),
                _ => None,
            };
            let input = match &inner.kind {
                ExprKind::Name(n) => model.inputs.iter().any(|i| i.name.text == *n),
                _ => false,
            };
            let (reg, delay) = match by {
                Some(by) if !input => (self.registers.expr(inner)?, Some(self.registers.expr(by)?)),
                _ => (self.registers.expr(&output.formula)?, None),
            };
            let dimension = self.units.of(&output.name.text);
            outputs.push(Output { name: output.name.text.clone(), dimension, reg, delay, state });
        }
        Ok(outputs)
    }

    /// Returns which operations run once, at every stage and at every row.
    fn schedule(
        &self,
        states: &[State],
        rates: &[Reg],
        outputs: &[Output],
    ) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
        let Registers { ops, depends, delays, .. } = &self.registers;
        let mut fixed: Vec<Reg> = states.iter().filter_map(|s| s.fixed).collect();
        fixed.extend(outputs.iter().filter_map(|o| o.delay));
        fixed.extend(delays.iter().map(|(_, _, by)| *by));
        let by_rates = self.registers.needed(rates);
        let read: Vec<Reg> = outputs.iter().map(|o| o.reg).collect();
        let by_outputs = self.registers.needed(&read);
        let by_start = self.registers.needed(&fixed);
        let select = |wanted: &dyn Fn(usize, u8) -> bool| -> Vec<u32> {
            (0..ops.len())
                .filter(|&i| wanted(i, depends[usize::from(ops[i].0)]))
                .map(|i| i as u32)
                .collect()
        };
        (
            select(&|i, on| on & ON_TIME == 0 && (by_rates[i] || by_outputs[i] || by_start[i])),
            select(&|i, on| on & ON_TIME != 0 && by_rates[i]),
            select(&|i, on| on & ON_TIME != 0 && by_outputs[i]),
        )
    }
}

/// `delay(…, time)` around a whole output.
fn late(expr: &Expr) -> (&Expr, Option<&Expr>) {
    if let ExprKind::Call(call) = &expr.kind
        && call.name.text == "delay"
        && let [of, by] = call.args.as_slice()
        && let (Some(of), Some(by)) = (of.values.first(), by.values.first())
    {
        return (of, Some(by));
    }
    (expr, None)
}
