//! Expressions: what type each has, and what is wrong in it.

use super::super::ast::{BinaryOp, Call, Expr, ExprKind, FluentItem, Name, Span};
use super::super::builtins::{self, Ty};
use super::super::diagnostic::Diagnostic;
use super::super::parse::nearest;
use super::call::{Slot, constant, slot, small, with_unit};
use super::{Checker, Names};
use crate::units::{Dimension, Quantity};

/// Circles of fluents that are remembered of a file, each at most 64 long. Chosen: nobody mends more at a time, and a text
/// of thousands of fluents that ask for each other is checked as fast as any.
const MOST_CIRCLES: usize = 16;

impl Checker<'_> {
    /// Returns the type of an expression and tells what is wrong in it.
    pub(super) fn expr(&mut self, expr: &Expr, names: &Names) -> Ty {
        match &expr.kind {
            ExprKind::Literal(quantity) => Ty::Quantity(quantity.dimension),
            ExprKind::Text(_) => Ty::Text,
            ExprKind::Bool(_) => Ty::Bool,
            ExprKind::Bad => Ty::Any,
            ExprKind::Name(name) => self.name(name, expr.span, names),
            ExprKind::Call(call) => self.call(call, names),
            ExprKind::Member(of, member) => self.member(of, member, names),
            ExprKind::Not(inner) => {
                self.condition("not", inner, names);
                Ty::Bool
            }
            ExprKind::Negate(inner) => match self.expr(inner, names) {
                ty @ (Ty::Quantity(_) | Ty::Any) => ty,
                ty => self.not_a_number(inner.span, &ty),
            },
            ExprKind::Within(comparison, tolerance) => {
                let given = self.expr(tolerance, names);
                let ExprKind::Binary(left, BinaryOp::Eq | BinaryOp::Ne, right) = &comparison.kind
                else {
                    self.expr(comparison, names);
                    self.tell(
                        Diagnostic::error(
                            "task::tolerance",
                            tolerance.span,
                            "`within` gives a tolerance to `==`, and there is none",
                            "tolerance of what?",
                        )
                        .help("write `x == 60 mL within 10 mL`, or leave the tolerance out"),
                    );
                    return Ty::Bool;
                };
                if let Ty::Quantity(dimension) = self.same(left, right, names) {
                    self.fits("the tolerance", &Ty::Quantity(dimension), &given, tolerance);
                    self.tolerance(tolerance, dimension);
                }
                Ty::Bool
            }
            ExprKind::Binary(left, op, right) => self.binary(left, *op, right, expr.span, names),
        }
    }

    pub(super) fn name(&mut self, name: &str, span: Span, names: &Names) -> Ty {
        if let Some(ty) = names.get(name) {
            return ty.clone();
        }
        if name == "any" {
            return Ty::Any;
        }
        if let Some(ty) = self.scope.objects.get(name) {
            return Ty::named(ty);
        }
        if let Some(ty) = builtins::constant(name) {
            return Ty::named(ty);
        }
        let callable = builtins::function(name).is_some()
            || self.library.fluent(name).is_some()
            || self.library.callable(name).is_some();
        if callable {
            self.tell(
                Diagnostic::error(
                    "task::call",
                    span,
                    format!("`{name}` wants arguments"),
                    "named, but not called",
                )
                .help(format!("write `{name}(…)`")),
            );
            return Ty::Any;
        }
        let known: Vec<&str> = names
            .keys()
            .chain(self.scope.objects.keys())
            .map(String::as_str)
            .chain(builtins::CONSTANTS.iter().map(|(name, ..)| *name))
            .collect();
        let what = if names.is_empty() { "object" } else { "parameter or object" };
        // The constants are suggested when near, but a list of what is here should name objects.
        let here: Vec<&str> =
            names.keys().chain(self.scope.objects.keys()).map(String::as_str).collect();
        if let Some(path) = self.library.imported_scene_with(&self.source.name, name) {
            self.tell(
                Diagnostic::error(
                    "task::unknown_name",
                    span,
                    format!("there is no {what} `{name}`"),
                    "not known",
                )
                .help(format!("the scene of `{path}` has it: name that with `--scene {path}`")),
            );
            return Ty::Any;
        }
        match nearest(name, known.iter().copied()) {
            Some(_) => self.unknown(name, span, what, &known),
            None => self.unknown(name, span, what, &here),
        }
        Ty::Any
    }

    pub(super) fn call(&mut self, call: &Call, names: &Names) -> Ty {
        let name = call.name.text.as_str();
        for arg in call.args.iter().filter(|arg| arg.values.len() > 1) {
            self.tell(
                Diagnostic::error(
                    "task::alternatives",
                    arg.span,
                    format!("`{name}` is asked about one thing at a time"),
                    "a choice",
                )
                .help("ask twice and join the answers with `or`; `|` is for what is done"),
            );
        }
        if let Some(function) = builtins::function(name) {
            let required = function.params.len() - function.optional;
            let slots: Vec<Slot> = function
                .params
                .iter()
                .enumerate()
                .map(|(i, (name, ty))| Slot { name, ty: Ty::named(ty), optional: i >= required })
                .collect();
            self.args(call, &slots, names, false);
            return Ty::named(function.result);
        }
        if let Some((fluent, _)) = self.library.fluent(name) {
            let slots: Vec<Slot> = fluent.params.iter().map(slot).collect();
            self.args(call, &slots, names, false);
            return self.fluent_type(fluent, call.name.span);
        }
        for value in call.args.iter().flat_map(|arg| &arg.values) {
            self.expr(value, names);
        }
        if self.library.callable(name).is_some() {
            self.tell(
                Diagnostic::error(
                    "task::not_a_fluent",
                    call.name.span,
                    format!("`{name}` is something to do, not something to ask"),
                    "a task or action",
                )
                .help("write it as a step of its own"),
            );
            return Ty::Any;
        }
        let fluents = self.library.fluents().map(|(fluent, _)| fluent.name.text.as_str());
        let known: Vec<&str> = builtins::FUNCTIONS.iter().map(|f| f.name).chain(fluents).collect();
        self.unknown(name, call.name.span, "fluent", &known);
        Ty::Any
    }

    /// Works out what a fluent is worth: true or false, or a quantity. That it leads back to the fluent that is being checked
    /// is told where that one asks for it.
    pub(super) fn fluent_type(&mut self, fluent: &FluentItem, span: Span) -> Ty {
        let ty = self.fluent_worth(fluent);
        let name = &fluent.name.text;
        let [asking] = self.pending.as_slice() else { return ty };
        let found = self.circles.iter().find_map(|circle| between(circle, asking, name));
        let Some(others) = found else { return ty };
        let message = match others.as_slice() {
            [] => format!("`{name}` is defined by itself"),
            others => format!("`{name}` is defined by itself, through {}", others.join(" and ")),
        };
        self.tell(
            Diagnostic::error("task::cycle", span, message, "in a circle")
                .help("say what it is by things that can be measured"),
        );
        ty
    }

    fn fluent_worth(&mut self, fluent: &FluentItem) -> Ty {
        let name = &fluent.name.text;
        if let Some(at) = self.pending.iter().position(|pending| pending == name) {
            if self.circles.len() < MOST_CIRCLES {
                self.circles.push(self.pending[at..].to_vec());
            }
            return Ty::Any;
        }
        if let Some(ty) = self.fluents.get(name) {
            return ty.clone();
        }
        // Fluents of fluents of fluents: beyond this nobody follows, and neither does the stack.
        if self.pending.len() > 64 {
            return Ty::Any;
        }
        self.pending.push(name.clone());
        let told = self.diagnostics.len();
        let names: Names = fluent
            .params
            .iter()
            .map(|param| (param.name.text.clone(), Ty::named(&param.ty.text)))
            .collect();
        let ty = self.expr(&fluent.body, &names);
        // Its own mistakes are told where it is defined.
        self.diagnostics.truncate(told);
        self.pending.pop();
        self.fluents.insert(name.clone(), ty.clone());
        ty
    }

    pub(super) fn member(&mut self, of: &Expr, member: &Name, names: &Names) -> Ty {
        let ExprKind::Name(object) = &of.kind else {
            self.expr(of, names);
            return self.unknown_member(member, &[]);
        };
        if let Some(ty) = builtins::member(object, &member.text) {
            return Ty::named(ty);
        }
        self.name(object, of.span, names);
        let known: Vec<&str> = builtins::MEMBERS
            .iter()
            .filter(|(its, ..)| its == object)
            .map(|(_, name, ..)| *name)
            .collect();
        self.unknown_member(member, &known)
    }

    pub(super) fn unknown_member(&mut self, member: &Name, known: &[&str]) -> Ty {
        let text = &member.text;
        let function = builtins::function(text).is_some() || self.library.fluent(text).is_some();
        if known.is_empty() && function {
            self.tell(
                Diagnostic::error(
                    "task::unknown_name",
                    member.span,
                    format!("`{text}` is asked with the object in parentheses"),
                    "not a member",
                )
                .help(format!("write `{text}(…)`")),
            );
        } else {
            self.unknown(text, member.span, "member", known);
        }
        Ty::Any
    }

    pub(super) fn binary(
        &mut self,
        left: &Expr,
        op: BinaryOp,
        right: &Expr,
        span: Span,
        names: &Names,
    ) -> Ty {
        match op {
            BinaryOp::Or | BinaryOp::And => {
                let word = if op == BinaryOp::Or { "or" } else { "and" };
                self.condition(word, left, names);
                self.condition(word, right, names);
                Ty::Bool
            }
            BinaryOp::Eq | BinaryOp::Ne => {
                if let Ty::Quantity(dimension) = self.same(left, right, names) {
                    self.tell(
                        Diagnostic::error(
                            "task::tolerance",
                            span,
                            "two measured quantities are never exactly equal",
                            "how close is close enough?",
                        )
                        .help(format!(
                            "add a tolerance: `{} within {}`",
                            self.source.slice(span),
                            small(dimension)
                        )),
                    );
                }
                Ty::Bool
            }
            BinaryOp::Le | BinaryOp::Ge | BinaryOp::Lt | BinaryOp::Gt => {
                match self.same(left, right, names) {
                    Ty::Quantity(_) | Ty::Any => {}
                    ty => {
                        self.not_a_number(span, &ty);
                    }
                }
                Ty::Bool
            }
            BinaryOp::Add | BinaryOp::Sub => match self.same(left, right, names) {
                ty @ (Ty::Quantity(_) | Ty::Any) => ty,
                ty => self.not_a_number(span, &ty),
            },
            BinaryOp::Mul | BinaryOp::Div => {
                let (a, b) = (self.expr(left, names), self.expr(right, names));
                if op == BinaryOp::Div && constant(right).is_some_and(|by| by.value == 0.0) {
                    self.tell(
                        Diagnostic::error(
                            "task::division",
                            right.span,
                            format!(
                                "`{}` is zero, and nothing can be divided by it",
                                self.source.slice(right.span)
                            ),
                            "divided by here",
                        )
                        .help("divide by something that is not zero"),
                    );
                }
                match (a, b) {
                    (Ty::Quantity(a), Ty::Quantity(b)) => {
                        Ty::Quantity(if op == BinaryOp::Mul { a * b } else { a / b })
                    }
                    (Ty::Any, _) | (_, Ty::Any) => Ty::Any,
                    (Ty::Quantity(_), ty) => self.not_a_number(right.span, &ty),
                    (ty, _) => self.not_a_number(left.span, &ty),
                }
            }
        }
    }

    /// Complains of a tolerance that is nothing, or less, as far as it can be read off the text.
    fn tolerance(&mut self, tolerance: &Expr, dimension: Dimension) {
        let is_none = |given: &Quantity| given.dimension == dimension && given.value <= 0.0;
        let Some(given) = constant(tolerance).filter(is_none) else { return };
        let least = Quantity { value: 0.0, ..given };
        let found = Diagnostic::error(
            "task::tolerance",
            tolerance.span,
            format!("the tolerance is {given}; it should be more than {least}"),
            "how close is close enough?",
        );
        self.tell(match &tolerance.kind {
            ExprKind::Negate(inner) if given.value < 0.0 => {
                let text = self.source.slice(inner.span);
                found.help(format!("write `within {text}`")).fix(tolerance.span, text)
            }
            _ => found.help(format!("write how close, such as `within {}`", small(dimension))),
        });
    }

    /// Checks that two sides are of one kind and returns it.
    pub(super) fn same(&mut self, left: &Expr, right: &Expr, names: &Names) -> Ty {
        let (a, b) = (self.expr(left, names), self.expr(right, names));
        match (&a, &b) {
            (Ty::Any, _) | (_, Ty::Any) => Ty::Any,
            // Two objects may be compared whatever their types.
            (Ty::Object(_) | Ty::Place, Ty::Object(_) | Ty::Place) => a,
            (a_ty, b_ty) if a_ty == b_ty => a,
            (Ty::Quantity(d), Ty::Quantity(none)) if none.is_none() => {
                self.unit_beside(right, left, *d)
            }
            (Ty::Quantity(none), Ty::Quantity(d)) if none.is_none() => {
                self.unit_beside(left, right, *d)
            }
            _ => {
                let code = match (&a, &b) {
                    (Ty::Quantity(_), Ty::Quantity(_)) => "task::unit",
                    _ => "task::type",
                };
                self.tell(
                    Diagnostic::error(
                        code,
                        right.span,
                        format!(
                            "`{}` is {}, and `{}` is {}",
                            self.source.slice(left.span),
                            a.words(),
                            self.source.slice(right.span),
                            b.words()
                        ),
                        format!("this is {}", b.words()),
                    )
                    .label(left.span, format!("this is {}", a.words()))
                    .help("put quantities of one kind on both sides"),
                );
                Ty::Any
            }
        }
    }

    /// `bare` has no unit beside `other`, which has one.
    pub(super) fn unit_beside(&mut self, bare: &Expr, other: &Expr, dimension: Dimension) -> Ty {
        let text = self.source.slice(bare.span).to_string();
        let other = self.source.slice(other.span);
        let message = format!("`{other}` is {}, and `{text}` has no unit", dimension.words());
        let found = Diagnostic::error("task::unit", bare.span, message, "no unit");
        self.tell(with_unit(found, &text, bare, dimension));
        Ty::Any
    }

    pub(super) fn not_a_number(&mut self, span: Span, ty: &Ty) -> Ty {
        self.tell(
            Diagnostic::error(
                "task::type",
                span,
                format!(
                    "this takes quantities, and `{}` is {}",
                    self.source.slice(span),
                    ty.words()
                ),
                "not a quantity",
            )
            .help("measure it first, such as `height(jar)`"),
        );
        Ty::Any
    }
}

/// Returns through which fluents of a circle the one that another asks for next leads back to itself.
fn between(circle: &[String], asking: &str, name: &str) -> Option<Vec<String>> {
    let (at, n) = (circle.iter().position(|one| one == asking)?, circle.len());
    let quoted = |step: usize| format!("`{}`", circle[(at + step) % n]);
    (circle[(at + 1) % n] == name).then(|| (2..=n).map(quoted).collect())
}
