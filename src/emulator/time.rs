//! The emulated arm's own time, which others can wait on.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use crate::execution::kortex::clock::Clock;

/// The arm's clock: it runs with the arm, not with the wall.
#[derive(Debug, Clone, Default)]
pub struct ArmClock(Arc<Ticks>);

#[derive(Debug, Default)]
struct Ticks {
    time: Mutex<f64>,
    changed: Condvar,
    waiting: AtomicUsize,
    is_over: AtomicBool,
}

impl ArmClock {
    /// Lets it be this late, s.
    pub(super) fn set(&self, time: f64) {
        *self.0.time.lock().unwrap_or_else(PoisonError::into_inner) = time;
        self.0.changed.notify_all();
    }

    /// Returns whether someone waits for time to pass.
    pub(super) fn is_awaited(&self) -> bool {
        self.0.waiting.load(Ordering::SeqCst) > 0
    }

    /// Lets everyone go who waits; from now on nobody can wait.
    pub(super) fn end(&self) {
        self.0.is_over.store(true, Ordering::SeqCst);
        self.0.changed.notify_all();
    }
}

impl Clock for ArmClock {
    fn now(&self) -> f64 {
        *self.0.time.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sleep(&self, seconds: f64) {
        let ticks = &self.0;
        ticks.waiting.fetch_add(1, Ordering::SeqCst);
        let mut time = ticks.time.lock().unwrap_or_else(PoisonError::into_inner);
        let until = *time + seconds;
        while *time < until && !ticks.is_over.load(Ordering::SeqCst) {
            // An arm that stopped for good must not hold anyone for ever.
            let waited = ticks.changed.wait_timeout(time, Duration::from_millis(100));
            time = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(time);
        ticks.waiting.fetch_sub(1, Ordering::SeqCst);
    }
}
