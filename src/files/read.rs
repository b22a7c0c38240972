//! Reading what somebody named: regular files below a size, nothing that never ends.
//!
//! A named pipe would be waited for and `/dev/zero` read until the memory is full; both are refused before
//! they are opened, and a file that grows while it is read stops at the limit. A text may come through a pipe that
//! the program was started with, as a shell's `<(…)`: somebody writes it, and it stops at the limit as well.

use std::fs::{self, File, Metadata};
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
    open_where(path, limit, &|_| false)
}

/// As [`open`], also of what is no regular file, if it `may` be read.
fn open_where(path: &Path, limit: u64, may: &dyn Fn(&Metadata) -> bool) -> io::Result<File> {
    let facts = fs::metadata(path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Unread::Missing.into(),
        _ => error,
    })?;
    if facts.is_dir() {
        return Err(Unread::Directory.into());
    }
    if !facts.is_file() && !may(&facts) {
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
    all(open(path, limit)?, limit)
}

/// Reads all of a file of at most `limit` bytes.
fn all(file: File, limit: u64) -> io::Result<Vec<u8>> {
    let mut found = Vec::new();
    file.take(limit + 1).read_to_end(&mut found)?;
    if found.len() as u64 > limit { Err(Unread::TooLarge(limit).into()) } else { Ok(found) }
}

/// Reads a text of at most [`TEXT`] bytes, also from a pipe that the program was started with.
///
/// # Errors
///
/// As [`open`]; [`io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn text(path: &Path) -> io::Result<String> {
    let file = open_where(path, TEXT, &|facts| is_handed_over(path, facts))?;
    utf8(all(file, TEXT)?)
}

/// Reads a text file with a limit of its own, bytes.
///
/// # Errors
///
/// As [`open`]; [`io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn text_of(path: &Path, limit: u64) -> io::Result<String> {
    utf8(bytes(path, limit)?)
}

fn utf8(found: Vec<u8>) -> io::Result<String> {
    String::from_utf8(found).map_err(|_| Unread::NotText.into())
}

/// Whether a path is a pipe that is open already, by the names that systems give what a program was started with.
#[cfg(unix)]
fn is_handed_over(path: &Path, facts: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt as _;

    const OPEN: [&str; 3] = ["/dev/fd", "/proc/self/fd", "/dev/stdin"];
    facts.file_type().is_fifo() && OPEN.iter().any(|folder| path.starts_with(folder))
}

#[cfg(not(unix))]
fn is_handed_over(_: &Path, _: &Metadata) -> bool {
    false
}

/// Throws away what a person at a terminal has typed and nobody has read; returns whether there was a line of it. What comes
/// from a pipe or a file stays.
///
/// A question is asked after it, so that a line typed before it was shown does not answer it.
#[cfg(unix)]
pub fn forget_typed() -> bool {
    use std::io::IsTerminal as _;

    let input = io::stdin();
    if !input.is_terminal() {
        return false;
    }
    // While nobody reads, a terminal counts whole lines.
    let was_any = rustix::io::ioctl_fionread(&input).is_ok_and(|n_bytes| n_bytes > 0);
    // A terminal that fails does so at the next line as well.
    let _ = rustix::termios::tcflush(&input, rustix::termios::QueueSelector::IFlush);
    was_any
}

/// Elsewhere a terminal is not asked.
#[cfg(not(unix))]
pub fn forget_typed() -> bool {
    false
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

    /// `trueup run <(cat a.task)` was refused as a device.
    #[cfg(unix)]
    #[test]
    fn a_text_comes_through_a_pipe_that_is_open_already() {
        use std::io::Write as _;
        use std::os::fd::AsRawFd as _;

        let (reads, mut writes) = io::pipe().unwrap();
        writes.write_all(b"home()").unwrap();
        drop(writes);
        let path = format!("/dev/fd/{}", reads.as_raw_fd());
        assert_eq!(bytes(Path::new(&path), 9).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        assert_eq!(text(Path::new(&path)).unwrap(), "home()");
    }
}
