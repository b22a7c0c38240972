//! What a sentence comes to, in words.

use std::fmt::Write as _;

use crate::language::sentence::{Meaning, Understood};

/// Words what a sentence comes to, as the command line and the prompt tell it.
pub fn told(meaning: &Meaning) -> String {
    match meaning {
        Meaning::Clear(found) => understood(found),
        Meaning::Ambiguous { question, choices } => {
            let mut text = question.clone();
            for (i, choice) in choices.iter().enumerate() {
                let _ = write!(text, "\n  {}  {}", i + 1, choice.text);
            }
            text
        }
        Meaning::Asked { line, .. } => format!("= {line}"),
        Meaning::Impossible { why, help } => {
            let help = help.as_ref().map(|help| format!("\n  {help}")).unwrap_or_default();
            format!("not possible: {why}{help}")
        }
        Meaning::Unknown { help } => format!("no task has a sentence like it\n  {help}"),
    }
}

/// Words a call that a model proposed.
pub fn proposed(call: &str) -> String {
    format!(
        "= {call}\n  proposed by the model, since no task has a sentence like it; nothing is done by itself"
    )
}

fn understood(found: &Understood) -> String {
    let mut text = format!("= {}", found.text);
    for (slot, said, value) in &found.slots {
        let _ = write!(text, "\n  {slot}: \"{said}\" is {value}");
    }
    for default in &found.defaults {
        let _ = write!(text, "\n  {default}, since nothing else was said");
    }
    if !found.template.is_empty() {
        let _ = write!(text, "\n  by the sentence \"{}\"", found.template);
    }
    text
}
