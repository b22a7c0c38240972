//! `trueup vqa ask RUN… --endpoint URL`: the questions of runs that are over, put to a model.

use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use crate::lines;
use crate::report::{Failure, Style};
use crate::vqa::{self, Endpoint, FILE, Line, On, Picture, Probe, Reply, Said};
use crate::workcell::picture;

use super::super::endpoint::{EndpointArgs, endpoint, no_answer, tell_where};
use super::super::shared::Shared;
use super::super::signals;
use super::{Stored, stored};
use crate::report::exit::Exit;

/// Put the questions of stored runs to a model, and keep what it answers.
#[derive(Debug, Args)]
pub(in super::super) struct AskArgs {
    /// Run folders, or folders of them.
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// One question about one picture of a run.
struct Open<'a> {
    run: &'a Stored,
    step: usize,
    on: On,
    fluent: &'a str,
    question: &'a str,
}

/// `trueup vqa ask`.
pub(super) fn ask(args: &AskArgs, _cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let runs = stored(&args.runs, style)?;
    let model = endpoint(&args.endpoint)?;
    tell_where(&model, "the pictures of these runs", style);
    let mut open = Vec::new();
    for run in &runs {
        open.extend(questions(run, &model)?);
    }
    signals::watch_interrupt()?;
    let stopped = &signals::is_interrupted;
    let mut probe: Option<Probe> = None;
    let bar = bar(open.len(), style);
    let mut probed: Option<&Path> = None;
    let (mut replies, mut picture): (Vec<Reply>, Option<(String, Picture)>) = (Vec::new(), None);
    for one in &open {
        if stopped() {
            break;
        }
        let file = one.run.dir.join(FILE);
        // Every run says what the model could do when it was asked about it.
        if probed != Some(&one.run.dir) {
            if probe.is_none() {
                let questions = distinct(&open);
                let found = model.probe(&questions, stopped);
                probe = Some(found.map_err(|e| no_answer(&model, &e.to_string()))?);
            }
            probed = Some(&one.run.dir);
            if let Some(probe) = &probe {
                keep(&file, &Line::Probe(probe.clone()))?;
            }
        }
        let path = frame(one.run, one.step, one.on);
        let name = path.display().to_string();
        if picture.as_ref().is_none_or(|(shown, _)| *shown != name) {
            let image = super::super::camera::picture(&path)?;
            picture = Some((name, Picture::photo(&image)));
        }
        let Some((_, shown)) = &picture else { continue };
        let reply = model.ask(one.question, one.on, shown, stopped);
        if stopped() {
            break;
        }
        let line = Line::Answer {
            step: one.step,
            fluent: one.fluent.to_owned(),
            question: one.question.to_owned(),
            reply: reply.clone(),
        };
        keep(&file, &line)?;
        replies.push(reply);
        bar.inc(1);
    }
    bar.finish_and_clear();
    tell(&model, &replies, open.len(), probe.as_ref(), style);
    Ok(if stopped() { Exit::Stopped } else { Exit::Yes })
}

/// Returns what this model has not answered yet; what could not be read is asked again.
fn questions<'a>(run: &'a Stored, model: &Endpoint) -> Result<Vec<Open<'a>>, Failure> {
    let lines =
        vqa::read(&run.dir).map_err(|error| Failure::unread(&run.dir.join(FILE), &error))?;
    let by = model.by();
    let has = |step: usize, on: On, fluent: &str| {
        lines.iter().any(|line| {
            matches!(line, Line::Answer { step: s, fluent: f, reply, .. }
                if *s == step && f == fluent && reply.on == on && reply.by == by
                    && reply.answer != Said::Unparsed)
        })
    };
    let mut open = Vec::new();
    for step in &run.run.steps {
        for on in [On::Real, On::Twin] {
            if !frame(run, step.number, on).is_file() {
                continue;
            }
            for row in &step.fluents {
                if let Some(question) = &row.ask
                    && !has(step.number, on, &row.name)
                {
                    let (step, fluent) = (step.number, row.name.as_str());
                    open.push(Open { run, step, on, fluent, question });
                }
            }
        }
    }
    Ok(open)
}

fn frame(run: &Stored, step: usize, on: On) -> PathBuf {
    picture::file(&run.dir, &picture::after(step, on.name()))
}

fn distinct(open: &[Open<'_>]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for one in open {
        if !found.iter().any(|question| question == one.question) {
            found.push(one.question.to_owned());
        }
    }
    found
}

fn keep(file: &Path, line: &Line) -> Result<(), Failure> {
    lines::append(file, line).map_err(|error| Failure::unwritten(file, &error))
}

fn bar(n: usize, style: Style) -> ProgressBar {
    if !style.bars || style.quiet {
        return ProgressBar::hidden();
    }
    let look = ProgressStyle::with_template("{bar:24} {pos} of {len} answers  {elapsed}");
    ProgressBar::new(n as u64).with_style(look.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn tell(model: &Endpoint, replies: &[Reply], of: usize, probe: Option<&Probe>, style: Style) {
    let count = |said: Said| replies.iter().filter(|reply| reply.answer == said).count();
    let seconds: f64 = replies.iter().map(|reply| reply.latency_s).sum();
    if style.json {
        return style.document(&json!({
            "model": model.model(), "endpoint": model.base().to_string(), "asked": replies.len(),
            "open": of, "yes": count(Said::Yes), "no": count(Said::No), "unsure": count(Said::Unsure),
            "unparsed": count(Said::Unparsed), "latency_s": seconds, "probe": probe,
        }));
    }
    let each = if replies.is_empty() { 0.0 } else { seconds / replies.len() as f64 };
    style.say(format!(
        "{}: {} of {of} open questions asked: {} yes, {} no, {} unsure, {} unparsed; {each:.2} s each",
        model.model(),
        replies.len(),
        count(Said::Yes),
        count(Said::No),
        count(Said::Unsure),
        count(Said::Unparsed)
    ));
    if let Some(why) = replies.iter().find_map(|reply| reply.why.as_ref()) {
        style.say(format!("  unparsed, the first: {why}"));
    }
    if let Some(probe) = probe.filter(|probe| !probe.sees) {
        style.say(format!(
            "  {} does not tell red from blue: it does not see the pictures",
            probe.model
        ));
    }
}
