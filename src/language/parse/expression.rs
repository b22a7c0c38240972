//! The grammar's pairs → expressions, calls and quantities.

use super::super::ast::{Arg, BinaryOp, Call, Expr, ExprKind, Literal, Name, Span};
use super::super::diagnostic::Diagnostic;
use super::build::{Builder, find, number, unquote};
use super::grammar::{Pair, Place, Rule};
use crate::units::{Quantity, Unit};

/// Operands of one operator in a row; the tree leans to one side and is walked by recursion.
const MAX_CHAIN: usize = 128;

/// Operands of all the operators that one stands inside of: as deep the tree can be. Brackets inside brackets with a
/// long chain in each would be deeper than a thread's stack.
const MAX_ABOVE: usize = 1024;

impl Builder<'_> {
    /// Reads an `expr` and everything under it.
    pub(super) fn expr(&mut self, pair: &Pair) -> Expr {
        let span = self.span(pair);
        match pair.as_rule() {
            Rule::expr | Rule::conjunction | Rule::sum | Rule::product => self.chain(pair, span),
            Rule::negation => self.prefixed(pair, span, Rule::K_not, ExprKind::Not),
            Rule::factor => self.prefixed(pair, span, Rule::minus, ExprKind::Negate),
            Rule::comparison => self.comparison(pair, span),
            Rule::quant => Expr { kind: ExprKind::Literal(self.literal(pair).quantity), span },
            Rule::text => Expr { kind: ExprKind::Text(unquote(pair.as_str())), span },
            Rule::K_true => Expr { kind: ExprKind::Bool(true), span },
            Rule::K_false => Expr { kind: ExprKind::Bool(false), span },
            Rule::path => self.path(pair, span),
            _ => self.formula_rule(pair).unwrap_or_else(|| nothing(span)),
        }
    }

    /// `a op b op c`, leaning left.
    pub(super) fn chain(&mut self, pair: &Pair, span: Span) -> Expr {
        let mut out: Option<Expr> = None;
        let mut op = None;
        let parts: Vec<Pair> = pair.clone().into_inner().collect();
        if !self.goes_deeper(parts.len()) {
            self.too_long(span);
            return nothing(span);
        }
        let deeper = parts.len();
        for part in parts {
            match part.as_rule() {
                Rule::K_or => op = Some(BinaryOp::Or),
                Rule::K_and => op = Some(BinaryOp::And),
                Rule::plus => op = Some(BinaryOp::Add),
                Rule::minus => op = Some(BinaryOp::Sub),
                Rule::times => op = Some(BinaryOp::Mul),
                Rule::divided => op = Some(BinaryOp::Div),
                _ => {
                    let next = self.expr(&part);
                    out = Some(match (out, op.take()) {
                        (Some(left), Some(op)) => {
                            let span = Span { from: left.span.from, to: next.span.to };
                            let kind = ExprKind::Binary(Box::new(left), op, Box::new(next));
                            Expr { kind, span }
                        }
                        _ => next,
                    });
                }
            }
        }
        self.above -= deeper;
        out.unwrap_or_else(|| nothing(span))
    }

    /// `not not φ`, `- -x`.
    pub(super) fn prefixed(
        &mut self,
        pair: &Pair,
        span: Span,
        sign: Rule,
        wrap: fn(Box<Expr>) -> ExprKind,
    ) -> Expr {
        let parts: Vec<Pair> = pair.clone().into_inner().collect();
        if !self.goes_deeper(parts.len()) {
            self.too_long(span);
            return nothing(span);
        }
        let mut out = None;
        for part in parts.iter().rev() {
            out = Some(match out {
                // A pair of parentheses gives its brackets and the expression between them.
                None if matches!(part.as_rule(), Rule::rpar | Rule::lpar | Rule::plus) => continue,
                None => self.expr(part),
                Some(inner) if part.as_rule() == sign => {
                    let from = self.span(part).from;
                    let to = span.to;
                    Expr { kind: wrap(Box::new(inner)), span: Span { from, to } }
                }
                Some(inner) => inner,
            });
        }
        self.above -= parts.len();
        out.unwrap_or_else(|| nothing(span))
    }

    fn comparison(&mut self, pair: &Pair, span: Span) -> Expr {
        let parts: Vec<Pair> = pair.clone().into_inner().collect();
        let comparators = parts.iter().filter(|p| p.as_rule() == Rule::comparator).count();
        if comparators > 1 {
            self.diagnostics.push(
                Diagnostic::error(
                    "task::chain",
                    span,
                    "a comparison has two sides",
                    "this one has more",
                )
                .help("compare two at a time and join them with `and`"),
            );
            return nothing(span);
        }
        let mut sums = parts.iter().filter(|p| p.as_rule() == Rule::sum);
        let Some(left) = sums.next().map(|p| self.expr(p)) else { return nothing(span) };
        let (Some(op), Some(right)) =
            (parts.iter().find(|p| p.as_rule() == Rule::comparator), sums.next())
        else {
            return left;
        };
        let op = match op.as_str().trim() {
            ">=" => BinaryOp::Ge,
            "<=" => BinaryOp::Le,
            "==" => BinaryOp::Eq,
            "!=" => BinaryOp::Ne,
            ">" => BinaryOp::Gt,
            _ => BinaryOp::Lt,
        };
        let right = self.expr(right);
        let inside = Span { from: left.span.from, to: right.span.to };
        let compared =
            Expr { kind: ExprKind::Binary(Box::new(left), op, Box::new(right)), span: inside };
        match parts.iter().find(|p| p.as_rule() == Rule::tolerance) {
            Some(tolerance) => {
                let Some(by) = find(tolerance, Rule::sum) else { return compared };
                let by = self.expr(&by);
                Expr { kind: ExprKind::Within(Box::new(compared), Box::new(by)), span }
            }
            None => compared,
        }
    }

    /// `jar`, `height(o)`, `gripper.open`.
    fn path(&mut self, pair: &Pair, span: Span) -> Expr {
        let parts: Vec<Pair> = pair.clone().into_inner().collect();
        if parts.len() > MAX_CHAIN {
            self.too_long(span);
            return nothing(span);
        }
        let mut out: Option<Expr> = None;
        for part in &parts {
            let here = self.span(part);
            match (part.as_rule(), out.take()) {
                (Rule::call, _) => {
                    out =
                        self.call(part).map(|call| Expr { kind: ExprKind::Call(call), span: here });
                }
                (Rule::id, None) => {
                    out = Some(Expr { kind: ExprKind::Name(part.as_str().into()), span: here });
                }
                (Rule::id, Some(of)) => {
                    let span = Span { from: of.span.from, to: here.to };
                    let kind = ExprKind::Member(Box::new(of), self.name(part));
                    out = Some(Expr { kind, span });
                }
                (_, other) => out = other,
            }
        }
        out.unwrap_or_else(|| nothing(span))
    }

    /// Reads `name(arg, by: 12 cm, at: tray | table)`.
    pub(super) fn call(&mut self, pair: &Pair) -> Option<Call> {
        let name = find(pair, Rule::id).map(|p| self.name(&p))?;
        let mut args = Vec::new();
        for part in pair.clone().into_inner() {
            match part.as_rule() {
                Rule::arg => {
                    let name = find(&part, Rule::id).map(|p| self.name(&p));
                    let values: Vec<Expr> = part
                        .clone()
                        .into_inner()
                        .filter(|p| p.as_rule() == Rule::expr)
                        .map(|p| self.expr(&p))
                        .collect();
                    args.push(Arg { name, values, span: self.span(&part) });
                }
                Rule::bad_args => {
                    self.bad_list(pair, &part, Place::Args);
                    let span = self.span(&part);
                    args.push(Arg { name: None, values: vec![nothing(span)], span });
                }
                _ => {}
            }
        }
        Some(Call { name, args, span: self.span(pair) })
    }

    /// Reads `12 cm` into SI.
    pub(super) fn literal(&mut self, pair: &Pair) -> Literal {
        let span = self.span(pair);
        let value = find(pair, Rule::num).map_or(f64::NAN, |p| number(p.as_str()));
        // The grammar's units are those of the table; a test holds them together.
        let unit = find(pair, Rule::unit).and_then(|p| Unit::parse(p.as_str()).ok());
        let quantity = unit.unwrap_or(Unit::NONE).of(value);
        if !quantity.value.is_finite() {
            self.diagnostics.push(
                Diagnostic::error("task::number", span, "this number is too large", "not finite")
                    .help("write a number a laboratory can measure"),
            );
            return Literal { quantity: Quantity { value: 0.0, ..quantity }, span };
        }
        Literal { quantity, span }
    }

    /// Goes down into an operator with so many operands, which is gone up from by taking them off `above`; `false`
    /// where the tree would be too deep.
    fn goes_deeper(&mut self, operands: usize) -> bool {
        let fits = operands <= MAX_CHAIN && self.above + operands <= MAX_ABOVE;
        self.above += if fits { operands } else { 0 };
        fits
    }

    fn too_long(&mut self, span: Span) {
        self.diagnostics.push(
            Diagnostic::error(
                "task::depth",
                span,
                "this expression is too long to read",
                "more than 64 parts in a row",
            )
            .help("give a part of it a name with `let`, or make it a fluent"),
        );
    }
}

/// What stands for an expression that could not be read.
pub(super) fn nothing(span: Span) -> Expr {
    Expr { kind: ExprKind::Bad, span }
}

/// A name for something that has none because it could not be read.
pub(super) fn no_name(span: Span) -> Name {
    Name { text: String::new(), span }
}
