//! A [`Scene`] → a `scene` item of the task language, which [`super::from_item`] reads again.
//!
//! Lengths are written to a tenth of a millimetre, the camera's place as a guess that looks at the table, and its inside as
//! a guess too, unless a calibration says what it is. A robot that is turned
//! and a camera that is rolled have no words in the language; only where they stand is written.

use std::fmt::Write;

use nalgebra::Vector3;

use crate::units::Quantity;
use crate::world::mug::Sizes;
use crate::world::{Object, Pixel, Scene, Shape};

/// Returns the scene as text, with a line of documentation (`///`) above it and a comment behind some things, by name.
pub fn to_text(scene: &Scene, doc: &str, comments: &[(String, String)]) -> String {
    let mut text = format!("/// {doc}\nscene {} {{\n", scene.name);
    let mut line = |words: String| {
        let _ = writeln!(text, "    {words}");
    };
    let (size, [x, y]) = (scene.table.size, scene.table.centre);
    line(format!(
        "table: Surface = box({}, {}, {}) at ({}, {}) {{ colour {} }}",
        mm(size.x),
        mm(size.y),
        mm(size.z),
        mm(x),
        mm(y),
        colour(scene.table.colour)
    ));
    for object in &scene.objects {
        let comment = comments.iter().find(|(name, _)| *name == object.name);
        let comment = comment.map(|(_, said)| format!("  // {said}")).unwrap_or_default();
        line(thing(scene, object) + comment.as_str());
    }
    // Dots of one size stand together.
    let mut marks = scene.marks.as_slice();
    while let Some(first) = marks.first() {
        let same =
            marks.iter().take_while(|mark| (mark.radius - first.radius).abs() < 1e-9).count();
        let (group, rest) = marks.split_at(same);
        let dots = group.iter().map(|mark| format!("({}, {})", mm(mark.x), mm(mark.y)));
        line(format!("marks dots(radius {}) {{", mm(first.radius)));
        for row in dots.collect::<Vec<_>>().chunks(4) {
            line(format!("    {}", row.join(" ")));
        }
        line("}".to_owned());
        marks = rest;
    }
    let lens = &scene.camera.intrinsics;
    let middle = Pixel::new(0.5 * f64::from(lens.width), 0.5 * f64::from(lens.height));
    let eye = scene.camera.world_from_camera.origin();
    let ahead = scene.camera.world_from_camera.axis(2);
    let looking = scene.camera.on_plane(middle, 0.0).map_or(eye + ahead, |point| point.coords());
    let inside = match &scene.calibration {
        Some(file) => format!("calibration \"{file}\""),
        None => format!("image {} x {} focal ~ {:.0} px", lens.width, lens.height, lens.fx),
    };
    line(format!(
        "camera {} {{ {inside} at {} looking {} }}",
        scene.camera_name,
        place(&eye),
        place(&looking)
    ));
    line(format!("robot {} at {}", scene.robot, place(&scene.world_from_base.origin())));
    if let Some(at) = &scene.person {
        let _ = writeln!(text, "    person at {}", place(at));
    }
    text.push_str("}\n");
    text
}

fn thing(scene: &Scene, object: &Object) -> String {
    let shape = match &object.shape {
        Shape::Cuboid { size } => {
            format!("cuboid({}, {}, {})", mm(size.x), mm(size.y), mm(size.z))
        }
        Shape::Cylinder { radius, height } => {
            format!("cylinder(radius {}, height {})", mm(*radius), mm(*height))
        }
        Shape::Lathe { profile } => {
            let points = profile.points().iter().map(|[r, z]| format!("{}, {}", mm(*r), mm(*z)));
            format!("lathe({})", points.collect::<Vec<_>>().join(", "))
        }
        Shape::Mug { mug } => {
            let Sizes { radius, height, handle, thick } = *mug.sizes();
            let [radius, height, handle, thick] = [radius, height, handle, thick].map(mm);
            format!("mug(radius {radius}, height {height}, handle {handle}, thick {thick})")
        }
        Shape::Mesh { mesh } => format!("mesh \"{}\"", mesh.file()),
    };
    let mut words = format!("{}: {} = {shape} {{", object.name, object.kind);
    if let Some(cavity) = object.cavity {
        let [holds, filled] = [cavity.capacity, cavity.filled].map(|volume| volume * 1e6);
        let _ = write!(words, " wall {} holds {holds:.0} mL", mm(cavity.wall));
        if filled > 0.0 {
            let _ = write!(words, " filled {filled:.0} mL");
        }
    }
    if let Shape::Mesh { mesh } = &object.shape {
        let _ = write!(words, " unit {}", Quantity::metres(mesh.unit()));
    }
    if let Some(drawer) = scene.drawer(&object.name) {
        let (travel, bar) = (mm(drawer.travel), mm(drawer.bar));
        let _ = write!(words, " case \"{}\" travel {travel} handle {bar}", drawer.case);
    }
    let _ = write!(words, " mass {:.0} g", object.mass * 1e3);
    if !object.looks.is_empty() {
        let _ = write!(words, " looks \"{}\"", object.looks);
    }
    let _ = write!(words, " colour {} }}", colour(object.colour));
    words
}

fn place(at: &Vector3<f64>) -> String {
    format!("({}, {}, {})", mm(at.x), mm(at.y), mm(at.z))
}

/// A length in mm, without digits that say nothing.
fn mm(length: f64) -> String {
    let tenths = (length * 1e4).round();
    let tenths = if tenths == 0.0 { 0.0 } else { tenths };
    format!("{} mm", tenths / 10.0)
}

fn colour([r, g, b]: [u8; 3]) -> String {
    format!("\"#{r:02x}{g:02x}{b:02x}\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{Library, Source};

    fn read(text: &str) -> Scene {
        let mut library = Library::new();
        library.add(Source::new("test.task", text));
        let (item, source) = library.scenes().next().expect("the text holds a scene");
        super::super::from_item(item, source).unwrap()
    }

    #[test]
    fn what_is_written_is_read_again() {
        for text in [
            include_str!("../../stdlib/scenes/kitchen.task"),
            include_str!("../../tests/tables/shelf.task"),
            include_str!("../../tests/tables/two_cups.task"),
            include_str!("../../tests/tables/turned.task"),
            include_str!("../../tests/tables/tumbler.task"),
            include_str!("../../tests/tables/drawer.task"),
        ] {
            let scene = read(text);
            let again = read(&to_text(&scene, "Again.", &[]));
            assert_eq!((&again.name, &again.robot), (&scene.name, &scene.robot));
            assert_eq!((again.drawers, again.person), (scene.drawers, scene.person));
            assert_eq!((again.marks.len(), again.table), (scene.marks.len(), scene.table));
            for (again, mark) in again.marks.iter().zip(&scene.marks) {
                let off = [again.x - mark.x, again.y - mark.y, again.radius - mark.radius];
                assert!(off.iter().all(|off| off.abs() < 1e-9), "{again:?} {mark:?}");
            }
            for (again, object) in again.objects.iter().zip(&scene.objects) {
                assert!((again.mass - object.mass).abs() < 1e-3 && again.shape == object.shape);
                let capacity = |o: &Object| o.cavity.map_or(0.0, |cavity| cavity.capacity);
                assert!((capacity(again) - capacity(object)).abs() < 1e-6);
                assert_eq!((&again.looks, again.colour), (&object.looks, object.colour));
            }
            let turned = again.camera.world_from_camera.inverse() * scene.camera.world_from_camera;
            assert!(turned.origin().norm() < 1e-3 && turned.rotation().angle() < 2e-3);
        }
    }
}
