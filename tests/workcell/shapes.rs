//! Things whose shapes are files, and mugs, in the laboratory: seen where they stand and how they are turned, taken, put,
//! poured from.

use std::path::Path;

use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::{Source, parse_line};
use trueup::trace::Nobody;
use trueup::workcell::{Ending, Options, Run, WorkCell};

use super::options;

/// Carries out a line on a table of `tests/tables` whose things stand at these places (m, rad).
fn done(scene: &str, places: &[(&str, f64, f64, f64)], line: &str) -> (Run, WorkCell) {
    let mut lab = LabSettings::perfect();
    for &(name, x_m, y_m, yaw_rad) in places {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad });
    }
    // Its meshes lie beside it.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables").join(scene);
    let text = std::fs::read_to_string(&path).unwrap();
    let scene = Source::new(path.display().to_string(), text);
    let switches = Switches { offset: false, ..Switches::default() };
    let mut cell =
        WorkCell::open(Options { scene: Some(scene), switches, ..options(lab, 1) }).unwrap();
    let source = Source::new("a line", line);
    let (step, _) = parse_line(&source.text);
    let call = cell.define(&source, &[step.unwrap()]);
    let run = cell.run(&call, None, Box::new(Nobody)).unwrap();
    (run, cell)
}

#[test]
fn a_bracket_is_seen_with_its_turn_and_put_on_a_tray() {
    let places =
        [("bracket", 0.52, -0.2, 0.5), ("house", 0.62, 0.0, 1.2), ("tray", 0.62, 0.2, 0.0)];
    let (run, mut cell) = done("meshes.task", &places, "put(bracket, at: tray)");
    assert_eq!((run.outcome, run.reached), (Ending::Success, true), "{:?}", run.reason);
    let state = cell.state().unwrap();
    let house = state.object("house").unwrap().world_from_object.unwrap();
    let (at, yaw) = (house.origin(), house.yaw());
    assert!((at.x - 0.62).hypot(at.y) < 0.003 && (yaw - 1.2).abs() < 0.05, "{at} {yaw}");
}

#[test]
fn a_mug_is_poured_from_with_its_handle_out_of_the_way() {
    let places = [("mug", 0.55, 0.12, 0.4), ("bowl", 0.54, -0.18, 0.0), ("bottle", 0.7, 0.2, 0.0)];
    let (run, _) = done("mugs.task", &places, "pour(mug, bowl)");
    assert_eq!((run.outcome, run.reached), (Ending::Success, true), "{:?}", run.reason);
    let water = run.water.unwrap();
    assert!(water.in_target_ml > 110.0 && water.spilt_ml < 3.0, "{water:?}");
}

/// One arm could put nothing into any vessel: its own links were nearer to each other than it keeps from walls. Of what lay on a tray
/// fingers from above were sent as far down as from the table, into the tray.
#[test]
fn a_die_is_put_into_a_bin_and_taken_out_and_a_slab_from_a_tray() {
    let places = [
        ("die", 0.5, 0.19, -0.1),
        ("bin", 0.68, -0.11, -0.4),
        ("slab", 0.53, -0.28, 0.1),
        ("tray", 0.68, 0.25, 0.8),
    ];
    for line in [
        "put(die, at: bin) then put(die, at: table)",
        "put(slab, at: tray) then put(slab, at: next_to(tray))",
    ] {
        let (run, _) = done("flat.task", &places, line);
        assert_eq!((run.outcome, run.reached), (Ending::Success, true), "{line}: {:?}", run.reason);
    }
}
