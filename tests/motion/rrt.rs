//! Paths are free, upright where asked, and the same for the same seed.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::{Options, Solver};
use trueup::motion::polyline::{l2, mix};
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

/// Every path is free by the exact solids 500 times a radian, and threads do not change it.
#[test]
fn a_path_is_free_wherever_one_looks_and_the_same_on_any_thread() {
    let robot = Robot::gen3();
    let world = CollisionWorld::new(&robot).with(&table_and_wall());
    let solver = Solver::new(&robot);
    let start = level_grasp(&solver, &world, -0.25).swap_remove(0);
    let goals = level_grasp(&solver, &world, 0.25);
    let one = |seed: u64| {
        let solver = Solver::new(&robot);
        let run = Budget::new(|| false);
        plan(&solver, &world, &start, &goals[..4], None, &Settings::seeded(seed), &run).unwrap()
    };
    let (one, world) = (&one, &world);
    let threads: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|seed| scope.spawn(move || one(seed))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for (seed, path) in threads.iter().enumerate() {
        assert_eq!(*path, one(seed as u64));
        for edge in path.corners.windows(2) {
            let steps = (500.0 * l2(&edge[0], &edge[1])).ceil() as usize;
            assert!((0..=steps).all(|k| world.free(&mix(
                &edge[0],
                &edge[1],
                k as f64 / steps as f64
            ))));
        }
    }
}

/// The goal lies in a box that is open at the top, and no straight motion of half a radian leads out of it: the search once
/// favoured its tree for ever, and took whole steps or none.
#[test]
fn a_goal_deep_in_a_box_is_reached() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let home = robot.pose("home").unwrap();
    let cuboid = |x: f64, y: f64, z: f64| Solid::Cuboid { half: Vector3::new(x, y, z) };
    let side = |name: &str, solid: Solid, x: f64, y: f64, z: f64| {
        Obstacle::new(name, solid, Isometry3::translation(x, y, z))
    };
    let world = CollisionWorld::new(&robot).with(&[
        side("floor", cuboid(0.12, 0.12, 0.01), 0.45, 0.3, -0.01),
        side("near", cuboid(0.01, 0.12, 0.15), 0.34, 0.3, 0.15),
        side("far", cuboid(0.01, 0.12, 0.15), 0.56, 0.3, 0.15),
        side("left", cuboid(0.12, 0.01, 0.15), 0.45, 0.41, 0.15),
        side("right", cuboid(0.12, 0.01, 0.15), 0.45, 0.19, 0.15),
    ]);
    let down = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let target = Pose::from_parts(Vector3::new(0.45, 0.3, 0.22), down);
    let goals = solver.solve(&target, &Options::near(home), &|q| world.free(q)).unwrap();
    let run = Budget::new(|| false);
    for seed in 0..5 {
        let settings = Settings::seeded(seed);
        let path = plan(&solver, &world, home, &goals[..1], None, &settings, &run).unwrap();
        assert!(sampled_free(&world, &path.corners));
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
    let later = Budget::new(|| looks.fetch_add(1, Ordering::Relaxed) > 4);
    assert_eq!(plan(across.clone(), &later), Err(Error::Cancelled));
    assert_eq!(looks.load(Ordering::Relaxed), 6);
    let little = Budget::of(200, || false);
    assert!(matches!(plan(across, &little), Err(Error::Spent { .. })));
}

/// A cube of 10 cm that slides along x and y, 1 m either way.
const SLIDING: &str = r#"<robot name="cube"><link name="base"/><link name="bar"/>
    <link name="body"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
    <joint name="x" type="prismatic"><parent link="base"/><child link="bar"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="100"/></joint>
    <joint name="y" type="prismatic"><parent link="bar"/><child link="body"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="100"/></joint></robot>"#;

/// A box as high as the cube can be met at, by its middle and half its sides, m.
fn slab(name: &str, (x, y): (f64, f64), (half_x, half_y): (f64, f64)) -> Obstacle {
    let half = Vector3::new(half_x, half_y, 0.5);
    Obstacle::new(name, Solid::Cuboid { half }, Isometry3::translation(x, y, 0.0))
}

/// "no path found", though the straight motion is free: 3 mm were kept beyond the margin, and never less.
#[test]
fn a_slot_with_less_room_than_is_usual_is_passed() {
    let robot = Robot::from_urdf(SLIDING, None).unwrap();
    let solver = Solver::new(&robot);
    let slot = [slab("one", (0.0, 1.052), (0.1, 1.0)), slab("other", (0.0, -1.052), (0.1, 1.0))];
    let world = CollisionWorld::new(&robot).with(&slot);
    let run = Budget::new(|| false);
    let (start, goals) = (vec![-0.5, 0.0], [vec![0.5, 0.0]]);
    let settings = Settings { max_samples: 300, ..Settings::default() };
    let path = plan(&solver, &world, &start, &goals, None, &settings, &run).unwrap();
    assert_eq!(path.corners, [start.clone(), goals[0].clone()]);
    assert!(world.certify(&start, &goals[0]));
    let wide = Settings { may_graze: false, ..settings };
    let none = plan(&solver, &world, &start, &goals, None, &wide, &run);
    assert!(matches!(none, Err(Error::NoPath { .. })), "{none:?}");
}

/// A goal 1 mm from something was left out where another had more room, though it was straight ahead and the other far, or
/// behind a wall without an end.
#[test]
fn a_goal_with_little_room_counts_beside_one_with_more() {
    let robot = Robot::from_urdf(SLIDING, None).unwrap();
    let solver = Solver::new(&robot);
    let run = Budget::new(|| false);
    let start = [0.0, 0.0];
    let goals = [vec![-0.6, 0.0], vec![0.3, 0.0]];
    let behind = |length: f64| {
        let beside = slab("beside the goal", (0.401, 0.0), (0.05, 0.05));
        let wall = slab("wall", (-0.3, 0.0), (0.01, 0.5 * length));
        CollisionWorld::new(&robot).with(&[beside, wall])
    };
    for (world, max_samples) in [(behind(1.0), 20_000), (behind(4.0), 300)] {
        for seed in 0..3 {
            let settings = Settings { max_samples, ..Settings::seeded(seed) };
            let path = plan(&solver, &world, &start, &goals, None, &settings, &run).unwrap();
            assert_eq!((path.goal, path.corners.len()), (1, 2), "{path:?}");
        }
    }
}

/// "no path found with 13134 samples", where 1000 were asked for: searches with several distances had so many each, and what
/// was drawn and not used was counted.
#[test]
fn no_more_samples_are_tried_than_there_may_be_in_all() {
    let robot = Robot::from_urdf(SLIDING, None).unwrap();
    let solver = Solver::new(&robot);
    let world = CollisionWorld::new(&robot).with(&[slab("wall", (0.0, 0.0), (0.05, 2.0))]);
    let run = Budget::new(|| false);
    for max_samples in [1, 2, 10, 300, 1000] {
        for may_graze in [true, false] {
            let settings = Settings { max_samples, may_graze, ..Settings::seeded(1) };
            let found =
                plan(&solver, &world, &[-0.5, 0.0], &[vec![0.5, 0.0]], None, &settings, &run);
            let Err(Error::NoPath { samples, .. }) = found else { panic!("{found:?}") };
            assert!(samples <= max_samples, "{samples} of {max_samples}");
            assert!(10 * samples > 9 * max_samples, "{samples} of {max_samples}");
        }
    }
}
