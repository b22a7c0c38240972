//! Four rays at once against placed things, in single precision: where they meet them, and how the surface lies there.
//!
//! For the forms that most of a picture is ([`super::form`]) and vessels of them. What a lathe made and meshes are met in
//! [`super::solid`], and what is clear is followed through in [`super::glass`], ray by ray in double precision. A place is right to 1e-7 m here, a
//! ten-thousandth of a pixel. Four numbers fit the registers that every processor of this kind has, so the picture is
//! the same on each.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

use super::form::Form;
use super::light::Lighting;
use super::scene::{Kind, Thing};
use super::vectors::Four3;

/// Balls around things, four at once: which of them a ray may meet.
pub(super) struct Balls(Vec<(Four3, f32x4)>);

impl Balls {
    pub(super) fn new(things: &[Thing]) -> Self {
        let things: Vec<&Thing> = things.iter().collect();
        // More than single precision rounds off.
        let square = |radius: f32| (radius + 1e-5) * (radius + 1e-5) + 2e-6;
        Self(things.chunks(4).map(|four| balls(four, square, -1.0)).collect())
    }

    /// Tells `told` of the things that the ray from `o` along `d` (unit, world) may meet, and of few more.
    #[inline]
    pub(super) fn ahead(&self, o: Vector3<f64>, d: Vector3<f64>, mut told: impl FnMut(usize)) {
        let (o, d) = (Four3::of(o.cast()), Four3::of(d.cast()));
        for (first, (centres, squares)) in self.0.iter().enumerate() {
            let to = *centres - o;
            let (along, far2) = (to.dot(d), to.dot(to));
            let is_near = (far2 - along * along).simd_le(*squares)
                & (along.simd_ge(f32x4::splat(0.0)) | far2.simd_le(*squares));
            let mut met = is_near.to_bitmask();
            while met != 0 {
                told(4 * first + met.trailing_zeros() as usize);
                met &= met - 1;
            }
        }
    }
}

/// Returns the middles of up to four balls around things, and what `of` makes of their radii; `none` where there is no thing.
fn balls(things: &[&Thing], of: impl Fn(f32) -> f32, none: f32) -> (Four3, f32x4) {
    let (mut centres, mut radii) = ([[0.0_f32; 4]; 3], [none; 4]);
    for (k, thing) in things.iter().enumerate() {
        for (axis, centres) in centres.iter_mut().enumerate() {
            centres[k] = thing.centre[axis] as f32;
        }
        radii[k] = of(thing.radius as f32);
    }
    let [x, y, z] = centres.map(f32x4::from);
    (Four3 { x, y, z }, f32x4::from(radii))
}

/// Balls around what may cast a shadow on a thing, four at once: which of them may stand between places on it and the lamp.
pub(super) struct Casters(Vec<(Four3, f32x4)>);

impl Casters {
    /// Returns the balls around those of `things` that are told of.
    pub(super) fn new(things: &[Thing], told: &[u32]) -> Self {
        let four = |told: &[u32]| {
            let things: Vec<&Thing> = told.iter().map(|&k| &things[k as usize]).collect();
            // More than single precision rounds off.
            balls(&things, |radius| radius + 1e-5, f32::NEG_INFINITY)
        };
        Self(told.chunks(4).map(four).collect())
    }

    /// Tells `told` which of them may stand between places within `around` m of `from` and the lamp, `towards` the middle of which it
    /// is and which reaches to angles with the sine `sine` from that.
    #[inline(always)]
    pub(super) fn between(
        &self,
        (from, around): (Vector3<f32>, f32),
        (towards, sine): (Four3, f32),
        mut told: impl FnMut(usize),
    ) {
        let from = Four3::of(from);
        let around = f32x4::splat(around);
        for (first, (centres, radii)) in self.0.iter().enumerate() {
            let to = *centres - from;
            let (along, far2) = (to.dot(towards), to.dot(to));
            // From a place beside `from` a ball is seen as one is from there that is so much greater, and so much farther off.
            let reach = *radii + around + f32x4::splat(sine) * (far2.sqrt() + around);
            let off2 = far2 * f32x4::splat(1.0 - 1e-6) - along * along;
            let is_near = along.simd_ge(-reach) & off2.simd_le(reach * reach);
            let mut met = is_near.to_bitmask();
            while met != 0 {
                told(4 * first + met.trailing_zeros() as usize);
                met &= met - 1;
            }
        }
    }
}

/// A placed solid or vessel as rays of single precision meet it.
pub(super) struct Plain {
    form: Form,
    hole: Option<Hole>,
    /// Whether light goes through.
    is_clear: bool,
    /// Local from world.
    turn: Matrix3<f32>,
    origin: Vector3<f32>,
    /// The eye in its frame.
    eye: Vector3<f32>,
    /// Directions to places of the lamp and to its middle, in its frame.
    lamp: Vec<Vector3<f32>>,
    middle: Vector3<f32>,
}

/// The hollow of a vessel.
struct Hole {
    form: Form,
    /// Height of the rim.
    rim: f32,
    /// The water's surface, as in [`super::scene::Hollow`].
    level: Option<(Vector3<f32>, f32)>,
}

/// How a surface lies where four rays meet it.
pub(super) struct Lie {
    /// Outward, unit, world.
    pub(super) normal: Four3,
    /// As in [`super::scene::Hit`], and so the next two.
    pub(super) faces: [u8; 4],
    pub(super) depth: f32x4,
    /// Which of them are under water, one bit each.
    pub(super) wet: u32,
}

/// Nearer to each other along a ray are the outside and the hollow of a vessel only at its mouth, m: no wall is so thin.
const MOUTH: f32 = 2e-6;

impl Plain {
    /// Returns a thing as it is met four rays at a time; `None` when it is of another kind, or the eye is in it.
    pub(super) fn new(thing: &Thing, eye: Vector3<f64>, lighting: &Lighting) -> Option<Self> {
        let (form, hole) = match &thing.kind {
            Kind::Solid(solid) => (Form::of(solid)?, None),
            Kind::Vessel(hollow) if !thing.holds(eye) => {
                let level = hollow.level.map(|(up, height)| (up.cast(), height as f32));
                let form = Form::of(&hollow.cavity)?;
                (Form::of(&hollow.outer)?, Some(Hole { form, rim: hollow.rim as f32, level }))
            }
            Kind::Vessel(_) | Kind::Triangle { .. } | Kind::Mesh(_) => return None,
        };
        let (eye, _) = thing.inward(eye, Vector3::z());
        let (turn, origin) = thing.placed();
        let lamp = lighting.samples().iter().map(|to| (turn * to).cast()).collect();
        let middle = (turn * lighting.towards()).cast();
        let (turn, origin, eye) = (turn.cast(), origin.cast(), eye.cast());
        Some(Self {
            form,
            hole,
            is_clear: thing.paint.transparent,
            turn,
            origin,
            eye,
            lamp,
            middle,
        })
    }

    /// Returns whether light goes through it.
    pub(super) fn is_clear(&self) -> bool {
        self.is_clear
    }

    /// Returns which rays from the eye along `d` (unit, world) come within `width` m of it.
    #[inline(always)]
    pub(super) fn is_about(&self, d: Four3, width: f32x4) -> f32x4 {
        let span = self.form.span_about(Four3::of(self.eye), d.turned(&self.turn), width);
        span.leave.simd_gt(f32x4::splat(0.0))
    }

    /// Returns where rays from the eye along `d` (unit, world) enter its hull; infinite where they do not.
    #[inline(always)]
    pub(super) fn entered(&self, d: Four3) -> f32x4 {
        self.form.span(Four3::of(self.eye), d.turned(&self.turn)).enter
    }

    /// Returns where rays from the eye along `d` (unit, world) meet it first, taking it as opaque; infinite where they do not.
    #[inline(always)]
    pub(super) fn seen(&self, d: Four3) -> f32x4 {
        let (o, d) = (Four3::of(self.eye), d.turned(&self.turn));
        let outer = self.form.span(o, d);
        let Some(hole) = &self.hole else { return outer.enter };
        if !outer.enter.simd_lt(f32x4::splat(f32::INFINITY)).any() {
            return outer.enter;
        }
        let inner = hole.form.span(o, d);
        let by_mouth = (inner.enter - outer.enter).simd_lt(f32x4::splat(MOUTH));
        by_mouth.bitselect(inner.leave, outer.enter)
    }

    /// Returns places of the world in its frame.
    #[inline(always)]
    fn placed(&self, o: Four3) -> Four3 {
        (o - Four3::of(self.origin)).turned(&self.turn)
    }

    /// Returns whether it may stand between the places `o` and a part of the lamp, which is seen from them under half an angle of which
    /// `spread` is the sine.
    #[inline(always)]
    pub(super) fn may_shade(&self, o: Four3, spread: f32, reach: f32) -> bool {
        let (o, d) = (self.placed(o), Four3::of(self.middle));
        let far2 = o.dot(o).to_array();
        let far = far2[0].max(far2[1]).max(far2[2].max(far2[3])).sqrt() + reach;
        let span = self.form.grown(spread * far).span(o, d);
        span.leave.simd_gt(f32x4::splat(0.0)).any()
    }

    /// Takes from `left` what it lets through no more than `through` of, for each of the directions to the lamp.
    #[inline(always)]
    pub(super) fn darken(&self, from: Four3, through: f32, left: &mut [f32x4]) {
        let from = self.placed(from);
        for (left, to) in left.iter_mut().zip(&self.lamp) {
            let dark = self.is_between(from, Four3::of(*to));
            *left = left.fast_min(dark.bitselect(f32x4::splat(through), f32x4::splat(1.0)));
        }
    }

    /// Returns which rays from `o` along `d` (unit), in its frame, it stands in the way of.
    #[inline(always)]
    fn is_between(&self, o: Four3, d: Four3) -> f32x4 {
        let outer = self.form.span(o, d);
        let least = f32x4::splat(1e-6);
        let is_ahead = outer.leave.simd_gt(least);
        let Some(hole) = &self.hole else { return is_ahead };
        if !is_ahead.any() {
            return is_ahead;
        }
        let inner = hole.form.span(o, d);
        // From between the walls, or in by the mouth: what is not left by the mouth again is blocked.
        let by_mouth = (inner.enter - outer.enter).simd_lt(f32x4::splat(MOUTH));
        let is_open = inner.leave.simd_gt(least) & (inner.enter.simd_le(least) | by_mouth);
        let is_out = (outer.leave - inner.leave).simd_lt(f32x4::splat(MOUTH));
        is_ahead & !(is_open & is_out)
    }

    /// Returns which of the places `o` in the hollow of a vessel see out by its mouth along `d` (unit, world).
    #[inline(always)]
    pub(super) fn sees_out(&self, o: Four3, d: Four3) -> f32x4 {
        let Some(hole) = &self.hole else { return f32x4::splat(0.0) };
        let (o, d) = ((o - Four3::of(self.origin)).turned(&self.turn), d.turned(&self.turn));
        let leave = hole.form.span(o, d).leave;
        (o.z + leave * d.z).simd_gt(f32x4::splat(hole.rim - 1e-5))
    }

    /// Returns how the surface lies where rays from the eye meet it at `t`.
    #[inline(always)]
    pub(super) fn surface(&self, d: Four3, t: f32x4) -> Lie {
        let (o, d) = (Four3::of(self.eye), d.turned(&self.turn));
        let at = o + d * t;
        let (mut normal, mut faces) = self.form.surface(at);
        let (mut depth, mut wet) = (f32x4::splat(0.0), 0);
        if let Some(hole) = &self.hole {
            let is_in = (t - self.form.span(o, d).enter).simd_gt(f32x4::splat(MOUTH / 2.0));
            if is_in.any() {
                let (inward, inner) = hole.form.surface(at);
                normal = Four3 {
                    x: is_in.bitselect(-inward.x, normal.x),
                    y: is_in.bitselect(-inward.y, normal.y),
                    z: is_in.bitselect(-inward.z, normal.z),
                };
                faces = is_in.bitselect(inner + f32x4::splat(8.0), faces);
                let zero = f32x4::splat(0.0);
                let above = at.z.fast_max(zero) * f32x4::splat(1.0 / hole.rim);
                depth = is_in & (f32x4::splat(1.0) - above);
                if let Some((up, height)) = hole.level {
                    let is_under = at.dot(Four3::of(up)).simd_lt(f32x4::splat(height));
                    wet = (is_in & is_under).to_bitmask();
                }
            }
        }
        let faces = faces.fast_trunc_int().to_array();
        let faces = [faces[0] as u8, faces[1] as u8, faces[2] as u8, faces[3] as u8];
        Lie { normal: normal.turned_back(&self.turn), faces, depth, wet }
    }
}
