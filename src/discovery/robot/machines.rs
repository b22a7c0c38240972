//! Whether recordings are of one machine, before it is asked what that machine lacks: a load that only some of them bear, or numbers
//! that no one machine has.
//!
//! What tells them apart is [`super::links`]'s.

use super::arm_finding::{different, loaded};
use super::channels::Quantity;
use super::explain::ArmGap;
use super::laid_out;
use super::links::{self, Alone, Carried, Numbers, Spread};
use super::term::{Law, Term};
use super::wording;
use crate::discovery::finding::Finding;
use crate::discovery::recording::Recording;
use crate::discovery::selection::Options;
use crate::language::ast::EffectItem;
use crate::motion::Robot;

/// Takes into account that torques are read a little late or early beside the motion, if they are.
pub(super) fn settle_delay(gap: &mut ArmGap, notes: &mut Vec<String>) {
    if let Some(delay) = links::late(gap) {
        gap.known.0.push(Term { law: Law::SensorDelay(Quantity::Torque), joint: 0 });
        gap.known.1.push(delay);
        notes.push(wording::read_late(delay));
    }
}

/// Says by what the recordings held out are of another machine than those fitted, if they are.
pub(super) fn apart(
    gap: &mut ArmGap,
    numbers: &Numbers,
    [train, heldout]: [&[Recording]; 2],
    options: &Options,
    notes: &[String],
) -> Option<Finding> {
    if numbers.are_apart
        && let Some((carried, of_train)) = bearing(gap)
    {
        let who = names(if of_train { train } else { heldout });
        return Some(loaded(gap, &carried, &who, options, notes.to_vec()));
    }
    let words = numbers.different.as_ref()?;
    Some(different(gap, words, notes.to_vec()))
}

/// Judges anew recordings of which no model of one machine was found: says which of three or more are of another machine than the
/// others, whichever were to be fitted, or notes in `found` which number differs between them.
pub(super) fn parted(
    robot: &Robot,
    known: &[EffectItem],
    [train, heldout]: [&[Recording]; 2],
    options: &Options,
    found: &mut Finding,
) -> Option<Finding> {
    let (gap, _) = laid_out::gap(robot, known, train, heldout).ok()?;
    let alone = Alone::of(&gap)?;
    let recordings = || train.iter().chain(heldout);
    if let Some(stands) = alone.parted() {
        let all = recordings().cloned().zip(stands);
        let (against, others): (Vec<_>, Vec<_>) = all.partition(|(_, stands)| *stands);
        let [others, against] = [others, against].map(|set| -> Vec<Recording> {
            set.into_iter().map(|(recording, _)| recording).collect()
        });
        let either = [[&others[..], &against], [&against, &others]];
        let judged = either.into_iter().find_map(|sets| of_two(robot, known, sets, options));
        if judged.is_some() {
            return judged;
        }
    }
    let Spread { name, values } = alone.spread()?;
    let values: Vec<_> = recordings().map(|r| r.name.as_str()).zip(values).collect();
    found.notes.insert(0, wording::differs(&name, &values));
    None
}

/// Says by what two sets of recordings are of two machines, if they are: where those fitted have more than the file knows, and those
/// held out have not, it shows only the other way round.
fn of_two(
    robot: &Robot,
    known: &[EffectItem],
    sets: [&[Recording]; 2],
    options: &Options,
) -> Option<Finding> {
    let [fitted, held] = sets;
    let (mut gap, mut notes) = laid_out::gap(robot, known, fitted, held).ok()?;
    settle_delay(&mut gap, &mut notes);
    let numbers = links::identified(&gap)?;
    notes.insert(0, wording::parted(&names(held)));
    apart(&mut gap, &numbers, sets, options, &notes)
}

/// Returns the load that the recordings held out bear, or those fitted, which then change their places; and whether it is those.
fn bearing(gap: &mut ArmGap) -> Option<(Carried, bool)> {
    for of_train in [false, true] {
        if let Some(carried) = links::carried(gap) {
            return Some((carried, of_train));
        }
        std::mem::swap(&mut gap.train, &mut gap.heldout);
    }
    None
}

fn names(recordings: &[Recording]) -> Vec<&str> {
    recordings.iter().map(|recording| recording.name.as_str()).collect()
}
