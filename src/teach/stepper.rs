//! The logic of stepping, over a run that is going on or over the record of one.
//!
//! A pause is a loop of words at a place where the arm holds still. What is looked at ([`words::Wish::Back`]) and
//! what is carried out ([`words::Wish::Next`]) are told apart: while an earlier step is looked at, a word that would
//! move the arm comes back to the present first, and moves nothing.

use std::path::{Path, PathBuf};

use crate::execution::conduct::{Ahead, Conductor, Dial, Part, Word};
use crate::trace::Line;
use crate::trace::{Outcome, StepRecord};

use super::questions::{Puzzle, without_riddles};
use super::shown::{Front, Shown};
use super::stops::Stops;
use super::words;

/// How a run is stepped.
#[derive(Debug, Clone, Default)]
pub struct Setup {
    /// Whether the questions are asked, and steps are told of after them.
    pub teaches: bool,
    /// Whether it pauses before each step, rather than at breakpoints alone.
    pub steps: bool,
    /// Where answers are kept, if anywhere.
    pub answers: Option<PathBuf>,
    /// The breakpoints.
    pub stops: Stops,
    /// The arm's speed dial; `None` over a record.
    pub dial: Option<Dial>,
}

/// How far the run goes on before the next pause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Going {
    /// To the next step.
    Step,
    /// To the next line of the script of the step with that number, or to the next step.
    Line(usize),
    /// Out of a sub-task.
    Through(String),
    /// To a breakpoint.
    Free,
}

/// Where a pause is.
#[derive(Clone, Copy)]
pub(super) enum At<'a> {
    /// Before a step, with the breakpoint that paused there.
    Before(&'a Ahead),
    /// Before a line of a step's script.
    Line(&'a Ahead, usize),
    /// After a step that failed.
    Failed,
    /// After the last step.
    End,
}

/// Steps through a run.
pub struct Stepper<F> {
    pub(super) front: F,
    pub(super) setup: Setup,
    task: String,
    pub(super) run_dir: Option<PathBuf>,
    pub(super) going: Going,
    /// Paths of the sub-tasks that were entered.
    pub(super) entered: Vec<String>,
    pub(super) seen: Vec<StepRecord>,
    /// Which of `seen` is looked at.
    pub(super) looking: Option<usize>,
    pub(super) puzzle: Option<Puzzle>,
    /// A word that was said where a question was open.
    pub(super) carried: Option<String>,
    /// The step of whose lines it was said that they begin without a pause.
    passed: Option<usize>,
}

impl<F: Front> Stepper<F> {
    /// Steps through the next run.
    pub fn new(front: F, setup: Setup) -> Self {
        let going = if setup.steps { Going::Step } else { Going::Free };
        Self {
            front,
            setup,
            task: String::new(),
            run_dir: None,
            going,
            entered: Vec::new(),
            seen: Vec::new(),
            looking: None,
            puzzle: None,
            carried: None,
            passed: None,
        }
    }

    /// Returns the front.
    pub fn front(&self) -> &F {
        &self.front
    }

    /// Steps through the record of a run that is over.
    pub fn over_record(
        &mut self,
        task: &str,
        run_dir: Option<&Path>,
        steps: &[(Ahead, StepRecord)],
    ) {
        self.begins(task, run_dir);
        for (ahead, record) in steps {
            if self.before(ahead) == Word::Stop {
                return;
            }
            if self.going == Going::Line(ahead.number) && record.lines.is_empty() {
                self.front.show(&Shown::NoLines { ahead });
            }
            let mut lines = record.lines.iter();
            if lines.any(|line| self.within(ahead, line, None) == Word::Stop)
                || self.after(ahead, record) == Word::Stop
            {
                return;
            }
        }
    }

    /// Returns the sub-task that begins with a step and was not entered yet, the outermost.
    pub(super) fn unit<'a>(&self, ahead: &'a Ahead) -> Option<&'a Part> {
        ahead.inside().iter().find(|part| {
            !part.is_branch
                && part.first == ahead.number
                && part.last > part.first
                && !self.entered.contains(&part.path)
        })
    }

    /// Returns whether the run pauses before a step, and the breakpoint if one is why.
    fn pauses(&self, ahead: &Ahead) -> (bool, Option<String>) {
        let stop = self.setup.stops.hit(ahead);
        let pauses = match &self.going {
            Going::Step | Going::Line(_) => true,
            Going::Through(path) => !is_below(&ahead.path, path),
            Going::Free => false,
        };
        (pauses || stop.is_some(), stop)
    }

    fn show_ahead(&mut self, ahead: &Ahead, stop: Option<String>) {
        let (task, blind) = (self.unit(ahead), self.setup.teaches);
        self.front.show(&Shown::Ahead { ahead, task, stop, blind });
    }

    fn prompt(&self, at: At<'_>) -> String {
        let name = self.task.split('(').next().unwrap_or_default();
        if let Some(record) = self.looking.and_then(|at| self.seen.get(at)) {
            return format!("{name} looking at {}> ", record.number);
        }
        match at {
            At::Before(ahead) => format!("{name} {}/{}> ", ahead.number, ahead.of),
            At::Line(ahead, line) => format!("{name} {}/{} line {line}> ", ahead.number, ahead.of),
            At::Failed => format!("{name} failed> "),
            At::End => format!("{name} done> "),
        }
    }

    /// Takes words until one lets the run go on, or ends it.
    fn pause(&mut self, at: At<'_>) -> Word {
        loop {
            let line = match self.carried.take() {
                Some(line) => line,
                None => match self.front.ask(&self.prompt(at)) {
                    Some(line) => line,
                    // At the end there is nothing left to stop.
                    None if matches!(at, At::End) => return Word::Go,
                    None => return Word::Stop,
                },
            };
            match words::parse(&line) {
                Ok(wish) => {
                    if let Some(word) = self.grant(wish, at) {
                        self.looking = None;
                        return word;
                    }
                }
                Err(wrong) => {
                    self.front.show(&Shown::NotAWord { line: line.trim(), wrong });
                }
            }
        }
    }
}

/// Returns whether `path` is `above` or lies below it.
fn is_below(path: &str, above: &str) -> bool {
    path.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '.']))
}

impl<F: Front> Conductor for Stepper<F> {
    fn begins(&mut self, task: &str, run_dir: Option<&Path>) {
        task.clone_into(&mut self.task);
        self.run_dir = run_dir.map(Path::to_path_buf);
    }

    fn tells(&self) -> bool {
        self.setup.teaches
    }

    fn before(&mut self, ahead: &Ahead) -> Word {
        let (pauses, stop) = self.pauses(ahead);
        if !pauses {
            return Word::Go;
        }
        self.show_ahead(ahead, stop);
        self.pause(At::Before(ahead))
    }

    fn passing(&mut self, ahead: &Ahead, why: &str) {
        if self.pauses(ahead).0 {
            self.front.show(&Shown::Passing { ahead, why });
            // The pause that was wanted is made up for at the next place where it can be.
            self.going = Going::Step;
        }
    }

    fn within(&mut self, ahead: &Ahead, line: &Line, why: Option<&str>) -> Word {
        let stop = self.setup.stops.at_line(line);
        if self.going != Going::Line(ahead.number) && stop.is_none() {
            return Word::Go;
        }
        if let Some(why) = why {
            // Once a step: a loop may tilt in many small turns.
            if self.passed.replace(ahead.number) != Some(ahead.number) {
                self.front.show(&Shown::PassingLine { ahead, line, why });
            }
            // The pause that was wanted is made up for at the next line where it can be, or the next step.
            self.going = Going::Line(ahead.number);
            return Word::Go;
        }
        self.front.show(&Shown::Line { ahead, line, stop });
        self.pause(At::Line(ahead, line.line))
    }

    fn after(&mut self, ahead: &Ahead, record: &StepRecord) -> Word {
        let before = self.seen.last().map(|last| last.fluents.clone()).unwrap_or_default();
        let is_stepping = matches!(self.going, Going::Step | Going::Line(_));
        let given = if self.setup.teaches && is_stepping && self.carried.is_none() {
            self.questions(record)
        } else {
            Vec::new()
        };
        if self.setup.teaches {
            let (shown, withheld) = without_riddles(record);
            self.front.show(&Shown::Done { record: &shown, before: &before, withheld });
        }
        self.seen.push(record.clone());
        self.puzzle = None;
        self.compare(record, &given);
        match record.outcome {
            Outcome::Failure if self.setup.steps || is_stepping => {
                let is_over = self.setup.dial.is_none();
                self.front.show(&Shown::Failed { record, is_over });
                self.going = Going::Step;
                self.pause(At::Failed)
            }
            Outcome::Success
                if is_stepping && record.number >= ahead.of && !ahead.is_recovery() =>
            {
                self.front.show(&Shown::Over);
                self.pause(At::End)
            }
            _ => Word::Go,
        }
    }
}
