//! Completion, hints and colours for the prompt, from texts cached when it was opened:
//! nothing here asks a device.

use std::borrow::Cow;
use std::collections::BTreeSet;

use rustyline::completion::{Completer, Pair};
use rustyline::highlight::{CmdKind, Highlighter};
use rustyline::hint::Hinter;
use rustyline::history::SearchDirection;
use rustyline::validate::Validator;
use rustyline::{Context, Result};

use crate::language::assist::{self, CompletionKind, Place};
use crate::language::ast::{ExprKind, Step};
use crate::language::builtins::{self, Ty};
use crate::language::script_words::words_of;
use crate::language::{self, Library, Scope};
use crate::report::Style;
use crate::teach::wording::WORDS;

use super::commands::COMMANDS;
use super::paint::{Known, paint};
use super::table::SETTINGS;

/// What may be typed, with what completion puts there.
#[derive(Clone)]
pub(super) struct Helper {
    library: Library,
    scope: Scope,
    known: Known,
    colour: bool,
    /// Whether a run is paused and takes words of stepping.
    pub(super) steps: bool,
    /// The lines before this one, of a statement that is open.
    pub(super) open: String,
}

/// What could stand behind the name of a command.
enum Behind {
    /// One of these words, in place of the one that begins there.
    Words(usize, Vec<Pair>),
    /// Text of the language that begins there; whether it is a call, and no condition or step.
    Language(usize, bool),
}

impl Helper {
    /// Caches the texts of a cell and the names of its scene.
    pub(super) fn new(library: Library, scope: Scope, style: Style) -> Self {
        let tasks = library.tasks().map(|(task, _)| task.name.text.clone());
        let actions = library.actions().map(|(action, _)| action.name.text.clone());
        let fluents = library.fluents().map(|(fluent, _)| fluent.name.text.clone());
        let calls = tasks.chain(actions).chain(fluents).collect();
        let known = Known { calls, objects: scope.objects.keys().cloned().collect() };
        Self { library, scope, known, colour: style.colour, steps: false, open: String::new() }
    }

    /// Returns where the word before `pos` begins, and what could stand in its place.
    fn offers(&self, line: &str, pos: usize) -> (usize, Vec<Pair>) {
        let before = &line[..pos];
        if let Some(begun) = before.strip_prefix(':')
            && !begun.contains(char::is_whitespace)
        {
            let found = COMMANDS.iter().filter(|command| command.name.starts_with(begun));
            let pairs = found.map(|command| Pair {
                display: format!(":{:<12} {}", command.name, command.what),
                replacement: command.typed(),
            });
            return (0, pairs.collect());
        }
        if self.steps && !before.contains(char::is_whitespace) {
            let found = WORDS.iter().filter(|(word, ..)| word.starts_with(before));
            let pairs = found.map(|(word, _, what)| Pair {
                display: format!("{word:<12} {what}"),
                replacement: (*word).to_owned(),
            });
            return (0, pairs.collect());
        }
        let mut is_call = false;
        let from = match before.chars().next() {
            Some(':') => match self.behind(before) {
                Behind::Words(start, pairs) => return (start, pairs),
                Behind::Language(from, only_call) => {
                    is_call = only_call;
                    from
                }
            },
            Some('?') => 1,
            Some('!') => return (pos, Vec::new()),
            _ => 0,
        };
        let asks = line.starts_with('?');
        if let Some((of, begun)) = before[from..].split_once('.').filter(|_| asks) {
            let found = words_of(of).filter(|word| word.name.starts_with(begun));
            let pairs = found.map(|word| Pair {
                display: format!("{}   {}", word.written(), word.does),
                replacement: word.full_name(),
            });
            return (from, pairs.collect());
        }
        let text = &line[from..];
        let place = Place { library: &self.library, scope: &self.scope, text, at: pos - from };
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let start = before[from..].rfind(|c| !is_name(c)).map_or(from, |at| {
            from + at + before[from + at..].chars().next().map_or(1, char::len_utf8)
        });
        // A number stays as it is; what is offered follows it.
        let is_number = before[start..].starts_with(|c: char| c.is_ascii_digit());
        let start = if is_number { pos } else { start };
        let mut offers = assist::complete(&place);
        if !is_call && start == from && pos > from && offers.is_empty() {
            // A question may stand alone here, as it may behind `check`.
            let text = format!("check {text}");
            let at = place.at + text.len() - place.text.len();
            offers = assist::complete(&Place { text: &text, at, ..place });
            offers.retain(|offer| offer.kind == CompletionKind::Fluent);
        }
        offers.retain(|offer| !is_call || offer.kind != CompletionKind::Keyword);
        let pairs = offers.into_iter().map(|offer| {
            let doc = offer.doc.lines().next().unwrap_or_default().trim();
            let detail = if offer.detail.is_empty() { &offer.label } else { &offer.detail };
            let display = if doc.is_empty() { detail.clone() } else { format!("{detail}   {doc}") };
            Pair { display, replacement: if asks { offer.label } else { offer.insert } }
        });
        (start, pairs.collect())
    }

    /// Tells what could stand behind the name of a command; `before` begins with its colon and reaches up to the place.
    fn behind(&self, before: &str) -> Behind {
        let end = before.len();
        let (mut name, mut rest) = before[1..].split_once(char::is_whitespace).unwrap_or_default();
        // `:set confirm none` is `:confirm none`.
        if name == "set"
            && let Some((setting, value)) = rest.trim_start().split_once(char::is_whitespace)
            && SETTINGS.contains(&setting)
        {
            (name, rest) = (setting, value);
        }
        let Some(command) = COMMANDS.iter().find(|command| command.name == name) else {
            return Behind::Words(end, Vec::new());
        };
        let said = rest.trim_start();
        if name == "phrase" {
            let behind_sentence = said.strip_prefix('"').and_then(|said| said.split_once('"'));
            let call = behind_sentence.and_then(|(_, rest)| rest.trim_start().strip_prefix('='));
            return match call {
                Some(call) => Behind::Language(end - call.trim_start().len(), true),
                None => Behind::Words(end, Vec::new()),
            };
        }
        let at = said.split(char::is_whitespace).count() - 1;
        let begun = said.rsplit(char::is_whitespace).next().unwrap_or_default();
        let words = |found: Vec<Pair>| Behind::Words(end - begun.len(), found);
        if command.takes_names() {
            let names = self.names(command.takes.contains("FLUENT")).into_iter();
            return words(
                names
                    .filter(|name| name.starts_with(begun))
                    .map(|name| {
                        let known =
                            assist::describe(&self.library, &self.scope, name).unwrap_or_default();
                        let display = known.lines().next().unwrap_or(name).to_owned();
                        Pair { display, replacement: name.to_owned() }
                    })
                    .collect(),
            );
        }
        if !command.takes_language(at) {
            let found = command.choices().filter(|word| word.starts_with(begun));
            return words(
                found.map(|word| Pair { display: word.into(), replacement: word.into() }).collect(),
            );
        }
        // The step before a call is no part of it.
        let has_first = at > 0 && command.takes.split(' ').count() == 2;
        let language = match said.split_once(char::is_whitespace) {
            Some((_, second)) if has_first => second.trim_start(),
            _ => said,
        };
        Behind::Language(end - language.len(), command.takes_call(at))
    }

    /// Returns the names of tasks and actions, and those of what is true or false where it is `also_asked`.
    fn names(&self, also_asked: bool) -> BTreeSet<&str> {
        let mut names = BTreeSet::new();
        for callable in self.library.callables() {
            names.insert(callable.name());
        }
        if also_asked {
            let is_condition =
                |function: &&builtins::Builtin| Ty::named(function.result) == Ty::Bool;
            names.extend(self.library.fluents().map(|(fluent, _)| fluent.name.text.as_str()));
            names.extend(
                builtins::FUNCTIONS.iter().filter(is_condition).map(|function| function.name),
            );
        }
        names
    }

    /// Whether a call gives objects of this scene for its objects; a line that is no single call names none.
    fn names_things_here(&self, line: &str) -> bool {
        let (Some(Step::Act(act)), _) = language::parse_line(line) else { return true };
        let Some((callable, _)) = self.library.callable(&act.call.name.text) else { return true };
        let params = callable.params();
        act.call.args.iter().enumerate().all(|(at, arg)| {
            let param = match &arg.name {
                Some(name) => params.iter().find(|param| param.name.text == name.text),
                None => params.get(at),
            };
            let is_object =
                param.is_some_and(|param| matches!(Ty::named(&param.ty.text), Ty::Object(_)));
            !is_object
                || arg.values.iter().all(|value| match &value.kind {
                    ExprKind::Name(name) => self.scope.objects.contains_key(name),
                    _ => true,
                })
        })
    }

    /// Returns the rest of a signature behind a call that has just been opened.
    fn signature(&self, line: &str) -> Option<String> {
        let head = line.strip_suffix('(')?;
        let name = head.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next()?;
        let (callable, _) = self.library.callable(name)?;
        let whole = assist::signature(name, callable.params());
        Some(whole[name.len() + 1..].to_owned())
    }
}

impl Completer for Helper {
    type Candidate = Pair;

    fn complete(&self, line: &str, pos: usize, _: &Context<'_>) -> Result<(usize, Vec<Pair>)> {
        let before = self.open.len();
        let (start, pairs) = self.offers(&format!("{}{line}", self.open), before + pos);
        Ok((start.saturating_sub(before), pairs))
    }
}

impl Hinter for Helper {
    type Hint = String;

    fn hint(&self, line: &str, pos: usize, context: &Context<'_>) -> Option<String> {
        // Without colour it could not be told from what was typed.
        if !self.colour || line.is_empty() || pos < line.len() {
            return None;
        }
        // A call that has just been opened shows what it takes; otherwise the last line like it.
        if let Some(rest) = self.signature(line) {
            return Some(rest);
        }
        if !self.open.is_empty() {
            return None;
        }
        let history = context.history();
        let mut last = history.len().checked_sub(1)?;
        loop {
            let found = history.starts_with(line, last, SearchDirection::Reverse).ok()??;
            if self.names_things_here(&found.entry) {
                return found.entry.get(pos..).map(str::to_owned);
            }
            last = found.idx.checked_sub(1)?;
        }
    }
}

impl Highlighter for Helper {
    fn highlight<'l>(&self, line: &'l str, _: usize) -> Cow<'l, str> {
        if self.colour { paint(line, &self.known).into() } else { line.into() }
    }

    fn highlight_char(&self, _: &str, _: usize, kind: CmdKind) -> bool {
        self.colour && kind != CmdKind::MoveCursor
    }

    fn highlight_hint<'h>(&self, hint: &'h str) -> Cow<'h, str> {
        if self.colour { format!("\x1b[2m{hint}\x1b[0m").into() } else { hint.into() }
    }
}

/// A line is taken as it is: whether it goes on is asked where lines come from.
impl Validator for Helper {}

impl rustyline::Helper for Helper {}

#[cfg(test)]
mod tests {
    use super::*;

    fn helper() -> Helper {
        let library = Library::standard();
        let scope = library.scope(library.default_scene());
        let style = Style { json: false, quiet: false, verbose: false, colour: false, bars: false };
        Helper::new(library, scope, style)
    }

    fn offered(line: &str) -> (usize, Vec<String>) {
        let (start, pairs) = helper().offers(line, line.len());
        (start, pairs.into_iter().map(|pair| pair.replacement).collect())
    }

    #[test]
    fn calls_objects_and_commands_are_completed_where_they_fit() {
        assert_eq!(offered("po"), (0, vec!["pour(".into()]));
        assert_eq!(offered("vis"), (0, vec!["visible(".into()]));
        let (start, found) = offered("pour(ja");
        assert_eq!((start, found), (5, vec!["jar".to_owned()]));
        // A container is wanted, and the table is none.
        let (_, found) = offered("pour(");
        assert!(found.contains(&"cup".into()) && !found.contains(&"table".into()), "{found:?}");
        assert_eq!(offered(":gra"), (0, vec![":graph ".into()]));
        assert_eq!(offered(":graph po"), (7, vec!["pour(".into()]));
        assert_eq!(offered("?po"), (1, vec!["pour".into()]));
        assert_eq!(
            offered("?arm.open"),
            (1, vec!["arm.open".into(), "arm.open_to".into(), "arm.opening".into()])
        );
        let mut paused = helper();
        paused.steps = true;
        let (_, words) = paused.offers("con", 3);
        assert_eq!(words.len(), 1);
        assert_eq!(words[0].replacement, "continue");
        assert_eq!(offered("!po"), (3, Vec::new()));
        assert_eq!(offered("\u{1f600} po").0, 5);
    }

    #[test]
    fn a_line_that_goes_on_is_completed_with_those_before_it() {
        let history = rustyline::history::DefaultHistory::new();
        let open = Helper { open: "pour(jar,\n".into(), ..helper() };
        let (start, pairs) = open.complete("  cu", 4, &Context::new(&history)).unwrap();
        assert_eq!((start, pairs[0].replacement.as_str()), (2, "cup"));
    }

    #[test]
    fn a_sentence_names_things_and_a_command_takes_its_own() {
        let things = ["cup", "jar", "table"].map(str::to_owned);
        assert_eq!(offered("pick up the "), (12, things.to_vec()));
        assert_eq!(offered("pick up the j"), (12, vec!["jar".into()]));
        assert_eq!(offered(":replay "), (8, Vec::new()));
        assert_eq!(offered(":replay 1 "), (10, Vec::new()));
        assert_eq!(offered(":runs "), (6, Vec::new()));
        assert_eq!(offered(":fork 3 po"), (8, vec!["pour(".into()]));
        assert_eq!(offered(":why vis"), (5, vec!["visible(".into()]));
        assert_eq!(offered(":confirm r"), (9, vec!["risky".into()]));
        assert_eq!(offered(":set c"), (5, vec!["confirm".into()]));
        let when = ["all", "risky", "none"].map(str::to_owned);
        assert_eq!(offered(":set confirm "), (13, when.to_vec()));
        assert_eq!(offered(":set dose filled(ja"), (17, vec!["jar".into()]));
        assert_eq!(
            offered(":quiz po"),
            (6, ["pour", "poured", "pouring"].map(str::to_owned).to_vec())
        );
        assert_eq!(offered(":quiz vis"), (6, vec!["visible".into()]));
        assert_eq!(offered(":break gras"), (7, vec!["grasp".into()]));
        assert_eq!(offered(":phrase \"empty the {o}\" = po"), (26, vec!["pour(".into()]));
        assert_eq!(offered(":phrase \"empty po"), (17, Vec::new()));
        // What begins an item or a step is no call, and neither is what is asked.
        assert_eq!(offered(":graph vis"), (7, Vec::new()));
        assert!(offered(":graph ").1.iter().all(|offer| offer.ends_with('(')));
        let (start, found) = offered("put(jar, at: ");
        assert_eq!(start, 13);
        assert!(
            ["cup", "table", "left_of(", "point("].iter().all(|p| found.iter().any(|f| f == p))
        );
        assert!(!found.contains(&"jar".to_owned()), "{found:?}");
        assert_eq!(offered("put(jar, at: le"), (13, vec!["left_of(".into()]));
        assert_eq!(offered("pour(jar, cup, amount: 120").0, 26);
    }

    #[test]
    fn an_object_is_offered_with_its_type_and_a_call_with_its_parameters() {
        let (_, pairs) = helper().offers("pour(ja", 7);
        assert!(pairs[0].display.starts_with("jar: Container"), "{}", pairs[0].display);
        let (_, pairs) = helper().offers("po", 2);
        assert!(pairs[0].display.starts_with("pour(source: Container, "), "{}", pairs[0].display);
        let rest = helper().signature("pick(").unwrap();
        assert_eq!(rest, "o: Graspable)");
    }

    #[test]
    fn without_colour_nothing_is_shown_behind_what_was_typed() {
        let history = rustyline::history::DefaultHistory::new();
        let context = Context::new(&history);
        assert_eq!(helper().hint("pick(", 5, &context), None);
        let coloured = Helper { colour: true, ..helper() };
        assert_eq!(coloured.hint("pick(", 5, &context).as_deref(), Some("o: Graspable)"));
    }

    #[test]
    fn a_line_of_another_scene_is_not_shown() {
        let mut history = rustyline::history::DefaultHistory::new();
        for line in ["pick(jar)", "pick(kettle)", "pick(can, face: top)"] {
            rustyline::history::History::add(&mut history, line).unwrap();
        }
        let context = Context::new(&history);
        let coloured = Helper { colour: true, ..helper() };
        assert_eq!(coloured.hint("pic", 3, &context).as_deref(), Some("k(jar)"));
        assert_eq!(coloured.hint("pick(ket", 8, &context), None);
    }

    #[test]
    fn completion_survives_every_prefix() {
        let line = "pour(jar, cup, amount: 40 mL) while held(jar) // \u{1f600} \"x";
        for at in (0..=line.len()).filter(|at| line.is_char_boundary(*at)) {
            helper().offers(&line[..at], at);
        }
    }
}
