//! Quantities and their literals: the one place that spells `cm`, `deg` or `mL`.
//!
//! A [`Quantity`] is a number in SI with its [`Dimension`]; angles count as a dimension of their own so
//! that `12 deg` is never taken for a plain number. Nothing here parses programs; that is
//! [`crate::language`]'s work.
//!
//! Source: BIPM, *The International System of Units*, 9th edition, 2019, tables 2, 4 and 8.

mod dimension;
mod spelling;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use spelling::{UNITS, convert, known_units, suggest_unit, units_of};

/// Significant digits that people are told, and the most that tell two quantities apart. Chosen: three are as fine as anything
/// on a table is measured, nine finer than anything is computed.
const USUAL_DIGITS: usize = 3;
const MOST_DIGITS: usize = 9;

/// Exponents of the base quantities a unit is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(default)]
pub struct Dimension {
    /// Length, m.
    pub length: i8,
    /// Mass, kg.
    pub mass: i8,
    /// Time, s.
    pub time: i8,
    /// Angle, rad.
    pub angle: i8,
    /// Electric current, A.
    pub current: i8,
    /// Pixels, px.
    pub pixel: i8,
}

/// A number in SI units with its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Quantity {
    /// The value in SI: m, kg, s, rad, A, px and their products.
    pub value: f64,
    /// What it measures.
    pub dimension: Dimension,
}

/// What a unit's text is worth: `cm` is 0.01 of a length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// How many SI units one of it is.
    pub factor: f64,
    /// What it measures.
    pub dimension: Dimension,
}

/// A column of a table of measurements: `q_1[rad]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name without the unit: `q_1`.
    pub name: String,
    /// Its unit, `None` when the header gives none.
    pub unit: Option<Unit>,
}

/// What is wrong with the text of a unit or a column.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// No unit is spelt like this.
    #[error("`{text}` is not a unit; known are {known}", known = known_units())]
    UnknownUnit {
        /// As written.
        text: String,
    },
    /// A header that is neither `name` nor `name[unit]`.
    #[error("`{text}` is not a column header; write `name[unit]`, such as `q_1[rad]`")]
    BadColumn {
        /// As written.
        text: String,
    },
}

/// Reads a table's column header `name[unit]`, the unit as loggers spell it, or a bare `name`.
///
/// # Errors
///
/// [`Error::BadColumn`] for anything else, [`Error::UnknownUnit`] for a unit that does not exist.
pub fn parse_column(header: &str) -> Result<Column, Error> {
    let text = header.trim();
    let bad = || Error::BadColumn { text: text.into() };
    let (name, unit) = match text.split_once('[') {
        None => (text, None),
        Some((name, rest)) => (name, Some(rest.strip_suffix(']').ok_or_else(bad)?)),
    };
    let name = name.trim();
    if name.is_empty() || name.contains(']') {
        return Err(bad());
    }
    Ok(Column { name: name.into(), unit: unit.map(Unit::logged).transpose()? })
}

impl Quantity {
    /// A quantity of `value` SI units.
    pub const fn new(value: f64, dimension: Dimension) -> Self {
        Self { value, dimension }
    }

    /// A plain number.
    pub const fn number(value: f64) -> Self {
        Self::new(value, Dimension::NONE)
    }

    /// A length of `value` m.
    pub const fn metres(value: f64) -> Self {
        Self::new(value, Dimension::LENGTH)
    }

    /// An angle of `value` rad.
    pub const fn radians(value: f64) -> Self {
        Self::new(value, Dimension::ANGLE)
    }

    /// A volume of `value` m³.
    pub const fn cubic_metres(value: f64) -> Self {
        Self::new(value, Dimension::VOLUME)
    }

    /// A time of `value` s.
    pub const fn seconds(value: f64) -> Self {
        Self::new(value, Dimension::TIME)
    }

    /// Returns the everyday unit for a value of this size, and the value in it.
    pub fn in_everyday_unit(self) -> (f64, String) {
        let size = self.value.abs();
        let unit = match self.dimension {
            // A tenth of a metre or a second is where people change words.
            Dimension::LENGTH if size < 0.1 => "mm",
            Dimension::LENGTH if size < 1.0 => "cm",
            Dimension::LENGTH => "m",
            Dimension::VOLUME if size < 1e-3 => "mL",
            Dimension::VOLUME => "L",
            Dimension::ANGLE => "deg",
            Dimension::ANGULAR_SPEED => "deg/s",
            Dimension::TIME if size < 0.1 && size > 0.0 => "ms",
            Dimension::MASS if size < 1.0 => "g",
            Dimension::SPEED if size < 1.0 => "cm/s",
            _ => return (self.value, self.dimension.si()),
        };
        let factor = Unit::parse(unit).map_or(1.0, |unit| unit.factor);
        (self.value / factor, unit.into())
    }

    /// Writes it with its sign, as a margin is told: `+12 mm`, `-31 mm`.
    pub fn signed(self) -> String {
        if self.value >= 0.0 { format!("+{self}") } else { self.to_string() }
    }

    /// Writes it with so many significant digits in the everyday unit.
    fn written(self, digits: usize) -> String {
        let (value, unit) = self.in_everyday_unit();
        let number = significant(value, digits);
        if unit.is_empty() { number } else { format!("{number} {unit}") }
    }
}

/// Writes two quantities with as many significant digits as tell them apart, three at least: a value beside its limit.
pub fn told_apart(first: Quantity, second: Quantity) -> [String; 2] {
    let with = |digits| [first, second].map(|quantity| quantity.written(digits));
    let differ = |written: &[String; 2]| written[0] != written[1];
    (USUAL_DIGITS..=MOST_DIGITS).map(with).find(differ).unwrap_or_else(|| with(USUAL_DIGITS))
}

impl fmt::Display for Quantity {
    /// Three significant digits in the everyday unit: `12 cm`, `31 mm`, `150 mL`, `7.2 deg`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.written(USUAL_DIGITS))
    }
}

/// Writes a number with `digits` significant digits and no trailing zeros: `7.2`, `150`, `0.062`.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() || value == 0.0 {
        return if value == 0.0 { "0".into() } else { value.to_string() };
    }
    // The exponent after rounding, so that 99.96 counts as 100 and not as 99.9.
    let rounded = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    if !(-5..=9).contains(&exponent) {
        return rounded;
    }
    let decimals = i32::try_from(digits).map_or(0, |n| n - 1 - exponent);
    let decimals = usize::try_from(decimals).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::dimension::dim;
    use super::*;

    #[test]
    fn units_and_their_products_have_the_si_value_and_dimension() {
        let cases = [
            ("cm", 0.01, Dimension::LENGTH),
            ("mL", 1e-6, Dimension::VOLUME),
            ("L", 1e-3, Dimension::VOLUME),
            ("N*m", 1.0, Dimension::TORQUE),
            ("kg*m^2/s^2", 1.0, Dimension::TORQUE),
            ("m/s", 1.0, Dimension::SPEED),
            ("km/min", 1e3 / 60.0, Dimension::SPEED),
            ("rad/s^2", 1.0, dim(0, 0, -2, 1, 0, 0)),
            ("N*m*s/rad", 1.0, dim(2, 1, -1, -1, 0, 0)),
            ("rad/(N*m)", 1.0, dim(-2, -1, 2, 1, 0, 0)),
            ("N·m·s²/rad²", 1.0, dim(2, 1, 0, -2, 0, 0)),
            ("1/s", 1.0, Dimension::FREQUENCY),
            ("ns", 1e-9, Dimension::TIME),
            ("rad/us", 1e6, Dimension::ANGULAR_SPEED),
            ("s^-1", 1.0, Dimension::FREQUENCY),
            ("", 1.0, Dimension::NONE),
            ("%", 0.01, Dimension::NONE),
        ];
        for (text, factor, dimension) in cases {
            let unit = Unit::parse(text).unwrap();
            assert!((unit.factor / factor - 1.0).abs() < 1e-12, "{text}: {}", unit.factor);
            assert_eq!(unit.dimension, dimension, "{text}");
        }
        assert_eq!(Unit::parse("cm^3").unwrap().dimension, Unit::parse("mL").unwrap().dimension);
        assert!((Unit::parse("cm^3").unwrap().factor - 1e-6).abs() < 1e-18);
    }

    #[test]
    fn a_header_may_spell_a_unit_as_loggers_do() {
        let cases = [
            ("mNm", "mN*m"),
            ("Nm", "N*m"),
            ("N.m", "N*m"),
            ("N m", "N*m"),
            ("N-m", "N*m"),
            ("N⋅m", "N*m"),
            ("mN.m", "mN*m"),
            ("Nm/rad", "N*m/rad"),
            ("rad/mNm", "rad/(mN*m)"),
            ("degrees", "deg"),
            ("deg/s", "deg/s"),
            ("degrees/sec", "deg/s"),
            ("radians/second", "rad/s"),
            ("rad.s^-1", "rad/s"),
            ("RPM", "rpm"),
            ("µs", "us"),
            ("amps", "A"),
        ];
        for (logged, unit) in cases {
            let (found, expected) = (Unit::logged(logged).unwrap(), Unit::parse(unit).unwrap());
            assert_eq!(found.dimension, expected.dimension, "{logged}");
            assert!((found.factor / expected.factor - 1.0).abs() < 1e-12, "{logged}");
            assert_eq!(parse_column(&format!("a[{logged}]")).unwrap().unit, Some(found));
        }
        // Programs are written in the units of the language.
        assert!(Unit::parse("degrees").is_err());
        let error = Unit::logged("furlongs.m").unwrap_err();
        assert_eq!(error, Error::UnknownUnit { text: "furlongs.m".into() });
        for text in ["", ".", "-", "..", "mNm^2", "é", "µ"] {
            let _ = Unit::logged(text);
        }
    }

    #[test]
    fn a_unit_that_does_not_exist_is_an_error_that_names_it() {
        for text in ["centimetres", "m//s", "m*", "(m", "m^", "m^99", "(m))", "((m))", "µ"] {
            assert!(Unit::parse(text).is_err(), "{text}");
        }
        assert!(Unit::parse(&"(".repeat(100_000)).is_err());
        assert!(Unit::parse("cmm").unwrap_err().to_string().contains("`cmm` is not a unit"));
        assert_eq!(suggest_unit("centimetres"), Some("cm"));
        assert_eq!(suggest_unit("ML"), Some("mL"));
        assert_eq!(suggest_unit("nanoseconds"), Some("ns"));
        assert_eq!(suggest_unit("µs"), Some("us"));
        assert_eq!(suggest_unit("furlongs"), None);
        // An inch is no centimetre.
        assert_eq!(suggest_unit("inch"), None);
        assert_eq!(convert(3.0, "Inches"), Some(("7.62".to_owned(), "cm")));
        assert_eq!(convert(0.5, "lb"), Some(("226.796".to_owned(), "g")));
        assert_eq!(convert(3.0, "cm"), None);
        assert_eq!(units_of(Dimension::VOLUME), ["mL", "L"]);
    }

    #[test]
    fn the_si_text_of_a_dimension_reads_back_as_the_same_dimension() {
        for text in ["N*m*s/rad", "N*m*s^2/rad^2", "kg", "m/s^2", "rad/s", "1/s", "V", "Pa", "px"] {
            let dimension = Unit::parse(text).unwrap().dimension;
            let again = Unit::parse(&dimension.si()).unwrap();
            assert_eq!(again.dimension, dimension, "{text} -> {}", dimension.si());
            assert!((again.factor - 1.0).abs() < 1e-15);
        }
        assert_eq!(Dimension::TORQUE.si(), "N*m");
    }

    /// A pour failed "by 0.184 mL (135 mL, limit 135 mL)".
    #[test]
    fn a_value_is_told_apart_from_its_limit() {
        let volumes = |a, b| told_apart(Quantity::cubic_metres(a), Quantity::cubic_metres(b));
        assert_eq!(volumes(134.866e-6, 135.06e-6), ["134.9 mL", "135.1 mL"]);
        assert_eq!(volumes(120e-6, 135e-6), ["120 mL", "135 mL"]);
        assert_eq!(volumes(135e-6, 135e-6), ["135 mL", "135 mL"]);
    }

    #[test]
    fn quantities_are_told_in_everyday_units() {
        let cases = [
            (Quantity::metres(0.12), "12 cm"),
            (Quantity::metres(0.031), "31 mm"),
            (Quantity::metres(-0.031), "-31 mm"),
            (Quantity::metres(1.25), "1.25 m"),
            (Quantity::metres(0.0), "0 mm"),
            (Quantity::metres(0.000_061_4), "0.0614 mm"),
            (Quantity::cubic_metres(150e-6), "150 mL"),
            (Quantity::radians(7.2_f64.to_radians()), "7.2 deg"),
            (Quantity::seconds(0.03), "30 ms"),
            (Quantity::seconds(20.0), "20 s"),
            (Quantity::new(0.16, Dimension::MASS), "160 g"),
            (Quantity::new(1.83, Dimension::TORQUE), "1.83 N*m"),
            (Quantity::number(0.5), "0.5"),
        ];
        for (quantity, text) in cases {
            assert_eq!(quantity.to_string(), text);
        }
        assert_eq!(Quantity::metres(0.012).signed(), "+12 mm");
        assert_eq!(significant(99.96, 3), "100");
        assert_eq!(significant(0.099_96, 3), "0.1");
    }

    #[test]
    fn columns_carry_their_unit() {
        let column = parse_column(" tau_4[N*m] ").unwrap();
        assert_eq!(
            (column.name.as_str(), column.unit.unwrap().dimension),
            ("tau_4", Dimension::TORQUE)
        );
        assert_eq!(parse_column("view").unwrap().unit, None);
        assert!(matches!(parse_column("q_1[rad"), Err(Error::BadColumn { .. })));
        assert!(matches!(parse_column("[rad]"), Err(Error::BadColumn { .. })));
        assert!(matches!(parse_column("q_1[turns]"), Err(Error::UnknownUnit { .. })));
    }
}
