//! `trueup lsp`: the language server on stdin and stdout.

use lsp_server::Connection;

use crate::lsp;
use crate::report::Failure;

use super::run::stdlib;
use super::{Cli, Exit};

/// `trueup lsp`.
pub(super) fn serve(cli: &Cli) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let (connection, threads) = Connection::stdio();
    let served = lsp::serve(&connection, &stdlib, cli.cell.stdlib.as_deref());
    // The threads end when the connection does.
    drop(connection);
    let joined = threads.join();
    served.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    joined.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    Ok(Exit::Yes)
}
