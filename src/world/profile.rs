//! The profile of a round thing: radii at heights, straight between them, turned about z.
//!
//! Cups that open upwards, bowls, cones, bottles, balls. Numbers only: what is seen, touched or poured of it is said by
//! the layers above.

use serde::{Deserialize, Serialize};

/// The most points of a profile: a ball of 10 cm by so many is off by less than 1 mm.
pub const MOST: usize = 12;

/// Radii over heights, from the foot at height 0 up, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct Profile {
    points: [[f64; 2]; MOST],
    len: usize,
}

/// Why points are no profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Fewer than two, or more than [`MOST`].
    #[error("a profile has 2 to 12 points")]
    Count,
    /// The first is not at height 0, or one is not above the one before it.
    #[error("heights of a profile begin at 0 and rise")]
    Heights,
    /// A radius below 0 or none above 0, or what is no number.
    #[error("radii of a profile are 0 or more, and not all 0")]
    Radii,
}

impl Profile {
    /// Makes a profile of points (radius, height), m.
    ///
    /// # Errors
    ///
    /// [`Fault`] says what is wrong with them.
    pub fn new(given: &[[f64; 2]]) -> Result<Self, Fault> {
        if given.len() < 2 || given.len() > MOST {
            return Err(Fault::Count);
        }
        let rises = given.windows(2).all(|pair| pair[1][1] > pair[0][1]);
        if given[0][1] != 0.0 || !rises || given.iter().any(|[_, z]| !z.is_finite()) {
            return Err(Fault::Heights);
        }
        let is_radius = |[r, _]: &[f64; 2]| r.is_finite() && *r >= 0.0;
        if !given.iter().all(is_radius) || given.iter().all(|[r, _]| *r <= 0.0) {
            return Err(Fault::Radii);
        }
        let mut points = [[0.0; 2]; MOST];
        points[..given.len()].copy_from_slice(given);
        Ok(Self { points, len: given.len() })
    }

    /// Returns the profile of a cone cut off at its top, m.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn cone(bottom: f64, top: f64, height: f64) -> Result<Self, Fault> {
        Self::new(&[[bottom, 0.0], [top, height]])
    }

    /// Returns the profile of a ball on a foot as wide as its first facet, m.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn ball(radius: f64) -> Result<Self, Fault> {
        let turn = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / MOST as f64;
        let foot = turn(0).cos();
        let points: [[f64; 2]; MOST] = std::array::from_fn(|k| {
            let z = if k == 0 { 0.0 } else { radius * (foot - turn(k).cos()) };
            [radius * turn(k).sin(), z]
        });
        Self::new(&points)
    }

    /// Returns its points (radius, height), from the foot up, m.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points[..self.len]
    }

    /// Returns its stretches: each from a point (radius, height) to the next, m.
    pub fn stretches(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
        self.points().windows(2).map(|pair| (pair[0], pair[1]))
    }

    /// Returns the height, m.
    pub fn height(&self) -> f64 {
        self.points[self.len - 1][1]
    }

    /// Returns the radius of the foot, m.
    pub fn foot(&self) -> f64 {
        self.points[0][0]
    }

    /// Returns the radius at the top, m.
    pub fn top(&self) -> f64 {
        self.points[self.len - 1][0]
    }

    /// Returns the largest radius, m.
    pub fn widest(&self) -> f64 {
        self.points().iter().fold(0.0, |widest, [r, _]| widest.max(*r))
    }

    /// Returns the smallest radius, m.
    pub fn narrowest(&self) -> f64 {
        self.points().iter().fold(f64::INFINITY, |narrowest, [r, _]| narrowest.min(*r))
    }

    /// Returns the radius at a height, m; beyond its ends that of the end.
    pub fn radius_at(&self, z: f64) -> f64 {
        let above = self.points().partition_point(|point| point[1] <= z);
        match (above.checked_sub(1), self.points().get(above)) {
            (None, _) => self.foot(),
            (_, None) => self.top(),
            (Some(below), Some([r, high])) => {
                let [from, low] = self.points[below];
                from + (r - from) * (z - low) / (high - low)
            }
        }
    }

    /// Returns how fast the radius grows with the height there, no unit.
    pub fn slope_at(&self, z: f64) -> f64 {
        let above = self.points().partition_point(|point| point[1] <= z).clamp(1, self.len - 1);
        let ([r0, z0], [r1, z1]) = (self.points[above - 1], self.points[above]);
        (r1 - r0) / (z1 - z0)
    }

    /// Returns the lowest and the highest place at which it is at least so wide, m; `None` where it never is.
    pub fn heights_at(&self, radius: f64) -> Option<[f64; 2]> {
        let mut found: Option<[f64; 2]> = None;
        for ([r0, z0], [r1, z1]) in self.stretches() {
            let (from, to) = if r0.min(r1) >= radius {
                (z0, z1)
            } else if r0.max(r1) < radius {
                continue;
            } else {
                let cut = z0 + (z1 - z0) * (radius - r0) / (r1 - r0);
                if r1 > r0 { (cut, z1) } else { (z0, cut) }
            };
            found = Some(found.map_or([from, to], |[low, high]| [low.min(from), high.max(to)]));
        }
        found
    }

    /// Returns the volume, m³: that of its stumps of cones.
    pub fn volume(&self) -> f64 {
        let stump = |([r0, z0], [r1, z1]): ([f64; 2], [f64; 2])| {
            std::f64::consts::PI / 3.0 * (z1 - z0) * (r0 * r0 + r0 * r1 + r1 * r1)
        };
        self.stretches().map(stump).sum()
    }

    /// Returns whether the solid is convex: nowhere does it bend inwards.
    pub fn is_convex(&self) -> bool {
        let bends = |three: &[[f64; 2]]| {
            let slope = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) / (b[1] - a[1]);
            slope(three[1], three[2]) > slope(three[0], three[1]) + 1e-9
        };
        !self.points().windows(3).any(bends)
    }

    /// Returns it with every radius and height changed by `change`, where that is a profile still.
    fn mapped(&self, change: impl Fn([f64; 2]) -> [f64; 2]) -> Option<Self> {
        let points: Vec<[f64; 2]> = self.points().iter().map(|point| change(*point)).collect();
        Self::new(&points).ok()
    }

    /// Returns it `wide` times as wide and `high` times as high.
    #[must_use]
    pub fn scaled(&self, wide: f64, high: f64) -> Self {
        self.mapped(|[r, z]| [wide * r, high * z]).unwrap_or(*self)
    }

    /// Returns it with every radius larger by `by` m, no smaller than 0, and its top higher by `up` m.
    #[must_use]
    pub fn grown(&self, by: f64, up: f64) -> Self {
        let high = (self.height() + up) / self.height();
        self.mapped(|[r, z]| [(r + by).max(0.0), z * high]).unwrap_or(*self)
    }

    /// Returns the space inside walls and a floor of that thickness, walls measured level, m, from the inside floor up;
    /// `None` where the walls meet.
    pub fn inside(&self, wall: f64) -> Option<Self> {
        let floor = [self.radius_at(wall) - wall, 0.0];
        let above = self.points().iter().filter(|[_, z]| *z > wall);
        let points = std::iter::once(floor).chain(above.map(|[r, z]| [r - wall, z - wall]));
        Self::new(&points.collect::<Vec<_>>()).ok().filter(|inside| inside.narrowest() > 0.0)
    }
}

impl TryFrom<Vec<[f64; 2]>> for Profile {
    type Error = Fault;

    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, Fault> {
        Self::new(&points)
    }
}

impl From<Profile> for Vec<[f64; 2]> {
    fn from(profile: Profile) -> Self {
        profile.points().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl with a bottle's neck: wide in the middle.
    fn vase() -> Profile {
        Profile::new(&[[0.03, 0.0], [0.05, 0.04], [0.02, 0.1], [0.02, 0.14]]).unwrap()
    }

    #[test]
    fn radii_and_heights_are_each_others_inverse() {
        let vase = vase();
        assert!((vase.radius_at(0.02) - 0.04).abs() < 1e-12);
        assert!((vase.radius_at(0.07) - 0.035).abs() < 1e-12);
        let [low, high] = vase.heights_at(0.035).unwrap();
        assert!((low - 0.01).abs() < 1e-12 && (high - 0.07).abs() < 1e-12);
        assert_eq!(vase.heights_at(0.051), None);
        assert_eq!(vase.heights_at(0.0), Some([0.0, 0.14]));
        assert!(!vase.is_convex() && Profile::ball(0.05).unwrap().is_convex());
    }

    #[test]
    fn volumes_are_those_of_geometry() {
        let ball = Profile::ball(0.05).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3);
        assert!((ball.volume() / exact - 1.0).abs() < 0.03, "{}", ball.volume());
        assert!(ball.height() < 0.1 && ball.widest() < 0.0501);
        let cup = Profile::cone(0.03, 0.04, 0.1).unwrap();
        let inside = cup.inside(0.002).unwrap();
        assert!((inside.height() - 0.098).abs() < 1e-12 && (inside.top() - 0.038).abs() < 1e-12);
        assert!((inside.foot() - (0.0302 - 0.002)).abs() < 1e-12);
        assert_eq!(cup.inside(0.035), None);
    }

    #[test]
    fn what_is_no_profile_says_why() {
        let of = |points: &[[f64; 2]]| Profile::new(points).unwrap_err();
        assert_eq!(of(&[[0.1, 0.0]]), Fault::Count);
        assert_eq!(of(&[[0.1, 0.0], [0.1, 0.0]]), Fault::Heights);
        assert_eq!(of(&[[0.1, 0.1], [0.1, 0.2]]), Fault::Heights);
        assert_eq!(of(&[[-0.1, 0.0], [0.1, 0.1]]), Fault::Radii);
        assert_eq!(of(&[[0.0, 0.0], [0.0, 0.1]]), Fault::Radii);
        assert_eq!(of(&[[0.1, 0.0], [0.1, f64::NAN]]), Fault::Heights);
    }
}
