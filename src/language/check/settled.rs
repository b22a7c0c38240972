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
        let called = expr.calls();
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
