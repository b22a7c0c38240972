//! `trueup new scene|task NAME`: a file to begin with, which passes `trueup check` as it is.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::files::write;
use crate::language::{self, Source};

use crate::report::exit::Exit;
use crate::report::{Failure, Style};
use crate::workcell::{self, Stdlib};

/// What stands for the name in a template.
const NAME: &str = "NAME";

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// A table, what stands on it, its dots, camera and robot.
    Scene,
    /// A task, what it needs and gives, and a call of it.
    Task,
}

/// Write a file to begin with: a scene or a task.
#[derive(Debug, Args)]
pub(super) struct NewArgs {
    /// What it holds.
    kind: Kind,
    /// Its name, as calls spell it; the file is `NAME.task`.
    name: String,
}

/// `trueup new scene|task NAME`.
pub(super) fn new(args: &NewArgs, style: Style) -> Result<Exit, Failure> {
    let template = match args.kind {
        Kind::Scene => include_str!("../../examples/templates/scene.task"),
        Kind::Task => include_str!("../../examples/templates/task.task"),
    };
    let path = PathBuf::from(format!("{}.task", args.name));
    let source = Source::new(path.display().to_string(), template.replace(NAME, &args.name));
    let (_, diagnostics) = language::parse(&source.text);
    if diagnostics.iter().any(language::Diagnostic::is_error) {
        // The template is right, so the name is not one.
        return Err(Failure::input("new::name", format!("`{}` is not a name", args.name))
            .help("lower-case letters, digits and `_`, a letter first, such as `breakfast`"));
    }
    let library = workcell::library(&Stdlib::embedded());
    let is_taken = match args.kind {
        Kind::Scene => library.scenes().any(|(scene, _)| scene.name.text == args.name),
        Kind::Task => library.task(&args.name).is_some(),
    };
    if is_taken {
        return Err(Failure::input(
            "new::name",
            format!("the standard library has a `{}` already", args.name),
        )
        .help(format!("take another name, such as `my_{}`", args.name)));
    }
    if path.exists() {
        return Err(Failure::there(&path));
    }
    write::replace(&path, &source.text).map_err(|error| Failure::unwritten(&path, &error))?;
    if style.json {
        style.document(&serde_json::json!({"file": path.display().to_string()}));
    } else {
        let next = match args.kind {
            Kind::Scene => format!("trueup --scene {}", path.display()),
            Kind::Task => format!("trueup run {}", path.display()),
        };
        style.say(format!("{} is written; edit it, then `{next}`", path.display()));
    }
    Ok(Exit::Yes)
}
