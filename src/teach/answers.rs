//! What people answer to the questions of a run, in a file that only grows, and how often they were right.
//!
//! A trainee's answer is kept as `person:trainee`: it is no measurement and no expert's label, and nothing
//! but progress is worked out from it. An expert's is kept as `person:expert` and is the truth that others
//! are judged by (`trueup vqa eval`). Beside each answer stands what geometry said of the same fluent after
//! the same step. One JSON object a line; a line that cannot be read is passed over and counted.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::lines;
use crate::trace::{FluentRow, Measure, StepRecord};
use crate::vqa::On;

/// Where answers are kept, in the folder of runs.
pub const FILE: &str = "answers.jsonl";
/// Who is being taught.
pub const TRAINEE: &str = "person:trainee";
/// Whose answers are the truth.
pub const EXPERT: &str = "person:expert";

/// Whether answers under this name are an expert's: [`EXPERT`], or `person:expert:anna`.
pub fn is_expert(by: &str) -> bool {
    by.strip_prefix(EXPERT).is_some_and(|rest| rest.is_empty() || rest.starts_with(':'))
}

/// What a person says of a fluent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// It is so.
    Yes,
    /// It is not.
    No,
    /// It cannot be told.
    CannotTell,
}

impl Answer {
    /// Reads `y`, `n`, `u` and their words.
    pub fn parse(word: &str) -> Option<Self> {
        match word.trim().to_lowercase().as_str() {
            "y" | "yes" => Some(Self::Yes),
            "n" | "no" => Some(Self::No),
            "u" | "unknown" | "can't tell" | "cannot tell" => Some(Self::CannotTell),
            _ => None,
        }
    }

    /// Returns the answer that a reading of a fluent amounts to.
    pub fn of(truth: Option<bool>) -> Self {
        match truth {
            Some(true) => Self::Yes,
            Some(false) => Self::No,
            None => Self::CannotTell,
        }
    }

    /// Returns it in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::No => "no",
            Self::CannotTell => "can't tell",
        }
    }
}

/// One answer of one person, with geometry's beside it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answered {
    /// Whose: [`TRAINEE`].
    pub by: String,
    /// The name of the run folder; empty for a run that is not kept.
    pub run: String,
    /// The number of the step after which it was asked.
    pub step: usize,
    /// The path of that step.
    pub path: String,
    /// The fluent: `above(jar, cup)`.
    pub fluent: String,
    /// The question as the person read it.
    pub question: String,
    /// Which picture it was asked about.
    #[serde(default)]
    pub on: On,
    /// What the person said, before geometry's answer was shown.
    pub answer: Answer,
    /// What geometry said, as measured.
    pub geometry: Answer,
    /// What geometry said in the twin.
    pub twin: Answer,
    /// By how much it held (positive) or failed as measured.
    pub margin: Option<Measure>,
    /// One standard deviation of the margin, where the measurement has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<Measure>,
}

impl Answered {
    /// Sets what a person said of a fluent after a step beside what geometry said; `None` when the fluent
    /// has no question.
    pub fn new(
        by: &str,
        run: &str,
        step: &StepRecord,
        row: &FluentRow,
        answer: Answer,
    ) -> Option<Self> {
        Some(Self {
            by: by.to_owned(),
            run: run.to_owned(),
            step: step.number,
            path: step.path.clone(),
            fluent: row.name.clone(),
            question: row.ask.clone()?,
            on: On::Real,
            answer,
            geometry: Answer::of(row.measured),
            twin: Answer::of(row.twin),
            margin: row.margin.clone(),
            std: row.std.clone(),
        })
    }

    /// Returns whether the person said what geometry says.
    pub fn agrees(&self) -> bool {
        self.answer == self.geometry
    }
}

/// Adds an answer at the end of the file, which is made if it is not there.
///
/// # Errors
///
/// What the file system says.
pub fn append(path: &Path, answered: &Answered) -> io::Result<()> {
    lines::append(path, answered)
}

/// Reads all answers, the oldest first, and counts the lines that are none. No file is no answer.
///
/// # Errors
///
/// What the file system says.
pub fn read(path: &Path) -> io::Result<(Vec<Answered>, usize)> {
    lines::read(path)
}

/// How often someone was right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// As often the answer was geometry's.
    pub right: usize,
    /// Of so many answers to which geometry had one too.
    pub of: usize,
    /// Answers besides, where geometry could not tell; they are neither right nor wrong.
    pub open: usize,
}

/// Returns how often each trainee was right about each fluent, by person and the fluent's name without its
/// arguments.
pub fn progress(answers: &[Answered]) -> BTreeMap<(String, String), Tally> {
    let mut found: BTreeMap<(String, String), Tally> = BTreeMap::new();
    for answered in answers.iter().filter(|answered| !is_expert(&answered.by)) {
        let name = answered.fluent.split('(').next().unwrap_or_default();
        let tally = found.entry((answered.by.clone(), name.to_owned())).or_default();
        if answered.geometry == Answer::CannotTell {
            tally.open += 1;
        } else {
            tally.of += 1;
            tally.right += usize::from(answered.agrees());
        }
    }
    found
}
