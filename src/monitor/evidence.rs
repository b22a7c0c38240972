//! What a run shows of how well its parse graph fits: the evidence that [`crate::graph::energy`] weighs.

use std::collections::BTreeMap;

use crate::graph::energy::{Compared, Found, PAPER_ERROR_RATE};
use crate::graph::{Condition, Evidence, Interval, ParseGraph, Step};
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::text;
use crate::trace::{FluentRow, StepRecord};

/// Returns what is known of a run of this parse graph: when each step ran, how its conditions were found, and
/// the twin's fluents beside those measured. A condition with an `or` in it is left out: which side was meant to
/// hold is not known.
pub fn evidence(pg: &ParseGraph, steps: &[StepRecord]) -> Evidence {
    let mut evidence = Evidence::default();
    for (i, record) in steps.iter().enumerate() {
        let [from, to] = record.interval_s;
        evidence.intervals.insert(record.path.clone(), Interval { from, to });
        if let Some(step) = pg.steps.iter().find(|step| step.path == record.path) {
            let before = i.checked_sub(1).map_or(&[][..], |i| steps[i].fluents.as_slice());
            let found = found(step, before, &record.fluents);
            evidence.found.entry(record.path.clone()).or_default().extend(found);
        }
        evidence.compared.extend(record.fluents.iter().map(|row| Compared {
            fluent: row.name.clone(),
            expected: row.twin,
            measured: row.measured,
            error_rate: PAPER_ERROR_RATE,
        }));
    }
    evidence
}

/// The conditions of a step: what it needs as things stood before it, what it keeps and gives as they stood after.
fn found(step: &Step, before: &[FluentRow], after: &[FluentRow]) -> BTreeMap<String, Found> {
    let each = |all: &[Condition], rows: &[FluentRow]| -> Vec<(String, Found)> {
        let known = all.iter().filter_map(|c| Some((c.text.clone(), holds(&c.expr, rows)?)));
        known.collect()
    };
    let mut found = BTreeMap::new();
    found.extend(each(&step.needs, before));
    found.extend(each(&step.keeps, after));
    found.extend(each(&step.gives, after));
    found
}

/// Returns how a condition was found: its worst part, as `and` is judged everywhere.
fn holds(expr: &Expr, rows: &[FluentRow]) -> Option<Found> {
    match &expr.kind {
        ExprKind::Binary(a, BinaryOp::And, b) => match (holds(a, rows), holds(b, rows)) {
            (Some(a), Some(b)) => Some(worse(a, b)),
            (a, b) => a.or(b),
        },
        ExprKind::Not(inner) => holds(inner, rows).map(|found| Found {
            truth: found.truth.map(|truth| !truth),
            margin_in_sigmas: found.margin_in_sigmas.map(|margin| -margin),
        }),
        _ => {
            let name = text::expr(expr);
            let row = rows.iter().find(|row| row.name == name)?;
            let margin = row.margin.as_ref().zip(row.std.as_ref());
            let in_sigmas = margin
                .filter(|(margin, std)| margin.unit == std.unit && std.value > 0.0)
                .map(|(margin, std)| margin.value / std.value);
            Some(Found { truth: row.measured, margin_in_sigmas: in_sigmas })
        }
    }
}

fn worse(a: Found, b: Found) -> Found {
    let rank = |found: &Found| match (found.truth, found.margin_in_sigmas) {
        (Some(false), margin) => margin.map_or(f64::NEG_INFINITY, |margin| margin.min(0.0)),
        (_, margin) => margin.unwrap_or(f64::INFINITY),
    };
    if rank(&a) <= rank(&b) { a } else { b }
}
