//! `trueup report RUN`: a run folder as one HTML page that needs nothing else.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use clap::Args;
use image::codecs::jpeg::JpegEncoder;

use crate::alignment::decode;
use crate::files::{self, write};
use crate::report::run_page::{Material, page};
use crate::report::{self, Failure, Style, kept};
use crate::workcell::archive;

use super::shared::Shared;
use crate::report::exit::Exit;

/// How finely pictures are kept, of 100: a page of a dozen steps stays in a mail.
const QUALITY: u8 = 80;

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
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    let graph = files::read::text(&dir.join("graph.svg")).ok();
    let frames = dir.join("frames");
    let picture = |name: &str| address(&frames.join(format!("{name}.png")));
    let material = Material { graph: graph.as_deref(), picture: Some(&picture) };
    write::replace(&args.output, page(&run, &material))
        .map_err(|error| Failure::unwritten(&args.output, &error))?;
    if style.json {
        style.document(&serde_json::json!({"page": args.output.display().to_string()}));
    } else {
        style.say(format!("{} in {}", run.task, args.output.display()));
    }
    Ok(Exit::Yes)
}

/// Returns a picture as an address that holds all of it; `None` when there is none to read.
fn address(path: &Path) -> Option<String> {
    let picture = decode::read(path).ok()?;
    let mut jpeg = Cursor::new(Vec::new());
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, QUALITY)).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg.get_ref())))
}
