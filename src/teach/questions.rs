//! The questions after a step, asked blind; what was answered beside what geometry says; the ladder of hints.

use std::path::Path;

use crate::trace::{FluentRow, Outcome, StepRecord};

use super::answers::{self, Answer, Answered, TRAINEE};
use super::shown::{Front, Shown};
use super::stepper::Stepper;
use super::words::{self, Wish};

/// A fluent that hints are given about.
pub(super) struct Puzzle {
    step: usize,
    row: FluentRow,
    rung: usize,
}

impl<F: Front> Stepper<F> {
    /// Climbs the ladder: by how much, which way, what to try.
    pub(super) fn hint(&mut self) {
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
        let Some(puzzle) = &mut self.puzzle else {
            return self.front.show(&Shown::NoHint { steps: &self.seen });
        };
        puzzle.rung = (puzzle.rung + 1).min(3);
        let upto = self.seen.iter().rposition(|record| record.number == puzzle.step);
        let steps = &self.seen[..upto.map_or(0, |at| at + 1)];
        self.front.show(&Shown::Hint { rung: puzzle.rung, row: &puzzle.row, steps });
    }

    /// Asks the questions of a step blind; returns what was answered. A word of stepping leaves the rest
    /// unasked and is taken up at the next pause.
    pub(super) fn questions(&mut self, record: &StepRecord) -> Vec<Answered> {
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
    pub(super) fn compare(&mut self, record: &StepRecord, given: &[Answered]) {
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
pub(super) fn asked(record: &StepRecord) -> impl Iterator<Item = &FluentRow> {
    let is_whole = record.outcome != Outcome::Stopped;
    record.fluents.iter().filter(move |row| is_whole && row.ask.is_some() && row.expected.is_some())
}

/// Returns a step without the fluents that people are asked about after other steps: what is not asked yet
/// is not given away. And of how many left out twin and measurement both know, which count where they are compared.
pub(super) fn without_riddles(record: &StepRecord) -> (StepRecord, usize) {
    let mut shown = record.clone();
    let riddles = shown.fluents.extract_if(.., |row| row.ask.is_some() && row.expected.is_none());
    let known = riddles.filter(|row| row.twin.is_some() && row.measured.is_some()).count();
    (shown, known)
}
