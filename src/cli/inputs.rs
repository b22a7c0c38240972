//! Files that the arguments name, read with an error that says which and why.

use std::path::Path;

use crate::files;
use crate::language::ast::{Item, Step};
use crate::language::{self, Source};
use crate::report::{self, Failure, Style};

/// Reads a text file, with an error that says which and why.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    files::read::text(path).map_err(|error| Failure::unread(path, &error))
}

/// Reads what a program writes, which may be larger than what a person does.
pub(super) fn data(path: &Path) -> Result<String, Failure> {
    let text = files::read::text_of(path, files::read::DATA);
    text.map_err(|error| Failure::unread(path, &error))
}

/// Returns the steps of a call or of a script.
pub(super) fn steps(source: &Source, is_file: bool, style: Style) -> Result<Vec<Step>, Failure> {
    let (steps, wrong): (Vec<Step>, _) = if is_file {
        let (program, wrong) = language::parse(&source.text);
        let runs = program.items.into_iter().filter_map(|item| match item {
            Item::Run(step) => Some(step),
            _ => None,
        });
        (runs.collect(), wrong)
    } else {
        let (step, wrong) = language::parse_line(&source.text);
        (step.into_iter().collect(), wrong)
    };
    if steps.is_empty() || wrong.iter().any(language::Diagnostic::is_error) {
        return Err(report::text_failure(&wrong, source, style));
    }
    Ok(steps)
}
