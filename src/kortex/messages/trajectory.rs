//! Service 2, Base: waypoint lists, pre-computed trajectories, and what the arm says against them.

use super::common::CartesianReferenceFrame;
use super::motion::Pose;

/// `Base.WaypointList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct WaypointList {
    #[prost(message, repeated, tag = "1")]
    pub waypoints: Vec<Waypoint>,
    #[prost(float, tag = "2")]
    pub duration: f32,
    #[prost(bool, tag = "3")]
    pub use_optimal_blending: bool,
}

/// `Base.Waypoint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Waypoint {
    #[prost(string, tag = "1")]
    pub name: String,
    #[prost(oneof = "WaypointKind", tags = "2, 3")]
    pub kind: Option<WaypointKind>,
}

/// The one of `Base.Waypoint.type_of_waypoint` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum WaypointKind {
    #[prost(message, tag = "2")]
    AngularWaypoint(AngularWaypoint),
    #[prost(message, tag = "3")]
    CartesianWaypoint(CartesianWaypoint),
}

/// `Base.AngularWaypoint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct AngularWaypoint {
    #[prost(float, repeated, tag = "1")]
    pub angles: Vec<f32>,
    #[prost(float, repeated, tag = "2")]
    pub maximum_velocities: Vec<f32>,
    #[prost(float, tag = "3")]
    pub duration: f32,
}

/// `Base.CartesianWaypoint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianWaypoint {
    #[prost(message, optional, tag = "1")]
    pub pose: Option<Pose>,
    #[prost(enumeration = "CartesianReferenceFrame", tag = "2")]
    pub reference_frame: i32,
    #[prost(float, tag = "3")]
    pub maximum_linear_velocity: f32,
    #[prost(float, tag = "4")]
    pub maximum_angular_velocity: f32,
    #[prost(float, tag = "5")]
    pub blending_radius: f32,
}

/// `Base.WaypointValidationReport`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct WaypointValidationReport {
    #[prost(message, optional, tag = "1")]
    pub trajectory_error_report: Option<TrajectoryErrorReport>,
    #[prost(message, optional, tag = "2")]
    pub optimal_waypoint_list: Option<WaypointList>,
}

/// `Base.TrajectoryErrorReport`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TrajectoryErrorReport {
    #[prost(message, repeated, tag = "1")]
    pub trajectory_error_elements: Vec<TrajectoryErrorElement>,
}

/// `Base.TrajectoryErrorElement`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TrajectoryErrorElement {
    #[prost(enumeration = "TrajectoryErrorType", tag = "1")]
    pub error_type: i32,
    /// `Base.TrajectoryErrorIdentifier`.
    #[prost(int32, tag = "2")]
    pub error_identifier: i32,
    #[prost(float, tag = "3")]
    pub error_value: f32,
    #[prost(float, tag = "4")]
    pub min_value: f32,
    #[prost(float, tag = "5")]
    pub max_value: f32,
    #[prost(uint32, tag = "6")]
    pub index: u32,
    #[prost(string, tag = "7")]
    pub message: String,
    #[prost(uint32, tag = "8")]
    pub waypoint_index: u32,
}

/// `Base.PreComputedJointTrajectory`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PreComputedJointTrajectory {
    #[prost(enumeration = "TrajectoryContinuityMode", tag = "1")]
    pub mode: i32,
    #[prost(message, repeated, tag = "2")]
    pub trajectory_elements: Vec<PreComputedJointTrajectoryElement>,
}

/// `Base.PreComputedJointTrajectoryElement`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PreComputedJointTrajectoryElement {
    #[prost(float, repeated, tag = "1")]
    pub joint_angles: Vec<f32>,
    #[prost(float, repeated, tag = "2")]
    pub joint_speeds: Vec<f32>,
    #[prost(float, repeated, tag = "3")]
    pub joint_accelerations: Vec<f32>,
    #[prost(float, tag = "4")]
    pub time_from_start: f32,
}

/// `Base.TrajectoryErrorType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum TrajectoryErrorType {
    Unspecified = 0,
    OutsideWorkspace = 1,
    ActuatorCountMismatch = 2,
    InvalidDuration = 3,
    JointNoMotion = 4,
    InvalidJointSpeed = 5,
    LargeSpeed = 6,
    InvalidAcceleration = 7,
    InvalidTimeStep = 8,
    InvalidTrajectorySize = 9,
    WrongMode = 10,
    InvalidJointPosition = 11,
    FileError = 12,
    NoFileInMemory = 13,
    IndexOutOfTraj = 14,
    AlreadyRunning = 15,
    WrongStartingPoint = 16,
    CartesianCannotStart = 17,
    WrongStartingSpeed = 18,
    InvalidPosition = 19,
    InvalidCartesianPosition = 20,
    InvalidCartesianOrientation = 21,
    InvalidCartesianLinearVelocity = 22,
    InvalidCartesianAngularVelocity = 23,
    InvalidJointTorque = 24,
    MultipleWaypointTypeList = 25,
    InitialWaypointNoStop = 26,
    FinalWaypointNoStop = 27,
    InvalidBlendingRadius = 28,
    InvalidReferenceFrame = 29,
    NumericalErrorImpossibleTrajectory = 30,
}

/// `Base.TrajectoryContinuityMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum TrajectoryContinuityMode {
    Unspecified = 0,
    Position = 1,
    Speed = 2,
    Acceleration = 3,
}
