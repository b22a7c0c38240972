//! One call of an action, and the lines of its script that acted.

use serde::{Deserialize, Serialize};

/// An action that was called.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Call {
    /// The action: `grasp`.
    pub name: String,
    /// Its arguments as text, by the names of its parameters.
    pub args: Vec<(String, String)>,
}

/// What a line did to the things on the table, whatever the action is called that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deed {
    /// The fingers closed on an object.
    Took {
        /// Which.
        object: String,
    },
    /// The fingers opened.
    Released,
    /// The hand turned a vessel along a way that was planned to pour.
    Turned {
        /// What is poured from.
        source: String,
        /// What is poured into.
        target: String,
    },
    /// The hand turned a vessel back upright.
    TurnedBack,
    /// The fingers pushed an object along what it stands on.
    Pushed {
        /// What.
        object: String,
    },
    /// The hand went down to where what it holds is to stand.
    SetDown {
        /// What.
        object: String,
    },
}

/// A line of a script that acts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// The script: `lift.rhai`.
    pub script: String,
    /// Which line of it, from 1; 0 when unknown.
    pub line: usize,
    /// The line as it is written.
    pub text: String,
    /// What it does, in words.
    pub does: String,
    /// When it began, s of arm time from the beginning of the script.
    pub at_s: f64,
    /// What it did to things, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deed: Option<Deed>,
}

impl Line {
    /// Returns its place: `lift.rhai:2`.
    pub fn place(&self) -> String {
        format!("{}:{}", self.script, self.line)
    }
}
