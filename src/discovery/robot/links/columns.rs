//! What the recordings say of every number, written out as columns and summed up.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::channels::{Channel, Quantity};
use super::super::explain::ArmGap;
use super::super::simulate::Model;
use super::super::term::{Law, Term};
use super::body::{NUMBERS, spread};
use super::fit::{CREEPS, LOAD, OF_JOINT, Parts, Problem, Sums};
use super::rows::products;
use crate::discovery::selection::{Residuals as _, Set, related};

/// An angle so small that torques are linear in it, rad.
const LITTLE: f64 = 1e-3;

/// Sums up what the recordings say, once for each speed below which dry friction may give way.
pub(super) fn problems(gap: &ArmGap) -> Option<Vec<Problem>> {
    let [train, heldout] = [Set::Train, Set::Heldout].map(|set| {
        let columns = Columns::of(gap, set)?;
        let all = CREEPS.into_iter().map(|creep| columns.summed(gap, creep, &[]));
        all.collect::<Option<Vec<Vec<Sums>>>>()
    });
    let pairs = train?.into_iter().zip(heldout?);
    Some(pairs.map(|pair| problem(gap, pair, 0)).collect())
}

/// Returns what is to be fitted of the sums of those fitted and held out, with so many `more` numbers of which nothing is known.
pub(super) fn problem(
    gap: &ArmGap,
    (train, heldout): (Vec<Sums>, Vec<Sums>),
    more: usize,
) -> Problem {
    let bodies = &gap.train[0].arm.chain.bodies;
    let mut prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
    let mut is_up = vec![false; prior.len()];
    for joint in 0..gap.train[0].arm.chain.n() {
        let known = gap.train.iter().map(|model| model.arm.armature[joint]).fold(0.0, f64::max);
        prior.extend(OF_JOINT.map(|_| f64::INFINITY));
        is_up.extend([true, true, false, known <= 0.0]);
    }
    prior.extend(LOAD.map(|_| f64::INFINITY));
    is_up.extend([true, false, false, false]);
    // What the model says is no number to be fitted.
    prior.push(0.0);
    is_up.push(false);
    let named = Parts::of(bodies.len()).named.len();
    prior.resize(prior.len() + named + more, f64::INFINITY);
    is_up.resize(prior.len(), false);
    Problem { train, heldout, prior, is_up }
}

/// What is left of each row of a set, and by how much it falls for one unit more of each number.
pub(super) struct Columns {
    set: Set,
    here: Vec<f64>,
    bodies: Vec<Vec<f64>>,
    /// Of each joint viscous friction, offset and rotor.
    joints: [Vec<Vec<f64>>; 3],
    modelled: Vec<f64>,
    /// For little of each: springs, zeros, the base's roll and pitch.
    named: Vec<Vec<f64>>,
}

impl Columns {
    /// Writes out the recordings of a set.
    pub(super) fn of(gap: &ArmGap, set: Set) -> Option<Self> {
        let models = gap.models(set);
        let n = models.first()?.arm.chain.n();
        let here = gap.residuals(set, &[], &[])?;
        let each: Vec<_> = models.par_iter().map(Model::body_columns).collect();
        let mut bodies = vec![Vec::new(); n * NUMBERS];
        for columns in each {
            bodies.iter_mut().zip(columns).for_each(|(all, one)| all.extend(one));
        }
        let [viscous, offset, rotor] = [Law::Viscous, Law::TorqueOffset, Law::Armature]
            .map(|law| of_law(gap, set, &here, (law, &[1.0])));
        // What a sensor would show twice is what the model says of it.
        let mut modelled = vec![0.0; here.len()];
        for column in of_law(gap, set, &here, (Law::TorqueGain, &[2.0]))? {
            modelled.iter_mut().zip(column).for_each(|(sum, one)| *sum += one);
        }
        let mut named = of_law(gap, set, &here, (Law::Stiffness, &[1.0]))?;
        named.extend(of_law(gap, set, &here, (Law::ZeroOffset, &[LITTLE]))?);
        for tilt in [[LITTLE, 0.0], [0.0, LITTLE]] {
            named.push(of_term(gap, set, &here, Term { law: Law::BaseTilt, joint: 0 }, &tilt)?);
        }
        Some(Self { set, here, bodies, joints: [viscous?, offset?, rotor?], modelled, named })
    }

    /// Returns what every torque sensor says where dry friction gives way below `creep` rad/s, with `more` numbers after all others.
    pub(super) fn summed(&self, gap: &ArmGap, creep: f64, more: &[&Vec<f64>]) -> Option<Vec<Sums>> {
        let dry = of_law(gap, self.set, &self.here, (Law::Coulomb, &[1.0, creep]))?;
        let [viscous, offset, rotor] = &self.joints;
        let of_joint = |j: usize| [&viscous[j], &dry[j], &offset[j], &rotor[j]];
        let n = viscous.len();
        let load = self.bodies[(n - 1) * NUMBERS..].iter().take(LOAD.len());
        let numbers = self.bodies.iter().chain((0..n).flat_map(of_joint)).chain(load);
        let columns: Vec<&Vec<f64>> = numbers
            .chain([&self.modelled])
            .chain(&self.named)
            .chain(more.iter().copied())
            .collect();
        summed(gap, self.set, &self.here, &columns)
    }
}

/// Returns by how much `here` falls for a law at each joint.
fn of_law(
    gap: &ArmGap,
    set: Set,
    here: &[f64],
    (law, parameters): (Law, &[f64]),
) -> Option<Vec<Vec<f64>>> {
    let n = gap.models(set).first()?.arm.chain.n();
    let column = |joint: usize| of_term(gap, set, here, Term { law, joint }, parameters);
    (0..n).into_par_iter().map(column).collect()
}

/// Returns by how much `here` falls for an effect.
fn of_term(
    gap: &ArmGap,
    set: Set,
    here: &[f64],
    term: Term,
    parameters: &[f64],
) -> Option<Vec<f64>> {
    let there = gap.residuals(set, &[term], parameters)?;
    Some(here.iter().zip(there).map(|(here, there)| here - there).collect())
}

/// Sums columns and residuals up, sensor by sensor.
pub(super) fn summed(
    gap: &ArmGap,
    set: Set,
    here: &[f64],
    columns: &[&Vec<f64>],
) -> Option<Vec<Sums>> {
    let blocks = gap.blocks(set);
    let channels = gap.train[0].course.data.channels.iter().enumerate();
    let torques = channels.filter(|(_, channel)| channel.quantity == Quantity::Torque);
    let of = |(sensor, channel): (usize, &Channel)| {
        let rows: Vec<usize> = blocks
            .iter()
            .filter(|block| block.sensor == sensor)
            .flat_map(|block| block.rows.clone())
            .filter(|row| here[*row].abs() > 0.0)
            .collect();
        let a = DMatrix::from_fn(rows.len(), columns.len(), |i, k| columns[k][rows[i]]);
        let b = DVector::from_fn(rows.len(), |i, _| here[rows[i]]);
        let gram = products(&a);
        let along = a.tr_mul(&b);
        // How long what no number explains lasts: by what the richest fit leaves.
        let ridge = DMatrix::from_diagonal(&gram.diagonal().map(|d| 1e-9 * d + 1e-300));
        let solved = (&gram + ridge).cholesky()?.solve(&along);
        let left = &b - &a * solved;
        let (square, count) = (b.norm_squared(), rows.len() as f64);
        let related = related(left.as_slice());
        Some(Sums { joint: channel.index, gram, along, square, rows: count, related })
    };
    torques.map(of).collect()
}
