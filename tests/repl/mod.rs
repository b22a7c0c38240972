//! Transcripts: what is typed at the prompt, and what it answers.
//!
//! A transcript is a text file as a terminal would show it: lines after `lab> ` and ` ... ` are typed, the
//! others are answers, stdout and stderr as they come. `TRUEUP_TRANSCRIPTS=write` writes the answers anew;
//! read them as closely as code. A first line `// with --flag …` gives the program arguments.

mod kept;
mod survive;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::Desk;

/// Asking for this has a known answer, which shows where the answer before it ends.
const MARK: &str = "?end-of-answer";

/// What a typed line begins with.
const PROMPTS: [&str; 2] = ["lab>", "twin>"];

/// The arguments that a transcript's first line asks for.
fn arguments(transcript: &str) -> Vec<&str> {
    let first = transcript.lines().next().unwrap_or_default();
    first.strip_prefix("// with ").map_or_else(Vec::new, |args| args.split(' ').collect())
}

fn transcripts() -> Vec<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/repl");
    let mut found: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "txt"))
        .collect();
    found.sort();
    found
}

/// What is typed in a transcript: statements of one line or several.
fn typed(transcript: &str) -> Vec<Vec<String>> {
    let mut statements: Vec<Vec<String>> = Vec::new();
    for line in transcript.lines() {
        let first = PROMPTS.iter().find_map(|prompt| line.strip_prefix(prompt));
        if let Some(first) = first {
            statements.push(vec![first.trim_start().to_owned()]);
        } else if let Some(next) = line.strip_prefix(" ... ") {
            statements.last_mut().expect("a statement begins with `lab>`").push(next.to_owned());
        }
    }
    statements
}

/// Types the statements at a prompt and returns the transcript, each answer ending with a newline.
fn play(desk: &Desk, args: &[&str], statements: &[Vec<String>]) -> String {
    let mut input = format!("{MARK}\n");
    for statement in statements {
        writeln!(input, "{}\n{MARK}", statement.join("\n")).unwrap();
    }
    let said = desk.typed(args, &input);
    assert_eq!(said.code, 0, "{}", said.out);
    assert!(!said.out.contains("panicked") && !said.out.contains('\x1b'), "{}", said.out);
    // What the mark is answered with, learnt from the first one.
    let end = "lists what can be called\n";
    let at = said.out.find(end).unwrap() + end.len();
    let (mark, mut rest) = said.out.split_at(at);
    let mut transcript = String::new();
    if !args.is_empty() {
        writeln!(transcript, "// with {}", args.join(" ")).unwrap();
    }
    let prompt = if args.contains(&"twin") { PROMPTS[1] } else { PROMPTS[0] };
    for statement in statements {
        writeln!(transcript, "{prompt} {}", statement.join("\n ... ")).unwrap();
        let (answer, after) = match rest.split_once(mark) {
            Some(parts) => parts,
            // After `:quit` nobody answers.
            None => (rest, ""),
        };
        transcript += answer;
        if !answer.is_empty() && !answer.ends_with('\n') {
            transcript.push('\n');
        }
        rest = after;
    }
    assert_eq!(rest, "", "an answer that nobody asked for");
    transcript
}

#[test]
fn transcripts_are_answered_as_written() {
    let write = std::env::var_os("TRUEUP_TRANSCRIPTS").is_some_and(|value| value == "write");
    let files = transcripts();
    assert!(files.len() >= 25, "{} transcripts", files.len());
    let mut wrong = String::new();
    for file in files {
        let expected = fs::read_to_string(&file).unwrap();
        let statements = typed(&expected);
        assert!(!statements.is_empty(), "{} types nothing", file.display());
        // Each on a desk of its own: what one keeps, another does not find.
        let desk = Desk::new("repl-transcripts");
        kept::lay_out(&desk);
        let played = play(&desk, &arguments(&expected), &statements);
        if write {
            fs::write(&file, &played).unwrap();
        } else if played != expected {
            let name = file.file_name().unwrap().display();
            write!(wrong, "--- {name}, expected\n{expected}--- answered\n{played}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Input that ends in the middle of a call is a mistake that is told, not a call that is waited for.
#[test]
fn input_that_ends_too_early_is_told() {
    let said = Desk::new("repl-end").typed(&[], "pour(jar,\n");
    assert_eq!(said.code, 0);
    assert!(said.out.contains("never closed"), "{}", said.out);
}

/// Neither nothing nor noise nor a thousand lines bring the prompt down.
#[test]
fn the_prompt_outlives_what_is_typed() {
    let desk = Desk::new("repl-noise");
    assert_eq!(desk.typed(&[], "").out, "");
    let noise =
        "?\n:\n::\n: help\n? pour\n)\n(\n)\n\u{1f600}\nlab> :tasks\n//\nlab>\npour\npour(\n)\n\t\n";
    let said = desk.typed(&[], &format!("{noise}:help\n"));
    assert_eq!(said.code, 0, "{}", said.out);
    assert!(!said.out.contains("panicked"), "{}", said.out);
    assert!(said.out.contains("Ctrl-C"), "`:help` at the end is still answered: {}", said.out);
    let many = ":objects\n".repeat(300);
    assert_eq!(desk.typed(&[], &many).out.matches("not seen yet").count(), 600);
}
