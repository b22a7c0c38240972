//! `trueup vqa label RUN`: an expert answers the questions of a run, looking at its pictures, without being
//! shown what anybody else said.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::files;
use crate::report::{self, Failure, Style, kept};
use crate::teach::answers::{self, Answer, Answered, EXPERT};
use crate::trace::{FluentRow, StepRecord};
use crate::vqa::On;
use crate::workcell::archive;
use crate::workcell::picture;

use super::super::shared::Shared;
use super::answers_beside;
use crate::report::exit::Exit;

/// Answer the questions of a run as an expert, whose word is the truth for `eval`.
#[derive(Debug, Args)]
pub(in super::super) struct LabelArgs {
    /// A run folder, or the number or name of one in the folder of `--record`.
    run: PathBuf,
    /// Whose labels: a name is kept with them.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// The file labels are added to; `answers.jsonl` beside the run when left out.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
}

/// `trueup vqa label RUN`.
pub(super) fn label(args: &LabelArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let dir = kept::folder(&cli.cell.record, &args.run)?;
    let run = archive::load(&dir).map_err(|error| report::cell_failure(&error, style))?;
    let dir = std::path::absolute(&dir).unwrap_or(dir);
    let name = dir.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_default();
    let file = args.answers.clone().unwrap_or_else(|| answers_beside(&dir));
    let by = match &args.name {
        Some(own) => format!("{EXPERT}:{}", own.trim()),
        None => EXPERT.to_owned(),
    };
    let (before, _) = answers::read(&file).map_err(|error| Failure::unread(&file, &error))?;
    let is_done = |step: &StepRecord, row: &FluentRow, on: On| {
        before.iter().any(|one| {
            one.by == by
                && one.run == name
                && one.step == step.number
                && one.fluent == row.name
                && one.on == on
        })
    };
    let mut open = Vec::new();
    for step in &run.steps {
        for on in [On::Real, On::Twin] {
            let picture = frame(&dir, step.number, on);
            let rows = step.fluents.iter().filter(|row| row.ask.is_some());
            open.extend(
                rows.filter(|row| !is_done(step, row, on) && picture.is_file())
                    .map(|row| (step, row, on)),
            );
        }
    }
    let mut labelled = 0;
    let mut shown = None;
    let mut input = std::io::stdin().lock();
    let say = |line: &str| if style.json { report::complain(line) } else { report::out(line) };
    say(&format!(
        "{} questions of {}; look at the picture and answer y, n or u (cannot be told); Enter passes, q ends",
        open.len(),
        run.task
    ));
    'all: for (step, row, on) in &open {
        if shown != Some((step.number, *on)) {
            shown = Some((step.number, *on));
            let place = frame(&dir, step.number, *on);
            say(&format!("\nafter step {} {}: {}", step.number, step.action, place.display()));
        }
        let question = row.ask.as_deref().unwrap_or(&row.name);
        loop {
            say(&format!("  {question}"));
            let word = files::read::line(&mut input).unwrap_or_default();
            if word.is_empty() {
                break 'all;
            }
            let word = word.trim();
            match (word, Answer::parse(word)) {
                ("", _) => break,
                ("q", _) => break 'all,
                (_, Some(answer)) => {
                    keep(&file, &by, &name, step, row, *on, answer)?;
                    labelled += 1;
                    break;
                }
                (other, None) => say(&format!("  `{other}` is not y, n, u, q or Enter")),
            }
        }
    }
    if style.json {
        style.document(&json!({
            "run": name, "by": by, "labelled": labelled, "open": open.len() - labelled,
            "file": file.display().to_string(),
        }));
    } else {
        style.say(format!(
            "{labelled} labels added to {}; {} questions are open",
            file.display(),
            open.len() - labelled
        ));
    }
    Ok(Exit::Yes)
}

fn frame(dir: &Path, step: usize, on: On) -> PathBuf {
    picture::file(dir, &picture::after(step, on.name()))
}

fn keep(
    file: &Path,
    by: &str,
    run: &str,
    step: &StepRecord,
    row: &FluentRow,
    on: On,
    answer: Answer,
) -> Result<(), Failure> {
    let Some(answered) = Answered::new(by, run, step, row, answer) else { return Ok(()) };
    answers::append(file, &Answered { on, ..answered })
        .map_err(|error| Failure::unwritten(file, &error))
}
