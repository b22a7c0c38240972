//! Robots other than the Gen3, and files that are wrong.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::{Error, Robot};

/// Two links of 1 m in the xz-plane, a point-like mass of 2 kg at each end, jaws at the tip.
pub(super) const TWO_LINKS: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="1 0 0"/><mass value="2"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="1 0 0"/><mass value="2"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <link name="hand"/><link name="left"/><link name="right"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" velocity="1" effort="10"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="1 0 0"/>
    <axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="2" effort="10"/></joint>
  <joint name="h" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="1 0 0"/></joint>
  <joint name="l" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" velocity="1" effort="1"/></joint>
  <joint name="r" type="prismatic"><parent link="hand"/><child link="right"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="0.04" velocity="1" effort="1"/><mimic joint="l"/></joint>
</robot>"#;

#[test]
fn jaws_are_not_part_of_q_and_follow_the_opening() {
    let robot = Robot::from_urdf(TWO_LINKS, None).unwrap();
    assert_eq!(robot.n_joints(), 2);
    assert_eq!(robot.links()[robot.tip()].name, "hand");
    assert!((robot.max_opening() - 0.08).abs() < 1e-15);
    let poses = robot.link_poses(&[0.0, 0.0], 0.05).unwrap();
    let left = poses[robot.link("left").unwrap()].translation.vector;
    let right = poses[robot.link("right").unwrap()].translation.vector;
    assert!((left - Vector3::new(2.0, 0.025, 0.0)).norm() < 1e-15);
    assert!((left - right - Vector3::new(0.0, 0.05, 0.0)).norm() < 1e-15);
}

/// Closed forms of the planar arm, Siciliano et al., §7.3.2, with point masses at the link ends.
#[test]
fn a_planar_arm_has_its_textbook_dynamics() {
    let robot = Robot::from_urdf(TWO_LINKS, None).unwrap();
    let dynamics = Dynamics::new(&robot, Bodies::All);
    let (a, b): (f64, f64) = (0.3, 0.9);
    let (m, g) = (2.0, 9.81);
    let gravity = dynamics.gravity_torques(&[a, b]).unwrap();
    assert!((gravity[0] - m * g * (2.0 * a.cos() + (a + b).cos())).abs() < 1e-12);
    assert!((gravity[1] - m * g * (a + b).cos()).abs() < 1e-12);
    let mass = dynamics.mass_matrix(&[a, b]).unwrap();
    assert!((mass[(0, 0)] - m * (3.0 + 2.0 * b.cos())).abs() < 1e-12);
    assert!((mass[(0, 1)] - m * (1.0 + b.cos())).abs() < 1e-12);
    assert!((mass[(1, 1)] - m).abs() < 1e-12);
    // Coriolis and centrifugal: h = -m sin b; c = [h db (2 da + db), -h da²].
    let (da, db) = (0.7, -1.1);
    let extra = dynamics.bias(&[a, b], &[da, db]).unwrap() - gravity;
    let h = -m * b.sin();
    assert!((extra[0] - h * db * (2.0 * da + db)).abs() < 1e-12);
    assert!((extra[1] + h * da * da).abs() < 1e-12);
    // Forward undoes inverse.
    let tau = dynamics.inverse(&[a, b], &[da, db], &[0.4, -2.0]).unwrap();
    let ddq = dynamics.forward(&[a, b], &[da, db], tau.as_slice()).unwrap();
    assert!((ddq[0] - 0.4).abs() < 1e-12 && (ddq[1] + 2.0).abs() < 1e-12);
}

#[test]
fn the_jacobian_is_the_derivative_and_its_rate_too() {
    let robot = Robot::gen3();
    let q = [0.3, -0.5, 0.9, 1.2, -0.4, 0.8, 2.0];
    let dq = [0.5, -0.3, 0.8, 0.2, -0.9, 0.4, 0.7];
    let step = 1e-6;
    let ahead: Vec<f64> = q.iter().zip(&dq).map(|(q, dq)| q + step * dq).collect();
    let behind: Vec<f64> = q.iter().zip(&dq).map(|(q, dq)| q - step * dq).collect();
    let dq = nalgebra::DVector::from_column_slice(&dq);
    let twist = robot.jacobian(&q).unwrap() * &dq;
    let p = |q: &[f64]| robot.forward(q).unwrap();
    let v = (p(&ahead).origin() - p(&behind).origin()) / (2.0 * step);
    let turn =
        (p(&ahead).rotation() * p(&behind).rotation().inverse()).scaled_axis() / (2.0 * step);
    // Central differences at 1e-6 are good to about 1e-9.
    assert!((v - twist.fixed_rows::<3>(0)).norm() < 1e-8);
    assert!((turn - twist.fixed_rows::<3>(3)).norm() < 1e-8);
    let j = |q: &[f64]| robot.jacobian(q).unwrap() * &dq;
    let rate = (j(&ahead) - j(&behind)) / (2.0 * step);
    assert!((rate - robot.jacobian_rate(&q, dq.as_slice()).unwrap()).norm() < 1e-8);
}

#[test]
fn a_joint_that_mimics_another_on_the_way_shares_its_entry_of_q() {
    let coupled = TWO_LINKS.replace(
        "<axis xyz=\"0 -1 0\"/><limit lower=\"-3\" upper=\"3\" velocity=\"2\" effort=\"10\"/>",
        "<axis xyz=\"0 -1 0\"/><limit lower=\"-3\" upper=\"3\" velocity=\"2\" effort=\"10\"/>\
         <mimic joint=\"a\" multiplier=\"-1\"/>",
    );
    let robot = Robot::from_urdf(&coupled, None).unwrap();
    assert_eq!(robot.n_joints(), 1);
    let tip = robot.forward(&[FRAC_PI_2]).unwrap().origin();
    assert!((tip - Vector3::new(1.0, 0.0, 1.0)).norm() < 1e-12);
    let jacobian = robot.jacobian(&[FRAC_PI_2]).unwrap();
    assert!((jacobian[(0, 0)] + 1.0).abs() < 1e-12 && jacobian[(4, 0)].abs() < 1e-12);
}

#[test]
fn wrong_files_say_what_is_wrong() {
    let fails = |text: &str, tip: Option<&str>, part: &str| {
        let message = Robot::from_urdf(text, tip).unwrap_err().to_string();
        assert!(message.contains(part), "{message:?} should mention {part:?}");
    };
    fails("not xml", None, "URDF");
    fails("<robot name=\"r\"/>", None, "no <link>");
    fails(TWO_LINKS, Some("elbow"), "no link elbow; it has base, upper");
    fails(TWO_LINKS, Some("base"), "no joint moves");
    fails(
        &TWO_LINKS.replace("<child link=\"fore\"/>", "<child link=\"upper\"/>"),
        None,
        "two joints",
    );
    fails(&TWO_LINKS.replace("<parent link=\"base\"/>", "<parent link=\"hand\"/>"), None, "loop");
    fails(&TWO_LINKS.replace("<child link=\"hand\"/>", "<child link=\"foot\"/>"), None, "foot");
    fails(&TWO_LINKS.replace("mimic joint=\"l\"", "mimic joint=\"x\""), None, "mimics x");
    fails(
        &TWO_LINKS.replace("name=\"b\" type=\"revolute\"", "name=\"b\" type=\"floating\""),
        None,
        "Floating",
    );
    let robot = Robot::gen3();
    assert_eq!(robot.forward(&[0.0; 6]), Err(Error::WrongLength { expected: 7, found: 6 }));
    assert!(matches!(robot.forward(&[f64::NAN; 7]), Err(Error::NotFinite { .. })));
    assert!(matches!(
        Robot::from_file(std::path::Path::new("no/such.urdf"), None),
        Err(Error::File { .. })
    ));
}
