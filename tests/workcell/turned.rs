//! Things that a lathe makes, in the laboratory: seen where they stand, taken, poured from and into.

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::{Source, parse_line};
use trueup::trace::Nobody;
use trueup::workcell::{Ending, Options, WorkCell};

use super::options;

#[test]
fn a_tumbler_that_opens_upwards_is_poured_into_a_bowl() {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("tumbler", 0.56, 0.12), ("bowl", 0.54, -0.18)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.0 });
    }
    let scene = Source::new("tumbler.task", include_str!("../tables/tumbler.task"));
    let switches = Switches { offset: false, ..Switches::default() };
    let options = Options { scene: Some(scene), switches, ..options(lab, 1) };
    let mut cell = WorkCell::open(options).unwrap();
    let source = Source::new("a line", "pour(tumbler, bowl)");
    let (step, _) = parse_line(&source.text);
    let call = cell.define(&source, &[step.unwrap()]);
    let run = cell.run(&call, None, Box::new(Nobody)).unwrap();
    assert_eq!((run.outcome, run.reached), (Ending::Success, true), "{:?}", run.reason);
    // The scales, which know nothing of shapes.
    let water = run.water.unwrap();
    assert!(water.in_target_ml > 115.0 && water.spilt_ml < 3.0, "{water:?}");
    let state = cell.state().unwrap();
    let bowl = state.object("bowl").unwrap().world_from_object.unwrap().origin();
    assert!((bowl.x - 0.54).hypot(bowl.y + 0.18) < 0.003, "{bowl}");
}
