//! What a run came to: the answer of `trueup run --json`, and `run.json`.

use serde::{Deserialize, Serialize};

use crate::arm::Pacing;
use crate::execution::calibration::Calibration;
use crate::graph::ParseGraph;
use crate::monitor::questionnaire::Answer;
use crate::trace::{Outcome, StepRecord};
use crate::vqa::Probe;
use crate::world::WorldState;

use super::displaced::Displaced;
use super::matching::Matching;
use super::setting::Setting;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Everything the task gives is true as measured.
    Success,
    /// It was done, and something that it gives nobody could judge.
    Unconfirmed,
    /// It is not.
    Failure,
    /// A person or a limit stopped it.
    Stopped,
    /// An arm or a camera failed on the way.
    Unavailable,
}

impl Ending {
    /// Whether every step was done, whatever is known of what it came to.
    pub fn is_done(self) -> bool {
        matches!(self, Self::Success | Self::Unconfirmed)
    }

    /// Returns its word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Success => "success",
            Self::Unconfirmed => "unconfirmed",
            Self::Failure => "failure",
            Self::Stopped => "stopped",
            Self::Unavailable => "unavailable",
        }
    }
}

/// Whether a run is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// It goes on, or was cut off: which of them is not for its document to say. The outcome means nothing yet.
    Running,
    /// It is over. Records of older programs say nothing, and are.
    #[default]
    Ended,
}

/// What became of the water.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Water {
    /// In the vessel that was poured into, mL.
    pub in_target_ml: f64,
    /// Left in the vessel that was poured from, mL.
    pub in_source_ml: f64,
    /// In every vessel that the scales know, mL, by name. Records of older programs name none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vessels_ml: Vec<(String, f64)>,
    /// Anywhere else, mL.
    pub spilt_ml: f64,
    /// Whose scales say so.
    pub measured_by: String,
}

/// Seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Timing {
    /// Calibrating and looking, also at the end.
    pub perceive: f64,
    /// Choosing from the graph, at first and after a failure.
    pub plan: f64,
    /// Rehearsing in the twin.
    pub simulate: f64,
    /// Performing on the arm.
    pub execute: f64,
    /// Waiting for a person's word between, while the arm held still.
    #[serde(default)]
    pub waiting: f64,
    /// Drawing and keeping the pictures that were left to draw when all else was done. Records of older programs do not say.
    #[serde(default)]
    pub pictures: f64,
    /// All of it.
    pub total: f64,
}

/// One rehearsal in a few words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// What was chosen at each Or: `pick/either=level_side`.
    pub choices: Vec<String>,
    /// Which set of choices inside the scripts.
    pub variant: usize,
    /// Whether it survived.
    pub success: bool,
    /// Water on the table at its end, mL.
    pub spilt_ml: f64,
    /// Arm time, s.
    pub time_s: f64,
    /// Where and why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// In which step a free motion moved something that it was not to touch, what, and how far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brushed: Option<String>,
}

/// What a run's scripts are there for, read off the words they use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Aims {
    /// They take something into the hand.
    pub holds: bool,
    /// They pour.
    pub pours: bool,
}

/// A run: the answer of `trueup run --json`, and `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The call: `pour(jar, cup)`.
    pub task: String,
    /// Whether it is over.
    #[serde(default)]
    pub state: State,
    /// How it ended.
    pub outcome: Ending,
    /// Whether everything the task gives is true as measured.
    pub reached: bool,
    /// Why, when it did not succeed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What would help, when a device failed: the arm, or the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_help: Option<String>,
    /// Whether the arm was asked to stop and had not answered when the run ended: whether it holds is not known.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stop_unanswered: bool,
    /// The seed.
    pub seed: u64,
    /// `lab` or `twin`.
    pub robot: String,
    /// The scene and the arm that it was made with. Records of older programs do not say.
    #[serde(default, rename = "scene", skip_serializing_if = "Option::is_none")]
    pub setting: Option<Setting>,
    /// The program's version.
    pub version: String,
    /// The world when it began, once it was looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<WorldState>,
    /// What the regressions found: with it the joint positions of the steps mean the poses they meant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// How well the twin matched what was measured before the first step (Eq. 1).
    #[serde(default, rename = "match", skip_serializing_if = "Option::is_none")]
    pub matching: Option<Matching>,
    /// The steps, as carried out.
    pub steps: Vec<StepRecord>,
    /// The questionnaire, answered by geometry after each step, and by a model where one is asked.
    pub questions: Vec<Vec<Answer>>,
    /// What the model that answers beside geometry showed it can do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<Probe>,
    /// What its scripts are there for; `None` in records of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aims: Option<Aims>,
    /// What was tried in the twin, best first, attempt after attempt.
    pub rehearsals: Vec<Tried>,
    /// The parse graphs that were performed, one an attempt.
    pub parse_graphs: Vec<ParseGraph>,
    /// What the scales say at the end, where there are scales.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
    /// What stands elsewhere than it was seen before the run, though no step took or pushed it. Records of older programs name
    /// nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displaced: Vec<Displaced>,
    /// The vessel on the scale whose reading was recorded while the arm moved, where there was one. Records of older
    /// programs do not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale_under: Option<String>,
    /// How evenly positions were streamed to the arm, where they were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stream: Option<Pacing>,
    /// How long it took.
    pub timing_s: Timing,
    /// The run folder.
    pub run_dir: Option<String>,
}

impl Run {
    /// Returns the steps that were carried out: those that were not needed count for nothing.
    pub fn carried_out(&self) -> impl Iterator<Item = &StepRecord> {
        self.steps.iter().filter(|step| step.was_carried_out())
    }

    /// Returns how many steps were carried out, and after how many of them twin and measurement agree in all they know.
    pub fn agreeing(&self) -> (usize, usize) {
        let of = self.carried_out().count();
        (of, self.carried_out().filter(|step| step.hamming == 0).count())
    }

    /// Returns a run of which only these steps are known, failed if the last of them did.
    pub fn so_far(task: &str, steps: &[StepRecord]) -> Self {
        let failed = steps.last().is_none_or(|step| step.outcome != Outcome::Success);
        Self {
            task: task.to_owned(),
            state: State::Ended,
            outcome: if failed { Ending::Failure } else { Ending::Success },
            reached: false,
            reason: None,
            device_help: None,
            stop_unanswered: false,
            seed: 0,
            robot: String::new(),
            setting: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            start: None,
            calibration: None,
            matching: None,
            steps: steps.to_vec(),
            questions: Vec::new(),
            probe: None,
            aims: None,
            rehearsals: Vec::new(),
            parse_graphs: Vec::new(),
            water: None,
            displaced: Vec::new(),
            scale_under: None,
            stream: None,
            timing_s: Timing::default(),
            run_dir: None,
        }
    }
}
