//! Why a file that somebody named is not read.

use std::io;

/// What is not read, beside what the file system says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Unread {
    #[error("there is no such file")]
    Missing,
    #[error("it is a directory")]
    Directory,
    #[error("it is not a regular file but a pipe or a device")]
    Irregular,
    #[error("it is not UTF-8 text")]
    NotText,
    /// More bytes than this.
    #[error("it is larger than {} MiB", .0 >> 20)]
    TooLarge(u64),
}

impl From<Unread> for io::Error {
    fn from(why: Unread) -> Self {
        let kind = match why {
            Unread::Missing => io::ErrorKind::NotFound,
            Unread::Directory => io::ErrorKind::IsADirectory,
            Unread::Irregular => io::ErrorKind::InvalidInput,
            Unread::NotText => io::ErrorKind::InvalidData,
            Unread::TooLarge(_) => io::ErrorKind::FileTooLarge,
        };
        Self::new(kind, why)
    }
}
