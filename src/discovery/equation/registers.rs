//! Formulas → operations over registers: each value is computed once, and constants are computed at once.
//!
//! Which registers a model's parts get, and which operations run when, is decided in [`super::compile`].
//!
//! Source of the value numbering: Cocke and Schwartz, *Programming Languages and Their Compilers*, 1970.

use std::collections::BTreeMap;

use crate::language::ast::{BinaryOp, Expr, ExprKind, ModelItem};
use crate::language::{Diagnostic, MODEL_CONSTANTS};

use super::error::Unrunnable;
use super::program::{Binary, Op, Reg, Unary};

/// Most registers a model may need.
const MOST_REGISTERS: usize = 60_000;

/// Set in what a register depends on: parameters.
pub(super) const ON_PARAMS: u8 = 1;
/// Set in what a register depends on: what changes over time.
pub(super) const ON_TIME: u8 = 2;

/// Functions of one value by the names that formulas call them.
const UNARY: [(&str, Unary); 14] = [
    ("sqrt", Unary::Sqrt),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("asin", Unary::Asin),
    ("acos", Unary::Acos),
    ("atan", Unary::Atan),
    ("exp", Unary::Exp),
    ("log", Unary::Log),
    ("ln", Unary::Log),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
    ("abs", Unary::Abs),
];

/// Functions of two values by their names.
const BINARY: [(&str, Binary); 4] = [
    ("min", Binary::Min),
    ("max", Binary::Max),
    ("atan2", Binary::Atan2),
    ("hypot", Binary::Hypot),
];

/// The registers of a model and the operations between them, as far as they are laid out.
pub(super) struct Registers<'a> {
    model: &'a ModelItem,
    /// Names that have a value.
    pub(super) names: BTreeMap<String, Reg>,
    pub(super) constants: Vec<(Reg, f64)>,
    pub(super) ops: Vec<(Reg, Op)>,
    /// What each register depends on: [`ON_PARAMS`], [`ON_TIME`].
    pub(super) depends: Vec<u8>,
    pub(super) delays: Vec<(Reg, usize, Reg)>,
    pub(super) sites: Vec<Reg>,
    /// Definitions that are being read.
    pending: Vec<String>,
}

impl<'a> Registers<'a> {
    /// Returns those of a model of which nothing is laid out.
    pub(super) fn new(model: &'a ModelItem) -> Self {
        Self {
            model,
            names: BTreeMap::new(),
            constants: Vec::new(),
            ops: Vec::new(),
            depends: Vec::new(),
            delays: Vec::new(),
            sites: Vec::new(),
            pending: Vec::new(),
        }
    }

    /// Returns a new register.
    pub(super) fn register(&mut self, depends: u8) -> Reg {
        self.depends.push(depends);
        (self.depends.len() - 1).min(MOST_REGISTERS) as Reg
    }

    /// Returns whether there are more than can be run.
    pub(super) fn are_too_many(&self) -> bool {
        self.depends.len() > MOST_REGISTERS
    }

    /// Which operations some registers need.
    pub(super) fn needed(&self, of: &[Reg]) -> Vec<bool> {
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
            let (first, second) = self.ops[i].1.args();
            todo.push(first);
            todo.extend(second);
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
        let (first, second) = op.args();
        let args: Vec<Reg> = std::iter::once(first).chain(second).collect();
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

    /// Returns the register of a formula's value.
    pub(super) fn expr(&mut self, expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        Ok(match &expr.kind {
            ExprKind::Literal(quantity) => self.constant(quantity.value),
            ExprKind::Name(name) => self.name(name, expr)?,
            ExprKind::Negate(inner) => {
                let inner = self.expr(inner)?;
                self.op(Op::Neg(inner))
            }
            ExprKind::Binary(a, op, b) => {
                let (a, b) = (self.expr(a)?, self.expr(b)?);
                self.op(match op {
                    BinaryOp::Add => Op::Add(a, b),
                    BinaryOp::Sub => Op::Sub(a, b),
                    BinaryOp::Mul => Op::Mul(a, b),
                    BinaryOp::Div => Op::Div(a, b),
                    _ => return Err(Unrunnable::NotComputable.at(expr.span)),
                })
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                self.call(&call.name.text, &args, expr)?
            }
            _ => return Err(Unrunnable::NotComputable.at(expr.span)),
        })
    }

    fn name(&mut self, name: &str, expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        if let Some(reg) = self.names.get(name) {
            return Ok(*reg);
        }
        let model = self.model;
        if let Some(defined) = model.lets.iter().find(|l| l.name.text == name) {
            if self.pending.iter().any(|p| p == name) {
                return Err(Unrunnable::NotComputable.at(expr.span));
            }
            self.pending.push(name.into());
            let reg = self.expr(&defined.formula)?;
            self.pending.pop();
            self.names.insert(name.into(), reg);
            return Ok(reg);
        }
        match MODEL_CONSTANTS.iter().find(|(c, _)| *c == name) {
            Some((_, value)) => Ok(self.constant(*value)),
            None => Err(Unrunnable::NotComputable.at(expr.span)),
        }
    }

    fn call(&mut self, name: &str, args: &[&Expr], expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        if name == "delay" {
            return self.delayed(args, expr);
        }
        let regs: Vec<Reg> = args.iter().map(|a| self.expr(a)).collect::<Result<_, _>>()?;
        self.function(name, &regs).ok_or_else(|| Unrunnable::NotComputable.at(expr.span))
    }

    /// Returns the register of `delay(input, time)`.
    fn delayed(&mut self, args: &[&Expr], expr: &Expr) -> Result<Reg, Box<Diagnostic>> {
        let unreadable = || Unrunnable::NotComputable.at(expr.span);
        let [of, by] = args else { return Err(unreadable()) };
        let ExprKind::Name(input) = &of.kind else { return Err(unreadable()) };
        let position = self.model.inputs.iter().position(|i| i.name.text == *input);
        let input = position.ok_or_else(unreadable)?;
        let by = self.expr(by)?;
        if let Some((reg, ..)) = self.delays.iter().find(|(_, i, b)| *i == input && *b == by) {
            return Ok(*reg);
        }
        let reg = self.register(ON_TIME);
        self.delays.push((reg, input, by));
        Ok(reg)
    }

    /// Returns the register of a function of registers; `None` if there is none of that name and so many arguments.
    fn function(&mut self, name: &str, regs: &[Reg]) -> Option<Reg> {
        Some(match (name, regs) {
            ("sign", &[a]) => {
                let site = self.site(a);
                self.op(Op::Sign(a, site))
            }
            ("step", &[a]) => {
                let site = self.site(a);
                self.op(Op::Step(a, site))
            }
            ("clamp", &[x, low, high]) => {
                let x = self.op(Op::Binary(Binary::Min, x, high));
                self.op(Op::Binary(Binary::Max, x, low))
            }
            ("deadzone", &[x, width]) => {
                let least = self.op(Op::Neg(width));
                let inside = self.op(Op::Binary(Binary::Min, x, width));
                let inside = self.op(Op::Binary(Binary::Max, inside, least));
                self.op(Op::Sub(x, inside))
            }
            ("pow", &[x, by]) => match self.value(by) {
                Some(n) if n.fract() == 0.0 && n.abs() <= 64.0 => self.op(Op::PowI(x, n as i32)),
                Some(n) => self.op(Op::PowF(x, n)),
                None => self.op(Op::Binary(Binary::Pow, x, by)),
            },
            (_, &[a]) => {
                let (_, f) = UNARY.iter().find(|(known, _)| *known == name)?;
                self.op(Op::Unary(*f, a))
            }
            (_, &[a, b]) => {
                let (_, f) = BINARY.iter().find(|(known, _)| *known == name)?;
                self.op(Op::Binary(*f, a, b))
            }
            _ => return None,
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
