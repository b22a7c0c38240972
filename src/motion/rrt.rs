//! A collision-free joint path from a configuration to one of several goals.
//!
//! The path is searched for by `connect`, shorter ones after it as long as they cost little, and made shorter by `simplify`, both with quick looks at motions
//! (`motions`); then every edge is certified (see [`CollisionWorld::certify`]), and one that is not is searched
//! again by itself with motions that are.
//! More room is asked for than the margin as long as there is a path with it, and less where there is none.
//! It is a list of corners without time; [`super::trajectory`] rounds and times it. All chance comes from
//! the seed.
//!
//! Continuous joints turn the short way: a goal is reached up to whole turns of these.

use super::budget::Budget;
use super::certify::LEFT;
use super::collision::CollisionWorld;
pub use super::cone::Cone;
use super::connect::{Samples, Search};
use super::error::Error;
use super::fault::NoWay;
use super::ik::{Solver, wrap};
use super::motions::Motions;
use super::polyline::{l2, length};
use super::robot::{Motion, Robot};
use super::simplify::{passed_by, simplified};

/// Distances that are kept beyond the margin where the ends of a path allow it, m: a path that grazes an obstacle is slow to certify and
/// leaves no room to round its corners. The next one is asked for where there is no path with the one before; with less than the
/// last no path is certain. Chosen: through a slot that leaves 2 mm on either side searches that keep 0.5 mm found seven ways of eight,
/// those that keep 0.1 mm four, since what they found was not certain.
const ROOMS: [f64; 3] = [0.003, 0.0005, LEFT];
/// Samples that are kept for each search with less room while one with more goes on, or this share of all where that is more; where there
/// are not so many, all searches have the same. Chosen: each had so many when it was counted by itself, so what was found then still is; who
/// asks for many more has most of them for what keeps room, as most ways do.
const KEPT: usize = 50_000;
const KEPT_SHARE: usize = 10;
/// A path that is no longer than so many times the straight way is not searched a shorter one for. Chosen.
const SHORT: f64 = 1.2;
/// Configurations that may be looked at for other ways than the first, in all: about 30 µs. Chosen.
const CHECKS_FOR_OTHERS: usize = 800;
/// Samples for a search with nothing but certain motions, each of which costs a hundred times a look. Chosen: of 8,400 searches of the
/// Panda's problems five came to that and drew 1,761 at most; an end that no certain motion leaves is given up after a second, not ten.
const SAMPLES_OF_CERTAIN: usize = 2000;
/// Where a search may try many samples there are so many for each of certain motions.
const SAMPLES_FOR_A_CERTAIN: usize = 10;
/// Samples for the search between the ends of one edge that is not certain.
const SAMPLES_TO_MEND: usize = 500;

/// What may be chosen about a search.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Seed of all chance.
    pub seed: u64,
    /// How many samples trees are grown towards before giving up, by all searches for one path together; where it may graze some
    /// are kept for those with less room. Ten times as many are drawn at most. Policies that are led search for each goal by itself.
    pub max_samples: usize,
    /// Whether a path may come as near to something as the margin, where none is found that keeps more room.
    pub may_graze: bool,
    /// Longest step of a tree, rad (Euclidean over the joints).
    pub range: f64,
    /// Farthest any point of the robot may move between two checks while searching, m.
    pub resolution: f64,
    /// How many shortcuts are tried.
    pub shortcuts: usize,
    /// How many other ways are searched after the first, each no longer than the best so far, where that costs little.
    pub others: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 0,
            max_samples: 60_000,
            may_graze: true,
            range: 0.7,
            resolution: 0.15,
            shortcuts: 10,
            others: 2,
        }
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
    /// Samples that trees were grown towards; 0 if the straight motion was free.
    pub samples: usize,
    /// Configurations checked for collision.
    pub checks: usize,
    /// Length before shortcutting, rad (Euclidean over the joints).
    pub raw_length: f64,
    /// Why policies did not arrive, where they were to find the way and this one was searched in their place.
    pub policies_failed: Option<NoWay>,
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
        match check_end(robot, world, cone, &goal, &goal_name(index, goals.len())) {
            Ok(()) => usable.push((index, goal)),
            Err(error) => refused = Some(error),
        }
    }
    if usable.is_empty() {
        return Err(refused.unwrap_or(Error::NoGoal));
    }
    usable.sort_by(|a, b| l2(&a.1, start).total_cmp(&l2(&b.1, start)));

    let room = |q: &[f64]| world.distance(q) - world.margin();
    let mut rooms = Vec::with_capacity(usable.len());
    for (_, goal) in &usable {
        budget.spend(cost)?;
        rooms.push(room(goal));
    }
    let goal_room = rooms.iter().copied().fold(0.0, f64::max);
    let least_room = room(start).min(goal_room);
    let mut pads = ROOMS.map(|most| (0.5 * least_room).clamp(0.0, most)).to_vec();
    // Where the ends themselves have little room, several come to the same.
    pads.dedup();
    if !settings.may_graze {
        pads.truncate(1);
    }

    let mut motions = Motions::new(robot, world, cone, (0.0, settings.resolution), budget);
    let mut samples = Samples { tried: 0, most: settings.max_samples };
    let mut none = Error::NoGoal;
    let n_searches = pads.len();
    for (done, pad) in pads.into_iter().enumerate() {
        motions.pad = pad;
        let max_samples = share(&samples, done, n_searches);
        let settings = &Settings { max_samples, ..*settings };
        // The roomiest goal has twice the room, so one is left; were none, the search would have nowhere to go.
        let roomy = usable.iter().zip(&rooms);
        let roomy = roomy.filter(|(_, room)| **room > pad || goal_room <= 0.0);
        let roomy: Vec<_> = roomy.map(|(goal, _)| goal.clone()).collect();
        let ends = (start, roomy.as_slice());
        match certain(solver, &mut motions, settings, ends, &mut samples) {
            Ok(mut found) => {
                if settings.may_graze && roomy.len() < usable.len() {
                    let ends = (start, usable.as_slice());
                    let within = length(&found.1);
                    let near =
                        nearer(solver, &mut motions, settings, ends, &rooms, within, &mut samples)?;
                    found = near.unwrap_or(found);
                }
                let (goal, corners, raw_length) = found;
                return Ok(Path {
                    corners,
                    goal,
                    samples: samples.tried,
                    checks: motions.checks,
                    raw_length,
                    policies_failed: None,
                });
            }
            Err(error @ Error::NoPath { .. }) => none = error,
            Err(other) => return Err(other),
        }
    }
    Err(none)
}

/// Returns how many samples the next search may try when `done` of `n_searches` have ended: what is left, but for what is kept for those after it.
fn share(samples: &Samples, done: usize, n_searches: usize) -> usize {
    let each = samples.most / n_searches;
    let kept = each.min(KEPT.max(samples.most / KEPT_SHARE));
    samples.left().saturating_sub((n_searches - done - 1) * kept)
}

/// What messages call a goal: one of several has its number, from 1 on.
pub(super) fn goal_name(index: usize, n_goals: usize) -> String {
    if n_goals == 1 { "goal".into() } else { format!("goal {} of {n_goals}", index + 1) }
}

/// A goal that is reached, the corners of a simplified path to it, and how long it was before, rad.
type Found = (usize, Vec<Vec<f64>>, f64);

/// Returns a path that is certain all the way.
fn certain<'s>(
    solver: &'s Solver<'s>,
    motions: &mut Motions<'s>,
    settings: &Settings,
    ends: (&[f64], &[(usize, Vec<f64>)]),
    samples: &mut Samples,
) -> Result<Found, Error> {
    let (goal, corners, raw_length) = searched(solver, motions, settings, ends, samples)?;
    if let Some(corners) = mended(solver, motions, settings, corners, samples)? {
        return Ok((goal, corners, raw_length));
    }
    // What grazes something between two looks and has no way around it there: nothing but certain motions, then.
    let most = SAMPLES_OF_CERTAIN.max(settings.max_samples / SAMPLES_FOR_A_CERTAIN);
    let settings = Settings { max_samples: settings.max_samples.min(most), ..*settings };
    motions.is_certain = true;
    let found = searched(solver, motions, &settings, ends, samples);
    motions.is_certain = false;
    found
}

/// Returns a certain path to a goal with no more room than is kept on one that was found, `within` rad long, where a quick look
/// finds one that is shorter.
fn nearer<'s>(
    solver: &'s Solver<'s>,
    motions: &mut Motions<'s>,
    settings: &Settings,
    (start, goals): (&[f64], &[(usize, Vec<f64>)]),
    rooms: &[f64],
    within: f64,
    samples: &mut Samples,
) -> Result<Option<Found>, Error> {
    let pad = motions.pad;
    let close = goals
        .iter()
        .zip(rooms)
        .filter(|((_, q), room)| **room > LEFT && **room <= pad && SHORT * l2(start, q) < within);
    let (close, rooms): (Vec<_>, Vec<f64>) =
        close.map(|(goal, room)| (goal.clone(), *room)).unzip();
    if close.is_empty() {
        return Ok(None);
    }
    motions.pad = 0.5 * rooms.into_iter().fold(pad, f64::min);
    let Settings { seed, max_samples, range, shortcuts, .. } = *settings;
    let mut search = Search {
        solver,
        motions,
        range,
        max_samples,
        max_checks: CHECKS_FOR_OTHERS,
        within,
        seed,
        samples,
        next: Vec::new(),
    };
    let (corners, goal) = match search.run(start, &close) {
        Ok(way) => way,
        Err(Error::NoPath { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let raw_length = length(&corners);
    let corners = simplified(motions, corners, shortcuts, seed)?;
    for edge in corners.windows(2) {
        if !motions.world.certify_within(&edge[0], &edge[1], motions.budget)? {
            return Ok(None);
        }
    }
    Ok((length(&corners) < within).then_some((goal, corners, raw_length)))
}

/// Returns a path that is free wherever it is looked at.
fn searched<'s>(
    solver: &'s Solver<'s>,
    motions: &mut Motions<'s>,
    settings: &Settings,
    (start, goals): (&[f64], &[(usize, Vec<f64>)]),
    samples: &mut Samples,
) -> Result<Found, Error> {
    let Settings { seed, max_samples, range, shortcuts, others, .. } = *settings;
    let mut search = Search {
        solver,
        motions,
        range,
        max_samples,
        max_checks: usize::MAX,
        within: f64::INFINITY,
        seed,
        samples,
        next: Vec::new(),
    };
    let (mut corners, mut goal) = search.run(start, goals)?;
    let raw_length = length(&corners);
    if others > 0 && corners.len() > 2 {
        passed_by(search.motions, &mut corners)?;
    }
    search.within = length(&corners);
    let end = search.motions.checks.saturating_add(CHECKS_FOR_OTHERS);
    for other in 1..=others as u64 {
        search.max_checks = end.saturating_sub(search.motions.checks);
        if search.within <= SHORT * l2(start, &goals[0].1) || search.max_checks == 0 {
            break;
        }
        search.seed = seed ^ (other << 32);
        match search.run(start, goals) {
            Ok((mut way, to)) => {
                passed_by(search.motions, &mut way)?;
                if length(&way) < search.within {
                    search.within = length(&way);
                    (corners, goal) = (way, to);
                }
            }
            Err(Error::NoPath { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    Ok((goal, simplified(motions, corners, shortcuts, seed)?, raw_length))
}

/// Certifies every edge, and searches again with certain motions where one is not; `None` where there is no way.
fn mended<'s>(
    solver: &'s Solver<'s>,
    motions: &mut Motions<'s>,
    settings: &Settings,
    corners: Vec<Vec<f64>>,
    samples: &mut Samples,
) -> Result<Option<Vec<Vec<f64>>>, Error> {
    let mut path: Vec<Vec<f64>> = Vec::with_capacity(corners.len());
    for corner in corners {
        let Some(from) = path.last() else {
            path.push(corner);
            continue;
        };
        if motions.world.certify_within(from, &corner, motions.budget)? {
            path.push(corner);
            continue;
        }
        let local = Settings { max_samples: SAMPLES_TO_MEND, others: 0, ..*settings };
        motions.is_certain = true;
        let way = searched(solver, motions, &local, (from, &[(0, corner)]), samples);
        motions.is_certain = false;
        match way {
            Ok((_, way, _)) => path.extend(way.into_iter().skip(1)),
            Err(Error::NoPath { .. }) => return Ok(None),
            Err(other) => return Err(other),
        }
    }
    Ok(Some(path))
}

/// Checks that a path may begin or end at `q`.
pub(super) fn check_end(
    robot: &Robot,
    world: &CollisionWorld<'_>,
    cone: Option<&Cone>,
    q: &[f64],
    which: &str,
) -> Result<(), Error> {
    robot.check(q)?;
    if let Some(at) = robot.outside_limits(q, 1e-9) {
        let joint = &robot.joints()[at];
        let slides = robot.links()[joint.link].joint.motion == Motion::Slide;
        return Err(Error::Limit {
            which: which.into(),
            joint: joint.name.clone(),
            value: q[at],
            lower: joint.lower,
            upper: joint.upper,
            unit: if slides { "m" } else { "rad" },
        });
    }
    if !world.free(q) {
        let clearance = world.clearance(q)?;
        return Err(Error::Collision {
            which: which.into(),
            first: clearance.first,
            second: clearance.second,
            depth: world.margin() - clearance.distance,
            margin: world.margin(),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// With 50,000 samples asked for three searches tried so many each.
    #[test]
    fn searches_share_their_samples_and_each_has_what_is_kept_for_it() {
        let shares = |most: usize| {
            let mut samples = Samples { tried: 0, most };
            [0, 1, 2].map(|done| {
                let share = share(&samples, done, 3);
                samples.tried += share;
                share
            })
        };
        assert_eq!(shares(150_000), [50_000; 3]);
        assert_eq!(shares(500_000), [400_000, 50_000, 50_000]);
        assert_eq!(shares(1_000_000), [800_000, 100_000, 100_000]);
        assert_eq!(shares(1000), [334, 333, 333]);
        assert_eq!(shares(1), [1, 0, 0]);
        // What the first leaves is the second's.
        let samples = Samples { tried: 10, most: 150_000 };
        assert_eq!(share(&samples, 1, 3), 99_990);
        assert_eq!(share(&samples, 0, 1), 149_990);
    }
}
