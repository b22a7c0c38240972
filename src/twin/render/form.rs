//! Boxes, cylinders and capsules in their own frame, as four rays of single precision at a time meet them: from where to where lines
//! are inside, and how the surface lies there. What double precision does one by one is [`super::solid`]'s.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;
use wide::f32x4;

use super::solid::Solid;
use super::span::{BOTTOM, SIDE, TOP};
use super::vectors::Four3;

/// The kinds of solid that are met four rays at a time.
#[derive(Clone, Copy)]
pub(super) enum Form {
    Cuboid { centre: Vector3<f32>, half: Vector3<f32> },
    Cylinder { radius: f32, bottom: f32, top: f32 },
    Capsule { radius: f32, bottom: f32, top: f32 },
}

/// From where to where lines are inside a solid; where one misses it, it enters at infinity and leaves at its negative.
#[derive(Clone, Copy)]
pub(super) struct Spans {
    pub(super) enter: f32x4,
    pub(super) leave: f32x4,
}

impl Form {
    pub(super) fn of(solid: &Solid) -> Option<Self> {
        Some(match *solid {
            Solid::Cuboid { centre, half } => {
                Self::Cuboid { centre: centre.cast(), half: half.cast() }
            }
            Solid::Cylinder { radius, bottom, top } => {
                Self::Cylinder { radius: radius as f32, bottom: bottom as f32, top: top as f32 }
            }
            Solid::Capsule { radius, bottom, top } => {
                Self::Capsule { radius: radius as f32, bottom: bottom as f32, top: top as f32 }
            }
            Solid::Lathe { .. } | Solid::Ellipsoid { .. } => return None,
        })
    }

    /// As [`Solid::grown`].
    pub(super) fn grown(&self, by: f32) -> Self {
        match *self {
            Self::Cuboid { centre, half } => Self::Cuboid { centre, half: half.add_scalar(by) },
            Self::Cylinder { radius, bottom, top } => {
                Self::Cylinder { radius: radius + by, bottom: bottom - by, top: top + by }
            }
            Self::Capsule { radius, bottom, top } => {
                Self::Capsule { radius: radius + by, bottom, top }
            }
        }
    }

    #[inline(always)]
    pub(super) fn span(&self, o: Four3, d: Four3) -> Spans {
        match *self {
            Self::Cuboid { centre, half } => cuboid(o - Four3::of(centre), d, Four3::of(half)),
            Self::Cylinder { radius, bottom, top } => {
                let ends = [f32x4::splat(bottom), f32x4::splat(top)];
                cylinder(o, d, f32x4::splat(radius), ends)
            }
            Self::Capsule { radius, bottom, top } => {
                capsule(o, d, f32x4::splat(radius), [bottom, top])
            }
        }
    }

    /// As [`Self::span`] of the solid [`Self::grown`] by as much for each line.
    #[inline(always)]
    pub(super) fn span_about(&self, o: Four3, d: Four3, by: f32x4) -> Spans {
        match *self {
            Self::Cuboid { centre, half } => {
                let grown = Four3::of(half) + Four3 { x: by, y: by, z: by };
                cuboid(o - Four3::of(centre), d, grown)
            }
            Self::Cylinder { radius, bottom, top } => {
                let ends = [f32x4::splat(bottom) - by, f32x4::splat(top) + by];
                cylinder(o, d, f32x4::splat(radius) + by, ends)
            }
            Self::Capsule { radius, bottom, top } => {
                capsule(o, d, f32x4::splat(radius) + by, [bottom, top])
            }
        }
    }

    /// Returns the outward normals (unit) at places of the surface, and the faces.
    #[inline(always)]
    pub(super) fn surface(&self, at: Four3) -> (Four3, f32x4) {
        let zero = f32x4::splat(0.0);
        match *self {
            Self::Cuboid { centre, half } => {
                let off = at - Four3::of(centre);
                let over = |off: f32x4, half: f32| off.abs() - f32x4::splat(half);
                let over = [over(off.x, half.x), over(off.y, half.y), over(off.z, half.z)];
                let is_x = over[0].simd_ge(over[1]) & over[0].simd_ge(over[2]);
                let is_y = !is_x & over[1].simd_ge(over[2]);
                let side =
                    |off: f32x4| off.simd_lt(zero).bitselect(f32x4::splat(-1.0), f32x4::splat(1.0));
                let (x, y, z) = (side(off.x), side(off.y), side(off.z));
                let face = is_x.bitselect(
                    x * f32x4::splat(0.5) + f32x4::splat(0.5),
                    is_y.bitselect(
                        y * f32x4::splat(0.5) + f32x4::splat(2.5),
                        z * f32x4::splat(0.5) + f32x4::splat(4.5),
                    ),
                );
                let normal =
                    Four3 { x: is_x & x, y: is_y & y, z: (is_x | is_y).bitselect(zero, z) };
                (normal, face)
            }
            Self::Cylinder { radius, bottom, top } => {
                let out = (at.x * at.x + at.y * at.y).sqrt().fast_max(f32x4::splat(1e-9));
                let (top, bottom) = (at.z - f32x4::splat(top), f32x4::splat(bottom) - at.z);
                let is_side = (out - f32x4::splat(radius)).simd_ge(top.fast_max(bottom));
                let is_top = top.simd_ge(bottom);
                let one = f32x4::splat(1.0);
                let normal = Four3 {
                    x: is_side & (at.x / out),
                    y: is_side & (at.y / out),
                    z: is_side.bitselect(zero, is_top.bitselect(one, -one)),
                };
                let end =
                    is_top.bitselect(f32x4::splat(f32::from(TOP)), f32x4::splat(f32::from(BOTTOM)));
                (normal, is_side.bitselect(f32x4::splat(f32::from(SIDE)), end))
            }
            Self::Capsule { bottom, top, .. } => {
                let z = at.z.fast_max(f32x4::splat(bottom)).fast_min(f32x4::splat(top));
                let off = Four3 { z: at.z - z, ..at };
                (off * (f32x4::splat(1.0) / off.norm()), f32x4::splat(f32::from(SIDE)))
            }
        }
    }
}

/// Keeps the spans that are not empty.
#[inline(always)]
fn kept(enter: f32x4, leave: f32x4, is_met: f32x4) -> Spans {
    let far = f32x4::splat(f32::INFINITY);
    let is_met = is_met & enter.simd_lt(leave);
    Spans { enter: is_met.bitselect(enter, far), leave: is_met.bitselect(leave, -far) }
}

/// Returns 1/x, and of nearly nothing something great, never infinite.
#[inline(always)]
fn inverse(x: f32x4) -> f32x4 {
    let least = f32x4::splat(1e-12);
    let sign = x.simd_lt(f32x4::splat(0.0)).bitselect(-least, least);
    f32x4::splat(1.0) / x.abs().simd_lt(least).bitselect(sign, x)
}

#[inline(always)]
fn cuboid(o: Four3, d: Four3, half: Four3) -> Spans {
    let slab = |o: f32x4, d: f32x4, half: f32x4| {
        let inverse = inverse(d);
        let (a, b) = ((-half - o) * inverse, (half - o) * inverse);
        (a.fast_min(b), a.fast_max(b))
    };
    let (x, y, z) = (slab(o.x, d.x, half.x), slab(o.y, d.y, half.y), slab(o.z, d.z, half.z));
    let enter = x.0.fast_max(y.0).fast_max(z.0);
    let leave = x.1.fast_min(y.1).fast_min(z.1);
    kept(enter, leave, enter.simd_lt(leave))
}

/// Where lines are inside an endless cylinder about z: the middle of that stretch, half of it, and whether there is any.
#[inline(always)]
fn tube(o: Four3, d: Four3, radius: f32x4) -> (f32x4, f32x4, f32x4) {
    // Along the axis the stretch has no end; a great one does as well.
    let a = (d.x * d.x + d.y * d.y).fast_max(f32x4::splat(1e-12));
    let middle = -(o.x * d.x + o.y * d.y) / a;
    let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
    let left = radius * radius - x * x - y * y;
    let zero = f32x4::splat(0.0);
    (middle, (left.fast_max(zero) / a).sqrt(), left.simd_gt(zero))
}

#[inline(always)]
fn cylinder(o: Four3, d: Four3, radius: f32x4, [bottom, top]: [f32x4; 2]) -> Spans {
    let (middle, reach, is_met) = tube(o, d, radius);
    let inverse = inverse(d.z);
    let (a, b) = ((bottom - o.z) * inverse, (top - o.z) * inverse);
    let enter = (middle - reach).fast_max(a.fast_min(b));
    let leave = (middle + reach).fast_min(a.fast_max(b));
    kept(enter, leave, is_met)
}

/// As `solid::capsule`: in and out through the tube between the ends, beyond them through the balls there.
#[inline(always)]
fn capsule(o: Four3, d: Four3, radius: f32x4, [bottom, top]: [f32; 2]) -> Spans {
    let ball = |z: f32| {
        let o = Four3 { z: o.z - f32x4::splat(z), ..o };
        let middle = -o.dot(d);
        let near = o + d * middle;
        let left = radius * radius - near.dot(near);
        let zero = f32x4::splat(0.0);
        let reach = left.fast_max(zero).sqrt();
        (middle - reach, middle + reach, left.simd_gt(zero))
    };
    if top - bottom < 1e-9 {
        let (enter, leave, is_met) = ball(bottom);
        return kept(enter, leave, is_met);
    }
    let (middle, reach, is_met) = tube(o, d, radius);
    let (enter, leave) = (middle - reach, middle + reach);
    let height = |t: f32x4| o.z + t * d.z;
    let is_below = |t: f32x4| height(t).simd_lt(f32x4::splat(bottom));
    let is_above = |t: f32x4| height(t).simd_gt(f32x4::splat(top));
    let ends = [is_below(enter), is_above(enter), is_below(leave), is_above(leave)];
    if !(ends[0] | ends[1] | ends[2] | ends[3]).any() {
        return kept(enter, leave, is_met);
    }
    let (below, above) = (ball(bottom), ball(top));
    let all = f32x4::splat(0.0).simd_le(f32x4::splat(0.0));
    let pick = |is_below: f32x4, is_above: f32x4, below: f32x4, above: f32x4, between: f32x4| {
        is_below.bitselect(below, is_above.bitselect(above, between))
    };
    let is_met = is_met
        & pick(ends[0], ends[1], below.2, above.2, all)
        & pick(ends[2], ends[3], below.2, above.2, all);
    kept(
        pick(ends[0], ends[1], below.0, above.0, enter),
        pick(ends[2], ends[3], below.1, above.1, leave),
        is_met,
    )
}
