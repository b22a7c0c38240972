//! Which of what `trueup gap` is given can serve: runs by their numbers, folders of runs, and what is passed over.
//!
//! No recording is read here but to see whether it has rows.

use std::fs::{self, File};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use crate::report::{Failure, kept};
use crate::workcell::archive;

use super::bags;

/// What lies in a folder of runs, or beside a recording, and is none: answers, priors, sidecars, pages.
const NO_RECORDING: [&str; 9] =
    ["jsonl", "json", "task", "html", "toml", "svg", "md", "yaml", "yml"];

/// What can be looked at, and what is said of the rest.
pub(super) struct Given {
    pub(super) paths: Vec<PathBuf>,
    pub(super) notes: Vec<String>,
}

/// Finds what is meant: a number or a name is a run of the folder `root`, a folder that is no run is the runs in it. Of several
/// what cannot serve is passed over, with a note, and what is given twice is used once.
pub(super) fn given(wanted: &[PathBuf], root: &Path) -> Result<Given, Failure> {
    let mut paths = Vec::new();
    for path in wanted {
        paths.extend(meant(path, root)?);
    }
    let (paths, mut notes) = once(&paths);
    let mut aside = Aside::default();
    let mut kept = Vec::new();
    let is_alone = paths.len() == 1;
    for path in paths {
        // What is wrong with a file that is given alone is said by whoever reads it.
        match useless(&path).filter(|_| !is_alone || path.is_dir()) {
            Some(why) => aside.add(&path, why),
            None => kept.push(path),
        }
    }
    notes.extend(aside.notes());
    if !kept.is_empty() {
        return Ok(Given { paths: kept, notes });
    }
    let at = wanted.first().map_or_else(String::new, |path| path.display().to_string());
    Err(nothing().at(at).help(notes.join("; ")))
}

/// Leaves one of each that is given several times, by the same name or by others, and says so. The last one is left, for what comes
/// last is held out.
fn once(paths: &[PathBuf]) -> (Vec<PathBuf>, Vec<String>) {
    let place = |path: &PathBuf| fs::canonicalize(path).unwrap_or_else(|_| path.clone());
    let places: Vec<PathBuf> = paths.iter().map(place).collect();
    let (mut kept, mut notes) = (Vec::new(), Vec::new());
    for (at, path) in paths.iter().enumerate() {
        let Some(last) = places[at + 1..].iter().rposition(|place| *place == places[at]) else {
            kept.push(path.clone());
            continue;
        };
        let [this, last] = [path, &paths[at + 1 + last]].map(|path| path.display().to_string());
        let note = if this == last {
            format!("{this} is given more than once, and is used once")
        } else {
            format!("{this} is {last} by another name, and is used once")
        };
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    (kept, notes)
}

/// Nothing is left to look at.
pub(super) fn nothing() -> Failure {
    Failure::input("gap::nothing", "nothing of what is given can be looked at")
}

/// Returns what a word on the line means: a path, or runs.
fn meant(path: &Path, root: &Path) -> Result<Vec<PathBuf>, Failure> {
    let folders = |of: &Path| archive::entries(of).into_iter().map(|entry| entry.dir).collect();
    if path.is_dir() {
        let is_one = ["run.json", "arm.csv"].iter().any(|file| path.join(file).is_file());
        let runs: Vec<PathBuf> = if is_one { Vec::new() } else { folders(path) };
        return Ok(if runs.is_empty() { vec![path.to_owned()] } else { runs });
    }
    let word = path.to_string_lossy();
    let is_run = || {
        word.parse::<usize>().is_ok() || archive::entries(root).iter().any(|run| run.name == word)
    };
    if path.exists() || !is_run() {
        return Ok(vec![path.to_owned()]);
    }
    kept::entry(root, &word).map(|entry| vec![entry.dir])
}

/// Says why nothing can be found in a file or a folder; `None` if it can, or if reading it says more.
fn useless(path: &Path) -> Option<&'static str> {
    let is_dir = path.is_dir();
    let file = if is_dir { path.join("arm.csv") } else { path.to_owned() };
    if !is_dir && path.extension().is_some_and(|ending| NO_RECORDING.iter().any(|no| ending == *no))
    {
        return Some("no recording");
    }
    if is_dir && !file.exists() {
        let why = bags::is_nearly(path).unwrap_or("no run, no ROS 2 bag, and no folder of runs");
        return (!bags::is_bag(path)).then_some(why);
    }
    let is_of_a_run = file.file_name().is_some_and(|name| name == "arm.csv")
        && file.with_file_name("run.json").is_file();
    let file = is_of_a_run.then(|| File::open(&file))?.ok()?;
    let rows = BufReader::new(file).lines().take(2).count();
    (rows < 2).then_some("the run ended before the arm moved")
}

/// What is passed over, by the reason for it.
#[derive(Debug, Default)]
pub(super) struct Aside(Vec<(String, Vec<String>)>);

impl Aside {
    /// Passes over a path.
    pub(super) fn add(&mut self, path: &Path, why: impl Into<String>) {
        let (name, why) = (path.display().to_string(), why.into());
        match self.0.iter_mut().find(|(other, _)| *other == why) {
            Some((_, names)) => names.push(name),
            None => self.0.push((why, vec![name])),
        }
    }

    /// Whether a path is passed over.
    pub(super) fn has(&self, path: &Path) -> bool {
        let name = path.display().to_string();
        self.0.iter().any(|(_, names)| names.contains(&name))
    }

    /// Says so, in a line for each reason.
    pub(super) fn notes(&self) -> Vec<String> {
        let line = |(why, names): &(String, Vec<String>)| {
            let are = if names.len() == 1 { "is" } else { "are" };
            format!("{} {are} left out: {why}", names.join(", "))
        };
        self.0.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn runs_are_found_by_number_and_folder_and_what_is_none_is_passed_over() {
        let root = tempfile::tempdir().unwrap();
        for (name, rows) in [("1-pick", "t[s]\n0\n1\n"), ("2-pour", ""), ("3-pour", "t[s]\n0\n")] {
            let dir = root.path().join(name);
            fs::create_dir(&dir).unwrap();
            fs::write(dir.join("run.json"), "{}").unwrap();
            fs::write(dir.join("arm.csv"), rows).unwrap();
        }
        fs::write(root.path().join("answers.jsonl"), "{}\n").unwrap();
        let names = |wanted: &[PathBuf]| -> Result<_, String> {
            let given = given(wanted, root.path()).map_err(|failure| failure.code)?;
            let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
            Ok((given.paths.iter().map(name).collect::<Vec<_>>(), given.notes.len()))
        };
        let both = (vec!["1-pick".to_owned(), "3-pour".to_owned()], 1);
        assert_eq!(names(&[root.path().to_owned()]), Ok(both.clone()));
        assert_eq!(names(&["1".into(), "3-pour".into()]), Ok((both.0.clone(), 0)));
        let all =
            ["1-pick", "2-pour", "3-pour", "answers.jsonl"].map(|name| root.path().join(name));
        assert_eq!(names(&all), Ok((both.0, 2)));
        // A run that was given twice counted twice in the fit.
        let again = root.path().join("3-pour").join("..").join("1-pick");
        let twice = ["1-pick".into(), "3-pour".into(), "1".into(), again];
        assert_eq!(names(&twice), Ok((vec!["3-pour".into(), "1-pick".into()], 1)));
        assert_eq!(names(&["1".into(), "1".into()]), Ok((vec!["1-pick".into()], 1)));
        assert_eq!(names(&["2".into()]).unwrap_err(), "gap::nothing");
        // The folder that `ros2 bag record` writes was no run, and no folder of runs.
        let bag = root.path().join("walk");
        fs::create_dir(&bag).unwrap();
        fs::write(bag.join("walk_0.mcap"), "").unwrap();
        assert_eq!(names(std::slice::from_ref(&bag)).unwrap_err(), "gap::nothing");
        fs::write(bag.join("metadata.yaml"), "").unwrap();
        assert_eq!(names(std::slice::from_ref(&bag)), Ok((vec!["walk".into()], 0)));
        assert_eq!(names(&["7".into()]).unwrap_err(), "run::unknown");
    }
}
