//! The prompt: lines in, calls carried out, answers out; a thin loop over a [`WorkCell`].
//!
//! Completion and hints read a cached scene and library only and never touch a device. Ctrl-C while the
//! arm moves stops it and comes back to the prompt; at the prompt it clears the line. Piped input works.

mod complete;

use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;

use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::{Config, Editor};

use crate::graph::outline;
use crate::language::ast::{Call, Step};
use crate::language::{self, Diagnostic, Source};
use crate::report::{self, Failure, Style};
use crate::workcell::{Run, WorkCell};
use complete::Helper;

/// What the prompt can have done for it.
#[derive(Clone, Copy)]
pub struct Hands<'a> {
    /// Carries out one step typed at the prompt.
    pub perform: &'a dyn Fn(&mut WorkCell, &Step) -> Result<Run, Failure>,
    /// Says what the twin lacks by the runs in these folders.
    pub gap: &'a dyn Fn(&[PathBuf]) -> Result<(), Failure>,
}

/// What the prompt remembers between lines.
struct Session<'a> {
    cell: WorkCell,
    style: Style,
    hands: Hands<'a>,
    last: Option<Last>,
    /// Folders of the runs of this session, the oldest first.
    runs: Vec<PathBuf>,
}

/// What came of the last call.
enum Last {
    /// It was carried out, well or not.
    Run(Box<Run>),
    /// Nothing was done, and why.
    Failure(Failure),
}

/// Whether the loop goes on.
enum Next {
    Prompt,
    Quit,
}

const HELP: &str = "\
type a call:   pour(jar, cup)      pick(jar)      Tab completes, Up recalls
:help          this page           ?pour          what a task needs and gives
:objects       what is on the table and where
:tasks         what can be called
:graph CALL    the And-Or graph of a call
:align         fit the three regressions anew
:look          photograph the table again
:why           why the last run went as it did
:gap [N]       what the twin lacks, by the last N runs (all of this session)
:quit          leave               Ctrl-C         stops the arm, keeps the prompt";

/// Runs the prompt until `:quit` or the end of input.
///
/// # Errors
///
/// Only when the terminal itself fails; everything else is told and the prompt comes back.
pub fn run(cell: WorkCell, style: Style, hands: Hands<'_>) -> Result<(), Failure> {
    let mut session = Session { cell, style, hands, last: None, runs: Vec::new() };
    if std::io::stdin().is_terminal() { session.terminal() } else { session.piped() }
}

impl Session<'_> {
    fn terminal(&mut self) -> Result<(), Failure> {
        let broken = |error: ReadlineError| {
            Failure::unavailable("terminal", format!("the terminal failed: {error}"))
        };
        let config = Config::builder().auto_add_history(true).max_history_size(2000);
        let config = config.map_err(broken)?.build();
        let mut editor: Editor<Helper, DefaultHistory> =
            Editor::with_config(config).map_err(broken)?;
        editor.set_helper(Some(Helper::new(&self.cell, self.style)));
        let history = history_file();
        if let Some(path) = &history {
            // A missing history is an empty one.
            let _ = editor.load_history(path);
        }
        self.style.say(self.greeting());
        loop {
            match editor.readline(&self.prompt()) {
                Ok(line) => {
                    if let Next::Quit = self.line(&line) {
                        break;
                    }
                }
                Err(ReadlineError::Interrupted) => {
                    self.style.say("the arm holds still; :quit or Ctrl-D leaves");
                }
                Err(ReadlineError::Eof) => break,
                Err(error) => return Err(broken(error)),
            }
        }
        if let Some(path) = &history {
            let _ = editor.save_history(path);
        }
        Ok(())
    }

    /// Reads statements from a pipe, each as many lines as it needs.
    fn piped(&mut self) -> Result<(), Failure> {
        let mut statement = String::new();
        for line in std::io::stdin().lock().lines() {
            let line = line.map_err(|error| {
                Failure::input("io::read", format!("cannot read input: {error}"))
            })?;
            statement += &line;
            statement.push('\n');
            if !statement.starts_with(':') && language::is_incomplete(&statement) {
                continue;
            }
            let whole = std::mem::take(&mut statement);
            if let Next::Quit = self.line(&whole) {
                return Ok(());
            }
        }
        if !statement.trim().is_empty() {
            self.line(&statement);
        }
        Ok(())
    }

    fn greeting(&self) -> String {
        let scene = self.cell.scene();
        let objects: Vec<String> =
            scene.objects.iter().map(|o| format!("{} ({})", o.name, o.looks)).collect();
        format!(
            "arm {}: ready   scene {}\nobjects  {}\n:help   ?pour   Tab completes   Ctrl-C stops the arm\n",
            self.cell.robot_name(),
            scene.name,
            objects.join("   ")
        )
    }

    fn prompt(&self) -> String {
        format!("{}> ", self.cell.robot_name())
    }

    fn line(&mut self, line: &str) -> Next {
        let line = line.trim();
        // A pasted transcript keeps its prompts.
        let line = line.strip_prefix(self.prompt().trim_end()).map_or(line, str::trim);
        if line.is_empty() || line.starts_with("//") {
            return Next::Prompt;
        }
        // A wish to stop was about an earlier line.
        self.cell.cancel().clear();
        if let Some(name) = line.strip_prefix('?') {
            self.tell_about(name.trim());
        } else if let Some(command) = line.strip_prefix(':') {
            return self.command(command);
        } else if let Some(step) = self.read(line) {
            match (self.hands.perform)(&mut self.cell, &step) {
                Ok(run) => {
                    self.runs.extend(run.run_dir.as_ref().map(PathBuf::from));
                    self.last = Some(Last::Run(Box::new(run)));
                }
                Err(failure) => {
                    self.style.failure(&failure);
                    self.last = Some(Last::Failure(failure));
                }
            }
        }
        Next::Prompt
    }

    /// Reads and checks a line; tells everything that is wrong with it.
    fn read(&self, line: &str) -> Option<Step> {
        let source = Source::new("prompt", line);
        let (step, mut wrong) = language::parse_line(line);
        if let Some(step) = step.as_ref().filter(|_| wrong.is_empty()) {
            wrong = self.cell.check_line(step, &source);
        }
        for diagnostic in &wrong {
            report::complain(report::diagnostic(diagnostic, &source, self.style).trim_end());
        }
        step.filter(|_| !wrong.iter().any(Diagnostic::is_error))
    }

    fn command(&mut self, command: &str) -> Next {
        let (word, rest) = command.split_once(char::is_whitespace).unwrap_or((command, ""));
        match word {
            "quit" | "q" | "exit" => return Next::Quit,
            "help" | "h" => self.style.say(HELP),
            "objects" => self.objects(),
            "tasks" => self.tasks(),
            "graph" => self.graph(rest.trim()),
            "align" => {
                let done = self.cell.align();
                self.told(done, "aligned");
            }
            "look" => {
                let done = self.cell.perceive();
                self.told(done, "looked");
                self.objects();
            }
            "why" => self.why(),
            "gap" => self.gap(rest.trim()),
            other => {
                let failure = Failure::input("repl::command", format!("there is no `:{other}`"));
                let known =
                    ["help", "objects", "tasks", "graph", "align", "look", "why", "gap", "quit"];
                let failure = match language::nearest(other, known.into_iter()) {
                    Some(near) => failure.help(format!("did you mean `:{near}`?")),
                    None => failure.help("`:help` lists the commands"),
                };
                self.style.failure(&failure);
            }
        }
        Next::Prompt
    }

    fn gap(&self, last: &str) {
        let n = if last.is_empty() { Ok(self.runs.len()) } else { last.parse::<usize>() };
        let asked = match n {
            Err(_) | Ok(0) if !last.is_empty() => {
                Err(Failure::input("repl::gap", format!("`{last}` is not a number of runs"))
                    .help("`:gap 2` takes the last two runs, `:gap` all of this session"))
            }
            _ if self.runs.is_empty() => Err(Failure::input("repl::gap", "nothing has run yet")
                .help("`trueup gap RUN...` takes folders of earlier runs")),
            Err(_) => Ok(self.runs.len()),
            Ok(n) => Ok(n),
        };
        let told = asked.and_then(|n| {
            let first = self.runs.len().saturating_sub(n);
            (self.hands.gap)(&self.runs[first..])
        });
        if let Err(failure) = told {
            self.style.failure(&failure);
        }
    }

    fn told(&self, done: Result<(), crate::workcell::Error>, word: &str) {
        match done {
            Ok(()) => self.style.say(word),
            Err(error) => self.style.failure(&report::cell_failure(&error, self.style)),
        }
    }

    fn objects(&self) {
        match self.cell.state() {
            Ok(state) => self.style.say(report::objects(self.cell.scene(), &state)),
            Err(error) => self.style.failure(&report::cell_failure(&error, self.style)),
        }
    }

    fn tasks(&self) {
        for (task, _) in self.cell.library().tasks() {
            self.style.say(report::signature(&task.name.text, &task.params, &task.doc));
        }
    }

    fn graph(&self, call: &str) {
        if call.is_empty() {
            let failure = Failure::input("repl::graph", "`:graph` takes a call");
            return self.style.failure(&failure.help("type one, such as `:graph pour(jar, cup)`"));
        }
        let Some(Step::Act(act)) = self.read(call) else { return };
        let call: &Call = &act.call;
        match self.cell.graph(call) {
            Ok(graph) => {
                let learnt = outline::Learnt::default();
                self.style.say(outline::outline(&graph, &learnt).trim_end());
            }
            Err(error) => self.style.failure(&report::cell_failure(&error, self.style)),
        }
    }

    fn tell_about(&self, name: &str) {
        let library = self.cell.library();
        if let Some(text) = report::documentation(library, name) {
            return self.style.say(text);
        }
        let tasks = library.tasks().map(|(task, _)| task.name.text.as_str());
        let actions = library.actions().map(|(action, _)| action.name.text.as_str());
        let fluents = library.fluents().map(|(fluent, _)| fluent.name.text.as_str());
        let failure = match name {
            "" => Failure::input("repl::unknown", "`?` takes a name, such as `?pour`"),
            name => Failure::input("repl::unknown", format!("nothing here is called `{name}`")),
        };
        let near = language::nearest(name, tasks.chain(actions).chain(fluents));
        self.style.failure(&match near {
            Some(near) => failure.help(format!("did you mean `?{near}`?")),
            None => failure.help("`:tasks` lists what can be called"),
        });
    }

    fn why(&self) {
        match &self.last {
            Some(Last::Run(run)) => self.style.say(report::run::why(run)),
            Some(Last::Failure(failure)) => self.style.failure(failure),
            None => self.style.say("nothing has run yet"),
        }
    }
}

fn history_file() -> Option<PathBuf> {
    let home = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/state")))?;
    let dir = home.join("trueup");
    std::fs::create_dir_all(&dir).ok()?;
    Some(dir.join("history"))
}
