//! Motions of the arm that scripts ask for: planned in the twin, played on the arm. How each is carried out, cleared by the
//! limits and watched over, is `driving`'s.

use nalgebra::Vector3;
use rand::RngExt;

use crate::motion::polyline::mix;
use crate::motion::rrt::short_way;
use crate::motion::trajectory::{self, Trajectory};
use crate::world::Pose;
use crate::world::frame::{Tool, World};

use super::super::decisions::Entry;
use super::super::error::ActionError;
use super::super::plan::{Leg, Planner, Way, distance, turned_angle};
use super::super::refusal::Refusal;
use super::super::wording;
use super::ActionContext;
use super::moving::{PATIENCE, is_for_another};
use crate::trace::{Event, NoWay, Unrehearsed};

/// An arm this near to where a path begins stands there, rad.
const STANDS_THERE: f64 = 0.02;
/// A hand at most this far beside where a path begins, and above it, is brought down there, m: so far the joints
/// may turn in one go with the hand a few millimetres beside its straight way.
const ASIDE: f64 = 0.02;
const ABOVE: f64 = 0.16;
/// How fast, as a share of full speed.
const DOWN_SPEED: f64 = 0.3;

/// How fast, as a share of full speed, a hand leaves what it touches.
const OUT_SPEED: f64 = 0.3;
/// So many ways are tried before the limits' word is final.
const TRIES: usize = 4;
/// How much higher a point is visited when the limits refuse it, m.
const RAISED: [f64; 3] = [0.0, 0.05, 0.1];

/// How fast the tool pushes, m/s. Chosen: what is pushed so fast slides on by 0.4 mm (`v² / 2 μ g` with a friction of 0.3)
/// when the hand stops; with twice as much by 1.7 mm, with half of it a push of 30 cm takes ten seconds.
const PUSHING: f64 = 0.05;
/// How much further than in the rehearsal measuring may turn the hand, rad; chosen: a vessel that is a tenth fuller or
/// emptier than believed, and taken a few degrees askew.
const FURTHER: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// A hand within this of a path is on it, rad.
const ON_PATH: f64 = 0.05;

/// Returns the way along a path from `q`, which is on it, to a share of it, both ends included; one point when it is
/// there already, `None` when `q` is not on the path.
fn between(path: &[Vec<f64>], q: &[f64], share: f64) -> Option<Vec<Vec<f64>>> {
    // Points nearer to an end than this add nothing but a kink, in steps of the path.
    const APART: f64 = 0.15;
    let last = path.len().checked_sub(1).filter(|last| *last > 0)? as f64;
    let at = |place: f64| -> Vec<f64> {
        let from = (place.floor() as usize).min(path.len() - 2);
        mix(&path[from], &path[from + 1], place - from as f64)
    };
    // Where on each step of the path `q` is nearest.
    let places = path.windows(2).enumerate().map(|(k, pair)| {
        let step: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| b - a).collect();
        let along: f64 =
            q.iter().zip(&pair[0]).zip(&step).map(|((q, a), step)| (q - a) * step).sum();
        let length: f64 = step.iter().map(|step| step * step).sum();
        k as f64 + if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 }
    });
    let off = |place: &f64| distance(&at(*place), q);
    let here = places.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    if off(&here) > ON_PATH {
        return None;
    }
    let there = share * last;
    let (low, high) = (here.min(there) + APART, here.max(there) - APART);
    let mut inner: Vec<f64> =
        (0..path.len()).map(|k| k as f64).filter(|k| *k > low && *k < high).collect();
    if there < here {
        inner.reverse();
    }
    let mut way = vec![q.to_vec()];
    way.extend(inner.into_iter().map(at));
    if (there - here).abs() > 1e-4 {
        way.push(at(there));
    }
    Some(way)
}

impl ActionContext {
    /// Goes to a tool pose, or above it when the limits refuse every way there, round everything in the way;
    /// for calibration, without a decision log.
    pub fn visit(&mut self, at: &Pose<World, Tool>) -> Result<(), ActionError> {
        let mut refused = None;
        for up in RAISED {
            let above = Pose::from_parts(at.origin() + Vector3::z() * up, at.rotation());
            match self.way(0.8, &|planner, seed| planner.visit(&above, seed)) {
                Ok(way) => return self.drive_way(&way, 0.8, PATIENCE),
                Err(ActionError::Limit(limit)) => refused = refused.or(Some(limit)),
                Err(error) => return Err(error),
            }
        }
        refused.map_or(Ok(()), |limit| Err(limit.into()))
    }

    /// Goes to `q` as [`Self::move_to`] does, whatever is moved by that.
    pub(super) fn go_to(
        &mut self,
        q: &[f64],
        tilt: Option<f64>,
        speed: f64,
    ) -> Result<(), ActionError> {
        let way = if let Some(out) = self.logged_path()? {
            Way { out, on: self.logged_path()?.unwrap_or_default() }
        } else {
            let way = self.way(speed, &|planner, seed| planner.free(q, tilt, seed))?;
            self.run.log.record(Entry::Path(way.out.clone()));
            self.run.log.record(Entry::Path(way.on.clone()));
            way
        };
        if !self.can_give_way() {
            return self.drive_way(&way, speed, PATIENCE);
        }
        // As long as nothing moves there is nothing to give way to.
        if self.body.arm().feedback()?.moving.is_empty() {
            let done = self.drive_way(&way, speed, 0.0);
            if !done.as_ref().is_err_and(is_for_another) {
                return done;
            }
        }
        let Some(goal) = way.on.last() else { return Ok(()) };
        self.tell(&Event::note(wording::gives_way()));
        let begun = self.body.arm().feedback()?.time;
        // From rest it goes away from what came too near, and round it.
        while self.give_way(goal, tilt, speed)? {
            if self.body.arm().feedback()?.time - begun > PATIENCE {
                break;
            }
            self.uncount();
        }
        let rest = self.way(speed, &|planner, seed| planner.free(goal, tilt, seed))?;
        self.drive_way(&rest, speed, PATIENCE)
    }

    /// Plans a way that the limits let pass, by another chance when they do not.
    fn way(
        &mut self,
        speed: f64,
        plan: &dyn Fn(&Planner, u64) -> Result<Way, NoWay>,
    ) -> Result<Way, ActionError> {
        let planner = self.planner()?;
        let mut refused = None;
        for _ in 0..TRIES {
            let way = plan(&planner, self.run.chance.random())?;
            let passes = [&way.out, &way.on].into_iter().try_for_each(|corners| {
                let from = corners.first().unwrap_or(&self.run.q);
                let trajectory = self.rounded(corners, speed)?;
                self.setting.cell.clear(trajectory, from)?;
                Ok(())
            });
            match passes {
                Ok(()) => return Ok(way),
                Err(ActionError::Limit(limit)) => refused = Some(limit),
                Err(error) => return Err(error),
            }
        }
        Err(refused.map_or(ActionError::Stopped, ActionError::Limit))
    }

    /// Follows a way; what moves by itself is let pass for `patience` s.
    fn drive_way(&mut self, way: &Way, speed: f64, patience: f64) -> Result<(), ActionError> {
        self.run.felt = false;
        if way.out.len() > 1 {
            self.drive_corners(&way.out, speed.min(OUT_SPEED), patience)?;
        }
        self.drive_corners(&way.on, speed, patience)
    }

    /// `arm.move_by([x, y, z], speed)`: a straight line of the tool in the world, orientation kept.
    pub fn move_by(&mut self, by: [f64; 3], speed: f64) -> Result<(), ActionError> {
        let path = self.planned_path(|planner| planner.line(Vector3::from(by)))?;
        self.follow(&path, speed)
    }

    /// `arm.rise(by, speed)`: the tool straight up by `by` m, or by as much of it as the arm can follow.
    pub fn rise(&mut self, by: f64, speed: f64) -> Result<(), ActionError> {
        let path = self.planned_path(|planner| planner.rise(by))?;
        if path.len() > 1 { self.follow(&path, speed) } else { Ok(()) }
    }

    /// `arm.follow(path, speed)`: a joint path at a fraction of the speed limits.
    pub fn follow(&mut self, path: &[Vec<f64>], speed: f64) -> Result<(), ActionError> {
        let path = self.slid(path)?;
        let trajectory =
            Trajectory::through_points(&path, &self.paced(speed)).map_err(Refusal::from)?;
        self.drive(self.dialled(trajectory), &path)
    }

    /// Follows straight joint motions from corner to corner, the corners a little rounded.
    fn drive_corners(
        &mut self,
        corners: &[Vec<f64>],
        speed: f64,
        patience: f64,
    ) -> Result<(), ActionError> {
        let trajectory = self.rounded(corners, speed)?;
        self.drive_past(self.dialled(trajectory), corners, patience)
    }

    /// Times straight joint motions from corner to corner, the corners a little rounded.
    fn rounded(&self, corners: &[Vec<f64>], speed: f64) -> Result<Trajectory, ActionError> {
        // Planning keeps a margin wider than a corner cut this short moves any point of the arm, rad.
        const CUT: f64 = 0.05;
        Trajectory::through_corners(corners, &self.paced(speed), CUT, &|_, _| true)
            .map_err(|error| Refusal::from(error).into())
    }

    /// Returns the same motion as slow as the dial says. Turns that pour are left as they are: see [`Dial`].
    fn dialled(&self, trajectory: Trajectory) -> Trajectory {
        match self.setting.dial.percent() {
            100 => trajectory,
            _ => trajectory.slowed(self.setting.dial.stretch()),
        }
    }

    /// Returns the robot's limits at a fraction of its speed.
    pub(super) fn paced(&self, speed: f64) -> trajectory::Limits {
        let speed = speed.clamp(0.02, 1.0);
        trajectory::Limits::of(&self.setting.cell.robot).scaled(speed, speed)
    }

    /// `arm.turn(path, rate)`: a joint path that turns the hand, at `rate` rad/s.
    pub fn turn(&mut self, path: &[Vec<f64>], rate: f64) -> Result<(), ActionError> {
        /// The share of the jerk that is used by a turn slower than the arm could make it: what is poured sloshes. Chosen: with
        /// twice as much a jar that had poured before gave 75 mL for 60, with this 56 (`two_cups` of `tests/tables`, seed 6).
        const GENTLE: f64 = 0.25;
        let path = &self.wound(path)?[..];
        let angle = turned_angle(&self.setting.cell.robot, path);
        let mut limits = self.paced(1.0);
        let timed = |limits: &trajectory::Limits| {
            let trajectory = Trajectory::through_points(path, limits).map_err(Refusal::from)?;
            let slower = angle / rate.max(1e-3) / trajectory.duration().max(1e-3);
            Ok::<_, ActionError>((trajectory, slower))
        };
        let (mut trajectory, mut slower) = timed(&limits)?;
        if slower > 1.0 {
            for jerk in &mut limits.jerk {
                *jerk *= GENTLE;
            }
            (trajectory, slower) = timed(&limits)?;
        }
        self.drive(trajectory.slowed(slower.max(1.0)), path)
    }

    /// `arm.push(leg)`: the forward way of a push, slowly; the thing is believed to stand where the push ends, until it is
    /// seen.
    pub fn push(&mut self, leg: &Leg) -> Result<(), ActionError> {
        let path = self.slid(&leg.way)?;
        let trajectory =
            Trajectory::through_points(&path, &self.paced(1.0)).map_err(Refusal::from)?;
        let slower = leg.length / PUSHING / trajectory.duration().max(1e-3);
        let trajectory = if slower > 1.0 { trajectory.slowed(slower) } else { trajectory };
        let pushed = self.drive(self.dialled(trajectory), &path);
        self.body.pushed(&leg.object, pushed.is_ok().then_some(leg.ends));
        pushed
    }

    /// `arm.turn_back(path, rate)`: what is left of a turn, back to its beginning, from wherever it stopped.
    pub fn turn_back(&mut self, path: &[Vec<f64>], rate: f64) -> Result<(), ActionError> {
        let path = self.wound(path)?;
        // A hand that has left the path goes to the nearest point of it first.
        let onto = || {
            let off = |q: &[f64]| distance(q, &self.run.q);
            let at = (0..path.len()).min_by(|&a, &b| off(&path[a]).total_cmp(&off(&path[b])))?;
            let mut way = vec![self.run.q.clone()];
            way.extend(path[..=at].iter().rev().cloned());
            Some(way)
        };
        let Some(back) = between(&path, &self.run.q, 0.0).or_else(onto) else { return Ok(()) };
        if back.len() < 2 { Ok(()) } else { self.turn(&back, rate) }
    }

    /// `arm.turn_to(path, share, rate)`: along a path that turns the hand, from wherever it is on it to this share
    /// of it. Measuring may decide how far, so the arm may go further than the rehearsal did, but not much.
    pub fn turn_to(&mut self, path: &[Vec<f64>], share: f64, rate: f64) -> Result<(), ActionError> {
        let share = share.clamp(0.0, 1.0);
        let path = &self.wound(path)?[..];
        let way = between(path, &self.run.q, share).ok_or(Refusal::NotOnPath)?;
        if self.run.log.is_playing() {
            let whole = turned_angle(&self.setting.cell.robot, path);
            let rehearsed = self.step.turned.unwrap_or(0.0);
            if (share - rehearsed) * whole > FURTHER {
                return Err(ActionError::Unrehearsed(Unrehearsed::Turn {
                    needed: share * whole,
                    rehearsed: rehearsed * whole,
                }));
            }
        } else {
            self.run.log.record(Entry::Turned(share));
        }
        if way.len() < 2 { Ok(()) } else { self.turn(&way, rate) }
    }

    /// `arm.draw_back(path, speed)`: the way that `path` goes. A hand that is above where it begins, such as in a
    /// lift that was cut short, is first brought down there, as it went up.
    pub fn draw_back(&mut self, path: &[Vec<f64>], speed: f64) -> Result<(), ActionError> {
        let Some(first) = path.first() else { return Ok(()) };
        let down = if let Some(down) = self.logged_path()? {
            down
        } else {
            let down = self.way_down(first)?;
            self.run.log.record(Entry::Path(down.clone()));
            down
        };
        if down.len() > 1 {
            self.follow(&down, DOWN_SPEED)?;
        }
        self.follow(path, speed)
    }

    /// Returns a path with its joints that turn without an end turned by whole turns, so that it passes where the arm is as
    /// the arm is wound now: what was planned before a free motion does not know how often round that goes.
    pub(super) fn wound(&mut self, path: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, ActionError> {
        self.found()?;
        let as_now = |q: &Vec<f64>| short_way(&self.setting.cell.robot, &self.run.q, q);
        let off = |q: &Vec<f64>| distance(&as_now(q), &self.run.q);
        let Some(near) = path.iter().min_by(|a, b| off(a).total_cmp(&off(b))) else {
            return Ok(Vec::new());
        };
        let by: Vec<f64> = as_now(near).iter().zip(near).map(|(is, was)| is - was).collect();
        if by.iter().all(|by| by.abs() < 1.0) {
            return Ok(path.to_vec());
        }
        Ok(path.iter().map(|q| q.iter().zip(&by).map(|(q, by)| q + by).collect()).collect())
    }

    /// Returns the way from where the hand is down to where it was at `q`; one point when it stands there.
    fn way_down(&mut self, q: &[f64]) -> Result<Vec<Vec<f64>>, ActionError> {
        self.found()?;
        if distance(q, &self.run.q) < STANDS_THERE {
            return Ok(vec![q.to_vec()]);
        }
        let up = self.setting.cell.tool_pose(&self.run.q).origin()
            - self.setting.cell.tool_pose(q).origin();
        let aside = up.xy().norm();
        if aside > ASIDE || up.z < -ASIDE || up.z > ABOVE {
            return Err(Refusal::NotAtWay { beside: aside, above: up.z }.into());
        }
        Ok(vec![self.run.q.clone(), q.to_vec()])
    }

    pub(super) fn planner(&mut self) -> Result<Planner, ActionError> {
        self.found()?;
        let state = self.body.state()?;
        let (q, budget) = (self.run.q.clone(), self.budget());
        let planner = Planner::new(self.setting.cell.clone(), state, q, self.step.doubt, budget);
        Ok(planner.having_taken(self.run.past.taken.clone()))
    }
}
