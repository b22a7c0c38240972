//! Which water is simulated: settled water rides frozen, drops at rest on the table stay there.
//!
//! A carried jar is quiet most of the time, and its water would cost as much as when it pours.

use nalgebra::Vector3;

use super::{Fluid, Phase};

/// Root mean square speed in its vessel below which water is calm, m/s: ten times what the solver leaves
/// in water at rest, a tenth of what a hand's jolt makes.
const CALM_SPEED: f32 = 0.02;
/// For how long it must be calm to freeze, s.
const CALM_TIME: f32 = 0.2;
/// Water in a vessel that leans more than this does not freeze, rad: it would stand at the lip as ice, and come in one
/// gush once it is tilted enough to wake.
const LEANS: f64 = 0.35;
/// After how long on the table a drop stays where it is, s.
const DROP_TIME: f32 = 0.4;

impl Fluid {
    /// Wakes the water of vessels that tilt, are accelerated, or into which something falls.
    pub(super) fn wake(&mut self) {
        for k in 0..self.vessels.len() {
            let moving = &self.vessels[k];
            if !moving.frozen {
                continue;
            }
            let up = moving.now.rotation.inverse() * Vector3::z();
            let tilted = f64::from(up.angle(&moving.up_when_frozen)) > self.settings.wake_tilt;
            let pushed = f64::from(moving.acceleration.norm()) > self.settings.wake_acceleration;
            if tilted || pushed || self.visited(k) {
                self.vessels[k].frozen = false;
                self.vessels[k].calm = 0.0;
                for i in 0..self.phase.len() {
                    if self.phase[i] == Phase::Riding(k) {
                        self.phase[i] = Phase::Live;
                        let p = self.position[i];
                        self.velocity[i] = self.vessels[k].velocity_at(&p);
                    }
                }
            }
        }
    }

    /// Returns whether a moving particle is about vessel `k` without being inside.
    fn visited(&self, k: usize) -> bool {
        let (moving, reach) = (&self.vessels[k], 3.0 * self.spacing);
        let near = |i: usize| moving.vessel.near(&moving.local(&self.position[i]), reach);
        (0..self.phase.len())
            .any(|i| self.phase[i] == Phase::Live && self.inside[i] & (1 << k) == 0 && near(i))
    }

    /// Moves frozen and clinging particles with their vessels.
    pub(super) fn ride(&mut self) {
        for i in 0..self.phase.len() {
            if let Phase::Riding(k) | Phase::Clinging(k) = self.phase[i] {
                let moving = &self.vessels[k];
                self.position[i] = moving.world(&self.ride[i]);
                self.velocity[i] = moving.velocity_at(&self.position[i]);
            }
        }
    }

    pub(super) fn freeze(&mut self, k: usize) {
        for i in 0..self.phase.len() {
            if self.phase[i] == Phase::Live && self.inside[i] & (1 << k) != 0 {
                self.phase[i] = Phase::Riding(k);
                self.ride[i] = self.vessels[k].local(&self.position[i]);
            }
        }
        let moving = &mut self.vessels[k];
        moving.frozen = true;
        moving.up_when_frozen = moving.now.rotation.inverse() * Vector3::z();
    }

    /// Lets calm water freeze and drops that came to rest on the table stay there.
    pub(super) fn rest(&mut self) {
        for i in 0..self.phase.len() {
            if self.phase[i] != Phase::Live {
                continue;
            }
            if self.position[i].z < -0.5 {
                self.phase[i] = Phase::Gone;
            } else if self.touched_table[i] && self.inside[i] == 0 {
                self.rest_time[i] += self.dt;
                if self.rest_time[i] > DROP_TIME {
                    self.phase[i] = Phase::Spilt;
                    self.velocity[i] = Vector3::zeros();
                }
            }
        }
        if !self.settings.freeze {
            return;
        }
        for k in 0..self.vessels.len() {
            if self.vessels[k].frozen {
                continue;
            }
            let moving = &self.vessels[k];
            let (mut n, mut square) = (0, 0.0);
            for i in 0..self.phase.len() {
                if self.phase[i] == Phase::Live && self.inside[i] & (1 << k) != 0 {
                    let v = self.velocity[i] - moving.velocity_at(&self.position[i]);
                    square += v.norm_squared();
                    n += 1;
                }
            }
            let up = moving.now.rotation.inverse() * Vector3::z();
            let calm = (n == 0 || square / (n as f32) < CALM_SPEED * CALM_SPEED)
                && f64::from(moving.acceleration.norm()) < 0.5 * self.settings.wake_acceleration
                && moving.spin.norm() < 0.05
                && (n == 0 || f64::from(up.angle(&Vector3::z())) < LEANS)
                && !self.visited(k);
            let moving = &mut self.vessels[k];
            moving.calm = if calm { moving.calm + self.dt } else { 0.0 };
            if moving.calm > CALM_TIME {
                self.freeze(k);
            }
        }
    }
}
