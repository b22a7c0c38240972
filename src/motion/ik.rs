//! Inverse kinematics: joint positions that put the tip at a pose.
//!
//! Arms with the Gen3's geometry have a [closed form](super::closed_form) with joint 3 free, which finds
//! every solution of a sweep over joint 3. Arms whose axes meet or are parallel where it helps are
//! taken apart (`decomposition`): all solutions of six joints, and of seven those of a sweep over one. Every other
//! chain is solved numerically (`descent`) from many starts, inside the limits first and then past them too, since limits may
//! bar the way to a solution inside them. A collision check is the caller's, by a filter.

use std::borrow::Cow;
use std::f64::consts::TAU;

use super::closed_form::ClosedForm;
use super::decomposition::Decomposition;
use super::descent::{Give, descend};
use super::frames::Frame;
use super::gate::Gate;
use super::reserve::Reserve;
use super::robot::{JointLimits, Motion, Robot};
use super::solutions::Search;
use super::unreached;
use crate::world::frame::{Base, Flange, Pose};

/// How near an arm with fewer joints than a pose has directions need come. Chosen: a millimetre is what things are seen to,
/// two degrees what they lean by in a hand, and a mug still stands.
const NEAR: Give = Give { position: 1e-3, rotation: 0.035 };

/// Starts of the numerical method where a closed form was asked already, or there are few solutions.
const FEW: usize = 12;

/// Limits are inclusive: rounding may put a solution at a limit this far past it, rad.
pub(super) const SLACK: f64 = 1e-9;

/// What may be chosen about a search.
#[derive(Debug, Clone)]
pub struct Options {
    /// Solutions are sorted by distance to this, rad, and continuous joints take the turn nearest to it.
    pub near: Vec<f64>,
    /// How many values of joint 3 the closed form tries over a full turn, besides the one of `near`.
    pub sweep: usize,
    /// How many starts the numerical method tries.
    pub restarts: usize,
    /// Stop after so many solutions; the nearest are not guaranteed then.
    pub enough: usize,
    /// Seed of the numerical method's starts.
    pub seed: u64,
}

impl Options {
    /// Returns the usual options, near `q`: all solutions over 64 values of joint 3.
    pub fn near(q: &[f64]) -> Self {
        Self { near: q.to_vec(), sweep: 64, restarts: 100, enough: usize::MAX, seed: 0 }
    }

    /// As [`Self::near`], content with the first solution found.
    pub fn first(q: &[f64]) -> Self {
        Self { enough: 1, ..Self::near(q) }
    }
}

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unreachable {
    /// What stands in the way.
    pub reason: Reason,
    /// How far from the target the tip can come with the wanted orientation, m, or where that cannot be had with another: the
    /// smallest distance found. For [`Reason::Collision`] 0, since the pose itself can be reached, and for
    /// [`Reason::Orientation`], since the place can.
    pub nearest: f64,
    /// Whether the tip has the wanted orientation there.
    pub is_turned: bool,
}

/// What stands in the way of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// No joint positions at all reach it.
    OutOfReach,
    /// Joint positions inside the limits reach its place, and none turn the tip so.
    Orientation,
    /// Only joint positions outside the limits reach it.
    Limits,
    /// The filter refused every solution.
    Collision,
}

impl Reason {
    /// Returns the word of the JSON answer.
    pub fn word(self) -> &'static str {
        match self {
            Self::OutOfReach => "out_of_reach",
            Self::Orientation => "orientation",
            Self::Limits => "limits",
            Self::Collision => "collision",
        }
    }
}

/// A robot with what its inverse kinematics needs worked out once.
#[derive(Debug, Clone)]
pub struct Solver<'a> {
    robot: &'a Robot,
    closed_form: Option<(ClosedForm, Gate)>,
    /// Of an arm without that form, if it has one.
    decomposition: Option<Decomposition>,
    spans: Vec<Span>,
    pub(super) give: Give,
}

/// What of a joint is asked for each solution.
#[derive(Debug, Clone, Copy)]
struct Span {
    turns: bool,
    lower: f64,
    upper: f64,
}

impl<'a> Solver<'a> {
    /// Prepares a robot: recognises the closed form by the joints' geometry, not by name.
    pub fn new(robot: &'a Robot) -> Self {
        let span = |joint: &JointLimits| Span {
            turns: robot.links[joint.link].joint.motion == Motion::Turn,
            lower: joint.lower,
            upper: joint.upper,
        };
        let spans = robot.joints().iter().map(span).collect();
        let closed_form = ClosedForm::of(robot).map(|form| {
            let gate = form.gate(robot);
            (form, gate)
        });
        let decomposition = if closed_form.is_none() { Decomposition::of(robot) } else { None };
        Self { robot, closed_form, decomposition, spans, give: Give::NOTHING }
    }

    /// Lets an arm with fewer than six joints come near a pose that it cannot take: a thing in its hand leans by what it was
    /// seen to lean, and such an arm cannot lean with it.
    #[must_use]
    pub fn giving_way(mut self) -> Self {
        if self.robot.n_joints() < 6 {
            self.give = NEAR;
        }
        self
    }

    /// Returns the closed form, if this arm has one.
    pub fn closed_form(&self) -> Option<&ClosedForm> {
        self.closed_form.as_ref().map(|(form, _)| form)
    }

    /// Whether every solution is found in closed form: of an arm with a joint to spare, every one at the values of that
    /// joint that are tried.
    pub fn is_analytic(&self) -> bool {
        self.closed_form.is_some() || self.decomposition.is_some()
    }

    /// Returns the robot.
    pub fn robot(&self) -> &'a Robot {
        self.robot
    }

    /// Returns joint positions inside the limits that put the tip at `target` and that `accept` takes,
    /// nearest to `options.near` first. Distances are maximum differences per joint, rad.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] if there is none.
    pub fn solve(
        &self,
        target: &Pose<Base, Flange>,
        options: &Options,
        accept: &dyn Fn(&[f64]) -> bool,
    ) -> Result<Vec<Vec<f64>>, Unreachable> {
        let target = &Frame::of(target.isometry());
        let near = &*self.near(options);
        let mut search = Search::new(self, near, accept);
        if let Some((form, gate)) = &self.closed_form {
            search.closed(form, gate, target, options);
        }
        if let Some(parts) = &self.decomposition {
            search.by_parts(parts, target, options);
        }
        if search.found.is_empty() && !(search.outside && search.refused) {
            let restarts = self.restarts(options.restarts, search.refused);
            search.descend(target, options, restarts);
            if search.found.is_empty() && !search.refused && !self.is_analytic() {
                search.descend_past_limits(target, options, restarts);
            }
        }
        if search.found.is_empty() {
            return Err(self.why_not(target, &search, near, options));
        }
        let mut found = search.found;
        found.sort_by(|a, b| distance(a, near).total_cmp(&distance(b, near)));
        Ok(found)
    }

    /// Returns the solution nearest to `near`, as [`Self::solve`].
    ///
    /// # Errors
    ///
    /// [`Unreachable`] if there is none.
    pub fn nearest(
        &self,
        target: &Pose<Base, Flange>,
        near: &[f64],
    ) -> Result<Vec<f64>, Unreachable> {
        let mut all = self.solve(target, &Options::near(near), &|_| true)?;
        Ok(all.swap_remove(0))
    }

    /// Appends the in-limit solutions with joint 3 held at `q3` (closed form only), turned near `near`.
    pub fn at_joint_3(&self, target: &Pose<Base, Flange>, q3: f64, near: &[f64]) -> Vec<Vec<f64>> {
        let Some(form) = self.closed_form() else { return Vec::new() };
        let mut raw = Vec::with_capacity(8);
        form.solve(self.robot, target.isometry(), q3, near, &mut raw);
        raw.into_iter().filter_map(|q| self.fit(q, near)).map(|q| q.to_vec()).collect()
    }

    /// Descends from `q` to the target, `reserve` inside the limits or where `q` is farther out: the solution a
    /// small motion leads to.
    pub fn descend_from(
        &self,
        target: &Pose<Base, Flange>,
        q: &[f64],
        reserve: Reserve,
    ) -> Option<Vec<f64>> {
        let ends = |(i, (joint, q)): (usize, (&JointLimits, &f64))| {
            let room = reserve.of(self.robot, i);
            let (lower, upper) = (joint.lower + room, joint.upper - room);
            (lower.min(*q).max(joint.lower), upper.max(*q).min(joint.upper))
        };
        let ranges: Vec<_> = self.robot.joints().iter().zip(q).enumerate().map(ends).collect();
        let mut q = q.to_vec();
        let target = Frame::of(target.isometry());
        descend(self.robot, &target, &mut q, Some(&ranges), self.give).then_some(q)
    }

    /// Brings `q` near `near` by whole turns, inside the limits; `None` if it does not fit.
    pub(super) fn fit<Q: AsMut<[f64]>>(&self, q: Q, near: &[f64]) -> Option<Q> {
        let mut q = self.turned(q, near, SLACK)?;
        for (x, span) in q.as_mut().iter_mut().zip(&self.spans) {
            *x = x.clamp(span.lower, span.upper);
        }
        Some(q)
    }

    /// As [`Self::fit`], with limits that are wider by `slack` rad.
    pub(super) fn turned<Q: AsMut<[f64]>>(&self, mut q: Q, near: &[f64], slack: f64) -> Option<Q> {
        for ((x, near), span) in q.as_mut().iter_mut().zip(near).zip(&self.spans) {
            let (lower, upper) = (span.lower - slack, span.upper + slack);
            if span.turns {
                *x = near + wrap(*x - near);
                if *x > upper {
                    *x -= TAU * ((*x - upper) / TAU).ceil();
                } else if *x < lower {
                    *x += TAU * ((lower - *x) / TAU).ceil();
                }
            }
            if *x < lower || *x > upper {
                return None;
            }
        }
        Some(q)
    }

    /// Brings joint positions into the limits: each that turns at the turn nearest to the middle of its range, or else to the
    /// nearer end.
    pub(super) fn clamp(&self, q: &mut [f64]) {
        for (x, span) in q.iter_mut().zip(&self.spans) {
            let middle = 0.5 * (span.lower + span.upper);
            if span.turns && middle.is_finite() {
                *x = middle + wrap(*x - middle);
            }
            *x = x.clamp(span.lower, span.upper);
        }
    }

    /// Returns from how many starts the numerical method tries what a closed form did not find.
    fn restarts(&self, most: usize, refused: bool) -> usize {
        match (&self.closed_form, &self.decomposition) {
            // A pose that so few joints take at all they take in a way or two.
            (None, None) if self.robot.n_joints() < 6 => most.min(FEW),
            (None, None) => most,
            (Some(_), _) if !refused => 0,
            // These are all there are.
            (None, Some(parts)) if refused && parts.held().is_none() => 0,
            // What the filter takes may lie between two values of the joint that is swept, and beside a singular pose an
            // arm whose axes meet only nearly has solutions that no start leads to.
            _ => most.min(FEW),
        }
    }

    fn near<'o>(&self, options: &'o Options) -> Cow<'o, [f64]> {
        if options.near.len() == self.robot.n_joints() {
            return Cow::Borrowed(&options.near);
        }
        self.spans.iter().map(|span| 0.0_f64.clamp(span.lower, span.upper)).collect()
    }

    /// Works out what the failed search says about the target.
    fn why_not(
        &self,
        target: &Frame,
        search: &Search<'_>,
        near: &[f64],
        options: &Options,
    ) -> Unreachable {
        if search.refused {
            return Unreachable { reason: Reason::Collision, nearest: 0.0, is_turned: true };
        }
        let form = self.closed_form();
        let nearest = unreached::nearest(self.robot, form, target, near, options.seed);
        let reason = if search.outside {
            Reason::Limits
        } else if !nearest.is_turned && nearest.distance <= 0.0 {
            Reason::Orientation
        } else {
            Reason::OutOfReach
        };
        Unreachable { reason, nearest: nearest.distance, is_turned: nearest.is_turned }
    }
}

/// The largest difference of any joint.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Brings an angle into ±π.
pub(super) fn wrap(angle: f64) -> f64 {
    // Nearly all are there already, and rounding is a call on most processors.
    if angle.abs() < 3.0 { angle } else { angle - TAU * (angle / TAU).round() }
}
