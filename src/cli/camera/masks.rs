//! `--masks`: who else makes masks, and what is said when they do not.

use clap::Args;
use image::RgbImage;

use crate::masks::{Error, Mask, Source, Where};
use crate::report::{Failure, Style};

use super::super::numbers;

#[derive(Debug, Args)]
pub(super) struct MasksArgs {
    /// Who else makes masks: a server, `http://HOST:PORT/PATH` (docs/seeing.md says what it is asked and answers), or a network in
    /// a file that ends in `.onnx`. The better mask is taken, ours or theirs, and it is said which.
    #[arg(long, value_name = "URL|FILE")]
    pub(super) masks: Option<String>,
    /// How long the server's answer may take, s.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = numbers::seconds, requires = "masks")]
    masks_timeout: f64,
}

/// Somebody who makes masks, with the name that was given.
pub(super) struct Asked {
    pub(super) name: String,
    source: Source,
}

/// Opens what was named, if anything was; says once where pictures go that leave this machine.
pub(super) fn opened(args: &MasksArgs, style: Style) -> Result<Option<Asked>, Failure> {
    let Some(name) = args.masks.clone() else { return Ok(None) };
    let source =
        Source::named(&name, args.masks_timeout).map_err(|error| failure(&error, &name))?;
    if let Source::Endpoint(endpoint) = &source
        && !endpoint.address().is_loopback()
    {
        let host = endpoint.address().host();
        style.note(&format!("the picture leaves this machine: it goes to {host}"));
    }
    Ok(Some(Asked { name, source }))
}

impl Asked {
    /// Asks for masks.
    pub(super) fn ask(&self, image: &RgbImage, places: &[Where]) -> Result<Vec<Mask>, Failure> {
        self.source.ask(image, places).map_err(|error| failure(&error, &self.name))
    }
}

/// Words why there are no masks.
fn failure(error: &Error, name: &str) -> Failure {
    let message = error.to_string();
    let failure = match error {
        Error::Unknown(_) | Error::NoAddress(_) => Failure::input("masks::source", message)
            .help("`--masks http://127.0.0.1:8000/masks`, or `--masks FILE.onnx`"),
        Error::Trouble { .. } => Failure::unavailable("masks::unavailable", message).help(
            "is the server running? examples/masks_server.py is one to copy; `--masks-timeout 300` waits longer for an answer",
        ),
        Error::Status { .. } => Failure::unavailable("masks::unavailable", message)
            .help("what the server says of it is in its own log"),
        Error::Answer { .. } | Error::Mask { .. } => Failure::unavailable("masks::answer", message)
            .help("what must come back is in docs/seeing.md; examples/masks_server.py sends it"),
        Error::NotBuilt => Failure::input("masks::not_built", message)
            .help("build it with `cargo build --release --features onnx`"),
        Error::Network { .. } => Failure::input("masks::network", message)
            .help("docs/seeing.md says which networks can be run, and how to export one"),
    };
    failure.at(name)
}
