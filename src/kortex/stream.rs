//! Low-level servoing: a position for every joint a thousand times a second, over UDP.
//!
//! The arm is asked for low-level servoing before and brought back to single-level servoing after, however
//! the motion ends. The beat itself is kept by a thread of its own, in [`super::beat`]. An arm that leaves
//! low-level servoing by itself, as one does when commands are late, holds where it is; if it rests soon it is
//! asked again and led back to its path, a bounded number of times. One that someone else told to leave is not.
//!
//! Source: the vendor's examples 107 and 108 (first command is what was measured, numbers of frames, flags).

use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use crate::arm::{Cancel, DeviceError};
use crate::motion::trajectory::Trajectory;

use super::beat::{BEHIND, Beat, Beating, End, Left, RESUME};
use super::error::Error;
use super::link::{Datagrams, LinkError, Loss};
use super::messages::cyclic;
use super::rpc::base_cyclic;

/// How far off its path, rad, an arm may have come to rest to be led back to it: 2 deg.
const OFF: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// How far ahead of where it was left an arm may come to rest, s along the path.
const AHEAD: f64 = 1.0;

/// How to stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cyclic {
    /// The arm's UDP port; 10001 unless it is an emulator.
    pub port: u16,
    /// The arm may be silent for so long, s, before the motion is given up. The motion is held long before.
    pub silence: f64,
}

impl Cyclic {
    /// Streams to a port, and gives a motion up that stood still for longer than [`RESUME`].
    pub fn at(port: u16) -> Self {
        Self { port, silence: RESUME }
    }
}

/// Where on its path a stream begins: at its start, or where an arm that left it came to rest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    /// How far along the path, s.
    pub(super) along: f64,
    /// How far from it every joint is there, rad.
    pub(super) off: Vec<f64>,
}

impl Course {
    /// The beginning of a path, where the arm is.
    pub(super) fn start(n: usize) -> Self {
        Self { along: 0.0, off: vec![0.0; n] }
    }

    /// The place on a path nearest to where an arm rests that was left at `along`.
    pub(super) fn rejoin(
        trajectory: &Trajectory,
        along: f64,
        measured: &[f64],
    ) -> Result<Self, DeviceError> {
        let off = |along: f64| -> Vec<f64> {
            let there = trajectory.sample(along).q;
            measured.iter().zip(there).map(|(q, there)| q - there).collect()
        };
        let size = |off: &[f64]| off.iter().fold(0.0_f64, |most, off| most.max(off.abs()));
        let last = (along + AHEAD).min(trajectory.duration());
        let first = (along - 0.1).clamp(0.0, last);
        let steps = ((last - first) / 0.002).ceil().max(1.0);
        let places = (0..=steps as usize).map(|step| first + (last - first) * step as f64 / steps);
        let nearest =
            places.map(|along| (along, size(&off(along)))).min_by(|a, b| a.1.total_cmp(&b.1));
        let (along, by) = nearest.unwrap_or((along, f64::INFINITY));
        if by > OFF {
            return Err(Error::OffPath(by).into());
        }
        Ok(Self { along, off: off(along) })
    }
}

/// What became of a stream that did not fail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Went {
    /// It came to its end, or was called off and rests.
    Over,
    /// The arm left low-level servoing for want of commands in time.
    Left(Left),
    /// Someone else had it leave low-level servoing, or it went into fault.
    Ended,
}

/// One motion over an open session.
pub(super) struct Stream<'a> {
    pub(super) trajectory: &'a Trajectory,
    pub(super) course: Course,
    pub(super) cancel: &'a Cancel,
    /// The arm may be silent for so long, s.
    pub(super) silence: f64,
}

/// Sees what the arm answers; an error of it calls the motion off.
pub(super) type Watch<'a> = dyn FnMut(&cyclic::Feedback) -> Result<(), LinkError> + 'a;

/// Asks where the arm is; datagrams get lost, so a few times.
pub(super) fn ask(datagrams: &mut Datagrams) -> Result<cyclic::Feedback, LinkError> {
    let mut last = Err(LinkError::Lost(Loss::NeverOpen));
    for _ in 0..5 {
        last = datagrams.call(base_cyclic::REFRESH_FEEDBACK, &(), Duration::from_millis(200));
        if !matches!(last, Err(LinkError::Silent { .. })) {
            break;
        }
    }
    last
}

impl Stream<'_> {
    /// Streams to the end; `watch` sees what the arm answers, `beat` counts. The caller has set the
    /// servoing mode.
    pub(super) fn run(
        self,
        datagrams: &mut Datagrams,
        beat: &mut Beat,
        watch: &mut Watch<'_>,
    ) -> Result<Went, DeviceError> {
        let (trajectory, silence) = (self.trajectory, self.silence);
        let (n, course) = (self.course.off.len(), self.course);
        // What cannot be read calls the motion off, too.
        let off = self.cancel.child();
        let cancel = &off;
        thread::scope(|scope| {
            let (sender, told) = channel();
            let beating = scope.spawn(move || {
                Beating::new(trajectory, course, cancel, silence, datagrams, sender, beat).run()
            });
            let shown = show(&told, n, cancel, watch);
            let end = beating.join().map_err(|_| Error::BeatFailed)?;
            shown?;
            match end {
                End::Done => Ok(Went::Over),
                End::Left(left) => Ok(Went::Left(left)),
                End::Ended => Ok(Went::Ended),
                End::Paused(pause) => Err(Error::Paused(pause).into()),
                End::Behind(joint, by) => Err(DeviceError::FollowingError {
                    joint: joint + 1,
                    error_deg: by.to_degrees(),
                    limit_deg: BEHIND.to_degrees(),
                }),
                End::Refused(refusal) => Err(LinkError::Refused(refusal).into()),
                End::Silent => Err(Error::Stalled(silence).into()),
                End::Lost(error) => Err(error.into()),
            }
        })
    }
}

/// Shows the answers until the thread that receives them is done.
fn show(
    told: &Receiver<cyclic::Feedback>,
    n: usize,
    off: &Cancel,
    watch: &mut Watch<'_>,
) -> Result<(), DeviceError> {
    let mut first_wrong = None;
    loop {
        match told.recv_timeout(Duration::from_millis(100)) {
            Ok(feedback) if feedback.actuators.len() == n => {
                if let Err(error) = watch(&feedback) {
                    off.cancel();
                    first_wrong = first_wrong.or(Some(error));
                }
            }
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    first_wrong.map_or(Ok(()), |error| Err(error.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One joint that turns 1 rad in 10 s, from rest to rest.
    fn path() -> Trajectory {
        Trajectory::from_points(&[0.0, 5.0, 10.0], &[vec![0.0], vec![0.5], vec![1.0]]).unwrap()
    }

    #[test]
    fn an_arm_that_ran_on_a_little_rejoins_where_it_rests() {
        let path = path();
        let there = path.sample(4.3).q;
        let course = Course::rejoin(&path, 4.0, &there).unwrap();
        assert!((course.along - 4.3).abs() < 0.003, "{course:?}");
        assert!(course.off[0].abs() < 1e-3);
    }

    #[test]
    fn an_arm_beside_its_path_is_led_back_and_one_far_from_it_is_not() {
        let path = path();
        // Beyond the end nothing is nearer than the end.
        let course = Course::rejoin(&path, 9.9, &[1.02]).unwrap();
        assert!((course.along - 10.0).abs() < 1e-9 && (course.off[0] - 0.02).abs() < 1e-9);
        let error = Course::rejoin(&path, 4.0, &[0.9]).unwrap_err();
        assert!(error.to_string().contains("deg off its path"), "{error}");
    }
}
