//! A camera's effects in the words of the vocabulary: numbers with uncertainty, equations, lines of a model file.

use nalgebra::{DMatrix, Vector3};

use super::lens::Lens;
use super::term::{Feature, Law, SHIFT};
use crate::discovery::finding::Told;
use crate::discovery::model_file;
use crate::units::significant;

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
pub fn told(
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
    law.told()
        .into_iter()
        .map(|(name, unit, at)| match at {
            Ok(at) => Number { name, value: parameters[at], std: std(at), unit, fitted: true },
            Err(value) => Number { name, value, std: 0.0, unit, fitted: false },
        })
        .collect()
}

/// Writes what the effect changes in the model. `x`, `y` are `X/Z`, `Y/Z` in the camera's axes, `r` their length.
pub fn equation(law: Law, told: &[Number], lens: &Lens) -> String {
    let v = |at: usize| told.get(at).map_or(0.0, |number| number.value);
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
pub fn line(law: Law, told: &[Number]) -> String {
    let fitted: Vec<Told> = told
        .iter()
        .filter(|number| number.fitted)
        .map(|n| (n.name.to_owned(), n.value, n.std, n.unit.to_owned()))
        .collect();
    model_file::line(law.name(), law.seat(), &fitted)
}
