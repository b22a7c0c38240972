//! Units with fractional powers: a root of a length is a unit on the way to another.

use crate::units::Dimension;

/// Exponents in twelfths, so that roots have them too: length, mass, time, angle, current, pixel.
type Exponents = [i16; 6];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fine(Exponents);

pub(super) const NUMBER: Fine = Fine([0; 6]);

impl From<Dimension> for Fine {
    fn from(d: Dimension) -> Self {
        Self([d.length, d.mass, d.time, d.angle, d.current, d.pixel].map(|e| i16::from(e) * 12))
    }
}

impl Fine {
    fn zip(self, rhs: Self, f: impl Fn(i16, i16) -> i16) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], rhs.0[i])))
    }

    pub(super) fn times(self, rhs: Self) -> Self {
        self.zip(rhs, i16::saturating_add)
    }

    pub(super) fn over(self, rhs: Self) -> Self {
        self.zip(rhs, i16::saturating_sub)
    }

    /// `None` where the power has no twelfths.
    pub(super) fn power(self, exponent: f64) -> Option<Self> {
        let mut out = [0; 6];
        for (to, from) in out.iter_mut().zip(self.0) {
            let value = f64::from(from) * exponent;
            if (value - value.round()).abs() > 1e-9 || value.abs() > 30_000.0 {
                return None;
            }
            *to = value.round() as i16;
        }
        Some(Self(out))
    }

    /// The same but for angles, which are numbers.
    pub(super) fn same(self, rhs: Self) -> bool {
        (0..6).all(|i| i == 3 || self.0[i] == rhs.0[i])
    }

    pub(super) fn is_number(self) -> bool {
        self.same(NUMBER)
    }

    pub(super) fn whole(self) -> Option<Dimension> {
        let mut out = [0_i8; 6];
        for (to, from) in out.iter_mut().zip(self.0) {
            if from % 12 != 0 {
                return None;
            }
            *to = i8::try_from(from / 12).ok()?;
        }
        let [length, mass, time, angle, current, pixel] = out;
        Some(Dimension { length, mass, time, angle, current, pixel })
    }

    pub(super) fn words(self) -> String {
        self.whole().map_or_else(
            || "a unit with roots in it".into(),
            |d| match d.si().as_str() {
                "" => "a plain number".into(),
                unit => format!("in {unit}"),
            },
        )
    }
}
