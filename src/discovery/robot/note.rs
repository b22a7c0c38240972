//! What was assumed of a recording before anything was fitted to it, as it is told to people.

use std::fmt;

use crate::units::significant;

/// Something assumed of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// Nobody says how noisy the sensors are.
    NoiseEstimated {
        /// Which recording.
        recording: String,
    },
    /// A group of columns holds what was not measured.
    Unmeasured {
        /// Which recording.
        recording: String,
        /// What the columns' names begin with.
        stem: &'static str,
    },
    /// The logger wrote rows twice.
    Repeats {
        /// Which recording.
        recording: String,
        /// How many are left out.
        repeats: usize,
        /// Out of how many.
        rows: usize,
    },
    /// The time stamps are less even than the motion.
    Jitter {
        /// Which recording.
        recording: String,
        /// By how much they are off, s.
        off: f64,
    },
    /// A channel tells nothing in any recording.
    NeverChanges {
        /// Which channel.
        channel: String,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoiseEstimated { recording } => write!(
                f,
                "{recording}: no noise is given; it is estimated from the channels themselves"
            ),
            Self::Unmeasured { recording, stem } => write!(
                f,
                "{recording}: `{stem}` is the same in every row while the arm moves; it is taken as not measured"
            ),
            Self::Repeats { recording, repeats, rows } => write!(
                f,
                "{recording}: {repeats} of {rows} rows repeat the row before and are left out"
            ),
            Self::Jitter { recording, off } => write!(
                f,
                "{recording}: the samples are evenly spaced, their time stamps jitter by {} ms; an even clock is used",
                significant(off * 1e3, 2)
            ),
            Self::NeverChanges { channel } => {
                write!(f, "{channel} never changes: nothing is said of it")
            }
        }
    }
}
