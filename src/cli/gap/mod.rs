//! `trueup gap`: what the model lacks, from recordings or from points that a camera saw.

mod apply;
mod bags;
mod checked;
mod foreign;
mod given;
mod inputs;
mod points;
mod setting;

use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use crate::discovery::equation;
use crate::discovery::finding::Finding;
use crate::discovery::model_file::{self, ModelFile};
use crate::discovery::recording::{self, Flaw, Map, Recording};
use crate::discovery::{Investigation, Options, Subject, investigate};
use crate::files;
use crate::language::Source;
use crate::monitor::changes::{self, Change};
use crate::motion::Robot;
use crate::report::{self, Failure, Style};
use crate::trace::StepRecord;
use crate::units::significant;
use crate::workcell;

use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;
use foreign::failure;
use inputs::{Inputs, Kind, inputs, plain, robot_of};

/// The part of a single recording that is held out.
const HOLDOUT: f64 = 0.33;

#[derive(Debug, Clone, Args)]
pub(super) struct GapArgs {
    /// Recordings (CSV, or ROS 2 bags in MCAP, as a file or as the folder that `ros2 bag record` writes), run folders,
    /// numbers of runs in the folder of `--record`, folders of runs, or tables of points and their pixels
    /// (`x[m],y[m],z[m],u[px],v[px],view`); of several, the last is held out.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The model to correct: a `.task` file with a `twin` or a `model`.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The robot the recordings are of, a URDF or one of the stdlib (`panda`), instead of the one their sidecar names.
    #[arg(long, value_name = "URDF")]
    robot_file: Option<PathBuf>,
    /// Where to look for the URDF a sidecar names, after the recording's own folder.
    #[arg(long, value_name = "DIR")]
    robot_dir: Option<PathBuf>,
    /// What columns are to be called: `THEIRS=OURS[unit],...`.
    #[arg(long, value_name = "THEIRS=OURS,..", default_value = "")]
    map: String,
    /// The part of a single recording that is held out.
    #[arg(long, value_name = "FRACTION", default_value_t = HOLDOUT)]
    holdout: f64,
    /// Write the page, the finding and the next experiment into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write what was found into the model file.
    #[arg(long)]
    apply: bool,
}

/// `:gap` at the prompt: what the twin lacks, by some runs.
pub(super) fn over(runs: &[PathBuf], cli: &Shared, style: Style) -> Result<(), Failure> {
    let args = GapArgs {
        recordings: runs.to_vec(),
        model: None,
        robot_file: None,
        robot_dir: None,
        map: String::new(),
        holdout: HOLDOUT,
        out: None,
        apply: false,
    };
    gap(&args, cli, style).map(|_| ())
}

/// `trueup gap ...`.
pub(super) fn gap(args: &GapArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    if !(args.holdout > 0.0 && args.holdout < 1.0) {
        return Err(Failure::input(
            "gap::holdout",
            format!("--holdout is {}, which is no part of a recording", args.holdout),
        )
        .help("give a fraction between 0 and 1, such as 0.33"));
    }
    let map = Map::parse(&args.map).map_err(|error| failure(&error))?;
    let given::Given { paths, notes } = given::given(&args.recordings, &cli.cell.record)?;
    let mut args = GapArgs { recordings: paths, ..args.clone() };
    if args.recordings.first().is_some_and(|path| points::is_table(path, &map)) {
        return points::gap(&args, notes, &map, cli, style);
    }
    if let Some(path) = &args.model {
        let text = read(path)?;
        if equation::model_in(&text, "").is_some() {
            let mut recordings = plain(&args, &map)?;
            recordings[0].notes.extend(notes);
            held_out_is_new(&recordings)?;
            return equations(&args, path, &text, &recordings, cli, style);
        }
    }
    let model = model_of(&args, style)?;
    let Inputs { mut recordings, kind, scene, robot: own, runs, used } =
        inputs(&args, &map, model.as_ref(), cli, style)?;
    recordings[0].notes.extend(notes);
    args.recordings = used;
    let args = &args;
    held_out_is_new(&recordings)?;
    let known = model.as_ref().map_or(&[][..], |(_, file)| file.effects());
    let robot;
    let mut robot_at = None;
    let subject = match (&scene, kind) {
        (Some(scene), Kind::Pours) => Subject::Pours(scene, known),
        (scene, _) => {
            let found = robot_of(args, &recordings, own.as_ref(), cli)?;
            (robot, robot_at) = found;
            let joints: Vec<String> =
                robot.joints().iter().map(|joint| joint.name.clone()).collect();
            for recording in &mut recordings {
                recording.number_joints(&joints);
            }
            match scene {
                Some(scene) => Subject::Held(&robot, scene, known),
                None => Subject::Arm(&robot, known),
            }
        }
    };
    let options = Options { holdout: args.holdout, ..Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(report::shown(what));
            bar.set_position((part * 100.0) as u64);
        }
    };
    let finding = investigate(&recordings, subject, &options, &mut progress);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let is_told =
        args.robot_file.is_some() || recordings[0].sidecar.robot.is_some() || own.is_some();
    let is_assumed = kind != Kind::Pours && !is_told;
    let arm = match subject {
        Subject::Arm(robot, _) | Subject::Held(robot, ..) => Some(robot),
        Subject::Pours(..) => None,
    };
    let mut investigation = finding.map_err(|error| {
        let told = fewer_joints(&error, &recordings).and_then(|fewer| {
            if is_assumed { Some(of_another_arm(&fewer)) } else { of_a_shorter_chain(arm?, &fewer) }
        });
        told.unwrap_or_else(|| failure(&error))
    })?;
    if is_assumed {
        let assumed = "no robot is named; the Gen3 of the stdlib is assumed (`--robot-file URDF` names another)";
        investigation.finding.notes.insert(0, assumed.into());
    }
    if let Some((path, file)) = &model {
        change(&mut investigation.finding, path, file, args, cli)?;
    }
    revise(&mut investigation, robot_at.as_deref(), args)?;
    let steps: Vec<(&str, &[StepRecord])> =
        runs.iter().map(|(name, run)| (name.as_str(), &run.steps[..])).collect();
    let fluents = changes::unexplained(&steps);
    if let Some(folder) = &args.out {
        keep(&mut investigation, &fluents, runs.len(), folder)?;
    }
    if style.json {
        style.document(&WithFluents { finding: &investigation.finding, fluents: &fluents });
        return Ok(Exit::Yes);
    }
    tell(&investigation.finding, style);
    if !runs.is_empty() {
        style.say("");
        style.say(report::changes::people(&fluents, runs.len(), style).trim_end());
    }
    Ok(Exit::Yes)
}

/// A finding over runs, with what no step of them explains.
#[derive(serde::Serialize)]
struct WithFluents<'a> {
    #[serde(flatten)]
    finding: &'a Finding,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    fluents: &'a [Change],
}

/// The same for a model given by its equations.
fn equations(
    args: &GapArgs,
    path: &Path,
    text: &str,
    recordings: &[Recording],
    cli: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let place = path.display().to_string();
    let options = equation::Options { holdout: args.holdout, ..equation::Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(report::shown(what));
            bar.set_position((part * 100.0) as u64);
        }
    };
    let found = equation::investigate(&place, text, "", recordings, &options, &mut progress);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let outcome = found.map_err(|error| match error {
        equation::Error::Model { diagnostics } => {
            report::text_failure(&diagnostics, &Source::new(place.as_str(), text), style)
        }
        equation::Error::Recording(error) => failure(&error),
        equation::Error::NoModel { .. } => Failure::input("gap::model", error.to_string())
            .at(place.as_str())
            .help("add one: `model tanks { … }`"),
        equation::Error::BlowUp { .. } => Failure::input("gap::blow_up", error.to_string())
            .at(place.as_str())
            .help("is a sign wrong, or a unit? a guess helps: `param k = free ~ 0.05 in 0 to 1`"),
        equation::Error::TooShort { .. } => Failure::input("gap::short", error.to_string())
            .at(args.recordings[0].display().to_string())
            .help("record for longer"),
    })?;
    let mut investigation = Investigation {
        finding: outcome.finding,
        traces: outcome.traces,
        whys: outcome.whys,
        experiment: outcome.experiment,
        revision: None,
    };
    investigation.finding.notes.extend(checked::mistakes(path, text, cli)?);
    if args.apply && outcome.text != text {
        let note = apply::apply(path, text, &outcome.text)?;
        investigation.finding.model.applied = true;
        investigation.finding.notes.push(note);
    }
    if let Some(folder) = &args.out {
        keep(&mut investigation, &[], 0, folder)?;
    } else if investigation.experiment.is_some() {
        let notes = &mut investigation.finding.notes;
        notes.push("`--out DIR` writes the file with the input to record next".into());
    }
    tell(&investigation.finding, style);
    Ok(Exit::Yes)
}

/// Reads the model file, if one is given.
fn model_of(args: &GapArgs, style: Style) -> Result<Option<(PathBuf, ModelFile)>, Failure> {
    let Some(path) = &args.model else {
        if args.apply && args.robot_file.is_none() {
            return Err(Failure::input("gap::apply", "--apply needs a model file to write to")
                .help("name it with `--model FILE`, or the robot's with `--robot-file URDF`"));
        }
        return Ok(None);
    };
    let text = read(path)?;
    let place = path.display().to_string();
    match ModelFile::read(&text) {
        Ok(file) => Ok(Some((path.clone(), file))),
        Err(model_file::Error::Mistakes(diagnostics)) => {
            Err(report::text_failure(&diagnostics, &Source::new(place, text), style))
        }
        Err(error @ model_file::Error::NoTwin) => {
            Err(Failure::input("gap::model", error.to_string())
                .at(place)
                .help("add one: `twin my_twin of my_scene { }`"))
        }
    }
}

/// Writes a file, with an error that says which and why.
fn write(path: &Path, text: &str) -> Result<(), Failure> {
    files::write::replace(path, text).map_err(|error| Failure::unwritten(path, &error))
}

/// Writes the page, the finding and the motion that would settle a doubt into a folder.
fn keep(
    investigation: &mut Investigation,
    fluents: &[Change],
    runs: usize,
    folder: &Path,
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| Failure::unwritten(folder, &error))?;
    if let Some(csv) = &investigation.experiment {
        let path = folder.join("next.csv");
        write(&path, csv)?;
        if let Some(next) = &mut investigation.finding.next_experiment {
            next.commands = Some(path.display().to_string());
        }
    }
    let table = report::changes::table(fluents, runs);
    write(&folder.join("gap.html"), &report::gap_page::page(investigation, &table))?;
    let whole = WithFluents { finding: &investigation.finding, fluents };
    let json = serde_json::to_string_pretty(&whole)
        .map_err(|error| Failure::input("json", error.to_string()))?;
    write(&folder.join("gap.json"), &json)
}

/// Says what changes in the model file, and changes it if asked to.
fn change(
    finding: &mut Finding,
    path: &Path,
    file: &ModelFile,
    args: &GapArgs,
    cli: &Shared,
) -> Result<(), Failure> {
    let names: Vec<String> = args
        .recordings
        .iter()
        .map(|path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned())
        .collect();
    let provenance = format!(
        "found by gap in {}: held-out misfit {} -> {} of noise",
        names.join(", "),
        significant(finding.gap.before.heldout, 3),
        significant(finding.gap.after.heldout, 3)
    );
    let before = file.text();
    let after = file.with(&finding.model.added, &provenance);
    finding.model.path = Some(path.display().to_string());
    finding.model.diff = model_file::diff(&path.display().to_string(), before, &after);
    let with_found = ModelFile::read(&after);
    let effects = with_found.as_ref().map_or(file.effects(), ModelFile::effects);
    finding.notes.extend(workcell::unheeded_words(effects));
    finding.notes.extend(checked::mistakes(path, before, cli)?);
    if !args.apply || after == before {
        return Ok(());
    }
    finding.notes.push(apply::apply(path, before, &after)?);
    finding.model.applied = true;
    Ok(())
}

/// Writes the robot's file with the numbers that were identified: beside what else is kept, or, where it is to be applied,
/// beside the file itself, which stays as it is.
fn revise(
    investigation: &mut Investigation,
    robot: Option<&Path>,
    args: &GapArgs,
) -> Result<(), Failure> {
    let Some(revision) = &investigation.revision else { return Ok(()) };
    let notes = &mut investigation.finding.notes;
    let Some(robot) = robot else {
        notes.push("the robot is the stdlib's; give its URDF with `--robot-file` to have these numbers written".into());
        return Ok(());
    };
    let name =
        format!("{}.identified.urdf", robot.file_stem().unwrap_or_default().to_string_lossy());
    let mut places = Vec::new();
    if args.apply {
        places.push(robot.with_file_name(&name));
    }
    places.extend(args.out.as_ref().map(|folder| folder.join(&name)));
    if places.is_empty() {
        notes.push(format!("`--apply` writes {name}, the robot's file with these numbers"));
        return Ok(());
    }
    let recorded: Vec<String> =
        args.recordings.iter().map(|path| path.display().to_string()).collect();
    let why = format!(
        "numbers identified by trueup gap from {}; {} is the file as it was",
        recorded.join(", "),
        robot.display()
    );
    let text = match revision.written(&read(robot)?, &why) {
        Ok(text) => text,
        Err(error) => {
            notes
                .push(format!("these numbers cannot be written into {}: {error}", robot.display()));
            return Ok(());
        }
    };
    for place in places {
        if let Some(folder) = place.parent() {
            std::fs::create_dir_all(folder).map_err(|error| Failure::unwritten(folder, &error))?;
        }
        notes.push(apply::copy(&place, &text)?);
    }
    Ok(())
}

fn tell(finding: &Finding, style: Style) {
    if style.json {
        style.document(finding);
    } else {
        style.say(report::gap::people(finding, style).trim_end());
    }
}

fn bar(style: Style) -> Option<ProgressBar> {
    if style.quiet || !style.bars {
        return None;
    }
    let look = ProgressStyle::with_template("{bar:30} {msg} {elapsed}");
    Some(ProgressBar::new(100).with_style(look.unwrap_or_else(|_| ProgressStyle::default_bar())))
}

/// A recording with the columns of fewer joints than its robot has.
struct FewerJoints<'a> {
    /// What was found missing.
    error: &'a recording::Error,
    /// The first column that is.
    column: &'a str,
    recording: &'a Recording,
    /// Whether its sidecar is the one that says where the robot's chain ends.
    is_first: bool,
    /// How many joints have columns.
    joints: usize,
}

/// Returns whether a column is missing because all joints from there on have none.
fn fewer_joints<'a>(
    error: &'a recording::Error,
    recordings: &'a [Recording],
) -> Option<FewerJoints<'a>> {
    let Some(Flaw::NoColumn { name: column, .. }) = error.flaw() else { return None };
    let (stem, number) = column.rsplit_once('_')?;
    let missing: usize = number.parse().ok()?;
    let at = recordings.iter().position(|other| error.place.starts_with(&other.name))?;
    let (recording, is_first, column) = (&recordings[at], at == 0, column.as_str());
    let joints = recording.group_len(stem);
    let goes_on = recording.has(&format!("{stem}_{}", missing + 1));
    let is_fewer = joints > 0 && joints + 1 == missing && !goes_on;
    is_fewer.then_some(FewerJoints { error, column, recording, is_first, joints })
}

/// Says that the Gen3 was assumed, where the columns are those of an arm with fewer joints.
fn of_another_arm(fewer: &FewerJoints<'_>) -> Failure {
    let (name, joints) = (fewer.column, fewer.joints);
    let message = format!(
        "the columns are of an arm with {joints} joint{}, and no robot is named, so that the Gen3 with {} joints was assumed",
        if joints == 1 { "" } else { "s" },
        Robot::gen3().n_joints(),
    );
    let help = format!(
        "name the arm's file, or one of the stdlib's robots, with `--robot-file`; if `{name}` is there under another name, `--map 'THEIRS={name}'` renames it"
    );
    Failure::input("gap::robot", message).at(fewer.recording.name.as_str()).help(help)
}

/// Says how the robot's chain is ended where the columns do, as before a gripper that its file counts as a joint.
fn of_a_shorter_chain(robot: &Robot, fewer: &FewerJoints<'_>) -> Option<Failure> {
    // Where the others have columns, it is this one that lacks them.
    if !fewer.is_first || fewer.recording.group_len("q") > fewer.joints {
        return None;
    }
    let last = robot.joints().get(fewer.joints.checked_sub(1)?)?;
    let next = robot.joints().get(fewer.joints)?;
    let (end, from) = (&robot.links()[last.link].name, &next.name);
    let help = format!(
        "if the recording ends before the joint {from}, as before a gripper, name the link where it ends in the JSON file beside it: \
         `\"tip\": \"{end}\"`; otherwise {}",
        fewer.error.help
    );
    Some(failure(fewer.error).help(help))
}

/// Refuses to judge on the recording that was fitted.
fn held_out_is_new(recordings: &[Recording]) -> Result<(), Failure> {
    let Some((last, fitted)) = recordings.split_last() else { return Ok(()) };
    let same = |a: &[f64], b: &[f64]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    let repeats = |other: &&Recording| {
        let columns = other.columns.iter().zip(&last.columns);
        same(&other.time, &last.time)
            && other.columns.len() == last.columns.len()
            && columns.into_iter().all(|(a, b)| a.name == b.name && same(&a.values, &b.values))
    };
    let Some(other) = fitted.iter().find(repeats) else { return Ok(()) };
    let message =
        format!("the recording held out has the same rows as {}, which is fitted", other.name);
    Err(Failure::input("gap::same", message).at(last.name.as_str()).help(
        "judged on what was fitted, anything looks right: hold out another recording, or give this one alone, of which the last \
         part is held out",
    ))
}
