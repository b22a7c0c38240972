//! The folder where runs are kept: which there are, by age, and what each was.
//!
//! Runs are numbered from 1, the oldest first: their folders are named by the time they were made. Nothing
//! here writes.

use std::fs;
use std::path::{Path, PathBuf};

use crate::files::read::{DATA, text_of};
use crate::monitor::questionnaire;
use crate::trace::{Deed, Event, Line, StepRecord};

use super::error::NoRun;
use super::record::{EVENTS, is_going_on};
use super::{Ending, Error, Run, State, wording};

/// How many earlier runs are looked at.
const MOST_EARLIER: usize = 20;

/// One run folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its place among all, from 1.
    pub number: usize,
    /// The name of its folder.
    pub name: String,
    /// Its folder.
    pub dir: PathBuf,
}

impl Entry {
    /// Reads the run.
    ///
    /// # Errors
    ///
    /// [`Error::Record`] when the document is not there or not a run.
    pub fn load(&self) -> Result<Run, Error> {
        load(&self.dir)
    }
}

/// Reads the run in a folder. Of one that was cut off between a step and its document the step is taken from
/// its events.
///
/// # Errors
///
/// [`Error::Record`] when the document is not there or not a run.
pub fn load(dir: &Path) -> Result<Run, Error> {
    let path = dir.join("run.json");
    let wrong = |why: NoRun| Error::Record { path: path.clone(), why };
    let text = text_of(&path, DATA).map_err(|error| wrong(error.into()))?;
    let mut run: Run = serde_json::from_str(&text).map_err(|error| wrong(error.into()))?;
    if run.state == State::Running {
        for step in steps_told(dir).into_iter().skip(run.steps.len()) {
            run.questions.resize(run.steps.len(), Vec::new());
            run.questions.push(questionnaire::by_geometry(&step.fluents));
            run.steps.push(step);
        }
        run.reason = run.reason.or_else(|| why_unrecorded(dir));
    }
    if run.aims.is_none() {
        run.steps.iter_mut().for_each(with_deeds);
    }
    Ok(run)
}

/// Adds to a step of an older program, which kept no deeds, what the action of the standard library did that it
/// names.
fn with_deeds(step: &mut StepRecord) {
    let Some((name, args)) = step.action.trim_end_matches(')').split_once('(') else { return };
    let mut args = args.split(',').map(|arg| arg.trim().to_owned());
    let mut next = || args.next().unwrap_or_default();
    let deed = match name {
        "grasp" => Deed::Took { object: next() },
        "tilt" => Deed::Turned { source: next(), target: next() },
        "lower" => Deed::SetDown { object: next() },
        _ => return,
    };
    if let Some(line) = step.lines.first_mut() {
        line.deed = Some(deed);
        return;
    }
    let script = format!("{name}.rhai");
    let line = Line {
        script,
        line: 0,
        text: String::new(),
        does: String::new(),
        at_s: 0.0,
        deed: Some(deed),
    };
    step.lines.push(line);
}

/// Returns the steps whose end the events of a run tell; a line that was cut short tells nothing.
fn steps_told(dir: &Path) -> Vec<StepRecord> {
    let text = text_of(&dir.join(EVENTS), DATA).unwrap_or_default();
    let events = text.lines().filter_map(|line| serde_json::from_str(line).ok());
    let ends = events.filter_map(|event| match event {
        Event::StepEnd { record } => Some(*record),
        _ => None,
    });
    ends.collect()
}

/// Returns why a run was recorded no further, where the last of its events says so.
fn why_unrecorded(dir: &Path) -> Option<String> {
    let text = text_of(&dir.join(EVENTS), DATA).ok()?;
    match serde_json::from_str(text.lines().next_back()?).ok()? {
        Event::Note { text, .. } if wording::is_unrecorded(&text) => Some(text),
        _ => None,
    }
}

/// How a run that is kept stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// It goes on, in a program that runs now.
    Running,
    /// Its program ended, or could write no more, before it did.
    CutOff,
    /// It is over.
    Ended(Ending),
}

/// Returns how the run in a folder stands.
pub fn standing(dir: &Path, run: &Run) -> Standing {
    match run.state {
        State::Ended => Standing::Ended(run.outcome),
        State::Running if is_going_on(dir) => Standing::Running,
        State::Running => Standing::CutOff,
    }
}

/// Returns the runs in a folder, the oldest first; none when there is no such folder.
pub fn entries(root: &Path) -> Vec<Entry> {
    let Ok(found) = fs::read_dir(root) else { return Vec::new() };
    let folders = found.filter_map(|entry| {
        let dir = entry.ok()?.path();
        let name = dir.file_name()?.to_str()?.to_owned();
        dir.join("run.json").is_file().then_some((name, dir))
    });
    let mut folders: Vec<(String, PathBuf)> = folders.collect();
    folders.sort();
    let numbered = folders.into_iter().enumerate();
    numbered.map(|(i, (name, dir))| Entry { number: i + 1, name, dir }).collect()
}

/// Returns the run folders among paths, and those in the other folders among them, by path.
///
/// # Errors
///
/// The path that cannot be read, and what the file system says of it.
pub fn folders(paths: &[PathBuf]) -> Result<Vec<PathBuf>, (PathBuf, std::io::Error)> {
    let is_run = |path: &PathBuf| path.join("run.json").is_file();
    let mut found = Vec::new();
    for path in paths {
        if is_run(path) {
            found.push(path.clone());
            continue;
        }
        let inside = fs::read_dir(path).map_err(|error| (path.clone(), error))?;
        found.extend(inside.flatten().map(|entry| entry.path()).filter(is_run));
    }
    found.sort();
    found.dedup();
    Ok(found)
}

/// Returns the last runs of the same task before run `number`, or among all when it has none, with their
/// numbers, the oldest first.
pub fn earlier(run: &Run, number: Option<usize>, entries: &[Entry]) -> Vec<(usize, Run)> {
    let head = |task: &str| task.split('(').next().unwrap_or_default().to_owned();
    let before = entries.iter().filter(|entry| number.is_none_or(|n| entry.number < n));
    let mut found: Vec<(usize, Run)> = before
        .rev()
        .filter_map(|entry| Some((entry.number, entry.load().ok()?)))
        .filter(|(_, earlier)| head(&earlier.task) == head(&run.task))
        .take(MOST_EARLIER)
        .collect();
    found.reverse();
    found
}
