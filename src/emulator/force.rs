//! Wrenches, admittance, operating and control modes.
//!
//! Nothing touches the emulated arm from outside, so a wrench finds no resistance: the tool drifts along it
//! at a speed in proportion, as against a damper. The damper is chosen, an arm's is not published. Admittance
//! is kept and told; without anyone who pushes, it does nothing.

use nalgebra::Vector6;

use crate::kortex::messages::base::{
    ActionType, OperatingMode, OperatingModeInformation, OperatingModeNotification, ServoingMode,
};
use crate::kortex::messages::config::ControlMode;
use crate::kortex::messages::force::{
    Admittance, AdmittanceMode, ControlModeNotification, WrenchCommand, WrenchMode,
};
use crate::kortex::refusal;
use crate::kortex::rpc::{base as call, control_config};

use super::call::{Answer, Ask, done};
use super::controller::Controller;
use super::error::Refused;
use super::paths::is_of_tool;
use super::servo::Motion;

/// What a force and a torque work against, N·s/m and N·m·s/rad.
const DAMPER: (f64, f64) = (200.0, 20.0);

impl Controller {
    pub(super) fn push(&mut self, ask: &Ask<'_>, asked: &WrenchCommand) -> Answer {
        self.may_command(ask)?;
        self.no_action()?;
        let in_tool = is_of_tool(asked.reference_frame)?;
        let told = asked.wrench.clone().unwrap_or_default();
        let force = [told.force_x, told.force_y, told.force_z].map(|f| f64::from(f) / DAMPER.0);
        let torque = [told.torque_x, told.torque_y, told.torque_z].map(|t| f64::from(t) / DAMPER.1);
        if !force.iter().chain(&torque).all(|number| number.is_finite()) {
            return Err(Refused::NotANumber);
        }
        self.wrench = WrenchMode::try_from(asked.mode).unwrap_or(WrenchMode::Normal);
        let most = self.config.tool_speeds(ControlMode::CartesianJoystick as i32);
        let held = |vector: [f64; 3], most: f64| {
            let norm = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
            vector.map(|x| if norm > most { x * most / norm } else { x })
        };
        let (force, torque) = (held(force, most.0), held(torque, most.1));
        let twist = Vector6::from_iterator(force.into_iter().chain(torque));
        self.servo.keep_twist(twist, in_tool, true);
        done()
    }

    pub(super) fn set_admittance(&mut self, ask: &Ask<'_>, mode: i32) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        self.admittance = match AdmittanceMode::try_from(mode) {
            Ok(AdmittanceMode::Unspecified) | Err(_) => {
                return Err(Refused::NoAdmittance);
            }
            Ok(mode) => mode,
        };
        done()
    }

    pub(super) fn read_admittance(&mut self, ask: &Ask<'_>) -> Answer {
        let asked: Admittance = ask.read()?;
        self.set_admittance(ask, asked.admittance_mode)
    }

    pub(super) fn set_operating_mode(
        &mut self,
        ask: &Ask<'_>,
        asked: &OperatingModeInformation,
    ) -> Answer {
        let mode = asked.operating_mode();
        if !matches!(mode, OperatingMode::Run | OperatingMode::Maintenance) {
            return Err(Refused::NoOperatingMode);
        }
        self.sessions.take(ask.session, self.is_moving(), ask.now)?;
        if mode != self.operating {
            self.operating = mode;
            self.stop_all(refusal::ROBOT_IN_MAINTENANCE);
            let told = OperatingModeNotification {
                operating_mode: mode as i32,
                timestamp: Some(self.timestamp()),
                ..OperatingModeNotification::default()
            };
            self.topics.tell(call::ON_OPERATING_MODE_TOPIC, &told);
        }
        done()
    }

    /// Returns how the joints are controlled now.
    pub(super) fn control_mode(&self) -> ControlMode {
        match self.servo.motion() {
            Motion::Speeds(_) => ControlMode::AngularJoystick,
            Motion::Twist { is_pushed: true, .. } if self.wrench == WrenchMode::Restricted => {
                ControlMode::ForceControlMotionRestricted
            }
            Motion::Twist { is_pushed: true, .. } => ControlMode::ForceControl,
            Motion::Twist { .. } => ControlMode::CartesianJoystick,
            Motion::Path(_) => match self.actions.kind() {
                Some(ActionType::ReachPose) => ControlMode::CartesianTrajectory,
                Some(ActionType::ExecuteWaypointList) if self.is_cartesian => {
                    ControlMode::CartesianWaypointTrajectory
                }
                _ => ControlMode::AngularTrajectory,
            },
            _ => match self.admittance {
                AdmittanceMode::Cartesian => ControlMode::CartesianAdmittance,
                AdmittanceMode::Joint => ControlMode::JointAdmittance,
                AdmittanceMode::NullSpace => ControlMode::NullSpaceAdmittance,
                _ => ControlMode::Idle,
            },
        }
    }

    /// Tells a control mode that is new.
    pub(super) fn tell_control_mode(&mut self) {
        let mode = self.control_mode();
        if mode == self.told_mode {
            return;
        }
        self.told_mode = mode;
        let told = |control_mode: i32| ControlModeNotification {
            control_mode,
            timestamp: Some(self.timestamp()),
            user_handle: None,
            connection: None,
        };
        let (base, control) = (told(base_number(mode)), told(mode as i32));
        self.topics.tell(call::ON_CONTROL_MODE_TOPIC, &base);
        self.topics.tell(control_config::ON_CONTROL_MODE_TOPIC, &control);
    }

    /// Begins anew, as after the plug was pulled: what is stored stays, everything else is forgotten.
    pub(super) fn reboot(&mut self) {
        self.stop_all(refusal::CONTROL_MANUAL_STOP);
        self.clear_fault();
        self.set_mode(ServoingMode::SingleLevel);
        self.operating = OperatingMode::Run;
        self.admittance = AdmittanceMode::Disabled;
        self.config.settle();
        self.all_sessions_over();
        self.is_rebooting = true;
    }
}

/// Returns a control mode as the older call of `Base` numbers it: it has no Cartesian waypoints.
pub(super) fn base_number(mode: ControlMode) -> i32 {
    match mode {
        ControlMode::CartesianWaypointTrajectory => ControlMode::CartesianTrajectory as i32,
        other => other as i32,
    }
}
