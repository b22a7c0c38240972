//! One step in the record.

use serde::{Deserialize, Serialize};

use crate::world::WorldState;

use super::failure::StepFailure;
use super::line::{Call, Deed, Line};
use super::rows::{DuringRow, FluentRow};

/// How one step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Everything it should make true is true.
    Success,
    /// Something it should make true is false, or its script gave up.
    Failure,
    /// A person or a limit stopped it.
    Stopped,
}

/// One step that was carried out, or that was come to and not needed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Its place in the run, from 1.
    pub number: usize,
    /// Its node's path in the graph.
    pub path: String,
    /// As a call: `grasp(jar)`.
    pub action: String,
    /// The action that was called; `None` for a check, and in records of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub call: Option<Call>,
    /// How it ended.
    pub outcome: Outcome,
    /// What ends or spares it and held before it began, so that nothing was done; `None` of a step that was carried out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_needed: Option<String>,
    /// Why, when it failed, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Why, when it failed; `None` in records of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<StepFailure>,
    /// Start and end in arm time, s.
    pub interval_s: [f64; 2],
    /// The fluents after it.
    pub fluents: Vec<FluentRow>,
    /// How the conditions fared that were in force while it ran.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub during: Vec<DuringRow>,
    /// The lines of its script that acted, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<Line>,
    /// Where the plan had the arm after it, rad; empty in records of older programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub planned_q: Vec<f64>,
    /// How many known fluents differ between twin and measurement (Eq. 8).
    pub hamming: usize,
    /// `exp(-hamming)` (Eq. 8).
    pub score: f64,
    /// The world after it, as measured.
    pub measured: WorldState,
    /// The world after it in the twin, if the step was rehearsed.
    pub twin: Option<WorldState>,
}

impl StepRecord {
    /// Returns whether it was carried out: what was not needed says nothing of arm, twin or branch.
    pub fn was_carried_out(&self) -> bool {
        self.not_needed.is_none()
    }

    /// Returns what the step did to things, in order.
    pub fn deeds(&self) -> impl Iterator<Item = &Deed> {
        self.lines.iter().filter_map(|line| line.deed.as_ref())
    }
}
