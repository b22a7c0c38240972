//! What the planner is asked all the time: inverse kinematics, and a path around a wall.

#![expect(clippy::unwrap_used, reason = "a failed unwrap in a bench is a failed bench")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::ik::{Options, Solver};
use trueup::motion::rmpflow::{Moving, Policy, Target};
use trueup::motion::rrt::{Settings, plan};
use trueup::motion::solid::Solid;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Budget, Robot};
use trueup::workcell::Stdlib;
use trueup::world::Pose;

/// A position of the Panda's joints, rad.
const PANDA: [f64; 7] = [0.3, -0.5, 0.2, -1.8, 0.4, 1.9, 0.1];

fn planning(criterion: &mut Criterion) {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let cuboid = |x: f64, y: f64, z: f64| Solid::Cuboid { half: Vector3::new(x, y, z) };
    let world = CollisionWorld::new(&robot).with(&[
        Obstacle::new("table", cuboid(0.6, 0.6, 0.01), Isometry3::translation(0.5, 0.0, -0.01)),
        Obstacle::new("wall", cuboid(0.25, 0.02, 0.25), Isometry3::translation(0.55, 0.0, 0.25)),
    ]);
    // The flange level and pointing forward, on either side of the wall.
    let forward = UnitQuaternion::from_matrix(&Matrix3::from_columns(&[
        Vector3::new(0.0, -1.0, 0.0),
        Vector3::new(0.0, 0.0, -1.0),
        Vector3::new(1.0, 0.0, 0.0),
    ]));
    let home = robot.pose("home").unwrap();
    let reach = |y: f64| {
        let target = Pose::from_parts(Vector3::new(0.45, y, 0.25), forward);
        solver.solve(&target, &Options::near(home), &|q| world.free(q)).unwrap()
    };
    let (start, goals) = (reach(-0.25).swap_remove(0), reach(0.25));

    let mut group = criterion.benchmark_group("plan");
    group.sample_size(20);
    group.bench_function("inverse kinematics, all free solutions", |bencher| {
        bencher.iter(|| reach(black_box(0.25)));
    });
    group.bench_function("is a configuration free", |bencher| {
        bencher.iter(|| world.free(black_box(&start)));
    });
    let run = Budget::new(|| false);
    let mut seed = 0;
    group.bench_function("path around a wall", |bencher| {
        bencher.iter(|| {
            seed = (seed + 1) % 10;
            plan(&solver, &world, &start, &goals[..4], None, &Settings::seeded(seed), &run).unwrap()
        });
    });
    group.finish();
}

/// What the inner loops ask: one pose, one solution, one step of a simulation.
fn parts(criterion: &mut Criterion) {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let dynamics = Dynamics::new(&robot, Bodies::All);
    let home = robot.pose("home").unwrap();
    let q = [0.3, -0.7, 1.1, 0.9, -0.4, 1.2, 2.1];
    let (dq, tau) = ([0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7], [1.0; 7]);
    let target = robot.forward(&q).unwrap();
    let far = Pose::from_parts(Vector3::new(0.9, 0.8, 0.5), target.rotation());
    let mut group = criterion.benchmark_group("motion");
    group.bench_function("jacobian", |bencher| bencher.iter(|| robot.jacobian(black_box(&q))));
    group.bench_function("inverse kinematics, first solution", |bencher| {
        bencher.iter(|| solver.solve(black_box(&target), &Options::first(home), &|_| true));
    });
    group.bench_function("inverse kinematics, one value of joint 3", |bencher| {
        bencher.iter(|| solver.at_joint_3(black_box(&target), q[2], home));
    });
    group.bench_function("inverse kinematics, out of reach", |bencher| {
        bencher.iter(|| solver.solve(black_box(&far), &Options::near(home), &|_| true));
    });
    for (name, q) in [("ur5e_2f85", &[0.3, -0.9, 1.1, -0.4, 1.2, 0.5][..]), ("panda", &PANDA)] {
        let robot = Stdlib::embedded().robot(name).unwrap();
        let (solver, target) = (Solver::new(&robot), robot.forward(q).unwrap());
        let home = robot.pose("home").unwrap();
        group.bench_function(format!("inverse kinematics, first solution of {name}"), |bencher| {
            bencher.iter(|| solver.solve(black_box(&target), &Options::first(home), &|_| true));
        });
        group.bench_function(format!("inverse kinematics, all solutions of {name}"), |bencher| {
            bencher.iter(|| solver.solve(black_box(&target), &Options::near(home), &|_| true));
        });
    }
    group.bench_function("inverse dynamics", |bencher| {
        bencher.iter(|| dynamics.inverse(black_box(&q), &dq, &dq));
    });
    group.bench_function("mass matrix", |bencher| {
        bencher.iter(|| dynamics.mass_matrix(black_box(&q)));
    });
    group.bench_function("forward dynamics", |bencher| {
        bencher.iter(|| dynamics.forward(black_box(&q), &dq, &tau));
    });
    group.finish();
}

/// How long it takes to time a path, and a step of the policies takes.
fn timing(criterion: &mut Criterion) {
    let robot = Robot::gen3();
    let limits = Limits::of(&robot);
    let home = robot.pose("home").unwrap();
    let moved = |k: usize| -> Vec<f64> {
        home.iter().enumerate().map(|(i, q)| q + 0.8 * ((k * 7 + i) as f64).sin()).collect()
    };
    let corners: Vec<Vec<f64>> = (0..5).map(moved).collect();
    let points: Vec<Vec<f64>> = (0..100)
        .map(|k| home.iter().enumerate().map(move |(i, q)| q + (0.01 * (k * (i + 1)) as f64).sin()))
        .map(Iterator::collect)
        .collect();
    let mut group = criterion.benchmark_group("timing");
    for (name, corners) in [("straight", &corners[..2]), ("five corners", &corners[..])] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                Trajectory::through_corners(black_box(corners), &limits, 0.2, &|_, _| true)
            });
        });
    }
    group.bench_function("a hundred points", |bencher| {
        bencher.iter(|| Trajectory::through_points(black_box(&points), &limits));
    });
    let table = Solid::Cuboid { half: Vector3::new(0.6, 0.6, 0.01) };
    let table = Obstacle::new("table", table, Isometry3::translation(0.5, 0.0, -0.01));
    let world = CollisionWorld::new(&robot).with(&[table]);
    let mut policy = Policy::new(&world);
    let tip = *robot.forward(&corners[1]).unwrap().isometry();
    let target = Target { tip, posture: corners[1].clone(), upright: None };
    let start = Moving { q: home.to_vec(), dq: vec![0.1; home.len()] };
    group.bench_function("a step of the policies", |bencher| {
        bencher.iter(|| policy.step(&mut start.clone(), &target).unwrap());
    });
    group.finish();
}

criterion_group!(benches, planning, parts, timing);
criterion_main!(benches);
