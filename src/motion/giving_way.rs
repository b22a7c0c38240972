//! A motion among things that move: tick by tick it is told where they were seen, and gives way.
//!
//! The policies of [`super::rmpflow`] say how each joint is to be accelerated. Here that is held to the limits: no joint is
//! accelerated more than it can be, passes the end of its range or its speed, and what is sent is the mean over a short window, which
//! bounds jerk as well. The arm is half a window behind the policies for it; obstacles are put where they will be then.
//!
//! How fast an obstacle moves is told by where it was seen lately ([`super::sights`]); how it turns is learnt from the next sight alone.
//! One that is not seen any more rests where it would be until somebody says that it has gone. Nothing is promised of what comes faster
//! than the arm can give way, and balls inside the robot are not quite all of it: whoever sends this to an arm looks where it leads and
//! stops it.
//!
//! Not a plan: it can come to rest before its target. Nothing here moves an arm.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;

use super::collision::{CollisionWorld, Obstacle};
use super::error::Error;
use super::rmpflow::{Moving, Policy, STEP, Target};
use super::sights::{REMEMBERED, Sights};
use super::trajectory::{Limits, Sample};

/// A motion that gives way, at one instant.
pub struct GivingWay<'w> {
    policy: Policy<'w>,
    limits: Limits,
    /// Where the policies have it.
    at: Moving,
    /// The last states of the policies, of which the mean is sent; the latest last.
    window: VecDeque<Sample>,
    seen: BTreeMap<String, Seen>,
    time: f64,
}

/// What was seen of an obstacle lately.
#[derive(Debug, Clone, Default)]
struct Seen {
    /// Of the first of its parts.
    sights: Sights,
    /// Its parts as they were seen last.
    parts: Vec<Obstacle>,
    is_moving: bool,
}

impl<'w> GivingWay<'w> {
    /// Begins at rest at `q` (rad), at time 0. Obstacles of the world rest until they are seen to move.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] and [`Error::NotFinite`] for joints that are none of this robot.
    pub fn new(world: &CollisionWorld<'w>, limits: &Limits, q: &[f64]) -> Result<Self, Error> {
        let policy = Policy::new(world);
        policy.robot().check(q)?;
        // Two accelerations of opposite signs, a window apart, are what the mean changes by most.
        let slowest = limits.acceleration.iter().zip(&limits.jerk).map(|(a, j)| 2.0 * a / j);
        // Rounding is not to pass a limit.
        let limits = limits.scaled(1.0, 1.0 - 1e-9);
        let ticks = (slowest.fold(0.0, f64::max) / STEP).ceil().max(1.0) as usize;
        let none = vec![0.0; q.len()];
        let rest = Sample { q: q.to_vec(), dq: none.clone(), ddq: none.clone() };
        let at = Moving { q: q.to_vec(), dq: none };
        let window = VecDeque::from(vec![rest; ticks]);
        Ok(Self { policy, limits, at, window, seen: BTreeMap::new(), time: 0.0 })
    }

    /// Returns the time, s: [`STEP`] more with every tick.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns the least distance between the robot and an obstacle as the policies see them, m: between balls inside the robot and
    /// the obstacle where it is expected half a window from now.
    pub fn nearest(&self) -> f64 {
        self.policy.nearest()
    }

    /// Takes in where an obstacle was seen at `time` (s, on the clock of [`Self::time`], not later than now): its parts share a name and
    /// come in the same order every time. A name that was never heard is a new obstacle.
    ///
    /// # Errors
    ///
    /// [`Error::Sight`] for a place or a time that is none, and for a sight that is no later than the one before.
    pub fn sees(&mut self, time: f64, parts: &[Obstacle]) -> Result<(), Error> {
        let Some(first) = parts.first() else { return Ok(()) };
        let numbers =
            |part: &Obstacle| part.solid.pose.to_homogeneous().iter().all(|x| x.is_finite());
        let no_sight = || Error::Sight { name: first.name.clone(), time };
        if !parts.iter().all(numbers) {
            return Err(no_sight());
        }
        let seen = self.seen.entry(first.name.clone()).or_default();
        if !seen.sights.add(time, first.solid.pose.translation.vector) {
            return Err(no_sight());
        }
        seen.is_moving = true;
        seen.parts = parts.to_vec();
        let velocity = seen.sights.velocity();
        // What is sent is the mean over the window: the arm is where the policies were half of it ago.
        let behind = 0.5 * STEP * self.window.len() as f64;
        let since = (self.time - time).clamp(0.0, REMEMBERED) + behind;
        let moved = |part: &Obstacle| {
            let mut part = part.clone();
            part.solid.pose.translation.vector += velocity * since;
            part
        };
        self.policy.place_parts(&parts.iter().map(moved).collect::<Vec<_>>());
        self.policy.moves(&first.name, &velocity);
        Ok(())
    }

    /// Takes in that an obstacle that was seen has gone: nothing is kept away from any more where it was.
    pub fn forgets(&mut self, name: &str) {
        /// Farther than any arm feels, m.
        const AWAY: f64 = 1e6;
        let Some(mut seen) = self.seen.remove(name) else { return };
        for part in &mut seen.parts {
            part.solid.pose.translation.vector.z = AWAY;
        }
        self.policy.place_parts(&seen.parts);
        self.policy.moves(name, &Vector3::zeros());
    }

    /// Lets [`STEP`] s pass and returns where the joints are to be then, how fast, and how accelerated.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] and [`Error::NotFinite`] for a posture that is none of this robot.
    pub fn tick(&mut self, target: &Target) -> Result<Sample, Error> {
        let pull = self.policy.pull(&self.at, target)?;
        let over = pull.iter().zip(&self.limits.acceleration).map(|(a, most)| a.abs() / most);
        let share = over.fold(1.0, f64::max).recip();
        let mut ddq = vec![0.0; pull.len()];
        for (i, joint) in self.policy.robot().joints().iter().enumerate() {
            let (q, dq) = (self.at.q[i], self.at.dq[i]);
            let (most, brake) = (self.limits.velocity[i], self.limits.acceleration[i]);
            let down = most.min(stoppable(q - joint.lower, brake));
            let up = most.min(stoppable(joint.upper - q, brake));
            let rate = (dq + STEP * share * pull[i]).clamp(-down, up);
            // A joint that begins beyond its range comes to rest as others do.
            let rate = rate.clamp(dq - STEP * brake, dq + STEP * brake);
            ddq[i] = (rate - dq) / STEP;
            self.at.dq[i] = rate;
            self.at.q[i] += STEP * rate;
        }
        self.policy.carry_on();
        self.time += STEP;
        for (name, seen) in &mut self.seen {
            let last = seen.sights.last().unwrap_or(self.time);
            if seen.is_moving && self.time - last > REMEMBERED {
                seen.is_moving = false;
                self.policy.moves(name, &Vector3::zeros());
            }
        }
        self.window.pop_front();
        self.window.push_back(Sample { q: self.at.q.clone(), dq: self.at.dq.clone(), ddq });
        Ok(self.mean())
    }

    /// The mean over the window.
    fn mean(&self) -> Sample {
        let n = self.at.q.len();
        let none = || vec![0.0; n];
        let mut mean = Sample { q: none(), dq: none(), ddq: none() };
        let share = (self.window.len() as f64).recip();
        for state in &self.window {
            for i in 0..n {
                mean.q[i] += share * state.q[i];
                mean.dq[i] += share * state.dq[i];
                mean.ddq[i] += share * state.ddq[i];
            }
        }
        mean
    }
}

/// Returns the highest speed from which a joint comes to rest within `room` (rad) at `brake` (rad/s²), in steps of [`STEP`]: each
/// step is made at the speed at its end.
///
/// From `v` the way is `v (v / brake + h) / 2` in steps of `h`.
fn stoppable(room: f64, brake: f64) -> f64 {
    let step = brake * STEP;
    0.5 * ((step * step + 8.0 * brake * room.max(0.0)).sqrt() - step)
}
