//! `trueup vqa …`: a vision-language model asked the questions of runs, experts' labels, and how well
//! everybody answers.

mod ask;
pub(super) mod eval;
mod label;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::language::{nearest, sentence};
use crate::report::{self, Failure, Style};
use crate::teach::answers;
use crate::workcell::archive;
use crate::workcell::{self, Run};

use super::cell::stdlib;
use super::endpoint::{EndpointArgs, endpoint, no_answer, tell_where};
use super::shared::Shared;
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum VqaCommand {
    /// Precision, recall, F1 and consistency of all answers in stored runs.
    Eval(eval::EvalArgs),
    /// Put the questions of stored runs to a model, and keep what it answers.
    Ask(ask::AskArgs),
    /// Find out whether a model sees pictures and keeps to the form of a reply.
    Probe(ProbeArgs),
    /// Answer the questions of a run as an expert, whose word is the truth for `eval`.
    Label(label::LabelArgs),
}

#[derive(Debug, Args)]
pub(super) struct ProbeArgs {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// `trueup vqa …`.
pub(super) fn vqa(command: &VqaCommand, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    match command {
        VqaCommand::Eval(args) => eval::eval(args, cli, style),
        VqaCommand::Ask(args) => ask::ask(args, cli, style),
        VqaCommand::Probe(args) => probe(args, cli, style),
        VqaCommand::Label(args) => label::label(args, cli, style),
    }
}

/// `trueup vqa probe`.
fn probe(args: &ProbeArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let model = endpoint(&args.endpoint)?;
    tell_where(&model, "made pictures", style);
    let probe =
        model.probe(&asks(cli)?, &|| false).map_err(|e| no_answer(&model, &e.to_string()))?;
    if style.json {
        style.document(&probe);
    } else {
        style.say(report::vqa::probe(&probe));
    }
    Ok(if probe.sees && probe.keeps_form { Exit::Yes } else { Exit::No })
}

/// Returns the questions of the library about the first things of its scene.
fn asks(cli: &Shared) -> Result<Vec<String>, Failure> {
    let library = workcell::library(&stdlib(cli)?);
    let scene = library.scene(library.default_scene());
    let things = scene.map(|(scene, _)| sentence::things(scene)).unwrap_or_default();
    let asked = library.fluents().filter_map(|(fluent, _)| {
        let question = fluent.ask.as_ref()?.text.clone();
        let filled =
            fluent.params.iter().zip(&things).fold(question, |question, (param, thing)| {
                question.replace(&format!("{{{}}}", param.name.text), &thing.looks)
            });
        Some(filled)
    });
    Ok(asked.collect())
}

/// A run that was read, and where it lies.
struct Stored {
    name: String,
    dir: PathBuf,
    run: Run,
}

/// Reads run folders, or all runs in folders of them.
fn stored(paths: &[PathBuf], style: Style) -> Result<Vec<Stored>, Failure> {
    let folders = archive::folders(paths)
        .map_err(|(path, error)| Failure::unread(&path, &error).help(near(&path)))?;
    if folders.is_empty() {
        return Err(Failure::input("vqa::none", "there is no run in these folders")
            .help("a run folder holds a `run.json`; `trueup run` makes one"));
    }
    folders
        .into_iter()
        .map(|dir| {
            let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
            let name = dir.file_name().map(|name| name.to_string_lossy().into_owned());
            Ok(Stored { name: name.unwrap_or_default(), dir, run })
        })
        .collect()
}

/// Returns what would help when a folder is not there.
fn near(path: &Path) -> String {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let beside = std::fs::read_dir(parent.unwrap_or(Path::new(".")));
    let names: Vec<String> = beside
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match nearest(&name, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "name a run folder, or a folder of them".to_owned(),
    }
}

/// Returns the file of people's answers beside a run.
fn answers_beside(dir: &Path) -> PathBuf {
    dir.parent().unwrap_or(Path::new("")).join(answers::FILE)
}
