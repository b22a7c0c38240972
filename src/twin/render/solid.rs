//! Where a straight line enters and leaves a convex solid, in the solid's own frame.
//!
//! Closed forms only: what is drawn has no facets, so an outline is exact to rounding however large it
//! appears. Placing solids in the world and colouring them is [`super::scene`]'s and [`super::trace`]'s
//! work.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::world::Profile;

/// A convex solid about its own z axis, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Solid {
    /// A box given by its centre and half its edges.
    Cuboid {
        /// Centre.
        centre: Vector3<f64>,
        /// Half the edges.
        half: Vector3<f64>,
    },
    /// A cylinder about z between two heights.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Height of the lower end.
        bottom: f64,
        /// Height of the upper end.
        top: f64,
    },
    /// A convex round thing about z: radii over heights from `bottom` up.
    Lathe {
        /// The radii.
        profile: Arc<Profile>,
        /// Height of the lower end.
        bottom: f64,
    },
    /// All points within a radius of a stretch of the z axis; a sphere when the stretch is 0.
    Capsule {
        /// Radius.
        radius: f64,
        /// Lower end of the stretch.
        bottom: f64,
        /// Upper end of the stretch.
        top: f64,
    },
    /// An ellipsoid about the origin.
    Ellipsoid {
        /// Half axes.
        half: Vector3<f64>,
    },
}

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

impl Solid {
    /// Returns the stretch of the line `origin + t direction` inside the solid, if any.
    #[inline]
    pub(super) fn span(&self, origin: Vector3<f64>, direction: Vector3<f64>) -> Option<Span> {
        match *self {
            Self::Cuboid { centre, half } => cuboid(origin - centre, direction, half),
            Self::Cylinder { radius, bottom, top } => {
                cylinder(origin, direction, radius, bottom, top)
            }
            Self::Capsule { radius, bottom, top } => {
                capsule(origin, direction, radius, bottom, top)
            }
            Self::Lathe { ref profile, bottom } => {
                lathe(origin - Vector3::z() * bottom, direction, profile)
            }
            Self::Ellipsoid { half } => {
                let span = ball(origin.component_div(&half), direction.component_div(&half), 1.0)?;
                Some(span)
            }
        }
    }

    /// Returns where a line that goes through the solid leaves it, and by which face: as [`Self::span`], for which it is not asked
    /// where it enters.
    #[inline]
    pub(super) fn leave(&self, o: Vector3<f64>, d: Vector3<f64>) -> Option<(f64, u8)> {
        let mut least = (f64::INFINITY, 0);
        let mut end = |t: f64, face: u8| {
            if t < least.0 {
                least = (t, face);
            }
        };
        let beside = |d: f64, low: f64, high: f64| if d > 0.0 { high } else { low };
        match *self {
            Self::Cuboid { centre, half } => {
                let o = o - centre;
                for (axis, face) in [(0, 0_u8), (1, 2), (2, 4)] {
                    if d[axis].abs() >= 1e-12 {
                        let side = beside(d[axis], -half[axis], half[axis]);
                        end((side - o[axis]) / d[axis], face + u8::from(d[axis] > 0.0));
                    }
                }
            }
            Self::Cylinder { radius, bottom, top } => {
                let a = d.x * d.x + d.y * d.y;
                if a >= 1e-18 {
                    let middle = -(o.x * d.x + o.y * d.y) / a;
                    let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
                    let left = radius * radius - x * x - y * y;
                    if left <= 0.0 {
                        return None;
                    }
                    end(middle + (left / a).sqrt(), SIDE);
                }
                if d.z.abs() >= 1e-12 {
                    let face = if d.z > 0.0 { TOP } else { BOTTOM };
                    end((beside(d.z, bottom, top) - o.z) / d.z, face);
                }
            }
            Self::Lathe { .. } | Self::Capsule { .. } | Self::Ellipsoid { .. } => {
                let span = self.span(o, d)?;
                return Some((span.leave, span.leave_face));
            }
        }
        Some(least)
    }

    /// Returns the outward unit normal at a point of the surface.
    #[inline]
    pub(super) fn normal(&self, face: u8, at: Vector3<f64>) -> Vector3<f64> {
        match *self {
            Self::Cuboid { .. } => {
                let mut n = Vector3::zeros();
                n[usize::from(face / 2)] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
                n
            }
            Self::Cylinder { .. } => match face {
                BOTTOM => -Vector3::z(),
                TOP => Vector3::z(),
                _ => Vector3::new(at.x, at.y, 0.0).normalize(),
            },
            Self::Lathe { ref profile, bottom } => match face {
                BOTTOM => -Vector3::z(),
                TOP => Vector3::z(),
                _ => {
                    let slope = profile.slope_at(at.z - bottom);
                    let level = Vector3::new(at.x, at.y, 0.0).try_normalize(0.0);
                    (level.unwrap_or_default() - Vector3::z() * slope).normalize()
                }
            },
            Self::Capsule { bottom, top, .. } => {
                (at - Vector3::z() * at.z.clamp(bottom, top)).normalize()
            }
            Self::Ellipsoid { half } => at
                .component_div(&half)
                .component_div(&half)
                .try_normalize(0.0)
                .unwrap_or(Vector3::z()),
        }
    }

    /// Returns a solid that holds every point within `d` m of this one.
    pub(super) fn grown(&self, d: f64) -> Self {
        match *self {
            Self::Cuboid { centre, half } => Self::Cuboid { centre, half: half.add_scalar(d) },
            Self::Cylinder { radius, bottom, top } => {
                Self::Cylinder { radius: radius + d, bottom: bottom - d, top: top + d }
            }
            Self::Capsule { radius, bottom, top } => {
                Self::Capsule { radius: radius + d, bottom, top }
            }
            Self::Lathe { ref profile, bottom } => Self::Cylinder {
                radius: profile.widest() + d,
                bottom: bottom - d,
                top: bottom + profile.height() + d,
            },
            // What lies near an ellipsoid is no ellipsoid; a ball is simple and drops are small.
            Self::Ellipsoid { half } => {
                Self::Capsule { radius: half.max() + d, bottom: 0.0, top: 0.0 }
            }
        }
    }

    /// Returns the corners of a box that holds the solid: least and greatest coordinates.
    pub(super) fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        match *self {
            Self::Cuboid { centre, half } => (centre - half, centre + half),
            Self::Cylinder { radius, bottom, top } => {
                (Vector3::new(-radius, -radius, bottom), Vector3::new(radius, radius, top))
            }
            Self::Capsule { radius, bottom, top } => (
                Vector3::new(-radius, -radius, bottom - radius),
                Vector3::new(radius, radius, top + radius),
            ),
            Self::Lathe { ref profile, bottom } => {
                let (r, top) = (profile.widest(), bottom + profile.height());
                (Vector3::new(-r, -r, bottom), Vector3::new(r, r, top))
            }
            Self::Ellipsoid { half } => (-half, half),
        }
    }

    /// Returns how far down it reaches, against `up` (unit): the least height of a point of it, m.
    pub(super) fn lowest(&self, up: Vector3<f64>) -> f64 {
        match *self {
            Self::Cylinder { radius, bottom, top } => {
                (bottom * up.z).min(top * up.z) - radius * up.x.hypot(up.y)
            }
            Self::Capsule { radius, bottom, top } => (bottom * up.z).min(top * up.z) - radius,
            Self::Cuboid { .. } | Self::Lathe { .. } | Self::Ellipsoid { .. } => {
                let (low, high) = self.bounds();
                low.component_mul(&up).inf(&high.component_mul(&up)).sum()
            }
        }
    }

    /// Returns whether a point lies inside.
    #[inline]
    pub(super) fn holds(&self, p: Vector3<f64>) -> bool {
        match *self {
            Self::Cuboid { centre, half } => {
                let d = p - centre;
                d.x.abs() <= half.x && d.y.abs() <= half.y && d.z.abs() <= half.z
            }
            Self::Cylinder { radius, bottom, top } => {
                p.x * p.x + p.y * p.y <= radius * radius && p.z >= bottom && p.z <= top
            }
            Self::Capsule { radius, bottom, top } => {
                (p - Vector3::z() * p.z.clamp(bottom, top)).norm_squared() <= radius * radius
            }
            Self::Lathe { ref profile, bottom } => {
                let z = p.z - bottom;
                z >= 0.0 && z <= profile.height() && p.x.hypot(p.y) <= profile.radius_at(z)
            }
            Self::Ellipsoid { half } => p.component_div(&half).norm_squared() <= 1.0,
        }
    }
}

/// The slab method of Kay and Kajiya (SIGGRAPH 1986).
#[inline]
fn cuboid(o: Vector3<f64>, d: Vector3<f64>, half: Vector3<f64>) -> Option<Span> {
    let mut span =
        Span { enter: f64::NEG_INFINITY, enter_face: 0, leave: f64::INFINITY, leave_face: 0 };
    for (axis, face) in [(0, 0_u8), (1, 2), (2, 4)] {
        if d[axis].abs() < 1e-12 {
            if o[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / d[axis];
        let (low, high) = ((-half[axis] - o[axis]) * inverse, (half[axis] - o[axis]) * inverse);
        let (near, far, near_face, far_face) =
            if inverse > 0.0 { (low, high, face, face + 1) } else { (high, low, face + 1, face) };
        if near > span.enter {
            (span.enter, span.enter_face) = (near, near_face);
        }
        if far < span.leave {
            (span.leave, span.leave_face) = (far, far_face);
        }
        if span.enter >= span.leave {
            return None;
        }
    }
    Some(span)
}

/// The roots of |o + t d|² = r².
#[inline]
fn ball(o: Vector3<f64>, d: Vector3<f64>, radius: f64) -> Option<Span> {
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

#[inline]
fn cylinder(o: Vector3<f64>, d: Vector3<f64>, radius: f64, bottom: f64, top: f64) -> Option<Span> {
    let a = d.x * d.x + d.y * d.y;
    let mut span = if a < 1e-18 {
        if o.x * o.x + o.y * o.y > radius * radius {
            return None;
        }
        Span { enter: f64::NEG_INFINITY, enter_face: 0, leave: f64::INFINITY, leave_face: 0 }
    } else {
        let middle = -(o.x * d.x + o.y * d.y) / a;
        let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
        let left = radius * radius - x * x - y * y;
        if left <= 0.0 {
            return None;
        }
        let reach = (left / a).sqrt();
        Span { enter: middle - reach, enter_face: SIDE, leave: middle + reach, leave_face: SIDE }
    };
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
fn lathe(o: Vector3<f64>, d: Vector3<f64>, profile: &Profile) -> Option<Span> {
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
fn capsule(o: Vector3<f64>, d: Vector3<f64>, radius: f64, bottom: f64, top: f64) -> Option<Span> {
    let at = |z: f64| ball(o - Vector3::z() * z, d, radius);
    if top - bottom < 1e-12 {
        return at(bottom);
    }
    let a = d.x * d.x + d.y * d.y;
    let (enter, leave) = if a < 1e-12 * d.z * d.z {
        // Along the axis: in through the ball it comes to first, out through the other.
        (f64::NEG_INFINITY, f64::INFINITY)
    } else {
        let middle = -(o.x * d.x + o.y * d.y) / a;
        let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
        let left = radius * radius - x * x - y * y;
        if left <= 0.0 {
            return None;
        }
        let reach = (left / a).sqrt();
        (middle - reach, middle + reach)
    };
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

#[cfg(test)]
mod tests {
    use super::*;

    fn solids() -> Vec<Solid> {
        let lathe =
            |profile: Result<Profile, crate::world::profile::Fault>| Arc::new(profile.unwrap());
        vec![
            Solid::Cuboid {
                centre: Vector3::new(0.1, 0.0, 0.2),
                half: Vector3::new(0.3, 0.2, 0.4),
            },
            Solid::Cylinder { radius: 0.3, bottom: -0.2, top: 0.5 },
            Solid::Capsule { radius: 0.2, bottom: -0.1, top: 0.4 },
            Solid::Capsule { radius: 0.25, bottom: 0.0, top: 0.0 },
            Solid::Ellipsoid { half: Vector3::new(0.3, 0.2, 0.1) },
            Solid::Lathe { profile: lathe(Profile::cone(0.2, 0.35, 0.5)), bottom: -0.2 },
            Solid::Lathe { profile: lathe(Profile::cone(0.4, 0.0, 0.4)), bottom: -0.1 },
            Solid::Lathe { profile: lathe(Profile::ball(0.3)), bottom: -0.3 },
            Solid::Lathe {
                profile: lathe(Profile::new(&[[0.1, 0.0], [0.3, 0.2], [0.32, 0.5]])),
                bottom: -0.1,
            },
        ]
    }

    #[test]
    fn a_grown_solid_holds_all_that_is_near() {
        for solid in solids() {
            let grown = solid.grown(0.05);
            for i in 0..2000 {
                let a = f64::from(i) * 0.618;
                let p = Vector3::new((1.7 * a).sin(), (2.3 * a).cos(), (3.1 * a).sin()) * 0.6;
                let off = Vector3::new((5.1 * a).sin(), (4.3 * a).cos(), (6.7 * a).sin());
                if solid.holds(p) {
                    assert!(grown.holds(p + off.normalize() * 0.0499), "{solid:?}");
                }
            }
        }
    }

    #[test]
    fn nothing_of_a_solid_is_below_its_lowest_place() {
        for solid in solids() {
            for i in 0..200 {
                let a = f64::from(i) * 0.618;
                let up =
                    Vector3::new((1.7 * a).sin(), (2.3 * a).cos(), (3.1 * a).sin()).normalize();
                let lowest = solid.lowest(up);
                for k in 0..200 {
                    let b = f64::from(k) * 0.618;
                    let p = Vector3::new((5.1 * b).sin(), (4.3 * b).cos(), (6.7 * b).sin()) * 0.6;
                    assert!(!solid.holds(p) || p.dot(&up) > lowest - 1e-12, "{solid:?} {p}");
                }
            }
        }
    }

    /// Walks along many lines: inside and outside must change exactly where the span says.
    #[test]
    fn a_span_ends_where_inside_turns_to_outside() {
        for solid in solids() {
            for i in 0..200 {
                let a = f64::from(i) * 0.618;
                let o = Vector3::new(2.0 * a.sin(), 2.0 * a.cos(), (0.37 * a).sin());
                let to = Vector3::new((1.7 * a).sin(), (2.3 * a).cos(), (3.1 * a).sin()) * 0.3;
                let d = (to - o) * 0.7;
                let Some(span) = solid.span(o, d) else {
                    for k in 0..400 {
                        assert!(!solid.holds(o + d * (f64::from(k) * 0.01)), "{solid:?}");
                    }
                    continue;
                };
                let (leave, face) = solid.leave(o, d).unwrap();
                assert!((leave - span.leave).abs() < 1e-12 && face == span.leave_face);
                for (t, face) in [(span.enter, span.enter_face), (span.leave, span.leave_face)] {
                    let n = solid.normal(face, o + d * t);
                    assert!((n.norm() - 1.0).abs() < 1e-9);
                    assert!(solid.holds(o + d * t - n * 1e-6), "{solid:?} {face}");
                    assert!(!solid.holds(o + d * t + n * 1e-6), "{solid:?} {face}");
                }
                assert!(solid.normal(span.enter_face, o + d * span.enter).dot(&d) <= 1e-9);
                assert!(solid.normal(span.leave_face, o + d * span.leave).dot(&d) >= -1e-9);
            }
        }
    }
}
