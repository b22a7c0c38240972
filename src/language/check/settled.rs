//! Promises that no step can keep: what they speak of is settled before the first one.

use super::super::ast::{BinaryOp, Expr, ExprKind};
use super::super::diagnostic::Diagnostic;
use super::Checker;

/// Fluents of the language whose values no step changes.
const SETTLED: [&str; 3] = ["filled", "capacity", "travel"];

impl Checker<'_> {
    /// Warns of what a task promises about nothing that its steps change.
    pub(super) fn settled(&mut self, gives: &[Expr]) {
        for expr in gives {
            self.settled_in(expr);
        }
    }

    fn settled_in(&mut self, expr: &Expr) {
        if let ExprKind::Binary(left, BinaryOp::And, right) = &expr.kind {
            self.settled_in(left);
            self.settled_in(right);
            return;
        }
        let mut called = Vec::new();
        calls(expr, &mut called);
        let all_settled = called.iter().all(|name| SETTLED.contains(name));
        let Some(first) = called.first().filter(|_| all_settled) else { return };
        let text = self.source.slice(expr.span);
        let found = Diagnostic::warning(
            "task::settled",
            expr.span,
            format!("no step changes `{text}`"),
            "as true at the end as when the run begins",
        );
        self.tell(match *first {
            "filled" => {
                found.help("`filled` is the water when the run began; `volume` is that of now")
            }
            _ => found.help("promise something that a step brings about"),
        });
    }
}

/// Collects the names of what an expression calls; parameters and constants are none.
fn calls<'e>(expr: &'e Expr, into: &mut Vec<&'e str>) {
    match &expr.kind {
        ExprKind::Call(call) => {
            into.push(&call.name.text);
            call.args.iter().flat_map(|arg| &arg.values).for_each(|value| calls(value, into));
        }
        ExprKind::Member(of, name) => {
            into.push(&name.text);
            calls(of, into);
        }
        ExprKind::Not(of) | ExprKind::Negate(of) => calls(of, into),
        ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => {
            calls(a, into);
            calls(b, into);
        }
        ExprKind::Literal(_)
        | ExprKind::Text(_)
        | ExprKind::Bool(_)
        | ExprKind::Name(_)
        | ExprKind::Bad => {}
    }
}
