//! One motion carried out on the arm: the arm is led to where it begins, the limits clear it, whoever watches is told of every tick,
//! and what must hold meanwhile ends it.
//!
//! Which motion it is, and what it is for, is `motion`'s; what moves by itself is let pass in [`super::moving`].

use std::sync::PoisonError;

use crate::motion::trajectory::Trajectory;
use crate::world::WorldState;

use super::super::body::Watcher;
use super::super::decisions::Entry;
use super::super::error::ActionError;
use super::super::refusal::Refusal;
use super::super::wording;
use super::super::worked::Working;
use super::ActionContext;
use super::moving::{Guard, PATIENCE, ROOM};
use crate::arm::limits::{Cleared, LimitError};
use crate::arm::{Arm, Cancel, DeviceError, Feedback};
use crate::trace::{Event, Unrehearsed};

/// An arm further than this from where its next path begins is not led there, rad: what lies between was
/// not rehearsed.
const BRIDGE: f64 = 0.2;
/// How fast it is led there, as a share of full speed.
const BRIDGE_SPEED: f64 = 0.3;

impl ActionContext {
    /// Has the arm do something that is to take `seconds`, with whoever watches told of every tick and the
    /// conditions in force read.
    pub(super) fn act<T>(
        &mut self,
        seconds: f64,
        doing: impl FnOnce(&mut dyn Arm, &Cancel, &mut dyn FnMut(&Feedback)) -> Result<T, DeviceError>,
    ) -> Result<T, ActionError> {
        self.act_on(0.0, seconds, ROOM, doing)
    }

    /// As [`Self::act`], of something of which `over` s are over, and which lets what moves by itself come as near as `room` m.
    pub(super) fn act_on<T>(
        &mut self,
        over: f64,
        seconds: f64,
        room: f64,
        doing: impl FnOnce(&mut dyn Arm, &Cancel, &mut dyn FnMut(&Feedback)) -> Result<T, DeviceError>,
    ) -> Result<T, ActionError> {
        if self.step.orders.is_some() {
            return Err(Refusal::HoldsArm.into());
        }
        self.in_time(seconds - over)?;
        let (mut ticks, openings) = (ticks(&self.setting.watcher), self.step.openings.clone());
        let state = self.body.state()?;
        // As fast as it is held to move now this motion goes on, whatever the dial says meanwhile.
        let pace = self.pace();
        self.run.past.paces.turn(state.time, pace);
        let mut working = self.working(&state);
        let around = std::mem::take(&mut self.run.around);
        let mut guard = Guard::new(self.setting.cell.clone(), &state, around, room);
        let mut during = self.step.during.take();
        if let Some(during) = &mut during {
            let paces = self.run.past.paces.clone();
            during.motion_begins(self.body.sight(), over, seconds, paces);
        }
        // What cuts this motion short is not a wish to stop everything.
        let stop = self.setting.cancel.child();
        let done = doing(self.body.arm(), &stop, &mut |feedback| {
            ticks(feedback);
            working.sees(feedback);
            if let Some(openings) = &openings {
                openings.note(feedback);
            }
            let is_cut = during.as_mut().is_some_and(|during| during.sees(feedback));
            if is_cut || guard.sees(feedback) {
                stop.cancel();
            }
        });
        self.run.past.worked = working.done();
        let (came_near, touched, around) = guard.done();
        self.run.around = around;
        for (name, into) in touched {
            if self.run.touched.insert(name.clone()) {
                self.tell(&Event::note(wording::touched(&name, into)));
            }
        }
        let mut cut = None;
        if let Some(during) = &mut during {
            during.motion_ends();
            cut = during.cut().cloned();
            if let Some(ended) = during.ended() {
                self.run.log.record(Entry::Ended(ended));
            }
        }
        self.step.during = during;
        if done.is_err() && cut.is_none() && came_near.is_none() {
            // A reality may hold the arm elsewhere than it was sent; one that does not answer is asked again before the next plan.
            let _ = self.find_arm();
        }
        match (done, cut, came_near) {
            (Err(DeviceError::Stopped), ..) if self.setting.cancel.is_cancelled() => {
                Err(ActionError::Stopped)
            }
            (Err(DeviceError::Stopped) | Ok(_), Some(cut), _) => Err(cut.into()),
            (Err(DeviceError::Stopped), None, Some(near)) => Err(Refusal::from(near).into()),
            (done, ..) => Ok(done?),
        }
    }

    /// Does not count the motion that ended last among those of the rehearsal.
    pub(super) fn uncount(&mut self) {
        if let Some(during) = &mut self.step.during {
            during.uncount();
        }
    }

    /// Leads the arm to where `path` begins, and clears a trajectory along it, which begins at the last command.
    pub(super) fn cleared(
        &mut self,
        trajectory: Trajectory,
        path: &[Vec<f64>],
    ) -> Result<Cleared, ActionError> {
        self.found()?;
        self.bridge(path)?;
        self.cleared_from_here(trajectory)
    }

    /// Clears a trajectory that begins at the last command; an arm that is elsewhere is asked where before the next plan.
    fn cleared_from_here(&mut self, trajectory: Trajectory) -> Result<Cleared, ActionError> {
        let from = self.body.arm().feedback()?.q_cmd;
        let cleared = self.setting.cell.clear(trajectory, &from);
        self.run.is_astray |= matches!(cleared, Err(LimitError::Jump { .. }));
        Ok(cleared?)
    }

    /// Begins to take note of what a tool does while the arm moves.
    fn working(&mut self, state: &WorldState) -> Working {
        let sight = self.body.sight();
        let (cell, rest) = (self.setting.cell.clone(), self.run.rest.clone());
        Working::new(sight, cell, state, rest, std::mem::take(&mut self.run.past.worked))
    }

    /// Clears a trajectory and follows it; the plan then has the arm at the end of `path`.
    pub(super) fn drive(
        &mut self,
        trajectory: Trajectory,
        path: &[Vec<f64>],
    ) -> Result<(), ActionError> {
        self.drive_past(trajectory, path, PATIENCE)
    }

    /// As [`Self::drive`]; what moves by itself is let pass for `patience` s.
    pub(super) fn drive_past(
        &mut self,
        trajectory: Trajectory,
        path: &[Vec<f64>],
        patience: f64,
    ) -> Result<(), ActionError> {
        let cleared = self.cleared(trajectory, path)?;
        if let Err(error) = self.follow_past(cleared, patience) {
            // The motion was cut short: the next plan begins where the arm was left, not at the path's end. An arm that does not
            // say where that is has said what is wrong before.
            let _ = self.find_arm();
            return Err(error);
        }
        if let Some(last) = path.last() {
            self.came_to(last);
        }
        Ok(())
    }

    /// Leads the arm to where a rehearsed path begins, when a step before ended a little sooner or later
    /// than in the rehearsal.
    fn bridge(&mut self, path: &[Vec<f64>]) -> Result<(), ActionError> {
        let Some(first) = path.first().filter(|_| self.run.log.is_playing()) else { return Ok(()) };
        let apart = |(a, b): (&f64, &f64)| (a - b).abs();
        let off = first.iter().zip(&self.run.q).map(apart).fold(0.0, f64::max);
        // What the limits lead it over needs no motion of its own.
        if off < 0.5 * self.setting.cell.limits.jump {
            return Ok(());
        }
        if off > BRIDGE {
            return Err(ActionError::Unrehearsed(Unrehearsed::Start { off }));
        }
        let way = [self.run.q.clone(), first.clone()];
        let trajectory =
            Trajectory::through_points(&way, &self.paced(BRIDGE_SPEED)).map_err(Refusal::from)?;
        let cleared = self.cleared_from_here(trajectory)?;
        let led = self.follow_past(cleared, PATIENCE);
        self.uncount();
        if led.is_ok() {
            self.came_to(first);
        } else {
            let _ = self.find_arm();
        }
        led
    }
}

fn ticks(watcher: &Watcher) -> impl FnMut(&Feedback) + use<> {
    let watcher = watcher.clone();
    move |feedback| {
        let mut watcher = watcher.lock().unwrap_or_else(PoisonError::into_inner);
        watcher.event(&Event::Tick(feedback.clone()));
    }
}
