//! Carrying out one statement: what a line is (a command, a sum, a call, a `let`, a question, a sentence), reading and
//! checking it, and what is remembered of it.
//!
//! Where lines come from and when the prompt ends is the loop's, in [`super`]; how a call is stepped through is `step`'s, what a
//! sentence means `sentences`'.

use std::path::PathBuf;

use crate::language::ast::{ExprKind, Step};
use crate::language::{self, Diagnostic, Source, text};
use crate::report::exit::{self, Exit};
use crate::report::{self, Failure};
use crate::workcell::check::check_step;
use crate::workcell::{Ending, Run};

use super::commands::nothing_stepped;
use super::saved::Made;
use super::{Next, Session, paste, sentences};

impl Session<'_, '_> {
    /// Does one line; what is wrong with it is told, and the prompt goes on.
    pub(super) fn line(&mut self, line: &str) -> Next {
        let line = paste::without_notes(line).trim();
        if line.is_empty() {
            return Next::Prompt;
        }
        if let Some(name) = line.strip_prefix('?') {
            // A question about something leaves an open one open.
            self.tell_about(name.trim());
            return Next::Prompt;
        }
        if self.is_idle() && !line.starts_with(':') {
            self.pending = None;
            self.style.say("the line was left undone");
            return Next::Prompt;
        }
        if let Some(pending) = self.pending.take()
            && self.answered(pending, line)
        {
            return Next::Prompt;
        }
        // Whoever asks "why?" means no other thing than who says it.
        let word = line.trim_end_matches(['?', '!']);
        let bare = matches!(word, "help" | "quit" | "exit" | "why") && self.is_free(word);
        if let Some(command) = if bare { Some(word) } else { line.strip_prefix(':') } {
            return self.command(command);
        }
        let done = match line.strip_prefix('!') {
            Some(expression) => self.calculate(expression.trim()),
            None => self.statement(line),
        };
        if let Err(failure) = done {
            self.fail(&failure);
        }
        Next::Prompt
    }

    /// Whether a word is the name of no value, object, task or action.
    fn is_free(&self, word: &str) -> bool {
        self.values.all().all(|(name, _)| name != word)
            && self.library.callable(word).is_none()
            && !self.scope.objects.contains_key(word)
    }

    fn calculate(&mut self, expression: &str) -> Result<(), Failure> {
        let cancel = self.bench.cell()?.cancel();
        cancel.clear();
        // `:reset` brings another laboratory, with a wish of its own.
        self.calculator.stops_when(move || cancel.is_cancelled());
        if let Some(answer) = self.calculator.answer(expression)? {
            self.style.say(answer);
        }
        Ok(())
    }

    /// A call, a `let`, `it`, a question, or a sentence.
    pub(super) fn statement(&mut self, line: &str) -> Result<(), Failure> {
        if line == "it" {
            self.tell_it();
            return Ok(());
        }
        if let Some(word) = self.stepping_word(line) {
            return Err(nothing_stepped(word));
        }
        let is_word = line.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'));
        if is_word && self.is_free(line) && language::sentence::is_again(&line.to_lowercase()) {
            return self.again();
        }
        if is_word && self.is_free(line) && self.taught.hears(line) {
            return self.sentence(line, line);
        }
        if is_word && self.named(line)? {
            return Ok(());
        }
        let filled = match line.split_once('=') {
            // The name that is given is not a value it could stand for.
            Some((head, value)) if head.starts_with("let ") => {
                self.values.fill(value).map(|value| format!("{head}={value}"))
            }
            _ => self.values.fill(line),
        };
        let meant = filled.as_deref().unwrap_or(line);
        let (step, wrong) = language::parse_line(meant);
        let is_read = !wrong.iter().any(Diagnostic::is_error);
        match step {
            Some(Step::Let(name, ..)) if is_read => self.bind(meant, &name.text),
            _ if !is_read && (sentences::looks_like_one(meant) || self.taught.hears(meant)) => {
                self.sentence(meant, line)
            }
            _ if !is_read && is_pasted_sentences(meant) => Err(no_program(meant, &wrong)),
            step => {
                let is_call = match &step {
                    Some(Step::Act(act)) => self.library.callable(&act.call.name.text).is_some(),
                    Some(_) => true,
                    None => false,
                };
                if !is_call && self.asked(meant)? {
                    return Ok(());
                }
                let Some(step) = self.read(meant) else { return Ok(()) };
                if filled.is_some() {
                    self.style.say(format!("= {meant}"));
                }
                self.ask_or_run(step, meant, false);
                Ok(())
            }
        }
    }

    /// `let dose = 40 mL`: worked out now, and remembered.
    fn bind(&mut self, line: &str, name: &str) -> Result<(), Failure> {
        if name == "it"
            || self.scope.objects.contains_key(name)
            || self.library.callable(name).is_some()
        {
            return Err(Failure::input("repl::name", format!("`{name}` means something already"))
                .help("give the value another name"));
        }
        let Some(Step::Let(_, value, _)) = self.read(line) else { return Ok(()) };
        let told = match &value.kind {
            ExprKind::Name(_) | ExprKind::Text(_) | ExprKind::Bool(_) | ExprKind::Literal(_) => {
                text::expr(&value)
            }
            _ => self.worth(&value)?,
        };
        self.style.say(format!("{name} = {told}"));
        self.values.set(name, told);
        Ok(())
    }

    fn tell_it(&self) {
        let object = self.values.it().map_or_else(String::new, |it| format!("it is {it}"));
        let told = match (&self.refused, &self.last) {
            (Some(failure), _) => failure.message.clone(),
            (None, Some(run)) => report::run::ending(run, self.style),
            (None, None) if object.is_empty() => "nothing has run yet".to_owned(),
            (None, None) => String::new(),
        };
        let lines = [told, object];
        let lines: Vec<&str> = lines.iter().map(String::as_str).filter(|l| !l.is_empty()).collect();
        self.style.say(lines.join("\n"));
    }

    /// Reads and checks a line; tells everything that is wrong with it.
    pub(super) fn read(&self, line: &str) -> Option<Step> {
        self.read_as("", line)
    }

    /// As [`Self::read`], with the words that make a step of the line before it.
    pub(super) fn read_as(&self, before: &str, line: &str) -> Option<Step> {
        let whole = format!("{before}{line}");
        let source = Source::new("prompt", whole.as_str());
        let (step, mut wrong) = language::parse_line(&whole);
        if let Some(step) = step.as_ref().filter(|_| wrong.is_empty()) {
            wrong = check_step(step, &source, &self.library, &self.stdlib, &self.scope);
        }
        let source = Source::new("prompt", line);
        let typed: Vec<Diagnostic> =
            wrong.iter().map(|each| each.clone().without_first(before.len())).collect();
        for drawn in report::diagnostics(typed.iter().map(|each| (each, &source)), self.style) {
            report::complain(drawn.trim_end());
        }
        if wrong.iter().any(Diagnostic::is_error) {
            self.worsen(Exit::BadInput as u8);
        }
        step.filter(|_| !wrong.iter().any(Diagnostic::is_error))
    }

    /// Carries out a step and remembers what came of it.
    pub(super) fn run(&mut self, step: Step, meant: &str) {
        if let Step::Act(act) = &step
            && let Some(argument) = act.call.args.first().and_then(|arg| arg.values.first())
            && let ExprKind::Name(object) = &argument.kind
        {
            self.values.set_it(object.clone());
        }
        // A line that cannot even begin leaves what was known of the last one.
        if let Err(failure) = self.bench.cell() {
            return self.fail(&failure);
        }
        let done = self.perform(step);
        self.remember(done, meant);
    }

    /// Remembers what came of a call, and tells it when it is a failure.
    pub(super) fn remember(&mut self, done: Result<Run, Failure>, meant: &str) {
        self.looking = None;
        let (is_fault, is_stopped) = match &done {
            Ok(run) => (run.device_help.is_some(), run.outcome == Ending::Stopped),
            Err(failure) => (Self::is_fault(failure), failure.exit() == Exit::Stopped as u8),
        };
        if is_stopped {
            self.lines.forget();
        }
        match done {
            Ok(run) => {
                self.worsen(exit::ended(&run) as u8);
                self.runs.extend(run.run_dir.as_ref().map(PathBuf::from));
                self.made.push(Made { call: meant.to_owned(), ending: run.outcome });
                self.last = Some(Box::new(run));
                self.refused = None;
            }
            Err(failure) => {
                self.fail(&failure);
                self.refused = Some(failure);
            }
        }
        self.look_for_fault(is_fault);
    }

    pub(super) fn tell_about(&self, name: &str) {
        let library = &self.library;
        if let Some(text) = language::assist::describe(library, &self.scope, name) {
            return self.style.tell(&text);
        }
        let failure = match name {
            "" => Failure::input("repl::unknown", "`?` takes a name, such as `?pour`"),
            name => Failure::input("repl::unknown", format!("nothing here is called `{name}`")),
        };
        let near = language::assist::nearest_name(library, &self.scope, name);
        self.fail(&match near {
            Some(near) => failure.help(format!("did you mean `?{near}`?")),
            None => failure.help("`:tasks` lists what can be called"),
        });
    }
}

/// Whether a statement of several lines holds one that is a sentence, and no part of a program.
fn is_pasted_sentences(text: &str) -> bool {
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    let is_sentence = |line: &str| {
        sentences::looks_like_one(line)
            && language::parse_line(line).1.iter().any(Diagnostic::is_error)
    };
    lines().count() > 1 && lines().any(is_sentence)
}

/// Says why lines that hold a sentence are no program: they stand behind a bracket that was left open, or are pasted together.
fn no_program(text: &str, wrong: &[Diagnostic]) -> Failure {
    let Some(open) = wrong.iter().find(|each| each.code == "task::unclosed") else {
        let words = "pasted lines are read as one program, and this is none; nothing was done";
        return Failure::input("repl::pasted", words).help("type or paste sentences one by one");
    };
    let source = Source::new("prompt", text);
    let (line, _) = source.line_column(open.span.from);
    let bracket = source.slice(open.span);
    let closing = if bracket == "{" { "}" } else { ")" };
    let words = format!("`{bracket}` opened in line {line} is not closed; nothing was done");
    Failure::input("task::unclosed", words).help(format!(
        "add `{closing}` where it should end; the lines after it were taken into it: type them again"
    ))
}

#[cfg(test)]
mod tests {
    use super::{is_pasted_sentences, no_program};
    use crate::language;

    /// "`ml` is not a unit" was all that was said of them, and the `let` between them was lost as well.
    #[test]
    fn sentences_that_are_pasted_together_are_told_from_a_program_with_a_mistake() {
        for sentences in [
            "let q = 5 cm\npour 40 ml from the jar into the cup",
            "pick up the jar\n\nlet q = 5 cm\n",
        ] {
            assert!(is_pasted_sentences(sentences), "{sentences}");
        }
        for program in [
            "pour 40 ml from the jar into the cup",
            "let q = 5 cm\nlift(jar, by: q",
            "if visible(jar) {\n    pick(jar)\n    plaec(jar)\n}",
            "pick(jar)\ncheck holding(jar)",
        ] {
            assert!(!is_pasted_sentences(program), "{program}");
        }
    }

    /// Whoever forgot a bracket was told not to paste.
    #[test]
    fn a_bracket_that_took_a_sentence_in_is_named_and_not_the_pasting() {
        for (text, told) in [
            ("pour(cup, jar, amount: 60mL\nwhy did it fail\n", "`(` opened in line 1 is not"),
            ("look()\npour(jar, cup\nlet q = 5 cm\npick up the jar", "`(` opened in line 2 is"),
            ("let q = 5 cm\npick up the jar", "pasted lines are read as one program"),
        ] {
            assert!(is_pasted_sentences(text), "{text}");
            let failure = no_program(text, &language::parse_line(text).1);
            assert!(failure.message.starts_with(told), "{}", failure.message);
        }
    }
}
