//! Why a verb of the cell could not be done.

use std::path::PathBuf;

use crate::arm::DeviceError;
use crate::execution::calibrate;
use crate::execution::error::ActionError;
use crate::graph;
use crate::http::Trouble;
use crate::lab;
use crate::language::{Diagnostic, Source};
use crate::trace::{OffTable, StepFailure};

use super::stdlib;

/// Why a verb of the cell could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{path}: {error}")]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The run cannot be recorded any further; the arm was brought to rest.
    #[error("the run cannot be recorded any further in {dir}: {error}")]
    Unrecorded {
        /// Its folder.
        dir: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The text has mistakes.
    #[error("{} mistakes in the text", .0.len())]
    Text(Vec<(Diagnostic, Source)>),
    /// The call cannot be made a graph.
    #[error("{}", .0.iter().map(|p| p.message.as_str()).collect::<Vec<_>>().join("; "))]
    Graph(Vec<graph::Problem>),
    /// No branch of the graph is possible.
    #[error("{0}")]
    Branch(#[from] graph::Error),
    /// There is no such scene.
    #[error("no `scene` in {0}")]
    NoScene(String),
    /// The scene's robot is none, or lacks what every action needs.
    #[error("{0}")]
    Robot(#[from] stdlib::RobotError),
    /// The lab cannot be built.
    #[error("the lab cannot be built: {0}")]
    Lab(#[from] lab::Error),
    /// The camera's picture cannot be aligned.
    #[error("{0}")]
    Calibrate(calibrate::Error),
    /// An object the call needs is not where the camera looks.
    #[error("`{0}` cannot be seen: nothing in the picture looks like it")]
    NotSeen(String),
    /// The arm does not get at an object the call needs; nothing has moved.
    #[error("{}", said_of_short(object, *is_filled, short))]
    OutOfReach {
        /// Which.
        object: String,
        /// Whether it is poured into, and nobody grasps it.
        is_filled: bool,
        /// What is wanting.
        short: Short,
    },
    /// An object is to stand at a point that is off the table; nothing has moved.
    #[error("`{object}` cannot stand at that point: {off}")]
    OffTable {
        /// Which.
        object: String,
        /// Where, and what the table is.
        off: OffTable,
    },
    /// More is to be poured than goes in; nothing has moved.
    #[error("`{target}` has room for {:.0} mL and runs over beyond; {:.0} mL were to be poured", 1e6 * .room, 1e6 * .amount)]
    NoRoom {
        /// Where it was to go.
        target: String,
        /// What still goes in, m³.
        room: f64,
        /// What was to be poured, m³.
        amount: f64,
    },
    /// More is to be poured than there is; nothing has moved.
    #[error("`{source_name}` holds {:.0} mL; {:.0} mL were to be poured", 1e6 * .there, 1e6 * .amount)]
    NotSoMuch {
        /// What it was to come from.
        source_name: String,
        /// What is there, m³.
        there: f64,
        /// What was to be poured, m³.
        amount: f64,
    },
    /// There is nothing in the vessel that is to be poured from; nothing has moved.
    #[error("`{source_name}` is empty")]
    Empty {
        /// What it was to come from.
        source_name: String,
    },
    /// There is less in the vessel that is to be poured from than can be weighed; nothing has moved.
    #[error("`{source_name}` is nearly empty, with {:.1} mL in it; less than {:.0} mL cannot be poured, since it cannot be weighed in the hand", 1e6 * .there, 1e6 * .least)]
    NearlyEmpty {
        /// What it was to come from.
        source_name: String,
        /// What is there, m³.
        there: f64,
        /// The least that can be weighed, m³.
        least: f64,
    },
    /// Less is to be poured than can be weighed; nothing has moved.
    #[error("{:.1} mL cannot be measured by weighing in the hand; the least is {:.0} mL", 1e6 * .amount, 1e6 * .least)]
    NotWeighable {
        /// What was to be poured, m³.
        amount: f64,
        /// The least that can be weighed, m³.
        least: f64,
    },
    /// What the call needs is false before it begins; nothing has moved.
    #[error("`{call}` needs `{what}`, which is false{by}")]
    Needs {
        /// The call.
        call: String,
        /// The condition.
        what: String,
        /// By how much, in words: ` by 3 mm`.
        by: String,
    },
    /// The call needs an empty hand; nothing has moved.
    #[error("the hand already holds `{held}`")]
    HandFull {
        /// What is in it.
        held: String,
        /// Whether that is a drawer, which is let go where it is.
        is_drawer: bool,
    },
    /// The call needs something in the hand that is not there; nothing has moved.
    #[error("`{object}` is not in the hand{}", other.as_ref().map(|other| format!("; `{other}` is")).unwrap_or_default())]
    NotInHand {
        /// What it needs there.
        object: String,
        /// What is there.
        other: Option<String>,
        /// Whether what it needs is a drawer, which is taken by its handle.
        is_drawer: bool,
    },
    /// Everything failed in the twin.
    #[error(
        "none of {tried} simulated plans succeeded; the best failed at {step}: {failure}{}",
        .water.as_ref().map(ToString::to_string).unwrap_or_default()
    )]
    NoSurvivor {
        /// How many were tried.
        tried: usize,
        /// How many steps the best one did.
        reached: usize,
        /// Where the best one failed.
        step: String,
        /// Why.
        failure: Box<StepFailure>,
        /// Where the twin's water was then, where it failed for an amount of water.
        water: Option<InTwin>,
    },
    /// A folder holds no run that can be read.
    #[error("{path} is no run that can be read: {why}")]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: NoRun,
    },
    /// A what-if cannot begin there.
    #[error("{0}")]
    WhatIf(#[from] WhatIf),
    /// There is nothing to do.
    #[error("there is nothing to do")]
    NothingToDo,
    /// The model that was to answer questions does not answer.
    #[error("the model at {endpoint} does not answer: {why}")]
    Model {
        /// Where it was looked for.
        endpoint: String,
        /// Why.
        why: Trouble,
    },
    /// An action could not be done.
    #[error("{0}")]
    Action(#[from] ActionError),
}

impl Error {
    /// Returns what has to be done first for it not to come up, in words, where that is one call.
    pub fn first(&self) -> Option<String> {
        match self {
            Self::HandFull { is_drawer: true, .. } => {
                Some("let it go first: `open_gripper()`".to_owned())
            }
            Self::HandFull { held, .. } => Some(format!("put it down first: `place({held})`")),
            Self::NotInHand { other: Some(other), .. } => {
                Some(format!("put that down first: `place({other})`"))
            }
            Self::NotInHand { object, is_drawer: true, .. } => {
                Some(format!("take its handle first: `take_handle({object})`"))
            }
            Self::NotInHand { object, .. } => Some(format!("pick it up first: `pick({object})`")),
            _ => None,
        }
    }
}

/// What is wanting where the arm does not get at a thing.
#[derive(Debug, Clone, PartialEq)]
pub enum Short {
    /// So much, m.
    By(f64),
    /// Room to the end of this joint's range.
    AtEnd(String),
    /// The hand's turn.
    NotTurned,
}

/// Words what is wanting where the hand does not get to a thing, or above it where it is poured into.
fn said_of_short(object: &str, is_filled: bool, short: &Short) -> String {
    let above = if is_filled { "the place to pour from, above " } else { "" };
    match short {
        Short::By(m) if *m < 5e-4 => format!("{above}`{object}` is less than 1 mm out of reach"),
        Short::By(m) => format!("{above}`{object}` is {:.0} mm out of reach", m * 1e3),
        Short::AtEnd(joint) => {
            format!("{above}`{object}` is reached only with `{joint}` at the end of its range")
        }
        Short::NotTurned => {
            let so = if is_filled { "a pour" } else { "a grasp" };
            format!(
                "the arm reaches {above}`{object}`, but cannot turn its hand there as {so} needs"
            )
        }
    }
}

/// Where the twin's water is.
#[derive(Debug, Clone, PartialEq)]
pub struct InTwin {
    /// How much is in each vessel of the scene, m³.
    pub vessels: Vec<(String, f64)>,
    /// How much is in none, m³.
    pub spilt: f64,
}

impl std::fmt::Display for InTwin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "; in the twin: ")?;
        for (name, volume) in &self.vessels {
            write!(f, "{name} {:.1} mL, ", 1e6 * volume)?;
        }
        write!(f, "spilt {:.1} mL", 1e6 * self.spilt)
    }
}

/// Why a what-if cannot begin where it was to.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WhatIf {
    /// The run has no such step.
    #[error("the run has no step {after}; it has {of}")]
    NoStep {
        /// The step after which it was to begin.
        after: usize,
        /// How many steps the run has.
        of: usize,
    },
    /// The run has an object that the scene has not.
    #[error("the run has a `{0}`, which this scene has not")]
    OtherScene(String),
    /// The run's arm has not as many joints.
    #[error("the run is of another arm than this one")]
    OtherArm,
    /// It was the last step of its plan.
    #[error("nothing was planned after step {0}")]
    NothingAfter(usize),
}

/// Why a folder holds no run that can be read.
#[derive(Debug, thiserror::Error)]
pub enum NoRun {
    /// Its document cannot be read.
    #[error("{0}")]
    File(#[from] std::io::Error),
    /// Its document is no run.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
}

impl Error {
    /// Of two that say that no simulated plan succeeded, the one whose best plan got farther, for the plans of both; of any
    /// other pair the second.
    pub(super) fn or_farther(self, other: Self) -> Self {
        let count = |error: &Self| match error {
            Self::NoSurvivor { tried, reached, .. } => Some((*tried, *reached)),
            _ => None,
        };
        let (Some(mine), Some(others)) = (count(&self), count(&other)) else { return other };
        let mut kept = if others.1 > mine.1 { other } else { self };
        if let Self::NoSurvivor { tried, .. } = &mut kept {
            *tried = mine.0 + others.0;
        }
        kept
    }
}

impl From<calibrate::Error> for Error {
    fn from(error: calibrate::Error) -> Self {
        match error {
            // A stop is a stop wherever it reaches the arm.
            calibrate::Error::Action(error) => Self::Action(error),
            other => Self::Calibrate(other),
        }
    }
}

impl From<DeviceError> for Error {
    fn from(error: DeviceError) -> Self {
        Self::Action(error.into())
    }
}

/// Why the corners of a cube say nothing in a laboratory.
#[derive(Debug, thiserror::Error)]
pub enum NoCorners {
    /// The laboratory cannot be opened.
    #[error(transparent)]
    Cell(#[from] Error),
    /// Its camera gives no picture.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// Its dots do not give the camera.
    #[error(transparent)]
    Calibrate(#[from] calibrate::Error),
    /// Nothing can be found in the picture.
    #[error(transparent)]
    Picture(#[from] crate::alignment::vision::Error),
    /// Its dots do not give a map.
    #[error(transparent)]
    Map(#[from] crate::alignment::Error),
    /// The cube is not found, or not by its contour.
    #[error("the cube's corners were not measured on its contour {0}")]
    NotSeen(String),
    /// Not all corners are there.
    #[error("{0} corners of the cube were found where 6 are seen")]
    Few(usize),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "`cup` is 0 mm out of reach", of a cup at which a slide had 20 mm left to its end.
    #[test]
    fn what_is_wanting_is_told_and_no_distance_of_nothing() {
        let said = |short, is_filled| {
            Error::OutOfReach { object: "cup".into(), is_filled, short }.to_string()
        };
        assert_eq!(said(Short::By(0.0434), false), "`cup` is 43 mm out of reach");
        assert_eq!(said(Short::By(1e-6), false), "`cup` is less than 1 mm out of reach");
        let end = said(Short::AtEnd("lift".into()), false);
        assert_eq!(end, "`cup` is reached only with `lift` at the end of its range");
        let turn = said(Short::NotTurned, true);
        assert!(turn.ends_with("above `cup`, but cannot turn its hand there as a pour needs"));
    }
}
