//! Four rays at once through glass and water, in single precision.
//!
//! What [`super::glass`] does ray by ray, for vessels and solids of [`super::rays`]: rays that meet the same surfaces in the same
//! order go together, led by the first of them; one that turns off goes again with those that are left. What they
//! see beyond is asked at once where it is the table's top, else by [`super::trace`] one by one.

use nalgebra::Vector3;
use wide::f32x4;

use super::glass::{MOST_SURFACES, Medium, ROUND};
use super::light::Lighting;
use super::rays::{Change, Four3, Plain};
use super::tone::{BRIGHTEST, clamped};
use super::trace::{Stage, key_of_table, mix};

/// What rays see that went through something clear.
pub(super) struct Through {
    /// Linear light, no brighter than is told apart.
    pub(super) light: [[f32; 3]; 4],
    /// As in [`super::trace::Sample`].
    pub(super) keys: [u64; 4],
}

impl Stage<'_> {
    /// Follows rays from the eye along `d` (unit, world) that enter the clear thing `index` at `t`, those with a bit in `wanted`.
    pub(super) fn through_four(&self, index: usize, d: Four3, t: f32x4, wanted: u32) -> Through {
        let mut seen = Through { light: [[0.0; 3]; 4], keys: [0; 4] };
        let mut todo = wanted;
        while todo != 0 {
            let first = todo.trailing_zeros() as usize;
            let plain = self.plain[index].as_ref();
            let mut done =
                plain.map_or(0, |plain| self.follow(index, plain, (d, t), todo, &mut seen));
            if done == 0 {
                let d = d.lane(first).normalize();
                let t = f64::from(t.to_array()[first]);
                let (light, key) = self.through(&self.things[index], self.eye, d, t, 0);
                (seen.light[first], seen.keys[first]) = (clamped(light), key);
                done = 1 << first;
            }
            todo &= !done;
        }
        seen
    }

    /// Follows the first of the rays in `lanes` and all that go the same way, and returns which these were; none where single
    /// precision does not do.
    fn follow(
        &self,
        index: usize,
        plain: &Plain,
        (d, t): (Four3, f32x4),
        mut lanes: u32,
        seen: &mut Through,
    ) -> u32 {
        let first = lanes.trailing_zeros() as usize;
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let (eye, mut way) = plain.inward(d);
        let mut at = eye + way * (t - f32x4::splat(1e-5));
        let mut medium = Medium::Air;
        let mut light = Four3 { x: zero, y: zero, z: zero };
        let mut left = Four3 { x: one, y: one, z: one };
        let mut key = u64::from(self.things[index].id);
        let mut is_out = false;
        for _ in 0..MOST_SURFACES {
            let step = plain.step(at, way);
            let change = step.change(first);
            lanes &= alike(step.changes, first);
            if change == Change::Never {
                is_out = true;
                break;
            }
            left = left.times(medium.pass_four(step.length));
            at = at + way * step.length;
            let (outward, faces) = plain.wall(change, at);
            lanes &= alike(faces, first);
            key = mix(key, u64::from(faces.to_array()[first] as u8));
            let beyond = match change {
                Change::Enter | Change::LeaveHole => plain.stuff(),
                Change::Leave => Medium::Air,
                Change::Level if medium == Medium::Water => Medium::Air,
                Change::Level => Medium::Water,
                Change::EnterHole => {
                    let wet = plain.under(at);
                    let is_wet = wet >> first & 1 == 1;
                    lanes &= if is_wet { wet } else { !wet };
                    if is_wet { Medium::Water } else { Medium::Air }
                }
                Change::Never => return 0,
            };
            if beyond == medium || change == Change::Level && medium == Medium::Glass {
                return 0;
            }
            let facing = |n: Four3| {
                let sign = n.dot(way).simd_gt(zero).bitselect(-one, one);
                n * sign
            };
            let mut normal = facing(outward);
            if (change == Change::Enter || change == Change::Leave)
                && let Some(soft) = plain.rounded(outward, at, ROUND as f32)
            {
                let soft = facing(soft);
                // Seen almost along the wall the rounding would turn the surface inside out.
                let is_soft = soft.dot(normal).simd_gt(zero);
                normal = Four3 {
                    x: is_soft.bitselect(soft.x, normal.x),
                    y: is_soft.bitselect(soft.y, normal.y),
                    z: is_soft.bitselect(soft.z, normal.z),
                };
            }
            let parted = Parted::of(way, normal, medium, beyond);
            let is_bent = parted.bends >> first & 1 == 1;
            lanes &= if is_bent { parted.bends } else { !parted.bends };
            if is_bent {
                let around = self.lighting.mirrored_four(plain.outward(parted.back));
                light = light + left.times(around) * parted.mirrored;
                left = left * (one - parted.mirrored);
                way = parted.bent;
                medium = beyond;
            } else {
                way = parted.back;
                key = mix(key, 77);
            }
            let dim = left.x.fast_max(left.y).fast_max(left.z).simd_lt(f32x4::splat(0.01));
            let dim = dim.to_bitmask();
            if dim >> first & 1 == 1 {
                lanes &= dim;
                seen.keep(light, [key; 4], lanes);
                return lanes;
            }
            lanes &= !dim;
        }
        if !is_out && medium != Medium::Air {
            // Caught inside by total reflection; what comes out has been mixed well.
            let up = Four3::of(Vector3::z());
            light = light + left.times(self.lighting.mirrored_four(up)) * f32x4::splat(0.4);
            seen.keep(light, [mix(key, 78); 4], lanes);
            return lanes;
        }
        if medium != Medium::Air {
            return 0;
        }
        // A hair back, so that what the thing stands on is not missed where the two touch.
        let from = plain.back(at - way * f32x4::splat(1e-4));
        let (beyond, keys) = self.beyond(index, from, plain.outward(way), lanes);
        let mut all = [0; 4];
        for k in 0..4 {
            all[k] = mix(key, keys[k]);
        }
        seen.keep(light + left.times(beyond), all, lanes);
        lanes
    }

    /// Returns what rays see that left thing `own`, and the keys of it.
    fn beyond(&self, own: usize, from: Four3, d: Four3, lanes: u32) -> (Four3, [u64; 4]) {
        let zero = f32x4::splat(0.0);
        let far = -from.z / d.z.fast_min(f32x4::splat(-1e-4));
        let (x, y) = (from.x + d.x * far, from.y + d.y * far);
        let within = |at: f32x4, middle: f64, size: f64| {
            let half = f32x4::splat(size as f32 / 2.0 - 1e-5);
            (at - f32x4::splat(middle as f32)).abs().simd_lt(half)
        };
        let is_on = d.z.simd_lt(f32x4::splat(-1e-3))
            & from.z.simd_gt(f32x4::splat(2e-6))
            & within(x, self.table.centre[0], self.table.size.x)
            & within(y, self.table.centre[1], self.table.size.y);
        let mut plainly = is_on.to_bitmask() & lanes;
        for (k, thing) in self.things.iter().enumerate().skip(1) {
            if k == own || plainly == 0 {
                continue;
            }
            let to = Four3::of(thing.centre.cast()) - from;
            let (along, far2) = (to.dot(d), to.dot(to));
            let radius = thing.radius as f32 + 1e-5;
            let square = f32x4::splat(radius * radius + 2e-6);
            let is_near = (far2 - along * along).simd_le(square)
                & (along.simd_ge(zero) | far2.simd_le(square));
            if is_near.to_bitmask() & plainly == 0 {
                continue;
            }
            let met = match &self.plain[k] {
                Some(plain) if !plain.is_clear() => plain.blocks(from, d),
                _ => is_near,
            };
            plainly &= !met.to_bitmask();
        }
        let (mut light, mut keys) = ([[0.0_f32; 4]; 4], [key_of_table(false); 4]);
        if plainly != 0 {
            light = self.lighting.table_four(x, y);
            for mark in self.marks {
                let (x, y) = (x - f32x4::splat(mark.x as f32), y - f32x4::splat(mark.y as f32));
                let radius = mark.radius as f32 + 1e-5;
                let is_on = (x * x + y * y).simd_lt(f32x4::splat(radius * radius));
                // One by one, as whatever is rare.
                plainly &= !is_on.to_bitmask();
            }
        }
        for k in 0..4 {
            if (lanes & !plainly) >> k & 1 == 1 {
                let sample = self.look(from.lane(k), d.lane(k).normalize(), None, 1);
                let [r, g, b] = clamped(sample.light);
                (light[k], keys[k]) = ([r, g, b, 0.0], sample.key);
            }
        }
        let mut rows = [f32x4::splat(0.0); 4];
        for k in 0..4 {
            rows[k] = f32x4::from(light[k]);
        }
        let [x, y, z, _] = f32x4::transpose(rows);
        (Four3 { x, y, z }, keys)
    }
}

/// What becomes of rays at a surface, as by `split` of [`super::glass`].
struct Parted {
    /// Which go on, bent, one bit each; the others are thrown back whole.
    bends: u32,
    bent: Four3,
    back: Four3,
    /// The share that is thrown back.
    mirrored: f32x4,
}

impl Parted {
    /// Parts rays along `way` (unit) at a surface whose normal faces them.
    #[inline]
    fn of(way: Four3, normal: Four3, medium: Medium, beyond: Medium) -> Self {
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let (n1, n2) = (medium.index() as f32, beyond.index() as f32);
        let ratio = f32x4::splat(n1 / n2);
        let (n1, n2) = (f32x4::splat(n1), f32x4::splat(n2));
        let cos1 = -normal.dot(way);
        let rest = one - ratio * ratio * (one - cos1 * cos1);
        let cos2 = rest.fast_max(zero).sqrt();
        let s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
        let p = (n1 * cos2 - n2 * cos1) / (n1 * cos2 + n2 * cos1);
        let bent = way * ratio + normal * (ratio * cos1 - cos2);
        Self {
            bends: rest.simd_gt(zero).to_bitmask(),
            bent: bent * (one / bent.norm()),
            back: way + normal * (cos1 + cos1),
            mirrored: (s * s + p * p) * f32x4::splat(0.5),
        }
    }
}

/// Returns which of four numbers are the same as one of them, one bit each.
#[inline]
fn alike(four: f32x4, first: usize) -> u32 {
    four.simd_eq(f32x4::splat(four.to_array()[first])).to_bitmask()
}

impl Through {
    fn keep(&mut self, light: Four3, keys: [u64; 4], lanes: u32) {
        let cut =
            |x: f32x4| x.fast_max(f32x4::splat(0.0)).fast_min(f32x4::splat(BRIGHTEST)).to_array();
        let (r, g, b) = (cut(light.x), cut(light.y), cut(light.z));
        for k in 0..4 {
            if lanes >> k & 1 == 1 {
                (self.light[k], self.keys[k]) = ([r[k], g[k], b[k]], keys[k]);
            }
        }
    }
}

impl Medium {
    /// As [`Self::pass`], over four lengths.
    #[inline]
    fn pass_four(self, length: f32x4) -> Four3 {
        let one = f32x4::splat(1.0);
        let Some([r, g, b]) = self.tint() else { return Four3 { x: one, y: one, z: one } };
        // The exponential as the eighth power of five terms of its series: light goes through no metre of glass.
        let part = |a: f64| {
            let x = (length * f32x4::splat(a as f32 / 8.0)).fast_min(one);
            let terms = |x: f32x4, a: f32, rest: f32x4| f32x4::splat(a) - x * rest;
            let series = terms(x, 0.5, terms(x, 1.0 / 6.0, f32x4::splat(1.0 / 24.0)));
            let part = one - x * (one - x * series);
            let square = part * part;
            let fourth = square * square;
            fourth * fourth
        };
        Four3 { x: part(r), y: part(g), z: part(b) }
    }
}

impl Lighting {
    /// As [`Self::mirrored`], in four directions.
    fn mirrored_four(&self, d: Four3) -> Four3 {
        let sheen = self.sheen_four(d);
        let is_up = d.z.simd_gt(f32x4::splat(0.05));
        if !is_up.any() {
            return sheen;
        }
        let one = f32x4::splat(1.0);
        let inside = |at: f32x4, apart: f32, half: f32| {
            let whole = (at * f32x4::splat(1.0 / apart)).round();
            let from_middle = (at - f32x4::splat(apart) * whole).abs();
            let over = (from_middle - f32x4::splat(half)) * f32x4::splat(1.0 / 0.08);
            one - over.fast_max(f32x4::splat(0.0)).fast_min(one)
        };
        let scale = f32x4::splat(2.2) / d.z.fast_max(f32x4::splat(0.05));
        let panel = inside(d.x * scale - f32x4::splat(0.4), 1.5, 0.22)
            * inside(d.y * scale + f32x4::splat(0.3), 1.9, 0.50);
        sheen + Four3::of(self.lamp().cast()) * (is_up & (panel * f32x4::splat(5.0)))
    }
}
