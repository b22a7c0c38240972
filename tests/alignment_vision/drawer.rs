//! How far a drawer is drawn, in pictures of the scene of `tests/tables/drawer.task` drawn with known truth.

use trueup::alignment::vision::{Options, Sighting, see};
use trueup::language::{Library, Source};
use trueup::motion::Robot;
use trueup::twin::render::{self, ArmLook, View, render};
use trueup::world::{ObjectState, Pose, Scene, WorldState};

fn scene(tray: &str) -> Scene {
    let text = include_str!("../tables/drawer.task").replace("#c02020", tray);
    let mut library = Library::new();
    library.add(Source::new("drawer.task", text));
    let (item, source) = library.scenes().next().expect("the text holds a scene");
    trueup::scene::from_item(item, source).unwrap()
}

/// What is seen of a chest that is turned by `yaw` from facing the arm and drawn by `drawn` m, with its truth.
fn seen(scene: &Scene, yaw: f64, drawn: f64) -> (Sighting, f64) {
    let drawer = &scene.drawers[0];
    let case = Pose::upright(0.72, 0.05, 0.0, std::f64::consts::PI + yaw);
    let tray = drawer.tray_at(scene, &case, drawn).unwrap();
    let poses = [case, tray, Pose::upright(0.55, 0.30, 0.0, 0.4)];
    let objects = scene.objects.iter().zip(poses).map(|(object, pose)| ObjectState {
        name: object.name.clone(),
        world_from_object: Some(pose),
        std: 0.0,
        water: None,
    });
    let state = WorldState {
        time: 0.0,
        q: vec![0.0; 7],
        opening: 0.085,
        world_from_tool: Pose::identity(),
        held: None,
        objects: objects.collect(),
        spilt: None,
        unknown: Vec::new(),
    };
    let links: [(String, nalgebra::Isometry3<f64>); 0] = [];
    let view = View::of(scene, &state, &ArmLook::new(&Robot::gen3()), &links);
    let picture = render(&scene.camera, &view, &render::Options::default()).colour;
    let seen = see(&picture, &scene.camera, scene, &Options::default()).unwrap();
    assert_eq!(seen.len(), scene.objects.len());
    let off = seen[1].world_from_object.map_or(f64::NAN, |at| (at.origin() - tray.origin()).norm());
    (seen[1].clone(), off)
}

#[test]
fn how_far_a_drawer_is_drawn_is_seen_to_half_a_centimetre() {
    let scene = scene("#c02020");
    for (yaw, drawn) in
        [(0.0, 0.0), (0.25, 0.0), (-0.3, 0.02), (0.0, 0.05), (0.3, 0.09), (-0.2, 0.11)]
    {
        let (tray, off) = seen(&scene, yaw, drawn);
        assert!(tray.found, "{yaw} rad, {drawn} m: {:?}", tray.reason);
        assert!(
            off < 0.006,
            "{yaw} rad, {drawn} m: {:.1} mm off ± {:.1}",
            1e3 * off,
            1e3 * tray.std
        );
    }
}

#[test]
fn a_tray_in_the_colour_of_the_table_is_not_found_and_said_so() {
    let (tray, _) = seen(&scene("#c8b090"), 0.0, 0.09);
    assert!(!tray.found, "{tray:?}");
    assert!(tray.reason.unwrap().contains("in the colour of `drawer`"));
}
