//! Objects: their shape, what they are made of, what they hold. Constant once a scene is read.
//!
//! Where an object is and what it holds *now* belongs to [`super::WorldState`]. The origin of an object
//! is the centre of its base, z up when it stands. Lengths in m, volumes in m³.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::Profile;

/// Density of water, kg/m³.
pub const WATER_DENSITY: f64 = 1000.0;

/// An empty vessel with walls of 3 mm, for tests.
#[cfg(test)]
pub(crate) fn vessel(shape: Shape, capacity: f64) -> Object {
    Object {
        name: "vessel".into(),
        kind: "Container".into(),
        shape,
        cavity: Some(Cavity { wall: 0.003, capacity, filled: 0.0 }),
        looks: String::new(),
        material: Material::Opaque,
        colour: [0; 3],
        mass: 0.1,
    }
}

/// The two solids of the paper (section 2.2), cuboids and upright cylinders, and what a lathe makes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
}

impl Shape {
    /// Returns the shape that stands on the same place, larger by `by` m on every side and at its top.
    #[must_use]
    pub fn grown(&self, by: f64) -> Self {
        match *self {
            Self::Cuboid { size } => {
                Self::Cuboid { size: size + Vector3::new(2.0 * by, 2.0 * by, by) }
            }
            Self::Cylinder { radius, height } => {
                Self::Cylinder { radius: radius + by, height: height + by }
            }
            Self::Lathe { profile } => Self::Lathe { profile: profile.grown(by, by) },
        }
    }

    /// Returns the height, m.
    pub fn height(&self) -> f64 {
        match *self {
            Self::Cuboid { size } => size.z,
            Self::Cylinder { height, .. } => height,
            Self::Lathe { profile } => profile.height(),
        }
    }

    /// Returns the volume, m³.
    pub fn volume(&self) -> f64 {
        match *self {
            Self::Cuboid { size } => size.x * size.y * size.z,
            Self::Cylinder { radius, height } => std::f64::consts::PI * radius * radius * height,
            Self::Lathe { profile } => profile.volume(),
        }
    }

    /// Returns whether the shape is below a point `x`, `y` of its own frame, m.
    pub fn is_below(&self, x: f64, y: f64) -> bool {
        self.inset(x, y) >= 0.0
    }

    /// Returns how far inside the edge of its top a point `x`, `y` of its own frame is, seen from above, m; negative outside.
    pub fn inset(&self, x: f64, y: f64) -> f64 {
        match *self {
            Self::Cuboid { size } => (0.5 * size.x - x.abs()).min(0.5 * size.y - y.abs()),
            Self::Cylinder { radius, .. } => radius - x.hypot(y),
            Self::Lathe { profile } => profile.top() - x.hypot(y),
        }
    }

    /// Returns how far a point `x`, `y` of its own frame is from its side, seen from above, m; 0 where it is below it.
    pub fn beside(&self, x: f64, y: f64) -> f64 {
        match *self {
            Self::Cuboid { size } => {
                (x.abs() - 0.5 * size.x).max(0.0).hypot((y.abs() - 0.5 * size.y).max(0.0))
            }
            Self::Cylinder { radius, .. } => (x.hypot(y) - radius).max(0.0),
            Self::Lathe { profile } => (x.hypot(y) - profile.widest()).max(0.0),
        }
    }

    /// Returns the radius of the upright cylinder that just contains the shape, m.
    pub fn outer_radius(&self) -> f64 {
        match *self {
            Self::Cuboid { size } => 0.5 * size.x.hypot(size.y),
            Self::Cylinder { radius, .. } => radius,
            Self::Lathe { profile } => profile.widest(),
        }
    }

    /// Returns the radius of the largest upright cylinder inside the shape, m.
    pub fn inner_radius(&self) -> f64 {
        match *self {
            Self::Cuboid { size } => 0.5 * size.x.min(size.y),
            Self::Cylinder { radius, .. } => radius,
            Self::Lathe { profile } => profile.narrowest(),
        }
    }

    /// Returns the radius of the largest circle inside its upper end, m.
    pub fn rim_radius(&self) -> f64 {
        match *self {
            Self::Lathe { profile } => profile.top(),
            _ => self.inner_radius(),
        }
    }

    /// Returns points all over the side of the shape, from base to rim, m in the object's frame.
    pub fn outline(&self, around: usize) -> Vec<Vector3<f64>> {
        let turn = std::f64::consts::TAU / around as f64;
        let ring: Vec<(f64, f64)> = match *self {
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
        };
        let levels = (0..=10).map(|k| self.height() * f64::from(k) / 10.0);
        let wide = |z: f64| match *self {
            Self::Lathe { profile } => profile.radius_at(z),
            _ => 1.0,
        };
        levels
            .flat_map(|z| ring.iter().map(move |&(x, y)| Vector3::new(wide(z) * x, wide(z) * y, z)))
            .collect()
    }

    /// Returns the angle, rad, by which the shape may be turned about z without looking different;
    /// 0 when any turn looks the same.
    pub fn symmetry(&self) -> f64 {
        use std::f64::consts::{FRAC_PI_2, PI};
        match *self {
            Self::Cuboid { size } if (size.x - size.y).abs() < 1e-6 => FRAC_PI_2,
            Self::Cuboid { .. } => PI,
            Self::Cylinder { .. } | Self::Lathe { .. } => 0.0,
        }
    }
}

/// What light does to an object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Its colour is seen.
    Opaque,
    /// What is behind it is seen: glass or clear plastic.
    Transparent,
}

/// An open-topped vessel's inside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cavity {
    /// Thickness of walls and floor, m.
    pub wall: f64,
    /// Volume to the brim, m³.
    pub capacity: f64,
    /// Volume of water at the start, as the scene file says, m³.
    pub filled: f64,
}

/// One thing on the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Its name in programs: `jar`.
    pub name: String,
    /// Its type in programs: `Container`.
    pub kind: String,
    /// Its outside.
    pub shape: Shape,
    /// Its inside, when it is a vessel.
    pub cavity: Option<Cavity>,
    /// How people call it: "transparent jar".
    pub looks: String,
    /// What it is made of, to the eye.
    pub material: Material,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
    /// Its mass when empty, kg.
    pub mass: f64,
}

impl Object {
    /// Returns the shape of the space inside the walls, from the inside floor to the rim, if a vessel.
    pub fn inside(&self) -> Option<Shape> {
        let wall = self.cavity?.wall;
        Some(match self.shape {
            Shape::Cuboid { size } => Shape::Cuboid {
                size: Vector3::new(size.x - 2.0 * wall, size.y - 2.0 * wall, size.z - wall),
            },
            Shape::Cylinder { radius, height } => {
                Shape::Cylinder { radius: radius - wall, height: height - wall }
            }
            Shape::Lathe { profile } => Shape::Lathe { profile: profile.inside(wall)? },
        })
    }
}
