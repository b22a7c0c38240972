//! What a model says that cannot be meant: names, functions, missing equations, units.
//!
//! `names` looks at what stands for what, `units` at what can be added to what; the second only when the
//! first found nothing.

mod fine;
mod names;
mod units;

use std::collections::BTreeMap;

use super::super::ast::{Expr, ExprKind, ModelItem, Span};
use super::super::diagnostic::Diagnostic;
use crate::units::Dimension;
use fine::Fine;

/// The functions of formulas with the number of their arguments.
pub const MODEL_FUNCTIONS: &[(&str, usize, &str)] = &[
    ("sqrt", 1, "the square root; 0 below 0"),
    ("sin", 1, "sine"),
    ("cos", 1, "cosine"),
    ("tan", 1, "tangent"),
    ("asin", 1, "inverse sine"),
    ("acos", 1, "inverse cosine"),
    ("atan", 1, "inverse tangent"),
    ("atan2", 2, "the angle of the point (x, y), written atan2(y, x)"),
    ("exp", 1, "exponential"),
    ("log", 1, "natural logarithm"),
    ("ln", 1, "natural logarithm"),
    ("sinh", 1, "hyperbolic sine"),
    ("cosh", 1, "hyperbolic cosine"),
    ("tanh", 1, "hyperbolic tangent"),
    ("abs", 1, "absolute value"),
    ("sign", 1, "-1, 0 or 1; steep rather than broken at 0"),
    ("step", 1, "0 below 0, 1 above"),
    ("min", 2, "the smaller"),
    ("max", 2, "the larger"),
    ("clamp", 3, "the first, kept between the second and the third"),
    ("deadzone", 2, "the first, without what lies within the second on both sides of 0"),
    ("delay", 2, "an input as it was so long ago; also around a whole output"),
    ("pow", 2, "a power; `x^2` says the same"),
    ("hypot", 2, "the length of (x, y)"),
];

/// Names that stand for numbers unless the model declares them.
pub const MODEL_CONSTANTS: &[(&str, f64)] = &[("pi", std::f64::consts::PI)];

/// The units of a model's names, as far as they are given or follow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelUnits {
    known: BTreeMap<String, Fine>,
}

impl ModelUnits {
    /// Returns the dimension of an input, parameter, state, definition or output, when it is known and
    /// has whole powers.
    pub fn of(&self, name: &str) -> Option<Dimension> {
        self.known.get(name).and_then(|fine| fine.whole())
    }
}

/// Checks a model by itself; it leans on nothing outside.
pub fn check_model(model: &ModelItem) -> (ModelUnits, Vec<Diagnostic>) {
    let mut check =
        Check { model, units: BTreeMap::new(), kinds: BTreeMap::new(), out: Vec::new() };
    check.names();
    check.formulas();
    if check.out.is_empty() {
        check.dimensions();
    }
    (ModelUnits { known: check.units }, check.out)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sort {
    Input,
    Param,
    State,
    Let,
    Output,
}

struct Check<'a> {
    model: &'a ModelItem,
    units: BTreeMap<String, Fine>,
    kinds: BTreeMap<String, (Sort, Span)>,
    out: Vec<Diagnostic>,
}

/// The names in a formula.
pub fn names_in(expr: &Expr) -> Vec<String> {
    let mut out = Vec::new();
    let mut todo = vec![expr];
    while let Some(expr) = todo.pop() {
        match &expr.kind {
            ExprKind::Name(name) => out.push(name.clone()),
            ExprKind::Negate(inner) | ExprKind::Not(inner) | ExprKind::Member(inner, _) => {
                todo.push(inner);
            }
            ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => todo.extend([&**b, &**a]),
            ExprKind::Call(call) => {
                todo.extend(call.args.iter().rev().flat_map(|a| a.values.iter().rev()));
            }
            _ => {}
        }
    }
    out
}
