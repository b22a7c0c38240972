//! Water on its way: each particle falls as a stone does, beside and through what the vessels leave open.
//!
//! There is no pressure in a stream, so nothing pushes its particles apart, and none splashes. What meets a wall, a rim
//! or the table loses its speed towards it.

use nalgebra::Vector3;

use super::{Fluid, Phase};

/// How far particles stay from surfaces, in their widths.
const MARGIN: f32 = 0.4;
/// A particle is where it may be if it is no farther from there, m: single precision puts a metre so far off, and back.
const ROUNDED: f32 = 1e-6;
/// No particle is faster, m/s: one thrown out by a jump of its vessel must not leave the room.
const TOP_SPEED: f32 = 5.0;
/// What a drop on the table keeps of its speed each step: a film is slowed by the wood far more than by water.
const SLIDES: f32 = 0.9;

impl Fluid {
    /// One step of the particles that move.
    pub(super) fn fall(&mut self) {
        let dt = self.dt;
        for &i in &self.loose {
            if self.phase[i] != Phase::Live {
                continue;
            }
            let start = self.position[i];
            let v = self.velocity[i] + self.gravity * dt;
            let v = v * (TOP_SPEED / v.norm().max(TOP_SPEED));
            let target = start + v * dt;
            let (place, inside, wall) = self.confine(&start, self.inside[i], &target);
            self.position[i] = place;
            self.velocity[i] = stopped(&v, &(place - target), &wall);
            self.inside[i] = inside;
            let low = place.z < 0.6 * self.spacing && inside == 0;
            if low && self.table.holds(f64::from(place.x), f64::from(place.y), 0.0) {
                self.touched_table[i] = true;
                self.velocity[i].x *= SLIDES;
                self.velocity[i].y *= SLIDES;
            }
        }
    }

    /// Returns where a particle may go from `start` (with the sides it was on) when it wants to `target`, the sides it
    /// is on then, and the velocity of what kept it from going there.
    fn confine(
        &self,
        start: &Vector3<f32>,
        sides: u32,
        target: &Vector3<f32>,
    ) -> (Vector3<f32>, u32, Vector3<f32>) {
        let margin = MARGIN * self.spacing;
        let mut p = *target;
        let (mut now, mut wall) = (sides, Vector3::zeros());
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
                if (held - to).norm_squared() > ROUNDED * ROUNDED {
                    p = moving.world(&held);
                    wall = moving.velocity_at(&p);
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
                return (p, now, wall);
            }
        }
        // Squeezed between two vessels: it moves with the one it is in, or stays.
        for (k, moving) in self.vessels.iter().enumerate() {
            if sides & (1 << k) != 0 {
                let local = moving.local_before(start);
                let place = moving.world(&local);
                return (place, sides, moving.velocity_at(&place));
            }
        }
        (*start, sides, wall)
    }
}

/// Returns a velocity after something that moves with `wall` m/s has put a particle aside by `aside` m: no longer
/// towards it, and not thrown back. A step's way aside is not a speed.
fn stopped(v: &Vector3<f32>, aside: &Vector3<f32>, wall: &Vector3<f32>) -> Vector3<f32> {
    aside.try_normalize(1e-7).map_or(*v, |out| v + out * (wall - v).dot(&out).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_takes_the_speed_towards_it_and_gives_none_back() {
        let (out, still) = (Vector3::new(0.002, 0.0, 0.0), Vector3::zeros());
        let v = stopped(&Vector3::new(-0.3, 0.0, -1.0), &out, &still);
        assert!((v - Vector3::new(0.0, 0.0, -1.0)).norm() < 1e-6, "{v:?}");
        // Already on its way out, it is not thrown; a wall that comes takes it along.
        let away = Vector3::new(0.1, 0.0, -1.0);
        assert_eq!(stopped(&away, &out, &still), away);
        let pushed = stopped(&away, &out, &Vector3::new(0.4, 0.0, 0.0));
        assert!((pushed.x - 0.4).abs() < 1e-6, "{pushed:?}");
    }
}
