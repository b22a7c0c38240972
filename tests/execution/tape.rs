//! Decisions are recorded in the twin and played on the arm; off the tape, nothing is improvised.

use trueup::execution::arm::Cancel;
use trueup::execution::plan::{NoWay, Why};
use trueup::execution::script::ScriptError;
use trueup::execution::stage::ActionError;
use trueup::execution::tape::{Entry, Tape};

use super::scripts;

fn choice(entry: &Entry) -> Option<usize> {
    match entry {
        Entry::Choice(chosen) => Some(*chosen),
        _ => None,
    }
}

#[test]
fn a_recording_tape_answers_nothing_and_keeps_everything() {
    let mut tape = Tape::recording();
    assert!(!tape.is_playing());
    assert_eq!(tape.next("a choice", choice), Ok(None));
    tape.record(Entry::Choice(2));
    tape.record(Entry::Path(vec![vec![0.0; 7]]));
    let mut played = tape.rewound();
    assert!(played.is_playing());
    assert_eq!(played.next("a choice", choice), Ok(Some(2)));
    // Playing records nothing, and rewinding begins at the beginning.
    played.record(Entry::Choice(9));
    assert_eq!(played.rewound(), tape.rewound());
}

#[test]
fn asking_for_something_else_is_off_the_tape() {
    let mut tape = Tape::recording();
    tape.record(Entry::Path(vec![vec![0.0; 7]]));
    let mut played = tape.rewound();
    let off = played.next("a choice", choice).unwrap_err();
    assert_eq!((off.asked, off.had), ("a choice", "a path"));
    let path = |entry: &Entry| matches!(entry, Entry::Path(_)).then_some(());
    assert_eq!(played.next("a path", path), Ok(Some(())), "a refusal takes nothing off the tape");
    let end = played.next("a path", path).unwrap_err();
    assert_eq!((end.asked, end.had), ("a path", "ended"));
}

/// The same script, recorded and played: the same joint positions to the last bit; another script is refused.
#[test]
fn a_played_script_moves_as_the_recorded_one() {
    let cancel = Cancel::default();
    let script = "arm.move_by([0.0, 0.0, -0.02], 0.3); arm.move_to(twin.pose_named(\"retract\"));";
    let recorded = scripts(&cancel, Tape::recording());
    recorded.run("go.rhai", script, &Default::default()).unwrap();
    let tape = recorded.stage().tape().clone();
    assert!(!tape.is_playing());

    let played = scripts(&cancel, tape.rewound());
    played.run("go.rhai", script, &Default::default()).unwrap();
    assert_eq!(played.stage().planned_q(), recorded.stage().planned_q());
    let (a, b) = (played.stage().state().unwrap(), recorded.stage().state().unwrap());
    assert_eq!((a.q, a.time), (b.q, b.time));

    let astray = scripts(&cancel, tape.rewound());
    let before = astray.stage().state().unwrap().q;
    let error = astray.run("go.rhai", "choose([1, 2, 3]);", &Default::default()).unwrap_err();
    assert!(
        matches!(error, ScriptError::Action { error: ActionError::OffTape(_), line: Some(1) }),
        "{error:?}"
    );
    assert_eq!(astray.stage().state().unwrap().q, before, "nothing moved");
}

/// A plan is asked for as often as the script asks, also in a loop that gives up on the way.
#[test]
fn what_failed_in_the_twin_is_not_on_the_tape() {
    let cancel = Cancel::default();
    let scripts = scripts(&cancel, Tape::recording());
    let script = "try { twin.placements(\"jar\"); } catch { choose([1]); }";
    scripts.run("go.rhai", script, &Default::default()).unwrap();
    let mut tape = scripts.stage().tape().rewound();
    assert_eq!(tape.next("a choice", choice), Ok(Some(0)));
    assert!(tape.next("a choice", choice).is_err());
    let error = scripts.stage().placements("jar").unwrap_err();
    assert!(matches!(&error, ActionError::NoWay(NoWay { why: Why::EmptyHand, .. })), "{error}");
}
