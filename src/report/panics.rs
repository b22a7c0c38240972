//! Mistakes of the program's own, in words: what, where in the program, and what to do about it.
//!
//! A panic says nothing by itself: whoever catches it says it, once, and what nobody caught, in a thread of
//! its own, is said when the program ends.

use std::any::Any;
use std::panic::{self, PanicHookInfo};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::Failure;

/// At most so many are kept: of a mistake that is made again and again the first says enough.
const MOST: usize = 20;

/// A panic.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Panic {
    said: String,
    place: String,
}

/// The panics that nobody has spoken of yet, the oldest first.
static SEEN: Mutex<Vec<Panic>> = Mutex::new(Vec::new());

fn seen() -> MutexGuard<'static, Vec<Panic>> {
    SEEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on panics are kept for whoever catches them, instead of being printed where they happen.
pub fn listen() {
    panic::set_hook(Box::new(|info: &PanicHookInfo<'_>| {
        let place = info
            .location()
            .map_or_else(String::new, |at| format!("{}:{}", inside(at.file()), at.line()));
        let mut seen = seen();
        if seen.len() < MOST {
            seen.push(Panic { said: said(info.payload()), place });
        }
    }));
}

/// Words a panic that was caught; `is_held` says that an arm was stopped for it.
pub fn caught(panic: &(dyn Any + Send), is_held: bool) -> Failure {
    let said = said(panic);
    // With several threads at work one mistake is made several times; the first is the cause.
    let first = std::mem::take(&mut *seen()).into_iter().next();
    words(&first.unwrap_or(Panic { said, place: String::new() }), is_held)
}

/// Words what panicked in a thread of its own, if anything did.
pub fn uncaught(is_held: bool) -> Option<Failure> {
    let first = std::mem::take(&mut *seen()).into_iter().next()?;
    Some(words(&first, is_held))
}

fn words(panic: &Panic, is_held: bool) -> Failure {
    let Panic { said, place } = panic;
    let held = if is_held { "; the arm was stopped and holds" } else { "" };
    let at = if place.is_empty() { String::new() } else { format!(" at {place}") };
    let failure = Failure::internal(format!("internal error: {said}{at}{held}"), is_held);
    let failure = if place.is_empty() { failure } else { failure.at(place.clone()) };
    failure.help(
        "this is a mistake in trueup, not in what you gave it; please report it with the command, its \
         files and this message",
    )
}

fn said(payload: &dyn Any) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "no reason was given".into())
}

/// Returns a file of the program without the folders of the machine it was built on.
fn inside(file: &str) -> &str {
    match file.rsplit_once("/registry/src/") {
        Some((_, rest)) => rest.split_once('/').map_or(rest, |(_, rest)| rest),
        None => file,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;
    use std::thread;

    #[test]
    fn a_place_does_not_name_the_machine() {
        let file = "/home/me/.cargo/registry/src/index.example-1/rapier3d-1.0/src/a.rs";
        assert_eq!(inside(file), "rapier3d-1.0/src/a.rs");
        assert_eq!(inside("src/motion/rrt.rs"), "src/motion/rrt.rs");
    }

    /// The hook is the whole process's, so it is tried in one of its own.
    #[test]
    fn panics_are_told_once_with_their_place_by_whoever_catches_them_or_at_the_end() {
        let own = std::env::current_exe().unwrap();
        let args = ["--exact", "report::panics::tests::in_a_process_of_its_own", "--ignored"];
        let done = Command::new(own).args(args).arg("--nocapture").output().unwrap();
        let (out, err) =
            (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
        assert!(done.status.success(), "{out}{err}");
        assert!(out.contains("1 passed"), "{out}{err}");
        assert!(!err.contains("panicked"), "{err}");
    }

    #[test]
    #[ignore = "sets the hook of its process; run by the test above"]
    fn in_a_process_of_its_own() {
        listen();
        let caught_one = panic::catch_unwind(|| {
            let list: Vec<u8> = Vec::new();
            list[std::hint::black_box(3)]
        });
        let failure = caught(caught_one.unwrap_err().as_ref(), true);
        assert!(failure.message.contains("index is 3"), "{}", failure.message);
        assert!(failure.message.contains("src/report/panics.rs:"), "{}", failure.message);
        assert!(failure.message.contains("the arm was stopped"), "{}", failure.message);
        assert_eq!((failure.code.as_str(), failure.exit()), ("internal::error", 3));
        assert!(uncaught(false).is_none(), "it was told");
        // A pool of threads hands the panic on; a thread by itself does not.
        let pool = panic::catch_unwind(|| rayon::join(|| (), || panic!("in the pool")));
        let failure = caught(pool.unwrap_err().as_ref(), false);
        assert!(failure.message.contains("in the pool"), "{}", failure.message);
        assert!(thread::spawn(|| panic!("by itself")).join().is_err());
        let failure = uncaught(false).unwrap();
        assert!(failure.message.contains("by itself"), "{}", failure.message);
        assert_eq!(failure.exit(), 2);
    }
}
