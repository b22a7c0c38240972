//! What to try when something is not as promised.

use std::fmt::Write as _;

use crate::trace::{Cause, FluentRow, Outcome, StepRecord};
use crate::workcell::Run;

use super::super::way_out::way_out;
use super::Question;
use super::words::{size, to_camera};

/// How many things to try are told.
const MOST_TRIES: usize = 3;

/// Up to three things to try, the likeliest to help first.
pub(in crate::report) fn tries(
    question: &Question<'_>,
    step: &StepRecord,
    row: Option<&FluentRow>,
) -> String {
    let mut found: Vec<String> = Vec::new();
    // What was stopped did not come to what it promises, and that says nothing of twin and cell.
    match step.failure.as_ref().map(|failure| &failure.cause) {
        // What is false of it may be so for want of time alone.
        Some(late @ Cause::Overdue(_)) => found.push(way_out(late, None)),
        _ if step.outcome == Outcome::Stopped => {}
        _ => found.extend(row.and_then(|row| by_margin(step, row))),
    }
    found.extend(other_branches(question.run, step));
    let good = question.earlier.iter().rev().find(|(_, run)| {
        run.carried_out().any(|s| s.path == step.path && s.outcome == Outcome::Success)
    });
    if let (Some((good, _)), Some(this)) = (good, question.number) {
        found
            .push(format!(":diff {good} {this} sets it beside run {good}, where this step worked"));
    }
    if let Some(number) = question.number {
        found.push(format!(":replay {number} {} shows the step and its pictures", step.number));
    }
    found.truncate(MOST_TRIES);
    let mut text = String::new();
    for (i, try_this) in found.iter().enumerate() {
        let head = if i == 0 { "try" } else { "   " };
        let _ = write!(text, "\n{head}  {}  {try_this}", i + 1);
    }
    text
}

/// What the margin itself says to try.
fn by_margin(step: &StepRecord, row: &FluentRow) -> Option<String> {
    let unit = row.margin.as_ref().map_or("", |margin| margin.unit.as_str());
    match (row.measured, row.twin) {
        (None, _) => Some(":look takes a new camera image, which may settle it".into()),
        (Some(false), Some(true)) if unit == "m^3" => {
            Some(":gap says which effect the twin lacks that saw the water arrive".into())
        }
        (Some(false), Some(true)) => Some(
            ":align fits the three regressions anew: the twin had it true, so what is off is where \
             things are"
                .into(),
        ),
        (Some(false), _) => {
            let direction = row.direction.as_ref()?;
            let margin = row.margin.as_ref()?;
            if step.measured.held.as_deref() == Some(&direction.object) {
                return None;
            }
            Some(format!(
                "move `{}` {} {} by hand, then :look",
                direction.object,
                size(margin),
                to_camera(direction)
            ))
        }
        _ => None,
    }
}

/// The branches that were possible where the step lies, and were not taken.
fn other_branches(run: &Run, step: &StepRecord) -> Option<String> {
    let pg = run.parse_graphs.last()?;
    let inside = |node: &str| step.path.starts_with(node);
    let choice = pg
        .choices
        .iter()
        .rev()
        .find(|choice| choice.is_free && inside(&choice.node) && choice.possible.len() > 1)?;
    let others: Vec<&str> =
        choice.possible.iter().map(String::as_str).filter(|b| *b != choice.branch).collect();
    let task = choice.key.split('/').next().unwrap_or_default();
    Some(format!(
        "another branch of {task} than {}: `{task}(…) via {}`",
        choice.branch,
        others.first()?
    ))
}
