//! Every error, verdict and finding → text for people or JSON for programs; the one place that words things.
//!
//! Layers below return data. What a person reads comes from here, always in the same order: what, where,
//! what would help. Colour only repeats what the words say, and is left out for `NO_COLOR` and pipes.

mod numbers;
pub mod aligned;
pub mod calibrated;
pub mod changes;
pub mod course;
pub mod energy;
pub mod exit;
pub mod export;
mod failure;
mod folded;
pub mod film;
pub mod fork;
pub mod gap;
pub mod gap_page;
pub mod grid;
pub mod hand_eye;
pub mod html;
pub mod kept;
pub mod marks_sheet;
pub mod panics;
pub mod record;
pub mod run;
pub mod run_page;
pub mod seen;
pub mod sentence;
pub mod teach;
pub mod paper;
#[cfg(feature = "arrow")]
pub mod parquet;
pub mod plot;
pub mod trials;
mod uncalibrated;
pub mod vqa;
pub mod water;
mod way_out;
pub mod why;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write as _};
use std::sync::OnceLock;

use serde_json::{Value, json};

pub use failure::{Failure, cell_failure, problems_failure, text_failure};
pub use seen::{measured, others_masks, segments, sighting, whose_mask};

use crate::language::ast::Param;
use crate::language::{self, Diagnostic, Source};
use crate::plain::{coloured, picture, shortened, visible};
use crate::world::{Scene, WorldState};

/// How to speak: to a person or a program, in colour or plain, at length or not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "five answers of the command line and the terminal that do not depend on each other"
)]
pub struct Style {
    /// One JSON document on stdout and nothing else there.
    pub json: bool,
    /// No progress and no tables.
    pub quiet: bool,
    /// All there is about every step.
    pub verbose: bool,
    /// Colour on stdout.
    pub colour: bool,
    /// Whether stderr is a terminal, so that progress may be a bar.
    pub bars: bool,
}

impl Style {
    /// Words alone, for pages and files.
    pub fn plain() -> Self {
        Self { json: false, quiet: false, verbose: false, colour: false, bars: false }
    }

    /// Looks at the terminal and the environment once.
    pub fn detect(json: bool, quiet: bool, verbose: bool) -> Self {
        Self {
            json,
            quiet,
            verbose,
            colour: !Self::is_plain() && !json && io::stdout().is_terminal(),
            bars: io::stderr().is_terminal(),
        }
    }

    /// Whether the environment asks for no colour: `NO_COLOR` is set, or the terminal knows none.
    pub fn is_plain() -> bool {
        std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
            || std::env::var_os("TERM").is_some_and(|value| value == "dumb")
    }

    /// Prints a line on stdout for people, folded where a terminal would cut it; nothing in JSON mode.
    pub fn say(self, line: impl AsRef<str>) {
        if !self.json {
            out(&folded::fitted(line.as_ref(), folded::columns(&io::stdout())));
        }
    }

    /// Prints lines of sentences on stdout for people, on a terminal no wider than is good to read.
    pub fn tell(self, text: &str) {
        if self.bars {
            self.say(folded::sentences(text, folded::columns(&io::stdout())));
        } else {
            self.say(text);
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
            let mut document = json!({"error": {
                "code": failure.code,
                "message": failure.message,
                "where": failure.place,
                "help": failure.help,
            }});
            if let Some(runs) = &failure.runs {
                document["runs"] = json!(runs);
            }
            self.document(&document);
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
        let columns = folded::columns(&io::stderr());
        complain(&if self.bars { folded::sentences(&text, columns) } else { text });
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
    written(writeln!(io::stdout().lock(), "{}", coloured(line)));
}

/// Why an answer is not, or not wholly, where it was to be written.
static UNWRITTEN: OnceLock<String> = OnceLock::new();

/// Remembers that stdout could not be written; that nobody reads it any more is not our error.
fn written(result: io::Result<()>) {
    if let Err(error) = result
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        UNWRITTEN.get_or_init(|| error.to_string());
    }
}

/// Returns the failure of an answer that could not be written.
pub fn unwritten_answer() -> Option<Failure> {
    let why = UNWRITTEN.get()?;
    let failure = Failure::input("io::write", format!("the answer could not be written: {why}"));
    Some(failure.help("is there room where the output goes to?"))
}

/// Characters of a text that a bar shows.
const LONGEST: usize = 900;

/// Returns a text as a bar may show it, which writes to the terminal by itself: without what a terminal obeys.
pub fn shown(text: &str) -> String {
    shortened(&visible(text), LONGEST).into_owned()
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
    written(writeln!(io::stdout().lock(), "{plain}"));
}

/// Writes a line to stderr, folded where a terminal would cut it, and without what a terminal would obey but for colours; a
/// closed pipe is not our error.
pub fn complain(line: &str) {
    let line = folded::fitted(line, folded::columns(&io::stderr()));
    let _ = writeln!(io::stderr().lock(), "{}", coloured(&line));
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

/// Mistakes of one kind that are drawn of a text; the others are counted.
const DRAWN: usize = 20;

/// Draws diagnostics as the terminal can show them: a few of each kind, and how many more there are.
pub fn diagnostics<'a>(
    wrong: impl IntoIterator<Item = (&'a Diagnostic, &'a Source)>,
    style: Style,
) -> Vec<String> {
    let mut seen: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut drawn = Vec::new();
    for (each, source) in wrong {
        let seen = seen.entry((&source.name, each.code)).or_default();
        *seen += each.count;
        if *seen <= DRAWN || each.count > 1 {
            drawn.push(diagnostic(each, source, style));
        }
    }
    let more = seen.into_iter().filter(|((_, code), seen)| *seen > DRAWN && *code != "task::more");
    drawn.extend(
        more.map(|((name, code), seen)| format!("and {} more of {code} in {name}\n", seen - DRAWN)),
    );
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

/// Words what is on the table.
pub fn objects(scene: &Scene, state: &WorldState) -> String {
    let mut text = String::new();
    for object in &scene.objects {
        let known = state.object(&object.name);
        // What hangs in the hand goes where the hand goes; a drawer stays in its case.
        let is_held = state.held.as_deref() == Some(&object.name);
        let is_drawer = scene.drawer(&object.name).is_some();
        let place = match known.and_then(|o| o.world_from_object) {
            Some(_) if is_held && !is_drawer => "in the hand".to_owned(),
            Some(pose) => {
                let at = pose.origin();
                let std = known.map_or(f64::NAN, |o| o.std);
                format!("at ({:.1}, {:.1}) cm ± {:.1} mm", at.x * 1e2, at.y * 1e2, std * 1e3)
            }
            None => "not seen yet".to_owned(),
        };
        let water = known.and_then(|o| o.water).map(|water| format!("{:.0} mL", water * 1e6));
        let held = if is_held && is_drawer { "held by its handle" } else { "" };
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
