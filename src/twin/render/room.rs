//! The room around the table: floor and walls, which are far away and plain.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;
use wide::f32x4;

use super::light::{Lighting, Rgb};
use super::noise::{noise, noise_four};
use super::vectors::Four3;

/// Height of the floor below the table top, m. A common height for a table.
const FLOOR: f64 = -0.74;

/// Grey linoleum, and walls.
const LINOLEUM: [f64; 3] = [0.155, 0.165, 0.172];
const WALL: [f64; 3] = [0.44, 0.45, 0.45];

impl Lighting {
    /// Returns what the room looks like from `o` in the direction `d` (unit): floor and walls.
    pub(super) fn room(&self, o: Vector3<f64>, d: Vector3<f64>) -> Rgb {
        if d.z < -1e-3 {
            let t = (FLOOR - o.z) / d.z;
            let p = o + d * t.max(0.0);
            // Darker away from the lamp and under the table.
            let far = 1.0 / (1.0 + 0.05 * (p.x * p.x + p.y * p.y));
            let speck = 0.985 + 0.03 * noise(p.x * 7.0, p.y * 7.0);
            return Vector3::from(LINOLEUM) * (speck * (0.35 + 0.65 * far)) * self.level();
        }
        Vector3::from(WALL) * self.level() * (0.8 + 0.3 * d.z)
    }

    /// As [`Self::room`], in four directions and single precision.
    #[inline(always)]
    pub(super) fn room_four(&self, o: Vector3<f64>, d: Four3) -> Four3 {
        let level = f32x4::splat(self.level() as f32);
        let wall = level * (d.z * f32x4::splat(0.3) + f32x4::splat(0.8));
        let of = |[r, g, b]: [f64; 3]| Four3::of(Vector3::new(r as f32, g as f32, b as f32));
        let walls = of(WALL) * wall;
        let low = f32x4::splat(-1e-3);
        let is_floor = d.z.simd_lt(low);
        if !is_floor.any() {
            return walls;
        }
        let t = f32x4::splat((FLOOR - o.z) as f32) / d.z.fast_min(low);
        let t = t.fast_max(f32x4::splat(0.0));
        let (x, y) = (f32x4::splat(o.x as f32) + d.x * t, f32x4::splat(o.y as f32) + d.y * t);
        let one = f32x4::splat(1.0);
        let far = one / (one + f32x4::splat(0.05) * (x * x + y * y));
        let seven = f32x4::splat(7.0);
        let speck = f32x4::splat(0.985) + f32x4::splat(0.03) * noise_four(x * seven, y * seven);
        let part = speck * (f32x4::splat(0.35) + f32x4::splat(0.65) * far) * level;
        let floor = of(LINOLEUM) * part;
        Four3 {
            x: is_floor.bitselect(floor.x, walls.x),
            y: is_floor.bitselect(floor.y, walls.y),
            z: is_floor.bitselect(floor.z, walls.z),
        }
    }
}
