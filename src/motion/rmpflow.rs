//! Reactive motion: at every instant the joint acceleration that suits a target, obstacles and the arm's own limits.
//!
//! No path is searched. Each policy of `rmp` is carried to the joints by the Jacobian of what it speaks of, and all
//! are resolved at once; obstacles may move meanwhile. Such a motion can come to rest before its target where obstacles
//! enclose it: that is said. What it ran through is simplified and certified here as a search's path is, and timed
//! elsewhere; it bounds no jerk of its own.
//!
//! The robot is a set of balls inside its solids, so that what it keeps from touching is not quite all of it: the
//! certificate has the last word.
//!
//! Source: Cheng et al., "RMPflow: a geometric framework for generation of multitask motion policies", 2018: pullback,
//! pushforward and resolve.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::body::Body;
use super::budget::Budget;
use super::collision::{CollisionWorld, Obstacle};
use super::cone::Cone;
use super::error::Error;
use super::fault::NoWay;
use super::frames::{Frame, Frames};
use super::ik::Solver;
use super::outward::outward;
use super::polyline::{l2, length, mix};
use super::pullback::Gathered;
use super::rmp::{self, Pull};
use super::robot::Robot;
use super::rrt::{self, Path, Settings, check_end, goal_name, short_way};
use super::spheres::inner;

/// Time of a step, s: the longest at which the shipped gains are used.
pub const STEP: f64 = 1.0 / 300.0;
/// The highest joint acceleration that is asked for, rad/s² (Euclidean over the joints).
const MOST: f64 = 50.0;
/// A motion that has not arrived after so long is given up, s: of the public problems the middle one takes 4 to 6 s.
const LONGEST: f64 = 20.0;
/// A motion slower than this for [`RESTING`] s has come to rest, rad/s.
const STILL: f64 = 2e-3;
const RESTING: f64 = 0.3;
/// Near enough for the rest of the way to be one straight motion, rad.
const ARRIVED: f64 = 0.02;
/// Near enough to a corner on the way to go on to the next, rad.
const PASSED: f64 = 0.3;
/// How far apart the stations are at which the joints are led along a searched path, rad. The tip is pulled far harder than the
/// joints, so an arm that can have its tip at a goal with the elbow another way rests there for good. Chosen in a replay of the
/// policies beside this program: of 25 random motions of the `UR5e` among nothing 9 arrive by themselves and along corners, all
/// with 0.25 and with 0.5; along one of three corners it came to rest with 0.5.
const STATION: f64 = 0.25;
/// How far what was run through may be left for fewer corners, rad: on the public problems motions take twice as long with
/// 0.01 when they are timed, and a third longer with 0.05.
const BESIDE: f64 = 0.15;

/// A ball of the robot and what it keeps away from.
#[derive(Debug, Clone)]
struct Point {
    node: usize,
    /// In the node's frame, m.
    centre: Vector3<f64>,
    radius: f64,
    watched: Vec<u32>,
}

/// Where a motion is to go.
#[derive(Debug, Clone)]
pub struct Target {
    /// Where the tip is to be, in the base.
    pub tip: Isometry3<f64>,
    /// Joint positions that are preferred among those that bring it there, rad.
    pub posture: Vec<f64>,
    /// A direction of the tip that is to stay near one in the base, as of a vessel carried upright.
    pub upright: Option<Cone>,
}

/// Where the joints are and how fast they move.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// rad.
    pub q: Vec<f64>,
    /// rad/s.
    pub dq: Vec<f64>,
}

/// A robot among obstacles, moved by policies.
pub struct Policy<'w> {
    robot: &'w Robot,
    frames: Frames,
    points: Vec<Point>,
    /// What is to be kept away from, by name, and how fast it moves, m/s.
    things: Vec<(String, Body, Vector3<f64>)>,
    /// The frame that the tip is fixed to, and where it stands there.
    tip: (Option<usize>, Frame),
    work: Gathered,
    /// The least distance between a ball and what it keeps away from in the last step, m.
    nearest: f64,
}

impl<'w> Policy<'w> {
    /// Takes over the robot and the obstacles of a collision world. Obstacles rest until [`Self::moves`] says otherwise.
    pub fn new(world: &CollisionWorld<'w>) -> Self {
        let frames = world.frames().clone();
        let mut points = Vec::new();
        for (link, bodies, watched) in world.watched_parts() {
            let (Some(node), node_from_link) = frames.links[link] else { continue };
            let frame = Frame::of(&node_from_link);
            for body in bodies {
                for (centre, radius) in inner(&body.moved(&frame)) {
                    points.push(Point { node, centre, radius, watched: watched.clone() });
                }
            }
        }
        let resting = |(name, body): &(String, Body)| (name.clone(), *body, Vector3::zeros());
        let things = world.bodies().iter().map(resting).collect();
        let robot = world.robot();
        let (node, node_from_tip) = frames.links[robot.tip];
        let tip = (node, Frame::of(&node_from_tip));
        let (work, nearest) = (Gathered::new(STEP), f64::INFINITY);
        Self { robot, frames, points, things, tip, work, nearest }
    }

    /// The robot that is moved.
    pub(super) fn robot(&self) -> &'w Robot {
        self.robot
    }

    /// Returns the least distance between a ball of the robot and what it keeps away from, as it was in the last step, m; no less
    /// than the true one, infinite where nothing was within half a metre.
    pub fn nearest(&self) -> f64 {
        self.nearest
    }

    /// Says how fast an obstacle moves from now on, m/s; it goes on moving with every step.
    pub fn moves(&mut self, obstacle: &str, velocity: &Vector3<f64>) {
        for (name, _, rate) in &mut self.things {
            if name == obstacle {
                *rate = *velocity;
            }
        }
    }

    /// Puts an obstacle somewhere else, as a camera sees it.
    pub fn place(&mut self, obstacle: &Obstacle) {
        for (name, body, _) in &mut self.things {
            if *name == obstacle.name {
                *body = Body::new(&obstacle.solid);
            }
        }
    }

    /// As [`Self::place`], of an obstacle of one or more parts that share a name, always given in the same order; what was not
    /// there before is kept away from by all of the robot.
    pub fn place_parts(&mut self, parts: &[Obstacle]) {
        for (k, part) in parts.iter().enumerate() {
            let body = Body::new(&part.solid);
            let mut named = self.things.iter_mut().filter(|(name, ..)| *name == part.name);
            if let Some((_, known, _)) = named.nth(k) {
                *known = body;
                continue;
            }
            for point in &mut self.points {
                point.watched.push(self.things.len() as u32);
            }
            self.things.push((part.name.clone(), body, Vector3::zeros()));
        }
    }

    /// Moves the joints on by [`STEP`] s.
    ///
    /// # Errors
    ///
    /// [`Error::WrongLength`] and [`Error::NotFinite`] for joints or a posture that are none of this robot.
    pub fn step(&mut self, at: &mut Moving, target: &Target) -> Result<(), Error> {
        let pull = self.pull(at, target)?;
        let norm = pull.iter().map(|a| a * a).sum::<f64>().sqrt();
        let share = if norm > MOST { MOST / norm } else { 1.0 };
        for (i, joint) in self.robot.joints().iter().enumerate() {
            let rate = at.dq[i] + STEP * share * pull[i];
            at.dq[i] = rate.clamp(-joint.velocity, joint.velocity);
            at.q[i] += STEP * at.dq[i];
        }
        self.carry_on();
        Ok(())
    }

    /// Moves obstacles on by [`STEP`] s.
    pub(super) fn carry_on(&mut self) {
        for (_, body, rate) in &mut self.things {
            let mut shift = Frame::base();
            shift.origin = *rate * STEP;
            *body = body.moved(&shift);
        }
    }

    /// Returns the acceleration of each joint that suits all, rad/s².
    pub(super) fn pull(&mut self, at: &Moving, target: &Target) -> Result<Vec<f64>, Error> {
        self.robot.check(&at.q)?;
        self.robot.check(&at.dq)?;
        self.robot.check(&target.posture)?;
        let mut work = std::mem::take(&mut self.work);
        work.place(&self.frames, &at.q, &at.dq);
        self.nearest = f64::INFINITY;
        for point in &self.points {
            self.nearest = self.nearest.min(self.keep_away(point, &mut work));
        }
        work.gather();
        self.towards(target, &mut work);
        self.within_limits(at, target, &mut work);
        let pull = work.resolved().to_vec();
        self.work = work;
        Ok(pull)
    }

    /// What is near a ball pushes it away; returns the least distance to it, m.
    fn keep_away(&self, point: &Point, work: &mut Gathered) -> f64 {
        let mut nearest = f64::INFINITY;
        let centre = work.placed[point.node].point(&point.centre);
        let (velocity, acceleration) = work.motion(point.node, &centre);
        for &thing in &point.watched {
            let (_, body, rate) = &self.things[thing as usize];
            if body.distance_to_ball(&centre, point.radius) > rmp::FELT {
                continue;
            }
            let seen = outward(body, &centre);
            let x = seen.distance - point.radius;
            if x > rmp::FELT {
                continue;
            }
            nearest = nearest.min(x);
            let passing = velocity - rate;
            let (dx, along) = (seen.away.dot(&passing), seen.along.dot(&passing));
            let bent = (passing.norm_squared() - dx * dx - along * along).max(0.0) * seen.bend;
            let pull = rmp::obstacle(x, dx);
            let lever = centre.cross(&seen.away);
            let row =
                Vector6::new(seen.away.x, seen.away.y, seen.away.z, lever.x, lever.y, lever.z);
            work.add_on(point.node, &row, &pull, dx, seen.away.dot(&acceleration) + bent);
        }
        nearest
    }

    /// The target pulls the tip's point and its axes.
    fn towards(&self, target: &Target, work: &mut Gathered) {
        let (Some(node), tip_in_node) = self.tip else { return };
        let tip = work.placed[node].then(&tip_in_node);
        let goal = Frame::of(&target.tip);
        let to = goal.origin - tip.origin;
        work.add_point(node, &tip.origin, &rmp::target(&to));
        for (own, other) in [(tip.x, goal.x), (tip.y, goal.y), (tip.z, goal.z)] {
            work.add_axis(node, &own, &rmp::axis(&(other - own), to.norm()));
        }
        if let Some(cone) = &target.upright {
            let own = tip.direction(&cone.axis_in_flange);
            // As much as an axis matters at its target.
            work.add_axis(node, &own, &rmp::axis(&(cone.up_in_base.into_inner() - own), 0.0));
        }
    }

    /// Posture, damping, the ends of ranges and the highest speeds.
    fn within_limits(&self, at: &Moving, target: &Target, work: &mut Gathered) {
        let gap = l2(&target.posture, &at.q);
        let share = if gap > rmp::POSTURE_REACH { rmp::POSTURE_REACH / gap } else { 1.0 };
        let slowed = rmp::damping(at.dq.iter().map(|v| v * v).sum::<f64>().sqrt());
        for (i, joint) in self.robot.joints().iter().enumerate() {
            let (q, dq) = (at.q[i], at.dq[i]);
            let mut add = |pull: &Pull, slope: f64| work.add_joint(i, slope, pull, slope * dq);
            let push = rmp::POSTURE.push * share * (target.posture[i] - q);
            add(&Pull { push, ..rmp::POSTURE }, 1.0);
            add(&slowed, 1.0);
            let range = joint.upper - joint.lower;
            if range.is_finite() && range > 0.0 {
                add(&rmp::limit((q - joint.lower) / range, dq / range), 1.0 / range);
                add(&rmp::limit((joint.upper - q) / range, -dq / range), -1.0 / range);
            }
            if let Some(cap) = rmp::cap(dq, joint.velocity) {
                add(&cap, 1.0);
            }
        }
    }
}

/// Runs the policies from `start` to the first of `goals` that is possible, and returns the way as a path of corners: free of
/// collision everywhere, inside the joint limits and, if a cone is given, inside it. Where the motion comes to rest on the
/// way, or touches something, it is led along a path that is searched; where that does not help either, the searched path is
/// returned, with why.
///
/// # Errors
///
/// As [`super::rrt::plan`].
pub fn plan(
    solver: &Solver<'_>,
    world: &CollisionWorld<'_>,
    start: &[f64],
    goals: &[Vec<f64>],
    cone: Option<&Cone>,
    settings: &Settings,
    budget: &Budget<'_>,
) -> Result<Path, Error> {
    let robot = solver.robot();
    check_end(robot, world, cone, start, "start")?;
    let running = Running { world, start, cone, budget };
    let search = |goal: &[Vec<f64>]| rrt::plan(solver, world, start, goal, cone, settings, budget);
    let mut refused = Error::NoGoal;
    for (index, goal) in goals.iter().enumerate() {
        robot.check(goal)?;
        let goal = [short_way(robot, start, goal)];
        let name = goal_name(index, goals.len());
        let reached = check_end(robot, world, cone, &goal[0], &name)
            .and_then(|()| running.to_or_led(&goal, &search));
        match reached {
            Ok(path) => return Ok(Path { goal: index, ..path }),
            Err(error @ (Error::Cancelled | Error::Spent { .. })) => return Err(error),
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

/// Divides the edges of a path evenly into stretches no longer than [`STATION`]; returns where these end.
fn stations(corners: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut ends = Vec::new();
    for edge in corners.windows(2) {
        let n = (l2(&edge[0], &edge[1]) / STATION).ceil().max(1.0) as usize;
        ends.extend((1..=n).map(|k| mix(&edge[0], &edge[1], k as f64 / n as f64)));
    }
    ends
}

/// One motion that is being run.
struct Running<'r> {
    world: &'r CollisionWorld<'r>,
    start: &'r [f64],
    cone: Option<&'r Cone>,
    budget: &'r Budget<'r>,
}

/// Searches for a path to any of some goals.
type Search<'s> = dyn Fn(&[Vec<f64>]) -> Result<Path, Error> + 's;

impl Running<'_> {
    /// Runs to a goal; where that does not arrive, along a path that is searched, from corner to corner and at last from station
    /// to station; where that does not either, returns that path.
    fn to_or_led(&self, goal: &[Vec<f64>], search: &Search<'_>) -> Result<Path, Error> {
        let mut why = match self.to(goal) {
            Err(Error::NoPath { why, .. }) => why,
            ended => return ended,
        };
        let searched = search(goal)?;
        // Along a straight path there is no corner but the goal, and to that it would run as before.
        let by_corners = (searched.corners.len() > 2).then(|| searched.corners[1..].to_vec());
        for stops in by_corners.into_iter().chain([stations(&searched.corners)]) {
            match self.to(&stops) {
                Err(Error::NoPath { why: at_last, .. }) => why = at_last,
                Err(Error::Spent { seconds }) => {
                    why = NoWay::OnItsWay { seconds };
                    break;
                }
                arrived => return arrived,
            }
        }
        Ok(Path { policies_failed: Some(why), ..searched })
    }

    /// Runs from goal to goal and returns the way to the last.
    fn to(&self, goals: &[Vec<f64>]) -> Result<Path, Error> {
        let robot = self.world.robot();
        let mut policy = Policy::new(self.world);
        let mut at = Moving { q: self.start.to_vec(), dq: vec![0.0; self.start.len()] };
        let mut way = vec![self.start.to_vec()];
        for (k, goal) in goals.iter().enumerate() {
            let (tip, upright) = (robot.forward_unchecked(goal), self.cone.copied());
            let target = Target { tip, posture: goal.clone(), upright };
            let is_last = k + 1 == goals.len();
            let near = if is_last { ARRIVED } else { PASSED };
            let (mut resting, mut time) = (0.0, 0.0);
            while l2(&at.q, goal) > near {
                self.budget.spend(self.world.cost())?;
                policy.step(&mut at, &target)?;
                way.push(at.q.clone());
                time += STEP;
                let is_still = at.dq.iter().all(|v| v.abs() < STILL);
                resting = if is_still { resting + STEP } else { 0.0 };
                if resting > RESTING || time > LONGEST {
                    // What is left may be free all the same: the balance is one of pushes, not of touches.
                    if self.is_free(&at.q, goal)? {
                        break;
                    }
                    let gap = robot.forward_unchecked(&at.q).translation.vector
                        - target.tip.translation.vector;
                    let joints_deg = l2(&at.q, goal).to_degrees() as u32;
                    let why = NoWay::CameToRest { left_mm: (gap.norm() * 1e3) as u32, joints_deg };
                    return Err(Error::NoPath { samples: way.len(), why });
                }
            }
            if is_last {
                way.push(goal.clone());
            }
        }
        let corners = self.straightened(&way)?;
        let (samples, raw_length) = (way.len(), length(&way));
        Ok(Path { corners, goal: 0, samples, checks: samples, raw_length, policies_failed: None })
    }

    /// Whether the straight motion is certainly free, and inside the cone where there is one.
    fn is_free(&self, from: &[f64], to: &[f64]) -> Result<bool, Error> {
        let inside = self.cone.is_none_or(|cone| stays_inside(cone, self.world.robot(), from, to));
        Ok(inside && self.world.certify_within(from, to, self.budget)?)
    }

    /// Leaves out of a way what lies within [`BESIDE`] of straight motions that are certainly free.
    ///
    /// Source: Douglas and Peucker, 1973, each straight motion certified besides.
    fn straightened(&self, way: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, Error> {
        let mut corners = vec![way[0].clone()];
        let mut open = vec![(0, way.len() - 1)];
        while let Some((from, to)) = open.pop() {
            let off = |k: usize| off_line(&way[from], &way[to], &way[k]);
            let farthest = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b)));
            let is_straight = farthest.is_none_or(|k| off(k) < BESIDE);
            if is_straight && self.is_free(&way[from], &way[to])? {
                corners.push(way[to].clone());
            } else if let Some(middle) = farthest {
                open.push((middle, to));
                open.push((from, middle));
            } else {
                return Err(Error::NoPath { samples: way.len(), why: NoWay::Grazes });
            }
        }
        Ok(corners)
    }
}

/// How far a point is from the straight motion between two others, rad.
fn off_line(from: &[f64], to: &[f64], point: &[f64]) -> f64 {
    let square: f64 = from.iter().zip(to).map(|(a, b)| (b - a) * (b - a)).sum();
    let along: f64 = from.iter().zip(to).zip(point).map(|((a, b), p)| (b - a) * (p - a)).sum();
    let t = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
    l2(&mix(from, to, t), point)
}

/// Whether a straight motion as short as those of a way that was run through stays inside a cone.
fn stays_inside(cone: &Cone, robot: &Robot, from: &[f64], to: &[f64]) -> bool {
    /// Angle between two looks, rad.
    const LOOK: f64 = 0.02;
    let n = (l2(from, to) / LOOK).ceil().max(1.0) as usize;
    (0..=n).all(|k| {
        let q = mix(from, to, k as f64 / n as f64);
        cone.holds(robot, &q)
    })
}

#[cfg(test)]
mod tests {
    use super::super::solid::Solid;
    use super::*;

    /// It was thrown away, and nothing was found.
    #[test]
    fn a_searched_path_is_kept_where_policies_do_not_arrive_along_it() {
        let robot = Robot::gen3();
        let start = robot.pose("home").unwrap();
        let mut goal = start.to_vec();
        goal[0] += 2.0;
        let middle = robot.forward_unchecked(&mix(start, &goal, 0.5)).translation.vector;
        let turn = Isometry3::rotation(Vector3::z() * middle.y.atan2(middle.x));
        let half = Vector3::new(2.0, 0.02, 2.0);
        let wall = turn * Isometry3::translation(2.2, 0.0, 0.0);
        let wall = Obstacle::new("wall", Solid::Cuboid { half }, wall);
        let world = CollisionWorld::new(&robot).with(&[wall]);
        let budget = Budget::new(|| false);
        let running = Running { world: &world, start, cone: None, budget: &budget };
        // There is no way through the wall, so this is none; what leads the policies is not looked at again.
        let searched = Path {
            corners: vec![start.to_vec(), goal.clone()],
            goal: 0,
            samples: 1,
            checks: 1,
            raw_length: 2.0,
            policies_failed: None,
        };
        let path = running.to_or_led(&[goal], &|_| Ok(searched.clone())).unwrap();
        assert!(path.policies_failed.is_some());
        assert_eq!(Path { policies_failed: None, ..path }, searched);
    }
}
