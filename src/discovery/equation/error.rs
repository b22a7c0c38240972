//! Why a model gives no answer.

use super::super::recording;
use crate::language::Diagnostic;
use crate::language::ast::Span;

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The model's text has mistakes.
    #[error("the model has mistakes")]
    Model {
        /// All of them.
        diagnostics: Vec<Diagnostic>,
    },
    /// There is no such model in the text.
    #[error("there is no `model` block{}", if .name.is_empty() { String::new() } else { format!(" `{}`", .name) })]
    NoModel {
        /// The one asked for; empty for any.
        name: String,
    },
    /// A recording does not fit the model.
    #[error(transparent)]
    Recording(#[from] recording::Error),
    /// The model's states grow without bound, or are not numbers.
    #[error("the model blows up: `{what}` is no longer a finite number at t = {t} s")]
    BlowUp {
        /// Which state or output.
        what: String,
        /// When, s.
        t: f64,
    },
    /// Too few rows.
    #[error("{rows} rows are too few to fit a model and to judge it")]
    TooShort {
        /// How many there are.
        rows: usize,
    },
}

/// Why a model that was checked cannot be run all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Unrunnable {
    /// It needs more registers than there are.
    #[error("this model is too large to run")]
    TooLarge,
    /// The checker let a formula pass that is none.
    #[error("this cannot be computed")]
    NotComputable,
}

impl Unrunnable {
    /// Returns the diagnostic for what stands at `span`.
    pub(super) fn at(self, span: Span) -> Box<Diagnostic> {
        let (code, label) = match self {
            Self::TooLarge => ("task::depth", "too many operations"),
            Self::NotComputable => ("task::formula", "not a formula"),
        };
        Box::new(Diagnostic::error(code, span, self.to_string(), label).help(self.help()))
    }

    /// Returns what would help.
    fn help(self) -> &'static str {
        match self {
            Self::TooLarge => "split it into smaller models",
            Self::NotComputable => "formulas are of numbers, names, + - * / ^ and functions",
        }
    }
}
