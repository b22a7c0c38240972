//! `trueup align`: the three regressions on files.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::report::{Failure, Style};

use super::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum AlignCommand {
    /// Regression 1: the map between real and twin pixels.
    Map(AlignArgs),
}

#[derive(Debug, Args)]
pub(super) struct AlignArgs {
    /// The pairs.
    file: PathBuf,
}

pub(super) fn align(_command: &AlignCommand, _style: &Style) -> Result<Exit, Failure> {
    Err(Failure::unavailable("align::missing", "not here yet"))
}
