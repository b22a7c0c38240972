//! The logic of stepping, over a run that is going on or over the record of one.
//!
//! A pause is a loop of words at a place where the arm holds still. What is looked at ([`Wish::Back`]) and
//! what is carried out ([`Wish::Next`]) are told apart: while an earlier step is looked at, a word that would
//! move the arm comes back to the present first, and moves nothing.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::execution::conduct::{Ahead, Conductor, Dial, Part, Word};
use crate::execution::trace::{FluentRow, Outcome, StepRecord};
use crate::language;

use super::answers::{self, Answer, Answered, TRAINEE};
use super::stops::{Stops, known};
use super::words::{self, Wish, Wrong};

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
    /// There is no hint to give.
    NoHint,
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
enum Going {
    /// To the next step.
    Step,
    /// Out of a sub-task.
    Through(String),
    /// To a breakpoint.
    Free,
}

/// Where a pause is.
#[derive(Clone, Copy)]
enum At<'a> {
    /// Before a step, with the breakpoint that paused there.
    Before(&'a Ahead),
    /// After a step that failed.
    Failed,
    /// After the last step.
    End,
}

/// A fluent that hints are given about.
struct Puzzle {
    step: usize,
    row: FluentRow,
    rung: usize,
}

/// Steps through a run.
pub struct Stepper<F> {
    front: F,
    setup: Setup,
    task: String,
    run_dir: Option<PathBuf>,
    going: Going,
    /// Paths of the sub-tasks that were entered.
    entered: Vec<String>,
    seen: Vec<StepRecord>,
    /// Which of `seen` is looked at.
    looking: Option<usize>,
    puzzle: Option<Puzzle>,
    /// A word that was said where a question was open.
    carried: Option<String>,
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
            if self.before(ahead) == Word::Stop || self.after(ahead, record) == Word::Stop {
                return;
            }
        }
    }

    /// Returns the sub-task that begins with a step and was not entered yet, the outermost.
    fn unit<'a>(&self, ahead: &'a Ahead) -> Option<&'a Part> {
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
            Going::Step => true,
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

    /// Does what a word asks for; returns what the run is told, if it is told anything.
    fn grant(&mut self, wish: Wish, at: At<'_>) -> Option<Word> {
        let next = match at {
            At::Before(ahead) => Some(ahead),
            At::Failed | At::End => None,
        };
        match wish {
            Wish::Next if self.looking.is_some() => self.forward(next),
            Wish::Over | Wish::Out | Wish::Continue | Wish::Into if self.looking.is_some() => {
                self.present(next);
            }
            Wish::Next => return Some(self.go(Going::Step)),
            Wish::Continue => return Some(self.go(Going::Free)),
            Wish::Quit if matches!(at, At::End) => return Some(Word::Go),
            Wish::Quit => return Some(Word::Stop),
            Wish::Over => {
                let through = next.and_then(|ahead| self.unit(ahead)).map(|unit| unit.path.clone());
                return Some(self.go(through.map_or(Going::Step, Going::Through)));
            }
            Wish::Out => {
                let inner = next.and_then(|ahead| {
                    ahead
                        .inside()
                        .iter()
                        .rev()
                        .find(|part| !part.is_branch && part.last > part.first)
                });
                // What is part of nothing but the run is a step by itself.
                let through = inner.map(|part| part.path.clone());
                return Some(self.go(through.map_or(Going::Step, Going::Through)));
            }
            Wish::Into => self.into(next),
            Wish::Back(number) => self.back(number, next),
            Wish::Forward => self.forward(next),
            Wish::Why(fluent) => {
                let upto = self.looking.map_or(self.seen.len(), |at| at + 1);
                let (fluent, steps) = (fluent.as_deref(), &self.seen[..upto]);
                self.front.show(&Shown::Why { fluent, steps });
            }
            Wish::Hint => self.hint(),
            Wish::Slow(percent) => {
                if let (Some(dial), Some(percent)) = (&self.setup.dial, percent) {
                    dial.turn(percent);
                }
                let percent = self.setup.dial.as_ref().map(Dial::percent);
                self.front.show(&Shown::Slow { percent });
            }
            Wish::Stops => self.show_stops(None, next),
            Wish::Break(name) => {
                self.show_stops(Some(name), next);
            }
            Wish::Clear(name) => {
                self.setup.stops.clear(name.as_deref());
                self.show_stops(None, next);
            }
            Wish::Help => self.front.show(&Shown::Help),
        }
        None
    }

    fn go(&mut self, going: Going) -> Word {
        self.going = going;
        Word::Go
    }

    fn into(&mut self, next: Option<&Ahead>) {
        let Some(ahead) = next else { return self.present(None) };
        match self.unit(ahead).cloned() {
            Some(task) => {
                self.front.show(&Shown::Inside { task: Some(&task), ahead });
                self.entered.push(task.path);
            }
            None => self.front.show(&Shown::Inside { task: None, ahead }),
        }
    }

    fn back(&mut self, number: Option<usize>, next: Option<&Ahead>) {
        let wanted = match (number, self.looking) {
            (Some(number), _) => self.seen.iter().rposition(|record| record.number == number),
            (None, Some(at)) => at.checked_sub(1),
            // After a step the last one is what is on the screen already.
            (None, None) => self.seen.len().checked_sub(if next.is_some() { 1 } else { 2 }),
        };
        match wanted {
            Some(at) => self.look(at, next),
            None => self.front.show(&Shown::NoStep { of: self.seen.len() }),
        }
    }

    fn forward(&mut self, next: Option<&Ahead>) {
        match self.looking {
            Some(at) if at + 1 < self.seen.len() => self.look(at + 1, next),
            _ => self.present(next),
        }
    }

    fn look(&mut self, at: usize, next: Option<&Ahead>) {
        self.looking = Some(at);
        let next = next.map(|ahead| ahead.number);
        let run_dir = self.run_dir.as_deref();
        let record = &self.seen[at];
        let record = if self.setup.teaches { &without_riddles(record) } else { record };
        self.front.show(&Shown::Looking { record, next, run_dir });
    }

    fn present(&mut self, next: Option<&Ahead>) {
        self.looking = None;
        self.front.show(&Shown::Present { next: next.map(|ahead| ahead.number) });
    }

    /// Shows the breakpoints, after setting a new one that names a step of what is left of the run.
    fn show_stops(&mut self, new: Option<String>, next: Option<&Ahead>) {
        let names = next.map(known).unwrap_or_default();
        let is_known = |name: &String| {
            name.parse::<usize>().is_ok() || names.contains(&name.as_str()) || next.is_none()
        };
        let (mut unknown, mut near) = (None, None);
        match new {
            Some(name) if !is_known(&name) => {
                near = language::nearest(&name, names.into_iter()).map(str::to_owned);
                unknown = Some(name);
            }
            Some(name) => {
                self.setup.stops.set(&name);
            }
            None => {}
        }
        self.front.show(&Shown::Stops { stops: self.setup.stops.all(), unknown, near });
    }

    /// Climbs the ladder: by how much, which way, what to try.
    fn hint(&mut self) {
        if self.puzzle.is_none() {
            let last = self.seen.last();
            let denied = last.and_then(|record| {
                let row = record.fluents.iter().find(
                    |row| matches!((row.expected, row.measured), (Some(a), Some(b)) if a != b),
                )?;
                Some(Puzzle { step: record.number, row: row.clone(), rung: 0 })
            });
            self.puzzle = denied;
        }
        let Some(puzzle) = &mut self.puzzle else { return self.front.show(&Shown::NoHint) };
        puzzle.rung = (puzzle.rung + 1).min(3);
        let upto = self.seen.iter().rposition(|record| record.number == puzzle.step);
        let steps = &self.seen[..upto.map_or(0, |at| at + 1)];
        self.front.show(&Shown::Hint { rung: puzzle.rung, row: &puzzle.row, steps });
    }

    /// Asks the questions of a step blind; returns what was answered. A word of stepping leaves the rest
    /// unasked and is taken up at the next pause.
    fn questions(&mut self, record: &StepRecord) -> Vec<Answered> {
        let run = self.run_dir.as_deref().and_then(Path::file_name);
        let run = run.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let mut answered = Vec::new();
        for row in asked(record) {
            let question = row.ask.as_deref().unwrap_or_default();
            self.front.show(&Shown::Question { question, fluent: &row.name, step: record.number });
            let answer = loop {
                let Some(line) = self.front.ask("y/n/u> ") else { return answered };
                if line.trim().is_empty() {
                    break None;
                }
                if let Some(answer) = Answer::parse(&line) {
                    break Some(answer);
                }
                if let Ok(Wish::Continue | Wish::Quit) = words::parse(&line) {
                    self.carried = Some(line);
                    return answered;
                }
                // Anything else could give the answer away, or carry out a step nobody was shown.
                self.front.show(&Shown::AnswerFirst { line: line.trim() });
            };
            let both = answer.and_then(|said| Answered::new(TRAINEE, &run, record, row, said));
            answered.extend(both);
        }
        answered
    }

    /// Keeps answers, and shows each beside what geometry says.
    fn compare(&mut self, record: &StepRecord, given: &[Answered]) {
        for answered in given {
            if let Some(path) = &self.setup.answers
                && let Err(error) = answers::append(path, answered)
            {
                self.front.show(&Shown::Trouble { path, why: error.to_string() });
            }
            if !answered.agrees() {
                let row = record.fluents.iter().find(|row| row.name == answered.fluent);
                // The margin has been told; the ladder goes on from there.
                self.puzzle =
                    row.map(|row| Puzzle { step: record.number, row: row.clone(), rung: 1 });
            }
            self.front.show(&Shown::Compared { answered });
        }
    }
}

/// Returns the fluents that are asked about after a step: what it was to make true, or false, and what a
/// person is asked.
pub fn asked(record: &StepRecord) -> impl Iterator<Item = &FluentRow> {
    let is_whole = record.outcome != Outcome::Stopped;
    record.fluents.iter().filter(move |row| is_whole && row.ask.is_some() && row.expected.is_some())
}

/// Returns a step without the fluents that people are asked about after other steps: what is not asked yet
/// is not given away.
fn without_riddles(record: &StepRecord) -> StepRecord {
    let mut shown = record.clone();
    shown.fluents.retain(|row| row.ask.is_none() || row.expected.is_some());
    shown
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

    fn after(&mut self, ahead: &Ahead, record: &StepRecord) -> Word {
        let before = self.seen.last().map(|last| last.fluents.clone()).unwrap_or_default();
        let is_stepping = self.going == Going::Step;
        let given = if self.setup.teaches && is_stepping && self.carried.is_none() {
            self.questions(record)
        } else {
            Vec::new()
        };
        if self.setup.teaches {
            let shown = without_riddles(record);
            self.front.show(&Shown::Done { record: &shown, before: &before });
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
