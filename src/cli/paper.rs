//! `trueup paper table1|table2|table3`: the paper's tables made anew, with its own numbers beside, as Markdown and JSON.
//!
//! Every number of ours comes out of laboratories that are drawn while the command runs, or of the runs it keeps; what the
//! paper prints is quoted by [`crate::report::paper`]. What a laboratory cannot do is said in the documents.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use crate::files::write;
use crate::report::grid::Form;
use crate::report::paper::{self, Made, Progress};
use crate::report::{Failure, Style};
use crate::vqa::score::{Agreement, Case};
use crate::workcell::Options;
use crate::workcell::paper::{Corners, corners};
use crate::workcell::trials::table;

use super::cell::options;
use super::clock::stamp;
use super::numbers;
use super::shared::Shared;
use super::signals::{is_interrupted, watch_interrupt};
use super::trials::{Counted, LEAK, TrialsArgs, counted};
use super::vqa::eval::{EvalArgs, Scored, scored};
use crate::report::exit::Exit;

#[derive(Debug, Subcommand)]
pub(super) enum PaperCommand {
    /// Forms of the camera alignment: the corners of a cube, laboratory against twin. Seconds a laboratory.
    Table1(CornersArgs),
    /// Pick and pour in one laboratory after the other. About half a minute a laboratory.
    Table2(RunsArgs),
    /// Who answers the questions of such runs, on photographs and on the twin's pictures.
    Table3(RunsArgs),
}

#[derive(Debug, Args)]
pub(super) struct CornersArgs {
    /// How many laboratories: those of the seeds from `--seed` on.
    #[arg(long, short, value_name = "N", default_value_t = 20, value_parser = numbers::tries)]
    n: u64,
    /// Where the table is written, as Markdown and as JSON.
    #[arg(long, short, value_name = "FOLDER", default_value = "docs/paper")]
    out: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct RunsArgs {
    /// How many laboratories: those of the seeds from `--seed` on. Those whose runs are kept already are not run again.
    #[arg(long, short, value_name = "N", default_value_t = 3, value_parser = numbers::tries)]
    n: u64,
    /// Where the table is written, as Markdown and as JSON.
    #[arg(long, short, value_name = "FOLDER", default_value = "docs/paper")]
    out: PathBuf,
    /// Where run folders are kept.
    #[arg(long, value_name = "FOLDER", default_value = "trials/paper")]
    runs: PathBuf,
    /// Beside the whole, leave each of these regressions out in turn, in the same laboratories.
    #[arg(long, value_name = "1,2,3", value_delimiter = ',')]
    ablate: Vec<u8>,
    /// What a run may take, s of wall time; then it counts as failed, and the next begins.
    #[arg(long, value_name = "S", default_value_t = 300.0, value_parser = numbers::budget)]
    budget: f64,
}

/// The paper's task.
const TASK: &str = "pour(jar, cup)";

/// `trueup paper …`.
pub(super) fn paper(command: &PaperCommand, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    match command {
        PaperCommand::Table1(args) => first(args, cli, style),
        PaperCommand::Table2(args) => second(args, cli, style),
        PaperCommand::Table3(args) => third(args, cli, style),
    }
}

/// A table that is made: how it is told, and what is written.
struct Document {
    name: &'static str,
    text: String,
    page: String,
    json: Value,
}

impl Document {
    fn tell(self, out: &Path, made: &Made, style: Style) -> Result<(), Failure> {
        let Self { name, text, page, mut json } = self;
        json["made"] = json!(made);
        let put = |ending: &str, text: String| {
            let path = out.join(format!("{name}.{ending}"));
            write::replace(&path, text).map_err(|error| Failure::unwritten(&path, &error))
        };
        put("md", page)?;
        put("json", format!("{json:#}\n"))?;
        if style.json {
            style.document(&json);
        } else {
            style.say(text);
            style.note(&format!("written: {name}.md and {name}.json in {}", out.display()));
        }
        Ok(())
    }
}

/// Makes the folder of the tables before anything is worked out for them.
fn folder(out: &Path) -> Result<(), Failure> {
    fs::create_dir_all(out).map_err(|error| Failure::unwritten(out, &error))
}

fn made(table: &str, n: u64, cli: &Shared, more: &str) -> Made {
    let seed = cli.common.seed;
    let day = stamp();
    let (year, month, day) = (&day[..4], &day[4..6], &day[6..8]);
    Made {
        date: format!("{year}-{month}-{day}"),
        command: format!("trueup paper {table} --n {n} --seed {seed}{more}"),
        version: env!("CARGO_PKG_VERSION"),
    }
}

/// `trueup paper table1`.
fn first(args: &CornersArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    folder(&args.out)?;
    watch_interrupt()?;
    let plain = options(cli, None)?;
    let progress = Progress::new(args.n, style);
    let (mut all, mut failures): (Vec<Corners>, Vec<(u64, String)>) = (Vec::new(), Vec::new());
    for k in 0..args.n {
        if is_interrupted() {
            return Ok(Exit::Stopped);
        }
        let seed = cli.common.seed.wrapping_add(k);
        match corners(Options { seed, ..plain.clone() }) {
            Ok(one) => {
                let errors: Vec<String> =
                    one.ways.iter().map(|w| format!("{} {:.1} px", w.way, w.error_px)).collect();
                progress.over(&format!("seed {seed}: {}", errors.join(", ")));
                all.push(one);
            }
            Err(error) => {
                progress.over(&format!("seed {seed}: left out, {error}"));
                failures.push((seed, error.to_string()));
            }
        }
    }
    drop(progress);
    if all.is_empty() {
        let why = failures.into_iter().next().map(|(_, why)| why).unwrap_or_default();
        return Err(Failure::no("paper::nothing", format!("no laboratory gave a row: {why}"))
            .help("other laboratories: `--seed N`"));
    }
    let rows = paper::ways(&all);
    let made = made("table1", args.n, cli, "");
    let left_out: Vec<Value> =
        failures.iter().map(|(seed, why)| json!({"seed": seed, "reason": why})).collect();
    let document = Document {
        name: "table1",
        text: paper::first(&rows).form(Form::Text),
        page: paper::first_page(&made, &rows, all.len(), &failures),
        json: json!({
            "table": 1, "n": all.len(), "seed": cli.common.seed, "rows": rows, "laboratories": all,
            "left_out": left_out,
        }),
    };
    document.tell(&args.out, &made, style)?;
    Ok(Exit::Yes)
}

/// Makes the runs that are not kept yet; `None` when a person stopped them.
fn runs(args: &RunsArgs, cli: &Shared, style: Style) -> Result<Option<Counted>, Failure> {
    folder(&args.out)?;
    let trials = TrialsArgs::of(args.n, args.ablate.clone(), args.budget, args.runs.clone());
    let found = counted(TASK, &trials, cli, style)?;
    if found.stopped {
        style.note(&format!(
            "stopped; {} of {} runs are kept in {}, and the same command goes on",
            found.trials.len(),
            found.of,
            found.file.display()
        ));
        return Ok(None);
    }
    Ok(Some(found))
}

fn ablated(args: &RunsArgs) -> String {
    if args.ablate.is_empty() {
        return String::new();
    }
    let left_out: Vec<String> = args.ablate.iter().map(ToString::to_string).collect();
    format!(" --ablate {}", left_out.join(","))
}

/// `trueup paper table2`.
fn second(args: &RunsArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let Some(Counted { trials, .. }) = runs(args, cli, style)? else { return Ok(Exit::Stopped) };
    let rows = table(&trials, LEAK);
    let made = made("table2", args.n, cli, &ablated(args));
    let document = Document {
        name: "table2",
        text: paper::second(&rows).form(Form::Text),
        page: paper::second_page(&made, &rows, LEAK, &trials),
        json: json!({
            "table": 2, "n": args.n, "seed": cli.common.seed, "leak_ml": LEAK, "rows": rows,
            "paper": paper::second_printed(), "match": paper::matched(&trials), "trials": trials,
        }),
    };
    document.tell(&args.out, &made, style)?;
    Ok(Exit::Yes)
}

/// `trueup paper table3`.
fn third(args: &RunsArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let Some(Counted { trials, .. }) = runs(args, cli, style)? else { return Ok(Exit::Stopped) };
    // The runs of these laboratories alone, whatever else lies in the folder.
    let folders: Vec<PathBuf> =
        trials.iter().filter_map(|trial| trial.run_dir.as_ref()).map(PathBuf::from).collect();
    if folders.is_empty() {
        return Err(Failure::no("paper::nothing", "no run came as far as a question")
            .help("`trueup paper table2` says why"));
    }
    let Scored { table, probes, cases } = scored(&EvalArgs::of(folders), cli.common.seed, style)?;
    let geometry = both_pictures(&cases);
    let made = made("table3", args.n, cli, &ablated(args));
    let document = Document {
        name: "table3",
        text: paper::third(&table, geometry).form(Form::Text),
        page: paper::third_page(&made, &table, geometry),
        json: json!({
            "table": 3, "n": args.n, "seed": cli.common.seed, "scores": table, "probes": probes,
            "geometry": geometry, "paper": paper::third_printed(),
        }),
    };
    document.tell(&args.out, &made, style)?;
    Ok(Exit::Yes)
}

/// How often the truth of the photograph is that of the twin's picture of the same moment, by geometry.
fn both_pictures(cases: &[Case]) -> Agreement {
    use crate::vqa::On;
    let told = |on: On| cases.iter().filter(move |case| case.on == on && case.truth.is_some());
    let (mut pairs, mut same) = (0_usize, 0_usize);
    for real in told(On::Real) {
        let twin = told(On::Twin).find(|twin| twin.moment == real.moment);
        if let Some(twin) = twin {
            pairs += 1;
            same += usize::from(twin.truth == real.truth);
        }
    }
    let share = (pairs > 0).then(|| same as f64 / pairs as f64);
    Agreement { pairs, share, kappa: None }
}
