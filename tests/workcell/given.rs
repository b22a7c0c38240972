//! What was handed over is nowhere, in the rehearsal as on the arm: a hand-over without a flaw has no gap.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::Source;
use trueup::workcell::{Ending, Options, WorkCell};

use super::options;
use super::places::run;

/// Seven fluents were told to differ: the twin's person had taken the can out of reach, the arm's still had it in the air.
#[test]
fn twin_and_camera_agree_on_what_was_handed_over() {
    let mut lab = LabSettings::perfect();
    lab.people.comes = 1.0;
    for (name, x_m, y_m) in [("can", 0.62, 0.02), ("cube", 0.54, -0.32)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.0 });
    }
    let scene = Source::new("giving.task", include_str!("../tables/giving.task"));
    let switches = Switches { offset: false, ..Switches::default() };
    let options = Options { scene: Some(scene), switches, ..options(lab, 1) };
    let mut cell = WorkCell::open(options).unwrap();
    let run = run(&mut cell, "hand_over(can)");
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let given = run.steps.iter().position(|step| step.action.starts_with("give(")).unwrap();
    for step in &run.steps[given..] {
        for row in step.fluents.iter().filter(|row| row.name.contains("can")) {
            let differ = matches!((row.twin, row.measured), (Some(a), Some(b)) if a != b);
            let is_known_once = row.twin.is_some() != row.measured.is_some();
            assert!(!differ && !is_known_once, "{}: {row:?}", step.action);
        }
        let truth = |name: &str| {
            let row = step.fluents.iter().find(|row| row.name == name);
            row.map(|row| (row.twin, row.measured))
        };
        let [no, yes] = [false, true].map(|truth| (Some(truth), Some(truth)));
        assert_eq!(truth("visible(can)"), Some(no), "{}", step.action);
        assert_eq!(truth("reachable(can)"), Some((None, None)), "{}", step.action);
        assert_eq!(truth("level(can)"), Some((None, None)), "{}", step.action);
        assert_eq!(truth("given(can)"), Some(yes), "{}", step.action);
        assert!(step.measured.object("can").unwrap().world_from_object.is_none());
    }
}
