//! What a vessel holds at a tilt, and how slowly a thick liquid leaves it.
//!
//! Quasi-static: liquid stands up to a level plane through the lip; what is above leaves. The law of a thick one is
//! that of a sheet falling over the lip, `Q = w ρ g h³ s / (3 μ)` for a head `h` over a lip `w` wide and a slope `s`.
//!
//! Source: Bird, Stewart and Lightfoot, *Transport Phenomena*, 2nd ed. 2002, §2.2, a film falling down an
//! inclined wall.

use std::f64::consts::FRAC_PI_2;

use crate::motion::dynamics::GRAVITY;
use crate::world::{Object, Shape, WATER_DENSITY};

/// Viscosity of water, Pa·s.
pub const WATER: f64 = 1e-3;

/// Slices of the vessel, and steps of the tilt, of the table of what it holds.
const SLICES: usize = 200;
const STEPS: usize = 360;

/// What a vessel holds at a tilt, and how wide the liquid is then.
#[derive(Debug, Clone)]
pub struct Hold {
    /// m³ at even steps of the tilt from upright to level.
    volume: Vec<f64>,
    /// The liquid's surface then, m².
    surface: Vec<f64>,
    /// How wide the lip is, m: the side of a box, the radius of a round vessel.
    lip: f64,
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
        Some(Self { volume: volumes, surface, lip, wall: height })
    }

    /// Returns what is held at a tilt, m³.
    pub fn at(&self, tilt: f64) -> f64 {
        between(&self.volume, tilt)
    }

    /// Returns how high so much liquid (m³) beyond what is held at a tilt stands over the lip, m.
    fn head(&self, tilt: f64, above: f64) -> f64 {
        above / between(&self.surface, tilt)
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
