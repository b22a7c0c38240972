//! What someone at a desk asks of an arm that other hands may be moving: how it is, stop, clear its faults.
//!
//! It takes no control and changes no mode, so it can be asked at any time, beside whoever commands.

use std::time::Duration;

use crate::execution::arm::DeviceError;

use super::about::{About, refused};
use super::arm::resolve;
use super::clock::{Clock, Wall};
use super::link::{Link, LinkError, Login};
use super::messages::base::ArmStateInformation;
use super::messages::common::ArmState;
use super::messages::cyclic::{Feedback, ToolFeedback};
use super::rpc::{base, base_cyclic};
use super::safety;

/// After its faults are cleared an arm is left alone for so long, s, as `ros_kortex` does.
const RECOVERY: f64 = 1.0;

/// A session that only looks and stops.
#[derive(Debug)]
pub struct Desk(Link);

/// How an arm is.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// What it says of itself.
    pub about: About,
    /// Who commands it, as the arm words it; empty when nobody does.
    pub commanded_by: String,
    /// Where its joints are, deg, in 0..360.
    pub joints: Vec<f64>,
    /// How far its fingers are closed, from 0 to 1, if it has any.
    pub closed: Option<f64>,
    /// What is wrong with it.
    pub faults: Vec<String>,
}

impl Desk {
    /// Connects.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Refused`] with what would help: nobody there, wrong password.
    pub fn open(
        host: &str,
        port: u16,
        login: &Login,
        timeout: Duration,
    ) -> Result<Self, DeviceError> {
        Ok(Self(Link::open(resolve(host, port)?, login, timeout)?))
    }

    /// Asks how the arm is.
    ///
    /// # Errors
    ///
    /// When it does not answer.
    pub fn status(&self) -> Result<Status, DeviceError> {
        let about = About::ask(&self.0)?;
        let state: ArmStateInformation = self.0.call(base::GET_ARM_STATE, &())?;
        let told: Feedback = self.0.call(base_cyclic::REFRESH_FEEDBACK, &())?;
        let closed =
            told.interconnect.as_ref().and_then(|all| match all.tool_feedback.as_ref()? {
                ToolFeedback::GripperFeedback(gripper) => Some(gripper.motor.first()?.position),
            });
        Ok(Status {
            about,
            commanded_by: state.connection.map_or_else(String::new, |by| by.connection_information),
            joints: told.actuators.iter().map(|joint| f64::from(joint.position)).collect(),
            closed: closed.map(|percent| f64::from(percent) / 100.0),
            faults: safety::faults(&told),
        })
    }

    /// Stops whatever the arm does; it holds where it comes to rest and can be commanded again.
    ///
    /// # Errors
    ///
    /// When the arm cannot be told: then use the button.
    pub fn stop(&self) -> Result<(), DeviceError> {
        self.0.call(base::STOP, &()).map_err(|error| unheard(&error))
    }

    /// Stops the arm at once and leaves it in fault until its faults are cleared.
    ///
    /// # Errors
    ///
    /// When the arm cannot be told: then use the button.
    pub fn emergency_stop(&self) -> Result<(), DeviceError> {
        self.0.call(base::APPLY_EMERGENCY_STOP, &()).map_err(|error| unheard(&error))
    }

    /// Clears the arm's faults and looks whether they stay away.
    ///
    /// # Errors
    ///
    /// When it is still in fault afterwards, with what is wrong.
    pub fn clear_faults(&self) -> Result<(), DeviceError> {
        let () = self.0.call(base::CLEAR_FAULTS, &())?;
        Wall.sleep(RECOVERY);
        let state: ArmStateInformation = self.0.call(base::GET_ARM_STATE, &())?;
        if state.active_state() != ArmState::InFault {
            return Ok(());
        }
        let told: Feedback = self.0.call(base_cyclic::REFRESH_FEEDBACK, &())?;
        let what = format!("the arm is still in fault: {}", in_words(&safety::faults(&told)));
        Err(refused(what, "mend the cause; it may need a restart"))
    }
}

fn unheard(error: &LinkError) -> DeviceError {
    refused(error.to_string(), "press the emergency stop button")
}

/// Joins faults into a sentence.
pub(super) fn in_words(faults: &[String]) -> String {
    if faults.is_empty() { "it does not say why".to_owned() } else { faults.join("; ") }
}
