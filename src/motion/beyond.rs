//! How far eight points are from an obstacle: whether a squared distance exceeds that of a reach, without a branch and
//! almost without a root; and whether it does all along a short way.
//!
//! Boxes, capsules and cylinders are themselves; radii are larger by far more than rounding to 24 bits makes.

#![expect(clippy::inline_always, reason = "what is not inlined into the look misses the registers")]

use nalgebra::Vector3;

use super::body::Body;
use super::frames::Frame;
use super::lanes::{Eight, Three, Wide, short};

/// What is added to radii, m for each m that coordinates reach: rounding to 24 bits makes less than a tenth of it.
pub(super) const SLACK: f64 = 5e-6;

/// What an obstacle is, besides where.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Cuboid,
    /// A box whose z is the base's: nearly all of them.
    Upright,
    /// All within the radius of the segment along z.
    Round,
    /// Along z.
    Cylinder,
}

/// An obstacle, ready to be compared with points.
#[derive(Debug, Clone)]
pub(super) struct Thing {
    kind: Kind,
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
    /// Of a capsule and a cylinder only z counts.
    half: [f32; 3],
    /// Of a cylinder.
    across: f32,
    /// What is added all around.
    radius: f32,
}

impl Thing {
    /// Returns a body that stands still.
    pub(super) fn of(body: &Body) -> Self {
        let (frame, half, across, radius) = match *body {
            Body::Cuboid { frame, half } => (frame, half, 0.0, 0.0),
            Body::Cylinder { frame, radius, half } => (frame, Vector3::z() * half, radius, 0.0),
            Body::Round { a, b, radius } => {
                let along = b - a;
                let frame = Frame { origin: (a + b) * 0.5, ..Frame::towards(&along) };
                (frame, Vector3::z() * (0.5 * along.norm()), 0.0, radius)
            }
        };
        let kind = match body {
            Body::Cuboid { .. } if frame.z == Vector3::z() => Kind::Upright,
            Body::Cuboid { .. } => Kind::Cuboid,
            Body::Cylinder { .. } => Kind::Cylinder,
            Body::Round { .. } => Kind::Round,
        };
        let slack = SLACK * (frame.origin.norm() + half.norm() + across + radius);
        Self {
            kind,
            axes: [short(&frame.x), short(&frame.y), short(&frame.z)],
            origin: short(&frame.origin),
            half: short(&half),
            across: across as f32,
            radius: (radius + slack) as f32,
        }
    }

    /// Returns by how much the squared distance of a point exceeds that of `reach`.
    #[inline(always)]
    pub(super) fn beyond<S: Wide>(&self, simd: S, point: Three<S>, reach: Eight<S>) -> Eight<S> {
        let reach = reach + Eight::all(simd, self.radius);
        let limit = reach * reach;
        let p = point - Three::all(simd, self.origin);
        let [a, b, c] = self.axes;
        let half = Three::all(simd, self.half);
        match self.kind {
            Kind::Upright => {
                let x = p.x * Eight::all(simd, a[0]) + p.y * Eight::all(simd, a[1]);
                let y = p.x * Eight::all(simd, b[0]) + p.y * Eight::all(simd, b[1]);
                let (x, y) = (over(simd, x, half.x), over(simd, y, half.y));
                let z = over(simd, p.z, half.z);
                x * x + y * y + (z * z - limit)
            }
            Kind::Cuboid => {
                let x = over(simd, p.dot(Three::all(simd, a)), half.x);
                let y = over(simd, p.dot(Three::all(simd, b)), half.y);
                let z = over(simd, p.dot(Three::all(simd, c)), half.z);
                x * x + y * y + (z * z - limit)
            }
            Kind::Round => {
                let axis = Three::all(simd, c);
                let t = p.dot(axis).min(half.z).max(Eight::all(simd, 0.0) - half.z);
                let across = p - axis.scaled(t);
                across.dot(across) - limit
            }
            Kind::Cylinder => {
                let axis = Three::all(simd, c);
                let t = p.dot(axis);
                let across = p - axis.scaled(t);
                let aside = over(simd, across.dot(across).sqrt(), Eight::all(simd, self.across));
                let above = over(simd, t, half.z);
                aside * aside + (above * above - limit)
            }
        }
    }

    /// Returns a number below zero for each point that may come nearer than `reach` on its way: up to the share `half` of it
    /// before and after, at `speed`.
    ///
    /// The distance to what is convex is a convex function along a straight way, so no lower than its tangent: only what
    /// leads towards the obstacle counts. With the vector `d` from the nearest point, `|d| - half |d·v| / |d|` must exceed
    /// the reach, of which how far the way bends is a part.
    #[inline(always)]
    pub(super) fn beyond_swept<S: Wide>(
        &self,
        simd: S,
        (point, speed): (Three<S>, Three<S>),
        reach: Eight<S>,
        half: Eight<S>,
    ) -> Eight<S> {
        let reach = reach + Eight::all(simd, self.radius);
        let p = point - Three::all(simd, self.origin);
        let axes = self.axes.map(|axis| Three::all(simd, axis));
        let size = Three::all(simd, self.half);
        let (squared, rate) = match self.kind {
            Kind::Upright | Kind::Cuboid => {
                let (x, y, z) = (p.dot(axes[0]), p.dot(axes[1]), p.dot(axes[2]));
                let d = Three {
                    x: past(simd, x, size.x),
                    y: past(simd, y, size.y),
                    z: past(simd, z, size.z),
                };
                let v =
                    Three { x: speed.dot(axes[0]), y: speed.dot(axes[1]), z: speed.dot(axes[2]) };
                (d.dot(d), d.dot(v))
            }
            Kind::Round => {
                let t = p.dot(axes[2]);
                let d = p - axes[2].scaled(t - past(simd, t, size.z));
                (d.dot(d), d.dot(speed))
            }
            Kind::Cylinder => {
                let t = p.dot(axes[2]);
                let across = p - axes[2].scaled(t);
                let from_axis = across.dot(across).sqrt().max(Eight::all(simd, f32::MIN_POSITIVE));
                let aside = over(simd, from_axis, Eight::all(simd, self.across));
                let above = past(simd, t, size.z);
                let outward = across.dot(speed) * from_axis.reciprocal();
                (aside * aside + above * above, aside * outward + above * speed.dot(axes[2]))
            }
        };
        beyond_swept(squared, rate, reach, half)
    }
}

/// Returns a number below zero where a distance may fall below `reach`: its square, half the rate of that, and for how long
/// it may shrink at this rate.
#[inline(always)]
pub(super) fn beyond_swept<S: Wide>(
    squared: Eight<S>,
    rate: Eight<S>,
    reach: Eight<S>,
    half: Eight<S>,
) -> Eight<S> {
    let simd = squared.simd();
    squared - half * rate.abs() - reach * squared.sqrt() - Eight::all(simd, WITHIN)
}

/// What is taken away so that a point within an obstacle is below zero, m²: far less than the square of any reach.
const WITHIN: f32 = 1e-12;

/// Returns how far a coordinate lies beyond the nearer end of an edge, with its sign; 0 within.
#[inline(always)]
fn past<S: Wide>(simd: S, x: Eight<S>, half: Eight<S>) -> Eight<S> {
    let none = Eight::all(simd, 0.0);
    (x - half).max(none) + (x + half).min(none)
}

/// Returns how far a coordinate lies beyond half an edge; 0 within.
#[inline(always)]
fn over<S: Wide>(simd: S, x: Eight<S>, half: Eight<S>) -> Eight<S> {
    (x.abs() - half).max(Eight::all(simd, 0.0))
}
