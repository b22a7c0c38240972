//! Service 2, Base: actions, trajectories, the gripper, modes and faults.

use super::common::{ArmState, Connection, DeviceHandle, Timestamp, UserProfileHandle};
use super::force::{AdmittanceMode, WrenchCommand};
use super::motion::{
    ConstrainedJointAngles, ConstrainedPose, GripperCommand, JointSpeeds, TwistCommand,
};
use super::sequence::{ProtectionZoneHandle, SequenceHandle, Snapshot};
use super::trajectory::{PreComputedJointTrajectory, WaypointList};

/// `Base.Action`. Only the fields in use.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Action {
    #[prost(message, optional, tag = "1")]
    pub handle: Option<ActionHandle>,
    #[prost(string, tag = "2")]
    pub name: String,
    #[prost(string, tag = "3")]
    pub application_data: String,
    #[prost(
        oneof = "ActionParameters",
        tags = "4, 5, 7, 9, 10, 16, 17, 31, 32, 34, 35, 36, 38, 39, 40, 41"
    )]
    pub parameters: Option<ActionParameters>,
}

/// The one of `Base.Action.action_parameters` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum ActionParameters {
    #[prost(message, tag = "4")]
    SendTwistCommand(TwistCommand),
    #[prost(message, tag = "5")]
    SendWrenchCommand(WrenchCommand),
    #[prost(message, tag = "7")]
    SendJointSpeeds(JointSpeeds),
    #[prost(message, tag = "9")]
    ReachPose(ConstrainedPose),
    #[prost(message, tag = "10")]
    ReachJointAngles(ConstrainedJointAngles),
    #[prost(enumeration = "AdmittanceMode", tag = "16")]
    ToggleAdmittanceMode(i32),
    #[prost(message, tag = "17")]
    Snapshot(Snapshot),
    #[prost(message, tag = "31")]
    ApplyEmergencyStop(()),
    #[prost(message, tag = "32")]
    ClearFaults(()),
    #[prost(message, tag = "34")]
    Delay(Delay),
    #[prost(message, tag = "35")]
    ExecuteAction(ActionHandle),
    #[prost(message, tag = "36")]
    SendGripperCommand(GripperCommand),
    #[prost(message, tag = "38")]
    StopAction(()),
    #[prost(message, tag = "39")]
    PlayPreComputedTrajectory(PreComputedJointTrajectory),
    #[prost(message, tag = "40")]
    ExecuteSequence(SequenceHandle),
    #[prost(message, tag = "41")]
    ExecuteWaypointList(WaypointList),
}

/// `Base.ActionHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActionHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
    #[prost(enumeration = "ActionType", tag = "2")]
    pub action_type: i32,
    #[prost(fixed32, tag = "3")]
    pub permission: u32,
}

/// `Base.RequestedActionType`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RequestedActionType {
    #[prost(enumeration = "ActionType", tag = "1")]
    pub action_type: i32,
}

/// `Base.ActionList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActionList {
    #[prost(message, repeated, tag = "1")]
    pub action_list: Vec<Action>,
}

/// `Base.Delay`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Delay {
    #[prost(uint32, tag = "1")]
    pub duration: u32,
}

/// `Base.ServoingModeInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ServoingModeInformation {
    #[prost(enumeration = "ServoingMode", tag = "1")]
    pub servoing_mode: i32,
}

/// `Base.ServoingModeNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ServoingModeNotification {
    #[prost(enumeration = "ServoingMode", tag = "1")]
    pub servoing_mode: i32,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(message, optional, tag = "4")]
    pub connection: Option<Connection>,
}

/// `Base.ArmStateInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ArmStateInformation {
    #[prost(enumeration = "ArmState", tag = "1")]
    pub active_state: i32,
    #[prost(message, optional, tag = "2")]
    pub connection: Option<Connection>,
}

/// `Base.ArmStateNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ArmStateNotification {
    #[prost(enumeration = "ArmState", tag = "1")]
    pub active_state: i32,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub connection: Option<Connection>,
}

/// `Base.OperatingModeInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct OperatingModeInformation {
    #[prost(enumeration = "OperatingMode", tag = "1")]
    pub operating_mode: i32,
    #[prost(message, optional, tag = "2")]
    pub device_handle: Option<DeviceHandle>,
}

/// `Base.ActuatorInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActuatorInformation {
    #[prost(uint32, tag = "1")]
    pub count: u32,
}

/// `Base.ActionNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActionNotification {
    #[prost(enumeration = "ActionEvent", tag = "1")]
    pub action_event: i32,
    #[prost(message, optional, tag = "2")]
    pub handle: Option<ActionHandle>,
    #[prost(message, optional, tag = "3")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "4")]
    pub user_handle: Option<UserProfileHandle>,
    /// `SubErrorCodes`.
    #[prost(int32, tag = "5")]
    pub abort_details: i32,
    #[prost(message, optional, tag = "6")]
    pub connection: Option<Connection>,
    #[prost(message, repeated, tag = "7")]
    pub trajectory_info: Vec<TrajectoryInfo>,
}

/// `Base.TrajectoryInfo`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TrajectoryInfo {
    #[prost(enumeration = "TrajectoryInfoType", tag = "1")]
    pub trajectory_info_type: i32,
    #[prost(uint32, tag = "2")]
    pub waypoint_index: u32,
    #[prost(uint32, tag = "3")]
    pub joint_index: u32,
}

/// `Base.FirmwareBundleVersions`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FirmwareBundleVersions {
    #[prost(string, tag = "1")]
    pub main_bundle_version: String,
    #[prost(message, repeated, tag = "2")]
    pub components_versions: Vec<FirmwareComponentVersion>,
}

/// `Base.FirmwareComponentVersion`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FirmwareComponentVersion {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(string, tag = "2")]
    pub version: String,
    #[prost(uint32, tag = "3")]
    pub device_id: u32,
}

/// `Base.UserProfile`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UserProfile {
    #[prost(message, optional, tag = "1")]
    pub handle: Option<UserProfileHandle>,
    #[prost(string, tag = "2")]
    pub username: String,
    #[prost(string, tag = "3")]
    pub firstname: String,
    #[prost(string, tag = "4")]
    pub lastname: String,
    #[prost(string, tag = "5")]
    pub application_data: String,
}

/// `Base.FullUserProfile`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FullUserProfile {
    #[prost(message, optional, tag = "1")]
    pub user_profile: Option<UserProfile>,
    #[prost(string, tag = "2")]
    pub password: String,
}

/// `Base.UserProfileList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UserProfileList {
    #[prost(message, repeated, tag = "1")]
    pub user_profiles: Vec<UserProfile>,
}

/// `Base.UserList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UserList {
    #[prost(message, repeated, tag = "1")]
    pub user_handles: Vec<UserProfileHandle>,
}

/// `Base.PasswordChange`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PasswordChange {
    #[prost(message, optional, tag = "1")]
    pub handle: Option<UserProfileHandle>,
    #[prost(string, tag = "2")]
    pub old_password: String,
    #[prost(string, tag = "3")]
    pub new_password: String,
}

/// `Base.OperatingModeNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct OperatingModeNotification {
    #[prost(enumeration = "OperatingMode", tag = "1")]
    pub operating_mode: i32,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(message, optional, tag = "4")]
    pub connection: Option<Connection>,
    #[prost(message, optional, tag = "5")]
    pub device_handle: Option<DeviceHandle>,
}

/// `Base.ConfigurationChangeNotification`. Only the fields in use.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConfigurationChangeNotification {
    #[prost(enumeration = "ConfigurationNotificationEvent", tag = "1")]
    pub event: i32,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(oneof = "ConfigurationChange", tags = "4, 5, 9, 10")]
    pub change: Option<ConfigurationChange>,
    #[prost(message, optional, tag = "15")]
    pub connection: Option<Connection>,
}

/// The one of `Base.ConfigurationChangeNotification.configuration_change` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum ConfigurationChange {
    #[prost(message, tag = "4")]
    SequenceHandle(SequenceHandle),
    #[prost(message, tag = "5")]
    ActionHandle(ActionHandle),
    #[prost(message, tag = "9")]
    UserProfileHandle(UserProfileHandle),
    #[prost(message, tag = "10")]
    ProtectionZoneHandle(ProtectionZoneHandle),
}

/// `Base.ActionType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ActionType {
    Unspecified = 0,
    SendTwistCommand = 1,
    SendWrenchCommand = 2,
    SendJointSpeeds = 4,
    ReachPose = 6,
    ReachJointAngles = 7,
    ToggleAdmittanceMode = 13,
    Snapshot = 14,
    SwitchControlMapping = 16,
    NavigateJoints = 17,
    NavigateMappings = 18,
    ChangeTwist = 22,
    ChangeJointSpeeds = 23,
    ChangeWrench = 25,
    ApplyEmergencyStop = 28,
    ClearFaults = 29,
    TimeDelay = 31,
    ExecuteAction = 32,
    SendGripperCommand = 33,
    SendGpioCommand = 34,
    StopAction = 35,
    PlayPreComputedTrajectory = 39,
    ExecuteSequence = 40,
    ExecuteWaypointList = 41,
}

/// `Base.ActionEvent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ActionEvent {
    Unspecified = 0,
    End = 1,
    Abort = 2,
    Pause = 3,
    Start = 4,
    PreprocessStart = 5,
    PreprocessAbort = 6,
    PreprocessEnd = 7,
    PostprocessStart = 8,
    PostprocessAbort = 9,
    PostprocessEnd = 10,
    Feedback = 11,
}

/// `Base.ServoingMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ServoingMode {
    Unspecified = 0,
    SingleLevel = 2,
    LowLevel = 3,
    Bypass = 4,
}

/// `Base.OperatingMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum OperatingMode {
    Unspecified = 0,
    Maintenance = 1,
    Update = 2,
    UpdateCompleted = 3,
    UpdateFailed = 4,
    ShuttingDown = 5,
    Run = 6,
    UpdatingDevice = 7,
}

/// `Base.ConfigurationNotificationEvent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ConfigurationNotificationEvent {
    Unspecified = 0,
    Updated = 1,
    Deleted = 2,
    DeletedAll = 3,
    Created = 4,
}

/// `Base.TrajectoryInfoType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum TrajectoryInfoType {
    Unspecified = 0,
    JointAccelerationLimitReached = 1,
    JointSpeedLimitReached = 2,
    JointPositionLimitReached = 3,
    JointTorqueLimitReached = 4,
    SingularityRegion = 5,
    InverseKinematicFailed = 6,
    CartesianAccelerationLimitReached = 7,
    CartesianSpeedLimitReached = 8,
    CartesianPositionLimitReached = 9,
    CartesianWrenchLimitReached = 10,
    EnteringProtectionZone = 11,
    WaypointReached = 12,
    TrajectoryOk = 13,
}
