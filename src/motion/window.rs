//! Narrow windows of the redundancy: values of joint 3 between those of a sweep at which every joint keeps its limits.
//!
//! Where several joints are at their limits a pose may be reached with a single value of joint 3. There the largest
//! excess over any limit is least, and no more than rounding; so it is looked for where it dips between samples.
//!
//! Source: golden section; Press et al., *Numerical Recipes*, 2007, §10.2.

use std::f64::consts::TAU;

use super::closed_form::{ClosedForm, Looked, Wanted};
use super::gate::Gate;
use super::ik::{SLACK, wrap};
use super::robot::Robot;

/// A dip that is no lower than this at its sample, rad, is not looked into: samples are a tenth of a radian apart.
const SHALLOW: f64 = 0.4;
/// Where it is no higher than this at either end, rad, the middle between two samples is looked at as well.
const LEVEL: f64 = 0.1;
/// Looks into one dip at most: they narrow it from 0.2 rad to rounding.
const LOOKS: usize = 66;
/// An excess that could not fall to nothing within the rest of a dip at this slope, rad/rad, ends it.
const STEEPEST: f64 = 30.0;

/// What a value of joint 3 gives of a branch: its excess, and the joint positions unless they are surely outside.
type Look = (f64, Option<[f64; 7]>);

/// Returns solutions that lie between the values of joint 3 in `swept`, each beside all its branches.
pub(super) fn crossings(
    robot: &Robot,
    form: &ClosedForm,
    wanted: &Wanted,
    gate: &Gate,
    swept: &[(f64, Looked)],
) -> Vec<[f64; 7]> {
    let n = swept.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| swept[*a].0.total_cmp(&swept[*b].0));
    let swept: Vec<&(f64, Looked)> = order.into_iter().map(|k| &swept[k]).collect();
    let is_closed = robot.joints()[2].continuous;
    let mut found = Vec::new();
    let mut excesses = vec![0.0; n];
    for branch in 0..8 {
        for ((_, looked), known) in swept.iter().copied().zip(&mut excesses) {
            *known =
                looked.branches[branch].map_or(looked.beyond[branch], |q| excess(robot, Some(&q)));
        }
        let at = |k: usize| excesses[k];
        for k in 0..n {
            let here = at(k);
            // Around a full turn the first follows the last.
            let (before, low) = match (k, is_closed) {
                (0, false) => (f64::INFINITY, swept[0].0),
                (0, true) => (at(n - 1), swept[n - 1].0 - TAU),
                _ => (at(k - 1), swept[k - 1].0),
            };
            let (after, high) = match (k + 1 == n, is_closed) {
                (true, false) => (f64::INFINITY, swept[k].0),
                (true, true) => (at(0), swept[0].0 + TAU),
                _ => (at(k + 1), swept[k + 1].0),
            };
            let look = |q3: f64| match form.branch(robot, wanted, q3, gate, branch) {
                Ok(q) => (excess(robot, Some(&q)), Some(q)),
                Err(beyond) => (beyond, None),
            };
            let (at, looked) = swept[k];
            let at = *at;
            if here <= SHALLOW && here <= before && here <= after {
                found.extend(dip(&look, [low, at, high], (here, looked.branches[branch])));
            } else if here.min(after) <= LEVEL {
                // Beside a level stretch a dip shows at no sample.
                let middle = 0.5 * (at + high);
                let known = look(middle);
                if known.0 <= here.min(after) {
                    found.extend(dip(&look, [at, middle, high], known));
                }
            }
        }
    }
    found
}

/// Narrows a dip of the excess between the outer two of three values of joint 3; returns the solution at its bottom, if
/// it is one. `known` is what was found at the one between.
fn dip(
    look: &dyn Fn(f64) -> Look,
    [mut low, mut at, mut high]: [f64; 3],
    (mut least, mut best): Look,
) -> Option<[f64; 7]> {
    // (3 - √5) / 2, the golden section.
    const GOLDEN: f64 = 0.381_966_011_250_105;
    for _ in 0..LOOKS {
        // A tenth of the slack: what is found is told apart from what nearly is.
        if least <= 0.1 * SLACK {
            return best;
        }
        if least > STEEPEST * (high - low) {
            return None;
        }
        let next =
            if high - at > at - low { at + GOLDEN * (high - at) } else { at - GOLDEN * (at - low) };
        let (found, q) = look(next);
        if found <= least {
            if next > at {
                low = at;
            } else {
                high = at;
            }
            (at, best, least) = (next, q, found);
        } else if next > at {
            high = next;
        } else {
            low = next;
        }
    }
    best.filter(|_| least <= SLACK)
}

/// Returns by how much a position of the joints is outside its limits at most, rad; infinite for none.
fn excess(robot: &Robot, q: Option<&[f64; 7]>) -> f64 {
    let Some(q) = q else { return f64::INFINITY };
    let beyond = robot.joints().iter().zip(q).map(|(joint, x)| {
        let middle = 0.5 * (joint.lower + joint.upper);
        if middle.is_finite() {
            wrap(x - middle).abs() - 0.5 * (joint.upper - joint.lower)
        } else {
            f64::NEG_INFINITY
        }
    });
    beyond.fold(f64::NEG_INFINITY, f64::max)
}
