//! How much a search may cost, and who may end it sooner.
//!
//! Work is counted, not timed, so that the same search ends at the same place on any machine. One unit is
//! one pair of solids looked at for collision, or as much arithmetic elsewhere: some tens of nanoseconds.

use std::sync::atomic::{AtomicU64, Ordering};

use super::error::Error;

/// What one search may cost when nobody says otherwise: about a minute. What a pour plans in all its steps
/// costs less than a hundredth of it.
pub const USUAL: u64 = 1_000_000_000;
/// Units of a second on the machine this was written on, for messages.
const A_SECOND: u64 = 20_000_000;

/// Work that may still be done, and whether somebody wants it to end.
pub struct Budget<'a> {
    whole: u64,
    left: AtomicU64,
    stop: Box<dyn Fn() -> bool + Send + Sync + 'a>,
}

impl<'a> Budget<'a> {
    /// Returns the usual budget of a search; `stop` is asked often and ends it at once.
    pub fn new(stop: impl Fn() -> bool + Send + Sync + 'a) -> Self {
        Self::of(USUAL, stop)
    }

    /// Returns a budget of so many units.
    pub fn of(work: u64, stop: impl Fn() -> bool + Send + Sync + 'a) -> Self {
        Self { whole: work, left: AtomicU64::new(work), stop: Box::new(stop) }
    }

    /// Takes note of work about to be done.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`] when somebody wants it to end, [`Error::Spent`] when not so much is left.
    pub fn spend(&self, work: u64) -> Result<(), Error> {
        if (self.stop)() {
            return Err(Error::Cancelled);
        }
        let left = self.left.load(Ordering::Relaxed);
        // One search spends one budget; were there two, a unit might be counted once instead of twice.
        self.left.store(left.saturating_sub(work), Ordering::Relaxed);
        if left < work { Err(Error::Spent { seconds: self.whole / A_SECOND }) } else { Ok(()) }
    }
}

impl std::fmt::Debug for Budget<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let left = self.left.load(Ordering::Relaxed);
        f.debug_struct("Budget").field("whole", &self.whole).field("left", &left).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_ends_with_its_work_and_stays_ended() {
        let budget = Budget::of(10, || false);
        assert_eq!(budget.spend(6), Ok(()));
        assert_eq!(budget.spend(6), Err(Error::Spent { seconds: 0 }));
        assert_eq!(budget.spend(1), Err(Error::Spent { seconds: 0 }));
        let budget = Budget::new(|| true);
        assert_eq!(budget.spend(0), Err(Error::Cancelled));
    }
}
