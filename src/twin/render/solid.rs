//! Convex solids in their own frames: what is in them, how their surface lies, how far they reach. Where lines enter and leave them
//! is [`super::span`]'s; placing solids in the world and colouring them is [`super::scene`]'s and [`super::trace`]'s work.

#![expect(clippy::inline_always, reason = "the work is built again for each kind of processor")]

use std::sync::Arc;

use nalgebra::Vector3;

use super::span::{BOTTOM, SIDE, Span, TOP, ball, capsule, cuboid, cylinder, lathe};
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

impl Solid {
    /// Returns the stretch of the line `origin + t direction` inside the solid, if any.
    #[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
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
