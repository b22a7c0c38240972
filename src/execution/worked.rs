//! What a tool did to what it worked on, as far as it is measured while the arm moves: how far it went round in a vessel's
//! water, and over which part of a thing's top it was led touching it.
//!
//! Kept beside every motion, whichever script asked for it, so that a promise is not judged by who made it. In the twin
//! everything is known. On an arm where the tool is follows from its joints, where things are from the last picture, water
//! from what was declared and weighed, and touch from the torques of the joints against what they were at rest before a
//! touch (`arm.move_until`); where one of them is missing, what was done is unknown.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use crate::arm::Feedback;
use crate::world::frame::{Tool, World};
use crate::world::{Object, Point, Pose, Shape, WorldState, frame};

use super::body::Sight;
use super::cell::Cell;
use super::plan::{force_at, force_of, gravity_torque, lowest};

/// How often it is looked at, s of arm time: at 5 cm/s a tool goes 1 mm meanwhile.
const PERIOD: f64 = 0.02;
/// A tip is in the water from this far below its surface on, m: water is declared to 3 % (`lab.md`), 1 mm of 3 cm, and
/// places are known to some millimetres.
const DIPPED: f64 = 0.005;
/// A tip nearer than this to the axis of a vessel goes round nothing, m.
const ASIDE: f64 = 0.005;
/// A tool is led over a top when it is at most so far from it in height, m: what a calibrated hand may be off.
const OVER: f64 = 0.006;
/// It touches when the joints feel so much against it, N: ten times what is left of their noise in a mean over 20 ms in the
/// laboratory, a third of what a touch ends with.
const TOUCHES: f64 = 1.0;
/// So much is a pull at what is held, N: most of what `arm.offer` asks for in the stdlib, which is 4 N; and so long ago it is one
/// still, s.
const PULLS: f64 = 3.0;
const JUST: f64 = 1.0;
/// Fingers less open than this work as one tool, m.
const CLOSED: f64 = 0.005;
/// The sides of the squares that a top is counted in, m: a fifth of a finger.
const SQUARE: f64 = 0.005;
/// A thing that leans more than this has no level top and no level water, rad.
const LEANS: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Readings of which the mean is taken, of 250 a second.
const READINGS: f64 = 5.0;

/// What was done so far in a run.
#[derive(Debug, Clone, Default)]
pub(super) struct Worked {
    /// How far something went round in the water of each vessel, rad; `None` when nobody knows whether it was in it.
    stirred: BTreeMap<String, Option<f64>>,
    /// Whether things that the fingers let go were being pulled at when they opened; `None` when nobody knows.
    handed: BTreeMap<String, Option<bool>>,
    /// When somebody was last felt to pull at what is held, s.
    pulled: Option<f64>,
    /// Which squares of each thing's top were touched; `None` when nobody knows whether they were.
    swept: BTreeMap<String, Option<Vec<bool>>>,
}

impl Worked {
    /// Returns how far something went round in the water of a vessel, rad; `None` when nobody knows.
    pub(super) fn stirred(&self, vessel: &str) -> Option<f64> {
        self.stirred.get(vessel).copied().unwrap_or(Some(0.0))
    }

    /// Returns whether somebody was pulling at a thing when the fingers let it go; `None` when nobody knows.
    pub(super) fn handed(&self, thing: &str) -> Option<bool> {
        self.handed.get(thing).copied().unwrap_or(Some(false))
    }

    /// Returns whether somebody was just felt to pull at what is held; `now` in s.
    pub(super) fn is_pulled(&self, now: f64) -> bool {
        self.pulled.is_some_and(|at| now - at < JUST)
    }

    /// Takes note that the fingers opened on a thing, from `begin` s on; `felt` says whether anybody could feel a pull.
    pub(super) fn released(&mut self, thing: &str, begin: f64, felt: bool) {
        let pulled = self.is_pulled(begin);
        self.handed.insert(thing.to_owned(), (pulled || felt).then_some(pulled));
    }

    /// Takes note that the fingers closed on a thing: it is in nobody else's hand.
    pub(super) fn took(&mut self, thing: &str) {
        self.handed.remove(thing);
    }

    /// Returns the share of a thing's top that a tool was led over, touching it; `None` when nobody knows.
    pub(super) fn swept(&self, thing: &Object) -> Option<f64> {
        let top = Top::of(&thing.shape);
        let Some(touched) = self.swept.get(&thing.name) else { return Some(0.0) };
        let touched = touched.as_ref()?.iter().filter(|touched| **touched).count();
        Some(touched as f64 / top.squares().count().max(1) as f64)
    }
}

/// Takes note of what is done while the arm moves.
pub(super) struct Working {
    sight: Box<dyn Sight>,
    cell: Cell,
    /// Water in each vessel when the motion began, m³.
    water: BTreeMap<String, Option<f64>>,
    /// Torques beyond the model's at rest, N·m, if they were measured.
    rest: Option<Vec<f64>>,
    /// Mean torques beyond those, N·m.
    excess: Option<Vec<f64>>,
    /// At what angle the tip was in each vessel, rad.
    angles: BTreeMap<String, f64>,
    next: f64,
    worked: Worked,
}

impl Working {
    /// Begins with what was done before; `state` is the world now.
    pub(super) fn new(
        sight: Box<dyn Sight>,
        cell: Cell,
        state: &WorldState,
        rest: Option<Vec<f64>>,
        worked: Worked,
    ) -> Self {
        let water = state.objects.iter().map(|known| (known.name.clone(), known.water)).collect();
        let (angles, excess) = (BTreeMap::new(), None);
        Self { sight, cell, water, rest, excess, angles, next: f64::NEG_INFINITY, worked }
    }

    /// Returns what was done so far.
    pub(super) fn done(self) -> Worked {
        self.worked
    }

    /// Takes note of one tick.
    pub(super) fn sees(&mut self, feedback: &Feedback) {
        self.feels(feedback);
        if feedback.time < self.next {
            return;
        }
        self.next = feedback.time + PERIOD;
        let state = self.sight.state(feedback);
        let force = self.excess.as_ref().filter(|_| state.held.is_some());
        let force = force.and_then(|excess| force_at(&self.cell.robot, &feedback.q, excess));
        if force.is_some_and(|force| force.norm() >= PULLS) {
            self.worked.pulled = Some(feedback.time);
        }
        self.stirs(&state);
        self.sweeps(&state, feedback);
    }

    /// Takes a running mean of what the joints feel beyond what they felt at rest.
    fn feels(&mut self, feedback: &Feedback) {
        let Some(rest) = &self.rest else { return };
        let model = gravity_torque(&self.cell.robot, &feedback.q);
        let now = feedback.tau.iter().zip(&model).zip(rest).map(|((tau, g), rest)| tau - g - rest);
        self.excess = Some(match &self.excess {
            Some(mean) => {
                mean.iter().zip(now).map(|(mean, x)| mean + (x - mean) / READINGS).collect()
            }
            None => now.collect(),
        });
    }

    fn stirs(&mut self, state: &WorldState) {
        let scene = self.cell.scene.clone();
        let held = state.held.as_deref().and_then(|name| state.object(name));
        let tip = held.and_then(|held| held.world_from_object).map(|pose| pose.origin());
        for vessel in scene.objects.iter().filter(|o| Some(&o.name) != state.held.as_ref()) {
            let angle = tip.zip(standing(state, &vessel.name)).and_then(|(tip, pose)| {
                let at = (pose.inverse() * Point::<World>::from(tip)).coords();
                self.in_water(vessel, &at)
            });
            let Some(tip) = angle else {
                self.angles.remove(&vessel.name);
                continue;
            };
            let done = self.worked.stirred.entry(vessel.name.clone()).or_insert(Some(0.0));
            let Tip::Wet(angle) = tip else {
                *done = None;
                continue;
            };
            if let Some(before) = self.angles.insert(vessel.name.clone(), angle) {
                let by = (angle - before + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                    - std::f64::consts::PI;
                *done = done.map(|done| done + by.abs());
            }
        }
    }

    /// Returns where in a vessel a tip at `at` in its frame is; `None` when it is not in its water, or on its axis.
    fn in_water(&self, vessel: &Object, at: &Vector3<f64>) -> Option<Tip> {
        let (inside, cavity) = vessel.inside().zip(vessel.cavity)?;
        let is_in = inside.inset(at.x, at.y) >= 0.0 && at.z >= 0.0 && at.z <= vessel.shape.height();
        if !is_in || at.xy().norm() < ASIDE {
            return None;
        }
        let Some(water) = self.water.get(&vessel.name).copied().flatten() else {
            return Some(Tip::Somewhere);
        };
        let level = cavity.wall + water * inside.height() / inside.volume();
        (at.z <= level - DIPPED).then(|| Tip::Wet(at.y.atan2(at.x)))
    }

    fn sweeps(&mut self, state: &WorldState, feedback: &Feedback) {
        let Some((foot, low)) = self.foot(state) else { return };
        let scene = self.cell.scene.clone();
        for thing in scene.objects.iter().filter(|o| Some(&o.name) != state.held.as_ref()) {
            let Some(pose) = standing(state, &thing.name) else { continue };
            let top = Top::of(&thing.shape);
            if (low - pose.origin().z - thing.shape.height()).abs() > OVER {
                continue;
            }
            let under: Vec<usize> = top
                .squares()
                .filter(|(_, at)| {
                    let at = Vector3::new(at.x, at.y, thing.shape.height());
                    foot.holds(&(pose * Point::<frame::Object>::from(at)).coords())
                })
                .map(|(k, _)| k)
                .collect();
            if under.is_empty() {
                continue;
            }
            let touches = self.touches(state, &thing.name, feedback);
            let swept = self.worked.swept.entry(thing.name.clone());
            let swept = swept.or_insert_with(|| Some(vec![false; top.across * top.along]));
            match (touches, swept.as_mut()) {
                (None, _) => *swept = None,
                (Some(true), Some(squares)) => under.into_iter().for_each(|k| squares[k] = true),
                _ => {}
            }
        }
    }

    /// Whether the tool touches a thing: as physics has it, or as the joints feel it; `None` when neither is known.
    fn touches(&self, state: &WorldState, thing: &str, feedback: &Feedback) -> Option<bool> {
        if !self.sight.feels() {
            let tool = state.held.as_deref().unwrap_or("gripper");
            return self.sight.contact(tool, thing);
        }
        let excess = self.excess.as_ref()?;
        let down = self.cell.scene.world_from_base.inverse().rotation() * -Vector3::z();
        Some(force_of(&self.cell.robot, &feedback.q, excess, &down)? >= TOUCHES)
    }

    /// Returns what of the tool is lowest, and how low that is in the world, m; `None` of open fingers.
    fn foot(&self, state: &WorldState) -> Option<(Foot, f64)> {
        if let Some(held) = state.held.as_deref() {
            let pose = state.object(held)?.world_from_object?;
            let shape = &self.cell.scene.object(held)?.shape;
            let from_tool = Pose::<World, Tool>::from_parts(pose.origin(), pose.rotation());
            let square = |radius: f64| [radius * std::f64::consts::SQRT_2; 2];
            let sides = shape.faces().or(shape.foot_radius().map(square))?;
            let half = 0.5 * Vector2::from(sides);
            return Some((Foot { at: from_tool, least: -half, most: half }, pose.origin().z));
        }
        if state.opening > CLOSED {
            return None;
        }
        let tool = state.world_from_tool;
        // Level axes about the tool's own x.
        let x = Vector3::new(tool.axis(0).x, tool.axis(0).y, 0.0).try_normalize(1e-6)?;
        let y = Vector3::z().cross(&x);
        let corners = self.cell.robot.finger_corners(state.opening).into_iter();
        let corners: Vec<Vector3<f64>> = corners.map(|corner| tool.rotation() * corner).collect();
        let low = corners.iter().map(|corner| corner.z).fold(f64::INFINITY, f64::min);
        let mut foot = Foot {
            at: Pose::upright(tool.origin().x, tool.origin().y, tool.origin().z, x.y.atan2(x.x)),
            least: Vector2::repeat(f64::INFINITY),
            most: Vector2::repeat(f64::NEG_INFINITY),
        };
        for corner in &lowest(&corners) {
            let at = Vector2::new(corner.dot(&x), corner.dot(&y));
            (foot.least, foot.most) = (foot.least.inf(&at), foot.most.sup(&at));
        }
        Some((foot, tool.origin().z + low))
    }
}

/// Where in a vessel a tip is.
enum Tip {
    /// In its water, at this angle about its axis, rad.
    Wet(f64),
    /// In it, and nobody knows how high its water stands.
    Somewhere,
}

/// What of a tool touches: a rectangle in its level axes.
struct Foot {
    at: Pose<World, Tool>,
    least: Vector2<f64>,
    most: Vector2<f64>,
}

impl Foot {
    fn holds(&self, point: &Vector3<f64>) -> bool {
        let at = (self.at.inverse() * Point::<World>::from(*point)).coords();
        (self.least.x..=self.most.x).contains(&at.x) && (self.least.y..=self.most.y).contains(&at.y)
    }
}

/// The top of a thing in squares.
struct Top {
    shape: Arc<Shape>,
    along: usize,
    across: usize,
}

impl Top {
    fn of(shape: &Shape) -> Self {
        let [x, y] = shape.faces().unwrap_or([2.0 * shape.rim_radius(); 2]);
        let count = |length: f64| (length / SQUARE).round().max(1.0) as usize;
        Self { shape: Arc::new(shape.clone()), along: count(x), across: count(y) }
    }

    /// The middles of the squares in the thing's frame, m, with their numbers.
    fn squares(&self) -> impl Iterator<Item = (usize, Vector2<f64>)> + '_ {
        let middle = |k: usize, count: usize| (k as f64 + 0.5 - 0.5 * count as f64) * SQUARE;
        (0..self.along * self.across)
            .map(move |k| {
                let (i, j) = (k % self.along, k / self.along);
                (k, Vector2::new(middle(i, self.along), middle(j, self.across)))
            })
            .filter(|(_, at)| self.shape.inset(at.x, at.y) >= 0.0)
    }
}

/// Returns the pose of a thing that stands upright and whose place is known.
fn standing(state: &WorldState, name: &str) -> Option<Pose<World, frame::Object>> {
    let pose = state.object(name)?.world_from_object?;
    (pose.tilt() < LEANS).then_some(pose)
}
