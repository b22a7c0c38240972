//! The solids that links and obstacles are made of. Where a solid stands is said beside it.
//!
//! Every solid is centred on its own origin; capsules and cylinders lie along z. Distances between
//! solids are in `distance.rs`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::cover;
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

    /// Returns the solids that together are, or hold, an object's outside and where they stand in the object's own frame,
    /// whose origin is the centre of the base: larger by `by` m on every side and at its top. A mesh has one for each of its
    /// convex parts, a mug one more for its handle.
    pub fn of_object(shape: &Shape, by: f64) -> Vec<Placed> {
        let half = f64::midpoint(shape.height(), by);
        let solid = match shape {
            Shape::Cuboid { size } => {
                Self::Cuboid { half: Vector3::new(size.x / 2.0 + by, size.y / 2.0 + by, half) }
            }
            // The cylinder around what a lathe makes: nothing of the thing is outside.
            Shape::Cylinder { .. } | Shape::Lathe { .. } => {
                Self::Cylinder { radius: shape.outer_radius() + by, half }
            }
            Shape::Mug { mug } => {
                let (middle, half) = mug.around_handle();
                let handle = Self::Cuboid { half: half.add_scalar(by) };
                let pose = Isometry3::from(Translation3::from(middle));
                let mut solids = Self::of_object(&shape.body(), by);
                solids.push(Placed { solid: handle, pose });
                return solids;
            }
            Shape::Mesh { mesh } => {
                let around = mesh.parts().iter().filter_map(|part| cover::around(part));
                return around.map(|placed| placed.grown(by)).collect();
            }
        };
        vec![Placed { solid, pose: Isometry3::translation(0.0, 0.0, half) }]
    }

    /// Returns the solid larger by `by` m on every side.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        match *self {
            Self::Sphere { radius } => Self::Sphere { radius: radius + by },
            Self::Capsule { radius, half } => Self::Capsule { radius: radius + by, half },
            Self::Cylinder { radius, half } => {
                Self::Cylinder { radius: radius + by, half: half + by }
            }
            Self::Cuboid { half } => Self::Cuboid { half: half.add_scalar(by) },
        }
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
    /// Returns it larger by `by` m on every side, where it is.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        Self { solid: self.solid.grown(by), pose: self.pose }
    }

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
