//! Did it happen? Fluents in the twin beside fluents as measured, and the questionnaire.
//!
//! Judging never commands: what to do about a difference is [`crate::workcell`]'s business.

pub mod changes;
pub mod evidence;
pub mod questionnaire;

use crate::execution::done::FluentReading;
use crate::execution::during::Held;
use crate::fluent::{Reading, Score, Term, score};
use crate::graph::Role;
use crate::trace::{DuringRow, Fared, FluentRow, Measure, TermRow};
use crate::units::Quantity;

/// What twin and measurement say after one step, side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// One row a fluent, in the parse graph's order.
    pub rows: Vec<FluentRow>,
    /// How far they agree (the paper's Eq. 8).
    pub score: Score,
}

/// Sets the fluents of the twin beside those measured; both lists are of the same parse graph.
///
/// Fluents the twin has no reading of are unknown there, and unknown is not a mismatch.
pub fn compare(twin: &[FluentReading], measured: &[FluentReading]) -> Comparison {
    let rows: Vec<FluentRow> = measured
        .iter()
        .map(|real| {
            let twin = twin.iter().find(|twin| twin.text == real.text);
            let reading = twin.map(|twin| &twin.reading);
            FluentRow {
                name: real.text.clone(),
                expected: real.expected,
                twin: reading.and_then(|reading| reading.truth),
                measured: real.reading.truth,
                margin: margin(&real.reading),
                twin_margin: reading.and_then(margin),
                ask: real.ask.clone(),
                why: why(&real.reading),
                std: std(real.reading.sigma, real.reading.margin),
                direction: real.reading.direction.clone(),
                terms: real.reading.terms.iter().map(term).collect(),
            }
        })
        .collect();
    let twin: Vec<_> = rows.iter().map(|row| row.twin).collect();
    let real: Vec<_> = rows.iter().map(|row| row.measured).collect();
    Comparison { score: score(&twin, &real), rows }
}

/// Sets how conditions fared while a step ran beside how they fared in its rehearsal.
pub fn during(twin: &[Held], measured: &[Held]) -> Vec<DuringRow> {
    let fared = |held: &Held| Fared {
        least: held.least.map(measure),
        least_at_s: held.least_at,
        became_true_s: held.became_true,
        by_rehearsal: held.by_rehearsal,
    };
    let rows = measured.iter().map(|held| DuringRow {
        name: held.text.clone(),
        ends: held.role == Role::Until,
        measured: fared(held),
        twin: twin.iter().find(|t| t.text == held.text && t.role == held.role).map(fared),
    });
    rows.collect()
}

/// Returns why a reading is not a yes, in a few words.
fn why(reading: &Reading) -> Option<String> {
    let wrong = reading.error.as_ref().map(ToString::to_string);
    wrong.or_else(|| reading.unknown.clone())
}

fn margin(reading: &Reading) -> Option<Measure> {
    reading.margin.map(measure)
}

/// Returns a standard deviation in the unit of its margin; `None` when the state claims to be exact.
fn std(sigma: f64, margin: Option<Quantity>) -> Option<Measure> {
    let margin = margin.filter(|_| sigma > 0.0)?;
    Some(measure(Quantity { value: sigma, dimension: margin.dimension }))
}

fn term(term: &Term) -> TermRow {
    TermRow {
        text: term.text.clone(),
        truth: term.truth,
        value: term.value.map(measure),
        limit: term.limit.map(measure),
        margin: term.margin.map(measure),
        std: std(term.sigma, term.margin),
    }
}

/// Returns a quantity in the unit of INTERFACES: SI, with the unit's name.
pub fn measure(quantity: Quantity) -> Measure {
    Measure { value: quantity.value, unit: quantity.dimension.si() }
}
