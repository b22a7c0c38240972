//! Whether recordings are of one machine, and whether those fitted tell enough of it to ask.
//!
//! A joint that never turns back while it is fitted tells dry friction from an offset by nothing; what is predicted of it where it
//! turns back is off by much, of the same machine.

use super::super::chain::Body;
use super::super::wording;
use super::fit::{Fit, Parts, Problem, Sums, left_of};

/// How many times more a fit may leave of recordings it was not fitted to than theirs of themselves, in squares, and still
/// be of the same machine.
pub(super) const ANOTHER: f64 = 10.0;

/// From which factor on it is asked whether some of them bear a load.
pub(super) const SOME: f64 = 2.0;

/// The recordings fitted and those held out, each with numbers of its own.
pub(super) struct Apart {
    here: Fit,
    there: Fit,
    /// How many times more is left of those held out by what the others say than by their own numbers, in squares.
    pub(super) by: f64,
}

impl Apart {
    pub(super) fn of(problem: &Problem, parts: &Parts, left: f64, weights: &[f64]) -> Option<Self> {
        let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load]);
        let here = problem.fit(&all)?;
        let turned = problem.turned();
        let there = turned.fit(&all)?;
        let by = left / left_of(&turned.train, &there.x, weights).max(1.0);
        Some(Self { here, there, by })
    }

    /// Says by which numbers they are of two machines.
    pub(super) fn words(&self, parts: &Parts, bodies: &[Body]) -> String {
        let (here, there) = (&self.here, &self.there);
        let apart = |at: &usize| {
            let variance = here.covariance[(*at, *at)] + there.covariance[(*at, *at)];
            (here.x[*at] - there.x[*at]).abs() / variance.max(1e-300).sqrt()
        };
        let numbers = parts.joints.start..parts.load.end;
        let named = numbers.max_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or_default();
        wording::of_two_machines(parts.name(named, bodies), here.x[named], there.x[named])
    }
}

/// Returns by how much each sensor may be wrong of what is held out, by numbers of joints that are as uncertain as the motion fitted
/// leaves them, in units of what they leave of what is fitted, in squares.
fn doubts(problem: &Problem, fit: &Fit) -> Vec<f64> {
    let of = |(held, left): (&Sums, &f64)| {
        (&held.gram * &fit.covariance).trace() / (held.rows.max(1.0) * left)
    };
    problem.heldout.iter().zip(&fit.weights).map(of).collect()
}

/// Returns the doubt of the sensor in the middle, for a joint may well rest in the motion fitted.
pub(super) fn uncertain(problem: &Problem, bare: &Fit) -> f64 {
    let mut all = doubts(problem, bare);
    all.sort_by(f64::total_cmp);
    all.get((all.len().max(1) - 1) / 2).copied().unwrap_or(0.0)
}

/// Returns the same weights, infinite of sensors that have no say: what is left of them could be that of another machine by what the
/// motion fitted leaves open alone. A number that may not be negative is as open as any.
pub(super) fn heard(problem: &Problem, parts: &Parts, weights: &[f64]) -> Option<Vec<f64>> {
    let fit = problem.unbounded().fit(&parts.only(&[&parts.joints]))?;
    let heard = weights.iter().zip(doubts(problem, &fit));
    Some(
        heard
            .map(|(weight, doubt)| if doubt > ANOTHER { f64::INFINITY } else { *weight })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Rows of one joint, with as much noise in each: in `alike` of them its dry friction reads like an offset, in the others like the
    /// opposite of one.
    fn sums(parts: &Parts, rows: f64, alike: f64) -> Sums {
        let [viscous, dry, offset, rotor] = std::array::from_fn(|at| parts.joints.start + at);
        let mut gram = DMatrix::zeros(parts.count, parts.count);
        for at in [viscous, dry, offset, rotor] {
            gram[(at, at)] = rows;
        }
        gram[(dry, offset)] = 2.0 * alike - rows;
        gram[(offset, dry)] = gram[(dry, offset)];
        let along = DVector::zeros(parts.count);
        Sums { joint: 0, gram, along, square: rows, rows, related: 1.0 }
    }

    #[test]
    fn a_joint_that_never_turned_back_has_no_say() {
        let parts = Parts::of(1);
        let heard = |alike: f64| {
            let problem = Problem {
                train: vec![sums(&parts, 300.0, alike)],
                heldout: vec![sums(&parts, 300.0, 150.0)],
                prior: vec![f64::INFINITY; parts.count],
                is_up: vec![true; parts.count],
            };
            heard(&problem, &parts, &[2.0]).expect("every number can be fitted")[0]
        };
        assert!(heard(300.0).is_infinite());
        assert!((heard(200.0) - 2.0).abs() < 1e-12);
    }
}
