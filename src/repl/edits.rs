//! What trueup changed in files at this prompt, so that the last change can be taken back: `:undo-edit`.
//!
//! Kept while the prompt is open. A file that was changed by anyone else since is left alone.

use std::path::{Path, PathBuf};

use crate::report::Failure;

/// One change.
struct Edit {
    /// What made it: `:phrase`.
    by: &'static str,
    path: PathBuf,
    /// The text before; `None` when there was no such file.
    before: Option<String>,
    after: String,
}

/// The changes of this session, the oldest first.
#[derive(Default)]
pub(super) struct Edits(Vec<Edit>);

impl Edits {
    /// Takes note of a change.
    pub(super) fn made(
        &mut self,
        by: &'static str,
        path: &Path,
        before: Option<String>,
        after: &str,
    ) {
        self.0.push(Edit { by, path: path.to_path_buf(), before, after: after.to_owned() });
    }

    /// Takes the last change back; returns what was undone, in words.
    ///
    /// # Errors
    ///
    /// When there is none, or the file was changed since; nothing is written then.
    pub(super) fn undo(&mut self) -> Result<String, Failure> {
        let Some(last) = self.0.last() else {
            return Err(Failure::input("repl::undo", "no file was changed at this prompt").help(
                "`:phrase` and `:save` change files; what `trueup gap --apply` changes is its own",
            ));
        };
        let place = last.path.display().to_string();
        let now = std::fs::read_to_string(&last.path).ok();
        if now.as_deref() != Some(last.after.as_str()) {
            let words = format!("{place} was changed since {} wrote it", last.by);
            return Err(Failure::input("repl::undo", words).help("undo it by hand"));
        }
        let done = match &last.before {
            Some(before) => std::fs::write(&last.path, before),
            None => std::fs::remove_file(&last.path),
        };
        done.map_err(|error| {
            Failure::input("io::write", format!("cannot write: {error}")).at(place.clone())
        })?;
        let name = last.path.file_name().unwrap_or_default().display();
        let told = match &last.before {
            Some(_) => format!("{name} is as it was before {}", last.by),
            None => format!("{name} is gone again, which {} made", last.by),
        };
        self.0.pop();
        Ok(told)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("trueup-edits-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&dir);
        dir
    }

    #[test]
    fn changes_are_undone_last_first() {
        let path = file("order");
        let mut edits = Edits::default();
        std::fs::write(&path, "one").unwrap();
        edits.made(":save", &path, None, "one");
        std::fs::write(&path, "two").unwrap();
        edits.made(":phrase", &path, Some("one".into()), "two");
        edits.undo().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one");
        edits.undo().unwrap();
        assert!(!path.exists());
        assert_eq!(edits.undo().unwrap_err().code, "repl::undo");
    }

    #[test]
    fn a_file_that_someone_else_changed_is_left_alone() {
        let path = file("foreign");
        let mut edits = Edits::default();
        std::fs::write(&path, "mine").unwrap();
        edits.made(":save", &path, None, "mine");
        std::fs::write(&path, "theirs").unwrap();
        assert!(edits.undo().unwrap_err().message.contains("changed since"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
        std::fs::remove_file(&path).unwrap();
    }
}
