//! Solids in the form that distances are computed in, in some frame, and what surrounds them.
//!
//! How far two are apart is [`super::distance`].

use nalgebra::Vector3;

use super::frames::Frame;
use super::solid::{Placed, Solid};

/// A solid in the form distances are computed in, in some frame.
#[derive(Debug, Clone, Copy)]
pub(super) enum Body {
    /// All points within `radius` of the segment from `a` to `b`.
    Round { a: Vector3<f64>, b: Vector3<f64>, radius: f64 },
    /// A box about the origin of its own frame.
    Cuboid { frame: Frame, half: Vector3<f64> },
    /// A cylinder along z of its own frame.
    Cylinder { frame: Frame, radius: f64, half: f64 },
}

impl Body {
    pub(super) fn new(placed: &Placed) -> Self {
        let frame = Frame::of(&placed.pose);
        let end = |half: f64| frame.origin + frame.z * half;
        match placed.solid {
            Solid::Sphere { radius } => {
                let centre = frame.origin;
                Self::Round { a: centre, b: centre, radius }
            }
            Solid::Capsule { radius, half } => Self::Round { a: end(-half), b: end(half), radius },
            Solid::Cylinder { radius, half } => Self::Cylinder { frame, radius, half },
            Solid::Cuboid { half } => Self::Cuboid { frame, half },
        }
    }

    /// Returns the body carried into another frame.
    #[inline]
    pub(super) fn moved(&self, to: &Frame) -> Self {
        match *self {
            Self::Round { a, b, radius } => {
                Self::Round { a: to.point(&a), b: to.point(&b), radius }
            }
            Self::Cuboid { frame, half } => Self::Cuboid { frame: to.then(&frame), half },
            Self::Cylinder { frame, radius, half } => {
                Self::Cylinder { frame: to.then(&frame), radius, half }
            }
        }
    }

    /// Returns a ball that contains the body: centre and radius, m.
    #[inline]
    pub(super) fn bounds(&self) -> (Vector3<f64>, f64) {
        match *self {
            Self::Round { a, b, radius } => ((a + b) / 2.0, (b - a).norm() / 2.0 + radius),
            Self::Cuboid { frame, half } => (frame.origin, half.norm()),
            Self::Cylinder { frame, radius, half } => (frame.origin, radius.hypot(half)),
        }
    }

    /// Returns the lower and the upper corner of the box along the axes around the body, m.
    #[inline]
    pub(super) fn corners(&self) -> [Vector3<f64>; 2] {
        let (middle, half) = match *self {
            Self::Round { a, b, radius } => {
                ((a + b) / 2.0, ((b - a) / 2.0).abs().add_scalar(radius))
            }
            Self::Cuboid { frame, half } => {
                let reach = frame.x.abs() * half.x + frame.y.abs() * half.y;
                (frame.origin, reach + frame.z.abs() * half.z)
            }
            Self::Cylinder { frame, radius, half } => {
                let across = frame.z.map(|z| (1.0 - z * z).max(0.0).sqrt());
                (frame.origin, frame.z.abs() * half + across * radius)
            }
        };
        [middle - half, middle + half]
    }

    /// Returns a number no larger than the distance to anything inside a ball; quick.
    #[inline]
    pub(super) fn distance_to_ball(&self, centre: &Vector3<f64>, radius: f64) -> f64 {
        // A large box, as a table is, has a useless bounding ball.
        if let Self::Cuboid { frame, half } = self {
            let p = frame.local(&(centre - frame.origin));
            return (p.abs() - half).map(|x| x.max(0.0)).norm() - radius;
        }
        let (own, size) = self.bounds();
        (own - centre).norm() - size - radius
    }

    /// Returns by how much the body is rounded, m.
    #[inline]
    pub(super) fn rounding(&self) -> f64 {
        if let Self::Round { radius, .. } = self { *radius } else { 0.0 }
    }

    /// Returns what is rounded.
    #[inline]
    pub(super) fn core(&self) -> Self {
        match *self {
            Self::Round { a, b, .. } => Self::Round { a, b, radius: 0.0 },
            other => other,
        }
    }
}
