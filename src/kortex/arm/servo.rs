//! A path sent as positions at 1 kHz, over UDP.
//!
//! However it ends, the arm holds where it is and takes high-level commands again.

use std::net::SocketAddr;

use crate::arm::{Cancel, DeviceError, Feedback};
use crate::motion::trajectory::Trajectory;

use super::super::beat::{Beat, Left, RESUME};
use super::super::clock::{Clock, Wall};
use super::super::error::{Error, Faults};
use super::super::link::{Datagrams, LinkError};
use super::super::messages::base::ServoingMode;
use super::super::messages::common::ArmState;
use super::super::messages::cyclic;
use super::super::rpc::base_cyclic;
use super::super::safety;
use super::super::stream::{self, Course, Cyclic, Stream, Went};
use super::{KortexArm, RESTS, THERE};

/// How often an arm may leave low-level servoing on one path and be asked back.
const MOST_LEFT: u64 = 20;

impl KortexArm {
    /// Follows a path by sending positions at 1 kHz.
    ///
    /// However it ends, the arm holds where it is and takes high-level commands again.
    pub(super) fn stream(
        &mut self,
        how: Cyclic,
        trajectory: &Trajectory,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        let address = SocketAddr::new(self.address.ip(), how.port);
        let mut datagrams = Datagrams::open(address, &self.options.login)?;
        let told = stream::ask(&mut datagrams)?;
        let measured = self.inside(&told)?.q;
        let off = |(a, b): (&f64, &f64)| (a - b).abs();
        let jump = measured.iter().zip(&trajectory.ends().0).map(off).fold(0.0, f64::max);
        if jump > THERE {
            return Err(Error::BeginsElsewhere(jump).into());
        }
        let mut beat = Beat::default();
        let streamed =
            self.beat_to_the_end(how, trajectory, &mut datagrams, &mut beat, cancel, watch);
        // One that was given up for its silence is not waited for again.
        let patience = if streamed.is_ok() { self.options.patience } else { self.soon() };
        let back = self.link.set_servoing_within(ServoingMode::SingleLevel, patience);
        self.is_silent = matches!(back, Err(LinkError::Silent { .. }));
        self.streamed.get_or_insert_default().add(&beat);
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
        let (mut course, mut before) = (Course::start(self.q.len()), None);
        let resume = how.silence.max(RESUME);
        loop {
            let patience = self.options.patience;
            self.link.set_servoing_within(ServoingMode::LowLevel, patience)?;
            before.map_or(Ok(()), |left| in_time(left, resume))?;
            let stream = Stream { trajectory, course, cancel, silence: how.silence };
            let mut show = |told: &cyclic::Feedback| self.inside(told).map(|told| watch(&told));
            let left = match stream.run(datagrams, beat, &mut show)? {
                Went::Over => return Ok(()),
                Went::Left(left) => left,
                Went::Ended => {
                    let state = self.state()?;
                    return Err(self.why_ended(state)?);
                }
            };
            before = Some(left);
            beat.left += 1;
            if beat.left > MOST_LEFT {
                return Err(Error::LeftTooOften(beat.left).into());
            }
            if cancel.is_cancelled() {
                return self.halt(watch);
            }
            let rest = self.at_rest(resume, left, watch)?;
            course = Course::rejoin(trajectory, left.along, &rest)?;
        }
    }

    /// Says why a stream ended whose commands came in time.
    fn why_ended(&self, state: ArmState) -> Result<DeviceError, DeviceError> {
        if state == ArmState::InFault {
            let told: cyclic::Feedback = self.link.call(base_cyclic::REFRESH_FEEDBACK, &())?;
            return Ok(Error::FaultInStream(Faults(safety::faults(&told))).into());
        }
        Ok(Error::StoppedByOther.into())
    }

    /// Waits until the arm, which left its stream and holds by itself, rests; returns where.
    ///
    /// # Errors
    ///
    /// When it is in fault, and when it is too late to go on without being asked.
    fn at_rest(
        &mut self,
        resume: f64,
        left: Left,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Vec<f64>, DeviceError> {
        let state = self.state()?;
        if state == ArmState::InFault {
            return Err(self.why_ended(state)?);
        }
        let mut misses = 0;
        loop {
            if let Some(feedback) = self.measure_patiently(&mut misses)? {
                watch(&feedback);
                in_time(left, resume)?;
                if feedback.dq.iter().all(|dq| dq.abs() < RESTS) {
                    return Ok(feedback.q);
                }
            }
            self.options.clock.sleep(1.0 / self.options.rate);
        }
    }
}

/// Refuses to go on with a stream that stood still for longer than `resume`, s.
fn in_time(left: Left, resume: f64) -> Result<(), DeviceError> {
    let stood = Wall.now() - left.heard;
    if stood <= resume {
        return Ok(());
    }
    Err(Error::StoodTooLong(stood).into())
}
