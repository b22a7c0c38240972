//! A conductor with what it is still to be asked, and how long it has been waited for. When it is asked stands in
//! [`super::lead`].

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::execution::conduct::{Ahead, Conductor, Word};
use crate::trace::StepRecord;

/// A conductor, and what it could not be asked about yet.
pub(super) struct Lead {
    pub(super) conductor: Box<dyn Conductor>,
    /// Steps that ended where the arm could not be left standing, in their order.
    pub(super) pending: Vec<(Ahead, StepRecord)>,
    /// How long it has been waited for, s of wall time.
    pub(super) waited: f64,
    clock: fn() -> f64,
}

/// A lead that the gate before the lines of a script shares.
pub(super) type SharedLead = Arc<Mutex<Lead>>;

impl Lead {
    /// Nothing was asked yet; `clock` returns seconds since some instant.
    pub(super) fn new(conductor: Box<dyn Conductor>, clock: fn() -> f64) -> SharedLead {
        Arc::new(Mutex::new(Self { conductor, pending: Vec::new(), waited: 0.0, clock }))
    }

    /// Asks something, and counts the time it takes.
    pub(super) fn asking<T>(&mut self, ask: impl FnOnce(&mut Self) -> T) -> T {
        let begin = (self.clock)();
        let word = ask(self);
        self.waited += (self.clock)() - begin;
        word
    }

    /// Asks about what has ended; the first wish to stop counts, and the rest told all the same.
    pub(super) fn catch_up(&mut self) -> Word {
        let mut word = Word::Go;
        for (ahead, record) in std::mem::take(&mut self.pending) {
            if self.conductor.after(&ahead, &record) == Word::Stop {
                word = Word::Stop;
            }
        }
        word
    }
}

/// Locks a lead. A panic elsewhere does not make it another: it is still what it was.
pub(super) fn lock(lead: &SharedLead) -> MutexGuard<'_, Lead> {
    lead.lock().unwrap_or_else(PoisonError::into_inner)
}
