//! What `trueup gap` is given: recordings, run folders, robots and scenes.

use std::path::{Path, PathBuf};

use crate::discovery::held::Held;
use crate::discovery::model_file::ModelFile;
use crate::discovery::pour::Pour;
use crate::discovery::recording::{Map, Recording};
use crate::language::Source;
use crate::motion::Robot;
use crate::report::{self, Failure, Style};
use crate::workcell::archive;
use crate::workcell::{self, RobotError, Run, Stdlib, carried, poured, record};
use crate::world::Scene;

use super::super::cell::{of_run, stdlib};
use super::super::inputs::{arm_rows, data, read};
use super::super::shared::Shared;
use super::foreign::{self, failure};
use super::given::{Aside, nothing};
use super::setting::{AtHand, changed};
use super::{GapArgs, bags};

/// What all the recordings are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Arm,
    Pours,
    Held,
}

/// What `gap` is given.
pub(super) struct Inputs {
    pub(super) recordings: Vec<Recording>,
    pub(super) kind: Kind,
    /// The scene, unless the recordings are of an arm alone.
    pub(super) scene: Option<Scene>,
    /// The robot of the runs, where there are any.
    pub(super) robot: Option<Own>,
    /// The runs among what was given, each with the name of its folder.
    pub(super) runs: Vec<(String, Run)>,
    /// What of the paths was looked at.
    pub(super) used: Vec<PathBuf>,
}

/// The robot that runs were made with: the stdlib that it is in, and its name there.
pub(super) struct Own {
    stdlib: Stdlib,
    name: String,
}

/// Reads every recording; a run folder's is its pour, if it has one and a scale was read, else the arm's. Of several runs those of
/// another kind than the last are left out, those of which nothing can be told, and those of another arm or scene than the last
/// was made with, unless a scene is named.
pub(super) fn inputs(
    args: &GapArgs,
    map: &Map,
    model: Option<&(PathBuf, ModelFile)>,
    cli: &Shared,
    style: Style,
) -> Result<Inputs, Failure> {
    let mut files = read_all(args, map)?;
    let runs: Vec<Option<Run>> =
        args.recordings.iter().map(|path| run_at(path)).collect::<Result<_, _>>()?;
    let has = |is: fn(&Recording) -> bool| files.iter().flatten().any(is);
    let last = runs.iter().flatten().next_back();
    let is_named = cli.cell.scene.is_some() || model.is_some();
    let made_with = last.map(|run| of_run(cli, run));
    let cli = made_with.as_ref().unwrap_or(cli);
    let (mut scene, mut robot) = (None, None);
    let mut aside = Aside::default();
    let mut refused = None;
    let mut edited = None;
    if runs.iter().any(Option::is_some) || has(Pour::is_one) || has(Held::is_one) {
        let own = scene_of(cli, model, style)?;
        let known = stdlib(cli)?;
        let arm = known.robot(&own.robot).map_err(|error| {
            let help = "name the folder that its robot is in with `--stdlib DIR`";
            Failure::input("scene::robot", error.to_string()).at(own.name.as_str()).help(help)
        })?;
        if let (Some(run), Some(file)) = (last, &cli.cell.scene) {
            edited = changed(run, file, &read(file)?);
        }
        let at_hand = AtHand { robot: &arm, scene: &own, is_named };
        for ((file, run), path) in files.iter_mut().zip(&runs).zip(&args.recordings) {
            let Some(run) = run else { continue };
            if let Some(why) = at_hand.refuses(run) {
                aside.add(path, why.message.as_str());
                refused.get_or_insert_with(|| why.at(path.display().to_string()));
                file.clear();
                continue;
            }
            for recording in &mut *file {
                match poured::pour(run, recording, &arm, &own) {
                    // The arm's recording of a run, by itself, is what was asked for.
                    Ok(Some(pour)) if path.is_dir() => *recording = pour,
                    Err(error) if path.is_dir() => {
                        aside.add(path, error.what.as_str());
                        refused.get_or_insert_with(|| failure(&error));
                    }
                    _ => carried::carried(run, recording, &arm, &own),
                }
            }
            if aside.has(path) {
                file.clear();
            }
        }
        robot = last.map(|_| Own { stdlib: known, name: own.robot.clone() });
        scene = Some(own);
    }
    let kinds: Vec<Option<Kind>> = files.iter().map(|file| file.first().map(kind_of)).collect();
    let Some(kind) = kinds.iter().rev().find_map(|kind| *kind) else {
        return Err(refused.unwrap_or_else(nothing));
    };
    for ((file, other), path) in files.iter_mut().zip(&kinds).zip(&args.recordings) {
        let Some(other) = other.filter(|other| *other != kind) else { continue };
        if !path.is_dir() {
            return Err(mixed(kind, other, path));
        }
        let (is, last) = (words(other), words(kind));
        aside.add(
            path,
            format!("{is}, where the last is {last}; `trueup gap RUN...` takes them by themselves"),
        );
        file.clear();
    }
    let used = args.recordings.iter().zip(&files).filter(|(_, file)| !file.is_empty());
    let used: Vec<PathBuf> = used.map(|(path, _)| path.clone()).collect();
    let mut recordings = flat(files);
    if let Some(first) = recordings.first_mut() {
        first.notes.extend(aside.notes());
        first.notes.extend(edited);
    }
    let scene = scene.filter(|_| kind != Kind::Arm);
    let names = args.recordings.iter().map(|path| {
        let folder = folder(path);
        folder.file_name().unwrap_or(folder.as_os_str()).to_string_lossy().into_owned()
    });
    let runs = names.zip(runs).filter_map(|(name, run)| Some((name, run?))).collect();
    Ok(Inputs { recordings, kind, scene, robot, runs, used })
}

fn words(kind: Kind) -> &'static str {
    match kind {
        Kind::Arm => "the motion of an arm",
        Kind::Pours => "a pour",
        Kind::Held => "a thing in the hand",
    }
}

/// Recordings of several kinds that are no run folders.
fn mixed(last: Kind, this: Kind, path: &Path) -> Failure {
    let message = format!("this recording is of {}, the last is of {}", words(this), words(last));
    Failure::input("gap::mixed", message)
        .at(path.display().to_string())
        .help("compare like with like; `RUN/arm.csv` is the arm's recording of a run")
}

fn kind_of(recording: &Recording) -> Kind {
    if Pour::is_one(recording) {
        Kind::Pours
    } else if Held::is_one(recording) {
        Kind::Held
    } else {
        Kind::Arm
    }
}

/// Reads every recording as it is.
pub(super) fn plain(args: &GapArgs, map: &Map) -> Result<Vec<Recording>, Failure> {
    read_all(args, map).map(flat)
}

/// Reads what each file holds: one recording, or several whose clocks start again.
fn read_all(args: &GapArgs, map: &Map) -> Result<Vec<Vec<Recording>>, Failure> {
    args.recordings.iter().map(|path| recordings_at(path, map)).collect()
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

/// Returns the folder of a run folder's recording, or the path as it is.
fn folder(path: &Path) -> &Path {
    match (path.file_name(), path.parent()) {
        (Some(name), Some(parent)) if name == "arm.csv" && parent.as_os_str().is_empty() => {
            Path::new(".")
        }
        (Some(name), Some(parent)) if name == "arm.csv" => parent,
        _ => path,
    }
}

/// Reads the run of a run folder, or of the folder that an arm's recording of a run lies in.
fn run_at(path: &Path) -> Result<Option<Run>, Failure> {
    let file = folder(path).join("run.json");
    if !file.is_file() {
        return Ok(None);
    }
    archive::load(folder(path)).map(Some).map_err(|error| {
        Failure::input("gap::run", format!("not a run: {error}"))
            .at(file.display().to_string())
            .help("was it written by another version? its `arm.csv` can still be given by itself")
    })
}

/// Returns the scene that the model file's twin is of, the one asked for, or the stdlib's.
pub(super) fn scene_of(
    cli: &Shared,
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

/// Reads the recordings of a file and the sidecar beside it; a folder is a bag, or a run, whose recording is `arm.csv`.
fn recordings_at(path: &Path, map: &Map) -> Result<Vec<Recording>, Failure> {
    if let Some(parts) = bags::parts(path)? {
        let sidecar = sidecar(bags::sidecar(path, &parts))?;
        let sidecar = sidecar.as_ref().map(|(name, text)| (name.as_str(), text.as_str()));
        let name = path.display().to_string();
        return bags::read(&name, &parts, sidecar, map).map(|recording| vec![recording]);
    }
    let inside;
    let path = if path.is_dir() {
        inside = path.join("arm.csv");
        inside.as_path()
    } else {
        path
    };
    let sidecar = sidecar(Some(path.with_extension("json")).filter(|file| file.is_file()))?;
    let sidecar = sidecar.as_ref().map(|(name, text)| (name.as_str(), text.as_str()));
    let name = path.display().to_string();
    // Who else calls a file so may have ended it without a line's end.
    let is_of_a_run = path.file_name().is_some_and(|file| file == "arm.csv")
        && path.with_file_name(record::EVENTS).is_file();
    let text = if is_of_a_run { arm_rows(path) } else { data(path) };
    let text = text.map_err(|failure| foreign::told(path).unwrap_or(failure))?;
    Recording::read_runs(&name, &text, sidecar, map).map_err(|error| failure(&error))
}

/// Reads a sidecar, if there is one: its name and its text.
fn sidecar(file: Option<PathBuf>) -> Result<Option<(String, String)>, Failure> {
    file.map(|file| Ok((file.display().to_string(), read(&file)?))).transpose()
}

/// Finds the robot, as told, as the first sidecar says, that of the runs, or the stdlib's Gen3; and its file, unless it is the
/// stdlib's.
pub(super) fn robot_of(
    args: &GapArgs,
    recordings: &[Recording],
    own: Option<&Own>,
    cli: &Shared,
) -> Result<(Robot, Option<PathBuf>), Failure> {
    let sidecar = &recordings[0].sidecar;
    let tip = sidecar.tip.as_deref();
    let refused = |error: String| Failure::input("gap::robot", error);
    let from_file = |path: &Path| {
        let robot = Robot::from_file(path, tip)
            .map_err(|error| refused(error.to_string()).at(path.display().to_string()))?;
        Ok((robot, Some(path.to_path_buf())))
    };
    let library = stdlib(cli)?;
    // The robot of the stdlib that is called so, or the names there are.
    let of_stdlib = |name: &str| match library.robot_to(name, tip) {
        Ok(robot) => Ok(Ok((robot, None))),
        Err(RobotError::None { known, .. }) => Ok(Err(known)),
        Err(error @ RobotError::Text { .. }) => Err(refused(error.to_string())),
    };
    if let Some(path) = &args.robot_file {
        return match of_stdlib(&path.display().to_string())? {
            Ok(found) if !path.exists() => Ok(found),
            _ => from_file(path),
        };
    }
    if let (None, Some(Own { stdlib: known, name })) = (&sidecar.robot, own) {
        let robot = known.robot_to(name, tip).map_err(|error| refused(error.to_string()))?;
        return Ok((robot, None));
    }
    let name = match sidecar.robot.as_deref() {
        None | Some("gen3") => "gen3_2f85",
        Some(name) => name,
    };
    let known = match of_stdlib(name)? {
        Ok(found) => return Ok(found),
        Err(known) => known,
    };
    let first = &args.recordings[0];
    // The sidecar of a bag lies beside its folder.
    let within = first.is_dir().then_some(first.as_path());
    let folders = [within, first.parent(), args.robot_dir.as_deref()];
    for folder in folders.into_iter().flatten() {
        let path = folder.join(name);
        if path.is_file() {
            return from_file(&path);
        }
    }
    let help = format!(
        "put the URDF beside the recording, or name its folder with `--robot-dir`; the stdlib has {}",
        known.join(", ")
    );
    Err(refused(format!("the recording's robot `{name}` is not found"))
        .at(first.display().to_string())
        .help(help))
}
