//! `trueup trials merge`: one table of results files, of several machines for one.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::lines;
use crate::report::exit::Exit;
use crate::report::{Failure, Style};
use crate::workcell::trials::{Trial, table};

#[cfg(feature = "arrow")]
use super::write_parquet;
use super::{Shard, Told, tell};

/// So many missing parts are named; of more only the number is told.
const NAMED: usize = 8;

#[derive(Debug, Args)]
pub(super) struct MergeArgs {
    /// `trials*.jsonl`, or folders that hold some.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    told: Told,
}

/// `trueup trials merge FILES…`.
pub(super) fn merged(args: &MergeArgs, style: Style) -> Result<Exit, Failure> {
    let mut files = Vec::new();
    for path in &args.files {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path).map_err(|error| Failure::unread(path, &error))?;
        let is_results = |path: &PathBuf| {
            let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
            name.starts_with("trials") && path.extension().is_some_and(|ending| ending == "jsonl")
        };
        files.extend(entries.flatten().map(|entry| entry.path()).filter(is_results));
    }
    files.sort();
    let mut trials: Vec<Trial> = Vec::new();
    // The parts that hold trials, by how many there are to be.
    let mut parts: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for file in &files {
        let (kept, _) =
            lines::read::<Trial>(file).map_err(|error| Failure::unread(file, &error))?;
        let first = trials.first().map(|trial| trial.setup.clone());
        let differs = |trial: &&Trial| first.as_ref().is_some_and(|first| *first != trial.setup);
        if let Some(other) = kept.iter().find(differs) {
            return Err(Failure::input(
                "trials::setup",
                format!(
                    "these trials, of {}, were made with something else than the first",
                    other.task
                ),
            )
            .at(file.display().to_string())
            .help("make one table of each setup"));
        }
        if let Some(Shard { i, n }) = part_of(file).filter(|_| !kept.is_empty()) {
            parts.entry(n).or_default().insert(i);
        }
        trials.extend(kept);
    }
    if trials.is_empty() {
        return Err(Failure::input("trials::none", "there is no trial in these files")
            .help("`trueup trials --task FILE --out DIR` keeps them in DIR/trials.jsonl"));
    }
    for line in parts.iter().filter_map(|(n, there)| missing(*n, there)) {
        style.note(&line);
    }
    #[cfg(feature = "arrow")]
    write_parquet(&trials, &args.told, style)?;
    if style.json {
        let rows = table(&trials, args.told.leak);
        style.document(&json!({
            "task": trials[0].task, "leak_ml": args.told.leak, "done": trials.len(), "rows": rows,
            "trials": trials,
        }));
    } else {
        tell(&trials, &args.told, style);
    }
    Ok(Exit::Yes)
}

/// Returns which part a file is by its name, `trials-1of2.jsonl`.
fn part_of(file: &Path) -> Option<Shard> {
    let name = file.file_stem()?.to_str()?;
    let (i, n) = name.strip_prefix("trials-")?.split_once("of")?;
    format!("{i}/{n}").parse().ok()
}

/// Says which of `n` parts are missing where some are there.
fn missing(n: u64, there: &BTreeSet<u64>) -> Option<String> {
    let named = (1..=n).filter(|i| !there.contains(i)).take(NAMED + 1);
    let named: Vec<String> = named.map(|i| i.to_string()).collect();
    match &named[..] {
        [] => None,
        [one] => Some(format!("part {one} of {n} is not among these files")),
        several if several.len() <= NAMED => {
            Some(format!("parts {} of {n} are not among these files", several.join(", ")))
        }
        _ => {
            let count = n - there.len() as u64;
            Some(format!("{count} of {n} parts are not among these files"))
        }
    }
}
