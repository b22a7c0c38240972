//! Poses of the tip that lie close together are followed by the joints, on one branch and without a jump.

use crate::motion::ik::Solver;
use crate::motion::reserve::Reserve;
use crate::world::Pose;
use crate::world::frame::{Base, Flange};

use super::RESERVE;

/// A continuous motion never moves a joint further than this between two poses, rad. The poses that are followed are
/// 5 mm or 2 deg apart, so that a joint turns by some hundredths; near a singular position it may turn ten times as
/// far. Chosen: with half of it ways past such positions are lost, with twice as much a change of branch may pass for
/// motion.
const JUMP: f64 = 0.25;
/// How far a path that is followed keeps from the ends of a range: half of [`RESERVE`], which its beginning keeps. Chosen: at
/// nothing no room is left to the end, at three quarters paths along an end break off where the curve would still be inside.
const FOLLOWED: Reserve = RESERVE.times(0.5);
/// How far joint 3 is moved, rad, in the order tried, when a pose has no solution where it is. Chosen: the small shift
/// keeps the elbow nearly still, the large one is below half of [`JUMP`], so that the other joints may follow.
const ELBOW_SHIFTS: [f64; 5] = [0.0, 0.04, -0.04, 0.1, -0.1];

/// Returns the largest change of a joint between two positions, rad.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Returns the joint position nearest to `last` that brings the tip to a pose a small way off.
///
/// # Errors
///
/// How far out of reach the pose is, m; 0 when it can only be reached by a jump.
pub(super) fn follow(
    solver: &Solver<'_>,
    tip: &Pose<Base, Flange>,
    last: &[f64],
) -> Result<Vec<f64>, f64> {
    if solver.closed_form().is_none() {
        return follow_numerically(solver, tip, last).ok_or(0.0);
    }
    let step = |q: &Vec<f64>| distance(q, last);
    let inside = |q: &Vec<f64>| solver.robot().at_an_end(q, FOLLOWED).is_none();
    let nearest = |found: Vec<Vec<f64>>| {
        found.into_iter().filter(inside).min_by(|a, b| step(a).total_cmp(&step(b)))
    };
    // The elbow stays where it is while it can, and moves a little when it must.
    for shift in ELBOW_SHIFTS {
        let on_branch = nearest(solver.at_joint_3(tip, last[2] + shift, last));
        if let Some(q) = on_branch.filter(|q| step(q) <= JUMP) {
            return Ok(q);
        }
    }
    let q = solver.nearest(tip, last).map_err(|unreachable| unreachable.nearest)?;
    if step(&q) <= JUMP && inside(&q) { Ok(q) } else { Err(0.0) }
}

/// As [`follow`], for an arm without a closed form: from where it is, then from joint positions a little beside. Where
/// none of these ends near, there is nothing to follow; a search from anywhere would only find a jump.
fn follow_numerically(
    solver: &Solver<'_>,
    tip: &Pose<Base, Flange>,
    last: &[f64],
) -> Option<Vec<f64>> {
    ELBOW_SHIFTS.into_iter().find_map(|shift| {
        let mut start = last.to_vec();
        if let Some(elbow) = start.get_mut(2) {
            *elbow += shift;
        }
        let q = solver.descend_from(tip, &start, FOLLOWED)?;
        (distance(&q, last) <= JUMP).then_some(q)
    })
}
