//! A run that is over, as the stepper meets one that is going on: each step before it began, and what it
//! came to.

use crate::execution::conduct::Ahead;
use crate::graph::ParseGraph;
use crate::graph::parse_graph::Condition;
use crate::trace::{FluentRow, StepRecord};

/// Returns the steps of a record with what each needed and was to give, by the parse graphs that were
/// performed, one an attempt. What a condition was worth before a step is what the step before it measured.
pub fn steps(records: &[StepRecord], graphs: &[ParseGraph]) -> Vec<(Ahead, StepRecord)> {
    let mut at = (0, 0);
    let mut before: &[FluentRow] = &[];
    let mut found = Vec::new();
    for record in records {
        let place = find(graphs, at, &record.path);
        let judge = |condition: &Condition| {
            let row = before.iter().find(|row| row.name == condition.text);
            row.map_or((None, None), |row| (row.measured, row.margin.clone()))
        };
        let mut ahead = match place {
            Some((graph, index)) => {
                at = (graph, index + 1);
                Ahead::of(&graphs[graph], index, record.number, &judge, &|_| None)
            }
            None => bare(record),
        };
        ahead.of = records.len();
        ahead.later.retain(|later| later.number <= records.len());
        found.push((ahead, record.clone()));
        before = &record.fluents;
    }
    found
}

/// Returns where a path is met next: in the graph that is being performed, else in a later one.
fn find(
    graphs: &[ParseGraph],
    (graph, step): (usize, usize),
    path: &str,
) -> Option<(usize, usize)> {
    (graph..graphs.len()).find_map(|g| {
        let from = if g == graph { step } else { 0 };
        let steps = graphs[g].steps.get(from..).unwrap_or_default();
        steps.iter().position(|step| step.path == path).map(|i| (g, from + i))
    })
}

/// A step of which nothing but its record is known.
fn bare(record: &StepRecord) -> Ahead {
    Ahead {
        number: record.number,
        of: 0,
        path: record.path.clone(),
        action: record.action.clone(),
        place: None,
        script: record.lines.first().map(|line| line.script.clone()),
        parts: Vec::new(),
        needs: Vec::new(),
        keeps: Vec::new(),
        gives: Vec::new(),
        mark: None,
        later: Vec::new(),
    }
}
