//! Writing a file of a person's: whole or not at all, so that a full disk or a crash costs the change, never
//! what was there before.

use std::fs;
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use image::{ImageBuffer, ImageFormat, PixelWithColorType};
use tempfile::Builder;

/// Puts `content` where a file is or shall be: written beside it, flushed, synced, and renamed over it.
///
/// The file keeps its permissions and, where the system allows, its owner; what may not be written is refused. A link stays a link, and what it points at is replaced. What is no
/// regular file (`/dev/stdout`) is written to as it is.
///
/// # Errors
///
/// What the file system says; the file is then as it was.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, content.as_ref(), true)
}

/// As [`replace`], but left to the system to bring to the disk: for pictures of a run, of which there are
/// many. Whoever reads finds the file whole or not at all, also after this program was killed; only a crash of
/// the machine may cost it.
///
/// # Errors
///
/// As [`replace`].
pub fn place(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, content.as_ref(), false)
}

fn put(path: &Path, content: &[u8], is_synced: bool) -> io::Result<()> {
    let known = fs::metadata(path).ok();
    if known.as_ref().is_some_and(|facts| !facts.is_file()) {
        return fs::write(path, content);
    }
    if known.is_none() && path.is_symlink() {
        // What it points at is not there yet, so nothing can be lost.
        return fs::write(path, content);
    }
    if known.is_some() {
        // What may not be written is not replaced either.
        fs::OpenOptions::new().write(true).open(path)?;
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
    // Of what goes wrong the kind, and of the file itself what it says: what is around them would tell of the name that nobody
    // gave.
    let mut half = builder.tempfile_in(&dir).map_err(|error| io::Error::from(error.kind()))?;
    half.as_file_mut().write_all(content)?;
    if let Some(facts) = known {
        half.as_file().set_permissions(facts.permissions())?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::{MetadataExt as _, fchown};
            // Nobody but root may give a file away; then it is the writer's.
            let _ = fchown(half.as_file(), Some(facts.uid()), Some(facts.gid()));
        }
    }
    if is_synced {
        half.as_file().sync_all()?;
    }
    half.persist(&target).map_err(|error| error.error)?;
    if !is_synced {
        return Ok(());
    }
    // The new name is on the disk only when its folder is; not every file system lets a folder be synced.
    let _ = fs::File::open(&dir).and_then(|dir| dir.sync_all());
    Ok(())
}

/// Puts a picture where a file is or shall be, as PNG, as [`place`] does.
///
/// # Errors
///
/// As [`replace`].
pub fn picture<P>(path: &Path, image: &ImageBuffer<P, Vec<u8>>) -> io::Result<()>
where
    P: PixelWithColorType<Subpixel = u8>,
{
    let mut png = io::Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).map_err(io::Error::other)?;
    place(path, png.get_ref())
}

/// Adds bytes at the end of a file that only grows: all of them or none, so that no half of a line is taken
/// for a whole one later. `length` is how long the file is, and is kept up to date.
///
/// # Errors
///
/// What the file system says; the file is then as long as it was.
pub fn append(file: &mut fs::File, length: &mut u64, content: &[u8]) -> io::Result<()> {
    let written = file.write_all(content).and_then(|()| file.flush());
    match &written {
        Ok(()) => *length += content.len() as u64,
        // What cannot be taken back either is told by the first error.
        Err(_) => {
            let _ = file.set_len(*length).and_then(|()| file.seek(SeekFrom::End(0)));
        }
    }
    written
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

    #[test]
    fn what_is_added_is_there_and_a_picture_is_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("grows");
        let (mut file, mut length) = (fs::File::create(&path).unwrap(), 0);
        append(&mut file, &mut length, b"one\n").unwrap();
        append(&mut file, &mut length, b"two\n").unwrap();
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), length), ("one\ntwo\n", 8));
        let path = dir.path().join("a.png");
        picture(&path, &image::RgbImage::from_pixel(3, 2, image::Rgb([1, 2, 3]))).unwrap();
        assert_eq!(image::open(&path).unwrap().to_rgb8().dimensions(), (3, 2));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_cannot_be_added_is_told_and_not_counted() {
        let mut full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut length = 4;
        assert!(is_full(&append(&mut full, &mut length, b"five").unwrap_err()));
        assert_eq!(length, 4);
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
