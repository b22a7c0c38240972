//! Services 9, 10, 16 and 23: devices, actuators, limits and the tool.

use std::collections::BTreeMap;

use crate::kortex::messages::common::{DeviceHandle, DeviceType};
use crate::kortex::messages::config::{
    ActuatorMode, BrakeType, CartesianReferenceFrameInfo, CartesianTransform,
    CompleteProductConfiguration, DesiredSpeeds, DeviceHandles, EndEffectorType, GravityVector,
    KinematicLimits, MassCenter, ModelId, PayloadInformation, ToolConfiguration,
};
use crate::kortex::messages::trajectory::TrajectoryErrorReport;
use crate::motion::robot::Robot;

use super::error::Refused;
use super::paths::tool_speeds;

/// What the emulator calls its firmware.
pub(super) const FIRMWARE: &str = "2.6.0-emulated";

/// Control modes that have soft limits of their own: joystick, trajectories, admittances, waypoints.
const MODES: [i32; 8] = [1, 2, 4, 5, 6, 7, 8, 12];

/// What can be asked and set, and the last thing said against a trajectory.
#[derive(Debug, Clone)]
pub(super) struct Config {
    pub(super) hard: KinematicLimits,
    pub(super) soft: BTreeMap<i32, KinematicLimits>,
    pub(super) tool: ToolConfiguration,
    pub(super) payload: PayloadInformation,
    pub(super) gravity: GravityVector,
    /// The frame of Cartesian commands and the speeds of joysticks, kept and not used.
    pub(super) frame: CartesianReferenceFrameInfo,
    pub(super) desired: DesiredSpeeds,
    actuators: Vec<Actuator>,
    pub(super) product: CompleteProductConfiguration,
    pub(super) last_report: TrajectoryErrorReport,
}

/// One actuator's own settings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Actuator {
    pub(super) mode: ActuatorMode,
    pub(super) command_mode: i32,
    pub(super) is_servoing: bool,
}

/// An actuator after the arm is switched on.
const ACTUATOR: Actuator =
    Actuator { mode: ActuatorMode::Position, command_mode: 0, is_servoing: true };

pub(super) fn default_tool() -> ToolConfiguration {
    // Kinova's own for the Robotiq 2F-85: 0.925 kg, 120 mm along z; its centre from a public model.
    ToolConfiguration {
        tool_transform: Some(CartesianTransform { z: 0.120, ..CartesianTransform::default() }),
        tool_mass: 0.925,
        tool_mass_center: Some(MassCenter { z: 0.058, ..MassCenter::default() }),
    }
}

pub(super) const GRAVITY: GravityVector = GravityVector { x: 0.0, y: 0.0, z: -9.81 };

impl Config {
    /// Returns what an arm like this robot says of itself.
    pub(super) fn of(robot: &Robot) -> Self {
        let joints = robot.joints();
        // 5.2 rad/s² and 10 rad/s²: the accelerations of which the vendor's planning limits are 95 %.
        let hardest = |large: bool| if large { 5.2_f32 } else { 10.0 };
        let large = |i: usize| i < joints.len().min(4);
        let hard = KinematicLimits {
            control_mode: 0,
            twist_linear: 0.5,
            twist_angular: 100.0,
            joint_speed_limits: joints.iter().map(|j| j.velocity.to_degrees() as f32).collect(),
            joint_acceleration_limits: (0..joints.len())
                .map(|i| hardest(large(i)).to_degrees())
                .collect(),
        };
        let product = CompleteProductConfiguration {
            kin: "emulated".to_owned(),
            model: ModelId::L53 as i32,
            assembly_plant: "emulated".to_owned(),
            model_year: "2026".to_owned(),
            degree_of_freedom: joints.len() as u32,
            base_type: 2,
            end_effector_type: EndEffectorType::Robotiq2f85 as i32,
            vision_module_type: 2,
            interface_module_type: 2,
            arm_laterality: 1,
            wrist_type: 2,
            brake_type: BrakeType::NotInstalled as i32,
        };
        Self {
            soft: soft(&hard, 1.0),
            tool: default_tool(),
            payload: PayloadInformation::default(),
            gravity: GRAVITY,
            frame: CartesianReferenceFrameInfo { reference_frame: 3 },
            desired: DesiredSpeeds {
                linear: hard.twist_linear,
                angular: hard.twist_angular,
                joint_speed: hard.joint_speed_limits.clone(),
            },
            actuators: vec![ACTUATOR; joints.len()],
            hard,
            product,
            last_report: TrajectoryErrorReport::default(),
        }
    }

    /// Sets all soft limits to a share of the hard ones.
    pub(super) fn soften(&mut self, share: f32) {
        self.soft = soft(&self.hard, share);
    }

    /// Brings the actuators back to what they are after the arm is switched on.
    pub(super) fn settle(&mut self) {
        self.actuators.fill(ACTUATOR);
    }

    /// Returns the soft limits of a control mode, or the hard ones where it has none.
    pub(super) fn soft(&self, mode: i32) -> &KinematicLimits {
        self.soft.get(&mode).unwrap_or(&self.hard)
    }

    /// Returns the soft limits of the tool's speed in a control mode, m/s and rad/s.
    pub(super) fn tool_speeds(&self, mode: i32) -> (f64, f64) {
        tool_speeds(self.soft(mode))
    }

    /// Returns what an actuator (from 0) is told in low-level servoing.
    pub(super) fn actuator_mode(&self, joint: usize) -> ActuatorMode {
        self.actuators.get(joint).map_or(ActuatorMode::None, |actuator| actuator.mode)
    }

    pub(super) fn soft_mut(&mut self, mode: i32) -> Result<&mut KinematicLimits, Refused> {
        let found = self.soft.get_mut(&mode);
        found.ok_or(Refused::NoSoftLimits)
    }

    /// Says whether a device identifier is that of one kind of device.
    pub(super) fn must_be(&self, identifier: u8, kind: DeviceType) -> Result<(), Refused> {
        if self.device(identifier)? == kind {
            return Ok(());
        }
        Err(Refused::OtherDevice)
    }

    /// Returns what stands at a device identifier: the base, actuators from 1, interconnect, gripper, cameras.
    pub(super) fn device(&self, identifier: u8) -> Result<DeviceType, Refused> {
        let n = self.actuators.len() as u8;
        match identifier {
            0 => Ok(DeviceType::Base),
            i if i <= n.min(4) => Ok(DeviceType::BigActuator),
            i if i <= n => Ok(DeviceType::SmallActuator),
            i if i == n + 1 => Ok(DeviceType::Interconnect),
            i if i == n + 2 => Ok(DeviceType::Gripper),
            i if i == n + 3 => Ok(DeviceType::Vision),
            _ => Err(Refused::NoDevice),
        }
    }

    pub(super) fn devices(&self) -> DeviceHandles {
        let handles = (0..=self.actuators.len() as u8 + 3).filter_map(|identifier| {
            let device_type = self.device(identifier).ok()? as i32;
            let identifier = u32::from(identifier);
            Some(DeviceHandle { device_type, device_identifier: identifier, order: identifier })
        });
        DeviceHandles { device_handle: handles.collect() }
    }

    pub(super) fn actuator(&mut self, identifier: u8) -> Result<&mut Actuator, Refused> {
        let found = usize::from(identifier).checked_sub(1).and_then(|i| self.actuators.get_mut(i));
        found.ok_or(Refused::NoActuator)
    }
}

pub(super) fn soft(hard: &KinematicLimits, share: f32) -> BTreeMap<i32, KinematicLimits> {
    let scaled = |list: &[f32]| list.iter().map(|limit| limit * share).collect();
    MODES
        .into_iter()
        .map(|mode| {
            let limits = KinematicLimits {
                control_mode: mode,
                twist_linear: hard.twist_linear * share,
                twist_angular: hard.twist_angular * share,
                joint_speed_limits: scaled(&hard.joint_speed_limits),
                joint_acceleration_limits: scaled(&hard.joint_acceleration_limits),
            };
            (mode, limits)
        })
        .collect()
}

/// Returns limits that are positive and not above the hard ones.
pub(super) fn allowed(asked: &[f32], hard: &[f32]) -> Result<Vec<f32>, Refused> {
    if asked.len() != hard.len() {
        return Err(Refused::JointCount);
    }
    for (&asked, &hard) in asked.iter().zip(hard) {
        if asked > hard * 1.0001 {
            return Err(Refused::AboveHardLimit);
        }
        if asked.is_nan() || asked <= 0.0 {
            return Err(Refused::NotPositive);
        }
    }
    Ok(asked.to_vec())
}
