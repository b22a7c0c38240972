//! `trueup vqa eval RUNS…`: the paper's Table 3 of stored runs.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use crate::report::{self, Failure, Style};
use crate::teach::answers;
use crate::vqa::score::{self, Case, GEOMETRY, Table};
use crate::vqa::{self, Line, Probe};
use crate::workcell::questions::{Kept, cases};

use super::super::shared::Shared;
use super::super::trials::FormArgs;
use super::{Stored, answers_beside, stored};
use crate::report::exit::Exit;

/// Precision, recall, F1 and consistency of all answers in stored runs.
#[derive(Debug, Args)]
pub(in super::super) struct EvalArgs {
    /// Run folders, or folders of them.
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// Whose answers are judged.
    #[arg(long, value_name = "WHO,WHO", value_delimiter = ',')]
    answerers: Vec<Answerer>,
    /// The file of people's answers and labels; `answers.jsonl` beside the runs when left out.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
    #[command(flatten)]
    form: FormArgs,
}

/// Who may answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Answerer {
    /// By measuring.
    Geometry,
    /// Models that look at pictures.
    Vlm,
    /// Trainees.
    Person,
}

/// `trueup vqa eval`.
pub(super) fn eval(args: &EvalArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let Scored { table, probes, .. } = scored(args, cli.common.seed, style)?;
    let command = command(args, cli);
    if style.json {
        let mut document = json!(table);
        document["probes"] = json!(probes);
        document["command"] = json!(command);
        style.document(&document);
    } else {
        style.say(report::vqa::table(&table, &probes, &command, args.form.form()));
    }
    Ok(Exit::Yes)
}

/// The answers of stored runs, counted.
pub(in super::super) struct Scored {
    pub(in super::super) table: Table,
    pub(in super::super) probes: Vec<Probe>,
    pub(in super::super) cases: Vec<Case>,
}

impl EvalArgs {
    /// Returns the arguments that count everybody's answers in some folders.
    pub(in super::super) fn of(runs: Vec<PathBuf>) -> Self {
        Self { runs, answerers: Vec::new(), answers: None, form: FormArgs::markdown() }
    }
}

/// Counts the answers of stored runs.
pub(in super::super) fn scored(
    args: &EvalArgs,
    seed: u64,
    style: Style,
) -> Result<Scored, Failure> {
    let runs = stored(&args.runs, style)?;
    let mut found = Vec::new();
    let mut probes: Vec<Probe> = Vec::new();
    for stored in &runs {
        let lines = vqa::read(&stored.dir)
            .map_err(|error| Failure::unread(&stored.dir.join(vqa::FILE), &error))?;
        let after = lines.iter().filter_map(|line| match line {
            Line::Probe(probe) => Some(probe),
            Line::Answer { .. } => None,
        });
        for probe in stored.run.probe.iter().chain(after) {
            if probes.iter().all(|known| known.model != probe.model) {
                probes.push(probe.clone());
            }
        }
        let people = people(args, stored)?;
        let kept = Kept { name: &stored.name, run: &stored.run, lines: &lines, people: &people };
        found.extend(cases(&kept));
    }
    let wanted = |by: &str| {
        let kind = match by.split(':').next() {
            Some(GEOMETRY) => Answerer::Geometry,
            Some("person") => Answerer::Person,
            _ => Answerer::Vlm,
        };
        args.answerers.is_empty() || args.answerers.contains(&kind)
    };
    let table = score::table(&found, &wanted, seed);
    Ok(Scored { table, probes, cases: found })
}

/// Reads what people answered about a run.
fn people(args: &EvalArgs, stored: &Stored) -> Result<Vec<answers::Answered>, Failure> {
    let file = args.answers.clone().unwrap_or_else(|| answers_beside(&stored.dir));
    let read = answers::read(&file);
    read.map(|(answers, _)| answers).map_err(|error| Failure::unread(&file, &error))
}

/// Returns the line that makes the table again.
fn command(args: &EvalArgs, cli: &Shared) -> String {
    let mut words = vec!["trueup vqa eval".to_owned()];
    words.extend(args.runs.iter().map(|run| run.display().to_string()));
    if !args.answerers.is_empty() {
        let names = args.answerers.iter().filter_map(ValueEnum::to_possible_value);
        let names: Vec<String> = names.map(|name| name.get_name().to_owned()).collect();
        words.push(format!("--answerers {}", names.join(",")));
    }
    if let Some(file) = &args.answers {
        words.push(format!("--answers {}", file.display()));
    }
    words.push(format!("--seed {}", cli.common.seed));
    words.join(" ")
}
