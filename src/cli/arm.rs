//! `--robot`: which arm is meant, told from its text alone. Who connects, and how, is in [`super::kortex`] and
//! [`super::bridge`].

use std::path::Path;

use crate::report::Failure;

use super::bridge;
#[cfg(feature = "kortex")]
use super::kortex;

/// How an arm over Kortex is named.
pub(super) const KORTEX: &str = "kortex://";

/// The code of a robot that does not exist.
const UNKNOWN: &str = "robot::unknown";

/// The arm that `--robot` names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ArmAt {
    /// The embedded reality, or the simulation alone.
    Inside,
    /// A Gen3.
    #[cfg(feature = "kortex")]
    Kortex(kortex::Target),
    /// A reality behind a bridge.
    Bridge(bridge::Target),
}

impl ArmAt {
    /// Whether it is outside of this program.
    pub(super) fn is_elsewhere(&self) -> bool {
        *self != Self::Inside
    }
}

/// Reads what `--robot` was given.
pub(super) fn at(robot: &str) -> Result<ArmAt, Failure> {
    if matches!(robot, "lab" | "twin") {
        return Ok(ArmAt::Inside);
    }
    #[cfg(feature = "kortex")]
    if let Some(rest) = robot.strip_prefix(KORTEX) {
        return kortex::target(rest).map(ArmAt::Kortex);
    }
    #[cfg(not(feature = "kortex"))]
    if robot.starts_with(KORTEX) {
        return Err(Failure::input(UNKNOWN, "this build cannot speak with a Gen3")
            .help("build it with `--features kortex`"));
    }
    if let Some(rest) = robot.strip_prefix(bridge::SCHEME) {
        return bridge::target(rest).map(ArmAt::Bridge);
    }
    let help = if is_file(robot) {
        "the robot of a recording is named with `gap --robot-file URDF`"
    } else {
        "use `--robot lab`, `--robot twin`, `--robot kortex://USER@HOST` or `--robot bridge://HOST:PORT`"
    };
    Err(Failure::input(UNKNOWN, format!("there is no robot `{robot}`")).help(help))
}

/// Words of a robot that does not exist what `gap` takes instead, where no arm is run on.
pub(super) fn of_recordings(robot: &str, failure: Failure) -> Failure {
    if failure.code != UNKNOWN {
        return failure;
    }
    let file = if is_file(robot) { robot } else { "URDF" };
    Failure::input(UNKNOWN, format!("`gap` runs on no arm, so `{robot}` is not looked for"))
        .help(format!("name the arm of the recordings with `--robot-file {file}`"))
}

/// Whether what `--robot` was given is the description of a robot.
fn is_file(robot: &str) -> bool {
    Path::new(robot).extension().is_some_and(|ending| ending == "urdf")
}
