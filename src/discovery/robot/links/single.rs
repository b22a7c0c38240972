//! What an effect with a name explains beside the numbers of the file, by itself or beside a load: where it does as well as other
//! links do, it is what is missing.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::super::chain::Body;
use super::body::{FAR_OUT, NUMBERS, numbers};
use super::fit::{Fit, Parts, Problem};

/// How often a load's inertia and its moment are made to agree: each time what is wrong falls to a few hundredths.
pub(super) const AGREEING: usize = 4;

/// What an effect with a name comes to.
pub(super) struct Named {
    /// What is left of the recordings held out.
    pub(super) left: f64,
    /// How unlikely it is by those fitted, in -2 ln of the odds.
    pub(super) unlikely: f64,
}

/// Returns each effect with a name beside the numbers of the file: a load, every link heavier by itself, and every other that could be
/// taken for other links, also beside a load.
pub(super) fn named(
    problem: &Problem,
    parts: &Parts,
    bodies: &[Body],
    weights: &[f64],
) -> Vec<Named> {
    let of = |fit: Fit, numbers: usize| Named {
        left: problem.judged(&fit.x, weights),
        unlikely: problem.misfit(&fit) + numbers as f64 * problem.price(),
    };
    let heavier = bodies.iter().enumerate().filter_map(|(at, body)| {
        let mut directions = parts.only(&[&parts.joints]).insert_column(0, 0.0);
        let own = numbers(body);
        (0..NUMBERS).for_each(|k| directions[(at * NUMBERS + k, 0)] = own[k]);
        if own[0] > 0.0 { Some(of(problem.fit(&directions)?, 1)) } else { None }
    });
    let others = parts.each_named().filter_map(|effect| {
        Some(of(problem.fit(&parts.only(&[&parts.joints, &effect]))?, effect.len()))
    });
    let mut all: Vec<Named> = heavier.chain(others).collect();
    let beside: Vec<Range<usize>> = std::iter::once(0..0).chain(parts.each_named()).collect();
    let loads = beside.par_iter();
    let loads = loads.filter_map(|effect| loaded(problem, parts, bodies.len(), effect, weights));
    all.par_extend(loads);
    all
}

/// Returns what a load comes to beside an effect, with the inertia that a mass at a place has: it follows from mass and moment, which
/// are fitted anew beside it until they agree.
fn loaded(
    problem: &Problem,
    parts: &Parts,
    n: usize,
    effect: &Range<usize>,
    weights: &[f64],
) -> Option<Named> {
    let directions = parts.only(&[&parts.joints, &parts.load, effect]);
    let mut fit = problem.fit(&directions)?;
    let mut left = problem.judged(&fit.x, weights);
    for _ in 0..AGREEING {
        let [mass, x, y, z] = std::array::from_fn(|k| fit.x[parts.load.start + k]);
        let moment = Vector3::new(x, y, z);
        if mass <= 0.0 || moment.norm() > FAR_OUT * mass {
            break;
        }
        let about = Matrix3::identity() * moment.norm_squared() - moment * moment.transpose();
        let mut changes = vec![[0.0; NUMBERS]; n];
        let [.., xx, xy, xz, yy, yz, zz] = &mut changes[n - 1];
        let pairs =
            [(xx, (0, 0)), (xy, (0, 1)), (xz, (0, 2)), (yy, (1, 1)), (yz, (1, 2)), (zz, (2, 2))];
        for (number, at) in pairs {
            *number = about[at] / mass;
        }
        let beside = problem.beside(&changes);
        fit = beside.fit(&directions)?;
        left = beside.judged(&fit.x, weights);
    }
    let numbers = parts.load.len() + effect.len();
    Some(Named { left, unlikely: problem.misfit(&fit) + numbers as f64 * problem.price() })
}
