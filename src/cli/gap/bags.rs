//! ROS 2 bags: a file in MCAP, or the folder that `ros2 bag record` writes, in which the files are parts of one recording.

use std::fs;
use std::path::{Path, PathBuf};

#[cfg(feature = "bags")]
use crate::discovery::recording::Bag;
use crate::discovery::recording::{Map, Recording};
#[cfg(feature = "bags")]
use crate::files;
use crate::report::Failure;

use super::foreign;
#[cfg(feature = "bags")]
use super::foreign::failure;

/// What `ros2 bag record` writes beside the files of a bag.
const METADATA: &str = "metadata.yaml";
/// How the files end that are read.
const READ: &str = "mcap";
/// How the files of a bag end, in its other storage and compressed.
const STORED: [&str; 4] = [READ, "db3", "zstd", "zst"];

/// Whether a folder is a bag, in whatever storage.
pub(super) fn is_bag(folder: &Path) -> bool {
    folder.join(METADATA).is_file() && !stored(folder).is_empty()
}

/// Why a folder that is no bag is none, if it holds files that could be given by themselves.
pub(super) fn is_nearly(folder: &Path) -> Option<&'static str> {
    let has = stored(folder).iter().any(|file| ends(file, READ));
    has.then_some("a folder of MCAP files without a `metadata.yaml`; give the files themselves")
}

fn ends(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own == ending)
}

/// The files in a folder that a bag may be stored in, by name.
fn stored(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let is_stored =
        |path: &PathBuf| STORED.iter().any(|ending| ends(path, ending)) && path.is_file();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut found: Vec<PathBuf> = paths.filter(is_stored).collect();
    found.sort();
    found
}

/// The files of the bag that a path names, in order of their names; `None` if it names no bag.
///
/// # Errors
///
/// A [`Failure`] for a bag in another storage, with what makes one of it that is read.
pub(super) fn parts(path: &Path) -> Result<Option<Vec<PathBuf>>, Failure> {
    if ends(path, READ) && !path.is_dir() {
        return Ok(Some(vec![path.to_owned()]));
    }
    if !path.is_dir() || !is_bag(path) {
        return Ok(None);
    }
    let (read, others): (Vec<_>, Vec<_>) =
        stored(path).into_iter().partition(|file| ends(file, READ));
    match others.first() {
        Some(other) if read.is_empty() => Err(foreign::bag(path, other)),
        _ => Ok(Some(read)),
    }
}

/// The sidecar of a bag: beside its folder, or in it beside its first file.
pub(super) fn sidecar(path: &Path, parts: &[PathBuf]) -> Option<PathBuf> {
    let beside = path.file_name().filter(|_| path.is_dir()).map(|name| {
        let mut name = name.to_owned();
        name.push(".json");
        path.with_file_name(name)
    });
    let within = parts.first().map(|file| file.with_extension("json"));
    beside.into_iter().chain(within).find(|file| file.is_file())
}

/// Reads the files of one bag as one recording.
#[cfg(feature = "bags")]
pub(super) fn read(
    name: &str,
    parts: &[PathBuf],
    sidecar: Option<(&str, &str)>,
    map: &Map,
) -> Result<Recording, Failure> {
    let mut bag = Bag::default();
    for path in parts {
        let bytes = files::read::bytes(path, files::read::DATA);
        let bytes = bytes.map_err(|error| Failure::unread(path, &error))?;
        bag.add(&path.display().to_string(), &bytes).map_err(|error| failure(&error))?;
    }
    bag.recording(name, sidecar, map).map_err(|error| failure(&error))
}

#[cfg(not(feature = "bags"))]
pub(super) fn read(
    name: &str,
    _: &[PathBuf],
    _: Option<(&str, &str)>,
    _: &Map,
) -> Result<Recording, Failure> {
    Err(Failure::input("gap::recording", "this build does not read ROS 2 bags")
        .at(name)
        .help("build it with `--features bags`, or convert the bag to CSV"))
}
