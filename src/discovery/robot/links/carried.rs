//! What the recordings held out carry more than those fitted: numbers of links and joints that are common to both, and a load
//! that only one of them has.

use std::ops::Range;

use nalgebra::DMatrix;

use super::super::explain::ArmGap;
use super::super::term::{Law, Term};
use super::body::{FAR_OUT, NUMBERS, point};
use super::columns::problems;
use super::fit::{CREEPS, Fit, Parts, Problem, Sums, left_of};
use super::single::AGREEING;
use super::{SOME, of_joints};
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

/// The loads that are told, with the inertia that each has where it is.
struct Loads {
    /// What all recordings bear and what those held out bear more, as numbers of the last body ([`point`]).
    points: [DMatrix<f64>; 2],
    /// Whether all recordings bear something.
    is_common: bool,
}

impl Loads {
    /// Finds them: inertia follows from mass and moment, which are fitted anew with it until they agree.
    fn of(problem: &Problem, own: &Parts, parts: &Parts) -> Option<Self> {
        let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load, &parts.more]);
        let mut loads = Self { points: [point([0.0; 4]), point([0.0; 4])], is_common: false };
        for _ in 0..AGREEING {
            let fit = problem.seen(own, &own.seen(&loads.points)).merged().fit(&all)?;
            loads.is_common = is_told(&fit, &parts.load);
            loads.points = [&parts.load, &parts.more].map(|load| {
                let numbers = std::array::from_fn(|k| fit.x[load.start + k]);
                point(if is_told(&fit, load) { numbers } else { [0.0; 4] })
            });
        }
        Some(loads)
    }
}

/// Returns whether a load weighs something, by how sure a fit is of it.
fn is_told(fit: &Fit, load: &Range<usize>) -> bool {
    let at = load.start;
    fit.x[at] > TOLD * fit.covariance[(at, at)].max(0.0).sqrt()
}

/// Returns the load that makes the recordings held out and those fitted recordings of one machine, if there is one: beside
/// what both bear. Links share the weight, so they are free beside it, and whether each could be is not asked: thin ones would
/// lean to one side, and the load with them.
pub(in super::super) fn carried(gap: &ArmGap) -> Option<Carried> {
    let thinned = gap.for_search();
    let bodies = &gap.train[0].arm.chain.bodies;
    let own = Parts::of(bodies.len());
    let parts = own.merged();
    let problems = problems(&thinned)?;
    let loads = Loads::of(problems.first()?, &own, &parts)?;
    let seen = own.seen(&loads.points);
    let common = loads.is_common.then_some(&parts.load);
    let list: Vec<_> =
        [&parts.bodies, &parts.joints, &parts.more].into_iter().chain(common).collect();
    let all = parts.only(&list);
    let merged = problems.into_iter().zip(CREEPS).filter_map(|(problem, creep)| {
        let sets = problem.seen(&own, &seen);
        let merged = sets.merged();
        let fit = merged.fit(&all)?;
        Some((sets, merged, fit, creep))
    });
    let (sets, merged, fit, creep) = merged.min_by(|a, b| a.2.total().total_cmp(&b.2.total()))?;
    let plain = merged.fit(&parts.only(&[&parts.bodies, &parts.joints, &parts.load]))?;
    let is_needed = left_of(&merged.train, &plain.x, &fit.weights) >= CLEAR;
    if !is_needed || !is_told(&fit, &parts.more) {
        return None;
    }
    // Each set by what its own numbers leave of it.
    let here = sets.fit(&parts.only(&[&parts.bodies, &parts.joints, &parts.load]))?;
    let there = sets.turned().fit(&parts.only(&[&parts.bodies, &parts.joints, &parts.more]))?;
    let is_of_one = |sums: &[Sums], own: &Fit| left_of(sums, &fit.x, &own.weights) < SOME;
    if !is_of_one(&sets.train, &here) || !is_of_one(&sets.heldout, &there) {
        return None;
    }
    let gap = loaded(gap, &fit, creep, &parts);
    let load = at_tip(&gap, &fit, &parts.more);
    // The same by all rows, and by the law that is told.
    let left = gap.residuals(Set::Heldout, &load.terms, &load.parameters)?;
    let left = sum_of_squares(&left) / gap.count(Set::Heldout) as f64;
    let rows: f64 = sets.heldout.iter().map(|sums| sums.rows).sum();
    let of_own: f64 = sets.heldout.iter().map(|sums| sums.left(&there.x) * sums.rows / rows).sum();
    (left < SOME * of_own).then_some(Carried { gap, load })
}

/// Returns the recordings held out, to be fitted and judged, with links, joints and what both bear as they are.
fn loaded(gap: &ArmGap, fit: &Fit, creep: f64, parts: &Parts) -> ArmGap {
    let (mut terms, mut values) = gap.known.clone();
    let of_joints = of_joints(&fit.x, parts, creep);
    terms.extend(of_joints.0);
    values.extend(of_joints.1);
    if fit.x[parts.load.start] > 0.0 {
        let Hypothesis { terms: load, parameters, .. } = at_tip(gap, fit, &parts.load);
        terms.extend(load);
        values.extend(parameters);
    }
    let bodies = 0..parts.bodies.len() / NUMBERS;
    let changes: Vec<[f64; NUMBERS]> =
        bodies.map(|body| std::array::from_fn(|k| fit.x[body * NUMBERS + k])).collect();
    gap.of_heldout(&changes, (terms, values))
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
    let mut covariance = fit.covariance.view((load.start, load.start), (n, n)).into_owned();
    // A moment that could be that of a place out of reach is one that the motion does not show.
    let reach = FAR_OUT * fit.x[load.start];
    let open: Vec<usize> = (1..n).filter(|i| covariance[(*i, *i)].sqrt() > reach).collect();
    leave_open(&mut covariance, &open);
    let mut covariance = &turned * covariance * turned.transpose();
    let is_open = |i: &usize| open.iter().any(|k| turned[(*i, *k)].abs() > ROUNDED);
    leave_open(&mut covariance, &(1..n).filter(is_open).collect::<Vec<_>>());
    Hypothesis {
        terms: vec![Term { law: Law::Payload, joint: 0 }],
        parameters: (&turned * fit.x.rows(load.start, n)).as_slice().to_vec(),
        covariance,
        surcharges: vec![0.0],
        gains: vec![0.0],
        ..Hypothesis::nothing()
    }
}

/// Entries of a rotation below this are rounding.
const ROUNDED: f64 = 1e-9;

/// Takes the variance from numbers that nothing determines, as [`crate::fit::Fit::covariance`] has it.
fn leave_open(covariance: &mut DMatrix<f64>, open: &[usize]) {
    for &i in open {
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
    }
}
