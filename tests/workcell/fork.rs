//! What if: from a past step, in the twin only.

use trueup::trace::{Nobody, Outcome};
use trueup::workcell::record::Recorder;
use trueup::workcell::{Ending, Error, Options, WorkCell};

use super::{call, dry, kept, plain};
use crate::program::Scratch;

#[test]
fn the_rest_or_another_call_is_rehearsed_from_a_past_step_and_nothing_moves() {
    let scratch = Scratch::new("workcell-fork");
    let recorder = Recorder::create(&scratch.path("runs"), "now", "test").unwrap();
    let folder = recorder.dir().to_path_buf();
    let mut cell = WorkCell::open(Options { scene: Some(dry()), ..plain() }).unwrap();
    let run = cell.run(&call("pick(jar)"), Some(recorder), Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let before = cell.state().unwrap();

    let fork = cell.fork(&run, 2, None).unwrap();
    assert!(fork.success && fork.remembers, "{fork:?}");
    assert_eq!((fork.after, fork.steps.len()), (2, 1));
    let lift = &fork.steps[0];
    assert_eq!((lift.number, lift.same_as), (3, Some(3)));
    assert!(lift.compared >= 2 && lift.otherwise.is_empty(), "{lift:?}");

    // Another call from there, which is not what came.
    let fork = cell.fork(&run, 2, Some(&call("open_gripper()"))).unwrap();
    assert!(fork.success, "{fork:?}");
    assert_eq!((fork.call.as_deref(), fork.steps[0].same_as), (Some("open_gripper()"), None));

    // From the record alone, as another session would: what `back_off` recalls is not known.
    let record = kept(&folder);
    let mut other = WorkCell::open(Options { scene: Some(dry()), ..plain() }).unwrap();
    let fork = other.fork(&record, 2, None).unwrap();
    assert!(fork.success && !fork.remembers, "{fork:?}");
    let fork = other.fork(&record, 1, Some(&call("back_off()"))).unwrap();
    assert_eq!(fork.steps[0].outcome, Outcome::Failure);
    assert!(fork.steps[0].reason.as_ref().unwrap().contains("no earlier action remembered"));

    for after in [0, 3, 9] {
        let error = cell.fork(&run, after, None).unwrap_err();
        assert!(matches!(error, Error::WhatIf(_)), "{after}: {error}");
    }
    let after = cell.state().unwrap();
    assert_eq!((after.q, after.time), (before.q, before.time), "the arm has not moved");
}
