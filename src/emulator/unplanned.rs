//! Why a path is not planned, and what is wrong with a waypoint: the words a client reads, and the arm's number of
//! the kind of mistake.

use crate::kortex::messages::trajectory::TrajectoryErrorType as Kind;
use crate::motion;

/// Why there is no path to where someone wants.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Unplanned {
    /// A joint, from 0, has no such position.
    #[error("joint {} would leave its range", .0 + 1)]
    OutOfRange(usize),
    /// It takes longer than was asked for, s.
    #[error("it takes {0:.2} s at least")]
    TooSoon(f64),
    #[error("{0}")]
    Motion(#[from] motion::Error),
}

/// What is wrong with a list of waypoints, or with one of them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Wrong {
    #[error("{n} waypoints; 1 to {most} are allowed")]
    Count { n: usize, most: usize },
    #[error("all waypoints of a list are of one type")]
    Mixed,
    #[error("{given} angles for {n} joints")]
    JointCount { given: usize, n: usize },
    #[error("not a number")]
    NotANumber,
    #[error("the duration is too short")]
    Duration,
    #[error("joint position limit exceeded")]
    JointPosition,
    #[error("joint speed limit exceeded")]
    JointSpeed,
    #[error("joint acceleration limit exceeded")]
    JointAcceleration,
    #[error("{0}")]
    Untimed(motion::Error),
    #[error("the last waypoint must not blend")]
    Blends,
    #[error("poses are in the base's frame")]
    Frame,
    #[error("no pose")]
    NoPose,
    #[error("too fast")]
    LinearSpeed,
    #[error("too fast")]
    AngularSpeed,
    #[error("{0}")]
    Unplanned(Unplanned),
}

impl Wrong {
    /// Returns the arm's name for it.
    pub(super) fn kind(&self) -> Kind {
        match self {
            Self::Count { .. } => Kind::InvalidTrajectorySize,
            Self::Mixed => Kind::MultipleWaypointTypeList,
            Self::JointCount { .. } => Kind::ActuatorCountMismatch,
            Self::NotANumber => Kind::InvalidPosition,
            Self::Duration => Kind::InvalidDuration,
            Self::JointPosition => Kind::InvalidJointPosition,
            Self::JointSpeed => Kind::InvalidJointSpeed,
            Self::JointAcceleration => Kind::InvalidAcceleration,
            Self::Untimed(_) => Kind::NumericalErrorImpossibleTrajectory,
            Self::Blends => Kind::FinalWaypointNoStop,
            Self::Frame => Kind::InvalidReferenceFrame,
            Self::NoPose => Kind::InvalidCartesianPosition,
            Self::LinearSpeed => Kind::InvalidCartesianLinearVelocity,
            Self::AngularSpeed => Kind::InvalidCartesianAngularVelocity,
            Self::Unplanned(_) => Kind::OutsideWorkspace,
        }
    }
}
