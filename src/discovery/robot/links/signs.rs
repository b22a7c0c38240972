//! Torques that are counted the other way round, told from an arm that has something.
//!
//! No arm needs the opposite of what its model needs, and no friction drives: where a sensor's torques turned round are explained far
//! better by the file, friction of both kinds, an offset and a rotor than the torques as they are by those and every load and
//! every link that could be, it is their sign.

use super::ANOTHER;
use super::fit::{Fit, Parts, Problem};

/// How many times more a fit may leave, in squares, for friction that must not drive.
const DRIVES: f64 = 2.0;

/// Torques with the wrong sign.
#[derive(Debug)]
pub(in super::super) struct Turned {
    /// Of which joints, from 0.
    pub(in super::super) joints: Vec<usize>,
    /// Whether those held out show it, rather than those fitted.
    pub(in super::super) of_heldout: bool,
    /// The largest part that stays of what they leave once they are turned, as a root mean square.
    pub(in super::super) left: f64,
}

impl Turned {
    /// Returns those of the recordings fitted, or else those of the recordings held out, if there are any.
    pub(super) fn of(problem: &Problem, parts: &Parts) -> Option<Self> {
        let of = |problem: &Problem, of_heldout| {
            let found = turned(problem, parts)?;
            let left = found.iter().map(|(_, left)| left.sqrt()).fold(0.0, f64::max);
            let joints = found.into_iter().map(|(joint, _)| joint).collect();
            Some(Self { joints, of_heldout, left })
        };
        of(problem, false).or_else(|| of(&problem.turned(), true))
    }
}

/// Returns the joints whose torques have the wrong sign, each with the part that stays of what they leave, in squares.
fn turned(problem: &Problem, parts: &Parts) -> Option<Vec<(usize, f64)>> {
    let sensors = 0..problem.train.len();
    let joint = |sensor: usize| problem.train[sensor].joint;
    let with_turned = |which: &[usize]| {
        let first = problem.with_gain(usize::MAX, 1.0, parts);
        which.iter().fold(first, |all, sensor| all.with_gain(joint(*sensor), -1.0, parts))
    };
    let joints = parts.only(&[&parts.joints]);
    let plain = problem.fit(&joints)?;
    let other = with_turned(&sensors.clone().collect::<Vec<_>>()).fit(&joints)?;
    let may_be: Vec<usize> = sensors.filter(|at| other.weights[*at] < plain.weights[*at]).collect();
    if may_be.is_empty() {
        return None;
    }
    let turned = with_turned(&may_be);
    let lists = [
        vec![&parts.joints],
        vec![&parts.joints, &parts.load],
        vec![&parts.bodies, &parts.joints, &parts.load],
    ];
    let fits = |problem: &Problem| -> Vec<Fit> {
        lists.iter().filter_map(|list| problem.fit(&parts.only(list))).collect()
    };
    let least = |fits: &[Fit], at: usize| {
        fits.iter().map(|fit| fit.weights[at]).fold(f64::INFINITY, f64::min)
    };
    let (as_read, turned_round) = (fits(problem), fits(&turned));
    let driven = fits(&Problem { is_up: vec![false; turned.is_up.len()], ..turned });
    let found = may_be.into_iter().filter_map(|at| {
        let [read, round, driven] = [&as_read, &turned_round, &driven].map(|fits| least(fits, at));
        (read > ANOTHER * round && round < DRIVES * driven).then(|| (joint(at), round / read))
    });
    let found: Vec<(usize, f64)> = found.collect();
    (!found.is_empty()).then_some(found)
}
