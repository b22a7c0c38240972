//! Parts of a syntax tree as one line of text, written as the language would have them.
//!
//! Used where an expression or a step is shown by itself: labels of a graph, terms of a margin, the text
//! a branch's learnt counts hang on. It keeps no layout and no comments; that is a formatter's work.

use std::fmt::Write as _;

use super::ast::{
    Allen, BinaryOp, Block, Call, Conditions, Expr, ExprKind, Hold, Recovery, Remedy, Step,
};
use crate::units::{Dimension, Quantity};

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

/// Returns a step and all it holds, on one line.
pub fn step(step: &Step) -> String {
    match step {
        Step::Act(act) => {
            let label = act.label.as_ref().map(|l| format!(" as {}", l.text)).unwrap_or_default();
            let via: Vec<&str> = act.via.iter().map(|branch| branch.text.as_str()).collect();
            let via =
                if via.is_empty() { String::new() } else { format!(" via {}", via.join(", ")) };
            format!("{}{via}{}{label}", call(&act.call), holds(&act.holds))
        }
        Step::Sequence(all, _) => all.iter().map(self::step).collect::<Vec<_>>().join(" then "),
        Step::Block(all) => block(all),
        Step::Either(either) => {
            let mut text = String::from("either");
            for (i, branch) in either.branches.iter().enumerate() {
                let or = if i == 0 { "" } else { " or" };
                let _ = write!(text, "{or} {}", branch.name.text);
                if let Some(prior) = branch.prior {
                    let _ = write!(text, " prior {}", number(prior));
                }
                if let Some(when) = &branch.when {
                    let _ = write!(text, " when {}", expr(when));
                }
                let _ = write!(text, " {}", block(&branch.block));
            }
            text
        }
        Step::If(branch) => {
            let mut text = format!("if {} {}", expr(&branch.condition), block(&branch.then));
            if let Some(otherwise) = &branch.otherwise {
                let _ = write!(text, " else {}", block(otherwise));
            }
            text
        }
        Step::Repeat(repeat) => {
            let mut text = format!("repeat upto {} times {}", repeat.times, block(&repeat.block));
            if let Some(until) = &repeat.until {
                let _ = write!(text, " until {}", expr(until));
            }
            text
        }
        Step::Together(together) => {
            let mut text = String::from("together {");
            for inner in &together.steps {
                let _ = write!(text, " {}", self::step(inner));
            }
            for timing in &together.timings {
                let (a, b) = (&timing.a.text, &timing.b.text);
                let _ = write!(text, " timing {a} {} {b}", allen(timing.relation));
                if let Some(by) = timing.by {
                    let _ = write!(text, " by {}", quantity(by.quantity));
                }
            }
            text + " }"
        }
        Step::Check(what, _) => format!("check {}", expr(what)),
        Step::Break(stop) => match &stop.when {
            Some(when) => format!("break when {}", expr(when)),
            None => String::from("break"),
        },
        Step::Let(name, what, _) => format!("let {} = {}", name.text, expr(what)),
        Step::Bad(_) => String::from("?"),
    }
}

/// Returns `{ steps }` with its recoveries and holds, on one line.
pub fn block(block: &Block) -> String {
    let mut parts: Vec<String> = block.steps.iter().map(step).collect();
    parts.extend(block.recoveries.iter().map(recovery));
    let label = block.label.as_ref().map(|l| format!(" as {}", l.text)).unwrap_or_default();
    format!("{{ {} }}{}{label}", parts.join(" "), holds(&block.holds))
}

/// Returns `on failure of … { … }` on one line.
pub fn recovery(recovery: &Recovery) -> String {
    let of = recovery.of.as_ref().map(|c| format!(" of {}", call(c))).unwrap_or_default();
    let mut parts: Vec<String> = recovery.steps.iter().map(step).collect();
    parts.extend(recovery.remedy.as_ref().map(remedy));
    format!("on failure{of} {{ {} }}", parts.join(" "))
}

/// Returns `retry other upto 2 times` or `abort "why"`.
pub fn remedy(remedy: &Remedy) -> String {
    match remedy {
        Remedy::Retry { other, times } => {
            let other = if *other { "other " } else { "" };
            format!("retry {other}upto {times} times")
        }
        Remedy::Abort(Some(why)) => format!("abort {why:?}"),
        Remedy::Abort(None) => String::from("abort"),
    }
}

/// Returns `needs … keeps … gives …` on one line.
pub fn conditions(conditions: &Conditions) -> String {
    let mut parts = Vec::new();
    for (word, all) in
        [("needs", &conditions.needs), ("keeps", &conditions.keeps), ("gives", &conditions.gives)]
    {
        parts.extend(all.iter().map(|e| format!("{word} {}", expr(e))));
    }
    parts.join(" ")
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

fn holds(holds: &[Hold]) -> String {
    holds.iter().fold(String::new(), |mut text, hold| {
        let (word, what) = match hold {
            Hold::While(e) => ("while", e),
            Hold::Until(e) => ("until", e),
        };
        let _ = write!(text, " {word} {}", expr(what));
        text
    })
}

/// Writes `e` so that it may stand where operators looser than `level` may not.
fn at_level(e: &Expr, level: u8) -> String {
    let (own, text) = match &e.kind {
        ExprKind::Literal(q) if q.value < 0.0 => (6, quantity(*q)),
        ExprKind::Literal(q) => (7, quantity(*q)),
        ExprKind::Text(text) => (7, format!("{text:?}")),
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
