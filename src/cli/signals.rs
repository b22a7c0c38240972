//! Ctrl-C, and what else asks a program to end: the arm is stopped first, and asked twice the program ends at
//! once.
//!
//! A system that ends programs sends SIGTERM, a terminal that is closed SIGHUP; both do what Ctrl-C does, and
//! also end the prompt, which Ctrl-C does not. Whoever was told not to mind a closed terminal (`nohup`) does
//! not. A file that has reached a limit on its size is told by the write that fails, and ends nothing.

#[cfg(unix)]
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::arm::Cancel;
use crate::repl::Leave;
use crate::report::{Failure, complain};
use crate::workcell::WorkCell;

use crate::report::exit::Exit;

/// The wishes to stop of every cell that was opened, and of whatever else waits.
static STOPS: Mutex<Vec<Cancel>> = Mutex::new(Vec::new());
/// How often somebody asked to stop since the work began.
pub(super) static PRESSES: AtomicUsize = AtomicUsize::new(0);
/// Whether signals are watched already.
static IS_WATCHED: AtomicBool = AtomicBool::new(false);
/// Whether Ctrl-C is the prompt's own affair: it takes the prompt back instead of ending the program.
static AT_PROMPT: AtomicBool = AtomicBool::new(false);
/// Whether a cell was opened.
static HAS_ARM: AtomicBool = AtomicBool::new(false);
/// How the terminal was set before the prompt took it.
#[cfg(unix)]
static TERMINAL: OnceLock<rustix::termios::Termios> = OnceLock::new();
/// What the prompt knows of a wish that it ends.
pub(super) static LEAVE: Leave = Leave::new();

/// Makes Ctrl-C, and a wish that the program ends, a wish to stop that this cell obeys too.
pub(super) fn stop_on_interrupt(cell: &WorkCell) -> Result<(), Failure> {
    HAS_ARM.store(true, Ordering::SeqCst);
    stop(cell.cancel())
}

/// Makes Ctrl-C, and a wish that the program ends, this wish to stop; the process goes on.
pub(super) fn stop(cancel: Cancel) -> Result<(), Failure> {
    obey(cancel);
    watch_interrupt()
}

/// Adds a wish to stop to those that are obeyed.
pub(super) fn obey(cancel: Cancel) {
    STOPS.lock().unwrap_or_else(PoisonError::into_inner).push(cancel);
}

/// Leaves Ctrl-C to the prompt, and keeps how the terminal is set, which the prompt changes.
pub(super) fn at_prompt() {
    #[cfg(unix)]
    if let Ok(found) = rustix::termios::tcgetattr(std::io::stdin()) {
        let _ = TERMINAL.set(found);
    }
    AT_PROMPT.store(true, Ordering::SeqCst);
}

/// Makes a write beyond a limit on the size of files an error like any other: the signal that comes with it would end
/// the program at once, with the arm on its way. Where it cannot be watched it stays as it was.
#[cfg(unix)]
pub(super) fn outlive_limits() {
    let seen = std::sync::Arc::new(AtomicBool::new(false));
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, seen);
}

#[cfg(not(unix))]
pub(super) fn outlive_limits() {}

/// Returns whether an arm may have been moving.
pub(super) fn has_arm() -> bool {
    HAS_ARM.load(Ordering::SeqCst)
}

/// Returns whether somebody asked to stop.
pub(super) fn is_interrupted() -> bool {
    PRESSES.load(Ordering::SeqCst) > 0
}

/// Forgets that somebody asked: what was asked to stop has stopped.
#[cfg(feature = "kortex")]
pub(super) fn forget() {
    PRESSES.store(0, Ordering::SeqCst);
}

/// Makes Ctrl-C and its like a wish to stop; the process goes on.
pub(super) fn watch_interrupt() -> Result<(), Failure> {
    if IS_WATCHED.swap(true, Ordering::SeqCst) {
        return Ok(());
    }
    let unwatched = |error: String| Failure::unavailable("signal", error);
    ctrlc::set_handler(|| asked(false))
        .map_err(|error| unwatched(format!("cannot watch Ctrl-C: {error}")))?;
    watch_ends().map_err(|error| unwatched(format!("cannot watch SIGTERM: {error}")))
}

#[cfg(unix)]
fn watch_ends() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    let watched = if minds_hangup() { vec![SIGTERM, SIGHUP] } else { vec![SIGTERM] };
    let mut signals = signal_hook::iterator::Signals::new(watched)?;
    let watch = std::thread::Builder::new().name("signals".into());
    watch.spawn(move || signals.forever().for_each(|_| asked(true))).map(|_| ())
}

#[cfg(not(unix))]
fn watch_ends() -> std::io::Result<()> {
    Ok(())
}

/// Whether a closed terminal means anything to this process; where the system does not say so, it does.
#[cfg(unix)]
fn minds_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let hangup = 1 << (signal_hook::consts::SIGHUP - 1);
    ignored.is_none_or(|mask| mask & hangup == 0)
}

/// Stops everything, as somebody asked: with Ctrl-C, or the whole program to end.
fn asked(to_end: bool) {
    let before = PRESSES.fetch_add(1, Ordering::SeqCst);
    for cancel in STOPS.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        cancel.cancel();
    }
    let at_prompt = AT_PROMPT.load(Ordering::SeqCst);
    let is_again = (to_end && LEAVE.ask()) || (before > 0 && !at_prompt);
    // A prompt that waits for a line has nothing under way that would have to end first.
    if is_again || (to_end && at_prompt && LEAVE.is_idle()) {
        if is_again {
            complain("asked again: trueup ends at once");
        }
        #[cfg(unix)]
        give_back();
        std::process::exit(Exit::Stopped as i32);
    }
}

/// Sets the terminal as it was before the prompt took it: nobody else does when the program ends at once.
#[cfg(unix)]
fn give_back() {
    use std::io::Write as _;
    let Some(found) = TERMINAL.get() else { return };
    let _ =
        rustix::termios::tcsetattr(std::io::stdin(), rustix::termios::OptionalActions::Now, found);
    // What is pasted is no longer marked.
    let mut out = std::io::stdout();
    let _ = out.write_all(b"\x1b[?2004l\r\n").and_then(|()| out.flush());
}
