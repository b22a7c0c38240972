//! An amount is poured by weighing: a vessel that is emptier than was rehearsed gives as much as was asked for.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use trueup::arm::Cancel;
use trueup::arm::limits::Limits;
use trueup::execution::cell::{Cell, Pads};
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::{DecisionLog, Entry, Kind};
use trueup::execution::script::{ScriptError, ScriptValue, Scripts};
use trueup::execution::twin_arm::TwinBody;
use trueup::motion::free::Means;
use trueup::motion::robot::Robot;
use trueup::trace::Nobody;
use trueup::twin::Settings;

use super::twin;
use crate::kitchen;

/// The actions of a pour up to the jar hanging level again, as the standard library has them.
const ACTIONS: [(&str, &str); 6] = [
    ("approach.rhai", include_str!("../../stdlib/actions/approach.rhai")),
    ("grasp.rhai", include_str!("../../stdlib/actions/grasp.rhai")),
    ("lift.rhai", include_str!("../../stdlib/actions/lift.rhai")),
    ("move_over.rhai", include_str!("../../stdlib/actions/move_over.rhai")),
    ("tilt.rhai", include_str!("../../stdlib/actions/tilt.rhai")),
    ("untilt.rhai", include_str!("../../stdlib/actions/untilt.rhai")),
];

/// Pours `amount` from a jar with `filled` in it (m³), and returns what was decided and what is in the cup, m³; or why
/// not.
fn pour(filled: f64, amount: f64, log: DecisionLog) -> Result<(DecisionLog, f64), ScriptError> {
    let robot = Arc::new(Robot::gen3());
    let pads = Pads::of(&Settings::for_arm(&robot));
    let scene = Arc::new(kitchen::scene());
    let mut state = kitchen::state([0.557, 0.055, 0.7], [0.526, -0.21, 0.0]);
    state.objects[0].water = Some(filled);
    let twin = twin(&scene, &state);
    let cell = Cell { robot, scene, limits: Limits::default(), pads, means: Means::default() };
    let context = ActionContext::new(
        cell,
        Box::new(TwinBody::new(twin.clone())),
        kitchen::HOME.to_vec(),
        log,
        (1, 0),
        Cancel::default(),
        Arc::new(Mutex::new(Nobody)),
    );
    let mut scripts = Scripts::new(context);
    let name = |text: &str| ScriptValue::Name(text.into());
    let args: BTreeMap<String, ScriptValue> = [
        ("o", name("jar")),
        ("source", name("jar")),
        ("target", name("cup")),
        ("face", name("side")),
        ("pitch", ScriptValue::Number(0.0)),
        ("by", ScriptValue::Number(0.12)),
        ("clearance", ScriptValue::Number(0.05)),
        ("amount", ScriptValue::Number(amount)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into();
    for (file, text) in ACTIONS {
        scripts.context().begin_step(file).unwrap();
        scripts.run(file, text, &args)?;
    }
    let log = scripts.context().log().clone();
    let state = twin.lock().unwrap().state();
    assert!(state.spilt.unwrap() < 1e-6, "{:.1} mL spilt", 1e6 * state.spilt.unwrap());
    Ok((log, state.object("cup").unwrap().water.unwrap()))
}

#[test]
fn an_emptier_jar_gives_what_was_asked_for_or_is_refused() {
    let amount = 40e-6;
    let (log, rehearsed) = pour(220e-6, amount, DecisionLog::recording()).unwrap();
    assert!((rehearsed - amount).abs() < 3e-6, "{:.1} mL rehearsed", 1e6 * rehearsed);
    let (_, poured) = pour(150e-6, amount, log.rewound()).unwrap();
    assert!((poured - amount).abs() < 3e-6, "{:.1} mL from an emptier jar", 1e6 * poured);
    // One that is nearly empty would have to be turned much further, which was not tried.
    let refused = pour(45e-6, amount, log.rewound()).unwrap_err().to_string();
    assert!(refused.contains("too far to go unrehearsed"), "{refused}");
}

#[test]
fn the_rehearsal_says_how_far_measuring_may_turn_the_hand() {
    let mut log = DecisionLog::recording();
    log.begin("pour/tilt", false).unwrap();
    log.record(Entry::Turned(0.6));
    log.record(Entry::Choice(1));
    log.record(Entry::Turned(0.7));
    log.record(Entry::Turned(0.65));
    log.begin("pour/untilt", false).unwrap();
    let mut played = log.rewound();
    assert_eq!(played.begin("pour/tilt", false).unwrap().turned, Some(0.7));
    // Remarks on the step stand in no one's way.
    let choice = |entry: &Entry| matches!(entry, Entry::Choice(1)).then_some(());
    assert_eq!(played.next(Kind::Choice, choice), Ok(Some(())));
    assert_eq!(played.begin("pour/untilt", false).unwrap().turned, None);
}
