//! What actions remembered after each step of the last run, for a what-if.

use super::Run;
use crate::execution::context::Memory;
use crate::execution::timing::Past;
use std::collections::BTreeMap;

/// What actions remembered after each step of the last run, and when steps were done: no record holds that.
#[derive(Default)]
pub(super) struct Moments {
    /// The run they are of.
    run_dir: Option<String>,
    after: BTreeMap<usize, (Memory, Past)>,
}

impl Moments {
    /// Forgets those of an earlier run.
    pub(super) fn begin(&mut self, run_dir: Option<&str>) {
        *self = Self { run_dir: run_dir.map(str::to_owned), after: BTreeMap::new() };
    }

    /// Keeps what is remembered after a step.
    pub(super) fn keep(&mut self, number: usize, memory: Memory, past: Past) {
        self.after.insert(number, (memory, past));
    }

    /// Returns what was remembered after a step of that run.
    pub(super) fn of(&self, run: &Run, number: usize) -> Option<(Memory, Past)> {
        if self.run_dir != run.run_dir || run.run_dir.is_none() {
            return None;
        }
        self.after.get(&number).cloned()
    }
}
