//! `trueup say "…"`: the call that a sentence means, and why. Nothing moves.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use crate::language::ast::Step;
use crate::language::sentence::{self, Knowledge, Meaning, Phrase, Understood};
use crate::language::{self, Library, Source};
use crate::report::{self, Failure, Style};
use crate::vqa::Endpoint;
use crate::workcell::library;

use super::cell::stdlib;
use super::endpoint::{EndpointArgs, endpoint, no_answer};
use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;

/// Say which call a sentence means.
#[derive(Debug, Args)]
pub(super) struct SayArgs {
    /// The sentence, in quotes.
    sentence: String,
    /// A file of taught phrases, one a line: `"empty the {o}" = pour(o, cup)`.
    #[arg(long, value_name = "FILE")]
    phrases: Option<PathBuf>,
    #[command(flatten)]
    model: EndpointArgs,
}

/// `trueup say "Pour water from the jar into the cup"`.
pub(super) fn say(args: &SayArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let mut library = library(&stdlib);
    if let Some(path) = &cli.cell.scene {
        let source = Source::new(path.display().to_string(), read(path)?);
        library.add_with(source, &|path| stdlib.read(path));
    }
    let scene = library.default_scene().to_owned();
    let things =
        library.scene(&scene).map(|(scene, _)| sentence::things(scene)).unwrap_or_default();
    let phrases = match &args.phrases {
        Some(path) => phrases(path)?,
        None => Vec::new(),
    };
    // What is typed as the language is the language.
    let (step, wrong) = language::parse_line(&args.sentence);
    let meaning = match step {
        Some(Step::Act(act)) if wrong.is_empty() => Meaning::Clear(Understood {
            text: language::text::call(&act.call),
            calls: vec![act.call],
            template: String::new(),
            slots: Vec::new(),
            defaults: Vec::new(),
        }),
        _ => {
            // Whether it can be done now is asked before it is done, with the camera's eyes.
            let with = Knowledge { phrases: &phrases, ..Knowledge::on_paper(&library, &things) };
            sentence::understand(&args.sentence, &with)
        }
    };
    // A model may propose, only where no template fits and only when one is named.
    if let (Meaning::Unknown { .. }, Some(_)) = (&meaning, &args.model.endpoint) {
        let model = endpoint(&args.model)?;
        if let Some(call) = propose(&model, &args.sentence, &library, &scene, &|| false)? {
            if style.json {
                style.document(&json!({"meaning": "proposed", "call": call, "by": model.by()}));
            } else {
                style.say(report::sentence::proposed(&call));
            }
            // Somebody still has to say that this is what was meant.
            return Ok(Exit::No);
        }
    }
    if style.json {
        style.document(&document(&meaning));
    } else {
        style.say(report::sentence::told(&meaning));
    }
    let is_understood = matches!(meaning, Meaning::Clear(_) | Meaning::Asked { .. });
    Ok(if is_understood { Exit::Yes } else { Exit::No })
}

/// Asks a model which call a sentence means. What it says counts only when it parses and checks like anything
/// typed; `None` when it knows no call.
pub(super) fn propose(
    model: &Endpoint,
    said: &str,
    library: &Library,
    scene: &str,
    stopped: &dyn Fn() -> bool,
) -> Result<Option<String>, Failure> {
    let came = model.propose(&brief(library, scene), said, stopped);
    let call = came.map_err(|why| no_answer(model, &why.to_string()))?;
    if call.is_empty() {
        return Ok(None);
    }
    let source = Source::new("proposal", &call);
    let (step, mut wrong) = language::parse_line(&call);
    if let Some(step) = &step {
        wrong.extend(library.check_step(step, &source, &library.scope(scene)));
    }
    match step {
        Some(Step::Act(act)) if !wrong.iter().any(language::Diagnostic::is_error) => {
            Ok(Some(language::text::call(&act.call)))
        }
        _ => {
            let why = wrong.first().map_or("it is no call", |first| first.message.as_str());
            Err(Failure::no("vqa::proposal", format!("the model proposed `{call}`: {why}"))
                .help("say it otherwise, or type the call"))
        }
    }
}

/// Says what there is to call and to name, for a model.
fn brief(library: &Library, scene: &str) -> String {
    let mut text = String::from(
        "You turn one sentence into one call for a robot arm. Reply as JSON: {\"reason\": <15 words or \
         fewer>, \"call\": \"name(arguments)\"}. Leave call empty when no call does what the sentence asks. \
         The calls:\n",
    );
    let tasks = library.tasks().map(|(task, _)| (&task.name.text, &task.params, &task.doc));
    let actions = library.actions().map(|(act, _)| (&act.name.text, &act.params, &act.doc));
    for (name, params, doc) in tasks.chain(actions) {
        text += &report::signature(name, params, doc).replace("\n  ", ": ");
        text.push('\n');
    }
    text += "The things on the table:\n";
    let things = library.scene(scene).map(|(scene, _)| sentence::things(scene));
    for sentence::Thing { name, kind, looks } in things.unwrap_or_default() {
        let _ = writeln!(text, "{name}: {kind}, {looks}");
    }
    text
}

/// Reads a file of phrases; lines that are empty or begin with `//` are notes.
fn phrases(path: &Path) -> Result<Vec<Phrase>, Failure> {
    let text = read(path)?;
    let lines = text.lines().enumerate().filter(|(_, line)| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with("//")
    });
    let read = lines.map(|(i, line)| {
        sentence::phrase(line).map_err(|wrong| {
            Failure::input("task::template", wrong.message)
                .at(format!("{}:{}", path.display(), i + 1))
                .help(wrong.help)
        })
    });
    read.collect()
}

fn document(meaning: &Meaning) -> Value {
    let call = |found: &Understood| {
        let slots = found
            .slots
            .iter()
            .map(|(slot, said, value)| json!({"slot": slot, "said": said, "value": value}));
        json!({
            "call": found.text, "template": found.template,
            "slots": slots.collect::<Vec<_>>(), "defaults": found.defaults,
        })
    };
    match meaning {
        Meaning::Clear(found) => {
            let mut value = call(found);
            value["meaning"] = json!("clear");
            value
        }
        Meaning::Ambiguous { question, choices } => json!({
            "meaning": "ambiguous", "question": question,
            "choices": choices.iter().map(call).collect::<Vec<_>>(),
        }),
        Meaning::Asked { line, template } => {
            json!({"meaning": "question", "line": line, "template": template})
        }
        Meaning::Impossible { why, help } => {
            json!({"meaning": "impossible", "why": why, "help": help})
        }
        Meaning::Unknown { help } => json!({"meaning": "unknown", "help": help}),
    }
}
