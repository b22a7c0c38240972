//! What went wrong, worded for people, with the exit code it deserves.
//!
//! The errors of the layers below come in as data, and leave as a [`Failure`]: what, where, what would help.
//! How it is drawn on a terminal or as JSON is [`super::Style`]'s.

use std::io;
use std::path::Path;

use super::exit::Exit;
use super::uncalibrated::uncalibrated;
use super::way_out::{made_true, way_out};
use super::{Style, complain, diagnostics};
use crate::arm::limits::LimitError;
use crate::execution::error::ActionError;
use crate::execution::refusal::Refusal;
use crate::files::write;
use crate::graph;
use crate::language::{Diagnostic, Library, Source};
use crate::plain::shortened;
use crate::trace::Cause;
use crate::workcell;

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
    /// The documents of the runs before it, in a list.
    pub runs: Option<Box<serde_json::Value>>,
    exit: u8,
}

/// Of a call that failed before anything was done for it.
const UNTOUCHED: &str = "nothing has been touched; ";

/// Characters of a message, its place and its help that are kept: what came in may be quoted in any of them.
const LONGEST: (usize, usize, usize) = (900, 300, 600);

impl Failure {
    /// A file or folder that cannot be read: which, why, what would help.
    pub fn unread(path: &Path, error: &io::Error) -> Self {
        use io::ErrorKind as Kind;
        let place = path.display().to_string();
        let (code, help) = match error.kind() {
            Kind::NotFound => ("io::missing", "is the path right?"),
            Kind::InvalidData => ("io::text", "save it as a text file in UTF-8"),
            Kind::PermissionDenied => ("io::read", "check its permissions"),
            Kind::InvalidInput => ("io::read", "write what it gives into a file, and name that"),
            Kind::IsADirectory => ("io::read", "name a file in it"),
            Kind::NotADirectory => ("io::read", "is the path right?"),
            Kind::FileTooLarge => ("io::read", "is it the right file? give a part of it"),
            _ => ("io::read", "can it be read by another program?"),
        };
        let message = match error.kind() {
            Kind::NotFound if path.extension().is_some() => format!("there is no file `{place}`"),
            Kind::NotFound => format!("there is no file or folder `{place}`"),
            _ => format!("cannot read {place}: {error}"),
        };
        Self::input(code, message).at(place).help(help)
    }

    /// A file that cannot be written. A disk without room has a code of its own, for it is mended otherwise
    /// than a path that is wrong.
    pub fn unwritten(path: &Path, error: &io::Error) -> Self {
        let place = path.display().to_string();
        if write::is_full(error) {
            let (help, why) = room(error);
            let why = why.map_or_else(|| error.to_string(), str::to_owned);
            let message = format!("no room left on the disk for {place}: {why}");
            let help = format!("{help} and try again; what was there before is as it was");
            return Self::input("io::full", message).at(place).help(help);
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|_| error.kind() == io::ErrorKind::NotFound)
            && !folder.exists()
        {
            return Self::input("io::write", format!("there is no folder `{}`", folder.display()))
                .at(place)
                .help("make it first, or name a place in another folder");
        }
        Self::input("io::write", format!("cannot write {place}: {error}"))
            .at(place)
            .help("does its folder exist? check its permissions")
    }

    /// A file that would be lost.
    pub fn there(path: &Path) -> Self {
        Self::input("new::there", "there is a file of that name already")
            .at(path.display().to_string())
            .help("take another name, or move the file away")
    }

    /// A file whose name says that it is something else than what is written.
    pub fn ending(path: &Path, endings: &[&str]) -> Self {
        let dotted: Vec<String> = endings.iter().map(|ending| format!(".{ending}")).collect();
        let message = format!("the file's name does not end in {}", dotted.join(" or "));
        let failure = Self::input("io::ending", message).at(path.display().to_string());
        match endings.first() {
            Some(ending) => failure.help(format!(
                "name it {}; another ending does not change what is written",
                path.with_extension(ending).display()
            )),
            None => failure,
        }
    }

    /// The failure of one of several calls: those before it succeeded, and `left` after it were not run.
    #[must_use]
    pub fn after(mut self, runs: &[workcell::Run], left: usize) -> Self {
        let help = self.help.unwrap_or_default();
        let help = help.strip_prefix(UNTOUCHED).unwrap_or(&help);
        self.help = Some(format!(
            "calls before it: {}, done; after it: {left}, not run; {help}",
            runs.len()
        ));
        self.runs = serde_json::to_value(runs).ok().map(Box::new);
        self
    }

    /// No folder could be made for a run; `option` names the folder they are made in.
    pub fn no_run_folder(path: &Path, error: &io::Error, option: &str) -> Self {
        if write::is_full(error) {
            return Self::unwritten(path, error);
        }
        Self::input("io::write", format!("cannot make a run folder: {error}"))
            .at(path.display().to_string())
            .help(format!("name a folder that may be written with `{option} DIR`"))
    }

    /// Bad usage or input: exit code 2.
    pub fn input(code: &str, message: impl Into<String>) -> Self {
        Self {
            code: code.into(),
            message: shortened(&message.into(), LONGEST.0).into_owned(),
            place: None,
            help: None,
            is_shown: false,
            runs: None,
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

/// What would help where there is no room, and why there is none where that is not the disk.
fn room(error: &io::Error) -> (&'static str, Option<&'static str>) {
    if error.kind() == io::ErrorKind::FileTooLarge {
        let why = "a limit on the size of files is reached";
        return ("make room, or raise the limit (`ulimit -f`),", Some(why));
    }
    ("make room", None)
}

/// What would help where the arm does not get at a thing.
fn brought_nearer(object: &str, short: &workcell::Short) -> String {
    use workcell::Short;
    match short {
        Short::By(_) => format!("move `{object}` nearer to the arm"),
        Short::AtEnd(joint) => format!("move `{object}` to where `{joint}` need not go so far"),
        Short::NotTurned => {
            format!("move `{object}`, or mount the hand so that the arm can point it level or down")
        }
    }
}

/// Words why a verb of the cell could not be done.
pub fn cell_failure(error: &workcell::Error, style: Style) -> Failure {
    use workcell::Error;
    let words = error.to_string();
    match error {
        Error::Text(wrong) => texts_failure(&wrong.iter().map(|(d, s)| (d, s)).collect::<Vec<_>>(), style),
        Error::File { path, error } => Failure::unwritten(path, error),
        Error::Unrecorded { dir, error } => {
            let dir = dir.display().to_string();
            let (help, failure) = if write::is_full(error) {
                let (help, why) = room(error);
                let why = why.map_or_else(String::new, |why| format!(": {why}"));
                let message = format!(
                    "no room left on the disk; the arm was stopped and holds, and what was written so far \
                     is kept in {dir}{why}"
                );
                (help, Failure { code: "io::full".into(), ..Failure::stopped(message) })
            } else {
                let message = format!("{words}; the arm was stopped and holds");
                let failure = Failure { code: "io::write".into(), ..Failure::stopped(message) };
                ("check the folder", failure)
            };
            let help = format!("{help} and call it again; `trueup replay {dir}` tells what is kept");
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
        Error::Calibrate(error) => uncalibrated(error, words),
        Error::NotSeen(object) => Failure::no("camera::not_seen", words)
            .at(object.clone())
            .help("clear the view and try again; nothing has moved towards it"),
        Error::OutOfReach { object, short, .. } => {
            let failure = Failure::no("plan::out_of_reach", words).at(object.clone());
            failure.help(format!("{}; nothing has moved", brought_nearer(object, short)))
        }
        Error::OffTable { object, .. } => Failure::no("run::off_table", words)
            .at(object.clone())
            .help("name a place on the table, away from its edge; nothing has moved"),
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
        Error::Empty { source_name } | Error::NearlyEmpty { source_name, .. } => {
            Failure::no("run::vessel_empty", words).at(source_name.clone()).help(
                "fill it, then `:look`; at the prompt `:reset` opens a fresh laboratory; nothing has moved",
            )
        }
        Error::NotWeighable { least, .. } => {
            let least = (1e6 * least).round();
            Failure::no("run::not_weighable", words)
                .help(format!("pour at least `amount: {least:.0} mL`; nothing has moved"))
        }
        Error::Needs { what, .. } => {
            Failure::no("run::needs", words).help(format!("{}; nothing has moved", made_true(what)))
        }
        Error::HandFull { .. } | Error::NotInHand { .. } => {
            let first = error.first().unwrap_or_default();
            Failure::no("run::needs", words).help(format!("{first}; nothing has moved"))
        }
        Error::NoSurvivor { failure, water, .. } => {
            let help = way_out(&failure.cause, water.as_ref());
            Failure::no("plan::no_survivor", words).help(format!("{UNTOUCHED}{help}"))
        }
        Error::Record { path, .. } => Failure::input("io::run", words)
            .at(path.display().to_string())
            .help("a run folder has a `run.json`, written by `trueup run` or at the prompt"),
        Error::Model { endpoint, .. } => Failure::unavailable("vqa::unavailable", words)
            .at(endpoint.clone())
            .help("is the server running, and does the address end in `/v1`? nothing has moved"),
        Error::WhatIf(_) => Failure::input("run::what_if", words)
            .help("`:runs` lists the runs, `:replay RUN` shows the steps of one"),
        Error::NothingToDo => Failure::input("run::empty", words),
        Error::Action(action) => action_failure(action, words),
    }
}

/// Words why an action ended early.
fn action_failure(action: &ActionError, words: String) -> Failure {
    match action {
        ActionError::Limit(LimitError::Jump { .. }) => {
            Failure::stopped(words).help("call it again: it is then planned from where the arm is")
        }
        ActionError::Stopped | ActionError::Limit(_) => Failure::stopped(words),
        ActionError::Device(device) => {
            let failure = Failure::unavailable("device", words).help(device.help());
            let exit = if device.is_limit() { Exit::Stopped as u8 } else { failure.exit };
            Failure { exit, ..failure }
        }
        ActionError::NoWay(no_way) => {
            Failure::no("run::action", words).help(way_out(&Cause::NoWay(no_way.clone()), None))
        }
        ActionError::Refused(Refusal::InTheWay { name, .. }) => {
            Failure::no("run::action", words).at(name.clone()).help(format!(
                "call it again when `{name}` is out of the arm's way; in a laboratory it rests at the first corner of its `way_m` until \
                 `begins_s`, and at the last in the end"
            ))
        }
        _ => Failure::no("run::action", words),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::DeviceError;

    /// A stuck joint was told as an arm that is not available.
    #[test]
    fn a_limit_that_stopped_the_arm_is_a_stop_and_an_arm_that_is_away_is_not() {
        let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
        let exit = |device: DeviceError| cell_failure(&device.into(), style).exit();
        assert_eq!(
            exit(DeviceError::FollowingError { joint: 2, error_deg: 12.0, limit_deg: 11.5 }),
            Exit::Stopped as u8
        );
        assert_eq!(exit(DeviceError::Unavailable("gone".into())), Exit::Unavailable as u8);
    }

    /// It stood without a word of what works then.
    #[test]
    fn a_path_that_begins_elsewhere_is_told_with_what_would_help() {
        let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
        let error = ActionError::from(LimitError::Jump { joint: 1, jump_deg: 56.2 });
        let failure = cell_failure(&error.into(), style);
        assert_eq!(failure.exit(), Exit::Stopped as u8);
        assert!(failure.help.unwrap().starts_with("call it again"));
    }

    /// "`hand` has been in the way for 20 s; the arm waits no longer" stood alone.
    #[test]
    fn what_stays_in_the_way_is_told_with_what_would_help() {
        let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
        let error = ActionError::from(Refusal::InTheWay { name: "hand".into(), seconds: 20.1 });
        let failure = cell_failure(&error.into(), style);
        assert_eq!((failure.code.as_str(), failure.exit()), ("run::action", 1));
        assert!(failure.help.unwrap().contains("`way_m`"));
    }
}
