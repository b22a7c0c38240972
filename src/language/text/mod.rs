//! A syntax tree as text, written as the language would have it.
//!
//! Expressions and steps are one line, where they are shown by themselves: labels of a graph, terms of a
//! margin, the text a branch's learnt counts hang on. Items are laid out. What is read back is the same tree
//! but for its places. No layout and no comments of a writer are kept; that is a formatter's work.

mod items;
mod steps;

use super::ast::{Allen, BinaryOp, Call, Expr, ExprKind};
use crate::units::{Dimension, Quantity};

pub use items::{action, fluent, line, object_type, task};
pub use steps::{block, conditions, on_failure, recovery, remedy, step};

/// Returns an expression as the language writes it, with no more parentheses than it needs.
pub fn expr(expr: &Expr) -> String {
    at_level(expr, 0)
}

/// Returns `name(arg, by: 12 cm)`.
pub fn call(call: &Call) -> String {
    let args: Vec<String> = call
        .args
        .iter()
        .map(|arg| {
            let values: Vec<String> = arg.values.iter().map(expr).collect();
            match &arg.name {
                Some(name) => format!("{}: {}", name.text, values.join(" | ")),
                None => values.join(" | "),
            }
        })
        .collect();
    format!("{}({})", call.name.text, args.join(", "))
}

/// Returns a quantity in an everyday unit: `12 cm`, `60 mL`, `7.2 deg`.
pub fn quantity(quantity: Quantity) -> String {
    let v = quantity.value;
    let Dimension { length, mass, time, angle, current, pixel } = quantity.dimension;
    let (scale, unit) = match (length, mass, time, angle, current, pixel) {
        (0, 0, 0, 0, 0, 0) => return number(v),
        (1, 0, 0, 0, 0, 0) if v.abs() >= 1.0 => (1.0, "m"),
        (1, 0, 0, 0, 0, 0) if is_whole(v * 100.0) && v.abs() >= 0.01 => (100.0, "cm"),
        (1, 0, 0, 0, 0, 0) => (1e3, "mm"),
        (3, 0, 0, 0, 0, 0) if v.abs() >= 1e-3 => (1e3, "L"),
        (3, 0, 0, 0, 0, 0) => (1e6, "mL"),
        (0, 1, 0, 0, 0, 0) if v.abs() >= 1.0 => (1.0, "kg"),
        (0, 1, 0, 0, 0, 0) => (1e3, "g"),
        (0, 0, 1, 0, 0, 0) if v.abs() >= 1.0 || v == 0.0 => (1.0, "s"),
        (0, 0, 1, 0, 0, 0) => (1e3, "ms"),
        (0, 0, 0, 1, 0, 0) => (180.0 / std::f64::consts::PI, "deg"),
        (1, 0, -1, 0, 0, 0) => (1.0, "m/s"),
        (0, 0, -1, 1, 0, 0) => (180.0 / std::f64::consts::PI, "deg/s"),
        (1, 1, -2, 0, 0, 0) => (1.0, "N"),
        (2, 1, -2, 0, 0, 0) => (1.0, "N*m"),
        (0, 0, 0, 0, 1, 0) => (1.0, "A"),
        (0, 0, 0, 0, 0, 1) => (1.0, "px"),
        _ => return format!("{} {}", number(v), base_units(quantity.dimension)),
    };
    format!("{} {unit}", number(v * scale))
}

/// Returns the word for one of Allen's relations.
pub fn allen(relation: Allen) -> &'static str {
    match relation {
        Allen::Before => "before",
        Allen::Meets => "meets",
        Allen::Overlaps => "overlaps",
        Allen::Starts => "starts",
        Allen::During => "during",
        Allen::Finishes => "finishes",
        Allen::Equals => "equals",
    }
}

/// Returns a text in quotes, written so that reading gives it back.
pub fn quoted(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
    format!("\"{escaped}\"")
}

/// Returns the sign of an operator.
pub fn operator(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Or => "or",
        BinaryOp::And => "and",
        BinaryOp::Eq => "==",
        BinaryOp::Ne => "!=",
        BinaryOp::Le => "<=",
        BinaryOp::Ge => ">=",
        BinaryOp::Lt => "<",
        BinaryOp::Gt => ">",
        BinaryOp::Add => "+",
        BinaryOp::Sub => "-",
        BinaryOp::Mul => "*",
        BinaryOp::Div => "/",
    }
}

/// Writes `e` so that it may stand where operators looser than `level` may not.
fn at_level(e: &Expr, level: u8) -> String {
    let (own, text) = match &e.kind {
        ExprKind::Literal(q) if q.value < 0.0 => (6, quantity(*q)),
        ExprKind::Literal(q) => (7, quantity(*q)),
        ExprKind::Text(text) => (7, quoted(text)),
        ExprKind::Bool(value) => (7, value.to_string()),
        ExprKind::Name(name) => (7, name.clone()),
        ExprKind::Call(inner) => (7, call(inner)),
        ExprKind::Member(of, name) => (7, format!("{}.{}", at_level(of, 7), name.text)),
        ExprKind::Not(inner) => (6, format!("not {}", at_level(inner, 6))),
        ExprKind::Negate(inner) => (6, format!("-{}", at_level(inner, 7))),
        ExprKind::Within(inner, by) => {
            (3, format!("{} within {}", at_level(inner, 3), at_level(by, 4)))
        }
        ExprKind::Binary(a, op, b) => {
            let own = match op {
                BinaryOp::Or => 1,
                BinaryOp::And => 2,
                BinaryOp::Add | BinaryOp::Sub => 4,
                BinaryOp::Mul | BinaryOp::Div => 5,
                _ => 3,
            };
            // Operators group to the left; comparisons do not chain.
            let left = if own == 3 { 4 } else { own };
            (own, format!("{} {} {}", at_level(a, left), operator(*op), at_level(b, own + 1)))
        }
        ExprKind::Bad => (7, String::from("?")),
    };
    if own < level { format!("({text})") } else { text }
}

fn number(v: f64) -> String {
    // Six significant digits hide the rounding of unit conversion (0.12 * 100) and nothing else.
    if v == 0.0 || !v.is_finite() {
        return format!("{v}");
    }
    let digits = (5.0 - v.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

fn is_whole(v: f64) -> bool {
    (v - v.round()).abs() < 1e-6
}

fn base_units(d: Dimension) -> String {
    let all = [
        ("m", d.length),
        ("kg", d.mass),
        ("s", d.time),
        ("rad", d.angle),
        ("A", d.current),
        ("px", d.pixel),
    ];
    let parts: Vec<String> = all
        .iter()
        .filter(|(_, n)| *n != 0)
        .map(|(unit, n)| if *n == 1 { (*unit).to_owned() } else { format!("{unit}^{n}") })
        .collect();
    parts.join("*")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::ast::Span;

    fn q(value: f64, length: i8, angle: i8) -> Quantity {
        Quantity { value, dimension: Dimension { length, angle, ..Dimension::default() } }
    }

    #[test]
    fn quantities_are_written_in_everyday_units() {
        assert_eq!(quantity(q(0.12, 1, 0)), "12 cm");
        assert_eq!(quantity(q(0.031, 1, 0)), "31 mm");
        assert_eq!(quantity(q(60e-6, 3, 0)), "60 mL");
        assert_eq!(quantity(q(7.2_f64.to_radians(), 0, 1)), "7.2 deg");
        assert_eq!(quantity(q(0.9, 0, 0)), "0.9");
        assert_eq!(quantity(q(-0.005, 1, 0)), "-5 mm");
    }

    #[test]
    fn parentheses_stand_only_where_they_change_the_meaning() {
        let name = |n: &str| Expr { kind: ExprKind::Name(n.into()), span: Span::default() };
        let two = |a: Expr, op, b: Expr| Expr {
            kind: ExprKind::Binary(Box::new(a), op, Box::new(b)),
            span: Span::default(),
        };
        let sum = two(name("a"), BinaryOp::Sub, two(name("b"), BinaryOp::Sub, name("c")));
        assert_eq!(expr(&sum), "a - (b - c)");
        let left = two(two(name("a"), BinaryOp::Sub, name("b")), BinaryOp::Sub, name("c"));
        assert_eq!(expr(&left), "a - b - c");
        let both = two(name("p"), BinaryOp::And, two(name("q"), BinaryOp::Or, name("r")));
        assert_eq!(expr(&both), "p and (q or r)");
        let not = Expr { kind: ExprKind::Not(Box::new(both)), span: Span::default() };
        assert_eq!(expr(&not), "not (p and (q or r))");
    }
}
