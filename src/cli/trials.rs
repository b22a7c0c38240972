//! `trueup trials`: the same task in one laboratory after the other, counted as the paper's Table 2.
//!
//! A line is appended to the results file after every trial, so what was done is kept whatever happens, and
//! the same command goes on where it ended.

mod merge;

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use clap::{Args, Subcommand};
use serde_json::json;

use crate::arm::Cancel;
#[cfg(feature = "arrow")]
use crate::files::write;
use crate::language::ast::Step;
use crate::language::{self, Source};
use crate::lines;
use crate::report::grid::Form;
use crate::report::{self, Failure, Style, trials::Progress};
use crate::workcell::record::Recorder;
use crate::workcell::trials::{Trial, table};
use crate::workcell::{Ending, Error};

use super::cell::{open, options, switches};
use super::clock::{clock, stamp};
use super::inputs::{read, steps};
use super::shared::{CellArgs, Common, Shared};
use super::signals::{is_interrupted, stop_on_interrupt, watch_interrupt};
use super::{arm, numbers};
use crate::report::exit::Exit;
use merge::{MergeArgs, merged};

/// Carry out a task in one laboratory after the other, and count.
#[derive(Debug, Args)]
pub(super) struct TrialsArgs {
    #[command(subcommand)]
    command: Option<TrialsCommand>,
    /// A script, or a call such as `pour(jar, cup)`.
    #[arg(long, value_name = "FILE|CALL")]
    task: Option<String>,
    /// How many laboratories: those of the seeds from `--seed` on.
    #[arg(long, short, value_name = "N", default_value_t = 20, value_parser = numbers::tries)]
    n: u64,
    /// Only part I of N of them, for several machines: `1/4`.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Beside the whole, leave each of these regressions out in turn, in the same laboratories.
    #[arg(long, value_name = "1,2,3", value_delimiter = ',')]
    ablate: Vec<u8>,
    /// What a trial may take, s of wall time; then it counts as failed, and the next begins.
    #[arg(long, value_name = "S", default_value_t = 300.0, value_parser = numbers::budget)]
    budget: f64,
    /// Where run folders and results go; `trials/TASK` when left out.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    told: Told,
}

#[derive(Debug, Subcommand)]
enum TrialsCommand {
    /// Make one table of results files, or of folders that hold some.
    Merge(MergeArgs),
}

/// How the table is told.
#[derive(Debug, Args)]
struct Told {
    /// What a soft success may spill, mL.
    #[arg(long, value_name = "ML", default_value_t = LEAK, value_parser = numbers::millilitres)]
    leak: f64,
    #[command(flatten)]
    form: FormArgs,
    /// Also write the trials as a Parquet file, a row each: for pandas and R.
    #[cfg(feature = "arrow")]
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
}

/// In which form a table is printed.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct FormArgs {
    /// Print the table as comma-separated values.
    #[arg(long, conflicts_with_all = ["md", "json"])]
    csv: bool,
    /// Print the table as Markdown.
    #[arg(long, conflicts_with = "json")]
    md: bool,
}

impl FormArgs {
    pub(super) fn markdown() -> Self {
        Self { csv: false, md: true }
    }

    pub(super) fn form(self) -> Form {
        match (self.csv, self.md) {
            (true, _) => Form::Csv,
            (_, true) => Form::Markdown,
            _ => Form::Text,
        }
    }
}

/// Part `i` of `n`, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shard {
    i: u64,
    n: u64,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((i, n)) if (1..=n).contains(&i) => Ok(Self { i, n }),
            _ => Err(format!("`{text}` is not I/N with I from 1 to N, such as 1/4")),
        }
    }
}

/// Ends what takes too long, as Ctrl-C would.
struct Watchdog {
    /// Dropped when there is nothing left to watch.
    _over: Sender<()>,
    barked: Arc<AtomicBool>,
}

impl Watchdog {
    /// Asks everyone who obeys `cancel` to stop after `seconds`, unless it is dropped before.
    fn over(cancel: Cancel, seconds: f64) -> Self {
        let (over, is_over) = channel();
        let barked = Arc::new(AtomicBool::new(false));
        let bark = barked.clone();
        thread::spawn(move || {
            let waited = is_over.recv_timeout(Duration::from_secs_f64(seconds));
            if waited == Err(RecvTimeoutError::Timeout) {
                bark.store(true, Ordering::SeqCst);
                cancel.cancel();
            }
        });
        Self { _over: over, barked }
    }

    fn barked(&self) -> bool {
        self.barked.load(Ordering::SeqCst)
    }
}

/// `trueup trials`.
pub(super) fn trials(args: &TrialsArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    if let Some(TrialsCommand::Merge(merge)) = &args.command {
        return merged(merge, style);
    }
    let Some(task) = &args.task else {
        return Err(Failure::input("usage", "there is no task to try")
            .help("`--task scripts/pour.task`, or `--task 'pour(jar, cup)'`"));
    };
    let Counted { trials, file, of, stopped } = counted(task, args, cli, style)?;
    #[cfg(feature = "arrow")]
    write_parquet(&trials, &args.told, style)?;
    if style.json {
        let rows = table(&trials, args.told.leak);
        style.document(&json!({
            "task": task, "file": file.display().to_string(), "done": trials.len(), "of": of,
            "stopped": stopped, "leak_ml": args.told.leak, "rows": rows, "trials": trials,
        }));
    } else {
        if !trials.is_empty() {
            tell(&trials, &args.told, style);
        }
        if stopped {
            style.note(&format!(
                "stopped; {} of {of} trials are kept in {}, and the same command goes on",
                trials.len(),
                file.display()
            ));
        }
    }
    Ok(if stopped { Exit::Stopped } else { Exit::Yes })
}

/// What is kept of the trials that were wanted.
pub(super) struct Counted {
    pub(super) trials: Vec<Trial>,
    pub(super) file: PathBuf,
    /// How many were wanted.
    pub(super) of: usize,
    /// Whether a person stopped them.
    pub(super) stopped: bool,
}

impl TrialsArgs {
    /// Returns the arguments of `n` trials kept in a folder.
    pub(super) fn of(n: u64, ablate: Vec<u8>, budget: f64, out: PathBuf) -> Self {
        let form = FormArgs { csv: false, md: false };
        let told = Told {
            leak: LEAK,
            form,
            #[cfg(feature = "arrow")]
            parquet: None,
        };
        Self { command: None, task: None, n, shard: None, ablate, budget, out: Some(out), told }
    }
}

/// What a soft success may spill unless somebody says otherwise, mL. Chosen: two spoons, which a cloth takes up.
pub(super) const LEAK: f64 = 10.0;

/// Makes the trials of a task that are not kept yet, and returns all that were wanted.
pub(super) fn counted(
    task: &str,
    args: &TrialsArgs,
    cli: &Shared,
    style: Style,
) -> Result<Counted, Failure> {
    if arm::at(&cli.cell.robot)?.is_elsewhere() {
        return Err(Failure::input(
            "trials::robot",
            format!("{} is one place, and trials draw many", cli.cell.robot),
        )
        .help("leave `--robot` out; a run on an arm is `trueup run`"));
    }
    let work = Work::new(task, args, cli, style)?;
    let (done, of) = work.count()?;
    let stopped = work.go_on(done, of, cli, style)?;
    let mut trials = work.kept()?;
    let wanted = work.wanted();
    trials.retain(|trial| wanted.contains(&(trial.without.as_slice(), trial.seed)));
    Ok(Counted { trials, file: work.file, of, stopped })
}

fn tell(trials: &[Trial], told: &Told, style: Style) {
    style.say(report::trials::table(&table(trials, told.leak), told.leak, told.form.form()));
}

/// Writes the trials as a table, where one is asked for.
#[cfg(feature = "arrow")]
fn write_parquet(trials: &[Trial], told: &Told, style: Style) -> Result<(), Failure> {
    let Some(path) = &told.parquet else { return Ok(()) };
    let bytes = report::parquet::file(trials)
        .map_err(|error| Failure::input("trials::table", error.to_string()))?;
    write::replace(path, bytes).map_err(|error| Failure::unwritten(path, &error))?;
    style.note(&format!("{} trials are a table in {}", trials.len(), path.display()));
    Ok(())
}

/// What is to be tried, and where it is kept.
struct Work {
    source: Source,
    steps: Vec<Step>,
    is_file: bool,
    /// The regressions left out, one list a row of the table.
    sets: Vec<Vec<u8>>,
    seeds: Vec<u64>,
    /// What a trial may take, s.
    budget: f64,
    setup: String,
    out: PathBuf,
    file: PathBuf,
}

impl Work {
    fn new(task: &str, args: &TrialsArgs, cli: &Shared, style: Style) -> Result<Self, Failure> {
        let is_file = is_meant_as_file(task);
        let text = if is_file { read(Path::new(task))? } else { task.to_owned() };
        let source = Source::new(if is_file { task } else { "command line" }, text);
        let steps = steps(&source, is_file, style)?;
        let name = if is_file {
            Path::new(task).file_stem().map(|stem| stem.to_string_lossy().into_owned())
        } else {
            task.split('(').next().map(|name| name.trim().to_owned())
        };
        let out = args.out.clone();
        let out = out.unwrap_or_else(|| Path::new("trials").join(name.unwrap_or_default()));
        let file = out.join(match args.shard {
            Some(Shard { i, n }) => format!("trials-{i}of{n}.jsonl"),
            None => "trials.jsonl".to_owned(),
        });
        let first = cli.common.seed;
        let is_ours = |k: &u64| args.shard.is_none_or(|shard| k % shard.n == shard.i - 1);
        let seeds = (0..args.n).filter(is_ours).map(|k| first.wrapping_add(k)).collect();
        let mut base = cli.cell.without_regression.clone();
        base.sort_unstable();
        base.dedup();
        let mut sets = vec![base.clone()];
        for which in &args.ablate {
            let mut set = base.clone();
            set.push(*which);
            set.sort_unstable();
            set.dedup();
            if !sets.contains(&set) {
                sets.push(set);
            }
        }
        // What is no regression is told before the first trial.
        for set in &sets {
            switches(set)?;
        }
        let setup = setup(&source, cli)?;
        let budget = args.budget;
        Ok(Self { source, steps, is_file, sets, seeds, budget, setup, out, file })
    }

    /// Returns how many of the wanted trials are done, and how many are wanted.
    fn count(&self) -> Result<(usize, usize), Failure> {
        let kept = self.kept()?;
        if let Some(other) = kept.iter().find(|trial| trial.setup != self.setup) {
            return Err(Failure::input(
                "trials::setup",
                format!("the trials kept there, of {}, were made with something else", other.task),
            )
            .at(self.file.display().to_string())
            .help("name another folder with `--out DIR`"));
        }
        let wanted = self.wanted();
        let done = wanted.iter().filter(|(set, seed)| is_done(&kept, set, *seed)).count();
        Ok((done, wanted.len()))
    }

    /// All of one laboratory before the next, so that what is kept early is a fair comparison.
    fn wanted(&self) -> Vec<(&[u8], u64)> {
        let seeds = self.seeds.iter();
        seeds.flat_map(|seed| self.sets.iter().map(|set| (set.as_slice(), *seed))).collect()
    }

    fn kept(&self) -> Result<Vec<Trial>, Failure> {
        lines::read(&self.file)
            .map(|(kept, _)| kept)
            .map_err(|error| Failure::unread(&self.file, &error))
    }

    /// Makes the trials that are missing; returns whether a person stopped it.
    fn go_on(&self, done: usize, of: usize, cli: &Shared, style: Style) -> Result<bool, Failure> {
        watch_interrupt()?;
        let kept = self.kept()?;
        let progress = Progress::new(done, of, style);
        for (number, (set, seed)) in self.wanted().into_iter().enumerate() {
            if is_done(&kept, set, seed) {
                continue;
            }
            if is_interrupted() {
                return Ok(true);
            }
            let Some(trial) = self.trial(set, seed, &progress, cli, style)? else {
                return Ok(true);
            };
            lines::append(&self.file, &trial)
                .map_err(|error| Failure::unwritten(&self.file, &error))?;
            progress.over(number + 1, of, &trial);
        }
        Ok(false)
    }

    /// Makes one trial; `None` when a person stopped it.
    fn trial(
        &self,
        without: &[u8],
        seed: u64,
        progress: &Progress,
        cli: &Shared,
        style: Style,
    ) -> Result<Option<Trial>, Failure> {
        // Nothing is learnt from one trial for the next, nor from other runs.
        let cell = CellArgs {
            without_regression: without.to_vec(),
            record: self.out.clone(),
            ..cli.cell.clone()
        };
        let common = Common { seed, ..cli.common.clone() };
        let own = Shared { common, cell };
        let script = self.is_file.then(|| self.source.clone());
        let switches = options(&own, script.clone())?.switches;
        let begin = clock();
        let mut cell = open(&own, script, style)?;
        stop_on_interrupt(&cell)?;
        // A mistake in the text is a mistake in every laboratory.
        for step in &self.steps {
            let wrong = cell.check_line(step, &self.source);
            if wrong.iter().any(language::Diagnostic::is_error) {
                return Err(report::text_failure(&wrong, &self.source, style));
            }
        }
        let call = &cell.define(&self.source, &self.steps);
        let graph = cell.graph(call).map_err(|error| report::cell_failure(&error, style))?;
        let aims = cell.aims(&graph);
        let made =
            Recorder::create(&self.out, &stamp(), &format!("{}-seed-{seed}", call.name.text));
        let recorder = made
            .map_err(|(path, error)| Failure::no_run_folder(&path, &error, "--out"))?
            .without_film();
        let watch = progress.watch(&format!("seed {seed}"));
        let watchdog = Watchdog::over(cell.cancel(), self.budget);
        let ran = cell.run(call, Some(recorder), Box::new(watch));
        // A trial that could not be kept has not been made.
        if let Err(error @ (Error::Unrecorded { .. } | Error::File { .. })) = &ran {
            return Err(report::cell_failure(error, style));
        }
        if is_interrupted() {
            return Ok(None);
        }
        let trial = match &ran {
            Ok(run) if run.outcome == Ending::Stopped && watchdog.barked() => {
                Trial::of(run, switches).not_within(self.budget, aims)
            }
            Ok(run) => Trial::of(run, switches),
            Err(error) => {
                let task = language::text::call(call);
                Trial::refused(seed, switches, &task, aims, error, clock() - begin)
            }
        };
        Ok(Some(Trial { setup: self.setup.clone(), ..trial }))
    }
}

/// Whether a task is the name of a script, be it there or not; a call may have a `/` in its brackets.
fn is_meant_as_file(task: &str) -> bool {
    let path = Path::new(task);
    let is_script = path.extension().is_some_and(|ending| ending == "task");
    path.is_file() || is_script || (task.contains('/') && !task.contains('('))
}

fn is_done(kept: &[Trial], set: &[u8], seed: u64) -> bool {
    kept.iter().any(|trial| trial.without == set && trial.seed == seed)
}

/// Returns the fingerprint of all that a trial is made with, besides the seed and the regressions.
fn setup(source: &Source, cli: &Shared) -> Result<String, Failure> {
    let given = |file: &Option<PathBuf>| file.as_deref().map(read).transpose();
    let (scene, lab) = (given(&cli.cell.scene)?, given(&cli.cell.lab)?);
    let stdlib = super::cell::stdlib(cli)?;
    let mut texts = vec![env!("CARGO_PKG_VERSION"), &cli.cell.robot, &source.text];
    texts.extend([scene.as_deref().unwrap_or_default(), lab.as_deref().unwrap_or_default()]);
    texts.extend(stdlib.tasks().flat_map(|(path, text)| [path, text]));
    Ok(lines::fingerprint(&texts))
}
