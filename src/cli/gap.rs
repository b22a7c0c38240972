//! `trueup gap`: what the model lacks, from recordings.

use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use crate::discovery::finding::{Finding, Verdict};
use crate::discovery::recording::{self, Map, Recording};
use crate::discovery::{Options, Subject, investigate};
use crate::motion::Robot;
use crate::report::{self, Failure, Style};

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
    let robot = robot_of(args, &recordings)?;
    let options = Options { holdout: args.holdout, ..Options::default() };
    let bar = bar(style);
    let mut progress = |what: &str, part: f64| {
        if let Some(bar) = &bar {
            bar.set_message(what.to_owned());
            bar.set_position((part * 100.0) as u64);
        }
    };
    let finding = investigate(&recordings, Subject::Arm(&robot), &options, &mut progress);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let finding = finding.map_err(|error| failure(&error))?;
    tell(&finding, style);
    Ok(Exit::Yes)
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

/// Returns whether a verdict names everything it found.
#[expect(dead_code, reason = "for `--apply`")]
fn is_settled(finding: &Finding) -> bool {
    matches!(finding.verdict, Verdict::Named | Verdict::Several)
}
