//! Service 5, `VisionConfig`: the cameras in the wrist.
//!
//! Numbers of enumerations are kept as they come; what they mean stands beside where they are used.

use super::common::RotationMatrix;

/// `SensorIdentifier`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SensorIdentifier {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
}

/// `SensorSettings`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SensorSettings {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub resolution: i32,
    #[prost(int32, tag = "3")]
    pub frame_rate: i32,
    #[prost(int32, tag = "4")]
    pub bit_rate: i32,
}

/// `IntrinsicProfileIdentifier`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct IntrinsicProfileIdentifier {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub resolution: i32,
}

/// `IntrinsicParameters`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct IntrinsicParameters {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub resolution: i32,
    #[prost(float, tag = "3")]
    pub principal_point_x: f32,
    #[prost(float, tag = "4")]
    pub principal_point_y: f32,
    #[prost(float, tag = "5")]
    pub focal_length_x: f32,
    #[prost(float, tag = "6")]
    pub focal_length_y: f32,
    #[prost(message, optional, tag = "7")]
    pub distortion_coeffs: Option<DistortionCoefficients>,
}

/// `DistortionCoefficients`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct DistortionCoefficients {
    #[prost(float, tag = "1")]
    pub k1: f32,
    #[prost(float, tag = "2")]
    pub k2: f32,
    #[prost(float, tag = "3")]
    pub k3: f32,
    #[prost(float, tag = "4")]
    pub p1: f32,
    #[prost(float, tag = "5")]
    pub p2: f32,
}

/// `ExtrinsicParameters`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ExtrinsicParameters {
    #[prost(message, optional, tag = "1")]
    pub rotation: Option<RotationMatrix>,
    #[prost(message, optional, tag = "2")]
    pub translation: Option<TranslationVector>,
}

/// `TranslationVector`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct TranslationVector {
    #[prost(float, tag = "1")]
    pub t_x: f32,
    #[prost(float, tag = "2")]
    pub t_y: f32,
    #[prost(float, tag = "3")]
    pub t_z: f32,
}

/// `OptionIdentifier`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct OptionIdentifier {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub option: i32,
}

/// `OptionValue`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct OptionValue {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub option: i32,
    #[prost(float, tag = "3")]
    pub value: f32,
}

/// `OptionInformation`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct OptionInformation {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub option: i32,
    #[prost(bool, tag = "3")]
    pub supported: bool,
    #[prost(bool, tag = "4")]
    pub read_only: bool,
    #[prost(float, tag = "5")]
    pub minimum: f32,
    #[prost(float, tag = "6")]
    pub maximum: f32,
    #[prost(float, tag = "7")]
    pub step: f32,
    #[prost(float, tag = "8")]
    pub default_value: f32,
}

/// `SensorFocusAction`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct SensorFocusAction {
    #[prost(int32, tag = "1")]
    pub sensor: i32,
    #[prost(int32, tag = "2")]
    pub focus_action: i32,
    #[prost(message, optional, tag = "3")]
    pub focus_point: Option<FocusPoint>,
    #[prost(message, optional, tag = "4")]
    pub manual_focus: Option<ManualFocus>,
}

/// `FocusPoint`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FocusPoint {
    #[prost(uint32, tag = "1")]
    pub x: u32,
    #[prost(uint32, tag = "2")]
    pub y: u32,
}

/// `ManualFocus`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct ManualFocus {
    #[prost(uint32, tag = "1")]
    pub value: u32,
}

/// `VisionNotification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct VisionNotification {
    #[prost(int32, tag = "1")]
    pub event: i32,
    #[prost(int32, tag = "2")]
    pub sensor: i32,
    #[prost(int32, tag = "3")]
    pub option: i32,
}
