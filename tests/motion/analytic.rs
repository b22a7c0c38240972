//! Arms whose axes meet or run parallel: every solution, exactly; and arms where they do not.

use std::fmt::Write as _;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::motion::Robot;
use trueup::motion::ik::{Options, Reason, Solver};
use trueup::workcell::Stdlib;

use super::ik::UR5;

/// A joint: its origin in the link before (m), its axis, its range (rad).
type Joint = ([f64; 3], [f64; 3], [f64; 2]);

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// A KUKA KR 6's proportions: axes 2 and 3 parallel, 25 mm and 35 mm aside, a spherical wrist.
const INDUSTRIAL: [Joint; 6] = [
    ([0.0, 0.0, 0.4], Z, [-2.97, 2.97]),
    ([0.025, 0.0, 0.0], Y, [-3.0, 1.0]),
    ([0.455, 0.0, 0.0], Y, [-2.0, 2.7]),
    ([0.0, 0.0, 0.035], X, [-3.2, 3.2]),
    ([0.42, 0.0, 0.0], Y, [-2.1, 2.1]),
    ([0.08, 0.0, 0.0], X, [-6.1, 6.1]),
];

/// A KUKA LBR iiwa's proportions: a spherical shoulder, a spherical wrist.
const SEVEN: [Joint; 7] = [
    ([0.0, 0.0, 0.0], Z, [-2.97, 2.97]),
    ([0.0, 0.0, 0.36], Y, [-2.09, 2.09]),
    ([0.0, 0.0, 0.2], Z, [-2.97, 2.97]),
    ([0.0, 0.0, 0.22], Y, [-2.09, 2.09]),
    ([0.0, 0.0, 0.2], Z, [-2.97, 2.97]),
    ([0.0, 0.0, 0.2], Y, [-2.09, 2.09]),
    ([0.0, 0.0, 0.05], Z, [-3.05, 3.05]),
];

/// A UFACTORY xArm 6's proportions: axis 6 passes axis 5 by 76 mm.
const OFFSET_WRIST: [Joint; 6] = [
    ([0.0, 0.0, 0.267], Z, [-6.2, 6.2]),
    ([0.0, 0.0, 0.0], Y, [-2.05, 2.09]),
    ([0.05, 0.0, 0.284], Y, [-3.9, 0.19]),
    ([0.0775, 0.0, 0.3425], Z, [-6.2, 6.2]),
    ([0.0, 0.0, 0.0], Y, [-1.69, 3.1]),
    ([0.076, 0.0, 0.097], Z, [-6.2, 6.2]),
];

/// Returns a URDF; each origin is off by up to `off` m and rad, as a calibration finds it.
fn urdf(joints: &[Joint], off: f64) -> String {
    let mut random = StdRng::seed_from_u64(4);
    let mut noisy = |v: [f64; 3]| {
        let [x, y, z] = v.map(|x| x + off * random.random_range(-1.0..1.0));
        format!("{x} {y} {z}")
    };
    let mut text = "<robot name=\"arm\"><link name=\"l0\"/>".to_owned();
    for (i, (at, [x, y, z], [lower, upper])) in joints.iter().enumerate() {
        let (next, at, rpy) = (i + 1, noisy(*at), noisy([0.0; 3]));
        let _ = write!(
            text,
            "<link name=\"l{next}\"/><joint name=\"j{next}\" type=\"revolute\"><parent link=\"l{i}\"/><child link=\"l{next}\"/>
            <origin xyz=\"{at}\" rpy=\"{rpy}\"/><axis xyz=\"{x} {y} {z}\"/>
            <limit lower=\"{lower}\" upper=\"{upper}\" velocity=\"2\" effort=\"50\"/></joint>"
        );
    }
    let last = joints.len();
    let _ = write!(
        text,
        "<link name=\"tool\"/><joint name=\"t\" type=\"fixed\"><parent link=\"l{last}\"/><child link=\"tool\"/>
        <origin xyz=\"0 0.02 0.1\" rpy=\"0.3 0.2 0.1\"/></joint></robot>"
    );
    text
}

fn random_q(robot: &Robot, random: &mut StdRng) -> Vec<f64> {
    let within = |j: &trueup::motion::robot::JointLimits| j.lower.max(-3.1)..j.upper.min(3.1);
    robot.joints().iter().map(|j| random.random_range(within(j))).collect()
}

fn gap(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Solves poses of random joint positions: each solution is exact, inside the limits and there once. Returns how many
/// solutions there were, and for how many poses the joint positions it came from were among them.
fn solve_all(robot: &Robot, poses: usize) -> (usize, usize) {
    let solver = Solver::new(robot);
    assert!(solver.is_analytic());
    let mut random = StdRng::seed_from_u64(6);
    let (mut solutions, mut own) = (0, 0);
    for _ in 0..poses {
        let q = random_q(robot, &mut random);
        let target = robot.forward(&q).unwrap();
        let found = solver.solve(&target, &Options { sweep: 16, ..Options::near(&q) }, &|_| true);
        let found = found.unwrap_or_else(|why| panic!("{}: {q:?}: {why:?}", robot.name()));
        solutions += found.len();
        own += usize::from(gap(&found[0], &q) < 1e-6);
        for (i, q) in found.iter().enumerate() {
            assert!(robot.outside_limits(q, 0.0).is_none());
            let pose = robot.forward(q).unwrap();
            assert!((pose.origin() - target.origin()).norm() < 1e-8);
            assert!(pose.rotation().angle_to(&target.rotation()) < 1e-7);
            assert!(found[..i].iter().all(|other| gap(other, q) > 1e-7), "{q:?} twice");
        }
    }
    (solutions, own)
}

#[test]
fn arms_of_six_joints_are_solved_on_every_branch() {
    let ur5e = Stdlib::embedded().robot("ur5e_2f85").unwrap();
    let arms = [Robot::from_urdf(UR5, None), Robot::from_urdf(&urdf(&INDUSTRIAL, 0.0), None)];
    for robot in arms.into_iter().map(Result::unwrap).chain([ur5e]) {
        let (solutions, own) = solve_all(&robot, 500);
        assert_eq!(own, 500, "{}", robot.name());
        assert!(solutions > 500 * 2, "{}: {solutions}", robot.name());
    }
}

#[test]
fn arms_of_seven_joints_are_solved_at_each_value_of_one() {
    let panda = Stdlib::embedded().robot("panda").unwrap();
    for robot in [Robot::from_urdf(&urdf(&SEVEN, 0.0), None).unwrap(), panda] {
        let (solutions, own) = solve_all(&robot, 200);
        assert_eq!(own, 200, "{}", robot.name());
        assert!(solutions > 200 * 6, "{}: {solutions}", robot.name());
    }
}

/// The axes of a calibrated arm meet nowhere exactly: up to 0.5 mm and 0.5 mrad in each joint. Beside a singular pose a
/// branch may be missed.
#[test]
fn calibrated_arms_are_solved_as_they_are() {
    for joints in [&INDUSTRIAL[..], &SEVEN[..]] {
        let robot = Robot::from_urdf(&urdf(joints, 5e-4), None).unwrap();
        let (_, own) = solve_all(&robot, 200);
        assert!(own >= 190, "{own}");
    }
}

#[test]
fn what_an_arm_of_six_joints_cannot_reach_is_told_with_the_reason() {
    let robot = Robot::from_urdf(&urdf(&INDUSTRIAL, 0.0), None).unwrap();
    let solver = Solver::new(&robot);
    let middle = [0.0, -1.0, 1.0, 0.0, 0.5, 0.0];
    // Joint 2 is 0.6 rad past its end with the arm stretched: the elbow has no other way, and the other shoulder would need
    // joint 1 past its own end.
    let beyond = robot.forward(&[0.1, 1.6, 0.09, 0.4, 0.5, 0.2]).unwrap();
    let why = solver.solve(&beyond, &Options::near(&middle), &|_| true).unwrap_err();
    assert_eq!(why.reason, Reason::Limits);
    let there = robot.forward(&middle).unwrap();
    let why = solver.solve(&there, &Options::near(&middle), &|_| false).unwrap_err();
    assert_eq!(why.reason, Reason::Collision);
}

#[test]
fn an_arm_with_an_offset_wrist_is_solved_numerically() {
    let robot = Robot::from_urdf(&urdf(&OFFSET_WRIST, 0.0), None).unwrap();
    let solver = Solver::new(&robot);
    assert!(!solver.is_analytic());
    let mut random = StdRng::seed_from_u64(3);
    for _ in 0..100 {
        let target = robot.forward(&random_q(&robot, &mut random)).unwrap();
        let found = solver.solve(&target, &Options::first(&[0.0; 6]), &|_| true).unwrap();
        let pose = robot.forward(&found[0]).unwrap();
        assert!((pose.origin() - target.origin()).norm() < 1e-9);
    }
}

/// Where several joints are at their limits one value of the joint to spare serves, between those that are swept: one in seventy
/// such poses was once called beyond the limits.
#[test]
fn a_panda_takes_poses_with_joints_at_their_limits() {
    let robot = Stdlib::embedded().robot("panda").unwrap();
    let solver = Solver::new(&robot);
    let mut random = StdRng::seed_from_u64(11);
    let mut solved = 0;
    for _ in 0..1000 {
        let joints = robot.joints().iter();
        let q: Vec<f64> = joints
            .map(|joint| match random.random_range(0..20) {
                0..3 => joint.lower,
                3..6 => joint.upper,
                _ => random.random_range(joint.lower..joint.upper),
            })
            .collect();
        let target = robot.forward(&q).unwrap();
        let home = robot.pose("home").unwrap();
        let Ok(found) = solver.solve(&target, &Options::first(home), &|_| true) else { continue };
        solved += 1;
        assert!(robot.outside_limits(&found[0], 0.0).is_none());
        let pose = robot.forward(&found[0]).unwrap();
        assert!((pose.origin() - target.origin()).norm() < 5e-9, "{q:?}");
    }
    assert!(solved >= 990, "{solved}");
}
