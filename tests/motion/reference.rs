//! The stdlib Gen3 against reference values, computed elsewhere (Pinocchio, `MuJoCo`) on Kinova's numbers.
//!
//! `reference.csv`: five configurations; `g_V12` for the bracelet the stdlib URDF carries, `g_K`, `nle_K`
//! and `M_K` for the bracelet that Kinova's ROS package prints, whose centre of mass has the other sign.

use std::collections::BTreeMap;

use trueup::motion::Robot;
use trueup::motion::dynamics::{Bodies, Dynamics};

type Row = BTreeMap<String, String>;

fn rows() -> Vec<Row> {
    csv::Reader::from_reader(include_str!("reference.csv").as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .unwrap()
}

fn number(row: &Row, key: &str) -> f64 {
    row[key].parse().unwrap()
}

fn joints(row: &Row, prefix: &str) -> Vec<f64> {
    (1..=7).map(|i| number(row, &format!("{prefix}{i}"))).collect()
}

/// The stdlib arm with the bracelet of Kinova's ROS package.
fn gen3_with_published_bracelet() -> Robot {
    let urdf = include_str!("../../stdlib/robots/gen3_2f85/gen3_2f85.urdf");
    let published = urdf
        .replace("-0.000281 -0.011402 -0.029798", "0.000281 0.011402 -0.029798")
        .replace("<mass value=\"0.5006\"/>", "<mass value=\"0.5\"/>")
        .replace("iyz=\"0.000118\" izz=\"0.000609\"", "iyz=\"-0.000118\" izz=\"0.000609\"");
    assert_ne!(urdf, published);
    Robot::from_urdf(&published, None).unwrap()
}

#[test]
fn the_flange_is_where_pinocchio_and_mujoco_put_it() {
    let robot = Robot::gen3();
    for row in rows() {
        let pose = robot.forward(&joints(&row, "q")).unwrap();
        let p = pose.origin();
        for (ours, key) in [(p.x, "px"), (p.y, "py"), (p.z, "pz")] {
            // The table prints 12 significant digits.
            assert!((ours - number(&row, key)).abs() < 1e-11, "{}: {key}", row["name"]);
        }
        let r = pose.rotation();
        let theirs = ["qw", "qx", "qy", "qz"].map(|key| number(&row, key));
        let dot = r.w * theirs[0] + r.i * theirs[1] + r.j * theirs[2] + r.k * theirs[3];
        assert!((dot.abs() - 1.0).abs() < 1e-11, "{}: rotation", row["name"]);
    }
}

#[test]
fn the_jacobian_agrees_with_the_reference() {
    let robot = Robot::gen3();
    for row in rows() {
        let jacobian = robot.jacobian(&joints(&row, "q")).unwrap();
        for i in 0..6 {
            for j in 0..7 {
                let theirs = number(&row, &format!("J{}{}", i + 1, j + 1));
                assert!((jacobian[(i, j)] - theirs).abs() < 1e-10, "{}: J{i}{j}", row["name"]);
            }
        }
    }
}

#[test]
fn gravity_torques_of_the_bare_arm_agree() {
    let robot = Robot::gen3();
    let dynamics = Dynamics::new(&robot, Bodies::UpToTip);
    let published = gen3_with_published_bracelet();
    let dynamics_k = Dynamics::new(&published, Bodies::UpToTip);
    for row in rows() {
        let q = joints(&row, "q");
        for (ours, prefix) in [
            (dynamics.gravity_torques(&q).unwrap(), "g_V12_"),
            (dynamics_k.gravity_torques(&q).unwrap(), "g_K_"),
        ] {
            for (i, theirs) in joints(&row, prefix).iter().enumerate() {
                assert!((ours[i] - theirs).abs() < 1e-9, "{} {prefix}{i}", row["name"]);
            }
        }
    }
}

#[test]
fn mass_matrix_and_bias_torques_agree() {
    let robot = gen3_with_published_bracelet();
    let dynamics = Dynamics::new(&robot, Bodies::UpToTip);
    for row in rows() {
        let q = joints(&row, "q");
        let mass = dynamics.mass_matrix(&q).unwrap();
        for i in 0..7 {
            for j in i..7 {
                let theirs = number(&row, &format!("M_K_{}{}", i + 1, j + 1));
                assert!((mass[(i, j)] - theirs).abs() < 1e-9, "{}: M{i}{j}", row["name"]);
                assert!((mass[(i, j)] - mass[(j, i)]).abs() < 1e-15);
            }
        }
        let dq = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7];
        let bias = dynamics.bias(&q, &dq).unwrap();
        for (i, theirs) in joints(&row, "nle_K_").iter().enumerate() {
            assert!((bias[i] - theirs).abs() < 1e-9, "{}: bias {i}", row["name"]);
        }
    }
}

#[test]
fn the_tool_is_12_cm_past_the_flange_and_the_gripper_weighs_its_share() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap();
    let tool = robot.forward_tool(home).unwrap().origin();
    // Kinova's Home as their web page shows it.
    assert!((tool - nalgebra::Vector3::new(0.576_665, 0.001_350, 0.433_724)).norm() < 1e-6);
    let bare = Dynamics::new(&robot, Bodies::UpToTip);
    let all = Dynamics::new(&robot, Bodies::All);
    assert!((all.mass() - bare.mass() - 0.925).abs() < 1e-9);
}
