//! What is done about a jar that slips out of the fingers while it is lifted, in a whole cell.

use trueup::execution::calibrate::Switches;
use trueup::lab::{self, LabSettings, Spot};
use trueup::language::Source;
use trueup::trace::{Nobody, Outcome};
use trueup::workcell::{Ending, Options, WorkCell};

use super::{call, dry, options, plain};

const TASK: &str = "\
task hold(o: Graspable) {
    approach(o, side, pitch: 20 deg)
    grasp(o, side)
    lift(o, by: 12 cm)
    on failure {
        if not held(o) { open_gripper() back_off() home() look() }
        abort \"it slipped\"
    }
}
";

/// A laboratory as assumed, but for finger pads more slippery than wet ice: with 0.008 the jar slides down and stands in those of seeds 1
/// to 6; with 0.004 and 0.006 it is not found again in most of them, with 0.01 it is moved aside by some 5 cm and more.
fn slippery() -> LabSettings {
    let mut lab = LabSettings::perfect();
    lab.switches = lab::Switches { surfaces: true, ..lab.switches };
    lab.things.pad_friction = [0.008, 0.008];
    lab.things.table_friction = [0.4, 0.4];
    lab.things.mass = [0.0, 0.0];
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    lab
}

#[test]
fn a_jar_that_slips_while_it_is_lifted_is_let_go_and_looked_for() {
    let mut cell = WorkCell::open(Options {
        switches: Switches { offset: false, ..Switches::default() },
        scene: Some(dry()),
        script: Some(Source::new("hold.task", TASK)),
        ..options(slippery(), 2)
    })
    .unwrap();
    let run = cell.run(&call("hold(jar)"), None, Box::new(Nobody)).unwrap();
    // In the twin, whose pads are not slippery, it was held.
    assert!(run.rehearsals.iter().any(|tried| tried.success), "{:?}", run.rehearsals);
    let lift = &run.steps[2];
    assert_eq!((lift.action.as_str(), lift.outcome), ("lift(jar, by: 12 cm)", Outcome::Failure));
    let reason = lift.reason.as_deref().unwrap();
    assert!(reason.contains("it lost `held(jar)`") && reason.contains("into the step"), "{reason}");
    assert!(
        lift.interval_s[1] - lift.interval_s[0] < 1.0,
        "it was cut short: {:?}",
        lift.interval_s
    );

    let done: Vec<_> = run.steps[3..].iter().map(|s| (s.action.as_str(), s.outcome)).collect();
    let recovery = ["open_gripper()", "back_off()", "home()", "look()"];
    assert_eq!(done, recovery.map(|action| (action, Outcome::Success)), "{:?}", run.reason);
    assert_eq!(run.outcome, Ending::Failure);
    let why = run.reason.unwrap();
    assert!(why.contains("held(jar)") && why.ends_with("it slipped"), "{why}");
    // The hand is empty and open, and the jar was found again where it slid down.
    let state = cell.state().unwrap();
    assert_eq!(state.held, None);
    let jar = state.object("jar").unwrap().world_from_object.unwrap();
    assert!((jar.origin().x - 0.60).hypot(jar.origin().y - 0.10) < 0.03, "{jar:?}");
    assert!(jar.tilt() < 0.05 && jar.origin().z.abs() < 5e-3, "it stands: {jar:?}");
}

/// A full jar was dropped from 12 cm, and it was called a success.
#[test]
fn what_would_fall_is_not_let_go() {
    let mut cell = WorkCell::open(Options { scene: Some(dry()), ..plain() }).unwrap();
    let empty = "`jar` is not in the hand; pick it up first: `pick(jar)`";
    assert_eq!(cell.hindrance(&call("place(jar)")).as_deref(), Some(empty));
    let run = cell.run(&call("pick(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let error = cell.run(&call("open_gripper()"), None, Box::new(Nobody)).unwrap_err().to_string();
    assert!(error.contains("would fall 1") && error.contains("place(jar)"), "{error}");
    assert_eq!(cell.state().unwrap().held.as_deref(), Some("jar"));
    // What needs an empty hand says what is in it, and how it becomes empty.
    let full = "the hand already holds `jar`; put it down first: `place(jar)`";
    assert_eq!(cell.hindrance(&call("pour(jar, cup)")).as_deref(), Some(full));
    let run = cell.run(&call("place(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
}
