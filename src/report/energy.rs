//! The energy of a run, term by term.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::graph::Energy;
use crate::graph::energy::energy;
use crate::monitor::evidence::evidence;
use crate::workcell::Run;

/// Returns the energy of what a run did last; `None` when it did nothing.
pub fn of(run: &Run) -> Option<Energy> {
    let pg = run.parse_graphs.last()?;
    Some(energy(pg, &evidence(pg, &run.steps)))
}

/// The terms: value, name, what makes it.
fn terms(energy: &Energy) -> [(&'static str, f64, &'static str); 5] {
    [
        ("choice", energy.choice, "how unlikely its branches were"),
        ("temporal", energy.temporal, "how far steps ran from when they should"),
        ("spatial", energy.spatial, "what did not hold before or during a step"),
        ("causal", energy.causal, "what a step promised and did not bring about"),
        ("data", energy.data, "where twin and measurement differ"),
    ]
}

/// Words the terms, a line each, and their sum.
pub fn words(name: &str, energy: &Energy) -> String {
    let mut text = format!("energy of {name}, nats: the lower, the better the run fits its graph");
    for (term, value, what) in terms(energy) {
        let _ = write!(text, "\n  {term:<9} {:>8.2}  {what}", plain(value));
    }
    let _ = write!(text, "\n  {:<9} {:>8.2}", "sum", plain(energy.total()));
    text
}

/// A number without the sign of a zero.
fn plain(value: f64) -> f64 {
    value + 0.0
}

/// The terms for a program.
pub fn document(energy: &Energy) -> Value {
    let mut document = json!({ "sum": energy.total(), "unit": "nat" });
    for (term, value, _) in terms(energy) {
        document[term] = json!(value);
    }
    document
}
