//! Service 2, Base: wrenches, admittance, and the control modes they are part of.

use super::common::{CartesianReferenceFrame, Connection, Timestamp, UserProfileHandle};

/// `Base.WrenchCommand`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct WrenchCommand {
    #[prost(enumeration = "CartesianReferenceFrame", tag = "1")]
    pub reference_frame: i32,
    #[prost(enumeration = "WrenchMode", tag = "2")]
    pub mode: i32,
    #[prost(message, optional, tag = "3")]
    pub wrench: Option<Wrench>,
    #[prost(uint32, tag = "4")]
    pub duration: u32,
}

/// `Base.Wrench`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Wrench {
    #[prost(float, tag = "1")]
    pub force_x: f32,
    #[prost(float, tag = "2")]
    pub force_y: f32,
    #[prost(float, tag = "3")]
    pub force_z: f32,
    #[prost(float, tag = "4")]
    pub torque_x: f32,
    #[prost(float, tag = "5")]
    pub torque_y: f32,
    #[prost(float, tag = "6")]
    pub torque_z: f32,
}

/// `Base.Admittance`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Admittance {
    #[prost(enumeration = "AdmittanceMode", tag = "1")]
    pub admittance_mode: i32,
}

/// `Base.ControlModeInformation`, whose numbers are those of `ControlConfig.ControlMode` but for 12.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BaseControlMode {
    #[prost(int32, tag = "1")]
    pub mode: i32,
}

/// `Base.ControlModeNotification` and `ControlConfig.ControlModeNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ControlModeNotification {
    #[prost(int32, tag = "1")]
    pub control_mode: i32,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub user_handle: Option<UserProfileHandle>,
    #[prost(message, optional, tag = "4")]
    pub connection: Option<Connection>,
}

/// `Base.WrenchMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum WrenchMode {
    Unspecified = 0,
    Restricted = 1,
    Normal = 2,
}

/// `Base.AdmittanceMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum AdmittanceMode {
    Unspecified = 0,
    Cartesian = 1,
    Joint = 2,
    NullSpace = 3,
    Disabled = 4,
}
