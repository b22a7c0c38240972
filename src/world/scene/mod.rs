//! A scene: what a laboratory knows before it looks. Dimensions and rough guesses, no positions.
//!
//! [`Scene`] is constant once built. It is read from a `scene` item of the task language by
//! [`Scene::from_item`]; the camera pose in it is a guess that alignment corrects.

mod read;
mod thing;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::frame::{Base, Pose, World};
use super::object::Object;
use crate::language::ast::SceneItem;
use crate::language::{Diagnostic, Source};

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
    /// The camera as it is thought to be: name and guess.
    pub camera_name: String,
    /// The camera as it is thought to be.
    pub camera: Camera,
    /// The robot's folder in `stdlib/robots/`.
    pub robot: String,
    /// Where the robot is mounted.
    pub world_from_base: Pose<World, Base>,
}

impl Scene {
    /// Reads a scene item: units, sizes and sanity are checked here, names and syntax before.
    ///
    /// What a thing does not say has a default: `wall 3 mm` for a `Container`; `holds` what fits to the
    /// brim; `filled` nothing; `mass` from its volume; the colour its looks name, else grey. `looks`
    /// with "transparent", "clear" or "glass" in it makes it transparent. The position of a thing other
    /// than the table is not kept: the camera finds it.
    ///
    /// # Errors
    ///
    /// Everything that is wrong, at once, each at its place in `source`.
    pub fn from_item(item: &SceneItem, source: &Source) -> Result<Self, Vec<Diagnostic>> {
        let mut reader = read::Reader { source, diagnostics: Vec::new() };
        let scene = reader.scene(item);
        match scene {
            Some(scene) if reader.diagnostics.is_empty() => Ok(scene),
            _ => Err(reader.diagnostics),
        }
    }

    /// Returns the object of that name.
    pub fn object(&self, name: &str) -> Option<&Object> {
        self.objects.iter().find(|object| object.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::Library;
    use crate::world::Material;

    fn read(text: &str) -> Result<Scene, Vec<String>> {
        let mut library = Library::new();
        library.add(Source::new("test.task", text));
        let (item, source) = library.scenes().next().expect("the text holds a scene");
        Scene::from_item(item, source)
            .map_err(|found| found.into_iter().map(|d| d.message).collect())
    }

    #[test]
    fn the_kitchen_is_what_its_file_says() {
        let scene = read(include_str!("../../../stdlib/scenes/kitchen.task")).unwrap();
        assert_eq!((scene.name.as_str(), scene.robot.as_str()), ("kitchen", "gen3_2f85"));
        let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["jar", "cup"]);
        let jar = scene.object("jar").unwrap();
        assert_eq!(jar.material, Material::Transparent);
        let cavity = jar.cavity.unwrap();
        assert!((cavity.capacity - 250e-6).abs() < 1e-12 && (cavity.filled - 150e-6).abs() < 1e-12);
        assert!((jar.mass - 0.16).abs() < 1e-12 && (jar.shape.height() - 0.14).abs() < 1e-12);
        let cup = scene.object("cup").unwrap();
        assert_eq!((cup.material, cup.colour), (Material::Opaque, [0x20, 0x50, 0xc0]));
        // Not given, so to the brim: π (77 mm)² · 92 mm.
        let brim = std::f64::consts::PI * 0.077 * 0.077 * 0.092;
        assert!((cup.cavity.unwrap().capacity - brim).abs() < 1e-9);
        assert_eq!(scene.marks.len(), 13);
        assert!((scene.marks[0].y + 0.36).abs() < 1e-12, "signs are read");
        assert!((scene.table.centre[0] - 0.5).abs() < 1e-12);
        let eye = scene.camera.world_from_camera.origin();
        assert!((eye - Vector3::new(1.25, 0.0, 0.85)).norm() < 1e-12);
        assert!((scene.camera.intrinsics.fx - 900.0).abs() < 1e-9);
    }

    #[test]
    fn everything_wrong_with_a_scene_is_told_at_once() {
        let found = read(
            "scene s {\n table: Surface = box(120 cm, 80 cm, 2 cm)\n\
             jar: Container = cuboid(65, 65 mm, 140 mm) { filled 3 g hods 2 mL }\n\
             cup: Container = cylindr(radius 8 cm, height 9 cm)\n\
             mug: Container = cylinder(radius 4 cm, height 9 cm) { holds 2 L filled 1 mL }\n\
             pot: Container = cylinder(radius 4 cm) { colour \"bluish\" }\n\
             marks dots(radius 12 mm) { (2 m, 0 m) }\n\
             camera c { image 640 x 480 focal 600 px at (1 m, 0 m, -1 m) looking (0 m, 0 m, 0 m) } }",
        )
        .unwrap_err();
        let expected = [
            "a side of `jar` is a length, and this is a plain number",
            "`filled` is a volume, and this is a mass",
            "a thing has no `hods`",
            "there is no shape `cylindr`",
            "`mug` cannot hold 2 L: inside it measures 374 mL",
            "a cylinder takes radius, height",
            "this is not a colour",
            "this mark does not lie on the table",
            "the camera `c` cannot see the table from there",
            "the scene `s` has no robot",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_bare_scene_says_what_it_lacks() {
        let found = read("scene s { }").unwrap_err();
        let expected =
            ["table", "camera", "robot"].map(|what| format!("the scene `s` has no {what}"));
        assert_eq!(found, expected);
    }
}
