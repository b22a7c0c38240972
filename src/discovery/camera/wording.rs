//! A camera's effects in the words of the vocabulary: numbers with uncertainty, equations, lines of a model file.

use nalgebra::{DMatrix, Vector3};

use super::lens::Lens;
use super::term::{Feature, Law, SHIFT};
use crate::discovery::finding::ParameterEstimate;
use crate::discovery::model_file;
use crate::discovery::vocabulary::{OBJECT_TRACKER, TRACKER};
use crate::discovery::wording::left_aside;
use crate::language::ast::EffectItem;
use crate::units::{Dimension, significant};

/// A number of an effect as it is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// Its name.
    pub name: &'static str,
    /// Its value in SI.
    pub value: f64,
    /// One standard deviation; 0 for what was not fitted.
    pub std: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Whether it was fitted.
    pub fitted: bool,
}

/// Returns the effect's numbers in the order of the vocabulary; `covariance` is that of `parameters`, `up` the world's
/// vertical in the camera's axes.
pub fn estimates(
    law: Law,
    parameters: &[f64],
    covariance: &DMatrix<f64>,
    up: Vector3<f64>,
) -> Vec<Number> {
    let std = |at: usize| covariance[(at, at)].max(0.0).sqrt();
    if law == Law::Lift {
        // One number along the vertical is three along the camera's axes, and no turn.
        return SHIFT
            .into_iter()
            .enumerate()
            .map(|(i, name)| {
                let along = if i < 3 { up[i] } else { 0.0 };
                Number {
                    name,
                    value: along * parameters[0],
                    std: along.abs() * std(0),
                    unit: if i < 3 { "m" } else { "rad" },
                    fitted: i < 3,
                }
            })
            .collect();
    }
    law.shown()
        .into_iter()
        .map(|(name, unit, at)| match at {
            Ok(at) => Number { name, value: parameters[at], std: std(at), unit, fitted: true },
            Err(value) => Number { name, value, std: 0.0, unit, fitted: false },
        })
        .collect()
}

/// Writes what the effect changes in the model. `x`, `y` are `X/Z`, `Y/Z` in the camera's axes, `r` their length.
pub fn equation(law: Law, estimates: &[Number], lens: &Lens) -> String {
    let v = |at: usize| estimates.get(at).map_or(0.0, |number| number.value);
    let n = |at: usize| significant(v(at), 4);
    match law {
        Law::Radial(false) => format!("(x_d, y_d) = (x, y) * (1 + {} * r^2)", n(0)),
        Law::Radial(true) => format!("(x_d, y_d) = (x, y) * (1 + {} * r^2 + {} * r^4)", n(0), n(1)),
        Law::Tangential => format!(
            "x_d += 2*{p1}*x*y + {p2}*(r^2 + 2*x^2), y_d += {p1}*(r^2 + 2*y^2) + 2*{p2}*x*y",
            p1 = n(0),
            p2 = n(1)
        ),
        Law::Focal(_) => format!(
            "fx = {} * {} px = {} px, fy = {} * {} px = {} px",
            significant(v(0), 5),
            significant(lens.fx, 5),
            significant(v(0) * lens.fx, 5),
            significant(v(1), 5),
            significant(lens.fy, 5),
            significant(v(1) * lens.fy, 5)
        ),
        Law::Principal(..) => format!("cx += {} px, cy += {} px", n(0), n(1)),
        Law::Shift(_) | Law::Lift => format!(
            "the camera sits ({}, {}, {}) m further along its own axes (right, down, forward), turned by ({}, {}, \
             {}) rad about them",
            n(0),
            n(1),
            n(2),
            n(3),
            n(4),
            n(5)
        ),
        Law::Table(..) => {
            format!("the table is z = {} m + {} * y - {} * x", n(2), n(0), n(1))
        }
        Law::Delay => format!("a picture of time t shows t - {} s", n(0)),
        Law::Shutter => format!("row v is taken at t + {} s/px * v", n(0)),
        Law::Feature(feature) => formula(feature, v(0)),
    }
}

/// Writes a formula that has no name.
pub fn formula(feature: Feature, coefficient: f64) -> String {
    let number = significant(coefficient, 4);
    match feature {
        Feature::Radial => format!("(u, v) += {number} px * (x, y) * r^6"),
        Feature::Drift(channel) => format!("{} += {number} px/s * t", channel.name()),
        Feature::Monomial(channel, i, j) => {
            let power = |name: &str, power: u8| match power {
                0 => String::new(),
                1 => format!("*{name}"),
                _ => format!("*{name}^{power}"),
            };
            format!("{} += {number} px{}{}", channel.name(), power("x", i), power("y", j))
        }
    }
}

/// Writes the line of a model file: the numbers that were fitted.
pub fn line(law: Law, estimates: &[Number]) -> String {
    let fitted: Vec<ParameterEstimate> = estimates
        .iter()
        .filter(|number| number.fitted)
        .map(|n| (n.name.to_owned(), n.value, n.std, n.unit.to_owned()))
        .collect();
    model_file::line(law.name(), law.site(), &fitted)
}

pub(super) const LAYING_OUT: &str = "laying out the points";
pub(super) const TELLING_NOISE: &str = "telling noise from wrong matches";
pub(super) const CAMERA_OF_FILE: &str =
    "the camera is that of the file beside the points, not that of the scene";
pub(super) const POSES_FITTED: &str = "where the camera stood is not known: every picture's pose is fitted, and only \
                                       what no pose explains is a gap";
pub(super) const ROLES_EXCHANGED: &str =
    "the points to fit show nothing beyond noise, those held out do: their roles were exchanged";
pub(super) const NO_FORMULA: &str = "no formula predicts points it was not fitted to";
pub(super) const AS_WELL: &str =
    "explains the points as well; these pictures do not tell the two apart";
pub(super) const MOVED_OPPOSITE: &str = "a camera moved the opposite way, in all its numbers at once, would show the \
                                         same: only points that do not lie on the table tell which of the two moved";
pub(super) const ALL_NOISE: &str = "measured minus model is noise, and no effect explains any of it on points it was \
                                    not fitted to";
pub(super) const SEVERAL_AS_WELL: &str =
    "several effects explain the points equally well; these pictures do not tell them apart";
pub(super) const FORMULA_ONLY: &str =
    "no named effect explains the gap; the formula predicts points it was not fitted to";
pub(super) const FILM: &str = "film points that move fast and both ways across the whole picture, and the same points at rest";
pub(super) const BY_OTHER_MEANS: &str = "no picture of points whose place is known tells them apart: measure one of the two by other means";
pub(super) const TILTED: &str = "take pictures in which the target is tilted by 30 degrees and more about both axes, \
                                 near and far, out to the corners";

/// What a residual might follow, in the words of the table.
pub(super) const FOLLOWS: [&str; 10] = [
    "a constant",
    "x, the distance from the middle column",
    "y, the distance from the middle row",
    "the radius: r^3",
    "x^2",
    "x*y",
    "y^2",
    "depth: 1/Z",
    "the speed of the point in the picture",
    "the row times the speed in the picture",
];

/// How far away a target is held, as a part of the distance of the points, in words.
pub(super) const FAR: [(f64, &str); 4] =
    [(0.5, "at half the distance"), (0.75, "nearer"), (1.0, "as far away"), (1.5, "farther away")];

/// Where in the picture it is held, from -1 to 1 along x and y, in words.
pub(super) const SIDES: [(f64, f64, &str); 5] = [
    (0.0, 0.0, "in the middle"),
    (-1.0, -1.0, "at the upper left"),
    (1.0, -1.0, "at the upper right"),
    (-1.0, 1.0, "at the lower left"),
    (1.0, 1.0, "at the lower right"),
];

/// How it is turned about x and y, rad, in words.
pub(super) const HELD: [(f64, f64, &str); 3] =
    [(0.0, 0.0, "square to the camera"), (0.6, 0.0, "tilted"), (0.0, 0.6, "tilted")];

pub(super) fn motion_unknown(file: &str) -> String {
    format!(
        "{file}: not every time has as many points as the others, so their motion is not known and delays are not \
         looked for; name them in a column `point`"
    )
}

/// That the camera is found elsewhere than where the model's own shift has it.
pub(super) fn shifted_again() -> String {
    format!(
        "the model's own camera_shift(camera) is taken in the camera's axes, and the camera is not there; one that recordings of a \
         tip or of a thing in the hand told is of a tracker, in the base's axes: call it `camera_shift({TRACKER})` or \
         `camera_shift({OBJECT_TRACKER})`"
    )
}

pub(super) fn not_of_camera(effect: &EffectItem) -> String {
    let of = (effect.name.text.as_str(), effect.at.text.as_str());
    left_aside(of, "is not of the camera", "camera")
}

/// The noise, px.
pub(super) fn noise_estimated(sigma: f64) -> String {
    format!("noise estimated from the points: {} px per coordinate", significant(sigma, 3))
}

/// Of `all` points `wrong` are left out, the first of them at `lines`.
pub(super) fn left_out(wrong: usize, all: usize, lines: &[String]) -> String {
    let more = if wrong > lines.len() { ", …" } else { "" };
    format!("{wrong} of {all} points are left out as wrong matches: {}{more}", lines.join(", "))
}

/// Poses of a flat target, and by how many standard deviations two effects differ on them.
pub(super) fn flat_target(held: &str, separation: f64) -> String {
    format!(
        "a flat target held {held} comes first; on the poses proposed they differ by {} standard deviations",
        significant(separation, 2)
    )
}

pub(super) fn no_unit(file: &str, column: &str, expected: Dimension) -> String {
    format!("{file}: `{column}` has no unit; {} is assumed", expected.si())
}

pub(super) fn thinned(file: &str, rows: usize, every: usize) -> String {
    format!("{file}: of {rows} rows every {every}th is judged")
}

pub(super) fn cannot_show(blind: &[String]) -> String {
    super::super::wording::cannot_show("pictures", blind)
}

pub(super) fn still_above(left: f64) -> String {
    format!(
        "what is left is still above noise ({left:.0} standard deviations of its sum of squares)"
    )
}

pub(super) fn equally_well(doubted: &str) -> String {
    format!("{doubted} explain these points equally well")
}

/// The gap, in standard deviations above noise.
pub(super) fn nothing_predicts(left: f64) -> String {
    format!(
        "the gap is {left:.0} standard deviations above noise, but no effect and no formula predicts points it was \
         not fitted to"
    )
}

pub(super) fn explains(name: &str, at: &str) -> String {
    format!("{name} at {at} explains the gap, also on points held out")
}

pub(super) fn explain_together(n: usize) -> String {
    format!("{n} effects together explain the gap, also on points held out")
}
