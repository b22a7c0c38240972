//! What a comparison, a margin and a direction are in words.

use std::fmt::Write as _;

use crate::fluent::Direction;
use crate::trace::{FluentRow, Measure, TermRow};
use crate::units::{Unit, told_apart};

use super::super::run::people;

pub(in crate::report) fn verdict(row: &FluentRow) -> String {
    let by = row.margin.as_ref().map(|margin| format!(" by {}", size(margin)));
    match row.measured {
        Some(true) => format!("{} is true{}", row.name, by.unwrap_or_default()),
        Some(false) => format!("{} is false{}", row.name, by.unwrap_or_default()),
        None => {
            let why = row.why.as_deref().unwrap_or("it was not measured");
            format!("unknown: {} ({why})", row.name)
        }
    }
}

pub(super) fn comparison(term: &TermRow) -> String {
    let mark = match term.truth {
        Some(true) => "yes",
        Some(false) => "no ",
        None => "?  ",
    };
    let mut text = format!("{mark}  {}", term.text);
    if let (Some(value), Some(limit)) = (&term.value, &term.limit) {
        let [value, limit] = apart(value, limit);
        let _ = write!(text, "\n         is {value}, limit {limit}");
        if let Some(margin) = &term.margin {
            let _ = write!(text, ", margin {}", people(margin));
        }
        if let Some(std) = &term.std {
            let _ = write!(text, " ± {}", unsigned(std));
        }
    } else if let Some(margin) = &term.margin {
        let _ = write!(text, "\n         margin {}", people(margin));
    }
    text
}

/// A quantity as people write it, without a sign of its own when it is positive.
pub(in crate::report) fn unsigned(measure: &Measure) -> String {
    let text = people(measure);
    text.strip_prefix('+').map_or(text.clone(), str::to_owned)
}

/// A value and its limit, with as many digits as tell them apart.
fn apart(value: &Measure, limit: &Measure) -> [String; 2] {
    match [value, limit].map(|measure| Unit::parse(&measure.unit)) {
        [Ok(of_value), Ok(of_limit)] => {
            told_apart(of_value.of(value.value), of_limit.of(limit.value))
        }
        _ => [unsigned(value), unsigned(limit)],
    }
}

/// How much a margin is, without its sign: `31 mm`.
pub(in crate::report) fn size(margin: &Measure) -> String {
    unsigned(&Measure { value: margin.value.abs(), unit: margin.unit.clone() })
}

pub(in crate::report) fn way(direction: &Direction, margin: Option<&Measure>) -> String {
    let by = margin.map_or_else(String::new, |margin| format!(" {}", size(margin)));
    let axes = ["x", "y", "z"];
    let largest =
        (0..3).max_by(|i, j| direction.world[*i].abs().total_cmp(&direction.world[*j].abs()));
    let axis = largest.unwrap_or(0);
    let sign = if direction.world[axis] < 0.0 { '-' } else { '+' };
    format!(
        "`{}` needs to move{by} {} ({sign}{} in the table's frame)",
        direction.object,
        to_camera(direction),
        axes[axis]
    )
}

/// Says what a comparison of how a thing stands came to; `None` of any other.
pub(super) fn standing(term: &TermRow) -> Option<String> {
    let (head, rest) = term.text.split_once(')')?;
    let (name, object) = head.split_once('(').filter(|_| rest.starts_with(" <= "))?;
    let [is, limit] = apart(term.value.as_ref()?, term.limit.as_ref()?);
    Some(match (name, term.truth?) {
        ("tilt", true) => format!("`{object}` is upright ({is} from the vertical)"),
        ("tilt", false) => format!("`{object}` is tilted by {is} ({limit} allowed)"),
        ("drop", true) => format!("`{object}` stands"),
        ("drop", false) => {
            format!(
                "`{object}` does not stand: it is {is} above what is below it ({limit} allowed)"
            )
        }
        _ => return None,
    })
}

/// Which way the camera sees that to be, with whose left and right that is. Up and down are the table's: no camera is needed to
/// tell them.
pub(in crate::report) fn to_camera(direction: &Direction) -> String {
    let [x, y, z] = direction.world;
    if z.abs() > x.abs().max(y.abs()) {
        return if z < 0.0 { "lower" } else { "higher" }.to_owned();
    }
    match direction.camera.as_str() {
        side @ ("left" | "right") => format!("to the camera's {side}"),
        "nearer" => "nearer to the camera".into(),
        "farther" => "farther from the camera".into(),
        along => format!("{along} in the camera's image"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page said "14.9 cm left", and nobody could tell whose left.
    #[test]
    fn a_way_says_whose_left_it_is() {
        let said = |camera: &str| {
            let world = [0.0, -0.8, 0.6];
            to_camera(&Direction { object: "jar".into(), world, camera: camera.into() })
        };
        assert_eq!(said("left"), "to the camera's left");
        assert_eq!(said("farther"), "farther from the camera");
        assert_eq!(said("up"), "up in the camera's image");
        // A jar that was to come down was to move "farther from the camera", which looks from above.
        let world = [0.0, 0.3, -0.9];
        let down = Direction { object: "jar".into(), world, camera: "farther".into() };
        assert_eq!(to_camera(&down), "lower");
        assert_eq!(way(&down, None), "`jar` needs to move lower (-z in the table's frame)");
    }

    /// A jar held upright 12 cm above the table was not upright, by 11.5 cm.
    #[test]
    fn how_a_thing_stands_is_told_part_by_part() {
        let term = |text: &str, truth, value, limit, unit: &str| TermRow {
            text: text.into(),
            truth: Some(truth),
            value: Some(Measure { value, unit: unit.into() }),
            limit: Some(Measure { value: limit, unit: unit.into() }),
            margin: None,
            std: None,
        };
        let said = |term: &TermRow| standing(term).unwrap();
        assert_eq!(
            said(&term("drop(jar) <= 5 mm", false, 0.12, 0.005, "m")),
            "`jar` does not stand: it is 12 cm above what is below it (5 mm allowed)"
        );
        assert!(
            said(&term("tilt(jar) <= 5 deg", false, 1.361_357, 0.087_266, "rad"))
                .starts_with("`jar` is tilted by 78 deg")
        );
        assert!(standing(&term("height(jar) <= 5 mm", false, 0.12, 0.005, "m")).is_none());
    }
}
