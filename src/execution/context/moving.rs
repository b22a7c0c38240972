//! What moves by itself near the arm ([`Feedback::moving`]): the arm stops before it comes near, lets it pass, and goes on; a free
//! motion by policies gives way to it instead.
//!
//! Known is what whoever watches the cell tells, and how fast it moved lately. It is no safety function: nobody vouches for who
//! watches, and from what comes faster than the arm stops it is not kept away. While the arm rests nothing is done.
//!
//! Source: ISO/TS 15066:2016, 5.5.4, speed and separation monitoring: where the arm can come to rest is compared with where the
//! other will be by then.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use crate::arm::limits::Cleared;
use crate::arm::{Arm, Cancel, Feedback};
use crate::motion::Robot;
use crate::motion::braking::{Brake, Braking};
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::free::Means;
use crate::motion::giving_way::GivingWay;
use crate::motion::polyline::{l2, mix};
use crate::motion::rmpflow::Target;
use crate::motion::separation::Separation;
use crate::motion::sights::Sights;
use crate::motion::solid::Solid;
use crate::motion::trajectory::{Sample, Trajectory};
use crate::trace::Event;
use crate::world::frame::{Flange, Object};
use crate::world::{Mover, Pose, Shape, WorldState};

use super::super::cell::Cell;
use super::super::error::ActionError;
use super::super::refusal::Refusal;
use super::super::wording;
use super::ActionContext;

/// So near, m, nothing that moves is let come to an arm that moves on. Chosen: what whoever watches may be off (1 cm), what a hand that
/// begins to move goes in the 0.1 s until it is known (2 to 5 cm), and the width of a hand.
pub(super) const ROOM: f64 = 0.1;
/// So much more there is to be before a motion goes on, m: or it would stop and go.
const MORE: f64 = 0.05;
/// So near it may come to an arm that gives way, m; and so much larger than it is it is given way to, m: the policies alone
/// pass things at a centimetre.
const PASSED: f64 = 0.03;
const GROWN: f64 = 0.05;
/// How often it is looked at, s.
const EVERY: f64 = 0.02;
/// From a wish to stop to the beginning of braking, s.
const REACTION: f64 = 0.1;
/// What stays in the way for so long is waited for no longer, s.
pub(super) const PATIENCE: f64 = 20.0;
/// From one look whether the way is free to the next, s; and so much of the way, s.
const LOOK: f64 = 0.1;
const AHEAD: f64 = 1.0;
/// A joint that is told to be faster moves, rad/s. Chosen: what an arm at rest is told to be is noise of some thousandths.
const MOVES: f64 = 0.05;
/// Sights nearer in time than this are one, s.
const SAME: f64 = 1e-3;
/// Joint positions along what is left of a motion are so far apart, rad.
const APART: f64 = 0.03;
/// A motion that gives way has arrived so near its end, rad; it has come to rest when it was slower than `STILL` rad/s for so long,
/// s; and it is given up after so long, s.
const ARRIVED: f64 = 0.01;
const STILL: f64 = 4e-3;
const RESTING: f64 = 1.0;
const LONGEST: f64 = 60.0;

/// What moves by itself, as it was seen lately.
#[derive(Debug, Clone, Default)]
pub(super) struct Around(BTreeMap<String, (Sights, f64)>);

impl Around {
    /// Takes in what is told; what is not told of any more has gone. Returns the names of what has gone, and what was seen anew with
    /// when, s.
    fn takes<'f>(&mut self, feedback: &'f Feedback) -> (Vec<String>, Vec<(&'f Mover, f64)>) {
        let is_told = |name: &str| feedback.moving.iter().any(|mover| mover.name == name);
        let gone: Vec<String> = self.0.keys().filter(|name| !is_told(name)).cloned().collect();
        self.0.retain(|name, _| is_told(name));
        let mut anew = Vec::new();
        for mover in &feedback.moving {
            let (sights, radius) = self.0.entry(mover.name.clone()).or_default();
            *radius = mover.radius;
            let time = feedback.time - mover.age;
            if sights.last().is_none_or(|last| time > last + SAME) && sights.add(time, mover.at) {
                anew.push((mover, time));
            }
        }
        (gone, anew)
    }

    /// Returns what is expected where at `time` (s): names, middles in the world (m), radii (m).
    fn at(&self, time: f64) -> impl Iterator<Item = (&str, Vector3<f64>, f64)> {
        self.0
            .iter()
            .filter_map(move |(name, (sights, radius))| Some((&**name, sights.at(time)?, *radius)))
    }
}

/// What is in the hand: its name, its shape, and how it lies there.
type InHand = (String, Shape, Pose<Flange, Object>);

/// What the arm was stopped for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Near {
    /// What it is called.
    name: String,
    /// How near it would have come, m.
    apart: f64,
    /// When the arm was told to stop, s.
    time: f64,
}

impl From<Near> for Refusal {
    fn from(near: Near) -> Self {
        let Near { name, apart, time } = near;
        Self::CameNear { name, apart, time }
    }
}

/// Looks on while the arm does something, and says when it must stop for what moves by itself.
pub(super) struct Guard {
    cell: Cell,
    held: Option<InHand>,
    opening: f64,
    room: f64,
    around: Around,
    separation: Option<Separation>,
    next: f64,
    stopped: Option<Near>,
    touched: Touched,
}

/// What reached the arm or what it holds while the arm moved, by its name, and how far into it at most, m.
pub(super) type Touched = BTreeMap<String, f64>;

/// Why a motion may begin beside what moves.
#[derive(Debug, Clone, PartialEq)]
enum Free {
    /// Everything keeps away from its way.
    Clear,
    /// It leads no nearer to this, which is so near, m.
    NoNearer(String, f64),
}

impl Guard {
    /// Looks on from a state of the world, with what was seen so far; things may come as near as `room` m.
    pub(super) fn new(cell: Cell, state: &WorldState, around: Around, room: f64) -> Self {
        let held = state.held.clone().and_then(|name| {
            let pose = state.object(&name)?.world_from_object?;
            let shape = cell.scene.object(&name)?.shape.clone();
            let tool_from_object = state.world_from_tool.inverse() * pose;
            Some((name, shape, cell.robot.flange_from_tool() * tool_from_object))
        });
        let (opening, next) = (state.opening, f64::NEG_INFINITY);
        let (separation, stopped, touched) = (None, None, Touched::new());
        Self { cell, held, opening, room, around, separation, next, stopped, touched }
    }

    /// Looks at one tick of the arm; returns whether it is to be brought to rest.
    pub(super) fn sees(&mut self, feedback: &Feedback) -> bool {
        self.around.takes(feedback);
        if self.around.0.is_empty() || feedback.time + 1e-9 < self.next {
            return self.stopped.is_some();
        }
        self.next = feedback.time + EVERY;
        self.touches(feedback);
        if self.stopped.is_some() {
            return true;
        }
        let (rests, since) = at_rest(&self.cell.robot, &feedback.q, &feedback.dq, REACTION);
        let time = feedback.time + since;
        let expected: Vec<_> =
            self.around.at(time).map(|(name, at, r)| (name.to_owned(), at, r)).collect();
        for (name, at, radius) in expected {
            let stays = self.distance(&feedback.q, &at, radius);
            let goes = self.distance(&rests, &at, radius);
            // A motion that leads away from it is the best there is.
            if goes < self.room && goes < stays - 1e-3 {
                self.stopped = Some(Near { name, apart: goes, time: feedback.time });
                return true;
            }
        }
        false
    }

    /// Takes note of what reaches an arm that moves.
    fn touches(&mut self, feedback: &Feedback) {
        if feedback.dq.iter().all(|dq| dq.abs() < MOVES) {
            return;
        }
        let expected: Vec<_> =
            self.around.at(feedback.time).map(|(name, at, r)| (name.to_owned(), at, r)).collect();
        for (name, at, radius) in expected {
            let into = -self.distance(&feedback.q, &at, radius);
            if into >= 0.0 {
                let deepest = self.touched.entry(name).or_default();
                *deepest = deepest.max(into);
            }
        }
    }

    /// Returns how near a ball in the world is to what moves of the arm at `q`, m.
    fn distance(&mut self, q: &[f64], at: &Vector3<f64>, radius: f64) -> f64 {
        let Self { cell, held, opening, .. } = self;
        let separation = self.separation.get_or_insert_with(|| {
            let mut world = CollisionWorld::new(&cell.robot);
            world.set_opening(*opening);
            if let Some((name, shape, flange_from_object)) = held {
                world.attach(name, shape, *flange_from_object);
            }
            Separation::of(&world)
        });
        separation.distance(q, &in_base(cell, at), radius)
    }

    /// Returns why a motion may begin at `time` (s), if it may: for a second it keeps some room from everything, or comes no nearer than
    /// the arm is.
    fn free(&mut self, ahead: &Trajectory, time: f64) -> Option<Free> {
        let here = ahead.sample(0.0).q;
        let enough = self.room + MORE - 1e-3;
        let looks = (AHEAD / LOOK) as usize;
        let mut nearest: Option<(String, f64)> = None;
        for later in (0..=looks).map(|k| k as f64 * LOOK) {
            let expected: Vec<_> = self
                .around
                .at(time + later)
                .map(|(name, at, r)| (name.to_owned(), at, r))
                .collect();
            let q = ahead.sample(later.min(ahead.duration())).q;
            for (name, at, radius) in expected {
                let stays = self.distance(&here, &at, radius);
                let goes = self.distance(&q, &at, radius);
                if goes < enough.min(stays - 1e-3) {
                    return None;
                }
                if goes < enough && nearest.as_ref().is_none_or(|(_, least)| goes < *least) {
                    nearest = Some((name, goes));
                }
            }
        }
        Some(nearest.map_or(Free::Clear, |(name, apart)| Free::NoNearer(name, apart)))
    }

    /// Returns what the arm was stopped for, what reached it, and what was seen.
    pub(super) fn done(self) -> (Option<Near>, Touched, Around) {
        (self.stopped, self.touched, self.around)
    }
}

/// Returns where joints that move at `dq` (rad/s) come to rest, rad, that begin to brake in `wait` s, as arms do; and when, s.
fn at_rest(robot: &Robot, q: &[f64], dq: &[f64], wait: f64) -> (Vec<f64>, f64) {
    let then = Sample {
        q: q.iter().zip(dq).map(|(q, dq)| q + dq * wait).collect(),
        dq: dq.to_vec(),
        ddq: vec![0.0; dq.len()],
    };
    let braking = Braking::of(&then, &Brake::of(robot));
    let lasts = braking.duration();
    (braking.sample(lasts).q, wait + lasts)
}

/// Carries a place in the world into the robot's base.
fn in_base(cell: &Cell, at: &Vector3<f64>) -> Vector3<f64> {
    (cell.scene.world_from_base.inverse().isometry() * nalgebra::Point3::from(*at)).coords
}

/// Returns what is left of a trajectory for an arm that was stopped at `q` (rad): joint positions from there to its end, and when it was
/// where that is, s.
fn left(trajectory: &Trajectory, q: &[f64]) -> (Vec<Vec<f64>>, f64) {
    const STEP: f64 = 0.01;
    let steps = (trajectory.duration() / STEP).ceil() as usize;
    let at = |k: usize| trajectory.sample((k as f64 * STEP).min(trajectory.duration())).q;
    let off = |k: &usize| l2(&at(*k), q);
    let begin = (0..=steps).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0);
    let mut points = vec![q.to_vec()];
    for next in (begin..=steps).map(at) {
        if points.last().is_none_or(|last| l2(last, &next) > APART) {
            points.push(next);
        }
    }
    let end = at(steps);
    if points.len() > 1 && l2(&points[points.len() - 1], &end) < APART / 2.0 {
        points.pop();
    }
    points.push(end);
    (points, begin as f64 * STEP)
}

/// Whether the arm was stopped for what moves by itself.
pub(super) fn is_for_another(error: &ActionError) -> bool {
    matches!(error, ActionError::Refused(Refusal::CameNear { .. }))
}

impl ActionContext {
    /// Follows a trajectory; whenever something that moves by itself comes near its way, waits until that has passed, at most `patience` s,
    /// and goes on. Without patience the arm is left where it stopped.
    pub(super) fn follow_past(
        &mut self,
        cleared: Cleared,
        patience: f64,
    ) -> Result<(), ActionError> {
        // Until the arm is where the motion begins nothing of it is over.
        let mut over = -cleared.led();
        let mut cleared = cleared;
        loop {
            let seconds = over + cleared.trajectory().duration();
            let done = self
                .act_on(over, seconds, ROOM, |arm, stop, watch| arm.follow(&cleared, stop, watch));
            match done {
                Err(ActionError::Refused(Refusal::CameNear { name, apart, time }))
                    if patience > 0.0 =>
                {
                    self.uncount();
                    let near = Near { name, apart, time };
                    let Some((rest, since)) =
                        self.let_pass(cleared.trajectory(), &near, patience)?
                    else {
                        return Ok(());
                    };
                    (cleared, over) = (rest, over + since);
                }
                done => return done,
            }
        }
    }

    /// Waits until what is left of a motion is free of what moves; returns it with how much of the motion is over, s, or nothing where
    /// nothing is left.
    fn let_pass(
        &mut self,
        trajectory: &Trajectory,
        near: &Near,
        patience: f64,
    ) -> Result<Option<(Cleared, f64)>, ActionError> {
        let q = self.body.arm().feedback()?.q_cmd;
        let (points, since) = left(trajectory, &q);
        if l2(&q, &points[points.len() - 1]) < STILL {
            return Ok(None);
        }
        let rest = Trajectory::through_points(&points, &self.paced(1.0)).map_err(Refusal::from)?;
        let slower = (trajectory.duration() - since) / rest.duration().max(1e-3);
        let rest = rest.slowed(slower.max(1.0));
        let Near { name, apart, time: begin } = near;
        self.tell(&Event::note(wording::waits_for(name, *apart)));
        loop {
            let (time, state) = (self.body.arm().feedback()?.time, self.body.state()?);
            let around = std::mem::take(&mut self.run.around);
            let mut guard = Guard::new(self.setting.cell.clone(), &state, around, ROOM);
            let free = guard.free(&rest, time);
            (_, _, self.run.around) = guard.done();
            if let Some(free) = free {
                let seconds = time - begin;
                self.tell(&Event::note(match &free {
                    Free::Clear => wording::goes_on_past(name, seconds),
                    Free::NoNearer(near, apart) => wording::goes_on_beside(near, *apart, seconds),
                }));
                return Ok(Some((self.setting.cell.clear(rest, &q)?, since)));
            }
            if time - begin > patience {
                let (name, seconds) = (name.to_owned(), time - begin);
                return Err(Refusal::InTheWay { name, seconds }.into());
            }
            self.act(LOOK, |arm, stop, watch| arm.wait(LOOK, stop, watch))?;
            self.uncount();
        }
    }

    /// Whether a free motion may give way to what moves by itself: by policies, on an arm that can be led.
    pub(super) fn can_give_way(&mut self) -> bool {
        self.setting.cell.means == Means::Rmpflow && self.body.arm().led_every().is_some()
    }

    /// Leads the arm towards `goal` (rad) by policies that give way to what moves, with the hand within `tilt` rad of upright when
    /// that is asked for. It need not get there: the arm rests where it was left. Returns whether it was stopped for what moves.
    pub(super) fn give_way(
        &mut self,
        goal: &[f64],
        tilt: Option<f64>,
        speed: f64,
    ) -> Result<bool, ActionError> {
        let planner = self.planner()?;
        let world = planner.world();
        let limits = self.paced(speed / self.setting.dial.stretch());
        let cell = self.setting.cell.clone();
        let robot = cell.robot.clone();
        let before = self.body.arm().feedback()?;
        let motion = GivingWay::new(&world, &limits, &before.q_cmd).map_err(Refusal::from)?;
        let target = Target {
            tip: *robot.forward(goal).map_err(Refusal::from)?.isometry(),
            posture: goal.to_vec(),
            upright: planner.cone(tilt),
        };
        let period = self.body.arm().led_every().unwrap_or(LOOK);
        let mut ticks = 0_u32;
        let none = || vec![0.0; goal.len()];
        let at = Sample { q: before.q_cmd.clone(), dq: none(), ddq: none() };
        let samples = [(0.0, at.clone()), (0.0, at)];
        let around = Around::default();
        let (world, resting, refused) = (&world, 0.0, None);
        let mut led = Led { cell, world, motion, target, around, samples, resting, refused };
        let begin = before.time;
        let done = self.act_on(0.0, LONGEST, PASSED, |arm: &mut dyn Arm, stop: &Cancel, watch| {
            let mut sent = [before.q_cmd.clone(), none()];
            arm.lead(
                &mut |feedback| {
                    // Counted and not read: a clock that is told late or early would have the command hasten or wait.
                    let time = f64::from(ticks) * period;
                    ticks += 1;
                    let order = led.next(feedback, (begin, time + period))?;
                    let from = [&sent[0][..], &sent[1][..]];
                    let cell = &led.cell;
                    let tick = cell.limits.clear_tick(
                        &cell.robot,
                        &cell.scene.world_from_base,
                        order.clone(),
                        from,
                        (time, period),
                    );
                    sent = order;
                    tick.map_err(|limit| led.refused = Some(limit.into())).ok()
                },
                stop,
                watch,
            )
        });
        if let Some(refused) = led.refused.take() {
            return Err(refused);
        }
        let found = self.find_arm();
        match done {
            Err(error) if is_for_another(&error) => found.and(Ok(true)),
            done => done.and(found).and(Ok(false)),
        }
    }
}

/// A motion that gives way, as an arm is led by it.
struct Led<'w> {
    cell: Cell,
    /// All that stands still: the policies keep away from it, and are not all that it takes to be sure of it.
    world: &'w CollisionWorld<'w>,
    motion: GivingWay<'w>,
    target: Target,
    around: Around,
    /// The last two of the motion with their times, s.
    samples: [(f64, Sample); 2],
    /// How long the policies have rested, s.
    resting: f64,
    refused: Option<ActionError>,
}

impl Led<'_> {
    /// Returns where the joints are to be at `time` (s after `begin`) and how fast; nothing when it has arrived or come to rest, or
    /// would touch something that stands still if it were braked only then.
    fn next(&mut self, feedback: &Feedback, (begin, time): (f64, f64)) -> Option<[Vec<f64>; 2]> {
        let arrived = l2(&self.samples[1].1.q, &self.target.posture) < ARRIVED;
        if (arrived && self.resting > 0.0) || self.resting > RESTING || time > LONGEST {
            return None;
        }
        self.sees(feedback, begin);
        while self.motion.time() < time {
            match self.motion.tick(&self.target) {
                Ok(sample) => {
                    let step = self.motion.time() - self.samples[1].0;
                    let is_still = sample.dq.iter().all(|dq| dq.abs() < STILL);
                    self.resting = if is_still { self.resting + step } else { 0.0 };
                    self.samples.swap(0, 1);
                    self.samples[1] = (self.motion.time(), sample);
                }
                Err(error) => {
                    self.refused = Some(Refusal::from(error).into());
                    return None;
                }
            }
        }
        let [(from, a), (to, b)] = &self.samples;
        let share = if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        let (q, dq) = (mix(&a.q, &b.q, share), mix(&a.dq, &b.dq, share));
        let (rests, _) = at_rest(&self.cell.robot, &q, &dq, 0.0);
        (self.world.free(&q) && self.world.free(&rests)).then_some([q, dq])
    }

    /// Tells the motion what is seen to move.
    fn sees(&mut self, feedback: &Feedback, begin: f64) {
        let (gone, anew) = self.around.takes(feedback);
        for name in &gone {
            self.motion.forgets(name);
        }
        for (mover, seen) in anew {
            let solid = Solid::Sphere { radius: mover.radius + GROWN };
            let place = Isometry3::from(in_base(&self.cell, &mover.at));
            let ball = Obstacle::new(&mover.name, solid, place);
            if let Err(error) = self.motion.sees((seen - begin).min(self.motion.time()), &[ball]) {
                self.refused = Some(Refusal::from(error).into());
            }
        }
    }
}
