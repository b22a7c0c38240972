//! What is wrong with a line that is no answer: whether it ends too early, at which key it is wrong, and how it begins.

use serde_json::{Map, Value};

use super::check::no_number;
use super::error::Error;

/// So much of a line is shown, characters.
const SHOWN: usize = 80;

/// Refuses a list: whoever reads objects takes it for one whose keys are left out.
pub(super) fn no_object(line: &[u8], request: &'static str) -> Option<Error> {
    let is_list = line.trim_ascii_start().starts_with(b"[");
    is_list.then_some(Error::List { request, key: None })
}

/// Returns what is wrong with a line that could not be read.
pub(super) fn unread(line: &[u8], request: &'static str, error: &serde_json::Error) -> Error {
    if let Some(error) = no_number(line, request) {
        return error;
    }
    let begins = beginning(line);
    if error.is_eof() {
        return Error::CutShort { request, begins };
    }
    let told: Map<String, Value> = serde_json::from_slice(line).unwrap_or_default();
    if request == "hello" && told.get("camera").is_some_and(Value::is_array) {
        return Error::List { request, key: Some("camera") };
    }
    let why = error.to_string();
    // What is missing is named, and is missing at the end.
    let key = if why.starts_with("missing") { None } else { last_key(line, &told, error.column()) };
    Error::Unfit { request, why, key, begins }
}

/// Returns the last key of an object before a column of its line.
fn last_key(line: &[u8], told: &Map<String, Value>, column: usize) -> Option<String> {
    let read = String::from_utf8_lossy(line.get(..column)?);
    let found = told.keys().filter_map(|key| Some((read.rfind(&format!("\"{key}\""))?, key)));
    found.max().map(|(_, key)| key.clone())
}

/// Returns how a line begins, without what a terminal would obey.
fn beginning(line: &[u8]) -> String {
    let text = String::from_utf8_lossy(line);
    let text = text.trim();
    let mut begins: String =
        text.chars().take(SHOWN).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(SHOWN).is_some() {
        begins.push('…');
    }
    begins
}
