//! Things behind and under others, in pictures drawn with known truth: found where they are, kept where they are hidden, and gone
//! when they are gone.

use image::RgbImage;
use trueup::alignment::vision::{Look, Options, Sighting};
use trueup::language::{Library, Source};
use trueup::motion::Robot;
use trueup::twin::render::{self, ArmLook, View, render};
use trueup::world::frame::{Object, World};
use trueup::world::{ObjectState, Pose, Scene, WorldState};

type Placed = Option<Pose<World, Object>>;

fn scene(file: &str, text: &str) -> Scene {
    let mut library = Library::new();
    library.add(Source::new(file, text));
    let (item, source) = library.scenes().next().expect("the text holds a scene");
    trueup::scene::from_item(item, source).unwrap()
}

fn states(scene: &Scene, poses: &[Placed]) -> Vec<ObjectState> {
    let placed = scene.objects.iter().zip(poses);
    placed
        .map(|(object, pose)| ObjectState {
            name: object.name.clone(),
            world_from_object: *pose,
            std: 0.0,
            water: None,
        })
        .collect()
}

fn picture(scene: &Scene, poses: &[Placed]) -> RgbImage {
    let state = WorldState {
        time: 0.0,
        q: vec![0.0; 7],
        opening: 0.085,
        world_from_tool: Pose::identity(),
        held: None,
        objects: states(scene, poses),
        spilt: None,
        unknown: Vec::new(),
    };
    let links: [(String, nalgebra::Isometry3<f64>); 0] = [];
    let view = View::of(scene, &state, &ArmLook::new(&Robot::gen3()), &links);
    render(&scene.camera, &view, &render::Options::default()).colour
}

/// What is seen of a picture of things at some places by somebody who believes them at others.
fn seen(
    scene: &Scene,
    are: &[Placed],
    believed: &[Placed],
    options: &mut Options,
) -> Vec<Sighting> {
    let known = states(scene, believed);
    let picture = picture(scene, are);
    Look::new(&picture, &scene.camera, scene).unwrap().see_standing(options, &known)
}

/// The lower of two cubes shows a corner and two edges of its foot; alone, other turns and places fit these as well.
#[test]
fn the_lower_cube_of_a_stack_is_found_as_it_is_turned() {
    let scene = scene("cubes.task", include_str!("../tables/cubes.task"));
    for (x, y, lower, upper) in
        [(0.647, -0.115, -0.094, -0.175), (0.60, 0.05, 0.3, 0.25), (0.55, -0.2, 0.6, 0.62)]
    {
        let b = Pose::upright(x, y, 0.0, lower);
        let a = Pose::upright(x + 0.001, y, 0.06, upper);
        let poses = [Some(a), Some(b), Some(Pose::upright(0.56, 0.25, 0.0, 0.87))];
        let mut options = Options::default();
        options.raised.insert("a".into(), 0.06);
        let seen = seen(&scene, &poses, &[None; 3], &mut options);
        let found = seen[1].world_from_object.unwrap_or_else(|| panic!("{:?}", seen[1].reason));
        let off = (found.origin() - b.origin()).norm();
        assert!(off < 0.003, "{:.1} mm off", 1e3 * off);
    }
}

/// Of a cube behind a can two corners are seen. Laid along the can it had that one's edges for its own, 6 mm and 15 deg off.
#[test]
fn a_cube_half_behind_a_can_is_not_laid_along_the_can() {
    let text = include_str!("../tables/cubes.task").replace(
        "b: Graspable = cuboid(60 mm, 60 mm, 60 mm) { mass 120 g looks \"green cube\" colour \"#208030\" }",
        "b: Graspable = cylinder(radius 30 mm, height 100 mm) { mass 120 g looks \"can\" colour \"#d0b020\" }",
    );
    let scene = scene("cubes.task", &text);
    // The eye is at (1.25, 0, 0.85) m: the can stands before the cube, to one side or the other of its middle.
    for (aside, turn) in [(-0.012, 0.33), (0.012, 0.33), (-0.012, 0.05), (0.012, 0.6)] {
        let cube = Pose::upright(0.50, 0.05, 0.0, turn);
        let can = Pose::upright(0.575, 0.045 + aside, 0.0, 0.0);
        let poses = [Some(cube), Some(can), Some(Pose::upright(0.56, -0.25, 0.0, 0.87))];
        let seen = seen(&scene, &poses, &[None; 3], &mut Options::default()).swap_remove(0);
        let Some(found) = seen.world_from_object else {
            assert!(seen.reason.is_some());
            continue;
        };
        let off = (found.origin() - cube.origin()).norm();
        assert!(off < 0.003 && off < 4.0 * seen.std, "{off} m off, ± {} m", seen.std);
    }
}

/// A die stands behind a jar, as the camera looks, so that nothing of it is seen.
#[test]
fn what_is_hidden_is_kept_and_what_is_gone_is_not() {
    let text = include_str!("../tables/bottle.task").replace(
        "mug: Graspable = cylinder(radius 38 mm, height 95 mm)",
        "mug: Graspable = cylinder(radius 15 mm, height 30 mm)",
    );
    let scene = scene("bottle.task", &text);
    let bottle = Some(Pose::upright(0.70, 0.0, 0.0, 0.0));
    let tray = Some(Pose::upright(0.45, 0.25, 0.0, 0.0));
    // In the shade of the bottle: the eye is at (1.25, 0, 0.85) m.
    let behind = Some(Pose::upright(0.62, 0.0, 0.0, 0.0));
    let in_view = Some(Pose::upright(0.62, -0.2, 0.0, 0.0));
    let look = |mug, believed| {
        let [are, known] = [mug, believed].map(|mug| [bottle, mug, tray]);
        seen(&scene, &are, &known, &mut Options::default()).swap_remove(1)
    };
    let hidden = look(behind, behind);
    assert!(!hidden.found && hidden.kept.is_some(), "{:?}", hidden.reason);
    let gone = look(None, in_view);
    assert!(!gone.found && gone.kept.is_none(), "{:?}", gone.reason);
    let moved = look(in_view, behind);
    assert!(moved.found && moved.kept.is_none(), "{:?}", moved.reason);
}

/// A mug hangs in a hand over the table: it is not looked for there, and what stands is found as before.
#[test]
fn what_is_known_to_be_elsewhere_is_not_looked_for() {
    let scene = scene("bottle.task", include_str!("../tables/bottle.task"));
    let bottle = Some(Pose::upright(0.70, 0.0, 0.0, 0.0));
    let tray = Some(Pose::upright(0.45, 0.25, 0.0, 0.0));
    let hangs = Some(Pose::upright(0.55, -0.2, 0.2, 0.0));
    let names = |seen: &[Sighting]| -> Vec<String> {
        seen.iter().map(|sighting| sighting.name.clone()).collect()
    };
    let places = [bottle, hangs, tray];
    let all = seen(&scene, &places, &[None; 3], &mut Options::default());
    let mut options = Options::default();
    options.elsewhere.insert(scene.objects[1].name.clone());
    let others = seen(&scene, &places, &[None; 3], &mut options);
    assert_eq!(all.len(), 3);
    assert_eq!(names(&others), [names(&all)[0].clone(), names(&all)[2].clone()]);
    assert!(others.iter().all(|sighting| sighting.found), "{:?}", names(&others));
}
