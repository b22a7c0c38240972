//! A run in which no step failed in the end: what was done again, and what was nearest to being lost.

use std::fmt::Write as _;

use crate::trace::{FluentRow, Measure, Outcome, StepRecord};
use crate::workcell::{Ending, Run, State};

use super::super::run::{during, people};

/// How many steps were done, as one says after "after".
fn steps_done(n: usize) -> String {
    match n {
        0 => "no complete step".into(),
        1 => "1 complete step".into(),
        n => format!("{n} complete steps"),
    }
}

/// A run in which no step failed in the end.
pub(super) fn without_failure(run: &Run) -> String {
    let steps = run.steps.len();
    let mut text = match (&run.reason, run.outcome) {
        (Some(reason), _) => return format!("{}: {reason}", run.task),
        _ if run.state == State::Running => {
            let done = steps_done(steps);
            return format!("{} is not over, or was cut off, after {done}", run.task);
        }
        (None, Ending::Stopped) => {
            return format!("{} was stopped after {}", run.task, steps_done(steps));
        }
        (None, _) if steps == 1 => format!("{} did what it promised in its one step", run.task),
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
        let _ =
            write!(text, "\n  tightest margin, in step {} {}: {line}", step.number, step.action);
    }
    for (unit, step, row) in narrowest(run) {
        let _ = write!(
            text,
            "\n  closest to its limit{}: {}, by {}, after step {} {}",
            of_unit(&unit),
            row.name,
            row.margin.as_ref().map(people).unwrap_or_default().trim_start_matches('+'),
            step.number,
            step.action,
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

/// Which margins are compared with each other, in words.
fn of_unit(unit: &str) -> &'static str {
    match unit {
        "m" => ", of lengths",
        "rad" => ", of angles",
        "m^3" => ", of volumes",
        "m/s" => ", of speeds",
        _ => "",
    }
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
