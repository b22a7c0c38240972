//! Which of several recordings stand against the others: two sets that two sets of numbers describe best.
//!
//! It parts them and does not judge: whether two machines are what is seen, or a load, is asked of the two sets as it is of any.

use rayon::prelude::*;

use super::super::explain::ArmGap;
use super::fit::{Parts, Problem, Sums};
use super::{CREEPS, Columns, problem, tells};
use crate::discovery::selection::Set;

/// Of so many recordings every way to part them is tried; of more each by itself against the others.
const FEW: usize = 6;

/// Returns which recordings, those fitted first, stand against the others; `None` of fewer than three, or where they say nothing of
/// the links.
pub(in super::super) fn parted(gap: &ArmGap) -> Option<Vec<bool>> {
    let n = gap.train.len() + gap.heldout.len();
    if n < 3 || !tells(gap) {
        return None;
    }
    let mut alone = gap.for_search();
    let parts = Parts::of(alone.train.first()?.arm.chain.bodies.len());
    let mut models = std::mem::take(&mut alone.train);
    models.append(&mut alone.heldout);
    let mut each: Vec<Vec<Vec<Sums>>> = Vec::new();
    for model in models {
        alone.train = vec![model];
        let columns = Columns::of(&alone, Set::Train)?;
        let all = CREEPS.into_iter().map(|creep| columns.summed(&alone, creep, &[]));
        each.push(all.collect::<Option<_>>()?);
    }
    let left = |way: &Vec<bool>| {
        let of = |creep: usize| {
            let set = |stands| {
                let mut sets = each.iter().zip(way).filter(|(_, is)| **is == stands);
                let first = sets.next()?.0[creep].clone();
                Some(sets.fold(first, |all, (one, _)| together(&all, &one[creep])))
            };
            left_of_two(&problem(&alone, (set(false)?, set(true)?), 0), &parts)
        };
        (0..CREEPS.len()).filter_map(of).min_by(f64::total_cmp)
    };
    let scored = ways(n).into_par_iter().filter_map(|way| Some((left(&way)?, way)));
    scored.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, way)| way)
}

fn together(all: &[Sums], more: &[Sums]) -> Vec<Sums> {
    all.iter().zip(more).map(|(a, b)| a.and(b)).collect()
}

/// Returns what is left of both sets, each by numbers of its own, in -2 ln of the odds: the same noise is in both.
fn left_of_two(problem: &Problem, parts: &Parts) -> Option<f64> {
    let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load]);
    let (here, there) = (problem.fit(&all)?, problem.turned().fit(&all)?);
    let of = |(a, b): (&Sums, &Sums)| {
        let rows = a.rows + b.rows;
        let left = (a.left(&here.x) * a.rows + b.left(&there.x) * b.rows) / rows.max(1.0);
        rows / a.related.max(b.related) * left.ln()
    };
    Some(problem.train.iter().zip(&problem.heldout).map(of).sum())
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
