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
use crate::world::{Object, Shape, WATER_DENSITY};

/// Viscosity of water, Pa·s.
pub const WATER: f64 = 1e-3;

/// Discharge coefficient of a sharp crest with little depth over it, no unit (Bos, §5.1, table 5.1).
const DISCHARGE: f64 = 0.611;

/// How often what stands above a lip is halved to find it: to a millionth of the vessel.
const HALVINGS: usize = 20;

/// Slices of the vessel, and steps of the tilt, of the table of what it holds.
const SLICES: usize = 200;
const STEPS: usize = 360;

/// What a vessel holds at a tilt, and how wide the liquid is then.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    /// m³ at even steps of the tilt from upright to level.
    volume: Vec<f64>,
    /// The liquid's surface then, m².
    surface: Vec<f64>,
    /// How wide the lip is, m: the side of a box, the radius of a round vessel.
    lip: f64,
    /// Whether the lip is a circle's edge, of radius `lip`.
    round: bool,
    /// How long the wall is that the liquid leaves along, m.
    wall: f64,
}

impl Hold {
    /// Tabulates a vessel; `None` for an object that holds nothing.
    ///
    /// Liquid stands up to a plane through the lip's lowest edge. A box tilts about an edge.
    pub fn of(object: &Object) -> Option<Self> {
        let inside = object.inside()?;
        let height = object.shape.height() - object.cavity?.wall;
        let (reach, lip, width): (f64, f64, Box<dyn Fn(f64) -> f64>) = match inside {
            Shape::Cuboid { size } => (size.x, size.y, Box::new(move |_| size.y)),
            Shape::Cylinder { radius, .. } => (
                2.0 * radius,
                radius,
                Box::new(move |s| 2.0 * (radius * radius - (radius - s).powi(2)).max(0.0).sqrt()),
            ),
        };
        let sum = |reach: f64, of: &dyn Fn(f64) -> f64| -> f64 {
            let slice = reach / SLICES as f64;
            (0..SLICES).map(|i| of((i as f64 + 0.5) * slice) * slice).sum()
        };
        let angle = |i: usize| FRAC_PI_2 * i as f64 / STEPS as f64;
        let volume = |tilt: f64| {
            let slope = tilt.tan();
            sum(reach, &|s| (height - s * slope).clamp(0.0, height) * width(s))
        };
        let surface = |tilt: f64| {
            // Level, the surface is the wall that lies below; a hundredth of a degree short of that is as good.
            let tilt = tilt.min(FRAC_PI_2 - 2e-4);
            sum(reach.min(height / tilt.tan()), &width) / tilt.cos()
        };
        let mut volumes: Vec<f64> = (0..STEPS).map(|i| volume(angle(i))).collect();
        volumes.push(0.0);
        let surface = (0..=STEPS).map(|i| surface(angle(i))).collect();
        let round = matches!(inside, Shape::Cylinder { .. });
        Some(Self { volume: volumes, surface, lip, round, wall: height })
    }

    /// Returns what is held at a tilt, m³.
    pub fn at(&self, tilt: f64) -> f64 {
        between(&self.volume, tilt)
    }

    /// Returns how high so much liquid (m³) beyond what is held at a tilt stands over the lip, m.
    fn head(&self, tilt: f64, above: f64) -> f64 {
        above / between(&self.surface, tilt)
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
        let over = if self.round {
            // The edge is √(2 r z / sin θ) to either side at a height z; ∫ √(z (h - z)) dz = π h² / 8.
            let opens = 2.0 * (2.0 * self.lip / tilt.sin().abs().max(1e-3)).sqrt();
            (opens * FRAC_PI_4 * 0.5 * head.powf(1.5) * speed).min(straight(2.0 * self.lip))
        } else {
            straight(self.lip)
        };
        over + above.max(0.0) / self.wall * self.slide_speed(tilt, head)
    }

    /// Returns how fast a sheet of a mean thickness (m) slides off a wall that falls towards the lip by `β`, m/s.
    ///
    /// All along the wall, `L`, it gains `√(2 g L sin β)`, half of that on the mean. A thin one is held back by its
    /// viscosity: draining, it is `3/2` as thick at the lip as on the mean, and so much leaves there as from a film,
    /// `g sin β h³ / (3 ν)` (Jeffreys). The times of both add up.
    fn slide_speed(&self, tilt: f64, mean: f64) -> f64 {
        let falls = GRAVITY * (tilt.abs() - FRAC_PI_2).max(0.0).sin();
        if falls <= 0.0 || mean <= 0.0 {
            return 0.0;
        }
        let free = (0.5 * falls * self.wall).sqrt();
        let film = falls * (1.5 * mean).powi(3) / (3.0 * WATER / WATER_DENSITY * mean);
        free * film / (free + film)
    }

    /// Returns how much water (m³) stands above the lip when it leaves at a rate, m³/s.
    pub fn above_at(&self, tilt: f64, rate: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.volume[0]);
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
        let across = self.lip * self.head(tilt, above);
        if across > 0.0 { flow / across } else { 0.0 }
    }
}

/// Returns a table's value at a tilt; beyond level it is that of level.
fn between(table: &[f64], tilt: f64) -> f64 {
    let at = (tilt.abs() / FRAC_PI_2 * STEPS as f64).min(STEPS as f64);
    let i = (at as usize).min(STEPS - 1);
    table[i] + (at - i as f64) * (table[i + 1] - table[i])
}
