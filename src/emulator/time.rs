//! The emulated arm's own time, which others can wait on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::kortex::clock::Clock;

/// The arm's clock: it runs with the arm, not with the wall.
#[derive(Debug, Clone, Default)]
pub struct ArmClock(Arc<Ticks>);

#[derive(Debug, Default)]
struct Ticks {
    time: Mutex<Time>,
    changed: Condvar,
    is_over: AtomicBool,
}

/// How late it is, and until when somebody waits, s.
#[derive(Debug, Default)]
struct Time {
    now: f64,
    awaited: f64,
}

impl ArmClock {
    /// Lets it be this late, s.
    pub(super) fn set(&self, time: f64) {
        self.time().now = time;
        self.0.changed.notify_all();
    }

    /// Returns whether someone waits for a time that has not come.
    pub(super) fn is_awaited(&self) -> bool {
        let time = self.time();
        time.awaited > time.now
    }

    /// Lets everyone go who waits; from now on nobody can wait.
    pub(super) fn end(&self) {
        self.0.is_over.store(true, Ordering::SeqCst);
        self.0.changed.notify_all();
    }

    fn time(&self) -> MutexGuard<'_, Time> {
        self.0.time.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clock for ArmClock {
    fn now(&self) -> f64 {
        self.time().now
    }

    fn sleep(&self, seconds: f64) {
        let ticks = &self.0;
        let mut time = self.time();
        let until = time.now + seconds;
        time.awaited = time.awaited.max(until);
        while time.now < until && !ticks.is_over.load(Ordering::SeqCst) {
            // An arm that stopped for good must not hold anyone for ever.
            let waited = ticks.changed.wait_timeout(time, Duration::from_millis(100));
            time = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}
