//! Glass and water: what a ray sees through them, and in them.
//!
//! Glass is not painted on: a ray is bent at every wall by Snell's law, loses the part Fresnel's equations
//! say is mirrored, and is tinted along its way (Beer and Lambert). So a jar shows what real ones show: a
//! displaced background, dark and bright edges, a highlight, and little else.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;

use super::light::Rgb;
use super::scene::{Hollow, Kind, Thing};
use super::solid::Solid;
use super::span::{Span, TOP};
use super::trace::{Stage, mix};
use crate::motion::widest;

/// Index of refraction of soda-lime glass, and of water.
const N_GLASS: f64 = 1.52;
const N_WATER: f64 = 1.333;
/// Absorption per m of slightly green glass, and of water made a little bluer than it is, so that the eye
/// finds it as it does in a real room by cues this renderer lacks.
const TINT_GLASS: [f64; 3] = [4.5, 1.6, 2.8];
const TINT_WATER: [f64; 3] = [4.0, 1.3, 0.7];
/// How many surfaces of one vessel a ray is followed through.
const MOST_SURFACES: usize = 14;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Medium {
    Air,
    Glass,
    Water,
}

impl Medium {
    fn index(self) -> f64 {
        match self {
            Self::Air => 1.0,
            Self::Glass => N_GLASS,
            Self::Water => N_WATER,
        }
    }

    #[inline(always)]
    fn pass(self, length: f64) -> Rgb {
        let tint = match self {
            Self::Air => return Vector3::repeat(1.0),
            Self::Glass => TINT_GLASS,
            Self::Water => TINT_WATER,
        };
        let most = tint[0].max(tint[1]).max(tint[2]);
        if most * length < 0.1 {
            // Of most walls four terms of the series are right to 1e-7.
            let part = |a: f64| {
                let x = a * length;
                1.0 - x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0)))
            };
            return Vector3::new(part(tint[0]), part(tint[1]), part(tint[2]));
        }
        // Single precision is quick, and far finer than the tint is known.
        let part = |a: f64| f64::from(((-a * length) as f32).exp());
        Vector3::new(part(tint[0]), part(tint[1]), part(tint[2]))
    }
}

impl Stage<'_> {
    /// Returns what is seen in the water of an opaque vessel, or `None` when the ray misses the water.
    pub(super) fn under_water(
        &self,
        thing: &Thing,
        hollow: &Hollow,
        o: Vector3<f64>,
        d: Vector3<f64>,
    ) -> Option<Rgb> {
        let (up, height) = hollow.level?;
        let (lo, ld) = thing.inward(o, d);
        let t = (height - up.dot(&lo)) / up.dot(&ld);
        let at = lo + ld * t;
        if !(t > 0.0 && up.dot(&ld) < 0.0 && hollow.cavity.holds(at)) {
            return None;
        }
        let (mirrored, bent) = split(ld, up, 1.0, N_WATER);
        let down = bent?;
        let span = hollow.cavity.span(at, down)?;
        let wall = at + down * span.leave;
        let depth = 1.0 - wall.z.max(0.0) / hollow.rim;
        let normal = -thing.outward(hollow.cavity.normal(span.leave_face, wall));
        let open = 0.9 - 0.5 * depth;
        let floor = self.lighting.surface(thing.albedo, 0.0, normal, d, 0.35, open);
        let around = self.lighting.mirrored(thing.outward(ld - up * (2.0 * up.dot(&ld))));
        Some(
            floor.component_mul(&Medium::Water.pass(span.leave)) * (1.0 - mirrored)
                + around * mirrored,
        )
    }

    /// Follows a ray through a transparent thing that it enters at `t`, and beyond.
    pub(super) fn through(
        &self,
        thing: &Thing,
        o: Vector3<f64>,
        d: Vector3<f64>,
        t: f64,
        bounce: u8,
    ) -> (Rgb, u64) {
        widest(
            #[inline(always)]
            || self.follow(thing, o, d, t, bounce),
        )
    }

    #[inline(always)]
    fn follow(
        &self,
        thing: &Thing,
        o: Vector3<f64>,
        d: Vector3<f64>,
        t: f64,
        bounce: u8,
    ) -> (Rgb, u64) {
        let (mut at, mut way) = thing.inward(o + d * (t - 1e-5), d);
        let mut medium = Medium::Air;
        let mut light = Rgb::zeros();
        let mut left = Vector3::repeat(1.0);
        let mut key = u64::from(thing.id);
        for _ in 0..MOST_SURFACES {
            let Some(step) = next_surface(&thing.kind, at, way, medium) else { break };
            left.component_mul_assign(&medium.pass(step.length));
            at += way * step.length;
            key = mix(key, u64::from(step.code));
            let facing = |n: Vector3<f64>| if n.dot(&way) > 0.0 { -n } else { n };
            let mut normal = facing(step.normal);
            if step.code < 16 {
                let soft = facing(rounded(&thing.kind, step.normal, at));
                // Seen almost along the wall the rounding would turn the surface inside out.
                if soft.dot(&normal) > 0.0 {
                    normal = soft;
                }
            }
            let (mirrored, bent) = split(way, normal, medium.index(), step.beyond.index());
            let back = way - normal * (2.0 * normal.dot(&way));
            if let Some(bent) = bent {
                // The mirrored part is not followed further: what the room looks like there will do.
                let around = self.lighting.mirrored(thing.outward(back));
                light += left.component_mul(&around) * mirrored;
                left *= 1.0 - mirrored;
                way = bent;
                medium = step.beyond;
            } else {
                way = back;
                key = mix(key, 77);
            }
            if left.max() < 0.01 {
                return (light, key);
            }
        }
        if medium != Medium::Air {
            // Caught inside by total reflection; what comes out has been mixed well.
            light += left.component_mul(&self.lighting.mirrored(Vector3::z())) * 0.4;
            return (light, mix(key, 78));
        }
        // A hair back, so that what the thing stands on is not missed where the two touch.
        let from = thing.back(at - way * 1e-4);
        let beyond = self.look(from, thing.outward(way), None, bounce + 1);
        (light + left.component_mul(&beyond.light), mix(key, beyond.key))
    }
}

/// The way to the next change of medium.
struct Step {
    length: f64,
    normal: Vector3<f64>,
    beyond: Medium,
    code: u8,
}

/// Nearer than this is the surface just crossed, m.
const NEAR: f64 = 1e-7;

/// Returns the next surface along a ray inside or near a transparent thing, in its own frame, or `None`
/// when the ray leaves it for good. Only what can be met next is asked where it is met.
#[inline(always)]
fn next_surface(kind: &Kind, o: Vector3<f64>, d: Vector3<f64>, now: Medium) -> Option<Step> {
    let hollow = match kind {
        Kind::Solid(solid) => {
            let body = solid.span(o, d)?;
            return match now {
                Medium::Air => step(solid, body.enter, body.enter_face, Medium::Water, o, d),
                _ => step(solid, body.leave, body.leave_face, Medium::Air, o, d),
            };
        }
        Kind::Vessel(hollow) => hollow,
        Kind::Triangle { .. } | Kind::Mesh(_) => return None,
    };
    if hollow.cavity.holds(o + d * NEAR) {
        return next_in_hollow(hollow, 0.0, o, d, now);
    }
    let inside = hollow.cavity.span(o, d).filter(|inside| inside.enter > NEAR);
    if now == Medium::Glass {
        let Some(inside) = inside else {
            let (leave, face) = hollow.outer.leave(o, d)?;
            return step(&hollow.outer, leave, face, Medium::Air, o, d);
        };
        let beyond = hollow.first_in(&inside, o, d);
        return step(&hollow.cavity, inside.enter, inside.enter_face, beyond, o, d)
            .map(Step::of_hollow);
    }
    let body = hollow.outer.span(o, d)?;
    if body.enter <= NEAR {
        let left = step(&hollow.outer, body.leave, body.leave_face, Medium::Air, o, d);
        return left.filter(|_| now != Medium::Air);
    }
    // In by the mouth.
    if let Some(inside) = inside
        && inside.enter <= body.enter + 1e-9
    {
        if hollow.first_in(&inside, o, d) == now {
            return next_in_hollow(hollow, inside.enter, o, d, now);
        }
        return step(&hollow.outer, body.enter, body.enter_face, Medium::Water, o, d);
    }
    step(&hollow.outer, body.enter, body.enter_face, Medium::Glass, o, d)
}

/// As [`next_surface`], of a ray that is in the hollow of a vessel from `enter` on, with nothing before that.
#[inline(always)]
fn next_in_hollow(
    hollow: &Hollow,
    enter: f64,
    o: Vector3<f64>,
    d: Vector3<f64>,
    now: Medium,
) -> Option<Step> {
    let (leave, face) = hollow.cavity.leave(o, d)?;
    if let Some((t, up)) = hollow.meets_level(o, d)
        && t > enter.max(NEAR)
        && t < leave
    {
        let beyond = if up.dot(&d) < 0.0 { Medium::Water } else { Medium::Air };
        if beyond != now {
            return Some(Step { length: t, normal: up, beyond, code: 32 });
        }
    }
    let beyond = if face == TOP { Medium::Air } else { Medium::Glass };
    let next = step(&hollow.cavity, leave, face, beyond, o, d);
    next.filter(|_| beyond != now).map(Step::of_hollow)
}

/// Returns the step to a face of a solid that is met at `t`, if that is ahead.
#[inline]
fn step(
    solid: &Solid,
    t: f64,
    face: u8,
    beyond: Medium,
    o: Vector3<f64>,
    d: Vector3<f64>,
) -> Option<Step> {
    (t > NEAR && t < f64::INFINITY).then(|| {
        let normal = solid.normal(face, o + d * t);
        Step { length: t, normal, beyond, code: face }
    })
}

impl Step {
    /// Tells faces of a hollow from those of the outside.
    fn of_hollow(self) -> Self {
        Self { code: 16 + self.code, ..self }
    }
}

impl Hollow {
    /// Returns where a ray meets the water's surface, as if it had no end, and what is up there.
    #[inline]
    fn meets_level(&self, o: Vector3<f64>, d: Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let (up, height) = self.level?;
        let rise = up.dot(&d);
        (rise.abs() > 1e-9).then(|| ((height - up.dot(&o)) / rise, up))
    }

    /// Returns what a ray comes to first in the hollow.
    #[inline]
    fn first_in(&self, inside: &Span, o: Vector3<f64>, d: Vector3<f64>) -> Medium {
        let Some((up, height)) = self.level else { return Medium::Air };
        let level = self.meets_level(o, d).map_or(f64::INFINITY, |(t, _)| t);
        let next = if level > inside.enter { inside.leave.min(level) } else { inside.leave };
        let at = o + d * f64::midpoint(inside.enter, next);
        if up.dot(&at) < height { Medium::Water } else { Medium::Air }
    }
}

/// Returns the normal of a box's outside near its edges as if they were ground round, as glass edges are;
/// it is what gives them their bright and dark lines.
#[inline(always)]
fn rounded(kind: &Kind, normal: Vector3<f64>, at: Vector3<f64>) -> Vector3<f64> {
    /// Radius of a ground edge, m. Chosen: pressed jars have 1 to 3 mm.
    const ROUND: f64 = 0.002;
    let Kind::Vessel(hollow) = kind else { return normal };
    let Solid::Cuboid { centre, half } = hollow.outer else { return normal };
    let off = at - centre;
    let mut soft = normal;
    let mut is_near = false;
    for axis in 0..3 {
        let left = half[axis] - off[axis].abs();
        if normal[axis].abs() < 0.5 && left < ROUND {
            soft[axis] += off[axis].signum() * (1.0 - left.max(0.0) / ROUND);
            is_near = true;
        }
    }
    if is_near { soft.normalize() } else { normal }
}

/// Fresnel and Snell at a smooth surface: the part of unpolarised light that is mirrored, and the bent
/// direction, of length 1, unless all of it is. `normal` faces against `way`; both are of length 1.
#[inline(always)]
fn split(way: Vector3<f64>, normal: Vector3<f64>, n1: f64, n2: f64) -> (f64, Option<Vector3<f64>>) {
    let ratio = n1 / n2;
    let cos1 = -normal.dot(&way);
    let left = 1.0 - ratio * ratio * (1.0 - cos1 * cos1);
    if left <= 0.0 {
        return (1.0, None);
    }
    let cos2 = left.sqrt();
    let s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
    let p = (n1 * cos2 - n2 * cos1) / (n1 * cos2 + n2 * cos1);
    let bent = way * ratio + normal * (ratio * cos1 - cos2);
    (0.5 * (s * s + p * p), Some(bent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_mirrors_and_bends_as_the_textbook_says() {
        let down = -Vector3::z();
        let (mirrored, bent) = split(down, Vector3::z(), 1.0, 1.5);
        assert!((mirrored - 0.04).abs() < 1e-12, "((n-1)/(n+1))² at a right angle");
        assert!((bent.unwrap() - down).norm() < 1e-12);
        let slant = Vector3::new(0.6, 0.0, -0.8);
        let (_, bent) = split(slant, Vector3::z(), 1.0, 1.333);
        assert!((bent.unwrap().x - 0.6 / 1.333).abs() < 1e-12, "Snell");
        // Brewster's angle: the part mirrored is half of the s-polarised one.
        let brewster = 1.5_f64.atan();
        let way = Vector3::new(brewster.sin(), 0.0, -brewster.cos());
        let (mirrored, _) = split(way, Vector3::z(), 1.0, 1.5);
        let s = ((1.0 - 2.25) / (1.0 + 2.25_f64)).powi(2);
        assert!((mirrored - s / 2.0).abs() < 1e-12);
        let (all, none) = split(Vector3::new(0.9, 0.0, -(0.19_f64.sqrt())), Vector3::z(), 1.5, 1.0);
        assert!((all - 1.0).abs() < 1e-12 && none.is_none(), "total reflection");
    }

    #[test]
    fn a_ray_through_a_thin_window_comes_out_parallel() {
        let pane = Hollow {
            outer: Solid::Cuboid { centre: Vector3::zeros(), half: Vector3::new(0.5, 0.5, 0.5) },
            cavity: Solid::Cuboid {
                centre: Vector3::zeros(),
                half: Vector3::new(0.49, 0.49, 0.49),
            },
            rim: 0.5,
            level: None,
        };
        let kind = Kind::Vessel(pane);
        let start = Vector3::new(0.3, 0.2, -1.0).normalize();
        let (mut at, mut way) = (Vector3::new(-0.1, 0.0, 0.6), start);
        let mut medium = Medium::Air;
        let mut media = vec![medium];
        while let Some(step) = next_surface(&kind, at, way, medium) {
            at += way * step.length;
            let normal = if step.normal.dot(&way) > 0.0 { -step.normal } else { step.normal };
            way = split(way, normal, medium.index(), step.beyond.index()).1.unwrap();
            medium = step.beyond;
            media.push(medium);
            assert!(media.len() < 9);
        }
        let (air, glass) = (Medium::Air, Medium::Glass);
        assert_eq!(media, [air, glass, air, glass, air]);
        assert!((way - start).norm() < 1e-12);
    }
}
