//! `trueup vqa …`: a vision-language model asked the questions of runs, experts' labels, and how well
//! everybody answers.

mod ask;
mod eval;
mod label;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::http::Address;
use crate::language::{nearest, sentence};
use crate::report::{self, Failure, Style};
use crate::teach::answers;
use crate::vqa::{Endpoint, Patience, Settings};
use crate::workcell::archive;
use crate::workcell::{self, Run};

use super::run::{clock, stdlib};
use super::{Cli, Exit, numbers};

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

/// Which model is asked, and how long it is waited for.
#[derive(Debug, Args)]
pub(super) struct EndpointArgs {
    /// Where the model is, up to and including `/v1`; `TRUEUP_VQA_URL` when left out.
    #[arg(long, value_name = "URL")]
    pub(super) endpoint: Option<Address>,
    /// Its name there; `TRUEUP_VQA_MODEL` when left out, or the only one that is served.
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// How long a reply may take, s.
    #[arg(long, value_name = "S", default_value_t = 20.0, value_parser = numbers::seconds)]
    reply_timeout: f64,
    /// Ask for the probabilities of tokens as well; not every server knows how.
    #[arg(long)]
    logprobs: bool,
}

#[derive(Debug, Args)]
pub(super) struct ProbeArgs {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// `trueup vqa …`.
pub(super) fn vqa(command: &VqaCommand, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    match command {
        VqaCommand::Eval(args) => eval::eval(args, cli, style),
        VqaCommand::Ask(args) => ask::ask(args, cli, style),
        VqaCommand::Probe(args) => probe(args, cli, style),
        VqaCommand::Label(args) => label::label(args, cli, style),
    }
}

/// `trueup vqa probe`.
fn probe(args: &ProbeArgs, cli: &Cli, style: Style) -> Result<Exit, Failure> {
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
fn asks(cli: &Cli) -> Result<Vec<String>, Failure> {
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

/// Returns the endpoint that was named.
pub(super) fn endpoint(args: &EndpointArgs) -> Result<Endpoint, Failure> {
    let named = match &args.endpoint {
        Some(address) => address.clone(),
        None => match variable("TRUEUP_VQA_URL") {
            Some(text) => text
                .parse()
                .map_err(|why: String| Failure::input("vqa::endpoint", why).at("TRUEUP_VQA_URL"))?,
            None => {
                return Err(Failure::input("vqa::endpoint", "no model was named to ask")
                    .help("`--endpoint http://127.0.0.1:8080/v1`, or the same in TRUEUP_VQA_URL"));
            }
        },
    };
    at(named, args.model.clone(), args.reply_timeout, args.logprobs)
}

/// Returns the endpoint at an address; the model is the only one there when none is named.
pub(super) fn at(
    base: Address,
    model: Option<String>,
    reply_s: f64,
    logprobs: bool,
) -> Result<Endpoint, Failure> {
    if !(reply_s.is_finite() && reply_s > 0.0) {
        return Err(Failure::input("vqa::timeout", format!("{reply_s} s is no time to wait"))
            .help("`--reply-timeout 60` waits a minute for each reply"));
    }
    let patience = Patience { reply_s, ..Patience::default() };
    let named = model.or_else(|| variable("TRUEUP_VQA_MODEL"));
    let settings = Settings {
        base,
        model: named.clone().unwrap_or_default(),
        key: variable("TRUEUP_VQA_KEY"),
        patience,
        logprobs,
        clock,
    };
    let endpoint = Endpoint::new(settings);
    if named.is_some() {
        return Ok(endpoint);
    }
    let served = endpoint.models().map_err(|e| no_answer(&endpoint, &e.to_string()))?;
    match &served[..] {
        [one] => Ok(endpoint.with_model(one)),
        [] => Err(Failure::input("vqa::model", format!("{} lists no model", endpoint.base()))
            .help("name one with `--model NAME`")),
        several => Err(Failure::input(
            "vqa::model",
            format!("{} serves {} models", endpoint.base(), several.len()),
        )
        .help(format!("name one with `--model`: {}", several.join(", ")))),
    }
}

/// Returns a variable of the environment that is not empty.
fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

/// Says that nobody answers at an endpoint.
pub(super) fn no_answer(endpoint: &Endpoint, why: &str) -> Failure {
    Failure::unavailable("vqa::unavailable", format!("the model does not answer: {why}"))
        .at(endpoint.base().to_string())
        .help("is the server running, and does the address end in `/v1`?")
}

/// Says once where pictures go that leave this machine.
pub(super) fn tell_where(endpoint: &Endpoint, what: &str, style: Style) {
    if !endpoint.base().is_loopback() {
        style.note(&format!("{what} leave this machine: they go to {}", endpoint.base().host()));
    }
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
