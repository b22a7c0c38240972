//! Files that the arguments name, read with an error that says which and why.

use std::ffi::OsStr;
use std::path::Path;

use crate::files;
use crate::language::ast::{Item, Step};
use crate::language::{self, Source};
use crate::report::{self, Failure, Style};
use crate::workcell::{self, record};
use crate::world::Scene;

/// Reads a text file, with an error that says which and why.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    files::read::text(path).map_err(|error| Failure::unread(path, &error))
}

/// Reads what a program writes, which may be larger than what a person does.
pub(super) fn data(path: &Path) -> Result<String, Failure> {
    let text = files::read::text_of(path, files::read::DATA);
    text.map_err(|error| Failure::unread(path, &error))
}

/// Reads the rows of the arm that a run kept, without a last one that is there by half.
pub(super) fn arm_rows(path: &Path) -> Result<String, Failure> {
    data(path).map(record::whole_rows)
}

/// Checks that a file may be written as what its name says: what is there is replaced only where its name ends as such files do, so that
/// nothing of a person's is lost, and a new name ends so too. What is there and is no file, `/dev/stdout`, is called what it is.
pub(super) fn spare(path: &Path, endings: &[&str]) -> Result<(), Failure> {
    let is = |own: &OsStr| endings.iter().any(|ending| own.eq_ignore_ascii_case(ending));
    let is_other = path.exists() && !path.is_file();
    if is_other || path.extension().is_some_and(is) {
        return Ok(());
    }
    Err(if path.exists() { Failure::there(path) } else { Failure::ending(path, endings) })
}

/// Returns the scene of a file, or the kitchen when none is named.
pub(super) fn scene(file: Option<&Path>, style: Style) -> Result<Scene, Failure> {
    let mut library = workcell::library(&workcell::Stdlib::embedded());
    let file = match file {
        None => None,
        Some(path) => {
            let source = Source::new(path.display().to_string(), read(path)?);
            let (_, diagnostics) = language::parse(&source.text);
            if diagnostics.iter().any(language::Diagnostic::is_error) {
                return Err(report::text_failure(&diagnostics, &source, style));
            }
            Some(library.add(source))
        }
    };
    workcell::scene_of(&library, file).map_err(|error| report::cell_failure(&error, style))
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
