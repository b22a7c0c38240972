//! What actions remembered after each step of the last run that did one, for a what-if.

use super::Run;
use crate::execution::context::Memory;
use crate::execution::timing::Past;
use std::collections::BTreeMap;

/// What actions remembered after each step of the last run that did one, and when steps were done: no record holds that.
#[derive(Default)]
pub(super) struct Moments {
    /// The run they are of.
    run_dir: Option<String>,
    after: BTreeMap<usize, (Memory, Past)>,
    /// The folder of the run that began last.
    begun: Option<String>,
    /// Whether that run has done no step yet.
    is_new: bool,
}

impl Moments {
    /// Begins with a run. Those of an earlier one are forgotten when this one does a step: a call that is refused does none.
    pub(super) fn begin(&mut self, run_dir: Option<&str>) {
        (self.begun, self.is_new) = (run_dir.map(str::to_owned), true);
    }

    /// Keeps what is remembered after a step.
    pub(super) fn keep(&mut self, number: usize, memory: Memory, past: Past) {
        if self.is_new {
            self.is_new = false;
            self.run_dir = self.begun.take();
            self.after.clear();
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn run(dir: &str) -> Run {
        Run { run_dir: Some(dir.to_owned()), ..Run::so_far("place(jar)", &[]) }
    }

    /// Two calls that were refused had the next what-if fail for "no earlier action remembered a `spot`".
    #[test]
    fn a_refused_call_forgets_nothing() {
        let mut moments = Moments::default();
        moments.begin(Some("one"));
        moments.keep(1, Memory::default(), Past::default());
        for refused in ["two", "three"] {
            moments.begin(Some(refused));
            assert!(moments.of(&run("one"), 1).is_some() && moments.of(&run(refused), 1).is_none());
        }
        moments.begin(Some("four"));
        moments.keep(2, Memory::default(), Past::default());
        assert!(moments.of(&run("one"), 1).is_none() && moments.of(&run("four"), 2).is_some());
        assert!(moments.of(&run("four"), 1).is_none());
    }
}
