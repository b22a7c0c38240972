//! Writing a file of a person's: whole or not at all, so that a full disk or a crash costs the change, never
//! what was there before.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use tempfile::Builder;

/// Puts `content` where a file is or shall be: written beside it, flushed, synced, and renamed over it.
///
/// The file keeps its permissions; a link stays a link, and what it points at is replaced. What is no
/// regular file (`/dev/stdout`) is written to as it is.
///
/// # Errors
///
/// What the file system says; the file is then as it was.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    let known = fs::metadata(path).ok();
    if known.as_ref().is_some_and(|facts| !facts.is_file()) {
        return fs::write(path, content);
    }
    let target = if known.is_some() { fs::canonicalize(path)? } else { path.to_owned() };
    let dir = target.parent().filter(|dir| !dir.as_os_str().is_empty());
    let dir = dir.map_or_else(|| PathBuf::from("."), Path::to_owned);
    let mut builder = Builder::new();
    builder.prefix(".trueup-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // A new file is what `File::create` makes, less what the user's mask takes away.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut half = builder.tempfile_in(&dir)?;
    half.write_all(content.as_ref())?;
    if let Some(facts) = known {
        half.as_file().set_permissions(facts.permissions())?;
    }
    half.as_file().sync_all()?;
    half.persist(&target).map_err(|error| error.error)?;
    // The new name is on the disk only when its folder is; not every file system lets a folder be synced.
    let _ = fs::File::open(&dir).and_then(|dir| dir.sync_all());
    Ok(())
}

/// Whether there is no room for what was to be written: a full disk, a quota, a limit on the size of a file.
pub fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.task");
        replace(&path, "one").unwrap();
        replace(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        assert!(replace(&dir.path().join("gone/a.task"), "three").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn permissions_and_links_stay() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let dir = tempfile::tempdir().unwrap();
        let (path, link) = (dir.path().join("a"), dir.path().join("b"));
        fs::write(&path, "one").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&path, &link).unwrap();
        replace(&link, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told_from_other_errors() {
        let full = replace(Path::new("/dev/full"), "x").unwrap_err();
        assert!(is_full(&full), "{full:?}");
        let gone = replace(Path::new("/gone/x"), "x").unwrap_err();
        assert!(!is_full(&gone), "{gone:?}");
    }
}
