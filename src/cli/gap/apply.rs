//! What was found, written into the model file, with two ways back.

use std::path::Path;

use crate::files;
use crate::repl::Edits;
use crate::report::Failure;

use super::super::cell::home;
use super::write;

/// Writes a model file anew; returns where it is as it was, in words. `:undo-edit` takes it back as well.
pub(super) fn apply(path: &Path, before: &str, after: &str) -> Result<String, Failure> {
    // The old text first, so that there is always a way back.
    let mut old = path.as_os_str().to_owned();
    old.push(".before-gap");
    let old = Path::new(&old);
    write(old, before)?;
    write(path, after)?;
    Edits::new(home().as_deref()).made("gap --apply", path, Some(before.to_owned()), after);
    Ok(format!("{} holds the model as it was; so does `:undo-edit`", old.display()))
}

/// Writes a copy of a robot's file; returns where it is, in words. `:undo-edit` takes it back.
pub(super) fn copy(path: &Path, text: &str) -> Result<String, Failure> {
    let before = files::read::text(path).ok();
    write(path, text)?;
    Edits::new(home().as_deref()).made("gap --apply", path, before, text);
    Ok(format!(
        "{} is the robot's file with the numbers identified: `--robot-file` takes it",
        path.display()
    ))
}
