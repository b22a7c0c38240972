//! Paths are free, upright where asked, and the same for the same seed.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::{Options, Solver};
use trueup::motion::rrt::{Cone, Settings, plan};
use trueup::motion::solid::Solid;
use trueup::motion::{Budget, Error, Robot};
use trueup::world::Pose;

fn table_and_wall() -> Vec<Obstacle> {
    let cuboid = |x: f64, y: f64, z: f64| Solid::Cuboid { half: Vector3::new(x, y, z) };
    vec![
        Obstacle::new("table", cuboid(0.6, 0.6, 0.01), Isometry3::translation(0.5, 0.0, -0.01)),
        Obstacle::new("wall", cuboid(0.25, 0.02, 0.25), Isometry3::translation(0.55, 0.0, 0.25)),
    ]
}

/// The flange level and pointing forward (x), the tool's x axis up, at a place on the table.
fn level_grasp(solver: &Solver<'_>, world: &CollisionWorld<'_>, y: f64) -> Vec<Vec<f64>> {
    let forward = nalgebra::UnitQuaternion::from_matrix(&nalgebra::Matrix3::from_columns(&[
        Vector3::new(0.0, -1.0, 0.0),
        Vector3::new(0.0, 0.0, -1.0),
        Vector3::new(1.0, 0.0, 0.0),
    ]));
    let target = Pose::from_parts(Vector3::new(0.45, y, 0.25), forward);
    let home = solver.robot().pose("home").unwrap();
    solver.solve(&target, &Options::near(home), &|q| world.free(q)).unwrap()
}

fn sampled_free(world: &CollisionWorld<'_>, corners: &[Vec<f64>]) -> bool {
    corners.windows(2).all(|edge| {
        (0..=200).all(|k| {
            let t = f64::from(k) / 200.0;
            let q: Vec<f64> = edge[0].iter().zip(&edge[1]).map(|(a, b)| a + t * (b - a)).collect();
            world.free(&q)
        })
    })
}

#[test]
fn a_path_leads_round_a_wall_and_repeats_with_its_seed() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let world = CollisionWorld::new(&robot).with(&table_and_wall());
    let start = level_grasp(&solver, &world, -0.25).swap_remove(0);
    let goals = level_grasp(&solver, &world, 0.25);
    let run = Budget::new(|| false);
    for seed in 0..5 {
        let path = plan(&solver, &world, &start, &goals[..4], None, &Settings::seeded(seed), &run)
            .unwrap();
        assert!(path.corners.len() > 2, "the wall is in the straight way");
        assert_eq!(path.corners[0], start);
        assert!(sampled_free(&world, &path.corners));
        assert!(path.length() <= path.raw_length);
        let again = plan(&solver, &world, &start, &goals[..4], None, &Settings::seeded(seed), &run)
            .unwrap();
        assert_eq!(path, again);
    }
}

#[test]
fn a_jar_is_carried_over_the_wall_upright() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let world = CollisionWorld::new(&robot).with(&table_and_wall());
    let cone = Cone {
        // In that grasp the flange's -y axis points up.
        axis_in_flange: -Vector3::y_axis(),
        up_in_base: Vector3::z_axis(),
        max_angle: 10.0_f64.to_radians(),
    };
    let start = level_grasp(&solver, &world, -0.25).swap_remove(0);
    let goals = level_grasp(&solver, &world, 0.25);
    let run = Budget::new(|| false);
    for seed in 0..5 {
        let path =
            plan(&solver, &world, &start, &goals, Some(&cone), &Settings::seeded(seed), &run)
                .unwrap();
        assert!(sampled_free(&world, &path.corners));
        for edge in path.corners.windows(2) {
            for k in 0..=50 {
                let t = f64::from(k) / 50.0;
                let q: Vec<f64> =
                    edge[0].iter().zip(&edge[1]).map(|(a, b)| a + t * (b - a)).collect();
                assert!(cone.angle(&robot, &q) < cone.max_angle + 0.01);
            }
        }
    }
}

#[test]
fn what_cannot_be_planned_is_said() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let world = CollisionWorld::new(&robot).with(&table_and_wall());
    let start = level_grasp(&solver, &world, -0.25).swap_remove(0);
    let run = Budget::new(|| false);
    let plan = |goal: Vec<f64>, stop: &Budget<'_>| {
        plan(&solver, &world, &start, &[goal], None, &Settings::default(), stop)
    };
    let low = vec![0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(matches!(plan(low, &run), Err(Error::Collision { .. })));
    let far = vec![0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(matches!(plan(far, &run), Err(Error::Limit { .. })));
    assert!(matches!(plan(vec![0.0; 3], &run), Err(Error::WrongLength { .. })));
    let across = level_grasp(&solver, &world, 0.25).swap_remove(0);
    let stopped = Budget::new(|| true);
    assert_eq!(plan(across.clone(), &stopped), Err(Error::Cancelled));
    // In the middle of an edge, too: whoever stops it does not wait for the next sample.
    let looks = AtomicUsize::new(0);
    let later = Budget::new(|| looks.fetch_add(1, Ordering::Relaxed) > 20);
    assert_eq!(plan(across.clone(), &later), Err(Error::Cancelled));
    assert_eq!(looks.load(Ordering::Relaxed), 22);
    let little = Budget::of(2_000, || false);
    assert!(matches!(plan(across, &little), Err(Error::Spent { .. })));
}
