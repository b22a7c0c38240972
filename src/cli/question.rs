//! `trueup -c QUESTION --json`: what is so now, or how much something is, as one document. Nothing moves, and no run begins.

use serde::Serialize;
use serde_json::json;

use crate::language::ast::{ExprKind, Step};
use crate::language::{self, Diagnostic, Source};
use crate::monitor::measure;
use crate::report::exit::Exit;
use crate::report::{self, Failure, Style};
use crate::trace::Measure;
use crate::workcell::WorkCell;

/// Whether a condition is met, by how much, and that in words.
#[derive(Serialize)]
struct Answer<'a> {
    asked: &'a str,
    truth: Option<bool>,
    margin: Option<Measure>,
    told: String,
}

/// What makes a step of a condition.
const CONDITION: &str = "check ";
/// What makes a step of a quantity.
const QUANTITY: &str = "let value = ";

/// Whether a line reads as a condition or a quantity, and is no name alone. A call that moves the arm reads so, too.
pub(super) fn asks(line: &str) -> bool {
    let (step, wrong) = language::parse_line(&format!("{CONDITION}{line}"));
    let Some(Step::Check(expr, _)) = step else { return false };
    let is_name = matches!(expr.kind, ExprKind::Name(_) | ExprKind::Text(_) | ExprKind::Bad);
    !is_name && !wrong.iter().any(Diagnostic::is_error)
}

/// Answers a line that [`asks`].
pub(super) fn answer(line: &str, cell: &mut WorkCell, style: Style) -> Result<Exit, Failure> {
    if let Ok(Step::Check(condition, _)) = read(CONDITION, line, cell) {
        let reading = cell.read(&condition);
        let reading = reading.map_err(|error| report::cell_failure(&error, style))?;
        style.document(&Answer {
            asked: line,
            truth: reading.truth,
            margin: reading.margin.map(measure),
            told: report::why::now(line, &reading),
        });
        return Ok(if reading.truth == Some(true) { Exit::Yes } else { Exit::No });
    }
    // No condition, then: how much is it?
    let step = read(QUANTITY, line, cell)
        .map_err(|wrong| report::text_failure(&wrong, &Source::new("command line", line), style))?;
    let Step::Let(_, value, _) = step else {
        return Err(Failure::input("usage", "this is neither a condition nor a quantity"));
    };
    let worth = cell.quantity(&value).map_err(|error| report::cell_failure(&error, style))?;
    style.document(&json!({ "asked": line, "value": worth.map(measure) }));
    Ok(if worth.is_some() { Exit::Yes } else { Exit::No })
}

/// Reads and checks a line as the step that the words `before` it make of it; else says what is wrong, in places of the line.
fn read(before: &str, line: &str, cell: &WorkCell) -> Result<Step, Vec<Diagnostic>> {
    let source = Source::new("command line", format!("{before}{line}"));
    let (step, mut wrong) = language::parse_line(&source.text);
    if let Some(step) = step.as_ref().filter(|_| wrong.is_empty()) {
        wrong = cell.check_line(step, &source);
    }
    match step {
        Some(step) if !wrong.iter().any(Diagnostic::is_error) => Ok(step),
        _ => Err(wrong.into_iter().map(|each| each.without_first(before.len())).collect()),
    }
}
