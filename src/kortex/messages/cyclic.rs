//! Service 3, `BaseCyclic`, with the interconnect and the gripper that ride along: one command and one feedback a cycle.

use super::common::ArmState;

/// `BaseCyclic.Command`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Command {
    #[prost(fixed32, tag = "1")]
    pub frame_id: u32,
    #[prost(message, repeated, tag = "2")]
    pub actuators: Vec<ActuatorCommand>,
    #[prost(message, optional, tag = "3")]
    pub interconnect: Option<InterconnectCommand>,
}

/// `BaseCyclic.ActuatorCommand`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActuatorCommand {
    #[prost(fixed32, tag = "1")]
    pub command_id: u32,
    #[prost(fixed32, tag = "2")]
    pub flags: u32,
    #[prost(float, tag = "3")]
    pub position: f32,
    #[prost(float, tag = "4")]
    pub velocity: f32,
    #[prost(float, tag = "5")]
    pub torque_joint: f32,
    #[prost(float, tag = "6")]
    pub current_motor: f32,
}

/// `BaseCyclic.Feedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Feedback {
    #[prost(fixed32, tag = "1")]
    pub frame_id: u32,
    #[prost(message, optional, tag = "2")]
    pub base: Option<BaseFeedback>,
    #[prost(message, repeated, tag = "3")]
    pub actuators: Vec<ActuatorFeedback>,
    #[prost(message, optional, tag = "4")]
    pub interconnect: Option<InterconnectFeedback>,
}

impl Feedback {
    /// Returns how far the gripper is closed, from 0 to 1, if it says so.
    pub fn closed(&self) -> Option<f64> {
        let Some(ToolFeedback::GripperFeedback(gripper)) =
            self.interconnect.as_ref().and_then(|all| all.tool_feedback.as_ref())
        else {
            return None;
        };
        let percent = gripper.motor.first()?.position;
        percent.is_finite().then(|| f64::from(percent) / 100.0)
    }
}

/// `BaseCyclic.BaseFeedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BaseFeedback {
    #[prost(uint32, tag = "1")]
    pub active_state_connection_identifier: u32,
    #[prost(enumeration = "ArmState", tag = "2")]
    pub active_state: i32,
    #[prost(float, tag = "3")]
    pub arm_voltage: f32,
    #[prost(float, tag = "4")]
    pub arm_current: f32,
    #[prost(float, tag = "5")]
    pub temperature_cpu: f32,
    #[prost(float, tag = "6")]
    pub temperature_ambient: f32,
    #[prost(float, tag = "7")]
    pub imu_acceleration_x: f32,
    #[prost(float, tag = "8")]
    pub imu_acceleration_y: f32,
    #[prost(float, tag = "9")]
    pub imu_acceleration_z: f32,
    #[prost(float, tag = "10")]
    pub imu_angular_velocity_x: f32,
    #[prost(float, tag = "11")]
    pub imu_angular_velocity_y: f32,
    #[prost(float, tag = "12")]
    pub imu_angular_velocity_z: f32,
    #[prost(float, tag = "13")]
    pub tool_pose_x: f32,
    #[prost(float, tag = "14")]
    pub tool_pose_y: f32,
    #[prost(float, tag = "15")]
    pub tool_pose_z: f32,
    #[prost(float, tag = "16")]
    pub tool_pose_theta_x: f32,
    #[prost(float, tag = "17")]
    pub tool_pose_theta_y: f32,
    #[prost(float, tag = "18")]
    pub tool_pose_theta_z: f32,
    #[prost(float, tag = "19")]
    pub tool_twist_linear_x: f32,
    #[prost(float, tag = "20")]
    pub tool_twist_linear_y: f32,
    #[prost(float, tag = "21")]
    pub tool_twist_linear_z: f32,
    #[prost(float, tag = "22")]
    pub tool_twist_angular_x: f32,
    #[prost(float, tag = "23")]
    pub tool_twist_angular_y: f32,
    #[prost(float, tag = "24")]
    pub tool_twist_angular_z: f32,
    #[prost(float, tag = "25")]
    pub tool_external_wrench_force_x: f32,
    #[prost(float, tag = "26")]
    pub tool_external_wrench_force_y: f32,
    #[prost(float, tag = "27")]
    pub tool_external_wrench_force_z: f32,
    #[prost(float, tag = "28")]
    pub tool_external_wrench_torque_x: f32,
    #[prost(float, tag = "29")]
    pub tool_external_wrench_torque_y: f32,
    #[prost(float, tag = "30")]
    pub tool_external_wrench_torque_z: f32,
    #[prost(fixed32, tag = "31")]
    pub fault_bank_a: u32,
    #[prost(fixed32, tag = "32")]
    pub fault_bank_b: u32,
    #[prost(fixed32, tag = "33")]
    pub warning_bank_a: u32,
    #[prost(fixed32, tag = "34")]
    pub warning_bank_b: u32,
    #[prost(float, tag = "35")]
    pub commanded_tool_pose_x: f32,
    #[prost(float, tag = "36")]
    pub commanded_tool_pose_y: f32,
    #[prost(float, tag = "37")]
    pub commanded_tool_pose_z: f32,
    #[prost(float, tag = "38")]
    pub commanded_tool_pose_theta_x: f32,
    #[prost(float, tag = "39")]
    pub commanded_tool_pose_theta_y: f32,
    #[prost(float, tag = "40")]
    pub commanded_tool_pose_theta_z: f32,
}

/// `BaseCyclic.ActuatorFeedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActuatorFeedback {
    #[prost(fixed32, tag = "1")]
    pub command_id: u32,
    #[prost(fixed32, tag = "2")]
    pub status_flags: u32,
    #[prost(fixed32, tag = "3")]
    pub jitter_comm: u32,
    #[prost(float, tag = "4")]
    pub position: f32,
    #[prost(float, tag = "5")]
    pub velocity: f32,
    #[prost(float, tag = "6")]
    pub torque: f32,
    #[prost(float, tag = "7")]
    pub current_motor: f32,
    #[prost(float, tag = "8")]
    pub voltage: f32,
    #[prost(float, tag = "9")]
    pub temperature_motor: f32,
    #[prost(float, tag = "10")]
    pub temperature_core: f32,
    #[prost(fixed32, tag = "11")]
    pub fault_bank_a: u32,
    #[prost(fixed32, tag = "12")]
    pub fault_bank_b: u32,
    #[prost(fixed32, tag = "13")]
    pub warning_bank_a: u32,
    #[prost(fixed32, tag = "14")]
    pub warning_bank_b: u32,
}

/// `InterconnectCyclic.Command`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct InterconnectCommand {
    #[prost(message, optional, tag = "1")]
    pub command_id: Option<InterconnectMessageId>,
    #[prost(fixed32, tag = "2")]
    pub flags: u32,
    #[prost(oneof = "ToolCommand", tags = "3")]
    pub tool_command: Option<ToolCommand>,
}

/// The one of `InterconnectCyclic.Command.tool_command` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum ToolCommand {
    #[prost(message, tag = "3")]
    GripperCommand(GripperCyclicCommand),
}

/// `InterconnectCyclic.Feedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct InterconnectFeedback {
    #[prost(message, optional, tag = "1")]
    pub feedback_id: Option<InterconnectMessageId>,
    #[prost(fixed32, tag = "2")]
    pub status_flags: u32,
    #[prost(fixed32, tag = "3")]
    pub jitter_comm: u32,
    #[prost(float, tag = "4")]
    pub imu_acceleration_x: f32,
    #[prost(float, tag = "5")]
    pub imu_acceleration_y: f32,
    #[prost(float, tag = "6")]
    pub imu_acceleration_z: f32,
    #[prost(float, tag = "7")]
    pub imu_angular_velocity_x: f32,
    #[prost(float, tag = "8")]
    pub imu_angular_velocity_y: f32,
    #[prost(float, tag = "9")]
    pub imu_angular_velocity_z: f32,
    #[prost(float, tag = "10")]
    pub voltage: f32,
    #[prost(float, tag = "11")]
    pub temperature_core: f32,
    #[prost(fixed32, tag = "12")]
    pub fault_bank_a: u32,
    #[prost(fixed32, tag = "13")]
    pub fault_bank_b: u32,
    #[prost(fixed32, tag = "14")]
    pub warning_bank_a: u32,
    #[prost(fixed32, tag = "15")]
    pub warning_bank_b: u32,
    #[prost(oneof = "ToolFeedback", tags = "18")]
    pub tool_feedback: Option<ToolFeedback>,
}

/// The one of `InterconnectCyclic.Feedback.tool_feedback` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum ToolFeedback {
    #[prost(message, tag = "18")]
    GripperFeedback(GripperCyclicFeedback),
}

/// `InterconnectCyclic.MessageId`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct InterconnectMessageId {
    #[prost(fixed32, tag = "1")]
    pub identifier: u32,
}

/// `GripperCyclic.Command`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GripperCyclicCommand {
    #[prost(message, optional, tag = "1")]
    pub command_id: Option<GripperMessageId>,
    #[prost(fixed32, tag = "2")]
    pub flags: u32,
    #[prost(message, repeated, tag = "3")]
    pub motor_cmd: Vec<MotorCommand>,
}

/// `GripperCyclic.MotorCommand`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct MotorCommand {
    #[prost(fixed32, tag = "1")]
    pub motor_id: u32,
    #[prost(float, tag = "3")]
    pub position: f32,
    #[prost(float, tag = "4")]
    pub velocity: f32,
    #[prost(float, tag = "5")]
    pub force: f32,
}

/// `GripperCyclic.Feedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GripperCyclicFeedback {
    #[prost(message, optional, tag = "1")]
    pub feedback_id: Option<GripperMessageId>,
    #[prost(fixed32, tag = "2")]
    pub status_flags: u32,
    #[prost(fixed32, tag = "3")]
    pub fault_bank_a: u32,
    #[prost(fixed32, tag = "4")]
    pub fault_bank_b: u32,
    #[prost(fixed32, tag = "5")]
    pub warning_bank_a: u32,
    #[prost(fixed32, tag = "6")]
    pub warning_bank_b: u32,
    #[prost(message, repeated, tag = "7")]
    pub motor: Vec<MotorFeedback>,
}

/// `GripperCyclic.MotorFeedback`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct MotorFeedback {
    #[prost(fixed32, tag = "1")]
    pub motor_id: u32,
    #[prost(float, tag = "4")]
    pub position: f32,
    #[prost(float, tag = "5")]
    pub velocity: f32,
    #[prost(float, tag = "7")]
    pub current_motor: f32,
    #[prost(float, tag = "8")]
    pub voltage: f32,
    #[prost(float, tag = "10")]
    pub temperature_motor: f32,
}

/// `GripperCyclic.MessageId`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GripperMessageId {
    #[prost(fixed32, tag = "1")]
    pub identifier: u32,
}

/// `BaseCyclic.CustomData`, without the words whose meaning is the vendor's own.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CustomData {
    #[prost(fixed32, tag = "1")]
    pub frame_id: u32,
    #[prost(message, repeated, tag = "10")]
    pub actuators_custom_data: Vec<ActuatorCustomData>,
}

/// `BaseCyclic.ActuatorCustomData`, without the words whose meaning is the vendor's own.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ActuatorCustomData {
    #[prost(fixed32, tag = "1")]
    pub command_id: u32,
}
