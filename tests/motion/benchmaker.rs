//! Public planning problems: the scenes of `MotionBenchMaker` with the same grasps for the Gen3.
//!
//! Read in place; skipped where the files are not there. The scenes were made for another arm, so a
//! problem counts only if our own collision model finds its start and some goal free.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::{Options, Solver};
use trueup::motion::rrt::{Settings, plan};
use trueup::motion::solid::Solid;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Budget, Robot};
use trueup::world::Pose;

use crate::absent::public;

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

#[test]
fn public_problems_are_solved_and_the_motions_are_free_and_lawful() {
    let Some(folder) = public("motionbenchmaker") else { return };
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let scenes: Scenes = serde_json::from_str(&text("panda.json")).unwrap();
    let goals: Goals = serde_json::from_str(&text("gen3_goals.json")).unwrap();
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let limits = Limits::of(&robot);
    let home = robot.pose("home").unwrap();
    let run = Budget::new(|| false);
    let (mut posed, mut solved) = (0, 0);
    for (set, scenes) in &scenes.sets {
        for scene in scenes.iter().take(PER_SET) {
            let goal = goals
                .problems
                .iter()
                .find(|goal| goal.set == *set && goal.index == scene.index)
                .unwrap();
            let mut world = CollisionWorld::new(&robot);
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
            let options = Options::near(home);
            let Ok(ends) = solver.solve(&target, &options, &|q| world.free(q)) else { continue };
            if !world.free(home) {
                continue;
            }
            posed += 1;
            let ends = &ends[..ends.len().min(8)];
            let Ok(path) = plan(&solver, &world, home, ends, None, &Settings::default(), &run)
            else {
                continue;
            };
            solved += 1;
            let timed = Trajectory::through_corners(&path.corners, &limits, 0.2, &|a, b| {
                world.certify(a, b)
            })
            .unwrap();
            let (speed, acceleration) = timed.worst(&limits, 1e-3);
            assert!(speed <= 1.0 && acceleration <= 1.0, "{set} {}", scene.index);
            let (_, samples) = timed.sampled(5e-3);
            assert!(samples.iter().all(|q| world.free(q)), "{set} {}", scene.index);
        }
    }
    assert!(posed >= 6 && solved == posed, "{solved} of {posed}");
}

/// How many problems of each of the seven sets are tried.
const PER_SET: usize = 6;
