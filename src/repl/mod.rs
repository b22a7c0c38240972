//! The prompt: lines in, calls carried out, answers out; a thin loop over a [`WorkCell`].
//!
//! Completion and hints read a cached scene and library only and never touch a device. Ctrl-C while the
//! arm moves stops it and comes back to the prompt; pressed again, the prompt comes back at once. Names,
//! history and runs survive errors, interrupts and panics. Piped input works, so transcripts are tests.

mod asking;
mod calc;
mod commands;
mod complete;
mod edits;
mod lease;
mod paint;
mod paste;
mod phrases;
mod quiz;
mod table;
mod records;
mod saved;
mod sentences;
mod statement;
mod step;
mod line_source;
mod values;
mod work;

use std::cell::Cell;
use std::io::{BufRead, IsTerminal};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Scope;

use crate::language::ast::Step;
use crate::language::{self, Library};
use crate::report::exit::Exit;
use crate::report::{self, Failure, Style};
use crate::teach::stops::Stops;
use crate::workcell::{Run, Stdlib, WorkCell};
use calc::Calculator;
use complete::Helper;
use line_source::{LineSource, Pipe, Terminal, Typed};
use phrases::Taught;
use saved::Made;
use sentences::{Confirm, Pending};
use values::Values;
use work::Bench;

pub use edits::Edits;

/// Proposes a call for a sentence that no template fits, by the texts and a scene's name; `None` when there
/// is no call for it.
pub type Propose = dyn Fn(&str, &Library, &str) -> Result<Option<String>, Failure> + Sync;

/// What the prompt can have done for it.
#[derive(Clone, Copy)]
pub struct Hands<'a> {
    /// Carries out one step typed at the prompt.
    pub perform: &'a (dyn Fn(&mut WorkCell, &Step) -> Result<Run, Failure> + Sync),
    /// Asks a model what a sentence means, when one was named.
    pub propose: Option<&'a Propose>,
    /// Says what the twin lacks by the runs in these folders.
    pub gap: &'a (dyn Fn(&[PathBuf]) -> Result<(), Failure> + Sync),
    /// How things are done: topics, each with what there is to tell.
    pub topics: &'a [(&'a str, String)],
    /// Opens the cell of a robot, `twin` or the one that is meant by `real`, whose chance comes from this number.
    pub open: &'a (dyn Fn(&str, u64) -> Result<WorkCell, Failure> + Sync),
    /// The robot that `:real` means.
    pub real: &'a str,
    /// Where run folders are.
    pub record: &'a Path,
    /// Where history and phrases are kept, if anywhere.
    pub home: Option<&'a Path>,
    /// How often Ctrl-C was pressed since the work began.
    pub presses: &'a AtomicUsize,
    /// Whether the prompt is to be left.
    pub leave: &'a Leave,
    /// Whether nothing is asked before it is done: `--yes`.
    pub is_sure: bool,
}

/// A wish that the prompt is left, from outside of it.
#[derive(Debug, Default)]
pub struct Leave {
    is_asked: AtomicBool,
    is_idle: AtomicBool,
}

impl Leave {
    /// Nobody has asked.
    pub const fn new() -> Self {
        Self { is_asked: AtomicBool::new(false), is_idle: AtomicBool::new(false) }
    }

    /// Asks; returns whether it was asked before.
    pub fn ask(&self) -> bool {
        self.is_asked.swap(true, Ordering::SeqCst)
    }

    /// Returns whether somebody asked.
    pub fn is_asked(&self) -> bool {
        self.is_asked.load(Ordering::SeqCst)
    }

    /// Returns whether the prompt waits for a line, and nothing is under way.
    pub fn is_idle(&self) -> bool {
        self.is_idle.load(Ordering::SeqCst)
    }
}

/// What the prompt remembers between lines.
struct Session<'scope, 'env> {
    bench: Bench<'scope, 'env>,
    /// The robot that lines are for: `lab`, `twin`.
    robot: String,
    /// The cell of the other robot, after `:twin`.
    aside: Option<WorkCell>,
    /// The texts, for what needs no device.
    library: Library,
    stdlib: Stdlib,
    scope: language::Scope,
    style: Style,
    hands: Hands<'env>,
    last: Option<Box<Run>>,
    /// Why the last call was not carried out, if it was not.
    refused: Option<Failure>,
    /// Folders of the runs of this session, the oldest first.
    runs: Vec<PathBuf>,
    /// The calls that were begun, in their order.
    made: Vec<Made>,
    values: Values,
    calculator: Calculator,
    confirm: Confirm,
    pending: Option<Pending>,
    taught: Taught,
    /// Where lines come from.
    lines: Box<dyn LineSource + 'env>,
    /// Breakpoints.
    stops: Stops,
    /// The step of the last run that is looked at.
    looking: Option<usize>,
    /// What was changed in files, to be undone.
    edits: Edits,
    /// A line that came while a run was being stopped: it is the prompt's.
    held_back: Option<String>,
    clock: fn() -> f64,
    /// Whether it was said what stops the arm.
    is_told_to_stop: bool,
    /// When something was typed last, s of that clock.
    last_word: f64,
    /// The worst that came of a line: what a pipe ends with.
    worst: Cell<u8>,
}

/// Whether the loop goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    Prompt,
    Quit,
}

/// Runs the prompt on the terminal, or on piped input, until `:quit` or the end of input; returns the worst exit code
/// of what was piped in, and that all is well for a person.
///
/// # Errors
///
/// Only when the terminal itself fails; everything else is told and the prompt comes back.
pub fn run(cell: WorkCell, style: Style, hands: Hands<'_>) -> Result<u8, Failure> {
    if !std::io::stdin().is_terminal() {
        return run_on(cell, style, hands, &mut std::io::stdin().lock());
    }
    let library = cell.library().clone();
    let scope = library.scope(&cell.scene().name);
    let helper = Helper::new(library, scope, style);
    let terminal = Terminal::new(helper, hands.home.map(|home| home.join("history")))?;
    talk(cell, style, hands, Box::new(terminal)).map(|_| Exit::Yes as u8)
}

/// Runs the prompt on lines that come from anywhere, without a terminal; returns the worst exit code of them.
///
/// # Errors
///
/// Only when the lines cannot be read.
pub fn run_on<'a>(
    cell: WorkCell,
    style: Style,
    hands: Hands<'a>,
    input: &'a mut dyn BufRead,
) -> Result<u8, Failure> {
    talk(cell, style, hands, Box::new(Pipe::new(input)))
}

/// The lines were over before a question was answered.
fn unanswered(pending: &Pending) -> Failure {
    let failure =
        Failure::input("repl::unanswered", "the input ended before the question was answered");
    match pending {
        // No `--yes` says which.
        Pending::Which(_) => {
            failure.help("answer with a number on the next line, or write the call itself")
        }
        Pending::Real => failure.help("answer `yes` on the next line"),
        Pending::Run(..) => {
            failure.help("answer `y` on the next line, give `--yes`, or write the call itself")
        }
    }
}

fn talk<'a>(
    cell: WorkCell,
    style: Style,
    hands: Hands<'a>,
    lines: Box<dyn LineSource + 'a>,
) -> Result<u8, Failure> {
    std::thread::scope(|scope| Session::new(cell, style, hands, lines, scope).talk())
}

impl<'scope, 'env> Session<'scope, 'env> {
    fn new(
        cell: WorkCell,
        style: Style,
        hands: Hands<'env>,
        lines: Box<dyn LineSource + 'env>,
        scope: &'scope Scope<'scope, 'env>,
    ) -> Self {
        let library = cell.library().clone();
        let clock = cell.clock();
        Self {
            robot: cell.robot_name().to_owned(),
            aside: None,
            scope: library.scope(&cell.scene().name),
            library,
            stdlib: cell.stdlib().clone(),
            bench: Bench::new(cell, scope, hands.presses),
            style,
            hands,
            last: None,
            refused: None,
            runs: Vec::new(),
            made: Vec::new(),
            values: Values::default(),
            calculator: Calculator::new(|| false),
            confirm: if hands.is_sure { Confirm::None } else { Confirm::default() },
            pending: None,
            taught: Taught::read(hands.home, style),
            lines,
            stops: Stops::default(),
            looking: None,
            edits: Edits::new(hands.home),
            held_back: None,
            is_told_to_stop: false,
            clock,
            last_word: clock(),
            worst: Cell::new(Exit::Yes as u8),
        }
    }

    /// Tells a failure, and remembers that there was one.
    fn fail(&self, failure: &Failure) {
        self.style.failure(failure);
        self.worsen(failure.exit());
    }

    fn worsen(&self, exit: u8) {
        self.worst.set(self.worst.get().max(exit));
    }

    /// Waits for what is typed; it is over as well once somebody asked the program to end.
    fn typed(&mut self, prompt: &str) -> Result<Typed, Failure> {
        // While a run waits for a word it has to end first; otherwise whoever asks now sees that nothing is under way,
        // or is seen here.
        self.hands.leave.is_idle.store(self.bench.is_here(), Ordering::SeqCst);
        let typed =
            if self.hands.leave.is_asked() { Ok(Typed::End) } else { self.lines.next(prompt) };
        self.hands.leave.is_idle.store(false, Ordering::SeqCst);
        typed
    }

    /// Takes statements until there are none, or one that leaves; returns the worst exit code of them.
    fn talk(&mut self) -> Result<u8, Failure> {
        if self.lines.is_person() {
            self.style.say(self.greeting());
        }
        loop {
            let typed = if let Some(line) = self.held_back.take() {
                Typed::Statement(line)
            } else {
                self.typed(&self.prompt())?
            };
            match typed {
                Typed::Statement(statement) => {
                    let next = self.survive(&statement);
                    self.mind_presses();
                    if next == Next::Quit {
                        return Ok(self.worst.get());
                    }
                }
                Typed::Interrupted => {
                    self.pending = None;
                    self.style.say("the arm holds still; :quit or Ctrl-D leaves");
                }
                Typed::End => {
                    if let Some(pending) = &self.pending {
                        self.fail(&unanswered(pending));
                    }
                    return Ok(self.worst.get());
                }
            }
        }
    }

    fn greeting(&mut self) -> String {
        let (library, scope) = (&self.library, &self.scope);
        let things = library.scene(library.default_scene()).map(|(scene, _)| scene);
        let things = things.map(language::sentence::things).unwrap_or_default();
        let objects = things.iter().filter(|thing| scope.objects.contains_key(&thing.name));
        let objects: Vec<String> = objects
            .map(|thing| {
                if thing.looks.is_empty() {
                    thing.name.clone()
                } else {
                    format!("{} ({})", thing.name, thing.looks)
                }
            })
            .collect();
        format!(
            "arm {}: ready\nobjects  {}\n:help   ?pour   Tab completes   Ctrl-C stops the arm\n",
            self.robot,
            objects.join("   ")
        )
    }

    fn prompt(&self) -> String {
        match self.pending {
            Some(_) => "y/n> ".to_owned(),
            None => format!("{}> ", self.robot),
        }
    }

    /// Forgets what was typed ahead of a Ctrl-C, and that one, unless what it was to stop still winds down.
    fn mind_presses(&mut self) {
        if self.hands.presses.load(Ordering::SeqCst) > 0 {
            self.lines.forget();
            if self.bench.is_here() {
                self.hands.presses.store(0, Ordering::SeqCst);
            }
        }
    }

    /// Forgets what was typed before a question is shown: it is no answer to it.
    fn forget_typed(&mut self) {
        if self.lines.forget() {
            report::complain(
                "lines typed before this question are left out; only Ctrl-C stops the arm",
            );
        }
    }

    /// Puts a question; only what is typed from now on answers it.
    fn put(&mut self, question: impl AsRef<str>, pending: Pending) {
        self.forget_typed();
        self.style.say(question);
        self.pending = Some(pending);
    }

    /// Does one statement. A panic costs that statement and nothing else.
    fn survive(&mut self, statement: &str) -> Next {
        let done = catch_unwind(AssertUnwindSafe(|| self.line(statement)));
        self.last_word = (self.clock)();
        done.unwrap_or_else(|panic| {
            self.fail(&work::panicked(panic.as_ref(), false));
            Next::Prompt
        })
    }
}
