//! Lines that ask: a fluent, a comparison, a quantity, a name. Nothing moves, and no run begins.

use crate::language::ast::{BinaryOp, Expr, ExprKind, Step};
use crate::language::sentence::{self, Knowledge};
use crate::language::{self, Source, builtins, text};
use crate::report::exit::Exit;
use crate::report::{self, Failure};
use crate::teach::words;
use crate::workcell::{self, WorkCell, check::check_step};

use super::Session;
use super::commands::{COMMANDS, nothing_stepped};

/// Words for a command that has another name.
const OTHERWISE: &[(&str, &str)] = &[
    ("exit", "quit"),
    ("q", "quit"),
    ("bye", "quit"),
    ("man", "help"),
    ("hilfe", "help"),
    ("aide", "help"),
    ("ayuda", "help"),
    ("aiuto", "help"),
    ("ajuda", "help"),
];

impl Session<'_, '_> {
    /// Returns the word of stepping that a line says, where it says nothing else.
    pub(super) fn stepping_word<'l>(&self, line: &'l str) -> Option<&'l str> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let number = rest.trim().trim_end_matches('%').trim_end();
        let is_whole =
            rest.is_empty() || (matches!(word, "slow" | "back") && number.parse::<usize>().is_ok());
        // These are commands or of the language as well.
        let is_other = matches!(word, "why" | "break" | "quit")
            || self.values.all().any(|(name, _)| name == word)
            || self.scope.objects.contains_key(word)
            || self.library.callable(word).is_some();
        (words::is_word(word) && is_whole && !is_other).then_some(word)
    }

    /// Answers a line that is one word and no call: a value that was named, an object, a command without its
    /// colon, a name that nothing has. `false` when it is none of these.
    pub(super) fn named(&self, word: &str) -> Result<bool, Failure> {
        if let Some((name, value)) = self.values.all().find(|(name, _)| *name == word) {
            self.style.say(format!("{name} = {value}"));
            return Ok(true);
        }
        if self.scope.objects.contains_key(word) {
            self.tell_about(word);
            return Ok(true);
        }
        if let Some((callable, _)) = self.library.callable(word) {
            let needed = callable.params().iter().filter(|param| param.default.is_none());
            let needed: Vec<&str> = needed.map(|param| param.name.text.as_str()).collect();
            let help = if needed.is_empty() {
                format!("write `{word}()`")
            } else {
                let args = needed.join(", ");
                format!("write `{word}({args})` with what it acts on; `?{word}` says more")
            };
            let words = format!("`{word}` is called with parentheses");
            return Err(Failure::input("task::call", words).help(help));
        }
        if matches!(word, "y" | "yes" | "n" | "no") {
            return Err(Failure::input("repl::unasked", format!("`{word}` answers nothing")).help(
                "a question that was asked is gone with the next line; type the call again",
            ));
        }
        if matches!(word, "stop" | "halt") {
            return Err(nothing_stepped("stop"));
        }
        let other = OTHERWISE.iter().find(|(other, _)| *other == word);
        let meant = other.map_or(word, |(_, name)| *name);
        // `redo` is `:redo-edit`.
        let is_meant = |name: &str| {
            name == meant || name.split_once('-').is_some_and(|(head, _)| head == meant)
        };
        let command = COMMANDS.iter().find(|command| is_meant(command.name));
        let is_known = language::is_of_language(word)
            || language::assist::describe(&self.library, &self.scope, word).is_some();
        if !is_known && let Some(help) = self.instead(word) {
            let words = format!("nothing here is called `{word}`");
            return Err(Failure::input("repl::unknown", words).help(help));
        }
        if let Some(command) = command
            && (!is_known || command.name == meant)
        {
            return Err(Failure::input("repl::command", format!("nothing is called `{word}`"))
                .help(format!("commands begin with a colon: `:{}`", command.name)));
        }
        // `a-b` may be a difference.
        if is_known || !word.starts_with(char::is_alphabetic) || word.contains('-') {
            return Ok(false);
        }
        let near = language::assist::nearest_name(&self.library, &self.scope, word);
        let near = near.map(str::to_owned).or_else(|| {
            let commands = COMMANDS.iter().map(|command| command.name);
            language::nearest(word, commands).map(|name| format!(":{name}"))
        });
        let failure = Failure::input("repl::unknown", format!("nothing here is called `{word}`"));
        Err(failure.help(match near {
            Some(near) => format!("did you mean `{near}`?"),
            None if sentence::is_foreign(word) => {
                "sentences are in English; `:help` lists what can be typed".to_owned()
            }
            None => "`:tasks` lists what can be called, `:help` the commands".to_owned(),
        }))
    }

    /// Whether a word alone means something at the prompt: a name, a command, an answer, a word of stepping or of the language.
    pub(super) fn is_taken(&self, word: &str) -> bool {
        let is_command = COMMANDS.iter().any(|command| command.name == word)
            || OTHERWISE.iter().any(|(other, _)| *other == word)
            || matches!(word, "it" | "y" | "yes" | "n" | "no" | "halt");
        is_command
            || words::is_word(word)
            || sentence::is_again(word)
            || language::is_of_language(word)
            || self.values.all().any(|(name, _)| name == word)
            || language::assist::describe(&self.library, &self.scope, word).is_some()
    }

    /// Returns what to do instead of what a word wishes that no task does: `undo`.
    fn instead(&self, word: &str) -> Option<String> {
        let scene = self.library.scene(self.library.default_scene());
        let things = scene.map(|(scene, _)| sentence::things(scene)).unwrap_or_default();
        let with = Knowledge::on_paper(&self.library, &things);
        sentence::instead(&sentence::words(word), &with)
    }

    /// Answers a line that asks what is so or how much something is; `false` when it does neither.
    pub(super) fn asked(&mut self, line: &str) -> Result<bool, Failure> {
        let question = format!("check {line}");
        let (Some(Step::Check(expr, span)), wrong) = language::parse_line(&question) else {
            return Ok(false);
        };
        let is_name = matches!(expr.kind, ExprKind::Name(_) | ExprKind::Text(_) | ExprKind::Bad);
        if is_name || !wrong.is_empty() || !self.is_known(&expr) {
            return Ok(false);
        }
        let source = Source::new("prompt", question.as_str());
        let check = Step::Check(expr.clone(), span);
        let found = check_step(&check, &source, &self.library, &self.stdlib, &self.scope);
        if found.is_empty() {
            self.now(line)?;
            return Ok(true);
        }
        // No condition, then: how much is it?
        let Some(Step::Let(_, value, _)) = self.read_as("let value = ", line) else {
            return Ok(true);
        };
        // Nobody weighs the table while something runs: the scales' word at the end of the last run is the newest.
        let is_spilt = matches!(&value.kind, ExprKind::Call(call) if call.name.text == "spilt");
        if is_spilt && let Some(told) = self.last.as_deref().and_then(report::water::spilt) {
            self.style.say(told);
            return Ok(true);
        }
        let worth = self.measured(&value, false)?;
        let worth = self.in_vessel(&value)?.unwrap_or(worth);
        self.style.say(format!("{line} = {worth}"));
        Ok(true)
    }

    /// Returns what a line that asks for the water in a vessel and nothing else is answered with: how much, and who says so.
    fn in_vessel(&mut self, value: &Expr) -> Result<Option<String>, Failure> {
        let ExprKind::Call(call) = &value.kind else { return Ok(None) };
        let argument = call.args.first().and_then(|arg| arg.values.first());
        let Some(ExprKind::Name(vessel)) = argument.map(|argument| &argument.kind) else {
            return Ok(None);
        };
        if !matches!(call.name.text.as_str(), "filled" | "volume") {
            return Ok(None);
        }
        let style = self.style;
        let cell = self.bench.cell()?;
        let state = cell.state().map_err(|error| report::cell_failure(&error, style))?;
        let there = state.object(vessel).and_then(|object| object.water);
        let declared = cell.scene().object(vessel).and_then(|object| object.cavity);
        let (Some(there), Some(cavity)) = (there, declared) else { return Ok(None) };
        let told = report::water::in_vessel(there, cavity.filled, self.robot == "twin");
        let scales = self.last.as_deref().and_then(|run| report::water::on_scales(run, vessel));
        Ok(Some(match scales {
            Some(scales) => format!("{told}; {scales}"),
            None => told,
        }))
    }

    /// Whether what is called in an expression can be asked.
    fn is_known(&self, expr: &Expr) -> bool {
        let ExprKind::Call(call) = &expr.kind else { return true };
        let name = &call.name.text;
        builtins::function(name).is_some() || self.library.fluent(name).is_some()
    }

    /// Reads a condition now.
    pub(super) fn now(&mut self, condition: &str) -> Result<(), Failure> {
        let condition = self.values.fill(condition).unwrap_or_else(|| condition.to_owned());
        let Some(Step::Check(expr, _)) = self.read_as("check ", &condition) else {
            return Ok(());
        };
        let style = self.style;
        let reading = self.bench.cell()?.read(&expr);
        let reading = reading.map_err(|error| report::cell_failure(&error, style))?;
        style.say(report::why::now(&condition, &reading));
        if reading.truth != Some(true) {
            self.worsen(Exit::No as u8);
        }
        Ok(())
    }

    /// What a quantity is now, as text of the language.
    pub(super) fn worth(&mut self, value: &Expr) -> Result<String, Failure> {
        self.measured(value, true)
    }

    /// What a quantity is now, with all its digits or as people say it.
    fn measured(&mut self, value: &Expr, is_whole: bool) -> Result<String, Failure> {
        let style = self.style;
        let cell = self.bench.cell()?;
        let failed = |error: workcell::Error| report::cell_failure(&error, style);
        if let Some(worth) = cell.quantity(value).map_err(failed)? {
            return Ok(if is_whole { text::quantity(worth) } else { worth.to_string() });
        }
        if let Some(by) = zero_divisor(cell, value).map_err(failed)? {
            let (value, by) = (text::expr(value), text::expr(by));
            let words = format!("`{value}` divides by `{by}`, which is zero now");
            return Err(Failure::no("repl::unknown_value", words)
                .help("divide by something that is not zero"));
        }
        let asks = value.calls();
        let help = if asks.contains(&"spilt") {
            "no camera measures spilt water; the end of a run tells it where there are scales"
                .to_owned()
        } else if asks.iter().any(|name| matches!(*name, "volume" | "filled")) {
            match cell.tilted_vessel().map_err(failed)? {
                Some(held) => format!(
                    "no camera measures water; `untilt({held})` brings the {held} upright and weighs what is left in it"
                ),
                None => "no camera measures water: it is weighed in the hand while it is poured; give a value such \
                         as `40 mL`"
                    .to_owned(),
            }
        } else {
            "give a value such as `40 mL`, or `:look` first".to_owned()
        };
        let words = format!("unknown: `{}` has not been measured", text::expr(value));
        Err(Failure::no("repl::unknown_value", words).help(help))
    }
}

/// Returns what an expression divides by that is zero now, if there is such a thing.
fn zero_divisor<'e>(
    cell: &mut WorkCell,
    value: &'e Expr,
) -> Result<Option<&'e Expr>, workcell::Error> {
    match &value.kind {
        ExprKind::Binary(a, op, b) => {
            let (a, b) = (a.as_ref(), b.as_ref());
            if *op == BinaryOp::Div && cell.quantity(b)?.is_some_and(|by| by.value == 0.0) {
                return Ok(Some(b));
            }
            Ok(zero_divisor(cell, a)?.or(zero_divisor(cell, b)?))
        }
        ExprKind::Negate(inner) => zero_divisor(cell, inner),
        _ => Ok(None),
    }
}
