//! The layers import one way. `LAYERS` is the rule; `ARCHITECTURE.md` says why.

use std::fs;
use std::path::{Path, PathBuf};

/// Each layer and what it may import, lowest first; `*` stands for every layer before it.
const LAYERS: &[(&str, &[&str])] = &[
    ("units", &[]),
    // Reading what somebody named, writing whole or not at all; every layer may.
    ("files", &[]),
    // Text of strangers as it may be shown.
    ("plain", &[]),
    // Files of JSON lines: answers and trials.
    ("lines", &[]),
    // A small server for the two that listen, and a client for cameras, scales and models.
    ("http", &[]),
    // Masks that a server or a network makes of a picture; whether they are good is not asked here.
    ("masks", &["plain", "http"]),
    // Pictures become a file that players open.
    ("film", &[]),
    // Rows with times become a file that Rerun opens.
    ("rrd", &[]),
    ("fit", &[]),
    // Frames, cameras, objects, scenes and states as data: whoever moves an arm or fits a camera needs no parser.
    ("world", &[]),
    ("language", &["units", "plain"]),
    ("graph", &["units", "language"]),
    // A scene is read from a syntax tree, and a fluent is an expression of the language.
    ("scene", &["units", "files", "language", "world"]),
    ("fluent", &["units", "language", "world"]),
    ("alignment", &["fit", "world"]),
    ("motion", &["world"]),
    ("twin", &["world", "motion"]),
    ("lab", &["units", "world", "motion", "twin"]),
    // What an arm is to everyone, and the gate that every motion passes.
    ("arm", &["world", "motion"]),
    ("kortex", &["motion", "arm"]),
    // The client of somebody else's reality.
    ("bridge", &["alignment", "arm"]),
    ("trace", &["units", "language", "world", "fluent", "arm"]),
    // Regression 3 is fitted here, where pictures and the arm's model meet.
    (
        "execution",
        &[
            "units",
            "http",
            "fit",
            "world",
            "language",
            "graph",
            "fluent",
            "alignment",
            "motion",
            "twin",
            "lab",
            "arm",
            "trace",
        ],
    ),
    // The other side of the real arm's wire; any arm that can be stepped may be behind it.
    ("emulator", &["http", "world", "motion", "arm", "kortex"]),
    // A model at a web address is asked about pictures; it knows no step and no fluent.
    ("vqa", &["lines", "http"]),
    ("monitor", &["units", "language", "graph", "fluent", "trace", "execution", "vqa"]),
    // Stepping and teaching without a terminal; the arm is met through the conductor alone.
    ("teach", &["lines", "language", "graph", "trace", "execution", "vqa"]),
    // Sees recordings only: never `lab`, and of `execution` nothing yet.
    ("discovery", &["units", "plain", "fit", "language", "world", "alignment", "motion", "twin"]),
    ("workcell", &["*"]),
    ("report", &["*"]),
    // A client of the run folders, the conductor and the words of `report`.
    ("page", &["http", "graph", "arm", "trace", "execution", "teach", "workcell", "report"]),
    ("repl", &["units", "language", "graph", "teach", "workcell", "report"]),
    // An editor is told what `check` says.
    ("lsp", &["language", "workcell"]),
    // A command for one layer alone (`robot fk`, `align map`, `check`) asks that layer, without a cell.
    ("cli", &["*"]),
];

#[test]
fn every_layer_imports_only_what_the_table_allows() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    for path in rust_files(&src) {
        let inside = path.strip_prefix(&src).unwrap();
        let first = inside.iter().next().unwrap().to_str().unwrap();
        let layer = first.trim_end_matches(".rs");
        if matches!(layer, "lib" | "main") {
            continue;
        }
        let at = LAYERS.iter().position(|(name, _)| *name == layer);
        let at = at.unwrap_or_else(|| panic!("`{layer}` is missing from LAYERS"));
        let allowed = allowed(at);
        for (number, line) in fs::read_to_string(&path).unwrap().lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            for rest in code.split("crate::").skip(1) {
                let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
                let target = &rest[..end.unwrap_or(rest.len())];
                if target != layer && !allowed.contains(&target) {
                    wrong.push(format!("{}:{}: `{target}`", inside.display(), number + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "imports outside the table:\n{}", wrong.join("\n"));
}

/// A file that is emptied before it is written is gone when the disk is full. Tests may.
#[test]
fn only_the_file_layer_makes_files() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    // A run folder is new: its two files that grow are nobody's before.
    let may = [src.join("files/write.rs"), src.join("workcell/record.rs")];
    let mut wrong = Vec::new();
    for path in rust_files(&src).into_iter().filter(|path| !may.contains(path)) {
        let text = fs::read_to_string(&path).unwrap();
        let program = text.split("#[cfg(test)]").next().unwrap();
        for (number, line) in program.lines().enumerate() {
            if ["fs::write(", "File::create(", "fs::copy("].iter().any(|call| line.contains(call)) {
                wrong.push(format!("{}:{}: {}", path.display(), number + 1, line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "`files::write::replace` instead:\n{}", wrong.join("\n"));
}

#[test]
fn the_table_permits_nothing_that_nobody_imports() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut idle = Vec::new();
    for (layer, listed) in LAYERS {
        let file = src.join(format!("{layer}.rs"));
        let files = if file.exists() { vec![file] } else { rust_files(&src.join(layer)) };
        let text: String = files.iter().map(|path| fs::read_to_string(path).unwrap()).collect();
        for permitted in listed.iter().filter(|name| **name != "*") {
            let import = format!("crate::{permitted}");
            let is_whole =
                |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
            if !text.split(&import).skip(1).any(is_whole) {
                idle.push(format!("`{layer}` does not import `{permitted}`"));
            }
        }
    }
    assert!(idle.is_empty(), "permissions nobody uses:\n{}", idle.join("\n"));
}

/// What a run did and why it failed is data; a message is worded for people, and nobody reads it back.
#[test]
fn nothing_above_execution_matches_on_a_message() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let from = LAYERS.iter().position(|(name, _)| *name == "execution").unwrap() + 1;
    let searches =
        [".contains(\"", ".starts_with(\"", ".ends_with(\"", ".strip_prefix(\"", ".find(\""];
    let mut wrong = Vec::new();
    let above = LAYERS[from..].iter().map(|(name, _)| src.join(name)).filter(|dir| dir.is_dir());
    for path in above.flat_map(|dir| rust_files(&dir)) {
        let text = fs::read_to_string(&path).unwrap();
        let program = text.split("#[cfg(test)]").next().unwrap();
        for (number, line) in program.lines().enumerate() {
            for search in searches {
                let literals = line.split(search).skip(1).filter_map(|rest| rest.split('"').next());
                for literal in literals {
                    let is_message = literal.split_whitespace().count() > 2;
                    // `grasp(`: the text of a step.
                    let is_call = literal.strip_suffix('(').is_some_and(|name| {
                        !name.is_empty() && name.chars().all(char::is_alphanumeric)
                    });
                    if is_message || (is_call && !path.starts_with(src.join("discovery"))) {
                        wrong.push(format!("{}:{}: {literal}", path.display(), number + 1));
                    }
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "match on `trace::Cause` or `trace::Deed` instead:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn the_table_has_no_cycle() {
    for (at, (layer, _)) in LAYERS.iter().enumerate() {
        for below in allowed(at) {
            assert!(LAYERS[..at].iter().any(|(name, _)| *name == below), "{layer} imports {below}");
        }
    }
}

/// What every layer after it may import: how files are read and written is said once.
const COMMON: &str = "files";

fn allowed(at: usize) -> Vec<&'static str> {
    let is_above_common = LAYERS[..at].iter().any(|(name, _)| *name == COMMON);
    match LAYERS[at].1 {
        ["*"] => LAYERS[..at].iter().map(|(name, _)| *name).collect(),
        listed => listed.iter().copied().chain(is_above_common.then_some(COMMON)).collect(),
    }
}

pub(super) fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}
