//! What several services share: handles, timestamps, the error.

/// `Error`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Error {
    /// `ErrorCodes`.
    #[prost(int32, tag = "1")]
    pub error_code: i32,
    #[prost(uint32, tag = "2")]
    pub error_sub_code: u32,
    #[prost(string, tag = "3")]
    pub error_sub_string: String,
}

/// `Common.UserProfileHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UserProfileHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
    #[prost(fixed32, tag = "2")]
    pub permission: u32,
}

/// `Common.Connection`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Connection {
    #[prost(message, optional, tag = "1")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(string, tag = "2")]
    pub connection_information: String,
    #[prost(uint32, tag = "3")]
    pub connection_identifier: u32,
}

/// `Common.NotificationOptions`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct NotificationOptions {
    #[prost(enumeration = "NotificationType", tag = "1")]
    pub r#type: i32,
    #[prost(uint32, tag = "2")]
    pub rate_m_sec: u32,
    #[prost(float, tag = "3")]
    pub threshold_value: f32,
}

/// `Common.NotificationHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct NotificationHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
}

/// `Common.Timestamp`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Timestamp {
    #[prost(uint32, tag = "1")]
    pub sec: u32,
    #[prost(uint32, tag = "2")]
    pub usec: u32,
}

/// `Common.DeviceHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DeviceHandle {
    #[prost(enumeration = "DeviceType", tag = "1")]
    pub device_type: i32,
    #[prost(uint32, tag = "2")]
    pub device_identifier: u32,
    #[prost(uint32, tag = "3")]
    pub order: u32,
}

/// `Common.SafetyHandle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SafetyHandle {
    #[prost(uint32, tag = "1")]
    pub identifier: u32,
}

/// `Common.ArmState`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ArmState {
    Unspecified = 0,
    BaseInitialization = 1,
    Idle = 2,
    Initialization = 3,
    InFault = 4,
    Maintenance = 5,
    ServoingLowLevel = 6,
    ServoingReady = 7,
    ServoingPlayingSequence = 8,
    ServoingManuallyControlled = 9,
    BrakeReleasing = 10,
    Reserved = 255,
}

/// `Common.CartesianReferenceFrame`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum CartesianReferenceFrame {
    Unspecified = 0,
    Mixed = 1,
    Tool = 2,
    Base = 3,
}

/// `Common.DeviceTypes`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum DeviceType {
    Unspecified = 0,
    Base = 1,
    Vision = 2,
    BigActuator = 3,
    SmallActuator = 4,
    Interconnect = 5,
    Gripper = 6,
    MediumActuator = 7,
    XbigActuator = 8,
}

/// `Common.NotificationType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum NotificationType {
    Unspecified = 0,
    Threshold = 1,
    FixRate = 2,
    Event = 3,
}

/// The same of `Base` and of `VisionConfig`: `RotationMatrix`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RotationMatrix {
    #[prost(message, optional, tag = "1")]
    pub row1: Option<RotationMatrixRow>,
    #[prost(message, optional, tag = "2")]
    pub row2: Option<RotationMatrixRow>,
    #[prost(message, optional, tag = "3")]
    pub row3: Option<RotationMatrixRow>,
}

/// The same of `Base` and of `VisionConfig`: `RotationMatrixRow`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RotationMatrixRow {
    #[prost(float, tag = "1")]
    pub column1: f32,
    #[prost(float, tag = "2")]
    pub column2: f32,
    #[prost(float, tag = "3")]
    pub column3: f32,
}
