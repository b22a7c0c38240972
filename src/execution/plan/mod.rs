//! A goal in the world → joint paths that reach it: how to grasp, pour, put down and get there.
//!
//! Every list comes best first and holds only ways that the arm reaches and that touch nothing; whether
//! the water stays in is for the twin to say. Kinematics, collision and search are [`crate::motion`]'s.

mod brim;
mod grasp;
mod place;
mod pour;

use std::sync::Arc;

use nalgebra::{DVector, Unit, Vector3};

use crate::motion::Error;
use crate::motion::budget::Budget;
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::dynamics::{Bodies, Dynamics, GRAVITY};
use crate::motion::escape;
use crate::motion::ik::{self, Solver};
use crate::motion::robot::Robot;
use crate::motion::rrt::{self, Cone};
use crate::motion::solid::Solid;
use crate::motion::trajectory::{self, Trajectory};
use crate::world::frame::{Base, Flange, Object, Tool, World};
use crate::world::{Pose, WorldState};

use super::stage::Cell;

pub use grasp::{Grasp, distance, side_pose};
pub use place::Placement;
pub use pour::Pour;

/// There is no way, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct NoWay {
    /// What was wanted: "to grasp `jar`".
    pub what: String,
    /// Why not.
    pub why: Why,
}

/// Why there is no way.
#[derive(Debug, Clone, PartialEq)]
pub enum Why {
    /// Nobody knows where the object is.
    NotSeen(String),
    /// It does not fit between the fingers.
    TooWide {
        /// Its narrowest width, m.
        width: f64,
        /// The fingers' opening, m.
        opening: f64,
    },
    /// The arm does not reach.
    OutOfReach {
        /// The smallest distance between the goal and what the tool can reach, m.
        nearest: f64,
    },
    /// Every reachable way touches something.
    Blocked {
        /// How many ways were tried.
        tried: usize,
        /// What was touched most often.
        by: String,
    },
    /// The search ended without a path.
    NoPath(String),
    /// There is nothing in the hand.
    EmptyHand,
    /// The search used up its budget, which stands for about so many seconds of computing.
    NotWithin(u64),
    /// A person asked to stop.
    Stopped,
}

impl std::fmt::Display for NoWay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "no way {}: ", self.what)?;
        match &self.why {
            Why::NotSeen(o) => write!(f, "nobody knows where `{o}` is"),
            Why::TooWide { width, opening } => write!(
                f,
                "it is {:.0} mm wide and the fingers open {:.0} mm",
                width * 1e3,
                opening * 1e3
            ),
            Why::OutOfReach { nearest } => {
                write!(f, "it is {:.0} mm out of reach", nearest * 1e3)
            }
            Why::Blocked { tried, by } => {
                write!(f, "all {tried} reachable ways touch something, mostly {by}")
            }
            Why::NoPath(why) => write!(f, "no path was found ({why})"),
            Why::EmptyHand => write!(f, "there is nothing in the hand"),
            Why::NotWithin(seconds) => {
                write!(f, "none was found within a budget of about {seconds} s of computing")
            }
            Why::Stopped => write!(f, "stopped"),
        }
    }
}

impl std::error::Error for NoWay {}

/// How far plans keep from the ends of a joint's range, rad: a smooth curve through planned points
/// swings a little past them, and what is measured may ask for a little more than was planned.
const RESERVE: f64 = 0.03;
/// The same for free motions, whose corners are cut on the inside: half a degree, rad.
const END_RESERVE: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// How much higher than the limits ask plans keep the tool above the table, m: corners are cut, and the arm
/// is a little beside where it is sent.
const ABOVE_FLOOR: f64 = 0.01;

/// A free motion in two stretches, with a rest between.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// Out of where something is touched, rad; one point where nothing is.
    pub out: Vec<Vec<f64>>,
    /// On from there, rad.
    pub on: Vec<Vec<f64>>,
}

/// What the point between the fingers is called where it may not go.
const TOOL: &str = "the tool";
/// What finding the joint positions of one pose costs, in units of [`Budget`].
const REACHING: u64 = 10_000;
/// What following a path costs, a pose of it.
const TRACKING: u64 = 1_000;

/// Plans from one state of the world.
pub struct Planner {
    cell: Cell,
    state: WorldState,
    /// Where the arm is, rad.
    q: Vec<f64>,
    /// How far the arm may be from where it says, m: so much room is left around objects.
    doubt: f64,
    /// What all that is asked of this planner may cost, and who may end it.
    budget: Arc<Budget<'static>>,
}

/// Collects why ways were dropped, to say the commonest reason when none is left.
#[derive(Debug, Default)]
struct Dropped {
    tried: usize,
    blocked: std::collections::BTreeMap<String, usize>,
    nearest: f64,
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
        Self { cell, state, q, doubt, budget }
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

    /// Returns the tool pose of joint positions.
    fn tool_at(&self, q: &[f64]) -> Pose<World, Tool> {
        tool_pose(&self.cell, q)
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
    /// How far out of reach the pose is, m.
    fn reach(&self, tool: &Pose<World, Tool>, near: &[f64]) -> Result<Vec<Vec<f64>>, f64> {
        let pose = tool.isometry();
        if !pose.translation.vector.iter().all(|x| x.is_finite())
            || !pose.rotation.coords.iter().all(|x| x.is_finite())
        {
            return Err(f64::INFINITY);
        }
        let options = ik::Options { sweep: 24, ..ik::Options::near(near) };
        let robot = self.robot();
        let inside = |q: &[f64]| robot.outside_limits(q, -RESERVE).is_none();
        let found = Solver::new(robot).solve(&self.tip(tool), &options, &inside);
        found.map_err(|unreachable| unreachable.nearest)
    }

    /// Follows tool poses with the joints, starting at `q`: one joint position a pose, on one branch.
    ///
    /// # Errors
    ///
    /// How far out of reach the first pose is that cannot be followed without a jump, m.
    fn track(&self, q: &[f64], poses: &[Pose<World, Tool>]) -> Result<Vec<Vec<f64>>, f64> {
        let solver = Solver::new(self.robot());
        let mut path = vec![q.to_vec()];
        for pose in poses {
            let last = path.last().expect("the path begins with `q`");
            let next = follow(&solver, &self.tip(pose), last)?;
            path.push(next);
        }
        Ok(path)
    }

    /// What is in the way now: the table and every object whose place is known, but for `except`, and
    /// what is in the hand.
    fn obstacles(&self, except: &[&str], opening: f64) -> CollisionWorld<'_> {
        let scene = &self.cell.scene;
        let base_from_world = scene.world_from_base.inverse();
        let mut world = CollisionWorld::new(self.robot());
        let table = &scene.table;
        let centre: Pose<World, Object> =
            Pose::upright(table.centre[0], table.centre[1], -table.size.z / 2.0, 0.0);
        // An arm that is elsewhere than it says is lower than it says as well.
        let grown = Vector3::repeat(self.doubt);
        let slab = Solid::Cuboid { half: table.size / 2.0 + grown };
        world.add(&Obstacle::new("table", slab, *(base_from_world * centre).isometry()));
        // The arm is bolted to the table.
        world.ignore(&self.robot().links()[0].name, "table");
        let held = self.in_hand();
        for object in &scene.objects {
            let in_hand = held.as_ref().is_some_and(|(name, _)| *name == object.name);
            let known = self.state.object(&object.name).and_then(|o| o.world_from_object);
            if let Some(pose) = known.filter(|_| !in_hand && !except.contains(&&*object.name)) {
                let pose = base_from_world * pose;
                let shape = object.shape.grown(self.doubt);
                world.add(&Obstacle::of_object(&object.name, &shape, pose));
            }
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

    /// Returns the way from where the arm is to `q`, round everything in the way; `tilt` bounds the angle,
    /// rad, of what is in the hand from upright. Where something is touched already, the arm is led away from
    /// it first.
    pub fn free(&self, q: &[f64], tilt: Option<f64>, seed: u64) -> Result<Way, NoWay> {
        let world = self.obstacles(&[], self.state.opening);
        let cone = match (self.in_hand(), tilt) {
            (Some((_, tool_from_object)), Some(max_angle)) => Some(Cone {
                axis_in_flange: Unit::new_normalize(
                    (self.robot().flange_from_tool() * tool_from_object).axis(2),
                ),
                up_in_base: Unit::new_normalize(
                    self.cell.scene.world_from_base.inverse().rotation() * Vector3::z(),
                ),
                max_angle,
            }),
            _ => None,
        };
        let goals = [rrt::short_way(self.robot(), &self.q, q)];
        let robot = self.robot().clone().with_reserve(END_RESERVE, &[&self.q, &goals[0]]);
        let solver = Solver::new(&robot);
        let settings = rrt::Settings::seeded(seed);
        // An arm that is caught is told by the search what it touches.
        let out = escape::leave(&solver, &world, &self.q, cone.as_ref(), &self.budget);
        let out = out.unwrap_or_else(|| vec![self.q.clone()]);
        let start = out.last().unwrap_or(&self.q);
        let found =
            rrt::plan(&solver, &world, start, &goals, cone.as_ref(), &settings, &self.budget);
        match found {
            Ok(path) => Ok(Way { out, on: path.corners }),
            Err(error) => Err(NoWay { what: "to get there".to_owned(), why: error.into() }),
        }
    }

    /// Returns the joint path of a straight line of the tool by `by` m in the world, orientation kept.
    pub fn line(&self, by: Vector3<f64>) -> Result<Vec<Vec<f64>>, NoWay> {
        let no =
            |why| NoWay { what: format!("to move the tool by {:.0} mm", by.norm() * 1e3), why };
        let poses = straight(&self.tool_at(&self.q), by);
        self.goes_on(TRACKING * poses.len() as u64, 0).map_err(no)?;
        self.track(&self.q, &poses).map_err(|nearest| no(Why::OutOfReach { nearest }))
    }

    /// Returns a way to where the tool is at `at`, round everything in the way.
    pub fn visit(&self, at: &Pose<World, Tool>, seed: u64) -> Result<Way, NoWay> {
        let no = |why| NoWay { what: "to get there".to_owned(), why };
        self.goes_on(REACHING, 0).map_err(no)?;
        let goals = self.reach(at, &self.q).map_err(|nearest| no(Why::OutOfReach { nearest }))?;
        let world = self.obstacles(&[], self.state.opening);
        let free = goals.iter().find(|q| world.free(q));
        let goal =
            free.ok_or_else(|| no(Why::Blocked { tried: goals.len(), by: String::new() }))?;
        self.free(goal, None, seed)
    }

    /// Returns whether the arm can get at an object: between its fingers, or over it when it is too wide.
    ///
    /// # Errors
    ///
    /// How far out of reach it is.
    pub fn reachable(&self, o: &str) -> Result<(), NoWay> {
        let what = format!("to reach `{o}`");
        let origin = self.pose(o, &what)?.origin();
        let height = self.cell.scene.object(o).map_or(0.1, |object| object.shape.height());
        let mut nearest = f64::INFINITY;
        // Level grasps all round, low as for taking it and high as for pouring over it.
        for up in [0.6 * height, height + 0.12] {
            for turn in 0..8 {
                let heading =
                    origin.y.atan2(origin.x) + f64::from(turn) * std::f64::consts::FRAC_PI_4;
                let pose = side_pose(origin + Vector3::z() * up, heading, 0.0);
                self.goes_on(REACHING, 0).map_err(|why| NoWay { what: what.clone(), why })?;
                match self.reach(&pose, &self.q) {
                    Ok(_) => return Ok(()),
                    Err(shortfall) => nearest = nearest.min(shortfall),
                }
            }
        }
        Err(NoWay { what, why: Why::OutOfReach { nearest } })
    }

    /// Returns whether the limits let a dense path pass: a smooth curve through points that keep inside a joint's
    /// range may swing past its end where the arm's elbow is shifted.
    fn passes(&self, path: &[Vec<f64>]) -> bool {
        let limits = trajectory::Limits::of(self.robot());
        let Some(first) = path.first() else { return true };
        Trajectory::through_points(path, &limits)
            .is_ok_and(|timed| self.cell.limits.clear(&self.cell, timed, first).is_ok())
    }

    /// Drops a path that touches something; returns its smallest clearance otherwise.
    fn clear(world: &CollisionWorld<'_>, path: &[Vec<f64>], dropped: &mut Dropped) -> Option<f64> {
        let mut least = f64::INFINITY;
        for q in path {
            let nearest = world.clearance_or_overlap(q).expect("the path has one angle per joint");
            if nearest.distance <= 0.0 {
                let pair = format!("{} with {}", nearest.first, nearest.second);
                *dropped.blocked.entry(pair).or_default() += 1;
                return None;
            }
            least = least.min(nearest.distance);
        }
        Some(least)
    }
}

impl From<Error> for Why {
    fn from(error: Error) -> Self {
        match error {
            Error::Cancelled => Self::Stopped,
            Error::Spent { seconds } => Self::NotWithin(seconds),
            other => Self::NoPath(other.to_string()),
        }
    }
}

impl Dropped {
    fn new() -> Self {
        Self { nearest: f64::INFINITY, ..Self::default() }
    }

    fn out_of_reach(&mut self, shortfall: f64) {
        self.nearest = self.nearest.min(shortfall);
    }

    fn why(self) -> Why {
        match self.blocked.into_iter().max_by_key(|(_, count)| *count) {
            Some((by, _)) => Why::Blocked { tried: self.tried, by },
            None => Why::OutOfReach { nearest: self.nearest.min(9.99) },
        }
    }
}

/// Returns the joint position nearest to `last` that brings the tip to a pose a small way off.
///
/// # Errors
///
/// How far out of reach the pose is, m; 0 when it can only be reached by a jump.
pub fn follow(
    solver: &Solver<'_>,
    tip: &Pose<Base, Flange>,
    last: &[f64],
) -> Result<Vec<f64>, f64> {
    // A continuous motion never moves a joint further than this between two poses, rad.
    const JUMP: f64 = 0.25;
    let step = |q: &Vec<f64>| distance(q, last);
    let inside = |q: &Vec<f64>| solver.robot().outside_limits(q, -0.5 * RESERVE).is_none();
    let nearest = |found: Vec<Vec<f64>>| {
        found.into_iter().filter(inside).min_by(|a, b| step(a).total_cmp(&step(b)))
    };
    // The elbow stays where it is while it can, and moves a little when it must.
    for shift in [0.0, 0.04, -0.04, 0.1, -0.1] {
        let on_branch = nearest(solver.at_joint_3(tip, last[2] + shift, last));
        if let Some(q) = on_branch.filter(|q| step(q) <= JUMP) {
            return Ok(q);
        }
    }
    let q = solver.nearest(tip, last).map_err(|unreachable| unreachable.nearest)?;
    if step(&q) <= JUMP && inside(&q) { Ok(q) } else { Err(0.0) }
}

/// Returns the tool pose of joint positions of a cell's robot.
pub fn tool_pose(cell: &Cell, q: &[f64]) -> Pose<World, Tool> {
    let base_from_tool = cell.robot.forward_tool(q).expect("the plan has one angle per joint");
    cell.scene.world_from_base * base_from_tool
}

/// Returns poses every 5 mm along a straight line from `from` by `by` m, the start left out.
fn straight(from: &Pose<World, Tool>, by: Vector3<f64>) -> Vec<Pose<World, Tool>> {
    let n = (by.norm() / 0.005).ceil().max(1.0) as usize;
    (1..=n)
        .map(|i| Pose::from_parts(from.origin() + by * (i as f64 / n as f64), from.rotation()))
        .collect()
}

/// Returns the joint torques, N·m, that hold the arm and its gripper still at `q`.
pub fn gravity_torque(robot: &Arc<Robot>, q: &[f64]) -> Vec<f64> {
    let torques = Dynamics::new(robot, Bodies::All).gravity_torques(q);
    torques.map_or_else(|_| vec![0.0; q.len()], |torques: DVector<f64>| torques.as_slice().to_vec())
}

/// Returns the joint torques, N·m, that one more kilogram takes at `q`, `at` in the frame of the tool, m.
fn payload_torque(robot: &Arc<Robot>, q: &[f64], at: &Vector3<f64>) -> Vec<f64> {
    let (Ok(jacobian), Ok(flange)) = (robot.jacobian(q), robot.forward(q)) else {
        return vec![0.0; q.len()];
    };
    // The Jacobian is about the flange; the tool is ahead of it.
    let tool = robot.flange_from_tool();
    let ahead = flange.rotation() * (tool.origin() + tool.rotation() * at);
    (0..q.len())
        .map(|joint| {
            let turn = jacobian.fixed_view::<3, 1>(3, joint).into_owned();
            (jacobian[(2, joint)] + turn.cross(&ahead).z) * GRAVITY
        })
        .collect()
}

/// Returns the mass, kg, that takes so much more torque (N·m) at `q` than an empty hand when it hangs `at` this place in
/// the frame of the tool, m: the least-squares one over all joints.
pub fn mass_of(robot: &Arc<Robot>, q: &[f64], excess: &[f64], at: &Vector3<f64>) -> f64 {
    let column = payload_torque(robot, q, at);
    let along: f64 = column.iter().zip(excess).map(|(c, e)| c * e).sum();
    let norm: f64 = column.iter().map(|c| c * c).sum();
    if norm > 1e-9 { along / norm } else { 0.0 }
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
