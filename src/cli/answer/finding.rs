//! What `robot check` answers with: findings, and how they read. Nothing is looked at here.

use std::fmt::Write as _;

use serde::Serialize;

/// What a robot may be used for, each with what the one before needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Use {
    /// `robot fk`, `robot ik`.
    Kinematics,
    /// `robot plan`.
    Planning,
    /// The physics of the twin.
    Twin,
    /// `pour(jar, cup)`.
    Pour,
}

/// How something stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// In order.
    Ok,
    /// Assumed; it works, perhaps not as the robot does.
    Assumed,
    /// Not there, or wrong.
    Missing,
}

/// One thing that was looked at.
#[derive(Debug, Clone, Serialize)]
pub struct Finding {
    /// What it is about: `jaws`, `tool`.
    pub name: &'static str,
    /// How it stands.
    pub state: State,
    /// What cannot be done without it, and what builds on that.
    pub needed_for: Use,
    /// What was found.
    pub found: String,
    /// What to write where it is not in order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub write: Option<String>,
}

/// `robot check`.
#[derive(Debug, Clone, Serialize)]
pub struct CheckAnswer {
    /// The robot's name in its file.
    pub robot: String,
    /// What it can be used for, in order.
    pub usable_for: Vec<Use>,
    /// What was looked at.
    pub checks: Vec<Finding>,
}

impl CheckAnswer {
    /// Returns whether everything can be done.
    pub fn is_ready(&self) -> bool {
        self.usable_for.len() == 4
    }

    /// Returns the findings as lines for people.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for check in &self.checks {
            let state = match check.state {
                State::Ok => "ok",
                State::Assumed => "assumed",
                State::Missing => "missing",
            };
            let _ = writeln!(text, "{state:<8} {:<14} {}", check.name, check.found);
            if let Some(write) = &check.write {
                let _ = writeln!(text, "{:<8} {:<14} write {write}", "", "");
            }
        }
        let word = |to: &Use| match to {
            Use::Kinematics => "kinematics",
            Use::Planning => "planning",
            Use::Twin => "the twin",
            Use::Pour => "pour(jar, cup)",
        };
        let words: Vec<&str> = self.usable_for.iter().map(word).collect();
        let words = if words.is_empty() { "nothing yet".to_owned() } else { words.join(", ") };
        let _ = write!(text, "{}: usable for {words}", self.robot);
        text
    }
}
