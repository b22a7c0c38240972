//! Where a straight line enters and leaves a convex solid, in the solid's own frame.
//!
//! Closed forms only: what is drawn has no facets, so an outline is exact to rounding however large it
//! appears.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use nalgebra::Vector3;

use crate::world::Profile;

/// The part of a line inside a convex solid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// Parameter where the line enters.
    pub(super) enter: f64,
    /// Face it enters by.
    pub(super) enter_face: u8,
    /// Parameter where the line leaves.
    pub(super) leave: f64,
    /// Face it leaves by.
    pub(super) leave_face: u8,
}

/// The round side of a cylinder, or of what a lathe made.
pub(super) const SIDE: u8 = 0;
/// The lower end of a cylinder or box.
pub(super) const BOTTOM: u8 = 4;
/// The upper end of a cylinder or box.
pub(super) const TOP: u8 = 5;

/// The slab method of Kay and Kajiya (SIGGRAPH 1986), without a branch until all is known: which face is met changes from ray to ray.
#[inline(always)]
pub(super) fn cuboid(o: Vector3<f64>, d: Vector3<f64>, half: Vector3<f64>) -> Option<Span> {
    // Along a side it enters and leaves by that side very far away.
    let inverse = |d: f64| 1.0 / if d.abs() < LEAST { LEAST.copysign(d) } else { d };
    let slab = |o: f64, d: f64, half: f64| {
        let inverse = inverse(d);
        let (a, b) = ((-half - o) * inverse, (half - o) * inverse);
        if a < b { (a, b) } else { (b, a) }
    };
    let (x, y, z) = (slab(o.x, d.x, half.x), slab(o.y, d.y, half.y), slab(o.z, d.z, half.z));
    let most = |a: f64, b: f64| if a > b { a } else { b };
    let least = |a: f64, b: f64| if a < b { a } else { b };
    let (enter, leave) = (most(most(x.0, y.0), z.0), least(least(x.1, y.1), z.1));
    if enter >= leave {
        return None;
    }
    // Faces by twos along each axis, the lower one first; of an edge the first.
    let up = [u8::from(d.x > 0.0), 2 + u8::from(d.y > 0.0), 4 + u8::from(d.z > 0.0)];
    let face =
        |is_x: bool, is_y: bool| if is_x { up[0] } else { [up[2], up[1]][usize::from(is_y)] };
    let enter_face = face(x.0 >= enter, y.0 >= enter) ^ 1;
    let leave_face = face(x.1 <= leave, y.1 <= leave);
    Some(Span { enter, enter_face, leave, leave_face })
}

/// What is less along an axis stands still along it.
const LEAST: f64 = 1e-12;

/// The roots of |o + t d|² = r².
#[inline]
pub(super) fn ball(o: Vector3<f64>, d: Vector3<f64>, radius: f64) -> Option<Span> {
    let a = d.norm_squared();
    let middle = -o.dot(&d) / a;
    // The distance from the nearest point keeps its digits where `b² - 4ac` would lose them.
    let nearest = o + d * middle;
    let left = radius * radius - nearest.norm_squared();
    if left <= 0.0 {
        return None;
    }
    let reach = (left / a).sqrt();
    Some(Span { enter: middle - reach, enter_face: SIDE, leave: middle + reach, leave_face: SIDE })
}

/// Returns where a line is inside an endless cylinder about z: along the axis everywhere or nowhere.
#[inline]
fn endless(o: Vector3<f64>, d: Vector3<f64>, radius: f64) -> Option<(f64, f64)> {
    let a = d.x * d.x + d.y * d.y;
    if a < 1e-12 * d.z * d.z {
        let is_inside = o.x * o.x + o.y * o.y <= radius * radius;
        return is_inside.then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let middle = -(o.x * d.x + o.y * d.y) / a;
    let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
    let left = radius * radius - x * x - y * y;
    if left <= 0.0 {
        return None;
    }
    let reach = (left / a).sqrt();
    Some((middle - reach, middle + reach))
}

#[inline]
pub(super) fn cylinder(
    o: Vector3<f64>,
    d: Vector3<f64>,
    radius: f64,
    bottom: f64,
    top: f64,
) -> Option<Span> {
    let (enter, leave) = endless(o, d, radius)?;
    let mut span = Span { enter, enter_face: SIDE, leave, leave_face: SIDE };
    if d.z.abs() < 1e-12 {
        return (o.z >= bottom && o.z <= top).then_some(span);
    }
    let (low, high) = ((bottom - o.z) / d.z, (top - o.z) / d.z);
    let (near, far, near_face, far_face) =
        if d.z > 0.0 { (low, high, BOTTOM, TOP) } else { (high, low, TOP, BOTTOM) };
    if near > span.enter {
        (span.enter, span.enter_face) = (near, near_face);
    }
    if far < span.leave {
        (span.leave, span.leave_face) = (far, far_face);
    }
    (span.enter < span.leave).then_some(span)
}

/// What a lathe made is inside each of the cones that its stretches lie on, and between its ends.
pub(super) fn lathe(o: Vector3<f64>, d: Vector3<f64>, profile: &Profile) -> Option<Span> {
    let mut span =
        Span { enter: f64::NEG_INFINITY, enter_face: SIDE, leave: f64::INFINITY, leave_face: SIDE };
    let mut cut = |near: f64, near_face: u8, far: f64, far_face: u8| {
        if near > span.enter {
            (span.enter, span.enter_face) = (near, near_face);
        }
        if far < span.leave {
            (span.leave, span.leave_face) = (far, far_face);
        }
        span.enter < span.leave
    };
    if d.z.abs() < 1e-12 {
        if o.z < 0.0 || o.z > profile.height() {
            return None;
        }
    } else {
        let (low, high) = (-o.z / d.z, (profile.height() - o.z) / d.z);
        let is_rising = d.z > 0.0;
        let inside =
            if is_rising { cut(low, BOTTOM, high, TOP) } else { cut(high, TOP, low, BOTTOM) };
        if !inside {
            return None;
        }
    }
    for ([r0, z0], [r1, z1]) in profile.stretches() {
        let slope = (r1 - r0) / (z1 - z0);
        // x² + y² ≤ (radius + slope z)², on the side of the tip where the radius is not negative.
        let (radius, grows) = (r0 + slope * (o.z - z0), slope * d.z);
        let (near, far) = cone(o, d, radius, grows)?;
        if !cut(near, SIDE, far, SIDE) {
            return None;
        }
    }
    Some(span)
}

/// Returns where a line is inside a cone whose radius along it is `radius + t grows`.
fn cone(o: Vector3<f64>, d: Vector3<f64>, radius: f64, grows: f64) -> Option<(f64, f64)> {
    let a = d.x * d.x + d.y * d.y - grows * grows;
    let b = o.x * d.x + o.y * d.y - radius * grows;
    let c = o.x * o.x + o.y * o.y - radius * radius;
    if a.abs() < 1e-15 {
        // Along the cone's side: it is met once, or never.
        if b.abs() < 1e-15 {
            return (c <= 0.0 && radius >= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
        }
        let met = -0.5 * c / b;
        return Some(if b > 0.0 { (f64::NEG_INFINITY, met) } else { (met, f64::INFINITY) });
    }
    let left = b * b - a * c;
    if a > 0.0 {
        if left <= 0.0 {
            return None;
        }
        let (middle, reach) = (-b / a, left.sqrt() / a);
        // Both places are on one side of the tip.
        return (radius + middle * grows >= 0.0).then_some((middle - reach, middle + reach));
    }
    // Steeper than the cone: inside from the side of its tip on that opens, or up to there.
    let reach = left.max(0.0).sqrt() / -a;
    let middle = -b / a;
    Some(if grows > 0.0 {
        (middle + reach, f64::INFINITY)
    } else {
        (f64::NEG_INFINITY, middle - reach)
    })
}

/// A capsule lies in the endless cylinder around it: where the line enters and leaves that between the ends
/// of the stretch, it enters and leaves the capsule; beyond an end it does so through the ball there.
#[inline]
pub(super) fn capsule(
    o: Vector3<f64>,
    d: Vector3<f64>,
    radius: f64,
    bottom: f64,
    top: f64,
) -> Option<Span> {
    let at = |z: f64| ball(o - Vector3::z() * z, d, radius);
    if top - bottom < 1e-12 {
        return at(bottom);
    }
    // A line along the axis goes in through the ball it comes to first, and out through the other.
    let (enter, leave) = endless(o, d, radius)?;
    let end = |t: f64, pick: fn(Span) -> f64| {
        let z = o.z + t * d.z;
        if z < bottom {
            at(bottom).map(pick)
        } else if z > top {
            at(top).map(pick)
        } else {
            Some(t)
        }
    };
    let (enter, leave) = (end(enter, |span| span.enter)?, end(leave, |span| span.leave)?);
    Some(Span { enter, enter_face: SIDE, leave, leave_face: SIDE })
}
