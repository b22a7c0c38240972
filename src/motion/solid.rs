//! The solids that links and obstacles are made of. Where a solid stands is said beside it.
//!
//! Every solid is centred on its own origin; capsules and cylinders lie along z. Distances between
//! solids are in `distance.rs`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::world::Shape;

/// A convex solid about its own origin, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solid {
    /// A ball.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A segment along z, thickened.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half the segment's length, m, caps not counted.
        half: f64,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half the height, m.
        half: f64,
    },
    /// A box with edges along x, y and z.
    Cuboid {
        /// Half the edge lengths, m.
        half: Vector3<f64>,
    },
}

impl Solid {
    /// Returns the radius of the ball about the solid's origin that contains it, m.
    pub fn bounding_radius(&self) -> f64 {
        match *self {
            Self::Sphere { radius } => radius,
            Self::Capsule { radius, half } => radius + half,
            Self::Cylinder { radius, half } => radius.hypot(half),
            Self::Cuboid { half } => half.norm(),
        }
    }

    /// Returns the solid that is, or holds, an object's outside and where it stands in the object's own frame, whose
    /// origin is the centre of the base.
    pub fn of_object(shape: &Shape) -> Placed {
        let solid = match *shape {
            Shape::Cuboid { size } => Self::Cuboid { half: size / 2.0 },
            Shape::Cylinder { radius, height } => Self::Cylinder { radius, half: height / 2.0 },
            // The cylinder around it: nothing of the thing is outside.
            Shape::Lathe { profile } => {
                Self::Cylinder { radius: profile.widest(), half: profile.height() / 2.0 }
            }
        };
        Placed { solid, pose: Isometry3::translation(0.0, 0.0, shape.height() / 2.0) }
    }
}

/// A solid and where its origin stands in the frame of whatever it belongs to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// The solid.
    pub solid: Solid,
    /// Carries points of the solid into its owner's frame.
    pub pose: Isometry3<f64>,
}

impl Placed {
    /// Returns the capsule of radius `radius` m about the segment from `a` to `b`, m.
    pub fn capsule(a: Vector3<f64>, b: Vector3<f64>, radius: f64) -> Self {
        let along = b - a;
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
        Self {
            solid: Solid::Capsule { radius, half: along.norm() / 2.0 },
            pose: Isometry3::from_parts(Translation3::from((a + b) / 2.0), turn),
        }
    }
}

/// Merges each cylinder whose two end centres carry a sphere of the same radius into one capsule.
///
/// URDF has no capsule in its common subset, so link models write one as three solids.
pub(super) fn merge_capsules(solids: Vec<Placed>) -> Vec<Placed> {
    /// How far, m, a sphere may lie from the cylinder's end: files print about six digits.
    const NEAR: f64 = 1e-5;
    let mut rest = solids;
    let mut at = 0;
    while at < rest.len() {
        if let Solid::Cylinder { radius, half } = rest[at].solid {
            let cap = |end: f64| {
                let centre = rest[at].pose * nalgebra::Point3::new(0.0, 0.0, end);
                rest.iter().position(|other| {
                    matches!(other.solid, Solid::Sphere { radius: r } if (r - radius).abs() < NEAR)
                        && (other.pose.translation.vector - centre.coords).norm() < NEAR
                })
            };
            if let (Some(low), Some(high)) = (cap(-half), cap(half)) {
                // The spheres' centres are what the model states; the cylinder's angles are derived.
                let (a, b) =
                    (rest[low].pose.translation.vector, rest[high].pose.translation.vector);
                rest[at] = Placed::capsule(a, b, radius);
                let mut index = 0;
                rest.retain(|_| {
                    index += 1;
                    index - 1 != low && index - 1 != high
                });
                at = at.saturating_sub(usize::from(low < at) + usize::from(high < at));
            }
        }
        at += 1;
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cylinder_with_two_caps_becomes_a_capsule_and_others_stay() {
        let at = |z: f64| Isometry3::translation(0.0, 0.0, z);
        let merged = merge_capsules(vec![
            Placed { solid: Solid::Sphere { radius: 0.1 }, pose: at(0.2) },
            Placed { solid: Solid::Cylinder { radius: 0.1, half: 0.2 }, pose: at(0.0) },
            Placed { solid: Solid::Sphere { radius: 0.1 }, pose: at(-0.2) },
            Placed { solid: Solid::Sphere { radius: 0.1 }, pose: at(0.5) },
        ]);
        assert_eq!(merged.len(), 2);
        assert_eq!(merged[0].solid, Solid::Capsule { radius: 0.1, half: 0.2 });
        assert_eq!(merged[1].solid, Solid::Sphere { radius: 0.1 });
    }
}
