//! `trueup test FILE...`: the calls in back-quotes of the documentation, carried out in the twin.
//!
//! A call there is a promise to a reader, and a promise can be kept to. Each example has a cell of its own, so
//! that none builds on what another left behind; no run folder is made.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::language::ast::{Item, Program, Step};
use crate::language::{self, Diagnostic, Source, builtins, text};
use crate::report::{self, Failure, Style};
use crate::trace::Nobody;
use crate::workcell::{Ending, WorkCell, library};

use super::cell::{options, stdlib};
use super::clock::clock;
use super::inputs::read;
use super::shared::Shared;
use super::signals::stop_on_interrupt;
use super::text::task_files;
use crate::report::exit::Exit;

/// Carry out the examples in the documentation of task files, in the twin.
#[derive(Debug, Args)]
pub(super) struct TestArgs {
    /// Files, or folders with `.task` files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Only list the examples.
    #[arg(long)]
    list: bool,
}

/// A call in back-quotes behind `///`, or several: `pick(jar) then place(jar)`.
struct Example {
    step: Step,
    line: usize,
}

impl Example {
    /// What it calls first.
    fn head(&self) -> Option<&str> {
        match self.step.inside().first().copied().unwrap_or(&self.step) {
            Step::Act(act) => Some(&act.call.name.text),
            _ => None,
        }
    }
}

/// What came of an example.
struct Told {
    place: String,
    call: String,
    /// Why it is not as the documentation says; `None` when it is.
    wrong: Option<String>,
    seconds: f64,
}

/// `trueup test FILE... [--list]`.
pub(super) fn test(args: &TestArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let mut told: Vec<Told> = Vec::new();
    let stdlib = stdlib(cli)?;
    let mut is_watched = false;
    'files: for path in task_files(&args.files)? {
        let source = Source::new(path.display().to_string(), read(&path)?);
        let (program, wrong) = language::parse(&source.text);
        if wrong.iter().any(Diagnostic::is_error) {
            return Err(report::text_failure(&wrong, &source, style));
        }
        let mut library = library(&stdlib);
        library.add_with(source.clone(), &|path| stdlib.read(path));
        // What is asked is no example of what is done.
        let is_asked = |name: &str| {
            library.callable(name).is_none()
                && (library.fluent(name).is_some() || builtins::function(name).is_some())
        };
        let all = examples(&program, &source).into_iter();
        for example in all.filter(|example| !example.head().is_some_and(is_asked)) {
            let place = format!("{}:{}", source.name, example.line);
            let call = text::step(&example.step);
            if args.list {
                style.say(format!("{place}  {call}"));
                told.push(Told { place, call, wrong: None, seconds: 0.0 });
                continue;
            }
            let began = clock();
            let mut cell = twin(cli, &source, style)?;
            if !is_watched {
                stop_on_interrupt(&cell)?;
                is_watched = true;
            }
            let wrong = carried_out(&mut cell, &call, &source);
            let is_stopped = cell.cancel().is_cancelled();
            let one = Told { place, call, wrong, seconds: clock() - began };
            style.say(words(&one, style));
            told.push(one);
            if is_stopped {
                break 'files;
            }
        }
    }
    let failed = told.iter().filter(|one| one.wrong.is_some()).count();
    if style.json {
        let each: Vec<Value> = told.iter().map(document).collect();
        style.document(&json!({"examples": each, "failed": failed}));
    } else if told.is_empty() {
        style.say("no examples: a call in back-quotes behind `///`, such as `pick(jar)`, is one");
    } else if !args.list {
        style.say(format!("{} of {} examples do what they say", told.len() - failed, told.len()));
    }
    Ok(if failed > 0 { Exit::No } else { Exit::Yes })
}

/// The twin alone, with a file's definitions, whatever robot was asked for.
fn twin(cli: &Shared, source: &Source, style: Style) -> Result<WorkCell, Failure> {
    let mut options = options(cli, Some(source.clone()))?;
    options.robot = "twin".into();
    WorkCell::open(options).map_err(|error| report::cell_failure(&error, style))
}

/// Returns why an example does not do what it says.
fn carried_out(cell: &mut WorkCell, said: &str, source: &Source) -> Option<String> {
    let line = Source::new(format!("{}, an example", source.name), said);
    // Read again, so that its places are those of the line by itself.
    let (step, wrong) = language::parse_line(said);
    let Some(step) = step else { return wrong.into_iter().next().map(|wrong| wrong.message) };
    let wrong = cell.check_line(&step, &line);
    if let Some(wrong) = wrong.into_iter().find(Diagnostic::is_error) {
        return Some(wrong.message);
    }
    let call = cell.define(&line, &[step]);
    match cell.run(&call, None, Box::new(Nobody)) {
        Err(error) => Some(error.to_string()),
        Ok(run) if run.outcome == Ending::Success => None,
        Ok(run) => Some(run.reason.unwrap_or_else(|| "it did not succeed".into())),
    }
}

/// The examples of a text, in its order.
fn examples(program: &Program, source: &Source) -> Vec<Example> {
    let mut found = Vec::new();
    for item in &program.items {
        let (doc, span) = match item {
            Item::Task(item) => (&item.doc, item.name.span),
            Item::Action(item) => (&item.doc, item.name.span),
            _ => continue,
        };
        // The documentation stands right above its item, a line each.
        let below = source.text[..span.from].matches('\n').count() + 1;
        let above = source.text[..span.from].lines().rev();
        let other = above.skip(1).take_while(|line| !line.trim_start().starts_with("///")).count();
        for (i, line) in doc.iter().enumerate() {
            let at = below - other - (doc.len() - i);
            found.extend(calls_in(line).map(|step| Example { step, line: at }));
        }
    }
    found
}

/// The calls of whole things in back-quotes: `pick(jar)`, not `o` or `pick`.
fn calls_in(line: &str) -> impl Iterator<Item = Step> + '_ {
    line.split('`').skip(1).step_by(2).filter_map(|quoted| match language::parse_line(quoted) {
        (Some(step @ (Step::Act(_) | Step::Sequence(..))), wrong) if wrong.is_empty() => Some(step),
        _ => None,
    })
}

fn words(told: &Told, style: Style) -> String {
    let Told { place, call, wrong, seconds } = told;
    match wrong {
        None => format!("{} {place}  {call}  {seconds:.1} s", style.green("✓")),
        Some(why) => format!("{} {place}  {call}  {seconds:.1} s: {why}", style.red("✗")),
    }
}

fn document(told: &Told) -> Value {
    json!({
        "where": told.place, "call": told.call, "done": told.wrong.is_none(),
        "why": told.wrong, "seconds": told.seconds,
    })
}
