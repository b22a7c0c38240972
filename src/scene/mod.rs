//! A `scene` item of the task language → [`Scene`]: units, sizes and sanity, every mistake at its place.
//!
//! What a scene is, once read, is [`crate::world::scene`]'s.

mod error;
mod mesh;
mod read;
mod thing;
pub mod write;

pub use thing::SOLID_DENSITY;

use crate::language::ast::SceneItem;
use crate::language::{Diagnostic, Source};
use crate::world::Scene;

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
pub fn from_item(item: &SceneItem, source: &Source) -> Result<Scene, Vec<Diagnostic>> {
    let mut reader = read::Reader { source, diagnostics: Vec::new() };
    let scene = reader.scene(item);
    match scene {
        Some(scene) if reader.diagnostics.is_empty() => Ok(scene),
        _ => Err(reader.diagnostics),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::language::Library;
    use crate::world::Material;

    fn read(text: &str) -> Result<Scene, Vec<String>> {
        let mut library = Library::new();
        library.add(Source::new("test.task", text));
        let (item, source) = library.scenes().next().expect("the text holds a scene");
        from_item(item, source).map_err(|found| found.into_iter().map(|d| d.message).collect())
    }

    #[test]
    fn the_kitchen_is_what_its_file_says() {
        let scene = read(include_str!("../../stdlib/scenes/kitchen.task")).unwrap();
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
    fn a_camera_may_be_known_from_a_file_beside_the_scene() {
        let folder = tempfile::tempdir().unwrap();
        let lens =
            r#"{"fx_px": 905, "cx_px": 640, "cy_px": 355, "k1": -0.1, "image_px": [1280, 720]}"#;
        std::fs::write(folder.path().join("camera.json"), lens).unwrap();
        std::fs::write(folder.path().join("bare.json"), r#"{"fx_px": 9, "cx_px": 6, "cy_px": 3}"#)
            .unwrap();
        let read = |inside: &str| {
            let text = format!(
                "scene s {{ table: Surface = box(120 cm, 80 cm, 2 cm) robot gen3_2f85\n\
                 camera c {{ {inside} at (1 m, 0 m, 1 m) looking (0.5 m, 0 m, 0 m) }} }}"
            );
            let told = |wrong: &Diagnostic| (wrong.code.to_string(), wrong.message.clone());
            if let Some(wrong) = crate::language::parse(&text).1.first() {
                return Err(told(wrong));
            }
            let mut library = Library::new();
            library.add(Source::new(folder.path().join("s.task").display().to_string(), text));
            let (item, source) = library.scenes().next().expect("the text holds a scene");
            from_item(item, source).map_err(|found| told(&found[0]))
        };
        let scene = read("calibration \"camera.json\"").unwrap();
        let lens = scene.camera.intrinsics;
        assert_eq!((lens.fx, lens.cy, lens.k1, lens.width), (905.0, 355.0, -0.1, 1280));
        assert_eq!(scene.calibration.as_deref(), Some("camera.json"));
        for (inside, code, told) in [
            ("calibration \"nothing.json\"", "scene::calibration", "`nothing.json`"),
            ("calibration \"s.task\"", "scene::calibration", "`s.task`"),
            ("calibration \"bare.json\"", "scene::calibration", "how large"),
            ("calibration \"camera.json\" focal ~ 900 px", "task::argument", "`focal`"),
            ("focal ~ 900 px", "task::missing", "not complete"),
        ] {
            let (found, message) = read(inside).unwrap_err();
            assert!(found == code && message.contains(told), "{inside}: {found}: {message}");
        }
    }

    #[test]
    fn everything_wrong_with_a_scene_is_told_at_once() {
        let found = read(
            "scene s {\n table: Surface = box(120 cm, 80 cm, 2 cm)\n\
             jar: Container = cuboid(65, 65 mm, 140 mm) { filled 3 g hods 2 mL }\n\
             cup: Container = cylindr(radius 8 cm, height 9 cm)\n\
             mug: Container = cylinder(radius 4 cm, height 9 cm) { holds 2 L filled 1 mL }\n\
             pot: Container = cylinder(radius 4 cm) { colour \"bluish\" }\n\
             can: Container = cylinder(radius 4 cm, heigth 9 cm)\n\
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
            "a cylinder has no `heigth`",
            "this mark does not lie on the table",
            "the camera `c` cannot see the table from there",
            "the scene `s` has no robot",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn what_a_lathe_makes_is_read_or_refused_with_the_reason() {
        let rest = "table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)\n\
             camera c { image 640 x 480 focal ~ 600 px at (1 m, 0 m, 1 m) looking (0.5 m, 0 m, 0 m) }\n\
             robot gen3_2f85 at (0 m, 0 m, 0 m) }";
        let scene = read(&format!(
            "scene s {{ top: Graspable = cone(bottom 4 cm, top 0 cm, height 9 cm)\n\
             pot: Container = lathe(4 cm, 0 cm, 6 cm, 3 cm, 6.5 cm, 8 cm) {{ wall 3 mm }}\n\
             ball: Graspable = ball(diameter 6 cm)\n{rest}"
        ));
        let scene = scene.unwrap();
        let shape = |name: &str| scene.object(name).unwrap().shape.clone();
        assert!((shape("top").outer_radius() - 0.04).abs() < 1e-12);
        assert!((shape("pot").rim_radius() - 0.065).abs() < 1e-12);
        assert!((shape("ball").outer_radius() - 0.03).abs() < 5e-4);
        let pot = scene.object("pot").unwrap();
        let inside = pot.inside().unwrap();
        assert!((inside.rim_radius() - 0.062).abs() < 1e-12);
        assert!((pot.cavity.unwrap().capacity - inside.volume()).abs() < 1e-12);
        let found = read(&format!(
            "scene s {{ a: Graspable = lathe(4 cm, 0 cm, 6 cm)\n\
             b: Graspable = lathe(4 cm, 0 cm, 6 cm, 0 cm)\n\
             c: Container = lathe(4 cm, 0 cm, 2 cm, 6 cm, 2 cm, 9 cm) {{ wall 3 mm }}\n\
             d: Graspable = cone(bottom 4 cm, top 2 cm)\n\
             e: Container = cone(bottom 2 mm, top 4 cm, height 9 cm) {{ wall 3 mm }}\n{rest}"
        ));
        let expected = [
            "a lathe takes a radius and a height for each point, by turns",
            "heights of a profile begin at 0 and rise",
            "the vessel `c` has a neck, and liquid in a neck is not simulated",
            "a cone takes bottom, top, height",
            "the walls of `e` leave no room inside",
        ];
        assert_eq!(found.unwrap_err(), expected);
    }

    #[test]
    fn a_bare_scene_says_what_it_lacks() {
        let found = read("scene s { }").unwrap_err();
        let expected =
            ["table", "camera", "robot"].map(|what| format!("the scene `s` has no {what}"));
        assert_eq!(found, expected);
    }
}
