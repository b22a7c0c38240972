//! A drawer: a tray that slides out of a fixed case along one level axis, and the bar by which it is drawn.
//!
//! Tray and case are things of the scene. The case's front is its +x side; the tray looks the same way, stands in the middle
//! of the case's height, and when closed its front is [`PROUD`] before the case's. How far it is drawn is the one number
//! that changes. What slides, with which friction, is physics' to say. Lengths in m.

use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};

use super::frame::{self, Pose, World};
use super::object::{Object, Shape};
use super::scene::Scene;
use super::support;
use super::{ObjectState, WorldState};

/// How far before the case the front of a closed tray is, m: the thickness of a front that covers the case's edge.
pub const PROUD: f64 = 0.003;
/// From the front to the axis of the bar, m. Chosen: fingertips reach 32 mm past the point between the pads of a 2F-85
/// (`gen3_2f85.urdf`), and a centimetre is left to the front.
pub const REACH: f64 = 0.045;
/// Radius of the bar, m: of a common steel bar handle (12 mm).
pub const BAR: f64 = 0.006;
/// Thickness of the two posts that carry it, m.
const POST: f64 = 0.008;
/// The bar of a handle that says nothing else, m. Chosen: pads of 22 mm between two posts, and a centimetre on each side.
pub const USUAL_BAR: f64 = 0.05;
/// The shortest: pads of 22 mm between two posts.
pub const LEAST_BAR: f64 = 0.038;
/// Room between tray and case on each side, m, at least.
pub const ROOM: f64 = 0.003;

/// A tray that slides in a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drawer {
    /// The thing that slides: an open box.
    pub tray: String,
    /// The thing it slides in, which is fixed to the table: a box.
    pub case: String,
    /// How far it can be drawn, m.
    pub travel: f64,
    /// How high the bar of its handle is, m.
    pub bar: f64,
}

impl Drawer {
    /// Returns the pose of the tray in the case's frame when it is drawn by `drawn` m.
    pub fn case_from_tray(&self, scene: &Scene, drawn: f64) -> Option<Isometry3<f64>> {
        let (Shape::Cuboid { size: tray }, Shape::Cuboid { size: case }) =
            (&scene.object(&self.tray)?.shape, &scene.object(&self.case)?.shape)
        else {
            return None;
        };
        let x = 0.5 * (case.x - tray.x) + PROUD + drawn;
        Some(Isometry3::translation(x, 0.0, 0.5 * (case.z - tray.z)))
    }

    /// Returns where the tray is in the world when it is drawn by `drawn` m.
    pub fn tray_at(
        &self,
        scene: &Scene,
        case: &Pose<World, frame::Object>,
        drawn: f64,
    ) -> Option<Pose<World, frame::Object>> {
        Some(Pose::new(case.isometry() * self.case_from_tray(scene, drawn)?))
    }

    /// Returns how far the tray is drawn, m, when it and its case are there.
    pub fn drawn(
        &self,
        scene: &Scene,
        case: &Pose<World, frame::Object>,
        tray: &Pose<World, frame::Object>,
    ) -> Option<f64> {
        let closed = self.case_from_tray(scene, 0.0)?;
        let at = case.isometry().inverse_transform_point(&tray.origin().into());
        Some(at.x - closed.translation.x)
    }

    /// Returns how far it is drawn in a state of the world, m; `None` when nobody knows.
    pub fn drawn_in(&self, scene: &Scene, state: &WorldState) -> Option<f64> {
        let pose = |name: &str| state.object(name)?.world_from_object;
        self.drawn(scene, &pose(&self.case)?, &pose(&self.tray)?)
    }

    /// Returns the bar and the two posts that carry it: the place of each one's base in the tray's frame, and its shape.
    pub fn handle(&self, tray: &Object) -> [(Vector3<f64>, Shape); 3] {
        let Shape::Cuboid { size } = tray.shape else {
            let nothing = || Shape::Cuboid { size: Vector3::repeat(1e-4) };
            return std::array::from_fn(|_| (Vector3::zeros(), nothing()));
        };
        let (front, middle) = (0.5 * size.x, 0.5 * size.z);
        let bar = Shape::Cylinder { radius: BAR, height: self.bar };
        let post = Shape::Cuboid { size: Vector3::new(REACH, POST, POST) };
        let up = 0.5 * (self.bar - POST);
        [
            (Vector3::new(front + REACH, 0.0, middle - 0.5 * self.bar), bar),
            (Vector3::new(front + 0.5 * REACH, 0.0, middle + up - 0.5 * POST), post.clone()),
            (Vector3::new(front + 0.5 * REACH, 0.0, middle - up - 0.5 * POST), post),
        ]
    }

    /// Returns the middle of the bar in the tray's frame, m.
    pub fn grip(&self, tray: &Object) -> Vector3<f64> {
        let [(at, bar), ..] = self.handle(tray);
        at + 0.5 * bar.height() * Vector3::z()
    }
}

/// Moves a tray to where it is drawn by `drawn` m, and what stands in it, or on what stands in it, with it.
pub fn slide(scene: &Scene, drawer: &Drawer, objects: &mut [ObjectState], drawn: f64) {
    let pose = |objects: &[ObjectState], name: &str| {
        objects.iter().find(|o| o.name == name)?.world_from_object
    };
    let (Some(case), Some(before)) = (pose(objects, &drawer.case), pose(objects, &drawer.tray))
    else {
        return;
    };
    let Some(after) = drawer.tray_at(scene, &case, drawn) else { return };
    let by = after.origin() - before.origin();
    let with = carried(scene, &drawer.tray, objects);
    for object in objects.iter_mut() {
        if object.name == drawer.tray {
            object.world_from_object = Some(after);
        } else if with.contains(&object.name) {
            object.world_from_object = object
                .world_from_object
                .map(|pose| Pose::from_parts(pose.origin() + by, pose.rotation()));
        }
    }
}

/// Returns what stands in or on a thing, or on what does.
fn carried(scene: &Scene, bearer: &str, objects: &[ObjectState]) -> Vec<String> {
    let below = |name: &str| {
        let object = scene.object(name)?;
        let pose = objects.iter().find(|known| known.name == name)?.world_from_object?;
        support::below(scene, objects, object, &pose).name
    };
    let rests = |name: &str| {
        let mut under = below(name);
        // A pile is no higher than there are things.
        for _ in 0..scene.objects.len() {
            match under {
                Some(on) if on == bearer => return true,
                Some(on) => under = below(&on),
                None => return false,
            }
        }
        false
    };
    let fixed = |name: &str| scene.drawers.iter().any(|d| d.tray == name || d.case == name);
    let names = scene.objects.iter().map(|object| &object.name);
    names.filter(|name| !fixed(name) && rests(name)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::super::object::vessel;
    use super::*;

    fn scene() -> Scene {
        let named = |name: &str, shape| Object { name: name.into(), ..vessel(shape, 1e-3) };
        let cuboid = |x, y, z| Shape::Cuboid { size: Vector3::new(x, y, z) };
        let solid = |object: Object| Object { cavity: None, ..object };
        let mut scene = super::super::scene::bare(vec![
            solid(named("chest", cuboid(0.2, 0.24, 0.12))),
            named("tray", cuboid(0.18, 0.2, 0.07)),
            solid(named("die", cuboid(0.04, 0.04, 0.04))),
            solid(named("dot", cuboid(0.02, 0.02, 0.02))),
        ]);
        let (tray, case) = ("tray".into(), "chest".into());
        scene.drawers.push(Drawer { tray, case, travel: 0.12, bar: 0.05 });
        scene
    }

    #[test]
    fn what_stands_in_a_tray_moves_with_it_and_what_stands_beside_does_not() {
        let scene = scene();
        let drawer = &scene.drawers[0];
        let case = Pose::upright(0.6, 0.1, 0.0, 0.4);
        let tray = drawer.tray_at(&scene, &case, 0.02).unwrap();
        assert!((drawer.drawn(&scene, &case, &tray).unwrap() - 0.02).abs() < 1e-12);
        let inside = tray.isometry() * nalgebra::Point3::new(0.05, 0.0, 0.003);
        let state = |name: &str, pose| ObjectState {
            name: name.into(),
            world_from_object: Some(pose),
            std: 0.0,
            water: None,
        };
        let at = |p: nalgebra::Point3<f64>, up: f64| Pose::upright(p.x, p.y, p.z + up, 0.0);
        let mut objects = vec![
            state("chest", case),
            state("tray", tray),
            state("die", at(inside, 0.0)),
            state("dot", at(inside, 0.04)),
        ];
        slide(&scene, drawer, &mut objects, 0.12);
        let by = |k: usize, from: Vector3<f64>| {
            (objects[k].world_from_object.unwrap().origin() - from).norm()
        };
        assert!((by(1, tray.origin()) - 0.1).abs() < 1e-9);
        assert!((by(2, inside.coords) - 0.1).abs() < 1e-9, "in the tray");
        assert!(
            (by(3, inside.coords + 0.04 * Vector3::z()) - 0.1).abs() < 1e-9,
            "on what is in it"
        );
        assert!(by(0, case.origin()) < 1e-12, "the case stays");
    }
}
