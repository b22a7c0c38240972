//! Service 2, Base: sequences of actions, protection zones, snapshots.

use super::base::Action;
use super::common::{Connection, RotationMatrix, Timestamp, UserProfileHandle};

/// `Base.Sequence`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Sequence {
    #[prost(message, optional, tag = "1")]
    pub handle: Option<SequenceHandle>,
    #[prost(string, tag = "2")]
    pub name: String,
    #[prost(string, tag = "3")]
    pub application_data: String,
    #[prost(message, repeated, tag = "4")]
    pub tasks: Vec<SequenceTask>,
}

/// `Base.SequenceTask`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SequenceTask {
    #[prost(uint32, tag = "1")]
    pub group_identifier: u32,
    #[prost(message, optional, tag = "2")]
    pub action: Option<Action>,
    #[prost(string, tag = "3")]
    pub application_data: String,
}

/// `Base.SequenceHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SequenceHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
    #[prost(fixed32, tag = "2")]
    pub permission: u32,
}

/// `Base.SequenceList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SequenceList {
    #[prost(message, repeated, tag = "1")]
    pub sequence_list: Vec<Sequence>,
}

/// `Base.SequenceInfoNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SequenceInfoNotification {
    #[prost(enumeration = "SequenceEvent", tag = "1")]
    pub event_identifier: i32,
    #[prost(message, optional, tag = "2")]
    pub sequence_handle: Option<SequenceHandle>,
    #[prost(uint32, tag = "3")]
    pub task_index: u32,
    #[prost(uint32, tag = "4")]
    pub group_identifier: u32,
    #[prost(message, optional, tag = "5")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "6")]
    pub user_handle: Option<UserProfileHandle>,
    /// `SubErrorCodes`.
    #[prost(int32, tag = "7")]
    pub abort_details: i32,
    #[prost(message, optional, tag = "8")]
    pub connection: Option<Connection>,
}

/// `Base.ProtectionZone`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ProtectionZone {
    #[prost(message, optional, tag = "1")]
    pub handle: Option<ProtectionZoneHandle>,
    #[prost(string, tag = "2")]
    pub name: String,
    #[prost(string, tag = "3")]
    pub application_data: String,
    #[prost(bool, tag = "4")]
    pub is_enabled: bool,
    #[prost(message, optional, tag = "5")]
    pub shape: Option<ZoneShape>,
    #[prost(message, repeated, tag = "6")]
    pub limitations: Vec<CartesianLimitation>,
    #[prost(message, repeated, tag = "7")]
    pub envelope_limitations: Vec<CartesianLimitation>,
}

/// `Base.ProtectionZoneHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ProtectionZoneHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
    #[prost(fixed32, tag = "2")]
    pub permission: u32,
}

/// `Base.ProtectionZoneList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ProtectionZoneList {
    #[prost(message, repeated, tag = "1")]
    pub protection_zones: Vec<ProtectionZone>,
}

/// `Base.ProtectionZoneNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ProtectionZoneNotification {
    #[prost(enumeration = "ProtectionZoneEvent", tag = "1")]
    pub event: i32,
    #[prost(message, optional, tag = "2")]
    pub handle: Option<ProtectionZoneHandle>,
    #[prost(message, optional, tag = "3")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "4")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(message, optional, tag = "5")]
    pub connection: Option<Connection>,
}

/// `Base.ProtectionZoneEvent`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ProtectionZoneEvent {
    Unspecified = 0,
    Reached = 1,
    Entered = 2,
    Exited = 3,
}

/// `Base.ZoneShape`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ZoneShape {
    /// `Base.ShapeType`: 1 cylinder, 2 sphere, 3 rectangular prism.
    #[prost(int32, tag = "1")]
    pub shape_type: i32,
    #[prost(message, optional, tag = "2")]
    pub origin: Option<Point>,
    #[prost(message, optional, tag = "3")]
    pub orientation: Option<RotationMatrix>,
    #[prost(float, repeated, tag = "4")]
    pub dimensions: Vec<f32>,
    #[prost(float, tag = "5")]
    pub envelope_thickness: f32,
}

/// `Base.Point`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Point {
    #[prost(float, tag = "1")]
    pub x: f32,
    #[prost(float, tag = "2")]
    pub y: f32,
    #[prost(float, tag = "3")]
    pub z: f32,
}

/// `Base.CartesianLimitation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianLimitation {
    /// `Base.LimitationType`.
    #[prost(int32, tag = "1")]
    pub r#type: i32,
    #[prost(float, tag = "2")]
    pub translation: f32,
    #[prost(float, tag = "3")]
    pub orientation: f32,
}

/// `Base.Snapshot`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Snapshot {
    #[prost(enumeration = "SnapshotType", tag = "1")]
    pub snapshot_type: i32,
}

/// `Base.EventIdSequenceInfoNotification`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum SequenceEvent {
    Unspecified = 0,
    Completed = 1,
    Aborted = 2,
    Paused = 3,
    TaskStarted = 4,
    TaskCompleted = 5,
    Started = 6,
}

/// `Base.SnapshotType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum SnapshotType {
    Unspecified = 0,
    CartesianPosition = 1,
    JointPosition = 2,
    Gripper = 3,
    Combined = 4,
}
