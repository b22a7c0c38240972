//! `trueup export RUN`: a run folder as one file for other programs. No arm is asked.

use std::path::PathBuf;

use clap::Args;

use crate::files::{self, write};
use crate::report::export::{self, Material};
use crate::report::{self, Failure, Style, kept};
use crate::workcell::archive;

use super::inputs::data;
use super::shared::Shared;
use crate::report::exit::Exit;

/// Write a run folder as one file for other programs.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// A run folder, or the number or name of one in the folder of `--record`.
    run: PathBuf,
    /// An MCAP file for Foxglove, Rerun, ROS 2 and `trueup gap`: joints, gripper, scale, poses, pictures, steps, fluents.
    #[cfg(feature = "bags")]
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// A table: the arm's recording with the current step and every fluent as measured last.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Not written: Rerun opens the file of `--mcap`.
    #[arg(long, value_name = "FILE", hide = true)]
    rrd: Option<PathBuf>,
    /// Not written.
    #[arg(long, value_name = "FILE", hide = true)]
    mp4: Option<PathBuf>,
}

/// `trueup export RUN --mcap FILE --csv FILE`.
pub(super) fn export(args: &ExportArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    if args.rrd.is_some() {
        return Err(Failure::input("export::format", "RRD files are not written").help(
            "Rerun opens MCAP files: `trueup export RUN --mcap run.mcap`, `rerun run.mcap`",
        ));
    }
    if args.mp4.is_some() {
        return Err(Failure::input("export::format", "films are not written")
            .help("`trueup report RUN` shows the pictures on one page, `--mcap` hands them on"));
    }
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    // A run that ended before the arm was asked anything has none.
    let rows = dir.join("arm.csv");
    let arm = if rows.exists() { data(&rows)? } else { String::new() };
    let frames = dir.join("frames");
    let picture = |name: &str| {
        let path = frames.join(format!("{name}.png"));
        files::read::bytes(&path, files::read::DATA).ok()
    };
    let material = Material { run: &run, arm: &arm, picture: &picture };
    let wrong = |error: export::Error| {
        Failure::input("export::run", format!("{}: {error}", dir.display()))
            .help("a run folder as `trueup` writes it can be exported")
    };
    let mut written = Vec::new();
    let mut put = |path: &PathBuf, content: &[u8]| {
        write::replace(path, content).map_err(|error| Failure::unwritten(path, &error))?;
        written.push(path.display().to_string());
        Ok::<(), Failure>(())
    };
    #[cfg(feature = "bags")]
    if let Some(path) = &args.mcap {
        put(path, &export::bag(&material).map_err(wrong)?)?;
    }
    if let Some(path) = &args.csv {
        put(path, export::table(&material).map_err(wrong)?.as_bytes())?;
    }
    if written.is_empty() {
        return Err(Failure::input("usage", "`export` is not told what to write")
            .help("`trueup export RUN --mcap run.mcap` or `--csv run.csv`"));
    }
    if style.json {
        style.document(&serde_json::json!({"files": written}));
    } else {
        style.say(format!("{} in {}", run.task, written.join(" and ")));
    }
    Ok(Exit::Yes)
}
