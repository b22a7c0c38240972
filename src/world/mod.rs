//! What is where, at one instant: frames, the camera model, objects, scenes, and the state of them all.
//!
//! [`Scene`] is what is known beforehand and never changes; [`WorldState`] is what changes. There are
//! always two states: what the twin says and what was measured.

pub mod camera;
pub mod camera_file;
pub mod colour;
pub mod drawer;
mod fisheye;
pub mod frame;
pub mod mesh;
mod mover;
pub mod mug;
pub mod object;
pub mod profile;
pub mod region;
pub mod scene;
pub mod shape;
pub mod support;
pub mod window;

use serde::{Deserialize, Serialize};

pub use camera::{Camera, Intrinsics, LensModel, Pixel, Ray};
pub use drawer::Drawer;
pub use frame::{Point, Pose};
pub use mesh::Mesh;
pub use mover::Mover;
pub use mug::Mug;
pub use object::{Cavity, Material, Object, WATER_DENSITY};
pub use profile::Profile;
pub use region::Region;
pub use scene::{Mark, Scene, Table};
pub use shape::Shape;
pub use support::Support;
pub use window::Window;

/// What is known of one object at one instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    /// Which object of the scene.
    pub name: String,
    /// Where it is, `None` when nobody knows.
    pub world_from_object: Option<Pose<frame::World, frame::Object>>,
    /// One standard deviation of its position, m; infinite when nobody knows, which JSON writes `null`.
    #[serde(deserialize_with = "or_infinite")]
    pub std: f64,
    /// Water inside, m³, `None` when nobody knows.
    pub water: Option<f64>,
}

/// Something on the table that no scene declares, bounded by an upright cylinder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    /// The middle of the cylinder on the table, m.
    pub at: [f64; 2],
    /// Its radius, m.
    pub radius: f64,
    /// Its height, m: nothing of the thing is higher.
    pub height: f64,
    /// What it is, if its outline told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<Form>,
}

/// The form of something that no scene declares, as it was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// A box or a can, sizes in m.
    pub shape: Shape,
    /// Where it stands.
    pub world_from_object: Pose<frame::World, frame::Object>,
    /// So far its sides may be off, m: two standard deviations of place and sizes.
    pub within: f64,
    /// Its colour, sRGB.
    pub colour: [u8; 3],
}

/// Everything that changes, at one instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorldState {
    /// Time since the run began, s.
    pub time: f64,
    /// Arm joints, base first, rad.
    pub q: Vec<f64>,
    /// Opening between the finger pads, m.
    pub opening: f64,
    /// The tool centre point.
    pub world_from_tool: Pose<frame::World, frame::Tool>,
    /// The object the fingers hold, if any, by name.
    pub held: Option<String>,
    /// Objects in the scene's order.
    pub objects: Vec<ObjectState>,
    /// Water on the table, m³, `None` when nobody knows.
    pub spilt: Option<f64>,
    /// What else was seen on the table.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unknown: Vec<Unknown>,
}

/// Reads a number, `null` as infinity.
fn or_infinite<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl WorldState {
    /// Returns the state of the object of that name.
    pub fn object(&self, name: &str) -> Option<&ObjectState> {
        self.objects.iter().find(|object| object.name == name)
    }

    /// As [`Self::object`], to change it.
    pub fn object_mut(&mut self, name: &str) -> Option<&mut ObjectState> {
        self.objects.iter_mut().find(|object| object.name == name)
    }
}
