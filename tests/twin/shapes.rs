//! Meshes and mugs in the twin: they stay where they stand, fall and come to rest, and turn about their own middle.

use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector3;
use trueup::world::mesh::{Mesh, read};
use trueup::world::mug::{Mug, Sizes};
use trueup::world::{Object, Shape};

use super::{HOME, at, solid, state, twin, vessel};

fn file(name: &str, unit: f64) -> Shape {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables").join(name);
    let bytes = std::fs::read(path).unwrap();
    let triangles = read::triangles(name, &bytes, &Vector3::repeat(1.0)).unwrap();
    Shape::Mesh { mesh: Arc::new(Mesh::new(name, &triangles, unit).unwrap()) }
}

fn things() -> [Object; 3] {
    let sizes = Sizes { radius: 0.038, height: 0.095, handle: 0.03, thick: 0.01 };
    let mug = Shape::Mug { mug: Arc::new(Mug::new(sizes).unwrap()) };
    [
        solid("bracket", file("bracket.stl", 1e-3), 0.18),
        solid("house", file("house.obj", 1.0), 0.12),
        vessel("mug", mug, 0.25),
    ]
}

#[test]
fn what_stands_stays_and_what_is_let_go_above_the_table_comes_to_rest_upright() {
    for object in things() {
        for height in [0.0, 0.01] {
            let name = object.name.as_str();
            let start = at(0.5, 0.1, height);
            let mut twin = twin(vec![object.clone()], &state(&HOME, &[(name, start, 0.0)]));
            twin.run(1.0).unwrap();
            let pose = twin.state().objects[0].world_from_object.unwrap();
            let off = (pose.origin() - Vector3::new(0.5, 0.1, 0.0)).norm();
            assert!(off < 2e-3 && pose.tilt() < 0.02, "{name} from {height}: {off} {pose:?}");
        }
    }
}
