//! How bright plain things are at four places at once, in single precision: what [`super::trace`] works out place by place.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;
use wide::f32x4;

use super::light::{LAMPS, Lighting};
use super::rays::Lie;
use super::scene::Kind;
use super::tone::{BRIGHTEST, clamped};
use super::trace::{FEW, Stage, mix};
use super::vectors::Four3;

impl Stage<'_> {
    /// Returns the light of a plain thing at places that rays along `d` meet, and keys that change at its inner edges.
    #[inline(always)]
    pub(super) fn light_four(
        &self,
        index: usize,
        d: Four3,
        at: Four3,
        lie: &Lie,
    ) -> ([[f32; 3]; 4], [u64; 4]) {
        let own = &self.things[index];
        let (normal, faces) = (lie.normal, lie.faces);
        let (lit, steps) = self.lit_four(index, at, lie);
        let mut keys = [0; 4];
        for k in 0..4 {
            keys[k] = mix(u64::from(own.id), u64::from(faces[k]) * 8 + steps[k]);
        }
        // Close above the table less of the room is seen.
        let one = f32x4::splat(1.0);
        let zero = f32x4::splat(0.0);
        let open = if at.z.simd_lt(f32x4::splat(0.3)).any() {
            one - (at.z.fast_max(zero) * f32x4::splat(-50.0)).exp() * f32x4::splat(0.25)
        } else {
            one
        };
        let open = open * (one - lie.depth * f32x4::splat(0.6));
        let lighting = &self.lighting;
        let gloss = own.paint.specular as f32;
        let up = normal.z * f32x4::splat(0.5) + f32x4::splat(0.5);
        let around = f32x4::splat(lighting.ambient as f32)
            * open
            * (up * f32x4::splat(0.58) + f32x4::splat(0.42));
        let towards = Four3::of(lighting.towards().cast());
        let direct = normal.dot(towards).fast_max(zero) * lit;
        let (albedo, lamp) = (own.albedo.cast::<f32>(), lighting.lamp().cast::<f32>());
        let mut light = Four3 {
            x: f32x4::splat(albedo.x) * (direct * f32x4::splat(lamp.x) + around),
            y: f32x4::splat(albedo.y) * (direct * f32x4::splat(lamp.y) + around),
            z: f32x4::splat(albedo.z) * (direct * f32x4::splat(lamp.z) + around),
        };
        if gloss > 0.0 {
            let halfway = towards - d;
            let cos = normal.dot(halfway).fast_max(zero) / halfway.norm();
            let shine = power(cos, 12 + (90.0 * gloss * gloss) as u32) * lit;
            light = light + Four3::of(lamp) * (shine * f32x4::splat(0.9 * gloss));
        }
        if gloss > 0.1 {
            let cos = (-normal.dot(d)).fast_max(zero);
            let back = d + normal * (cos + cos);
            // Schlick's form of Fresnel's equations for a lacquer.
            let left = one - cos;
            let part = left * left * left * left * left * f32x4::splat(0.96) + f32x4::splat(0.04);
            light = light + lighting.sheen_four(back) * (part * open * f32x4::splat(gloss));
        }
        let mut lights = lights(light);
        if lie.wet != 0
            && let Kind::Vessel(hollow) = &own.kind
        {
            for k in 0..4 {
                if lie.wet >> k & 1 == 1
                    && let Some(seen) = self.under_water(own, hollow, self.eye, d.lane(k))
                {
                    lights[k] = clamped(seen);
                    keys[k] = mix(u64::from(own.id), 66 + u64::from(faces[k]));
                }
            }
        }
        (lights, keys)
    }

    /// Returns the part of the lamp that places on a body see, and numbers that change with it.
    #[inline(always)]
    fn lit_four(&self, index: usize, at: Four3, lie: &Lie) -> (f32x4, [u64; 4]) {
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let normal = lie.normal;
        let towards = Four3::of(self.lighting.towards().cast());
        let faces = normal.dot(towards).simd_gt(zero);
        let samples = self.lighting.samples();
        if samples.is_empty() || !faces.any() {
            return (faces & one, [0; 4]);
        }
        let from = at + normal * f32x4::splat(1e-4);
        // A little more than single precision rounds off.
        let sine = self.lighting.sine() as f32 + 1e-4;
        let first = Vector3::new(from.x.to_array()[0], from.y.to_array()[0], from.z.to_array()[0]);
        let around = (from - Four3::of(first)).norm().to_array();
        let around = around[1].max(around[2]).max(around[3]);
        let may_shade = |caster: u32| {
            let reach = 2.5 * self.things[caster as usize].radius as f32;
            let plain = self.plain[caster as usize].as_ref();
            plain.is_none_or(|plain| plain.may_shade(from, sine, reach))
        };
        let mut near = [0; FEW];
        let casters =
            self.casters_about(index, &mut near, (first, around), (towards, sine), may_shade);
        let is_deep = lie.depth.simd_gt(zero) & faces;
        let hollow = self.plain[index].as_ref().filter(|_| is_deep.any());
        if casters.is_empty() && hollow.is_none() {
            // All of the lamp: as many steps as there are looks at it, twice.
            let steps = faces.to_bitmask();
            let all = 2 * samples.len() as u64;
            let step = |k: u32| if steps >> k & 1 == 1 { all } else { 0 };
            return (faces & one, [step(0), step(1), step(2), step(3)]);
        }
        let mut left = [faces & one; LAMPS];
        if let Some(hollow) = hollow {
            for (left, to) in left.iter_mut().zip(samples) {
                let is_open = hollow.sees_out(from, Four3::of(to.cast()));
                *left = is_deep.bitselect(*left & is_open, *left);
            }
        }
        for &caster in casters {
            if !(left[0] + left[1] + left[2] + left[3]).simd_gt(zero).any() {
                break;
            }
            let is_clear = self.things[caster as usize].paint.transparent;
            let through = if is_clear { 0.7 } else { 0.0 };
            if let Some(plain) = &self.plain[caster as usize] {
                plain.darken(from, through, &mut left);
                continue;
            }
            for (left, to) in left.iter_mut().zip(samples) {
                *left = left.fast_min(self.darkened(caster, from, to, *left, through));
            }
        }
        let mut seen = zero;
        for left in left {
            seen += left;
        }
        let lit = seen * f32x4::splat(1.0 / samples.len() as f32);
        (lit, (seen + seen).fast_trunc_int().to_array().map(|steps| steps as u64))
    }

    /// Returns how much light a thing that is not plain lets through on the way to a point of the lamp, where any is `left` to be
    /// lost.
    fn darkened(
        &self,
        caster: u32,
        from: Four3,
        to: &Vector3<f64>,
        left: f32x4,
        through: f32,
    ) -> f32x4 {
        let thing = &self.things[caster as usize];
        let left = left.to_array();
        let mut passes = [1.0_f32; 4];
        for k in 0..4 {
            let from = from.lane(k);
            let is_lit = left[k] > through;
            if is_lit && thing.near(from, *to, f64::INFINITY) && thing.blocks(from, *to) {
                passes[k] = through;
            }
        }
        f32x4::from(passes)
    }
}

impl Lighting {
    /// As [`Self::sheen`], in four directions.
    #[inline(always)]
    fn sheen_four(&self, d: Four3) -> Four3 {
        let level = self.level() as f32;
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let is_down = d.z.simd_lt(zero);
        let room = (d.z * f32x4::splat(0.25) + f32x4::splat(0.30)) * f32x4::splat(level);
        let mut above = Four3 { x: room, y: room, z: room };
        let cos = d.dot(Four3::of(self.towards().cast())).fast_min(one);
        let [from, spread, edge] = self.lamp_edge();
        let sees_lamp = cos.simd_ge(f32x4::splat(from)) & d.z.simd_ge(zero);
        if sees_lamp.any() {
            let off = (cos.fast_max(zero).acos() - f32x4::splat(spread)) * f32x4::splat(1.0 / edge);
            let lamp = one - off.fast_max(zero).fast_min(one);
            let part = sees_lamp & (lamp * lamp * f32x4::splat(12.0));
            above = above + Four3::of(self.lamp().cast()) * part;
        }
        let below = Four3::of((self.table() * (0.55 * self.level())).cast());
        Four3 {
            x: is_down.bitselect(below.x, above.x),
            y: is_down.bitselect(below.y, above.y),
            z: is_down.bitselect(below.z, above.z),
        }
    }
}

/// Returns x to a whole power.
#[inline(always)]
fn power(x: f32x4, n: u32) -> f32x4 {
    let (mut result, mut square, mut n) = (f32x4::splat(1.0), x, n);
    while n > 0 {
        if n & 1 == 1 {
            result *= square;
        }
        square = square * square;
        n >>= 1;
    }
    result
}

/// Returns four lights one by one, none brighter than is told apart.
#[inline(always)]
pub(super) fn lights(light: Four3) -> [[f32; 3]; 4] {
    let cut = |x: f32x4| x.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(BRIGHTEST)).to_array();
    let (r, g, b) = (cut(light.x), cut(light.y), cut(light.z));
    [[r[0], g[0], b[0]], [r[1], g[1], b[1]], [r[2], g[2], b[2]], [r[3], g[3], b[3]]]
}
