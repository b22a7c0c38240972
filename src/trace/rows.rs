//! What was worth what after a step and while it ran, as it is recorded: rows of numbers with their units.

use serde::{Deserialize, Serialize};

use crate::fluent::Direction;

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
