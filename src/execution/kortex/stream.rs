//! Low-level servoing: a position for every joint a thousand times a second, over UDP.
//!
//! A thread of its own keeps the beat and never waits for an answer longer than a cycle; a datagram lost
//! costs one cycle. The arm is asked for low-level servoing before and brought back to single-level servoing
//! after, however the motion ends. A joint that falls behind its command by more than `BEHIND`, an arm
//! that is silent for too long, or one that leaves low-level servoing by itself ends the motion.
//!
//! Source: the vendor's examples 107 and 108 (first command is what was measured, numbers of frames, flags).

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use prost::Message;

use crate::execution::arm::{Cancel, DeviceError, Feedback};
use crate::motion::trajectory::Trajectory;

use super::about::refused;
use super::clock::{Clock, Wall};
use super::degrees;
use super::frame::{Frame, Kind};
use super::link::{Datagrams, LinkError, Login};
use super::messages::cyclic::{self, ActuatorCommand, Command};
use super::refusal::{self, Refusal};
use super::rpc::base_cyclic;

/// Time between two commands, s.
pub const PERIOD: f64 = 0.001;
/// A joint may be so far behind its command, rad: 4 deg, under the arm's own error at 5 deg.
const BEHIND: f64 = 4.0 * std::f64::consts::PI / 180.0;
/// How many commands are remembered, to be set beside the answers to them.
const REMEMBERED: usize = 4096;
/// A motion that is called off is slowed down to rest within so long, s.
const SLOWING: f64 = 0.3;
/// The last position is sent for so long after the end, s.
const SETTLE: f64 = 0.2;
/// `ActuatorCyclic.CommandFlags.SERVO_ENABLE`.
const SERVO_ENABLE: u32 = 1;

/// How to stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cyclic {
    /// The arm's UDP port; 10001 unless it is an emulator.
    pub port: u16,
    /// The arm may be silent for so long, s; 0.1 s is much on a machine that has little else to do.
    pub silence: f64,
}

/// How well the beat was kept.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Beat {
    /// Commands sent.
    pub sent: u64,
    /// Answers that came.
    pub answered: u64,
    /// Mean and longest time between two commands, s; [`PERIOD`] is what it should be.
    pub mean: f64,
    /// The longest.
    pub longest: f64,
    /// How many commands left more than half a period late.
    pub late: u64,
}

/// How a stream ended.
enum End {
    /// At the trajectory's end, or called off and at rest.
    Done,
    /// This joint (from 0) was this far behind, rad.
    Behind(usize, f64),
    /// The arm said no.
    Refused(Refusal),
    /// It said nothing.
    Silent,
    /// The socket failed.
    Lost(LinkError),
}

/// One motion over an open session.
pub(super) struct Stream<'a> {
    pub(super) trajectory: &'a Trajectory,
    pub(super) cancel: &'a Cancel,
    /// The arm may be silent for so long, s.
    pub(super) silence: f64,
    /// Reads feedback in the program's units.
    pub(super) read: &'a mut dyn FnMut(&cyclic::Feedback) -> Result<Feedback, LinkError>,
}

/// Opens a session for the stream and asks where the arm is.
pub(super) fn open(
    address: SocketAddr,
    login: &Login,
) -> Result<(Datagrams, cyclic::Feedback), LinkError> {
    let mut datagrams = Datagrams::open(address, login)?;
    let mut last = Err(LinkError::Lost("it was never open".to_owned()));
    // Datagrams get lost; a question about where the arm is may be asked again.
    for _ in 0..5 {
        last = datagrams.call(base_cyclic::REFRESH_FEEDBACK, &(), Duration::from_millis(200));
        if !matches!(last, Err(LinkError::Silent { .. })) {
            break;
        }
    }
    last.map(|feedback| (datagrams, feedback))
}

impl Stream<'_> {
    /// Streams to the end; `watch` sees what the arm answers. The caller has set the servoing mode.
    pub(super) fn run(
        self,
        datagrams: Datagrams,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Beat, DeviceError> {
        let (trajectory, cancel, silence) = (self.trajectory, self.cancel, self.silence);
        let n = trajectory.ends().0.len();
        thread::scope(|scope| {
            let (sender, told) = channel();
            let beating = scope.spawn(move || {
                let (frame, sent, beat) = (0, VecDeque::new(), Beat::default());
                let told = sender;
                Beating { trajectory, cancel, silence, datagrams, told, frame, sent, beat }.run()
            });
            let read = show(&told, n, self.read, watch);
            let (beat, end) = beating.join().map_err(|_| {
                refused("the thread that keeps the beat failed", "tell the project")
            })?;
            read?;
            match end {
                End::Done => Ok(beat),
                End::Behind(joint, by) => Err(DeviceError::FollowingError {
                    joint: joint + 1,
                    error_deg: by.to_degrees(),
                    limit_deg: BEHIND.to_degrees(),
                }),
                End::Refused(refusal) => Err(LinkError::Refused(refusal).into()),
                End::Silent => Err(LinkError::Silent {
                    rpc: base_cyclic::REFRESH,
                    milliseconds: (silence * 1e3) as u64,
                }
                .into()),
                End::Lost(error) => Err(error.into()),
            }
        })
    }
}

/// Shows the answers until the thread that receives them is done.
fn show(
    told: &Receiver<cyclic::Feedback>,
    n: usize,
    read: &mut dyn FnMut(&cyclic::Feedback) -> Result<Feedback, LinkError>,
    watch: &mut dyn FnMut(&Feedback),
) -> Result<(), DeviceError> {
    let mut first_wrong = None;
    loop {
        match told.recv_timeout(Duration::from_millis(100)) {
            Ok(feedback) if feedback.actuators.len() == n => match read(&feedback) {
                Ok(feedback) => watch(&feedback),
                Err(error) => first_wrong = first_wrong.or(Some(error)),
            },
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    first_wrong.map_or(Ok(()), |error| Err(error.into()))
}

/// The thread that keeps the beat.
struct Beating<'a> {
    trajectory: &'a Trajectory,
    cancel: &'a Cancel,
    silence: f64,
    datagrams: Datagrams,
    told: Sender<cyclic::Feedback>,
    frame: u32,
    /// The last commands, by the number of their frame.
    sent: VecDeque<(u32, Vec<f64>)>,
    beat: Beat,
}

impl Beating<'_> {
    fn run(mut self) -> (Beat, End) {
        let end = self.beat_on();
        (self.beat, end)
    }

    fn beat_on(&mut self) -> End {
        let duration = self.trajectory.duration();
        let (mut along, mut rate) = (0.0, 1.0_f64);
        let begun = Wall.now();
        let (mut last_sent, mut heard) = (begun, begun);
        let mut due = begun;
        let mut rest = 0.0;
        loop {
            // Time runs slower, never backwards, once the motion is called off.
            if self.cancel.is_cancelled() {
                rate = (rate - PERIOD / SLOWING).max(0.0);
            }
            along += PERIOD * rate;
            if along >= duration || rate <= 0.0 {
                rest += PERIOD;
            }
            let at = self.trajectory.sample(along.min(duration));
            if let Err(error) = self.send(&at.q, &at.dq, rate) {
                return End::Lost(error);
            }
            let now = Wall.now();
            self.count(now - last_sent);
            last_sent = now;
            due += PERIOD;
            // After a pause the beat goes on from now: catching up would be a jump.
            if now - due > 0.01 {
                due = now;
            }
            match self.listen(due) {
                Ok(true) => heard = Wall.now(),
                Ok(false) => {}
                Err(end) => return end,
            }
            if Wall.now() - heard > self.silence {
                return End::Silent;
            }
            if rest >= SETTLE {
                return End::Done;
            }
        }
    }

    fn send(&mut self, q: &[f64], dq: &[f64], rate: f64) -> Result<(), LinkError> {
        self.frame = (self.frame + 1) & 0xFFFF;
        let actuators = q.iter().zip(dq).map(|(&q, &dq)| ActuatorCommand {
            command_id: self.frame,
            flags: SERVO_ENABLE,
            position: degrees::to_wire(q),
            velocity: (dq * rate).to_degrees() as f32,
            ..ActuatorCommand::default()
        });
        let command =
            Command { frame_id: self.frame, actuators: actuators.collect(), interconnect: None };
        self.datagrams.send(base_cyclic::REFRESH, &command)?;
        self.beat.sent += 1;
        self.sent.push_back((self.frame, q.to_vec()));
        if self.sent.len() > REMEMBERED {
            self.sent.pop_front();
        }
        Ok(())
    }

    fn count(&mut self, interval: f64) {
        let beat = &mut self.beat;
        if beat.sent < 2 {
            return;
        }
        let n = (beat.sent - 1) as f64;
        beat.mean += (interval - beat.mean) / n;
        beat.longest = beat.longest.max(interval);
        if interval > 1.5 * PERIOD {
            beat.late += 1;
        }
    }

    /// Takes what comes until the next command is due; returns whether something came.
    fn listen(&mut self, due: f64) -> Result<bool, End> {
        let mut came = false;
        loop {
            let left = due - Wall.now();
            // Even when the next command is due, what has come already is taken.
            let wait = Duration::from_secs_f64(left.max(0.0));
            match self.datagrams.receive(wait) {
                Ok(Some(frame)) => came |= self.take(&frame)?,
                Ok(None) if left <= 0.0 => return Ok(came),
                Ok(None) => {}
                Err(error) => return Err(End::Lost(error)),
            }
            if left <= 0.0 {
                return Ok(came);
            }
        }
    }

    fn take(&mut self, frame: &Frame) -> Result<bool, End> {
        let header = &frame.header;
        let is_answer = header.kind == Kind::Response
            && (header.service, header.function)
                == (base_cyclic::REFRESH.service, base_cyclic::REFRESH.function);
        if !is_answer {
            return Ok(false);
        }
        if header.error != 0 {
            let told = (header.error, header.sub_error);
            let refusal = Refusal::read(base_cyclic::REFRESH, told, &frame.payload);
            let late = refusal.sub_code == refusal::WRONG_SERVOING_MODE && self.beat.answered == 0;
            // Until the mode is in force everywhere the first answers may still be refusals.
            return if late && self.beat.sent < 100 {
                Ok(true)
            } else {
                Err(End::Refused(refusal))
            };
        }
        let Ok(feedback) = cyclic::Feedback::decode(&frame.payload[..]) else { return Ok(false) };
        self.beat.answered += 1;
        // An answer to a command long forgotten says nothing about now.
        let Some(at) = self.sent.iter().position(|(number, _)| *number == feedback.frame_id) else {
            return Ok(false);
        };
        let is_fresh = (self.sent.len() - at) as f64 * PERIOD < self.silence;
        for (joint, (actuator, &q)) in feedback.actuators.iter().zip(&self.sent[at].1).enumerate() {
            let by = (degrees::from_wire(actuator.position, q) - q).abs();
            if by > BEHIND {
                return Err(End::Behind(joint, by));
            }
        }
        // Nobody listens any more: then nobody needs it.
        let _ = self.told.send(feedback);
        Ok(is_fresh)
    }
}
