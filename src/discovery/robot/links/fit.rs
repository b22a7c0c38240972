//! Least squares over what recordings say of an arm's numbers, summed up once per sensor, so that a fit of any of them costs
//! milliseconds.

use std::borrow::Borrow;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::super::chain::Body;
use super::super::term::{Law, Term};
use super::super::wording;
use super::body::{NUMBERS, point};
use super::single::AGREEING;
use crate::discovery::vocabulary::of_slide;

/// By how much the links' numbers must predict better to be taken: by a tenth of what is left.
pub(in super::super) const BETTER: f64 = 0.9;

/// Speeds below which dry friction may give way, rad/s; the one that fits best is taken.
pub(in super::super) const CREEPS: [f64; 4] = [1e-3, 4e-3, 1.6e-2, 5e-2];

/// How often sensors are weighed anew by what is left of them.
const WEIGHINGS: usize = 4;

/// What one sensor says, summed up: normal equations of its residuals over all recordings.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    /// The joint it sits in.
    pub(super) joint: usize,
    pub(super) gram: DMatrix<f64>,
    pub(super) along: DVector<f64>,
    pub(super) square: f64,
    pub(super) rows: f64,
    /// How many rows say as much as one that is independent.
    pub(super) related: f64,
}

impl Sums {
    /// Returns what `x` leaves, per row.
    pub(super) fn left(&self, x: &DVector<f64>) -> f64 {
        let left = self.square - 2.0 * self.along.dot(x) + x.dot(&(&self.gram * x));
        (left / self.rows.max(1.0)).max(1e-12)
    }

    /// Returns what it says of the recordings of both.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self {
            joint: self.joint,
            gram: &self.gram + &other.gram,
            along: &self.along + &other.along,
            square: self.square + other.square,
            rows: self.rows + other.rows,
            related: self.related.max(other.related),
        }
    }

    /// Returns the same by other numbers, of which those there are follow through `by`.
    fn seen(&self, by: &DMatrix<f64>) -> Self {
        Self {
            gram: by.transpose() * (&self.gram * by),
            along: by.tr_mul(&self.along),
            ..self.clone()
        }
    }

    /// Returns what is left to be explained by a sensor that shows `gain` times what there is; `modelled` is the column of
    /// what the model says.
    fn with_gain(&self, gain: f64, modelled: usize) -> Self {
        let (more, column) = (1.0 - gain, self.gram.column(modelled));
        let of_model = 2.0 * self.along[modelled] + more * column[modelled];
        Self {
            along: gain * (&self.along + more * column),
            gram: gain * gain * &self.gram,
            square: self.square + more * of_model,
            ..self.clone()
        }
    }
}

/// What is fitted: numbers of bodies with how far they may go, then numbers of joints.
#[derive(Clone)]
pub(super) struct Problem {
    pub(super) train: Vec<Sums>,
    pub(super) heldout: Vec<Sums>,
    /// One standard deviation before any data; infinite where nothing is known.
    pub(super) prior: Vec<f64>,
    /// Which may not be negative.
    pub(super) is_up: Vec<bool>,
}

/// Returns what numbers leave, sensor by sensor against `weights`, in the mean of those that have a say.
pub(super) fn left_of(sums: &[Sums], x: &DVector<f64>, weights: &[f64]) -> f64 {
    let sum: f64 = sums.iter().zip(weights).map(|(s, w)| s.left(x) / w).sum();
    sum / weights.iter().filter(|weight| weight.is_finite()).count().max(1) as f64
}

/// A fit of some of the numbers.
pub(super) struct Fit {
    pub(super) x: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// What is left of each sensor, per row.
    pub(super) weights: Vec<f64>,
}

impl Fit {
    /// Returns how much is left of all sensors, each by its own measure.
    pub(super) fn total(&self) -> f64 {
        self.weights.iter().map(|weight| weight.ln()).sum()
    }
}

impl Problem {
    /// Fits the numbers along `directions`, which are lists of multiples; sensors weigh as they are left. A direction of one
    /// number knows what is known of that number.
    pub(super) fn fit(&self, directions: &DMatrix<f64>) -> Option<Fit> {
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
    pub(super) fn form(&self, weights: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
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
    pub(super) fn judged(&self, x: &DVector<f64>, weights: &[f64]) -> f64 {
        left_of(&self.heldout, x, weights)
    }

    /// Returns the same, fitted to the recordings held out.
    pub(super) fn turned(&self) -> Self {
        self.with(self.heldout.clone(), self.train.clone())
    }

    /// Returns how little the numbers of a fit say for themselves, in -2 ln of the odds: what is left, by as many rows as are
    /// independent, and how far they are from the file's.
    pub(super) fn evidence(&self, fit: &Fit) -> f64 {
        let away = fit.x.iter().zip(&self.prior).filter(|(_, prior)| **prior > 0.0);
        self.misfit(fit) + away.map(|(x, prior)| (x / prior).powi(2)).sum::<f64>()
    }

    /// Returns what a fit leaves, in -2 ln of the odds, by as many rows as are independent.
    pub(super) fn misfit(&self, fit: &Fit) -> f64 {
        let left = self.train.iter().zip(&fit.weights);
        left.map(|(sums, weight)| sums.rows / sums.related * weight.ln()).sum()
    }

    /// Returns what one number of which nothing is known before costs by the information criterion (Schwarz, 1978), in -2 ln of the
    /// odds.
    pub(super) fn price(&self) -> f64 {
        self.train.iter().map(|sums| sums.rows / sums.related).sum::<f64>().max(1.0).ln()
    }

    /// Returns the same for a torque sensor that shows `gain` times what there is.
    pub(super) fn with_gain(&self, joint: usize, gain: f64, parts: &Parts) -> Self {
        let of = |sums: &Sums| {
            if sums.joint == joint { sums.with_gain(gain, parts.modelled) } else { sums.clone() }
        };
        self.with(self.train.iter().map(of).collect(), self.heldout.iter().map(of).collect())
    }

    /// Returns the same where every number may have either sign.
    pub(super) fn unbounded(&self) -> Self {
        let is_up = vec![false; self.is_up.len()];
        Self { is_up, ..self.with(self.train.clone(), self.heldout.clone()) }
    }

    /// Returns what is left to be fitted once the bodies have changed.
    pub(super) fn beside(&self, changes: &[[f64; NUMBERS]]) -> Self {
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

    /// Returns the same where a load, if `list` has one, has the inertia of a mass at a place: that follows from mass and moment, which
    /// are fitted anew with it until they agree. They begin beside the file's bodies: free ones would take the load's inertia for theirs.
    pub(super) fn bearing(&self, parts: &Parts, list: &[Range<usize>]) -> Option<Self> {
        let mut problem = self.clone();
        if !list.contains(&parts.load) {
            return Some(problem);
        }
        let beside: Vec<_> = list.iter().filter(|part| **part != parts.bodies).cloned().collect();
        let (filed, free) = (parts.only(&beside), parts.only(list));
        for directions in [filed].iter().chain(std::iter::repeat_n(&free, AGREEING)) {
            let fit = problem.fit(directions)?;
            let by = parts.bearing(std::array::from_fn(|k| fit.x[parts.load.start + k]));
            let of = |all: &[Sums]| all.iter().map(|sums| sums.seen(&by)).collect();
            problem = self.with(of(&self.train), of(&self.heldout));
        }
        Some(problem)
    }

    /// Returns both sets by the numbers of [`Parts::merged`], as the recordings fitted and those held out see them ([`Parts::seen`]).
    pub(super) fn seen(&self, own: &Parts, [fitted, held]: &[DMatrix<f64>; 2]) -> Self {
        let of = |all: &[Sums], by: &DMatrix<f64>| all.iter().map(|sums| sums.seen(by)).collect();
        Self {
            train: of(&self.train, fitted),
            heldout: of(&self.heldout, held),
            prior: [&self.prior[..], &self.prior[own.load.clone()]].concat(),
            is_up: [&self.is_up[..], &self.is_up[own.load.clone()]].concat(),
        }
    }

    /// Returns both sets as one to be fitted.
    pub(super) fn merged(&self) -> Self {
        let both = self.train.iter().zip(&self.heldout).map(|(fitted, held)| fitted.and(held));
        self.with(both.collect(), Vec::new())
    }

    fn with(&self, train: Vec<Sums>, heldout: Vec<Sums>) -> Self {
        Self { train, heldout, prior: self.prior.clone(), is_up: self.is_up.clone() }
    }
}

/// Where the numbers of bodies, of joints and of a load stand among all that are summed up, then what the model says of the
/// sensors, and last what has a name.
pub(super) struct Parts {
    pub(super) bodies: Range<usize>,
    pub(super) joints: Range<usize>,
    pub(super) load: Range<usize>,
    pub(super) modelled: usize,
    /// Single effects that could be taken for other links: a spring at each joint, a zero at each joint, a tilt of the base.
    pub(super) named: Range<usize>,
    /// What the recordings held out bear more, where both sets have the same numbers ([`Problem::seen`]).
    pub(super) more: Range<usize>,
    /// How many there are.
    pub(super) count: usize,
}

/// What every joint of a real arm has, in this order.
pub(super) const OF_JOINT: [(Law, &str, &str); 4] = [
    (Law::Viscous, "viscous friction", "N*m*s/rad"),
    (Law::Coulomb, "dry friction", "N*m"),
    (Law::TorqueOffset, "torque offset", "N*m"),
    (Law::Armature, "rotor's inertia", "kg*m^2"),
];

/// Units of the mass and the moment of a load on the last body, as [`wording::OF_LOAD`] calls them.
pub(super) const LOAD: [&str; 4] = ["kg", "kg*m", "kg*m", "kg*m"];

/// Numbers of a base's tilt: roll and pitch.
pub(super) const TILT: usize = 2;

impl Parts {
    pub(super) fn of(n: usize) -> Self {
        let bodies = 0..n * NUMBERS;
        let joints = bodies.end..bodies.end + n * OF_JOINT.len();
        let load = joints.end..joints.end + LOAD.len();
        let modelled = load.end;
        let named = modelled + 1..modelled + 1 + 2 * n + TILT;
        Self { bodies, joints, load, modelled, more: named.end..named.end, count: named.end, named }
    }

    /// Returns the same where both sets have the same numbers.
    pub(super) fn merged(&self) -> Self {
        let count = self.count + LOAD.len();
        let parts = Self::of(self.bodies.len() / NUMBERS);
        Self { more: self.count..count, count, ..parts }
    }

    /// Returns how these numbers follow from those of [`Self::merged`], in the recordings fitted and in those held out: a load is
    /// numbers of the last body, as [`super::body::point`] has them for what both bear and for what the latter bear more.
    pub(super) fn seen(&self, [both, more]: &[DMatrix<f64>; 2]) -> [DMatrix<f64>; 2] {
        let last = self.bodies.end - NUMBERS;
        let mut fitted = DMatrix::<f64>::identity(self.count, self.count + LOAD.len());
        fitted.columns_mut(self.load.start, LOAD.len()).fill(0.0);
        fitted.view_mut((last, self.load.start), (NUMBERS, LOAD.len())).copy_from(both);
        let mut held = fitted.clone();
        held.view_mut((last, self.count), (NUMBERS, LOAD.len())).copy_from(more);
        [fitted, held]
    }

    /// Returns how these numbers follow from the same where a load has the inertia of a mass at the place of `load`.
    fn bearing(&self, load: [f64; 4]) -> DMatrix<f64> {
        let mut by = DMatrix::<f64>::identity(self.count, self.count);
        by.columns_mut(self.load.start, LOAD.len()).fill(0.0);
        let last = self.bodies.end - NUMBERS;
        by.view_mut((last, self.load.start), (NUMBERS, LOAD.len())).copy_from(&point(load));
        by
    }

    /// Returns the effects with a name of which each may be all that is missing: one spring, one zero, the base's tilt.
    pub(super) fn each_named(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let tilt = self.named.end - TILT;
        (self.named.start..tilt).map(|at| at..at + 1).chain(std::iter::once(tilt..self.named.end))
    }

    /// Returns one of them as an effect.
    pub(super) fn effect(&self, named: &Range<usize>) -> Term {
        let (at, n) = (named.start - self.named.start, self.bodies.len() / NUMBERS);
        match at / n {
            0 => Term { law: Law::Stiffness, joint: at },
            1 => Term { law: Law::ZeroOffset, joint: at - n },
            _ => Term { law: Law::BaseTilt, joint: 0 },
        }
    }

    /// Returns the directions in which only these numbers change.
    pub(super) fn only<R: Borrow<Range<usize>>>(&self, parts: &[R]) -> DMatrix<f64> {
        let free: Vec<usize> = parts.iter().flat_map(|part| part.borrow().clone()).collect();
        DMatrix::from_fn(self.count, free.len(), |i, j| f64::from(u8::from(i == free[j])))
    }

    /// Returns what a number of a joint or of the load on these bodies is, with its unit.
    pub(super) fn name(&self, at: usize, bodies: &[Body]) -> (String, &'static str) {
        if self.load.contains(&at) {
            let at = at - self.load.start;
            return (wording::OF_LOAD[at].into(), LOAD[at]);
        }
        let at = at - self.joints.start;
        let (joint, (_, name, unit)) = (at / OF_JOINT.len(), OF_JOINT[at % OF_JOINT.len()]);
        let unit = if bodies[joint].slides { of_slide(name, unit) } else { unit };
        (format!("the {name} of joint {}", joint + 1), unit)
    }
}
