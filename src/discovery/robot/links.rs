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

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Vector4};
use rayon::prelude::*;

use super::chain::Body;
use super::data::Quantity;
use super::explain::ArmGap;
use super::simulate::Model;
use super::term::{Law, Term};
use crate::discovery::finding::Identified;
use crate::discovery::selection::{Gap as _, Set, related};
use crate::units::significant;

/// Numbers of a body: mass, moment (3), inertia (6).
pub(super) const NUMBERS: usize = 10;
const NAMES: [(&str, &str); NUMBERS] = [
    ("mass", "kg"),
    ("moment_x", "kg*m"),
    ("moment_y", "kg*m"),
    ("moment_z", "kg*m"),
    ("ixx", "kg*m^2"),
    ("ixy", "kg*m^2"),
    ("ixz", "kg*m^2"),
    ("iyy", "kg*m^2"),
    ("iyz", "kg*m^2"),
    ("izz", "kg*m^2"),
];

/// How far a file's numbers usually are off, as a part of the mass, of the mass times its spread, and so on.
const USUAL: f64 = 0.1;
/// By how much the links' numbers must predict better to be taken: by a tenth of what is left.
const BETTER: f64 = 0.9;
/// A number is told if the data say more of it than the file does: its uncertainty fell to this part.
const TOLD: f64 = 0.5;
/// Speeds below which dry friction may give way, rad/s; the one that fits best is taken.
const CREEPS: [f64; 4] = [1e-3, 4e-3, 1.6e-2, 5e-2];
/// How often sensors are weighed anew by what is left of them.
const WEIGHINGS: usize = 4;

/// The bodies of an arm as its recordings have them.
#[derive(Debug)]
pub(super) struct Links {
    /// What is added to each body's numbers.
    pub(super) changes: Vec<[f64; NUMBERS]>,
    /// Those that the data tell.
    pub(super) told: Vec<Identified>,
}

/// Adds a change to a number of a body.
pub(super) fn change(body: &mut Body, number: usize, by: f64) {
    match number {
        0 => body.mass += by,
        1..=3 => body.moment[number - 1] += by,
        _ => {
            let (i, j) = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)][number - 4];
            body.inertia[(i, j)] += by;
            if i != j {
                body.inertia[(j, i)] += by;
            }
        }
    }
}

/// Returns the numbers of a body.
fn numbers(body: &Body) -> [f64; NUMBERS] {
    let (h, i) = (&body.moment, &body.inertia);
    [body.mass, h.x, h.y, h.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]
}

/// Returns a body's size about its origin, m, by its inertia, which its centre is part of; 0 for none.
fn size(body: &Body) -> f64 {
    if body.mass > 0.0 { (0.5 * body.inertia.trace().max(0.0) / body.mass).sqrt() } else { 0.0 }
}

/// How far each number of a body may be off: one standard deviation of what a file usually is.
fn spread(body: &Body) -> [f64; NUMBERS] {
    let size = size(body);
    let unit = USUAL * body.mass.max(0.0);
    std::array::from_fn(|number| match number {
        0 => unit,
        1..=3 => unit * size,
        _ => unit * size * size,
    })
}

/// Returns a body's pseudo-inertia, which is positive for every body that could be: `∫ [r; 1] [r; 1]ᵀ dm`.
fn pseudo(body: &Body) -> Matrix4<f64> {
    let spread = Matrix3::identity() * (0.5 * body.inertia.trace()) - body.inertia;
    let mut pseudo = Matrix4::zeros();
    pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&spread);
    pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&body.moment);
    pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&body.moment.transpose());
    pseudo[(3, 3)] = body.mass;
    pseudo
}

/// What one sensor says, summed up: normal equations of its residuals over all recordings.
#[derive(Debug, Clone)]
struct Sums {
    gram: DMatrix<f64>,
    along: DVector<f64>,
    square: f64,
    rows: f64,
    /// How many rows say as much as one that is independent.
    related: f64,
}

impl Sums {
    /// Returns what `x` leaves, per row.
    fn left(&self, x: &DVector<f64>) -> f64 {
        let left = self.square - 2.0 * self.along.dot(x) + x.dot(&(&self.gram * x));
        (left / self.rows.max(1.0)).max(1e-12)
    }
}

/// What is fitted: numbers of bodies with how far they may go, then numbers of joints.
struct Problem {
    train: Vec<Sums>,
    heldout: Vec<Sums>,
    /// One standard deviation before any data; infinite where nothing is known.
    prior: Vec<f64>,
    /// Which may not be negative.
    is_up: Vec<bool>,
}

/// Returns what numbers leave, sensor by sensor against `weights`, in the mean.
fn left_of(sums: &[Sums], x: &DVector<f64>, weights: &[f64]) -> f64 {
    let sum: f64 = sums.iter().zip(weights).map(|(s, w)| s.left(x) / w).sum();
    sum / weights.len().max(1) as f64
}

/// A fit of some of the numbers.
struct Fit {
    x: DVector<f64>,
    covariance: DMatrix<f64>,
    /// What is left of each sensor, per row.
    weights: Vec<f64>,
}

impl Fit {
    /// Returns how much is left of all sensors, each by its own measure.
    fn total(&self) -> f64 {
        self.weights.iter().map(|weight| weight.ln()).sum()
    }
}

impl Problem {
    /// Fits the numbers along `directions`, which are lists of multiples; sensors weigh as they are left. A direction of one
    /// number knows what is known of that number.
    fn fit(&self, directions: &DMatrix<f64>) -> Option<Fit> {
        let k = directions.ncols();
        let single = |j: usize| {
            let mut found = (0..directions.nrows()).filter(|i| directions[(*i, j)].abs() > 0.0);
            found.next().filter(|_| found.next().is_none())
        };
        let of =
            |j: usize| single(j).map_or((f64::INFINITY, false), |i| (self.prior[i], self.is_up[i]));
        let (prior, is_up): (Vec<f64>, Vec<bool>) = (0..k).map(of).unzip();
        let projected: Vec<(DMatrix<f64>, DVector<f64>)> = self
            .train
            .iter()
            .map(|sums| {
                let half = &sums.gram * directions;
                (directions.transpose() * half, directions.transpose() * &sums.along)
            })
            .collect();
        let mut weights: Vec<f64> = self.train.iter().map(|sums| sums.square / sums.rows).collect();
        // What is known for sure stays as it is.
        let mut is_free: Vec<bool> = prior.iter().map(|prior| *prior > 0.0).collect();
        let mut y: DVector<f64> = DVector::zeros(k);
        let mut covariance: DMatrix<f64> = DMatrix::zeros(k, k);
        for _ in 0..WEIGHINGS {
            loop {
                let free: Vec<usize> = (0..k).filter(|i| is_free[*i]).collect();
                let mut gram = DMatrix::zeros(free.len(), free.len());
                let mut along = DVector::zeros(free.len());
                for ((g, b), (weight, sums)) in
                    projected.iter().zip(weights.iter().zip(&self.train))
                {
                    let scale = 1.0 / (weight * sums.related);
                    for (a, &i) in free.iter().enumerate() {
                        along[a] += scale * b[i];
                        for (c, &j) in free.iter().enumerate() {
                            gram[(a, c)] += scale * g[(i, j)];
                        }
                    }
                }
                for (a, &i) in free.iter().enumerate() {
                    gram[(a, a)] += prior[i].powi(-2) + 1e-12 * gram[(a, a)] + 1e-300;
                }
                let inverse = gram.cholesky()?.inverse();
                let solved: DVector<f64> = &inverse * along;
                y.fill(0.0);
                covariance.fill(0.0);
                for (a, &i) in free.iter().enumerate() {
                    y[i] = solved[a];
                    for (c, &j) in free.iter().enumerate() {
                        covariance[(i, j)] = inverse[(a, c)];
                    }
                }
                // No friction drives, and no rotor has less than no inertia.
                let Some(worst) = (0..k)
                    .filter(|i| is_up[*i] && y[*i] < 0.0)
                    .min_by(|a, b| y[*a].total_cmp(&y[*b]))
                else {
                    break;
                };
                is_free[worst] = false;
            }
            let x = directions * &y;
            weights = self.train.iter().map(|sums| sums.left(&x)).collect();
        }
        let x = directions * &y;
        let covariance = directions * covariance * directions.transpose();
        Some(Fit { x, covariance, weights })
    }

    /// Returns the quadratic form of all numbers and its gradient, with sensors of these variances.
    fn form(&self, weights: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let k = self.prior.len();
        let (mut form, mut along) = (DMatrix::zeros(k, k), DVector::zeros(k));
        for (sums, weight) in self.train.iter().zip(weights) {
            let scale = 1.0 / (weight * sums.related);
            form += scale * &sums.gram;
            along += scale * &sums.along;
        }
        (form, along)
    }

    /// Returns what numbers leave of the recordings held out, sensor by sensor against `weights`.
    fn judged(&self, x: &DVector<f64>, weights: &[f64]) -> f64 {
        left_of(&self.heldout, x, weights)
    }

    /// Returns the same with the recordings fitted and held out exchanged.
    fn turned(&self) -> Self {
        Self {
            train: self.heldout.clone(),
            heldout: self.train.clone(),
            ..self.with(Vec::new(), Vec::new())
        }
    }

    /// Returns what is left to be fitted once the bodies have changed.
    fn beside(&self, changes: &[[f64; NUMBERS]]) -> Self {
        let flat = changes.concat();
        let fixed = DVector::from_fn(self.prior.len(), |i, _| flat.get(i).copied().unwrap_or(0.0));
        let shifted = |sums: &Sums| Sums {
            along: &sums.along - &sums.gram * &fixed,
            square: sums.left(&fixed) * sums.rows,
            ..sums.clone()
        };
        let of = |all: &[Sums]| all.iter().map(shifted).collect();
        self.with(of(&self.train), of(&self.heldout))
    }

    fn with(&self, train: Vec<Sums>, heldout: Vec<Sums>) -> Self {
        Self { train, heldout, prior: self.prior.clone(), is_up: self.is_up.clone() }
    }
}

/// What the numbers of an arm come to, before any effect is looked for.
#[derive(Debug)]
pub(super) enum Numbers {
    /// The file's, as far as the recordings tell.
    File,
    /// Others.
    Own(Links),
    /// Those of the recordings fitted are not those of the recordings held out, by these words.
    Different(String),
}

/// Identifies the numbers of the links. They are taken if they predict the recordings held out clearly better than the
/// file's with any single link heavier, or with a load in the hand: those have names.
pub(super) fn identified(gap: &ArmGap) -> Option<Numbers> {
    let model = gap.train.first()?;
    let has_torque = |model: &Model| model.scene.data.has(Quantity::Torque);
    if !gap.is_along() || !gap.train.iter().chain(&gap.heldout).all(has_torque) {
        return None;
    }
    let gap = gap.for_search();
    let bodies = &model.arm.chain.bodies;
    let problems: Vec<Problem> =
        CREEPS.into_par_iter().filter_map(|creep| problem(&gap, creep)).collect();
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
    if left > BETTER * plainest {
        return Some(Numbers::File);
    }
    let told = told(bodies, &changes, &free, &problem.prior);
    Some(Numbers::Own(Links { changes, told }))
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

/// Where the numbers of bodies, of joints and of a load stand among all that are fitted.
struct Parts {
    bodies: Range<usize>,
    joints: Range<usize>,
    load: Range<usize>,
}

/// Mass and moment of a load on the last body.
const LOAD: [(&str, &str); 4] = [
    ("the mass of the load", "kg"),
    ("the moment of the load along x", "kg*m"),
    ("the moment of the load along y", "kg*m"),
    ("the moment of the load along z", "kg*m"),
];

impl Parts {
    fn of(n: usize) -> Self {
        let bodies = 0..n * NUMBERS;
        let joints = bodies.end..bodies.end + n * of_joint(0.0).len();
        let load = joints.end..joints.end + LOAD.len();
        Self { bodies, joints, load }
    }

    /// Returns the directions in which only these numbers change.
    fn only(&self, parts: &[&Range<usize>]) -> DMatrix<f64> {
        let free: Vec<usize> = parts.iter().flat_map(|part| (*part).clone()).collect();
        DMatrix::from_fn(self.load.end, free.len(), |i, j| f64::from(u8::from(i == free[j])))
    }

    /// Returns what a number of a joint or of the load is, with its unit.
    fn name(&self, at: usize) -> (String, &'static str) {
        if self.load.contains(&at) {
            let (name, unit) = LOAD[at - self.load.start];
            return (name.into(), unit);
        }
        let kinds = [
            ("viscous friction", "N*m*s/rad"),
            ("dry friction", "N*m"),
            ("torque offset", "N*m"),
            ("rotor's inertia", "kg*m^2"),
        ];
        let (joint, kind) =
            ((at - self.joints.start) / kinds.len(), (at - self.joints.start) % kinds.len());
        (format!("the {} of joint {}", kinds[kind].0, joint + 1), kinds[kind].1)
    }
}

/// Sums up what the recordings say, with dry friction that gives way below `creep`.
fn problem(gap: &ArmGap, creep: f64) -> Option<Problem> {
    let n = gap.train[0].arm.chain.n();
    let bodies = &gap.train[0].arm.chain.bodies;
    let mut prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
    let mut is_up = vec![false; prior.len()];
    for joint in 0..n {
        let known = gap.train.iter().map(|model| model.arm.armature[joint]).fold(0.0, f64::max);
        for (law, _) in of_joint(creep) {
            prior.push(f64::INFINITY);
            is_up.push(law != Law::TorqueOffset && (law != Law::Armature || known <= 0.0));
        }
    }
    prior.extend(LOAD.map(|_| f64::INFINITY));
    is_up.extend([true, false, false, false]);
    let train = sums(gap, Set::Train, creep)?;
    let heldout = sums(gap, Set::Heldout, creep)?;
    Some(Problem { train, heldout, prior, is_up })
}

/// What every joint of a real arm has, with the parameters of one unit of it.
fn of_joint(creep: f64) -> [(Law, Vec<f64>); 4] {
    [
        (Law::Viscous, vec![1.0]),
        (Law::Coulomb, vec![1.0, creep]),
        (Law::TorqueOffset, vec![1.0]),
        (Law::Armature, vec![1.0]),
    ]
}

/// Returns the normal equations of every torque sensor.
fn sums(gap: &ArmGap, set: Set, creep: f64) -> Option<Vec<Sums>> {
    let models = if set == Set::Train { &gap.train } else { &gap.heldout };
    let n = models.first()?.arm.chain.n();
    let here = gap.residuals(set, &[], &[])?;
    let mut columns: Vec<Vec<f64>> = (0..n * NUMBERS)
        .into_par_iter()
        .map(|at| models.iter().flat_map(|m| m.body_column(at / NUMBERS, at % NUMBERS)).collect())
        .collect();
    let laws: Vec<(Term, Vec<f64>)> =
        (0..n).flat_map(|joint| of_joint(creep).map(|(law, p)| (Term { law, joint }, p))).collect();
    let joints: Option<Vec<Vec<f64>>> = laws
        .into_par_iter()
        .map(|(term, parameters)| {
            let there = gap.residuals(set, &[term], &parameters)?;
            Some(here.iter().zip(there).map(|(here, there)| here - there).collect())
        })
        .collect();
    columns.extend(joints?);
    let last = (n - 1) * NUMBERS;
    columns.extend_from_within(last..last + LOAD.len());
    let mut found: Vec<Sums> = Vec::new();
    let blocks = gap.blocks(set);
    let channels = &models[0].scene.data.channels;
    for (sensor, channel) in channels.iter().enumerate() {
        if channel.quantity != Quantity::Torque {
            continue;
        }
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
        found.push(Sums { gram, along, square, rows: count, related: related(left.as_slice()) });
    }
    Some(found)
}

/// Returns the bodies' changes that fit best while every body stays one that could be, by alternating directions: a step
/// towards the data, a step to the nearest bodies that could be, until both agree.
///
/// Source: Boyd et al., "Distributed Optimization and Statistical Learning via the Alternating Direction Method of
/// Multipliers", 2011, §5.
fn consistent(
    problem: &Problem,
    bodies: &[Body],
    parts: &Parts,
    free: &Fit,
) -> Option<Vec<[f64; NUMBERS]>> {
    let k = problem.prior.len();
    let of_bodies = parts.bodies.end;
    // Without a load it stays none.
    let is_loaded = parts.load.clone().any(|at| free.covariance[(at, at)] > 0.0);
    let (mut form, along) = problem.form(&free.weights);
    let pull: Vec<f64> =
        (0..k)
            .map(|i| {
                if i < of_bodies && problem.prior[i] > 0.0 {
                    problem.prior[i].powi(-2)
                } else {
                    0.0
                }
            })
            .collect();
    for i in 0..k {
        // Twice: what is usual, and what pulls the two steps together.
        form[(i, i)] += 2.0 * pull[i] + 1e-12 * form[(i, i)] + 1e-300;
        let is_load = parts.load.contains(&i) && !is_loaded;
        if is_load || (i < of_bodies && problem.prior[i] <= 0.0) {
            form[(i, i)] = f64::MAX.sqrt();
        }
    }
    let inverse = form.cholesky()?.inverse();
    let mut near = DVector::zeros(k);
    let mut apart: DVector<f64> = DVector::zeros(k);
    for _ in 0..AGREEING {
        let wanted: DVector<f64> = &near - &apart;
        let towards = DVector::from_fn(k, |i, _| along[i] + pull[i] * wanted[i]);
        let x: DVector<f64> = &inverse * towards;
        let between = &x + &apart;
        near.copy_from(&between);
        for (b, body) in bodies.iter().enumerate() {
            let changes: [f64; NUMBERS] = std::array::from_fn(|n| between[b * NUMBERS + n]);
            for (n, by) in nearest(body, &changes).into_iter().enumerate() {
                near[b * NUMBERS + n] = by;
            }
        }
        apart = between - &near;
    }
    Some((0..bodies.len()).map(|b| std::array::from_fn(|n| near[b * NUMBERS + n])).collect())
}

/// How often the two steps are taken: far more often than they take to agree.
const AGREEING: usize = 200;
/// The least part of its spread that a body has in any direction.
const LEAST: f64 = 1e-4;

/// Returns the change nearest to `changes` with which the body could be: its mass is spread by something in every direction.
fn nearest(body: &Body, changes: &[f64; NUMBERS]) -> [f64; NUMBERS] {
    let size = size(body);
    if size <= 0.0 {
        return [0.0; NUMBERS];
    }
    let mut changed = body.clone();
    changes.iter().enumerate().for_each(|(k, by)| change(&mut changed, k, *by));
    // In units of the body's size all numbers are of one kind.
    let scale = Vector4::new(1.0 / size, 1.0 / size, 1.0 / size, 1.0);
    let pseudo = pseudo(&changed).component_mul(&(scale * scale.transpose()));
    let least = LEAST * body.mass;
    let mut split = pseudo.symmetric_eigen();
    if split.eigenvalues.min() >= least {
        return *changes;
    }
    split.eigenvalues.apply(|value| *value = value.max(least));
    let mended = split.recompose().component_div(&(scale * scale.transpose()));
    let spread = mended.fixed_view::<3, 3>(0, 0).into_owned();
    changed.mass = mended[(3, 3)];
    changed.moment = mended.fixed_view::<3, 1>(0, 3).into_owned();
    changed.inertia = Matrix3::identity() * spread.trace() - spread;
    let (own, new) = (numbers(body), numbers(&changed));
    std::array::from_fn(|k| new[k] - own[k])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;

    use super::super::chain::Chain;

    fn changed(body: &Body, changes: &[f64; NUMBERS]) -> Body {
        let mut changed = body.clone();
        changes.iter().enumerate().for_each(|(k, by)| change(&mut changed, k, *by));
        changed
    }

    #[test]
    fn a_body_that_could_be_stays_and_one_that_could_not_is_mended() {
        let chain = Chain::new(&Robot::gen3(), None, GRAVITY).unwrap();
        for body in &chain.bodies {
            let own = numbers(body);
            let heavier = own.map(|number| 0.1 * number);
            let kept = nearest(body, &heavier);
            let is_kept = kept.iter().zip(&heavier).all(|(a, b)| (a - b).abs() < 1e-12);
            assert!(is_kept, "{}: {kept:?}", body.name);
            // Lighter than nothing, and a moment that no such mass has.
            let mut absurd = [0.0; NUMBERS];
            absurd[0] = -2.0 * own[0];
            absurd[1] = 5.0 * own[0];
            let mended = changed(body, &nearest(body, &absurd));
            let least = pseudo(&mended).symmetric_eigenvalues().min();
            assert!(mended.mass > 0.0 && least > 0.0, "{}: {least}", body.name);
        }
    }

    #[test]
    fn numbers_are_read_back_as_they_were_changed() {
        let chain = Chain::new(&Robot::gen3(), None, GRAVITY).unwrap();
        let body = &chain.bodies[2];
        let by: [f64; NUMBERS] = std::array::from_fn(|k| 0.001 * (k as f64 + 1.0));
        let (own, new) = (numbers(body), numbers(&changed(body, &by)));
        for k in 0..NUMBERS {
            assert!((new[k] - own[k] - by[k]).abs() < 1e-12, "{}", NAMES[k].0);
        }
    }
}
