//! What a vessel holds at a tilt, and how slowly a thick liquid leaves it.
//!
//! Quasi-static: liquid stands up to a level plane through the lip; what is above leaves. Water leaves as over a weir,
//! `Q = 2/3 c w √(2g) h^(3/2)` for a head `h` over a lip `w` wide, and slides off a wall that falls towards the lip, the
//! last of it as a film drains; a thick one as a sheet falling over the lip, `Q = w ρ g h³ s / (3 μ)` for a slope `s`.
//!
//! Sources: Poleni's formula with the sharp crest's coefficient, Bos, *Discharge Measurement Structures*, 3rd ed. 1989,
//! ch. 5; Bird, Stewart and Lightfoot, *Transport Phenomena*, 2nd ed. 2002, §2.2, a film falling down an inclined wall;
//! Jeffreys, *The draining of a vertical plate*, Math. Proc. Camb. Phil. Soc. 26 (1930).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use crate::motion::dynamics::GRAVITY;
use crate::world::{Object, Profile, Shape, WATER_DENSITY};

/// Viscosity of water, Pa·s.
pub const WATER: f64 = 1e-3;

/// Discharge coefficient of a sharp crest with little depth over it, no unit (Bos, §5.1, table 5.1).
const DISCHARGE: f64 = 0.611;

/// How often what stands above a lip is halved to find it: to a millionth of the vessel.
const HALVINGS: usize = 20;

/// A vessel is level where the liquid's depth changes along it by less than this share of its width: less than a
/// micrometre.
const LEVEL: f64 = 1e-5;

/// A head is found to this share of the vessel's width: less than a micrometre.
const FINE: f64 = 1e-6;
/// Most steps of Newton's method, which is kept between bounds that are halved where it leaves them.
const STEPS: usize = 60;

/// What is inside a vessel, cut across: its outline from the lowest wall up.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Section {
    /// A box of a width and so much from wall to wall, m.
    Straight { width: f64, reach: f64 },
    /// A circle of that radius, m.
    Round { radius: f64 },
}

impl Section {
    /// Returns the distance from the lowest wall to the highest, m.
    fn reach(self) -> f64 {
        match self {
            Self::Straight { reach, .. } => reach,
            Self::Round { radius } => 2.0 * radius,
        }
    }

    /// Returns half the angle of the circle's segment that is so deep (m), rad.
    fn half_angle(radius: f64, depth: f64) -> f64 {
        (1.0 - depth / radius).clamp(-1.0, 1.0).acos()
    }

    /// Returns how wide it is at a depth, m.
    fn width(self, depth: f64) -> f64 {
        match self {
            Self::Straight { width, .. } => width,
            Self::Round { radius } => 2.0 * (depth * (2.0 * radius - depth)).max(0.0).sqrt(),
        }
    }

    /// Returns how much of it lies below a depth, m².
    fn area(self, depth: f64) -> f64 {
        let depth = depth.clamp(0.0, self.reach());
        match self {
            Self::Straight { width, .. } => width * depth,
            Self::Round { radius } => {
                let half = Self::half_angle(radius, depth);
                radius * radius * (half - half.sin() * half.cos())
            }
        }
    }

    /// Returns the integral of [`Self::area`] over the depth, m³.
    fn wedge(self, depth: f64) -> f64 {
        let inside = depth.clamp(0.0, self.reach());
        let wedge = match self {
            Self::Straight { width, .. } => 0.5 * width * inside * inside,
            Self::Round { radius } => {
                let half = Self::half_angle(radius, inside);
                let (sin, cos) = half.sin_cos();
                radius.powi(3) * (sin - half * cos - sin.powi(3) / 3.0)
            }
        };
        wedge + (depth - inside).max(0.0) * self.area(self.reach())
    }
}

/// Slices of a vessel whose radius changes: what is held is right to 0.2 % of the volume (test).
const SLICES: usize = 48;

/// What a vessel holds at a tilt, and how high liquid stands over its lip then.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    /// At the mouth.
    section: Section,
    /// The inside, where its radius changes with the height.
    profile: Option<Profile>,
    /// How far the wall leans outwards, rad: as much earlier it falls towards the lip.
    leans: f64,
    /// How wide the lip is, m: the side of a box, the radius of a round vessel.
    lip: f64,
    /// How long the wall is that the liquid leaves along, m.
    wall: f64,
}

impl Hold {
    /// Makes that of an object; `None` for one that holds nothing. A box tilts about an edge.
    pub fn of(object: &Object) -> Option<Self> {
        let wall = object.shape.height() - object.cavity?.wall;
        let (section, lip, profile) = match object.inside()? {
            Shape::Cuboid { size } => {
                (Section::Straight { width: size.y, reach: size.x }, size.y, None)
            }
            Shape::Cylinder { radius, .. } => (Section::Round { radius }, radius, None),
            Shape::Mesh { .. } | Shape::Mug { .. } => return None,
            Shape::Lathe { profile } => {
                let radius = profile.top();
                (Section::Round { radius }, radius, Some(profile))
            }
        };
        let leans = profile.map_or(0.0, |inside| ((inside.top() - inside.foot()) / wall).atan());
        Some(Self { section, profile, leans, lip, wall })
    }

    /// Returns what is held at a tilt, m³: as much as stands below a level plane through the lip's lowest place.
    pub fn at(&self, tilt: f64) -> f64 {
        self.below(tilt, 0.0)
    }

    /// Returns what stands below a level plane that meets the mouth so far (m) above the lip's lowest place, m³.
    ///
    /// From the mouth to the floor the depth over the lowest wall grows evenly, by `cot θ`.
    fn below(&self, tilt: f64, over: f64) -> f64 {
        let tilt = tilt.abs().min(FRAC_PI_2);
        if let Some(profile) = &self.profile
            && tilt >= f64::EPSILON
        {
            return self
                .slices(profile, tilt, over)
                .map(|(slice, depth)| slice.area(depth))
                .sum::<f64>()
                * self.slice();
        }
        let grows = self.wall * (FRAC_PI_2 - tilt).tan();
        if !grows.is_finite() || tilt < f64::EPSILON {
            return self.volume();
        }
        if grows < LEVEL * self.section.reach() {
            return self.wall * self.section.area(over + 0.5 * grows);
        }
        let between = self.section.wedge(over + grows) - self.section.wedge(over);
        between * self.wall / grows
    }

    /// Returns how thick a slice is, m.
    fn slice(&self) -> f64 {
        self.wall / SLICES as f64
    }

    /// Cuts the inside into circles and says how deep each is below a level plane that meets the mouth so far (m) above
    /// the lip's lowest place, m.
    fn slices(
        &self,
        profile: &Profile,
        tilt: f64,
        over: f64,
    ) -> impl Iterator<Item = (Section, f64)> {
        let (cot, thick, mouth) = ((FRAC_PI_2 - tilt).tan(), self.slice(), profile.top());
        let (profile, wall) = (*profile, self.wall);
        (0..SLICES).map(move |k| {
            let z = (k as f64 + 0.5) * thick;
            let radius = profile.radius_at(z);
            (Section::Round { radius }, over + (wall - z) * cot + radius - mouth)
        })
    }

    /// Returns the volume to the rim, m³.
    fn volume(&self) -> f64 {
        if let Some(profile) = &self.profile {
            return profile.volume();
        }
        self.wall * self.section.area(self.section.reach())
    }

    /// Returns how high so much liquid (m³) beyond what is held at a tilt stands over the lip, m.
    fn head(&self, tilt: f64, above: f64) -> f64 {
        if above <= 0.0 {
            return 0.0;
        }
        let (section, tilt) = (self.section, tilt.abs().clamp(f64::EPSILON, FRAC_PI_2));
        let grows = self.wall * (FRAC_PI_2 - tilt).tan();
        let wanted = self.at(tilt) + above;
        let slope = |over: f64| {
            if let Some(profile) = &self.profile {
                let slices = self.slices(profile, tilt, over);
                slices.map(|(slice, depth)| slice.width(depth)).sum::<f64>() * self.slice()
            } else if grows < LEVEL * section.reach() {
                self.wall * section.width(over + 0.5 * grows)
            } else {
                (section.area(over + grows) - section.area(over)) * self.wall / grows
            }
        };
        let (mut low, mut high) = (0.0, section.reach());
        // As if the vessel were level: of a circle, near its lowest point, 4/3 √(2 r) d^(3/2) lies below.
        let mut over = match section {
            Section::Straight { width, .. } => above / (width * self.wall),
            Section::Round { radius } => {
                (0.75 * above / (self.wall * (2.0 * radius).sqrt())).powf(2.0 / 3.0)
            }
        }
        .min(high);
        for _ in 0..STEPS {
            let off = self.below(tilt, over) - wanted;
            if off < 0.0 {
                low = over;
            } else {
                high = over;
            }
            let next = over - off / slope(over);
            let next = if next > low && next < high { next } else { f64::midpoint(low, high) };
            let moved = (next - over).abs();
            over = next;
            if moved < FINE * section.reach() {
                break;
            }
        }
        over * tilt.sin()
    }

    /// Returns how fast water leaves when so much of it (m³) stands above the lip, m³/s.
    ///
    /// Over the edge of a box as over a rectangular weir; over a circle's edge as over a parabolic one, which is the
    /// circle near its lowest point, and never faster than over all of its diameter. On a wall that falls by `β` towards
    /// the lip it slides as well.
    pub fn outflow(&self, tilt: f64, above: f64) -> f64 {
        let head = self.head(tilt, above).max(0.0);
        let speed = DISCHARGE * (2.0 * GRAVITY * head).sqrt();
        let straight = |width: f64| 2.0 / 3.0 * width * head * speed;
        let over = if let Section::Round { .. } = self.section {
            // The edge is √(2 r z / sin θ) to either side at a height z; ∫ √(z (h - z)) dz = π h² / 8.
            let opens = 2.0 * (2.0 * self.lip / tilt.sin().abs().max(1e-3)).sqrt();
            (opens * FRAC_PI_4 * 0.5 * head.powf(1.5) * speed).min(straight(2.0 * self.lip))
        } else {
            straight(self.lip)
        };
        over + above.max(0.0) / self.wall * self.slide_speed(tilt, self.mean_depth(head))
    }

    /// Returns how fast a sheet of a mean thickness (m) slides off a wall that falls towards the lip by `β`, m/s.
    ///
    /// All along the wall, `L`, it gains `√(2 g L sin β)`, half of that on the mean. A thin one is held back by its
    /// viscosity: draining, it is `3/2` as thick at the lip as on the mean, and so much leaves there as from a film,
    /// `g sin β h³ / (3 ν)` (Jeffreys). The times of both add up.
    fn slide_speed(&self, tilt: f64, mean: f64) -> f64 {
        let falls = GRAVITY * (tilt.abs() + self.leans - FRAC_PI_2).max(0.0).sin();
        if falls <= 0.0 || mean <= 0.0 {
            return 0.0;
        }
        let free = (0.5 * falls * self.wall).sqrt();
        let film = falls * (1.5 * mean).powi(3) / (3.0 * WATER / WATER_DENSITY * mean);
        free * film / (free + film)
    }

    /// Returns the mean depth of liquid that stands so high (m) over the lowest wall, m.
    fn mean_depth(&self, head: f64) -> f64 {
        let width = self.section.width(head);
        if width > 0.0 { self.section.area(head) / width } else { 0.0 }
    }

    /// Returns how much water (m³) stands above the lip when it leaves at a rate, m³/s.
    pub fn above_at(&self, tilt: f64, rate: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.volume());
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            if self.outflow(tilt, middle) < rate { low = middle } else { high = middle }
        }
        low
    }

    /// Returns how long a time constant a liquid's viscosity (Pa·s) adds when so much of it (m³) stands above
    /// the lip, s.
    pub fn lag(&self, viscosity: f64, tilt: f64, above: f64) -> f64 {
        if viscosity <= 0.0 || above <= 0.0 {
            return 0.0;
        }
        let head = self.head(tilt, above);
        // On its last stretch the surface falls by the head while the wall falls away, or rises, by the cosine of
        // the tilt; on a level wall only the head itself drives it.
        let slope = tilt.cos().abs() + head / self.wall;
        above * 3.0 * viscosity / (self.lip * WATER_DENSITY * GRAVITY * head.powi(3) * slope)
    }

    /// Returns how fast a sheet of so much flow (m³/s) leaves over the lip, m/s.
    pub fn sheet_speed(&self, tilt: f64, above: f64, flow: f64) -> f64 {
        let across = self.section.area(self.head(tilt, above));
        if across > 0.0 { flow / across } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::object;

    fn hold(shape: Shape) -> Hold {
        Hold::of(&object::vessel(shape, 1e-3)).unwrap()
    }

    /// What stands below the plane, by the sum over small cells.
    fn counted(hold: &Hold, tilt: f64, head: f64) -> f64 {
        let (n, reach) = (400, hold.section.reach());
        let (ds, dz) = (reach / n as f64, hold.wall / n as f64);
        let cell = |i: usize, k: usize| {
            let (s, z) = ((i as f64 + 0.5) * ds, (k as f64 + 0.5) * dz);
            // How high a place `s` from the lowest wall and `z` over the floor is above the lip.
            let high = s * tilt.sin() + (z - hold.wall) * tilt.cos();
            if high < head { hold.section.width(s) * ds * dz } else { 0.0 }
        };
        (0..n).flat_map(|i| (0..n).map(move |k| (i, k))).map(|(i, k)| cell(i, k)).sum()
    }

    /// What stands below the plane in a cup that opens upwards, by the sum over small cells.
    fn counted_in_a_cone(inside: &Profile, tilt: f64, head: f64) -> f64 {
        let (n, r, h) = (120, inside.widest(), inside.height());
        let (side, high) = (2.0 * r / n as f64, h / n as f64);
        let cell = |i: usize, j: usize, k: usize| {
            let at = |i: usize| (i as f64 + 0.5) * side - r;
            let (x, y, z) = (at(i), at(j), (k as f64 + 0.5) * high);
            let above = (inside.top() - x) * tilt.sin() + (z - h) * tilt.cos();
            let is_in = x.hypot(y) <= inside.radius_at(z) && above < head;
            if is_in { side * side * high } else { 0.0 }
        };
        let each = (0..n * n * n).map(|at| cell(at % n, at / n % n, at / n / n));
        each.sum()
    }

    #[test]
    fn a_cup_that_opens_upwards_holds_what_geometry_says() {
        let profile = Profile::cone(0.03, 0.042, 0.1).unwrap();
        let cup = hold(Shape::Lathe { profile });
        let inside = profile.inside(0.003).unwrap();
        for degrees in [0.5_f64, 20.0, 45.0, 70.0, 80.0, 88.0] {
            let tilt = degrees.to_radians();
            let expected = counted_in_a_cone(&inside, tilt, 0.0);
            let off = (cup.at(tilt) - expected).abs();
            assert!(off < 6e-3 * inside.volume(), "{degrees}: {} not {expected}", cup.at(tilt));
            let above = counted_in_a_cone(&inside, tilt, 0.004) - expected;
            if degrees > 10.0 {
                let found = cup.head(tilt, above);
                assert!((found - 0.004).abs() < 4e-4, "{degrees}: {found}");
            }
        }
        // Its wall falls towards the lip before it is level.
        assert!(cup.slide_speed(1.5, 1e-3) > 0.0 && cup.slide_speed(1.4, 1e-3) == 0.0);
    }

    #[test]
    fn what_is_held_and_how_high_it_stands_is_what_geometry_says() {
        let round = hold(Shape::Cylinder { radius: 0.032, height: 0.12 });
        let straight = hold(Shape::Cuboid { size: nalgebra::Vector3::new(0.066, 0.05, 0.14) });
        for hold in [round, straight] {
            assert!((hold.at(0.0) - hold.volume()).abs() < 1e-12);
            for degrees in [1.0_f64, 20.0, 60.0, 80.0, 87.0, 89.9, 90.0] {
                let tilt = degrees.to_radians();
                let expected = counted(&hold, tilt, 0.0);
                assert!((hold.at(tilt) - expected).abs() < 4e-3 * hold.volume(), "{degrees} deg");
                for head in [0.001, 0.005, 0.02] {
                    let above = hold.below(tilt, head / tilt.sin()) - hold.at(tilt);
                    let expected = counted(&hold, tilt, head) - expected;
                    let off = (above - expected).abs();
                    assert!(off < 6e-3 * hold.volume(), "{degrees} deg: {above}, not {expected}");
                    // Where the mouth is all under liquid, no head is higher than another.
                    if above + hold.at(tilt) < 0.99 * hold.volume() {
                        let found = hold.head(tilt, above);
                        assert!((found - head).abs() < 1e-6, "{degrees} deg: {found}, not {head}");
                    }
                }
            }
        }
    }
}
