//! `trueup teach` and `trueup run --step`: a run one step at a time, words from a terminal, a pipe or a file.

use std::collections::VecDeque;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use clap::Args;
use rustyline::DefaultEditor;

use crate::arm::Cancel;
use crate::files;
use crate::language::Library;
use crate::report::teach::{Earlier, Place, Teller};
use crate::report::{self, Failure, Style, kept};
use crate::teach::stepper::{Setup, Stepper};
use crate::teach::stops::Stops;
use crate::teach::{answers, record};
use crate::workcell::{self, Run, WorkCell, archive};

use super::inputs::read;
#[cfg(feature = "page")]
use super::page;
use super::run::{line_led, script_led};
use super::shared::Shared;
use crate::report::exit::Exit;

/// Carry out a call or a script step by step, or step through a run that is over.
#[derive(Debug, Args)]
pub(super) struct TeachArgs {
    /// A call such as `pick(jar)`, a script, or the folder, name or number of a run that is over.
    #[cfg_attr(feature = "page", arg(required_unless_present = "page"))]
    #[cfg_attr(not(feature = "page"), arg(required = true))]
    what: Option<String>,
    /// Serve a page on this machine instead of the terminal: stored runs, and the call as it is stepped.
    #[cfg(feature = "page")]
    #[arg(long, conflicts_with = "script")]
    page: bool,
    /// The port of the page; any that is free when left out.
    #[cfg(feature = "page")]
    #[arg(long, value_name = "PORT", default_value_t = 0, requires = "page")]
    port: u16,
    /// Take the words from this file instead of the terminal.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Where answers are kept; `answers.jsonl` in the folder of runs when left out.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
}

/// How often a wish to stop is looked for while a word is waited for.
const LOOK: Duration = Duration::from_millis(50);

/// `trueup teach FILE|CALL|RUN`.
pub(super) fn teach(args: &TeachArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let answers = args.answers.clone().unwrap_or_else(|| cli.cell.record.join(answers::FILE));
    let what = args.what.as_deref().unwrap_or_default();
    #[cfg(feature = "page")]
    if args.page {
        let root = cli.cell.record.clone();
        let at = page::Where { port: args.port, answers, root };
        return page::teach(what, at, cli, style);
    }
    let input = match &args.script {
        Some(file) => Input::Script(lines_of(&read(file)?)),
        None => Input::here()?,
    };
    let setup = Setup { teaches: true, steps: true, answers: Some(answers), ..Setup::default() };
    let lead =
        Lead { input: Arc::new(Mutex::new(input)), setup, record: cli.cell.record.clone(), style };
    let path = Path::new(what);
    if path.is_file() {
        return script_led(path, Some(&lead), false, cli, style);
    }
    match kept::folder(&cli.cell.record, path) {
        Ok(dir) => over_record(&dir, &lead, cli, style),
        Err(failure) if names_a_run(what) => Err(failure),
        // It says that there is none.
        Err(_) if names_a_file(what) => script_led(path, Some(&lead), false, cli, style),
        Err(_) => line_led(what, Some(&lead), false, cli, style),
    }
}

/// Whether words can only be the number or the name of a run: no step begins with a digit.
fn names_a_run(what: &str) -> bool {
    what.starts_with(|c: char| c.is_ascii_digit())
}

/// Whether words can only be the path of a file: no call, and with what stands in paths.
fn names_a_file(what: &str) -> bool {
    !what.contains(['(', ' ']) && what.contains(['.', '/', '\\'])
}

/// Steps through a run that is over; no arm is asked for.
fn over_record(dir: &Path, lead: &Lead, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    let run = archive::load(dir).map_err(|error| report::cell_failure(&error, style))?;
    if run.steps.is_empty() {
        return Err(Failure::no("teach::empty", format!("{} executed no step", run.task))
            .at(dir.display().to_string())
            .help("step through another run, or through a call"));
    }
    let library = workcell::library(&super::cell::stdlib(cli)?);
    style.say(format!(
        "{}: {} with {}, seed {}; this is the record, the arm does not move",
        dir.display(),
        run.task,
        run.robot,
        run.seed
    ));
    let teller = lead.teller(&run.task, library, Cancel::default());
    let mut stepper = Stepper::new(teller, lead.setup.clone());
    stepper.over_record(&run.task, Some(dir), &record::steps(&run.steps, &run.parse_graphs));
    Ok(Exit::Yes)
}

/// Whoever leads the runs of a command.
pub(super) struct Lead {
    input: Arc<Mutex<Input>>,
    setup: Setup,
    /// The folder of earlier runs.
    record: PathBuf,
    style: Style,
}

impl Lead {
    /// Steps without teaching: no questions, and steps are told of as in any run.
    pub(super) fn stepping(cli: &Shared, style: Style) -> Result<Self, Failure> {
        Ok(Self {
            input: Arc::new(Mutex::new(Input::here()?)),
            setup: Setup { steps: true, stops: Stops::default(), ..Setup::default() },
            record: cli.cell.record.clone(),
            style,
        })
    }

    /// Leads the next run of a cell.
    pub(super) fn take(&self, cell: &mut WorkCell) {
        let teller = self.teller("", cell.library().clone(), cell.cancel());
        let setup = Setup { dial: Some(cell.dial()), ..self.setup.clone() };
        cell.led_by(Box::new(Stepper::new(teller, setup)));
    }

    fn teller(
        &self,
        task: &str,
        library: Library,
        cancel: Cancel,
    ) -> Teller<impl FnMut(&str) -> Option<String> + Send + use<>> {
        let place: Place = Box::new(move |name| {
            let (fluent, source) = library.fluent(name)?;
            Some(source.place(fluent.name.span))
        });
        let (root, task) = (self.record.clone(), task.to_owned());
        let earlier: Earlier = Box::new(move || earlier(&root, &task));
        let (input, style) = (self.input.clone(), self.style);
        Teller::new(style, place, earlier, move |prompt| {
            let mut input = input.lock().unwrap_or_else(PoisonError::into_inner);
            input.next(prompt, &cancel, style)
        })
    }
}

/// Runs of the same task that are kept, the oldest first; none when the task is not known.
fn earlier(root: &Path, task: &str) -> Vec<(usize, Run)> {
    let head = |task: &str| task.split('(').next().unwrap_or_default().to_owned();
    let entries = archive::entries(root).into_iter();
    entries
        .filter_map(|entry| Some((entry.number, entry.load().ok()?)))
        .filter(|(_, run)| head(&run.task) == head(task))
        .collect()
}

/// Where words come from.
enum Input {
    Script(VecDeque<String>),
    Terminal(Box<DefaultEditor>),
    Pipe(Receiver<String>),
}

/// Returns the words of a script: every line but empty ones and remarks.
fn lines_of(text: &str) -> VecDeque<String> {
    let lines = text.lines().map(str::trim);
    lines.filter(|line| !line.is_empty() && !line.starts_with("//")).map(str::to_owned).collect()
}

/// Forgets what was typed before a question or a pause was shown: only a new editor has nothing typed into it.
fn forget_typed(editor: &mut DefaultEditor) -> rustyline::Result<()> {
    let was_any = files::read::forget_typed();
    let history = std::mem::take(editor.history_mut());
    *editor = DefaultEditor::with_history(rustyline::Config::default(), history)?;
    if was_any {
        report::complain(
            "lines typed before this question are left out; only Ctrl-C stops the arm",
        );
    }
    Ok(())
}

impl Input {
    /// Returns the terminal, or the pipe that is in its place.
    fn here() -> Result<Self, Failure> {
        if std::io::stdin().is_terminal() {
            let editor = DefaultEditor::new().map_err(|error| {
                Failure::unavailable("terminal", format!("the terminal failed: {error}"))
            })?;
            return Ok(Self::Terminal(Box::new(editor)));
        }
        let (send, lines) = channel();
        // A pipe cannot be waited for and looked away from at once; a thread of its own waits.
        std::thread::spawn(move || {
            let mut input = std::io::stdin().lock();
            while let Ok(line) = files::read::line(&mut input) {
                let typed = line.trim_end_matches(['\n', '\r']).to_owned();
                if line.is_empty() || send.send(typed).is_err() {
                    break;
                }
            }
        });
        Ok(Self::Pipe(lines))
    }

    /// Returns the next line; `None` at the end of all, and when somebody wants to stop.
    fn next(&mut self, prompt: &str, cancel: &Cancel, style: Style) -> Option<String> {
        if cancel.is_cancelled() {
            return None;
        }
        let line = match self {
            Self::Script(lines) => lines.pop_front()?,
            Self::Terminal(editor) => {
                forget_typed(editor).ok()?;
                let line = editor.readline(prompt).ok()?;
                if !line.trim().is_empty() {
                    let _ = editor.add_history_entry(&line);
                }
                return Some(line);
            }
            Self::Pipe(lines) => loop {
                if cancel.is_cancelled() {
                    return None;
                }
                match lines.recv_timeout(LOOK) {
                    Ok(line) => break line,
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return None,
                }
            },
        };
        // Where nobody typed, what was said stands beside what it was said to.
        style.say(format!("{prompt}{line}"));
        Some(line)
    }
}
