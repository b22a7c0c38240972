//! The language as a whole: texts in, trees and diagnostics out.

mod assist;
mod diagnostics;
mod forms;
mod habits;
mod layout;
mod meanings;
mod mistakes;
mod model;
mod reading;
mod robust;
mod script_words;
mod sentences;
mod stdlib;

use trueup::language::{Library, Source};

/// Returns code, message and help of everything wrong with a text beside the standard library.
fn checked(text: &str) -> Vec<(&'static str, String, String)> {
    let mut library = Library::standard();
    let file = library.add(Source::new("mine.task", text));
    let found = library.check_file(file, &library.scope("kitchen"));
    found.into_iter().map(|d| (d.code, d.message, d.help.unwrap_or_default())).collect()
}

/// Each text with the code, the message and the help of the first thing that is told about it.
fn each_is_told(cases: &[(&str, &str, &str, &str)]) {
    for (text, code, message, help) in cases {
        let found = checked(text);
        let first = found.first().unwrap_or_else(|| panic!("nothing is told about `{text}`"));
        let told = (first.0, first.1.as_str(), first.2.as_str());
        assert_eq!(told, (*code, *message, *help), "{text}");
    }
}
