//! Objects: their shape, what they are made of, what they hold. Constant once a scene is read.
//!
//! Where an object is and what it holds *now* belongs to [`super::WorldState`]. The origin of an object
//! is the centre of its base, z up when it stands. Lengths in m, volumes in m³.

use serde::{Deserialize, Serialize};

pub use super::shape::Shape;

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
        self.shape.inside(wall)
    }
}
