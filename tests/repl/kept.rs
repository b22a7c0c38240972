//! Three runs that are kept, written by hand: the first works, in the other two the jar's lip ends left of
//! the cup, though the twin had it right.

use std::fs;
use std::path::Path;

use trueup::fluent::Direction;
use trueup::graph::ParseGraph;
use trueup::graph::parse_graph::Choice;
use trueup::report::Style;
use trueup::report::record::{again, difference};
use trueup::report::why::{Question, why};
use trueup::trace::Line;
use trueup::trace::{FluentRow, Measure, Outcome, StepRecord, TermRow};
use trueup::workcell::{Ending, Run, State, Timing};
use trueup::world::{ObjectState, Pose, WorldState};

use crate::program::Scratch;

fn length(value: f64) -> Measure {
    Measure { value, unit: "m".into() }
}

fn state(time: f64) -> WorldState {
    let object = |name: &str, x: f64| ObjectState {
        name: name.into(),
        world_from_object: Some(Pose::upright(x, 0.1, 0.2, 0.0)),
        std: 0.001,
        water: None,
    };
    WorldState {
        time,
        q: vec![0.0; 7],
        opening: 0.06,
        world_from_tool: Pose::upright(0.5, 0.1, 0.3, 0.0),
        held: Some("jar".into()),
        objects: vec![object("jar", 0.5), object("cup", 0.55)],
        spilt: None,
        unknown: Vec::new(),
    }
}

/// `holding(jar)`, by `margin` m.
fn holding(margin: f64) -> FluentRow {
    FluentRow {
        name: "holding(jar)".into(),
        expected: Some(true),
        twin: Some(true),
        measured: Some(true),
        margin: Some(length(margin)),
        twin_margin: Some(length(0.11)),
        ask: Some("Has the robot already picked up the transparent jar?".into()),
        why: None,
        std: Some(length(0.001)),
        direction: None,
        terms: Vec::new(),
    }
}

/// `above(jar, cup)`: the lip is `off` m from the middle of the cup, of 35 mm that are allowed.
fn above(off: f64, sigma: f64) -> FluentRow {
    let margin = 0.035 - off;
    let truth = (margin.abs() >= 2.0 * sigma).then_some(margin >= 0.0);
    let why = truth.is_none().then(|| "the margin is within twice its uncertainty".to_owned());
    let term = |text: &str, value: f64, limit: f64, margin: f64, truth| TermRow {
        text: text.into(),
        truth,
        value: Some(length(value)),
        limit: Some(length(limit)),
        margin: Some(length(margin)),
        std: Some(length(sigma)),
    };
    let lip = "offset(lip(jar), center(cup)) <= rim(cup) - 5 mm";
    FluentRow {
        name: "above(jar, cup)".into(),
        expected: Some(true),
        twin: Some(true),
        measured: truth,
        margin: Some(length(margin)),
        twin_margin: Some(length(0.022)),
        ask: Some("Is the transparent jar above the blue cup?".into()),
        why,
        std: Some(length(sigma)),
        direction: (margin < 0.0).then(|| Direction {
            object: "jar".into(),
            world: [0.0, -1.0, 0.0],
            camera: "right".into(),
        }),
        terms: vec![
            term(lip, off, 0.035, margin, truth),
            term("gap(jar, cup) >= 2 cm", 0.048, 0.02, 0.028, Some(true)),
        ],
    }
}

/// What `lift.rhai` did.
fn lifted() -> Line {
    Line {
        script: "lift.rhai".into(),
        line: 2,
        text: "arm.raise(by, by - 2.0 * cm, 0.3);".into(),
        does: "move straight by 12.0 cm up at 30 % of full speed".into(),
        at_s: 0.0,
        deed: None,
    }
}

fn step(number: usize, path: &str, action: &str, rows: Vec<FluentRow>) -> StepRecord {
    let differ = |row: &&FluentRow| matches!((row.twin, row.measured), (Some(twin), Some(real)) if twin != real);
    let hamming = rows.iter().filter(differ).count();
    let failed = rows.iter().find(|row| row.measured == Some(false));
    let begin = 5.0 * number as f64;
    StepRecord {
        call: None,
        failure: None,
        number,
        path: path.into(),
        action: action.into(),
        outcome: if failed.is_some() { Outcome::Failure } else { Outcome::Success },
        not_needed: None,
        reason: failed.map(|row| format!("it promised `{}`, which is false", row.name)),
        interval_s: [begin, begin + 4.0],
        fluents: rows,
        during: Vec::new(),
        lines: if number == 1 { vec![lifted()] } else { Vec::new() },
        planned_q: Vec::new(),
        hamming,
        score: (-(hamming as f64)).exp(),
        measured: state(begin + 4.0),
        twin: Some(state(begin + 4.0)),
    }
}

/// A run whose lip ended `off` m from the cup's middle, known to `sigma` m.
pub(crate) fn pour(branch: &str, held: f64, off: f64, sigma: f64) -> Run {
    let steps = vec![
        step(1, "pour/2-pick/lift", "lift(jar, by: 12 cm)", vec![holding(held)]),
        step(
            2,
            "pour/4-move_over",
            "move_over(jar, cup, clearance: 5 cm)",
            vec![holding(held), above(off, sigma)],
        ),
    ];
    let outcome = if steps.iter().all(|step| step.outcome == Outcome::Success) {
        Ending::Success
    } else {
        Ending::Failure
    };
    let reason = steps
        .iter()
        .find_map(|step| step.reason.as_ref().map(|reason| format!("{}: {reason}", step.action)));
    let choice = Choice {
        node: "pour/2-pick/either".into(),
        branch: branch.into(),
        key: format!("pick/either.{branch}"),
        text: "0".into(),
        p: 0.6,
        possible: vec!["level_side".into(), "tilted_side".into()],
        is_free: true,
        is_asked: false,
        assumed: None,
    };
    Run {
        aims: None,
        state: State::Ended,
        task: "pour(jar, cup)".into(),
        outcome,
        reached: outcome == Ending::Success,
        reason,
        device_help: None,
        stop_unanswered: false,
        displaced: Vec::new(),
        seed: 1,
        robot: "lab".into(),
        setting: None,
        version: "0".into(),
        start: None,
        calibration: None,
        matching: None,
        questions: vec![Vec::new(); steps.len()],
        steps,
        probe: None,
        rehearsals: Vec::new(),
        parse_graphs: vec![ParseGraph {
            call: "pour(jar, cup)".into(),
            choices: vec![choice],
            steps: Vec::new(),
            timings: Vec::new(),
            recoveries: Vec::new(),
            log_p: 0.0,
        }],
        water: None,
        scale_under: None,
        stream: None,
        timing_s: Timing { total: 12.0, execute: 8.0, ..Timing::default() },
        run_dir: None,
    }
}

fn keep(scratch: &Scratch, root: &str, name: &str, mut run: Run) {
    run.run_dir = Some(format!("{root}/{name}"));
    let text = serde_json::to_string(&run).unwrap();
    scratch.file(&format!("{root}/{name}/run.json"), text);
}

/// Puts the runs on the scratch: three in `runs`, one whose last answer nobody can give in `doubtful`.
pub(crate) fn lay_out(scratch: &Scratch) {
    keep(scratch, "runs", "20260101-090000-pour", pour("tilted_side", 0.11, 0.013, 0.001));
    keep(scratch, "runs", "20260101-100000-pour", pour("level_side", 0.10, 0.064, 0.001));
    keep(scratch, "runs", "20260102-110000-pour", pour("level_side", 0.11, 0.066, 0.001));
    keep(scratch, "doubtful", "20260103-120000-pour", pour("level_side", 0.11, 0.036, 0.002));
    fs::create_dir_all(scratch.path("runs/not-a-run")).unwrap();
    keep(scratch, "bias", "20260101-100000-pour", pour("level_side", 0.10, 0.064, 0.001));
    keep(scratch, "bias", "20260101-110000-pour", pour("level_side", 0.10, 0.063, 0.001));
    keep(scratch, "bias", "20260102-110000-pour", pour("level_side", 0.11, 0.066, 0.001));
    keep(scratch, "chance", "20260101-100000-pour", pour("level_side", 0.10, 0.01, 0.001));
    keep(scratch, "chance", "20260101-110000-pour", pour("level_side", 0.10, 0.09, 0.001));
    keep(scratch, "chance", "20260102-110000-pour", pour("level_side", 0.11, 0.066, 0.001));
}

/// Steps of two calls that begin alike were "only in run 1" and "only in run 2", and nothing of them was compared.
#[test]
fn steps_of_two_calls_are_compared_where_they_say_the_same() {
    let first = pour("level_side", 0.1, 0.064, 0.001);
    let mut second = pour("level_side", 0.1, 0.064, 0.001);
    for step in &mut second.steps {
        step.path = format!("elsewhere/{}", step.path);
    }
    second.steps.last_mut().unwrap().outcome = Outcome::Stopped;
    let told = difference((1, &first), (2, &second)).join("\n");
    assert!(!told.contains("only in run"), "{told}");
    assert!(told.contains("in run 1, stopped in run 2"), "{told}");
}

/// Steps that an `until` had spared were told with a tick, and counted among those after which the twin agrees.
#[test]
fn a_step_that_was_not_needed_says_so_and_counts_for_nothing() {
    let mut run = pour("level_side", 0.1, 0.01, 0.001);
    let style = Style::plain();
    let whole = again(("1", Path::new("")), &run, None, style).unwrap();
    assert!(whole.contains("agree (3 of 3 fluents after 2 steps)"), "{whole}");
    run.steps[1].not_needed = Some("above(jar, cup)".into());
    let told = again(("1", Path::new("")), &run, None, style).unwrap();
    let line = told.lines().find(|line| line.contains(" 2  move_over")).unwrap();
    assert!(line.starts_with('–'), "{line}");
    assert!(line.ends_with("not needed: above(jar, cup) was true before"), "{line}");
    assert!(
        told.contains("agree (1 of 1 fluents after 1 step)\n  1 step was not needed"),
        "{told}"
    );
    assert_eq!(run.agreeing(), (1, 1));
}

/// After a person's own stop `:why poured(cup, 100 mL)` had advised to look for an effect that the twin lacks.
#[test]
fn what_was_stopped_says_nothing_of_what_the_twin_lacks() {
    let told = |outcome: Outcome| {
        let mut run = pour("level_side", 0.1, 0.064, 0.001);
        let step = run.steps.last_mut().unwrap();
        step.outcome = outcome;
        let row = step.fluents.last_mut().unwrap();
        row.name = "poured(cup, 100 mL)".into();
        row.margin = Some(Measure { value: -60e-6, unit: "m^3".into() });
        let fluent = Some("poured(cup, 100 mL)");
        why(&Question { run: &run, number: Some(3), fluent, earlier: &[], place: &|_| None })
            .unwrap()
    };
    assert!(told(Outcome::Failure).contains(":gap says"));
    let stopped = told(Outcome::Stopped);
    assert!(!stopped.contains(":gap") && stopped.contains(":replay 3 2"), "{stopped}");
}
