//! A goal in the world → joint paths that reach it: how to grasp, pour, put down and get there.
//!
//! Every list comes best first and holds only ways that the arm reaches and that touch nothing; whether
//! the water stays in is for the twin to say. Kinematics, collision and search are [`crate::motion`]'s.

mod brim;
mod drawer;
mod ends;
mod felt;
mod follow;
mod grasp;
mod grip;
mod hollow;
mod level;
mod no_path;
mod place;
mod pour;
mod push;
mod reachable;
mod roadmap;
mod straight;
mod table;
mod turn;
mod way;
mod work;

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::motion::Error;
use crate::motion::budget::Budget;
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::ik::{self, Reason, Solver};
use crate::motion::reserve::Reserve;
use crate::motion::robot::Robot;
use crate::motion::solid::Solid;
use crate::motion::trajectory::{self, Trajectory};
use crate::world::frame::{Base, Flange, Object, Tool, World};
use crate::world::{Pose, Shape, WorldState};

use crate::trace::{FARTHEST_TOLD, NoWay, Over, Why};

use super::cell::Cell;
use follow::follow;

pub use felt::{force_at, force_of, gravity_torque, mass_of};
pub use follow::distance;
pub use grasp::{Grasp, side_pose};
pub use place::Placement;
pub use pour::Pour;
pub use push::{Leg, Push};
pub use way::Way;
pub(super) use work::lowest;
pub use work::{Stir, Stroke, Wipe};

/// How far plans keep from the ends of a joint's range: a smooth curve through planned points
/// swings a little past them, and what is measured may ask for a little more than was planned. Chosen: 1.7 deg. Half of
/// it is what [`follow`] lets a path use, so with less nothing would be left for the curve; twice as much takes 2 % of
/// the range of joint 4, which limits where a level hand can be. A slide that carries a hand over the table goes no farther
/// than the hand between two points of a path, 5 mm, and what is measured is off by a millimetre: 2 mm of its way.
const RESERVE: Reserve = Reserve { turning: 0.03, sliding: 0.002 };
/// How much higher than the limits ask plans keep the tool above the table, m: corners are cut, and the arm
/// is a little beside where it is sent. Chosen: with half of it the limits, which ask for 5 mm, refuse ways that were
/// planned; with twice as much nothing is gained, since a hand grasps no lower than 55 mm, and what was
/// put down low may not be let go.
const ABOVE_FLOOR: f64 = 0.01;

/// What is called that was seen on the table and no scene declares.
const UNKNOWN: &str = "something unknown";
/// What the point between the fingers is called where it may not go.
const TOOL: &str = "the tool";
/// What finding the joint positions of one pose costs, in units of [`Budget`]: 0.5 ms at 20 million units a second. It
/// is twice what 25 values of joint 3 take in the closed form (8.8 µs each, measured with a probe of it), since a pose
/// that is out of reach is tried numerically as well. An order of magnitude is enough: a budget is thousands of these.
const REACHING: u64 = 10_000;
/// What following a path costs, a pose of it: 50 µs, which is the closed form at the five places of the elbow that
/// [`follow`] tries.
const TRACKING: u64 = 1_000;
/// Values of joint 3 that are tried for a pose, besides the one the arm has: one every 15 deg. Chosen: at 12 a window
/// of joint 3 of less than 30 deg may be missed; the usual 64 of [`ik::Options::near`] cost 2.7 times as much, and
/// the elbow is moved on while a path is followed anyway.
const SWEEP: usize = 24;
/// How far apart the poses along a straight line are, m. At the 0.5 m from the base at which a hand works, 5 mm turn
/// a joint by about 0.01 rad, far below [`JUMP`]. Chosen: with half of it every straight line costs twice as much to
/// check; a jaw is 14 mm thick, and with twice as much it could be 5 mm deep in something between two looks.
const STRAIGHT_STEP: f64 = 0.005;
/// Plans from one state of the world.
pub struct Planner {
    cell: Cell,
    state: WorldState,
    /// Where the arm is, rad.
    q: Vec<f64>,
    /// How far the arm may be from where it says, m: so much room is left around objects.
    doubt: f64,
    /// Around these it is less than that, m.
    near: BTreeMap<String, f64>,
    /// What was taken last, and where it stood then, x and y, m.
    taken: Option<(String, [f64; 2])>,
    /// What all that is asked of this planner may cost, and who may end it.
    budget: Arc<Budget<'static>>,
}

/// Collects why ways were dropped, to say the commonest reason when none is left.
#[derive(Debug, Default)]
struct Dropped {
    tried: usize,
    blocked: BTreeMap<String, usize>,
    /// The least that is out of reach, m; 0 of what is reached and cannot be followed.
    nearest: f64,
    /// A joint at whose end something is reached.
    at_end: Option<String>,
    /// Whether something is reached but for how the hand is turned.
    is_unturned: bool,
    /// The smallest width between fingers that do not open so wide, m.
    narrowest: f64,
    /// The largest width between fingers that do not close so far, m; 0 without any.
    widest: f64,
}

impl Planner {
    /// Starts from a state of the world and the arm at `q` rad, which may be `doubt` m from where it says.
    pub fn new(
        cell: Cell,
        state: WorldState,
        q: Vec<f64>,
        doubt: f64,
        budget: Arc<Budget<'static>>,
    ) -> Self {
        Self { cell, state, q, doubt, near: BTreeMap::new(), taken: None, budget }
    }

    /// Knows what was taken last, and where it stood then, x and y, m.
    #[must_use]
    pub fn having_taken(self, taken: Option<(String, [f64; 2])>) -> Self {
        Self { taken, ..self }
    }

    /// Takes note of work about to be done; returns whether to go on looking for ways, or be content with those
    /// there are.
    ///
    /// # Errors
    ///
    /// When somebody wants it to end, or there are none and the budget is used up.
    fn goes_on(&self, work: u64, found: usize) -> Result<bool, Why> {
        match self.budget.spend(work) {
            Ok(()) => Ok(true),
            Err(Error::Spent { .. }) if found > 0 => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    fn robot(&self) -> &Robot {
        &self.cell.robot
    }

    /// Returns where an object is known to be.
    fn pose(&self, o: &str, what: &str) -> Result<Pose<World, Object>, NoWay> {
        let known = self.state.object(o).and_then(|object| object.world_from_object);
        known.ok_or_else(|| NoWay { what: what.to_owned(), why: Why::NotSeen(o.to_owned()) })
    }

    /// Returns the direction from the arm's first axis to a place, rad, seen from above.
    fn bearing(&self, to: &Vector3<f64>) -> f64 {
        let robot = self.robot();
        let zeros = vec![0.0; robot.n_joints()];
        let first = robot.joints().first().map_or(0, |joint| joint.link);
        let base_from_first = robot.link_poses(&zeros, 0.0).map(|poses| poses[first]);
        let base_from_first = Pose::<Base, Flange>::new(base_from_first.unwrap_or_default());
        let away = to - (self.cell.scene.world_from_base * base_from_first).origin();
        away.y.atan2(away.x)
    }

    /// Returns the tool pose of joint positions.
    fn tool_at(&self, q: &[f64]) -> Pose<World, Tool> {
        self.cell.tool_pose(q)
    }

    /// Carries points of the robot's tip, for which kinematics are solved, into the base.
    fn tip(&self, tool: &Pose<World, Tool>) -> Pose<Base, Flange> {
        let base_from_tool = self.cell.scene.world_from_base.inverse() * *tool;
        base_from_tool * self.robot().flange_from_tool().inverse()
    }

    /// Returns every joint position that brings the tool to a pose, nearest to `near` first.
    ///
    /// # Errors
    ///
    /// [`Why::OutOfReach`], [`Why::AtEnd`] or [`Why::NotTurned`].
    fn reach(&self, tool: &Pose<World, Tool>, near: &[f64]) -> Result<Vec<Vec<f64>>, Why> {
        let pose = tool.isometry();
        if !pose.translation.vector.iter().all(|x| x.is_finite())
            || !pose.rotation.coords.iter().all(|x| x.is_finite())
        {
            return Err(Why::OutOfReach { nearest: f64::INFINITY });
        }
        let options = ik::Options { sweep: SWEEP, ..ik::Options::near(near) };
        let robot = self.robot();
        let at_end = std::cell::Cell::new(None);
        let inside = |q: &[f64]| {
            let end = robot.at_an_end(q, RESERVE);
            at_end.set(at_end.get().or(end));
            end.is_none()
        };
        let found = Solver::new(robot).giving_way().solve(&self.tip(tool), &options, &inside);
        found.map_err(|no| match at_end.get() {
            // Nothing else is refused.
            Some(joint) if no.reason == Reason::Collision => {
                Why::AtEnd { joint: robot.joints()[joint].name.clone() }
            }
            _ if !no.is_turned && no.nearest <= 0.0 => Why::NotTurned,
            _ => Why::OutOfReach { nearest: no.nearest },
        })
    }

    /// Follows tool poses with the joints, starting at `q`: one joint position a pose, on one branch.
    ///
    /// # Errors
    ///
    /// How far out of reach the first pose is that cannot be followed without a jump, m.
    fn track(&self, q: &[f64], poses: &[Pose<World, Tool>]) -> Result<Vec<Vec<f64>>, f64> {
        let solver = Solver::new(self.robot()).giving_way();
        let mut path = vec![q.to_vec()];
        for pose in poses {
            let last = path.last().expect("the path begins with `q`");
            let next = follow(&solver, &self.tip(pose), last)?;
            path.push(next);
        }
        Ok(path)
    }

    /// How much room is left around something, m: so much larger than it is it is taken.
    fn room_around(&self, name: &str) -> f64 {
        self.near.get(name).copied().unwrap_or(self.doubt)
    }

    /// What is in the way now: the table and every object whose place is known, but for `except`, and
    /// what is in the hand.
    fn obstacles(&self, except: &[&str], opening: f64) -> CollisionWorld<'_> {
        self.obstacles_around(except, None, opening)
    }

    /// As [`Self::obstacles`], with one vessel as its walls and its floor.
    fn obstacles_around(
        &self,
        except: &[&str],
        vessel: Option<&str>,
        opening: f64,
    ) -> CollisionWorld<'_> {
        let scene = &self.cell.scene;
        let base_from_world = scene.world_from_base.inverse();
        let mut world = CollisionWorld::new(self.robot());
        let table = &scene.table;
        let centre: Pose<World, Object> =
            Pose::upright(table.centre[0], table.centre[1], -table.size.z / 2.0, 0.0);
        // An arm that is elsewhere than it says is lower than it says as well.
        let grown = Vector3::repeat(self.room_around("table"));
        let slab = Solid::Cuboid { half: table.size / 2.0 + grown };
        world.add(&Obstacle::new("table", slab, *(base_from_world * centre).isometry()));
        // The arm is bolted to the table.
        world.ignore(&self.robot().links()[0].name, "table");
        let held = self.in_hand();
        for object in &scene.objects {
            let in_hand = held.as_ref().is_some_and(|(name, _)| *name == object.name);
            let room = self.room_around(&object.name);
            let known = self.state.object(&object.name).and_then(|o| o.world_from_object);
            if let Some(pose) = known.filter(|_| !in_hand && !except.contains(&&*object.name)) {
                let pose = base_from_world * pose;
                if vessel == Some(&*object.name) && object.cavity.is_some() {
                    for (solid, at) in hollow::walls(object, room) {
                        world.add(&Obstacle::new(&object.name, solid, pose.isometry() * at));
                    }
                    continue;
                }
                for solid in Obstacle::of_object(&object.name, &object.shape, room, pose) {
                    world.add(&solid);
                }
            }
            if let Some(pose) = known.filter(|_| !in_hand && !except.contains(&&*object.name)) {
                for (at, shape) in self.bars(object) {
                    let pose = base_from_world * Pose::new(pose.isometry() * at);
                    for solid in Obstacle::of_object(&object.name, &shape, room, pose) {
                        world.add(&solid);
                    }
                }
            }
        }
        for other in &self.state.unknown {
            let bound = || {
                let shape = Shape::Cylinder { radius: other.radius, height: other.height };
                (shape, Pose::upright(other.at[0], other.at[1], 0.0, 0.0), 0.0)
            };
            let (shape, stands, within) = other.form.as_ref().map_or_else(bound, |form| {
                (form.shape.clone(), form.world_from_object, form.within)
            });
            let (room, stands) = (self.room_around(UNKNOWN) + within, base_from_world * stands);
            for solid in Obstacle::of_object(UNKNOWN, &shape, room, stands) {
                world.add(&solid);
            }
            world.ignore(TOOL, UNKNOWN);
        }
        world.set_opening(opening);
        // The limits look at the point between the fingers, which no solid of theirs need hold.
        let middle = self.robot().flange_from_tool().origin();
        world.guard(TOOL, self.cell.limits.floor + ABOVE_FLOOR, &middle);
        for object in &scene.objects {
            world.ignore(TOOL, &object.name);
        }
        if let Some((name, tool_from_object)) = held
            && let Some(object) = scene.object(&name).filter(|_| !except.contains(&&*name))
            // A tray in the hand stays in its case.
            && scene.drawer(&name).is_none()
        {
            let flange_from_object = self.robot().flange_from_tool() * tool_from_object;
            world.attach(&name, &object.shape, flange_from_object);
        }
        world
    }

    /// Returns what is in the hand and how it lies there.
    fn in_hand(&self) -> Option<(String, Pose<Tool, Object>)> {
        let name = self.state.held.clone()?;
        let pose = self.state.object(&name)?.world_from_object?;
        Some((name, self.state.world_from_tool.inverse() * pose))
    }

    /// Returns the robot among all that stands still, as it is now.
    pub fn world(&self) -> CollisionWorld<'_> {
        self.obstacles(&[], self.state.opening)
    }

    /// Returns whether the limits let a dense path pass: a smooth curve through points that keep inside a joint's
    /// range may swing past its end where the arm's elbow is shifted.
    fn passes(&self, path: &[Vec<f64>]) -> bool {
        let limits = trajectory::Limits::of(self.robot());
        let Some(first) = path.first() else { return true };
        Trajectory::through_points(path, &limits)
            .is_ok_and(|timed| self.cell.clear(timed, first).is_ok())
    }

    /// Drops a path that touches something; returns its smallest clearance otherwise.
    fn clear(world: &CollisionWorld<'_>, path: &[Vec<f64>], dropped: &mut Dropped) -> Option<f64> {
        Self::clear_by(world, path, 0.0, dropped)
    }

    /// Drops a path that comes as near as `room` m to something; returns its smallest clearance otherwise.
    fn clear_by(
        world: &CollisionWorld<'_>,
        path: &[Vec<f64>],
        room: f64,
        dropped: &mut Dropped,
    ) -> Option<f64> {
        let mut least = f64::INFINITY;
        for q in path {
            let nearest = world.clearance_or_overlap(q).expect("the path has one angle per joint");
            if nearest.distance <= room {
                dropped.touches(&nearest.first, &nearest.second);
                return None;
            }
            least = least.min(nearest.distance);
        }
        Some(least)
    }
}

impl Dropped {
    fn new() -> Self {
        Self { nearest: f64::INFINITY, narrowest: f64::INFINITY, ..Self::default() }
    }

    fn out_of_reach(&mut self, shortfall: f64) {
        self.nearest = self.nearest.min(shortfall);
    }

    /// Takes note of why a pose has no joint positions.
    fn missed(&mut self, why: Why) {
        match why {
            Why::OutOfReach { nearest } => self.out_of_reach(nearest),
            Why::AtEnd { joint } => self.at_end = self.at_end.take().or(Some(joint)),
            _ => self.is_unturned = true,
        }
    }

    /// Whether no way was dropped for how far the arm gets.
    fn is_nowhere_short(&self) -> bool {
        self.nearest.is_infinite() && self.at_end.is_none() && !self.is_unturned
    }

    /// Returns what of all that the arm does not get to it misses least: what it cannot follow, what it reaches at the end of a
    /// joint's range, what is nearest, what it cannot turn its hand for.
    fn missed_least(self) -> Why {
        match self.at_end {
            Some(joint) if self.nearest > 0.0 => Why::AtEnd { joint },
            _ if self.is_unturned && self.nearest.is_infinite() => Why::NotTurned,
            _ => Why::OutOfReach { nearest: self.nearest },
        }
    }

    fn too_wide(&mut self, widths: impl Iterator<Item = f64>) {
        self.narrowest = widths.fold(self.narrowest, f64::min);
    }

    fn too_narrow(&mut self, widths: impl Iterator<Item = f64>) {
        self.widest = widths.fold(self.widest, f64::max);
    }

    fn touches(&mut self, first: &str, second: &str) {
        *self.blocked.entry(format!("{first} with {second}")).or_default() += 1;
    }

    fn why(mut self) -> Why {
        let blocked = std::mem::take(&mut self.blocked);
        match blocked.into_iter().max_by_key(|(_, count)| *count) {
            Some((by, _)) => Why::Blocked { tried: self.tried, by },
            None => match self.missed_least() {
                Why::OutOfReach { nearest } => {
                    Why::OutOfReach { nearest: nearest.min(FARTHEST_TOLD) }
                }
                why => why,
            },
        }
    }

    /// As [`Self::why`], of ways to take something between fingers that open from `least` to `most` m. A hand that points down has
    /// more of its fingers beside the thing, and that may be wider there.
    fn why_no_grip(self, [least, most]: [f64; 2]) -> Why {
        let is_width = self.tried == 0 && self.blocked.is_empty() && self.is_nowhere_short();
        match self.narrowest {
            _ if is_width && self.widest > 0.0 => {
                Why::TooNarrow { width: self.widest, opening: least }
            }
            width if is_width && width.is_finite() => Why::TooWide { width, opening: most },
            _ if is_width => Why::NoSides,
            _ => self.why(),
        }
    }

    /// As [`Self::why`], of ways with something over a thing.
    fn why_not_over(self, target: &str) -> Why {
        match self.why() {
            Why::OutOfReach { nearest } => {
                Why::OverOutOfReach(Over { target: target.to_owned(), nearest })
            }
            Why::NotTurned => Why::OverOutOfReach(Over { target: target.to_owned(), nearest: 0.0 }),
            why => why,
        }
    }
}

/// Returns poses every [`STRAIGHT_STEP`] along a straight line from `from` by `by` m, the start left out.
fn straight(from: &Pose<World, Tool>, by: Vector3<f64>) -> Vec<Pose<World, Tool>> {
    let n = (by.norm() / STRAIGHT_STEP).ceil().max(1.0) as usize;
    (1..=n)
        .map(|i| Pose::from_parts(from.origin() + by * (i as f64 / n as f64), from.rotation()))
        .collect()
}

/// Returns the angle, rad, through which the tool turns along a joint path.
pub fn turned_angle(robot: &Arc<Robot>, path: &[Vec<f64>]) -> f64 {
    let turns: Vec<_> = path
        .iter()
        .filter_map(|q| robot.forward_tool(q).ok())
        .map(|pose| pose.rotation())
        .collect();
    turns.windows(2).map(|pair| pair[0].angle_to(&pair[1])).sum()
}
