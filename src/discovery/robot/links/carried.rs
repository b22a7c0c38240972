//! What the recordings held out carry more than those fitted: numbers of links and joints that are common to both, and a load
//! that only one of them has.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::super::explain::ArmGap;
use super::super::term::{Law, Term};
use super::body::NUMBERS;
use super::fit::{Fit, Parts, Problem, consistent, left_of};
use super::{CREEPS, SOME, of_joints, problems};
use crate::discovery::selection::{Hypothesis, Residuals as _, Set, sum_of_squares};

/// A mass is told if it is this many times its standard deviation.
const TOLD: f64 = 5.0;

/// Without it this many times more is left, in squares.
const CLEAR: f64 = 2.0;

/// A load in some recordings, beside what they have in common with others.
#[derive(Debug)]
pub(in super::super) struct Carried {
    /// The recordings that have it, as if fitted and held out, with the numbers of links and joints that are common to all.
    pub(in super::super) gap: ArmGap,
    /// The load there, by mass and moment in the tip's frame.
    pub(in super::super) load: Hypothesis<Term>,
}

/// Returns the load that makes the recordings held out and those fitted recordings of one machine, if there is one: beside
/// what both bear.
pub(in super::super) fn carried(gap: &ArmGap) -> Option<Carried> {
    let thinned = gap.for_search();
    let bodies = &gap.train[0].arm.chain.bodies;
    let own = Parts::of(bodies.len());
    let parts = own.merged();
    let common = parts.only(&[&parts.bodies, &parts.joints, &parts.load]);
    let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load, &parts.more]);
    let merged = problems(&thinned)?.into_iter().zip(CREEPS).filter_map(|(problem, creep)| {
        let merged = problem.merged(&own);
        let free = merged.fit(&all)?;
        Some((problem, merged, free, creep))
    });
    let (problem, merged, free, creep) =
        merged.min_by(|a, b| a.2.total().total_cmp(&b.2.total()))?;
    let changes = consistent(&merged, bodies, &parts, &free)?;
    let beside = parts.only(&[&parts.joints, &parts.load, &parts.more]);
    let with = merged.beside(&changes).fit(&beside)?;
    let plain = merged.fit(&common)?;
    let mean = |fit: &Fit| left_of(&merged.train, &fit.x, &with.weights);
    let x = whole(&with.x, &changes);
    let at = parts.more.start;
    let std = with.covariance[(at, at)].max(0.0).sqrt();
    if mean(&plain) < CLEAR || x[at] <= TOLD * std {
        return None;
    }
    // Each set by what its own numbers leave of it.
    let each = own.only(&[&own.bodies, &own.joints, &own.load]);
    let turned = problem.turned();
    let (here, there) = (problem.fit(&each)?, turned.fit(&each)?);
    let of_one = |alone: &Problem, fit: &Fit, part: f64| {
        left_of(&alone.train, &borne(&x, &own, &parts, part), &fit.weights) < SOME
    };
    if !of_one(&problem, &here, 0.0) || !of_one(&turned, &there, 1.0) {
        return None;
    }
    let gap = loaded(gap, &changes, &with, creep, &parts);
    let load = at_tip(&gap, &with, &parts.more);
    // A mass that is far off is hard to turn, which the sums do not know.
    let left = gap.residuals(Set::Heldout, &load.terms, &load.parameters)?;
    let left = sum_of_squares(&left) / gap.count(Set::Heldout) as f64;
    let rows: f64 = turned.train.iter().map(|sums| sums.rows).sum();
    let of_own: f64 = turned.train.iter().map(|sums| sums.left(&there.x) * sums.rows / rows).sum();
    (left < SOME * of_own).then_some(Carried { gap, load })
}

/// Returns the numbers of one set: beside what both bear a part of what one of them bears more.
fn borne(x: &DVector<f64>, own: &Parts, parts: &Parts, part: f64) -> DVector<f64> {
    let mut own_x = x.rows(0, own.count).into_owned();
    for (at, more) in own.load.clone().zip(parts.more.clone()) {
        own_x[at] += part * x[more];
    }
    own_x
}

/// Returns all numbers: those of the bodies, and what was fitted beside them.
fn whole(beside: &DVector<f64>, changes: &[[f64; NUMBERS]]) -> DVector<f64> {
    let mut x = beside.clone();
    x.iter_mut().zip(changes.iter().flatten()).for_each(|(x, by)| *x = *by);
    x
}

/// Returns the recordings held out, to be fitted and judged, with links, joints and what both bear as they are.
fn loaded(
    gap: &ArmGap,
    changes: &[[f64; NUMBERS]],
    with: &Fit,
    creep: f64,
    parts: &Parts,
) -> ArmGap {
    let (mut terms, mut values) = gap.known.clone();
    let of_joints = of_joints(&with.x, parts, creep);
    terms.extend(of_joints.0);
    values.extend(of_joints.1);
    let Hypothesis { terms: load, parameters, .. } = at_tip(gap, with, &parts.load);
    terms.extend(load);
    values.extend(parameters);
    gap.of_heldout(changes, (terms, values))
}

/// Returns a load in the frame of the tip instead of that of the last body.
fn at_tip(gap: &ArmGap, fit: &Fit, load: &Range<usize>) -> Hypothesis<Term> {
    let tip = gap.train[0].arm.chain.body_from_tip.inverse();
    let (rotation, place) = (tip.rotation.to_rotation_matrix(), tip.translation.vector);
    let n = load.len();
    let turned = DMatrix::from_fn(n, n, |i, j| match (i, j) {
        (0, _) => f64::from(u8::from(j == 0)),
        (_, 0) => place[i - 1],
        _ => rotation[(i - 1, j - 1)],
    });
    let covariance = fit.covariance.view((load.start, load.start), (n, n));
    Hypothesis {
        terms: vec![Term { law: Law::Payload, joint: 0 }],
        parameters: (&turned * fit.x.rows(load.start, n)).as_slice().to_vec(),
        covariance: &turned * covariance * turned.transpose(),
        surcharges: vec![0.0],
        gains: vec![0.0],
        ..Hypothesis::nothing()
    }
}
