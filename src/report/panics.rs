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

/// Words what panicked in a thread of its own, if anything did; no arm was stopped for it.
pub fn uncaught() -> Option<Failure> {
    let first = std::mem::take(&mut *seen()).into_iter().next()?;
    Some(words(&first, false))
}

fn words(panic: &Panic, is_held: bool) -> Failure {
    let Panic { said, place } = panic;
    let held = if is_held { "; the arm was stopped and holds" } else { "" };
    let failure = Failure::internal(format!("internal error: {said}{held}"), is_held);
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

    #[test]
    fn a_place_does_not_name_the_machine() {
        let file = "/home/me/.cargo/registry/src/index.example-1/rapier3d-1.0/src/a.rs";
        assert_eq!(inside(file), "rapier3d-1.0/src/a.rs");
        assert_eq!(inside("src/motion/rrt.rs"), "src/motion/rrt.rs");
    }
}
