//! Decisions are recorded in the twin and played on the arm; not in the decision log, nothing is improvised.

use std::collections::BTreeMap;

use trueup::arm::Cancel;
use trueup::execution::decisions::{DecisionLog, Entry, Kind};
use trueup::execution::error::ActionError;
use trueup::execution::script::ScriptError;
use trueup::trace::{NoWay, Why};
use trueup::world::Region;

use super::scripts;

fn choice(entry: &Entry) -> Option<usize> {
    match entry {
        Entry::Choice(chosen) => Some(*chosen),
        _ => None,
    }
}

#[test]
fn a_recording_tape_answers_nothing_and_keeps_everything() {
    let mut log = DecisionLog::recording();
    assert!(!log.is_playing());
    assert_eq!(log.next(Kind::Choice, choice), Ok(None));
    log.record(Entry::Choice(2));
    log.record(Entry::Path(vec![vec![0.0; 7]]));
    let mut played = log.rewound();
    assert!(played.is_playing());
    assert_eq!(played.next(Kind::Choice, choice), Ok(Some(2)));
    // Playing records nothing, and rewinding begins at the beginning.
    played.record(Entry::Choice(9));
    assert_eq!(played.rewound(), log.rewound());
}

#[test]
fn asking_for_something_else_is_off_the_tape() {
    let mut log = DecisionLog::recording();
    log.record(Entry::Path(vec![vec![0.0; 7]]));
    let mut played = log.rewound();
    let off = played.next(Kind::Choice, choice).unwrap_err();
    assert_eq!((off.asked, off.had), (Kind::Choice, Kind::Path));
    let path = |entry: &Entry| matches!(entry, Entry::Path(_)).then_some(());
    assert_eq!(played.next(Kind::Path, path), Ok(Some(())), "a refusal takes nothing off the log");
    let end = played.next(Kind::Path, path).unwrap_err();
    assert_eq!((end.asked.to_string(), end.had.to_string()), ("a path".into(), "ended".into()));
}

/// The same script, recorded and played: the same joint positions to the last bit; another script is refused.
#[test]
fn a_played_script_moves_as_the_recorded_one() {
    let cancel = Cancel::default();
    let script = "arm.move_by([0.0, 0.0, -0.02], 0.3); arm.move_to(twin.pose_named(\"retract\"));";
    let mut recorded = scripts(&cancel, DecisionLog::recording());
    recorded.run("go.rhai", script, &BTreeMap::default()).unwrap();
    let log = recorded.context().log().clone();
    assert!(!log.is_playing());

    let mut played = scripts(&cancel, log.rewound());
    played.run("go.rhai", script, &BTreeMap::default()).unwrap();
    assert_eq!(played.context().planned_q().unwrap(), recorded.context().planned_q().unwrap());
    let (a, b) = (played.context().state().unwrap(), recorded.context().state().unwrap());
    assert_eq!((a.q, a.time), (b.q, b.time));

    let mut astray = scripts(&cancel, log.rewound());
    let before = astray.context().state().unwrap().q;
    let error = astray.run("go.rhai", "choose([1, 2, 3]);", &BTreeMap::default()).unwrap_err();
    assert!(
        matches!(error, ScriptError::Action { error: ActionError::NotInLog(_), line: Some(1) }),
        "{error:?}"
    );
    assert_eq!(astray.context().state().unwrap().q, before, "nothing moved");
}

/// A plan is asked for as often as the script asks, also in a loop that gives up on the way.
#[test]
fn what_failed_in_the_twin_is_not_on_the_tape() {
    let cancel = Cancel::default();
    let mut scripts = scripts(&cancel, DecisionLog::recording());
    let script = "try { twin.placements(\"jar\"); } catch { choose([1]); }";
    scripts.run("go.rhai", script, &BTreeMap::default()).unwrap();
    let mut log = scripts.context().log().rewound();
    assert_eq!(log.next(Kind::Choice, choice), Ok(Some(0)));
    assert!(log.next(Kind::Choice, choice).is_err());
    let error = scripts.context().placements("jar", &Region::On("table".into())).unwrap_err();
    assert!(matches!(&error, ActionError::NoWay(NoWay { why: Why::EmptyHand, .. })), "{error}");
}
