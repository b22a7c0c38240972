//! What `trueup gap` is given: recordings, run folders, robots and scenes.

use std::path::{Path, PathBuf};

use crate::discovery::model_file::ModelFile;
use crate::discovery::pour::Pour;
use crate::discovery::recording::{Map, Recording};
use crate::language::Source;
use crate::motion::Robot;
use crate::report::{self, Failure, Style};
use crate::workcell::{self, Run, poured};
use crate::world::Scene;

use super::super::Cli;
use super::super::run::{read, stdlib};
use super::{GapArgs, failure};

/// Reads every recording; a run folder's is its pour, if it has one and a scale was read, else the arm's.
/// With them comes the scene, if they are pours.
pub(super) fn recordings(
    args: &GapArgs,
    map: &Map,
    model: Option<&(PathBuf, ModelFile)>,
    cli: &Cli,
    style: Style,
) -> Result<(Vec<Recording>, Option<Scene>), Failure> {
    let mut files: Vec<Vec<Recording>> =
        args.recordings.iter().map(|path| recordings_at(path, map)).collect::<Result<_, _>>()?;
    let runs: Vec<Option<Run>> =
        args.recordings.iter().map(|path| run_at(path)).collect::<Result<_, _>>()?;
    let mut scene = None;
    if runs.iter().any(Option::is_some) || files.iter().flatten().any(Pour::is_one) {
        scene = Some(scene_of(cli, model, style)?);
    }
    let Some(scene) = scene else { return Ok((flat(files), None)) };
    let robot = stdlib(cli)?.robot(&scene.robot).map_err(|error| {
        Failure::input("scene::robot", error.to_string()).at(scene.name.as_str())
    })?;
    for (file, run) in files.iter_mut().zip(&runs) {
        let Some(run) = run else { continue };
        for recording in file {
            let pour =
                poured::pour(run, recording, &robot, &scene).map_err(|error| failure(&error))?;
            if let Some(pour) = pour {
                *recording = pour;
            }
        }
    }
    let recordings = flat(files);
    let pours = recordings.iter().filter(|recording| Pour::is_one(recording)).count();
    if pours == 0 {
        return Ok((recordings, None));
    }
    if let Some(other) = recordings.iter().find(|recording| !Pour::is_one(recording)) {
        return Err(Failure::input("gap::mixed", "some recordings are pours and others are not")
            .at(other.name.as_str())
            .help("compare pours with pours; `RUN/arm.csv` is the arm's recording of a run"));
    }
    Ok((recordings, Some(scene)))
}

/// Reads every recording as it is.
pub(super) fn plain(args: &GapArgs, map: &Map) -> Result<Vec<Recording>, Failure> {
    let files: Result<_, _> = args.recordings.iter().map(|path| recordings_at(path, map)).collect();
    files.map(flat)
}

/// The recordings of all files in a row; where files hold several, it is said which one is held out.
fn flat(files: Vec<Vec<Recording>>) -> Vec<Recording> {
    let several = files.iter().any(|file| file.len() > 1);
    let mut recordings: Vec<Recording> = files.into_iter().flatten().collect();
    if let Some(last) = recordings.last_mut()
        && several
    {
        let note = format!("{} is held out, being the last", last.name);
        last.notes.push(note);
    }
    recordings
}

/// Reads the run of a run folder.
fn run_at(path: &Path) -> Result<Option<Run>, Failure> {
    let file = path.join("run.json");
    if !path.is_dir() || !file.is_file() {
        return Ok(None);
    }
    serde_json::from_str(&read(&file)?).map(Some).map_err(|error| {
        Failure::input("gap::run", format!("not a run: {error}"))
            .at(file.display().to_string())
            .help("was it written by another version? its `arm.csv` can still be given by itself")
    })
}

/// Returns the scene that the model file's twin is of, the one asked for, or the stdlib's.
pub(super) fn scene_of(
    cli: &Cli,
    model: Option<&(PathBuf, ModelFile)>,
    style: Style,
) -> Result<Scene, Failure> {
    let mut library = workcell::library(&stdlib(cli)?);
    let mut wanted = None;
    if let Some(path) = &cli.cell.scene {
        wanted = Some(library.add(Source::new(path.display().to_string(), read(path)?)));
    }
    if let Some((path, file)) = model {
        let own = library.add(Source::new(path.display().to_string(), file.text()));
        let of = file.scene();
        let sources: Vec<String> = library
            .scenes()
            .filter(|(scene, _)| scene.name.text == of)
            .map(|(_, source)| source.name.clone())
            .collect();
        let at = (0..=own)
            .find(|at| library.source(*at).is_some_and(|source| sources.contains(&source.name)));
        if at.is_none() {
            return Err(Failure::input("gap::scene", format!("there is no scene `{of}`"))
                .at(path.display().to_string())
                .help("name its file with `--scene FILE`"));
        }
        wanted = at;
    }
    workcell::scene_of(&library, wanted).map_err(|error| report::cell_failure(&error, style))
}

/// Reads the recordings of a file and the sidecar beside it; a folder is a run, whose recording is `arm.csv`.
fn recordings_at(path: &Path, map: &Map) -> Result<Vec<Recording>, Failure> {
    let inside;
    let path = if path.is_dir() {
        inside = path.join("arm.csv");
        inside.as_path()
    } else {
        path
    };
    let beside = path.with_extension("json");
    let sidecar = if beside.is_file() { Some(read(&beside)?) } else { None };
    let beside = beside.display().to_string();
    let sidecar = sidecar.as_deref().map(|text| (beside.as_str(), text));
    let name = path.display().to_string();
    let found = if path.extension().is_some_and(|extension| extension == "mcap") {
        let bytes = std::fs::read(path).map_err(|error| {
            Failure::input("io::read", format!("cannot read {name}: {error}"))
                .at(&name)
                .help("is the path right?")
        })?;
        Recording::read_bag(&name, &bytes, sidecar, map).map(|recording| vec![recording])
    } else {
        Recording::read_runs(&name, &read(path)?, sidecar, map)
    };
    found.map_err(|error| failure(&error))
}

/// Finds the robot: as told, as the first sidecar says, or the stdlib's.
pub(super) fn robot_of(args: &GapArgs, recordings: &[Recording]) -> Result<Robot, Failure> {
    let sidecar = &recordings[0].sidecar;
    let tip = sidecar.tip.as_deref();
    let from_file = |path: &Path| {
        Robot::from_file(path, tip).map_err(|error| {
            Failure::input("gap::robot", error.to_string()).at(path.display().to_string())
        })
    };
    if let Some(path) = &args.robot_file {
        return from_file(path);
    }
    let stdlib = |tip: Option<&str>| match tip {
        None => Ok(Robot::gen3()),
        Some(tip) => {
            Robot::gen3_to(tip).map_err(|error| Failure::input("gap::robot", error.to_string()))
        }
    };
    let Some(name) = &sidecar.robot else { return stdlib(tip) };
    if matches!(name.as_str(), "gen3_2f85" | "gen3") {
        return stdlib(tip);
    }
    let first = &args.recordings[0];
    let folder = if first.is_dir() { Some(first.as_path()) } else { first.parent() };
    let folders = [folder, args.robot_dir.as_deref()];
    for folder in folders.into_iter().flatten() {
        let path = folder.join(name);
        if path.is_file() {
            return from_file(&path);
        }
    }
    Err(Failure::input("gap::robot", format!("the recording's robot `{name}` is not found"))
        .at(first.display().to_string())
        .help("put the URDF beside the recording, or name its folder with `--robot-dir`"))
}
