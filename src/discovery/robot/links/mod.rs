//! The numbers of the links, identified before any effect is looked for: mass, centre and inertia of every body, beside
//! what every joint of a real arm has.
//!
//! A maker's file is never exact, and what its numbers are off by looks like effects that are not there. Torques are linear
//! in all of these numbers; most of them show only in sums, so each is held near the file's, as near as a file is usually
//! right, and every body stays one that could be: its pseudo-inertia is positive. What comes of it is taken only if it
//! predicts the recordings held out clearly better, and no single link or load does as well: that has a name.
//!
//! Source: Gautier and Khalil, "Direct calculation of minimum set of inertial parameters", 1990; Traversaro et al.,
//! "Identification of fully physical consistent inertial parameters using optimization on manifolds", 2016; Wensing, Kim
//! and Slotine, "Linear matrix inequalities for physically consistent inertial parameter identification", 2018.

pub(super) mod body;
mod fit;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::chain::{Body, Chain};
use super::data::Quantity;
use super::explain::ArmGap;
use super::simulate::Model;
use super::term::{Law, Term};
use crate::discovery::finding::Identified;
use crate::discovery::selection::{Gap as _, Set, related};
use crate::motion::revise::{LinkChange, Revision};
use crate::units::significant;
use body::{NAMES, NUMBERS, numbers, spread};
use fit::{Fit, LOAD, OF_JOINT, Parts, Problem, Sums, consistent, left_of};

/// By how much the links' numbers must predict better to be taken: by a tenth of what is left.
pub(super) const BETTER: f64 = 0.9;
/// A number is told if the data say more of it than the file does: its uncertainty fell to this part.
const TOLD: f64 = 0.5;
/// Speeds below which dry friction may give way, rad/s; the one that fits best is taken.
pub(super) const CREEPS: [f64; 4] = [1e-3, 4e-3, 1.6e-2, 5e-2];

/// The bodies of an arm as its recordings have them.
#[derive(Debug)]
pub(super) struct Links {
    /// What is added to each body's numbers.
    pub(super) changes: Vec<[f64; NUMBERS]>,
    /// Those that the data tell.
    pub(super) told: Vec<Identified>,
    /// Whether they predict clearly better than the file's with any single link heavier, or with a load.
    pub(super) is_better: bool,
}

impl Links {
    /// Returns what these numbers change in the arm's file, in which its links have the names of its bodies.
    pub(super) fn revision(&self, chain: &Chain) -> Revision {
        let of = |(body, by): (&Body, &[f64; NUMBERS])| LinkChange {
            link: body.name.clone(),
            mass: by[0],
            moment: Vector3::new(by[1], by[2], by[3]),
            inertia: Matrix3::new(by[4], by[5], by[6], by[5], by[7], by[8], by[6], by[8], by[9]),
        };
        let links = chain.bodies.iter().zip(&self.changes).map(of).collect();
        Revision { links, joints: Vec::new() }
    }
}

/// What the numbers of an arm come to, before any effect is looked for.
#[derive(Debug)]
pub(super) enum Numbers {
    /// Others than the file's.
    Own(Links),
    /// Those of the recordings fitted are not those of the recordings held out, by these words.
    Different(String),
}

/// Identifies the numbers of the links; `None` where the file's, with one link heavier or with a load in the hand, predict the
/// recordings held out better: those have names.
pub(super) fn identified(gap: &ArmGap) -> Option<Numbers> {
    let model = gap.train.first()?;
    let has_torque = |model: &Model| model.scene.data.has(Quantity::Torque);
    if !gap.is_along() || !gap.train.iter().chain(&gap.heldout).all(has_torque) {
        return None;
    }
    let gap = gap.for_search();
    let bodies = &model.arm.chain.bodies;
    let problems = problems(&gap)?;
    let parts = Parts::of(bodies.len());
    let scored = problems.into_iter().filter_map(|p| {
        let fit = p.fit(&parts.only(&[&parts.joints]))?;
        let sums = p.train.iter().map(|sums| sums.left(&fit.x) / (sums.square / sums.rows));
        Some((sums.sum::<f64>(), p, fit))
    });
    let (_, problem, bare) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let loaded = problem.fit(&parts.only(&[&parts.joints, &parts.load]))?;
    let heavier = bodies.iter().enumerate().filter_map(|(at, body)| {
        let mut directions = parts.only(&[&parts.joints]);
        directions = directions.insert_column(0, 0.0);
        let own = numbers(body);
        (0..NUMBERS).for_each(|k| directions[(at * NUMBERS + k, 0)] = own[k]);
        if own[0] > 0.0 { problem.fit(&directions) } else { None }
    });
    let plain: Vec<Fit> = [bare, loaded].into_iter().chain(heavier).collect();
    let lists = [&[&parts.bodies, &parts.joints][..], &[&parts.bodies, &parts.joints, &parts.load]];
    let freed = lists.into_par_iter().filter_map(|list| {
        let free = problem.fit(&parts.only(list))?;
        let changes = consistent(&problem, bodies, &parts, &free)?;
        // The others once more beside bodies that could be.
        let with = problem.beside(&changes).fit(&parts.only(&list[1..]))?;
        Some((changes, free, with))
    });
    let freed: Vec<_> = freed.collect();
    let weights =
        freed.iter().map(|(.., with)| with).min_by(|a, b| a.total().total_cmp(&b.total()))?;
    let weights = weights.weights.clone();
    let judged =
        |fit: &Fit, changes: &[[f64; NUMBERS]]| problem.beside(changes).judged(&fit.x, &weights);
    let as_filed = vec![[0.0; NUMBERS]; bodies.len()];
    let plainest = plain.iter().map(|fit| judged(fit, &as_filed)).fold(f64::INFINITY, f64::min);
    let best = freed
        .into_iter()
        .map(|(changes, free, with)| (judged(&with, &changes), changes, free))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (left, changes, free) = best;
    if let Some(words) = different(&problem, &parts, left.min(plainest), &weights) {
        return Some(Numbers::Different(words));
    }
    (left <= plainest).then(|| {
        let told = told(bodies, &changes, &free, &problem.prior);
        Numbers::Own(Links { changes, told, is_better: left <= BETTER * plainest })
    })
}

/// How many times more a fit may leave of recordings it was not fitted to than theirs of themselves, in squares, and still
/// be of the same machine.
const ANOTHER: f64 = 10.0;

/// Says by which numbers the recordings held out are of another machine than those fitted, if they are.
fn different(problem: &Problem, parts: &Parts, left: f64, weights: &[f64]) -> Option<String> {
    let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load]);
    let here = problem.fit(&all)?;
    let turned = problem.turned();
    let there = turned.fit(&all)?;
    let own = left_of(&turned.train, &there.x, weights);
    if left < ANOTHER * own.max(1.0) {
        return None;
    }
    let apart = |at: usize| {
        let variance = here.covariance[(at, at)] + there.covariance[(at, at)];
        (here.x[at] - there.x[at]).abs() / variance.max(1e-300).sqrt()
    };
    let named =
        (parts.joints.start..parts.load.end).max_by(|a, b| apart(*a).total_cmp(&apart(*b)))?;
    let (what, unit) = parts.name(named);
    Some(format!(
        "{what} is {} {unit} in the recordings fitted and {} {unit} in those held out",
        significant(here.x[named], 3),
        significant(there.x[named], 3)
    ))
}

/// Sums up what the recordings say, once for each speed below which dry friction may give way.
fn problems(gap: &ArmGap) -> Option<Vec<Problem>> {
    let n = gap.train[0].arm.chain.n();
    let bodies = &gap.train[0].arm.chain.bodies;
    let mut prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
    let mut is_up = vec![false; prior.len()];
    for joint in 0..n {
        let known = gap.train.iter().map(|model| model.arm.armature[joint]).fold(0.0, f64::max);
        prior.extend(OF_JOINT.map(|_| f64::INFINITY));
        is_up.extend([true, true, false, known <= 0.0]);
    }
    prior.extend(LOAD.map(|_| f64::INFINITY));
    is_up.extend([true, false, false, false]);
    let [train, heldout] = [Set::Train, Set::Heldout].map(|set| sums(gap, set));
    let pairs = train?.into_iter().zip(heldout?);
    let problem =
        |(train, heldout)| Problem { train, heldout, prior: prior.clone(), is_up: is_up.clone() };
    Some(pairs.map(problem).collect())
}

/// Returns what every torque sensor says, once for each creep.
fn sums(gap: &ArmGap, set: Set) -> Option<Vec<Vec<Sums>>> {
    let models = if set == Set::Train { &gap.train } else { &gap.heldout };
    let n = models.first()?.arm.chain.n();
    let here = gap.residuals(set, &[], &[])?;
    let of_body = |at: usize| -> Vec<f64> {
        models.iter().flat_map(|m| m.body_column(at / NUMBERS, at % NUMBERS)).collect()
    };
    let bodies: Vec<Vec<f64>> = (0..n * NUMBERS).into_par_iter().map(of_body).collect();
    let column = |(law, joint, parameters): (Law, usize, Vec<f64>)| -> Option<Vec<f64>> {
        let there = gap.residuals(set, &[Term { law, joint }], &parameters)?;
        Some(here.iter().zip(there).map(|(here, there)| here - there).collect())
    };
    let all = |law: Law, parameters: &[f64]| -> Option<Vec<Vec<f64>>> {
        (0..n).into_par_iter().map(|joint| column((law, joint, parameters.to_vec()))).collect()
    };
    let [viscous, offset, rotor] =
        [Law::Viscous, Law::TorqueOffset, Law::Armature].map(|law| all(law, &[1.0]));
    let (viscous, offset, rotor) = (viscous?, offset?, rotor?);
    let with = |creep: f64| -> Option<Vec<Sums>> {
        let dry = all(Law::Coulomb, &[1.0, creep])?;
        let of_joint = |j: usize| [&viscous[j], &dry[j], &offset[j], &rotor[j]];
        let load = bodies[(n - 1) * NUMBERS..].iter().take(LOAD.len());
        let columns: Vec<&Vec<f64>> =
            bodies.iter().chain((0..n).flat_map(of_joint)).chain(load).collect();
        summed(gap, set, &here, &columns)
    };
    CREEPS.into_iter().map(with).collect()
}

/// Sums columns and residuals up, sensor by sensor.
fn summed(gap: &ArmGap, set: Set, here: &[f64], columns: &[&Vec<f64>]) -> Option<Vec<Sums>> {
    let blocks = gap.blocks(set);
    let channels = gap.train[0].scene.data.channels.iter().enumerate();
    let torques = channels.filter(|(_, channel)| channel.quantity == Quantity::Torque);
    let of = |(sensor, _)| {
        let rows: Vec<usize> = blocks
            .iter()
            .filter(|block| block.sensor == sensor)
            .flat_map(|block| block.rows.clone())
            .filter(|row| here[*row].abs() > 0.0)
            .collect();
        let a = DMatrix::from_fn(rows.len(), columns.len(), |i, k| columns[k][rows[i]]);
        let b = DVector::from_fn(rows.len(), |i, _| here[rows[i]]);
        let gram = a.tr_mul(&a);
        let along = a.tr_mul(&b);
        // How long what no number explains lasts: by what the richest fit leaves.
        let ridge = DMatrix::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
        let solved = (&gram + ridge).cholesky()?.solve(&along);
        let left = &b - &a * solved;
        let (square, count) = (b.norm_squared(), rows.len() as f64);
        Some(Sums { gram, along, square, rows: count, related: related(left.as_slice()) })
    };
    torques.map(of).collect()
}

/// Returns the numbers of which the data say more than the file does, and something else.
fn told(bodies: &[Body], changes: &[[f64; NUMBERS]], fit: &Fit, prior: &[f64]) -> Vec<Identified> {
    let mut found = Vec::new();
    for (b, (body, changes)) in bodies.iter().zip(changes).enumerate() {
        let own = numbers(body);
        for (k, (name, unit)) in NAMES.iter().enumerate() {
            let at = b * NUMBERS + k;
            let std = fit.covariance[(at, at)].max(0.0).sqrt();
            if std < TOLD * prior[at] && changes[k].abs() > 2.0 * std {
                found.push(Identified {
                    name: "inertial".into(),
                    at: body.name.clone(),
                    parameter: (*name).to_owned(),
                    file: own[k],
                    value: own[k] + changes[k],
                    std,
                    unit: (*unit).to_owned(),
                });
            }
        }
    }
    found
}
