//! Other arms: the stdlib's Panda and `UR5e` against independent numbers, and makers' URDFs with meshes and knuckles.
//!
//! `arms.csv`: poses of the flange. Those of the Panda are Pinocchio's (4.1.0) for the URDF of example-robot-data
//! (commit 39aa9437), which was not read when ours was written; those of the `UR5e` follow from the Denavit-Hartenberg
//! parameters that Universal Robots publishes.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use trueup::motion::collision::CollisionWorld;
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::reserve::Reserve;
use trueup::motion::robot::Drive;
use trueup::motion::solid::Solid;
use trueup::motion::{Robot, ik};
use trueup::workcell::Stdlib;

const REFERENCE: &str = include_str!("arms.csv");

fn robot(name: &str) -> Robot {
    Stdlib::embedded().robot(name).unwrap()
}

#[test]
fn flanges_stand_where_independent_sources_say() {
    let mut n = 0;
    for line in REFERENCE.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let numbers: Vec<f64> = cells[1..].iter().filter_map(|cell| cell.parse().ok()).collect();
        let (q, pose) = numbers.split_at(numbers.len() - 7);
        let flange = robot(cells[0]).forward(q).unwrap();
        let off = (flange.origin() - Vector3::new(pose[0], pose[1], pose[2])).norm();
        // The maker's URDF has its right angles to nine digits.
        assert!(off < 2e-9, "{line}: {off} m");
        let r = flange.rotation();
        let same = r.w * pose[3] + r.i * pose[4] + r.j * pose[5] + r.k * pose[6];
        assert!((same.abs() - 1.0).abs() < 1e-9, "{line}");
        n += 1;
    }
    assert_eq!(n, 12);
}

/// Pinocchio 4.1.0 with the same files: masses and centres are read, and the gripper hangs on the flange.
#[test]
fn gravity_torques_agree_with_pinocchio() {
    let panda = [
        0.0,
        -10.261_715_085_8,
        -3.431_783_565_2,
        20.308_740_331_9,
        0.802_000_918_7,
        2.739_215_547_1,
        -0.018_772_285_9,
    ];
    let ur5e = [0.0, -39.586_387_510_1, -23.217_302_174_9, -2.201_739_877_5, 0.075_254_875_4, 0.0];
    for (name, q, expected) in [
        ("panda", &[0.3, -0.5, 0.2, -1.8, 0.4, 1.9, 0.1][..], &panda[..]),
        ("ur5e_2f85", &[0.3, -1.2, 1.5, -0.4, 1.2, 0.3], &ur5e),
    ] {
        let robot = robot(name);
        let torques = Dynamics::new(&robot, Bodies::All).gravity_torques(q).unwrap();
        for (torque, expected) in torques.iter().zip(expected) {
            assert!((torque - expected).abs() < 1e-7, "{name}: {torques:?}");
        }
    }
}

#[test]
fn the_new_arms_have_all_that_a_pour_needs() {
    for (name, joints, opening) in [("panda", 7, 0.080), ("ur5e_2f85", 6, 0.085)] {
        let robot = robot(name);
        assert_eq!((robot.n_joints(), robot.jaws().count()), (joints, 2), "{name}");
        assert!((robot.max_opening() - opening).abs() < 1e-9, "{name}");
        assert!(robot.notes().is_empty(), "{name}: {:?}", robot.notes());
        let world = CollisionWorld::new(&robot);
        for pose in ["home", "retract"] {
            let q = robot.pose(pose).unwrap();
            assert!(robot.outside_limits(q, 0.0).is_none() && world.free(q), "{name} at {pose}");
        }
    }
    // A Panda's fingertips end 9.5 mm past its tool point, its palm lies 37.4 mm behind.
    let panda = robot("panda");
    assert!((panda.fingers_ahead().unwrap() - 0.0095).abs() < 1e-6);
    assert!((panda.palm().unwrap().z + 0.0374).abs() < 1e-6);
}

/// The box about the upper arm and the cylinder about the base were 2.5 mm apart with the arm up and overlapped by 16 mm with it
/// down, where `ur_description`'s meshes are 17 mm apart: half of all positions were refused, and every margin above 2.5 mm.
#[test]
fn an_upper_arm_swings_past_its_base() {
    let robot = robot("ur5e_2f85");
    let world = CollisionWorld::new(&robot);
    let down = std::f64::consts::FRAC_PI_2;
    for q in [[0.0, down, 0.0, -down, 0.0, 0.0], [0.0, -1.4, 1.4, 0.0, down, 0.0]] {
        assert!(world.distance(&q) > 0.05, "{q:?}: {}", world.distance(&q));
    }
}

/// An arm without a closed form is followed from where it is: the solution a small motion leads to.
#[test]
fn a_descent_stays_near_and_inside_the_reserve() {
    let robot = robot("panda");
    let solver = ik::Solver::new(&robot);
    let mut q = robot.pose("home").unwrap().to_vec();
    let reserve = Reserve { turning: 0.02, sliding: 0.02 };
    for step in 0..40 {
        let mut target = *robot.forward(&q).unwrap().isometry();
        target.translation.vector +=
            Vector3::new(0.004, if step % 2 == 0 { 0.003 } else { 0.0 }, 0.0);
        let next = solver.descend_from(&trueup::world::Pose::new(target), &q, reserve).unwrap();
        let far = q.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 0.05, "step {step}: {far} rad");
        assert!(robot.outside_limits(&next, -0.02 + 1e-12).is_none());
        q = next;
    }
}

/// Writes a box from `low` to `high` as a binary STL.
fn stl(low: [f64; 3], high: [f64; 3]) -> Vec<u8> {
    let corner =
        |k: usize| [0, 1, 2].map(|i| if (k >> i) & 1 == 0 { low[i] } else { high[i] } as f32);
    let faces =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let mut bytes = vec![0; 80];
    bytes.extend(12_u32.to_le_bytes());
    for [a, b, c, d] in faces {
        for triangle in [[a, b, c], [a, c, d]] {
            bytes.extend([0; 12]);
            for number in triangle.into_iter().flat_map(corner) {
                bytes.extend(number.to_le_bytes());
            }
            bytes.extend([0; 2]);
        }
    }
    bytes
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("my_arm/urdf")).unwrap();
    fs::create_dir_all(folder.join("my_arm/meshes")).unwrap();
    folder
}

#[test]
fn meshes_of_a_package_become_solids_and_what_is_not_read_is_named() {
    let folder = folder("motion-meshes");
    let urdf = |file: &str, scale: &str| {
        format!(
            r#"<link name="{file}"><visual><geometry><mesh filename="package://my_arm/meshes/arm.dae"/></geometry></visual>
            <collision><origin xyz="0 0 0.1"/><geometry><mesh filename="package://my_arm/meshes/{file}"{scale}/></geometry></collision></link>"#
        )
    };
    let links = [("arm.stl", r#" scale="0.001 0.001 0.001""#), ("arm.dae", ""), ("none.obj", "")];
    let mut text = "<robot name=\"my_arm\"><link name=\"base\"/>".to_owned();
    let mut parent = "base";
    for (file, scale) in links {
        text += &urdf(file, scale);
        let _ = write!(
            text,
            r#"<joint name="j_{file}" type="revolute"><parent link="{parent}"/><child link="{file}"/>
            <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="9"/></joint>"#
        );
        parent = file;
    }
    let path = folder.join("my_arm/urdf/my_arm.urdf");
    fs::write(&path, text + "</robot>").unwrap();
    let (low, high) = ([-50.0, -20.0, 0.0], [350.0, 20.0, 60.0]);
    fs::write(folder.join("my_arm/meshes/arm.stl"), stl(low, high)).unwrap();
    fs::write(folder.join("my_arm/meshes/arm.dae"), "<COLLADA/>").unwrap();

    let robot = Robot::from_file(&path, None).unwrap();
    let link = &robot.links()[robot.link("arm.stl").unwrap()];
    let [solid] = link.collision[..] else { panic!("{:?}", link.collision) };
    let Solid::Cuboid { half } = solid.solid else { panic!("{solid:?}") };
    assert!((half - Vector3::new(0.2, 0.02, 0.03)).amax() < 1e-6, "{half:?}");
    let middle = solid.pose * Point3::origin();
    assert!((middle.coords - Vector3::new(0.15, 0.0, 0.13)).norm() < 1e-6, "{middle:?}");
    // What is drawn as a mesh is drawn as it collides.
    assert_eq!(link.visual.len(), 1);
    let notes: Vec<String> = robot.notes().iter().map(ToString::to_string).collect();
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("arm.dae") && notes[0].contains("dae is not read"), "{notes:?}");
    assert!(notes[1].contains("none.obj") && notes[1].contains("not found"), "{notes:?}");
    // The folder of the URDF will do for its name.
    assert_eq!(Robot::from_file(path.parent().unwrap(), None).unwrap(), robot);
    // Where links are needs no mesh.
    let bare = Robot::bare_from_file(&path, None, true).unwrap();
    assert!(bare.links().iter().all(|link| link.collision.is_empty()));
    let tip = |robot: &Robot| *robot.forward(&[0.1, 0.2, 0.3]).unwrap().isometry();
    assert_eq!(tip(&bare), tip(&robot));
}

/// The knuckles of a 2F-85 as `ros2_robotiq_gripper` has them, with the box about the mesh of a fingertip.
fn knuckles() -> String {
    let mut text = r#"<robot name="g"><link name="base"/><link name="hand"/>
      <joint name="j" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
        <limit lower="-3" upper="3" velocity="1" effort="9"/></joint>"#
        .to_owned();
    for (side, s, turn) in
        [("left", 1.0, "lower=\"0\" upper=\"0.8\""), ("right", -1.0, "lower=\"-0.8\" upper=\"0\"")]
    {
        let mimic =
            |factor: f64| format!(r#"<mimic joint="left_knuckle_joint" multiplier="{factor}"/>"#);
        let lead = if side == "left" { String::new() } else { mimic(-1.0) };
        let back =
            if side == "left" { "lower=\"-0.8\" upper=\"0\"" } else { "lower=\"0\" upper=\"0.8\"" };
        let _ = write!(
            text,
            r#"<link name="{side}_knuckle"/><link name="{side}_finger"/><link name="{side}_inner"/>
            <link name="{side}_tip"><inertial><mass value="0.04"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
              <collision><origin xyz="{x} 0 0.0225"/><geometry><box size="0.0313 0.027 0.057"/></geometry></collision></link>
            <joint name="{side}_knuckle_joint" type="revolute"><parent link="hand"/><child link="{side}_knuckle"/><axis xyz="0 -1 0"/>
              <origin xyz="{a} 0 0.05490452"/><limit {turn} velocity="0.5" effort="50"/>{lead}</joint>
            <joint name="{side}_finger_joint" type="fixed"><parent link="{side}_knuckle"/><child link="{side}_finger"/><origin xyz="{b} 0 -0.00376347"/></joint>
            <joint name="{side}_inner_joint" type="revolute"><parent link="hand"/><child link="{side}_inner"/><axis xyz="0 -1 0"/>
              <origin xyz="{c} 0 0.06142"/><limit {turn} velocity="0.5" effort="50"/>{inner}</joint>
            <joint name="{side}_tip_joint" type="revolute"><parent link="{side}_finger"/><child link="{side}_tip"/><axis xyz="0 -1 0"/>
              <origin xyz="{d} 0 0.04718515"/><limit {back} velocity="0.5" effort="50"/>{tip}</joint>"#,
            x = -s * 0.00965,
            a = s * 0.030_601_14,
            b = s * 0.031_526_16,
            c = s * 0.0127,
            d = s * 0.005_631_34,
            inner = mimic(s),
            tip = mimic(-s),
        );
    }
    text + "</robot>"
}

#[test]
fn jaws_on_coupled_knuckles_open_as_far_as_their_maker_says() {
    let robot = Robot::from_urdf(&knuckles(), Some("hand")).unwrap();
    // Robotiq's data sheet: 85 mm of stroke.
    assert!((robot.max_opening() - 0.085).abs() < 3e-4, "{}", robot.max_opening());
    let jaws: Vec<&str> = robot.jaw_links().collect();
    assert_eq!(jaws, ["left_tip", "right_tip"]);
    let [note] = robot.notes() else { panic!("{:?}", robot.notes()) };
    assert!(
        note.to_string().contains("open 85 mm") && note.to_string().contains("by 13 mm"),
        "{note}"
    );
    let (tip, knuckle) = (robot.link("left_tip").unwrap(), robot.link("left_knuckle").unwrap());
    let Drive::Jaw { multiplier, .. } = robot.links()[tip].joint.drive else { panic!("a jaw") };
    assert!((multiplier - 0.5).abs() < 1e-12);
    for opening in [0.0, 0.02, 0.05, 0.0849] {
        let poses = robot.link_poses(&[0.3], opening).unwrap();
        let hand = poses[robot.link("hand").unwrap()];
        let left = hand.inv_mul(&poses[tip]);
        assert!((left.translation.x - 0.00965 - 0.0313 / 2.0 - opening / 2.0).abs() < 1e-9);
        assert!(left.rotation.angle() < 1e-9, "the pads stay parallel");
        // Inner face of the pad from the middle: 0.03716 cos(a) - 0.04342 sin(a) + what is rigid.
        let angle = hand.inv_mul(&poses[knuckle]).rotation.angle();
        let (lever, rise) = (0.031_526_16 + 0.005_631_34, 0.047_185_15 - 0.003_763_47);
        let rigid = 0.030_601_14 - 0.00965 - 0.0313 / 2.0;
        let gap = 2.0 * (lever * angle.cos() - rise * angle.sin() + rigid);
        assert!((gap - opening).abs() < 1e-4, "{opening} m open at {angle} rad, which is {gap} m");
    }
}

#[test]
fn a_tool_point_needs_no_link_of_the_urdf() {
    let side = "tool = { link = \"hand\", xyz_m = [0.0, 0.0, 0.13], rpy_deg = [0.0, 0.0, 90.0] }";
    let robot = Robot::from_urdf_with(&knuckles(), side, Some("hand")).unwrap();
    let tool = robot.flange_from_tool();
    assert!((tool.origin() - Vector3::new(0.0, 0.0, 0.13)).norm() < 1e-12);
    assert!((tool.axis(0) - Vector3::y()).norm() < 1e-12);
    let wrong = side.replace("0.13", "inf");
    assert!(Robot::from_urdf_with(&knuckles(), &wrong, Some("hand")).is_err());
}

/// A 2F-140 whose pads are links fixed to fingers without a shape had fingertips 0 mm ahead, and every tool point was refused.
#[test]
fn pads_fixed_to_a_finger_without_a_shape_are_its_fingertips() {
    let side = "tool = { link = \"hand\", xyz_m = [0.0, 0.0, 0.13], rpy_deg = [0.0, 0.0, 0.0] }";
    let mut text = knuckles();
    let whole = Robot::from_urdf_with(&text, side, Some("hand")).unwrap();
    for of in ["left", "right"] {
        let nail = format!(
            r#"<link name="{of}_tip"/><joint name="{of}_nail_joint" type="fixed"><parent link="{of}_tip"/><child link="{of}_nail"/></joint>
            <link name="{of}_nail"><inertial>"#
        );
        text = text.replace(&format!("<link name=\"{of}_tip\"><inertial>"), &nail);
    }
    let parted = Robot::from_urdf_with(&text, side, Some("hand")).unwrap();
    let jaws: Vec<&str> = parted.jaw_links().collect();
    assert_eq!(jaws, ["left_tip", "right_tip", "left_nail", "right_nail"]);
    // Half open the knuckle is at a = 0.425 rad: 0.0549 + 0.03716 sin(a) + 0.04342 cos(a) + 0.051 m from the hand.
    for robot in [&whole, &parted] {
        let ahead = robot.fingers_ahead().unwrap();
        assert!((ahead - 0.0308).abs() < 2e-4, "{ahead} m");
    }
    let (a, b) = (whole.finger_corners(0.02), parted.finger_corners(0.02));
    assert_eq!((a.len(), b.len()), (16, 16));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).norm() < 1e-12));
}

/// A hand whose body and pads are links of their own, with a camera beside them.
#[test]
fn the_palm_is_what_lies_between_the_jaws_of_all_that_is_fixed_to_the_hand() {
    let boxed = |name: &str, at: &str, size: &str| {
        format!(
            r#"<link name="{name}"><collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision></link>"#
        )
    };
    let fixed = |parent: &str, child: &str| {
        format!(
            r#"<joint name="{child}_joint" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let slide = |side: &str, sign: &str, mimic: &str| {
        format!(
            r#"<link name="{side}"/><joint name="{side}_joint" type="prismatic"><parent link="hand"/><child link="{side}"/><axis xyz="{sign}1 0 0"/>
            <limit lower="0" upper="0.04" velocity="1" effort="9"/>{mimic}</joint>"#
        )
    };
    let text = [
        r#"<robot name="g"><link name="base"/><link name="hand"/>
        <joint name="j" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
          <limit lower="-3" upper="3" velocity="1" effort="9"/></joint>"#
            .to_owned(),
        boxed("body", "0 0 0.045", "0.08 0.06 0.09"),
        boxed("camera", "0 0.06 0.1", "0.03 0.03 0.03"),
        slide("left", "", ""),
        slide("right", "-", r#"<mimic joint="left_joint"/>"#),
        boxed("left_pad", "0.005 0 0.15", "0.01 0.02 0.05"),
        boxed("right_pad", "-0.005 0 0.15", "0.01 0.02 0.05"),
        fixed("hand", "body"),
        fixed("hand", "camera"),
        fixed("left", "left_pad"),
        fixed("right", "right_pad"),
        "</robot>".to_owned(),
    ];
    let side = "tool = { link = \"hand\", xyz_m = [0.0, 0.0, 0.15], rpy_deg = [0.0, 0.0, 0.0] }";
    let robot = Robot::from_urdf_with(&text.concat(), side, Some("hand")).unwrap();
    // The body ends 0.09 m from the hand, the camera 0.115 m and the pads 0.175 m.
    assert!((robot.fingers_ahead().unwrap() - 0.025).abs() < 1e-12);
    let palm = robot.palm().unwrap();
    assert_eq!(robot.links()[palm.link].name, "body");
    assert!((palm.z + 0.06).abs() < 1e-12 && (palm.half_height - 0.03).abs() < 1e-12, "{palm:?}");
}
