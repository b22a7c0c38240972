//! Robots other than the Gen3, and files that are wrong.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::{Error, Robot};

/// Two links of 1 m in the xz-plane, a point-like mass of 2 kg at each end, jaws at the tip.
pub(crate) const TWO_LINKS: &str = r#"<robot name="two">
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

/// Two fingers along one axis, the second with `multiplier="-1"`, as Interbotix writes them, "do not move alike".
#[test]
fn jaws_are_the_same_whichever_way_their_file_counts() {
    let right = "<axis xyz=\"0 -1 0\"/>\n    <limit lower=\"0\" upper=\"0.04\" velocity=\"1\" effort=\"1\"/><mimic joint=\"l\"/>";
    let left = "<axis xyz=\"0 1 0\"/>\n    <limit lower=\"0\" upper=\"0.04\"";
    let written = |left_as: &str, right_as: &str| {
        assert_eq!((TWO_LINKS.matches(left).count(), TWO_LINKS.matches(right).count()), (1, 1));
        let text = TWO_LINKS.replace(left, left_as).replace(right, right_as);
        Robot::from_urdf(&text, None).unwrap()
    };
    let finger = |axis: f64, range: [f64; 2], mimic: &str| {
        let [lower, upper] = range;
        format!(
            "<axis xyz=\"0 {axis} 0\"/><limit lower=\"{lower}\" upper=\"{upper}\" velocity=\"1\" effort=\"1\"/>{mimic}"
        )
    };
    let mirrored = "<mimic joint=\"l\" multiplier=\"-1\"/>";
    let shifted = "<mimic joint=\"l\" multiplier=\"-1\" offset=\"0.04\"/>";
    let inwards = "<axis xyz=\"0 -1 0\"/>\n    <limit lower=\"-0.04\" upper=\"0\"";
    for robot in [
        written(left, &finger(1.0, [-0.04, 0.0], mirrored)),
        written(inwards, &finger(-1.0, [0.0, 0.04], mirrored)),
    ] {
        assert!((robot.max_opening() - 0.08).abs() < 1e-15 && robot.min_opening().abs() < 1e-15);
        assert!(robot.pair().is_some());
        let poses = robot.link_poses(&[0.0, 0.0], 0.05).unwrap();
        let [left, right] =
            ["left", "right"].map(|name| poses[robot.link(name).unwrap()].translation.vector);
        assert!((left - Vector3::new(2.0, 0.025, 0.0)).norm() < 1e-15, "{left}");
        assert!((right - Vector3::new(2.0, -0.025, 0.0)).norm() < 1e-15, "{right}");
    }
    // Counted from 40 mm farther, which the opening knows nothing of.
    let robot = written(left, &finger(1.0, [0.0, 0.04], shifted));
    assert!(robot.pair().is_some() && (robot.max_opening() - 0.08).abs() < 1e-15);
    let poses = robot.link_poses(&[0.0, 0.0], 0.05).unwrap();
    let right = poses[robot.link("right").unwrap()].translation.vector;
    assert!((right - Vector3::new(2.0, 0.015, 0.0)).norm() < 1e-15, "{right}");
    // Two that go the same way are no jaws.
    assert!(written(left, &finger(1.0, [0.0, 0.04], "<mimic joint=\"l\"/>")).pair().is_none());
    // Pads 13 mm before where a finger's link is, which ends 21 mm from the middle.
    let pad = |side: f64| {
        let at = -0.011 * side;
        format!(
            "<collision><origin xyz=\"0 {at} 0\"/><geometry><box size=\"0.02 0.004 0.02\"/></geometry></collision></link>"
        )
    };
    let text =
        TWO_LINKS.replace("lower=\"0\" upper=\"0.04\"", "lower=\"0.021\" upper=\"0.057\"").replace(
            "<link name=\"left\"/><link name=\"right\"/>",
            &format!("<link name=\"left\">{}<link name=\"right\">{}", pad(1.0), pad(-1.0)),
        );
    let robot = Robot::from_urdf(&text, None).unwrap();
    let openings = [robot.min_opening(), robot.max_opening()];
    assert!((openings[0] - 0.016).abs() < 1e-12 && (openings[1] - 0.088).abs() < 1e-12);
    let poses = robot.link_poses(&[0.0, 0.0], 0.0).unwrap();
    let left = poses[robot.link("left").unwrap()].translation.vector;
    assert!((left - Vector3::new(2.0, 0.021, 0.0)).norm() < 1e-12, "{left}");
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
fn a_hanging_links_torque_is_its_weight_times_its_lever() {
    // One link on a horizontal axis: tau = m g l cos(q), plus the inertia m l² + I when accelerated.
    let text = r#"<robot name="pendulum">
      <link name="base"/>
      <link name="rod"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
        <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
      <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/>
        <axis xyz="0 -1 0"/><limit effort="50" velocity="5"/></joint>
      <link name="left"/><link name="right"/>
      <joint name="l" type="prismatic"><parent link="rod"/><child link="left"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
      <joint name="r" type="prismatic"><parent link="rod"/><child link="right"/><axis xyz="-1 0 0"/>
        <limit lower="0" upper="0.04" effort="1" velocity="1"/><mimic joint="l"/></joint>
    </robot>"#;
    let robot = Robot::from_urdf(text, Some("rod")).unwrap();
    let dynamics = Dynamics::new(&robot, Bodies::All);
    for (q, ddq) in [(0.0, 0.0), (0.7, 0.0), (1.2, 3.0), (-2.0, -1.5)] {
        let tau = dynamics.inverse(&[q], &[0.4], &[ddq]).unwrap();
        let expected = 2.0 * 9.81 * 0.3 * f64::cos(q) + (2.0 * 0.09 + 0.02) * ddq;
        assert!((tau[0] - expected).abs() < 1e-12, "{} for {expected}", tau[0]);
    }
}

#[test]
fn a_robot_with_other_zeros_stands_where_its_file_says_it_would_at_the_offsets() {
    let robot = Robot::gen3();
    let offsets = [0.02, -0.01, 0.03, 0.005, -0.02, 0.01, 0.04];
    let off = robot.clone().with_zero_offsets(&offsets);
    let q = [0.3, -0.5, 0.9, 1.2, -0.4, 0.8, 2.0];
    let really: Vec<f64> = q.iter().zip(offsets).map(|(q, offset)| q + offset).collect();
    let (a, b) = (off.link_poses(&q, 0.03).unwrap(), robot.link_poses(&really, 0.03).unwrap());
    for (a, b) in a.iter().zip(&b) {
        assert!((a.to_homogeneous() - b.to_homogeneous()).norm() < 1e-12);
    }
    assert_eq!(robot.clone().with_zero_offsets(&[]), robot);
}

#[test]
fn a_shifted_mounting_carries_tool_jaws_and_marker_with_it() {
    let robot = Robot::gen3();
    let shift = Vector3::new(0.002, -0.003, 0.001);
    let off = robot.clone().with_tool_shift(shift);
    let moved = off.flange_from_tool().origin() - robot.flange_from_tool().origin();
    assert!((moved - shift).norm() < 1e-12);
    let ball = |robot: &Robot| robot.marker_in_flange().unwrap().coords();
    assert!((ball(&off) - ball(&robot) - shift).norm() < 1e-12);
    let q = [0.3, -0.5, 0.9, 1.2, -0.4, 0.8, 2.0];
    let (a, b) = (off.link_poses(&q, 0.03).unwrap(), robot.link_poses(&q, 0.03).unwrap());
    let in_base = b[robot.tip()].rotation * shift;
    let on_hand = |name: &str| ["gripper", "jaw", "tool"].iter().any(|part| name.contains(part));
    for ((a, b), link) in a.iter().zip(&b).zip(robot.links()) {
        let expected = if on_hand(&link.name) { in_base } else { Vector3::zeros() };
        let moved = a.translation.vector - b.translation.vector;
        assert!((moved - expected).norm() < 1e-12, "{} moved by {moved:?}", link.name);
    }
}

#[test]
fn a_marker_sits_on_a_link_of_the_robot_that_the_opening_does_not_move() {
    let with =
        |marker: &str| Robot::from_urdf_with(TWO_LINKS, &format!("[marker]\n{marker}"), None);
    let ball = "centre_m = [0.1, 0.0, 0.02]\nradius_m = 0.01\ncolour_srgb = [255, 0, 128]";
    let robot = with(&format!("link = \"fore\"\n{ball}")).unwrap();
    let marker = robot.marker().unwrap();
    assert_eq!((marker.link, marker.colour), (robot.link("fore").unwrap(), [255, 0, 128]));
    // The flange, here the hand, stands 1 m along the forearm.
    let seen = robot.marker_in_flange().unwrap().coords();
    assert!((seen - Vector3::new(-0.9, 0.0, 0.02)).norm() < 1e-12, "{seen:?}");
    for (marker, part) in [
        (format!("link = \"left\"\n{ball}"), "moves with the jaws"),
        (format!("link = \"elbow\"\n{ball}"), "no link elbow"),
        (format!("link = \"fore\"\n{}", ball.replace("0.01", "-0.01")), "radius"),
    ] {
        let message = with(&marker).unwrap_err().to_string();
        assert!(message.contains(part), "{message:?} should mention {part:?}");
    }
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
        &TWO_LINKS.replace("joint name=\"b\"", "joint name=\"a\""),
        None,
        "two joints are named a",
    );
    let empty = "<link name=\"left\"><collision><geometry></geometry></collision></link>";
    fails(
        &TWO_LINKS.replace("<link name=\"left\"/>", empty),
        None,
        "line 7: <geometry> of link left has no single shape",
    );
    fails(
        &TWO_LINKS.replace("<link name=\"left\"/>", "<link name=\"left\"><visual/></link>"),
        None,
        "line 7: <visual> of link left has no geometry",
    );
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

/// Nothing could be kept clear of a ball of -0.1 m, which was 151 mm away from all.
#[test]
fn a_collision_shape_that_encloses_nothing_is_refused() {
    let with = |shape: &str| {
        let solid = format!(
            "<link name=\"base\"><collision><geometry>{shape}</geometry></collision></link>"
        );
        Robot::from_urdf(&TWO_LINKS.replace("<link name=\"base\"/>", &solid), None)
    };
    for (shape, expected) in [
        ("<sphere radius=\"-0.1\"/>", "link base: the radius of its collision sphere is -0.1 m"),
        ("<sphere radius=\"0\"/>", "the radius of its collision sphere is 0 m"),
        ("<box size=\"0.1 -0.2 0.1\"/>", "the side along y of its collision box is -0.2 m"),
        ("<cylinder radius=\"0.1\" length=\"0\"/>", "the length of its collision cylinder is 0 m"),
        ("<capsule radius=\"inf\" length=\"1\"/>", "the radius of its collision capsule is inf m"),
    ] {
        let told = with(shape).unwrap_err().to_string();
        assert!(told.ends_with(expected), "{told}");
    }
    assert!(with("<box size=\"0.1 0.2 0.1\"/>").is_ok());
    // What is drawn touches nothing.
    let drawn =
        "<link name=\"base\"><visual><geometry><sphere radius=\"0\"/></geometry></visual></link>";
    assert!(Robot::from_urdf(&TWO_LINKS.replace("<link name=\"base\"/>", drawn), None).is_ok());
}

/// A rail of 2 m, and an arm of two joints on it.
const ON_A_RAIL: &str = r#"<robot name="railed">
  <link name="floor"/><link name="cart"/><link name="upper"/><link name="fore"/>
  <joint name="rail" type="prismatic"><parent link="floor"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="2" velocity="1" effort="100"/></joint>
  <joint name="a" type="revolute"><parent link="cart"/><child link="upper"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" velocity="1" effort="10"/></joint>
  <joint name="b" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="1 0 0"/>
    <axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="2" effort="10"/></joint>
</robot>"#;

/// A rail at 0.5 of `[poses_deg]` stood at 8.7 mm.
#[test]
fn a_named_pose_of_a_rail_is_in_metres() {
    let side = "[poses_deg]\nhome = [0.5, 90, -180]";
    let robot = Robot::from_urdf_with(ON_A_RAIL, side, None).unwrap();
    assert!(robot.slides(0) && !robot.slides(1));
    let home = robot.pose("home").unwrap();
    assert!((home[0] - 0.5).abs() < 1e-15, "{home:?}");
    assert!((home[1] - FRAC_PI_2).abs() < 1e-15 && (home[2] + 2.0 * FRAC_PI_2).abs() < 1e-15);
}

/// `robot.toml` of another arm: what is over was left out without a word. A tip half-way up has fewer joints.
#[test]
fn a_named_pose_has_as_many_numbers_as_the_arm_has_joints() {
    let with = |home: &str, tip| {
        Robot::from_urdf_with(ON_A_RAIL, &format!("[poses_deg]\nhome = {home}"), tip)
    };
    for wrong in ["[0.5, 90]", "[0.5, 90, 0, 0]"] {
        let told = with(wrong, None).unwrap_err().to_string();
        assert!(told.contains("the arm has 3 joints"), "{told}");
    }
    let half = with("[0.5, 90, -180]", Some("upper")).unwrap();
    assert_eq!(half.pose("home").unwrap().len(), 2);
    assert!(with("[0.5, 90, -180, 0]", Some("upper")).is_err());
}

/// A PR2's arms of seven joints hang on a column of one, and its `imu_link` was the end of the chain.
#[test]
fn a_column_that_carries_arms_is_no_arm_and_a_hand_with_fingers_is() {
    let joint = |parent: &str, child: &str, kind: &str| {
        format!(
            r#"<link name="{child}"/><joint name="j_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
            <axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="9"/></joint>"#
        )
    };
    let robot = |joints: &[(&str, &str)]| {
        let moving: String = joints.iter().map(|(a, b)| joint(a, b, "revolute")).collect();
        let rigid = joint("torso", "imu", "fixed");
        let text = format!(r#"<robot name="r"><link name="base"/>{moving}{rigid}</robot>"#);
        Robot::from_urdf(&text, None)
    };
    let arms = [("base", "torso"), ("torso", "l1"), ("l1", "l2"), ("torso", "r1"), ("r1", "r2")];
    let Err(Error::Branches { link, ways }) = robot(&arms) else { panic!("an arm was chosen") };
    assert_eq!((link.as_str(), ways.join(" ").as_str()), ("torso", "l1 r1"));
    let fingers = [("base", "torso"), ("torso", "l1"), ("torso", "r1")];
    let robot = robot(&fingers).unwrap();
    assert_eq!((robot.n_joints(), robot.links()[robot.tip()].name.as_str()), (1, "imu"));
}
