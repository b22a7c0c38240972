//! `trueup report RUN`: a run folder as one HTML page that needs nothing else.

use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use clap::Args;

use crate::alignment::decode;
use crate::files::{self, write};
use crate::report::run_page::{Material, page};
use crate::report::{self, Failure, Style, kept};
use crate::trace::jpeg;
use crate::workcell::{Run, archive, film, picture};

use super::inputs::{arm_rows, spare};
use super::shared::Shared;
use crate::report::exit::Exit;

/// Write a run folder as one HTML page.
#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// A run folder, or the number or name of one in the folder of `--record`.
    run: PathBuf,
    /// The page.
    #[arg(short, long, value_name = "FILE", default_value = "report.html")]
    output: PathBuf,
}

/// `trueup report RUN [-o report.html]`.
pub(super) fn report(args: &ReportArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    spare(&args.output, &["html", "htm"])?;
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    write::replace(&args.output, whole(&dir, &run))
        .map_err(|error| Failure::unwritten(&args.output, &error))?;
    if style.json {
        style.document(&serde_json::json!({"page": args.output.display().to_string()}));
    } else {
        style.say(format!("{} in {}", run.task, args.output.display()));
    }
    Ok(Exit::Yes)
}

/// Returns the page of the run in a folder.
pub(super) fn whole(dir: &Path, run: &Run) -> String {
    let graph = files::read::text(&dir.join("graph.svg")).ok();
    let picture = |name: &str| address(&picture::file(dir, name));
    let arm = arm_rows(&dir.join("arm.csv")).unwrap_or_default();
    let film = film::read(dir);
    page(run, &Material { graph: graph.as_deref(), arm: &arm, film, picture: Some(&picture) })
}

/// Returns a picture as an address that holds all of it; `None` when there is none to read.
fn address(path: &Path) -> Option<String> {
    let file = files::read::bytes(path, files::read::DATA).ok()?;
    // Runs of earlier versions have PNG files, thirty times as large.
    let file =
        if file.starts_with(b"\x89PNG") { jpeg(&decode::decoded(&file).ok()?) } else { file };
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(file)))
}
