//! Going until something is felt: by the torques of the joints, against what they were at rest.
//!
//! How far that is may differ between the rehearsal and the arm by what a table is believed lower or higher; what follows
//! is then shifted by as much (`ActionContext::slid`), and much further the arm does not go.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;

use super::super::decisions::{Entry, Kind};
use super::super::error::ActionError;
use super::super::plan::{distance, force_at, force_of, gravity_torque};
use super::super::refusal::Refusal;
use super::ActionContext;
use super::moving::ROOM;
use crate::arm::{DeviceError, Feedback};
use crate::motion::Robot;
use crate::motion::trajectory::Trajectory;
use crate::trace::Unrehearsed;

/// How fast the tool goes where something is to be felt, m/s. Measured in the laboratory: at twice this a touch for 3 N ended
/// with 12 N, since a command takes up to 40 ms, the mean another 20 and the arm some more to come to rest, and a servo gives
/// way by about 0.1 mm/N. With half of it a touch from 2 cm away takes eight seconds.
const FEELING: f64 = 0.005;
/// Readings that are averaged: of 250 a second, 20 ms.
const READINGS: usize = 5;
/// How long the torques are read at rest before, s. Chosen: the noise of a mean over it (0.08 N·m a reading in the
/// laboratory) is a hundredth of a newton at 0.6 m.
const REST: f64 = 0.5;
/// How fast the tool pulls, m/s. Chosen: a person draws a drawer ten times as fast; at 3 cm/s an end is met 2 mm late, which the
/// servo's give turns into some 20 N.
const PULLING: f64 = 0.03;
/// How much further than in the rehearsal the arm may go until it feels something, m: what a hand may be off (8 to 19 mm
/// in `docs/results.md`).
const FURTHER: f64 = 0.02;
/// A path that begins this near to where the arm came to feel something is shifted to there, rad: 2 cm at 0.4 m.
const SLID: f64 = 0.05;

/// What the joints feel along a way.
struct Feel {
    robot: Arc<Robot>,
    /// Torques beyond the model's at rest, N·m.
    rest: Vec<f64>,
    /// Unit vector in the base.
    way: Vector3<f64>,
    /// N.
    threshold: f64,
    recent: VecDeque<f64>,
    felt: bool,
}

impl Feel {
    /// Takes a reading; returns whether the threshold is reached.
    fn sees(&mut self, feedback: &Feedback) -> bool {
        let model = gravity_torque(&self.robot, &feedback.q);
        let excess: Vec<f64> = (feedback.tau.iter().zip(&model))
            .zip(&self.rest)
            .map(|((tau, model), rest)| tau - model - rest)
            .collect();
        // What pushes aside, as a rail does, is told apart where the joints feel every direction.
        let (robot, q) = (&self.robot, &feedback.q);
        let along = force_at(robot, q, &excess).map(|force| force.dot(&self.way));
        let along = along.or_else(|| force_of(robot, q, &excess, &self.way));
        self.recent.push_back(along.unwrap_or(0.0));
        if self.recent.len() > READINGS {
            self.recent.pop_front();
        }
        let mean = self.recent.iter().sum::<f64>() / self.recent.len() as f64;
        self.felt |= self.recent.len() == READINGS && mean >= self.threshold;
        self.felt
    }
}

/// What came of a line that ends where something is felt.
struct Felt {
    stopped: bool,
    /// How far it went, and how far the rehearsal's went, m.
    went: f64,
    rehearsed: Option<f64>,
}

impl ActionContext {
    /// `arm.move_until([x, y, z], force)`: a straight line of the tool until `force` N are felt against it; returns how
    /// far it went, m.
    ///
    /// # Errors
    ///
    /// [`Refusal::NothingFelt`] at its end, and [`Unrehearsed::Touch`] on an arm that goes further than the rehearsal did.
    pub fn move_until(&mut self, by: [f64; 3], force: f64) -> Result<f64, ActionError> {
        let Some(felt) = self.felt_line(by, force, FEELING)? else { return Ok(0.0) };
        let Felt { stopped, went, rehearsed } = felt;
        match rehearsed {
            _ if stopped => Ok(went),
            Some(rehearsed) if rehearsed + FURTHER < Vector3::from(by).norm() => {
                Err(ActionError::Unrehearsed(Unrehearsed::Touch { went, rehearsed }))
            }
            _ => Err(Refusal::NothingFelt { force, way: went }.into()),
        }
    }

    /// `arm.pull([x, y, z], force)`: a straight line of the tool that ends where `force` N are felt against it, or with its
    /// way; returns how far it went, m.
    ///
    /// # Errors
    ///
    /// When the way cannot be planned, or the joints do not feel what pulls that way.
    pub fn pull(&mut self, by: [f64; 3], force: f64) -> Result<f64, ActionError> {
        Ok(self.felt_line(by, force, PULLING)?.map_or(0.0, |felt| felt.went))
    }

    /// A straight line of the tool at a speed, m/s, until `force` N are felt against it or it ends; `None` for one of no
    /// length. How far it went is in the log whatever came of it.
    fn felt_line(
        &mut self,
        by: [f64; 3],
        force: f64,
        speed: f64,
    ) -> Result<Option<Felt>, ActionError> {
        let by = Vector3::from(by);
        let Some(way) = by.try_normalize(1e-6) else { return Ok(None) };
        let path = self.planned_path(|planner| planner.line_into(by))?;
        let rehearsed = self.run.log.next(Kind::Felt, |entry| match entry {
            Entry::Felt(went) => Some(*went),
            _ => None,
        })?;
        let most = rehearsed.map_or(by.norm(), |went| by.norm().min(went + FURTHER));
        let stopped = self.feel_along(&path, &way, most, (force, speed));
        let went = (self.setting.cell.tool_pose(&self.run.q).origin()
            - self.setting.cell.tool_pose(&path[0]).origin())
        .dot(&way);
        self.run.log.record(Entry::Felt(went));
        Ok(Some(Felt { stopped: stopped?, went, rehearsed }))
    }

    /// Goes along a path until so many N are felt, at most so far, m, at so many m/s; returns whether they were.
    fn feel_along(
        &mut self,
        path: &[Vec<f64>],
        way: &Vector3<f64>,
        most: f64,
        (threshold, speed): (f64, f64),
    ) -> Result<bool, ActionError> {
        let path = self.slid(path)?;
        let (_, rest) = self.torque_excess(REST)?;
        self.run.rest = Some(rest.clone());
        let way_in_base = self.in_base(way);
        let robot = self.setting.cell.robot.clone();
        if force_of(&robot, &path[0], &rest, &way_in_base).is_none() {
            return Err(Refusal::Numb.into());
        }
        let (cell, begin) = (self.setting.cell.clone(), self.setting.cell.tool_pose(&path[0]));
        let length =
            path.last().map_or(0.0, |last| (cell.tool_pose(last).origin() - begin.origin()).norm());
        let limits = self.paced(1.0);
        let trajectory = Trajectory::through_points(&path, &limits).map_err(Refusal::from)?;
        let slower = length / speed / trajectory.duration().max(1e-3);
        let trajectory = if slower > 1.0 { trajectory.slowed(slower) } else { trajectory };
        let cleared = self.cleared(trajectory, &path)?;
        let mut feel =
            Feel { robot, rest, way: way_in_base, threshold, recent: VecDeque::new(), felt: false };
        let seconds = cleared.trajectory().duration() - cleared.led();
        let done = self.act_on(-cleared.led(), seconds, ROOM, |arm, stop, watch| {
            let touch = stop.child();
            let done = arm.follow(&cleared, &touch, &mut |feedback| {
                watch(feedback);
                let gone = (cell.tool_pose(&feedback.q).origin() - begin.origin()).dot(way);
                if feel.sees(feedback) || gone > most {
                    touch.cancel();
                }
            });
            match done {
                Err(DeviceError::Stopped) if !stop.is_cancelled() => Ok(()),
                done => done,
            }
        });
        self.find_arm()?;
        done?;
        self.run.felt = true;
        Ok(feel.felt)
    }

    /// Returns a path from where the arm came to feel something, when it begins next to there, in place of from where it
    /// was planned to begin.
    pub(super) fn slid(&mut self, path: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, ActionError> {
        let path = self.wound(path)?;
        let begins_near = |first: &Vec<f64>| self.run.felt && distance(first, &self.run.q) < SLID;
        let Some(first) = path.first().filter(|first| begins_near(first)) else {
            return Ok(path);
        };
        let off: Vec<f64> = self.run.q.iter().zip(first).map(|(is, was)| is - was).collect();
        let shift = |q: &Vec<f64>| q.iter().zip(&off).map(|(q, off)| q + off).collect();
        Ok(path.iter().map(shift).collect())
    }
}
