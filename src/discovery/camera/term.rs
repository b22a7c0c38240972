//! The effects on a camera as laws with parameters: what may be wrong, on what scale, and under which name.

use crate::discovery::selection::ParameterSpec;

/// A coordinate of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// To the right.
    U,
    /// Down.
    V,
}

impl Channel {
    /// Returns its name in a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::U => "u",
            Self::V => "v",
        }
    }
}

/// A shape in the picture for what has no name; its coefficient is in px.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// `x^i y^j` of the normalised coordinates, in one channel.
    Monomial(Channel, u8, u8),
    /// `(x, y) r⁶`: a third radial coefficient.
    Radial,
    /// Proportional to time, in one channel.
    Drift(Channel),
}

/// What may be wrong with a camera. Parameters are in the order of [`Law::specs`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// `k1`, and `k2` if so.
    Radial(bool),
    /// `p1`, `p2`.
    Tangential,
    /// One factor of both focal lengths, or one each.
    Focal(bool),
    /// The principal point, in u, in v.
    Principal(bool, bool),
    /// The camera sits further along its own axes (x right, y down, z forward) and is turned about them, as
    /// far as a number is free: x, y, z, roll, pitch, yaw.
    Shift([bool; 6]),
    /// The camera sits higher or lower: a shift along the world's vertical.
    Lift,
    /// The table's tilt (roll and pitch about the world's origin), its height.
    Table(bool, bool),
    /// Pictures show the past.
    Delay,
    /// Row v is taken later than the first one.
    Shutter,
    /// A formula.
    Feature(Feature),
}

/// The names of a shift's numbers.
pub const SHIFT: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

/// One number of an effect in the vocabulary's words: name, unit, the parameter it is or the value it has.
pub type Shown = (&'static str, &'static str, Result<usize, f64>);

const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

fn spec(name: &'static str, unit: &'static str, scale: f64, range: (f64, f64)) -> ParameterSpec {
    // A thousandth of what is visible at a glance is below what a model of a lens can mean.
    ParameterSpec { name, unit, scale, range, neutral: Some(0.0), least: 1e-3 * scale }
}

impl Law {
    /// Returns the name in the vocabulary.
    pub fn name(self) -> &'static str {
        match self {
            Self::Radial(_) => "radial_distortion",
            Self::Tangential => "tangential_distortion",
            Self::Focal(_) => "focal_error",
            Self::Principal(..) => "principal_point_shift",
            Self::Shift(_) | Self::Lift => "camera_shift",
            Self::Table(..) => "table_tilt",
            Self::Delay => "image_delay",
            Self::Shutter => "rolling_shutter",
            Self::Feature(_) => "unknown",
        }
    }

    /// Returns where it sits.
    pub fn site(self) -> &'static str {
        if matches!(self, Self::Table(..)) { "table" } else { "camera" }
    }

    /// Returns the parameters. `extent` is the largest normalised coordinate in the data: how far a formula's
    /// coefficient must move to be seen depends on it.
    pub fn specs(self, extent: f64) -> Vec<ParameterSpec> {
        let factor =
            |name| ParameterSpec { neutral: Some(1.0), ..spec(name, "", 2e-3, (0.1, 10.0)) };
        let metres = |name| spec(name, "m", 1e-3, ANY);
        let angle = |name| spec(name, "rad", 1e-3, (-1.5, 1.5));
        match self {
            Self::Radial(false) => vec![spec("k1", "", 0.01, (-3.0, 3.0))],
            Self::Radial(true) => {
                vec![spec("k1", "", 0.01, (-3.0, 3.0)), spec("k2", "", 0.02, (-20.0, 20.0))]
            }
            Self::Tangential => {
                vec![spec("p1", "", 1e-3, (-1.0, 1.0)), spec("p2", "", 1e-3, (-1.0, 1.0))]
            }
            Self::Focal(false) => vec![factor("fx_scale")],
            Self::Focal(true) => vec![factor("fx_scale"), factor("fy_scale")],
            Self::Principal(u, v) => {
                let names = [("du", u), ("dv", v)];
                let free = names.into_iter().filter(|(_, free)| *free);
                free.map(|(name, _)| spec(name, "px", 1.0, ANY)).collect()
            }
            Self::Shift(free) => SHIFT
                .into_iter()
                .enumerate()
                .filter(|(i, _)| free[*i])
                .map(|(i, name)| if i < 3 { metres(name) } else { angle(name) })
                .collect(),
            Self::Lift => vec![metres("lift")],
            Self::Table(tilt, height) => {
                let mut specs = Vec::new();
                if tilt {
                    specs.extend([angle("roll"), angle("pitch")]);
                }
                if height {
                    specs.push(metres("height"));
                }
                specs
            }
            Self::Delay => vec![spec("delay", "s", 1e-3, (-1.0, 1.0))],
            Self::Shutter => vec![spec("row_time", "s", 2e-6, (-1e-3, 1e-3))],
            Self::Feature(feature) => {
                let (unit, reach) = match feature {
                    Feature::Monomial(_, x, y) => ("px", extent.powi(i32::from(x + y))),
                    Feature::Radial => ("px", extent.powi(7)),
                    Feature::Drift(_) => ("px/s", 10.0),
                };
                vec![spec("coefficient", unit, 0.3 / reach.max(1e-9), ANY)]
            }
        }
    }

    /// Returns every number of the effect, those that are not fitted with the value they keep.
    pub fn shown(self) -> Vec<Shown> {
        let shown = |free: bool, at: usize| if free { Ok(at) } else { Err(0.0) };
        match self {
            Self::Radial(k2) => vec![("k1", "", Ok(0)), ("k2", "", shown(k2, 1))],
            Self::Tangential => vec![("p1", "", Ok(0)), ("p2", "", Ok(1))],
            Self::Focal(each) => {
                vec![("fx_scale", "", Ok(0)), ("fy_scale", "", Ok(usize::from(each)))]
            }
            Self::Principal(u, v) => {
                vec![("du", "px", shown(u, 0)), ("dv", "px", shown(v, usize::from(u)))]
            }
            Self::Shift(free) => {
                let mut at = 0;
                let numbers = SHIFT.into_iter().enumerate().map(|(i, name)| {
                    let shown = shown(free[i], at);
                    at += usize::from(free[i]);
                    (name, if i < 3 { "m" } else { "rad" }, shown)
                });
                numbers.collect()
            }
            // In the camera's own axes: `wording` turns it.
            Self::Lift => vec![("lift", "m", Ok(0))],
            Self::Table(tilt, height) => vec![
                ("roll", "rad", shown(tilt, 0)),
                ("pitch", "rad", shown(tilt, 1)),
                ("height", "m", shown(height, if tilt { 2 } else { 0 })),
            ],
            Self::Delay => vec![("delay", "s", Ok(0))],
            Self::Shutter => vec![("row_time", "s", Ok(0))],
            Self::Feature(Feature::Drift(_)) => vec![("coefficient", "px/s", Ok(0))],
            Self::Feature(_) => vec![("coefficient", "px", Ok(0))],
        }
    }

    /// Returns whether a formula does what one of its numbers does by itself.
    pub fn says(self, formula: Feature) -> bool {
        let Feature::Monomial(channel, i, j) = formula else { return false };
        match self {
            Self::Focal(_) => matches!((channel, i, j), (Channel::U, 1, 0) | (Channel::V, 0, 1)),
            Self::Principal(..) => (i, j) == (0, 0),
            _ => false,
        }
    }

    /// Returns whether it can do all that `other` can.
    pub fn contains(self, other: Self) -> bool {
        match (self, other) {
            (Self::Radial(a), Self::Radial(b)) | (Self::Focal(a), Self::Focal(b)) => a || !b,
            (Self::Principal(u, v), Self::Principal(a, b))
            | (Self::Table(u, v), Self::Table(a, b)) => (u || !a) && (v || !b),
            (Self::Shift(free), Self::Shift(less)) => {
                free.into_iter().zip(less).all(|(free, less)| free || !less)
            }
            (Self::Shift(free), Self::Lift) => free[..3].iter().all(|free| *free),
            // Points on a plane: the camera moved instead.
            (Self::Shift(free), Self::Table(..)) => free.into_iter().all(|free| free),
            _ => self == other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discovery::vocabulary::kind_named;

    /// What is told of each effect are the vocabulary's numbers, in its order and units.
    #[test]
    fn every_law_speaks_the_vocabulary() {
        let laws = [
            Law::Radial(false),
            Law::Radial(true),
            Law::Tangential,
            Law::Focal(false),
            Law::Focal(true),
            Law::Principal(false, true),
            Law::Shift([true, false, false, false, true, true]),
            Law::Table(true, false),
            Law::Table(false, true),
            Law::Delay,
            Law::Shutter,
        ];
        for law in laws {
            let kind = kind_named(law.name()).unwrap();
            let shown: Vec<_> = law.shown().iter().map(|(name, unit, _)| (*name, *unit)).collect();
            assert_eq!(shown, kind.numbers().collect::<Vec<_>>(), "{law:?}");
            let free: Vec<usize> =
                law.shown().iter().filter_map(|(.., shown)| shown.ok()).collect();
            let specs = law.specs(0.5).len();
            assert_eq!(free.iter().max().map(|most| most + 1), Some(specs), "{law:?}");
        }
    }

    #[test]
    fn a_focal_length_is_what_stretches_a_channel_along_itself() {
        let formula = |channel, i, j| Feature::Monomial(channel, i, j);
        let focal = Law::Focal(true);
        assert!(focal.says(formula(Channel::U, 1, 0)) && focal.says(formula(Channel::V, 0, 1)));
        assert!(!focal.says(formula(Channel::U, 0, 1)) && !focal.says(formula(Channel::U, 2, 0)));
        assert!(Law::Principal(true, false).says(formula(Channel::V, 0, 0)));
        assert!(!focal.says(Feature::Radial) && !Law::Tangential.says(formula(Channel::U, 1, 0)));
    }

    #[test]
    fn the_general_contains_the_special() {
        let all = Law::Shift([true; 6]);
        assert!(all.contains(Law::Lift) && all.contains(Law::Table(true, true)));
        assert!(Law::Radial(true).contains(Law::Radial(false)));
        assert!(!Law::Radial(false).contains(Law::Radial(true)));
        assert!(!Law::Table(true, true).contains(all));
    }
}
