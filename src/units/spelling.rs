//! The spellings of units, and reading them.

use super::{Dimension, Error, Quantity, Unit, significant};

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
    ("rev", std::f64::consts::TAU, Dimension::ANGLE),
    ("ns", 1e-9, Dimension::TIME),
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
    ("rpm", std::f64::consts::TAU / 60.0, Dimension::ANGULAR_SPEED),
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
    ("revolution", "rev"),
    ("turn", "rev"),
    ("second", "s"),
    ("sec", "s"),
    ("minute", "min"),
    ("mins", "min"),
    ("millisecond", "ms"),
    ("msec", "ms"),
    ("microsecond", "us"),
    ("usec", "us"),
    ("µs", "us"),
    ("μs", "us"),
    ("nanosecond", "ns"),
    ("nsec", "ns"),
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
    ("mnm", "mN*m"),
    ("percent", "%"),
    ("pixel", "px"),
    ("hz", "Hz"),
    ("hertz", "Hz"),
    ("volt", "V"),
    ("amp", "A"),
    ("ampere", "A"),
    ("cms", "cm"),
    ("mms", "mm"),
];

/// What loggers write in the headers of tables, and what it is in the language. Accepted there, as words of a product.
const LOGGED: &[(&str, &str)] = &[
    ("mNm", "(mN*m)"),
    ("meter", "m"),
    ("meters", "m"),
    ("metre", "m"),
    ("metres", "m"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("degs", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("rads", "rad"),
    ("RPM", "rpm"),
    ("sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("msec", "ms"),
    ("millisecond", "ms"),
    ("milliseconds", "ms"),
    ("usec", "us"),
    ("µs", "us"),
    ("μs", "us"),
    ("microsecond", "us"),
    ("microseconds", "us"),
    ("nsec", "ns"),
    ("nanosecond", "ns"),
    ("nanoseconds", "ns"),
    ("Newton", "N"),
    ("newton", "N"),
    ("amp", "A"),
    ("amps", "A"),
    ("Amp", "A"),
    ("Amps", "A"),
];

/// Units of other systems, and what one of each is in a unit of the language. Not accepted, only converted in what is suggested.
///
/// Source: BIPM, *The International System of Units*, 9th edition, for prefixes; NIST SP 811, 2008, appendix B, for the others.
const FOREIGN: &[(&str, f64, &str)] = &[
    ("in", 2.54, "cm"),
    ("inch", 2.54, "cm"),
    ("inches", 2.54, "cm"),
    ("ft", 30.48, "cm"),
    ("foot", 30.48, "cm"),
    ("feet", 30.48, "cm"),
    ("dm", 10.0, "cm"),
    ("cl", 10.0, "mL"),
    ("dl", 100.0, "mL"),
    ("lb", 453.592_37, "g"),
    ("lbs", 453.592_37, "g"),
    ("pound", 453.592_37, "g"),
    ("pounds", 453.592_37, "g"),
    ("oz", 28.349_523_125, "g"),
    ("ounce", 28.349_523_125, "g"),
    ("ounces", 28.349_523_125, "g"),
];

/// The units worth listing to a person who wrote one that does not exist.
pub fn known_units() -> &'static str {
    "mm cm m deg rad ns us ms s min mL L g kg N N*m A V Hz rad/s %"
}

/// Returns the units of a dimension that have a spelling of their own: `mL` and `L` of a volume.
pub fn units_of(dimension: Dimension) -> Vec<&'static str> {
    UNITS.iter().filter(|(.., its)| *its == dimension).map(|(unit, ..)| *unit).collect()
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

/// Returns what so many of a unit of another system are, the number and its unit: 3 `inches` → `7.62`, `cm`.
pub fn convert(value: f64, unit: &str) -> Option<(String, &'static str)> {
    let lower = unit.to_lowercase();
    let (_, each, unit) = FOREIGN.iter().find(|(spelling, ..)| *spelling == lower)?;
    Some((significant(value * each, 6), *unit))
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

    /// Reads a unit of a table's header: as [`Self::parse`], or as loggers spell it, `mNm`, `N.m`, `N-m`, `degrees/sec`.
    ///
    /// # Errors
    ///
    /// As [`Self::parse`], with the text as written.
    pub fn logged(text: &str) -> Result<Self, Error> {
        Self::parse(text).or_else(|error| Self::parse(&in_the_language(text)).map_err(|_| error))
    }

    /// Returns `value` of this unit as a quantity in SI.
    pub fn of(self, value: f64) -> Quantity {
        Quantity { value: value * self.factor, dimension: self.dimension }
    }
}

/// Returns a unit as loggers spell it in the language's words and signs.
fn in_the_language(text: &str) -> String {
    let mut found = String::new();
    let mut rest = text.trim();
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end.max(first.len_utf8()));
        let joins = found.ends_with(char::is_alphabetic) && after.starts_with(char::is_alphabetic);
        found.push_str(match word {
            "." | "⋅" | "×" => "*",
            // Before a digit it is the sign of a power.
            "-" if joins => "*",
            _ => LOGGED
                .iter()
                .find(|(spelling, _)| *spelling == word)
                .map_or(word, |(_, unit)| *unit),
        });
        rest = after;
    }
    found
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
