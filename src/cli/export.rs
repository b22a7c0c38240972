//! `trueup export RUN`: a run folder as one file for other programs, or as a film. No arm is asked.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::alignment::decode;
use crate::discovery::recording::Sidecar;
use crate::discovery::recording::sidecar::is_exported;
use crate::files::{self, write};
use crate::report::export::{self, Material};
use crate::report::film::Seen;
use crate::report::{self, Failure, Style, kept};
use crate::workcell::links::Links;
use crate::workcell::{Run, archive, carried, film, picture, record};

use super::cell;
use super::inputs::{arm_rows, spare};
use super::shared::Shared;
use crate::report::exit::Exit;

/// Write a run folder as a film, or as one file for other programs.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// A run folder, or the number or name of one in the folder of `--record`.
    run: PathBuf,
    /// An MCAP file for Foxglove, ROS 2 and `trueup gap`: joints, gripper, scale, poses, pictures, steps, fluents.
    #[cfg(feature = "bags")]
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// A table: the arm's recording with the current step and every fluent as measured last; beside it, in a JSON file, what
    /// the run says of it (`gap` reads both).
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// An RRD file for Rerun: as `--mcap`, and the arm's links, margins and what was said. For the links, `--scene` says which
    /// scene the run was made in, where its file is not where it was.
    #[cfg(feature = "arrow")]
    #[arg(long, value_name = "FILE")]
    rrd: Option<PathBuf>,
    /// A film for browsers and players: camera beside twin, with the step, the fluents and the water below. A run behind a
    /// bridge has the camera when it was run with `--live`.
    #[arg(long, value_name = "FILE")]
    mp4: Option<PathBuf>,
}

impl ExportArgs {
    /// Returns the files that are wanted, each with the ending that says what it is.
    fn wanted(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let files = [
            #[cfg(feature = "bags")]
            ("mcap", &self.mcap),
            #[cfg(feature = "arrow")]
            ("rrd", &self.rrd),
            ("csv", &self.csv),
            ("mp4", &self.mp4),
        ];
        files.into_iter().filter_map(|(ending, file)| Some((ending, file.as_ref()?)))
    }
}

/// `trueup export RUN --mp4 FILE --mcap FILE --rrd FILE --csv FILE`.
pub(super) fn export(args: &ExportArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    // All names before any file: what is refused leaves nothing behind.
    args.wanted().try_for_each(|(ending, path)| spare(path, &[ending]))?;
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    // A run that ended before the arm was asked anything has none.
    let rows = dir.join("arm.csv");
    let arm = if rows.exists() { arm_rows(&rows)? } else { String::new() };
    let picture =
        |name: &str| files::read::bytes(&picture::file(&dir, name), files::read::DATA).ok();
    let film = film::read(&dir);
    let still = |number: usize, whose: &str| {
        files::read::bytes(&film::picture(&dir, number, whose), files::read::DATA).ok()
    };
    // A run that was cut off may have none.
    let events = files::read::text_of(&dir.join(record::EVENTS), files::read::DATA);
    let links = links(args, cli, &run, style)?;
    let told = told(args, cli, (&run, arm.as_str()), style);
    let material = Material {
        run: &run,
        arm: &arm,
        picture: &picture,
        film: &film,
        still: &still,
        events: &events.unwrap_or_default(),
        links: links.as_ref(),
        sidecar: told.as_deref(),
    };
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
    #[cfg(feature = "arrow")]
    if let Some(path) = &args.rrd {
        put(path, &export::rrd(&material).map_err(wrong)?)?;
    }
    if let Some(path) = &args.csv {
        put(path, export::table(&material).map_err(wrong)?.as_bytes())?;
        if let Some((beside, text)) = beside(path, told.as_deref(), style) {
            put(&beside, text.as_bytes())?;
        }
    }
    if let Some(path) = &args.mp4 {
        let moving = moving(&dir, &run, &film).ok_or_else(|| {
            Failure::input("export::pictures", format!("{}: no pictures", dir.display()))
                .help("a run that moved the arm has them; `trueup runs` lists what is kept")
        })?;
        put(path, &moving)?;
        let is_filmed = |moment: &film::Moment| film::picture(&dir, moment.number, "real").exists();
        if !film.moments.is_empty() && !film.moments.iter().any(is_filmed) {
            style.note(report::film::ONLY_THE_TWIN);
        }
    }
    if written.is_empty() {
        return Err(Failure::input("usage", "no file to write is named")
            .help("`trueup export RUN --mp4 run.mp4`, `--rrd run.rrd`, `--mcap run.mcap` or `--csv run.csv`"));
    }
    if style.json {
        style.document(&serde_json::json!({"files": written}));
    } else {
        style.say(format!("{} in {}", run.task, written.join(" and ")));
    }
    Ok(Exit::Yes)
}

/// Returns what the run says of the arm's recording, for the files that `gap` reads.
fn told(args: &ExportArgs, cli: &Shared, (run, arm): (&Run, &str), style: Style) -> Option<String> {
    let is_read = args.wanted().any(|(ending, _)| matches!(ending, "csv" | "mcap"));
    if arm.is_empty() || !is_read {
        return None;
    }
    let options = cell::options(&cell::of_run(cli, run), None).ok();
    let found = options.and_then(|options| carried::told(run, arm, options).ok().flatten());
    if found.is_none() {
        style.note(
            "what the hand carried is left out: arm and scene are not this run's; `--scene FILE` or `--stdlib FOLDER` says which",
        );
    }
    found.map(|told| told.text())
}

/// Returns the file beside a table in which `gap` looks for what is known of it, and what belongs into it. What another
/// program or person wrote there stays.
fn beside(table: &Path, told: Option<&str>, style: Style) -> Option<(PathBuf, String)> {
    table.extension()?;
    let path = table.with_extension("json");
    let is_there = path.exists();
    if is_there && !files::read::text(&path).is_ok_and(|text| is_exported(&text)) {
        let (path, table) = (path.display(), table.display());
        style.note(&format!(
            "{path} is there, and no export wrote it: it stays, and `gap {table}` reads it; another name for the table gives \
             it a file of its own"
        ));
        return None;
    }
    // What an earlier export said there is of another run.
    let text = told.map(str::to_owned).or_else(|| is_there.then(|| Sidecar::default().text()))?;
    Some((path, text))
}

/// Returns where the arm's links are, for a file that has a place for them.
#[cfg(feature = "arrow")]
fn links(
    args: &ExportArgs,
    cli: &Shared,
    run: &Run,
    style: Style,
) -> Result<Option<Links>, Failure> {
    if args.rrd.is_none() {
        return Ok(None);
    }
    let found = Links::of(run, cell::options(&cell::of_run(cli, run), None)?)
        .map_err(|error| report::cell_failure(&error, style))?;
    if found.is_none() {
        style.note(
            "the arm's links are left out: arm and scene are not this run's; `--scene FILE` or `--stdlib FOLDER` says which",
        );
    }
    Ok(found)
}

/// As there: without that file, nobody asks.
#[cfg(not(feature = "arrow"))]
#[expect(clippy::unnecessary_wraps, reason = "as the other, which may fail")]
fn links(_: &ExportArgs, _: &Shared, _: &Run, _: Style) -> Result<Option<Links>, Failure> {
    Ok(None)
}

/// Returns the film of a run.
fn moving(dir: &Path, run: &Run, film: &film::Film) -> Option<Vec<u8>> {
    let picture = |seen: Seen, whose: &str| {
        let path = match seen {
            Seen::Moment(number) => film::picture(dir, number, whose),
            Seen::After(number) => picture::file(dir, &picture::after(number, whose)),
        };
        decode::read(&path).ok()
    };
    report::film::mp4(&report::film::Material { run, film, picture: &picture })
}
