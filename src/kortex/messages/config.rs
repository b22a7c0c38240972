//! Services 9, 10, 16 and 23: devices, actuators, limits and the tool.

use super::common::{DeviceHandle, DeviceType};

/// `DeviceManager.DeviceHandles`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DeviceHandles {
    #[prost(message, repeated, tag = "1")]
    pub device_handle: Vec<DeviceHandle>,
}

/// `DeviceConfig.DeviceType`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DeviceTypeInformation {
    #[prost(enumeration = "DeviceType", tag = "1")]
    pub device_type: i32,
}

/// `DeviceConfig.RunMode`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RunMode {
    /// `DeviceConfig.RunModes`.
    #[prost(int32, tag = "1")]
    pub run_mode: i32,
}

/// `DeviceConfig.RebootRqst`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RebootRequest {
    /// ms.
    #[prost(uint32, tag = "1")]
    pub delay: u32,
}

/// `DeviceConfig.FirmwareVersion`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FirmwareVersion {
    #[prost(uint32, tag = "1")]
    pub firmware_version: u32,
}

/// `DeviceConfig.BootloaderVersion`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BootloaderVersion {
    #[prost(uint32, tag = "1")]
    pub bootloader_version: u32,
}

/// `DeviceConfig.ModelNumber`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ModelNumber {
    #[prost(string, tag = "1")]
    pub model_number: String,
}

/// `DeviceConfig.PartNumber`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PartNumber {
    #[prost(string, tag = "1")]
    pub part_number: String,
}

/// `DeviceConfig.SerialNumber`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SerialNumber {
    #[prost(string, tag = "1")]
    pub serial_number: String,
}

/// `DeviceConfig.MACAddress`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct MacAddress {
    #[prost(bytes = "vec", tag = "1")]
    pub mac_address: Vec<u8>,
}

/// `DeviceConfig.IPv4Settings`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Ipv4Settings {
    #[prost(uint32, tag = "1")]
    pub ipv4_address: u32,
    #[prost(uint32, tag = "2")]
    pub ipv4_subnet_mask: u32,
    #[prost(uint32, tag = "3")]
    pub ipv4_default_gateway: u32,
}

/// `DeviceConfig.PartNumberRevision`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PartNumberRevision {
    #[prost(string, tag = "1")]
    pub part_number_revision: String,
}

/// `ActuatorConfig.ControlModeInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActuatorModeInformation {
    #[prost(enumeration = "ActuatorMode", tag = "1")]
    pub control_mode: i32,
}

/// `ActuatorConfig.CommandModeInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CommandModeInformation {
    /// `ActuatorConfig.CommandMode`.
    #[prost(int32, tag = "1")]
    pub command_mode: i32,
}

/// `ActuatorConfig.Servoing`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Servoing {
    #[prost(bool, tag = "1")]
    pub enabled: bool,
}

/// `ControlConfig.KinematicLimits`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct KinematicLimits {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
    #[prost(float, tag = "2")]
    pub twist_linear: f32,
    #[prost(float, tag = "3")]
    pub twist_angular: f32,
    #[prost(float, repeated, tag = "4")]
    pub joint_speed_limits: Vec<f32>,
    #[prost(float, repeated, tag = "5")]
    pub joint_acceleration_limits: Vec<f32>,
}

/// `ControlConfig.KinematicLimitsList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct KinematicLimitsList {
    #[prost(message, repeated, tag = "1")]
    pub kinematic_limits_list: Vec<KinematicLimits>,
}

/// `ControlConfig.ControlModeInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ControlModeInformation {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
}

/// `ControlConfig.ToolConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ToolConfiguration {
    #[prost(message, optional, tag = "1")]
    pub tool_transform: Option<CartesianTransform>,
    #[prost(float, tag = "2")]
    pub tool_mass: f32,
    #[prost(message, optional, tag = "3")]
    pub tool_mass_center: Option<MassCenter>,
}

/// `ControlConfig.CartesianTransform`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianTransform {
    #[prost(float, tag = "1")]
    pub x: f32,
    #[prost(float, tag = "2")]
    pub y: f32,
    #[prost(float, tag = "3")]
    pub z: f32,
    #[prost(float, tag = "4")]
    pub theta_x: f32,
    #[prost(float, tag = "5")]
    pub theta_y: f32,
    #[prost(float, tag = "6")]
    pub theta_z: f32,
}

/// `ControlConfig.Position`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct MassCenter {
    #[prost(float, tag = "1")]
    pub x: f32,
    #[prost(float, tag = "2")]
    pub y: f32,
    #[prost(float, tag = "3")]
    pub z: f32,
}

/// `ControlConfig.PayloadInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PayloadInformation {
    #[prost(float, tag = "1")]
    pub payload_mass: f32,
    #[prost(message, optional, tag = "2")]
    pub payload_mass_center: Option<MassCenter>,
}

/// `ControlConfig.GravityVector`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GravityVector {
    #[prost(float, tag = "1")]
    pub x: f32,
    #[prost(float, tag = "2")]
    pub y: f32,
    #[prost(float, tag = "3")]
    pub z: f32,
}

/// `ControlConfig.JointSpeedSoftLimits`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointSpeedSoftLimits {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
    #[prost(float, repeated, tag = "2")]
    pub joint_speed_soft_limits: Vec<f32>,
}

/// `ControlConfig.JointAccelerationSoftLimits`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointAccelerationSoftLimits {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
    #[prost(float, repeated, tag = "2")]
    pub joint_acceleration_soft_limits: Vec<f32>,
}

/// `ControlConfig.TwistLinearSoftLimit`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TwistLinearSoftLimit {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
    #[prost(float, tag = "2")]
    pub twist_linear_soft_limit: f32,
}

/// `ControlConfig.TwistAngularSoftLimit`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TwistAngularSoftLimit {
    #[prost(enumeration = "ControlMode", tag = "1")]
    pub control_mode: i32,
    #[prost(float, tag = "2")]
    pub twist_angular_soft_limit: f32,
}

/// `ControlConfig.CartesianReferenceFrameInfo`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianReferenceFrameInfo {
    /// `Common.CartesianReferenceFrame`.
    #[prost(int32, tag = "1")]
    pub reference_frame: i32,
}

/// `ControlConfig.LinearTwist`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct LinearTwist {
    #[prost(float, tag = "1")]
    pub linear: f32,
}

/// `ControlConfig.AngularTwist`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct AngularTwist {
    #[prost(float, tag = "1")]
    pub angular: f32,
}

/// `ControlConfig.JointSpeeds`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DesiredJointSpeeds {
    #[prost(float, repeated, tag = "1")]
    pub joint_speed: Vec<f32>,
}

/// `ControlConfig.DesiredSpeeds`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DesiredSpeeds {
    #[prost(float, tag = "1")]
    pub linear: f32,
    #[prost(float, tag = "2")]
    pub angular: f32,
    #[prost(float, repeated, tag = "3")]
    pub joint_speed: Vec<f32>,
}

/// `ProductConfiguration.CompleteProductConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CompleteProductConfiguration {
    #[prost(string, tag = "1")]
    pub kin: String,
    #[prost(enumeration = "ModelId", tag = "2")]
    pub model: i32,
    #[prost(string, tag = "4")]
    pub assembly_plant: String,
    #[prost(string, tag = "5")]
    pub model_year: String,
    #[prost(uint32, tag = "6")]
    pub degree_of_freedom: u32,
    /// `ProductConfiguration.BaseType`.
    #[prost(int32, tag = "7")]
    pub base_type: i32,
    #[prost(enumeration = "EndEffectorType", tag = "8")]
    pub end_effector_type: i32,
    /// `ProductConfiguration.VisionModuleType`.
    #[prost(int32, tag = "9")]
    pub vision_module_type: i32,
    /// `ProductConfiguration.InterfaceModuleType`.
    #[prost(int32, tag = "10")]
    pub interface_module_type: i32,
    /// `ProductConfiguration.ArmLaterality`.
    #[prost(int32, tag = "11")]
    pub arm_laterality: i32,
    /// `ProductConfiguration.WristType`.
    #[prost(int32, tag = "12")]
    pub wrist_type: i32,
    #[prost(enumeration = "BrakeType", tag = "13")]
    pub brake_type: i32,
}

/// `ActuatorConfig.ControlMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ActuatorMode {
    None = 0,
    Position = 1,
    Velocity = 2,
    Torque = 3,
    Current = 4,
    Custom = 5,
    TorqueHighVelocity = 6,
}

/// `ControlConfig.ControlMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ControlMode {
    Unspecified = 0,
    AngularJoystick = 1,
    CartesianJoystick = 2,
    AngularTrajectory = 4,
    CartesianTrajectory = 5,
    CartesianAdmittance = 6,
    JointAdmittance = 7,
    NullSpaceAdmittance = 8,
    ForceControl = 10,
    ForceControlMotionRestricted = 11,
    CartesianWaypointTrajectory = 12,
    Idle = 13,
}

/// `ProductConfiguration.ModelId`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum ModelId {
    Unspecified = 0,
    L53 = 1,
    L31 = 2,
    Hdk = 3,
}

/// `ProductConfiguration.EndEffectorType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum EndEffectorType {
    Unspecified = 0,
    NotInstalled = 1,
    L31Gripper2f = 2,
    Robotiq2f85 = 3,
    Robotiq2f140 = 4,
}

/// `ProductConfiguration.BrakeType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum BrakeType {
    Unspecified = 0,
    NotInstalled = 1,
    Spoke = 2,
    Clutch = 3,
}
