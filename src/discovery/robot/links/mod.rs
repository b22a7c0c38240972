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
mod beside;
pub(super) mod body;
mod carried;
mod columns;
mod consistent;
pub(super) mod covariance;
pub(super) mod fit;
mod freed;
mod gains;
mod late;
pub(super) mod own;
mod parted;
mod rows;
mod settled;
mod signs;
mod single;

use std::ops::Range;

use nalgebra::DVector;
use rayon::prelude::*;

use super::channels::Quantity;
use super::explain::ArmGap;
use super::simulate::Model;
use super::term::{Law, Term};

use apart::{ANOTHER, Apart, SOME, heard, uncertain};
use beside::Shows;
use columns::problems;
use fit::{BETTER, Fit, OF_JOINT, Parts, Problem};
use freed::Freed;
use gains::Shown;
use own::Links;
use single::{Named, named};

pub(super) use beside::Beside;
pub(super) use carried::{Carried, carried};
pub(super) use gains::Gain;
pub(super) use late::late;
pub(super) use parted::{Alone, DIFFERS, MATTERS, Spread};
pub(super) use settled::settled;
pub(super) use signs::Turned;

/// And this part of what is beyond the least there is.
const HALF: f64 = 0.5;

/// What is left of some thousand rows differs by less than this part by chance.
const NO_CHANCE: f64 = 0.05;

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
    /// Others than the file's, where they are of one. Nothing where the file's, as they are, with one link heavier or with a load
    /// in the hand, predict the recordings held out better: those have names.
    pub(super) own: Option<Own>,
}

/// Numbers of the links that predict better than the file's.
#[derive(Debug, Default)]
pub(super) struct Own {
    /// Those that do so by themselves; then, the best first, gains of torque sensors beside which still others fit much better.
    pub(super) links: Option<(Links, Vec<Gain>)>,
    /// Several effects with names, or one that is no gain, beside which others predict much better still.
    pub(super) beside: Option<Beside>,
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
    let lists = [vec![parts.joints.clone()], vec![parts.joints.clone(), parts.load.clone()]];
    let freed = lists.par_iter().filter_map(|list| Freed::of(&problem, bodies, &parts, list));
    let freed: Vec<Freed> = freed.collect();
    // What an ampere is worth was fitted: a gain is in it.
    let has_gains = !model.course.data.are_currents;
    // What is carried for a while has no column here: what would show may be its weight.
    let is_bare = gap.things.is_empty();
    let beside = if is_bare { &lists[..] } else { &[] };
    let shows = beside::shows(&problem, &parts, bodies, beside, has_gains);
    let with = freed.iter().chain(shows.iter().map(Shows::freed)).map(Freed::with);
    let least = with.min_by(|a, b| a.total().total_cmp(&b.total()))?;
    let weights = heard(&problem, &parts, &least.weights)?;
    if weights.iter().all(|weight| weight.is_infinite()) {
        return Some(Numbers::default());
    }
    let with_gains = |(problem, list, without): (&Problem, &[Range<usize>], &Fit)| {
        if !has_gains {
            return Vec::new();
        }
        gains::shown(problem, &parts, list, without)
    };
    let best = taken(freed)?;
    let (left, unlikely) = (best.judged(&weights), best.unlikely(&parts));
    // Where what is held out does not tell them apart, what was fitted does.
    let stands =
        |named: &Named| named.left <= (1.0 - NO_CHANCE) * left || named.unlikely <= unlikely;
    let named = named(&problem, &parts, bodies, &weights);
    let named = named.into_iter().filter(stands).map(|named| named.left);
    // What was fitted of the joints may be worse than nothing, of what it was not fitted to.
    let as_filed = DVector::zeros(problem.prior.len());
    let [plain, loaded] = &lists;
    let with_load = problem.fit(&parts.only(loaded));
    let beside_load = with_load.map(|fit| with_gains((&problem, loaded, &fit)));
    let plainest = with_gains((&problem, plain, &bare))
        .iter()
        .chain(beside_load.iter().flatten())
        .map(|shown| shown.problem.judged(&shown.fit.x, &weights))
        .chain([&bare.x, &as_filed].map(|x| problem.judged(x, &weights)))
        .chain(named)
        .fold(f64::INFINITY, f64::min);
    let beside = beside::taken(shows);
    let left_beside = beside.as_ref().map_or(f64::INFINITY, |found| found.left(&weights));
    let apart = Apart::of(&problem, &parts, left.min(plainest).min(left_beside), &weights)?;
    // Where those fitted bear it, the file as it is may be right of those held out, and what was fitted is not.
    let are_apart = apart.by > SOME || left > SOME * plainest;
    if apart.by > ANOTHER {
        let different = Some(apart.words(&parts, bodies));
        return Some(Numbers { are_apart, different, ..Numbers::default() });
    }
    let is_better = is_clearly_less(left_beside, left.min(plainest));
    // A gain alone is looked for with what could stand for it.
    let is_alone = |found: &Shows| left <= plainest && found.is_one_gain();
    let beside = beside.filter(|found| is_better && !is_alone(found));
    let beside = beside.map(|found| found.told(bodies));
    if left > plainest {
        let own = beside.map(|beside| Own { links: None, beside: Some(beside) });
        return Some(Numbers { are_apart, own, ..Numbers::default() });
    }
    let gains = with_gains(best.free()).into_iter().filter_map(|shown| {
        let problem = &shown.problem;
        let freed = lists.iter().filter_map(|list| Freed::of(problem, bodies, &parts, list));
        let freed = taken(freed.collect())?;
        let left_with = freed.judged(&weights);
        let links = freed.links(bodies, left_with <= BETTER * plainest);
        let Shown { joint, gain: factor, std, explained, .. } = shown;
        (left_with < left).then_some(Gain { joint, factor, std, links, explained })
    });
    let gains = gains.collect();
    let links = best.links(bodies, left <= BETTER * plainest);
    let own = Some(Own { links: Some((links, gains)), beside });
    Some(Numbers { are_apart, own, ..Numbers::default() })
}

/// Returns whether what several numbers leave is clearly less than what others do, in units of the least there is: by a tenth, or by
/// half of what is beyond that, where this is no chance.
fn is_clearly_less(left: f64, than: f64) -> bool {
    left <= BETTER * than || (left <= than - NO_CHANCE && left - 1.0 <= HALF * (than - 1.0))
}

/// Returns the one of several that is to be taken.
fn taken(mut all: Vec<Freed>) -> Option<Freed> {
    let freed: Vec<&Freed> = all.iter().collect();
    let best = Freed::best(&freed)?;
    Some(all.swap_remove(best))
}

/// Returns whether every joint of a real arm has an effect like this: it is fitted with the links.
pub(super) fn is_of_joint(term: &Term) -> bool {
    OF_JOINT.iter().any(|(law, ..)| *law == term.law)
}

/// Returns the problem with the creep that fits best beside free bodies and a load, which would else speak for another, and its fit
/// of the joints alone.
fn best(problems: Vec<Problem>, parts: &Parts) -> Option<(Problem, Fit)> {
    let all = parts.only(&[&parts.bodies, &parts.joints, &parts.load]);
    let scored = problems.into_par_iter().filter_map(|problem| {
        let fit = problem.fit(&all)?;
        let sums = problem.train.iter().map(|sums| sums.left(&fit.x) / (sums.square / sums.rows));
        Some((sums.sum::<f64>(), problem))
    });
    let scored: Vec<(f64, Problem)> = scored.collect();
    let (_, problem) = scored.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let fit = problem.fit(&parts.only(&[&parts.joints]))?;
    Some((problem, fit))
}

/// Returns what was fitted of the joints as effects with their parameters.
fn of_joints(x: &DVector<f64>, parts: &Parts, creep: f64) -> (Vec<Term>, Vec<f64>) {
    let (mut terms, mut values) = (Vec::new(), Vec::new());
    for (k, value) in x.rows(parts.joints.start, parts.joints.len()).iter().enumerate() {
        let (law, ..) = OF_JOINT[k % OF_JOINT.len()];
        terms.push(Term { law, joint: k / OF_JOINT.len() });
        values.push(*value);
        values.extend((law == Law::Coulomb).then_some(creep));
    }
    (terms, values)
}
