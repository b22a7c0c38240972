//! The bodies that fit best among those that could be: their pseudo-inertia is positive.
//!
//! The least of a quadratic form within such bounds, on the way from within them that a barrier keeps inside: its logarithm of the
//! determinant weighs less and less. Where bodies that fit could be, it is what fits.
//!
//! Source: Wensing, Kim and Slotine, "Linear matrix inequalities for physically consistent inertial parameter identification",
//! 2018; Boyd and Vandenberghe, "Convex Optimization", 2004, ch. 11.

use nalgebra::{DMatrix, DVector, Matrix4};

use super::super::chain::Body;
use super::body::{NUMBERS, Pseudo, nearest};
use super::fit::{Fit, Problem};

/// What the barrier weighs at last, in -2 ln of the odds: seven bodies are less than 0.3 from the best, four times this for each.
const LAST: f64 = 0.01;

/// It weighs less by this each time, from what there is to be gained on.
const LESS: f64 = 0.1;

/// Newton's steps for each at most; they take ten.
const STEPS: usize = 50;

/// What a further step would gain less than, in -2 ln of the odds, is not taken.
const ENOUGH: f64 = 1e-3;

/// How often a step is halved at most until it stays inside.
const HALVINGS: usize = 40;

/// Returns the bodies' changes that fit best while every body stays one that could be. What a fit left out, or left at nothing
/// since it may not be less, stays nothing: bodies would pay for a load that weighs less than nothing.
pub(super) fn consistent(
    problem: &Problem,
    bodies: &[Body],
    free: &Fit,
) -> Option<Vec<[f64; NUMBERS]>> {
    let of_bodies = bodies.len() * NUMBERS;
    let is_open = |i: &usize| {
        let is_body = *i < of_bodies;
        if is_body { problem.prior[*i] > 0.0 } else { free.covariance[(*i, *i)] > 0.0 }
    };
    let open: Vec<usize> = (0..problem.prior.len()).filter(is_open).collect();
    let (form, along) = problem.form(&free.weights);
    let n = open.len();
    let mut form = DMatrix::from_fn(n, n, |i, k| form[(open[i], open[k])]);
    let along = DVector::from_fn(n, |i, _| along[open[i]]);
    for (at, &i) in open.iter().enumerate() {
        form[(at, at)] += problem.prior[i].powi(-2) + 1e-12 * form[(at, at)] + 1e-300;
    }
    let at = |i: usize| open.iter().position(|open| *open == i);
    let bounded = bodies.iter().enumerate().filter_map(|(b, body)| {
        Some(Bounded { from: at(b * NUMBERS)?, pseudo: Pseudo::of(body)? })
    });
    let bounds = Bounds { form, along, bodies: bounded.collect() };
    let inside: Vec<[f64; NUMBERS]> =
        bodies.iter().map(|body| nearest(body, &[0.0; NUMBERS])).collect();
    let begin = inside.concat();
    let x = DVector::from_fn(n, |at, _| begin.get(open[at]).copied().unwrap_or(free.x[open[at]]));
    let x = bounds.best(x)?;
    let number = |i: usize| at(i).map_or(0.0, |at| x[at]);
    let changes = |b: usize| std::array::from_fn(|k| number(b * NUMBERS + k));
    Some((0..bodies.len()).map(changes).collect())
}

/// A body whose pseudo-inertia stays positive.
struct Bounded {
    /// Where its numbers begin.
    from: usize,
    pseudo: Pseudo,
}

impl Bounded {
    fn at(&self, x: &DVector<f64>) -> Matrix4<f64> {
        self.pseudo.with(&x.as_slice()[self.from..self.from + NUMBERS])
    }
}

/// A quadratic form with what bounds it.
struct Bounds {
    form: DMatrix<f64>,
    along: DVector<f64>,
    bodies: Vec<Bounded>,
}

impl Bounds {
    /// Returns what numbers cost with a barrier that weighs `barrier`; `None` outside.
    fn cost(&self, x: &DVector<f64>, barrier: f64) -> Option<f64> {
        let mut cost = x.dot(&(&self.form * x)) - 2.0 * self.along.dot(x);
        for body in &self.bodies {
            cost -= barrier * body.at(x).cholesky()?.ln_determinant();
        }
        Some(cost)
    }

    /// Returns the numbers that cost least without a barrier, but for little, from some that are inside.
    fn best(&self, mut x: DVector<f64>) -> Option<DVector<f64>> {
        let free = self.form.clone().cholesky()?.solve(&self.along);
        let away = &x - free;
        let mut barrier = away.dot(&(&self.form * &away)).max(LAST);
        loop {
            x = self.least(x, barrier)?;
            if barrier <= LAST {
                return Some(x);
            }
            barrier = (LESS * barrier).max(LAST);
        }
    }

    /// Returns the numbers that cost least, from some that are inside.
    fn least(&self, mut x: DVector<f64>, barrier: f64) -> Option<DVector<f64>> {
        for _ in 0..STEPS {
            let mut slope = 2.0 * (&self.form * &x - &self.along);
            let mut bend = 2.0 * &self.form;
            for body in &self.bodies {
                let inverse = body.at(&x).cholesky()?.inverse();
                let by: [Matrix4<f64>; NUMBERS] =
                    std::array::from_fn(|k| inverse * body.pseudo.by[k]);
                for (i, a) in by.iter().enumerate() {
                    slope[body.from + i] -= barrier * a.trace();
                    for (k, b) in by.iter().enumerate() {
                        bend[(body.from + i, body.from + k)] += barrier * (a * b).trace();
                    }
                }
            }
            let step = -bend.cholesky()?.solve(&slope);
            let gain = -0.5 * slope.dot(&step);
            if gain < ENOUGH {
                break;
            }
            let here = self.cost(&x, barrier)?;
            // So far a step is sure to stay inside (Boyd and Vandenberghe, 9.6): further out is right at the border.
            let far = (2.0 * gain / barrier).sqrt();
            let sure = if far > 1.0 { (1.0 + far).recip() } else { 1.0 };
            let halved = std::iter::successors(Some(sure), |part| Some(0.5 * part)).take(HALVINGS);
            let mut tried = halved.map(|part| (part, &x + part * &step));
            // As far as the slope promises a fifth of.
            let pays = |(part, next): &(f64, DVector<f64>)| {
                self.cost(next, barrier).is_some_and(|cost| cost < here - 0.2 * part * gain)
            };
            match tried.find(pays) {
                Some((_, next)) => x = next,
                None => break,
            }
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::super::chain::Chain;
    use super::super::body::{numbers, spread};
    use super::super::fit::{Parts, Sums};
    use super::*;
    use crate::motion::Robot;
    use crate::motion::dynamics::GRAVITY;

    /// A sensor that reads every number of the bodies by itself, as it would be with `wanted` changes, each to a hundredth of what
    /// files are off by.
    fn read(bodies: &[Body], parts: &Parts, wanted: &[f64]) -> Problem {
        let prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
        let mut gram = DMatrix::zeros(parts.count, parts.count);
        let mut along = DVector::zeros(parts.count);
        for (i, (prior, wanted)) in prior.iter().zip(wanted).enumerate() {
            if *prior > 0.0 {
                gram[(i, i)] = (100.0 / prior).powi(2);
                along[i] = gram[(i, i)] * wanted;
            }
        }
        let square = wanted.iter().zip(along.iter()).map(|(x, b)| x * b).sum::<f64>() + 1e4;
        let sums = Sums { joint: 0, gram, along, square, rows: 1e4, related: 1.0 };
        let mut all = prior;
        all.resize(parts.count, f64::INFINITY);
        let is_up = vec![false; parts.count];
        Problem { train: vec![sums], heldout: Vec::new(), prior: all, is_up }
    }

    #[test]
    fn bodies_that_could_be_are_what_fits_and_others_are_the_best_of_those_that_could() {
        let chain = Chain::new(&Robot::gen3(), None, -GRAVITY * Vector3::z()).unwrap();
        let bodies = &chain.bodies;
        let parts = Parts::of(bodies.len());
        let fitted = |wanted: &[f64]| {
            let problem = read(bodies, &parts, wanted);
            let fit = problem.fit(&parts.only(&[&parts.bodies])).unwrap();
            let changes = consistent(&problem, bodies, &fit).unwrap();
            (problem, fit, changes.concat())
        };
        let prior: Vec<f64> = bodies.iter().flat_map(spread).collect();
        let heavier: Vec<f64> =
            bodies.iter().flat_map(|body| numbers(body).map(|own| 0.1 * own)).collect();
        let (_, fit, changes) = fitted(&heavier);
        for (i, prior) in prior.iter().enumerate().filter(|(_, prior)| **prior > 0.0) {
            assert!((changes[i] - fit.x[i]).abs() < 1e-3 * prior, "{i}");
        }
        // A centre outside of what the inertia leaves room for.
        let mut absurd = heavier.clone();
        absurd[21] += 30.0 * prior[21];
        let (problem, _, changes) = fitted(&absurd);
        let cost = |x: &[f64]| {
            let x = DVector::from_fn(parts.count, |i, _| x.get(i).copied().unwrap_or(0.0));
            let away = x.iter().zip(&prior).filter(|(_, prior)| **prior > 0.0);
            problem.train[0].left(&x) * 1e4 + away.map(|(x, p)| (x / p).powi(2)).sum::<f64>()
        };
        let could_be = |x: &[f64]| {
            bodies.iter().zip(x.chunks(NUMBERS)).all(|(body, own)| {
                Pseudo::of(body).is_none_or(|p| p.with(own).symmetric_eigenvalues().min() > 0.0)
            })
        };
        assert!(!could_be(&absurd) && could_be(&changes));
        let mended: Vec<f64> = bodies
            .iter()
            .zip(absurd.chunks(NUMBERS))
            .flat_map(|(body, own)| nearest(body, own.try_into().unwrap()))
            .collect();
        assert!(cost(&changes) < cost(&mended), "{} {}", cost(&changes), cost(&mended));
        // Nothing near it that could be is better.
        for i in 20..30 {
            for by in [-1e-3, 1e-3] {
                let mut near = changes.clone();
                near[i] += by * prior[i];
                let by = cost(&near) - cost(&changes);
                assert!(!could_be(&near) || by > -1.0, "{i}: {by}");
            }
        }
    }
}
