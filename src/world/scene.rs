//! A scene: what a laboratory knows before it looks. Dimensions and rough guesses, no positions.
//!
//! [`Scene`] is constant once built; [`crate::scene`] reads one from a text. The camera pose in it is a guess that
//! alignment corrects.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::drawer::Drawer;
use super::frame::{Base, Point, Pose, World};
use super::object::Object;

/// Where something is handed over when a scene says nothing, in the base's frame, m: at 0.62 m a level hand reaches every
/// height up to 0.275 m (tried within the Gen3's limits), and what is held by its middle is above what stands on the table.
const HANDING: Vector3<f64> = Vector3::new(0.62, 0.0, 0.25);

/// A printed dot on the table, a reference point of regression 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Its centre on the table top, m.
    pub x: f64,
    /// Its centre on the table top, m.
    pub y: f64,
    /// Its radius, m.
    pub radius: f64,
}

/// The table: a slab whose top is the plane z = 0 of the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Extent along x, y and z, m.
    pub size: Vector3<f64>,
    /// Centre of the top, m.
    pub centre: [f64; 2],
    /// Colour, sRGB.
    pub colour: [u8; 3],
}

impl Table {
    /// Returns the corners of the top, counter-clockwise from (-x, -y), m.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let (hx, hy) = (self.size.x / 2.0, self.size.y / 2.0);
        let [cx, cy] = self.centre;
        [[cx - hx, cy - hy], [cx + hx, cy - hy], [cx + hx, cy + hy], [cx - hx, cy + hy]]
    }

    /// Returns whether a point of the plane lies on the table, at least `margin` m from its edge.
    #[inline]
    pub fn holds(&self, x: f64, y: f64, margin: f64) -> bool {
        (x - self.centre[0]).abs() <= self.size.x / 2.0 - margin
            && (y - self.centre[1]).abs() <= self.size.y / 2.0 - margin
    }
}

/// What stands in the room, as far as it is known beforehand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Its name in the program.
    pub name: String,
    /// The table.
    pub table: Table,
    /// Printed dots on the table.
    pub marks: Vec<Mark>,
    /// The things that may be moved, in the order they are declared.
    pub objects: Vec<Object>,
    /// Which of them slide in others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drawers: Vec<Drawer>,
    /// The camera as it is thought to be: name and guess.
    pub camera_name: String,
    /// The camera as it is thought to be.
    pub camera: Camera,
    /// The file that says what is inside the camera, as the scene names it; without one its intrinsics are a guess.
    #[serde(default)]
    pub calibration: Option<String>,
    /// The robot's folder in `stdlib/robots/`.
    pub robot: String,
    /// Where the robot is mounted.
    pub world_from_base: Pose<World, Base>,
    /// Where a person takes what the arm holds out, m, if the scene says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<Vector3<f64>>,
}

impl Scene {
    /// Returns the object of that name.
    pub fn object(&self, name: &str) -> Option<&Object> {
        self.objects.iter().find(|object| object.name == name)
    }

    /// Returns the drawer whose tray has that name.
    pub fn drawer(&self, tray: &str) -> Option<&Drawer> {
        self.drawers.iter().find(|drawer| drawer.tray == tray)
    }

    /// Returns where something is handed over, m in the world: where the scene has the person, or before the arm.
    pub fn handing(&self) -> Vector3<f64> {
        self.person
            .unwrap_or_else(|| (self.world_from_base * Point::<Base>::from(HANDING)).coords())
    }

    /// Returns whether a thing is fixed to the table: the case of a drawer.
    pub fn is_fixed(&self, name: &str) -> bool {
        self.drawers.iter().any(|drawer| drawer.case == name)
    }
}

/// A table with these things, for tests.
#[cfg(test)]
pub(crate) fn bare(objects: Vec<Object>) -> Scene {
    use super::camera::Intrinsics;
    Scene {
        name: "bare".into(),
        table: Table { size: Vector3::new(1.2, 0.8, 0.02), centre: [0.5, 0.0], colour: [0; 3] },
        marks: Vec::new(),
        objects,
        drawers: Vec::new(),
        camera_name: "camera".into(),
        camera: Camera {
            intrinsics: Intrinsics::centred(900.0, 1280, 720),
            world_from_camera: Pose::upright(0.0, 0.0, 1.0, 0.0),
        },
        calibration: None,
        robot: String::new(),
        world_from_base: Pose::upright(0.0, 0.0, 0.0, 0.0),
        person: None,
    }
}
