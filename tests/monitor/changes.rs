//! Which changes are explained, on runs of two steps that were made up.

use trueup::monitor::changes::{Change, Count, Kind, unexplained};
use trueup::trace::{FluentRow, Measure, Outcome, StepRecord};

use crate::kitchen;

fn row(name: &str, expected: Option<bool>, twin: bool, measured: Option<bool>) -> FluentRow {
    FluentRow {
        name: name.into(),
        expected,
        twin: Some(twin),
        measured,
        margin: Some(Measure { value: 0.004, unit: "m".into() }),
        twin_margin: None,
        ask: None,
        why: None,
        std: None,
        direction: None,
        terms: Vec::new(),
    }
}

fn step(number: usize, action: &str, fluents: Vec<FluentRow>) -> StepRecord {
    StepRecord {
        number,
        path: action.into(),
        action: action.into(),
        outcome: Outcome::Success,
        not_needed: None,
        reason: None,
        failure: None,
        call: None,
        interval_s: [0.0, 1.0],
        fluents,
        during: Vec::new(),
        lines: Vec::new(),
        planned_q: Vec::new(),
        hamming: 0,
        score: 1.0,
        measured: kitchen::state([0.5, 0.1, 0.0], [0.6, -0.1, 0.0]),
        twin: None,
    }
}

/// A tilt after a lift: how `pours` (declared), `wet` and `high` (not declared) fare.
fn run(pours: bool, wet: (bool, Option<bool>), high: (bool, bool)) -> Vec<StepRecord> {
    let before = vec![
        row("pours", None, false, Some(false)),
        row("wet", None, false, Some(false)),
        row("high", None, false, Some(false)),
        row("still", None, true, Some(true)),
    ];
    let after = vec![
        row("pours", Some(true), true, Some(pours)),
        row("wet", None, wet.0, wet.1),
        row("high", None, high.0, Some(high.1)),
        row("still", None, true, Some(true)),
    ];
    vec![step(1, "lift(jar)", before), step(2, "tilt(jar)", after)]
}

fn of<'a>(changes: &'a [Change], fluent: &str) -> &'a Change {
    changes.iter().find(|change| change.fluent == fluent).unwrap()
}

#[test]
fn the_four_kinds_are_told_apart_and_counted_over_runs() {
    let runs = [
        run(true, (false, Some(true)), (true, true)),
        run(true, (false, Some(true)), (true, true)),
        run(false, (false, None), (true, true)),
    ];
    let named: Vec<(&str, &[StepRecord])> =
        ["a", "b", "c"].into_iter().zip(runs.iter().map(|run| &run[..])).collect();
    let changes = unexplained(&named);
    let wet = of(&changes, "wet");
    assert_eq!((wet.kind, wet.becomes, wet.number), (Kind::Missing, true, 2));
    // In the third run nobody could tell.
    assert_eq!((wet.measured, wet.twin), (Count { had: 2, of: 2 }, Count { had: 0, of: 3 }));
    assert_eq!(wet.runs, ["a", "b"]);
    let pours = of(&changes, "pours");
    assert_eq!(
        (pours.kind, pours.measured, pours.runs[0].as_str()),
        (Kind::Failed, Count { had: 1, of: 3 }, "c")
    );
    assert_eq!(pours.twin, Count { had: 0, of: 3 });
    let high = of(&changes, "high");
    assert_eq!((high.kind, high.measured.had, high.twin.had), (Kind::Undeclared, 3, 3));
    assert_eq!(changes.len(), 3, "what stays as it was needs no explanation: {changes:#?}");
    // What the twin lacks comes first.
    assert_eq!(changes[0].fluent, "wet");
}

#[test]
fn what_only_the_twin_does_is_a_phantom_and_what_was_declared_is_explained() {
    let runs = [run(true, (true, Some(false)), (false, false))];
    let changes = unexplained(&[("a", &runs[0][..])]);
    assert_eq!(changes.len(), 1, "{changes:#?}");
    assert_eq!((changes[0].kind, changes[0].runs[0].as_str()), (Kind::Phantom, "a"));
}

#[test]
fn the_same_call_made_twice_is_two_places() {
    let mut twice = run(true, (false, Some(false)), (false, false));
    let again = run(true, (false, Some(true)), (false, false));
    twice.extend(again.into_iter().skip(1).map(|step| StepRecord { number: 3, ..step }));
    let changes = unexplained(&[("a", &twice[..])]);
    assert_eq!(changes.len(), 1, "{changes:#?}");
    assert_eq!((changes[0].fluent.as_str(), changes[0].number), ("wet", 3));
}

/// `upright(b)` was unknown on the arm after every step: `gap` called it a phantom, "in the twin only", with "0 of 0" beside it.
#[test]
fn what_nobody_could_tell_on_the_arm_is_no_phantom() {
    let unknown = || run(true, (true, None), (false, false));
    let runs = [unknown(), unknown()];
    let named: Vec<(&str, &[StepRecord])> =
        ["a", "b"].into_iter().zip(runs.iter().map(|run| &run[..])).collect();
    assert!(unexplained(&named).is_empty());
    // A run in which it could be told decides for all of them.
    let told = [unknown(), run(true, (true, Some(true)), (false, false))];
    let named: Vec<(&str, &[StepRecord])> =
        ["a", "b"].into_iter().zip(told.iter().map(|run| &run[..])).collect();
    let changes = unexplained(&named);
    let wet = of(&changes, "wet");
    assert_eq!(
        (wet.kind, wet.measured, wet.twin.of),
        (Kind::Undeclared, Count { had: 1, of: 1 }, 2)
    );
}

/// Steps that were never simulated were missing effects, one and all.
#[test]
fn what_was_never_simulated_is_not_missing_in_the_twin() {
    let mut bare = run(true, (true, Some(true)), (false, false));
    for row in bare.iter_mut().flat_map(|step| &mut step.fluents) {
        row.twin = None;
    }
    assert!(unexplained(&[("a", &bare[..])]).is_empty());
}

/// Ctrl-C in the middle of a turn: the twin had poured by the end of that step, and `pouring(jar, cup)` was called a phantom.
#[test]
fn a_step_that_was_stopped_says_nothing_of_the_twin() {
    let mut stopped = run(true, (true, Some(false)), (false, false));
    stopped[1].outcome = Outcome::Stopped;
    assert!(unexplained(&[("a", &stopped[..])]).is_empty());
}
