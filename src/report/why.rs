//! Why a run went as it did: the comparison that decided with its numbers, its limit and its margin, which
//! way and how surely, how the same step went in earlier runs, and up to three things to try.
//!
//! Margins are those of the record, each in the unit of its own term. A margin within two standard
//! deviations of zero is not an answer, and is told as one that nobody can give.

use std::fmt::Write as _;

use crate::execution::trace::{FluentRow, Measure, Outcome, StepRecord, TermRow};
use crate::execution::walk::FluentReading;
use crate::monitor;
use crate::workcell::{Ending, Run};
use crate::world::fluent::{Direction, Reading};

use super::Failure;
use super::run::{during, people};

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

/// How many things to try are told.
const MOST_TRIES: usize = 3;
/// From how many runs on a margin that keeps its sign may be called a bias.
const ENOUGH_RUNS: usize = 3;

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
    match failed {
        Some(step) if run.outcome != Ending::Success => Ok(failure(question, step)),
        _ => Ok(without_failure(run)),
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
    let is_it = |row: &&FluentRow| {
        row.name == name || row.name.strip_prefix(name).is_some_and(|rest| rest.starts_with('('))
    };
    let rows: Vec<_> = run
        .steps
        .iter()
        .flat_map(|step| step.fluents.iter().filter(is_it).map(move |row| (step, row)))
        .collect();
    let promised = rows.iter().rev().find(|(_, row)| row.expected.is_some());
    promised.or(rows.last()).copied()
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
        [] => failure.help("no step was carried out"),
        known => failure.help(format!("it says something of {}", known.join(", "))),
    }
}

/// A run in which no step failed in the end.
fn without_failure(run: &Run) -> String {
    let steps = run.steps.len();
    let mut text = match (&run.reason, run.outcome) {
        (Some(reason), _) => return format!("{}: {reason}", run.task),
        (None, Ending::Stopped) => {
            return format!("{} was stopped after {steps} whole steps", run.task);
        }
        (None, _) => format!("{} did what it promised in all {steps} steps", run.task),
    };
    let again = run.steps.iter().filter(|step| step.outcome != Outcome::Success);
    for step in again {
        let reason = step.reason.as_deref().unwrap_or("no reason was given");
        let _ = write!(
            text,
            "\n  at step {} {}: {reason}; it was done again",
            step.number, step.action
        );
    }
    for step in &run.steps {
        for line in step.during.iter().filter(|row| row.ends).filter_map(during) {
            let _ = write!(text, "\n  step {} {}: {line}", step.number, step.action);
        }
    }
    if let Some((step, line)) = nearly_lost(run) {
        let _ = write!(
            text,
            "\n  nearest to being lost, in step {} {}: {line}",
            step.number, step.action
        );
    }
    for (unit, step, row) in narrowest(run) {
        let _ = write!(
            text,
            "\n  the smallest margin in {unit} was {} after step {} {}: {}",
            row.name,
            step.number,
            step.action,
            row.margin.as_ref().map(people).unwrap_or_default()
        );
    }
    text
}

/// Returns the condition with the smallest margin while a step ran, in words. Margins of different units
/// are compared by their share of what is usual in each.
fn nearly_lost(run: &Run) -> Option<(&StepRecord, String)> {
    let all = run.steps.iter().flat_map(|step| step.during.iter().map(move |row| (step, row)));
    let kept = all.filter(|(_, row)| !row.ends).filter_map(|(step, row)| {
        let least = row.measured.least.as_ref()?;
        Some((usual_share(least), step, row))
    });
    let (_, step, row) = kept.min_by(|a, b| a.0.total_cmp(&b.0))?;
    during(row).map(|line| (step, line))
}

/// Returns a margin as a share of what counts as a lot in its unit.
fn usual_share(margin: &Measure) -> f64 {
    let lot = match margin.unit.as_str() {
        "m" => 0.01,
        "rad" => 5.0_f64.to_radians(),
        "m^3" => 10e-6,
        _ => 1.0,
    };
    margin.value / lot
}

/// Returns the promise kept by the smallest margin, for each unit: margins of different units are not
/// compared with each other.
fn narrowest(run: &Run) -> Vec<(String, &StepRecord, &FluentRow)> {
    let mut best: Vec<(String, &StepRecord, &FluentRow)> = Vec::new();
    for step in &run.steps {
        for row in step.fluents.iter().filter(|row| row.expected == Some(true)) {
            let Some(margin) = row.margin.as_ref().filter(|_| row.measured == Some(true)) else {
                continue;
            };
            let smaller = |row: &FluentRow| {
                row.margin.as_ref().is_some_and(|known| margin.value < known.value)
            };
            match best.iter_mut().find(|(unit, ..)| *unit == margin.unit) {
                Some(known) if smaller(known.2) => *known = (margin.unit.clone(), step, row),
                Some(_) => {}
                None => best.push((margin.unit.clone(), step, row)),
            }
        }
    }
    best
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
    let reason = step.reason.as_deref().unwrap_or_default();
    let named = |row: &&FluentRow| {
        reason.contains(&format!("`{}`", row.name))
            || row.terms.iter().any(|term| reason.contains(&format!("`{}`", term.text)))
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
        for term in &row.terms {
            let _ = write!(told, "\n  {}", comparison(term));
        }
        if let Some(direction) = &row.direction {
            let _ = write!(told, "\n{}", way(direction, row.margin.as_ref()));
        }
    }
    told
}

pub(super) fn verdict(row: &FluentRow) -> String {
    let by = row.margin.as_ref().map(|margin| format!(" by {}", size(margin)));
    match row.measured {
        Some(true) => format!("{} is true{}", row.name, by.unwrap_or_default()),
        Some(false) => format!("{} is false{}", row.name, by.unwrap_or_default()),
        None => {
            let why = row.why.as_deref().unwrap_or("it was not measured");
            format!("nobody can tell whether {}: {why}", row.name)
        }
    }
}

fn comparison(term: &TermRow) -> String {
    let mark = match term.truth {
        Some(true) => "yes",
        Some(false) => "NO ",
        None => "?  ",
    };
    let mut text = format!("{mark}  {}", term.text);
    if let (Some(value), Some(limit)) = (&term.value, &term.limit) {
        let _ = write!(text, "\n         is {}, limit {}", unsigned(value), unsigned(limit));
        if let Some(margin) = &term.margin {
            let _ = write!(text, ", margin {}", people(margin));
        }
        if let Some(std) = &term.std {
            let _ = write!(text, " ± {}", unsigned(std));
        }
    }
    text
}

/// A quantity as people write it, without a sign of its own when it is positive.
pub(super) fn unsigned(measure: &Measure) -> String {
    let text = people(measure);
    text.strip_prefix('+').map_or(text.clone(), str::to_owned)
}

/// How much a margin is, without its sign: `31 mm`.
pub(super) fn size(margin: &Measure) -> String {
    unsigned(&Measure { value: margin.value.abs(), unit: margin.unit.clone() })
}

pub(super) fn way(direction: &Direction, margin: Option<&Measure>) -> String {
    let by = margin.map_or_else(String::new, |margin| format!(" {}", size(margin)));
    let axes = ["x", "y", "z"];
    let largest =
        (0..3).max_by(|i, j| direction.world[*i].abs().total_cmp(&direction.world[*j].abs()));
    let axis = largest.unwrap_or(0);
    let sign = if direction.world[axis] < 0.0 { '-' } else { '+' };
    format!(
        "`{}` would have to move{by} {} as the camera sees it ({sign}{} in the table's frame)",
        direction.object, direction.camera, axes[axis]
    )
}

fn in_this_run(run: &Run, step: &StepRecord, row: &FluentRow) -> String {
    let mut text = format!("after step {} {}", step.number, step.action);
    match row.expected {
        Some(wanted) => {
            let wanted = if wanted { "true" } else { "false" };
            let _ = write!(text, ", which should have made it {wanted}");
        }
        None => text += ", which promised nothing about it",
    }
    let margin = row.twin_margin.as_ref().map(|m| format!(" ({})", people(m))).unwrap_or_default();
    let twin = match row.twin {
        Some(true) => format!("true{margin}"),
        Some(false) => format!("false too{margin}"),
        None => String::new(),
    };
    if twin.is_empty() {
        text += "; the twin had nothing to say of it";
    } else {
        let _ = write!(text, "; the twin had it {twin}");
    }
    if row.measured == Some(false) {
        let before = run.steps.iter().take_while(|earlier| earlier.number < step.number);
        let was = before.filter(|earlier| {
            earlier.fluents.iter().any(|r| r.name == row.name && r.measured == Some(true))
        });
        match was.last() {
            Some(earlier) => {
                let _ = write!(text, "; it was last true after step {}", earlier.number);
            }
            None => text += "; it was never true in this run",
        }
    }
    text
}

/// The same fluent after the same step, in earlier runs.
fn history(question: &Question<'_>, step: &StepRecord, row: &FluentRow) -> Option<String> {
    let same = |run: &Run| -> Option<FluentRow> {
        let there = run.steps.iter().find(|s| s.path == step.path)?;
        there.fluents.iter().find(|r| r.name == row.name).cloned()
    };
    let rows: Vec<FluentRow> = question.earlier.iter().filter_map(|(_, run)| same(run)).collect();
    if rows.is_empty() {
        return None;
    }
    let count = |truth| rows.iter().filter(|row| row.measured == truth).count();
    let runs = if rows.len() == 1 { "run" } else { "runs" };
    let mut text = format!(
        "in {} earlier {runs} this step ended with it true {}, false {}, unknown {}",
        rows.len(),
        times(count(Some(true))),
        times(count(Some(false))),
        times(count(None))
    );
    let unit = row.margin.as_ref().map(|margin| margin.unit.as_str())?;
    let margins: Vec<f64> = rows
        .iter()
        .chain([row])
        .filter_map(|row| row.margin.as_ref())
        .filter(|margin| margin.unit == unit)
        .map(|margin| margin.value)
        .collect();
    if margins.len() < 2 {
        return Some(text);
    }
    let at = |value: f64| people(&Measure { value, unit: unit.to_owned() });
    let least = margins.iter().copied().fold(f64::INFINITY, f64::min);
    let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let _ = write!(text, "; with this one the margins are {} to {}", at(least), at(most));
    if is_bias(&margins) {
        text += ": a bias, not chance";
    }
    Some(text)
}

/// Whether margins of one sign are further from zero than their scatter explains: the mean is beyond two
/// standard errors.
fn is_bias(margins: &[f64]) -> bool {
    let n = margins.len() as f64;
    let mean = margins.iter().sum::<f64>() / n;
    let spread = margins.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    margins.len() >= ENOUGH_RUNS
        && margins.iter().all(|margin| *margin < 0.0)
        && mean.abs() > 2.0 * (spread / n).sqrt()
}

fn times(n: usize) -> String {
    match n {
        0 => "never".to_owned(),
        1 => "once".to_owned(),
        n => format!("{n} times"),
    }
}

/// Up to three things to try, the likeliest to help first.
pub(super) fn tries(question: &Question<'_>, step: &StepRecord, row: Option<&FluentRow>) -> String {
    let mut found: Vec<String> = Vec::new();
    if let Some(row) = row {
        found.extend(by_margin(step, row));
    }
    found.extend(other_branches(question.run, step));
    let good = question.earlier.iter().rev().find(|(_, run)| {
        run.steps.iter().any(|s| s.path == step.path && s.outcome == Outcome::Success)
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
        (None, _) => Some(":look photographs the table again, to know it more surely".into()),
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
                direction.camera
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
