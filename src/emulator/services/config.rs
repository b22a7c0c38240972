//! What the service says and does of `config`; what it keeps is in [`super::super::config`].

use super::super::call::{Answer, Ask, done, say};
use super::super::config::{GRAVITY, allowed, default_tool};
use super::super::controller::Controller;
use super::super::error::Refused;
use crate::kortex::messages::common::{DeviceType, NotificationHandle};
use crate::kortex::messages::config::{
    ActuatorMode, ActuatorModeInformation, AngularTwist, BootloaderVersion, CommandModeInformation,
    ControlModeInformation, DesiredJointSpeeds, DeviceTypeInformation, FirmwareVersion,
    Ipv4Settings, JointAccelerationSoftLimits, JointSpeedSoftLimits, KinematicLimitsList,
    LinearTwist, MacAddress, ModelNumber, PartNumber, PartNumberRevision, PayloadInformation,
    RebootRequest, RunMode, SerialNumber, Servoing, TwistAngularSoftLimit, TwistLinearSoftLimit,
};
use crate::kortex::rpc::{
    actuator_config as actuator, control_config as control, device_config as device, device_manager,
};

impl Controller {
    pub(in crate::emulator) fn config_service(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc.service {
            9 => self.device_config(ask),
            10 => self.actuator_config(ask),
            16 if ask.rpc.name.contains("Limit") => self.limits_config(ask),
            16 => self.control_config(ask),
            _ if ask.rpc == device_manager::READ_ALL_DEVICES => say(&self.config.devices()),
            _ => Err(Refused::NotEmulated),
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
            device::REBOOT_REQUEST => Err(Refused::BaseReboots),
            device::CLEAR_ALL_SAFETY_STATUS => {
                self.clear_fault();
                done()
            }
            topic @ device::ON_SAFETY_TOPIC => say(&NotificationHandle {
                identifier: self.topics.subscribe(ask.session, ask.peer, topic),
            }),
            _ => Err(Refused::NotEmulated),
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
                one.mode = mode.map_err(|_| Refused::NoMode)?;
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
            _ => Err(Refused::NotEmulated),
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
            _ => Err(Refused::NotEmulated),
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
            _ => Err(Refused::NotEmulated),
        }
    }
}
