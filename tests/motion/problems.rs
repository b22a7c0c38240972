//! The public problems of `MotionBenchMaker` with the same grasps for the Gen3, as collision worlds with goals.
//!
//! Read in place. The scenes were made for another arm, so a problem counts only if our own collision model finds its
//! start and some goal free.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use trueup::motion::Robot;
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::{Options, Solver};
use trueup::motion::solid::Solid;
use trueup::world::Pose;

/// A problem: from the robot's `home` to any of the goals, rad.
pub(crate) struct Problem<'r> {
    /// Set and number in the set.
    pub(crate) name: String,
    pub(crate) world: CollisionWorld<'r>,
    pub(crate) goals: Vec<Vec<f64>>,
}

/// Reads the first `of_each` problems of each set, by set.
pub(crate) fn problems<'r>(
    folder: &Path,
    robot: &'r Robot,
    of_each: usize,
) -> BTreeMap<String, Vec<Problem<'r>>> {
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let scenes: Scenes = serde_json::from_str(&text("panda.json")).unwrap();
    let grasps: Goals = serde_json::from_str(&text("gen3_goals.json")).unwrap();
    let sets = scenes.sets.iter().map(|(set, scenes)| {
        let posed = scenes.iter().take(of_each).filter_map(|scene| {
            let is_this = |goal: &&Goal| goal.set == *set && goal.index == scene.index;
            let grasp = grasps.problems.iter().find(is_this).unwrap();
            let name = format!("{set} {}", scene.index);
            let (world, goals) = posed(robot, scene, grasp)?;
            Some(Problem { name, world, goals })
        });
        (set.clone(), posed.collect())
    });
    sets.collect()
}

fn posed<'r>(
    robot: &'r Robot,
    scene: &Scene,
    goal: &Goal,
) -> Option<(CollisionWorld<'r>, Vec<Vec<f64>>)> {
    let mut world = CollisionWorld::new(robot);
    for thing in &scene.obstacles {
        world.add(&obstacle(thing));
    }
    // The thing that is grasped is touched on purpose: it is the one nearest to the grasp.
    let grasp = Vector3::from(goal.pos);
    let gap = |thing: &&Thing| (Vector3::from(thing.pos) - grasp).norm();
    let grasped = scene.obstacles.iter().min_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap();
    world.ignore_gripper(&grasped.name);
    let turn = Rotation3::from_matrix(&Matrix3::from_row_slice(&goal.R_rowmajor));
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let past_flange = turn * Vector3::new(0.0, 0.0, 0.13);
    let target = Pose::from_parts(grasp - past_flange, turn);
    let home = robot.pose("home").unwrap();
    let options = Options::near(home);
    let mut ends = Solver::new(robot).solve(&target, &options, &|q| world.free(q)).ok()?;
    ends.truncate(8);
    world.free(home).then_some((world, ends))
}

#[derive(Deserialize)]
struct Scenes {
    sets: BTreeMap<String, Vec<Scene>>,
}

#[derive(Deserialize)]
struct Scene {
    index: usize,
    obstacles: Vec<Thing>,
}

#[derive(Deserialize)]
struct Thing {
    name: String,
    pos: [f64; 3],
    quat_xyzw: [f64; 4],
    half_extents: Option<[f64; 3]>,
    length: Option<f64>,
    radius: Option<f64>,
}

#[derive(Deserialize)]
struct Goals {
    problems: Vec<Goal>,
}

#[derive(Deserialize)]
#[expect(non_snake_case, reason = "the file's own key")]
struct Goal {
    set: String,
    index: usize,
    pos: [f64; 3],
    R_rowmajor: [f64; 9],
}

fn obstacle(thing: &Thing) -> Obstacle {
    let [x, y, z, w] = thing.quat_xyzw;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let solid = match (thing.half_extents, thing.radius, thing.length) {
        (Some(half), ..) => Solid::Cuboid { half: Vector3::from(half) },
        (None, Some(radius), Some(length)) => Solid::Cylinder { radius, half: length / 2.0 },
        _ => panic!("{} has no size", thing.name),
    };
    Obstacle::new(&thing.name, solid, Isometry3::from_parts(Vector3::from(thing.pos).into(), turn))
}
