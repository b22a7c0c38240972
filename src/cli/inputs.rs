//! Files that the arguments name, read with an error that says which and why.

use std::path::Path;

use crate::files;
use crate::report::Failure;

/// Reads a text file, with an error that says which and why.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    files::read::text(path).map_err(|error| Failure::unread(path, &error))
}

/// Reads what a program writes, which may be larger than what a person does.
pub(super) fn data(path: &Path) -> Result<String, Failure> {
    let text = files::read::text_of(path, files::read::DATA);
    text.map_err(|error| Failure::unread(path, &error))
}
