//! Whether a level hand comes to where jars stand, for `robot check`: to how many places, and what keeps it from the others.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;

use nalgebra::Vector3;

use crate::execution::plan::side_pose;
use crate::motion::collision::{Clearance, CollisionWorld};
use crate::motion::ik::{Options, Reason, Solver};
use crate::motion::robot::Robot;
use crate::world::frame::{Base, Flange, Pose};

use super::robot_check::TABLE;

/// Where a level hand is tried, m: the places of the laboratory's objects lie between these distances from the base
/// (`radius_m` of its `placement`), and a jar of 14 cm is taken this high.
const DISTANCES: [f64; 4] = [0.55, 0.60, 0.65, 0.70];
const HEIGHT: f64 = 0.09;
/// How far the hand points down in `level_side` and `tilted_side` of `pick`, rad.
const PITCHES: [f64; 2] = [0.0, 20.0 * std::f64::consts::PI / 180.0];
/// Solutions of one place that are asked what touches. Chosen: all eight branches of eight values of a joint to spare. With half
/// of them a pair may be missed that touches most often, with twice as many an arm of seven joints is waited for.
const ASKED: usize = 64;
/// Rounding at the end of a joint's range, rad or m.
const SLACK: f64 = 1e-9;
/// Fewer joints than a pose has directions.
const FEW: usize = 6;

/// What keeps the hand from a place.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Kept {
    /// These touch, of all that do most often.
    Touch(String, String),
    /// These joints would have to go past their ranges; none where that is not known.
    Range(Vec<String>),
    /// No joint positions at all are a solution.
    Far,
    /// Joint positions come to the place, and none turn the hand so.
    Turned,
}

/// What `robot check` says of the reach.
pub(super) struct Reach {
    pub(super) found: String,
    /// What to write where no place is reached.
    pub(super) write: Option<String>,
}

/// Counts the places, 0.55 to 0.70 m ahead, to which a hand comes that is level or nearly, over what `world` has.
pub(super) fn reach(robot: &Robot, world: &CollisionWorld<'_>) -> Reach {
    let near = robot.pose("home").unwrap_or_default().to_vec();
    let hand = Hand { robot, world, solver: Solver::new(robot), near };
    let tries = PITCHES.into_iter().flat_map(|pitch| DISTANCES.map(|distance| (distance, pitch)));
    let tried: Vec<_> = tries.map(|(distance, pitch)| hand.comes(distance, pitch)).collect();
    let (n, reached) = (tried.len(), tried.iter().filter(|tried| tried.is_ok()).count());
    let mut found = format!(
        "a hand that is level or points 20 deg down comes to {reached} of {n} places 0.55 to 0.70 m ahead, 9 cm over the table"
    );
    // At how many places, and the smallest overlap, m.
    let mut reasons: BTreeMap<Kept, (usize, f64)> = BTreeMap::new();
    for (kept, overlap) in tried.into_iter().filter_map(Result::err) {
        let (places, least) = reasons.entry(kept).or_insert((0, f64::INFINITY));
        *places += 1;
        *least = least.min(overlap);
    }
    let mut reasons: Vec<_> = reasons.into_iter().collect();
    reasons.sort_by_key(|(_, (places, _))| std::cmp::Reverse(*places));
    for (k, (kept, (places, overlap))) in reasons.iter().enumerate() {
        let mark = if k == 0 { ": not" } else { ";" };
        let _ = write!(found, "{mark} to {places}, where {}", why(kept, *overlap));
    }
    if reached > 0 {
        return Reach { found, write: None };
    }
    let down = DISTANCES.into_iter().filter(|&d| hand.comes(d, FRAC_PI_2).is_ok()).count();
    if down > 0 {
        let of = DISTANCES.len();
        let _ = write!(
            found,
            "; one that points straight down comes to {down} of {of}, and takes from above"
        );
    }
    let far = Kept::Far;
    let write = match reasons.first().map_or(&far, |(kept, _)| kept) {
        // No base makes it level.
        Kept::Far | Kept::Turned if down > 0 && robot.n_joints() < FEW => {
            "`pick(jar) via from_above`: an arm with so few joints takes nothing from the side, wherever its base is".to_owned()
        }
        other => help(other),
    };
    Reach { found, write: Some(write) }
}

/// Says why a place is not reached; `overlap` is the smallest, m, of what touches.
fn why(kept: &Kept, overlap: f64) -> String {
    match kept {
        Kept::Touch(first, second) if overlap.is_finite() => {
            format!("{first} and {second} overlap by {:.1} mm or more", 1e3 * overlap)
        }
        Kept::Touch(first, second) => format!("{first} and {second} overlap"),
        Kept::Range(joints) if joints.is_empty() => "a joint's range ends before".to_owned(),
        Kept::Range(joints) if joints.len() == 1 => {
            format!("the range of {} ends before", joints[0])
        }
        Kept::Range(joints) => format!("the ranges of {} end before", joints.join(" and ")),
        Kept::Far => "no joint positions put the hand".to_owned(),
        Kept::Turned => "the hand comes, but not level".to_owned(),
    }
}

/// Says what to write so that what keeps the hand from a place no longer does.
fn help(kept: &Kept) -> String {
    const BASE: &str = "another place of the base in the scene: `robot NAME at (x, y, z)`";
    match kept {
        Kept::Touch(first, second) if second == TABLE => format!(
            "a base that stands higher in the scene, `robot NAME at (x, y, z)`, or smaller shapes for {first}"
        ),
        Kept::Touch(first, second) => format!(
            "shapes of {first} and {second} that are nearer to the real ones, or, where the arm's do not touch, [[unchecked]] link = \"{first}\" with = [\"{second}\"] in robot.toml"
        ),
        Kept::Range(joints) => {
            let of = if joints.is_empty() { "the joints".to_owned() } else { joints.join(" and ") };
            format!(
                "<limit lower=\"..\" upper=\"..\"/> of {of} in the URDF as far as the arm's go; if they are right, {BASE}"
            )
        }
        Kept::Far | Kept::Turned => BASE.to_owned(),
    }
}

/// A hand to be brought to places.
struct Hand<'a, 'w> {
    robot: &'a Robot,
    world: &'a CollisionWorld<'w>,
    solver: Solver<'a>,
    /// Where the arm begins, rad.
    near: Vec<f64>,
}

impl Hand<'_, '_> {
    /// Whether it comes to a place that is `distance` m ahead, pointing `pitch` rad down; else what keeps it from there, and how
    /// far what touches overlaps at least, m.
    fn comes(&self, distance: f64, pitch: f64) -> Result<(), (Kept, f64)> {
        let tool = side_pose(Vector3::new(distance, 0.0, HEIGHT), 0.0, pitch);
        let base_from_tip = tool.isometry() * self.robot.flange_from_tool().inverse().isometry();
        let target: Pose<Base, Flange> = Pose::new(base_from_tip);
        let touching = RefCell::new(Vec::new());
        let free = |q: &[f64]| {
            let is_free = self.world.free(q);
            let mut touching = touching.borrow_mut();
            if !is_free && touching.len() < ASKED {
                touching.extend(self.world.clearance(q).ok());
            }
            is_free
        };
        let solved = self.solver.solve(&target, &Options::first(&self.near), &free);
        let Err(unreachable) = solved else { return Ok(()) };
        Err(match unreachable.reason {
            Reason::Collision => commonest(&touching.into_inner()),
            Reason::Limits => (Kept::Range(self.past_ranges(&target)), f64::INFINITY),
            Reason::OutOfReach => (Kept::Far, f64::INFINITY),
            Reason::Orientation => (Kept::Turned, f64::INFINITY),
        })
    }

    /// Returns the joints that would go past their ranges where as few of them do as can be.
    fn past_ranges(&self, target: &Pose<Base, Flange>) -> Vec<String> {
        let wide = self.robot.clone().with_whole_turns();
        let found = Solver::new(&wide).solve(target, &Options::near(&self.near), &|_| true);
        let past = found.unwrap_or_default().into_iter().map(|q| self.past(&q));
        let fewest = past.min_by_key(Vec::len).unwrap_or_default();
        fewest.into_iter().map(|joint| self.robot.joints()[joint].name.clone()).collect()
    }

    /// Returns the joints that are past their ranges at `q`, whichever way round they turn.
    fn past(&self, q: &[f64]) -> Vec<usize> {
        let is_past = |&i: &usize| {
            let (joint, slides) = (&self.robot.joints()[i], self.robot.slides(i));
            let turns: &[f64] = if slides { &[0.0] } else { &[-TAU, 0.0, TAU] };
            let range = joint.lower - SLACK..=joint.upper + SLACK;
            !turns.iter().any(|turn| range.contains(&(q[i] + turn)))
        };
        (0..q.len()).filter(is_past).collect()
    }
}

/// Returns the pair that touches at most solutions, and how far it overlaps at least, m.
fn commonest(touching: &[Clearance]) -> (Kept, f64) {
    let mut pairs: BTreeMap<(&str, &str), (usize, f64)> = BTreeMap::new();
    for nearest in touching {
        let pair = (nearest.first.as_str(), nearest.second.as_str());
        let (times, least) = pairs.entry(pair).or_insert((0, f64::INFINITY));
        *times += 1;
        *least = least.min(-nearest.distance);
    }
    let most = pairs.into_iter().max_by_key(|(_, (times, _))| *times);
    most.map_or((Kept::Far, f64::INFINITY), |((first, second), (_, least))| {
        (Kept::Touch(first.to_owned(), second.to_owned()), least)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of an arm whose own parts overlap "another place of the base" was advised.
    #[test]
    fn the_pair_that_touches_most_often_is_told_and_the_advice_is_about_it() {
        let nearest = |second: &str, distance: f64| Clearance {
            distance,
            first: "l5".into(),
            second: second.into(),
        };
        let touching = [nearest("l7", -0.02), nearest(TABLE, -0.3), nearest("l7", -0.0148)];
        let (kept, overlap) = commonest(&touching);
        assert_eq!(kept, Kept::Touch("l5".into(), "l7".into()));
        assert_eq!(why(&kept, overlap), "l5 and l7 overlap by 14.8 mm or more");
        assert!(help(&kept).contains("[[unchecked]] link = \"l5\" with = [\"l7\"]"));
        let (kept, _) = commonest(&touching[1..2]);
        assert!(help(&kept).starts_with("a base that stands higher"), "{kept:?}");
    }
}
