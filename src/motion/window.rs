//! Narrow windows of the redundancy: values of the joint to spare between those of a sweep at which every joint keeps its
//! limits.
//!
//! Where several joints are at their limits a pose may be reached with a single value of that joint. There the largest
//! excess over any limit is least, and no more than rounding; so it is looked for where it dips between samples.
//!
//! Source: golden section; Press et al., *Numerical Recipes*, 2007, §10.2.

use std::f64::consts::TAU;

use super::closed_form::{ClosedForm, Looked, Wanted};
use super::gate::Gate;
use super::ik::{SLACK, wrap};
use super::robot::{Motion, Robot};

/// A dip that is no lower than this at its sample, rad, is not looked into: samples are a tenth of a radian apart.
const SHALLOW: f64 = 0.4;
/// Where it is no higher than this at either end, rad, the middle between two samples is looked at as well.
const LEVEL: f64 = 0.1;
/// Looks into one dip at most: they narrow it from 0.2 rad to rounding.
const LOOKS: usize = 66;
/// An excess that could not fall to nothing within the rest of a dip at this slope, rad/rad, ends it.
const STEEPEST: f64 = 30.0;

/// Returns solutions that lie between the values of joint 3 in `swept`, each beside all its branches.
pub(super) fn crossings(
    robot: &Robot,
    form: &ClosedForm,
    wanted: &Wanted,
    gate: &Gate,
    swept: &[(f64, Looked)],
) -> Vec<[f64; 7]> {
    let mut order: Vec<usize> = (0..swept.len()).collect();
    order.sort_by(|a, b| swept[*a].0.total_cmp(&swept[*b].0));
    let mut found = Vec::new();
    let mut looks = Vec::with_capacity(swept.len());
    for branch in 0..8 {
        looks.clear();
        looks.extend(order.iter().map(|k| {
            let (q3, looked) = &swept[*k];
            let q = looked.branches[branch];
            (*q3, (q.map_or(looked.beyond[branch], |q| excess(robot, &q)), q))
        }));
        let look = |q3: f64| match form.branch(robot, wanted, q3, gate, branch) {
            Ok(q) => (excess(robot, &q), Some(q)),
            Err(beyond) => (beyond, None),
        };
        found.extend(dips(&looks, robot.joints()[2].continuous, &look).into_iter().flatten());
    }
    found
}

/// Returns values of joint `held` between those in `swept` (each with the least excess of any solution there, rad) at which a
/// solution keeps its limits; `least` gives that excess of any value.
pub(super) fn values(
    robot: &Robot,
    held: usize,
    swept: &[(f64, f64)],
    least: &dyn Fn(f64) -> f64,
) -> Vec<f64> {
    let mut looks: Vec<_> = swept.iter().map(|(at, excess)| (*at, (*excess, *at))).collect();
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    dips(&looks, robot.joints()[held].continuous, &|value| (least(value), value))
}

/// Returns what is found at the bottoms of all dips that fall to nothing: `swept` has in order the values tried and what was
/// found there, each with its excess.
fn dips<T: Copy>(
    swept: &[(f64, (f64, T))],
    is_closed: bool,
    look: &dyn Fn(f64) -> (f64, T),
) -> Vec<T> {
    let (n, mut found) = (swept.len(), Vec::new());
    for (k, (at, known)) in swept.iter().enumerate() {
        let here = known.0;
        // Around a full turn the first follows the last.
        let (before, low) = match (k, is_closed) {
            (0, false) => (f64::INFINITY, swept[0].0),
            (0, true) => (swept[n - 1].1.0, swept[n - 1].0 - TAU),
            _ => (swept[k - 1].1.0, swept[k - 1].0),
        };
        let (after, high) = match (k + 1 == n, is_closed) {
            (true, false) => (f64::INFINITY, *at),
            (true, true) => (swept[0].1.0, swept[0].0 + TAU),
            _ => (swept[k + 1].1.0, swept[k + 1].0),
        };
        if here <= SHALLOW && here <= before && here <= after {
            found.extend(dip(look, [low, *at, high], *known));
        } else if here.min(after) <= LEVEL {
            // Beside a level stretch a dip shows at no sample.
            let middle = 0.5 * (at + high);
            let known = look(middle);
            if known.0 <= here.min(after) {
                found.extend(dip(look, [*at, middle, high], known));
            }
        }
    }
    found
}

/// Narrows a dip of the excess between the outer two of three values; returns what is found at its bottom, if that is
/// inside. The last argument is what was found at the one between.
fn dip<T: Copy>(
    look: &dyn Fn(f64) -> (f64, T),
    [mut low, mut at, mut high]: [f64; 3],
    (mut least, mut best): (f64, T),
) -> Option<T> {
    // (3 - √5) / 2, the golden section.
    const GOLDEN: f64 = 0.381_966_011_250_105;
    for _ in 0..LOOKS {
        // A tenth of the slack: what is found is told apart from what nearly is.
        if least <= 0.1 * SLACK {
            return Some(best);
        }
        if least > STEEPEST * (high - low) {
            return None;
        }
        let next =
            if high - at > at - low { at + GOLDEN * (high - at) } else { at - GOLDEN * (at - low) };
        let (found, what) = look(next);
        if found <= least {
            if next > at {
                low = at;
            } else {
                high = at;
            }
            (at, best, least) = (next, what, found);
        } else if next > at {
            high = next;
        } else {
            low = next;
        }
    }
    (least <= SLACK).then_some(best)
}

/// Returns by how much a position of the joints is outside its limits at most, rad or m.
pub(super) fn excess(robot: &Robot, q: &[f64]) -> f64 {
    let beyond = robot.joints().iter().zip(q).map(|(joint, x)| {
        let middle = 0.5 * (joint.lower + joint.upper);
        if !middle.is_finite() {
            return f64::NEG_INFINITY;
        }
        let turns = robot.links()[joint.link].joint.motion == Motion::Turn;
        let off = if turns { wrap(x - middle) } else { x - middle };
        off.abs() - 0.5 * (joint.upper - joint.lower)
    });
    beyond.fold(f64::NEG_INFINITY, f64::max)
}
