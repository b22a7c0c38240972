//! `trueup lsp`: the language server on stdin and stdout.
//!
//! A message that cannot be read is refused as JSON-RPC says, and the next is heard; `lsp-server`'s own pipes end there.

use std::io::{self, BufRead, ErrorKind, Read as _, Write as _};
use std::panic::resume_unwind;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};

use lsp_server::{Connection, ErrorCode, Message};
use serde_json::json;

use crate::lsp;
use crate::report::Failure;

use super::cell::stdlib;
use super::shared::Shared;
use crate::report::exit::Exit;

/// `trueup lsp`.
pub(super) fn serve(cli: &Shared) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let (editor, connection) = Connection::memory();
    let Connection { sender, receiver } = editor;
    let writer = thread::spawn(move || {
        receiver.into_iter().try_for_each(|message| message.write(&mut io::stdout().lock()))
    });
    let reader = thread::spawn(move || {
        hear(&mut io::stdin().lock(), |message| sender.send(message).is_ok())
    });
    let places = lsp::Places { folder: cli.cell.stdlib.clone(), cache: cache() };
    let served = lsp::serve(&connection, &stdlib, places);
    // The writer ends when nothing can be sent any more.
    drop(connection);
    let joined = ended(reader).and(ended(writer));
    served.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    joined.map_err(|error| Failure::input("lsp::protocol", error.to_string()))?;
    Ok(Exit::Yes)
}

fn ended(thread: JoinHandle<io::Result<()>>) -> io::Result<()> {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// Passes on what the editor says, until it says goodbye, goes away, or nobody listens any more.
fn hear(from: &mut impl BufRead, mut pass_on: impl FnMut(Message) -> bool) -> io::Result<()> {
    while let Some(body) = framed(from)? {
        match serde_json::from_slice(&body) {
            Ok(message) => {
                let is_exit = matches!(&message, Message::Notification(n) if n.method == "exit");
                if !pass_on(message) || is_exit {
                    break;
                }
            }
            Err(error) => refuse(&error)?,
        }
    }
    Ok(())
}

/// Reads one message behind its header, `None` at the end.
fn framed(from: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut length: Option<usize> = None;
    loop {
        let mut line = String::new();
        if from.read_line(&mut line)? == 0 {
            return Ok(None);
        }
        let header = line.trim();
        if header.is_empty() {
            break;
        }
        if let Some((name, value)) = header.split_once(':')
            && name.eq_ignore_ascii_case("Content-Length")
        {
            length = value.trim().parse().ok();
        }
    }
    let lost = |what: &str| io::Error::new(ErrorKind::InvalidData, what);
    let length = length.ok_or_else(|| lost("a message has no Content-Length"))?;
    let mut body = Vec::new();
    if from.take(length as u64).read_to_end(&mut body)? < length {
        return Err(lost("a message ends early"));
    }
    Ok(Some(body))
}

/// Tells the editor that a message cannot be read; it answers no request by number.
fn refuse(error: &serde_json::Error) -> io::Result<()> {
    let code = if error.is_data() { ErrorCode::InvalidRequest } else { ErrorCode::ParseError };
    let why = json!({"code": code as i32, "message": error.to_string()});
    let said = json!({"jsonrpc": "2.0", "id": null, "error": why}).to_string();
    let mut out = io::stdout().lock();
    write!(out, "Content-Length: {}\r\n\r\n{said}", said.len())?;
    out.flush()
}

/// Returns the folder for copies of the embedded stdlib: one for each version of the program.
fn cache() -> Option<PathBuf> {
    let caches = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    Some(caches.join("trueup").join(concat!("stdlib-", env!("CARGO_PKG_VERSION"))))
}
