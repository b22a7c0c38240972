//! Why a run went as it did: the comparison that decided with its numbers, its limit and its margin, which
//! way and how surely, how the same step went in earlier runs, and up to three things to try.
//!
//! Margins are those of the record, each in the unit of its own term. A margin within two standard
//! deviations of zero is not an answer, and is told as one that nobody can give.

mod words;
mod history;
mod tries;
mod kept;

use std::fmt::Write as _;

use crate::execution::done::FluentReading;
use crate::fluent::Reading;
use crate::monitor;
use crate::trace::{FluentRow, Outcome, StepRecord, TermRow};
use crate::workcell::Run;

use super::Failure;
use super::run::{during, left_in_hand};
use history::{history, in_this_run};
use kept::without_failure;
pub(super) use tries::tries;
use words::{comparison, standing};
pub(super) use words::{size, to_camera, unsigned, verdict, way};

/// What is asked.
pub struct Question<'a> {
    /// The run.
    pub run: &'a Run,
    /// Its number among the runs that are kept, if it has one.
    pub number: Option<usize>,
    /// The fluent, by its whole text or its name; what failed when `None`.
    pub fluent: Option<&'a str>,
    /// Other runs, the oldest first, with their numbers.
    pub earlier: &'a [(usize, Run)],
    /// Says where a fluent is defined.
    pub place: &'a dyn Fn(&str) -> Option<String>,
}

/// Answers the question.
///
/// # Errors
///
/// When the run has no such fluent; the help names those it has.
pub fn why(question: &Question<'_>) -> Result<String, Failure> {
    let run = question.run;
    if let Some(name) = question.fluent {
        if let Some((step, row)) = recorded(run, name) {
            return Ok(told(question, step, row));
        }
        return while_running(run, name).ok_or_else(|| not_recorded(run, name));
    }
    let failed = run.steps.iter().rev().find(|step| step.outcome != Outcome::Success);
    let mut text = match failed {
        Some(step) if !run.outcome.is_done() => failure(question, step),
        _ => without_failure(run),
    };
    if let Some(held) = left_in_hand(run) {
        let _ = write!(text, "\n  {held}");
    }
    Ok(text)
}

/// As [`why`], for a run that is under way: a fluent that is named is told as it is after the last step, whatever was promised
/// before.
///
/// # Errors
///
/// As [`why`].
pub fn latest(question: &Question<'_>) -> Result<String, Failure> {
    let rows = question.fluent.map(|name| rows(question.run, name)).unwrap_or_default();
    match rows.last() {
        Some((step, row)) => Ok(told(question, step, row)),
        None => why(question),
    }
}

/// Answers for one fluent after one step, whatever it is worth there.
///
/// # Errors
///
/// When there is no such step, or it says nothing of the fluent that is asked about.
pub fn of_step(question: &Question<'_>, number: usize) -> Result<String, Failure> {
    let (step, row) = stated(question, number)?;
    Ok(told(question, step, row))
}

/// Returns the rungs of a ladder from a hint to an answer, each with what it is about and helping more than
/// the one before: how close it is, which way it would have to move, what to try. What is true has the first
/// alone, and what nobody promised needs no remedy.
///
/// # Errors
///
/// As [`of_step`].
pub fn hints(
    question: &Question<'_>,
    number: usize,
) -> Result<Vec<(&'static str, String)>, Failure> {
    let (step, row) = stated(question, number)?;
    let close =
        row.terms.iter().fold(verdict(row), |text, term| format!("{text}\n  {}", comparison(term)));
    let mut rungs = vec![("how close it is", close)];
    if row.measured == Some(true) {
        return Ok(rungs);
    }
    if let Some(direction) = &row.direction {
        rungs.push(("which way", way(direction, row.margin.as_ref())));
    }
    let tries = tries(question, step, Some(row));
    if row.expected == Some(true) && !tries.is_empty() {
        rungs.push(("what to try", tries.trim_start().to_owned()));
    }
    Ok(rungs)
}

/// Returns the step of that number and what it says of the fluent that is asked about.
fn stated<'a>(
    question: &Question<'a>,
    number: usize,
) -> Result<(&'a StepRecord, &'a FluentRow), Failure> {
    let run = question.run;
    let name = question.fluent.unwrap_or_default();
    let step = run.steps.iter().find(|step| step.number == number).ok_or_else(|| {
        Failure::input("why::step", format!("{} has no step {number}", run.task))
            .help(format!("it has {} steps", run.steps.len()))
    })?;
    let row = step.fluents.iter().find(|row| row.name == name);
    Ok((step, row.ok_or_else(|| not_recorded(run, name))?))
}

/// Returns the last step that says something of a fluent, those that promised it before others.
fn recorded<'a>(run: &'a Run, name: &str) -> Option<(&'a StepRecord, &'a FluentRow)> {
    let rows = rows(run, name);
    let promised = rows.iter().rev().find(|(_, row)| row.expected.is_some());
    promised.or(rows.last()).copied()
}

/// Returns what the steps of a run say of a fluent, by its whole text or its name, in their order.
fn rows<'a>(run: &'a Run, name: &str) -> Vec<(&'a StepRecord, &'a FluentRow)> {
    let is_it = |row: &&FluentRow| {
        row.name == name || row.name.strip_prefix(name).is_some_and(|rest| rest.starts_with('('))
    };
    run.steps
        .iter()
        .flat_map(|step| step.fluents.iter().filter(is_it).map(move |row| (step, row)))
        .collect()
}

/// Tells of a condition that was in force while steps ran, by its whole text.
fn while_running(run: &Run, name: &str) -> Option<String> {
    let mut told = Vec::new();
    for step in &run.steps {
        let rows = step.during.iter().filter(|row| row.name == name);
        let lines = rows.filter_map(during);
        told.extend(lines.map(|line| format!("step {} {}: {line}", step.number, step.action)));
    }
    (!told.is_empty()).then(|| told.join("\n"))
}

fn not_recorded(run: &Run, name: &str) -> Failure {
    let mut known: Vec<&str> =
        run.steps.iter().flat_map(|step| &step.fluents).map(|row| row.name.as_str()).collect();
    known.sort_unstable();
    known.dedup();
    let failure = Failure::input("why::fluent", format!("{} says nothing of `{name}`", run.task));
    match known.as_slice() {
        [] => failure.help("no step has run"),
        known => failure.help(format!("it says something of {}", known.join(", "))),
    }
}

/// A step that failed: its reason, then the fluent that decided.
fn failure(question: &Question<'_>, step: &StepRecord) -> String {
    let mut text = format!("step {} {} ", step.number, step.action);
    text += match step.outcome {
        Outcome::Stopped => "was stopped",
        _ => "did not do what it should",
    };
    if let Some(reason) = &step.reason {
        let _ = write!(text, ": {reason}");
    }
    if step.outcome == Outcome::Stopped {
        return text;
    }
    for line in step.during.iter().filter_map(during) {
        let _ = write!(text, "\n  {line}");
    }
    match decided(step) {
        Some(row) => {
            text.push('\n');
            text += &told(question, step, row);
        }
        None => text += &tries(question, step, None),
    }
    text
}

/// Returns the fluent that a failed step failed by: a promise that is not so, or what its reason names.
fn decided(step: &StepRecord) -> Option<&FluentRow> {
    let denied = |row: &&FluentRow| matches!((row.expected, row.measured), (Some(wanted), Some(is)) if wanted != is);
    let unmet = step.failure.as_ref().and_then(|failure| failure.cause.unmet());
    let named = |row: &&FluentRow| {
        let is_it = |text: &str| unmet.is_some_and(|unmet| unmet.is(text));
        // A term may say after its text which of several it is.
        let is_term = |text: &str| {
            is_it(text) || text.rsplit_once(": ").is_some_and(|(plain, _)| is_it(plain))
        };
        is_it(&row.name) || row.terms.iter().any(|term| is_term(&term.text))
    };
    step.fluents.iter().find(denied).or_else(|| step.fluents.iter().find(named))
}

/// All there is to say of one fluent after one step.
fn told(question: &Question<'_>, step: &StepRecord, row: &FluentRow) -> String {
    let mut text = verdict(row);
    let name = row.name.split('(').next().unwrap_or_default();
    if let Some(place) = (question.place)(name) {
        let _ = write!(text, "   {place}");
    }
    for term in &row.terms {
        let _ = write!(text, "\n  {}", comparison(term));
    }
    if let Some(direction) = &row.direction {
        let _ = write!(text, "\n{}", way(direction, row.margin.as_ref()));
    }
    let _ = write!(text, "\n{}", in_this_run(question.run, step, row));
    if let Some(history) = history(question, step, row) {
        let _ = write!(text, "\n{history}");
    }
    if row.measured != Some(true) {
        text += &tries(question, step, Some(row));
    }
    text
}

/// Words what a condition is worth now, outside of any run.
pub fn now(text: &str, reading: &Reading) -> String {
    let read = FluentReading {
        text: text.to_owned(),
        expected: None,
        reading: reading.clone(),
        ask: None,
    };
    let compared = monitor::compare(&[], &[read]);
    let mut told = String::new();
    for row in &compared.rows {
        told += &verdict(row);
        if row.measured == Some(false) {
            let (held, failed): (Vec<_>, Vec<_>) =
                row.terms.iter().partition(|term| term.truth == Some(true));
            let said = |terms: &[&TermRow]| {
                terms.iter().filter_map(|term| standing(term)).collect::<Vec<_>>().join(", ")
            };
            let (held, failed) = (said(&held), said(&failed));
            let but = if held.is_empty() { "" } else { ", but " };
            if !failed.is_empty() {
                let _ = write!(told, "\n  {held}{but}{failed}");
            }
        }
        for term in &row.terms {
            let _ = write!(told, "\n  {}", comparison(term));
        }
        if let Some(direction) = &row.direction {
            let _ = write!(told, "\n{}", way(direction, row.margin.as_ref()));
        }
    }
    told
}
