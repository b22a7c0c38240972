//! `trueup runs`: runs that are kept, listed, told again, compared, written as a page. No arm is asked.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::json;

use crate::report::{self, Failure, Style, kept};

use super::replay::{ReplayArgs, replay};
use super::report::{ReportArgs, report};
use super::shared::Shared;
use crate::report::exit::Exit;

/// Runs that are kept in the folder of `--record`.
#[derive(Debug, Args)]
pub(super) struct RunsArgs {
    #[command(subcommand)]
    what: Option<What>,
}

#[derive(Debug, Subcommand)]
enum What {
    /// List those in the folder of `--record`, the oldest first.
    #[command(visible_alias = "list")]
    Ls,
    /// Tell one again, as `replay` does.
    Show(ReplayArgs),
    /// Say what was different in two.
    #[command(visible_alias = "compare")]
    Diff(DiffArgs),
    /// Write one as a page, as `report` does.
    Export(ReportArgs),
}

#[derive(Debug, Args)]
struct DiffArgs {
    /// A run: its folder, or its number or name in the folder of `--record`.
    first: PathBuf,
    /// Another.
    second: PathBuf,
}

/// `trueup runs [ls|show|diff|export]`.
pub(super) fn runs(args: &RunsArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    match &args.what {
        None | Some(What::Ls) => {
            kept::check(&cli.cell.record)?;
            let list = kept::list(&cli.cell.record, None);
            if style.json {
                style.document(&list.document);
            }
            style.say(list.words);
            Ok(Exit::Yes)
        }
        Some(What::Show(args)) => replay(args, cli, style),
        Some(What::Export(args)) => report(args, cli, style),
        Some(What::Diff(args)) => diff(args, cli, style),
    }
}

fn diff(args: &DiffArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let mut both = Vec::new();
    for (wanted, number) in [(&args.first, 1), (&args.second, 2)] {
        let dir = kept::folder(&cli.cell.record, wanted)?;
        let run = crate::workcell::archive::load(&dir)
            .map_err(|error| report::cell_failure(&error, style))?;
        // A run outside of the folder has no number; it is called by its place on the line.
        let entries = crate::workcell::archive::entries(&cli.cell.record);
        let its = entries.iter().find(|entry| entry.dir == dir).map_or(number, |e| e.number);
        both.push((its, run));
    }
    let ((a, first), (b, second)) = (&both[0], &both[1]);
    let lines = report::record::difference((*a, first), (*b, second));
    if style.json {
        style.document(&json!({"runs": [a, b], "differences": lines[2..]}));
    }
    style.say(lines.join("\n"));
    Ok(Exit::Yes)
}
