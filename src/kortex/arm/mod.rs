//! [`Arm`] over Kortex: a real Gen3, or whoever answers like one.
//!
//! A motion is sent as waypoints the arm has validated, and is over when the arm says so *and* its joints
//! are there. An arm that errs is stopped first and reported second, and one that is silent while it moves is
//! reported within a second. A connection that is lost is opened again by the next question, never in the middle
//! of a motion, and nothing is repeated by itself.
//!
//! Not known to the wire, and therefore not here: the joints' commanded positions (they are worked out from
//! what was sent), the force of the fingers (the controller has no command for it).

use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;

use crate::arm::limits::{Cleared, ClearedGrip};
use crate::arm::{Arm, Cancel, DeviceError, Feedback, Grip, Pacing};

use super::about::About;
use super::beat::Beat;
use super::clock::Clock;
use super::degrees;
use super::error::{Error, Faults};
use super::link::{Garbled, Link, LinkError, Login};
use super::messages::base::ServoingMode;
use super::messages::common::ArmState;
use super::messages::cyclic;
use super::rpc::{base, base_cyclic};
use super::safety;
use super::stream::Cyclic;
use super::waypoints;

mod fingers;
mod path;
mod servo;

/// A joint this near to where it was sent is there, rad: under the arm's own warning of 3 deg.
const THERE: f64 = 0.035;
/// A joint slower than this rests, rad/s.
pub(super) const RESTS: f64 = 0.02;
/// How long it may take to come to rest, s.
const COMING_TO_REST: f64 = 3.0;
/// How many answers in a row may fail to come before a motion is given up.
const MISSES: u32 = 3;
/// How long what is known of the fingers may be old, s.
const FINGERS_OLD: f64 = 0.2;

/// How to connect.
#[derive(Clone)]
pub struct Options {
    /// Name or address of the arm.
    pub host: String,
    /// Its TCP port; 10000 unless it is an emulator.
    pub port: u16,
    /// How motions are streamed at 1 kHz, if they are not to be sent as waypoints.
    pub stream: Option<Cyclic>,
    /// Who connects.
    pub login: Login,
    /// How many times a second feedback is asked for; the arm itself works at 40 Hz over TCP.
    pub rate: f64,
    /// How long an answer may take while the arm rests.
    pub timeout: Duration,
    /// How long nothing may be heard of an arm that moves; [`Options::PATIENCE`] unless the machine is busy.
    pub patience: Duration,
    /// Where its joints are likely to be, rad: joints that turn without end are counted from there.
    pub near: Vec<f64>,
    /// Widest opening between the finger pads, m.
    pub max_opening: f64,
    /// The arm's clock.
    pub clock: Arc<dyn Clock>,
}

impl Options {
    /// Silence for which a moving arm is given up: with one last call to stop it, it is told within a second.
    pub const PATIENCE: Duration = Duration::from_millis(600);
}

/// A Gen3 with a Robotiq 2F-85.
pub struct KortexArm {
    options: Options,
    address: SocketAddr,
    link: Link,
    about: About,
    /// Handle under which actions are told.
    actions: u16,
    begun: f64,
    q: Vec<f64>,
    q_cmd: Vec<f64>,
    /// How the last streamed motion was paced, and all of them since that was asked.
    beat: Option<Beat>,
    streamed: Option<Beat>,
    /// Whether the arm was given up for its silence and has not been heard since.
    is_silent: bool,
    /// How wide the fingers were last, m, and when that was told, by the clock in s.
    opening: Option<(f64, f64)>,
    /// When the fingers are to be sent beside a motion, by the clock in s, and how far open, m.
    fingers: Option<(f64, f64)>,
}

impl std::fmt::Debug for KortexArm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("KortexArm").field("address", &self.address).finish_non_exhaustive()
    }
}

impl KortexArm {
    /// Connects and asks what kind of arm it is. Nothing moves.
    ///
    /// # Errors
    ///
    /// [`DeviceError::Refused`] with what would help: nobody there, wrong password, another kind of arm.
    pub fn connect(options: Options) -> Result<Self, DeviceError> {
        let address = resolve(&options.host, options.port)?;
        let (link, about, actions) = open(address, &options)?;
        let begun = options.clock.now();
        let near = options.near.clone();
        let mut arm = Self {
            options,
            address,
            link,
            about,
            actions,
            begun,
            q: near.clone(),
            q_cmd: near,
            beat: None,
            streamed: None,
            is_silent: false,
            opening: None,
            fingers: None,
        };
        let feedback = arm.measure()?;
        arm.q_cmd.clone_from(&feedback.q);
        Ok(arm)
    }

    /// Returns what the arm said of itself when it was connected.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Returns how well the beat of the last streamed motion was kept.
    pub fn beat(&self) -> Option<&Beat> {
        self.beat.as_ref()
    }

    /// Opens the connection again after it was lost. What was under way is not taken up again.
    ///
    /// # Errors
    ///
    /// As [`Self::connect`].
    pub fn reconnect(&mut self) -> Result<(), DeviceError> {
        let (link, about, actions) = open(self.address, &self.options)?;
        (self.link, self.about, self.actions) = (link, about, actions);
        let feedback = self.measure()?;
        self.q_cmd.clone_from(&feedback.q);
        Ok(())
    }

    /// Clears the faults and waits as long as the arm needs to be ready again.
    ///
    /// # Errors
    ///
    /// When it still is in fault afterwards.
    pub fn clear_faults(&mut self) -> Result<(), DeviceError> {
        let () = self.link.call(base::CLEAR_FAULTS, &())?;
        // As long as `ros_kortex` waits.
        self.options.clock.sleep(1.0);
        let state = self.state()?;
        if state == ArmState::InFault {
            return Err(Error::StillInFault.into());
        }
        let feedback = self.measure()?;
        self.q_cmd.clone_from(&feedback.q);
        Ok(())
    }

    /// Returns what the arm does now.
    ///
    /// # Errors
    ///
    /// When it does not answer.
    pub fn state(&mut self) -> Result<ArmState, DeviceError> {
        let told: super::messages::base::ArmStateInformation =
            self.link.call(base::GET_ARM_STATE, &())?;
        Ok(told.active_state())
    }

    /// Returns how long one answer of an arm that moves may take.
    fn soon(&self) -> Duration {
        self.options.patience / MISSES
    }

    /// Asks for feedback, once; of an arm that was given up for its silence only briefly.
    fn measure(&mut self) -> Result<Feedback, LinkError> {
        self.measure_within(if self.is_silent { self.soon() } else { self.options.timeout })
    }

    fn measure_within(&mut self, timeout: Duration) -> Result<Feedback, LinkError> {
        let told: cyclic::Feedback =
            self.link.call_within(base_cyclic::REFRESH_FEEDBACK, &(), timeout)?;
        self.is_silent = false;
        self.inside(&told)
    }

    /// Returns what the arm reports in the program's units.
    fn inside(&mut self, told: &cyclic::Feedback) -> Result<Feedback, LinkError> {
        let n = self.q.len();
        let numbers = |a: &cyclic::ActuatorFeedback| {
            a.position.is_finite() && a.velocity.is_finite() && a.torque.is_finite()
        };
        if told.actuators.len() != n || !told.actuators.iter().all(numbers) {
            return Err(LinkError::Unreadable {
                rpc: base_cyclic::REFRESH_FEEDBACK,
                error: Garbled::Actuators { told: told.actuators.len(), expected: n },
            });
        }
        for (q, actuator) in self.q.iter_mut().zip(&told.actuators) {
            *q = degrees::from_wire(actuator.position, *q);
        }
        let each = |pick: fn(&cyclic::ActuatorFeedback) -> f32| {
            told.actuators.iter().map(move |actuator| f64::from(pick(actuator)))
        };
        let now = self.options.clock.now();
        if let Some(closed) = told.closed() {
            self.opening = Some(((1.0 - closed) * self.options.max_opening, now));
        }
        // Without it nothing could be said of what the arm may touch.
        let known = self.opening.filter(|(_, told)| now - told <= FINGERS_OLD);
        let (opening, _) = known.ok_or(LinkError::NoGripper)?;
        Ok(Feedback {
            time: self.options.clock.now() - self.begun,
            q_cmd: self.q_cmd.clone(),
            q: self.q.clone(),
            dq: each(|actuator| actuator.velocity).map(f64::to_radians).collect(),
            // The measured torque is opposite to the way the joint is driven (the vendor's example 108).
            tau: each(|actuator| -actuator.torque).collect(),
            opening,
            mass: None,
            moving: Vec::new(),
        })
    }

    /// Asks for feedback and forgives a few answers that do not come.
    fn measure_patiently(&mut self, misses: &mut u32) -> Result<Option<Feedback>, DeviceError> {
        match self.measure_within(self.soon()) {
            Ok(feedback) => {
                *misses = 0;
                Ok(Some(feedback))
            }
            Err(LinkError::Silent { .. }) => {
                *misses += 1;
                if *misses < MISSES {
                    return Ok(None);
                }
                self.is_silent = true;
                Err(Error::Stalled(self.options.patience.as_secs_f64()).into())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Asks for feedback until it comes, as patiently.
    fn measure_in_motion(&mut self) -> Result<Feedback, DeviceError> {
        let mut misses = 0;
        loop {
            if let Some(feedback) = self.measure_patiently(&mut misses)? {
                return Ok(feedback);
            }
        }
    }

    /// Tells the arm to stop, a few times: a stop that was not heard is no stop.
    fn say_stop(&mut self) -> Result<(), LinkError> {
        // One that hears nothing stops by itself.
        let tries = if self.is_silent { 1 } else { MISSES };
        let mut stopped = Ok(());
        for _ in 0..tries {
            stopped = self.link.call_within::<()>(base::STOP, &(), self.soon());
            if !matches!(stopped, Err(LinkError::Silent { .. })) {
                return stopped;
            }
        }
        self.is_silent = true;
        stopped
    }

    /// Stops the arm and waits until it rests; where it rests is where the next motion begins.
    fn halt(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<(), DeviceError> {
        self.say_stop()?;
        let until = self.options.clock.now() + COMING_TO_REST;
        let mut misses = 0;
        while self.options.clock.now() < until {
            self.options.clock.sleep(1.0 / self.options.rate);
            let Some(feedback) = self.measure_patiently(&mut misses)? else { continue };
            self.q_cmd.clone_from(&feedback.q);
            watch(&Feedback { q_cmd: feedback.q.clone(), ..feedback.clone() });
            if feedback.dq.iter().all(|dq| dq.abs() < RESTS) {
                break;
            }
        }
        Ok(())
    }

    /// Asks for feedback for so long, s, and shows it to `watch`.
    fn look_on(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let clock = self.options.clock.clone();
        let until = clock.now() + seconds;
        let mut misses = 0;
        while clock.now() < until {
            if cancel.is_cancelled() {
                self.halt(watch)?;
                return Err(DeviceError::Stopped);
            }
            self.send_fingers_when_due()?;
            if let Some(feedback) = self.measure_patiently(&mut misses)? {
                watch(&feedback);
            }
            clock.sleep((until - clock.now()).clamp(0.0, 1.0 / self.options.rate));
        }
        Ok(())
    }
}

pub(super) fn resolve(host: &str, port: u16) -> Result<SocketAddr, DeviceError> {
    let found = (host, port).to_socket_addrs().map(|mut all| all.next());
    match found {
        Ok(Some(address)) => Ok(address),
        _ => Err(Error::NoHost(host.to_owned()).into()),
    }
}

/// Opens a session, looks what kind of arm it is, and has it follow high-level commands.
fn open(address: SocketAddr, options: &Options) -> Result<(Link, About, u16), DeviceError> {
    let link = Link::open(address, &options.login, options.timeout)?;
    let about = About::ask(&link)?;
    about.check(options.near.len())?;
    if about.state == ArmState::InFault {
        let told: cyclic::Feedback = link.call(base_cyclic::REFRESH_FEEDBACK, &())?;
        return Err(Error::InFault(Faults(safety::faults(&told))).into());
    }
    if let Some(who) = &about.moving {
        return Err(Error::MovedByOther(who.clone()).into());
    }
    if about.servoing != ServoingMode::SingleLevel {
        link.set_servoing(ServoingMode::SingleLevel)?;
    }
    let actions = link.subscribe(base::ON_ACTION_TOPIC)?;
    Ok((link, about, actions))
}

impl Arm for KortexArm {
    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        match self.measure() {
            Ok(feedback) => Ok(feedback),
            Err(lost) if lost.is_lost() => {
                self.reconnect().map_err(|again| Error::NotReopened { lost, again })?;
                Ok(self.measure()?)
            }
            Err(error) => Err(error.into()),
        }
    }

    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        if cancel.is_cancelled() {
            return Err(DeviceError::Stopped);
        }
        let (trajectory, list) = waypoints::of(trajectory.trajectory(), &self.about.soft);
        if let Some(how) = self.options.stream {
            return self.stream(how, &trajectory, cancel, watch);
        }
        self.validate(&list)?;
        // What was told of earlier actions is old.
        self.link.notes(self.actions);
        let begun = self.link.call_within::<()>(
            base::EXECUTE_WAYPOINT_TRAJECTORY,
            &list,
            self.options.patience,
        );
        if let Err(error) = begun {
            // It may have begun all the same: the call may have come through and its answer not.
            if matches!(error, LinkError::Silent { .. }) {
                let _ = self.halt(watch);
            }
            return Err(error.into());
        }
        self.accompany(&trajectory, list.waypoints.len(), cancel, watch)
    }

    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        let gripped = self.close_to(grip, cancel, watch);
        if !matches!(gripped, Ok(_) | Err(DeviceError::Stopped)) {
            let _ = self.say_stop();
        }
        gripped
    }

    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError> {
        if self.options.stream.is_some() {
            return Err(Error::FingersInStream.into());
        }
        self.fingers = Some((self.options.clock.now() + after, grip.opening()));
        Ok(())
    }

    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.look_on(seconds, cancel, watch)
    }

    fn stop(&mut self) {
        // An arm that cannot be told stops by itself when this connection falls silent.
        let _ = self.halt(&mut |_| {});
    }

    fn pacing(&mut self) -> Option<Pacing> {
        self.streamed.take().as_ref().map(Pacing::from)
    }
}
