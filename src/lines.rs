//! Files of JSON lines that only grow: answers of people and models, trials.
//!
//! A line that cannot be read is passed over and counted; one that a crash cut short is ended before the
//! next is written, so it costs itself alone.

use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest as _, Sha256};

use crate::files::read::{DATA, text_of};
use crate::files::write;

/// Adds a value at the end of the file, which is made, with its folder, if it is not there.
///
/// # Errors
///
/// What the file system says; the file is then as it was.
pub fn append(path: &Path, value: &impl Serialize) -> io::Result<()> {
    extend(path, std::slice::from_ref(value))
}

/// Adds values at the end of the file, all of them or none.
///
/// # Errors
///
/// As [`append`].
pub fn extend(path: &Path, values: &[impl Serialize]) -> io::Result<()> {
    if let Some(dir) = path.parent().filter(|dir| !dir.as_os_str().is_empty()) {
        fs::create_dir_all(dir)?;
    }
    let mut lines = String::new();
    for value in values {
        lines += &serde_json::to_string(value)?;
        lines.push('\n');
    }
    let mut file = OpenOptions::new().create(true).read(true).append(true).open(path)?;
    let mut length = file.metadata()?.len();
    if length > 0 {
        let mut last = [0];
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        if last != *b"\n" {
            lines.insert(0, '\n');
        }
    }
    write::append(&mut file, &mut length, lines.as_bytes())?;
    // An answer or a trial took long to come by.
    file.sync_data()
}

/// Reads all values, the oldest first, and counts the lines that are none. No file is no value.
///
/// # Errors
///
/// What the file system says.
pub fn read<T: DeserializeOwned>(path: &Path) -> io::Result<(Vec<T>, usize)> {
    let text = match text_of(path, DATA) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((Vec::new(), 0)),
        Err(error) => return Err(error),
    };
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let (mut values, mut unreadable) = (Vec::new(), 0);
    for line in lines {
        match serde_json::from_str(line) {
            Ok(value) => values.push(value),
            Err(_) => unreadable += 1,
        }
    }
    Ok((values, unreadable))
}

/// Returns the SHA-256 of texts in hexadecimal, by which a line says what it was made with. Each text but a
/// lone one ends in a byte of its own, so that "ab", "c" is not "a", "bc".
pub fn fingerprint(texts: &[&str]) -> String {
    let mut sum = Sha256::new();
    for text in texts {
        sum.update(text.as_bytes());
        if texts.len() > 1 {
            sum.update([0xff]);
        }
    }
    let mut hex = String::new();
    for byte in sum.finalize() {
        let _ = write!(hex, "{byte:02x}");
    }
    hex
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vectors of FIPS 180-2.
    #[test]
    fn a_fingerprint_is_sha_256() {
        let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(fingerprint(&[""]), empty);
        assert!(fingerprint(&["abc"]).starts_with("ba7816bf8f01cfea"));
        assert_ne!(fingerprint(&["ab", "c"]), fingerprint(&["a", "bc"]));
    }

    #[test]
    fn a_line_that_was_cut_short_costs_itself_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines.jsonl");
        fs::write(&path, "1\n{\"cut").unwrap();
        append(&path, &2).unwrap();
        append(&path, &3).unwrap();
        let read = read::<u32>(&path).unwrap();
        assert_eq!(read, (vec![1, 2, 3], 1));
    }
}
