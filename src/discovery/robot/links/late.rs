//! How late torques are read beside the motion, where that is less than half a row.
//!
//! A torque that is read late looks like friction: what gravity changes while a joint turns is in proportion to its speed. Half a
//! row and more is an effect with a name; less is how the rows were written, and is taken into account before any effect is
//! looked for. It is fitted beside all numbers of the links and of the joints, for it is one for all joints and they are not, and beside a
//! tilt of the base, which is one for all of them too; and taken only if the recordings held out say the same.

use std::ops::Range;

use nalgebra::DMatrix;

use super::super::channels::Quantity;
use super::super::explain::ArmGap;
use super::super::term::{Law, Term};
use super::body::NUMBERS;
use super::columns::{Columns, problem};
use super::fit::{BETTER, CREEPS, Parts, Problem, TILT};
use super::of_joints;
use crate::discovery::selection::{Residuals as _, Set};

/// So many of its standard deviations it must be from none. Chosen: of five, chance gives one in two million.
const SURE: f64 = 5.0;
/// By how much the delay of the recordings fitted and that of those held out may differ, as a share of it. Chosen: of twice as
/// much, one of the two would as well be none.
const AGREE: f64 = 0.5;

/// Speed below which dry friction is taken to give way, rad/s: how late torques are hardly depends on it.
const CREEP: f64 = CREEPS[1];

/// Returns how late torques are read, s, negative if early, where it is less than half a row and the recordings tell; `None` else.
pub(in super::super) fn late(gap: &ArmGap) -> Option<f64> {
    let delay = Term { law: Law::SensorDelay(Quantity::Torque), joint: 0 };
    let mut models = gap.train.iter().chain(&gap.heldout);
    let have_torque = models.all(|model| model.course.data.has(Quantity::Torque));
    if !gap.is_along() || !have_torque || gap.known.0.contains(&delay) {
        return None;
    }
    let (half, gap) = (0.5 * row(gap)?, gap.for_search());
    let parts = Parts::of(gap.train[0].arm.chain.n());
    let [train, heldout] = [Set::Train, Set::Heldout].map(|set| Columns::of(&gap, set));
    let columns = [train?, heldout?];
    let problem = |more: [&[&Vec<f64>]; 2]| -> Option<Problem> {
        let [train, heldout] = [0, 1].map(|k| columns[k].summed(&gap, CREEP, more[k]));
        Some(problem(&gap, (train?, heldout?), more[0].len()))
    };
    let without = problem([&[], &[]])?;
    // The file's links, unless others predict clearly better: each number that is fitted makes the delay less sure.
    let fit = |numbers: &[&Range<usize>]| without.fit(&parts.only(numbers));
    let tilt = parts.named.end - TILT..parts.named.end;
    let all = [&parts.bodies, &parts.joints, &tilt];
    let (free, bare) = (fit(&all)?, fit(&all[1..])?);
    let left = [&free, &bare].map(|fit| without.judged(&fit.x, &free.weights));
    let (free, numbers) =
        if left[0] <= BETTER * left[1] { (free, &all[..]) } else { (bare, &all[1..]) };
    // By how much what is left falls for a second of delay of all that was fitted.
    let changes: Vec<[f64; NUMBERS]> = (0..parts.bodies.len() / NUMBERS)
        .map(|body| std::array::from_fn(|k| free.x[body * NUMBERS + k]))
        .collect();
    let fitted = gap.with_bodies(&changes);
    let (mut terms, values) = of_joints(&free.x, &parts, CREEP);
    terms.push(delay);
    let column = |set: Set| -> Option<Vec<f64>> {
        let [early, late] = [-half, half]
            .map(|delay| fitted.residuals(set, &terms, &[&values[..], &[delay]].concat()));
        Some(early?.iter().zip(late?).map(|(early, late)| (early - late) / (2.0 * half)).collect())
    };
    let [train, heldout] = [column(Set::Train)?, column(Set::Heldout)?];
    let with = problem([&[&train], &[&heldout]])?;
    let last = with.prior.len() - 1;
    let also = |directions: DMatrix<f64>| {
        let at = (directions.nrows(), directions.ncols());
        let mut more = directions.insert_row(at.0, 0.0).insert_column(at.1, 0.0);
        more[at] = 1.0;
        more
    };
    let directions = also(parts.only(numbers));
    let told = |problem: &Problem| -> Option<(f64, f64)> {
        let fit = problem.fit(&directions)?;
        let variance = fit.covariance[(last, last)];
        (variance > 0.0).then(|| (fit.x[last], variance.recip()))
    };
    let (here, there) = (told(&with)?, told(&with.turned())?);
    let weight = here.1 + there.1;
    let delay = (here.0 * here.1 + there.0 * there.1) / weight;
    let is_sure = delay.abs() * weight.sqrt() > SURE;
    let agree = (here.0 - there.0).abs() < AGREE * delay.abs();
    (is_sure && agree && delay.abs() < half).then_some(delay)
}

/// Returns the time from row to row, s: the median of the first recording's.
fn row(gap: &ArmGap) -> Option<f64> {
    let times = &gap.train.first()?.course.data.time;
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().filter(|step| *step > 0.0)
}
