//! Where sentences live: what is said to people stands where words are kept, apart from what decides.
//!
//! A literal of four words or more in a file that computes is a sentence that nobody finds when words change, and that
//! somebody may come to match on. Sentences stand in `report`, at the doors, in a room's `error.rs`, `wording.rs` or
//! `refusal.rs`, in an error's `Display`, or in a catalogue that is named here.

use std::fs;
use std::path::Path;

use super::layers::rust_files;

/// Rooms that speak to people, and files beside them that do nothing else.
const SPEAKING: &[&str] = &["report", "cli", "repl", "page", "language"];
const FILES: &[&str] = &["error.rs", "wording.rs", "refusal.rs"];
/// Tables of words, drawings that have words in them, and what writes the language.
const CATALOGUES: &[&str] = &[
    "discovery/vocabulary",
    "graph/draw",
    "graph/exchange/dot.rs",
    "kortex/frame.rs",
    "kortex/safety.rs",
    "scene/write.rs",
    "units/spelling.rs",
];
/// So many words are a sentence.
const SENTENCE: usize = 4;

#[test]
fn sentences_stand_where_words_are_kept() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut wrong, mut n_files) = (Vec::new(), 0);
    for path in rust_files(&src) {
        let inside = path.strip_prefix(&src).unwrap();
        let is_said_here = SPEAKING.iter().any(|room| inside.starts_with(room))
            || FILES.iter().any(|file| inside.ends_with(file))
            || CATALOGUES.iter().any(|place| inside.starts_with(place));
        if is_said_here {
            continue;
        }
        n_files += 1;
        let text = fs::read_to_string(&path).unwrap();
        for (line, literal) in sentences(&text) {
            wrong.push(format!("{}:{line}: {literal}", inside.display()));
        }
    }
    assert!(n_files > 300, "{n_files} files were read");
    assert!(wrong.is_empty(), "put these into `wording.rs` or `error.rs`:\n{}", wrong.join("\n"));
}

#[test]
fn a_sentence_is_found_and_what_is_none_is_not() {
    let found = |text: &str| sentences(text).len();
    assert_eq!(found("let a = \"this is one, and long\";"), 1);
    assert_eq!(found("let a = format!(\"{} is {} of {b} and {c} too\", 1, 2);"), 1);
    assert_eq!(found("let a = \"three words only\"; // \"a comment has as many as it wants\""), 0);
    assert_eq!(found("let a = \"t[s],q_1[rad],q_2[rad] a.b.c.d\"; let b = '\"';"), 0);
    assert_eq!(found("let a = r#\"it is \"quoted\" and long\"#;"), 1);
    assert_eq!(found("    #[error(\"it is what it says it is\")]\n    A,"), 0);
    assert_eq!(found("a.expect(\"what cannot be is not here\")"), 0);
    let display = "impl fmt::Display for A {\n    fn f() { \"it is what it says it is\" }\n}\n";
    assert_eq!(found(display), 0);
    assert_eq!(found(&format!("{display}const A: &str = \"it is what it says it is\";")), 1);
    assert_eq!(
        found("#[cfg(test)]\nmod tests { const A: &str = \"it is what it says it is\"; }"),
        0
    );
}

/// Returns the literals that are sentences, each with its line from 1.
fn sentences(text: &str) -> Vec<(usize, String)> {
    let program = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let mut found = Vec::new();
    for literal in literals(program) {
        let before = &program[..literal.from];
        // An `impl` at the margin ends with a brace at the margin.
        let at = before.rfind("\nimpl").map_or(0, |at| at + 1);
        let head = before[at..].lines().next().unwrap_or_default();
        let is_display = head.contains("Display for") && !before[at..].contains("\n}");
        let open = before.rfind("#[").max(before.rfind("#![")).map_or("", |at| &before[at..]);
        let depth = open.chars().fold(0_i32, |depth, c| match c {
            '[' => depth + 1,
            ']' => depth - 1,
            _ => depth,
        });
        let call = before.trim_end();
        let line = before.lines().last().unwrap_or_default();
        let is_for_developers = line.contains("assert!(")
            || ["expect(", "unreachable!(", "panic!("].iter().any(|c| call.ends_with(c));
        if is_display || depth > 0 || is_for_developers || words(literal.text) < SENTENCE {
            continue;
        }
        found.push((before.matches('\n').count() + 1, literal.text.to_owned()));
    }
    found
}

/// Returns how many words a literal has, without what stands in braces.
fn words(literal: &str) -> usize {
    let mut depth = 0_i32;
    let kept: String = literal
        .chars()
        .filter(|c| {
            depth += match c {
                '{' => 1,
                '}' => -1,
                _ => 0,
            };
            depth == 0 && *c != '}'
        })
        .collect();
    let is_word = |token: &&str| {
        let bare = token.trim_matches(['.', ',', ';', ':', '?', '!', '(', ')', '`', '\'']);
        bare.len() > 1 && bare.chars().all(|c| c.is_alphabetic() || c == '-' || c == '\'')
    };
    kept.split_whitespace().filter(is_word).count()
}

struct Literal<'a> {
    /// Where its first quotation mark stands, bytes.
    from: usize,
    text: &'a str,
}

/// Returns the string literals of a program; comments, characters and lifetimes are passed over.
fn literals(program: &str) -> Vec<Literal<'_>> {
    let bytes = program.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                at += program[at..].find('\n').unwrap_or(bytes.len() - at);
            }
            b'\'' => {
                // `'a'`, `'\n'` and `'"'` are characters, `'a` is a lifetime.
                let is_escape = bytes.get(at + 1) == Some(&b'\\');
                let close = program[at + 1..].char_indices().nth(1).map(|(i, _)| at + 1 + i);
                at = match close {
                    _ if is_escape => at + 3 + program[at + 3..].find('\'').unwrap_or(0),
                    Some(close) if bytes[close] == b'\'' => close,
                    _ => at,
                } + 1;
            }
            b'r' if program[at + 1..].trim_start_matches('#').starts_with('"')
                && !program[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') =>
            {
                let marks = program[at + 1..].find('"').unwrap_or(0);
                let from = at + 1 + marks;
                let end = format!("\"{}", "#".repeat(marks));
                let len = program[from + 1..].find(&end).unwrap_or(0);
                found.push(Literal { from, text: &program[from + 1..from + 1 + len] });
                at = from + 1 + len + end.len();
            }
            b'"' => {
                let mut end = at + 1;
                while end < bytes.len() && bytes[end] != b'"' {
                    end += if bytes[end] == b'\\' { 2 } else { 1 };
                }
                let end = end.min(bytes.len());
                found.push(Literal { from: at, text: &program[at + 1..end] });
                at = end + 1;
            }
            _ => at += 1,
        }
    }
    found
}
