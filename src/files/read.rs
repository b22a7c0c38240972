//! Reading what somebody named: regular files below a size, nothing that never ends.
//!
//! A named pipe would be waited for and `/dev/zero` read until the memory is full; both are refused before
//! they are opened, and a file that grows while it is read stops at the limit.

use std::fs::{self, File};
use std::io::{self, BufRead, Read as _};
use std::path::Path;

use super::error::Unread;

/// The largest text that a person writes: tasks, scenes, settings, descriptions of robots, bytes.
pub const TEXT: u64 = 16 << 20;
/// The largest thing that a program writes for this one: recordings, pictures, run folders, bytes.
pub const DATA: u64 = 2 << 30;

/// Opens a regular file of at most `limit` bytes.
///
/// # Errors
///
/// [`io::ErrorKind::InvalidInput`] for what is no regular file, [`io::ErrorKind::FileTooLarge`] for a larger
/// one, and what the file system says.
pub fn open(path: &Path, limit: u64) -> io::Result<File> {
    let facts = fs::metadata(path)?;
    if facts.is_dir() {
        return Err(Unread::Directory.into());
    }
    if !facts.is_file() {
        return Err(Unread::Irregular.into());
    }
    if facts.len() > limit {
        return Err(Unread::TooLarge(limit).into());
    }
    File::open(path)
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
///
/// As [`open`].
pub fn bytes(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut found = Vec::new();
    open(path, limit)?.take(limit + 1).read_to_end(&mut found)?;
    if found.len() as u64 > limit { Err(Unread::TooLarge(limit).into()) } else { Ok(found) }
}

/// Reads a text of at most [`TEXT`] bytes.
///
/// # Errors
///
/// As [`open`]; [`io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn text(path: &Path) -> io::Result<String> {
    text_of(path, TEXT)
}

/// As [`text`], with a limit of its own, bytes.
///
/// # Errors
///
/// As [`text`].
pub fn text_of(path: &Path, limit: u64) -> io::Result<String> {
    let found = bytes(path, limit)?;
    String::from_utf8(found).map_err(|_| Unread::NotText.into())
}

/// Reads one line of what is typed or piped in, with its end; empty when there is no more.
///
/// # Errors
///
/// What the system says; [`io::ErrorKind::FileTooLarge`] for a line longer than a megabyte, which nobody types,
/// and [`io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn line(input: &mut dyn BufRead) -> io::Result<String> {
    const LONGEST: u64 = 1 << 20;
    let mut line = String::new();
    let read = input.take(LONGEST).read_line(&mut line)?;
    if read as u64 == LONGEST && !line.ends_with('\n') {
        Err(Unread::TooLarge(LONGEST).into())
    } else {
        Ok(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_end_is_refused() {
        let mut input = io::Cursor::new("one\ntwo");
        assert_eq!(line(&mut input).unwrap(), "one\n");
        assert_eq!(line(&mut input).unwrap(), "two");
        assert_eq!(line(&mut input).unwrap(), "");
        let mut zeros = io::BufReader::new(io::repeat(0));
        assert_eq!(line(&mut zeros).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn only_regular_files_below_the_limit_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("text");
        fs::write(&path, "twelve bytes").unwrap();
        assert_eq!(bytes(&path, 12).unwrap(), b"twelve bytes");
        assert_eq!(bytes(&path, 11).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(text(dir.path()).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(text(&dir.path().join("gone")).unwrap_err().kind(), io::ErrorKind::NotFound);
        fs::write(&path, b"\xff").unwrap();
        assert_eq!(text(&path).unwrap_err().kind(), io::ErrorKind::InvalidData);
        if cfg!(unix) {
            let device = text(Path::new("/dev/zero")).unwrap_err();
            assert_eq!(device.kind(), io::ErrorKind::InvalidInput);
        }
    }
}
