//! What came of one step: how it ended, and what every fluent was worth then.

use crate::fluent::Reading;
use crate::trace::{Line, Outcome, StepFailure};
use crate::world::WorldState;

use super::during::Held;

/// What a fluent was worth after a step.
#[derive(Debug, Clone, PartialEq)]
pub struct FluentReading {
    /// As text: `holding(jar)`.
    pub text: String,
    /// What the plan says of it now, if anything.
    pub expected: Option<bool>,
    /// What it is.
    pub reading: Reading,
    /// Its question, if it has one.
    pub ask: Option<String>,
}

/// One step that was carried out, or that was come to and not needed.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// Which step of the parse graph.
    pub index: usize,
    /// How it ended.
    pub outcome: Outcome,
    /// What ends or spares it and held before it began, so that nothing was done.
    pub not_needed: Option<String>,
    /// Why, when it did not succeed.
    pub failure: Option<StepFailure>,
    /// Whether it failed because it does not fit what was rehearsed, so that planning it again may help.
    pub plan_again: bool,
    /// Start and end in arm time, s.
    pub interval: [f64; 2],
    /// Every fluent of the parse graph, in its order.
    pub fluents: Vec<FluentReading>,
    /// How the conditions fared that were in force while it ran.
    pub held: Vec<Held>,
    /// The lines of its script that acted.
    pub lines: Vec<Line>,
    /// The world after it.
    pub state: WorldState,
}
