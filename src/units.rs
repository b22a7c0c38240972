//! Quantities and their literals: the one file that spells `cm`, `deg` or `mL`.
//!
//! A [`Quantity`] is a number in SI with its [`Dimension`]; angles count as a dimension of their own so
//! that `12 deg` is never taken for a plain number. Nothing here parses programs; that is
//! [`crate::language`]'s work.
//!
//! Source: BIPM, *The International System of Units*, 9th edition, 2019, tables 2, 4 and 8.

use std::fmt;
use std::ops::{Div, Mul};

use serde::{Deserialize, Serialize};

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

/// Shorthand for the table below: length, mass, time, angle, current, pixel.
const fn dim(length: i8, mass: i8, time: i8, angle: i8, current: i8, pixel: i8) -> Dimension {
    Dimension { length, mass, time, angle, current, pixel }
}

impl Dimension {
    /// A plain number.
    pub const NONE: Self = dim(0, 0, 0, 0, 0, 0);
    /// m.
    pub const LENGTH: Self = dim(1, 0, 0, 0, 0, 0);
    /// m².
    pub const AREA: Self = dim(2, 0, 0, 0, 0, 0);
    /// m³; a millilitre is 1e-6 m³.
    pub const VOLUME: Self = dim(3, 0, 0, 0, 0, 0);
    /// kg.
    pub const MASS: Self = dim(0, 1, 0, 0, 0, 0);
    /// s.
    pub const TIME: Self = dim(0, 0, 1, 0, 0, 0);
    /// rad.
    pub const ANGLE: Self = dim(0, 0, 0, 1, 0, 0);
    /// A.
    pub const CURRENT: Self = dim(0, 0, 0, 0, 1, 0);
    /// px.
    pub const PIXEL: Self = dim(0, 0, 0, 0, 0, 1);
    /// 1/s.
    pub const FREQUENCY: Self = dim(0, 0, -1, 0, 0, 0);
    /// m/s.
    pub const SPEED: Self = dim(1, 0, -1, 0, 0, 0);
    /// rad/s.
    pub const ANGULAR_SPEED: Self = dim(0, 0, -1, 1, 0, 0);
    /// N = kg·m/s².
    pub const FORCE: Self = dim(1, 1, -2, 0, 0, 0);
    /// N·m.
    pub const TORQUE: Self = dim(2, 1, -2, 0, 0, 0);
    /// V = kg·m²/(A·s³).
    pub const VOLTAGE: Self = dim(2, 1, -3, 0, -1, 0);
    /// Pa = N/m².
    pub const PRESSURE: Self = dim(-1, 1, -2, 0, 0, 0);

    /// Returns the dimension that programs call by this name: `Length`, `Angle`, `Volume`, …
    pub fn named(name: &str) -> Option<Self> {
        NAMES.iter().find(|(its_name, ..)| *its_name == name).map(|(_, dimension, ..)| *dimension)
    }

    /// Returns its name in programs, `None` when it has none.
    pub fn name(self) -> Option<&'static str> {
        NAMES.iter().find(|(_, dimension, ..)| *dimension == self).map(|(name, ..)| *name)
    }

    /// Returns the names of all dimensions a parameter may have.
    pub fn names() -> impl Iterator<Item = &'static str> {
        NAMES.iter().map(|(name, ..)| *name)
    }

    /// Returns it in words for a sentence: `a length`, `a plain number`, or its SI unit.
    pub fn words(self) -> String {
        NAMES.iter().find(|(_, dimension, ..)| *dimension == self).map_or_else(
            || format!("a quantity in {}", self.si()),
            |(.., words, _)| (*words).into(),
        )
    }

    /// Returns the unit people write it in, which is also what a missing unit is taken to mean.
    pub fn everyday_unit(self) -> String {
        NAMES
            .iter()
            .find(|(_, dimension, ..)| *dimension == self)
            .map_or_else(|| self.si(), |(.., unit)| (*unit).into())
    }

    /// Returns whether it is a plain number.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Returns its SI unit as [`Unit::parse`] reads it: `N*m*s/rad`; empty for a plain number.
    pub fn si(self) -> String {
        // Named derived units first, so that a torque reads `N*m` and not `kg*m^2/s^2`.
        let derived = [(Self::FORCE, "N"), (Self::TORQUE, "N*m"), (Self::VOLTAGE, "V")];
        let mut rest = self;
        let mut above = Vec::new();
        // A positive power of mass with falling time is how every mechanical effort looks.
        if self.mass == 1 && self.time < 0 {
            for (dimension, name) in derived {
                let left = self / dimension;
                if left.mass == 0 && left.length == 0 && left.current == 0 {
                    above.push(name.to_string());
                    rest = left;
                    break;
                }
            }
        }
        let mut below = Vec::new();
        let bases = [
            (rest.mass, "kg"),
            (rest.length, "m"),
            (rest.current, "A"),
            (rest.pixel, "px"),
            (rest.angle, "rad"),
            (rest.time, "s"),
        ];
        for (power, name) in bases {
            let text = |n: i8| if n == 1 { name.to_string() } else { format!("{name}^{n}") };
            match power {
                0 => {}
                n if n > 0 => above.push(text(n)),
                n => below.push(text(-n)),
            }
        }
        if above.is_empty() && !below.is_empty() {
            above.push("1".into());
        }
        let mut out = above.join("*");
        for unit in below {
            out.push('/');
            out.push_str(&unit);
        }
        out
    }
}

/// Name in programs, dimension, words in a sentence, everyday unit.
const NAMES: &[(&str, Dimension, &str, &str)] = &[
    ("Length", Dimension::LENGTH, "a length", "cm"),
    ("Angle", Dimension::ANGLE, "an angle", "deg"),
    ("Volume", Dimension::VOLUME, "a volume", "mL"),
    ("Time", Dimension::TIME, "a time", "s"),
    ("Mass", Dimension::MASS, "a mass", "g"),
    ("Force", Dimension::FORCE, "a force", "N"),
    ("Torque", Dimension::TORQUE, "a torque", "N*m"),
    ("Speed", Dimension::SPEED, "a speed", "cm/s"),
    ("AngularSpeed", Dimension::ANGULAR_SPEED, "an angular speed", "deg/s"),
    ("Frequency", Dimension::FREQUENCY, "a frequency", "Hz"),
    ("Area", Dimension::AREA, "an area", "cm^2"),
    ("Current", Dimension::CURRENT, "a current", "A"),
    ("Voltage", Dimension::VOLTAGE, "a voltage", "V"),
    ("Number", Dimension::NONE, "a plain number", ""),
];

impl Mul for Dimension {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        self.zip(rhs, i8::saturating_add)
    }
}

impl Div for Dimension {
    type Output = Self;
    fn div(self, rhs: Self) -> Self {
        self.zip(rhs, i8::saturating_sub)
    }
}

impl Dimension {
    fn zip(self, rhs: Self, f: impl Fn(i8, i8) -> i8) -> Self {
        dim(
            f(self.length, rhs.length),
            f(self.mass, rhs.mass),
            f(self.time, rhs.time),
            f(self.angle, rhs.angle),
            f(self.current, rhs.current),
            f(self.pixel, rhs.pixel),
        )
    }

    fn power(self, n: i8) -> Self {
        self.zip(self, |a, _| a.saturating_mul(n))
    }
}

/// Every unit the language knows: spelling, SI units in one of it, dimension. The grammar lists the
/// same spellings, longest first; a test compares the two.
pub const UNITS: &[(&str, f64, Dimension)] = &[
    ("mm", 1e-3, Dimension::LENGTH),
    ("cm", 1e-2, Dimension::LENGTH),
    ("km", 1e3, Dimension::LENGTH),
    ("m", 1.0, Dimension::LENGTH),
    ("deg", std::f64::consts::PI / 180.0, Dimension::ANGLE),
    ("°", std::f64::consts::PI / 180.0, Dimension::ANGLE),
    ("mrad", 1e-3, Dimension::ANGLE),
    ("rad", 1.0, Dimension::ANGLE),
    ("us", 1e-6, Dimension::TIME),
    ("ms", 1e-3, Dimension::TIME),
    ("s", 1.0, Dimension::TIME),
    ("min", 60.0, Dimension::TIME),
    ("mL", 1e-6, Dimension::VOLUME),
    ("L", 1e-3, Dimension::VOLUME),
    ("g", 1e-3, Dimension::MASS),
    ("kg", 1.0, Dimension::MASS),
    ("mN", 1e-3, Dimension::FORCE),
    ("N", 1.0, Dimension::FORCE),
    ("Nm", 1.0, Dimension::TORQUE),
    ("Pa", 1.0, Dimension::PRESSURE),
    ("mA", 1e-3, Dimension::CURRENT),
    ("A", 1.0, Dimension::CURRENT),
    ("mV", 1e-3, Dimension::VOLTAGE),
    ("V", 1.0, Dimension::VOLTAGE),
    ("Hz", 1.0, Dimension::FREQUENCY),
    ("kHz", 1e3, Dimension::FREQUENCY),
    ("px", 1.0, Dimension::PIXEL),
    ("%", 1e-2, Dimension::NONE),
];

/// Spellings people try, and the unit they mean. Not accepted, only suggested.
const MEANT: &[(&str, &str)] = &[
    ("millimetre", "mm"),
    ("millimeter", "mm"),
    ("centimetre", "cm"),
    ("centimeter", "cm"),
    ("metre", "m"),
    ("meter", "m"),
    ("degree", "deg"),
    ("radian", "rad"),
    ("second", "s"),
    ("sec", "s"),
    ("minute", "min"),
    ("mins", "min"),
    ("millisecond", "ms"),
    ("msec", "ms"),
    ("millilitre", "mL"),
    ("milliliter", "mL"),
    ("ml", "mL"),
    ("l", "L"),
    ("litre", "L"),
    ("liter", "L"),
    ("gram", "g"),
    ("gr", "g"),
    ("kilogram", "kg"),
    ("kilo", "kg"),
    ("newton", "N"),
    ("n", "N"),
    ("percent", "%"),
    ("pixel", "px"),
    ("hz", "Hz"),
    ("hertz", "Hz"),
    ("volt", "V"),
    ("amp", "A"),
    ("ampere", "A"),
    ("inch", "cm"),
    ("cms", "cm"),
    ("mms", "mm"),
];

/// The units worth listing to a person who wrote one that does not exist.
pub fn known_units() -> &'static str {
    "mm cm m deg rad ms s min mL L g kg N N*m %"
}

/// Returns the unit that a wrong spelling most likely means: `centimetres` → `cm`.
pub fn suggest_unit(text: &str) -> Option<&'static str> {
    let lower = text.to_lowercase();
    let singular = lower.strip_suffix('s').unwrap_or(&lower);
    MEANT
        .iter()
        .find(|(spelling, _)| *spelling == lower || *spelling == singular)
        .map(|(_, unit)| *unit)
        .or_else(|| {
            UNITS.iter().find(|(unit, ..)| unit.to_lowercase() == lower).map(|(unit, ..)| *unit)
        })
}

impl Unit {
    /// A plain number.
    pub const NONE: Self = Self { factor: 1.0, dimension: Dimension::NONE };

    /// Reads a unit: `cm`, `N*m`, `N*m*s/rad`, `rad/s^2`, `rad/(N*m)`, `m/s²`, `1/s`; empty and `-`
    /// are a plain number. Spaces around the signs do not matter.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownUnit`] with the text.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let unknown = || Error::UnknownUnit { text: text.trim().into() };
        // Superscripts as EFFECTS and data sheets write them.
        let plain: String = text
            .trim()
            .replace('·', "*")
            .replace('²', "^2")
            .replace('³', "^3")
            .chars()
            .filter(|c| !c.is_whitespace())
            .collect();
        if matches!(plain.as_str(), "" | "-" | "1") {
            return Ok(Self::NONE);
        }
        let (unit, rest) = product(&plain).ok_or_else(unknown)?;
        if rest.is_empty() { Ok(unit) } else { Err(unknown()) }
    }

    /// Returns `value` of this unit as a quantity in SI.
    pub fn of(self, value: f64) -> Quantity {
        Quantity { value: value * self.factor, dimension: self.dimension }
    }
}

/// `factor (("*" | "/") factor)*`, left to right as in mathematics.
fn product(text: &str) -> Option<(Unit, &str)> {
    let (mut unit, mut rest) = factor(text)?;
    while let Some(sign) = rest.chars().next().filter(|c| matches!(c, '*' | '/')) {
        let (by, after) = factor(&rest[1..])?;
        unit = if sign == '*' {
            Unit { factor: unit.factor * by.factor, dimension: unit.dimension * by.dimension }
        } else {
            Unit { factor: unit.factor / by.factor, dimension: unit.dimension / by.dimension }
        };
        rest = after;
    }
    Some((unit, rest))
}

/// One unit with its power, `1`, or a product in parentheses. Parentheses do not nest: no unit needs
/// it, and a text of ten thousand of them must not exhaust the stack.
fn factor(text: &str) -> Option<(Unit, &str)> {
    if let Some(inner) = text.strip_prefix('(') {
        let close = inner.find(')')?;
        let (group, rest) = inner.split_at(close);
        let (unit, left) = if group.contains('(') { None } else { product(group) }?;
        return left.is_empty().then_some((unit, &rest[1..]));
    }
    let end = text.find(['*', '/', '^', '(', ')']).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let base = if name == "1" {
        Unit::NONE
    } else {
        let (_, factor, dimension) = UNITS.iter().find(|(unit, ..)| *unit == name)?;
        Unit { factor: *factor, dimension: *dimension }
    };
    let Some(power) = rest.strip_prefix('^') else { return Some((base, rest)) };
    let digits = power.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(power.len());
    let n: i8 = power[..digits].parse().ok().filter(|n: &i8| n.unsigned_abs() <= 9)?;
    let raised =
        Unit { factor: base.factor.powi(i32::from(n)), dimension: base.dimension.power(n) };
    Some((raised, &power[digits..]))
}

/// Reads a table's column header `name[unit]`, or a bare `name`.
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
    Ok(Column { name: name.into(), unit: unit.map(Unit::parse).transpose()? })
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
}

impl fmt::Display for Quantity {
    /// Three significant digits in the everyday unit: `12 cm`, `31 mm`, `150 mL`, `7.2 deg`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, unit) = self.in_everyday_unit();
        let number = significant(value, 3);
        match unit.as_str() {
            "" => f.write_str(&number),
            unit => write!(f, "{number} {unit}"),
        }
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
    fn a_unit_that_does_not_exist_is_an_error_that_names_it() {
        for text in ["centimetres", "m//s", "m*", "(m", "m^", "m^99", "(m))", "((m))", "µ"] {
            assert!(Unit::parse(text).is_err(), "{text}");
        }
        assert!(Unit::parse(&"(".repeat(100_000)).is_err());
        assert!(Unit::parse("cmm").unwrap_err().to_string().contains("`cmm` is not a unit"));
        assert_eq!(suggest_unit("centimetres"), Some("cm"));
        assert_eq!(suggest_unit("ML"), Some("mL"));
        assert_eq!(suggest_unit("furlongs"), None);
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
