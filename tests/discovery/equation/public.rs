//! Real machines; read in place and skipped where the folder is absent.

use std::path::PathBuf;

use trueup::discovery::finding::Value;
use trueup::discovery::recording::{Map, Recording};

use super::ask;

fn read(file: &str, map: &str) -> Option<Recording> {
    let path =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/public")).join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: {} is absent", path.display());
        return None;
    };
    Some(Recording::read(file, &text, None, &Map::parse(map).unwrap()).unwrap())
}

#[test]
fn the_cascaded_tanks_overflow() {
    let map = "t_s=t[s],u_pump_V=u[V],y_lower_tank_level_V=y[V]";
    let files = ["cascaded_tanks/train.csv", "cascaded_tanks/test.csv"];
    let [Some(train), Some(test)] = files.map(|file| read(file, map)) else { return };
    let outcome = ask(include_str!("../../../stdlib/models/tanks.task"), &[train, test]).unwrap();
    let finding = &outcome.finding;
    assert!(
        finding.effects.iter().any(|e| e.name == "overflow" && e.at == "upper"),
        "{finding:#?}"
    );
    // Published with a physical overflow: 0.18 V; the linear approximation 0.75 V. The spread is 2.17 V.
    assert!(finding.gap.after.heldout * 2.17 < 0.30, "{:?}", finding.gap);
}

#[test]
fn the_positioning_system_rubs() {
    let map = "t_s=t[s],q_meas_m=q[m],u_control_V=u[V]";
    let files = ["emps/train.csv", "emps/test_pulses.csv"];
    let [Some(train), Some(test)] = files.map(|file| read(file, map)) else { return };
    let outcome = ask(include_str!("../../../stdlib/models/emps.task"), &[train, test]).unwrap();
    let finding = &outcome.finding;
    let effect = |name: &str| finding.effects.iter().find(|e| e.name == name);
    let number =
        |name: &str, parameter: &str| match effect(name).map(|e| &e.parameters[parameter].value) {
            Some(Value::Number(value)) => *value,
            _ => panic!("{finding:#?}"),
        };
    // Published: viscous 2.14 1/s; dry friction 0.2145 m/s² with an offset of 0.033 m/s².
    assert!((number("linear_damping", "coefficient") / 2.14 - 1.0).abs() < 0.1);
    let (forward, backward) =
        (number("asymmetric_friction", "forward"), number("asymmetric_friction", "backward"));
    assert!((0.5 * (forward + backward) / 0.2145 - 1.0).abs() < 0.15, "{forward} {backward}");
    assert!((0.5 * (backward - forward) / 0.033 - 1.0).abs() < 0.3, "{forward} {backward}");
    assert!(finding.gap.after.heldout < 0.154, "{:?}", finding.gap);
}
