//! Runs that are kept in a folder, as both doors ask for them: by number, by name, and as a list.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::workcell::Run;
use crate::workcell::archive::{self, Entry};

use super::record::{ended, list as listed};
use super::{Failure, Style, cell_failure};

/// Returns the run of that number or folder name.
///
/// # Errors
///
/// When there is none, with the numbers there are.
pub fn entry(root: &Path, wanted: &str) -> Result<Entry, Failure> {
    check(root)?;
    let entries = archive::entries(root);
    let found = entries.iter().find(|e| wanted.parse() == Ok(e.number) || e.name == wanted);
    found.cloned().ok_or_else(|| {
        let failure = Failure::input("run::unknown", format!("there is no run `{wanted}`"));
        match entries.len() {
            0 => failure.help("nothing has run yet"),
            1 => failure.help("there is one, number 1"),
            n => failure.help(format!("runs are numbered 1 to {n}; `trueup runs` lists them")),
        }
    })
}

/// Returns the folder of a run: the one that is named, or that of the number or name in `root`.
///
/// # Errors
///
/// As [`entry`].
pub fn folder(root: &Path, wanted: &Path) -> Result<PathBuf, Failure> {
    if wanted.is_dir() {
        return Ok(wanted.to_path_buf());
    }
    Ok(entry(root, &wanted.display().to_string())?.dir)
}

/// Reads a run.
///
/// # Errors
///
/// When its document is not there or not a run.
pub fn load(entry: &Entry, style: Style) -> Result<Run, Failure> {
    entry.load().map_err(|error| cell_failure(&error, style))
}

/// A list of runs, for people and for programs.
pub struct List {
    /// A line each.
    pub words: String,
    /// `{"runs": […]}`.
    pub document: Value,
}

/// Looks whether the runs of a folder can be listed; one that is not there has none.
///
/// # Errors
///
/// What the system says of a folder that cannot be read.
pub fn check(root: &Path) -> Result<(), Failure> {
    match std::fs::read_dir(root) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::unread(root, &error))
        }
        _ => Ok(()),
    }
}

/// Lists the runs of a folder, the oldest first; of many the last `most`.
pub fn list(root: &Path, most: Option<usize>) -> List {
    let entries = archive::entries(root);
    let first = entries.len().saturating_sub(most.unwrap_or(entries.len()));
    let runs: Vec<_> =
        entries.into_iter().skip(first).map(|entry| (entry.clone(), entry.load().ok())).collect();
    let each = runs.iter().map(|(entry, run)| {
        let run = run.as_ref();
        json!({
            "number": entry.number,
            "folder": entry.dir.display().to_string(),
            "task": run.map(|run| &run.task),
            "ended": run.map(|run| ended(archive::standing(&entry.dir, run))),
            "steps": run.map(|run| run.agreeing().0),
            "twin_agrees_after": run.map(|run| run.agreeing().1),
        })
    });
    let document = json!({ "runs": each.collect::<Vec<_>>() });
    let words = match runs.as_slice() {
        [] => format!("no run is kept in {} yet", root.display()),
        runs => listed(runs),
    };
    List { words, document }
}
