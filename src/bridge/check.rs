//! What feedback must be before it is believed: of the right length, finite, in order of time, and in SI units.

use std::f64::consts::TAU;

use serde_json::Value;

use super::error::{Error, Unit};
use super::wire::Told;
use crate::arm::Mover;

/// The robot that a reality must have.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Its folder in `stdlib/robots`.
    pub robot: String,
    /// Its joints, in its order.
    pub joints: Vec<Joint>,
    /// The widest opening between its pads, m; 0 without a gripper.
    pub max_opening: f64,
}

/// A joint that a reality must have.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Its range, rad or m; infinite where it turns without end.
    pub range: (f64, f64),
    /// What its motor may carry, N·m or N; infinite where nobody says.
    pub effort: f64,
    /// Its highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Its highest acceleration, rad/s² or m/s², by which it is brought to rest.
    pub acceleration: f64,
    /// Its highest jerk, rad/s³ or m/s³.
    pub jerk: f64,
}

/// So many times beyond its effort a joint's torque is in another unit. Chosen: a torque sensor feels a knock of a few times the effort;
/// mN·m are a thousand times more.
const TIMES_EFFORT: f64 = 10.0;

/// Fingers that are closed may be told to be open by so much less than nothing, m: their zero is off. Chosen: an encoder's zero is off by
/// some tenths of a millimetre.
const BELOW_NOTHING: f64 = 0.005;

/// A joint that is told to have turned by more, rad, and so many times faster than it can, is another or has another sign. Chosen: twice what a
/// joint may be behind its command, since less is told as that; and clocks may be coarse.
const LEAP: f64 = 0.4;
const TIMES_SPEED: f64 = 3.0;

/// Numbers that stay the same to the last bit for longer, s, while commands go on by more, rad, are not read from the arm, if by them it moves.
/// Chosen: a server may read its arm four times a second; a joint that does not follow is known later.
const FROZEN: (f64, f64) = (0.25, 0.1);

/// Feedback that does not change while commands do.
#[derive(Debug, Clone, Default)]
pub(super) struct Unchanged {
    /// The server's time, s, and what was commanded, rad, when it began.
    since: Option<(f64, Vec<f64>)>,
}

impl Unchanged {
    /// Takes in feedback after the one `before` and what was commanded with it, rad; returns what is wrong, if that has gone on for too
    /// long. An arm at rest is none of it.
    pub(super) fn takes(
        &mut self,
        before: &Told,
        told: &Told,
        sent: Option<&[f64]>,
    ) -> Option<Error> {
        let rests = told.dq.iter().all(|dq| dq.abs() <= 0.0);
        if rests || told.q != before.q || told.dq != before.dq {
            self.since = None;
            return None;
        }
        let sent = sent?;
        let (begin, from) = self.since.get_or_insert_with(|| (before.t, sent.to_vec()));
        let moved = sent.iter().zip(from.iter()).map(|(to, from)| (to - from).abs());
        let (passed_s, moved) = (told.t - *begin, moved.fold(0.0, f64::max));
        (passed_s > FROZEN.0 && moved > FROZEN.1)
            .then(|| Error::Frozen { passed_s, sent_deg: moved.to_degrees() })
    }
}

/// Returns which number of feedback that cannot be read is none: JSON has no word for it, and programs write `NaN` or `null`.
pub(super) fn no_number(line: &[u8], request: &'static str) -> Option<Error> {
    let text = std::str::from_utf8(line).ok()?.to_owned();
    let words = ["-Infinity", "Infinity", "NaN"];
    let text = words.into_iter().fold(text, |text, word| text.replace(word, "null"));
    let told: Value = serde_json::from_str(&text).ok()?;
    for field in ["q", "dq", "tau"] {
        let mut list = told.get(field).and_then(Value::as_array).into_iter().flatten();
        if let Some(at) = list.position(Value::is_null) {
            return Some(Error::NotFinite { request, field, joint: Some(at + 1) });
        }
    }
    let single = ["t", "opening"].into_iter();
    let mut none = single.filter(|field| told.get(*field).is_some_and(Value::is_null));
    none.next().map(|field| Error::NotFinite { request, field, joint: None })
}

/// Returns what is wrong with feedback, if anything is; `before` is the feedback before it.
pub(super) fn wrong(
    told: &Told,
    request: &'static str,
    wanted: &Wanted,
    before: Option<&Told>,
) -> Option<Error> {
    let joints = wanted.joints.len();
    let lists = [("q", &told.q), ("dq", &told.dq), ("tau", &told.tau)];
    for (field, list) in lists {
        if list.len() != joints {
            return Some(Error::Length { request, field, got: list.len(), joints });
        }
        if let Some(at) = list.iter().position(|number| !number.is_finite()) {
            return Some(Error::NotFinite { request, field, joint: Some(at + 1) });
        }
    }
    for (field, number) in [("t", told.t), ("opening", told.opening)] {
        if !number.is_finite() {
            return Some(Error::NotFinite { request, field, joint: None });
        }
    }
    if let Some(error) = in_other_units(told, request, wanted, before) {
        return Some(error);
    }
    if told.moving.len() > Mover::MOST {
        return Some(Error::Movers { request, got: told.moving.len() });
    }
    for (at, mover) in told.moving.iter().enumerate() {
        let is_another = told.moving[..at].iter().any(|other| other.name == mover.name);
        if !mover.is_sound() || mover.name.is_empty() || is_another {
            return Some(Error::Mover { request, which: at + 1 });
        }
    }
    let before = before?;
    if told.t < before.t {
        return Some(Error::ClockWentBack { from: before.t, to: told.t });
    }
    leaps(told, request, wanted, before)
}

/// Returns which joint was nowhere near here at the feedback before; whole turns are no distance.
fn leaps(told: &Told, request: &'static str, wanted: &Wanted, before: &Told) -> Option<Error> {
    let within_s = told.t - before.t;
    let ways = told.q.iter().zip(&before.q).map(|(q, from)| q - from);
    for (at, (way, joint)) in ways.zip(&wanted.joints).enumerate() {
        let turned = (way - TAU * (way / TAU).round()).abs();
        if turned > LEAP + TIMES_SPEED * joint.velocity * within_s {
            let (turned_deg, limit_deg_s) = (turned.to_degrees(), joint.velocity.to_degrees());
            return Some(Error::Leap { request, joint: at + 1, turned_deg, within_s, limit_deg_s });
        }
    }
    None
}

/// Returns which number cannot be in SI units. A joint may be a whole turn out of its range, as some encoders count, fingers be read
/// beyond their widest, and a torque be some times its joint's effort: what is told here is no measurement of this robot. Torques after some
/// that could be are in their unit, and what is wrong with them is another thing.
fn in_other_units(
    told: &Told,
    request: &'static str,
    wanted: &Wanted,
    before: Option<&Told>,
) -> Option<Error> {
    let other = |field, joint, value, range, probably| {
        Some(Error::Units { request, field, joint, value, range, probably })
    };
    for (at, (value, joint)) in told.q.iter().zip(&wanted.joints).enumerate() {
        let range = joint.range;
        let fits = |value: f64| (range.0 - TAU..=range.1 + TAU).contains(&value);
        if !fits(*value) {
            let probably = fits(value.to_radians()).then_some(Unit::Degrees);
            return other("q", Some(at + 1), *value, range, probably);
        }
    }
    for (at, (value, joint)) in told.tau.iter().zip(&wanted.joints).enumerate() {
        let most = joint.effort;
        if value.abs() > TIMES_EFFORT * most {
            // Zeros are in any unit.
            if let Some(before) = before.filter(|told| told.tau.iter().any(|tau| tau.abs() > 0.0)) {
                let (joint, value, before) = (at + 1, *value, before.tau[at]);
                return Some(Error::Knock { request, joint, value, before, most });
            }
            let probably = (value.abs() / 1e3 <= most).then_some(Unit::Millinewtons);
            return other("tau", Some(at + 1), *value, (-most, most), probably);
        }
    }
    let widest = wanted.max_opening;
    if widest > 0.0 && (-2.0 * widest..-BELOW_NOTHING).contains(&told.opening) {
        return Some(Error::Negative { request, opening_mm: told.opening * 1e3 });
    }
    let fits = |opening: f64| (-BELOW_NOTHING..=2.0 * widest).contains(&opening);
    if widest > 0.0 && !fits(told.opening) {
        let probably = unit_of_opening(told.opening, widest);
        return other("opening", None, told.opening, (0.0, widest), probably);
    }
    None
}

/// Returns in which unit an opening is probably told that can be none in m, of fingers that open by `widest` m. They mostly stand open when a
/// server is met first, so the widest in each unit is looked for before what else would fit.
fn unit_of_opening(told: f64, widest: f64) -> Option<Unit> {
    /// As near to the widest as this share of it fingers are that stand open: their zero may be off.
    const NEAR: f64 = 0.1;
    /// What the widest is in per cent and in a Robotiq's counts.
    const PER_CENT: f64 = 100.0;
    const COUNTS: f64 = 255.0;
    let is_about = |most: f64| (told - most).abs() <= NEAR * most;
    let is_within = |most: f64| (0.0..=most).contains(&told);
    let (mm, twice_mm) = (widest * 1e3, 2.0 * widest * 1e3);
    if is_within(1.0 + NEAR) {
        Some(Unit::Fractions)
    } else if is_about(mm) {
        Some(Unit::Millimetres)
    } else if is_about(PER_CENT) {
        Some(Unit::PerCent)
    } else if is_about(COUNTS) {
        Some(Unit::Counts)
    } else if is_within(twice_mm) {
        Some(Unit::Millimetres)
    } else {
        is_within(COUNTS).then_some(Unit::Counts)
    }
}
