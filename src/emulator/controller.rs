//! The controller behind the wire: frames in, frames out, and an arm that moves between them.
//!
//! No socket and no clock is here: a frame comes with the peer it came from and the time it came, and what
//! is to be sent is handed back. So everything the emulator does can be tried without a network.

use std::sync::Arc;

use prost::Message as _;

use crate::arm::ticked::Plant;
use crate::kortex::frame::{Frame, FrameError, Kind};
use crate::kortex::messages::base::{
    ArmStateNotification, OperatingMode, ServoingMode, ServoingModeNotification,
};
use crate::kortex::messages::common::{self, ArmState, Timestamp};
use crate::kortex::messages::config::ControlMode;
use crate::kortex::messages::force::{AdmittanceMode, WrenchMode};
use crate::kortex::messages::session::{ConnectionList, CreateSessionInfo};
use crate::kortex::refusal;
use crate::kortex::rpc::{self, Rpc};
use crate::motion::robot::Robot;

use super::actions::Actions;
use super::call::{Answer, Ask, Fault, Peer, done, read, say};
use super::config::Config;
use super::cyclic::Stream;
use super::error::Refused;
use super::expansion::Expansion;
use super::faults::Chance;
use super::sequences::Sequences;
use super::servo::{Happened, Motion, Servo};
use super::sessions::Sessions;
use super::topics::Topics;
use super::vision::Vision;
use super::zones::Zones;

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
        if !is_question(frame.header.kind) {
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
            return Err(Refused::UnknownFrame);
        }
        let Some(rpc) = Rpc::find(header.service, header.function) else {
            return Err(if rpc::is_service(header.service) {
                Refused::UnknownMethod
            } else {
                Refused::UnknownService
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
                Happened::OverLimit(joint, bit) if self.fault.is_none() => {
                    self.fail(Fault::Limit(joint, bit));
                }
                Happened::Broken(_) if self.fault.is_none() => self.fail(Fault::Other),
                Happened::LeftBehind(_) | Happened::OverLimit(..) | Happened::Broken(_) => {}
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
    pub(super) fn may_move(&mut self, ask: &Ask<'_>) -> Result<(), Refused> {
        match self.fault {
            Some(Fault::EmergencyStop) => {
                return Err(Refused::EmergencyStop);
            }
            Some(_) => return Err(Refused::InFault),
            None if self.operating != OperatingMode::Run => {
                return Err(Refused::InMaintenance);
            }
            None => {}
        }
        let is_moving = self.is_moving();
        self.sessions.take(ask.session, is_moving, ask.now)
    }

    /// As [`Self::may_move`], for commands of single-level servoing.
    pub(super) fn may_command(&mut self, ask: &Ask<'_>) -> Result<(), Refused> {
        self.may_move(ask)?;
        match self.mode {
            ServoingMode::SingleLevel => Ok(()),
            _ => Err(Refused::NotSingleLevel),
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
            Fault::Following(_) | Fault::Limit(..) | Fault::Other => refusal::ROBOT_IN_FAULT,
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

/// Returns whether a frame of this kind is answered.
fn is_question(kind: Kind) -> bool {
    !matches!(kind, Kind::Response | Kind::Notification)
}

/// Answers a frame that cannot be read; `None` where it cannot be told whose question it was, which only a header tells.
pub(super) fn answer_unread(error: &FrameError) -> Option<Frame> {
    let FrameError::Version { header, .. } = error else { return None };
    let frame = Frame { header: *header, payload: Vec::new() };
    is_question(header.kind).then(|| refused(&frame, header.session, &Refused::OtherVersion))
}

/// Returns the response that says no.
fn refused(frame: &Frame, session: u16, no: &Refused) -> Frame {
    let error = common::Error {
        error_code: i32::from(no.code()),
        error_sub_code: u32::from(no.sub_code()),
        error_sub_string: no.to_string(),
    };
    let mut response = frame.response(session, error.encode_to_vec());
    (response.header.error, response.header.sub_error) = (no.code(), no.sub_code());
    response
}
