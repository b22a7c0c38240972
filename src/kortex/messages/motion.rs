//! Service 2, Base: joint angles, poses, speeds and fingers, in degrees and metres.

use super::common::CartesianReferenceFrame;

/// `Base.ConstrainedJointAngles`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConstrainedJointAngles {
    #[prost(message, optional, tag = "1")]
    pub joint_angles: Option<JointAngles>,
    #[prost(message, optional, tag = "2")]
    pub constraint: Option<JointTrajectoryConstraint>,
}

/// `Base.ConstrainedJointAngle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConstrainedJointAngle {
    #[prost(uint32, tag = "1")]
    pub joint_identifier: u32,
    #[prost(float, tag = "2")]
    pub value: f32,
    #[prost(message, optional, tag = "3")]
    pub constraint: Option<JointTrajectoryConstraint>,
}

/// `Base.JointAngles`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointAngles {
    #[prost(message, repeated, tag = "1")]
    pub joint_angles: Vec<JointAngle>,
}

/// `Base.JointAngle`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointAngle {
    #[prost(uint32, tag = "1")]
    pub joint_identifier: u32,
    #[prost(float, tag = "2")]
    pub value: f32,
}

/// `Base.JointTrajectoryConstraint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointTrajectoryConstraint {
    #[prost(enumeration = "JointTrajectoryConstraintType", tag = "1")]
    pub r#type: i32,
    #[prost(float, tag = "2")]
    pub value: f32,
}

/// `Base.ConstrainedPose`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConstrainedPose {
    #[prost(message, optional, tag = "1")]
    pub target_pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    pub constraint: Option<CartesianTrajectoryConstraint>,
}

/// `Base.ConstrainedPosition`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConstrainedPosition {
    #[prost(message, optional, tag = "1")]
    pub target_position: Option<Position>,
    #[prost(message, optional, tag = "2")]
    pub constraint: Option<CartesianTrajectoryConstraint>,
}

/// `Base.ConstrainedOrientation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ConstrainedOrientation {
    #[prost(message, optional, tag = "1")]
    pub target_orientation: Option<Orientation>,
    #[prost(message, optional, tag = "2")]
    pub constraint: Option<CartesianTrajectoryConstraint>,
}

/// `Base.Pose`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Pose {
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

/// `Base.Position`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Position {
    #[prost(float, tag = "1")]
    pub x: f32,
    #[prost(float, tag = "2")]
    pub y: f32,
    #[prost(float, tag = "3")]
    pub z: f32,
}

/// `Base.Orientation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Orientation {
    #[prost(float, tag = "1")]
    pub theta_x: f32,
    #[prost(float, tag = "2")]
    pub theta_y: f32,
    #[prost(float, tag = "3")]
    pub theta_z: f32,
}

/// `Base.CartesianTrajectoryConstraint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianTrajectoryConstraint {
    #[prost(oneof = "CartesianConstraint", tags = "1, 2")]
    pub kind: Option<CartesianConstraint>,
}

/// The one of `Base.CartesianTrajectoryConstraint.type` that is set.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum CartesianConstraint {
    #[prost(message, tag = "1")]
    Speed(CartesianSpeed),
    #[prost(float, tag = "2")]
    Duration(f32),
}

/// `Base.CartesianSpeed`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CartesianSpeed {
    #[prost(float, tag = "1")]
    pub translation: f32,
    #[prost(float, tag = "2")]
    pub orientation: f32,
}

/// `Base.IKData`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct IkData {
    #[prost(message, optional, tag = "1")]
    pub cartesian_pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    pub guess: Option<JointAngles>,
}

/// `Base.JointSpeeds`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointSpeeds {
    #[prost(message, repeated, tag = "1")]
    pub joint_speeds: Vec<JointSpeed>,
    #[prost(uint32, tag = "2")]
    pub duration: u32,
}

/// `Base.JointSpeed`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct JointSpeed {
    #[prost(uint32, tag = "1")]
    pub joint_identifier: u32,
    #[prost(float, tag = "2")]
    pub value: f32,
    #[prost(uint32, tag = "3")]
    pub duration: u32,
}

/// `Base.TwistCommand`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TwistCommand {
    #[prost(enumeration = "CartesianReferenceFrame", tag = "1")]
    pub reference_frame: i32,
    #[prost(message, optional, tag = "2")]
    pub twist: Option<Twist>,
    #[prost(uint32, tag = "3")]
    pub duration: u32,
}

/// `Base.Twist`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Twist {
    #[prost(float, tag = "1")]
    pub linear_x: f32,
    #[prost(float, tag = "2")]
    pub linear_y: f32,
    #[prost(float, tag = "3")]
    pub linear_z: f32,
    #[prost(float, tag = "4")]
    pub angular_x: f32,
    #[prost(float, tag = "5")]
    pub angular_y: f32,
    #[prost(float, tag = "6")]
    pub angular_z: f32,
}

/// `Base.GripperCommand`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GripperCommand {
    #[prost(enumeration = "GripperMode", tag = "1")]
    pub mode: i32,
    #[prost(message, optional, tag = "2")]
    pub gripper: Option<Gripper>,
    #[prost(uint32, tag = "3")]
    pub duration: u32,
}

/// `Base.Gripper`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Gripper {
    #[prost(message, repeated, tag = "1")]
    pub finger: Vec<Finger>,
}

/// `Base.Finger`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Finger {
    #[prost(uint32, tag = "1")]
    pub finger_identifier: u32,
    #[prost(float, tag = "2")]
    pub value: f32,
}

/// `Base.GripperRequest`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GripperRequest {
    #[prost(enumeration = "GripperMode", tag = "1")]
    pub mode: i32,
}

/// `Base.GripperMode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum GripperMode {
    Unspecified = 0,
    Force = 1,
    Speed = 2,
    Position = 3,
}

/// `Base.JointTrajectoryConstraintType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum JointTrajectoryConstraintType {
    Unspecified = 0,
    Duration = 1,
    Speed = 2,
}
