//! Every error, verdict and finding → text for people or JSON for programs; the one place that words things.
//!
//! Layers below return data. What a person reads comes from here, always in the same order: what, where,
//! what would help. Colour only repeats what the words say, and is left out for `NO_COLOR` and pipes.

mod numbers;
pub mod changes;
pub mod energy;
pub mod fork;
pub mod gap;
pub mod gap_page;
pub mod grid;
pub mod html;
pub mod kept;
pub mod panics;
pub mod record;
pub mod run;
pub mod run_page;
pub mod sentence;
pub mod teach;
pub mod trials;
pub mod vqa;
pub mod why;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write as _};
use std::path::Path;

use serde_json::{Value, json};

use crate::alignment::vision::Sighting;
use crate::execution::stage::ActionError;
use crate::files::write;
use crate::graph;
use crate::language::ast::Param;
use crate::language::{self, Diagnostic, Library, Source};
use crate::plain::{coloured, picture, shortened, visible};
use crate::workcell;
use crate::world::{Scene, WorldState};

/// How to speak: to a person or a program, in colour or plain, at length or not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "four answers of the command line and the terminal that do not depend on each other"
)]
pub struct Style {
    /// One JSON document on stdout and nothing else there.
    pub json: bool,
    /// No progress and no tables.
    pub quiet: bool,
    /// Colour on stdout.
    pub colour: bool,
    /// Whether stderr is a terminal, so that progress may be a bar.
    pub bars: bool,
}

/// What went wrong, worded for people, with the exit code it deserves.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// `io::missing`, `task::unit`, `plan::out_of_reach`, …
    pub code: String,
    /// What.
    pub message: String,
    /// Where: a file, a line, an object.
    pub place: Option<String>,
    /// What would help.
    pub help: Option<String>,
    /// Whether a person has been shown it already, as a mistake drawn into its text.
    pub is_shown: bool,
    exit: u8,
}

/// Characters of a message, its place and its help that are kept: what came in may be quoted in any of them.
const LONGEST: (usize, usize, usize) = (900, 300, 600);

impl Failure {
    /// A file or folder that cannot be read: which, why, what would help.
    pub fn unread(path: &Path, error: &io::Error) -> Self {
        use io::ErrorKind as Kind;
        let place = path.display().to_string();
        let (code, help) = match error.kind() {
            Kind::NotFound => ("io::missing", "is the path right?"),
            Kind::InvalidData => ("io::text", "it is not a text file in UTF-8"),
            Kind::PermissionDenied => ("io::read", "check its permissions"),
            Kind::InvalidInput => ("io::read", "write what it gives into a file, and name that"),
            Kind::IsADirectory => ("io::read", "name a file in it"),
            Kind::NotADirectory => ("io::read", "is the path right?"),
            Kind::FileTooLarge => ("io::read", "is it the right file? give a part of it"),
            _ => ("io::read", "can it be read by another program?"),
        };
        Self::input(code, format!("cannot read {place}: {error}")).at(place).help(help)
    }

    /// Bad usage or input: exit code 2.
    pub fn input(code: &str, message: impl Into<String>) -> Self {
        Self {
            code: code.into(),
            message: shortened(&message.into(), LONGEST.0).into_owned(),
            place: None,
            help: None,
            is_shown: false,
            exit: 2,
        }
    }

    /// Done, and the answer is no: exit code 1.
    pub fn no(code: &str, message: impl Into<String>) -> Self {
        Self { exit: 1, ..Self::input(code, message) }
    }

    /// Stopped by a person or a safety limit: exit code 3.
    pub fn stopped(message: impl Into<String>) -> Self {
        Self { exit: 3, ..Self::input("run::stopped", message) }
    }

    /// A mistake of the program's own: exit code 3 when an arm was stopped for it and holds, else 2.
    pub fn internal(message: impl Into<String>, is_held: bool) -> Self {
        Self { exit: if is_held { 3 } else { 2 }, ..Self::input("internal::error", message) }
    }

    /// A device is not there: exit code 4.
    pub fn unavailable(code: &str, message: impl Into<String>) -> Self {
        Self { exit: 4, ..Self::input(code, message) }
    }

    /// Says where.
    #[must_use]
    pub fn at(mut self, place: impl Into<String>) -> Self {
        self.place = Some(shortened(&place.into(), LONGEST.1).into_owned());
        self
    }

    /// Says what would help.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(shortened(&help.into(), LONGEST.2).into_owned());
        self
    }

    /// Returns the exit code.
    pub fn exit(&self) -> u8 {
        self.exit
    }
}

impl Style {
    /// Looks at the terminal and the environment once.
    pub fn detect(json: bool, quiet: bool) -> Self {
        let plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        Self {
            json,
            quiet,
            colour: !plain && !json && io::stdout().is_terminal(),
            bars: io::stderr().is_terminal(),
        }
    }

    /// Prints a line on stdout for people; nothing in JSON mode.
    pub fn say(self, line: impl AsRef<str>) {
        if !self.json {
            out(line.as_ref());
        }
    }

    /// Prints an event of a run for programs, on one line.
    pub fn event(self, value: &impl serde::Serialize) {
        if let Ok(text) = serde_json::to_string(value) {
            out_json(&text);
        }
    }

    /// Prints the one JSON document.
    pub fn document(self, value: &impl serde::Serialize) {
        match serde_json::to_string_pretty(value) {
            Ok(text) => out_json(&text),
            Err(error) => self.failure(&Failure::input("json", error.to_string())),
        }
    }

    /// Tells an answer that is numbers: the document for programs, lines for people.
    pub fn answer(self, value: &impl serde::Serialize) {
        match serde_json::to_value(value) {
            Ok(value) if !self.json => out(numbers::lines(&value).trim_end()),
            _ => self.document(value),
        }
    }

    /// Tells a failure: a JSON document on stdout, or words on stderr.
    pub fn failure(self, failure: &Failure) {
        if self.json {
            self.document(&json!({"error": {
                "code": failure.code,
                "message": failure.message,
                "where": failure.place,
                "help": failure.help,
            }}));
            return;
        }
        if failure.is_shown {
            return;
        }
        let mut text = format!("{} {}", self.red("error:"), visible(&failure.message));
        if let Some(place) = &failure.place {
            let _ = write!(text, "\n  --> {}", visible(place));
        }
        if let Some(help) = &failure.help {
            let _ = write!(text, "\nhelp: {}", visible(help));
        }
        complain(&text);
    }

    /// Prints on stderr for people, unless asked to be quiet.
    pub fn note(self, line: &str) {
        if !self.quiet {
            complain(line);
        }
    }

    /// Wraps in red where colour is on.
    pub fn red(self, text: &str) -> String {
        self.paint(text, 31)
    }

    /// Wraps in green where colour is on.
    pub fn green(self, text: &str) -> String {
        self.paint(text, 32)
    }

    /// Wraps in a dim shade where colour is on.
    pub fn dim(self, text: &str) -> String {
        self.paint(text, 2)
    }

    fn paint(self, text: &str, code: u8) -> String {
        if self.colour { format!("\x1b[{code}m{}\x1b[0m", visible(text)) } else { text.to_owned() }
    }
}

/// Writes a line to stdout, without what a terminal would obey but for colours; a closed pipe is not our error.
pub fn out(line: &str) {
    let _ = writeln!(io::stdout().lock(), "{}", coloured(line));
}

/// Returns a text as a bar may show it, which writes to the terminal by itself: without what a terminal obeys.
pub fn shown(text: &str) -> String {
    shortened(&visible(text), LONGEST.0).into_owned()
}

/// Writes JSON to stdout. What it may hold as it is and a terminal obeys is written as `\u009b`, which means the
/// same.
fn out_json(text: &str) {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        if c == '\n' || picture(c) == c {
            plain.push(c);
        } else {
            let _ = write!(plain, "\\u{:04x}", u32::from(c));
        }
    }
    let _ = writeln!(io::stdout().lock(), "{plain}");
}

/// Writes a line to stderr, without what a terminal would obey but for colours; a closed pipe is not our error.
pub fn complain(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", coloured(line));
}

/// Returns a number as JSON, with `null` for what is not a number.
pub fn number(value: f64) -> Value {
    serde_json::Number::from_f64(value).map_or(Value::Null, Value::Number)
}

/// Draws a diagnostic as the terminal can show it.
pub fn diagnostic(diagnostic: &Diagnostic, source: &Source, style: Style) -> String {
    let look = if style.colour { language::Style::Colour } else { language::Style::Plain };
    language::render(diagnostic, source, look)
}

/// Words why a file could not be written. A disk without room has a code of its own, for it is mended otherwise
/// than a path that is wrong.
pub fn unwritten(path: &Path, error: &io::Error) -> Failure {
    let place = path.display().to_string();
    if write::is_full(error) {
        return Failure::input(
            "io::full",
            format!("no room left on the disk for {place}: {error}"),
        )
        .at(place)
        .help("make room and try again; what was there before is as it was");
    }
    Failure::input("io::write", format!("cannot write {place}: {error}"))
        .at(place)
        .help("does its folder exist, and may it be written?")
}

/// Words why no folder could be made for a run; `option` names the folder they are made in.
pub fn no_run_folder(path: &Path, error: &io::Error, option: &str) -> Failure {
    if write::is_full(error) {
        return unwritten(path, error);
    }
    Failure::input("io::write", format!("cannot make a run folder: {error}"))
        .at(path.display().to_string())
        .help(format!("name a folder that may be written with `{option} DIR`"))
}

/// Mistakes of one kind that are drawn; the others are counted.
const DRAWN: usize = 20;

/// Draws diagnostics as the terminal can show them: a few of each kind, and how many more there are.
pub fn diagnostics<'a>(
    wrong: impl IntoIterator<Item = (&'a Diagnostic, &'a Source)>,
    style: Style,
) -> Vec<String> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let mut drawn = Vec::new();
    for (each, source) in wrong {
        let seen = seen.entry(each.code).or_default();
        *seen += each.count;
        if *seen <= DRAWN || each.count > 1 {
            drawn.push(diagnostic(each, source, style));
        }
    }
    let more = seen.into_iter().filter(|(code, seen)| *seen > DRAWN && *code != "task::more");
    drawn.extend(more.map(|(code, seen)| format!("and {} more of {code}\n", seen - DRAWN)));
    drawn
}

/// Returns what is wrong as JSON, a thousand at most: a last one counts the others.
pub fn diagnostics_json(wrong: &[(Diagnostic, Source)]) -> Vec<Value> {
    if wrong.len() <= language::diagnostic::MOST {
        return wrong.iter().map(|(each, source)| each.to_json(source)).collect();
    }
    let limited = language::limited(wrong.iter().map(|(each, _)| each.clone()).collect());
    let nowhere = Source::default();
    let source = |file: &str| {
        let known = wrong.iter().find(|(each, source)| each.file == file || source.name == file);
        known.map_or(&nowhere, |(_, source)| source)
    };
    limited.iter().map(|each| each.to_json(source(&each.file))).collect()
}

/// Shows everything that is wrong with a text and sums it up as a failure.
pub fn text_failure(diagnostics: &[Diagnostic], source: &Source, style: Style) -> Failure {
    texts_failure(&diagnostics.iter().map(|each| (each, source)).collect::<Vec<_>>(), style)
}

fn texts_failure(wrong: &[(&Diagnostic, &Source)], style: Style) -> Failure {
    let Some((first, source)) = wrong.iter().find(|(d, _)| d.is_error()).or(wrong.first()) else {
        return Failure::input("task::empty", "there is nothing to run")
            .help("type a call such as `pour(jar, cup)`");
    };
    let (line, column) = source.line_column(first.span.from);
    let count = wrong.iter().filter(|(d, _)| d.is_error()).map(|(d, _)| d.count).sum();
    if !style.json {
        for drawn in diagnostics(wrong.iter().copied(), style) {
            complain(drawn.trim_end());
        }
        if count > 1 {
            complain(&format!("{} {count} mistakes; nothing was done", style.red("error:")));
        }
    }
    let message = match count {
        0 | 1 => first.message.clone(),
        n => format!("{n} mistakes in the text; the first: {}", first.message),
    };
    let mut failure =
        Failure::input(first.code, message).at(format!("{}:{line}:{column}", source.name));
    failure.help.clone_from(&first.help);
    failure.is_shown = !style.json;
    failure
}

/// Words why a call has no graph.
pub fn problems_failure(problems: &[graph::Problem], library: &Library, asked: &Source) -> Failure {
    let Some(first) = problems.first() else {
        return Failure::input("graph::empty", "the call has no graph");
    };
    let written = library.callable(&first.within).map(|(_, source)| source);
    let source = if first.within.is_empty() { asked } else { written.unwrap_or(asked) };
    let mut failure =
        Failure::input(first.code, first.message.clone()).at(source.place(first.span));
    failure.help.clone_from(&first.help);
    failure
}

/// Words why a verb of the cell could not be done.
pub fn cell_failure(error: &workcell::Error, style: Style) -> Failure {
    use workcell::Error;
    let words = error.to_string();
    match error {
        Error::Text(wrong) => texts_failure(&wrong.iter().map(|(d, s)| (d, s)).collect::<Vec<_>>(), style),
        Error::File { path, error } => unwritten(path, error),
        Error::Unrecorded { dir, error } => {
            let dir = dir.display().to_string();
            let failure = if write::is_full(error) {
                let message = format!(
                    "no room left on the disk; the arm was stopped and holds, and what was written so far \
                     is kept in {dir}"
                );
                Failure { code: "io::full".into(), ..Failure::stopped(message) }
            } else {
                let message = format!("{words}; the arm was stopped and holds");
                Failure { code: "io::write".into(), ..Failure::stopped(message) }
            };
            let help = format!("make room and call it again; `trueup replay {dir}` tells what is kept");
            failure.at(dir).help(help)
        }
        Error::Graph(problems) => {
            problems_failure(problems, &Library::new(), &Source::new("command line", ""))
        }
        Error::Branch(_) => Failure::no("graph::no_branch", words),
        Error::NoScene(_) => Failure::input("scene::missing", words)
            .help("add a `scene` item, or leave `--scene` out to use the kitchen"),
        Error::Robot(_) => Failure::input("scene::robot", words)
            .help("`--stdlib DIR` adds `DIR/robots/NAME/NAME.urdf` and its `robot.toml`"),
        Error::Lab(_) => Failure::input("lab::settings", words),
        Error::Calibrate(_) => Failure::no("align::failed", words)
            .help("is the table in the picture, and do its dots match the scene's `marks`?"),
        Error::NotSeen(unseen) => Failure::no("camera::not_seen", words)
            .at(unseen.iter().map(|(object, _)| object.as_str()).collect::<Vec<_>>().join(", "))
            .help("clear the view and try again; nothing has moved towards it"),
        Error::OutOfReach { object, .. } => Failure::no("plan::out_of_reach", words)
            .at(object.clone())
            .help("move it nearer to the arm; nothing has moved"),
        Error::NoRoom { target, room, .. } => {
            let less = (0.9e6 * room).floor();
            Failure::no("run::no_room", words)
                .at(target.clone())
                .help(format!("pour less, such as `amount: {less:.0} mL`; nothing has moved"))
        }
        Error::NotSoMuch { source_name, there, .. } => {
            let there = (1e6 * there).floor();
            let failure = Failure::no("run::not_so_much", words).at(source_name.clone());
            failure.help(if there < 3.0 {
                "fill it first, or say in the scene what is in it; nothing has moved".into()
            } else {
                format!(
                    "pour less, such as `amount: {there:.0} mL`, or leave the amount out to pour \
                     everything; nothing has moved"
                )
            })
        }
        Error::NotWeighable { least, .. } => {
            let least = (1e6 * least).round();
            Failure::no("run::not_weighable", words)
                .help(format!("pour at least `amount: {least:.0} mL`; nothing has moved"))
        }
        Error::Needs { .. } => {
            Failure::no("run::needs", words).help("make it true first; nothing has moved")
        }
        Error::NoSurvivor { .. } => Failure::no("plan::no_survivor", words)
            .help(
                "nothing has been touched; if it is a matter of room, move the objects nearer to the arm \
                 or closer together",
            ),
        Error::Record { path, .. } => Failure::input("io::run", words)
            .at(path.display().to_string())
            .help("a run folder has a `run.json`, written by `trueup run` or at the prompt"),
        Error::Model { endpoint, .. } => Failure::unavailable("vqa::unavailable", words)
            .at(endpoint.clone())
            .help("is the server running, and does the address end in `/v1`? nothing has moved"),
        Error::WhatIf(_) => Failure::input("run::what_if", words)
            .help("`:runs` lists the runs, `:replay RUN` shows the steps of one"),
        Error::NothingToDo => Failure::input("run::empty", words),
        Error::Action(action) => match action {
            ActionError::Stopped | ActionError::Limit(_) => Failure::stopped(words),
            ActionError::Device(device) => {
                Failure::unavailable("device", words).help(device.help())
            }
            _ => Failure::no("run::action", words),
        },
    }
}

/// Words what a picture shows of one object.
pub fn sighting(seen: &Sighting) -> String {
    match seen.world_from_object {
        Some(pose) => {
            let at = pose.origin();
            format!(
                "{:<8} at ({:.1}, {:.1}) mm, turned {:.1} deg, ± {:.1} mm, confidence {:.2}",
                seen.name,
                at.x * 1e3,
                at.y * 1e3,
                pose.yaw().to_degrees(),
                seen.std * 1e3,
                seen.confidence
            )
        }
        None => format!(
            "{:<8} not found: {}",
            seen.name,
            seen.reason.as_deref().unwrap_or("nothing in the picture looks like it")
        ),
    }
}

/// Words what is on the table.
pub fn objects(scene: &Scene, state: &WorldState) -> String {
    let mut text = String::new();
    for object in &scene.objects {
        let known = state.object(&object.name);
        let place = match known.and_then(|o| o.world_from_object) {
            Some(pose) => {
                let at = pose.origin();
                let std = known.map_or(f64::NAN, |o| o.std);
                format!("at ({:.1}, {:.1}) cm ± {:.1} mm", at.x * 1e2, at.y * 1e2, std * 1e3)
            }
            None => "not seen yet".to_owned(),
        };
        let water = known.and_then(|o| o.water).map(|water| format!("{:.0} mL", water * 1e6));
        let held = if state.held.as_deref() == Some(&object.name) { "in the hand" } else { "" };
        let line = format!(
            "{:<8} {:<10} {:<18} {place:<28} {:<8} {held}",
            object.name,
            object.kind,
            object.looks,
            water.unwrap_or_default()
        );
        text += line.trim_end();
        text.push('\n');
    }
    text.trim_end().to_owned()
}

/// Words the head of a task or an action with the first sentence of its documentation.
pub fn signature(name: &str, params: &[Param], doc: &[String]) -> String {
    let summary = doc.first().map_or("", |line| line.trim());
    format!("{}\n  {summary}", language::assist::signature(name, params))
}
