//! Things whose shapes are files, and mugs, as scenes say them: what is read, and what is told of what cannot be.

use std::fs;

use nalgebra::Vector3;
use trueup::language::{Library, Source};
use trueup::scene::{from_item, write};
use trueup::world::{Scene, Shape};

use crate::program::Scratch;

const REST: &str = "table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)\n\
    camera c { image 640 x 480 focal ~ 600 px at (1 m, 0 m, 1 m) looking (0.5 m, 0 m, 0 m) }\n\
    robot gen3_2f85 at (0 m, 0 m, 0 m) }";

/// Reads a scene that lies in a folder; of what is wrong the code, the message and what would help.
fn read(folder: &Scratch, things: &str) -> Result<Scene, Vec<[String; 3]>> {
    let name = folder.path("s.task").display().to_string();
    let mut library = Library::new();
    library.add(Source::new(name, format!("scene s {{ {things}\n{REST}")));
    let (item, source) = library.scenes().next().expect("the text holds a scene");
    from_item(item, source).map_err(|found| {
        let told = found.into_iter();
        told.map(|d| [d.code.to_owned(), d.message, d.help.unwrap_or_default()]).collect()
    })
}

fn tables(name: &str) -> Scratch {
    let folder = Scratch::new(name);
    for file in ["bracket.stl", "house.obj"] {
        let from = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables").join(file);
        fs::copy(from, folder.path(file)).unwrap();
    }
    folder
}

#[test]
fn a_mesh_is_read_beside_its_scene_in_its_unit_and_written_again() {
    let folder = tables("shapes-read");
    let things = "bracket: Graspable = mesh \"bracket.stl\" { unit 1 mm mass 180 g }\n\
        house: Graspable = mesh \"house.obj\"";
    let scene = read(&folder, things).unwrap();
    let bracket = &scene.object("bracket").unwrap().shape;
    let Shape::Mesh { mesh } = bracket else { panic!("{bracket:?}") };
    assert!((mesh.size() - Vector3::new(0.08, 0.044, 0.074)).norm() < 1e-8, "{mesh:?}");
    assert!((bracket.height() - 0.074).abs() < 1e-8 && bracket.faces().is_some());
    let house = scene.object("house").unwrap();
    // Walls and a gable roof, of wood when nothing is said.
    let volume = 0.052 * 0.07 * 0.04 + 0.5 * 0.052 * 0.07 * 0.032;
    assert!((house.mass - 700.0 * volume).abs() < 1e-9, "{}", house.mass);
    let text = write::to_text(&scene, "Again.", &[]);
    assert!(text.contains("bracket: Graspable = mesh \"bracket.stl\" { unit 1 mm"), "{text}");
    let kept = serde_json::to_string(&scene).unwrap();
    let again: Scene = serde_json::from_str(&kept).unwrap();
    assert_eq!(again.objects, scene.objects);
}

#[test]
fn what_is_no_mesh_is_told_with_what_would_help() {
    let folder = tables("shapes-wrong");
    let file = |name: &str, text: &str| folder.file(name, text);
    file("hole.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
    file("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    file("empty.stl", "solid a\nendsolid a\n");
    for (shape, code, message, help) in [
        ("mesh \"none.stl\"", "scene::mesh", "is not there", "looked for in"),
        ("mesh \"house.dae\"", "scene::mesh", "only STL and OBJ", ".stl"),
        ("mesh \"empty.stl\"", "scene::mesh", "no triangle", "export"),
        ("mesh \"nan.obj\"", "scene::mesh", "damaged", "not finite"),
        ("mesh \"hole.obj\" { unit 5 cm }", "scene::mesh", "not closed: 3 of its 6", "holes"),
        ("mesh \"bracket.stl\"", "scene::mesh", "80.000 m", "`unit 1 mm`"),
        ("mesh \"house.obj\" { unit 1 mm }", "scene::mesh", "0.0720 mm", "`unit 1 m`"),
        ("mesh \"house.obj\" { wall 2 mm }", "task::type", "no liquid", "mug"),
        ("cuboid(1 cm, 1 cm, 1 cm) { unit 1 mm }", "task::argument", "no mesh", "remove"),
        ("mug(radius 4 cm, height 9 cm)", "task::argument", "a mug takes", "handle"),
        (
            "mug(radius 4 cm, height 9 cm, handle 2 cm, thick 2 cm)",
            "task::size",
            "no room for a finger",
            "thick",
        ),
    ] {
        let found = read(&folder, &format!("a: Graspable = {shape}")).unwrap_err();
        let [of, said, helps] = &found[0];
        assert_eq!((of.as_str(), found.len()), (code, 1), "{shape}: {found:?}");
        assert!(said.contains(message) && helps.contains(help), "{shape}: {found:?}");
    }
}

#[test]
fn a_mug_is_a_vessel_whose_handle_holds_nothing() {
    let folder = tables("shapes-mug");
    let things = "mug: Container = mug(diameter 76 mm, height 95 mm, handle 30 mm, thick 10 mm) { wall 4 mm }";
    let scene = read(&folder, things).unwrap();
    let mug = scene.object("mug").unwrap();
    let inside = std::f64::consts::PI * 0.034 * 0.034 * 0.091;
    assert!((mug.cavity.unwrap().capacity - inside).abs() < 1e-12);
    assert!((mug.shape.rim_radius() - 0.038).abs() < 1e-12 && mug.shape.faces().is_none());
    assert!((mug.shape.outer_radius() - 0.068).abs() < 2e-4);
    assert!(mug.shape.symmetry() > 6.0, "its handle tells its turn");
    let text = write::to_text(&scene, "Again.", &[]);
    let said = "mug(radius 38 mm, height 95 mm, handle 30 mm, thick 10 mm)";
    assert!(text.contains(said), "{text}");
}
