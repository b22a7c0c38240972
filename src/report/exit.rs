//! How commands end: the exit codes of `INTERFACES`, and how the arm stands then.

use crate::workcell::{Ending, Run};

/// How a command ended; the numbers are the exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// Done and true.
    Yes = 0,
    /// Done, and the answer is no.
    No = 1,
    /// Usage or bad input.
    BadInput = 2,
    /// Stopped by a person or a safety limit.
    Stopped = 3,
    /// An arm, a camera or an endpoint is not available.
    Unavailable = 4,
}

impl Exit {
    /// Returns what has this code; what has none is bad input.
    pub fn of(code: u8) -> Self {
        [Self::Yes, Self::No, Self::BadInput, Self::Stopped, Self::Unavailable]
            .into_iter()
            .find(|exit| *exit as u8 == code)
            .unwrap_or(Self::BadInput)
    }
}

/// Returns how a command ends that performed a run.
pub fn ended(run: &Run) -> Exit {
    match run.outcome {
        Ending::Success | Ending::Unconfirmed => Exit::Yes,
        // An arm or a camera that failed on the way is no answer to what was asked.
        Ending::Unavailable => Exit::Unavailable,
        Ending::Failure => Exit::No,
        Ending::Stopped => Exit::Stopped,
    }
}

/// Says how the arm stands after a run that was stopped.
pub(super) fn stands(run: &Run) -> &'static str {
    if run.stop_unanswered {
        "the arm was asked to stop and has not answered yet"
    } else {
        "the arm holds its position"
    }
}
