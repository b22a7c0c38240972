//! `trueup check` and `trueup fmt`: texts without a robot.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::files::write;
use crate::language::ast::Span;
use crate::language::{self, Diagnostic, Source};
use crate::report::{self, Failure, Style};
use crate::workcell::check;

use super::cell::stdlib;
use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;

/// Find mistakes in task files.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Files, or folders with `.task` files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Lay task files out in the one canonical way.
#[derive(Debug, Args)]
pub(super) struct FmtArgs {
    /// Change nothing; say which files would change, with exit code 1 when there are any.
    #[arg(long)]
    check: bool,
    /// Files, or folders with `.task` files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Returns the task files that paths name, folders searched to the bottom, in order of name.
pub(super) fn task_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        let mut open = vec![path.clone()];
        while let Some(dir) = open.pop() {
            let entries = std::fs::read_dir(&dir).map_err(|error| Failure::unread(&dir, &error))?;
            for entry in entries.flatten() {
                let path = entry.path();
                if path.is_dir() {
                    // A link to a folder may lead back to where it lies.
                    if !path.is_symlink() {
                        open.push(path);
                    }
                } else if path.extension().is_some_and(|ending| ending == "task") {
                    found.push(path);
                }
            }
        }
        if found.len() == before {
            let place = path.display().to_string();
            return Err(
                Failure::input("io::empty", "there are no `.task` files in the folder").at(place)
            );
        }
    }
    found.sort();
    Ok(found)
}

/// `trueup check FILE...`: each file by itself over the stdlib, and the scene's file with them where one is named.
pub(super) fn check(args: &CheckArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let mut paths = task_files(&args.files)?;
    let scene = match &cli.cell.scene {
        None => None,
        Some(path) => {
            if !paths.contains(path) {
                paths.insert(0, path.clone());
            }
            Some(Source::new(path.display().to_string(), read(path)?))
        }
    };
    let files = paths.len();
    let (mut sources, mut unread) = (Vec::new(), Vec::new());
    for path in paths {
        match read(&path) {
            Ok(text) => sources.push(Source::new(path.display().to_string(), text)),
            Err(failure) if files == 1 => return Err(failure),
            // What is wrong with the others is told all the same.
            Err(failure) => unread.push((path.display().to_string(), failure)),
        }
    }
    let mut all = check::check_all(&stdlib, scene, sources)
        .map_err(|error| report::cell_failure(&error, style))?;
    let wrong = all.iter().filter(|(diagnostic, _)| diagnostic.is_error()).count();
    let errors = wrong + unread.len();
    for (name, failure) in unread {
        if style.json {
            all.push(unreadable(name, failure));
        } else {
            style.failure(&failure);
        }
    }
    if style.json {
        style.document(&json!({ "diagnostics": report::diagnostics_json(&all) }));
    } else {
        for drawn in report::diagnostics(all.iter().map(|(d, source)| (d, source)), style) {
            style.say(drawn);
        }
        style.say(counted(errors, all.len() - wrong, files, style));
    }
    Ok(if errors > 0 { Exit::No } else { Exit::Yes })
}

/// Returns a file that cannot be read as something that is wrong with it.
fn unreadable(name: String, failure: Failure) -> (Diagnostic, Source) {
    let code = match failure.code.as_str() {
        "io::missing" => "io::missing",
        "io::text" => "io::text",
        _ => "io::read",
    };
    let found = Diagnostic::error(code, Span::default(), failure.message, "not read");
    let found = failure.help.into_iter().fold(found, Diagnostic::help);
    (found, Source::new(name, ""))
}

/// Counts what is wrong with how many files.
fn counted(errors: usize, warnings: usize, files: usize, style: Style) -> String {
    let many = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let of = format!("in {}", many(files, "file"));
    match (errors, warnings) {
        (0, 0) => style.green(&format!("no mistakes found {of}")),
        (0, _) => format!("{} {of}", many(warnings, "warning")),
        (_, 0) => style.red(&format!("{} {of}", many(errors, "error"))),
        _ => style.red(&format!("{}, {} {of}", many(errors, "error"), many(warnings, "warning"))),
    }
}

/// `trueup fmt FILE...`.
pub(super) fn fmt(args: &FmtArgs, style: Style) -> Result<Exit, Failure> {
    let mut changed = Vec::new();
    for path in task_files(&args.files)? {
        let text = read(&path)?;
        let name = path.display().to_string();
        let (_, diagnostics) = language::parse(&text);
        if diagnostics.iter().any(Diagnostic::is_error) {
            let source = Source::new(name, text);
            return Err(report::text_failure(&diagnostics, &source, style));
        }
        let formatted = language::format(&text);
        if formatted == text {
            continue;
        }
        changed.push((name, path, formatted));
    }
    // Nothing is written before everything has been read.
    for (_, path, formatted) in changed.iter().filter(|_| !args.check) {
        write::replace(path, formatted).map_err(|error| Failure::unwritten(path, &error))?;
    }
    let changed: Vec<String> = changed.into_iter().map(|(name, ..)| name).collect();
    if style.json {
        style.document(&json!({ "changed": changed }));
    } else {
        let verb = if args.check { "would change" } else { "formatted" };
        for name in &changed {
            style.say(format!("{verb}: {name}"));
        }
    }
    Ok(if args.check && !changed.is_empty() { Exit::No } else { Exit::Yes })
}
