//! What went wrong, worded for people, with the exit code it deserves.
//!
//! The errors of the layers below come in as data, and leave as a [`Failure`]: what, where, what would help.
//! How it is drawn on a terminal or as JSON is [`super::Style`]'s.

use std::io;
use std::path::Path;

use super::exit::Exit;
use super::uncalibrated::uncalibrated;
use super::{Style, complain, diagnostics};
use crate::execution::error::ActionError;
use crate::files::write;
use crate::graph;
use crate::language::ast::{ExprKind, Step};
use crate::language::{Diagnostic, Library, Source, parse_line};
use crate::plain::shortened;
use crate::trace::{Cause, Unmet, Why};
use crate::workcell::{self, InTwin};

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
        Self::input(code, format!("cannot read {place}: {error}")).at(place).help(help)
    }

    /// A file that cannot be written. A disk without room has a code of its own, for it is mended otherwise
    /// than a path that is wrong.
    pub fn unwritten(path: &Path, error: &io::Error) -> Self {
        let place = path.display().to_string();
        if write::is_full(error) {
            return Self::input(
                "io::full",
                format!("no room left on the disk for {place}: {error}"),
            )
            .at(place)
            .help("make room and try again; what was there before is as it was");
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

/// Returns the call that makes a condition true that is about what is held, if it is one: `place(jar)` for `not held(jar)`.
fn letting_go(condition: &str) -> Option<String> {
    let (Some(Step::Check(condition, _)), _) = parse_line(&format!("check {condition}")) else {
        return None;
    };
    let ExprKind::Not(held) = &condition.kind else { return None };
    let ExprKind::Call(call) = &held.kind else { return None };
    let ExprKind::Name(object) = &call.args.first()?.values.first()?.kind else { return None };
    let is_held = matches!(call.name.text.as_str(), "held" | "holding" | "grasped");
    // Which thing it is, where it is any, the hand knows.
    is_held.then(|| if object == "any" { "place".to_owned() } else { format!("place({object})") })
}

/// Says how a condition is made true.
fn made_true(condition: &str) -> String {
    match letting_go(condition) {
        Some(call) => format!("put down what is held first, with `{call}`"),
        None => "make it true first".to_owned(),
    }
}

/// Says what a person could change when an amount of water came out otherwise than promised.
fn about_water(water: &InTwin, unmet: &Unmet) -> &'static str {
    /// Less than this share of what is missing is not what went wrong, no unit.
    const PART: f64 = 0.5;
    let missing = unmet.margin.map_or(0.0, |margin| margin.value.abs());
    if water.spilt > PART * missing {
        "what was spilt would need a wider vessel; a smaller `amount:` may spill less"
    } else if unmet.numbers.is_some_and(|(volume, limit)| volume.value > limit.value) {
        "more came than may come; ask for less, with `amount:`"
    } else {
        "nothing of it was spilt: it stayed where it was; ask for less, with `amount:`"
    }
}

/// Says what a person could change when this stopped the best plan in the twin, with the water in it.
fn way_out(cause: &Cause, water: Option<&InTwin>) -> String {
    let no_way = match cause {
        Cause::NoWay(no_way) => no_way,
        Cause::Needs(unmet) => return made_true(&unmet.term),
        Cause::TooHeavy(_) => return "the hand cannot hold it; take something lighter".to_owned(),
        Cause::Overloaded(overload) => {
            return match &overload.held {
                Some(held) => format!("take something lighter than `{held}`, or put less in it"),
                None => {
                    "do it nearer to the arm, or check the efforts in the robot's URDF".to_owned()
                }
            };
        }
        // Their own words say what would have to be otherwise.
        Cause::Refused(_)
        | Cause::Script(_)
        | Cause::NotRemembered { .. }
        | Cause::Conflict { .. } => {
            return "the reason says what would have to be otherwise".to_owned();
        }
        Cause::Overdue(_) | Cause::Endless { .. } | Cause::Mistimed(_) => {
            return "give it more time".to_owned();
        }
        _ => {
            return match (cause.unmet(), water) {
                (Some(unmet), Some(water)) => about_water(water, unmet).to_owned(),
                (Some(unmet), None) if letting_go(&unmet.term).is_some() => {
                    made_true(&unmet.term)
                }
                _ => {
                    "if it is a matter of room, move the objects nearer to the arm or closer together"
                        .to_owned()
                }
            };
        }
    };
    let help = match &no_way.why {
        Why::NotSeen(_) => "clear the camera's view of it and try again",
        Why::TooWide { .. } | Why::NoSides => {
            "the hand does not get around it: take something narrower, or `push` it along the table"
        }
        Why::FingersShort { .. } => {
            "take it by a side where it is less deep, or `push` it along the table"
        }
        Why::OverOutOfReach(over) => {
            return format!("move `{}` nearer to the arm", over.target);
        }
        Why::OutOfReach { .. } => "move it nearer to the arm",
        Why::AtEnd { joint } => return format!("move it to where `{joint}` need not go so far"),
        Why::NotTurned => "move it, or let the hand come from another side",
        Why::Blocked { .. } | Why::NoPath(_) | Why::NotWithin(_) => {
            "move what is in the way, or make room around it"
        }
        Why::Tilted(tilted) => {
            let held = &tilted.held;
            return if tilted.is_vessel {
                format!("bring it upright first, with `untilt({held})`")
            } else {
                format!("bring `{held}` upright first")
            };
        }
        Why::IntoHeld { held, .. } => {
            return format!("put down what is in the hand first, with `place({held})`");
        }
        Why::TooNear(near) if near.which == "goal" => {
            return format!(
                "{} has to be farther from {} there: let the arm begin elsewhere, as with another `home` in its robot's `robot.toml`, \
                 or move what is near",
                near.first, near.second
            );
        }
        Why::TooNear(_) => "make room around the arm, or bring it elsewhere first",
        Why::OffTable(_) => "name a place on the table, away from its edge",
        Why::NoFreePlace => "make room on the table: `put` something on something else",
        Why::Shallow { .. } => "fill it, or take a narrower vessel",
        Why::EmptyHand => "`pick` something first",
        Why::OverOpening => "take it by its side: `approach` takes the face, `side`",
        Why::Topples { .. } => "`pick` it instead, or push something wider",
        Why::Lifted { .. } => "`put` it there instead",
        Why::Stopped => "call it again",
    };
    help.to_owned()
}

/// Words why a verb of the cell could not be done.
pub fn cell_failure(error: &workcell::Error, style: Style) -> Failure {
    use workcell::{Error, Short};
    let words = error.to_string();
    match error {
        Error::Text(wrong) => texts_failure(&wrong.iter().map(|(d, s)| (d, s)).collect::<Vec<_>>(), style),
        Error::File { path, error } => Failure::unwritten(path, error),
        Error::Unrecorded { dir, error } => {
            let dir = dir.display().to_string();
            let (help, failure) = if write::is_full(error) {
                let message = format!(
                    "no room left on the disk; the arm was stopped and holds, and what was written so far \
                     is kept in {dir}"
                );
                ("make room", Failure { code: "io::full".into(), ..Failure::stopped(message) })
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
            let help = match short {
                Short::By(_) => format!("move `{object}` nearer to the arm"),
                Short::AtEnd(joint) => {
                    format!("move `{object}` to where `{joint}` need not go so far")
                }
                Short::NotTurned => format!(
                    "move `{object}`, or mount the hand so that the arm can point it level or down"
                ),
            };
            let failure = Failure::no("plan::out_of_reach", words).at(object.clone());
            failure.help(format!("{help}; nothing has moved"))
        }
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
        Error::Empty { source_name } => Failure::no("run::vessel_empty", words)
            .at(source_name.clone())
            .help("fill it, then `:look`; at the prompt `:reset` opens a fresh laboratory; nothing has moved"),
        Error::NotWeighable { least, .. } => {
            let least = (1e6 * least).round();
            Failure::no("run::not_weighable", words)
                .help(format!("pour at least `amount: {least:.0} mL`; nothing has moved"))
        }
        Error::Needs { what, .. } => {
            Failure::no("run::needs", words).help(format!("{}; nothing has moved", made_true(what)))
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
        ActionError::Stopped | ActionError::Limit(_) => Failure::stopped(words),
        ActionError::Device(device) => {
            let failure = Failure::unavailable("device", words).help(device.help());
            let exit = if device.is_limit() { Exit::Stopped as u8 } else { failure.exit };
            Failure { exit, ..failure }
        }
        ActionError::NoWay(no_way) => {
            Failure::no("run::action", words).help(way_out(&Cause::NoWay(no_way.clone()), None))
        }
        _ => Failure::no("run::action", words),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::DeviceError;
    use crate::trace::{NoWay, Tilted, TooNear};
    use crate::units::{Dimension, Quantity};

    fn unmet(condition: &str, margin: Option<f64>) -> Unmet {
        let margin = margin.map(|value| Quantity { value, dimension: Dimension::VOLUME });
        Unmet { condition: condition.into(), term: condition.into(), margin, numbers: None }
    }

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

    #[test]
    fn the_help_fits_what_stopped_the_plan() {
        assert!(
            way_out(&Cause::Needs(unmet("not held(jar)", None)), None).contains("`place(jar)`")
        );
        assert!(way_out(&Cause::Promise(unmet("not held(any)", None)), None).contains("`place`"));
        assert_eq!(way_out(&Cause::Needs(unmet("upright(jar)", None)), None), "make it true first");
        let heavy = way_out(&Cause::TooHeavy("too heavy".into()), None);
        assert!(heavy.contains("lighter"), "{heavy}");
        let no_way = |why| Cause::NoWay(NoWay { what: "to get there".into(), why });
        let (held, angle, most) = ("jar".to_owned(), 0.9, 0.14);
        let tilted = Tilted { held: held.clone(), is_vessel: true, angle, most };
        assert!(way_out(&no_way(Why::Tilted(tilted)), None).ends_with("`untilt(jar)`"));
        let says = "the goal is in collision: shoulder_link and jar overlap by 16.3 mm".into();
        let home = no_way(Why::IntoHeld { held, says });
        assert!(way_out(&home, None).ends_with("`place(jar)`"));
        let near = |which: &str| {
            let (first, second) = ("hand".into(), "table".into());
            no_way(Why::TooNear(Box::new(TooNear {
                which: which.into(),
                first,
                second,
                apart: 0.002,
                kept: 0.04,
            })))
        };
        assert!(way_out(&near("goal"), None).starts_with("hand has to be farther from table"));
        assert!(way_out(&near("start"), None).starts_with("make room around the arm"));
        let poured = Cause::Promise(unmet("volume(cup) >= 81 mL", Some(-27e-6)));
        let water = |spilt| InTwin { vessels: vec![("cup".into(), 54e-6)], spilt };
        assert!(way_out(&poured, Some(&water(25e-6))).contains("wider vessel"));
        assert!(way_out(&poured, Some(&water(0.0))).contains("stayed where it was"));
        assert!(water(25e-6).to_string().ends_with("cup 54.0 mL, spilt 25.0 mL"));
    }
}
