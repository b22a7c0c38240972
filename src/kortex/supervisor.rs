//! What someone at a desk asks of an arm that other hands may be moving: how it is, stop, clear its faults.
//!
//! It takes no control, so it can be asked at any time, beside whoever commands. A stop is believed when the arm's
//! own feedback says that it rests and nobody streams to it; until then it is said again, more loudly each time.

use std::time::Duration;

use crate::arm::{Cancel, DeviceError};
use crate::motion::trajectory::Trajectory;

use super::about::About;
use super::arm::{RESTS, resolve};
use super::beat::{Beat, RESUME};
use super::clock::{Clock, Wall};
use super::degrees;
use super::error::{Error, Faults};
use super::link::{Datagrams, Link, LinkError, Login};
use super::messages::base::{ArmStateInformation, ServoingMode, ServoingModeInformation};
use super::messages::common::ArmState;
use super::messages::cyclic::Feedback;
use super::rpc::{base, base_cyclic};
use super::safety;
use super::stream::{self, Course, Stream, Went};

/// After its faults are cleared an arm is left alone for so long, s, as `ros_kortex` does.
const RECOVERY: f64 = 1.0;
/// An arm that moved less than [`STILL`] for so long, s, rests: longer than a stream of this program may stand
/// still and go on.
const CALM: f64 = RESUME + 0.1;
/// How far a joint at rest may be from where it was, rad: its encoder's noise and a little more.
const STILL: f64 = 1e-3;
/// How often it is looked whether it rests, s: as often as an arm works over TCP.
const LOOK: f64 = 0.025;
/// How long an arm that is told to stop may take to come to rest, s: from full speed it needs half of it.
pub const COMING_TO_REST: f64 = 1.5;

/// A session that only looks and stops.
#[derive(Debug)]
pub struct Supervisor(Link);

/// What it took to stop an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// It was told to stop, rests, and can be commanded again.
    Held,
    /// It went on, and rests since its emergency stop: it is in fault until its faults are cleared.
    Emergency,
}

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

impl Supervisor {
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
        Ok(Status {
            about,
            commanded_by: state.connection.map_or_else(String::new, |by| by.connection_information),
            joints: told.actuators.iter().map(|joint| f64::from(joint.position)).collect(),
            closed: told.closed(),
            faults: safety::faults(&told),
        })
    }

    /// Stops whatever the arm does, who ever commands it, and looks whether it rests: within `patience` s of being
    /// told to stop, of being taken out of low-level servoing, of its emergency stop.
    ///
    /// # Errors
    ///
    /// When the arm cannot be told, or still moves: then use the button.
    pub fn stop(&self, patience: f64) -> Result<Stopped, DeviceError> {
        // What it says to one of these is worth less than what its joints do.
        let told = self.0.call::<()>(base::STOP, &());
        if told.as_ref().is_err_and(LinkError::is_lost) {
            return Ok(told.map(|()| Stopped::Held).map_err(Error::Unheard)?);
        }
        if self.comes_to_rest(patience)? {
            return Ok(Stopped::Held);
        }
        let _ = self.0.set_servoing(ServoingMode::SingleLevel);
        let _ = self.0.call::<()>(base::STOP, &());
        if self.comes_to_rest(patience)? {
            return Ok(Stopped::Held);
        }
        self.emergency_stop(patience)?;
        Ok(Stopped::Emergency)
    }

    /// Stops the arm at once, leaves it in fault until its faults are cleared, and looks whether it rests within
    /// `patience` s.
    ///
    /// # Errors
    ///
    /// When the arm cannot be told, or still moves: then use the button.
    pub fn emergency_stop(&self, patience: f64) -> Result<(), DeviceError> {
        let () = self.0.call(base::APPLY_EMERGENCY_STOP, &()).map_err(Error::Unheard)?;
        if self.comes_to_rest(patience)? {
            return Ok(());
        }
        Err(Error::StillMoves.into())
    }

    /// Returns whether the arm comes to rest within so long, s, and stays at rest, with nobody streaming to it.
    fn comes_to_rest(&self, patience: f64) -> Result<bool, DeviceError> {
        let until = Wall.now() + patience + CALM;
        let (mut since, mut last) = (Wall.now(), Vec::new());
        loop {
            let told: Feedback =
                self.0.call(base_cyclic::REFRESH_FEEDBACK, &()).map_err(Error::Unheard)?;
            let q: Vec<f64> = told
                .actuators
                .iter()
                .enumerate()
                .map(|(i, joint)| {
                    degrees::from_wire(joint.position, last.get(i).copied().unwrap_or_default())
                })
                .collect();
            let fast = |speed: f32| f64::from(speed).to_radians().abs() >= RESTS;
            let moved = last.len() != q.len()
                || q.iter().zip(&last).any(|(q, last)| (q - last).abs() >= STILL);
            if moved || told.actuators.iter().any(|joint| fast(joint.velocity)) {
                // Where it was when it last moved: what creeps adds up.
                (since, last) = (Wall.now(), q);
            }
            let now = Wall.now();
            if now - since >= CALM {
                let mode: ServoingModeInformation =
                    self.0.call(base::GET_SERVOING_MODE, &()).map_err(Error::Unheard)?;
                return Ok(mode.servoing_mode() != ServoingMode::LowLevel);
            }
            if now > until {
                return Ok(false);
            }
            Wall.sleep(LOOK);
        }
    }

    /// Holds the arm where it is for so long, s, by positions streamed at 1 kHz, and returns how evenly they left.
    /// It takes control for as long, and the arm is at rest before and after.
    ///
    /// # Errors
    ///
    /// When it moves, is in fault, someone else commands it, or the stream fails.
    pub fn hold(
        &self,
        host: &str,
        udp: u16,
        login: &Login,
        seconds: f64,
        cancel: &Cancel,
    ) -> Result<Beat, DeviceError> {
        if !self.comes_to_rest(COMING_TO_REST)? {
            return Err(Error::Moves.into());
        }
        let mut datagrams = Datagrams::open(resolve(host, udp)?, login)?;
        let told = stream::ask(&mut datagrams)?;
        let q: Vec<f64> =
            told.actuators.iter().map(|joint| degrees::from_wire(joint.position, 0.0)).collect();
        let here = Trajectory::from_points(&[0.0, seconds], &[q.clone(), q.clone()])
            .map_err(Error::NoPath)?;
        self.0.set_servoing(ServoingMode::LowLevel)?;
        let mut beat = Beat::default();
        let course = Course::start(q.len());
        let stream = Stream { trajectory: &here, course, cancel, silence: RESUME };
        // Nobody looks on: that the joints follow is looked at by the beat itself.
        let held = stream.run(&mut datagrams, &mut beat, &mut |_| Ok(()));
        let back = self.0.set_servoing(ServoingMode::SingleLevel);
        match held? {
            Went::Over => {}
            Went::Left(_) | Went::Ended => return Err(Error::LeftWhileHeld.into()),
        }
        back?;
        Ok(beat)
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
        Err(Error::FaultStays(Faults(safety::faults(&told))).into())
    }
}
