//! Whether a real arm may move: said on the command line, or typed by who sees it.

use std::io::{self, BufRead, IsTerminal};

use crate::files;
use crate::report::{Failure, complain};

use super::shared::CellArgs;

/// Asks whether the arm may move, unless that was said on the command line.
pub(super) fn confirm(arm: &str, args: &CellArgs) -> Result<(), Failure> {
    if args.yes {
        return Ok(());
    }
    let stopped = || {
        Failure::stopped("motion not confirmed")
            .at(arm.to_owned())
            .help("make sure that no person is in its reach, then type `move` when asked, or give `--yes`")
    };
    if !io::stdin().is_terminal() {
        return Err(stopped());
    }
    // What was typed while the cell was opened answers nothing that was asked.
    files::read::forget_typed();
    complain(&format!(
        "{arm} will move, at {:.0} % of its limits at most. Is its reach clear? Type `move`:",
        args.speed * 100.0
    ));
    let mut line = String::new();
    match io::stdin().lock().read_line(&mut line) {
        Ok(_) if line.trim() == "move" => Ok(()),
        _ => Err(stopped()),
    }
}
