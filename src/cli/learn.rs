//! `trueup learn RUNS…`: what runs say of the branches they took goes into the outcomes file of its domain.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::files::write;
use crate::graph::outcome::{Counts, Outcome};
use crate::graph::{Outcomes, Priors};
use crate::lines;
use crate::report::{Failure, Style};
use crate::workcell::Run;
use crate::workcell::archive::{self, Standing};
use crate::workcell::learning::{self, Learnt};

use super::inputs::{data, read};
use super::shared::Shared;
use crate::report::exit::Exit;

/// Learn from stored runs which branches work.
#[derive(Debug, Args)]
pub(super) struct LearnArgs {
    /// Run folders, or a folder of run folders.
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// Change nothing; say what would change.
    #[arg(long)]
    dry: bool,
    /// Count how a person chooses, which moves the priors instead: the branches of these runs that were asked for with
    /// `via`. Never the robot's own choices.
    #[arg(long)]
    demonstrations: bool,
}

/// The file of the priors that people have shown.
const PRIORS: &str = "priors.json";

/// Reads what earlier runs have taught from the folder where runs are kept; nothing when it holds nothing.
pub(super) fn learnt(cli: &Shared) -> Result<Learnt, Failure> {
    let domain = learning::domain(&cli.cell.robot);
    let known = |name: &str| {
        let path = cli.cell.record.join(name);
        path.exists().then(|| data(&path)).transpose()
    };
    let outcomes = known(&learning::file_name(domain))?.unwrap_or_default();
    let outcomes = Outcomes::read(&outcomes).map_err(|error| spoilt(&error.to_string(), cli))?;
    let priors = match known(PRIORS)? {
        Some(text) => {
            Some(serde_json::from_str(&text).map_err(|error| spoilt(&error.to_string(), cli))?)
        }
        None => None,
    };
    Ok(Learnt { outcomes, priors, domain: domain.to_owned(), explore: cli.cell.explore })
}

fn spoilt(why: &str, cli: &Shared) -> Failure {
    Failure::input("learn::file", format!("what was learnt cannot be read: {why}"))
        .at(cli.cell.record.display().to_string())
        .help("mend the line, or move the file away to begin anew")
}

/// `trueup learn RUNS… [--dry]`.
pub(super) fn learn(args: &LearnArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let runs = stored(&args.runs)?;
    if args.demonstrations {
        return demonstrated(&runs, args.dry, cli, style);
    }
    let mut fresh: BTreeMap<&str, Vec<Outcome>> = BTreeMap::new();
    let mut passed = 0;
    for (name, run) in &runs {
        let domain = learning::domain(&run.robot);
        let known = names(&cli.cell.record.join(learning::file_name(domain)))?;
        if known.contains(name) {
            passed += 1;
            continue;
        }
        fresh.entry(domain).or_default().extend(learning::outcomes(run, name));
    }
    let mut changes = Vec::new();
    for (domain, outcomes) in &fresh {
        let path = cli.cell.record.join(learning::file_name(domain));
        let before = if path.exists() { data(&path)? } else { String::new() };
        let before = Outcomes::read(&before).map_err(|error| spoilt(&error.to_string(), cli))?;
        let mut after = before.clone();
        for outcome in outcomes {
            after.add(outcome);
        }
        let counts = |all: &Outcomes, wanted: &Outcome| {
            let same = |(b, t, d, _): &(&str, &str, &str, Counts)| {
                (*b, *t, *d) == (&wanted.branch, &wanted.text, &wanted.domain)
            };
            all.iter().find(same).map_or_else(Counts::default, |found| found.3)
        };
        let mut told = BTreeSet::new();
        for outcome in outcomes {
            if told.insert((&outcome.branch, &outcome.text)) {
                let (old, new) = (counts(&before, outcome), counts(&after, outcome));
                changes.push((outcome.branch.clone(), *domain, old, new));
            }
        }
        if !args.dry && !outcomes.is_empty() {
            lines::extend(&path, outcomes).map_err(|error| Failure::unwritten(&path, &error))?;
        }
    }
    if style.json {
        let list = changes.iter().map(|(branch, domain, old, new)| {
            json!({"branch": branch, "domain": domain, "before": old, "after": new})
        });
        style.document(&json!({
            "runs": runs.len() - passed, "known_before": passed, "dry": args.dry,
            "changes": list.collect::<Vec<_>>(),
        }));
        return Ok(Exit::Yes);
    }
    for (branch, domain, old, new) in &changes {
        let whose = if *domain == "real" { "on the arm" } else { "in the twin" };
        let worked = |c: &Counts| format!("worked {} of {}", c.worked, c.tries());
        style.say(format!("{branch}  {whose}  {}, now {}", worked(old), worked(new)));
    }
    let verb = if args.dry { "would be learnt from" } else { "learnt from" };
    style.say(format!("{verb}: {} runs; known before: {passed}", runs.len() - passed));
    Ok(Exit::Yes)
}

/// Counts what people asked for, each run once.
fn demonstrated(
    runs: &[(String, Run)],
    dry: bool,
    cli: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let path = cli.cell.record.join(PRIORS);
    let mut priors = if path.exists() {
        serde_json::from_str(&read(&path)?).map_err(|error| spoilt(&error.to_string(), cli))?
    } else {
        Priors::default()
    };
    let (mut counted, mut known, mut without) = (0, 0, 0);
    for (name, run) in runs {
        if priors.runs.contains(name) {
            known += 1;
        } else if run.parse_graphs.first().is_some_and(|pg| priors.learn(pg) > 0) {
            priors.runs.insert(name.clone());
            counted += 1;
        } else {
            without += 1;
        }
    }
    if !dry && counted > 0 {
        let text = serde_json::to_string_pretty(&priors)
            .map_err(|error| Failure::input("io::write", error.to_string()))?;
        write::replace(&path, text + "\n").map_err(|error| Failure::unwritten(&path, &error))?;
    }
    if style.json {
        style.document(&json!({
            "demonstrations": counted, "known_before": known, "without_choice": without, "dry": dry,
            "counts": priors.counts,
        }));
        return Ok(Exit::Yes);
    }
    for (branch, count) in &priors.counts {
        let times = if *count == 1 { "time" } else { "times" };
        style.say(format!("{branch}  chosen {count} {times}"));
    }
    let verb = if dry { "would be learnt from" } else { "learnt from" };
    style.say(format!("{verb}: {counted} runs; known before: {known}"));
    if without > 0 {
        style.say(format!(
            "passed over: {without} runs in which no branch was asked for with `via`; what the robot chose is not counted"
        ));
    }
    Ok(Exit::Yes)
}

/// Returns the runs of folders by name, in order of name.
fn stored(paths: &[PathBuf]) -> Result<Vec<(String, Run)>, Failure> {
    let folders =
        archive::folders(paths).map_err(|(path, error)| Failure::unread(&path, &error))?;
    if folders.is_empty() {
        return Err(Failure::input("learn::none", "there is no run in these folders")
            .help("a run folder holds a `run.json`; `trueup run` makes one"));
    }
    let read = folders.into_iter().map(|folder| {
        let run = archive::load(&folder).map_err(|error| {
            Failure::input("learn::run", format!("this is no run: {error}"))
                .at(folder.display().to_string())
        })?;
        let name = folder.file_name().map(|name| name.to_string_lossy().into_owned());
        // What goes on is counted when it is over.
        let is_over = archive::standing(&folder, &run) != Standing::Running;
        Ok(is_over.then(|| (name.unwrap_or_default(), run)))
    });
    read.filter_map(Result::transpose).collect()
}

/// Returns the names of the runs that a file already counts.
fn names(path: &Path) -> Result<BTreeSet<String>, Failure> {
    if !path.exists() {
        return Ok(BTreeSet::new());
    }
    let text = data(path)?;
    let outcomes = text.lines().filter_map(|line| serde_json::from_str::<Outcome>(line).ok());
    Ok(outcomes.map(|outcome| outcome.run).collect())
}
