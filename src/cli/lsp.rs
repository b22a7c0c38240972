//! `trueup lsp`: the language server on stdin and stdout.

use std::path::PathBuf;

use lsp_server::Connection;

use crate::lsp;
use crate::report::Failure;

use super::cell::stdlib;
use super::shared::Shared;
use crate::report::exit::Exit;

/// `trueup lsp`.
pub(super) fn serve(cli: &Shared) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let (connection, threads) = Connection::stdio();
    let places = lsp::Places { folder: cli.cell.stdlib.clone(), cache: cache() };
    let served = lsp::serve(&connection, &stdlib, places);
    // The threads end when the connection does.
    drop(connection);
    let joined = threads.join();
    served.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    joined.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    Ok(Exit::Yes)
}

/// Returns the folder for copies of the embedded stdlib: one for each version of the program.
fn cache() -> Option<PathBuf> {
    let caches = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    Some(caches.join("trueup").join(concat!("stdlib-", env!("CARGO_PKG_VERSION"))))
}
