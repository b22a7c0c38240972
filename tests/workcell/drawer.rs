//! What a hand that draws a drawer feels is what the drawer resists with: no more, whatever the fingers do to the bar between them.

use trueup::lab::{LabSettings, Spot};
use trueup::language::Source;
use trueup::workcell::{Ending, Options, Run, WorkCell};

use super::options;
use super::places::run;

/// Opens a drawer that resists with so many N.
fn opened(resists: f64) -> Run {
    let mut lab = LabSettings::default();
    lab.things.drawer_n = [resists; 2];
    for (name, x_m, y_m, yaw_rad) in [("chest", 0.73, -0.16, 2.72), ("die", 0.66, 0.11, 0.0)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad });
    }
    let scene = Source::new("drawer.task", include_str!("../tables/drawer.task"));
    let mut cell = WorkCell::open(Options { scene: Some(scene), ..options(lab, 29) }).unwrap();
    run(&mut cell, "open_drawer(drawer)")
}

#[test]
fn a_drawer_opens_that_resists_with_less_than_is_allowed_and_no_other() {
    // 25 N are allowed, of which the joints' own friction takes some.
    let opens = opened(18.0);
    assert_eq!(opens.outcome, Ending::Success, "{:?}", opens.reason);
    let stuck = opened(40.0);
    assert_eq!(stuck.outcome, Ending::Failure, "{:?}", stuck.reason);
    let reason = stuck.reason.unwrap_or_default();
    assert!(reason.contains("the drawer is stuck"), "{reason}");
}
