//! Why the arm is not commanded, or did not do what it was asked, and what would help.
//!
//! Why it did not answer at all is [`super::link::LinkError`].

use std::fmt;

use crate::arm::DeviceError;
use crate::motion;

use super::link::LinkError;
use super::messages::base::OperatingMode;
use super::messages::config::{EndEffectorType, ModelId};
use super::refusal;
use super::waypoints::PathRefused;

/// Why the arm is not commanded, or did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(super) enum Error {
    #[error("there is no host `{0}`")]
    NoHost(String),
    #[error("this arm is a {0:?}, not a Gen3")]
    Model(ModelId),
    #[error("this arm has {arm} joints; the scene's robot has {robot}")]
    JointCount { arm: usize, robot: usize },
    #[error("this arm's gripper is {0:?}; this program knows the 2F-85")]
    Gripper(EndEffectorType),
    #[error("the arm does not run: its mode is {0:?}")]
    NotRunning(OperatingMode),
    #[error("the arm does not tell its speed and acceleration limits")]
    NoLimits,
    #[error("the arm is in fault: {0}")]
    InFault(Faults),
    /// Who moves it, empty when it does not say.
    #[error("someone else moves the arm now: {}", or_unsaid(.0))]
    MovedByOther(String),
    #[error("{lost}; it cannot be opened again: {again}")]
    NotReopened { lost: LinkError, again: DeviceError },
    #[error("the arm is still in fault")]
    StillInFault,
    #[error("the arm is still in fault: {0}")]
    FaultStays(Faults),
    /// For so long, s.
    #[error("nothing was heard of the arm for {0:.1} s while it moved")]
    Stalled(f64),
    #[error("{0}")]
    PathRefused(PathRefused),
    #[error("{0}")]
    GivenUp(GivenUp),
    /// So far, rad.
    #[error("the path begins {:.1} deg from where the arm is", .0.to_degrees())]
    BeginsElsewhere(f64),
    /// So far, rad.
    #[error("the arm came to rest {:.1} deg off its path", .0.to_degrees())]
    OffPath(f64),
    #[error("the arm left 1 kHz servoing {0} times on one path, for want of commands in time")]
    LeftTooOften(u64),
    /// For so long, s.
    #[error("the arm left 1 kHz servoing for want of commands in time and stood for {0:.1} s")]
    StoodTooLong(f64),
    #[error("the arm went into fault while it was commanded at 1 kHz: {0}")]
    FaultInStream(Faults),
    #[error("someone else stopped the arm while it was commanded at 1 kHz")]
    StoppedByOther,
    /// For so long, s.
    #[error("this computer sent nothing to the arm for {0:.1} s")]
    Paused(f64),
    #[error("the thread that keeps the beat failed")]
    BeatFailed,
    #[error("the fingers are not commanded while positions are streamed to the joints")]
    FingersInStream,
    #[error("the arm moves")]
    Moves,
    #[error("the arm left 1 kHz servoing while it was held")]
    LeftWhileHeld,
    #[error("{0}")]
    NoPath(motion::Error),
    /// It was told to stop.
    #[error("{0}")]
    Unheard(LinkError),
    #[error("the arm still moves, although it was told to stop and its emergency stop was called")]
    StillMoves,
}

impl Error {
    /// Returns what would help.
    fn help(&self) -> &str {
        match self {
            Self::NoHost(_) => "give the arm's name or address; its own is 192.168.1.10",
            Self::Model(_) => "connect to a Gen3",
            Self::JointCount { .. } => "use a scene whose robot is this arm",
            Self::Gripper(_) => {
                "set the Robotiq 2F-85 in the arm's web page if that is what it has"
            }
            Self::NotRunning(_) => "wait for its update, or leave maintenance in its web page",
            Self::NoLimits => "update the arm's firmware to 2.3 or newer",
            Self::InFault(_) => {
                "mend the cause, then clear its faults: `trueup kortex clear-faults ADDRESS`"
            }
            Self::MovedByOther(_) => {
                "wait until they are done, or stop them: `trueup kortex stop ADDRESS`"
            }
            Self::NotReopened { again, .. } => again.help(),
            Self::StillInFault => {
                "see in the arm's web page which fault stays; it may need a restart"
            }
            Self::FaultStays(_) => "mend the cause; it may need a restart",
            Self::Stalled(_) => {
                "it stops by itself when it is cut off; check the cable and the arm's light, then call it again \
                 to go on"
            }
            Self::PathRefused(_) => "slow the motion down, or raise the soft limits",
            Self::GivenUp(given_up) => given_up.help(),
            Self::BeginsElsewhere(_) | Self::OffPath(_) => "plan again from where the arm is now",
            Self::LeftTooOften(_) => "end what else this computer does, or leave `--stream` out",
            Self::StoodTooLong(_) => {
                "call it again to go on; end what else this computer does, or leave `--stream` out"
            }
            Self::FaultInStream(_) => "mend the cause, then clear its faults",
            Self::StoppedByOther => "ask who did; it is not moved again before you call for it",
            Self::Paused(_) => {
                "end what else it does, or leave `--stream` out; then call it again to go on"
            }
            Self::BeatFailed | Self::NoPath(_) => "tell the project",
            Self::FingersInStream => "do one after the other, or do not stream",
            Self::Moves => "wait until it rests",
            Self::LeftWhileHeld => "see `trueup kortex status`; end what else this computer does",
            Self::Unheard(_) => "press the emergency stop button",
            Self::StillMoves => "press the emergency stop button, or take its power away",
        }
    }
}

impl From<Error> for DeviceError {
    fn from(error: Error) -> Self {
        Self::Refused { what: error.to_string(), help: error.help().to_owned() }
    }
}

impl From<LinkError> for DeviceError {
    fn from(error: LinkError) -> Self {
        Self::Refused { what: error.to_string(), help: error.help().to_owned() }
    }
}

/// A motion that the arm gave up.
#[derive(Debug)]
pub(super) struct GivenUp {
    /// What it says of the path, if it says something.
    pub(super) path: Option<PathRefused>,
    /// The reason it gives.
    pub(super) sub_code: u16,
}

impl fmt::Display for GivenUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sub_code = self.sub_code;
        match (&self.path, refusal::sub_code(sub_code)) {
            (Some(path), _) => write!(f, "{path}"),
            (None, Some(known)) => {
                write!(f, "the arm gave the motion up: {} ({} {sub_code})", known.what, known.name)
            }
            (None, None) => write!(f, "the arm gave the motion up and says {sub_code}"),
        }
    }
}

impl GivenUp {
    fn help(&self) -> &'static str {
        let known = refusal::sub_code(self.sub_code);
        known.map_or("see what stopped it and clear the faults", |known| known.help)
    }
}

/// What is wrong with an arm, as it says itself.
#[derive(Debug)]
pub(super) struct Faults(pub(super) Vec<String>);

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("it does not say why");
        }
        f.write_str(&self.0.join("; "))
    }
}

fn or_unsaid(who: &str) -> &str {
    if who.is_empty() { "it does not say who" } else { who }
}
