//! Places told by how far and which way from where a thing stands: "move the jar 10 cm to the left" → `point(52 cm, 15 cm)`.
//!
//! The words are made one place first, as those of a relation are; which point that is is known when the thing is. Left,
//! forward and back are as the robot looks from its base.

use super::knowledge::{Knowledge, Spot};
use super::resolve::{Found, Hindrance};
use crate::units::{Dimension, Unit, convert, significant, suggest_unit};

/// What a marked place begins with; nothing that people say.
const MARK: &str = "@shifted";
/// What people say at the end of a sentence, and which way that is: shares of left and of ahead.
const WAYS: &[(&str, [f64; 2])] = &[
    ("to the left", [1.0, 0.0]),
    ("to the right", [-1.0, 0.0]),
    ("further left", [1.0, 0.0]),
    ("further right", [-1.0, 0.0]),
    ("left", [1.0, 0.0]),
    ("right", [-1.0, 0.0]),
    ("further away", [0.0, 1.0]),
    ("away", [0.0, 1.0]),
    ("forwards", [0.0, 1.0]),
    ("forward", [0.0, 1.0]),
    ("backwards", [0.0, -1.0]),
    ("backward", [0.0, -1.0]),
    ("closer", [0.0, -1.0]),
    ("nearer", [0.0, -1.0]),
    ("back", [0.0, -1.0]),
];

/// Returns a sentence that ends with how far and which way, with those as one place: `move the jar at @shifted 10 cm left`.
pub(super) fn marked(said: &str) -> Option<String> {
    let spoken: Vec<&str> = said.split(' ').collect();
    let (at, taken, length) = (0..spoken.len()).find_map(|at| {
        let one = length(spoken[at]).map(|length| (at, 1, length));
        let two = || length(&format!("{}{}", spoken[at], spoken.get(at + 1)?));
        one.or_else(|| two().map(|length| (at, 2, length)))
    })?;
    let mut rest = spoken;
    rest.drain(at..at + taken);
    if at > 0 && rest[at - 1] == "by" {
        rest.remove(at - 1);
    }
    let rest = rest.join(" ");
    WAYS.iter().find_map(|(way, _)| {
        let head = rest.strip_suffix(way)?.strip_suffix(' ')?;
        Some(format!("{head} at {MARK} {length} {way}"))
    })
}

/// Reads `10cm` or `2inches`, as the language would write it: `10 cm`, `5.08 cm`.
fn length(word: &str) -> Option<String> {
    let digits = word.find(|c: char| !c.is_ascii_digit() && c != '.').filter(|at| *at > 0)?;
    let (number, spelt) = word.split_at(digits);
    let value = number.parse::<f64>().ok()?;
    // Of "cup 2 in the corner" nothing is an inch.
    let foreign = if spelt == "in" { None } else { convert(value, spelt) };
    let own = suggest_unit(spelt).map(|unit| (number.to_owned(), unit));
    let (number, unit) = own.or(foreign)?;
    let is_length = Unit::parse(unit).is_ok_and(|unit| unit.dimension == Dimension::LENGTH);
    is_length.then(|| format!("{number} {unit}"))
}

/// Returns what the words of a marked place mean until the thing is known; `None` when they are none.
pub(super) fn resolve(said: &str) -> Option<Found> {
    let shown = said.strip_prefix(MARK)?.trim();
    Some(Found { value: said.to_owned(), shown: shown.to_owned() })
}

/// Puts the point into what was said as a shift of the first thing that a call names: of slot, words and value.
pub(super) fn settle(
    way: &mut [(String, String, String)],
    with: &Knowledge<'_>,
) -> Result<(), Hindrance> {
    let Some((_, _, moved)) = way.first().cloned() else { return Ok(()) };
    for (_, said, value) in way {
        let Some(shift) = value.strip_prefix(MARK).map(|shift| shift.trim().to_owned()) else {
            continue;
        };
        let Some(point) = (with.spot)(&moved).and_then(|spot| point(&shift, &spot)) else {
            let why = format!("where the {moved} stands has to be known to move it by so much");
            return Err(Hindrance::new(why, Some("say it at the prompt, after `:look`".into())));
        };
        (*said, *value) = (shift, point);
    }
    Ok(())
}

/// Returns the point that is a shift away from where a thing stands: `10 cm to the left` → `point(52.3 cm, 15.5 cm)`.
fn point(shift: &str, spot: &Spot) -> Option<String> {
    let (number, rest) = shift.split_once(' ')?;
    let (unit, way) = rest.split_once(' ')?;
    let (_, [left, ahead]) = WAYS.iter().find(|(said, _)| *said == way)?;
    let far = number.parse::<f64>().ok()? * Unit::parse(unit).ok()?.factor;
    let (sin, cos) = spot.facing.sin_cos();
    let x = spot.at[0] + far * (ahead * cos - left * sin);
    let y = spot.at[1] + far * (ahead * sin + left * cos);
    // To a millimetre, which is less than a hand places to.
    let [x, y] = [x, y].map(|at| significant((1000.0 * at).round() / 10.0, 6));
    Some(format!("point({x} cm, {y} cm)"))
}
