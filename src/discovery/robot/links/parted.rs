//! What recordings say one by one: which stand against the others, as two sets that two sets of numbers describe best, and which
//! number is another in each.
//!
//! It parts them and does not judge: whether two machines are what is seen, or a load, is asked of the two sets as it is of any.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::super::explain::ArmGap;
use super::columns::{Columns, problem};
use super::fit::{CREEPS, Fit, Parts, Problem, Sums};
use super::tells;
use crate::discovery::selection::Set;

/// Of so many recordings every way to part them is tried; of more each by itself against the others.
const FEW: usize = 6;

/// From so many standard deviations on, in the mean, a number differs between recordings.
pub(in super::super) const DIFFERS: f64 = 5.0;

/// And only if one machine leaves so many times more of some sensor, in squares, than each recording's own numbers.
pub(in super::super) const MATTERS: f64 = 1.2;

/// What each recording says by itself.
pub(in super::super) struct Alone {
    /// By creep, then by recording, those fitted first.
    sums: Vec<Vec<Vec<Sums>>>,
    parts: Parts,
    /// The arm with the last recording alone: what is known of its numbers is the same in all.
    gap: ArmGap,
}

/// A number that is another in each recording.
pub(in super::super) struct Spread {
    pub(in super::super) name: (String, &'static str),
    /// By recording, those fitted first.
    pub(in super::super) values: Vec<f64>,
}

impl Alone {
    /// Sums up what each recording says; `None` where one says nothing of the links.
    pub(in super::super) fn of(gap: &ArmGap) -> Option<Self> {
        if !tells(gap) {
            return None;
        }
        let mut alone = gap.for_search();
        let parts = Parts::of(alone.train.first()?.arm.chain.bodies.len());
        let mut models = std::mem::take(&mut alone.train);
        models.append(&mut alone.heldout);
        let mut sums = vec![Vec::new(); CREEPS.len()];
        for model in models {
            alone.train = vec![model];
            let columns = Columns::of(&alone, Set::Train)?;
            for (all, creep) in sums.iter_mut().zip(CREEPS) {
                all.push(columns.summed(&alone, creep, &[])?);
            }
        }
        Some(Self { sums, parts, gap: alone })
    }

    fn problem(&self, train: Vec<Sums>, heldout: Vec<Sums>) -> Problem {
        problem(&self.gap, (train, heldout), 0)
    }

    /// Returns the numbers of a machine.
    fn all(&self) -> DMatrix<f64> {
        self.parts.only(&[&self.parts.bodies, &self.parts.joints, &self.parts.load])
    }

    /// Returns which recordings, those fitted first, stand against the others; `None` of fewer than three.
    pub(in super::super) fn parted(&self) -> Option<Vec<bool>> {
        let n = self.sums.first()?.len();
        if n < 3 {
            return None;
        }
        let left = |way: &Vec<bool>| {
            let of = |each: &Vec<Vec<Sums>>| {
                let set = |stands| {
                    let sets = each.iter().zip(way).filter(|(_, is)| **is == stands);
                    together(sets.map(|(one, _)| one))
                };
                self.left_of_two(&self.problem(set(false)?, set(true)?))
            };
            self.sums.iter().filter_map(of).min_by(f64::total_cmp)
        };
        let scored = ways(n).into_par_iter().filter_map(|way| Some((left(&way)?, way)));
        scored.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, way)| way)
    }

    /// Returns the number of a joint or a load that differs most between recordings, if one does so much that no model of one machine
    /// fits.
    pub(in super::super) fn spread(&self) -> Option<Spread> {
        let all = self.all();
        let of = |creep: usize| {
            let each = &self.sums[creep];
            let merged = self.problem(together(each.iter())?, Vec::new()).fit(&all)?;
            let own = each.iter().map(|one| self.problem(one.clone(), Vec::new()).fit(&all));
            Some((merged, own.collect::<Option<Vec<Fit>>>()?, creep))
        };
        let fits = (0..CREEPS.len()).filter_map(of);
        let (merged, own, creep) = fits.min_by(|a, b| a.0.total().total_cmp(&b.0.total()))?;
        let each = &self.sums[creep];
        let rows = |sensor: usize| each.iter().map(move |one| one[sensor].rows);
        let matters = merged.weights.iter().enumerate().any(|(sensor, left)| {
            let parts = own.iter().zip(rows(sensor)).map(|(fit, rows)| fit.weights[sensor] * rows);
            left * rows(sensor).sum::<f64>() > MATTERS * parts.sum::<f64>()
        });
        let numbers = self.parts.joints.start..self.parts.load.end;
        let differs = |at: usize| -> f64 {
            let told = own.iter().map(|fit| (fit.x[at], fit.covariance[(at, at)].max(1e-300)));
            let (sum, weight) = told.clone().fold((0.0, 0.0), |(sum, all), (x, variance)| {
                (sum + x / variance, all + 1.0 / variance)
            });
            let squares: f64 =
                told.map(|(x, variance)| (x - sum / weight).powi(2) / variance).sum();
            squares / (own.len() as f64 - 1.0).max(1.0)
        };
        let (worst, at) = numbers
            .map(|at| (differs(at), at))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(worst, _)| matters && *worst > DIFFERS * DIFFERS)?;
        let values = own.iter().map(|fit| fit.x[at]).collect();
        let bodies = &self.gap.train.first()?.arm.chain.bodies;
        worst.is_finite().then(|| Spread { name: self.parts.name(at, bodies), values })
    }

    /// Returns what is left of both sets, each by numbers of its own, in -2 ln of the odds: the same noise is in both.
    fn left_of_two(&self, problem: &Problem) -> Option<f64> {
        let all = self.all();
        let (here, there) = (problem.fit(&all)?, problem.turned().fit(&all)?);
        let of = |(a, b): (&Sums, &Sums)| {
            let rows = a.rows + b.rows;
            let left = (a.left(&here.x) * a.rows + b.left(&there.x) * b.rows) / rows.max(1.0);
            rows / a.related.max(b.related) * left.ln()
        };
        Some(problem.train.iter().zip(&problem.heldout).map(of).sum())
    }
}

/// Returns what recordings say together.
fn together<'a>(mut all: impl Iterator<Item = &'a Vec<Sums>>) -> Option<Vec<Sums>> {
    let first = all.next()?.clone();
    let both = |a: Vec<Sums>, b: &Vec<Sums>| a.iter().zip(b).map(|(a, b)| a.and(b)).collect();
    Some(all.fold(first, both))
}

/// Returns the ways to part `n` in two, each by which stand against the others: no more than half, and of two halves one.
fn ways(n: usize) -> Vec<Vec<bool>> {
    let singles = (0..n).map(|one| (0..n).map(|at| at == one).collect());
    if n > FEW {
        return singles.collect();
    }
    let of = |way: u32| -> Vec<bool> { (0..n).map(|at| way >> at & 1 == 1).collect() };
    let count = |way: &Vec<bool>| way.iter().filter(|stands| **stands).count();
    let all = (1..1_u32 << n).map(of);
    all.filter(|way| 2 * count(way) < n || 2 * count(way) == n && way[n - 1]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_part_a_few_comes_once() {
        // Half of all choices but the one of nothing, since a set and the others are one way.
        for (n, count) in [(3, 3), (4, 7), (5, 15), (6, 31), (7, 7)] {
            let ways = ways(n);
            assert_eq!(ways.len(), count);
            for (at, way) in ways.iter().enumerate() {
                let turned: Vec<bool> = way.iter().map(|stands| !stands).collect();
                assert!(!ways[at + 1..].contains(way) && !ways.contains(&turned));
            }
        }
    }
}
