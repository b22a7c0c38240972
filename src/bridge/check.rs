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

/// Returns what is wrong with feedback, if anything is; `before` is the time of the feedback before it, s.
pub(super) fn wrong(
    told: &Told,
    request: &'static str,
    wanted: &Wanted,
    before: Option<f64>,
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
    if let Some(error) = in_other_units(told, request, wanted) {
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
    let from = before?;
    (told.t < from).then_some(Error::ClockWentBack { from, to: told.t })
}

/// Returns which number cannot be in SI units. A joint may be a whole turn out of its range, as some encoders count, and fingers be read
/// a little beyond theirs: what is told here is no measurement of this robot.
fn in_other_units(told: &Told, request: &'static str, wanted: &Wanted) -> Option<Error> {
    for (at, (value, joint)) in told.q.iter().zip(&wanted.joints).enumerate() {
        let range = joint.range;
        let fits = |value: f64| (range.0 - TAU..=range.1 + TAU).contains(&value);
        if !fits(*value) {
            let probably = fits(value.to_radians()).then_some(Unit::Degrees);
            let joint = Some(at + 1);
            return Some(Error::Units {
                request,
                field: "q",
                joint,
                value: *value,
                range,
                probably,
            });
        }
    }
    let widest = wanted.max_opening;
    let fits = |opening: f64| (-widest..=2.0 * widest).contains(&opening);
    if widest > 0.0 && !fits(told.opening) {
        let (value, range) = (told.opening, (0.0, widest));
        let probably = fits(value / 1e3).then_some(Unit::Millimetres);
        return Some(Error::Units {
            request,
            field: "opening",
            joint: None,
            value,
            range,
            probably,
        });
    }
    None
}
