//! What trueup changed in files, so that the last change can be taken back: `:undo-edit`.
//!
//! Whoever changes a file of the user says so here: `:phrase` and `:save` at the prompt, `trueup gap --apply`
//! outside it. The list is kept in a file beside history and phrases, so a change can be taken back later and
//! at another prompt; without a place for one it lasts as long as the prompt. A file that was changed by
//! anyone else since is left alone.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::files::{read, write};
use crate::report::Failure;

/// How many changes are kept.
const MOST: usize = 50;

/// One change.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Edit {
    /// What made it: `:phrase`.
    by: String,
    path: PathBuf,
    /// The text before; `None` when there was no such file.
    before: Option<String>,
    after: String,
}

/// The changes, the oldest first.
#[derive(Debug, Default)]
pub struct Edits {
    /// Where they are kept, if anywhere.
    kept: Option<PathBuf>,
    /// Those that could not be kept.
    unkept: Vec<Edit>,
}

impl Edits {
    /// Keeps changes in a folder, where there is one.
    pub fn new(home: Option<&Path>) -> Self {
        Self { kept: home.map(|home| home.join("edits.jsonl")), unkept: Vec::new() }
    }

    /// Takes note of a change.
    pub fn made(&mut self, by: &str, path: &Path, before: Option<String>, after: &str) {
        // Another prompt may stand in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let edit = Edit { by: by.to_owned(), path, before, after: after.to_owned() };
        let mut all = self.read();
        all.push(edit.clone());
        if !self.write(&all) {
            self.unkept.push(edit);
        }
    }

    /// Takes the last change back; returns what was undone, in words.
    ///
    /// # Errors
    ///
    /// When there is none, or the file was changed since; nothing is written then.
    pub fn undo(&mut self) -> Result<String, Failure> {
        let mut all = self.read();
        let Some(last) = self.unkept.pop().or_else(|| all.pop()) else {
            return Err(Failure::input("repl::undo", "trueup has changed no file")
                .help("`:phrase`, `:save` and `trueup gap --apply` change files"));
        };
        let place = last.path.display().to_string();
        let now = read::text(&last.path).ok();
        if now.as_deref() != Some(last.after.as_str()) {
            // It is not asked about again: what came before it may be undone still.
            self.write(&all);
            let words = format!("{place} was changed since {} wrote it", last.by);
            return Err(Failure::input("repl::undo", words).help("undo it by hand"));
        }
        let done = match &last.before {
            Some(before) => write::replace(&last.path, before),
            None => fs::remove_file(&last.path),
        };
        done.map_err(|error| Failure::unwritten(&last.path, &error))?;
        self.write(&all);
        let name = last.path.file_name().unwrap_or_default().display();
        Ok(match &last.before {
            Some(_) => format!("{name} is as it was before {}", last.by),
            None => format!("{name} is gone again, which {} made", last.by),
        })
    }

    /// Returns those that are kept; a line that is none is passed over.
    fn read(&self) -> Vec<Edit> {
        let text = self.kept.as_ref().and_then(|path| read::text_of(path, read::DATA).ok());
        let text = text.unwrap_or_default();
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// Writes those that are kept; returns whether that could be done.
    fn write(&self, all: &[Edit]) -> bool {
        let Some(path) = &self.kept else { return false };
        let newest = &all[all.len().saturating_sub(MOST)..];
        let lines: Result<String, _> =
            newest.iter().map(|edit| serde_json::to_string(edit).map(|line| line + "\n")).collect();
        lines.is_ok_and(|lines| write::replace(path, lines).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("trueup-edits-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        dir
    }

    #[test]
    fn changes_are_undone_last_first_also_at_another_prompt() {
        let home = folder("order");
        let path = home.join("model.task");
        for kept in [Some(home.as_path()), None] {
            let mut edits = Edits::new(kept);
            fs::write(&path, "one").unwrap();
            edits.made(":save", &path, None, "one");
            fs::write(&path, "two").unwrap();
            edits.made("gap --apply", &path, Some("one".into()), "two");
            if kept.is_some() {
                edits = Edits::new(kept);
            }
            assert_eq!(edits.undo().unwrap(), "model.task is as it was before gap --apply");
            assert_eq!(fs::read_to_string(&path).unwrap(), "one");
            edits.undo().unwrap();
            assert!(!path.exists());
            assert_eq!(edits.undo().unwrap_err().code, "repl::undo");
        }
    }

    #[test]
    fn a_file_that_someone_else_changed_is_left_alone_and_bars_nothing() {
        let home = folder("foreign");
        let (mine, other) = (home.join("mine"), home.join("other"));
        let mut edits = Edits::new(Some(&home));
        fs::write(&other, "b").unwrap();
        edits.made(":save", &other, None, "b");
        fs::write(&mine, "mine").unwrap();
        edits.made(":save", &mine, None, "mine");
        fs::write(&mine, "theirs").unwrap();
        assert!(edits.undo().unwrap_err().message.contains("changed since"));
        assert_eq!(fs::read_to_string(&mine).unwrap(), "theirs");
        edits.undo().unwrap();
        assert!(!other.exists());
    }

    #[test]
    fn the_list_does_not_grow_for_ever() {
        let home = folder("most");
        let mut edits = Edits::new(Some(&home));
        for i in 0..MOST + 5 {
            edits.made(":save", &home.join("f"), None, &i.to_string());
        }
        assert_eq!(edits.read().len(), MOST);
        assert_eq!(edits.read().last().unwrap().after, (MOST + 4).to_string());
    }
}
