//! Columns over time.

use super::Sidecar;
use super::error::{Error, Flaw};
use crate::units::Unit;

/// Most values of a recording, rows times columns. All of them are held, as numbers, more than once.
pub(super) const MOST_VALUES: usize = 25_000_000;

/// The latest time, s before or after the origin of a clock: three thousand years. Beyond, nothing finer than a
/// few microseconds can be told apart.
pub(super) const LATEST: f64 = 1e11;

/// The finest usual step of a clock, s.
pub(super) const FINEST: f64 = 1e-9;

/// Says that a recording holds more than is read.
pub(super) fn too_much(name: &str, values: usize) -> Error {
    Flaw::TooMuch { values, most: MOST_VALUES }.at(name)
}

/// A cell that is not a finite number.
#[derive(Debug, Clone, PartialEq)]
pub struct BadCell {
    /// Line of the file, from 1.
    pub line: usize,
    /// As written.
    pub text: String,
}

/// One column of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name, after renaming.
    pub name: String,
    /// Its unit, as the header or the map gave it; `None` when neither did.
    pub unit: Option<Unit>,
    /// Its values in SI, one per row; NaN where a cell is bad.
    pub values: Vec<f64>,
    /// The first of the cells that are not finite numbers, in the file's order.
    pub bad: Vec<BadCell>,
    /// How many such cells there are.
    pub n_bad: usize,
    /// Whether others of its file bear its name: which of them is meant nobody can say.
    pub is_one_of_several: bool,
}

/// What loggers write where there is no number.
const BLANKS: [&str; 7] = ["", "nan", "na", "n/a", "null", "none", "-"];

/// Fewer numbers say nothing of their noise.
const LEAST_NUMBERS: usize = 10;

impl Column {
    /// Returns whether nothing is written in any of its cells, as far as they are kept.
    pub(super) fn is_blank(&self) -> bool {
        !self.values.is_empty() && self.n_bad == self.values.len() && self.has_only_blanks()
    }

    /// Returns whether the cells that are no numbers are blank, as far as they are kept.
    fn has_only_blanks(&self) -> bool {
        self.bad.iter().all(|cell| {
            let text = cell.text.trim();
            BLANKS.iter().any(|blank| text.eq_ignore_ascii_case(blank))
        })
    }

    /// Returns whether every cell is a number or blank, as far as the cells are kept, and there are enough numbers.
    pub(super) fn has_numbers_or_blanks(&self) -> bool {
        let numbers = self.values.iter().filter(|value| value.is_finite()).count();
        numbers >= LEAST_NUMBERS && self.has_only_blanks()
    }
}

/// A stretch of time with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Its name.
    pub name: String,
    /// Its begin, s.
    pub from: f64,
    /// Its end, s.
    pub to: f64,
}

/// Measured data over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The file's name, for messages.
    pub name: String,
    /// When each row was taken, s; strictly increasing.
    pub time: Vec<f64>,
    /// The line of each row in its file; empty where it came from none with lines.
    pub lines: Vec<usize>,
    /// Every column but time, in the file's order.
    pub columns: Vec<Column>,
    /// What is known of the machine.
    pub sidecar: Sidecar,
    /// What was assumed or left out, one sentence each.
    pub notes: Vec<String>,
}
