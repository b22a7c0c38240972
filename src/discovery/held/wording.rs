//! What is said of a thing held in the hand: what was assumed, what was refused, how an effect reads.

use super::gap::Term;
use crate::discovery::finding::ParameterEstimate;
use crate::discovery::recording::Error;
use crate::discovery::selection::Diverged;
use crate::discovery::vocabulary::OBJECT_TRACKER;
use crate::discovery::wording::left_aside;
use crate::language::ast::EffectItem;
use crate::units::significant;

pub(super) use crate::discovery::wording::no_such;

/// No stretch in which anything is held.
pub(super) fn nothing_held(recording: &str) -> Error {
    Error::new(
        "nothing is held in it, as far as `gripper` and `held` say",
        recording,
        "add a column `held` of 0 and 1, or segments called `held` to the sidecar",
    )
}

/// Joints that this robot cannot have.
pub(super) fn not_this_robot(error: &impl ToString, recording: &str) -> Error {
    Error::new(error.to_string(), recording, "is it the recording of this robot?")
}

/// A fit that ran away.
pub(super) fn diverged(what: Diverged, recording: &str) -> Error {
    Error::new(
        what.to_string(),
        recording,
        "are the object's columns in m, in the frame of the robot's base?",
    )
}

pub(super) fn hand_does_not_turn(recording: &str) -> String {
    format!("{recording}: no joints and no `tcp_qw`; the hand is taken not to turn")
}

pub(super) fn size_unknown(recording: &str) -> String {
    format!(
        "{recording}: the sidecar does not say which object is held (`{{\"held\": {{\"object\": \"jar\"}}}}`); \
         its size is not judged"
    )
}

/// Before it was held it was seen `higher` m above where it stands.
pub(super) fn not_on_table(recording: &str, higher: f64) -> String {
    format!(
        "{recording}: before it is held the object is {} m away from where it stands on the table, so its height is not \
         judged",
        significant(higher, 2)
    )
}

/// What a height rests on.
pub(super) fn stood_on_table() -> String {
    "its height is that of a thing that stood on the table before it was held, as is assumed".into()
}

/// Where a size is read.
pub(super) fn read_once(term: &Term) -> &'static str {
    match term {
        Term::Height => "where it stood before it was held",
        _ => at_the_stop(),
    }
}

pub(super) fn squeeze_unknown(recording: &str) -> String {
    format!(
        "{recording}: how hard the fingers squeeze is not said (`squeeze_n`, `mass_kg`); that it slips only under \
         load cannot be tried"
    )
}

pub(super) fn all_is_held(recording: &str) -> String {
    format!("{recording}: neither `held` nor `gripper[m]` is recorded; all of it is taken as held")
}

/// It turned by an angle, rad.
pub(super) fn pivoted(recording: &str, angle: f64) -> String {
    let degrees = significant(angle.to_degrees(), 2);
    format!(
        "{recording}: it turned by {degrees} deg in the fingers, which no effect has a name for"
    )
}

pub(super) fn one_recording() -> String {
    "of one recording every second second is held out; a second one would be a better judge".into()
}

pub(super) fn not_of_holding(effect: &EffectItem) -> String {
    let of = (effect.name.text.as_str(), effect.at.text.as_str());
    left_aside(of, "does not change how a thing is held", OBJECT_TRACKER)
}

/// How an effect reads with its numbers.
pub(super) fn equation(object: &str, term: &Term, estimates: &[ParameterEstimate]) -> String {
    let number = |i: usize| {
        let (_, value, _, unit) = &estimates[i];
        format!("{} {unit}", significant(*value, 3)).trim_end().to_owned()
    };
    match term {
        Term::Rate => {
            format!("{object} creeps in the hand by {} the way its weight pulls", number(0))
        }
        Term::Friction => {
            format!(
                "{object} slips while the load along the pads exceeds 2 * {} * squeeze",
                number(0)
            )
        }
        Term::Width(_) => format!("{object} is {} wider between the fingers", number(0)),
        Term::Height => format!("{object} is {} higher", number(0)),
        Term::Late => format!("{object} was seen {} late", number(0)),
        Term::Shift => format!(
            "seen place = R * place + d with x {}, y {}, z {}, roll {}, pitch {}, yaw {}",
            number(0),
            number(1),
            number(2),
            number(3),
            number(4),
            number(5)
        ),
    }
}

/// When the thing moves, and along which axis of the hand.
pub(super) fn along_hand(when: &str, axis: &str) -> String {
    format!("{when}, along {axis} of the hand")
}

/// Where the gap of an opening is.
pub(super) fn at_the_stop() -> &'static str {
    "the opening at which the fingers stop"
}

pub(super) fn nothing_missing() -> &'static str {
    "the object stayed where it was in the hand, within noise, and is as large as the scene says"
}

/// What to do when several effects explain the same.
pub(super) fn hold_otherwise() -> &'static str {
    "hold it still for ten seconds, and then move it as fast as it may be moved, up and down"
}

/// When of the time it is held the thing moves, from how much it moved in the first and the last half.
pub(super) fn when(first: f64, last: f64) -> &'static str {
    if (first - last).abs() < 0.5 * (first + last) {
        "all the time it is held"
    } else if first > last {
        "soon after it is taken"
    } else {
        "the longer it is held"
    }
}

/// How wide it is along an axis of its own.
pub(super) fn width(object: &str, axis: usize) -> String {
    format!("{object} width {}", ["x", "y"][axis.min(1)])
}

/// How high it is.
pub(super) fn height(object: &str) -> String {
    format!("{object} height")
}
