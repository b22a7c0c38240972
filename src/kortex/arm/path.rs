//! A path the arm has validated, accompanied to its end.
//!
//! It is over when the arm says so *and* its joints are there; what the arm gives up is told with the joint, the
//! waypoint and the limit it names.

use prost::Message;

use crate::arm::{Cancel, DeviceError, Feedback};
use crate::motion::trajectory::Trajectory;

use super::super::clock::{Clock, Wall};
use super::super::error::{Error, GivenUp};
use super::super::link::MOVEMENT_SILENCE_MS;
use super::super::messages::base::{ActionEvent, ActionNotification};
use super::super::messages::trajectory::{
    TrajectoryErrorReport, WaypointList, WaypointValidationReport,
};
use super::super::refusal;
use super::super::rpc::base;
use super::super::waypoints::{LEAD, PathRefused};
use super::{KortexArm, RESTS, THERE};

/// How long the arm may take to say that a motion is over, s after it should be.
const PATIENCE: f64 = 3.0;

/// How an action ended, as far as it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    Nothing,
    Started,
    Ended,
    /// Given up, with the arm's reason.
    Aborted(u16),
}

impl KortexArm {
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
    pub(super) fn validate(&mut self, list: &WaypointList) -> Result<(), DeviceError> {
        let report: WaypointValidationReport =
            self.link.call(base::VALIDATE_WAYPOINT_LIST, list)?;
        let report = report.trajectory_error_report.unwrap_or_default();
        match PathRefused::of(&report, list.waypoints.len()) {
            None => Ok(()),
            Some(path) => Err(Error::PathRefused(path).into()),
        }
    }

    /// Asks why the arm gave a motion up.
    fn why_aborted(&mut self, sub_code: u16, n: usize) -> DeviceError {
        let report = self.link.call_within::<TrajectoryErrorReport>(
            base::GET_TRAJECTORY_ERROR_REPORT,
            &(),
            self.options.patience,
        );
        let path = report.ok().and_then(|report| PathRefused::of(&report, n));
        Error::GivenUp(GivenUp { path, sub_code }).into()
    }

    /// Follows a path the arm has taken to its end.
    pub(super) fn accompany(
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
        // The longest silence so far, s of the wall's clock, as the arm measures it.
        let (mut heard, mut silence) = (Wall.now(), 0.0_f64);
        loop {
            if cancel.is_cancelled() {
                self.halt(watch)?;
                return Err(DeviceError::Stopped);
            }
            if let Err(error) = self.send_fingers_when_due() {
                let _ = self.halt(watch);
                return Err(error.into());
            }
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
                silence = silence.max(Wall.now() - heard);
                heard = Wall.now();
                watch(feedback);
            }
            if let Told::Aborted(sub_code) = told {
                let cut_off = silence > f64::from(MOVEMENT_SILENCE_MS) / 1e3;
                let error = match sub_code {
                    // It stopped by itself because it was cut off: nobody told it to.
                    refusal::CONTROL_MANUAL_STOP if cut_off => Error::Stalled(silence).into(),
                    _ => self.why_aborted(sub_code, n),
                };
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
}
