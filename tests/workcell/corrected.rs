//! A twin that knows what was found: the plan and the belief of a whole cell heed it.

use trueup::execution::calibrate::Switches;
use trueup::lab::{HiddenEffect, LabSettings};
use trueup::language::Source;
use trueup::trace::Nobody;
use trueup::workcell::{Ending, Error, Options, WorkCell};

use super::{call, dry, options, plain};

/// A cell whose twin has `effects`, in a laboratory with `hidden` ones beside nothing else.
fn cell(effects: &str, hidden: &[(&str, &str, f64)], scene: Option<Source>) -> WorkCell {
    let of = if scene.is_some() { "dry_kitchen" } else { "kitchen" };
    let hidden = hidden.iter().map(|(name, number, value)| HiddenEffect {
        name: (*name).into(),
        at: "gripper".into(),
        numbers: [((*number).to_owned(), *value)].into(),
    });
    let lab = LabSettings { effects: hidden.collect(), ..plain().lab };
    WorkCell::open(Options {
        switches: Switches { offset: false, ..Switches::default() },
        scene,
        script: Some(Source::new("bench.task", format!("twin bench of {of} {{ {effects} }}"))),
        ..options(lab, 1)
    })
    .unwrap()
}

/// Pads as slippery as wet ice, of which 40 N do not hold a jar of 160 g.
#[test]
fn what_would_slip_is_held_more_firmly_once_the_pads_are_known() {
    let icy = [("grip_slip", "friction", 0.015)];
    let mut known = cell("effect grip_slip(gripper) { friction = 0.015 }", &icy, Some(dry()));
    let run = known.run(&call("pick(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    assert!(known.state().unwrap().held.is_some());
    // With less still the fingers would have to press harder than they may, and nothing is tried.
    let mut worse = cell("effect grip_slip(gripper) { friction = 0.01 }", &icy, Some(dry()));
    let reason = match worse.run(&call("pick(jar)"), None, Box::new(Nobody)) {
        Ok(run) => run.reason.unwrap(),
        Err(error) => error.to_string(),
    };
    assert!(reason.contains("a friction of 0.010") && reason.contains("157 N"), "{reason}");
}

/// What creeps in the hand stands on the table all the same when it is put down, and is believed to.
#[test]
fn what_creeps_in_the_hand_is_put_down_where_it_is() {
    let creep = [("grip_slip", "rate", 3e-3)];
    let mut known = cell("effect grip_slip(gripper) { rate = 3 mm/s }", &creep, Some(dry()));
    let run = known.run(&call("pick(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let lift = run.steps.last().unwrap();
    let height = |state: &trueup::world::WorldState| {
        state.object("jar").unwrap().world_from_object.unwrap().origin().z
    };
    let twin = run.steps.last().and_then(|step| step.twin.as_ref()).unwrap();
    assert!((height(&lift.measured) - height(twin)).abs() < 2e-3, "{} m", height(&lift.measured));
    let before = height(&known.state().unwrap());
    let run = known.run(&call("place(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let lowered = run.steps.iter().find(|step| step.action.starts_with("lower(")).unwrap();
    assert!(height(&lowered.measured).abs() < 5e-3 && before > 0.09, "{before} m");
}

#[test]
fn a_cup_that_is_known_to_run_over_is_not_poured_into_beyond_its_brim() {
    let mut known = cell("effect overflow(cup) { level = 90 mL }", &[], None);
    let run = known.run(&call("pour(jar, cup)"), None, Box::new(Nobody));
    let Err(Error::NoRoom { target, room, amount }) = run else { panic!("{run:?}") };
    assert_eq!(target, "cup");
    assert!((room - 90e-6).abs() < 1e-9 && (amount - 150e-6).abs() < 1e-9, "{room} {amount}");
}

/// All was poured, and then a retreat was refused: rehearsed with one arm's joints, performed with another's.
#[test]
fn the_arm_of_the_rehearsal_is_the_one_that_regression_3_found() {
    let mut lab = plain().lab;
    lab.switches.zero_offsets = true;
    lab.switches.tool_offset = true;
    let mut cell = WorkCell::open(Options { scene: Some(dry()), ..options(lab, 3) }).unwrap();
    let run = cell.run(&call("approach(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let found = run.calibration.as_ref().unwrap();
    let farthest = found.zeros.iter().fold(0.0_f64, |most, zero| most.max(zero.abs()));
    assert!(farthest > 0.005, "the zeros are hardly off: {:?}", found.zeros);
    let step = run.steps.last().unwrap();
    let twin = step.twin.as_ref().unwrap();
    // Joint by joint, as the encoders count.
    for (there, here) in twin.q.iter().zip(&step.measured.q) {
        assert!((there - here).abs() < 2e-3, "{:?} in the twin, {:?}", twin.q, step.measured.q);
    }
    let off = (twin.world_from_tool.origin() - step.measured.world_from_tool.origin()).norm();
    assert!(off < 1e-3, "{off} m");
}
