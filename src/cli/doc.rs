//! `trueup doc NAME`: what a name means, as `?name` at the prompt.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::language::{Source, assist};
use crate::report::{self, Failure, Style};
use crate::workcell::{check, library};

use super::cell::stdlib;
use super::inputs::read;
use super::shared::Shared;
use crate::report::exit::Exit;

/// Say what a task, an action, a fluent, a type or an object is.
#[derive(Debug, Args)]
pub(super) struct DocArgs {
    /// A name such as `pour` or `above`; without one, what can be called is listed.
    name: Option<String>,
    /// A task file whose names count as well.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
}

/// `trueup doc [NAME] [--file FILE]`.
pub(super) fn doc(args: &DocArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let stdlib = stdlib(cli)?;
    let mut library = library(&stdlib);
    let mut scope = library.scope(library.default_scene());
    let mut first = None;
    for path in cli.cell.scene.iter().chain(&args.file) {
        let source = Source::new(path.display().to_string(), read(path)?);
        let file = library.add_with(source, &|path| stdlib.read(path));
        scope = check::scope_of(&library, *first.get_or_insert(file));
    }
    let Some(name) = &args.name else {
        let tasks = library.tasks().map(|(t, _)| ("task", &t.name.text, &t.params, &t.doc));
        let actions = library.actions().map(|(a, _)| ("action", &a.name.text, &a.params, &a.doc));
        let all: Vec<_> = tasks.chain(actions).collect();
        if style.json {
            let each = all.iter().map(|(kind, name, params, doc)| {
                let signature = assist::signature(name, params);
                json!({"name": name, "kind": kind, "signature": signature, "doc": doc})
            });
            style.document(&json!({ "names": each.collect::<Vec<_>>() }));
        }
        for (_, name, params, doc) in all {
            style.say(report::signature(name, params, doc));
        }
        return Ok(Exit::Yes);
    };
    let name = name.trim_start_matches('?');
    let Some(said) = assist::describe(&library, &scope, name) else {
        let failure = Failure::input("doc::unknown", format!("nothing is called `{name}`"));
        return Err(match assist::nearest_name(&library, &scope, name) {
            Some(near) => failure.help(format!("did you mean `{near}`?")),
            None => failure.help("`trueup doc` lists what can be called"),
        });
    };
    if style.json {
        style.document(&json!({"name": name, "said": said}));
    }
    style.tell(&said);
    Ok(Exit::Yes)
}
