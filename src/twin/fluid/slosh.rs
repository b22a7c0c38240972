//! How the surface of the liquid in a moved vessel leans: its first mode, as an equivalent pendulum.
//!
//! The surface wants to lie at right angles to what liquid in the accelerated vessel falls to, and swings about that
//! with the frequency and the damping of the first antisymmetric mode. Higher modes and breaking waves are not here.
//!
//! Source: Dodge, *The New "Dynamic Behavior of Liquids in Moving Containers"*, 2000: §1.2 (frequency), eq. 2.6 (damping
//! in a cylinder with depth, after Mikishev and Dorozhkin).

use nalgebra::Vector3;

use crate::motion::dynamics::GRAVITY;
use crate::twin::hold::WATER;
use crate::world::{Shape, WATER_DENSITY};

/// Root of `J1'`: the first mode of a cylinder has the wave number 1.841 over its radius.
const MODE: f64 = 1.841;
/// Damping ratio times the root of the Reynolds number `√(g r³) / ν`.
const DAMPING: f64 = 0.79;
/// No surface swings by more than this in a step, rad: what is faster is not followed.
const FASTEST: f64 = 0.5;

/// What the swinging of a vessel's liquid depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    /// Wave number, 1/m.
    wave: f64,
    /// Half of what is across, m.
    radius: f64,
    /// Kinematic viscosity, m²/s.
    viscosity: f64,
}

impl Mode {
    /// Returns the mode of a vessel with that inside and a liquid's viscosity, Pa·s; a box's is that across the mean of
    /// its sides.
    pub(super) fn of(inside: &Shape, viscosity: f64) -> Self {
        let (wave, radius) = match (inside, inside.faces()) {
            // That of a glass as high that holds as much.
            (Shape::Lathe { profile }, _) => {
                let area = profile.volume() / profile.height();
                let radius = (area / std::f64::consts::PI).sqrt();
                (MODE / radius, radius)
            }
            (_, Some([x, y])) => {
                let side = f64::midpoint(x, y);
                (std::f64::consts::PI / side, 0.5 * side)
            }
            (_, None) => (MODE / inside.inner_radius(), inside.inner_radius()),
        };
        Self { wave, radius, viscosity: viscosity.max(WATER) / WATER_DENSITY }
    }

    /// Returns the frequency, rad/s, at a depth (m) and the damping ratio.
    fn swings(&self, depth: f64) -> (f64, f64) {
        let frequency = (GRAVITY * self.wave * (self.wave * depth).tanh()).sqrt();
        let reynolds = (GRAVITY * self.radius.powi(3)).sqrt() / self.viscosity;
        (frequency, (DAMPING / reynolds.sqrt()).min(1.0))
    }
}

/// How a surface lies and swings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slosh {
    /// Unit normal of the surface, world.
    pub(super) up: Vector3<f64>,
    /// How fast it turns, 1/s.
    rate: Vector3<f64>,
}

impl Slosh {
    /// A surface at rest.
    pub(super) fn calm() -> Self {
        Self { up: Vector3::z(), rate: Vector3::zeros() }
    }

    /// Swings for `dt` s while liquid falls along `falls` (m/s²: gravity less the vessel's acceleration).
    pub(super) fn swing(&mut self, mode: &Mode, depth: f64, falls: &Vector3<f64>, dt: f64) {
        // Without weight nothing draws it anywhere.
        let Some(rest) = (-falls).try_normalize(1e-3) else { return };
        let (frequency, damping) = mode.swings(depth.max(1e-4));
        let frequency = frequency.min(FASTEST / dt);
        self.rate +=
            ((rest - self.up) * frequency.powi(2) - self.rate * (2.0 * damping * frequency)) * dt;
        self.up = (self.up + self.rate * dt).normalize();
        self.rate -= self.up * self.up.dot(&self.rate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_swings_with_the_period_of_the_first_mode_and_calms_down() {
        // A glass of 6 cm across and deep: 23.4 rad/s.
        let mode = Mode::of(&Shape::Cylinder { radius: 0.03, height: 0.1 }, WATER);
        let mut slosh =
            Slosh { up: Vector3::new(0.1, 0.0, 1.0).normalize(), rate: Vector3::zeros() };
        let (falls, dt) = (Vector3::new(0.0, 0.0, -GRAVITY), 1.0 / 240.0);
        let (mut before, mut crossings) = (0.1, Vec::new());
        for step in 0..2400 {
            slosh.swing(&mode, 0.08, &falls, dt);
            if before > 0.0 && slosh.up.x <= 0.0 {
                crossings.push(f64::from(step) * dt);
            }
            before = slosh.up.x;
        }
        let period = (crossings[10] - crossings[0]) / 10.0;
        let expected = std::f64::consts::TAU / (GRAVITY * MODE / 0.03).sqrt();
        assert!((period / expected - 1.0).abs() < 0.01, "{period} s, {expected} s");
        // exp(-ζ ω t) with ζ = 0.79 / √(√(g r³) / ν) = 0.0062 for 10 s: a fifth of it is left at most.
        assert!(slosh.up.xy().norm() < 0.03, "{:?}", slosh.up);
    }

    #[test]
    fn in_a_vessel_that_is_pushed_evenly_it_leans_back_in_the_end() {
        let mode = Mode::of(&Shape::Cuboid { size: Vector3::new(0.06, 0.06, 0.1) }, 0.5);
        let mut slosh = Slosh::calm();
        for _ in 0..4800 {
            slosh.swing(&mode, 0.05, &Vector3::new(-3.0, 0.0, -GRAVITY), 1.0 / 240.0);
        }
        assert!((slosh.up.x / slosh.up.z - 3.0 / GRAVITY).abs() < 1e-3, "{:?}", slosh.up);
    }
}
