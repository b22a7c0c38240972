//! The thread that keeps the beat of low-level servoing.
//!
//! It never waits for an answer longer than a cycle. A datagram lost costs one cycle. When nothing has been
//! heard for a while the motion is slowed down to rest and the position is held, a thousand times a second
//! as before; it goes on as gently once answers come again. When the thread itself was not let run, it goes
//! on from where it was, the slower the longer the pause, and makes up for a small step at most. So a
//! busy machine or network makes a motion longer, never faster or rougher. A joint that falls behind its
//! command by more than 4 deg, or an arm that is silent for too long, ends the motion.
//!
//! A stream that stood still for longer than [`RESUME`], whoever was silent, is over: by then someone may have
//! stopped the arm and walked up to it. An arm that leaves low-level servoing although commands and answers came
//! in time was told to by someone else, and is not asked back at all.

use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::time::Duration;

use prost::Message;

use crate::arm::Cancel;
use crate::motion::trajectory::Trajectory;

use super::clock::{Clock, Wall};
use super::degrees;
use super::frame::{Frame, Kind};
use super::link::{Datagrams, LinkError};
use super::messages::cyclic::{self, ActuatorCommand, Command};
use super::pacing::Intervals;
use super::refusal::{self, Refusal};
use super::rpc::base_cyclic;
use super::stream::Course;

/// Time between two commands, s.
pub const PERIOD: f64 = 0.001;
/// A joint may be so far behind its command, rad: 4 deg, under the arm's own error at 5 deg.
pub(super) const BEHIND: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// How many commands are remembered, to be set beside the answers to them.
const REMEMBERED: usize = 4096;
/// A motion is slowed down to rest, and brought back to its pace, within so long, s.
const SLOWING: f64 = 0.3;
/// The last position is sent for so long after the end, s.
const SETTLE: f64 = 0.2;
/// Without an answer for so long the motion is held, s: fifty cycles in a row were lost.
const UNHEARD: f64 = 0.05;
/// A pause of this thread that counts as one, s, and one after which the arm has come to rest at the last
/// command: in between the pace is taken back in proportion.
const PAUSE: (f64, f64) = (0.02, 0.1);
/// What a late command may make up for, rad for the joint that moves most: half a degree, a sixth of what
/// the arm warns at.
const JUMP: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// An arm beside its path is led back to it within so long, s.
const BACK: f64 = 0.5;
/// `ActuatorCyclic.CommandFlags.SERVO_ENABLE`.
const SERVO_ENABLE: u32 = 1;

/// A stream that stood still for longer is over, s; it never goes on by itself.
pub const RESUME: f64 = 0.5;
/// A pause in commands or answers that may be why an arm left low-level servoing, s: thirty cycles.
const LAPSE: f64 = 0.03;

/// How well the beat was kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Beat {
    /// Commands sent.
    pub sent: u64,
    /// Answers that came.
    pub answered: u64,
    /// Times between two commands; [`PERIOD`] is what they should be.
    pub intervals: Intervals,
    /// Commands sent while the motion was slowed down or held because nothing was heard.
    pub held: u64,
    /// How often the thread was not let run for more than a fiftieth of a second.
    pub paused: u64,
    /// How often the arm left low-level servoing and was asked back.
    pub left: u64,
}

impl Beat {
    /// Adds what another motion came to.
    pub fn add(&mut self, other: &Self) {
        self.sent += other.sent;
        self.answered += other.answered;
        self.intervals.add_all(&other.intervals);
        self.held += other.held;
        self.paused += other.paused;
        self.left += other.left;
    }
}

/// How a stream ended.
pub(super) enum End {
    /// At the trajectory's end, or called off and at rest.
    Done,
    /// The arm left low-level servoing for want of commands in time.
    Left(Left),
    /// The arm left low-level servoing although commands came in time: someone else told it to.
    Ended,
    /// This machine sent nothing for so long, s.
    Paused(f64),
    /// This joint (from 0) was this far behind, rad.
    Behind(usize, f64),
    /// The arm said no.
    Refused(Refusal),
    /// It said nothing.
    Silent,
    /// The socket failed.
    Lost(LinkError),
}

/// Where an arm left low-level servoing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Left {
    /// How far along the path, s.
    pub(super) along: f64,
    /// When the last command that was answered was sent, s of the wall's clock.
    pub(super) heard: f64,
}

/// The thread's state.
pub(super) struct Beating<'a> {
    trajectory: &'a Trajectory,
    cancel: &'a Cancel,
    silence: f64,
    datagrams: &'a mut Datagrams,
    told: Sender<cyclic::Feedback>,
    beat: &'a mut Beat,
    frame: u32,
    /// The last commands: the number of their frame, when they were sent, s, and the positions, rad.
    sent: VecDeque<(u32, f64, Vec<f64>)>,
    /// How many commands this stream sent and how many were answered.
    mine: (u64, u64),
    /// When the last command that was answered was sent, s: a pause of this machine does not make it younger.
    heard: f64,
    /// How far along the path, s, and at which share of its pace.
    along: f64,
    rate: f64,
    /// How far off the path it began, rad, and how much of that is left.
    off: Vec<f64>,
    left: f64,
}

impl<'a> Beating<'a> {
    pub(super) fn new(
        trajectory: &'a Trajectory,
        course: Course,
        cancel: &'a Cancel,
        silence: f64,
        datagrams: &'a mut Datagrams,
        told: Sender<cyclic::Feedback>,
        beat: &'a mut Beat,
    ) -> Self {
        // A path begins at rest by itself; in the middle of it the pace is taken up gently.
        let rate = if course.along > 0.0 { 0.0 } else { 1.0 };
        Self {
            trajectory,
            cancel,
            silence,
            datagrams,
            told,
            beat,
            frame: 0,
            sent: VecDeque::new(),
            mine: (0, 0),
            heard: Wall.now(),
            along: course.along,
            rate,
            off: course.off,
            left: 1.0,
        }
    }

    /// Keeps the beat to the end.
    pub(super) fn run(mut self) -> End {
        let duration = self.trajectory.duration();
        let begun = Wall.now();
        let (mut last_sent, mut due) = (begun, begun);
        self.heard = begun;
        let mut rest = 0.0;
        loop {
            let now = Wall.now();
            let since = now - last_sent;
            // What was not sent for so long is not gone on with, whatever the arm has done since.
            if since > RESUME.max(self.silence) {
                return End::Paused(since);
            }
            self.rate *= self.count(since);
            let passed = since.min(PAUSE.0);
            let is_off = self.step(passed, last_sent - self.heard < UNHEARD);
            if self.along >= duration || is_off {
                rest += passed;
            }
            let (q, dq) = self.target();
            if let Err(error) = self.send(&q, &dq) {
                return End::Lost(error);
            }
            last_sent = now;
            // What was late is not sent for again: the next command is a whole period away.
            due = (due + PERIOD).max(now + 0.5 * PERIOD);
            if let Err(end) = self.listen(due) {
                return end;
            }
            if last_sent - self.heard > self.silence {
                return End::Silent;
            }
            if rest >= SETTLE {
                return End::Done;
            }
        }
    }

    /// Moves on along the path by so much time, s; returns whether the motion was called off and rests.
    fn step(&mut self, passed: f64, is_heard: bool) -> bool {
        let is_off = self.cancel.is_cancelled();
        if !is_heard {
            self.beat.held += 1;
        }
        // Time runs slower, never backwards, once the motion is called off or nobody answers.
        let wanted = if is_off || !is_heard { 0.0 } else { 1.0 };
        let most = passed / SLOWING;
        self.rate += (wanted - self.rate).clamp(-most, most);
        let at = self.trajectory.sample(self.along.min(self.trajectory.duration()));
        let fastest = at.dq.iter().fold(0.0_f64, |most, dq| most.max(dq.abs()));
        // A late command makes up for the time that was lost, but for a small step only.
        let most = if fastest > 0.0 { JUMP / fastest } else { f64::INFINITY };
        self.along += (passed * self.rate).min(most);
        if is_heard {
            self.left = (self.left - passed / BACK).max(0.0);
        }
        is_off && self.rate <= 0.0
    }

    /// Returns where the joints are to be now, rad, and how fast, rad/s.
    fn target(&self) -> (Vec<f64>, Vec<f64>) {
        let at = self.trajectory.sample(self.along.min(self.trajectory.duration()));
        // From 1 to 0 without a jump in speed.
        let share = self.left * self.left * (3.0 - 2.0 * self.left);
        let q = at.q.iter().zip(&self.off).map(|(q, off)| q + share * off).collect();
        (q, at.dq.iter().map(|dq| dq * self.rate).collect())
    }

    fn send(&mut self, q: &[f64], dq: &[f64]) -> Result<(), LinkError> {
        self.frame = (self.frame + 1) & 0xFFFF;
        let actuators = q.iter().zip(dq).map(|(&q, &dq)| ActuatorCommand {
            command_id: self.frame,
            flags: SERVO_ENABLE,
            position: degrees::to_wire(q),
            velocity: dq.to_degrees() as f32,
            ..ActuatorCommand::default()
        });
        let command =
            Command { frame_id: self.frame, actuators: actuators.collect(), interconnect: None };
        self.datagrams.send(base_cyclic::REFRESH, &command)?;
        self.beat.sent += 1;
        self.mine.0 += 1;
        self.sent.push_back((self.frame, Wall.now(), q.to_vec()));
        if self.sent.len() > REMEMBERED {
            self.sent.pop_front();
        }
        Ok(())
    }

    /// Notes the time between two commands; returns the share of its pace the motion keeps after it.
    fn count(&mut self, interval: f64) -> f64 {
        if self.mine.0 == 0 {
            return 1.0;
        }
        self.beat.intervals.add(interval);
        let (short, long) = PAUSE;
        if interval <= short {
            return 1.0;
        }
        self.beat.paused += 1;
        (1.0 - (interval - short) / (long - short)).max(0.0)
    }

    /// Takes what comes until the next command is due.
    fn listen(&mut self, due: f64) -> Result<(), End> {
        loop {
            let left = due - Wall.now();
            // Even when the next command is due, what has come already is taken.
            let wait = Duration::from_secs_f64(left.max(0.0));
            match self.datagrams.receive(wait) {
                Ok(Some(frame)) => self.take(&frame)?,
                Ok(None) => {}
                Err(error) => return Err(End::Lost(error)),
            }
            if left <= 0.0 {
                return Ok(());
            }
        }
    }

    /// Says why an arm is no longer in low-level servoing. What it was sent just now it has answered, unless it
    /// went without for a while.
    fn why_left(&self) -> End {
        if Wall.now() - self.heard < LAPSE {
            return End::Ended;
        }
        End::Left(Left { along: self.along, heard: self.heard })
    }

    fn take(&mut self, frame: &Frame) -> Result<(), End> {
        let header = &frame.header;
        let is_answer = header.kind == Kind::Response
            && (header.service, header.function)
                == (base_cyclic::REFRESH.service, base_cyclic::REFRESH.function);
        if !is_answer {
            return Ok(());
        }
        if header.error != 0 {
            let told = (header.error, header.sub_error);
            let refusal = Refusal::read(base_cyclic::REFRESH, told, &frame.payload);
            if refusal.sub_code != refusal::WRONG_SERVOING_MODE {
                return Err(End::Refused(refusal));
            }
            // Until the mode is in force everywhere the first answers may still be refusals.
            return match self.mine {
                (sent, 0) if sent < 100 => {
                    self.heard = Wall.now();
                    Ok(())
                }
                (_, 0) => Err(End::Refused(refusal)),
                _ => Err(self.why_left()),
            };
        }
        let Ok(feedback) = cyclic::Feedback::decode(&frame.payload[..]) else { return Ok(()) };
        self.beat.answered += 1;
        self.mine.1 += 1;
        // An answer to a command long forgotten says nothing about now.
        let Some(at) = self.sent.iter().position(|(number, ..)| *number == feedback.frame_id)
        else {
            return Ok(());
        };
        let (_, sent, q) = &self.sent[at];
        self.heard = self.heard.max(*sent);
        for (joint, (actuator, &q)) in feedback.actuators.iter().zip(q).enumerate() {
            let by = (degrees::from_wire(actuator.position, q) - q).abs();
            if by > BEHIND {
                return Err(End::Behind(joint, by));
            }
        }
        // What comes out of order is older than what has come.
        self.sent.drain(..at);
        // Nobody listens any more: then nobody needs it.
        let _ = self.told.send(feedback);
        Ok(())
    }
}
