//! The numbers of the links, identified before any effect is looked for: mass, centre and inertia of every body, beside
//! what every joint of a real arm has.
//!
//! A maker's file is never exact, and what its numbers are off by looks like effects that are not there. Torques are linear
//! in all of these numbers; most of them show only in sums, so each is held near the file's, as near as a file is usually
//! right, and every body stays one that could be: its pseudo-inertia is positive. What comes of it is taken only if it
//! predicts the recordings held out clearly better, and no single effect does as well that has a name: a heavier link, a load, a
//! spring, a joint's zero, a tilt of the base.
//!
//! Source: Gautier and Khalil, "Direct calculation of minimum set of inertial parameters", 1990; Traversaro et al.,
//! "Identification of fully physical consistent inertial parameters using optimization on manifolds", 2016; Wensing, Kim
//! and Slotine, "Linear matrix inequalities for physically consistent inertial parameter identification", 2018.

mod apart;
pub(super) mod body;
mod carried;
mod fit;
mod gains;
mod late;
mod parted;
mod signs;
mod single;

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::chain::{Body, Chain};
use super::channels::{Channel, Quantity};
use super::explain::ArmGap;
use super::simulate::Model;
use super::term::{Law, Term};
use super::wording;
use crate::discovery::finding::Identified;
use crate::discovery::selection::{Hypothesis, Residuals as _, Rival, Set, related};
use crate::motion::revise::{LinkChange, Revision};
use apart::{ANOTHER, Apart, SOME, heard, uncertain};
use body::{NAMES, NUMBERS, numbers, spread};
use fit::{Fit, LOAD, OF_JOINT, Parts, Problem, Sums, consistent};
use gains::Shown;
use single::named;

pub(super) use carried::{Carried, carried};
pub(super) use late::late;
pub(super) use parted::{Alone, DIFFERS, MATTERS, Spread};
pub(super) use signs::Turned;

/// By how much the links' numbers must predict better to be taken: by a tenth of what is left.
pub(super) const BETTER: f64 = 0.9;
/// A number is told if the data say more of it than the file does: its uncertainty fell to this part.
const TOLD: f64 = 0.5;
/// A number of a joint is told from the bodies' if it is this many times its standard deviation beside them.
const SURE: f64 = 4.0;
/// An angle so small that torques are linear in it, rad.
const LITTLE: f64 = 1e-3;
/// Speeds below which dry friction may give way, rad/s; the one that fits best is taken.
pub(super) const CREEPS: [f64; 4] = [1e-3, 4e-3, 1.6e-2, 5e-2];

/// The bodies of an arm as its recordings have them.
#[derive(Debug)]
pub(super) struct Links {
    /// What is added to each body's numbers.
    pub(super) changes: Vec<[f64; NUMBERS]>,
    /// Those that the data tell.
    pub(super) told: Vec<Identified>,
    /// Says which of them is further from the file's than files are off, if one is.
    pub(super) far: Option<String>,
    /// Whether a load was taken beside them.
    pub(super) has_load: bool,
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

/// A torque sensor that shows more or less than there is, by a factor.
#[derive(Debug)]
pub(super) struct Gain {
    pub(super) joint: usize,
    pub(super) factor: f64,
    /// One standard deviation of it.
    pub(super) std: f64,
    /// The bodies that go with it.
    pub(super) links: Links,
    /// How much it explains beside them, in -2 ln of the odds.
    explained: f64,
}

impl Gain {
    /// Returns it in the place of the gain chosen, which is the effect of a hypothesis at `at`.
    pub(super) fn instead_of(&self, chosen: &Self, at: usize, h: &Hypothesis<Term>) -> Rival<Term> {
        let behind = chosen.explained - self.explained;
        let own = h.parameters.len() - h.terms.iter().map(|t| t.law.specs().len()).sum::<usize>();
        let before: usize = h.terms[..at].iter().map(|term| term.law.specs().len()).sum();
        let mut other = h.clone();
        let last = h.parameters.len() - 1;
        other.terms.remove(at);
        other.parameters.remove(own + before);
        other.terms.push(Term { law: Law::TorqueGain, joint: self.joint });
        other.parameters.push(self.factor);
        let covariance = std::mem::take(&mut other.covariance)
            .remove_row(own + before)
            .remove_column(own + before);
        other.covariance = covariance.insert_row(last, 0.0).insert_column(last, 0.0);
        other.covariance[(last, last)] = self.std.powi(2);
        other.train += behind;
        Rival { instead_of: at, hypothesis: other, behind, stability: 0.0 }
    }
}

/// What the numbers of an arm come to, before any effect is looked for.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// Whether the recordings held out say so much else than those fitted that some may bear a load.
    pub(super) are_apart: bool,
    /// Torques that have the wrong sign; nothing else is asked of them.
    pub(super) turned: Option<Turned>,
    /// Whether the recordings fitted are too short to tell of the joints; nothing else is asked of them then.
    pub(super) is_too_short: bool,
    /// By which words they are not of one machine at all.
    pub(super) different: Option<String>,
    /// Others than the file's, where they are of one; then, the best first, gains of torque sensors beside which still others
    /// fit much better. Nothing where the file's, as they are, with one link heavier or with a load in the hand, predict the
    /// recordings held out better: those have names.
    pub(super) own: Option<(Links, Vec<Gain>)>,
}

/// Returns whether every recording says what its motion took.
fn tells(gap: &ArmGap) -> bool {
    let has_torque = |model: &Model| model.course.data.has(Quantity::Torque);
    gap.is_along() && gap.train.iter().chain(&gap.heldout).all(has_torque)
}

/// Identifies the numbers of the links; `None` where the recordings say nothing of them.
pub(super) fn identified(gap: &ArmGap) -> Option<Numbers> {
    let model = gap.train.first()?;
    if !tells(gap) {
        return None;
    }
    let gap = gap.for_search();
    let bodies = &model.arm.chain.bodies;
    let parts = Parts::of(bodies.len());
    let (problem, bare) = best(problems(&gap)?, &parts)?;
    if uncertain(&problem, &bare) > 1.0 {
        return Some(Numbers { is_too_short: true, ..Numbers::default() });
    }
    if let Some(turned) = Turned::of(&problem, &parts) {
        return Some(Numbers { turned: Some(turned), ..Numbers::default() });
    }
    let beside = [&[&parts.joints][..], &[&parts.joints, &parts.load]];
    let freed = beside.par_iter().filter_map(|list| Freed::of(&problem, bodies, &parts, list));
    let freed: Vec<Freed> = freed.collect();
    let least = freed.iter().map(|f| &f.with).min_by(|a, b| a.total().total_cmp(&b.total()))?;
    let weights = heard(&problem, &parts, &least.weights)?;
    if weights.iter().all(|weight| weight.is_infinite()) {
        return Some(Numbers::default());
    }
    let with_gains = |list: &[&Range<usize>], without: &Fit| {
        // What an ampere is worth was fitted: a gain is in it.
        if model.course.data.are_currents {
            return Vec::new();
        }
        gains::shown(&problem, &parts, list, without)
    };
    let named = named(&problem, &parts, bodies, &weights);
    // What was fitted of the joints may be worse than nothing, of what it was not fitted to.
    let as_filed = DVector::zeros(problem.prior.len());
    let loaded = [&parts.joints, &parts.load];
    let with_load = problem.fit(&parts.only(&loaded));
    let beside_load = with_load.map(|fit| with_gains(&loaded, &fit)).unwrap_or_default();
    let plainest = with_gains(&[&parts.joints], &bare)
        .iter()
        .chain(&beside_load)
        .map(|shown| shown.problem.judged(&shown.fit.x, &weights))
        .chain([&bare.x, &as_filed].map(|x| problem.judged(x, &weights)))
        .chain(named)
        .fold(f64::INFINITY, f64::min);
    let best = Freed::best(freed, &problem, bodies, &weights)?;
    let left = best.judged(&problem, &weights);
    let apart = Apart::of(&problem, &parts, left.min(plainest), &weights)?;
    // Where those fitted bear it, the file as it is may be right of those held out, and what was fitted is not.
    let are_apart = apart.by > SOME || left > SOME * plainest;
    if apart.by > ANOTHER {
        let different = Some(apart.words(&parts));
        return Some(Numbers { are_apart, different, ..Numbers::default() });
    }
    if left > plainest {
        return Some(Numbers { are_apart, ..Numbers::default() });
    }
    let gains = with_gains(&best.list(&parts), &best.free).into_iter().filter_map(|shown| {
        let problem = &shown.problem;
        let freed = beside.iter().filter_map(|list| Freed::of(problem, bodies, &parts, list));
        let freed = Freed::best(freed.collect(), problem, bodies, &weights)?;
        let left_with = freed.judged(problem, &weights);
        let links = freed.links(bodies, &problem.prior, left_with <= BETTER * plainest);
        let Shown { joint, gain: factor, std, explained, .. } = shown;
        (left_with < left).then_some(Gain { joint, factor, std, links, explained })
    });
    let gains = gains.collect();
    let links = best.links(bodies, &problem.prior, left <= BETTER * plainest);
    Some(Numbers { are_apart, own: Some((links, gains)), ..Numbers::default() })
}

/// Returns the problem with the creep that fits best beside the file's bodies, and its fit of the joints.
fn best(problems: Vec<Problem>, parts: &Parts) -> Option<(Problem, Fit)> {
    let scored = problems.into_iter().filter_map(|problem| {
        let fit = problem.fit(&parts.only(&[&parts.joints]))?;
        let sums = problem.train.iter().map(|sums| sums.left(&fit.x) / (sums.square / sums.rows));
        Some((sums.sum::<f64>(), problem, fit))
    });
    let (_, problem, fit) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((problem, fit))
}

/// Returns what was fitted of the joints as effects with their parameters.
fn of_joints(x: &DVector<f64>, parts: &Parts, creep: f64) -> (Vec<Term>, Vec<f64>) {
    let laws = [Law::Viscous, Law::Coulomb, Law::TorqueOffset, Law::Armature];
    let (mut terms, mut values) = (Vec::new(), Vec::new());
    for (k, value) in x.rows(parts.joints.start, parts.joints.len()).iter().enumerate() {
        let law = laws[k % OF_JOINT.len()];
        terms.push(Term { law, joint: k / OF_JOINT.len() });
        values.push(*value);
        values.extend((law == Law::Coulomb).then_some(creep));
    }
    (terms, values)
}

/// Numbers of bodies that fit, and could be.
struct Freed<'a> {
    /// What was fitted beside them.
    beside: &'a [&'a Range<usize>],
    changes: Vec<[f64; NUMBERS]>,
    /// The fit of all of them, whether they could be or not.
    free: Fit,
    /// The fit of the others, beside bodies that could be.
    with: Fit,
}

impl<'a> Freed<'a> {
    fn of(
        problem: &Problem,
        bodies: &[Body],
        parts: &'a Parts,
        beside: &'a [&'a Range<usize>],
    ) -> Option<Self> {
        let free = problem.fit(&parts.only(&[&[&parts.bodies], beside].concat()))?;
        // What is not sure beside the bodies is left to them: beside bodies that are fixed it would look sure.
        let sure = |at: usize| {
            let is_open = parts.joints.contains(&at);
            !is_open || free.x[at].abs() > SURE * free.covariance[(at, at)].sqrt()
        };
        let all = [&[&parts.bodies], beside].concat().into_iter().flat_map(Range::clone);
        let each: Vec<Range<usize>> = all.filter(|at| sure(*at)).map(|at| at..at + 1).collect();
        let free = problem.fit(&parts.only(&each.iter().collect::<Vec<_>>()))?;
        let changes = consistent(problem, bodies, parts, &free)?;
        let with = problem.beside(&changes).fit(&parts.only(beside))?;
        Some(Self { beside, changes, free, with })
    }

    /// Returns the one to be taken. A load has a name, and is one only if it does clearly more than the links' own numbers, or
    /// they would have to be what numbers of files are not.
    fn best(all: Vec<Self>, problem: &Problem, bodies: &[Body], weights: &[f64]) -> Option<Self> {
        let is_far = |freed: &Self| freed.beside.len() == 1 && freed.is_far(bodies, &problem.prior);
        let better = if all.iter().any(is_far) { 1.0 } else { BETTER };
        let cost = |freed: &Self| {
            freed.judged(problem, weights) / if freed.beside.len() > 1 { better } else { 1.0 }
        };
        all.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// Returns all that was fitted.
    fn list(&self, parts: &'a Parts) -> Vec<&'a Range<usize>> {
        [&[&parts.bodies], self.beside].concat()
    }

    /// Returns what it leaves of the recordings held out.
    fn judged(&self, problem: &Problem, weights: &[f64]) -> f64 {
        problem.beside(&self.changes).judged(&self.with.x, weights)
    }

    /// Returns whether a number is further from the file's than numbers of files are.
    fn is_far(&self, bodies: &[Body], prior: &[f64]) -> bool {
        far(bodies, &told(bodies, &self.changes, &self.free, prior)).is_some()
    }

    fn links(self, bodies: &[Body], prior: &[f64], is_better: bool) -> Links {
        let told = told(bodies, &self.changes, &self.free, prior);
        let has_load = self.beside.len() > 1;
        Links { far: far(bodies, &told), changes: self.changes, told, has_load, is_better }
    }
}

/// Sums up what the recordings say, once for each speed below which dry friction may give way.
fn problems(gap: &ArmGap) -> Option<Vec<Problem>> {
    let [train, heldout] = [Set::Train, Set::Heldout].map(|set| {
        let columns = Columns::of(gap, set)?;
        let all = CREEPS.into_iter().map(|creep| columns.summed(gap, creep, &[]));
        all.collect::<Option<Vec<Vec<Sums>>>>()
    });
    let pairs = train?.into_iter().zip(heldout?);
    Some(pairs.map(|pair| problem(gap, pair, 0)).collect())
}

/// Returns what is to be fitted of the sums of those fitted and held out, with so many `more` numbers of which nothing is known.
fn problem(gap: &ArmGap, (train, heldout): (Vec<Sums>, Vec<Sums>), more: usize) -> Problem {
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
struct Columns {
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
    fn of(gap: &ArmGap, set: Set) -> Option<Self> {
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
    fn summed(&self, gap: &ArmGap, creep: f64, more: &[&Vec<f64>]) -> Option<Vec<Sums>> {
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
fn summed(gap: &ArmGap, set: Set, here: &[f64], columns: &[&Vec<f64>]) -> Option<Vec<Sums>> {
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

/// Returns the products of all pairs of columns.
fn products(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    let all = faer::MatRef::from_column_major_slice(a.as_slice(), rows, n);
    let products = all.transpose() * all;
    DMatrix::from_fn(n, n, |i, k| products[(i, k)])
}

/// What a file's numbers are rarely off by, in units of what they usually are.
const RARELY: f64 = 3.0;

/// Says which number is furthest from the file's, if it is further than numbers of files are.
fn far(bodies: &[Body], told: &[Identified]) -> Option<String> {
    let by = |number: &Identified| {
        let body = bodies.iter().find(|body| body.name == number.at)?;
        let at = NAMES.iter().position(|(name, _)| *name == number.parameter)?;
        Some((number.value - number.file).abs() / spread(body)[at])
    };
    let all = told.iter().filter_map(|number| Some((by(number)?, number)));
    let (by, number) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (by > RARELY).then(|| wording::far_off(&number.parameter, &number.at, by))
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
