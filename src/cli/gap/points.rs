//! `trueup gap` on files of points and their pixels: what the model of the camera lacks.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::discovery::Options;
use crate::discovery::camera::{self, points::Points, points::is_points};
use crate::discovery::model_file::ModelFile;
use crate::discovery::recording::Map;
use crate::files;
use crate::report::{self, Failure, Style};
use crate::world::Camera;

use super::super::inputs::{data, read};
use super::super::shared::Shared;
use super::foreign::failure;
use super::inputs::scene_of;
use super::{GapArgs, bar, change, keep, model_of, tell};
use crate::report::exit::Exit;

/// Bytes in which the header of a table of points ends, with the notes before it.
const HEADER: u64 = 1 << 16;

/// Returns whether a file is a table of points, going by its header.
pub(super) fn is_table(path: &Path, map: &Map) -> bool {
    let table = path.extension().is_some_and(|extension| extension == "csv") && path.is_file();
    // The header is enough, and a table may be large.
    let mut begin = Vec::new();
    let read = files::read::open(path, files::read::DATA)
        .and_then(|file| file.take(HEADER).read_to_end(&mut begin));
    table && read.is_ok() && is_points(&String::from_utf8_lossy(&begin), map)
}

/// `trueup gap POINTS.csv...`; `notes` are about what was given.
pub(super) fn gap(
    args: &GapArgs,
    notes: Vec<String>,
    map: &Map,
    cli: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let files: Vec<Points> =
        args.recordings.iter().map(|path| points_at(path, map)).collect::<Result<_, _>>()?;
    let model = model_of(args, style)?;
    let nominal = scene_camera(model.as_ref(), &files, cli, style)?;
    let known = model.as_ref().map_or(&[][..], |(_, file)| file.effects());
    let options = Options { holdout: args.holdout, ..Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(report::shown(what));
            bar.set_position((part * 100.0) as u64);
        }
    };
    let found = camera::investigate(&files, nominal.as_ref(), known, &options, &mut progress);
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let mut investigation = found.map_err(|error| failure(&error))?;
    investigation.finding.notes.extend(notes);
    if let Some((path, file)) = &model {
        change(&mut investigation.finding, path, file, args, cli)?;
    }
    if let Some(folder) = &args.out {
        keep(&mut investigation, &[], 0, folder)?;
    }
    tell(&investigation.finding, style);
    Ok(Exit::Yes)
}

/// Reads a table and the files beside it.
fn points_at(path: &Path, map: &Map) -> Result<Points, Failure> {
    let beside = |extension: &str| -> Result<Option<(String, String)>, Failure> {
        let path = path.with_extension(extension);
        if !path.is_file() {
            return Ok(None);
        }
        Ok(Some((path.display().to_string(), read(&path)?)))
    };
    let (sidecar, extrinsics) = (beside("json")?, beside("extrinsics.json")?);
    let text = data(path)?;
    Points::read(
        &path.display().to_string(),
        &text,
        sidecar.as_ref().map(|(place, text)| (place.as_str(), text.as_str())),
        extrinsics.as_ref().map(|(place, text)| (place.as_str(), text.as_str())),
        map,
    )
    .map_err(|error| failure(&error))
}

/// Returns the camera of the scene that the twin is of, or of the one asked for; `None` where no scene is named, or the
/// points bring their own camera and the scene is not at hand.
fn scene_camera(
    model: Option<&(PathBuf, ModelFile)>,
    points: &[Points],
    cli: &Shared,
    style: Style,
) -> Result<Option<Camera>, Failure> {
    if model.is_none() && cli.cell.scene.is_none() {
        return Ok(None);
    }
    match scene_of(cli, model, style) {
        Ok(scene) => Ok(Some(scene.camera)),
        Err(_) if points.iter().any(|points| points.known.lens.is_some()) => Ok(None),
        Err(failure) => Err(failure),
    }
}
