//! The controller behind the wire: frames in, frames out, and an arm that moves between them.
//!
//! No socket and no clock is here: a frame comes with the peer it came from and the time it came, and what
//! is to be sent is handed back. So everything the emulator does can be tried without a network.

use std::net::SocketAddr;
use std::sync::Arc;

use prost::Message;

use crate::execution::kortex::frame::{Frame, Kind};
use crate::execution::kortex::messages::base::{
    ArmStateNotification, OperatingMode, ServoingMode, ServoingModeNotification,
};
use crate::execution::kortex::messages::common::{self, ArmState, Timestamp};
use crate::execution::kortex::messages::config::ControlMode;
use crate::execution::kortex::messages::force::{AdmittanceMode, WrenchMode};
use crate::execution::kortex::messages::session::{ConnectionList, CreateSessionInfo};
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc::{self, Rpc};
use crate::execution::ticked::Plant;
use crate::motion::robot::Robot;

use super::actions::Actions;
use super::config::Config;
use super::cyclic::Stream;
use super::expansion::Expansion;
use super::faults::Chance;
use super::sequences::Sequences;
use super::servo::{Happened, Motion, Servo};
use super::sessions::Sessions;
use super::topics::Topics;
use super::vision::Vision;
use super::zones::Zones;

/// A client as the network knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Peer {
    /// A TCP connection, by its number, and where it came from.
    Tcp(u64, SocketAddr),
    /// Whoever sends datagrams from there.
    Udp(SocketAddr),
}

impl std::fmt::Display for Peer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tcp(_, from) => write!(f, "TCP {from}"),
            Self::Udp(from) => write!(f, "UDP {from}"),
        }
    }
}

/// A refusal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct No {
    pub(super) code: u8,
    pub(super) sub_code: u16,
    pub(super) detail: String,
}

impl No {
    /// The protocol was broken.
    pub(super) fn protocol(sub_code: u16, detail: &str) -> Self {
        Self { code: 1, sub_code, detail: detail.to_owned() }
    }

    /// The arm will not.
    pub(super) fn device(sub_code: u16, detail: &str) -> Self {
        Self { code: 3, sub_code, detail: detail.to_owned() }
    }
}

/// What a service says: a serialised message or a no.
pub(super) type Answer = Result<Vec<u8>, No>;

/// Says a message.
#[expect(clippy::unnecessary_wraps, reason = "the last word of every service")]
pub(super) fn say(message: &impl Message) -> Answer {
    Ok(message.encode_to_vec())
}

/// Says that it is done.
#[expect(clippy::unnecessary_wraps, reason = "the last word of every service")]
pub(super) fn done() -> Answer {
    Ok(Vec::new())
}

/// Reads what a call carries.
pub(super) fn read<M: Message + Default>(payload: &[u8]) -> Result<M, No> {
    M::decode(payload)
        .map_err(|error| No::protocol(refusal::PAYLOAD_DECODING_ERR, &error.to_string()))
}

/// Who asks what, and when.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ask<'a> {
    pub(super) rpc: Rpc,
    pub(super) peer: Peer,
    pub(super) session: u16,
    pub(super) device: u8,
    pub(super) payload: &'a [u8],
    /// When it came, s.
    pub(super) now: f64,
}

impl Ask<'_> {
    /// Reads what the call carries.
    pub(super) fn read<M: Message + Default>(&self) -> Result<M, No> {
        read(self.payload)
    }
}

/// Why the arm is in fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// Someone pressed, or called, the emergency stop.
    EmergencyStop,
    /// This joint (from 0) did not follow its command.
    Following(usize),
    /// Something else, planted or real.
    Other,
}

/// Everything behind the wire.
pub(super) struct Controller {
    pub(super) robot: Arc<Robot>,
    pub(super) servo: Servo,
    pub(super) sessions: Sessions,
    pub(super) topics: Topics,
    pub(super) actions: Actions,
    pub(super) config: Config,
    pub(super) stream: Stream,
    pub(super) chance: Chance,
    pub(super) mode: ServoingMode,
    pub(super) fault: Option<Fault>,
    pub(super) sequences: Sequences,
    pub(super) zones: Zones,
    pub(super) expansion: Expansion,
    pub(super) vision: Vision,
    pub(super) operating: OperatingMode,
    pub(super) admittance: AdmittanceMode,
    /// The mode of the last wrench.
    pub(super) wrench: WrenchMode,
    /// Whether the waypoints that are followed are poses of the tool.
    pub(super) is_cartesian: bool,
    /// Whether everyone is to be sent away for a while.
    pub(super) is_rebooting: bool,
    pub(super) told_mode: ControlMode,
    told_state: ArmState,
    /// When the program was started, s.
    begun: f64,
}

impl Controller {
    pub(super) fn new(
        robot: Arc<Robot>,
        plant: Box<dyn Plant>,
        (user, password): (&str, &str),
        chance: Chance,
        now: f64,
    ) -> Self {
        Self {
            servo: Servo::new(robot.clone(), plant),
            sessions: Sessions::new(user, password),
            topics: Topics::default(),
            actions: Actions::of(&robot),
            config: Config::of(&robot),
            stream: Stream::new(f64::INFINITY),
            chance,
            mode: ServoingMode::SingleLevel,
            fault: None,
            sequences: Sequences::default(),
            zones: Zones::default(),
            expansion: Expansion::default(),
            vision: Vision::default(),
            operating: OperatingMode::Run,
            admittance: AdmittanceMode::Disabled,
            wrench: WrenchMode::Normal,
            is_cartesian: false,
            is_rebooting: false,
            told_mode: ControlMode::Idle,
            told_state: ArmState::ServoingReady,
            begun: now,
            robot,
        }
    }

    /// Answers a frame; `None` for one that is no question.
    pub(super) fn answer(&mut self, peer: Peer, frame: &Frame, now: f64) -> Option<Frame> {
        if matches!(frame.header.kind, Kind::Response | Kind::Notification) {
            return None;
        }
        let mut session = frame.header.session;
        let answered = self.dispatch(peer, frame, now, &mut session);
        let answered = self.chance.garble(answered);
        Some(match answered {
            Ok(payload) => frame.response(session, payload),
            Err(no) => refused(frame, session, &no),
        })
    }

    fn dispatch(&mut self, peer: Peer, frame: &Frame, now: f64, session: &mut u16) -> Answer {
        let header = &frame.header;
        if header.kind != Kind::Request {
            return Err(No::protocol(refusal::UNSUPPORTED_FRAME_TYPE, "unsupported frame type"));
        }
        let Some(rpc) = Rpc::find(header.service, header.function) else {
            return Err(if rpc::is_service(header.service) {
                No::protocol(refusal::UNSUPPORTED_METHOD, "unsupported method")
            } else {
                No::protocol(refusal::UNSUPPORTED_SERVICE, "unsupported service")
            });
        };
        if rpc == rpc::session::CREATE_SESSION {
            let asked: CreateSessionInfo = read(&frame.payload)?;
            self.peer_left(peer);
            *session = self.sessions.create(peer, &asked, now)?;
            return done();
        }
        self.sessions.heard(peer, header.session, now)?;
        let ask = Ask {
            rpc,
            peer,
            session: header.session,
            device: header.device,
            payload: &frame.payload,
            now,
        };
        match rpc.service {
            1 => self.session_service(&ask),
            2 => self.base_service(&ask),
            3 => self.cyclic_service(&ask),
            5 => self.vision_service(&ask),
            14 => self.interconnect_service(&ask),
            _ => self.config_service(&ask),
        }
    }

    fn session_service(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc {
            rpc::session::CLOSE_SESSION => {
                self.session_over(ask.session);
                done()
            }
            rpc::session::KEEP_ALIVE => done(),
            _ => say(&ConnectionList { connection: self.sessions.connections() }),
        }
    }

    /// Takes note that a connection is gone: its sessions end, and so does what they moved.
    pub(super) fn peer_left(&mut self, peer: Peer) {
        let (gone, had_control) = self.sessions.leave(peer);
        for session in gone {
            self.topics.forget(session);
        }
        if had_control {
            self.stop_all(refusal::CONTROL_MANUAL_STOP);
        }
    }

    /// Ends every session there is.
    pub(super) fn all_sessions_over(&mut self) {
        for session in self.sessions.ids() {
            self.session_over(session);
        }
    }

    fn session_over(&mut self, session: u16) {
        self.topics.forget(session);
        if self.sessions.close(session) {
            self.stop_all(refusal::CONTROL_MANUAL_STOP);
        }
    }

    /// Lets one tick of the arm pass at wall time `now`, s.
    pub(super) fn tick(&mut self, now: f64) {
        for session in self.sessions.expire(now) {
            self.session_over(session);
        }
        if self.is_moving() && self.sessions.is_holder_silent(now) {
            self.stop_all(refusal::CONTROL_MANUAL_STOP);
        }
        self.mind_silence();
        self.keep_zones();
        for happened in self.servo.tick() {
            match happened {
                Happened::Arrived => self.action_arrived(),
                Happened::Passed(waypoint) => self.waypoint_passed(waypoint),
                Happened::FingersRest => self.fingers_rest(),
                Happened::LeftBehind(joint) if self.fault.is_none() => {
                    self.fail(Fault::Following(joint));
                }
                Happened::Broken(_) if self.fault.is_none() => self.fail(Fault::Other),
                Happened::LeftBehind(_) | Happened::Broken(_) => {}
            }
        }
        self.chance.at(now - self.begun);
        if self.chance.forgets() {
            self.all_sessions_over();
        }
        for planted in self.chance.due() {
            self.fail(planted);
        }
        if self.actions.is_running() && self.chance.aborts() {
            self.abort_action(refusal::CONTROL_WAYPOINT_TRAJECTORY_ABORTED);
            self.servo.brake();
        }
        self.play_on(now);
        self.tell_state();
        self.tell_control_mode();
    }

    /// Returns whether something moves because someone commanded it.
    pub(super) fn is_moving(&self) -> bool {
        !matches!(self.servo.motion(), Motion::Hold | Motion::Brake)
    }

    /// Says whether a session may move the arm now, and gives it control.
    pub(super) fn may_move(&mut self, ask: &Ask<'_>) -> Result<(), No> {
        match self.fault {
            Some(Fault::EmergencyStop) => {
                return Err(No::device(
                    refusal::ROBOT_IN_EMERGENCY_STOP,
                    "robot is in emergency stop",
                ));
            }
            Some(_) => return Err(No::device(refusal::ROBOT_IN_FAULT, "robot is in fault")),
            None if self.operating != OperatingMode::Run => {
                let word = "robot is in maintenance";
                return Err(No::device(refusal::ROBOT_IN_MAINTENANCE, word));
            }
            None => {}
        }
        let is_moving = self.is_moving();
        self.sessions.take(ask.session, is_moving, ask.now)
    }

    /// As [`Self::may_move`], for commands of single-level servoing.
    pub(super) fn may_command(&mut self, ask: &Ask<'_>) -> Result<(), No> {
        self.may_move(ask)?;
        match self.mode {
            ServoingMode::SingleLevel => Ok(()),
            _ => {
                Err(No::device(refusal::WRONG_SERVOING_MODE, "must be single level servoing mode"))
            }
        }
    }

    /// Brings everything to rest; a running action is aborted for this reason. A stream of positions is at an end:
    /// its next command is refused until someone asks for low-level servoing again.
    pub(super) fn stop_all(&mut self, sub_code: u16) {
        self.set_mode(ServoingMode::SingleLevel);
        self.servo.brake();
        self.abort_action(sub_code);
    }

    /// Goes into fault: every joint holds where it was measured, wherever it was sent.
    pub(super) fn fail(&mut self, fault: Fault) {
        let reason = match fault {
            Fault::EmergencyStop => refusal::ROBOT_IN_EMERGENCY_STOP,
            Fault::Following(_) | Fault::Other => refusal::ROBOT_IN_FAULT,
        };
        self.fault = Some(fault);
        self.stop_all(reason);
        self.servo.hold_here();
    }

    /// Forgets the fault. What leaned on something since is not sent back into it.
    pub(super) fn clear_fault(&mut self) {
        if self.fault.take().is_some() {
            self.servo.hold_here();
        }
    }

    /// Changes the servoing mode and says so.
    pub(super) fn set_mode(&mut self, mode: ServoingMode) {
        if self.mode == mode {
            return;
        }
        self.mode = mode;
        self.servo.brake();
        let told = ServoingModeNotification {
            servoing_mode: mode as i32,
            timestamp: Some(self.timestamp()),
            user_handle: None,
            connection: None,
        };
        self.topics.tell(rpc::base::ON_SERVOING_MODE_TOPIC, &told);
    }

    /// Returns the arm's state.
    pub(super) fn arm_state(&self) -> ArmState {
        match (self.fault, self.mode, self.servo.motion()) {
            (Some(_), _, _) => ArmState::InFault,
            _ if self.operating != OperatingMode::Run => ArmState::Maintenance,
            _ if self.sequences.is_playing() => ArmState::ServoingPlayingSequence,
            (None, ServoingMode::LowLevel, _) => ArmState::ServoingLowLevel,
            (None, _, Motion::Speeds(_) | Motion::Twist { .. }) => {
                ArmState::ServoingManuallyControlled
            }
            _ => ArmState::ServoingReady,
        }
    }

    fn tell_state(&mut self) {
        let state = self.arm_state();
        if state != self.told_state {
            self.told_state = state;
            let told = ArmStateNotification {
                active_state: state as i32,
                timestamp: Some(self.timestamp()),
                connection: None,
            };
            self.topics.tell(rpc::base::ON_ARM_STATE_TOPIC, &told);
        }
    }

    /// Returns the arm's time.
    pub(super) fn timestamp(&self) -> Timestamp {
        let time = self.servo.time;
        Timestamp { sec: time as u32, usec: (time.fract() * 1e6) as u32 }
    }
}

/// Returns the response that says no.
fn refused(frame: &Frame, session: u16, no: &No) -> Frame {
    let error = common::Error {
        error_code: i32::from(no.code),
        error_sub_code: u32::from(no.sub_code),
        error_sub_string: no.detail.clone(),
    };
    let mut response = frame.response(session, error.encode_to_vec());
    (response.header.error, response.header.sub_error) = (no.code, no.sub_code);
    response
}
