//! Discovery: planted truth is found, nothing is found where nothing was planted, bad input is told.

mod bag;
mod camera;
mod equation;
mod held;
mod logs;
mod planted;
mod pour;
mod recordings;
mod secrecy;
mod thick;

use std::path::PathBuf;

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

/// Reads a recording of the folder with its sidecar.
fn recording(name: &str) -> Recording {
    let path = folder().join(format!("{name}.csv"));
    let sidecar = std::fs::read_to_string(path.with_extension("json")).ok();
    let sidecar = sidecar.as_deref().map(|text| ("sidecar", text));
    let text = std::fs::read_to_string(&path).unwrap();
    Recording::read(name, &text, sidecar, &Map::default()).unwrap()
}
