//! The lines of a script that act, and who may hold the arm before one. What each does is worded in `wording`.
//!
//! Every binding that moves the arm, its fingers, or looks is a natural place to stop: between two of them
//! nothing moves. So it is the bindings that ask, with the line that calls them, and no debugger of the script
//! engine is needed, which would stop at every expression and slow each of them down.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex};

use crate::trace::{Deed, Line};
use crate::world::WorldState;

use super::conduct::Word;

/// How many lines are kept of one step: a loop may act many times.
pub const MOST: usize = 200;

/// Is asked before a line, the arm holding still, with the world as far as it is known; may block.
pub type Gate = Arc<Mutex<dyn FnMut(&Line, &WorldState) -> Word + Send>>;

/// A script that runs, and the lines of it that acted so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Running {
    file: String,
    text: String,
    since: f64,
    lines: Vec<Line>,
    /// How many acted, kept or not.
    count: usize,
    /// How many plans it asked for, and how many notes it left.
    plans: usize,
    notes: usize,
}

impl Running {
    /// Begins a script at arm time `since`, s.
    pub(super) fn new(file: &str, text: &str, since: f64) -> Self {
        Self { file: file.to_owned(), text: text.to_owned(), since, ..Self::default() }
    }

    /// Takes note of a line that acts at arm time `now`, s.
    pub(super) fn acts(&mut self, line: usize, does: String, deed: Option<Deed>, now: f64) -> Line {
        let written = line.checked_sub(1).and_then(|at| self.text.lines().nth(at));
        let line = Line {
            script: self.file.clone(),
            line,
            text: written.unwrap_or_default().trim().to_owned(),
            does,
            at_s: now - self.since,
            deed,
        };
        self.count += 1;
        if self.lines.len() < MOST {
            self.lines.push(line.clone());
        }
        line
    }

    /// Returns how many lines acted, kept or not.
    pub(super) fn acted(&self) -> usize {
        self.count
    }

    /// Counts a plan that is asked for; returns how many were.
    pub(super) fn plans(&mut self) -> usize {
        self.plans += 1;
        self.plans
    }

    /// Counts a note; returns how many were left.
    pub(super) fn notes(&mut self) -> usize {
        self.notes += 1;
        self.notes
    }

    /// Takes note of what the last line that acted found out.
    pub(super) fn found(&mut self, what: &str) {
        // Of more than are kept the last is none of these.
        if let Some(line) = self.lines.last_mut().filter(|_| self.count <= MOST) {
            let _ = write!(line.does, ": {what}");
        }
    }

    /// Returns the lines that acted, at most [`MOST`].
    pub(super) fn lines(self) -> Vec<Line> {
        self.lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_kept_up_to_a_number_of_lines() {
        let mut running = Running::new("a.rhai", "// wait\n  arm.wait(1.0);\n", 2.0);
        let line = running.acts(2, "hold still".into(), None, 2.5);
        assert_eq!((line.place().as_str(), line.text.as_str()), ("a.rhai:2", "arm.wait(1.0);"));
        assert!((line.at_s - 0.5).abs() < 1e-12);
        for _ in 0..2 * MOST {
            running.acts(9, String::new(), None, 3.0);
        }
        assert_eq!(running.lines().len(), MOST);
    }
}
