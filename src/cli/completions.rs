//! `trueup completions SHELL`: a script with which a shell completes commands and options.

use clap::Args;
use clap_complete::Shell;
use serde_json::json;

use crate::report::{self, Style};

use super::guide;
use crate::report::exit::Exit;

/// Write a script with which a shell completes commands and options.
#[derive(Debug, Args)]
pub(super) struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// `trueup completions bash`.
pub(super) fn completions(args: &CompletionsArgs, style: Style) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut guide::offering(), "trueup", &mut script);
    let script = String::from_utf8_lossy(&script);
    if style.json {
        style.document(&json!({"shell": args.shell.to_string(), "script": script}));
    } else {
        report::out(script.trim_end());
    }
    Exit::Yes
}
