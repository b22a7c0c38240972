//! `trueup replay RUN`: a run again from its record, without an arm.

use std::path::PathBuf;

use clap::Args;

use crate::report::{self, Failure, Style, kept};
use crate::workcell::archive;

use super::shared::Shared;
use crate::report::exit::Exit;

/// Tell a recorded run again, without an arm.
#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// A run folder, or the number or name of one in the folder of `--record`.
    run: PathBuf,
    /// Only this step, with everything known after it.
    #[arg(long, value_name = "N")]
    step: Option<usize>,
}

/// `trueup replay RUN [--step N]`.
pub(super) fn replay(args: &ReplayArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    let told = report::record::again((&dir.display().to_string(), &dir), &run, args.step, style)?;
    if style.json {
        match args.step.and_then(|wanted| run.steps.iter().find(|step| step.number == wanted)) {
            Some(step) => style.document(step),
            None => style.document(&run),
        }
    } else {
        style.say(told);
    }
    Ok(Exit::Yes)
}
