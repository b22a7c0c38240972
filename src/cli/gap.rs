//! `trueup gap`: what the model lacks, from recordings.

use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use crate::discovery::equation;
use crate::discovery::finding::Finding;
use crate::discovery::model_file::{self, ModelFile};
use crate::discovery::recording::{self, Map, Recording};
use crate::discovery::{Investigation, Options, Subject, investigate};
use crate::language::Source;
use crate::motion::Robot;
use crate::report::{self, Failure, Style};
use crate::units::significant;

use super::Exit;
use super::run::read;

#[derive(Debug, Args)]
pub(super) struct GapArgs {
    /// Recordings (CSV) or run folders; of several, the last is held out.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The model to correct: a `.task` file with a `twin` or a `model`.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The robot the recordings are of, instead of the one their sidecar names.
    #[arg(long, value_name = "URDF")]
    robot_file: Option<PathBuf>,
    /// Where to look for the URDF a sidecar names, after the recording's own folder.
    #[arg(long, value_name = "DIR")]
    robot_dir: Option<PathBuf>,
    /// What columns are to be called: `THEIRS=OURS[unit],...`.
    #[arg(long, value_name = "THEIRS=OURS,..", default_value = "")]
    map: String,
    /// The part of a single recording that is held out.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.33)]
    holdout: f64,
    /// Write the page, the finding and the next experiment into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write what was found into the model file.
    #[arg(long)]
    apply: bool,
}

/// `trueup gap ...`.
pub(super) fn gap(args: &GapArgs, style: Style) -> Result<Exit, Failure> {
    if !(args.holdout > 0.0 && args.holdout < 1.0) {
        return Err(Failure::input(
            "gap::holdout",
            format!("--holdout is {}, which is no part of a recording", args.holdout),
        )
        .help("give a fraction between 0 and 1, such as 0.33"));
    }
    let map = Map::parse(&args.map).map_err(|error| failure(&error))?;
    let recordings: Vec<Recording> =
        args.recordings.iter().map(|path| recording_at(path, &map)).collect::<Result<_, _>>()?;
    if let Some(path) = &args.model {
        let text = read(path)?;
        if equation::model_in(&text, "").is_some() {
            return equations(args, path, &text, &recordings, style);
        }
    }
    let robot = robot_of(args, &recordings)?;
    let model = model_of(args, style)?;
    let options = Options { holdout: args.holdout, ..Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(what.to_owned());
            bar.set_position((part * 100.0) as u64);
        }
    };
    let known = model.as_ref().map_or(&[][..], |(_, file)| file.effects());
    let finding = investigate(&recordings, Subject::Arm(&robot, known), &options, &mut progress);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let mut investigation = finding.map_err(|error| failure(&error))?;
    if let Some((path, file)) = &model {
        change(&mut investigation.finding, path, file, args)?;
    }
    if let Some(folder) = &args.out {
        keep(&mut investigation, folder)?;
    }
    tell(&investigation.finding, style);
    Ok(Exit::Yes)
}

/// The same for a model given by its equations.
fn equations(
    args: &GapArgs,
    path: &Path,
    text: &str,
    recordings: &[Recording],
    style: Style,
) -> Result<Exit, Failure> {
    let place = path.display().to_string();
    let options = equation::Options { holdout: args.holdout, ..equation::Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(what.to_owned());
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
        experiment: outcome.experiment,
    };
    if args.apply && outcome.text != text {
        // The old text first, so that there is always a way back.
        let mut undo = path.as_os_str().to_owned();
        undo.push(".before-gap");
        write(Path::new(&undo), text)?;
        write(path, &outcome.text)?;
        investigation.finding.model.applied = true;
        let note = format!("{} holds the model as it was", Path::new(&undo).display());
        investigation.finding.notes.push(note);
    }
    if let Some(folder) = &args.out {
        keep(&mut investigation, folder)?;
    }
    tell(&investigation.finding, style);
    Ok(Exit::Yes)
}

/// Reads the model file, if one is given.
fn model_of(args: &GapArgs, style: Style) -> Result<Option<(PathBuf, ModelFile)>, Failure> {
    let Some(path) = &args.model else {
        if args.apply {
            return Err(Failure::input("gap::apply", "--apply needs a model file to write to")
                .help("name it with `--model FILE`"));
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
    std::fs::write(path, text).map_err(|error| {
        Failure::input("io::write", format!("cannot write {}: {error}", path.display()))
            .at(path.display().to_string())
            .help("may it be written?")
    })
}

/// Writes the page, the finding and the motion that would settle a doubt into a folder.
fn keep(investigation: &mut Investigation, folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| {
        Failure::input("io::write", format!("cannot make {}: {error}", folder.display()))
            .at(folder.display().to_string())
            .help("name a folder that may be written with `--out DIR`")
    })?;
    if let Some(csv) = &investigation.experiment {
        let path = folder.join("next.csv");
        write(&path, csv)?;
        if let Some(next) = &mut investigation.finding.next_experiment {
            next.commands = Some(path.display().to_string());
        }
    }
    write(&folder.join("gap.html"), &report::gap_page::page(investigation))?;
    let json = serde_json::to_string_pretty(&investigation.finding)
        .map_err(|error| Failure::input("json", error.to_string()))?;
    write(&folder.join("gap.json"), &json)
}

/// Says what changes in the model file, and changes it if asked to.
fn change(
    finding: &mut Finding,
    path: &Path,
    file: &ModelFile,
    args: &GapArgs,
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
    if !args.apply || after == before {
        return Ok(());
    }
    // The old text first, so that there is always a way back.
    let mut undo = path.as_os_str().to_owned();
    undo.push(".before-gap");
    write(Path::new(&undo), before)?;
    write(path, &after)?;
    finding.model.applied = true;
    finding.notes.push(format!("{} holds the model as it was", Path::new(&undo).display()));
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

/// Reads a recording and the sidecar beside it; a folder is a run, whose recording is `arm.csv`.
fn recording_at(path: &Path, map: &Map) -> Result<Recording, Failure> {
    let inside;
    let path = if path.is_dir() {
        inside = path.join("arm.csv");
        inside.as_path()
    } else {
        path
    };
    let text = read(path)?;
    let beside = path.with_extension("json");
    let sidecar = if beside.is_file() { Some(read(&beside)?) } else { None };
    let beside = beside.display().to_string();
    let sidecar = sidecar.as_deref().map(|text| (beside.as_str(), text));
    Recording::read(&path.display().to_string(), &text, sidecar, map)
        .map_err(|error| failure(&error))
}

/// Finds the robot: as told, as the first sidecar says, or the stdlib's.
fn robot_of(args: &GapArgs, recordings: &[Recording]) -> Result<Robot, Failure> {
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

/// Words a mistake in a recording.
fn failure(error: &recording::Error) -> Failure {
    Failure::input("gap::recording", error.what.clone()).at(&error.place).help(&error.help)
}
