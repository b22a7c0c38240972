//! What changed over several runs that nothing declared, and what was declared and did not change.
//!
//! After each step a fluent either stayed as it was, which needs no explanation, or an action explains it by what
//! it `gives`. What is neither is one of four: a *failed effect* was declared and did not come about; a *missing
//! effect* happened where it was measured and not in the twin; a *phantom effect* only in the twin; an
//! *undeclared effect* in both, so that the twin knows what the language does not say. Which of the last three it is
//! is judged by the runs in which both could be told: what nobody measured is not absent, and what was never
//! simulated is not missing in the twin. Where there is no such run nothing is said.
//!
//! Source: Fire and Zhu, "Learning Perceptual Causality from Video", 2016: inertia and causes as one Or.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::trace::{FluentRow, Measure, Outcome, StepRecord};

/// What a change that is not explained is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// It happened where it was measured and not in the twin.
    Missing,
    /// It was declared and did not come about.
    Failed,
    /// It happened in the twin only.
    Phantom,
    /// It happened in both, and no `gives` says so.
    Undeclared,
}

/// Of so many runs in which it could be told, so many had it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Count {
    /// Runs that had it.
    pub had: usize,
    /// Runs in which it could be told.
    pub of: usize,
}

/// A change of one fluent after one step, over runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// What it is.
    pub kind: Kind,
    /// The fluent.
    pub fluent: String,
    /// The value it took, or failed to take.
    pub becomes: bool,
    /// The step after which, as a call.
    pub step: String,
    /// Its number in the first run that had it.
    pub number: usize,
    /// As measured.
    pub measured: Count,
    /// In the twin.
    pub twin: Count,
    /// By how much, as measured in the run where that was most: the margin of the fluent.
    pub margin: Option<Measure>,
    /// The runs that had it as measured; of a phantom, in the twin.
    pub runs: Vec<String>,
}

/// One fluent after one step of one run.
struct Seen<'a> {
    run: &'a str,
    number: usize,
    row: &'a FluentRow,
    /// What it was before, as measured and in the twin.
    before: (Option<bool>, Option<bool>),
}

/// Returns what no step explains, over all runs; each is its name with its steps. Most frequent first, what the
/// twin lacks before what it has too. A step that was stopped says nothing: the twin is beyond where the arm came to rest;
/// nor does one that was not needed.
pub fn unexplained(runs: &[(&str, &[StepRecord])]) -> Vec<Change> {
    // A step is the same in two runs when it is the same call, the second of a kind when it is the second.
    let mut places: BTreeMap<(String, usize, String), Vec<Seen<'_>>> = BTreeMap::new();
    for (name, steps) in runs {
        let mut before: BTreeMap<&str, (Option<bool>, Option<bool>)> = BTreeMap::new();
        let mut times: BTreeMap<&str, usize> = BTreeMap::new();
        let tells = |step: &&StepRecord| step.outcome != Outcome::Stopped && step.was_carried_out();
        for step in steps.iter().filter(tells) {
            let time = times.entry(&step.action).or_insert(0);
            *time += 1;
            for row in &step.fluents {
                let seen = Seen {
                    run: name,
                    number: step.number,
                    row,
                    before: before.get(row.name.as_str()).copied().unwrap_or_default(),
                };
                let place = (step.action.clone(), *time, row.name.clone());
                places.entry(place).or_default().push(seen);
            }
            for row in &step.fluents {
                before.insert(&row.name, (row.measured, row.twin));
            }
        }
    }
    let mut found: Vec<Change> = places
        .iter()
        .flat_map(|((step, _, fluent), seen)| {
            [true, false].into_iter().filter_map(move |becomes| change(step, fluent, becomes, seen))
        })
        .collect();
    found.sort_by(|a, b| {
        let rank = |change: &Change| (change.kind, usize::MAX - change.runs.len(), change.number);
        rank(a).cmp(&rank(b)).then_with(|| a.fluent.cmp(&b.fluent))
    });
    found
}

/// Returns the change of a fluent to `becomes` after a step, if no declaration explains it.
fn change(step: &str, fluent: &str, becomes: bool, seen: &[Seen<'_>]) -> Option<Change> {
    let declared = |seen: &&Seen<'_>| seen.row.expected == Some(becomes);
    if seen.iter().any(|seen| declared(&seen)) {
        let declared: Vec<&Seen<'_>> = seen.iter().filter(declared).collect();
        let failed = |value: Option<bool>| value == Some(!becomes);
        let of = |value: &dyn Fn(&FluentRow) -> Option<bool>| Count {
            had: declared.iter().filter(|seen| failed(value(seen.row))).count(),
            of: declared.iter().filter(|seen| value(seen.row).is_some()).count(),
        };
        let had: Vec<&Seen<'_>> =
            declared.iter().copied().filter(|seen| failed(seen.row.measured)).collect();
        let (measured, twin) = (of(&|row| row.measured), of(&|row| row.twin));
        return told(Kind::Failed, step, fluent, becomes, &had, (measured, twin));
    }
    let changed = |before: Option<bool>, now: Option<bool>| {
        before.zip(now).map(|(before, now)| now == becomes && before != becomes)
    };
    let measured = |seen: &Seen<'_>| changed(seen.before.0, seen.row.measured);
    let twin = |seen: &Seen<'_>| changed(seen.before.1, seen.row.twin);
    let of = |value: &dyn Fn(&Seen<'_>) -> Option<bool>| Count {
        had: seen.iter().filter(|seen| value(seen) == Some(true)).count(),
        of: seen.iter().filter(|seen| value(seen).is_some()).count(),
    };
    let (arm, there) = (of(&measured), of(&twin));
    let both: Vec<(bool, bool)> =
        seen.iter().filter_map(|seen| measured(seen).zip(twin(seen))).collect();
    let on_arm = both.iter().filter(|(arm, _)| *arm).count();
    let in_twin = both.iter().filter(|(_, twin)| *twin).count();
    if on_arm + in_twin == 0 {
        return None;
    }
    let kind = match on_arm.cmp(&in_twin) {
        std::cmp::Ordering::Greater => Kind::Missing,
        std::cmp::Ordering::Less => Kind::Phantom,
        std::cmp::Ordering::Equal => Kind::Undeclared,
    };
    let value: &dyn Fn(&Seen<'_>) -> Option<bool> =
        if kind == Kind::Phantom { &twin } else { &measured };
    let had: Vec<&Seen<'_>> = seen.iter().filter(|seen| value(seen) == Some(true)).collect();
    told(kind, step, fluent, becomes, &had, (arm, there))
}

/// Puts a change together; `None` if no run had it.
fn told(
    kind: Kind,
    step: &str,
    fluent: &str,
    becomes: bool,
    had: &[&Seen<'_>],
    (measured, twin): (Count, Count),
) -> Option<Change> {
    let first = had.first()?;
    let size = |margin: &Measure| margin.value.abs();
    let margins = had.iter().filter_map(|seen| {
        let row = seen.row;
        if kind == Kind::Phantom { row.twin_margin.clone() } else { row.margin.clone() }
    });
    Some(Change {
        kind,
        fluent: fluent.to_owned(),
        becomes,
        step: step.to_owned(),
        number: first.number,
        measured,
        twin,
        margin: margins.max_by(|a, b| size(a).total_cmp(&size(b))),
        runs: had.iter().map(|seen| seen.run.to_owned()).collect(),
    })
}
