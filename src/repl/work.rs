//! Work that takes time is done beside the prompt: Ctrl-C once stops the arm in a controlled way, twice
//! brings the prompt back while the rest winds down.
//!
//! The cell goes to the thread that works and comes back from it, also when the work panicked; so names,
//! history and what was learnt survive. Source: issue threads on evcxr, elixir and vector, where an error
//! cost the user's variables.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{Builder, Scope};
use std::time::Duration;

use crate::report::{self, Failure, panics};
use crate::workcell::WorkCell;

/// How often the prompt looks whether Ctrl-C was pressed again.
const LOOK: Duration = Duration::from_millis(20);
/// Room for deep recursion in scripts and parsers, bytes.
const STACK: usize = 16 << 20;

/// Where the cell is.
enum Whereabouts {
    Here(Box<WorkCell>),
    /// With work that was asked to stop and has not come back yet.
    Away(Receiver<Box<WorkCell>>),
    /// Lost with a thread that could not even be begun.
    Lost,
}

/// The cell, and the threads that work with it.
pub(super) struct Bench<'scope, 'env> {
    cell: Whereabouts,
    scope: &'scope Scope<'scope, 'env>,
    presses: &'env AtomicUsize,
    /// What waits for a word before it goes on.
    paused: Option<String>,
}

impl<'scope, 'env> Bench<'scope, 'env> {
    /// Puts a cell on the bench; `presses` counts how often Ctrl-C was pressed.
    pub(super) fn new(
        cell: WorkCell,
        scope: &'scope Scope<'scope, 'env>,
        presses: &'env AtomicUsize,
    ) -> Self {
        Self { cell: Whereabouts::Here(Box::new(cell)), scope, presses, paused: None }
    }

    /// Whether nothing is done with the cell now.
    pub(super) fn is_here(&self) -> bool {
        self.paused.is_none() && matches!(self.cell, Whereabouts::Here(_))
    }

    /// Lends the cell.
    ///
    /// # Errors
    ///
    /// When earlier work is still winding down.
    pub(super) fn cell(&mut self) -> Result<&mut WorkCell, Failure> {
        if let Some(what) = &self.paused {
            let words = format!("{what} is being stepped through, and has the arm");
            return Err(Failure::input("repl::paused", words)
                .help("`continue` lets it go on, `quit` ends it; `help` lists the words"));
        }
        if let Whereabouts::Away(back) = &self.cell
            && let Ok(cell) = back.try_recv()
        {
            self.cell = Whereabouts::Here(cell);
        }
        match &mut self.cell {
            Whereabouts::Here(cell) => Ok(cell),
            Whereabouts::Away(_) => {
                Err(Failure::stopped("the last call is still being stopped; the arm holds")
                    .help("wait a moment and type it again"))
            }
            Whereabouts::Lost => Err(Failure::unavailable("repl::lost", "the cell is gone")
                .help("`:quit` and begin anew")),
        }
    }

    /// Puts another cell in place of this one and returns it.
    ///
    /// # Errors
    ///
    /// As [`Self::cell`].
    pub(super) fn exchange(&mut self, other: WorkCell) -> Result<WorkCell, Failure> {
        Ok(std::mem::replace(self.cell()?, other))
    }

    /// Does something with the cell, and waits for it unless Ctrl-C is pressed twice.
    ///
    /// # Errors
    ///
    /// What the work says; that it panicked; or that it is still winding down.
    pub(super) fn work<T: Send + 'scope>(
        &mut self,
        job: impl FnOnce(&mut WorkCell) -> Result<T, Failure> + Send + 'scope,
    ) -> Result<T, Failure> {
        let begun = self.begin(job)?;
        loop {
            if let Some(done) = self.wait(&begun) {
                return done;
            }
        }
    }

    /// Begins something with the cell; [`Self::wait`] says when it is done.
    ///
    /// # Errors
    ///
    /// As [`Self::cell`], or when no thread can be begun.
    pub(super) fn begin<T: Send + 'scope>(
        &mut self,
        job: impl FnOnce(&mut WorkCell) -> Result<T, Failure> + Send + 'scope,
    ) -> Result<Begun<T>, Failure> {
        // A wish to stop was about an earlier line.
        self.cell()?.cancel().clear();
        self.presses.store(0, Ordering::SeqCst);
        let Whereabouts::Here(mut cell) = std::mem::replace(&mut self.cell, Whereabouts::Lost)
        else {
            return Err(Failure::unavailable("repl::lost", "the cell is gone"));
        };
        let (give_back, back) = channel();
        let (tell, told) = channel();
        let worker = Builder::new().name("work".into()).stack_size(STACK);
        let begun = worker.spawn_scoped(self.scope, move || {
            let done = catch_unwind(AssertUnwindSafe(|| job(&mut cell)));
            if done.is_err() {
                cell.halt();
            }
            // Nobody waits any more when the prompt has been left.
            let _ = give_back.send(cell);
            let _ = tell.send(done);
        });
        if let Err(error) = begun {
            let words = format!("no thread can be begun: {error}");
            return Err(Failure::unavailable("repl::thread", words));
        }
        self.cell = Whereabouts::Away(back);
        Ok(Begun(told))
    }

    /// Waits a moment; `None` when the work goes on. Its errors are those of [`Self::work`].
    pub(super) fn wait<T>(&mut self, begun: &Begun<T>) -> Option<Result<T, Failure>> {
        match begun.0.recv_timeout(LOOK) {
            Ok(done) => {
                self.paused = None;
                let back = self.cell().map(|_| ());
                let done = done.unwrap_or_else(|panic| Err(panicked(panic.as_ref(), true)));
                return Some(back.and(done));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let lost = Failure::unavailable("repl::thread", "the work ended without a word");
                return Some(Err(lost));
            }
        }
        if self.presses.load(Ordering::SeqCst) >= 2 {
            report::run::hush();
            self.paused = None;
            return Some(Err(Failure::stopped("stopped twice; the arm holds its position")
                .help("what was going on winds down beside the prompt")));
        }
        None
    }

    /// Says that the work waits for a word, and about what; `None` when it goes on.
    pub(super) fn pause(&mut self, what: Option<String>) {
        self.paused = what;
    }
}

/// What a job that was begun came to, once it is done.
pub(super) struct Begun<T>(Receiver<std::thread::Result<Result<T, Failure>>>);

/// Words a panic: the line is lost, nothing else; `is_held` says that the arm was stopped for it.
pub(super) fn panicked(panic: &(dyn Any + Send), is_held: bool) -> Failure {
    let failure = panics::caught(panic, is_held);
    let help = failure.help.clone().unwrap_or_default();
    failure.help(format!("the line was given up; names and runs are kept. {help}"))
}
