//! A person's wish that a look ends before it is over: asked between its parts, and remembered.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether somebody wants it to end.
pub type Asks<'a> = &'a (dyn Fn() -> bool + Sync);

/// The wish that a look ends.
#[derive(Default)]
pub(super) struct Stop<'a> {
    asks: Option<Asks<'a>>,
    /// Whether it was there once. What was left out since is not there when the wish is forgotten.
    was: AtomicBool,
}

impl<'a> Stop<'a> {
    /// A wish that is there as soon as `asks` says so.
    pub(super) fn when(asks: Asks<'a>) -> Self {
        Self { asks: Some(asks), was: AtomicBool::new(false) }
    }

    /// Whether somebody has wanted it to end.
    pub(super) fn is_asked(&self) -> bool {
        let is_asked = self.was.load(Ordering::Relaxed) || self.asks.is_some_and(|asks| asks());
        if is_asked {
            self.was.store(true, Ordering::Relaxed);
        }
        is_asked
    }
}

impl fmt::Debug for Stop<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stop").field("was", &self.was).finish_non_exhaustive()
    }
}
