//! Transcripts: what is typed at the prompt, and what it answers.
//!
//! A transcript is a text file as a terminal would show it: lines after `lab> ` and ` ... ` are typed, the
//! others are answers, stdout and stderr as they come. `TRUEUP_TRANSCRIPTS=write` writes the answers anew;
//! read them as closely as code. A first line `// with --flag …` gives the program arguments. Transcripts with
//! the same arguments are typed at one prompt, one after the other, but for those that begin with `// alone`.

pub(crate) mod kept;
mod lease;
mod quiz;
mod step;
mod survive;
mod terminal;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::Scratch;

/// Asking for this has a known answer, which shows where the answer before it ends.
const MARK: &str = "?end-of-answer";

/// Returns the prompt that a typed line begins with: `lab>`, `pour 3/8>`, `y/n/u>`.
pub(crate) fn prompt_of(line: &str) -> Option<&str> {
    let (prompt, _) = line.split_once('>')?;
    let is_prompt = prompt.starts_with(|c: char| c.is_ascii_lowercase())
        && !prompt.ends_with(' ')
        && prompt.chars().all(|c| c.is_ascii_alphanumeric() || " /_".contains(c));
    is_prompt.then(|| &line[..=prompt.len()])
}

/// A transcript's first line, when it says how it is to be played.
fn heading(transcript: &str) -> Option<&str> {
    let first = transcript.lines().next().unwrap_or_default();
    (first == "// alone" || first.starts_with("// with ")).then_some(first)
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

/// A prompt, and the lines that are typed after it.
pub(crate) type Statement = (String, Vec<String>);

/// What is typed in a transcript, with the prompt before it: statements of one line or several.
pub(crate) fn typed(transcript: &str) -> Vec<Statement> {
    let mut statements: Vec<Statement> = Vec::new();
    for line in transcript.lines() {
        if let Some(prompt) = prompt_of(line) {
            let first = line[prompt.len()..].trim_start().to_owned();
            statements.push((prompt.to_owned(), vec![first]));
        } else if let Some(next) = line.strip_prefix(" ... ") {
            statements.last_mut().expect("a statement begins with `lab>`").1.push(next.to_owned());
        }
    }
    statements
}

/// A transcript that is to be played.
struct Script {
    file: PathBuf,
    expected: String,
    statements: Vec<Statement>,
}

/// Types transcripts at one prompt and returns what each came to, every answer ending with a newline.
fn play(heading: Option<&str>, scripts: &[Script]) -> Vec<String> {
    let scratch = Scratch::new("repl-transcripts");
    kept::lay_out(&scratch);
    let args = heading.and_then(|heading| heading.strip_prefix("// with "));
    let args: Vec<&str> = args.map_or_else(Vec::new, |args| args.split(' ').collect());
    let all: Vec<Statement> =
        scripts.iter().flat_map(|script| script.statements.iter().cloned()).collect();
    let mut answered = answered(&scratch, &args, &all).into_iter();
    let heading = heading.map_or_else(String::new, |heading| format!("{heading}\n"));
    let one = |script: &Script| {
        let lines = answered.by_ref().take(script.statements.len());
        format!("{heading}{}", lines.collect::<String>())
    };
    scripts.iter().map(one).collect()
}

/// Types statements at one prompt and returns each as the terminal shows it, with its answer, every answer ending with
/// a newline.
pub(crate) fn answered(scratch: &Scratch, args: &[&str], statements: &[Statement]) -> Vec<String> {
    let mut input = format!("{MARK}\n");
    for (_, statement) in statements {
        writeln!(input, "{}\n{MARK}", statement.join("\n")).unwrap();
    }
    let said = scratch.typed(args, &input);
    // Asking for the mark, which is no name, is the worst line.
    assert_eq!(said.code, 2, "{}", said.out);
    assert!(!said.out.contains("panicked") && !said.out.contains('\x1b'), "{}", said.out);
    // What the mark is answered with, learnt from the first one.
    let end = "lists what can be called\n";
    let at = said.out.find(end).unwrap() + end.len();
    let (mark, mut rest) = said.out.split_at(at);
    let mut shown = Vec::new();
    for (prompt, statement) in statements {
        let mut line = format!("{prompt} {}\n", statement.join("\n ... "));
        // After `:quit` nobody answers.
        let (answer, after) = rest.split_once(mark).unwrap_or((rest, ""));
        line += answer;
        if !answer.is_empty() && !answer.ends_with('\n') {
            line.push('\n');
        }
        rest = after;
        shown.push(line);
    }
    assert_eq!(rest, "", "an answer that nobody asked for");
    shown
}

#[test]
fn transcripts_are_answered_as_written() {
    let write = std::env::var_os("TRUEUP_TRANSCRIPTS").is_some_and(|value| value == "write");
    let files = transcripts();
    assert!(files.len() >= 25, "{} transcripts", files.len());
    let mut desks: BTreeMap<String, (Option<String>, Vec<Script>)> = BTreeMap::new();
    for file in files {
        let expected = fs::read_to_string(&file).unwrap();
        let statements = typed(&expected);
        assert!(!statements.is_empty(), "{} types nothing", file.display());
        let head = heading(&expected).map(str::to_owned);
        let key = match head.as_deref() {
            Some("// alone") => file.display().to_string(),
            other => other.unwrap_or_default().to_owned(),
        };
        let script = Script { file, expected, statements };
        desks.entry(key).or_insert_with(|| (head, Vec::new())).1.push(script);
    }
    let mut wrong = String::new();
    for (head, scripts) in desks.into_values() {
        let played = play(head.as_deref(), &scripts);
        for (script, played) in scripts.iter().zip(played) {
            if write {
                fs::write(&script.file, &played).unwrap();
            } else if played != script.expected {
                let name = script.file.file_name().unwrap().display();
                let expected = &script.expected;
                write!(wrong, "--- {name}, expected\n{expected}--- answered\n{played}").unwrap();
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Input that ends in the middle of a call is a mistake that is told, not a call that is waited for.
#[test]
fn input_that_ends_too_early_is_told() {
    let said = Scratch::new("repl-end").typed(&[], "pour(jar,\n");
    assert_eq!(said.code, 2);
    assert!(said.out.contains("never closed"), "{}", said.out);
}

/// The lines after an open parenthesis were swallowed, `:quit` as well, and not mentioned.
#[test]
fn an_open_parenthesis_keeps_nothing_from_being_answered() {
    let scratch = Scratch::new("repl-open");
    let said = scratch.typed(&["--robot", "twin"], "pour(jar, cup\n\n1+1\npick(jar\n?pour\n");
    assert_eq!(said.code, 2);
    assert_eq!(said.out.matches("`(` is never closed").count(), 2, "{}", said.out);
    let at = |what: &str| said.out.find(what).unwrap_or_else(|| panic!("{what}: {}", said.out));
    assert!(at("[prompt:1:5]") < at("1+1 = 2") && at("1+1 = 2") < at("pour(source:"));
}

/// Neither nothing nor noise nor a thousand lines bring the prompt down.
#[test]
fn the_prompt_outlives_what_is_typed() {
    let scratch = Scratch::new("repl-noise");
    assert_eq!(scratch.typed(&[], "").out, "");
    let noise =
        "?\n:\n::\n: help\n? pour\n)\n(\n)\n\u{1f600}\nlab> :tasks\n//\nlab>\npour\npour(\n)\n\t\n";
    let said = scratch.typed(&[], &format!("{noise}:help\n"));
    assert_eq!(said.code, 2, "{}", said.out);
    assert!(!said.out.contains("panicked"), "{}", said.out);
    assert!(said.out.contains("Ctrl-C"), "`:help` at the end is still answered: {}", said.out);
    let many = ":objects\n".repeat(300);
    assert_eq!(scratch.typed(&[], &many).out.matches("not seen yet").count(), 600);
}
