//! Forward ∘ inverse kinematics is the identity.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::motion::Robot;
use trueup::motion::ik::{Options, Reason, Solver};
use trueup::world::Pose;

fn random_q(robot: &Robot, random: &mut StdRng) -> Vec<f64> {
    robot
        .joints()
        .iter()
        .map(|j| random.random_range(j.lower.max(-3.1)..j.upper.min(3.1)))
        .collect()
}

#[test]
fn every_reachable_pose_of_the_gen3_is_solved_exactly() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    assert!(solver.closed_form().is_some());
    let mut random = StdRng::seed_from_u64(1);
    let home = robot.pose("home").unwrap();
    let mut solutions = 0;
    for _ in 0..1000 {
        let target = robot.forward(&random_q(&robot, &mut random)).unwrap();
        let found = solver.solve(&target, &Options { sweep: 16, ..Options::near(home) }, &|_| true);
        let found = found.expect("it is reachable by construction");
        solutions += found.len();
        let mut last = 0.0;
        for q in &found {
            assert!(robot.outside_limits(q, 0.0).is_none());
            let pose = robot.forward(q).unwrap();
            assert!((pose.origin() - target.origin()).norm() < 1e-9);
            assert!(pose.rotation().angle_to(&target.rotation()) < 1e-7);
            let gap = q.iter().zip(home).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(gap >= last);
            last = gap;
        }
    }
    // 17 values of joint 3, up to 8 branches each, of which the limits leave a good part.
    assert!(solutions > 1000 * 40, "{solutions}");
}

#[test]
fn the_configuration_a_pose_came_from_is_among_its_solutions() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let mut random = StdRng::seed_from_u64(2);
    for _ in 0..300 {
        let q = random_q(&robot, &mut random);
        let target = robot.forward(&q).unwrap();
        let all = solver.at_joint_3(&target, q[2], &q);
        let nearest = all
            .iter()
            .map(|s| s.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "{nearest} {q:?}");
    }
}

#[test]
fn named_poses_and_singular_ones_are_solved() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let singular = [0.4, 0.0, 0.0, 0.0, 0.3, 0.0, 0.2];
    let poses = ["zero", "home", "retract"].map(|name| robot.pose(name).unwrap().to_vec());
    for q in poses.iter().chain([&singular.to_vec()]) {
        let target = robot.forward(q).unwrap();
        let found = solver.nearest(&target, q).unwrap();
        let pose = robot.forward(&found).unwrap();
        assert!((pose.origin() - target.origin()).norm() < 1e-8, "{q:?}");
    }
}

#[test]
fn an_unreachable_pose_says_why_and_how_far() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let home = robot.pose("home").unwrap();
    // Straight up the arm reaches 1.187 m; 10 cm more is out of reach by 10 cm.
    let above = robot.forward(&[0.0; 7]).unwrap();
    let target = Pose::from_parts(above.origin() + Vector3::new(0.0, 0.0, 0.1), above.rotation());
    let why = solver.solve(&target, &Options::near(home), &|_| true).unwrap_err();
    assert_eq!(why.reason, Reason::OutOfReach);
    assert!((why.nearest - 0.1).abs() < 1e-3, "{}", why.nearest);
    // A filter that refuses everything stands for a collision.
    let at_home = robot.forward(home).unwrap();
    let why = solver.solve(&at_home, &Options::near(home), &|_| false).unwrap_err();
    assert_eq!(why.reason, Reason::Collision);
    // Folded on itself beyond the limit of joint 4.
    let folded = robot.forward(&[0.0, 0.0, 0.0, 2.9, 0.0, 0.0, 0.0]).unwrap();
    let why = solver.solve(&folded, &Options::near(home), &|_| true).unwrap_err();
    assert_eq!(why.reason, Reason::Limits);
    assert!(why.nearest > 1e-3 && why.nearest < 0.2, "{}", why.nearest);
}

/// A UR5 (published DH parameters, as a URDF without meshes): six joints, three axes of them parallel.
pub(super) const UR5: &str = r#"<robot name="ur5"><link name="base_link"/><link name="l1"/><link name="l2"/>
  <link name="l3"/><link name="l4"/><link name="l5"/><link name="l6"/><link name="tool0"/>
  <joint name="j1" type="revolute"><parent link="base_link"/><child link="l1"/><origin xyz="0 0 0.089159"/>
    <axis xyz="0 0 1"/><limit lower="-6.2832" upper="6.2832" velocity="3.15" effort="150"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0.13585 0" rpy="0 1.570796327 0"/>
    <axis xyz="0 1 0"/><limit lower="-6.2832" upper="6.2832" velocity="3.15" effort="150"/></joint>
  <joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0 -0.1197 0.425"/>
    <axis xyz="0 1 0"/><limit lower="-3.1416" upper="3.1416" velocity="3.15" effort="150"/></joint>
  <joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="0 0 0.39225" rpy="0 1.570796327 0"/>
    <axis xyz="0 1 0"/><limit lower="-6.2832" upper="6.2832" velocity="3.2" effort="28"/></joint>
  <joint name="j5" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="0 0.093 0"/>
    <axis xyz="0 0 1"/><limit lower="-6.2832" upper="6.2832" velocity="3.2" effort="28"/></joint>
  <joint name="j6" type="revolute"><parent link="l5"/><child link="l6"/><origin xyz="0 0 0.09465"/>
    <axis xyz="0 1 0"/><limit lower="-6.2832" upper="6.2832" velocity="3.2" effort="28"/></joint>
  <joint name="t" type="fixed"><parent link="l6"/><child link="tool0"/><origin xyz="0 0.0823 0" rpy="-1.570796327 0 0"/></joint>
</robot>"#;

#[test]
fn a_ur5_is_solved_and_its_reach_told() {
    let robot = Robot::from_urdf(UR5, None).unwrap();
    let solver = Solver::new(&robot);
    let mut random = StdRng::seed_from_u64(3);
    for _ in 0..200 {
        let target = robot.forward(&random_q(&robot, &mut random)).unwrap();
        let found = solver.solve(&target, &Options::first(&[0.0; 6]), &|_| true).unwrap();
        let pose = robot.forward(&found[0]).unwrap();
        assert!((pose.origin() - target.origin()).norm() < 1e-9);
    }
    let far = Isometry3::from_parts(Translation3::new(2.0, 0.0, 0.0), UnitQuaternion::identity());
    let why = solver.solve(&Pose::new(far), &Options::near(&[0.0; 6]), &|_| true).unwrap_err();
    assert_eq!(why.reason, Reason::OutOfReach);
    assert!(why.nearest > 0.9 && why.nearest < 1.4, "{}", why.nearest);
}

/// Limits are inclusive: of these, 33 of 1000 were once called unreachable, by 1e-16 to 1e-3 m.
#[test]
fn a_pose_taken_with_joints_2_4_and_6_at_their_limits_is_solved() {
    let robot = Robot::gen3();
    let solver = Solver::new(&robot);
    let home = robot.pose("home").unwrap();
    let mut random = StdRng::seed_from_u64(9);
    for _ in 0..1000 {
        let mut q = random_q(&robot, &mut random);
        for i in [1, 3, 5] {
            let joint = &robot.joints()[i];
            q[i] = if random.random_bool(0.5) { joint.lower } else { joint.upper };
        }
        let target = robot.forward(&q).unwrap();
        let found = solver.solve(&target, &Options::near(home), &|_| true);
        let found = found.unwrap_or_else(|why| panic!("{q:?}: {why:?}"));
        for q in &found {
            assert!(robot.outside_limits(q, 0.0).is_none());
            let pose = robot.forward(q).unwrap();
            assert!((pose.origin() - target.origin()).norm() < 5e-9, "{q:?}");
            assert!(pose.rotation().angle_to(&target.rotation()) < 1e-7, "{q:?}");
        }
    }
}

/// A hand that always points down: on a rail, with two joints about upright axes, a slide and a last one that turns it.
pub(crate) const SCARA: &str = r#"<robot name="scara"><link name="base"/><link name="cart"/><link name="s1"/><link name="s2"/><link name="s3"/>
  <link name="s4"/><link name="flange"/>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
    <axis xyz="0 1 0"/><limit lower="-0.6" upper="0.6" velocity="0.8" effort="400"/></joint>
  <joint name="j1" type="revolute"><parent link="cart"/><child link="s1"/><origin xyz="0 0 0.6"/>
    <axis xyz="0 0 1"/><limit lower="-2.4" upper="2.4" velocity="2" effort="150"/></joint>
  <joint name="j2" type="revolute"><parent link="s1"/><child link="s2"/><origin xyz="0.4 0 0.11"/>
    <axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5" velocity="2" effort="100"/></joint>
  <joint name="j3" type="prismatic"><parent link="s2"/><child link="s3"/><origin xyz="0.35 0 0"/>
    <axis xyz="0 0 -1"/><limit lower="0" upper="0.45" velocity="0.6" effort="200"/></joint>
  <joint name="j4" type="revolute"><parent link="s3"/><child link="s4"/><origin xyz="0 0 -0.12"/>
    <axis xyz="0 0 1"/><limit lower="-3.14" upper="3.14" velocity="3" effort="40"/></joint>
  <joint name="jf" type="fixed"><parent link="s4"/><child link="flange"/><origin xyz="0 0 -0.09" rpy="3.141592653589793 0 0"/></joint>
</robot>"#;

/// A place that is reached with the hand pointing down was "374 mm out of reach" of a hand pointing level, and 495 mm with
/// another `--near`: the distance of that position from the place.
#[test]
fn an_orientation_that_cannot_be_had_is_told_apart_from_a_place_out_of_reach() {
    let robot = Robot::from_urdf(SCARA, None).unwrap();
    let solver = Solver::new(&robot);
    let half = std::f64::consts::FRAC_PI_2;
    let level = UnitQuaternion::from_euler_angles(half, 0.0, half);
    let leaning = UnitQuaternion::from_euler_angles(std::f64::consts::PI - 0.015, 0.0, 0.0);
    for near in [[0.0, 0.0, 0.0, 0.225, 0.0], [0.1, 0.5, 0.5, 0.2, 0.0]] {
        let why = |x: f64, turn: UnitQuaternion<f64>| {
            let target = Isometry3::from_parts(Translation3::new(x, 0.1, 0.3), turn);
            solver.solve(&Pose::new(target), &Options::near(&near), &|_| true).unwrap_err()
        };
        for turn in [level, leaning] {
            let told = why(0.45, turn);
            assert_eq!((told.reason, told.is_turned), (Reason::Orientation, false));
            assert!(told.nearest.abs() < 1e-12);
        }
        // The arm is 0.75 m long.
        let far = why(2.0, level);
        assert_eq!((far.reason, far.is_turned), (Reason::OutOfReach, false));
        assert!((far.nearest - 1.25).abs() < 0.01, "{}", far.nearest);
    }
}

/// Five joints after those of an SO-101: two lengths in a plane that turns, and a hand that bends in it and rolls.
const FIVE: &str = r#"<robot name="five"><link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
  <link name="l5"/><link name="tip"/>
  <joint name="pan" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0.039 0 0.062" rpy="3.14159265 0 -3.14159265"/>
    <axis xyz="0 0 1"/><limit lower="-1.92" upper="1.92" velocity="4" effort="10"/></joint>
  <joint name="lift" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="-0.03 -0.018 -0.054" rpy="-1.57079633 -1.57079633 0"/>
    <axis xyz="0 0 1"/><limit lower="-1.75" upper="1.75" velocity="4" effort="10"/></joint>
  <joint name="elbow" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="-0.113 -0.028 0" rpy="0 0 1.57079633"/>
    <axis xyz="0 0 1"/><limit lower="-1.69" upper="1.69" velocity="4" effort="10"/></joint>
  <joint name="flex" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="-0.135 0.005 0" rpy="0 0 -1.57079633"/>
    <axis xyz="0 0 1"/><limit lower="-1.66" upper="1.66" velocity="4" effort="10"/></joint>
  <joint name="roll" type="revolute"><parent link="l4"/><child link="l5"/><origin xyz="0 -0.061 0.018" rpy="1.57079633 0.0487 3.14159265"/>
    <axis xyz="0 0 1"/><limit lower="-2.74" upper="2.84" velocity="4" effort="10"/></joint>
  <joint name="jt" type="fixed"><parent link="l5"/><child link="tip"/><origin xyz="-0.008 0 -0.098" rpy="0 3.14159265 0"/></joint>
</robot>"#;

/// One in a hundred poses that an arm of five joints takes was called beyond its limits, which one depended on the seed: a way
/// without limits had led to it, and twelve within them had not.
#[test]
fn a_pose_that_five_joints_take_is_not_called_beyond_their_limits() {
    let robot = Robot::from_urdf(FIVE, None).unwrap();
    let solver = Solver::new(&robot);
    let mut random = StdRng::seed_from_u64(11);
    for seed in 0..800 {
        let taken = random_q(&robot, &mut random);
        let target = robot.forward(&taken).unwrap();
        let options = Options { seed, ..Options::near(&[0.0; 5]) };
        let found = solver.solve(&target, &options, &|_| true);
        let found = found.unwrap_or_else(|why| panic!("{taken:?}: {why:?}"));
        assert!(robot.outside_limits(&found[0], 0.0).is_none());
        let pose = robot.forward(&found[0]).unwrap();
        assert!((pose.origin() - target.origin()).norm() < 1e-9);
    }
    // The elbow bent half a radian further than it goes.
    let bent = robot.forward(&[0.3, 0.4, 2.2, 0.3, 0.5]).unwrap();
    let why = solver.solve(&bent, &Options::near(&[0.0; 5]), &|_| true).unwrap_err();
    assert_eq!(why.reason, Reason::Limits);
}
