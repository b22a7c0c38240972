//! Dimensions: their names, and what becomes of them in products.

use std::ops::{Div, Mul};

use super::Dimension;

/// Shorthand for the table below: length, mass, time, angle, current, pixel.
pub(super) const fn dim(
    length: i8,
    mass: i8,
    time: i8,
    angle: i8,
    current: i8,
    pixel: i8,
) -> Dimension {
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

    /// Returns what a joint that slides has where one that turns has this: a length for an angle, a force for a torque.
    pub fn of_sliding(self) -> Option<Self> {
        match self {
            Self::ANGLE => Some(Self::LENGTH),
            Self::ANGULAR_SPEED => Some(Self::SPEED),
            Self::TORQUE => Some(Self::FORCE),
            _ => None,
        }
    }

    /// Returns whether it is a plain number.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Returns its SI unit as [`super::Unit::parse`] reads it: `N*m*s/rad`; empty for a plain number.
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

    pub(super) fn power(self, n: i8) -> Self {
        self.zip(self, |a, _| a.saturating_mul(n))
    }
}
