//! RRT-Connect: a collision-free joint path from a configuration to one of several goals.
//!
//! One tree grows from the start and one from the goals until they touch. The path is then shortcut and
//! every edge certified (see [`CollisionWorld::certify`]); one that is not is searched again by itself.
//! It is a list of corners without time; [`super::trajectory`] rounds and times it. All chance comes from
//! the seed.
//!
//! Continuous joints turn the short way: a goal is reached up to whole turns of these.
//!
//! Source: Kuffner and LaValle, "RRT-Connect", ICRA 2000.

use std::f64::consts::PI;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::budget::Budget;
use super::collision::CollisionWorld;
pub use super::cone::Cone;
use super::error::Error;
use super::fault::NoWay;
use super::growth::{Tree, beside};
use super::ik::{Solver, wrap};
use super::polyline::{l2, length, mix, mix_into, point_at};
use super::robot::{Motion, Robot};

/// Distance that is kept beyond the margin where the ends of a path allow it, m. Chosen.
const ROOM: f64 = 0.003;
/// A straight motion that takes more looks than this is not tried: it is no motion of an arm. Chosen: the
/// farthest motion of the Gen3 takes some 1500, and the finest search looks 16 times as often.
const LONGEST_EDGE: f64 = 200_000.0;
/// A step that is blocked is tried again this much shorter, while it is longer than [`SHORTEST`]; shares of the range.
const SHORTER: f64 = 0.35;
const SHORTEST: f64 = 0.05;
/// A tree that could not grow to so many samples, but for those between, is stuck.
const STUCK: usize = 20;
/// How often the stretches that graze an obstacle are searched again, each time so much more finely.
const MENDS: usize = 4;
/// Stretches searched again in one path before all of it is: each may leave new ones behind.
const MOST_MENDS: usize = 40;
const FINER: f64 = 0.4;
/// What bringing a sample into the cone costs, in units of [`Budget`].
const PROJECTING: u64 = 200;

/// What may be chosen about a search.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Seed of all chance.
    pub seed: u64,
    /// How many samples are drawn before giving up.
    pub max_samples: usize,
    /// Longest step of a tree, rad (Euclidean over the joints).
    pub range: f64,
    /// Farthest any point of the robot may move between two checks while searching, m.
    pub resolution: f64,
    /// How many shortcuts are tried.
    pub shortcuts: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { seed: 0, max_samples: 20_000, range: 1.0, resolution: 0.03, shortcuts: 120 }
    }
}

impl Settings {
    /// Returns the usual settings with another seed.
    pub fn seeded(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }
}

/// A path, and what it took to find it.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Corners, start first, rad. Straight joint motions lead from each to the next.
    pub corners: Vec<Vec<f64>>,
    /// Which goal it leads to.
    pub goal: usize,
    /// Samples drawn; 0 if the straight motion was free.
    pub samples: usize,
    /// Configurations checked for collision.
    pub checks: usize,
    /// Length before shortcutting, rad (Euclidean over the joints).
    pub raw_length: f64,
}

impl Path {
    /// Returns the length, rad (Euclidean over the joints).
    pub fn length(&self) -> f64 {
        length(&self.corners)
    }
}

/// Finds a path from `start` to any of `goals`, inside the joint limits, free of collision and, if a
/// cone is given, inside it all the way.
///
/// # Errors
///
/// [`Error::WrongLength`], [`Error::NotFinite`]; [`Error::Limit`] and [`Error::Collision`] for a start, or
/// for goals of which none is possible; [`Error::NoPath`] when the samples are used up; [`Error::Spent`] and
/// [`Error::Cancelled`] when the budget ends it.
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
    let cost = world.cost();
    check_end(robot, world, cone, start, "start")?;
    let mut usable = Vec::new();
    let mut refused = None;
    for (index, goal) in goals.iter().enumerate() {
        budget.spend(cost)?;
        robot.check(goal)?;
        let goal = short_way(robot, start, goal);
        match check_end(robot, world, cone, &goal, "goal") {
            Ok(()) => usable.push((index, goal)),
            Err(error) => refused = Some(error),
        }
    }
    if usable.is_empty() {
        return Err(refused.unwrap_or(Error::NoGoal));
    }
    usable.sort_by(|a, b| l2(&a.1, start).total_cmp(&l2(&b.1, start)));

    // While searching, more room is asked for where both ends have it: a path that grazes an obstacle is
    // slow to certify and leaves no room to round its corners.
    let room = |q: &[f64]| world.distance(q) - world.margin();
    let mut rooms = Vec::with_capacity(usable.len());
    for (_, goal) in &usable {
        budget.spend(cost)?;
        rooms.push(room(goal));
    }
    let goal_room = rooms.iter().copied().fold(0.0, f64::max);
    let pad = (0.5 * room(start).min(goal_room)).clamp(0.0, ROOM);
    // The roomiest goal has twice the room, so one is left; were none, the search would have nowhere to go.
    let mut rooms = rooms.into_iter();
    usable.retain(|_| rooms.next().is_some_and(|room| room > pad || goal_room <= 0.0));
    let padded = world.padded(pad);

    // A path that passes the sampled checks but not the certificate is searched again more finely.
    let mut settings = *settings;
    let mut checks = 0;
    let mut samples = 0;
    for _ in 0..4 {
        let mut search = Search {
            solver,
            world: &padded,
            cone,
            settings,
            checks,
            cost,
            budget,
            between: Vec::new(),
        };
        let (corners, goal) = search.run(start, &usable, &mut samples)?;
        let raw_length = length(&corners);
        let corners = search.shorten(corners)?;
        let corners = search.mended(world, corners, &mut samples)?;
        checks = search.checks;
        if let Some(corners) = corners {
            return Ok(Path { corners, goal, samples, checks, raw_length });
        }
        settings.resolution *= FINER;
        settings.seed = settings.seed.wrapping_add(0x9e37_79b9);
    }
    Err(Error::NoPath { samples, why: NoWay::Grazes })
}

struct Search<'s> {
    solver: &'s Solver<'s>,
    world: &'s CollisionWorld<'s>,
    cone: Option<&'s Cone>,
    settings: Settings,
    checks: usize,
    /// What one check costs.
    cost: u64,
    budget: &'s Budget<'s>,
    /// Memory for configurations on an edge.
    between: Vec<f64>,
}

enum Extended {
    Reached(usize),
    Advanced(usize),
    Trapped,
}

impl Search<'_> {
    fn run(
        &mut self,
        start: &[f64],
        goals: &[(usize, Vec<f64>)],
        samples: &mut usize,
    ) -> Result<(Vec<Vec<f64>>, usize), Error> {
        for (index, goal) in goals {
            if self.edge_free(start, goal)? {
                return Ok((vec![start.to_vec(), goal.clone()], *index));
            }
        }
        let robot = self.solver.robot();
        let mut random = StdRng::seed_from_u64(self.settings.seed);
        let mut trees =
            [Tree::rooted([&start.to_vec()]), Tree::rooted(goals.iter().map(|(_, q)| q))];
        let mut active = 0;
        // Samples to which each tree could not grow, halved whenever it could.
        let mut stuck = [0_usize; 2];
        for _ in 0..self.settings.max_samples {
            *samples += 1;
            let is_stuck = stuck[active] > STUCK && random.random_bool(0.5);
            let sample = if is_stuck {
                beside(robot, &trees[active], &mut random)
            } else {
                self.sample(robot, start, &mut random)?
            };
            // A tree in a narrow place grows by short steps or not at all.
            let mut step = 1.0;
            let grown = loop {
                match self.extend(&mut trees[active], &sample, step)? {
                    Extended::Trapped if step > SHORTEST => step *= SHORTER,
                    Extended::Trapped => break None,
                    Extended::Reached(node) | Extended::Advanced(node) => break Some(node),
                }
            };
            let Some(grown) = grown else {
                stuck[active] += 1;
                active = 1 - active;
                continue;
            };
            stuck[active] /= 2;
            let target = trees[active].node(grown).to_vec();
            let met = self.connect(&mut trees[1 - active], &target)?;
            if let Some(met) = met {
                let (near, far) = if active == 0 { (grown, met) } else { (met, grown) };
                let mut way = trees[0].trace(near);
                way.reverse();
                let tail = trees[1].trace(far);
                let end = tail.last().expect("a way holds at least its root");
                let goal = goals
                    .iter()
                    .find(|(_, q)| q == end)
                    .expect("the far tree is rooted in the goals")
                    .0;
                // Where the trees meet, both hold the same configuration.
                way.extend(tail.into_iter().skip(1));
                return Ok((way, goal));
            }
            active = 1 - active;
        }
        Err(Error::NoPath {
            samples: *samples,
            why: NoWay::NeverMet { start: trees[0].len(), goal: trees[1].len() },
        })
    }

    /// Grows a tree towards a configuration until it is reached or nothing leads nearer.
    ///
    /// Every step but a bent one leads a whole `range` nearer, and a bent one a tenth of it.
    fn connect(&mut self, tree: &mut Tree, target: &[f64]) -> Result<Option<usize>, Error> {
        const STEPS: usize = 1000;
        for _ in 0..STEPS {
            match self.extend(tree, target, 1.0)? {
                Extended::Reached(node) => return Ok(Some(node)),
                Extended::Advanced(_) => {}
                Extended::Trapped => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Draws a configuration: in the limits, and half a turn about the start where there are none.
    fn sample(&self, robot: &Robot, start: &[f64], random: &mut StdRng) -> Result<Vec<f64>, Error> {
        let q: Vec<f64> = robot
            .joints()
            .iter()
            .zip(start)
            .map(|(joint, start)| {
                let (low, high) = (joint.lower.max(start - PI), joint.upper.min(start + PI));
                if low < high { random.random_range(low..high) } else { low }
            })
            .collect();
        let Some(cone) = self.cone else { return Ok(q) };
        self.budget.spend(PROJECTING)?;
        Ok(cone.project(self.solver, &q).unwrap_or(q))
    }

    fn extend(&mut self, tree: &mut Tree, target: &[f64], share: f64) -> Result<Extended, Error> {
        // A node is passed in about the time a tenth of a pair of solids is looked at.
        self.budget.spend(1 + tree.len() as u64 / 10)?;
        let from = tree.nearest(target);
        let gap = l2(tree.node(from), target);
        if gap < 1e-9 {
            return Ok(Extended::Reached(from));
        }
        // A joint motion of that length leaves a narrow cone less often when it is short.
        let range =
            if self.cone.is_some() { self.settings.range.min(0.4) } else { self.settings.range };
        let range = share * range;
        let reaches = gap <= range;
        let mut next =
            if reaches { target.to_vec() } else { mix(tree.node(from), target, range / gap) };
        let mut bent = false;
        if let Some(cone) = self.cone
            && !cone.holds(self.solver.robot(), &next)
        {
            self.budget.spend(PROJECTING)?;
            let Some(projected) = cone.project(self.solver, &next) else {
                return Ok(Extended::Trapped);
            };
            // Another branch of the arm is no continuation, and a step back is no progress.
            if l2(&projected, &next) > range || l2(&projected, target) > gap - 0.1 * range {
                return Ok(Extended::Trapped);
            }
            next = projected;
            bent = true;
        }
        if !self.edge_free(tree.node(from), &next)? {
            return Ok(Extended::Trapped);
        }
        let node = tree.push(&next, from);
        Ok(if reaches && !bent { Extended::Reached(node) } else { Extended::Advanced(node) })
    }

    /// Checks the straight motion, its end first and then ever more finely, so that a collision anywhere
    /// is met early.
    fn edge_free(&mut self, from: &[f64], to: &[f64]) -> Result<bool, Error> {
        let moved = self.world.displacement(from, to);
        let steps = (moved / self.settings.resolution).ceil().max(1.0);
        if steps.is_nan() || steps > LONGEST_EDGE || !self.free(to)? {
            return Ok(false);
        }
        let steps = steps as usize;
        let mut between = std::mem::take(&mut self.between);
        between.resize(from.len(), 0.0);
        let is_free = self.inside_free(from, to, steps, &mut between);
        self.between = between;
        is_free
    }

    fn inside_free(
        &mut self,
        from: &[f64],
        to: &[f64],
        steps: usize,
        between: &mut [f64],
    ) -> Result<bool, Error> {
        // Strides halve: with stride s the odd multiples of s are new.
        let mut stride = steps.next_power_of_two() / 2;
        while stride > 0 {
            let mut k = stride;
            while k < steps {
                mix_into(between, from, to, k as f64 / steps as f64);
                if !self.free(between)? {
                    return Ok(false);
                }
                k += 2 * stride;
            }
            stride /= 2;
        }
        Ok(true)
    }

    fn free(&mut self, q: &[f64]) -> Result<bool, Error> {
        self.budget.spend(self.cost)?;
        self.checks += 1;
        let holds = self.cone.is_none_or(|cone| cone.holds(self.solver.robot(), q));
        Ok(holds && self.world.free(q))
    }

    /// Certifies every edge in `world`, and searches again, more finely, along those that graze something between two
    /// checks; `None` where that does not help.
    fn mended(
        &mut self,
        world: &CollisionWorld<'_>,
        corners: Vec<Vec<f64>>,
        samples: &mut usize,
    ) -> Result<Option<Vec<Vec<f64>>>, Error> {
        let settings = self.settings;
        let mut path = corners;
        // Edges from here on are still to be certified.
        let mut at = 0;
        let mut mends = 0;
        while at + 1 < path.len() {
            if world.certify_within(&path[at], &path[at + 1], self.budget)? {
                at += 1;
                continue;
            }
            if mends == MOST_MENDS {
                self.settings = settings;
                return Ok(None);
            }
            mends += 1;
            self.settings.resolution =
                settings.resolution * FINER.powf(1.0 + (mends % MENDS) as f64);
            self.settings.seed = self.settings.seed.wrapping_add(0x51_7cc1);
            let (from, to) = (path[at].clone(), path[at + 1].clone());
            let way = match self.run(&from, &[(0, to)], samples) {
                Ok((way, _)) => self.shorten(way)?,
                Err(Error::NoPath { .. }) => break,
                Err(other) => return Err(other),
            };
            path.splice(at..=at + 1, way);
        }
        self.settings = settings;
        Ok((at + 1 >= path.len()).then_some(path))
    }

    /// Replaces stretches of the path by straight motions where these are free.
    fn shorten(&mut self, mut corners: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Error> {
        let mut random = StdRng::seed_from_u64(self.settings.seed ^ 0x51de);
        // From the start, as far as one can see: this alone removes most corners.
        let mut at = 0;
        while at + 2 < corners.len() {
            for far in (at + 2..corners.len()).rev() {
                if self.edge_free(&corners[at], &corners[far])? {
                    corners.drain(at + 1..far);
                    break;
                }
            }
            at += 1;
        }
        for _ in 0..self.settings.shortcuts {
            if corners.len() < 3 {
                break;
            }
            let total = length(&corners);
            let (a, b) = (random.random_range(0.0..total), random.random_range(0.0..total));
            let (from_edge, from) = point_at(&corners, a.min(b));
            let (to_edge, to) = point_at(&corners, a.max(b));
            if from_edge == to_edge {
                continue;
            }
            let old = l2(&from, &corners[from_edge + 1])
                + length(&corners[from_edge + 1..=to_edge])
                + l2(&corners[to_edge], &to);
            if l2(&from, &to) < old - 1e-6 && self.edge_free(&from, &to)? {
                corners.splice(from_edge + 1..=to_edge, [from, to]);
            }
        }
        // Shortcuts leave short edges behind, which cost time at their corners.
        let mut at = 1;
        while at + 1 < corners.len() {
            if self.edge_free(&corners[at - 1], &corners[at + 1])? {
                corners.remove(at);
            } else {
                at += 1;
            }
        }
        Ok(corners)
    }
}

/// Checks that a path may begin or end at `q`.
fn check_end(
    robot: &Robot,
    world: &CollisionWorld<'_>,
    cone: Option<&Cone>,
    q: &[f64],
    which: &str,
) -> Result<(), Error> {
    robot.check(q)?;
    if let Some(at) = robot.outside_limits(q, 1e-9) {
        let joint = &robot.joints()[at];
        return Err(Error::Limit {
            joint: joint.name.clone(),
            value: q[at],
            lower: joint.lower,
            upper: joint.upper,
        });
    }
    if !world.free(q) {
        let clearance = world.clearance(q)?;
        return Err(Error::Collision {
            which: which.into(),
            first: clearance.first,
            second: clearance.second,
            depth: world.margin() - clearance.distance,
        });
    }
    if let Some(cone) = cone
        && !cone.holds(robot, q)
    {
        return Err(Error::Tilted {
            which: which.into(),
            angle: cone.angle(robot, q),
            max_angle: cone.max_angle,
        });
    }
    Ok(())
}

/// Returns the goal with every continuous joint turned the short way from `start`.
pub fn short_way(robot: &Robot, start: &[f64], goal: &[f64]) -> Vec<f64> {
    let mut out = goal.to_vec();
    for (i, joint) in robot.joints().iter().enumerate() {
        if joint.continuous && robot.links()[joint.link].joint.motion == Motion::Turn {
            out[i] = start[i] + wrap(goal[i] - start[i]);
        }
    }
    out
}
