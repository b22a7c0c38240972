//! Whether recordings are of one machine, before it is asked what that machine lacks: a load that only some of them bear, or numbers
//! that no one machine has.
//!
//! What tells them apart is [`super::links`]'s.

use super::arm_finding::{different, loaded};
use super::channels::Quantity;
use super::explain::ArmGap;
use super::laid_out;
use super::links::{self, Carried, Numbers};
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

/// Says which of three or more recordings are of another machine than the others, whichever were to be fitted: for where no model of
/// one machine was found.
pub(super) fn parted(
    robot: &Robot,
    known: &[EffectItem],
    [train, heldout]: [&[Recording]; 2],
    options: &Options,
) -> Option<Finding> {
    let (gap, _) = laid_out::gap(robot, known, train, heldout).ok()?;
    let stands = links::parted(&gap)?;
    let all = train.iter().chain(heldout).cloned().zip(stands);
    let (against, others): (Vec<_>, Vec<_>) = all.partition(|(_, stands)| *stands);
    let [fitted, held] = [others, against]
        .map(|set| -> Vec<Recording> { set.into_iter().map(|(recording, _)| recording).collect() });
    let (mut gap, mut notes) = laid_out::gap(robot, known, &fitted, &held).ok()?;
    settle_delay(&mut gap, &mut notes);
    let numbers = links::identified(&gap)?;
    notes.insert(0, wording::parted(&names(&held)));
    apart(&mut gap, &numbers, [&fitted, &held], options, &notes)
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

fn names(recordings: &[Recording]) -> String {
    let names: Vec<&str> = recordings.iter().map(|recording| recording.name.as_str()).collect();
    names.join(", ")
}
