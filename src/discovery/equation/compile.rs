//! A checked model → the flat `Program` that is run.
//!
//! Source of the value numbering: Cocke and Schwartz, *Programming Languages and Their Compilers*, 1970.

use std::collections::BTreeMap;

use crate::language::ast::{BinaryOp, Expr, ExprKind, ModelItem, StartValue};
use crate::language::{Diagnostic, MODEL_CONSTANTS, ModelUnits, check_model};
use crate::units::Dimension;

use super::program::{Binary, Op, Program, Reg, Unary};

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

/// Most registers a model may need.
const MOST_REGISTERS: usize = 60_000;

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
    names: BTreeMap<String, Reg>,
    constants: Vec<(Reg, f64)>,
    ops: Vec<(Reg, Op)>,
    /// What each register depends on: parameters (1), what changes over time (2).
    depends: Vec<u8>,
    delays: Vec<(Reg, usize, Reg)>,
    sites: Vec<Reg>,
    pending: Vec<String>,
}

const ON_PARAMS: u8 = 1;
const ON_TIME: u8 = 2;

impl<'a> Maker<'a> {
    fn new(model: &'a ModelItem, units: ModelUnits) -> Self {
        Self {
            model,
            units,
            names: BTreeMap::new(),
            constants: Vec::new(),
            ops: Vec::new(),
            depends: Vec::new(),
            delays: Vec::new(),
            sites: Vec::new(),
            pending: Vec::new(),
        }
    }

    fn register(&mut self, depends: u8) -> Reg {
        self.depends.push(depends);
        (self.depends.len() - 1).min(MOST_REGISTERS) as Reg
    }

    fn make(mut self) -> Result<Compiled, Box<Diagnostic>> {
        let model = self.model;
        let mut input_regs = Vec::new();
        for input in &model.inputs {
            let reg = self.register(ON_TIME);
            self.names.insert(input.name.text.clone(), reg);
            input_regs.push(reg);
        }
        let mut state_regs = Vec::new();
        for state in &model.states {
            let reg = self.register(ON_TIME);
            self.names.insert(state.name.text.clone(), reg);
            state_regs.push(reg);
        }
        let time_reg = self.register(ON_TIME);
        self.names.entry("t".into()).or_insert(time_reg);
        let (mut params, mut param_regs) = (Vec::new(), Vec::new());
        for param in &model.params {
            let reg = match &param.value {
                StartValue::Fixed(formula) => self.expr(formula)?,
                StartValue::Free(guess) => {
                    let reg = self.register(ON_PARAMS);
                    params.push(FreeParam {
                        name: param.name.text.clone(),
                        guess: guess.map(|g| g.quantity.value),
                        range: param.range.map(|r| r.map(|l| l.quantity.value)),
                    });
                    param_regs.push(reg);
                    reg
                }
            };
            self.names.insert(param.name.text.clone(), reg);
        }
        let mut states = Vec::new();
        for state in &model.states {
            let (fixed, guess) = match &state.value {
                StartValue::Fixed(formula) => (Some(self.expr(formula)?), None),
                StartValue::Free(guess) => (None, guess.map(|g| g.quantity.value)),
            };
            let range = state.range.map(|r| r.map(|l| l.quantity.value));
            states.push(State { name: state.name.text.clone(), fixed, guess, range });
        }
        let mut rates = Vec::new();
        for state in &model.states {
            let equation = model.equations.iter().find(|e| e.name.text == state.name.text);
            let Some(equation) = equation else { continue };
            rates.push(self.expr(&equation.formula)?);
        }
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
                Some(by) if !input => (self.expr(inner)?, Some(self.expr(by)?)),
                _ => (self.expr(&output.formula)?, None),
            };
            let dimension = self.units.of(&output.name.text);
            outputs.push(Output { name: output.name.text.clone(), dimension, reg, delay, state });
        }
        if self.depends.len() > MOST_REGISTERS {
            let found = Diagnostic::error(
                "task::depth",
                model.name.span,
                "this model is too large to run",
                "too many operations",
            )
            .help("split it into smaller models");
            return Err(Box::new(found));
        }
        let mut fixed: Vec<Reg> = states.iter().filter_map(|s| s.fixed).collect();
        fixed.extend(outputs.iter().filter_map(|o| o.delay));
        fixed.extend(self.delays.iter().map(|(_, _, by)| *by));
        let by_rates = self.needed(&rates);
        let by_outputs = self.needed(&outputs.iter().map(|o| o.reg).collect::<Vec<_>>());
        let by_start = self.needed(&fixed);
        let select = |wanted: &dyn Fn(usize, u8) -> bool| -> Vec<u32> {
            (0..self.ops.len())
                .filter(|&i| wanted(i, self.depends[usize::from(self.ops[i].0)]))
                .map(|i| i as u32)
                .collect()
        };
        let program = Program {
            once: select(&|i, on| {
                on & ON_TIME == 0 && (by_rates[i] || by_outputs[i] || by_start[i])
            }),
            rates: select(&|i, on| on & ON_TIME != 0 && by_rates[i]),
            outputs: select(&|i, on| on & ON_TIME != 0 && by_outputs[i]),
            constants: self.constants,
            ops: self.ops,
            n_registers: self.depends.len(),
        };
        let inputs =
            model.inputs.iter().map(|i| (i.name.text.clone(), self.units.of(&i.name.text)));
        Ok(Compiled {
            name: model.name.text.clone(),
            inputs: inputs.collect(),
            params,
            states,
            outputs,
            widths: vec![1e-9; self.sites.len()],
            units: self.units,
            program,
            rates,
            param_regs,
            state_regs,
            input_regs,
            delays: self.delays,
            time_reg,
            sites: self.sites,
        })
    }

    /// Which operations some registers need.
    fn needed(&self, of: &[Reg]) -> Vec<bool> {
        let mut by_reg: BTreeMap<Reg, usize> = BTreeMap::new();
        for (i, (reg, _)) in self.ops.iter().enumerate() {
            by_reg.insert(*reg, i);
        }
        let mut needed = vec![false; self.ops.len()];
        let mut todo: Vec<Reg> = of.to_vec();
        while let Some(reg) = todo.pop() {
            let Some(&i) = by_reg.get(&reg) else { continue };
            if std::mem::replace(&mut needed[i], true) {
                continue;
            }
            match self.ops[i].1 {
                Op::Binary(_, a, b) => todo.extend([a, b]),
                Op::Unary(_, a)
                | Op::PowI(a, _)
                | Op::PowF(a, _)
                | Op::Sign(a, _)
                | Op::Step(a, _) => todo.push(a),
            }
        }
        needed
    }

    fn constant(&mut self, value: f64) -> Reg {
        if let Some((reg, _)) = self.constants.iter().find(|(_, c)| c.to_bits() == value.to_bits())
        {
            return *reg;
        }
        let reg = self.register(0);
        self.constants.push((reg, value));
        reg
    }

    fn value(&self, reg: Reg) -> Option<f64> {
        self.constants.iter().find(|(r, _)| *r == reg).map(|(_, c)| *c)
    }

    /// Returns the register of an operation: one that computes the same, or a constant, or a new one.
    fn op(&mut self, op: Op) -> Reg {
        if let Some((reg, _)) = self.ops.iter().find(|(_, o)| *o == op) {
            return *reg;
        }
        let args: Vec<Reg> = match op {
            Op::Binary(_, a, b) => vec![a, b],
            Op::Unary(_, a) | Op::PowI(a, _) | Op::PowF(a, _) | Op::Sign(a, _) | Op::Step(a, _) => {
                vec![a]
            }
        };
        let values: Vec<Option<f64>> = args.iter().map(|a| self.value(*a)).collect();
        if values.iter().all(Option::is_some) && !matches!(op, Op::Sign(..) | Op::Step(..)) {
            let mut frame = vec![0.0; self.depends.len()];
            for (arg, value) in args.iter().zip(&values) {
                frame[usize::from(*arg)] = value.unwrap_or_default();
            }
            return self.constant(op.apply::<f64>(&frame, &[]));
        }
        let depends = args.iter().fold(0, |d, a| d | self.depends[usize::from(*a)]);
        let reg = self.register(depends);
        self.ops.push((reg, op));
        reg
    }

    fn expr(&mut self, expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        Ok(match &expr.kind {
            ExprKind::Literal(quantity) => self.constant(quantity.value),
            ExprKind::Name(name) => self.name(name, expr)?,
            ExprKind::Negate(inner) => {
                let inner = self.expr(inner)?;
                self.op(Op::Unary(Unary::Neg, inner))
            }
            ExprKind::Binary(a, op, b) => {
                let (a, b) = (self.expr(a)?, self.expr(b)?);
                let op = match op {
                    BinaryOp::Add => Binary::Add,
                    BinaryOp::Sub => Binary::Sub,
                    BinaryOp::Mul => Binary::Mul,
                    BinaryOp::Div => Binary::Div,
                    _ => return Err(unreadable(expr)),
                };
                self.op(Op::Binary(op, a, b))
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                self.call(&call.name.text, &args, expr)?
            }
            _ => return Err(unreadable(expr)),
        })
    }

    fn name(&mut self, name: &str, expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        if let Some(reg) = self.names.get(name) {
            return Ok(*reg);
        }
        let model = self.model;
        if let Some(defined) = model.lets.iter().find(|l| l.name.text == name) {
            if self.pending.iter().any(|p| p == name) {
                return Err(unreadable(expr));
            }
            self.pending.push(name.into());
            let reg = self.expr(&defined.formula)?;
            self.pending.pop();
            self.names.insert(name.into(), reg);
            return Ok(reg);
        }
        match MODEL_CONSTANTS.iter().find(|(c, _)| *c == name) {
            Some((_, value)) => Ok(self.constant(*value)),
            None => Err(unreadable(expr)),
        }
    }

    fn call(&mut self, name: &str, args: &[&Expr], expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        if name == "delay" {
            let [of, by] = args else { return Err(unreadable(expr)) };
            let ExprKind::Name(input) = &of.kind else { return Err(unreadable(expr)) };
            let position = self.model.inputs.iter().position(|i| i.name.text == *input);
            let Some(input) = position else { return Err(unreadable(expr)) };
            let by = self.expr(by)?;
            if let Some((reg, ..)) = self.delays.iter().find(|(_, i, b)| *i == input && *b == by) {
                return Ok(*reg);
            }
            let reg = self.register(ON_TIME);
            self.delays.push((reg, input, by));
            return Ok(reg);
        }
        let regs: Vec<Reg> = args.iter().map(|a| self.expr(a)).collect::<Result<_, _>>()?;
        let unary = match name {
            "sqrt" => Some(Unary::Sqrt),
            "sin" => Some(Unary::Sin),
            "cos" => Some(Unary::Cos),
            "tan" => Some(Unary::Tan),
            "asin" => Some(Unary::Asin),
            "acos" => Some(Unary::Acos),
            "atan" => Some(Unary::Atan),
            "exp" => Some(Unary::Exp),
            "log" | "ln" => Some(Unary::Log),
            "sinh" => Some(Unary::Sinh),
            "cosh" => Some(Unary::Cosh),
            "tanh" => Some(Unary::Tanh),
            "abs" => Some(Unary::Abs),
            _ => None,
        };
        Ok(match (name, regs.as_slice()) {
            (_, &[a]) if unary.is_some() => self.op(Op::Unary(unary.unwrap_or(Unary::Neg), a)),
            ("sign", &[a]) => {
                let site = self.site(a);
                self.op(Op::Sign(a, site))
            }
            ("step", &[a]) => {
                let site = self.site(a);
                self.op(Op::Step(a, site))
            }
            ("min", &[a, b]) => self.op(Op::Binary(Binary::Min, a, b)),
            ("max", &[a, b]) => self.op(Op::Binary(Binary::Max, a, b)),
            ("atan2", &[a, b]) => self.op(Op::Binary(Binary::Atan2, a, b)),
            ("hypot", &[a, b]) => self.op(Op::Binary(Binary::Hypot, a, b)),
            ("clamp", &[x, low, high]) => {
                let x = self.op(Op::Binary(Binary::Min, x, high));
                self.op(Op::Binary(Binary::Max, x, low))
            }
            ("deadzone", &[x, width]) => {
                let least = self.op(Op::Unary(Unary::Neg, width));
                let inside = self.op(Op::Binary(Binary::Min, x, width));
                let inside = self.op(Op::Binary(Binary::Max, inside, least));
                self.op(Op::Binary(Binary::Sub, x, inside))
            }
            ("pow", &[x, by]) => match self.value(by) {
                Some(n) if n.fract() == 0.0 && n.abs() <= 64.0 => self.op(Op::PowI(x, n as i32)),
                Some(n) => self.op(Op::PowF(x, n)),
                None => self.op(Op::Binary(Binary::Pow, x, by)),
            },
            _ => return Err(unreadable(expr)),
        })
    }

    fn site(&mut self, of: Reg) -> u16 {
        let found = self.sites.iter().position(|s| *s == of);
        found.unwrap_or_else(|| {
            self.sites.push(of);
            self.sites.len() - 1
        }) as u16
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

/// What the checker let pass and cannot be run.
fn unreadable(expr: &Expr) -> Box<Diagnostic> {
    let found =
        Diagnostic::error("task::formula", expr.span, "this cannot be computed", "not a formula")
            .help("formulas are of numbers, names, + - * / ^ and functions");
    Box::new(found)
}
