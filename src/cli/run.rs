//! `trueup run`, `trueup -c` and `trueup`: calls carried out in a work cell.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::language::ast::{Act, Item, Step};
use crate::language::{self, Library, Source};
use crate::repl::{Hands, Propose};
use crate::report::{self, Failure, Style, run::Console};
use crate::trace::Observer;
use crate::workcell::record::Recorder;
use crate::workcell::{Fan, Run, WorkCell};

use super::cell::{home, model, open};
use super::clock::stamp;
use super::inputs::read;
use super::shared::{CellArgs, Common, Shared};
use super::signals::{self, is_interrupted, stop_on_interrupt};
use super::teach::Lead;
use super::topics::topics;
use super::{gap, question, say};
use crate::report::exit::{Exit, ended};

/// Run a saved script; a run folder is written.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// The script.
    file: PathBuf,
    /// Pause before each step, and take words from the terminal or a pipe.
    #[arg(long)]
    step: bool,
    /// Show the runs on a page of this machine while they go on.
    #[cfg(feature = "page")]
    #[arg(long)]
    live: bool,
}

/// The page that runs are shown on; there is none without the feature.
#[cfg(feature = "page")]
type Window = super::watch::Window;
#[cfg(not(feature = "page"))]
type Window = std::convert::Infallible;

/// How long a page of runs is served.
#[derive(Debug, Clone, Copy)]
pub(super) enum Until {
    /// For one run.
    RunIsOver,
    /// For all runs of a prompt.
    PromptIsLeft,
}

/// Opens the page of `--live`, if it is wanted.
#[cfg(feature = "page")]
fn window(
    is_live: bool,
    until: Until,
    cell: &mut WorkCell,
    cli: &Shared,
    style: Style,
) -> Result<Option<Window>, Failure> {
    is_live.then(|| Window::open(cell, cli, until, style)).transpose()
}

#[cfg(not(feature = "page"))]
fn window(
    _: bool,
    _: Until,
    _: &mut WorkCell,
    _: &Shared,
    _: Style,
) -> Result<Option<Window>, Failure> {
    Ok(None)
}

/// `trueup run FILE.task`.
pub(super) fn script(args: &RunArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let lead = args.step.then(|| Lead::stepping(cli, style)).transpose()?;
    #[cfg(feature = "page")]
    let is_live = args.live;
    #[cfg(not(feature = "page"))]
    let is_live = false;
    script_led(&args.file, lead.as_ref(), is_live, cli, style)
}

/// Runs a script, each call led if somebody leads.
pub(super) fn script_led(
    file: &Path,
    lead: Option<&Lead>,
    is_live: bool,
    cli: &Shared,
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
    let window = window(is_live, Until::RunIsOver, &mut cell, cli, style)?;
    let mut exit = Exit::Yes;
    let mut runs = Vec::new();
    // Calls are a run each; steps that share names or conditions are one.
    let is_call = |step: &Step| matches!(step, Step::Act(_));
    let parts: Vec<&[Step]> =
        if steps.iter().all(is_call) { steps.chunks(1).collect() } else { vec![&steps] };
    for (at, steps) in parts.iter().enumerate() {
        if let Some(lead) = lead {
            lead.take(&mut cell);
        }
        let run = one(&mut cell, steps, &source, (&cli.cell.record, window.as_ref()), style);
        let run = run.map_err(|failure| {
            if runs.is_empty() { failure } else { failure.after(&runs, parts.len() - at - 1) }
        })?;
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
pub(super) fn line(line: &str, is_live: bool, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    line_led(line, None, is_live, cli, style)
}

/// Whether a line that is no step means something at the prompt: a command, a name asked about, a sum, words.
fn reads_at_prompt(line: &str) -> bool {
    let is_call = line.trim().is_empty() || line.contains('(');
    line.starts_with([':', '?', '!']) || !is_call || line.ends_with('?') || compares(line)
}

/// Whether a line is a condition, such as `distance(jar, cup) < 5 cm`.
fn compares(line: &str) -> bool {
    let (step, wrong) = language::parse_line(&format!("check {line}"));
    matches!(step, Some(Step::Check(..))) && !wrong.iter().any(language::Diagnostic::is_error)
}

/// Whether a call asks for the value of a fluent, of which nothing can be led.
fn is_asked(act: &Act, lead: Option<&Lead>, cell: &WorkCell) -> bool {
    let name = act.call.name.text.as_str();
    lead.is_none()
        && cell.library().callable(name).is_none()
        && language::assist::describe(
            cell.library(),
            &cell.library().scope(&cell.scene().name),
            name,
        )
        .is_some()
}

/// Carries out a line, led if somebody leads.
pub(super) fn line_led(
    line: &str,
    lead: Option<&Lead>,
    is_live: bool,
    cli: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let source = Source::new("command line", line);
    let (step, diagnostics) = language::parse_line(line);
    let step = step.filter(|_| !diagnostics.iter().any(language::Diagnostic::is_error));
    let is_led = lead.is_some() || style.json;
    let asks = style.json && lead.is_none() && question::asks(line);
    // A `let` alone names a value for the lines after it, which only the prompt has.
    let is_named = matches!(step, Some(Step::Let(..))) && lead.is_none();
    let is_prompts = is_named || (step.is_none() && reads_at_prompt(line));
    if is_prompts && style.json && lead.is_none() && !asks {
        return Err(Failure::input("usage", "with `--json`, `-c` takes a call, another step of a task, or a question")
            .help("leave `--json` out, or ask by a command: `trueup runs --json`, `trueup doc pick --json`"));
    }
    if step.is_none() && !asks && (is_led || !reads_at_prompt(line)) {
        return Err(report::text_failure(&diagnostics, &source, style));
    }
    let mut cell = open(cli, None, style)?;
    let step = match step {
        Some(Step::Act(act)) if is_asked(&act, lead, &cell) => {
            if style.json {
                return question::answer(line, &mut cell, style);
            }
            return at_prompt(line, is_live, cell, cli, style);
        }
        None if asks => return question::answer(line, &mut cell, style),
        Some(Step::Let(..)) if is_named => return at_prompt(line, is_live, cell, cli, style),
        Some(step) => step,
        None => return at_prompt(line, is_live, cell, cli, style),
    };
    let diagnostics = cell.check_line(&step, &source);
    if diagnostics.iter().any(language::Diagnostic::is_error) {
        return Err(report::text_failure(&diagnostics, &source, style));
    }
    stop_on_interrupt(&cell)?;
    if let Some(lead) = lead {
        lead.take(&mut cell);
    }
    let window = window(is_live, Until::RunIsOver, &mut cell, cli, style)?;
    let run = one(&mut cell, &[step], &source, (&cli.cell.record, window.as_ref()), style)?;
    match lead {
        Some(_) if style.json => report::teach::ended(&run, style),
        _ if style.json => style.document(&run),
        _ => {}
    }
    Ok(ended(&run))
}

/// `trueup`: the prompt.
pub(super) fn prompt(is_live: bool, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let mut cell = open(cli, None, style)?;
    stop_on_interrupt(&cell)?;
    signals::at_prompt();
    let window = window(is_live, Until::PromptIsLeft, &mut cell, cli, style)?;
    // At an open prompt `--yes` starts a real arm; before each call it is asked for all the same.
    let is_sure = cli.cell.yes && matches!(cell.robot_name(), "lab" | "twin");
    let exit = with_hands(cli, is_sure, window.as_ref(), style, |hands| {
        crate::repl::run(cell, style, hands)
    })?;
    Ok(if signals::LEAVE.is_asked() { Exit::Stopped } else { Exit::of(exit) })
}

/// Has the prompt take one line: a question, a sentence, what begins with a colon.
fn at_prompt(
    line: &str,
    is_live: bool,
    mut cell: WorkCell,
    cli: &Shared,
    style: Style,
) -> Result<Exit, Failure> {
    let window = window(is_live, Until::RunIsOver, &mut cell, cli, style)?;
    let exit = with_hands(cli, cli.cell.yes, window.as_ref(), style, |hands| {
        crate::repl::run_on(cell, style, hands, &mut format!("{line}\n").as_bytes())
    })?;
    Ok(Exit::of(exit))
}

/// Gives what the prompt can have done for it to `work`.
fn with_hands(
    cli: &Shared,
    is_sure: bool,
    window: Option<&Window>,
    style: Style,
    work: impl FnOnce(Hands<'_>) -> Result<u8, Failure>,
) -> Result<u8, Failure> {
    let real = if cli.cell.robot == "twin" { "lab" } else { cli.cell.robot.as_str() };
    let home = home();
    let model = model(cli)?;
    let propose = model.map(|model| {
        move |said: &str, library: &Library, scene: &str| {
            say::propose(&model, said, library, scene, &is_interrupted)
        }
    });
    let topics = topics();
    work(Hands {
        perform: &|cell, step| {
            let source = Source::new("prompt", language::text::step(step));
            one(cell, std::slice::from_ref(step), &source, (&cli.cell.record, window), style)
        },
        propose: propose.as_ref().map(|propose| propose as &Propose),
        gap: &|runs| gap::over(runs, cli, style),
        topics: &topics,
        open: &|robot, seed| {
            let cell = CellArgs { robot: robot.to_owned(), ..cli.cell.clone() };
            let other = Shared { common: Common { seed, ..cli.common.clone() }, cell };
            #[cfg_attr(not(feature = "page"), expect(unused_mut, reason = "only a page looks on"))]
            let mut cell = open(&other, None, style)?;
            #[cfg(feature = "page")]
            if window.is_some() {
                cell.show_rehearsals();
            }
            signals::obey(cell.cancel());
            Ok(cell)
        },
        real,
        record: &cli.cell.record,
        home: home.as_deref(),
        presses: &signals::PRESSES,
        leave: &signals::LEAVE,
        is_sure,
    })
}

/// Carries out steps of a script or one line, recorded in a folder of their own under `root`, and shows them where
/// there is a window.
fn one(
    cell: &mut WorkCell,
    steps: &[Step],
    source: &Source,
    (root, window): (&Path, Option<&Window>),
    style: Style,
) -> Result<Run, Failure> {
    let call = &cell.define(source, steps);
    cell.graph(call).map_err(|error| report::cell_failure(&error, style))?;
    let recorder = Recorder::create(root, &stamp(), &call.name.text)
        .map_err(|(path, error)| Failure::no_run_folder(&path, &error, "--record"))?;
    let console = Console::new(style);
    let console = if cell.is_told() { console.without_steps() } else { console };
    #[cfg_attr(not(feature = "page"), expect(unused_mut, reason = "only a page looks on"))]
    let mut watchers: Vec<Box<dyn Observer + Send>> = vec![Box::new(console)];
    #[cfg(feature = "page")]
    watchers.extend(window.map(|window| window.onlooker(&language::text::call(call))));
    let run = cell.run(call, Some(recorder), Box::new(Fan(watchers)));
    let run = run.map_err(|error| report::cell_failure(&error, style));
    #[cfg(feature = "page")]
    if let Some(window) = window {
        window.ended(&run, style);
    }
    #[cfg(not(feature = "page"))]
    let _ = window;
    let run = run?;
    style.say(report::run::ending(&run, style));
    Ok(run)
}
