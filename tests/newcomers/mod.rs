//! What newcomers type first, and what they then read: a student, an operator, a teacher, a file each.
//!
//! A path is a text file as a terminal would show it. A line after `$ ` is a command; after `$ trueup` alone, lines after
//! `lab> ` are typed at its prompt. Everything else is what the program says, stdout and stderr as they come; the time
//! in the name of a run folder stands as `YYYYMMDD-HHMMSS`, and what a run took as `..`. Three runs are kept from before
//! (`repl::kept`).
//! `TRUEUP_TRANSCRIPTS=write` writes the answers anew; read them as a newcomer would.
//!
//! Every technical term that a newcomer reads here is explained in `docs/glossary.md`, and none of the words that once
//! stood in their place comes back.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::Scratch;
use crate::repl::{answered, kept, prompt_of, typed};

/// Words that are the field's or this program's own, and that not everybody knows.
const TERMS: &[&str] = &[
    "action",
    "And-Or graph",
    "camera alignment",
    "branch",
    "breakpoint",
    "candidate",
    "dribble",
    "encoder",
    "endpoint",
    "fluent",
    "homography",
    "hypothesis",
    "intrinsics",
    "inverse kinematics",
    "joint",
    "Kortex",
    "laboratory",
    "margin",
    "match",
    "MCAP",
    "offset",
    "parse graph",
    "precondition",
    "prior",
    "probability",
    "regression",
    "residual",
    "RRD",
    "run folder",
    "scene",
    "script",
    "seed",
    "segment",
    "standard deviation",
    "stdlib",
    "torque",
    "trial",
    "twin",
    "URDF",
];

/// What was printed once and nobody understood at first reading.
const JARGON: &[&str] = &[
    "survived",
    "P = exp",
    "nearest to being lost",
    "all the while",
    "smallest margin in m^3",
    "too little to be weighed",
    "that cannot be done",
    "this is no call",
    "should have made true",
    "as the camera sees it",
    "nobody knows",
    "sum of squares",
    "explainable",
    "does not fade",
    "so far as geometry",
    "Geometry says",
    "waiting for a word",
    "embedded reality",
    "photograph",
    "nobody said",
    "stands here twice",
    "opens the seal",
    "trembles",
    "may it be read",
    "not heeded",
];

fn paths() -> Vec<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/newcomers");
    let files = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|ending| ending == "txt")).collect();
    found.sort();
    found
}

/// Returns the words of a command line; what stands between single quotes is one.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (n, part) in line.split('\'').enumerate() {
        if n % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

/// Returns the text with the time in every run folder's name left out: eight digits, a hyphen, six digits.
fn without_times(text: &str) -> String {
    let is_time = |at: usize| {
        let stamp = text.as_bytes().get(at..at + 15);
        stamp.is_some_and(|stamp| {
            stamp[8] == b'-' && (0..15).all(|i| i == 8 || stamp[i].is_ascii_digit())
        })
    };
    let (mut masked, mut at) = (String::new(), 0);
    while let Some(letter) = text[at..].chars().next() {
        if is_time(at) {
            masked += "YYYYMMDD-HHMMSS";
            at += 15;
        } else {
            masked.push(letter);
            at += letter.len_utf8();
        }
    }
    masked
}

/// Returns the text without what its runs took, which depends on the machine: in the line that ends a run, and behind an
/// example that was tried.
fn without_clock(text: &str) -> String {
    let line = |line: &str| {
        let mark = line.chars().next().filter(|mark| "✓✗".contains(*mark));
        let is_example = mark.is_some() && line.contains(".task:");
        if !is_example && !line.contains(" perceiving, ") {
            return line.to_owned();
        }
        let number = |word: &str| word.parse::<f64>().is_ok();
        let words = line.split(' ').map(|word| if number(word) { ".." } else { word });
        words.collect::<Vec<_>>().join(" ")
    };
    text.lines().map(|text| line(text) + "\n").collect()
}

/// Types a path and returns it with what is answered now.
fn walked(name: &str, path: &str) -> String {
    let scratch = Scratch::new(&format!("newcomers-{name}"));
    kept::lay_out(&scratch);
    let mut shown = String::new();
    for section in format!("\n{path}").split("\n$ ").skip(1) {
        let (command, below) = section.split_once('\n').unwrap_or((section, ""));
        let words = words(command);
        let [program, args @ ..] = &words[..] else { panic!("{name}: an empty command") };
        assert_eq!(program, "trueup", "{name}");
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        writeln!(shown, "$ {command}").unwrap();
        if args.is_empty() && below.lines().any(|line| prompt_of(line).is_some()) {
            shown += &answered(&scratch, &args, &typed(below)).concat();
            continue;
        }
        let said = scratch.typed(&args, "");
        assert!(!said.out.contains("panicked"), "{}", said.out);
        shown += &said.out;
        if !said.out.is_empty() && !said.out.ends_with('\n') {
            shown.push('\n');
        }
        if said.code != 0 {
            writeln!(shown, "(exit code {})", said.code).unwrap();
        }
    }
    without_clock(&without_times(&shown))
}

#[test]
fn the_paths_of_newcomers_are_answered_as_written() {
    let write = std::env::var_os("TRUEUP_TRANSCRIPTS").is_some_and(|value| value == "write");
    let paths = paths();
    assert_eq!(paths.len(), 3, "a student, an operator, a teacher");
    let mut wrong = String::new();
    for path in paths {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let expected = fs::read_to_string(&path).unwrap();
        let walked = walked(name, &expected);
        if write {
            fs::write(&path, &walked).unwrap();
        } else if walked != expected {
            write!(wrong, "--- {name}, expected\n{expected}--- answered\n{walked}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Whether a text has the word, by itself or in the plural.
fn has(text: &str, word: &str) -> bool {
    let (text, word) = (text.to_lowercase(), word.to_lowercase());
    text.match_indices(&word).any(|(at, _)| {
        let is_letter = |letter: char| letter.is_alphanumeric() || letter == '_';
        let before = text[..at].chars().next_back();
        let after = text[at + word.len()..].trim_start_matches('s').chars().next();
        !before.is_some_and(is_letter) && !after.is_some_and(is_letter)
    })
}

#[test]
fn every_term_that_a_newcomer_reads_is_in_the_glossary() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let glossary = fs::read_to_string(root.join("docs/glossary.md")).unwrap();
    // What a row explains: its first two columns.
    let rows = glossary.lines().filter(|line| line.starts_with('|'));
    let explained: String = rows
        .map(|row| row.split('|').skip(1).take(2).collect::<Vec<_>>().join("|") + "\n")
        .collect();
    let mut missing: Vec<&str> = Vec::new();
    let mut jargon: Vec<&&str> = Vec::new();
    let mut n_read = 0;
    for path in paths() {
        let text = fs::read_to_string(&path).unwrap();
        let read: Vec<&&str> = TERMS.iter().filter(|term| has(&text, term)).collect();
        n_read += read.len();
        missing.extend(read.into_iter().copied().filter(|term| !has(&explained, term)));
        jargon.extend(JARGON.iter().filter(|word| text.contains(**word)));
    }
    missing.sort_unstable();
    missing.dedup();
    assert!(n_read > 20, "{n_read} terms were read");
    assert!(missing.is_empty(), "docs/glossary.md has no entry for {missing:?}");
    assert!(jargon.is_empty(), "said again: {jargon:?}");
}

#[test]
fn a_time_and_a_word_are_told_from_what_is_none() {
    assert_eq!(without_times("runs/20260101-090000-pour"), "runs/YYYYMMDD-HHMMSS-pour");
    assert_eq!(without_times("± 20260101-0900 é"), "± 20260101-0900 é");
    let took = "  12.5 s: 0.0 perceiving, 1.5 simulating\n";
    assert_eq!(without_clock(took), "  .. s: .. perceiving, .. simulating\n");
    assert_eq!(without_clock("✓ a.task:4  a(jar)  84.4 s"), "✓ a.task:4  a(jar)  .. s\n");
    assert_eq!(without_clock("✓  3  lift(jar)  1.4 s"), "✓  3  lift(jar)  1.4 s\n");
    assert_eq!(words("trueup -c 'pour(jar, cup)' --seed 1").len(), 5);
    assert!(has("two Fluents, both true", "fluent") && !has("influents", "fluent"));
}
