//! RRT-Connect: two trees of free motions, one from the start and one from the goals, that grow until they touch.
//!
//! The smaller tree grows towards a sample, or by a step that its tip leads; from where it comes to it goes on straight to the other
//! tree, as far as that is free. A node that was blocked listens to near samples only. A tree that hardly grows takes shorter steps, and draws most
//! of its samples beside itself. All chance comes from the seed.
//!
//! Source: Kuffner and LaValle, "RRT-Connect", ICRA 2000; balanced as in Kuffner and LaValle, "An efficient approach to
//! path planning using balanced bidirectional RRT search", CMU-RI-TR-05-34, 2005; Jaillet, Yershova, LaValle and Siméon,
//! "Adaptive tuning of the sampling domain for dynamic-domain RRTs", IROS 2005.

use std::f64::consts::PI;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::error::Error;
use super::fault::NoWay;
use super::growth::{Tree, beside};
use super::ik::Solver;
use super::led::led;
use super::motions::Motions;
use super::polyline::{l2, mixed};
use super::robot::{JointLimits, Robot};

/// A step that is blocked is tried again this much shorter, while it is longer than [`SHORTEST`]; shares of the range.
const SHORTER: f64 = 0.35;
const SHORTEST: f64 = 0.05;
/// A tree that could not grow to so many samples for each of its nodes, but for those between, is stuck; from so many to so
/// many in all. Chosen on the Panda's problems: with 20 for all trees, samples beside those that do grow cost half the time.
const STUCK: usize = 10;
const STUCK_IN_ALL: [usize; 2] = [20, 80];
/// The share of its samples that a tree which is stuck draws beside itself. Chosen: of 0.2, 0.5 and 0.8.
const BESIDE: f64 = 0.8;
/// Of the first so many samples half are drawn towards the straight way. Chosen: the paths of what is easy are 2 % shorter,
/// among some fifty variants on the Panda's problems; with some of them what is hard was slower. With 50 paths are longer.
const NEARER: usize = 100;
/// The share of all later samples that tell only which node grows: by a step that its tip leads. Chosen: of 0.3 to 0.9. Where the first
/// ones are led as well, the paths of what is easy are 2 % longer.
const LED: f64 = 0.7;
/// Samples drawn for one that a node listens to, at most.
const DRAWN: usize = 10;
/// Steps straight to the other tree at most; bent ones each lead a tenth of the range nearer.
const STEPS: usize = 1000;
/// A joint motion of this length, rad, leaves a narrow cone less often than a longer one.
const RANGE_IN_CONE: f64 = 0.4;
/// What bringing a sample into the cone costs, in units of [`super::Budget`].
const PROJECTING: u64 = 200;

/// Samples that the searches for one path have grown a tree towards, and how many that may be in all.
#[derive(Debug)]
pub(super) struct Samples {
    pub(super) tried: usize,
    pub(super) most: usize,
}

impl Samples {
    /// Returns how many may be tried yet.
    pub(super) fn left(&self) -> usize {
        self.most.saturating_sub(self.tried)
    }
}

/// One search between two sets of configurations.
pub(super) struct Search<'a, 's> {
    pub(super) solver: &'s Solver<'s>,
    pub(super) motions: &'a mut Motions<'s>,
    /// Longest step of a tree, rad.
    pub(super) range: f64,
    /// Samples of this search, if so many are left.
    pub(super) max_samples: usize,
    /// Configurations that may be looked at.
    pub(super) max_checks: usize,
    /// Samples through which no shorter way leads than this, rad, are moved to where one does.
    pub(super) within: f64,
    pub(super) seed: u64,
    /// Samples of all searches.
    pub(super) samples: &'a mut Samples,
    /// Memory for the end of a step.
    pub(super) next: Vec<f64>,
}

/// Returns what samples are drawn from, joint by joint, rad: the lower end and the width of the limits, half a turn about the
/// start where there are none.
fn ranges(robot: &Robot, start: &[f64]) -> Vec<(f64, f64)> {
    let joints = robot.joints().iter().zip(start);
    let range = |(joint, start): (&JointLimits, &f64)| {
        let (low, high) = (joint.lower.max(start - PI), joint.upper.min(start + PI));
        (low, (high - low).max(0.0))
    };
    joints.map(range).collect()
}

/// Draws a configuration, of 2^32 places for each joint.
fn draw(ranges: &[(f64, f64)], random: &mut StdRng, sample: &mut [f64]) {
    const PLACE: f64 = 1.0 / (1_u64 << 32) as f64;
    for (x, (low, width)) in sample.iter_mut().zip(ranges) {
        *x = low + width * (f64::from(random.random::<u32>()) * PLACE);
    }
}

/// Where a step has led.
enum Extended {
    Reached(usize),
    Advanced(usize),
    Trapped,
}

impl Search<'_, '_> {
    /// Returns corners of a free path from `start` to one of `goals`, and which.
    ///
    /// # Errors
    ///
    /// [`Error::NoPath`] when the samples are used up; [`Error::Spent`] and [`Error::Cancelled`].
    pub(super) fn run(
        &mut self,
        start: &[f64],
        goals: &[(usize, Vec<f64>)],
    ) -> Result<(Vec<Vec<f64>>, usize), Error> {
        for (index, goal) in goals {
            if self.motions.are_free(start, goal)? {
                return Ok((vec![start.to_vec(), goal.clone()], *index));
            }
        }
        let robot = self.motions.robot;
        let ranges = ranges(robot, start);
        let mut sample = vec![0.0; start.len()];
        let mut random = StdRng::seed_from_u64(self.seed);
        let mut trees =
            [Tree::rooted([&start.to_vec()]), Tree::rooted(goals.iter().map(|(_, q)| q))];
        let mut active = 1;
        // Samples to which each tree could not grow, halved whenever it could.
        let mut stuck = [0_usize; 2];
        let (mut drawn, mut tried) = (0, 0);
        let looked = self.motions.checks;
        let max_samples = self.max_samples.min(self.samples.left());
        while tried < max_samples
            && drawn < max_samples.saturating_mul(DRAWN)
            && self.motions.checks - looked < self.max_checks
        {
            drawn += 1;
            // The smaller one grows, as long as it takes.
            if trees[active].len() > trees[1 - active].len() {
                active = 1 - active;
            }
            let [few, many] = STUCK_IN_ALL;
            let is_stuck = stuck[active] > (STUCK * trees[active].len()).clamp(few, many);
            let mut grows = None;
            if drawn >= NEARER && random.random_bool(LED) {
                draw(&ranges, &mut random, &mut sample);
                let node = trees[active].nearest(&sample);
                led(robot, trees[active].node(node), self.range, &mut random, &mut sample);
                grows = Some(node);
            } else if is_stuck && random.random_bool(BESIDE) {
                beside(robot, &trees[active], &mut random, &mut sample);
            } else {
                draw(&ranges, &mut random, &mut sample);
                let nearer = drawn < NEARER && random.random_bool(0.5);
                let share = if nearer { random.random_range(0.0..1.0) } else { 1.0 };
                self.move_in((start, &goals[0].1), share, &mut sample)?;
            }
            let is_led = grows.is_some();
            let from = grows.unwrap_or_else(|| trees[active].nearest(&sample));
            self.motions.budget.spend(1 + trees[active].len() as u64 / 100)?;
            let gap = l2(trees[active].node(from), &sample);
            if gap > trees[active].domain(from) && self.motions.cone.is_none() {
                // Most likely what has stopped the node lies in this way, too.
                stuck[active] += 1;
                continue;
            }
            tried += 1;
            self.samples.tried += 1;
            let mut share = 1.0;
            let grown = loop {
                match self.extend(&mut trees[active], from, &sample, share)? {
                    // A tree in a narrow place grows by short steps or not at all.
                    Extended::Trapped if is_stuck && !is_led && share > SHORTEST => {
                        share *= SHORTER;
                    }
                    Extended::Trapped => break None,
                    Extended::Reached(node) | Extended::Advanced(node) => break Some(node),
                }
            };
            let Some(grown) = grown else {
                trees[active].was_blocked(from);
                stuck[active] += 1;
                continue;
            };
            stuck[active] /= 2;
            trees[active].has_grown(from);
            let met = trees[1 - active].nearest(trees[active].node(grown));
            self.motions.budget.spend(1 + trees[1 - active].len() as u64 / 100)?;
            let target = trees[1 - active].node(met).to_vec();
            if let Some(end) = self.connect(&mut trees[active], grown, &target)? {
                let (near, far) = if active == 0 { (end, met) } else { (met, end) };
                return Ok(joined(&trees, near, far, goals));
            }
        }
        Err(Error::NoPath {
            samples: self.samples.tried,
            why: NoWay::NeverMet { start: trees[0].len(), goal: trees[1].len() },
        })
    }

    /// Grows a tree from one of its nodes straight towards a configuration; returns the node that reaches it.
    fn connect(
        &mut self,
        tree: &mut Tree,
        from: usize,
        target: &[f64],
    ) -> Result<Option<usize>, Error> {
        let mut at = from;
        for _ in 0..STEPS {
            match self.extend(tree, at, target, 1.0)? {
                Extended::Reached(node) => return Ok(Some(node)),
                Extended::Advanced(node) => at = node,
                Extended::Trapped => break,
            }
        }
        Ok(None)
    }

    /// Moves a sample as near to the straight way as `share` of its distance, and as a way of the length that is looked for
    /// can lead there; and into the cone.
    fn move_in(
        &self,
        ends: (&[f64], &[f64]),
        share: f64,
        sample: &mut Vec<f64>,
    ) -> Result<(), Error> {
        if share < 1.0 || self.within.is_finite() {
            self.move_towards(ends, share, sample);
        }
        if let Some(cone) = self.motions.cone {
            self.motions.budget.spend(PROJECTING)?;
            if let Some(projected) = cone.project(self.solver, sample) {
                *sample = projected;
            }
        }
        Ok(())
    }

    /// Moves a sample towards the straight way.
    ///
    /// Source: Gammell, Srinivasa and Barfoot, "Informed RRT*", IROS 2014: what ways of a length reach is an ellipsoid.
    fn move_towards(&self, (start, goal): (&[f64], &[f64]), share: f64, sample: &mut [f64]) {
        let straight = l2(start, goal);
        if straight < 1e-6 {
            return;
        }
        let along = sample.iter().zip(start).zip(goal).map(|((q, a), b)| (q - a) * (b - a));
        let along = (along.sum::<f64>() / (straight * straight)).clamp(0.0, 1.0);
        let mut share = share;
        let foot = |(a, b): (&f64, &f64)| mixed(*a, *b, along);
        if self.within.is_finite() {
            let across = 0.5 * (self.within.powi(2) - straight.powi(2)).max(0.0).sqrt();
            let beside = 1.0 - ((2.0 * along - 1.0) * straight / self.within).powi(2);
            let feet = start.iter().zip(goal).map(foot);
            let gap = sample.iter().zip(feet).map(|(q, foot)| (q - foot).powi(2)).sum::<f64>();
            share *= (across * beside.max(0.0).sqrt() / gap.sqrt()).min(1.0);
        }
        for (q, foot) in sample.iter_mut().zip(start.iter().zip(goal).map(foot)) {
            *q = mixed(foot, *q, share);
        }
    }

    /// Grows a tree from one of its nodes by one step, a share of the range, towards a configuration.
    fn extend(
        &mut self,
        tree: &mut Tree,
        from: usize,
        target: &[f64],
        share: f64,
    ) -> Result<Extended, Error> {
        let gap = l2(tree.node(from), target);
        if gap < 1e-9 {
            return Ok(Extended::Reached(from));
        }
        let cone = self.motions.cone;
        let range = if cone.is_some() { self.range.min(RANGE_IN_CONE) } else { self.range };
        let range = share * range;
        let reaches = gap <= range;
        let mut next = std::mem::take(&mut self.next);
        next.clear();
        if reaches {
            next.extend_from_slice(target);
        } else {
            let straight = tree.node(from).iter().zip(target);
            next.extend(straight.map(|(a, b)| mixed(*a, *b, range / gap)));
        }
        let mut bent = false;
        if let Some(cone) = cone
            && !cone.holds(self.motions.robot, &next)
        {
            self.motions.budget.spend(PROJECTING)?;
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
        let is_free = self.motions.are_free(tree.node(from), &next)?;
        let node = is_free.then(|| tree.push(&next, from));
        self.next = next;
        let Some(node) = node else { return Ok(Extended::Trapped) };
        Ok(if reaches && !bent { Extended::Reached(node) } else { Extended::Advanced(node) })
    }
}

/// Returns the way through both trees, which meet at these nodes, and the goal it leads to.
fn joined(
    trees: &[Tree; 2],
    near: usize,
    far: usize,
    goals: &[(usize, Vec<f64>)],
) -> (Vec<Vec<f64>>, usize) {
    let mut way = trees[0].trace(near);
    way.reverse();
    let tail = trees[1].trace(far);
    let end = tail.last().expect("a way holds at least its root");
    let goal = goals.iter().find(|(_, q)| q == end);
    let goal = goal.expect("the far tree is rooted in the goals").0;
    // Where the trees meet, both hold the same configuration.
    way.extend(tail.into_iter().skip(1));
    (way, goal)
}
