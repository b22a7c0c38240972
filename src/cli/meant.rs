//! What somebody means who names a command by what it is called elsewhere.
//!
//! A word that no command has is met with the one that is written most like it: `compare` with `completions`. For some words it is known
//! better.

use clap::Error;
use clap::error::{ContextKind, ContextValue};

/// Words, and the command that does it.
const MEANT: &[(&[&str], &str)] = &[
    (&["compare", "diff"], "runs diff"),
    (&["list", "ls"], "runs ls"),
    (&["show"], "runs show"),
    (&["simulate"], "run"),
    (&["calibrate"], "camera calibrate"),
];

/// Has an error about a command that is none suggest the one that is meant; `first` is the first word of the line.
pub(super) fn suggested(mut error: Error, first: Option<&str>) -> Error {
    let meant = match error.get(ContextKind::InvalidSubcommand) {
        // Below a command its own are meant.
        Some(ContextValue::String(word)) if first == Some(word.as_str()) => {
            MEANT.iter().find(|(words, _)| words.contains(&word.as_str()))
        }
        _ => None,
    };
    if let Some((_, command)) = meant {
        let command = ContextValue::String((*command).to_owned());
        error.insert(ContextKind::SuggestedSubcommand, command);
    }
    error
}
