//! Joints that follow others: on the way to the tip, beside it, through a third one, and fingers, which are no part of the arm.

use std::fmt::Write as _;

use nalgebra::{DVector, Isometry3, Point3, UnitQuaternion, Vector3};
use trueup::motion::Robot;
use trueup::motion::dynamics::{Bodies, Dynamics, GRAVITY};

/// A step of finite differences, rad: central ones are then good to about 1e-9.
const STEP: f64 = 1e-5;
/// How well finite differences of energies agree with torques here, N·m and J.
const AGREES: f64 = 1e-6;

/// A robot of links `NAME KG`, each with its mass 0.1 m ahead, and joints
/// `NAME KIND PARENT CHILD | ORIGIN | AXIS | LEADER FACTOR OFFSET`, the last part for one that follows.
fn urdf(links: &[(&str, f64)], joints: &[&str]) -> String {
    let mut text = String::from("<robot name=\"r\">");
    for (name, mass) in links {
        let _ = write!(
            text,
            "<link name=\"{name}\"><inertial><origin xyz=\"0.03 0 0.1\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.02\" iyy=\"0.03\" izz=\"0.01\" ixy=\"0\" ixz=\"0.002\" iyz=\"0\"/></inertial></link>"
        );
    }
    for joint in joints {
        let parts: Vec<&str> = joint.split('|').map(str::trim).collect();
        let words: Vec<&str> = parts[0].split(' ').collect();
        let &[name, kind, parent, child] = words.as_slice() else { panic!("{joint}") };
        let mimic = parts.get(3).map(|part| {
            let words: Vec<&str> = part.split(' ').collect();
            let &[leader, factor, offset] = words.as_slice() else { panic!("{joint}") };
            format!("<mimic joint=\"{leader}\" multiplier=\"{factor}\" offset=\"{offset}\"/>")
        });
        let (lower, upper) = if kind == "prismatic" { ("0", "0.04") } else { ("-2", "2") };
        let _ = write!(
            text,
            "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{}\"/><axis xyz=\"{}\"/><limit lower=\"{lower}\" upper=\"{upper}\" effort=\"50\" velocity=\"2\"/>\
             {}</joint>",
            parts[1],
            parts[2],
            mimic.unwrap_or_default()
        );
    }
    text + "</robot>"
}

/// A palletizer: a rod beside the upper arm turns as the upper arm does. With or without two fingers.
fn palletizer(has_fingers: bool) -> String {
    let mut links = vec![
        ("base", 1.0),
        ("a", 5.0),
        ("upper", 5.0),
        ("fore", 3.0),
        ("wrist", 1.0),
        ("flange", 0.3),
        ("rod", 1.0),
    ];
    let mut joints = vec![
        "j1 revolute base a | 0 0 0.2 | 0 0 1",
        "j2 revolute a upper | 0.1 0 0.3 | 0 1 0",
        "j3 revolute upper fore | 0 0 0.6 | 0 1 0",
        "j5 revolute fore wrist | 0.6 0 0 | 0 1 0",
        "j6 revolute wrist flange | 0 0 -0.1 | 0 0 1",
        "rod revolute a rod | -0.1 0 0.3 | 0 1 0 | j2 1 0",
    ];
    if has_fingers {
        links.extend([("left", 0.1), ("right", 0.1)]);
        joints.push("l prismatic flange left | 0 0 0.1 | 1 0 0");
        joints.push("r prismatic flange right | 0 0 0.1 | -1 0 0 | l 1 0");
    }
    urdf(&links, &joints)
}

/// Returns the energy of all bodies in gravity, J.
fn potential(robot: &Robot, q: &[f64]) -> f64 {
    let poses = robot.link_poses(q, 0.0).unwrap();
    let bodies = robot.links().iter().zip(&poses);
    let height = |com: Vector3<f64>, at: &Isometry3<f64>| (at * Point3::from(com)).z;
    bodies
        .filter_map(|(link, pose)| {
            link.inertial.map(|own| own.mass * GRAVITY * height(own.com, pose))
        })
        .sum()
}

/// Returns the energy of all bodies that move with joint speeds `dq`, J.
fn kinetic(robot: &Robot, q: &[f64], dq: &[f64]) -> f64 {
    let moved = |by: f64| -> Vec<f64> { q.iter().zip(dq).map(|(q, dq)| q + by * dq).collect() };
    let [before, after] = [-STEP, STEP].map(|by| robot.link_poses(&moved(by), 0.0).unwrap());
    let mut energy = 0.0;
    for (link, (before, after)) in robot.links().iter().zip(before.iter().zip(&after)) {
        let Some(own) = link.inertial else { continue };
        let com = Point3::from(own.com);
        let speed = (after * com - before * com) / (2.0 * STEP);
        let turn = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * STEP);
        energy += 0.5 * own.mass * speed.norm_squared() + 0.5 * turn.dot(&(own.inertia * turn));
    }
    energy
}

/// Holds torques and mass matrix of a robot to its energies.
fn agrees_with_its_energies(robot: &Robot, q: &[f64]) {
    let dynamics = Dynamics::new(robot, Bodies::All);
    let gravity = dynamics.gravity_torques(q).unwrap();
    for joint in 0..robot.n_joints() {
        let at = |by: f64| {
            let mut q = q.to_vec();
            q[joint] += by;
            potential(robot, &q)
        };
        let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        assert!((slope - gravity[joint]).abs() < AGREES, "joint {joint}: {slope} for {gravity}");
    }
    let dq: Vec<f64> = (0..q.len()).map(|joint| 0.7 - 0.4 * joint as f64).collect();
    let speeds = DVector::from_column_slice(&dq);
    let mass = dynamics.mass_matrix(q).unwrap();
    let (energy, told) = (kinetic(robot, q, &dq), 0.5 * speeds.dot(&(mass * &speeds)));
    assert!((energy - told).abs() < AGREES, "{energy} J for {told} J");
}

/// A rod beside the arm took the joint it follows out of the arm: "5 numbers where 4 are needed".
#[test]
fn a_rod_beside_the_arm_moves_with_it_and_takes_no_joint_from_it() {
    let q = [0.1, 0.2, 0.3, 0.4, 0.5];
    for (has_fingers, tip) in
        [(false, Some("flange")), (false, None), (true, Some("flange")), (true, None)]
    {
        let robot = Robot::from_urdf(&palletizer(has_fingers), tip).unwrap();
        let names: Vec<&str> = robot.joints().iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names, ["j1", "j2", "j3", "j5", "j6"]);
        assert_eq!(robot.links()[robot.tip()].name, "flange");
        assert!(robot.notes().is_empty(), "{:?}", robot.notes());
        assert_eq!(robot.pair().is_some(), has_fingers);
        if has_fingers {
            assert!((robot.max_opening() - 0.08).abs() < 1e-12);
        }
        let poses = robot.link_poses(&q, 0.0).unwrap();
        let [upper, rod] = ["upper", "rod"].map(|name| poses[robot.link(name).unwrap()].rotation);
        assert!(upper.angle_to(&rod) < 1e-12);
        // Upper arm, forearm and wrist in the plane that the base turns.
        let (two, three) = (q[1] + q[2], q[1] + q[2] + q[3]);
        let out = 0.1 + 0.6 * f64::sin(q[1]) + 0.6 * f64::cos(two) - 0.1 * f64::sin(three);
        let up = 0.5 + 0.6 * f64::cos(q[1]) - 0.6 * f64::sin(two) - 0.1 * f64::cos(three);
        let tip = robot.forward(&q).unwrap().origin();
        let expected = Vector3::new(out * f64::cos(q[0]), out * f64::sin(q[0]), up);
        assert!((tip - expected).norm() < 1e-12, "{tip:?} for {expected}");
        agrees_with_its_energies(&robot, &q);
    }
}

#[test]
fn the_last_joint_before_the_tip_is_the_arms_where_something_turns_beside_it() {
    let text = urdf(
        &[("base", 1.0), ("a", 5.0), ("b", 3.0), ("s", 4.0)],
        &[
            "j1 revolute base a | 0 0 0.2 | 0 1 0",
            "j2 revolute a b | 0.1 0 0.3 | 0 1 0",
            "js revolute a s | 0 0 0.1 | 0 1 0 | j2 -1 0",
        ],
    );
    let robot = Robot::from_urdf(&text, Some("b")).unwrap();
    assert_eq!(robot.n_joints(), 2);
    agrees_with_its_energies(&robot, &[0.3, 0.4]);
}

/// The factor and summand of a joint that follows a follower were left out: gravity was 9 % off.
#[test]
fn a_joint_that_follows_a_follower_moves_by_both_factors() {
    let text = urdf(
        &[("base", 1.0), ("a", 5.0), ("b", 3.0), ("c", 2.0), ("d", 1.0), ("e", 1.0)],
        &[
            "j1 revolute base a | 0 0 0.2 | 0 0 1",
            "j2 revolute a b | 0.1 0 0.3 | 0 1 0",
            "j3 revolute b c | 0 0 0.4 | 0 1 0 | j2 0.5 0.2",
            "j4 revolute c d | 0.3 0 0 | 0 1 0 | j3 -2 0.1",
            "j5 revolute b e | 0.1 0 0 | 1 0 0 | j4 3 0",
        ],
    );
    let robot = Robot::from_urdf(&text, Some("d")).unwrap();
    assert_eq!(robot.n_joints(), 2);
    let q = [0.3, 0.4];
    // j3 = 0.5 q + 0.2 and j4 = -2 j3 + 0.1 = -q - 0.3: with q itself 0.5 q - 0.1.
    let turn = robot.forward(&q).unwrap().rotation();
    let expected = UnitQuaternion::from_euler_angles(0.0, 0.5 * 0.4 - 0.1, 0.3);
    assert!(turn.angle_to(&expected) < 1e-12, "{turn}");
    agrees_with_its_energies(&robot, &q);
    let (jacobian, ahead) = (robot.jacobian(&q).unwrap(), [q[0], q[1] + STEP]);
    let behind = [q[0], q[1] - STEP];
    let [ahead, behind] = [ahead, behind].map(|q| robot.forward(&q).unwrap());
    let turned = (ahead.rotation() * behind.rotation().inverse()).scaled_axis() / (2.0 * STEP);
    assert!((turned - jacobian.fixed_view::<3, 1>(3, 1)).norm() < 1e-8, "{jacobian}");
}

/// What leads stands beside the way: the joint on it stayed where it was, and q had no number for it.
#[test]
fn a_joint_on_the_way_that_follows_one_beside_it_is_an_entry_of_q() {
    let text = urdf(
        &[("base", 1.0), ("a", 5.0), ("b", 3.0), ("c", 2.0), ("s", 1.0)],
        &[
            "j1 revolute base a | 0 0 0.2 | 0 0 1",
            "js revolute base s | 0 0 0.2 | 0 1 0",
            "j2 revolute a b | 0.1 0 0.3 | 0 1 0 | js 0.5 0.2",
            "j3 revolute b c | 0 0 0.4 | 0 1 0",
        ],
    );
    for tip in [None, Some("c")] {
        let robot = Robot::from_urdf(&text, tip).unwrap();
        let names: Vec<&str> = robot.joints().iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names, ["j1", "j2", "j3"]);
        let poses = robot.link_poses(&[0.0, 0.4, 0.0], 0.0).unwrap();
        // 0.5 js + 0.2 = 0.4.
        let led = poses[robot.link("s").unwrap()].rotation;
        assert!((led.scaled_axis() - Vector3::new(0.0, 0.4, 0.0)).norm() < 1e-12, "{led}");
        agrees_with_its_energies(&robot, &[0.1, 0.4, -0.3]);
    }
}

/// Jaws are not part of q, wherever the tip is.
#[test]
fn a_tip_on_a_finger_makes_no_joint_of_it() {
    let robot = Robot::from_urdf(&palletizer(true), Some("left")).unwrap();
    assert_eq!(robot.n_joints(), 5);
    assert!(robot.pair().is_some());
    assert_eq!(Robot::gen3_to("left_jaw_link").unwrap().n_joints(), 7);
}

#[test]
fn a_joint_that_follows_itself_or_nobody_is_named() {
    let links = [("a", 1.0), ("b", 1.0), ("c", 1.0)];
    for (first, second, expected) in [
        (
            "j1 revolute a b | 0 0 0.2 | 0 0 1 | nope 1 0",
            "j2 revolute b c | 0 0 0.2 | 0 0 1",
            "joint j1 mimics nope, which does not exist",
        ),
        (
            "j1 revolute a b | 0 0 0.2 | 0 0 1 | nope 1 0",
            "j2 revolute b c | 0 0 0.2 | 0 0 1 | j1 1 0",
            "joint j1 mimics nope, which does not exist",
        ),
        (
            "j1 revolute a b | 0 0 0.2 | 0 0 1",
            "j2 revolute b c | 0 0 0.2 | 0 0 1 | j2 1 0",
            "joint j2 mimics itself",
        ),
        (
            "j1 revolute a b | 0 0 0.2 | 0 0 1 | j2 1 0",
            "j2 revolute b c | 0 0 0.2 | 0 0 1 | j1 1 0",
            "joints j1, j2 mimic each other in a circle",
        ),
    ] {
        for tip in [None, Some("c")] {
            let told = Robot::from_urdf(&urdf(&links, &[first, second]), tip).unwrap_err();
            assert!(told.to_string().ends_with(expected), "{told}");
        }
    }
}
