//! What is shown to whoever steps, and the front that shows it and asks for words.

use std::path::Path;

use serde::Serialize;

use crate::execution::conduct::{Ahead, Part};
use crate::trace::Line;
use crate::trace::{FluentRow, StepRecord};

use super::answers::Answered;
use super::words::Wrong;

/// Something to be shown to whoever steps. Serialised, it is an event of `--json`.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Shown<'a> {
    /// A pause before a step.
    Ahead {
        /// The step.
        ahead: &'a Ahead,
        /// The sub-task that begins with it and was not entered.
        task: Option<&'a Part>,
        /// The breakpoint that paused here.
        stop: Option<String>,
        /// Whether what a question is about is kept from the person.
        blind: bool,
    },
    /// What a sub-task is made of.
    Inside {
        /// The sub-task; `None` when the step ahead begins none.
        task: Option<&'a Part>,
        /// Its first step.
        ahead: &'a Ahead,
    },
    /// A pause before a line of a step's script.
    Line {
        /// The step.
        ahead: &'a Ahead,
        /// The line.
        line: &'a Line,
        /// The breakpoint that paused here.
        stop: Option<String>,
    },
    /// A line begins without a pause, though one was wanted; so may others after it.
    PassingLine {
        /// The step.
        ahead: &'a Ahead,
        /// The line.
        line: &'a Line,
        /// Why the arm cannot be left standing there.
        why: &'a str,
    },
    /// The record of a step holds no lines of its script.
    NoLines {
        /// The step.
        ahead: &'a Ahead,
    },
    /// A step begins without a pause, though one was wanted.
    Passing {
        /// The step.
        ahead: &'a Ahead,
        /// Why the arm cannot be left standing there.
        why: &'a str,
    },
    /// A question, before its answer is shown.
    Question {
        /// As the person reads it.
        question: &'a str,
        /// The fluent.
        fluent: &'a str,
        /// The number of the step after which it is asked.
        step: usize,
    },
    /// What a step came to.
    Done {
        /// The step.
        record: &'a StepRecord,
        /// The fluents before it.
        before: &'a [FluentRow],
        /// How many fluents that twin and measurement both know are kept from the person.
        #[serde(skip)]
        withheld: usize,
    },
    /// What a person said beside what geometry says.
    Compared {
        /// Both.
        answered: &'a Answered,
    },
    /// A step failed, and the run waits before it goes on with what the task says about that.
    Failed {
        /// The step.
        record: &'a StepRecord,
        /// Whether the run is over, so that nothing can be left undone.
        is_over: bool,
    },
    /// An earlier step is looked at.
    Looking {
        /// The step.
        record: &'a StepRecord,
        /// The step that comes next, `None` after the last.
        next: Option<usize>,
        /// The folder of the run.
        run_dir: Option<&'a Path>,
        /// How many fluents that twin and measurement both know are kept from the person.
        #[serde(skip)]
        withheld: usize,
    },
    /// What comes next is looked at again.
    Present {
        /// The step that comes next, `None` after the last.
        next: Option<usize>,
    },
    /// One more rung of the ladder of hints: 1 by how much, 2 which way, 3 what to try.
    Hint {
        /// Which rung.
        rung: usize,
        /// About what.
        row: &'a FluentRow,
        /// The steps so far, the one it is about last.
        steps: &'a [StepRecord],
    },
    /// There is no fluent to give a hint about.
    NoHint {
        /// The steps so far.
        steps: &'a [StepRecord],
    },
    /// Why a fluent is what it is.
    Why {
        /// Which; what failed when `None`.
        fluent: Option<&'a str>,
        /// The steps so far, or up to the one looked at.
        steps: &'a [StepRecord],
    },
    /// The speed dial.
    Slow {
        /// Where it stands, percent; `None` when nothing moves.
        percent: Option<u8>,
    },
    /// The breakpoints.
    Stops {
        /// In the order they were set.
        stops: Vec<String>,
        /// A name that is no step of what is left of the run.
        unknown: Option<String>,
        /// A name of a step that is like it.
        near: Option<String>,
    },
    /// All steps are done.
    Over,
    /// The words.
    Help,
    /// A line that is no word.
    NotAWord {
        /// The line.
        line: &'a str,
        /// What is wrong with it.
        #[serde(skip)]
        wrong: Wrong,
    },
    /// A line that is no answer, where a question is open.
    AnswerFirst {
        /// The line.
        line: &'a str,
    },
    /// There is no such step to look at.
    NoStep {
        /// How many there are.
        of: usize,
    },
    /// An answer could not be kept.
    Trouble {
        /// The file.
        path: &'a Path,
        /// What the system says.
        why: String,
    },
}

/// Shows, and asks for a line.
pub trait Front: Send {
    /// Shows something.
    fn show(&mut self, shown: &Shown<'_>);

    /// Returns the next line; `None` when there is none any more, or a person wants to stop.
    fn ask(&mut self, prompt: &str) -> Option<String>;
}
