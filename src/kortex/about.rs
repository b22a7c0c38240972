//! What kind of arm answers: model, firmware, gripper, limits, state, and who else is there.

use crate::motion::trajectory::Limits;

use super::error::Error;
use super::link::{Link, LinkError};
use super::messages::base::{
    ActuatorInformation, ArmStateInformation, FirmwareBundleVersions, OperatingMode,
    OperatingModeInformation, ServoingMode, ServoingModeInformation,
};
use super::messages::common::ArmState;
use super::messages::config::{
    BrakeType, CompleteProductConfiguration, ControlMode, ControlModeInformation, EndEffectorType,
    KinematicLimits, ModelId,
};
use super::messages::session::ConnectionList;
use super::refusal;
use super::rpc::{base, control_config, session};

/// What an arm says of itself when one connects.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Whether it is a Gen3 (and not a Gen3 lite or something else).
    pub model: ModelId,
    /// How many joints it has.
    pub joints: usize,
    /// What is on its flange.
    pub gripper: EndEffectorType,
    /// Whether its joints have brakes.
    pub brakes: BrakeType,
    /// Its firmware, as it says; empty when it is too old to say.
    pub firmware: String,
    /// Whether it runs, updates or is in maintenance.
    pub operating: OperatingMode,
    /// What it does.
    pub state: ArmState,
    /// Whether it follows high-level or low-level commands.
    pub servoing: ServoingMode,
    /// The most the arm can do, rad/s and rad/s².
    pub hard: Limits,
    /// The most it accepts in a path, rad/s and rad/s².
    pub soft: Limits,
    /// Who moves the arm just now, if someone does; empty when it does not say who.
    pub moving: Option<String>,
    /// Who is connected, this program included.
    pub connected: Vec<String>,
}

/// Returns the answer, or nothing where the firmware is too old to know the call.
fn if_known<T>(answer: Result<T, LinkError>) -> Result<Option<T>, LinkError> {
    match answer {
        Ok(answer) => Ok(Some(answer)),
        Err(LinkError::Refused(no))
            if matches!(
                no.sub_code,
                refusal::UNSUPPORTED_METHOD | refusal::UNSUPPORTED_SERVICE | refusal::UNIMPLEMENTED
            ) =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

fn limits(wire: &KinematicLimits) -> Limits {
    let inside = |list: &[f32]| list.iter().map(|&x| f64::from(x).to_radians()).collect();
    Limits::new(inside(&wire.joint_speed_limits), inside(&wire.joint_acceleration_limits))
}

/// Returns who moves the arm: one that only stands ready moves for nobody.
fn moving(told: &ArmStateInformation) -> Option<String> {
    let moves = matches!(
        told.active_state(),
        ArmState::ServoingLowLevel
            | ArmState::ServoingPlayingSequence
            | ArmState::ServoingManuallyControlled
    );
    let who = told.connection.as_ref().map(|by| by.connection_information.clone());
    moves.then(|| who.unwrap_or_default())
}

impl About {
    /// Asks the arm.
    pub(super) fn ask(link: &Link) -> Result<Self, LinkError> {
        let product: CompleteProductConfiguration =
            link.call(base::GET_PRODUCT_CONFIGURATION, &())?;
        let firmware: Option<FirmwareBundleVersions> =
            if_known(link.call(base::GET_FIRMWARE_BUNDLE_VERSIONS, &()))?;
        let actuators: ActuatorInformation = link.call(base::GET_ACTUATOR_COUNT, &())?;
        let operating: OperatingModeInformation = link.call(base::GET_OPERATING_MODE, &())?;
        let state: ArmStateInformation = link.call(base::GET_ARM_STATE, &())?;
        let servoing: ServoingModeInformation = link.call(base::GET_SERVOING_MODE, &())?;
        let hard: KinematicLimits = link.call(control_config::GET_KINEMATIC_HARD_LIMITS, &())?;
        let mode = ControlModeInformation { control_mode: ControlMode::AngularTrajectory as i32 };
        let soft: Option<KinematicLimits> =
            if_known(link.call(control_config::GET_KINEMATIC_SOFT_LIMITS, &mode))?;
        let connected: Option<ConnectionList> = if_known(link.call(session::GET_CONNECTIONS, &()))?;
        let hard = limits(&hard);
        Ok(Self {
            model: product.model(),
            joints: actuators.count as usize,
            gripper: product.end_effector_type(),
            brakes: product.brake_type(),
            firmware: firmware.map_or_else(String::new, |told| told.main_bundle_version),
            operating: operating.operating_mode(),
            state: state.active_state(),
            moving: moving(&state),
            servoing: servoing.servoing_mode(),
            soft: soft.map_or_else(|| hard.clone(), |soft| limits(&soft)),
            hard,
            connected: connected.map_or_else(Vec::new, |list| {
                list.connection.into_iter().map(|one| one.connection_information).collect()
            }),
        })
    }

    /// Says what about this arm this program cannot work with.
    pub(super) fn check(&self, joints: usize) -> Result<(), Error> {
        if self.model != ModelId::L53 && self.model != ModelId::Unspecified {
            return Err(Error::Model(self.model));
        }
        if self.joints != joints {
            return Err(Error::JointCount { arm: self.joints, robot: joints });
        }
        if self.gripper != EndEffectorType::Robotiq2f85 {
            return Err(Error::Gripper(self.gripper));
        }
        if self.operating != OperatingMode::Run {
            return Err(Error::NotRunning(self.operating));
        }
        let limits = [&self.hard, &self.soft];
        let whole = limits.iter().all(|limits| {
            limits.velocity.len() == joints
                && limits.acceleration.len() == joints
                && limits.velocity.iter().chain(&limits.acceleration).all(|&limit| limit > 0.0)
        });
        if whole { Ok(()) } else { Err(Error::NoLimits) }
    }
}
