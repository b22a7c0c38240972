//! Shapes of things: the kinds there are, and what is asked of all of them.
//!
//! Every shape stands in its own frame: the origin is the centre of its base, z up. What depends on the kind is asked here
//! (sizes, what is inside, what a shape covers seen from above, whether it is round or has faces); pictures, contacts and
//! grasps of a kind are made in the layers above. Lengths in m.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::Profile;
use super::mesh::Mesh;
use super::mug::{self, Mug, Sizes};

/// The two solids of the paper (section 2.2), cuboids and upright cylinders, what a lathe makes, and any closed surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A box with edges along x, y and z, m.
    Cuboid {
        /// Edge lengths, m.
        size: Vector3<f64>,
    },
    /// A cylinder about z, m.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Height, m.
        height: f64,
    },
    /// A round thing about z whose radius changes with the height: a cup that opens upwards, a bowl, a bottle, a ball.
    Lathe {
        /// Radii over heights, m.
        profile: Profile,
    },
    /// What a file of triangles encloses. It holds nothing.
    Mesh {
        /// Its surface, m.
        #[serde(with = "shared")]
        mesh: Arc<Mesh>,
    },
    /// A cylinder with a handle at +x.
    Mug {
        /// Its sizes, m.
        #[serde(with = "shared")]
        mug: Arc<Mug>,
    },
}

impl Shape {
    /// Returns the height, m.
    pub fn height(&self) -> f64 {
        match self {
            Self::Cuboid { size } => size.z,
            Self::Cylinder { height, .. } => *height,
            Self::Lathe { profile } => profile.height(),
            Self::Mesh { mesh } => mesh.size().z,
            Self::Mug { mug } => mug.sizes().height,
        }
    }

    /// Returns the volume, m³.
    pub fn volume(&self) -> f64 {
        match self {
            Self::Cuboid { size } => size.x * size.y * size.z,
            Self::Cylinder { radius, height } => PI * radius * radius * height,
            Self::Lathe { profile } => profile.volume(),
            Self::Mesh { mesh } => mesh.volume(),
            Self::Mug { mug } => mug::body_volume(mug.sizes()) + mug::handle_volume(mug),
        }
    }

    /// Returns what of it holds: of a mug the cylinder without its handle, of others the whole.
    #[must_use]
    pub fn body(&self) -> Self {
        match self {
            Self::Mug { mug } => {
                let Sizes { radius, height, .. } = *mug.sizes();
                Self::Cylinder { radius, height }
            }
            whole => whole.clone(),
        }
    }

    /// Returns the sides along x and y, m, of what has sides: of a mesh those of the box around it; `None` of what is round.
    pub fn faces(&self) -> Option<[f64; 2]> {
        match self {
            Self::Cuboid { size } => Some([size.x, size.y]),
            Self::Cylinder { .. } | Self::Lathe { .. } | Self::Mug { .. } => None,
            Self::Mesh { mesh } => Some([mesh.size().x, mesh.size().y]),
        }
    }

    /// Returns whether the shape is below a point `x`, `y` of its own frame, m.
    pub fn is_below(&self, x: f64, y: f64) -> bool {
        self.inset(x, y) >= 0.0
    }

    /// Returns how far inside the edge of its top a point `x`, `y` of its own frame is, seen from above, m; negative outside.
    pub fn inset(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Cuboid { size } => (0.5 * size.x - x.abs()).min(0.5 * size.y - y.abs()),
            Self::Cylinder { radius, .. } => radius - x.hypot(y),
            Self::Lathe { profile } => profile.top() - x.hypot(y),
            Self::Mesh { mesh } => mesh.inset(x, y),
            Self::Mug { mug } => mug.sizes().radius - x.hypot(y),
        }
    }

    /// Returns how far a point `x`, `y` of its own frame is from its side, seen from above, m; 0 where it is below it.
    pub fn beside(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Cuboid { size } => {
                (x.abs() - 0.5 * size.x).max(0.0).hypot((y.abs() - 0.5 * size.y).max(0.0))
            }
            Self::Cylinder { radius, .. } => (x.hypot(y) - radius).max(0.0),
            Self::Lathe { profile } => (x.hypot(y) - profile.widest()).max(0.0),
            Self::Mesh { mesh } => mesh.beside(x, y),
            Self::Mug { mug } => {
                (x.hypot(y) - mug.sizes().radius).max(0.0).min(mug.beside_handle(x, y))
            }
        }
    }

    /// Returns the convex polygon that it covers seen from above, in order; a circle by `around` corners.
    pub fn footprint(&self, around: usize) -> Vec<Vector2<f64>> {
        match self {
            Self::Cuboid { size } => [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
                .map(|(x, y)| Vector2::new(x * size.x, y * size.y))
                .to_vec(),
            Self::Cylinder { .. } | Self::Lathe { .. } => {
                let corner = |i: usize| {
                    let (sin, cos) = (TAU * i as f64 / around as f64).sin_cos();
                    self.outer_radius() * Vector2::new(cos, sin)
                };
                (0..around).map(corner).collect()
            }
            Self::Mesh { mesh } => mesh.footprint(),
            Self::Mug { mug } => mug.outside().footprint(),
        }
    }

    /// Returns the radius of the upright cylinder about its axis that just contains the shape, m.
    pub fn outer_radius(&self) -> f64 {
        match self {
            Self::Cuboid { size } => 0.5 * size.x.hypot(size.y),
            Self::Cylinder { radius, .. } => *radius,
            Self::Lathe { profile } => profile.widest(),
            Self::Mesh { mesh } => mesh.outer_radius(),
            Self::Mug { mug } => mug.outside().outer_radius(),
        }
    }

    /// Returns the radius of the largest upright cylinder inside the shape, m; of a mesh inside the box around it.
    pub fn inner_radius(&self) -> f64 {
        match self {
            Self::Cuboid { size } => 0.5 * size.x.min(size.y),
            Self::Cylinder { radius, .. } => *radius,
            Self::Lathe { profile } => profile.narrowest(),
            Self::Mesh { mesh } => 0.5 * mesh.size().x.min(mesh.size().y),
            Self::Mug { mug } => mug.sizes().radius,
        }
    }

    /// Returns the radius of the largest circle inside its upper end, m.
    pub fn rim_radius(&self) -> f64 {
        match self {
            Self::Lathe { profile } => profile.top(),
            _ => self.inner_radius(),
        }
    }

    /// Returns the width, m, that is nearest to an opening of the fingers among those at which they may hold the shape.
    pub fn between(&self, opening: f64) -> f64 {
        match self {
            Self::Cuboid { size } => {
                let off = |side: f64| (opening - side).abs();
                if off(size.x) < off(size.y) { size.x } else { size.y }
            }
            Self::Cylinder { .. } | Self::Mug { .. } => 2.0 * self.inner_radius(),
            Self::Lathe { profile } => {
                opening.clamp(2.0 * profile.narrowest(), 2.0 * profile.widest())
            }
            // Anywhere from its thinnest place on.
            Self::Mesh { mesh } => {
                let most = 2.0 * mesh.outer_radius();
                opening.clamp(mesh.least_between().unwrap_or(most).min(most), most)
            }
        }
    }

    /// Returns the smallest width that a gripper would close on, m; of a mesh that no fingers hold, the smaller side of the
    /// box around it.
    pub fn width(&self) -> f64 {
        match self {
            Self::Mesh { mesh } => mesh.least_between().unwrap_or(2.0 * self.inner_radius()),
            _ => 2.0 * self.inner_radius(),
        }
    }

    /// Returns the radius of the circle that it stands on, m; `None` of what has sides.
    pub fn foot_radius(&self) -> Option<f64> {
        match self {
            Self::Cylinder { radius, .. } => Some(*radius),
            Self::Lathe { profile } => Some(profile.foot()),
            Self::Mug { mug } => Some(mug.sizes().radius),
            Self::Cuboid { .. } | Self::Mesh { .. } => None,
        }
    }

    /// Returns the space that walls and a floor of `wall` m leave inside, from the inside floor to the rim; `None` where
    /// there is none, as in a mesh.
    pub fn inside(&self, wall: f64) -> Option<Self> {
        match self {
            Self::Cuboid { size } => Some(Self::Cuboid {
                size: Vector3::new(size.x - 2.0 * wall, size.y - 2.0 * wall, size.z - wall),
            }),
            Self::Cylinder { radius, height } => {
                Some(Self::Cylinder { radius: radius - wall, height: height - wall })
            }
            Self::Lathe { profile } => Some(Self::Lathe { profile: profile.inside(wall)? }),
            Self::Mug { .. } => self.body().inside(wall),
            Self::Mesh { .. } => None,
        }
    }

    /// Returns the shape with its sides longer by `by` m along its own axes; what is round grows evenly.
    #[must_use]
    pub fn stretched(&self, by: &Vector3<f64>) -> Self {
        // Seen from above it is round: what is wider one way is wider every way.
        let wider = if by.x.abs() > by.y.abs() { by.x } else { by.y };
        match self {
            Self::Cuboid { size } => Self::Cuboid { size: size + by },
            Self::Cylinder { radius, height } => {
                Self::Cylinder { radius: radius + 0.5 * wider, height: height + by.z }
            }
            Self::Lathe { profile } => Self::Lathe { profile: profile.grown(0.5 * wider, by.z) },
            Self::Mesh { mesh } => {
                let wide = 1.0 + wider / mesh.size().xy().max();
                self.scaled(wide, 1.0 + by.z / mesh.size().z)
            }
            Self::Mug { mug } => {
                let Sizes { radius, height, .. } = *mug.sizes();
                self.scaled(1.0 + 0.5 * wider / radius, 1.0 + by.z / height)
            }
        }
    }

    /// Returns the shape larger by factors: across, and in height.
    #[must_use]
    pub fn scaled(&self, wide: f64, high: f64) -> Self {
        match self {
            Self::Cuboid { size } => {
                Self::Cuboid { size: size.component_mul(&Vector3::new(wide, wide, high)) }
            }
            Self::Cylinder { radius, height } => {
                Self::Cylinder { radius: wide * radius, height: high * height }
            }
            Self::Lathe { profile } => Self::Lathe { profile: profile.scaled(wide, high) },
            Self::Mesh { mesh } => match mesh.scaled(wide, high) {
                Some(scaled) => Self::Mesh { mesh: Arc::new(scaled) },
                None => self.clone(),
            },
            Self::Mug { mug } => {
                let Sizes { radius, height, handle, thick } = *mug.sizes();
                let (radius, height) = (wide * radius, high * height);
                Mug::new(Sizes { radius, height, handle: wide * handle, thick })
                    .map_or_else(|_| self.clone(), |mug| Self::Mug { mug: Arc::new(mug) })
            }
        }
    }

    /// Returns points all over the side of the shape, from base to rim, m in the object's frame.
    pub fn outline(&self, around: usize) -> Vec<Vector3<f64>> {
        let turn = TAU / around as f64;
        let ring: Vec<(f64, f64)> = match self {
            Self::Cuboid { size } => {
                let (x, y) = (0.5 * size.x, 0.5 * size.y);
                vec![(x, y), (0.0, y), (-x, y), (-x, 0.0), (-x, -y), (0.0, -y), (x, -y), (x, 0.0)]
            }
            Self::Cylinder { radius, .. } => (0..around)
                .map(|i| (radius * (i as f64 * turn).cos(), radius * (i as f64 * turn).sin()))
                .collect(),
            Self::Lathe { .. } => {
                (0..around).map(|i| ((i as f64 * turn).cos(), (i as f64 * turn).sin())).collect()
            }
            Self::Mesh { mesh } => return mesh.spread(),
            Self::Mug { mug } => return mug.outside().spread(),
        };
        let levels = (0..=10).map(|k| self.height() * f64::from(k) / 10.0);
        let wide = |z: f64| match self {
            Self::Lathe { profile } => profile.radius_at(z),
            _ => 1.0,
        };
        levels
            .flat_map(|z| ring.iter().map(move |&(x, y)| Vector3::new(wide(z) * x, wide(z) * y, z)))
            .collect()
    }

    /// Returns how far the shape reaches in a direction of its own frame, m: the largest of its points' shares of it.
    pub fn reach(&self, way: &Vector3<f64>) -> f64 {
        let across = way.x.hypot(way.y);
        let end = (self.height() * way.z).max(0.0);
        match self {
            Self::Cuboid { size } => 0.5 * (size.x * way.x.abs() + size.y * way.y.abs()) + end,
            Self::Cylinder { radius, .. } => radius * across + end,
            Self::Lathe { profile } => {
                let reaches = profile.points().iter().map(|[r, z]| r * across + z * way.z);
                reaches.fold(f64::NEG_INFINITY, f64::max)
            }
            Self::Mug { mug } => {
                let wall = mug.sizes().radius * across + end;
                let corners = mug.outside().hull().iter().map(|p| p.dot(way));
                corners.fold(wall, f64::max)
            }
            Self::Mesh { mesh } => {
                mesh.hull().iter().map(|p| p.dot(way)).fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }

    /// Returns the angle, rad, by which the shape may be turned about z without looking different;
    /// 0 when any turn looks the same.
    pub fn symmetry(&self) -> f64 {
        match self {
            Self::Cuboid { size } if (size.x - size.y).abs() < 1e-6 => FRAC_PI_2,
            Self::Cuboid { .. } => PI,
            Self::Cylinder { .. } | Self::Lathe { .. } => 0.0,
            Self::Mesh { mesh } => mesh.symmetry(),
            Self::Mug { mug } => mug.outside().symmetry(),
        }
    }
}

/// What is shared, in files.
mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<T: Serialize, S: Serializer>(
        shared: &Arc<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        shared.as_ref().serialize(serializer)
    }

    pub(super) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}
