//! What trueup changed in files, so that the last change can be taken back: `:undo-edit`, and made again: `:redo-edit`.
//!
//! Whoever changes a file of the user says so here: `:phrase` and `:save` at the prompt, `trueup gap --apply`
//! outside it. The list is kept in a file beside history and phrases, so a change can be taken back later and
//! at another prompt of the same folder; without a place for one it lasts as long as the prompt. The list is one for
//! all folders, but each prompt takes back only what lies in its folder or was made from there. A file that was
//! changed by anyone else since is left alone, and what was taken back stays in the list.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::ErrorKind;
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
    /// The folder it was made from, if known.
    #[serde(default)]
    from: Option<PathBuf>,
    /// The text before; `None` when there was no such file.
    before: Option<String>,
    after: String,
    #[serde(default)]
    standing: Standing,
    /// Whether it is only in memory as yet.
    #[serde(skip)]
    is_unkept: bool,
}

/// How a change stands.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Standing {
    #[default]
    Made,
    Undone,
    /// Someone else changed the file: it is neither taken back nor made again.
    Overtaken,
}

impl Standing {
    /// The command that a change which stands so is for.
    fn command(self) -> &'static str {
        if self == Self::Undone { "`:redo-edit`" } else { "`:undo-edit`" }
    }
}

impl Edit {
    /// Whether a prompt in a folder may turn it: the file is in the folder, or was changed from there.
    fn is_of(&self, folder: Option<&Path>) -> bool {
        folder.is_some_and(|folder| {
            self.from.as_deref() == Some(folder) || real(&self.path).starts_with(folder)
        })
    }

    /// The folder at whose prompt it can be turned.
    fn folder(&self) -> &Path {
        let from = self.from.as_deref().filter(|from| from.is_dir());
        from.or_else(|| self.path.parent()).unwrap_or(&self.path)
    }
}

/// The changes, the oldest first.
#[derive(Debug, Default)]
pub struct Edits {
    /// Where they are kept, if anywhere.
    kept: Option<PathBuf>,
    /// The folder whose changes can be taken back; none where it is not known.
    folder: Option<PathBuf>,
    /// Those that could not be kept.
    unkept: Vec<Edit>,
}

impl Edits {
    /// Keeps changes in a folder, where there is one.
    pub fn new(home: Option<&Path>) -> Self {
        Self::in_folder(home, std::env::current_dir().ok())
    }

    /// As [`Self::new`], for a prompt in a folder.
    fn in_folder(home: Option<&Path>, folder: Option<PathBuf>) -> Self {
        let kept = home.map(|home| home.join("edits.jsonl"));
        Self { kept, folder: folder.map(|folder| real(&folder)), unkept: Vec::new() }
    }

    /// Takes note of a change.
    pub fn made(&mut self, by: &str, path: &Path, before: Option<String>, after: &str) {
        let edit = Edit {
            by: by.to_owned(),
            path: real(path),
            from: self.folder.clone(),
            before,
            after: after.to_owned(),
            standing: Standing::Made,
            is_unkept: true,
        };
        let _locked = self.lock();
        let mut all = self.all();
        all.push(edit);
        self.keep(all);
    }

    /// Takes the last change of this folder back; returns what was undone, in words.
    ///
    /// # Errors
    ///
    /// When there is none, or the file was changed since; no file is written then.
    pub fn undo(&mut self) -> Result<String, Failure> {
        self.turn(Standing::Made)
    }

    /// Makes again what was last taken back in this folder; returns what was done, in words.
    ///
    /// # Errors
    ///
    /// As [`Self::undo`].
    pub fn redo(&mut self) -> Result<String, Failure> {
        self.turn(Standing::Undone)
    }

    /// Turns the last change that stands so.
    fn turn(&mut self, standing: Standing) -> Result<String, Failure> {
        let _locked = self.lock();
        let mut all = self.all();
        let folder = self.folder.as_deref();
        let is_meant = |edit: &Edit| edit.standing == standing && edit.is_of(folder);
        let Some(at) = all.iter().rposition(is_meant) else {
            return Err(nothing(&all, standing));
        };
        let later = all[at + 1..].iter().rev().find(|edit| edit.standing == standing).cloned();
        // What is turned becomes the last one, so that it is also the first to be turned again.
        let mut edit = all.remove(at);
        let (now, then) = match standing {
            Standing::Undone => (edit.before.as_deref(), Some(edit.after.as_str())),
            _ => (Some(edit.after.as_str()), edit.before.as_deref()),
        };
        let place = self.place(&edit.path);
        if !holds(&edit.path, now) {
            let failure = self.overtaken(&edit, &place);
            // It is not asked about again: what came before it may be undone still.
            edit.standing = Standing::Overtaken;
            all.insert(at, edit);
            self.keep(all);
            return Err(failure);
        }
        let done = match then {
            Some(text) => write::replace(&edit.path, text),
            None => fs::remove_file(&edit.path),
        };
        done.map_err(|error| Failure::unwritten(&edit.path, &error))?;
        let by = &edit.by;
        let mut words = match (standing, then) {
            (Standing::Undone, _) => format!("{place} is again as {by} left it"),
            (_, Some(_)) => {
                format!("{place} is as it was before {by}; `:redo-edit` makes the change again")
            }
            (_, None) => {
                format!("{place} is gone again, which {by} made; `:redo-edit` brings it back")
            }
        };
        if let Some(later) = later {
            let _ = write!(
                words,
                " ({}, which {} changed later, is not of this folder: {} in {})",
                later.path.display(),
                later.by,
                standing.command(),
                later.folder().display()
            );
        }
        edit.standing = match standing {
            Standing::Undone => Standing::Made,
            _ => Standing::Undone,
        };
        all.push(edit);
        self.keep(all);
        Ok(words)
    }

    /// A change that someone else made another one after.
    fn overtaken(&self, edit: &Edit, place: &str) -> Failure {
        let words = match edit.standing {
            Standing::Undone => format!("{place} was changed since {} was taken back", edit.by),
            _ => format!("{place} was changed since {} wrote it", edit.by),
        };
        let help = match &self.kept {
            Some(kept) => format!("change it by hand; its earlier texts are in {}", kept.display()),
            None => "change it by hand".to_owned(),
        };
        Failure::input("repl::undo", words).help(help)
    }

    /// Returns how a file is told: from the folder of the prompt on, or whole.
    fn place(&self, path: &Path) -> String {
        let inside = self.folder.as_deref().and_then(|folder| path.strip_prefix(folder).ok());
        inside.unwrap_or(path).display().to_string()
    }

    /// Holds the list against other prompts until the result is dropped. Where the system has no such locks, the list
    /// is still written whole or not at all.
    fn lock(&self) -> Option<File> {
        // The list itself is exchanged for another file whenever it is written, so its folder is locked.
        let folder = File::open(self.kept.as_ref()?.parent()?).ok()?;
        folder.lock().ok()?;
        Some(folder)
    }

    /// Returns all changes; a line that is none is passed over.
    fn all(&self) -> Vec<Edit> {
        let text = self.kept.as_ref().and_then(|path| read::text_of(path, read::DATA).ok());
        let text = text.unwrap_or_default();
        let kept = text.lines().filter_map(|line| serde_json::from_str::<Edit>(line).ok());
        kept.chain(self.unkept.iter().cloned()).collect()
    }

    /// Keeps the newest changes: in the file, and what cannot be written there in memory.
    fn keep(&mut self, mut all: Vec<Edit>) {
        if self.write(&all) {
            self.unkept.clear();
        } else {
            all.retain(|edit| edit.is_unkept);
            self.unkept = all;
        }
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

/// No change of this folder stands so; the last one of another may.
fn nothing(all: &[Edit], standing: Standing) -> Failure {
    let Some(other) = all.iter().rev().find(|edit| edit.standing == standing) else {
        let (words, help) = match standing {
            Standing::Undone => {
                ("no change to a file was taken back", "`:undo-edit` takes one back")
            }
            _ => (
                "trueup has changed no file",
                "`:phrase`, `:save` and `trueup gap --apply` change files",
            ),
        };
        return Failure::input("repl::undo", words).help(help);
    };
    let done = if standing == Standing::Undone { "taken back" } else { "made" };
    let (by, path, folder) = (&other.by, other.path.display(), other.folder().display());
    let words = format!(
        "nothing was {done} in this folder; the last change, of {by} to {path}, was in another folder"
    );
    let command = standing.command();
    Failure::input("repl::undo", words)
        .help(format!("start trueup in {folder}, and {command} there"))
}

/// Whether a file holds a text; `None`: whether nothing has its name.
fn holds(path: &Path, text: Option<&str>) -> bool {
    match text {
        Some(text) => read::text(path).is_ok_and(|now| now == text),
        None => fs::symlink_metadata(path).is_err_and(|error| error.kind() == ErrorKind::NotFound),
    }
}

/// Returns a path without links and `..`, also of a file that is not there.
fn real(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let there = fs::canonicalize(&path).ok();
    let gone = || Some(fs::canonicalize(path.parent()?).ok()?.join(path.file_name()?));
    there.or_else(gone).unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a folder that is removed with what it is returned with, and its path.
    fn folder() -> (tempfile::TempDir, PathBuf) {
        let kept = tempfile::tempdir().unwrap();
        let path = kept.path().to_path_buf();
        (kept, path)
    }

    #[test]
    fn changes_are_undone_last_first_also_at_another_prompt() {
        let (_kept, home) = folder();
        let path = home.join("model.task");
        for kept in [Some(home.as_path()), None] {
            let prompt = || Edits::in_folder(kept, Some(home.clone()));
            let mut edits = prompt();
            fs::write(&path, "one").unwrap();
            edits.made(":save", &path, None, "one");
            fs::write(&path, "two").unwrap();
            edits.made("gap --apply", &path, Some("one".into()), "two");
            if kept.is_some() {
                edits = prompt();
            }
            let told = edits.undo().unwrap();
            assert!(told.starts_with("model.task is as it was before gap --apply;"), "{told}");
            assert_eq!(fs::read_to_string(&path).unwrap(), "one");
            edits.undo().unwrap();
            assert!(!path.exists());
            assert_eq!(edits.undo().unwrap_err().code, "repl::undo");
            // Nothing is lost: both are made again, in their order.
            edits.redo().unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), "one");
            assert_eq!(edits.redo().unwrap(), "model.task is again as gap --apply left it");
            assert_eq!(fs::read_to_string(&path).unwrap(), "two");
            assert_eq!(edits.redo().unwrap_err().code, "repl::undo");
            edits.undo().unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), "one");
            // What nobody may read as a text is no missing file either.
            edits.undo().unwrap();
            fs::write(&path, [0xff]).unwrap();
            assert!(edits.redo().unwrap_err().message.contains("changed since"));
            assert_eq!(fs::read(&path).unwrap(), [0xff]);
        }
    }

    /// Two prompts in two folders: one took back the script that the other had saved, and the script was gone.
    #[test]
    fn the_change_of_another_folder_is_told_and_left() {
        let (_kept, home) = folder();
        let (here, there) = (home.join("here"), home.join("there"));
        fs::create_dir(&here).unwrap();
        fs::create_dir(&there).unwrap();
        let at = |folder: &Path| Edits::in_folder(Some(&home), Some(folder.to_owned()));
        let (mine, theirs) = (here.join("mine.task"), there.join("theirs.task"));
        fs::write(&theirs, "theirs").unwrap();
        at(&there).made(":save", &theirs, None, "theirs");
        let refused = at(&here).undo().unwrap_err();
        assert!(refused.message.contains("theirs.task"), "{refused:?}");
        assert!(refused.message.ends_with("in another folder"), "{refused:?}");
        fs::write(&mine, "mine").unwrap();
        at(&here).made(":save", &mine, None, "mine");
        fs::write(&theirs, "again").unwrap();
        // A path that leaves its folder does not hide where it leads.
        let round = here.join("../there/theirs.task");
        at(&there).made("gap --apply", &round, Some("theirs".into()), "again");
        let told = at(&here).undo().unwrap();
        assert!(told.starts_with("mine.task is gone again") && told.contains("later"), "{told}");
        assert!(!mine.exists());
        assert_eq!(fs::read_to_string(&theirs).unwrap(), "again");
        at(&there).undo().unwrap();
        assert_eq!(fs::read_to_string(&theirs).unwrap(), "theirs");
        at(&here).redo().unwrap();
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
        // What was made from a folder is taken back there, wherever it lies.
        fs::write(&mine, "other").unwrap();
        at(&there).made(":save", &mine, Some("mine".into()), "other");
        at(&there).undo().unwrap();
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
    }

    #[test]
    fn a_file_that_someone_else_changed_is_left_alone_and_bars_nothing() {
        let (_kept, home) = folder();
        let (mine, other) = (home.join("mine"), home.join("other"));
        let mut edits = Edits::in_folder(Some(&home), Some(home.clone()));
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
        let (_kept, home) = folder();
        let mut edits = Edits::in_folder(Some(&home), Some(home.clone()));
        for i in 0..MOST + 5 {
            edits.made(":save", &home.join("f"), None, &i.to_string());
        }
        assert_eq!(edits.all().len(), MOST);
        assert_eq!(edits.all().last().unwrap().after, (MOST + 4).to_string());
    }
}
