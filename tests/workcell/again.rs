//! What does not fit the rehearsal when the arm does it is planned again from where the arm is.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Switches as Hidden};
use trueup::language::Source;
use trueup::trace::{Nobody, Outcome};
use trueup::workcell::{Ending, Options, WorkCell};

use super::{call, dry, options, plain};

/// Asks for something on the arm, whose torque sensors are biased, that it did not ask for in the twin: the
/// first so many times.
fn astray(times: usize) -> WorkCell {
    let script = format!(
        "let begun = 0;
        try {{ begun = recall(\"begun\"); }} catch {{}}
        remember(\"begun\", begun + 1);
        let felt = arm.heft(0.2);
        if begun < {times} && felt * felt > 1e-6 {{ choose([1, 2]); }}
        arm.move_to(twin.pose_named(\"retract\"));"
    );
    let mut lab = plain().lab;
    lab.switches = Hidden { readings: true, ..LabSettings::perfect().switches };
    let text = "action wander() { run \"wander.rhai\" }\ntask stroll() { wander() home() }\n";
    let mut options = Options {
        switches: Switches { offset: false, ..Switches::default() },
        scene: Some(dry()),
        script: Some(Source::new("wander.task", text)),
        ..options(lab, 1)
    };
    options.stdlib.add_script("wander.rhai", &script);
    WorkCell::open(options).unwrap()
}

#[test]
fn a_step_that_went_otherwise_than_rehearsed_is_planned_again_and_the_run_goes_on() {
    let run = astray(1).run(&call("stroll()"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let steps: Vec<_> = run.steps.iter().map(|s| (s.action.as_str(), s.outcome)).collect();
    let expected = [
        ("wander()", Outcome::Failure),
        ("wander()", Outcome::Success),
        ("home()", Outcome::Success),
    ];
    assert_eq!(steps, expected);
    assert!(run.steps[0].reason.as_ref().unwrap().contains("differently than rehearsed"));
    assert_eq!(run.parse_graphs.len(), 2, "the rest was performed as a rehearsal of its own");
}

#[test]
fn planning_again_has_an_end() {
    let run = astray(100).run(&call("stroll()"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Failure);
    assert_eq!(run.steps.len(), 4, "once, and three times again");
    assert!(run.reason.unwrap().contains("differently than rehearsed"));
}
