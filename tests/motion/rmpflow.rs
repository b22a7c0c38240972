//! Motions by policies: they arrive, touch nothing, keep limits, repeat, and give way to what moves.

use nalgebra::{Isometry3, Unit, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::Solver;
use trueup::motion::rmpflow::{Moving, Policy, STEP, Target, plan};
use trueup::motion::rrt::{Cone, Settings};
use trueup::motion::solid::Solid;
use trueup::motion::{Budget, Error, Robot};
use trueup::workcell::Stdlib;

fn ball(radius: f64, at: [f64; 3]) -> Obstacle {
    let pose = Isometry3::translation(at[0], at[1], at[2]);
    Obstacle::new("ball", Solid::Sphere { radius }, pose)
}

/// The tool's point half-way to where joint 1 turned by a radian puts it: in the way.
fn between(robot: &Robot, start: &[f64], goal: &[f64]) -> [f64; 3] {
    let middle: Vec<f64> = start.iter().zip(goal).map(|(a, b)| 0.5 * (a + b)).collect();
    robot.forward(&middle).unwrap().origin().into()
}

#[test]
fn a_motion_goes_round_a_ball_and_is_free_everywhere() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let start = robot.pose("home").unwrap().to_vec();
    let mut goal = start.clone();
    goal[0] += 1.2;
    let world = CollisionWorld::new(&robot).with(&[ball(0.08, between(&robot, &start, &goal))]);
    assert!(!world.certify(&start, &goal), "the ball is in the way");
    let run = Budget::new(|| false);
    let go = || {
        plan(&solver, &world, &start, &[goal.clone()], None, &Settings::seeded(3), &run).unwrap()
    };
    let path = go();
    assert_eq!(path, go(), "the same again");
    assert_eq!((&path.corners[0], path.corners.last().unwrap()), (&start, &goal));
    assert!(path.corners.windows(2).all(|edge| world.certify(&edge[0], &edge[1])));
}

#[test]
fn what_is_held_upright_stays_upright() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let start = robot.pose("home").unwrap().to_vec();
    let tip = robot.forward(&start).unwrap();
    // Whatever of the tip points up now.
    let up = tip.rotation().inverse() * Vector3::z();
    let cone = Cone {
        axis_in_flange: Unit::new_normalize(up),
        up_in_base: Vector3::z_axis(),
        max_angle: 15.0_f64.to_radians(),
    };
    let mut goal = start.clone();
    goal[0] -= 0.9;
    let world = CollisionWorld::new(&robot).with(&[ball(0.06, between(&robot, &start, &goal))]);
    let run = Budget::new(|| false);
    let settings = Settings::seeded(1);
    let path = plan(&solver, &world, &start, &[goal], Some(&cone), &settings, &run).unwrap();
    for edge in path.corners.windows(2) {
        for k in 0..=20 {
            let t = f64::from(k) / 20.0;
            let q: Vec<f64> = edge[0].iter().zip(&edge[1]).map(|(a, b)| a + t * (b - a)).collect();
            assert!(cone.holds(&robot, &q));
        }
    }
}

#[test]
fn joints_keep_their_ranges_and_speeds() {
    let robot = Robot::gen3();
    let world = CollisionWorld::new(&robot);
    let mut policy = Policy::new(&world);
    let start = robot.pose("home").unwrap().to_vec();
    // A target far outside of the workspace: the arm stretches towards it, and no joint passes its end.
    let target = Target {
        tip: Isometry3::translation(2.0, 1.5, -1.0),
        posture: start.clone(),
        upright: None,
    };
    let mut at = Moving { q: start.clone(), dq: vec![0.0; 7] };
    for _ in 0..3000 {
        policy.step(&mut at, &target).unwrap();
        assert!(robot.outside_limits(&at.q, 0.0).is_none(), "{:?}", at.q);
        for (v, joint) in at.dq.iter().zip(robot.joints()) {
            assert!(v.abs() <= joint.velocity);
        }
    }
    let wrong = Moving { q: vec![0.0; 6], dq: vec![0.0; 7] };
    assert!(matches!(policy.step(&mut wrong.clone(), &target), Err(Error::WrongLength { .. })));
}

#[test]
fn an_arm_at_its_target_gives_way_to_a_ball_that_comes_and_goes_back() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap().to_vec();
    let tip = *robot.forward(&home).unwrap().isometry();
    let radius = 0.05;
    let from = tip.translation.vector + Vector3::new(0.15, 0.5, 0.0);
    let world = CollisionWorld::new(&robot).with(&[ball(radius, from.into())]);
    let mut policy = Policy::new(&world);
    let target = Target { tip, posture: home.clone(), upright: None };
    let mut at = Moving { q: home.clone(), dq: vec![0.0; 7] };
    let velocity = Vector3::new(0.0, -0.12, 0.0);
    policy.moves("ball", &velocity);
    let (mut least, mut gave_way) = (f64::INFINITY, 0.0_f64);
    let steps = (8.0 / STEP) as usize;
    for k in 1..=steps {
        policy.step(&mut at, &target).unwrap();
        let now = from + velocity * (k as f64 * STEP);
        let around = CollisionWorld::new(&robot).with(&[ball(radius, now.into())]);
        if k % 10 == 0 {
            least = least.min(around.distance(&at.q));
        }
        let off = robot.forward(&at.q).unwrap().origin() - tip.translation.vector;
        gave_way = gave_way.max(off.norm());
    }
    assert!(least > 0.0, "touched by {least}");
    assert!(gave_way > 0.01, "it never moved: {gave_way}");
    let off = robot.forward(&at.q).unwrap().origin() - tip.translation.vector;
    assert!(off.norm() < 0.01, "it is back: {}", off.norm());
}

#[test]
fn where_neither_policies_nor_a_search_lead_is_said() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let start = robot.pose("home").unwrap().to_vec();
    let mut goal = start.clone();
    goal[0] += 2.0;
    let wall = Solid::Cuboid { half: Vector3::new(2.0, 0.02, 2.0) };
    let at = between(&robot, &start, &goal);
    let turn = Isometry3::rotation(Vector3::z() * at[1].atan2(at[0]));
    let wall = Obstacle::new("wall", wall, turn * Isometry3::translation(2.2, 0.0, 0.0));
    let world = CollisionWorld::new(&robot).with(&[wall]);
    let settings = Settings { max_samples: 1, ..Settings::seeded(1) };
    let run = Budget::new(|| false);
    let error = plan(&solver, &world, &start, &[goal], None, &settings, &run).unwrap_err();
    assert!(matches!(error, Error::NoPath { .. } | Error::Collision { .. }), "{error}");
}

/// With the tip at its target and the joints 425 deg from theirs an arm of six joints rested for good: there is one way to hold
/// the tip on each branch, and a straight searched path led to the same goal again. Nothing is in the way here.
#[test]
fn an_arm_of_six_joints_is_led_to_another_branch() {
    let robot = Stdlib::embedded().robot("ur5e_2f85").unwrap();
    let solver = Solver::new(&robot);
    let world = CollisionWorld::new(&robot);
    let start = [0.52, -2.49, -0.36, -0.69, 1.3, -2.59];
    let goal = vec![-2.08, 0.08, -0.6, 1.04, -1.05, -1.9];
    let run = Budget::new(|| false);
    let settings = Settings::seeded(1);
    let path =
        plan(&solver, &world, &start, std::slice::from_ref(&goal), None, &settings, &run).unwrap();
    assert_eq!(path.policies_failed, None);
    assert_eq!(&path.corners[0][..], &start[..]);
    let last = path.corners.last().unwrap();
    assert!(last.iter().zip(&goal).all(|(a, b)| (a - b).abs() < 1e-9), "{last:?}");
    assert!(path.corners.windows(2).all(|edge| world.certify(&edge[0], &edge[1])));
}
