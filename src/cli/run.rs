//! `trueup run`, `trueup -c` and `trueup`: calls carried out in a work cell.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;

use crate::execution::calibrate::Switches;
use crate::files;
use crate::lab::LabSettings;
use crate::language::ast::{Item, Step};
use crate::language::{self, Library, Source};
use crate::repl::{Hands, Propose};
use crate::report::{self, Failure, Style, run::Console};
use crate::vqa::Endpoint;
use crate::workcell::record::Recorder;
use crate::workcell::{Ending, Options, Run, Stdlib, WorkCell};

use super::signals::{self, is_interrupted, stop_on_interrupt};
use super::teach::Lead;
use super::{CellArgs, Cli, Exit, kortex, say, vqa};

/// Run a saved script; a run folder is written.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// The script.
    file: PathBuf,
    /// Pause before each step, and take words from the terminal or a pipe.
    #[arg(long)]
    step: bool,
}

/// Returns seconds since the program could first be asked; only differences mean something.
#[expect(
    clippy::disallowed_methods,
    reason = "the one clock of the program, handed down from here"
)]
pub(super) fn clock() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// Returns the time of day as run folders are named: `20261121-140307`, UTC.
pub(super) fn stamp() -> String {
    let seconds = clock() as i64;
    let (days, rest) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
    // Civil date from days since 1970 (Hinnant, "chrono-compatible low-level date algorithms").
    let shifted = days + 719_468;
    let era = shifted.div_euclid(146_097);
    let of_era = shifted.rem_euclid(146_097);
    let year_of_era =
        (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096).div_euclid(365);
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_shifted = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month_shifted + 2) / 5 + 1;
    let month = if month_shifted < 10 { month_shifted + 3 } else { month_shifted - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{second:02}")
}

/// Reads a text file, with an error that says which and why.
pub(super) fn read(path: &Path) -> Result<String, Failure> {
    files::read::text(path).map_err(|error| Failure::unread(path, &error))
}

/// Reads what a program writes, which may be larger than what a person does.
pub(super) fn data(path: &Path) -> Result<String, Failure> {
    let text = files::read::text_of(path, files::read::DATA);
    text.map_err(|error| Failure::unread(path, &error))
}

/// Returns which regressions are in force when these are left out.
pub(super) fn switches(left_out: &[u8]) -> Result<Switches, Failure> {
    let mut switches = Switches::default();
    for which in left_out {
        match which {
            1 => switches.camera = false,
            2 => switches.intrinsics = false,
            3 => switches.offset = false,
            other => {
                return Err(Failure::input(
                    "usage::regression",
                    format!("there is no regression {other}"),
                )
                .help("1 camera alignment, 2 intrinsics, 3 robot offset"));
            }
        }
    }
    Ok(switches)
}

/// Returns the embedded stdlib with the user's folder over it.
pub(super) fn stdlib(cli: &Cli) -> Result<Stdlib, Failure> {
    let embedded = Stdlib::embedded()
        .reading(|path| files::read::text(Path::new(path)).map_err(|e| e.to_string()));
    match &cli.cell.stdlib {
        None => Ok(embedded),
        Some(folder) => embedded.with_folder(folder).map_err(|(path, error)| {
            let mut failure = Failure::unread(&path, &error)
                .help("`--stdlib` takes a folder laid out like the project's `stdlib/`");
            failure.code = "io::read".into();
            failure
        }),
    }
}

pub(super) fn options(cli: &Cli, script: Option<Source>) -> Result<Options, Failure> {
    let robot = match kortex::target(&cli.cell.robot)? {
        // Who connects is nobody's business who reads a run folder.
        Some(target) => target.to_string(),
        None => cli.cell.robot.clone(),
    };
    let lab = match &cli.cell.lab {
        None => LabSettings::default(),
        Some(path) => LabSettings::from_toml(&read(path)?).map_err(|error| {
            Failure::input("lab::settings", error.to_string()).at(path.display().to_string())
        })?,
    };
    let scene = match &cli.cell.scene {
        None => None,
        Some(path) => Some(Source::new(path.display().to_string(), read(path)?)),
    };
    let switches = switches(&cli.cell.without_regression)?;
    Ok(Options {
        robot,
        scene,
        script,
        lab,
        stdlib: stdlib(cli)?,
        seed: cli.common.seed,
        switches,
        clock,
    })
}

/// Opens the cell the arguments ask for.
pub(super) fn open(cli: &Cli, script: Option<Source>, style: Style) -> Result<WorkCell, Failure> {
    let learnt = super::learn::learnt(cli)?;
    let options = options(cli, script)?;
    let opened = match kortex::target(&cli.cell.robot)? {
        None => WorkCell::open(options),
        Some(target) => {
            let ready = kortex::Ready::new(target, &cli.cell, style)?;
            WorkCell::open_with(options, |robot, _, _| ready.connect(robot))
        }
    };
    let mut cell = opened.map_err(|error| report::cell_failure(&error, style))?;
    if let Some(target) = kortex::target(&cli.cell.robot)? {
        kortex::confirm(&target, &cli.cell)?;
    }
    cell.learn_from(learnt);
    if let Some(model) = model(cli)? {
        cell.answered_by(model);
    }
    Ok(cell)
}

/// Returns the model that answers questions beside geometry, if one is named.
fn model(cli: &Cli) -> Result<Option<Endpoint>, Failure> {
    let CellArgs { ask_endpoint, ask_model, ask_timeout, .. } = &cli.cell;
    let Some(base) = ask_endpoint else { return Ok(None) };
    vqa::at(base.clone(), ask_model.clone(), *ask_timeout, false).map(Some)
}

/// `trueup run FILE.task`.
pub(super) fn script(args: &RunArgs, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let lead = args.step.then(|| Lead::stepping(cli, style)).transpose()?;
    script_led(&args.file, lead.as_ref(), cli, style)
}

/// Runs a script, each call led if somebody leads.
pub(super) fn script_led(
    file: &Path,
    lead: Option<&Lead>,
    cli: &Cli,
    style: Style,
) -> Result<Exit, Failure> {
    let source = Source::new(file.display().to_string(), read(file)?);
    let (program, diagnostics) = language::parse(&source.text);
    if diagnostics.iter().any(language::Diagnostic::is_error) {
        return Err(report::text_failure(&diagnostics, &source, style));
    }
    let steps: Vec<Step> = program
        .items
        .into_iter()
        .filter_map(|item| match item {
            Item::Run(step) => Some(step),
            _ => None,
        })
        .collect();
    if steps.is_empty() {
        return Err(Failure::input("script::empty", "the script calls nothing")
            .at(source.name)
            .help("end it with a call such as `pour(jar, cup)`"));
    }
    let mut cell = open(cli, Some(source.clone()), style)?;
    stop_on_interrupt(&cell)?;
    let mut exit = Exit::Yes;
    let mut runs = Vec::new();
    // Calls are a run each; steps that share names or conditions are one.
    let is_call = |step: &Step| matches!(step, Step::Act(_));
    let parts: Vec<&[Step]> =
        if steps.iter().all(is_call) { steps.chunks(1).collect() } else { vec![&steps] };
    for steps in parts {
        if let Some(lead) = lead {
            lead.take(&mut cell);
        }
        let run = one(&mut cell, steps, &source, &cli.cell.record, style)?;
        exit = ended(&run);
        runs.push(run);
        if exit != Exit::Yes {
            break;
        }
    }
    if style.json && lead.is_some() {
        for run in &runs {
            report::teach::ended(run, style);
        }
    } else if style.json {
        match &runs[..] {
            [run] => style.document(run),
            several => style.document(&several),
        }
    }
    Ok(exit)
}

/// `trueup -c LINE`.
pub(super) fn line(line: &str, cli: &Cli, style: Style) -> Result<Exit, Failure> {
    line_led(line, None, cli, style)
}

/// Carries out a line, led if somebody leads.
pub(super) fn line_led(
    line: &str,
    lead: Option<&Lead>,
    cli: &Cli,
    style: Style,
) -> Result<Exit, Failure> {
    let source = Source::new("command line", line);
    let (step, diagnostics) = language::parse_line(line);
    let Some(step) = step.filter(|_| !diagnostics.iter().any(language::Diagnostic::is_error))
    else {
        return Err(report::text_failure(&diagnostics, &source, style));
    };
    let mut cell = open(cli, None, style)?;
    let diagnostics = cell.check_line(&step, &source);
    if diagnostics.iter().any(language::Diagnostic::is_error) {
        return Err(report::text_failure(&diagnostics, &source, style));
    }
    stop_on_interrupt(&cell)?;
    if let Some(lead) = lead {
        lead.take(&mut cell);
    }
    let run = one(&mut cell, &[step], &source, &cli.cell.record, style)?;
    match lead {
        Some(_) if style.json => report::teach::ended(&run, style),
        _ if style.json => style.document(&run),
        _ => {}
    }
    Ok(ended(&run))
}

/// `trueup`: the prompt.
pub(super) fn prompt(cli: &Cli, style: Style) -> Result<Exit, Failure> {
    let cell = open(cli, None, style)?;
    stop_on_interrupt(&cell)?;
    let real = if cli.cell.robot == "twin" { "lab" } else { cli.cell.robot.as_str() };
    let home = home();
    let model = model(cli)?;
    let propose = model.map(|model| {
        move |said: &str, library: &Library, scene: &str| {
            say::propose(&model, said, library, scene, &is_interrupted)
        }
    });
    let hands = Hands {
        perform: &|cell, step| {
            let source = Source::new("prompt", language::text::step(step));
            one(cell, std::slice::from_ref(step), &source, &cli.cell.record, style)
        },
        propose: propose.as_ref().map(|propose| propose as &Propose),
        gap: &|runs| super::gap::over(runs, cli, style),
        open: &|robot| {
            let cell = CellArgs { robot: robot.to_owned(), ..cli.cell.clone() };
            let other = Cli { common: cli.common.clone(), cell, line: None, command: None };
            let cell = open(&other, None, style)?;
            signals::obey(cell.cancel());
            Ok(cell)
        },
        real,
        record: &cli.cell.record,
        home: home.as_deref(),
        presses: &signals::PRESSES,
        leave: &signals::LEAVE,
    };
    signals::at_prompt();
    crate::repl::run(cell, style, hands)?;
    Ok(if signals::LEAVE.is_asked() { Exit::Stopped } else { Exit::Yes })
}

/// Returns the folder where the prompt keeps history and phrases, made if it is not there.
pub(super) fn home() -> Option<PathBuf> {
    let state = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/state")))?;
    let dir = state.join("trueup");
    std::fs::create_dir_all(&dir).ok()?;
    Some(dir)
}

/// Carries out steps of a script or one line, recorded in a folder of their own under `root`.
fn one(
    cell: &mut WorkCell,
    steps: &[Step],
    source: &Source,
    root: &Path,
    style: Style,
) -> Result<Run, Failure> {
    let call = &cell.define(source, steps);
    cell.graph(call).map_err(|error| report::cell_failure(&error, style))?;
    let recorder = Recorder::create(root, &stamp(), &call.name.text)
        .map_err(|(path, error)| Failure::no_run_folder(&path, &error, "--record"))?;
    let console = Console::new(style);
    let console = if cell.is_told() { console.without_steps() } else { console };
    let run = cell.run(call, Some(recorder), Box::new(console));
    let run = run.map_err(|error| report::cell_failure(&error, style))?;
    style.say(report::run::ending(&run, style));
    Ok(run)
}

pub(super) fn ended(run: &Run) -> Exit {
    match run.outcome {
        Ending::Success => Exit::Yes,
        // An arm or a camera that failed on the way is no answer to what was asked.
        Ending::Failure if run.device_help.is_some() => Exit::Unavailable,
        Ending::Failure => Exit::No,
        Ending::Stopped => Exit::Stopped,
    }
}
