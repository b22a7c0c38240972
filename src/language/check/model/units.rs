//! Units of a model, checked where they are given and worked out where they follow.
//!
//! With `h' = k*u`, `h: V` and `u: A`, `k` is in V/(A*s). A number without a unit may stand for anything, so
//! a model written without units has nothing to object to. Angles count as numbers here, as they do in
//! SI: `g/l*sin(q)` is a legitimate rate of a rate in rad/s².

use super::super::super::ast::{BinaryOp, Expr, ExprKind, Name, Span, StartValue};
use super::super::super::diagnostic::Diagnostic;
use super::fine::{Fine, NUMBER};
use super::{Check, MODEL_CONSTANTS};
use crate::units::Dimension;

/// What is known of an expression's unit.
#[derive(Clone, Copy)]
struct Known {
    fine: Option<Fine>,
    /// A number without a unit had a part in it, so it may be otherwise.
    soft: bool,
}

const ANYTHING: Known = Known { fine: None, soft: true };

impl<'a> Check<'a> {
    /// Works units out until nothing new follows, then objects.
    pub(super) fn dimensions(&mut self) {
        let model = self.model;
        for input in &model.inputs {
            self.give(&input.name.text, input.unit.map(|u| u.unit.dimension));
        }
        for start in model.params.iter().chain(&model.states) {
            self.give(&start.name.text, start.unit.map(|u| u.unit.dimension));
            match &start.value {
                StartValue::Free(Some(guess)) if !is_plain(guess.quantity.dimension) => {
                    self.give(&start.name.text, Some(guess.quantity.dimension));
                }
                _ => {}
            }
        }
        for formula in model.lets.iter().chain(&model.outputs) {
            self.give(&formula.name.text, formula.unit.map(|u| u.unit.dimension));
        }
        for _ in 0..8 {
            let before = self.units.len();
            self.sweep();
            if self.units.len() == before {
                break;
            }
        }
        self.object();
    }

    fn give(&mut self, name: &str, dimension: Option<Dimension>) {
        if let Some(dimension) = dimension {
            self.units.entry(name.into()).or_insert_with(|| dimension.into());
        }
    }

    /// The unit the right-hand side of each formula must have.
    fn targets(&self) -> Vec<(&'a Name, &'a Expr, Option<Fine>)> {
        let model = self.model;
        let time = Fine::from(Dimension::TIME);
        let mut out = Vec::new();
        for start in model.params.iter().chain(&model.states) {
            if let StartValue::Fixed(formula) = &start.value {
                out.push((&start.name, formula, self.units.get(&start.name.text).copied()));
            }
        }
        for formula in model.lets.iter().chain(&model.outputs) {
            out.push((
                &formula.name,
                &formula.formula,
                self.units.get(&formula.name.text).copied(),
            ));
        }
        for equation in &model.equations {
            let of = self.units.get(&equation.name.text).map(|u| u.over(time));
            out.push((&equation.name, &equation.formula, of));
        }
        out
    }

    fn sweep(&mut self) {
        let time = Fine::from(Dimension::TIME);
        let n_rates = self.model.equations.len();
        let targets = self.targets();
        let n = targets.len();
        for (i, (name, formula, target)) in targets.into_iter().enumerate() {
            if let Some(target) = target {
                self.expect(formula, target);
            } else if let Known { fine: Some(fine), soft: false } = self.unit(formula, &mut None) {
                let of = if i >= n - n_rates { fine.times(time) } else { fine };
                self.units.entry(name.text.clone()).or_insert(of);
            }
        }
    }

    /// Passes a unit down to the names it settles.
    fn expect(&mut self, expr: &Expr, target: Fine) {
        match &expr.kind {
            ExprKind::Name(name) if self.kinds.contains_key(name) => {
                self.units.entry(name.clone()).or_insert(target);
            }
            ExprKind::Negate(inner) => self.expect(inner, target),
            ExprKind::Binary(a, BinaryOp::Add | BinaryOp::Sub, b) => {
                self.expect(a, target);
                self.expect(b, target);
            }
            ExprKind::Binary(a, BinaryOp::Mul, b) => {
                match (self.unit(a, &mut None).fine, self.unit(b, &mut None).fine) {
                    (Some(a), None) => self.expect(b, target.over(a)),
                    (None, Some(b)) => self.expect(a, target.over(b)),
                    _ => {}
                }
            }
            ExprKind::Binary(a, BinaryOp::Div, b) => {
                match (self.unit(a, &mut None).fine, self.unit(b, &mut None).fine) {
                    (Some(a), None) => self.expect(b, a.over(target)),
                    (None, Some(b)) => self.expect(a, target.times(b)),
                    _ => {}
                }
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                match (call.name.text.as_str(), args.as_slice()) {
                    ("sqrt", [a]) => {
                        if let Some(square) = target.power(2.0) {
                            self.expect(a, square);
                        }
                    }
                    ("abs", [a]) => self.expect(a, target),
                    ("min" | "max" | "deadzone" | "clamp", all) => {
                        for a in all {
                            self.expect(a, target);
                        }
                    }
                    ("delay", [a, b]) => {
                        self.expect(a, target);
                        self.expect(b, Dimension::TIME.into());
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }

    fn object(&mut self) {
        for (name, formula, target) in self.targets() {
            let mut told = Some(Vec::new());
            let found = self.unit(formula, &mut told);
            let told = told.unwrap_or_default();
            let clean = told.is_empty();
            self.out.extend(told);
            if let (true, Some(target), Known { fine: Some(fine), soft: false }) =
                (clean, target, found)
                && !fine.same(target)
            {
                let rate = self.model.equations.iter().any(|e| e.formula.span == formula.span);
                self.out.push(
                    Diagnostic::error(
                        "task::unit",
                        formula.span,
                        format!(
                            "`{}{}` is {}, its formula {}",
                            name.text,
                            if rate { "'" } else { "" },
                            target.words(),
                            fine.words()
                        ),
                        "another unit",
                    )
                    .help(
                        "give a factor the unit that is missing, or none at all if it is not known",
                    ),
                );
            }
        }
        for start in self.model.params.iter().chain(&self.model.states) {
            let Some(unit) = self.units.get(&start.name.text).copied() else { continue };
            let guess = match &start.value {
                StartValue::Free(guess) => *guess,
                StartValue::Fixed(_) => None,
            };
            for literal in guess.iter().chain(start.range.iter().flatten()) {
                let fine = Fine::from(literal.quantity.dimension);
                if !is_plain(literal.quantity.dimension) && !fine.same(unit) {
                    self.out.push(
                        Diagnostic::error(
                            "task::unit",
                            literal.span,
                            format!("`{}` is {}", start.name.text, unit.words()),
                            fine.words(),
                        )
                        .help("give it in the same unit"),
                    );
                }
            }
        }
    }

    /// The unit of an expression; complains into `told` when there is one.
    fn unit(&self, expr: &Expr, told: &mut Option<Vec<Diagnostic>>) -> Known {
        let hard = |fine| Known { fine: Some(fine), soft: false };
        match &expr.kind {
            ExprKind::Literal(quantity) => {
                Known { fine: Some(quantity.dimension.into()), soft: is_plain(quantity.dimension) }
            }
            ExprKind::Name(name) => match self.units.get(name) {
                Some(fine) => hard(*fine),
                None if name == "t" => hard(Dimension::TIME.into()),
                None if MODEL_CONSTANTS.iter().any(|(c, _)| c == name) => hard(NUMBER),
                None => ANYTHING,
            },
            ExprKind::Negate(inner) => self.unit(inner, told),
            ExprKind::Binary(a, op, b) => {
                let (x, y) = (self.unit(a, told), self.unit(b, told));
                match op {
                    BinaryOp::Mul | BinaryOp::Div => {
                        let fine = x.fine.zip(y.fine).map(|(a, b)| {
                            if *op == BinaryOp::Mul { a.times(b) } else { a.over(b) }
                        });
                        Known { fine, soft: x.soft || y.soft }
                    }
                    _ => alike(&[(a, x), (b, y)], told),
                }
            }
            ExprKind::Call(call) => {
                let args: Vec<&Expr> = call.args.iter().flat_map(|a| &a.values).collect();
                let units: Vec<Known> = args.iter().map(|a| self.unit(a, told)).collect();
                let pairs: Vec<(&Expr, Known)> =
                    args.iter().copied().zip(units.iter().copied()).collect();
                match (call.name.text.as_str(), pairs.as_slice()) {
                    ("sqrt", [(_, x)]) => {
                        Known { fine: x.fine.and_then(|f| f.power(0.5)), soft: x.soft }
                    }
                    ("abs", [(_, x)]) => *x,
                    ("delay", [(_, x), (time, by)]) => {
                        if let (Some(fine), false) = (by.fine, by.soft)
                            && !fine.same(Dimension::TIME.into())
                        {
                            tell(
                                told,
                                time.span,
                                format!("a delay is in s, this is {}", fine.words()),
                            );
                        }
                        *x
                    }
                    ("pow", [(_, x), (by, _)]) => {
                        let exponent = constant(by);
                        match (x.fine, exponent) {
                            (Some(fine), Some(n)) => Known { fine: fine.power(n), soft: x.soft },
                            (Some(fine), None) if fine.is_number() => hard(NUMBER),
                            _ => ANYTHING,
                        }
                    }
                    ("min" | "max" | "clamp" | "deadzone" | "hypot", all) => alike(all, told),
                    ("sign" | "step", _) => hard(NUMBER),
                    ("atan2", all) => {
                        alike(all, told);
                        hard(Dimension::ANGLE.into())
                    }
                    (name, [(arg, x)]) => {
                        if let (Some(fine), false) = (x.fine, x.soft)
                            && !fine.is_number()
                        {
                            tell(
                                told,
                                arg.span,
                                format!(
                                    "`{name}` takes a plain number or an angle, this is {}",
                                    fine.words()
                                ),
                            );
                        }
                        hard(NUMBER)
                    }
                    _ => ANYTHING,
                }
            }
            _ => ANYTHING,
        }
    }
}

/// The common unit of what is added or compared.
fn alike(parts: &[(&Expr, Known)], told: &mut Option<Vec<Diagnostic>>) -> Known {
    let firm = parts.iter().find_map(|(_, k)| k.fine.filter(|_| !k.soft));
    let Some(firm) = firm else {
        return Known { fine: parts.iter().find_map(|(_, k)| k.fine), soft: true };
    };
    for (part, known) in parts {
        if let Known { fine: Some(fine), soft: false } = known
            && !fine.same(firm)
        {
            tell(
                told,
                part.span,
                format!("this is {}, what stands before it {}", fine.words(), firm.words()),
            );
            break;
        }
    }
    Known { fine: Some(firm), soft: false }
}

fn tell(told: &mut Option<Vec<Diagnostic>>, span: Span, message: String) {
    if let Some(told) = told {
        told.push(
            Diagnostic::error("task::unit", span, message, "another unit")
                .help("only like can be added to like; a factor may lack its unit"),
        );
    }
}

fn is_plain(dimension: Dimension) -> bool {
    dimension == Dimension::NONE
}

/// The value of an exponent that is written out.
fn constant(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Literal(q) if is_plain(q.dimension) => Some(q.value),
        ExprKind::Negate(inner) => constant(inner).map(|v| -v),
        ExprKind::Binary(a, BinaryOp::Div, b) => Some(constant(a)? / constant(b)?),
        _ => None,
    }
}
