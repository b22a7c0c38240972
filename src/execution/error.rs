//! Why an action could not be done.

use crate::arm::DeviceError;
use crate::arm::limits::LimitError;

use crate::trace::{Cause, NoWay, Unrehearsed, Why};

use super::decisions::NotInLog;
use super::refusal::Refusal;

/// Why an action could not be done.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionError {
    /// A person asked to stop.
    #[error("stopped; the arm holds its position")]
    Stopped,
    /// A device failed.
    #[error("{0}")]
    Device(DeviceError),
    /// The limits refused the motion.
    #[error("{0}")]
    Limit(#[from] LimitError),
    /// There is no way to do it.
    #[error("{0}")]
    NoWay(NoWay),
    /// It is not what was rehearsed.
    #[error("{0}")]
    NotInLog(#[from] NotInLog),
    /// The arm would have to go where the rehearsal did not lead it.
    #[error("{0}")]
    Unrehearsed(Unrehearsed),
    /// It recalls what no earlier action remembered.
    #[error("no earlier action remembered a `{0}`")]
    NotRemembered(String),
    /// The script itself gave up, or asks for what it is not given.
    #[error("{0}")]
    Refused(#[from] Refusal),
    /// What ends the step is true: no error, but nothing more is to be done in it.
    #[error("the step is over")]
    Ended,
    /// A condition that must hold while the step runs is broken, or its time is up.
    #[error("{0}")]
    Broken(Box<Cause>),
}

impl ActionError {
    /// Whether a script may catch it and go on.
    pub fn can_be_caught(&self) -> bool {
        !matches!(self, Self::Stopped | Self::Ended | Self::Broken(_))
    }

    /// Whether planning and rehearsing again from where the arm is may help: what was rehearsed does not fit what
    /// was found, and was not begun.
    pub fn can_be_planned_again(&self) -> bool {
        matches!(self, Self::Limit(_) | Self::NoWay(_) | Self::NotInLog(_) | Self::Unrehearsed(_))
    }

    /// Whether nothing more is done after it: a person said stop, or a device failed.
    pub fn ends_the_walk(&self) -> bool {
        matches!(self, Self::Stopped | Self::Device(_))
    }
}

impl From<DeviceError> for ActionError {
    fn from(error: DeviceError) -> Self {
        match error {
            DeviceError::Stopped => Self::Stopped,
            other => Self::Device(other),
        }
    }
}

impl From<NoWay> for ActionError {
    fn from(no: NoWay) -> Self {
        match no.why {
            Why::Stopped => Self::Stopped,
            _ => Self::NoWay(no),
        }
    }
}

impl From<NotInLog> for Cause {
    fn from(off: NotInLog) -> Self {
        Self::Diverged { asked: off.asked.to_string(), had: off.had.to_string() }
    }
}

impl From<ActionError> for Cause {
    fn from(error: ActionError) -> Self {
        match error {
            // Nobody asks why a step ended that is over.
            ActionError::Stopped | ActionError::Ended => Self::Stopped,
            ActionError::Device(error) => Self::Device(error.to_string()),
            ActionError::Limit(error) => Self::Limit(error),
            ActionError::NoWay(no) => Self::NoWay(no),
            ActionError::NotInLog(off) => off.into(),
            ActionError::Unrehearsed(how) => Self::Unrehearsed(how),
            ActionError::NotRemembered(name) => Self::NotRemembered { name },
            ActionError::Refused(why @ Refusal::TooHeavy { .. }) => Self::TooHeavy(why.to_string()),
            ActionError::Refused(why) => Self::Refused(why.to_string()),
            ActionError::Broken(cause) => *cause,
        }
    }
}
