//! Poses at rest: a calibration against a tracker, a weighing. Rows are seconds or minutes apart and in any order; nothing is
//! derived from one to the next, and what is held out is drawn among them.
//!
//! [`investigate`] looks for one effect or a few that have names (`gap`). Where all numbers of the geometry together
//! (`geometry`) predict the poses held out clearly better than those, and those leave more than noise, the numbers are told
//! instead, and what is missing is looked for beside them.

mod at_rest;
mod gap;
mod geometry;
mod model;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;

pub(in super::super) use at_rest::are_poses;

use super::channels::Data;
use super::error::Misfit;
use super::links::fit::BETTER;
use super::plant::Arm;
use super::plausible;
use super::term::Term;
use super::wording;
use crate::discovery::Investigation;
use crate::discovery::finding::Verdict;
use crate::discovery::recording::{Error, Recording};
use crate::discovery::selection::{
    self, Hypothesis, Options, Outcome, Residuals as _, Set, sum_of_squares,
};
use crate::discovery::why::whys;
use crate::discovery::wording::{Worded as _, answer};
use crate::language::ast::EffectItem;
use crate::motion::Robot;
use at_rest::{Pose, poses};
use gap::{AtPoses, Noise};
use geometry::{Geometry, Seen};

/// More effects than this that have names are no list that a person could check against a table of the geometry.
const FEW: usize = 4;

/// What names leave is as noise up to this many standard deviations of χ² above it. Chosen: the usual one in twenty.
const AS_NOISE: f64 = 2.0;

/// A tracker's frame that is turned (rad) or shifted (m) by more than this is not the base's.
const ELSEWHERE: f64 = 0.2;

/// Finds what an arm's model lacks at rest: of several recordings the last is held out, of one a third of its poses, drawn.
///
/// # Errors
///
/// An [`Error`] for recordings that hold nothing of this arm, or too few poses to say anything.
pub(in super::super) fn investigate(
    robot: &Robot,
    known: &[EffectItem],
    recordings: &[Recording],
    holdout: f64,
    options: &Options,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Investigation, Error> {
    let mut notes: Vec<String> = recordings.iter().flat_map(|r| r.notes.clone()).collect();
    let arm = Arm::of(robot, &recordings[0])?;
    let tip = recordings[0].sidecar.tip.clone();
    let tip = tip.unwrap_or_else(|| robot.links()[robot.tip()].name.clone());
    let mut sets: Vec<Vec<Pose>> = Vec::new();
    for recording in recordings {
        recording.check_joints(&robot.sliding())?;
        let data = Data::at_rest(recording, arm.chain.n())?;
        plausible::check_at_rest(&arm, robot.joints(), &data, &recording.name)?;
        if data.are_currents {
            return Err(Misfit::CurrentsAtRest.at(&recording.name));
        }
        sets.push(poses(&data));
    }
    let (train, heldout) = split(sets, holdout);
    let place = recordings[0].name.clone();
    notes.push(wording::poses(train.len(), heldout.len()));
    let mut gap = AtPoses::new(arm, train, heldout);
    notes.extend(gap.take_known(known, &place)?);
    notes.extend(gap.find_tracker(ELSEWHERE));
    let too_few = || Misfit::TooFewPoses { n: gap.poses(Set::Train).len() }.at(&place);
    progress(wording::JUDGING_NOISE, 0.1);
    let geometry = Geometry::fitted(&Seen::of(&gap.arm.chain, &gap.known, gap.poses(Set::Train)));
    let noise = Noise::of(&gap, geometry.as_ref()).ok_or_else(too_few)?;
    gap.noise = noise;
    let options = Options { most: FEW, ..*options };
    let mut outcome = searched(&gap, &options, &place, progress)?;
    let filed = gap.clone();
    let (mut identified, mut revision) = (Vec::new(), None);
    if let Some(geometry) = &geometry {
        let with = filed.with_geometry(geometry);
        let off = geometry.off(&filed.arm.chain);
        let left = with.residuals(Set::Heldout, &[], &[]);
        let left = left.map_or(f64::INFINITY, |residuals| sum_of_squares(&residuals));
        let is_better = left < BETTER * outcome.best.heldout;
        if !off.is_empty() && is_better && !suffices(&gap, &outcome.best) {
            outcome = searched(&with, &options, &place, progress)?;
            revision = Some(geometry.revision(&filed.arm.chain, &tip));
            (gap, identified) = (with, off);
            let (count, rank) = (geometry.count(), geometry.rank());
            notes.push(wording::geometry(count, rank, geometry.told, geometry.noise));
        }
    }
    progress(wording::WRITING, 0.98);
    let traces = gap.traces(&filed, &outcome.best, &place);
    let whys = whys(&gap, &outcome, options.tie);
    let mut finding = answer(&gap, &outcome, &options, notes);
    if !identified.is_empty() {
        let none = selection::refit(&filed, Vec::new(), Vec::new(), Vec::new());
        let places = none.map_or(Vec::new(), |none| filed.places(&none));
        finding = finding.identified_first(identified, selection::left(&filed), places);
        if finding.verdict == Verdict::NothingMissing {
            finding.reason = wording::POSES_ARE_NOISE_NOW.into();
        }
    }
    Ok(Investigation { finding, traces, whys, experiment: None, revision })
}

/// Whether what has a name leaves nothing but noise, on the poses fitted and held out: then all numbers of the geometry, which by
/// chance may leave less of a few poses, say no more than the name.
fn suffices(gap: &AtPoses, best: &Hypothesis<Term>) -> bool {
    let sets = [(Set::Train, best.train), (Set::Heldout, best.heldout)];
    let is_noise = |(set, sum)| gap.above(sum, gap.count(set)) < AS_NOISE;
    !best.terms.is_empty() && sets.into_iter().all(is_noise)
}

/// Searches for effects among the poses of a recording.
fn searched(
    gap: &AtPoses,
    options: &Options,
    place: &str,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Outcome<Term>, Error> {
    selection::search(gap, options, progress)
        .map_err(|why| Misfit::searching_at_rest(why).at(place))
}

/// Splits poses into those fitted and those held out.
fn split(mut sets: Vec<Vec<Pose>>, holdout: f64) -> (Vec<Pose>, Vec<Pose>) {
    if sets.len() > 1 {
        let heldout = sets.pop().unwrap_or_default();
        return (sets.concat(), heldout);
    }
    let mut all = sets.pop().unwrap_or_default();
    // Always the same draw, so that the same poses get the same answer.
    all.shuffle(&mut StdRng::seed_from_u64(1));
    let held = ((all.len() as f64 * holdout).round() as usize).clamp(1, all.len().max(2) - 1);
    let train = all.split_off(held.min(all.len()));
    (train, all)
}
