//! `trueup report RUN`: a run folder as one HTML page that needs nothing else.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use clap::Args;
use image::codecs::jpeg::JpegEncoder;

use crate::report::run_page::{Material, page};
use crate::report::{self, Failure, Style, kept};
use crate::workcell::archive;

use super::{Cli, Exit};

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
pub(super) fn report(args: &ReportArgs, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    let graph = std::fs::read_to_string(dir.join("graph.svg")).ok();
    let frames = dir.join("frames");
    let picture = |name: &str| address(&frames.join(format!("{name}.png")));
    let material = Material { graph: graph.as_deref(), picture: Some(&picture) };
    std::fs::write(&args.output, page(&run, &material)).map_err(|error| {
        Failure::input("io::write", format!("cannot write the page: {error}"))
            .at(args.output.display().to_string())
    })?;
    if style.json {
        style.document(&serde_json::json!({"page": args.output.display().to_string()}));
    } else {
        style.say(format!("{} in {}", run.task, args.output.display()));
    }
    Ok(Exit::Yes)
}

/// Returns a picture as an address that holds all of it; `None` when there is none to read.
fn address(path: &Path) -> Option<String> {
    let picture = image::open(path).ok()?.to_rgb8();
    let mut jpeg = Cursor::new(Vec::new());
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, QUALITY)).ok()?;
    Some(format!("data:image/jpeg;base64,{}", base64(jpeg.get_ref())))
}

/// Writes bytes as RFC 4648 says.
fn base64(bytes: &[u8]) -> String {
    const SIGNS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let all = at(0) << 16 | at(1) << 8 | at(2);
        for sign in 0..4 {
            if sign <= three.len() {
                text.push(char::from(SIGNS[(all >> (18 - 6 * sign) & 63) as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::base64;

    /// The test vectors of RFC 4648, section 10.
    #[test]
    fn bytes_are_written_as_the_standard_says() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in vectors {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
