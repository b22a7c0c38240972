//! Water on its way: each particle falls as a stone does, beside and through what the vessels leave open.
//!
//! There is no pressure in a stream, so nothing pushes its particles apart, and none splashes. What meets a wall, a rim
//! or the table loses its speed towards it.

use nalgebra::Vector3;

use super::{Fluid, Phase};

/// How far particles stay from surfaces, in their widths.
const MARGIN: f32 = 0.4;
/// No particle is faster, m/s: one thrown out by a jump of its vessel must not leave the room.
const TOP_SPEED: f32 = 5.0;
/// What a drop on the table keeps of its speed each step: a film is slowed by the wood far more than by water.
const SLIDES: f32 = 0.9;

impl Fluid {
    /// One step of the particles that move.
    pub(super) fn fall(&mut self) {
        let dt = self.dt;
        for i in 0..self.phase.len() {
            if self.phase[i] != Phase::Live {
                continue;
            }
            let start = self.position[i];
            let v = self.velocity[i] + self.gravity * dt;
            let v = v * (TOP_SPEED / v.norm().max(TOP_SPEED));
            let (place, inside) = self.confine(&start, self.inside[i], &(start + v * dt));
            self.position[i] = place;
            self.velocity[i] = (place - start) / dt;
            self.inside[i] = inside;
            let low = place.z < 0.6 * self.spacing && inside == 0;
            if low && self.table.holds(f64::from(place.x), f64::from(place.y), 0.0) {
                self.touched_table[i] = true;
                self.velocity[i].x *= SLIDES;
                self.velocity[i].y *= SLIDES;
            }
        }
    }

    /// Returns where a particle may go from `start` (with the sides it was on) when it wants to `target`,
    /// and the sides it is on then.
    fn confine(
        &self,
        start: &Vector3<f32>,
        sides: u32,
        target: &Vector3<f32>,
    ) -> (Vector3<f32>, u32) {
        let margin = MARGIN * self.spacing;
        let mut p = *target;
        let mut now = sides;
        let below_top = |p: &Vector3<f32>| {
            p.z < margin
                && start.z > -margin
                && self.table.holds(f64::from(p.x), f64::from(p.y), 0.0)
        };
        // One vessel may push a particle into another: a few passes agree, or the particle stays put.
        for _ in 0..4 {
            if below_top(&p) {
                p.z = margin;
            }
            // Whether something asked before has been moved away from since; if not, all agree.
            let (mut asked, mut again) = (false, false);
            for (k, moving) in self.vessels.iter().enumerate() {
                let bit = 1 << k;
                let inside = sides & bit != 0;
                let apart = (p - moving.now.translation.vector).norm_squared();
                if !inside && apart > moving.reach2 {
                    now &= !bit;
                    continue;
                }
                let to = moving.local(&p);
                let (held, is_in) = if inside {
                    (moving.vessel.under_lid(&to, margin), true)
                } else {
                    moving.vessel.confine(&moving.local_before(start), &to, margin)
                };
                if held != to {
                    p = moving.world(&held);
                    again |= asked || below_top(&p);
                }
                asked = true;
                if is_in {
                    now |= bit;
                } else {
                    now &= !bit;
                }
            }
            if !again {
                return (p, now);
            }
        }
        // Squeezed between two vessels: it moves with the one it is in, or stays.
        for (k, moving) in self.vessels.iter().enumerate() {
            if sides & (1 << k) != 0 {
                let local = moving.local_before(start);
                return (moving.world(&local), sides);
            }
        }
        (*start, sides)
    }
}
