//! Discovery: planted truth is found, nothing is found where nothing was planted, bad input is told.

pub(crate) mod bag;
mod camera;
mod carried;
mod loaded;
mod equation;
mod held;
mod industrial;
mod logs;
mod planar;
mod planted;
pub(crate) mod poses;
mod pour;
mod recordings;
mod secrecy;
mod tables;
mod thick;
mod unread;

use std::path::PathBuf;

use trueup::discovery::finding::{Finding, Value};
use trueup::discovery::recording::{Map, Recording};
use trueup::motion::Robot;

/// The folder of recordings made with another simulator.
fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/discovery/recordings")
}

/// A seven-joint arm without a gripper.
fn bare_arm() -> Robot {
    Robot::from_file(&folder().join("gen3_bare.urdf"), Some("end_effector_link")).unwrap()
}

/// The value of a parameter of an effect that must be there.
fn number(finding: &Finding, effect: &str, name: &str) -> f64 {
    let found = finding.effects.iter().find(|found| found.name == effect);
    let found = found.unwrap_or_else(|| panic!("no {effect}: {:#?}", finding.effects));
    match &found.parameters[name].value {
        Value::Number(value) => *value,
        Value::Vector(values) => panic!("{values:?}"),
    }
}

/// Reads a recording of the folder with its sidecar.
fn recording(name: &str) -> Recording {
    let path = folder().join(format!("{name}.csv"));
    let sidecar = std::fs::read_to_string(path.with_extension("json")).ok();
    let sidecar = sidecar.as_deref().map(|text| ("sidecar", text));
    let text = std::fs::read_to_string(&path).unwrap();
    Recording::read(name, &text, sidecar, &Map::default()).unwrap()
}
