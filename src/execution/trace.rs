//! The record of a run: events in order, and the hook that lets others watch.
//!
//! Events are data; [`crate::report`] words them and the run folder keeps them. Nothing here judges.

use serde::{Deserialize, Serialize};

use crate::world::WorldState;
use crate::world::fluent::Direction;

use super::arm::Feedback;
use super::lines::Line;

/// One quantity a person would read, with its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// One fluent after one step, in the twin and as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FluentRow {
    /// As people read it: `holding(jar)`.
    pub name: String,
    /// What the plan says, if it says anything.
    pub expected: Option<bool>,
    /// In the twin; `None` is unknown.
    pub twin: Option<bool>,
    /// As measured; `None` is unknown.
    pub measured: Option<bool>,
    /// By how much it holds (positive) or fails as measured.
    pub margin: Option<Measure>,
    /// By how much it holds or fails in the twin.
    pub twin_margin: Option<Measure>,
    /// The question a person would be asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ask: Option<String>,
    /// Why it is unknown or false, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// One standard deviation of the margin, where the measurement has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<Measure>,
    /// Which way the thing would have to move for it to hold, when it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<Direction>,
    /// The comparisons it was judged by, as measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<TermRow>,
}

/// One comparison inside a fluent, as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermRow {
    /// With its arguments filled in: `gap(jar, cup) >= 2 cm`.
    pub text: String,
    /// Whether it holds; `None` is unknown.
    pub truth: Option<bool>,
    /// What was compared; `None` for a term that is yes or no.
    pub value: Option<Measure>,
    /// With what.
    pub limit: Option<Measure>,
    /// By how much it holds (positive) or fails.
    pub margin: Option<Measure>,
    /// One standard deviation of the margin, where the measurement has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<Measure>,
}

/// One condition that was in force while a step ran, in the twin and as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DuringRow {
    /// As people read it: `height(jar) < 20 cm`.
    pub name: String,
    /// Whether it ended the step when it became true (`until`), or had to hold (`keeps`, `while`).
    pub ends: bool,
    /// As measured.
    pub measured: Fared,
    /// In the twin, if the step was rehearsed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<Fared>,
}

/// How a condition fared while a step ran.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Fared {
    /// Its margin when it was smallest, where it has one and somebody knows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least: Option<Measure>,
    /// When that was, s from the step's beginning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_at_s: Option<f64>,
    /// When an `until` became true, s from the step's beginning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub became_true_s: Option<f64>,
    /// Whether that is the rehearsal's word, since nobody could measure it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_rehearsal: bool,
}

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

/// One step that was carried out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Its place in the run, from 1.
    pub number: usize,
    /// Its node's path in the graph.
    pub path: String,
    /// As a call: `grasp(jar)`.
    pub action: String,
    /// How it ended.
    pub outcome: Outcome,
    /// Why, when it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
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

/// What happens during a run, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// A part of the work begins: `perceive`, `plan`, `simulate`, `execute`.
    Phase {
        /// Its name.
        name: String,
        /// What it is about, in words.
        detail: String,
    },
    /// Something worth a line.
    Note {
        /// The line.
        text: String,
    },
    /// How far a long piece of work has come.
    Progress {
        /// What is being done.
        what: String,
        /// From 0 to 1.
        fraction: f64,
    },
    /// A step begins.
    StepStart {
        /// Its place in the run, from 1.
        number: usize,
        /// How many there are in the plan.
        of: usize,
        /// As a call.
        action: String,
        /// Its node's path in the graph.
        path: String,
    },
    /// A step has ended.
    StepEnd {
        /// What came of it.
        record: Box<StepRecord>,
    },
    /// One control tick of the arm.
    #[serde(skip)]
    Tick(Feedback),
    /// A picture: name and PNG-ready pixels go to the recorder, not to the event file.
    #[serde(skip)]
    Picture {
        /// File name without ending.
        name: String,
        /// The picture.
        image: image::RgbImage,
    },
}

/// Someone who watches a run.
pub trait Observer {
    /// Sees one event. An observer never slows the arm: it may only note and return.
    fn event(&mut self, event: &Event);
}

/// Watches nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Nobody;

impl Observer for Nobody {
    fn event(&mut self, _event: &Event) {}
}
