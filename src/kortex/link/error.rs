//! Why the arm did not answer, or not as hoped, and what would help.

use super::super::frame::FrameError;
use super::super::refusal::{self, Refusal};
use super::super::rpc::Rpc;

/// Why the arm did not answer, or not as hoped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// Nobody is there.
    #[error("no arm answers at {address}: {error}")]
    Connect {
        /// Where.
        address: String,
        /// What the system says.
        error: String,
    },
    /// The connection is gone.
    #[error("the connection to the arm is gone: {0}")]
    Lost(Loss),
    /// No answer in time.
    #[error("the arm did not answer {rpc} within {milliseconds} ms")]
    Silent {
        /// Which call.
        rpc: Rpc,
        /// How long it was waited for, ms.
        milliseconds: u64,
    },
    /// The answer is no.
    #[error("{0}")]
    Refused(Refusal),
    /// The answer cannot be read.
    #[error("the arm's answer to {rpc} cannot be read: {error}")]
    Unreadable {
        /// Which call.
        rpc: Rpc,
        /// Why.
        error: Garbled,
    },
    /// The arm answers, but says nothing of its fingers.
    #[error("the gripper does not report its opening")]
    NoGripper,
    /// What is to be sent does not fit a frame.
    #[error("{0}")]
    Frame(#[from] FrameError),
}

/// Why the connection is gone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// It was closed on this side.
    #[error("it was closed")]
    Closed,
    /// It was closed on the other side.
    #[error("the arm closed it")]
    ClosedByArm,
    /// The arm knows the session no more.
    #[error("the arm closed the session")]
    SessionOver,
    /// It never was there.
    #[error("it was never open")]
    NeverOpen,
    /// The time to wait for an answer is longer than the system can count.
    #[error("it was waited for without end")]
    Endless,
    /// What comes is no more read as frames.
    #[error("{0}")]
    Frame(FrameError),
    /// What the system says.
    #[error("{0}")]
    System(String),
}

/// Why an answer cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Garbled {
    /// It is no message of its kind.
    #[error("{0}")]
    Message(String),
    /// It speaks of other joints than there are, or gives no numbers for them.
    #[error("{told} actuators, {expected} expected, all with numbers")]
    Actuators {
        /// Of how many it speaks.
        told: usize,
        /// How many there are.
        expected: usize,
    },
}

impl LinkError {
    /// Returns what would help.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Connect { .. } => {
                "is the arm on and in this network? its own address is 192.168.1.10, its port 10000"
            }
            Self::Lost(Loss::Frame(FrameError::Magic(_))) => {
                "is this the arm's port? it is 10000 where nobody has changed it"
            }
            Self::Lost(_) => {
                "check the cable; the next command connects again, and the arm has stopped by itself"
            }
            Self::Silent { .. } => "check the cable and the arm's light, then try again",
            Self::Refused(refusal) => refusal.help(),
            Self::Unreadable { .. } => {
                "its firmware may be newer than this program; tell the project its version"
            }
            Self::NoGripper => "check the gripper's plug, then restart the arm",
            Self::Frame(_) => "shorten the path",
        }
    }

    /// Returns whether the arm refused with this sub-code.
    pub fn is_refusal(&self, sub_code: u16) -> bool {
        matches!(self, Self::Refused(refusal) if refusal.sub_code == sub_code)
    }

    /// Returns whether a new connection is needed.
    pub fn is_lost(&self) -> bool {
        matches!(self, Self::Lost(_)) || self.is_refusal(refusal::INVALID_SESSION)
    }
}
