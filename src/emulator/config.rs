//! Services 9, 10, 16 and 23: devices, actuators, limits and the tool.

use std::collections::BTreeMap;

use crate::execution::kortex::messages::common::{DeviceHandle, DeviceType, NotificationHandle};
use crate::execution::kortex::messages::config::{
    ActuatorMode, ActuatorModeInformation, AngularTwist, BootloaderVersion, BrakeType,
    CartesianReferenceFrameInfo, CartesianTransform, CommandModeInformation,
    CompleteProductConfiguration, ControlModeInformation, DesiredJointSpeeds, DesiredSpeeds,
    DeviceHandles, DeviceTypeInformation, EndEffectorType, FirmwareVersion, GravityVector,
    Ipv4Settings, JointAccelerationSoftLimits, JointSpeedSoftLimits, KinematicLimits,
    KinematicLimitsList, LinearTwist, MacAddress, MassCenter, ModelId, ModelNumber, PartNumber,
    PartNumberRevision, PayloadInformation, RebootRequest, RunMode, SerialNumber, Servoing,
    ToolConfiguration, TwistAngularSoftLimit, TwistLinearSoftLimit,
};
use crate::execution::kortex::messages::trajectory::TrajectoryErrorReport;
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc::{
    actuator_config as actuator, control_config as control, device_config as device, device_manager,
};
use crate::motion::robot::Robot;

use super::controller::{Answer, Ask, Controller, No, done, say};

/// What the emulator calls its firmware.
pub(super) const FIRMWARE: &str = "2.6.0-emulated";

/// Control modes that have soft limits of their own: joystick, trajectories, admittances, waypoints.
const MODES: [i32; 8] = [1, 2, 4, 5, 6, 7, 8, 12];

/// What can be asked and set, and the last thing said against a trajectory.
#[derive(Debug, Clone)]
pub(super) struct Config {
    hard: KinematicLimits,
    soft: BTreeMap<i32, KinematicLimits>,
    tool: ToolConfiguration,
    payload: PayloadInformation,
    gravity: GravityVector,
    /// The frame of Cartesian commands and the speeds of joysticks, kept and not used.
    frame: CartesianReferenceFrameInfo,
    desired: DesiredSpeeds,
    actuators: Vec<Actuator>,
    pub(super) product: CompleteProductConfiguration,
    pub(super) last_report: TrajectoryErrorReport,
}

/// One actuator's own settings.
#[derive(Debug, Clone, Copy)]
struct Actuator {
    mode: ActuatorMode,
    command_mode: i32,
    is_servoing: bool,
}

/// An actuator after the arm is switched on.
const ACTUATOR: Actuator =
    Actuator { mode: ActuatorMode::Position, command_mode: 0, is_servoing: true };

fn default_tool() -> ToolConfiguration {
    // Kinova's own for the Robotiq 2F-85: 0.925 kg, 120 mm along z; its centre from a public model.
    ToolConfiguration {
        tool_transform: Some(CartesianTransform { z: 0.120, ..CartesianTransform::default() }),
        tool_mass: 0.925,
        tool_mass_center: Some(MassCenter { z: 0.058, ..MassCenter::default() }),
    }
}

const GRAVITY: GravityVector = GravityVector { x: 0.0, y: 0.0, z: -9.81 };

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

    /// Returns what an actuator (from 0) is told in low-level servoing.
    pub(super) fn actuator_mode(&self, joint: usize) -> ActuatorMode {
        self.actuators.get(joint).map_or(ActuatorMode::None, |actuator| actuator.mode)
    }

    fn soft_mut(&mut self, mode: i32) -> Result<&mut KinematicLimits, No> {
        let found = self.soft.get_mut(&mode);
        found.ok_or_else(|| No::device(refusal::INVALID_PARAM, "no soft limits in this mode"))
    }

    /// Says whether a device identifier is that of one kind of device.
    pub(super) fn must_be(&self, identifier: u8, kind: DeviceType) -> Result<(), No> {
        if self.device(identifier)? == kind {
            return Ok(());
        }
        Err(No::device(refusal::INVALID_DEVICE, "another kind of device"))
    }

    /// Returns what stands at a device identifier: the base, actuators from 1, interconnect, gripper, cameras.
    fn device(&self, identifier: u8) -> Result<DeviceType, No> {
        let n = self.actuators.len() as u8;
        match identifier {
            0 => Ok(DeviceType::Base),
            i if i <= n.min(4) => Ok(DeviceType::BigActuator),
            i if i <= n => Ok(DeviceType::SmallActuator),
            i if i == n + 1 => Ok(DeviceType::Interconnect),
            i if i == n + 2 => Ok(DeviceType::Gripper),
            i if i == n + 3 => Ok(DeviceType::Vision),
            _ => Err(No::device(refusal::INVALID_DEVICE, "no such device")),
        }
    }

    fn devices(&self) -> DeviceHandles {
        let handles = (0..=self.actuators.len() as u8 + 3).filter_map(|identifier| {
            let device_type = self.device(identifier).ok()? as i32;
            let identifier = u32::from(identifier);
            Some(DeviceHandle { device_type, device_identifier: identifier, order: identifier })
        });
        DeviceHandles { device_handle: handles.collect() }
    }

    fn actuator(&mut self, identifier: u8) -> Result<&mut Actuator, No> {
        let found = usize::from(identifier).checked_sub(1).and_then(|i| self.actuators.get_mut(i));
        found.ok_or_else(|| No::device(refusal::INVALID_DEVICE, "not an actuator"))
    }
}

fn soft(hard: &KinematicLimits, share: f32) -> BTreeMap<i32, KinematicLimits> {
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
fn allowed(asked: &[f32], hard: &[f32]) -> Result<Vec<f32>, No> {
    if asked.len() != hard.len() {
        return Err(No::device(refusal::CONTROL_ACTUATOR_COUNT_MISMATCH, "wrong number of joints"));
    }
    for (&asked, &hard) in asked.iter().zip(hard) {
        if asked > hard * 1.0001 {
            return Err(No::device(refusal::VALUE_IS_ABOVE_MAXIMUM, "above the hard limit"));
        }
        if asked.is_nan() || asked <= 0.0 {
            return Err(No::device(refusal::VALUE_IS_BELOW_MINIMUM, "not positive"));
        }
    }
    Ok(asked.to_vec())
}

impl Controller {
    pub(super) fn config_service(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc.service {
            9 => self.device_config(ask),
            10 => self.actuator_config(ask),
            16 if ask.rpc.name.contains("Limit") => self.limits_config(ask),
            16 => self.control_config(ask),
            _ if ask.rpc == device_manager::READ_ALL_DEVICES => say(&self.config.devices()),
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    fn device_config(&mut self, ask: &Ask<'_>) -> Answer {
        let kind = self.config.device(ask.device)?;
        let name = format!("emulated-{kind:?}-{}", ask.device);
        match ask.rpc {
            device::GET_RUN_MODE => say(&RunMode::default()),
            device::GET_DEVICE_TYPE => say(&DeviceTypeInformation { device_type: kind as i32 }),
            device::GET_FIRMWARE_VERSION => say(&FirmwareVersion { firmware_version: 0x0206_0000 }),
            device::GET_BOOTLOADER_VERSION => {
                say(&BootloaderVersion { bootloader_version: 0x0100_0000 })
            }
            device::GET_MODEL_NUMBER => say(&ModelNumber { model_number: name }),
            device::GET_PART_NUMBER => say(&PartNumber { part_number: name }),
            device::GET_SERIAL_NUMBER => say(&SerialNumber { serial_number: name }),
            // Locally administered, so it can be nobody's.
            device::GET_MAC_ADDRESS => say(&MacAddress { mac_address: vec![2, 0, 0, 0, 0, 1] }),
            device::GET_IPV4_SETTINGS => say(&Ipv4Settings {
                ipv4_address: 0x7F00_0001,
                ipv4_subnet_mask: 0xFF00_0000,
                ipv4_default_gateway: 0x7F00_0001,
            }),
            device::GET_PART_NUMBER_REVISION => {
                say(&PartNumberRevision { part_number_revision: "1".to_owned() })
            }
            // What the arm is made of forgets nothing that is kept here; the base has a call of its own.
            device::REBOOT_REQUEST if kind != DeviceType::Base => {
                let _: RebootRequest = ask.read()?;
                done()
            }
            device::REBOOT_REQUEST => {
                Err(No::device(refusal::UNSUPPORTED_OPTION, "restart the base by Base.Reboot"))
            }
            device::CLEAR_ALL_SAFETY_STATUS => {
                self.clear_fault();
                done()
            }
            topic @ device::ON_SAFETY_TOPIC => say(&NotificationHandle {
                identifier: self.topics.subscribe(ask.session, ask.peer, topic),
            }),
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    fn actuator_config(&mut self, ask: &Ask<'_>) -> Answer {
        if ask.rpc == actuator::CLEAR_FAULTS {
            self.config.actuator(ask.device)?;
            self.clear_fault();
            return done();
        }
        let one = self.config.actuator(ask.device)?;
        match ask.rpc {
            actuator::GET_CONTROL_MODE => {
                say(&ActuatorModeInformation { control_mode: one.mode as i32 })
            }
            actuator::SET_CONTROL_MODE => {
                let asked: ActuatorModeInformation = ask.read()?;
                let mode = ActuatorMode::try_from(asked.control_mode);
                one.mode = mode.map_err(|_| No::device(refusal::INVALID_PARAM, "no such mode"))?;
                done()
            }
            actuator::GET_COMMAND_MODE => {
                say(&CommandModeInformation { command_mode: one.command_mode })
            }
            actuator::SET_COMMAND_MODE => {
                let asked: CommandModeInformation = ask.read()?;
                one.command_mode = asked.command_mode;
                done()
            }
            actuator::GET_SERVOING => say(&Servoing { enabled: one.is_servoing }),
            actuator::SET_SERVOING => {
                let asked: Servoing = ask.read()?;
                one.is_servoing = asked.enabled;
                done()
            }
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    fn control_config(&mut self, ask: &Ask<'_>) -> Answer {
        let config = &mut self.config;
        match ask.rpc {
            control::GET_CARTESIAN_REFERENCE_FRAME => say(&config.frame),
            control::SET_CARTESIAN_REFERENCE_FRAME => {
                config.frame = ask.read()?;
                done()
            }
            control::GET_DESIRED_SPEEDS => say(&config.desired),
            control::SET_DESIRED_LINEAR_TWIST => {
                config.desired.linear = ask.read::<LinearTwist>()?.linear;
                done()
            }
            control::SET_DESIRED_ANGULAR_TWIST => {
                config.desired.angular = ask.read::<AngularTwist>()?.angular;
                done()
            }
            control::SET_DESIRED_JOINT_SPEEDS => {
                config.desired.joint_speed = ask.read::<DesiredJointSpeeds>()?.joint_speed;
                done()
            }
            control::GET_GRAVITY_VECTOR => say(&config.gravity),
            control::SET_GRAVITY_VECTOR => {
                config.gravity = ask.read()?;
                done()
            }
            control::RESET_GRAVITY_VECTOR => {
                config.gravity = GRAVITY;
                say(&config.gravity)
            }
            control::GET_PAYLOAD_INFORMATION => say(&config.payload),
            control::SET_PAYLOAD_INFORMATION => {
                config.payload = ask.read()?;
                done()
            }
            control::RESET_PAYLOAD_INFORMATION => {
                config.payload = PayloadInformation::default();
                say(&config.payload)
            }
            control::GET_TOOL_CONFIGURATION => say(&config.tool),
            control::SET_TOOL_CONFIGURATION => {
                config.tool = ask.read()?;
                done()
            }
            control::RESET_TOOL_CONFIGURATION => {
                config.tool = default_tool();
                say(&config.tool)
            }
            control::GET_CONTROL_MODE => {
                say(&ControlModeInformation { control_mode: self.control_mode() as i32 })
            }
            control::UNSUBSCRIBE => {
                let handle: NotificationHandle = ask.read()?;
                self.topics.unsubscribe(ask.session, handle.identifier)?;
                done()
            }
            topic @ (control::ON_CONTROL_CONFIGURATION_TOPIC | control::ON_CONTROL_MODE_TOPIC) => {
                say(&NotificationHandle {
                    identifier: self.topics.subscribe(ask.session, ask.peer, topic),
                })
            }
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    fn limits_config(&mut self, ask: &Ask<'_>) -> Answer {
        let config = &mut self.config;
        let hard = config.hard.clone();
        match ask.rpc {
            control::GET_KINEMATIC_HARD_LIMITS => say(&hard),
            control::GET_KINEMATIC_SOFT_LIMITS => {
                let asked: ControlModeInformation = ask.read()?;
                say(config.soft_mut(asked.control_mode)?)
            }
            control::GET_ALL_KINEMATIC_SOFT_LIMITS => say(&KinematicLimitsList {
                kinematic_limits_list: config.soft.values().cloned().collect(),
            }),
            control::SET_JOINT_SPEED_SOFT_LIMITS => {
                let asked: JointSpeedSoftLimits = ask.read()?;
                let list = allowed(&asked.joint_speed_soft_limits, &hard.joint_speed_limits)?;
                config.soft_mut(asked.control_mode)?.joint_speed_limits = list;
                done()
            }
            control::SET_JOINT_ACCELERATION_SOFT_LIMITS => {
                let asked: JointAccelerationSoftLimits = ask.read()?;
                let most = &hard.joint_acceleration_limits;
                let list = allowed(&asked.joint_acceleration_soft_limits, most)?;
                config.soft_mut(asked.control_mode)?.joint_acceleration_limits = list;
                done()
            }
            control::SET_TWIST_LINEAR_SOFT_LIMIT => {
                let asked: TwistLinearSoftLimit = ask.read()?;
                let one = allowed(&[asked.twist_linear_soft_limit], &[hard.twist_linear])?;
                config.soft_mut(asked.control_mode)?.twist_linear = one[0];
                done()
            }
            control::SET_TWIST_ANGULAR_SOFT_LIMIT => {
                let asked: TwistAngularSoftLimit = ask.read()?;
                let one = allowed(&[asked.twist_angular_soft_limit], &[hard.twist_angular])?;
                config.soft_mut(asked.control_mode)?.twist_angular = one[0];
                done()
            }
            control::RESET_JOINT_SPEED_SOFT_LIMITS => {
                let asked: ControlModeInformation = ask.read()?;
                let control_mode = asked.control_mode;
                let limits = config.soft_mut(control_mode)?;
                limits.joint_speed_limits = hard.joint_speed_limits;
                let joint_speed_soft_limits = limits.joint_speed_limits.clone();
                say(&JointSpeedSoftLimits { control_mode, joint_speed_soft_limits })
            }
            control::RESET_JOINT_ACCELERATION_SOFT_LIMITS => {
                let asked: ControlModeInformation = ask.read()?;
                let control_mode = asked.control_mode;
                let limits = config.soft_mut(control_mode)?;
                limits.joint_acceleration_limits = hard.joint_acceleration_limits;
                let joint_acceleration_soft_limits = limits.joint_acceleration_limits.clone();
                say(&JointAccelerationSoftLimits { control_mode, joint_acceleration_soft_limits })
            }
            control::RESET_TWIST_LINEAR_SOFT_LIMIT => {
                let asked: ControlModeInformation = ask.read()?;
                let control_mode = asked.control_mode;
                let limits = config.soft_mut(control_mode)?;
                limits.twist_linear = hard.twist_linear;
                let twist_linear_soft_limit = limits.twist_linear;
                say(&TwistLinearSoftLimit { control_mode, twist_linear_soft_limit })
            }
            control::RESET_TWIST_ANGULAR_SOFT_LIMIT => {
                let asked: ControlModeInformation = ask.read()?;
                let control_mode = asked.control_mode;
                let limits = config.soft_mut(control_mode)?;
                limits.twist_angular = hard.twist_angular;
                let twist_angular_soft_limit = limits.twist_angular;
                say(&TwistAngularSoftLimit { control_mode, twist_angular_soft_limit })
            }
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }
}
