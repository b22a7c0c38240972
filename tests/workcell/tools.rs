//! What is done with closed fingers and with what they hold: a push, a stir, a wipe; and what is refused.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::ast::Step;
use trueup::language::{Source, parse_line};
use trueup::trace::{Deed, Nobody, StepRecord};
use trueup::workcell::{Ending, Error, Options, Run, WorkCell};

use super::options;

/// A table of `tests/tables/` in a laboratory that is as assumed, with things where they are put.
fn table(text: &'static str, at: &[(&str, f64, f64)]) -> WorkCell {
    let mut lab = LabSettings::perfect();
    for &(name, x_m, y_m) in at {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.2 });
    }
    let switches = Switches { offset: false, ..Switches::default() };
    let scene = Some(Source::new("table.task", text));
    WorkCell::open(Options { scene, switches, ..options(lab, 1) }).unwrap()
}

/// Why no plan for a line survives the twin.
fn refused(cell: &mut WorkCell, line: &str) -> String {
    match attempt(cell, line) {
        Err(why) => why.to_string(),
        Ok(run) => panic!("{line}: {:?}", run.outcome),
    }
}

fn run(cell: &mut WorkCell, line: &str) -> Run {
    attempt(cell, line).unwrap()
}

fn attempt(cell: &mut WorkCell, line: &str) -> Result<Run, Error> {
    let source = Source::new("a line", line);
    let (step, wrong) = parse_line(line);
    assert!(wrong.is_empty(), "{wrong:?}");
    let step = step.unwrap();
    assert!(cell.check_line(&step, &source).iter().all(|found| !found.is_error()), "{line}");
    let call = cell.define(&source, &[step]);
    cell.run(&call, None, Box::new(Nobody))
}

/// Whether a condition holds as the camera sees it now.
fn seen(cell: &mut WorkCell, condition: &str) -> Option<bool> {
    let Some(Step::Check(condition, _)) = parse_line(&format!("check {condition}")).0 else {
        panic!("{condition}")
    };
    cell.read(&condition).unwrap().truth
}

#[test]
fn a_cube_is_pushed_beside_a_tray_and_seen_there() {
    let places = [("a", 0.52, -0.22), ("b", 0.62, 0.30), ("tray", 0.60, 0.05)];
    let mut cell = table(include_str!("../tables/cubes.task"), &places);
    let done = run(&mut cell, "push(a, at: next_to(tray))");
    assert_eq!((done.outcome, done.reached), (Ending::Success, true), "{:?}", done.reason);
    assert_eq!(seen(&mut cell, "rests_on(a, next_to(tray))"), Some(true));
    assert_eq!(seen(&mut cell, "gripper.open and not held(any)"), Some(true));
    // Where it is there already it is left alone: a push had moved it 1 cm away from the tray.
    let again = run(&mut cell, "push(a, at: next_to(tray))");
    assert_eq!(again.outcome, Ending::Success, "{:?}", again.reason);
    let mut deeds = again.steps.iter().flat_map(StepRecord::deeds);
    assert!(!deeds.any(|deed| matches!(deed, Deed::Pushed { .. })));
    // The tray is 2 cm high: what slides does not climb it.
    let reason = refused(&mut cell, "push(a, at: tray)");
    assert!(reason.contains("pushing does not bring it onto `tray`"), "{reason}");
}

#[test]
fn what_would_tip_over_is_not_pushed() {
    let places = [("bottle", 0.55, -0.20), ("mug", 0.60, 0.20), ("tray", 0.62, 0.0)];
    let mut cell = table(include_str!("../tables/bottle.task"), &places);
    let reason = refused(&mut cell, "push(bottle, at: next_to(mug))");
    assert!(reason.contains("200 mm high and would tip over"), "{reason}");
}

#[test]
fn water_is_stirred_as_far_as_the_tool_went_round_in_it() {
    let places = [("dish", 0.62, 0.02), ("stick", 0.54, -0.31)];
    let mut cell = table(include_str!("../tables/stirring.task"), &places);
    let done = run(&mut cell, "stir(dish, stick)");
    // Whether the stick stands again is for the photograph, and where it stands the arm may hide it.
    assert!(done.outcome.is_done(), "{:?}", done.reason);
    // Three times round, of which the way out to the circle and back is none.
    let condition = "stirring(dish) >= 1000 deg and stirring(dish) <= 1200 deg";
    assert_eq!(seen(&mut cell, condition), Some(true));
    assert_eq!(seen(&mut cell, "stirred(dish)"), Some(true));
}
