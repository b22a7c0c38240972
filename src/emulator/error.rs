//! Why the controller says no: the words a client reads and the numbers that go with them; why a fault on demand
//! cannot be read.

use crate::arm::DeviceError;
use crate::kortex::refusal;
use crate::motion;
use crate::motion::ik::Reason;

use super::unplanned::Unplanned;
use super::wording::FAULTS as WORDS;

/// A refusal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Refused {
    #[error("user not found")]
    UserNotFound,
    #[error("invalid password")]
    WrongPassword,
    #[error("no such session")]
    NoSession,
    #[error("not emulated")]
    NotEmulated,
    #[error("unsupported method")]
    UnknownMethod,
    #[error("unsupported service")]
    UnknownService,
    #[error("unsupported frame type")]
    UnknownFrame,
    #[error("another header version")]
    OtherVersion,
    #[error("too many sessions")]
    TooManySessions,
    #[error("another session is in control")]
    NotInControl,
    #[error("username is empty")]
    NoUserName,
    #[error("username already exists")]
    UserNameTaken,
    #[error("invalid password")]
    OldPasswordWrong,
    #[error("password not changed")]
    PasswordNotChanged,
    #[error("user profile not found")]
    NoUserProfile,
    #[error("no such bridge")]
    NoBridge,
    #[error("sequence not found")]
    NoSequence,
    #[error("action not found")]
    NoSuchAction,
    #[error("no such subscription")]
    NoSubscription,
    #[error("protection zone not found")]
    NoZone,
    #[error("robot is in emergency stop")]
    EmergencyStop,
    #[error("robot is in fault")]
    InFault,
    #[error("robot is in maintenance")]
    InMaintenance,
    #[error("a movement is in progress")]
    Moving,
    #[error("an action is in progress")]
    Acting,
    #[error("a sequence is played")]
    Playing,
    #[error("no action in progress")]
    NothingToPause,
    #[error("no sequence is played")]
    NothingPlayed,
    #[error("must be single level servoing mode")]
    NotSingleLevel,
    #[error("must be low level servoing mode")]
    NotLowLevel,
    #[error("unsupported action")]
    UnknownAction,
    #[error("default actions stay")]
    DefaultNotChanged,
    #[error("default actions stay")]
    DefaultNotDeleted,
    #[error("an action that refers to another must not be referred to")]
    ReferredTwice,
    #[error("wrong number of joints")]
    JointCount,
    #[error("one command for every actuator")]
    CommandCount,
    #[error("2 to 100000 points are allowed")]
    PointCount,
    #[error("points are 1 ms apart")]
    TimeStep,
    #[error("the first point is not where the arm is")]
    StartsElsewhere,
    #[error("not a number")]
    NotANumber,
    #[error("no such frame of reference")]
    NoFrame,
    #[error("no such mode of the gripper")]
    NoGripperMode,
    #[error("a speed is negative")]
    NegativeSpeed,
    #[error("a duration is negative")]
    NegativeDuration,
    #[error("no finger")]
    NoFinger,
    #[error("the value is 0..1, or -1..1 for speed")]
    FingerValue,
    #[error("no target pose")]
    NoTargetPose,
    #[error("no pose")]
    NoPose,
    #[error("no such mode")]
    NoMode,
    #[error("no such admittance")]
    NoAdmittance,
    #[error("no such snapshot")]
    NoSnapshot,
    #[error("unsupported servoing mode")]
    UnknownServoing,
    #[error("no soft limits in this mode")]
    NoSoftLimits,
    #[error("this pin is not an output")]
    NotAnOutput,
    #[error("pins are 1 to 4")]
    NoPin,
    #[error("sensors are 1, colour, and 2, depth")]
    NoSensor,
    #[error("no shape")]
    NoShape,
    #[error("a size is missing or not positive")]
    NoSize,
    #[error("the orientation is no rotation")]
    NoRotation,
    #[error("another kind of device")]
    OtherDevice,
    #[error("no such device")]
    NoDevice,
    #[error("not an actuator")]
    NoActuator,
    #[error("above the hard limit")]
    AboveHardLimit,
    #[error("above its maximum")]
    AboveMaximum,
    #[error("at most 256 bytes")]
    TooManyBytes,
    #[error("focus is 0 to 1023")]
    FocusTooFar,
    #[error("not positive")]
    NotPositive,
    #[error("below its minimum")]
    BelowMinimum,
    #[error("the bus is not enabled")]
    BusOff,
    #[error("no answer at this address")]
    NobodyOnBus,
    #[error("this sensor has no such option")]
    NoOption,
    #[error("this option is only read")]
    ReadOnlyOption,
    #[error("run or maintenance")]
    NoOperatingMode,
    #[error("restart the base by Base.Reboot")]
    BaseReboots,
    #[error("not of this sensor")]
    NoResolution,
    #[error("only colour is focused")]
    OnlyColourFocused,
    #[error("no such action")]
    NoFocus,
    #[error("force mode is not implemented")]
    NoForceMode,
    #[error("not implemented")]
    NotImplemented,
    /// What a call carries cannot be read.
    #[error("{0}")]
    Garbled(String),
    #[error("joints are 0 to {last}")]
    NoJoint { last: usize },
    /// This joint, from 0, has two values in one list.
    #[error("joint {joint} is named twice")]
    JointTwice { joint: usize },
    #[error("{0}")]
    JointsUnplanned(Unplanned),
    #[error("{0}")]
    LineUnplanned(Unplanned),
    #[error("{0}")]
    Motion(motion::Error),
    #[error("no solution: {}", .0.word())]
    NoSolution(Reason),
    #[error("{0}")]
    Failed(DeviceError),
    /// One on demand, with a number that nobody knows.
    #[error("planted")]
    Planted,
}

impl Refused {
    /// Returns the protocol's kind of error: 1 when the protocol was broken, 3 when the arm will not.
    pub(super) fn code(&self) -> u8 {
        match self {
            Self::UserNotFound
            | Self::WrongPassword
            | Self::NoSession
            | Self::NotEmulated
            | Self::UnknownMethod
            | Self::UnknownService
            | Self::UnknownFrame
            | Self::OtherVersion
            | Self::Garbled(_) => 1,
            _ => 3,
        }
    }

    /// Returns the sub-code by which a client knows it.
    pub(super) fn sub_code(&self) -> u16 {
        match self {
            Self::UserNotFound => refusal::USER_NOT_FOUND,
            Self::WrongPassword | Self::OldPasswordWrong => refusal::INVALID_PASSWORD,
            Self::NoSession => refusal::INVALID_SESSION,
            Self::NotEmulated | Self::UnknownMethod => refusal::UNSUPPORTED_METHOD,
            Self::UnknownService => refusal::UNSUPPORTED_SERVICE,
            Self::UnknownFrame => refusal::UNSUPPORTED_FRAME_TYPE,
            Self::OtherVersion => refusal::INCOMPATIBLE_HEADER_VERSION,
            Self::TooManySessions | Self::NoSolution(_) | Self::Failed(_) => refusal::METHOD_FAILED,
            Self::NotInControl => refusal::SESSION_NOT_IN_CONTROL,
            Self::NoUserName => refusal::USERNAME_EMPTY,
            Self::UserNameTaken => refusal::USERNAME_ALREADY_EXISTS,
            Self::PasswordNotChanged => refusal::PASSWORD_NOT_CHANGED,
            Self::NoUserProfile
            | Self::NoBridge
            | Self::NoSequence
            | Self::NoSuchAction
            | Self::NoSubscription
            | Self::NoZone => refusal::ENTITY_NOT_FOUND,
            Self::EmergencyStop => refusal::ROBOT_IN_EMERGENCY_STOP,
            Self::InFault => refusal::ROBOT_IN_FAULT,
            Self::InMaintenance => refusal::ROBOT_IN_MAINTENANCE,
            Self::Moving | Self::Acting | Self::Playing => refusal::ROBOT_MOVEMENT_IN_PROGRESS,
            Self::NothingToPause | Self::NothingPlayed => refusal::CONTROL_NO_ACTION,
            Self::NotSingleLevel | Self::NotLowLevel => refusal::WRONG_SERVOING_MODE,
            Self::UnknownAction => refusal::UNSUPPORTED_ACTION,
            Self::DefaultNotChanged => refusal::UPDATE_PERMISSION_DENIED,
            Self::DefaultNotDeleted => refusal::DELETE_PERMISSION_DENIED,
            Self::ReferredTwice
            | Self::NotANumber
            | Self::NoFrame
            | Self::NoGripperMode
            | Self::NoFinger
            | Self::FingerValue
            | Self::NoTargetPose
            | Self::NoPose
            | Self::NoMode
            | Self::NoAdmittance
            | Self::NoSnapshot
            | Self::UnknownServoing
            | Self::NoSoftLimits
            | Self::NotAnOutput
            | Self::NoPin
            | Self::NoSensor
            | Self::NoShape
            | Self::NoSize
            | Self::NoRotation
            | Self::NoJoint { .. }
            | Self::JointTwice { .. }
            | Self::Motion(_) => refusal::INVALID_PARAM,
            Self::JointCount | Self::CommandCount => refusal::CONTROL_ACTUATOR_COUNT_MISMATCH,
            Self::PointCount => refusal::CONTROL_LARGE_SIZE,
            Self::TimeStep => refusal::CONTROL_INVALID_TIME_STEP,
            Self::StartsElsewhere => refusal::CONTROL_WRONG_STARTING_POINT,
            Self::OtherDevice | Self::NoDevice | Self::NoActuator => refusal::INVALID_DEVICE,
            Self::AboveHardLimit | Self::AboveMaximum | Self::TooManyBytes | Self::FocusTooFar => {
                refusal::VALUE_IS_ABOVE_MAXIMUM
            }
            Self::NotPositive | Self::BelowMinimum => refusal::VALUE_IS_BELOW_MINIMUM,
            Self::BusOff => refusal::DEVICE_NOT_READY,
            Self::NobodyOnBus => refusal::METHOD_TIMEOUT,
            Self::NoOption | Self::ReadOnlyOption | Self::NoOperatingMode | Self::BaseReboots => {
                refusal::UNSUPPORTED_OPTION
            }
            Self::NoResolution => refusal::UNSUPPORTED_RESOLUTION,
            Self::OnlyColourFocused | Self::NoFocus => refusal::UNSUPPORTED_FOCUS_ACTION,
            Self::NoForceMode | Self::NotImplemented => refusal::UNIMPLEMENTED,
            Self::Garbled(_) => refusal::PAYLOAD_DECODING_ERR,
            Self::NegativeDuration
            | Self::JointsUnplanned(Unplanned::TooSoon(_))
            | Self::LineUnplanned(Unplanned::TooSoon(_)) => refusal::CONTROL_INVALID_DURATION,
            Self::NegativeSpeed => refusal::CONTROL_INVALID_SPEED,
            Self::JointsUnplanned(_) => refusal::CONTROL_JOINT_POSITION_LIMIT,
            Self::LineUnplanned(_) => refusal::CONTROL_OUTSIDE_WORKSPACE,
            Self::Planted => 999,
        }
    }
}

/// Why a fault on demand cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongFault {
    /// It has no value.
    #[error("`{0}` is not NAME=VALUE; there are {WORDS}")]
    NoValue(String),
    /// There is none of this name.
    #[error("there is no fault `{0}`; there are {WORDS}")]
    Unknown(String),
    /// Its value is no share.
    #[error("`{name}` takes a share from 0 to 1, not `{text}`")]
    NoShare {
        /// Its name.
        name: String,
        /// Its value as it was written.
        text: String,
    },
    /// Its value is no time.
    #[error("`{name}` takes a time such as 3s or 20ms, not `{text}`")]
    NoTime {
        /// Its name.
        name: String,
        /// Its value as it was written.
        text: String,
    },
}
