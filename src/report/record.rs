//! Runs that are kept, in words: a list, two side by side, one again.

use std::fmt::Write as _;
use std::path::Path;

use crate::trace::{FluentRow, Outcome, StepRecord};
use crate::workcell::archive::{Entry, Standing, standing};
use crate::workcell::{Ending, Run, picture};

use super::run::{people, step as words_of_step};
use super::{Failure, Style};

/// How many margins that moved are told of two runs.
const MOST_MOVED: usize = 5;

/// Words a list of runs, those that cannot be read among them. The task stands last, since it may be long.
pub fn list(runs: &[(Entry, Option<Run>)]) -> String {
    let wide = runs.iter().map(|(entry, _)| entry.name.chars().count()).max().unwrap_or(0).max(6);
    let mut text = format!(
        "{:>4}  {:<wide$}  {:<11}  {:>5}  {:>11}  task",
        "run", "folder", "ended", "steps", "twin agrees"
    );
    for (entry, run) in runs {
        let _ = write!(text, "\n{:>4}  {:<wide$}  ", entry.number, entry.name);
        let _ = match run {
            None => write!(text, "cannot be read"),
            Some(run) => {
                let ended = ended(standing(&entry.dir, run));
                let (of, agree) = run.agreeing();
                let agree = format!("{agree} of {of}");
                write!(text, "{ended:<11}  {of:>5}  {agree:>11}  {}", run.task)
            }
        };
    }
    text
}

pub(super) fn ended(standing: Standing) -> &'static str {
    match standing {
        Standing::Running => "running",
        Standing::CutOff => "cut off",
        Standing::Ended(Ending::Success) => "done",
        Standing::Ended(Ending::Unconfirmed) => "unconfirmed",
        Standing::Ended(Ending::Failure) => "failed",
        Standing::Ended(Ending::Stopped) => "stopped",
        Standing::Ended(Ending::Unavailable) => "unavailable",
    }
}

/// How a run stands that is looked at by itself.
fn own_standing(run: &Run) -> Standing {
    standing(Path::new(run.run_dir.as_deref().unwrap_or_default()), run)
}

/// Words the run in folder `dir` again from its record: all of it, or one step with everything known after it.
///
/// # Errors
///
/// When there is no such step.
pub fn again(
    (name, dir): (&str, &Path),
    run: &Run,
    step: Option<usize>,
    style: Style,
) -> Result<String, Failure> {
    let mut text = format!(
        "{name}: {} with {}, seed {}; this is the record, the arm does not move\n",
        run.task, run.robot, run.seed
    );
    let mut before: &[FluentRow] = &[];
    for record in &run.steps {
        if step.is_none_or(|wanted| wanted == record.number) {
            // A step that is asked for by itself is told with all its fluents.
            let known = if step.is_some() { &[] } else { before };
            text += &words_of_step(record, known, 0, style);
            if step.is_some() {
                text += &everything_else(record);
            }
        }
        before = &record.fluents;
    }
    match step {
        Some(wanted) if run.steps.iter().all(|record| record.number != wanted) => {
            Err(Failure::input("replay::step", format!("{name} has no step {wanted}"))
                .help(format!("it has {} steps", run.steps.len())))
        }
        Some(wanted) => {
            if let Some(dir) = &run.run_dir {
                for name in [picture::before, picture::after] {
                    let path = picture::file(Path::new(dir), &name(wanted, "real"));
                    let _ = writeln!(text, "       pictures: {} and -twin", path.display());
                }
            }
            Ok(text.trim_end().to_owned())
        }
        None => {
            text += &super::run::ending(run, style);
            text += match standing(dir, run) {
                Standing::Running => "\n  it goes on now",
                Standing::CutOff if run.reason.is_some() => {
                    "\n  it was cut off: nothing is kept of what came after that"
                }
                Standing::CutOff => {
                    "\n  it was cut off: its program ended, or found no room to write, before it was over"
                }
                Standing::Ended(_) => "",
            };
            Ok(text.trim_end().to_owned())
        }
    }
}

/// The fluents that a step's own table leaves out because they are no news.
pub(super) fn everything_else(record: &StepRecord) -> String {
    let quiet = record.fluents.iter().filter(|row| row.expected.is_none() && row.ask.is_none());
    let names: Vec<String> = quiet
        .filter(|row| !matches!((row.twin, row.measured), (Some(a), Some(b)) if a != b))
        .map(|row| format!("{} {}", row.name, truth(row.measured)))
        .collect();
    if names.is_empty() {
        return String::new();
    }
    format!("       also measured: {}\n", names.join("; "))
}

fn truth(truth: Option<bool>) -> &'static str {
    match truth {
        Some(true) => "yes",
        Some(false) => "no",
        None => "unknown",
    }
}

/// Words what is different in two runs, line by line: the two runs, one that did no step with why, the branches, then steps that one has
/// and the other has not, then what was true in one and not in the other, then the margins that moved most.
pub fn difference((a, first): (usize, &Run), (b, second): (usize, &Run)) -> Vec<String> {
    let head = |number: usize, run: &Run| {
        let ended = ended(own_standing(run));
        format!("run {number}: {} {ended}, {} steps", run.task, run.agreeing().0)
    };
    let heads = [head(a, first), head(b, second)];
    let mut lines = Vec::new();
    for (number, run) in [(a, first), (b, second)] {
        if let (true, Some(reason)) = (run.steps.is_empty(), &run.reason) {
            lines.push(format!("run {number} did no step: {reason}"));
        }
    }
    let both = matched(first, second);
    if lines.is_empty() {
        lines = branches((a, first), (b, second));
        lines.extend(alone((a, first), &|at| both.iter().any(|pair| pair.0 == at)));
        lines.extend(alone((b, second), &|at| both.iter().any(|pair| pair.1 == at)));
    }
    let mut moved = Vec::new();
    for (one, other) in both.iter().map(|&(here, there)| (&first.steps[here], &second.steps[there]))
    {
        let step = format!("step {} {}", one.number, one.action);
        let (here, there) = (outcome(one), outcome(other));
        if here != there {
            lines.push(format!("{step}: {here} in run {a}, {there} in run {b}"));
        }
        for row in &one.fluents {
            let Some(there) = other.fluents.iter().find(|r| r.name == row.name) else { continue };
            if row.measured != there.measured {
                let said = |row: &FluentRow| format!("{}{}", truth(row.measured), margin(row));
                let (here, there) = (said(row), said(there));
                lines.push(format!(
                    "after {step}: {} {here} in run {a}, {there} in run {b}",
                    row.name
                ));
            } else if let Some(by) = shift(row, there) {
                let (here, there) = (margin(row), margin(there));
                let line =
                    format!("  {} after {step}:{here} in run {a},{there} in run {b}", row.name);
                moved.push((by, line));
            }
        }
    }
    if lines.is_empty() {
        lines.push("the same branches, the same steps, and the same is true after each".into());
    }
    // Margins of different units are ranked by how far they moved beside their own size.
    moved.sort_by(|x, y| y.0.total_cmp(&x.0));
    if !moved.is_empty() {
        lines.push("margins that moved most:".into());
    }
    lines.extend(moved.into_iter().take(MOST_MOVED).map(|(_, line)| line));
    heads.into_iter().chain(lines).collect()
}

fn outcome(step: &StepRecord) -> &'static str {
    match step.outcome {
        Outcome::Success if !step.was_carried_out() => "not needed",
        Outcome::Success => "done",
        Outcome::Failure => "failed",
        Outcome::Stopped => "stopped",
    }
}

fn margin(row: &FluentRow) -> String {
    row.margin.as_ref().map(|margin| format!(" ({})", people(margin))).unwrap_or_default()
}

/// How far a margin moved beside its size; `None` when it is the same but for its uncertainty.
fn shift(row: &FluentRow, there: &FluentRow) -> Option<f64> {
    let (a, b) = (row.margin.as_ref()?, there.margin.as_ref()?);
    let sigma = |row: &FluentRow| row.std.as_ref().map_or(0.0, |std| std.value);
    let by = (a.value - b.value).abs();
    let size = a.value.abs().max(b.value.abs());
    let is_news = a.unit == b.unit && by > 2.0 * sigma(row).hypot(sigma(there)) && by > 0.05 * size;
    is_news.then(|| by / size)
}

fn branches((a, first): (usize, &Run), (b, second): (usize, &Run)) -> Vec<String> {
    let (Some(one), Some(other)) = (first.parse_graphs.last(), second.parse_graphs.last()) else {
        return Vec::new();
    };
    let each = one.choices.iter().filter_map(|choice| {
        let there = other.branch(&choice.node).filter(|there| *there != choice.branch)?;
        Some(format!("at {}: {} in run {a}, {there} in run {b}", choice.node, choice.branch))
    });
    each.collect()
}

/// The places of the steps that both have: by path and by how often it was met before, and what is left, as of two calls that begin
/// alike, by what the steps say, in order.
fn matched(first: &Run, second: &Run) -> Vec<(usize, usize)> {
    let pairs = first.steps.iter().enumerate().filter_map(|(here, step)| {
        let nth = first.steps[..here].iter().filter(|s| s.path == step.path).count();
        let mut there = second.steps.iter().enumerate().filter(|(_, s)| s.path == step.path);
        there.nth(nth).map(|(there, _)| (here, there))
    });
    let mut pairs: Vec<(usize, usize)> = pairs.collect();
    let here = (0..first.steps.len()).filter(|at| pairs.iter().all(|pair| pair.0 != *at));
    let here: Vec<usize> = here.collect();
    let there = (0..second.steps.len()).filter(|at| pairs.iter().all(|pair| pair.1 != *at));
    let there: Vec<usize> = there.collect();
    let said = |run: &Run, places: &[usize]| -> Vec<String> {
        places.iter().map(|&at| run.steps[at].action.clone()).collect()
    };
    let alike = in_order(&said(first, &here), &said(second, &there));
    pairs.extend(alike.into_iter().map(|(i, j)| (here[i], there[j])));
    pairs.sort_unstable();
    pairs
}

/// The places of the texts that two lists have in common: as many as there can be in order.
fn in_order(a: &[String], b: &[String]) -> Vec<(usize, usize)> {
    // How many are in common from two places on.
    let mut most = vec![vec![0_usize; b.len() + 1]; a.len() + 1];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            most[i][j] = if a[i] == b[j] {
                most[i + 1][j + 1] + 1
            } else {
                most[i + 1][j].max(most[i][j + 1])
            };
        }
    }
    let (mut pairs, mut i, mut j) = (Vec::new(), 0, 0);
    while i < a.len() && j < b.len() {
        if a[i] == b[j] {
            pairs.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if most[i + 1][j] >= most[i][j + 1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    pairs
}

fn alone((number, run): (usize, &Run), is_matched: &dyn Fn(usize) -> bool) -> Vec<String> {
    let only = run.steps.iter().enumerate().filter(|(at, _)| !is_matched(*at));
    only.map(|(_, step)| format!("only in run {number}: step {} {}", step.number, step.action))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_two_calls_are_matched_by_what_they_say_in_order() {
        let list = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let (pick, pour) = (list("approach grasp lift"), list("home approach grasp lift carry"));
        assert_eq!(in_order(&pick, &pour), [(0, 1), (1, 2), (2, 3)]);
        assert_eq!(in_order(&pour, &pick), [(1, 0), (2, 1), (3, 2)]);
        assert_eq!(in_order(&list("a b a"), &list("b a b")), [(1, 0), (2, 1)]);
        assert!(in_order(&pick, &[]).is_empty());
    }
}
