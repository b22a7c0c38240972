//! Time at the door to the network: the one place beside the command line that reads a clock.
//!
//! A socket has time-outs, and an arm moves in its own time. Everything above is handed a [`Clock`]; an
//! emulated arm brings its own, which may run slower or faster than the wall's.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A clock that can be waited on.
pub trait Clock: Send + Sync {
    /// Returns seconds since some instant; never less than before.
    fn now(&self) -> f64;

    /// Lets so many seconds of this clock pass.
    fn sleep(&self, seconds: f64);
}

/// The wall's clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wall;

impl Clock for Wall {
    #[expect(
        clippy::disallowed_methods,
        reason = "time-outs of sockets and the watchdogs of an arm are measured against the wall"
    )]
    fn now(&self) -> f64 {
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64()
    }

    fn sleep(&self, seconds: f64) {
        if seconds > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(seconds));
        }
    }
}
