//! Completion, hints and multi-line input for the prompt, from names cached when it was opened.

use rustyline::completion::{Completer, Pair};
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::SearchDirection;
use rustyline::validate::{ValidationContext, ValidationResult, Validator};
use rustyline::{Context, Result};

use crate::language;
use crate::report::Style;
use crate::workcell::WorkCell;

/// What may be typed, with what completion puts there.
pub(super) struct Helper {
    /// Tasks and actions: name and signature.
    callables: Vec<(String, String)>,
    /// Objects: name, type and looks.
    objects: Vec<(String, String)>,
    commands: Vec<&'static str>,
    colour: bool,
}

impl Helper {
    /// Caches the names of a cell.
    pub(super) fn new(cell: &WorkCell, style: Style) -> Self {
        let library = cell.library();
        let tasks = library.tasks().map(|(t, _)| (t.name.text.clone(), &t.params));
        let actions = library.actions().map(|(a, _)| (a.name.text.clone(), &a.params));
        let callables = tasks
            .chain(actions)
            .map(|(name, params)| {
                let params: Vec<_> =
                    params.iter().map(|p| format!("{}: {}", p.name.text, p.ty.text)).collect();
                (name.clone(), format!("{name}({})", params.join(", ")))
            })
            .collect();
        let objects = cell
            .scene()
            .objects
            .iter()
            .map(|o| (o.name.clone(), format!("{}  {}  {}", o.name, o.kind, o.looks)))
            .collect();
        let commands =
            vec![":help", ":objects", ":tasks", ":graph ", ":align", ":look", ":why", ":quit"];
        Self { callables, objects, commands, colour: style.colour }
    }
}

impl Completer for Helper {
    type Candidate = Pair;

    fn complete(&self, line: &str, pos: usize, _: &Context<'_>) -> Result<(usize, Vec<Pair>)> {
        let before = &line[..pos];
        if before.starts_with(':') && !before.contains(' ') {
            let found = self.commands.iter().filter(|c| c.starts_with(before));
            let pairs =
                found.map(|c| Pair { display: (*c).to_owned(), replacement: (*c).to_owned() });
            return Ok((0, pairs.collect()));
        }
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let start = before.rfind(|c| !is_name(c)).map_or(0, |at| at + 1);
        let word = &before[start..];
        let mut pairs = Vec::new();
        let inside = before[..start].contains('(') && !before.starts_with(":graph ")
            || before[..start].matches('(').count() > before[..start].matches(')').count();
        if inside {
            for (name, shown) in self.objects.iter().filter(|(name, _)| name.starts_with(word)) {
                pairs.push(Pair { display: shown.clone(), replacement: name.clone() });
            }
        } else {
            for (name, shown) in self.callables.iter().filter(|(name, _)| name.starts_with(word)) {
                pairs.push(Pair { display: shown.clone(), replacement: format!("{name}(") });
            }
        }
        Ok((start, pairs))
    }
}

impl Hinter for Helper {
    type Hint = String;

    fn hint(&self, line: &str, pos: usize, context: &Context<'_>) -> Option<String> {
        if line.is_empty() || pos < line.len() {
            return None;
        }
        // A call that has just been opened shows what it takes; otherwise the last line like it.
        if let Some(name) = line.strip_suffix('(')
            && let Some((_, shown)) = self.callables.iter().find(|(known, _)| known == name)
        {
            return Some(shown[name.len() + 1..].to_owned());
        }
        let history = context.history();
        let last = history.len().checked_sub(1)?;
        let found = history.starts_with(line, last, SearchDirection::Reverse).ok()??;
        found.entry.get(pos..).map(str::to_owned)
    }
}

impl Highlighter for Helper {
    fn highlight_hint<'h>(&self, hint: &'h str) -> std::borrow::Cow<'h, str> {
        if self.colour { format!("\x1b[2m{hint}\x1b[0m").into() } else { hint.into() }
    }
}

impl Validator for Helper {
    fn validate(&self, context: &mut ValidationContext<'_>) -> Result<ValidationResult> {
        let line = context.input();
        let is_statement = !line.starts_with(':') && !line.starts_with('?');
        Ok(if is_statement && language::is_incomplete(line) {
            ValidationResult::Incomplete
        } else {
            ValidationResult::Valid(None)
        })
    }
}

impl rustyline::Helper for Helper {}
