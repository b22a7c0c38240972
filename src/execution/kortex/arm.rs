//! [`Arm`] over Kortex: a real Gen3, or whoever answers like one.
//!
//! A motion is sent as waypoints the arm has validated, and is over when the arm says so *and* its joints
//! are there. An arm that errs is stopped first and reported second. A connection that is lost is opened
//! again by the next question, never in the middle of a motion, and nothing is repeated by itself.
//!
//! Not known to the wire, and therefore not here: the joints' commanded positions (they are worked out from
//! what was sent), the force of the fingers (the controller has no command for it).

use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::Arc;
use std::time::Duration;

use prost::Message;

use crate::execution::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use crate::execution::limits::{Cleared, ClearedGrip};
use crate::motion::trajectory::Trajectory;

use super::about::{About, refused};
use super::beat::Beat;
use super::clock::Clock;
use super::degrees;
use super::desk::in_words;
use super::link::{Datagrams, Link, LinkError, Login};
use super::messages::base::{
    ActionEvent, ActionNotification, ServoingMode, ServoingModeInformation,
};
use super::messages::common::ArmState;
use super::messages::cyclic::{self, ToolFeedback};
use super::messages::motion::{Finger, Gripper, GripperCommand, GripperMode};
use super::messages::trajectory::{TrajectoryErrorReport, WaypointList, WaypointValidationReport};
use super::refusal;
use super::rpc::{base, base_cyclic};
use super::safety;
use super::stream::{self, Course, Cyclic, Stream, Went};
use super::waypoints::{self, LEAD};

/// A joint this near to where it was sent is there, rad: under the arm's own warning of 3 deg.
const THERE: f64 = 0.035;
/// A joint slower than this rests, rad/s.
const RESTS: f64 = 0.02;
/// How long the arm may take to say that a motion is over, s after it should be.
const PATIENCE: f64 = 3.0;
/// How long it may take to come to rest, s.
const COMING_TO_REST: f64 = 3.0;
/// How many answers in a row may fail to come before a motion is given up.
const MISSES: u32 = 3;
/// How often an arm may leave low-level servoing on one path and be asked back.
const MOST_LEFT: u64 = 20;
/// Fingers that move less than this in a tenth of a second rest, m; a per cent of their travel is 0.85 mm.
const STILL: f64 = 5e-4;
/// Fingers this far from where they were sent were stopped by something, m.
const STOPPED_SHORT: f64 = 3e-3;

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
    /// How long an answer may take.
    pub timeout: Duration,
    /// Where its joints are likely to be, rad: joints that turn without end are counted from there.
    pub near: Vec<f64>,
    /// Widest opening between the finger pads, m.
    pub max_opening: f64,
    /// The arm's clock.
    pub clock: Arc<dyn Clock>,
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
    beat: Option<Beat>,
    /// When the fingers are to be sent beside a motion, by the clock in s, and how far open, m.
    fingers: Option<(f64, f64)>,
}

/// How an action ended, as far as it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    Nothing,
    Started,
    Ended,
    /// Given up, with the arm's reason.
    Aborted(u16),
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
    pub fn beat(&self) -> Option<Beat> {
        self.beat
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

    /// Stops the arm at once and leaves it in fault until [`Self::clear_faults`].
    ///
    /// # Errors
    ///
    /// When the arm cannot be told: then use the button.
    pub fn emergency_stop(&mut self) -> Result<(), DeviceError> {
        let told = self.link.call::<()>(base::APPLY_EMERGENCY_STOP, &());
        told.map_err(|error| refused(error.to_string(), "press the emergency stop button"))
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
            let help = "see in the arm's web page which fault stays; it may need a restart";
            return Err(refused("the arm is still in fault", help));
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

    /// Asks for feedback, once.
    fn measure(&mut self) -> Result<Feedback, LinkError> {
        let told: cyclic::Feedback = self.link.call(base_cyclic::REFRESH_FEEDBACK, &())?;
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
                error: format!(
                    "{} actuators, {n} expected, all with numbers",
                    told.actuators.len()
                ),
            });
        }
        for (q, actuator) in self.q.iter_mut().zip(&told.actuators) {
            *q = degrees::from_wire(actuator.position, *q);
        }
        let each = |pick: fn(&cyclic::ActuatorFeedback) -> f32| {
            told.actuators.iter().map(move |actuator| f64::from(pick(actuator)))
        };
        let closed =
            told.interconnect.as_ref().and_then(|all| match all.tool_feedback.as_ref()? {
                ToolFeedback::GripperFeedback(gripper) => Some(gripper.motor.first()?.position),
            });
        let open = closed.map_or(f64::NAN, |percent| 1.0 - f64::from(percent) / 100.0);
        Ok(Feedback {
            time: self.options.clock.now() - self.begun,
            q_cmd: self.q_cmd.clone(),
            q: self.q.clone(),
            dq: each(|actuator| actuator.velocity).map(f64::to_radians).collect(),
            // The measured torque is opposite to the way the joint is driven (the vendor's example 108).
            tau: each(|actuator| -actuator.torque).collect(),
            opening: open * self.options.max_opening,
            mass: None,
        })
    }

    /// Asks for feedback and forgives a few answers that do not come.
    fn measure_patiently(&mut self, misses: &mut u32) -> Result<Option<Feedback>, DeviceError> {
        match self.measure() {
            Ok(feedback) => {
                *misses = 0;
                Ok(Some(feedback))
            }
            Err(error @ LinkError::Silent { .. }) => {
                *misses += 1;
                if *misses < MISSES { Ok(None) } else { Err(error.into()) }
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Stops the arm and waits until it rests; where it rests is where the next motion begins.
    fn halt(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<(), DeviceError> {
        // Asked more than once: a stop that was not heard is no stop.
        let mut stopped = self.link.call::<()>(base::STOP, &());
        for _ in 0..2 {
            if matches!(stopped, Err(LinkError::Silent { .. })) {
                stopped = self.link.call::<()>(base::STOP, &());
            }
        }
        stopped?;
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

    /// Reads what was told of actions since the last time.
    fn heard(&mut self, before: Told) -> Told {
        let mut told = before;
        for note in self.link.notes(self.actions) {
            // One that cannot be read is passed over: the joints will tell.
            let Ok(note) = ActionNotification::decode(&note.payload[..]) else { continue };
            told = match (note.action_event(), told) {
                (ActionEvent::Start, Told::Nothing) => Told::Started,
                (ActionEvent::End, _) => Told::Ended,
                (ActionEvent::Abort, _) => Told::Aborted(note.abort_details as u16),
                (_, told) => told,
            };
        }
        told
    }

    /// Has the arm check a path.
    fn validate(&mut self, list: &WaypointList) -> Result<(), DeviceError> {
        let report: WaypointValidationReport =
            self.link.call(base::VALIDATE_WAYPOINT_LIST, list)?;
        let report = report.trajectory_error_report.unwrap_or_default();
        match waypoints::words(&report, list.waypoints.len()) {
            None => Ok(()),
            Some(words) => Err(refused(words, "slow the motion down, or raise the soft limits")),
        }
    }

    /// Words why the arm gave a motion up.
    fn why_aborted(&mut self, sub_code: u16, n: usize) -> DeviceError {
        let known = refusal::sub_code(sub_code);
        let report =
            self.link.call::<TrajectoryErrorReport>(base::GET_TRAJECTORY_ERROR_REPORT, &());
        let path = report.ok().and_then(|report| waypoints::words(&report, n));
        let what = match (path, known) {
            (Some(path), _) => path,
            (None, Some(known)) => {
                format!("the arm gave the motion up: {} ({} {sub_code})", known.what, known.name)
            }
            (None, None) => format!("the arm gave the motion up and says {sub_code}"),
        };
        refused(what, known.map_or("see what stopped it and clear the faults", |known| known.help))
    }

    /// Follows a path the arm has taken to its end.
    fn accompany(
        &mut self,
        trajectory: &Trajectory,
        n: usize,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let clock = self.options.clock.clone();
        let goal = trajectory.ends().1;
        let (mut told, mut misses) = (Told::Nothing, 0);
        let mut start = clock.now();
        loop {
            if cancel.is_cancelled() {
                self.halt(watch)?;
                return Err(DeviceError::Stopped);
            }
            self.send_fingers_when_due()?;
            let before = told;
            told = self.heard(told);
            if before == Told::Nothing && told == Told::Started {
                start = clock.now();
            }
            let along = clock.now() - start - LEAD;
            self.q_cmd = trajectory.sample(along.max(0.0)).q;
            let feedback = match self.measure_patiently(&mut misses) {
                Ok(feedback) => feedback,
                Err(error) => {
                    let _ = self.halt(watch);
                    return Err(error);
                }
            };
            if let Some(feedback) = &feedback {
                watch(feedback);
            }
            if let Told::Aborted(sub_code) = told {
                let error = self.why_aborted(sub_code, n);
                let _ = self.halt(watch);
                return Err(error);
            }
            let late = along - trajectory.duration();
            let rests = feedback.as_ref().is_some_and(|feedback| {
                feedback.dq.iter().all(|dq| dq.abs() < RESTS)
                    && feedback.q.iter().zip(&goal).all(|(q, goal)| (q - goal).abs() < THERE)
            });
            // The word may be lost on its way; joints that are there and rest say the same.
            if rests && (told == Told::Ended || late > PATIENCE) {
                self.q_cmd = goal;
                return Ok(());
            }
            if late > 2.0 * PATIENCE {
                return self.not_there(&goal, feedback.as_ref(), watch);
            }
            clock.sleep(1.0 / self.options.rate);
        }
    }

    /// Follows a path by sending positions at 1 kHz.
    ///
    /// However it ends, the arm holds where it is and takes high-level commands again.
    fn stream(
        &mut self,
        how: Cyclic,
        trajectory: &Trajectory,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let address = SocketAddr::new(self.address.ip(), how.port);
        let mut datagrams = stream::open(address, &self.options.login)?;
        let told = stream::ask(&mut datagrams)?;
        let measured = self.inside(&told)?.q;
        let off = |(a, b): (&f64, &f64)| (a - b).abs();
        let jump = measured.iter().zip(&trajectory.ends().0).map(off).fold(0.0, f64::max);
        if jump > THERE {
            let what =
                format!("the path begins {:.1} deg from where the arm is", jump.to_degrees());
            return Err(refused(what, "plan again from where the arm is now"));
        }
        let mut beat = Beat::default();
        let streamed =
            self.beat_to_the_end(how, trajectory, &mut datagrams, &mut beat, cancel, watch);
        let back = self.set_servoing(ServoingMode::SingleLevel);
        self.beat = Some(beat);
        streamed?;
        back?;
        if cancel.is_cancelled() {
            let feedback = self.measure()?;
            self.q_cmd.clone_from(&feedback.q);
            return Err(DeviceError::Stopped);
        }
        self.q_cmd = trajectory.ends().1;
        Ok(())
    }

    /// Streams, and asks an arm back that left low-level servoing by itself.
    fn beat_to_the_end(
        &mut self,
        how: Cyclic,
        trajectory: &Trajectory,
        datagrams: &mut Datagrams,
        beat: &mut Beat,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let mut course = Course::start(self.q.len());
        loop {
            self.set_servoing(ServoingMode::LowLevel)?;
            let mut read = |told: &cyclic::Feedback| self.inside(told);
            let (silence, read) = (how.silence, &mut read);
            let stream = Stream { trajectory, course, cancel, silence, read };
            let along = match stream.run(datagrams, beat, watch)? {
                Went::Over => return Ok(()),
                Went::Left(along) => along,
            };
            beat.left += 1;
            if beat.left > MOST_LEFT {
                let what = format!(
                    "the arm left 1 kHz servoing {} times on one path, for want of commands in time",
                    beat.left
                );
                let help = "end what else this computer does, or leave `--stream` out";
                return Err(refused(what, help));
            }
            if cancel.is_cancelled() {
                return self.halt(watch);
            }
            course = Course::rejoin(trajectory, along, &self.at_rest(watch)?)?;
        }
    }

    /// Waits until the arm, which holds by itself, rests; returns where.
    fn at_rest(&mut self, watch: &mut dyn FnMut(&Feedback)) -> Result<Vec<f64>, DeviceError> {
        if self.state()? == ArmState::InFault {
            let what = "the arm went into fault while it was commanded at 1 kHz";
            return Err(refused(what, "find out why, then clear its faults"));
        }
        let until = self.options.clock.now() + COMING_TO_REST;
        let mut misses = 0;
        loop {
            if let Some(feedback) = self.measure_patiently(&mut misses)? {
                watch(&feedback);
                let rests = feedback.dq.iter().all(|dq| dq.abs() < RESTS);
                if rests || self.options.clock.now() > until {
                    return Ok(feedback.q);
                }
            }
            self.options.clock.sleep(1.0 / self.options.rate);
        }
    }

    fn set_servoing(&mut self, mode: ServoingMode) -> Result<(), LinkError> {
        let asked = ServoingModeInformation { servoing_mode: mode as i32 };
        self.link.call(base::SET_SERVOING_MODE, &asked)
    }

    /// Says which joint did not arrive, after stopping.
    fn not_there(
        &mut self,
        goal: &[f64],
        feedback: Option<&Feedback>,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let q = feedback.map_or_else(|| self.q.clone(), |feedback| feedback.q.clone());
        let _ = self.halt(watch);
        let off = |i: usize| (q[i] - goal[i]).abs();
        let worst = (0..q.len()).max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
        Err(DeviceError::FollowingError {
            joint: worst + 1,
            error_deg: off(worst).to_degrees(),
            limit_deg: THERE.to_degrees(),
        })
    }

    fn command_fingers(&mut self, opening: f64) -> Result<(), LinkError> {
        let closed = 1.0 - opening / self.options.max_opening;
        let finger = Finger { finger_identifier: 1, value: closed.clamp(0.0, 1.0) as f32 };
        let command = GripperCommand {
            mode: GripperMode::Position as i32,
            gripper: Some(Gripper { finger: vec![finger] }),
            duration: 0,
        };
        self.link.call(base::SEND_GRIPPER_COMMAND, &command)
    }

    /// Sends the fingers that are to go beside a motion, once it is time.
    fn send_fingers_when_due(&mut self) -> Result<(), LinkError> {
        match self.fingers {
            Some((due, opening)) if self.options.clock.now() >= due => {
                self.fingers = None;
                self.command_fingers(opening)
            }
            _ => Ok(()),
        }
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
        _ => Err(refused(
            format!("there is no host `{host}`"),
            "give the arm's name or address; its own is 192.168.1.10",
        )),
    }
}

/// Opens a session, looks what kind of arm it is, and has it follow high-level commands.
fn open(address: SocketAddr, options: &Options) -> Result<(Link, About, u16), DeviceError> {
    let link = Link::open(address, &options.login, options.timeout)?;
    let about = About::ask(&link)?;
    about.check(options.near.len())?;
    if about.state == ArmState::InFault {
        let told: cyclic::Feedback = link.call(base_cyclic::REFRESH_FEEDBACK, &())?;
        let what = format!("the arm is in fault: {}", in_words(&safety::faults(&told)));
        let help = "mend the cause, then clear its faults: `trueup kortex clear-faults ADDRESS`";
        return Err(refused(what, help));
    }
    if let Some(who) = &about.moving {
        let what = format!("someone else moves the arm now: {who}");
        return Err(refused(
            what,
            "wait until they are done, or stop them: `trueup kortex stop ADDRESS`",
        ));
    }
    if about.servoing != ServoingMode::SingleLevel {
        let single = ServoingModeInformation { servoing_mode: ServoingMode::SingleLevel as i32 };
        let () = link.call(base::SET_SERVOING_MODE, &single)?;
    }
    let actions = link.subscribe(base::ON_ACTION_TOPIC)?;
    Ok((link, about, actions))
}

impl Arm for KortexArm {
    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        match self.measure() {
            Ok(feedback) => Ok(feedback),
            Err(error) if error.is_lost() => {
                self.reconnect().map_err(|again| {
                    let what = format!("{error}; it cannot be opened again: {again}");
                    refused(what, again.help())
                })?;
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
        let () = self.link.call(base::EXECUTE_WAYPOINT_TRAJECTORY, &list)?;
        self.accompany(&trajectory, list.waypoints.len(), cancel, watch)
    }

    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        if cancel.is_cancelled() {
            return Err(DeviceError::Stopped);
        }
        self.fingers = None;
        self.command_fingers(grip.opening())?;
        let (mut last, mut still) = (self.measure()?.opening, 0);
        // At most five seconds: the slowest fingers need two.
        for _ in 0..50 {
            self.look_on(0.1, cancel, watch)?;
            let now = self.measure()?.opening;
            still = if (now - last).abs() < STILL { still + 1 } else { 0 };
            last = now;
            if still >= 3 {
                break;
            }
        }
        if !last.is_finite() {
            let help = "check the gripper's plug, then restart the arm";
            return Err(refused("the gripper does not report its opening", help));
        }
        Ok(Grip { opening: last, stalled: (last - grip.opening()).abs() > STOPPED_SHORT })
    }

    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError> {
        if self.options.stream.is_some() {
            let what = "the fingers are not commanded while positions are streamed to the joints";
            return Err(refused(what, "do one after the other, or do not stream"));
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
}
