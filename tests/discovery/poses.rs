//! Poses at rest, made by the general kinematics and dynamics of a robot whose file was changed: what was changed is found,
//! or the geometry told; nothing where nothing was.

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use std::fmt::Write as _;
use trueup::discovery::finding::{Finding, Verdict};
use trueup::discovery::model_file::ModelFile;
use trueup::discovery::recording::{Error, Map, Recording};
use trueup::discovery::{Investigation, Options, Subject, investigate};
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::{Inertial, Robot};

use super::{bare_arm, folder, number};

/// What chance gives: a normal number of standard deviation 1, from twelve even ones.
fn normal(chance: &mut StdRng) -> f64 {
    (0..12).map(|_| chance.random_range(-0.5..0.5)).sum()
}

/// A table of poses, far apart in time or without a time; `read` says what is read at each, in columns of these names.
fn table(
    count: usize,
    seed: u64,
    timed: bool,
    names: &[String],
    read: impl Fn(&[f64], &mut StdRng) -> Vec<f64>,
) -> String {
    let mut chance = StdRng::seed_from_u64(seed);
    let mut head: Vec<String> = (1..=7).map(|j| format!("q_{j}[rad]")).collect();
    head.extend(names.iter().cloned());
    if timed {
        head.insert(0, "t[s]".into());
    }
    let mut text = head.join(",") + "\n";
    for row in 0..count {
        let q: Vec<f64> = (0..7).map(|_| chance.random_range(-1.8..1.8)).collect();
        let mut values = q.clone();
        values.extend(read(&q, &mut chance));
        if timed {
            values.insert(0, 40.0 * row as f64);
        }
        let cells: Vec<String> = values.iter().map(|value| format!("{value:.7}")).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    text
}

fn tips() -> Vec<String> {
    ["x", "y", "z"].map(|axis| format!("tcp_{axis}[m]")).to_vec()
}

fn torques() -> Vec<String> {
    (1..=7).map(|joint| format!("tau_{joint}[N*m]")).collect()
}

/// Where a tracker sees the tip, with errors of 0.05 mm.
fn seen(robot: &Robot, tracker: Isometry3<f64>) -> impl Fn(&[f64], &mut StdRng) -> Vec<f64> {
    move |q, chance| {
        let tip = robot.link_poses(q, 0.0).unwrap()[robot.tip()].translation.vector;
        let tip = tracker * Point3::from(tip);
        tip.iter().map(|value| value + 5e-5 * normal(chance)).collect()
    }
}

/// What torque sensors read of an arm that carries something, with errors of 0.2 N·m.
fn weighed(robot: &Robot, payload: Inertial) -> impl Fn(&[f64], &mut StdRng) -> Vec<f64> {
    move |q, chance| {
        let dynamics = Dynamics::new(robot, Bodies::All).with_payload(payload);
        let still = [0.0; 7];
        let tau = dynamics.inverse(q, &still, &still).unwrap();
        tau.iter().map(|value| value + 0.2 * normal(chance)).collect()
    }
}

fn asked(text: &str, robot: &Robot) -> Result<Investigation, Error> {
    knowing(text, robot, "")
}

/// The same with a twin that has these lines.
fn knowing(text: &str, robot: &Robot, lines: &str) -> Result<Investigation, Error> {
    let recording = Recording::read("poses", text, None, &Map::default()).unwrap();
    let twin = ModelFile::read(&format!("twin t of s {{ {lines} }}")).unwrap();
    let arm = Subject::Arm(robot, twin.effects());
    investigate(&[recording], arm, &Options::default(), &mut |_, _| {})
}

fn answer(text: &str) -> Result<Finding, Error> {
    asked(text, &bare_arm()).map(|investigation| investigation.finding)
}

#[test]
fn a_joints_zero_is_named_from_poses() {
    let robot = bare_arm().with_zero_offsets(&[0.0, 0.0, 0.0, 0.004, 0.0, 0.0, 0.0]);
    let text = table(36, 1, true, &tips(), seen(&robot, Isometry3::identity()));
    let found = answer(&text).unwrap();
    assert_eq!(found.verdict, Verdict::Named, "{:?}", found.effects);
    assert_eq!(found.effects[0].at, "joint_4");
    assert!((number(&found, "joint_zero_offset", "angle") - 0.004).abs() < 2e-4);
    assert!(found.effects[0].stability > 0.9 && found.effects[0].heldout_share > 0.9);
    assert!(found.identified.is_empty());
}

/// Poses of an arm in which every joint sits up to a millimetre elsewhere and is turned by up to two milliradians, as no file
/// is exact; the tracker stands in a frame of its own, and nobody wrote a time down. With the file's text.
pub(crate) fn off_everywhere() -> (String, String) {
    let text = std::fs::read_to_string(folder().join("gen3_bare.urdf")).unwrap();
    let mut chance = StdRng::seed_from_u64(5);
    let mut other = String::new();
    let mut in_joint = false;
    for line in text.split_inclusive('>') {
        in_joint = (in_joint || line.contains("<joint")) && !line.contains("</joint");
        let mut line = line.to_owned();
        if in_joint && line.contains("<origin") {
            for (key, size) in [("xyz", 5e-4), ("rpy", 1e-3)] {
                let Some((before, rest)) = line.split_once(&format!("{key}=\"")) else { continue };
                let (values, after) = rest.split_once('"').unwrap();
                let values: Vec<String> = values
                    .split_whitespace()
                    .map(|v| (v.parse::<f64>().unwrap() + size * normal(&mut chance)).to_string())
                    .collect();
                line = format!("{before}{key}=\"{}\"{after}", values.join(" "));
            }
        }
        other.push_str(&line);
    }
    let robot = Robot::from_urdf(&other, Some("end_effector_link")).unwrap();
    let turn = UnitQuaternion::from_euler_angles(0.2, -0.4, 2.0);
    let tracker = Isometry3::from_parts(Translation3::new(2.0, -1.0, 0.5), turn);
    (table(60, 2, false, &tips(), seen(&robot, tracker)), text)
}

#[test]
fn a_geometry_that_is_off_everywhere_is_told_in_numbers() {
    let (table, text) = off_everywhere();
    let Investigation { finding: found, revision, .. } = asked(&table, &bare_arm()).unwrap();
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.effects);
    for name in ["link_length", "axis_tilt", "joint_zero_offset"] {
        assert!(found.identified.iter().any(|off| off.name == name), "no {name}");
    }
    assert!(found.identified.iter().all(|off| (off.value - off.file).abs() < 0.02));
    let is_length = |file: f64| file.to_bits() == 0 || file.abs() > 1e-12;
    assert!(found.identified.iter().all(|off| is_length(off.file)), "{:?}", found.identified);
    assert!(found.gap.before.heldout > 10.0 && found.gap.after.heldout < 1.8, "{:?}", found.gap);
    assert_eq!(found.path[0].name, "identified");
    assert!(found.notes.iter().any(|note| note.contains("tracker's frame is not the base's")));
    assert!(found.notes.iter().any(|note| note.contains("there is no time")));
    // The file with these numbers has nothing off any more.
    let revised = revision.unwrap().written(&text, "test").unwrap();
    let robot = Robot::from_urdf(&revised, Some("end_effector_link")).unwrap();
    let again = asked(&table, &robot).unwrap().finding;
    assert_eq!(again.verdict, Verdict::NothingMissing, "{:?}", again.effects);
    assert!(again.identified.is_empty() && again.gap.before.heldout < 1.8, "{:?}", again.gap);
}

/// Poses of an arm whose tracker stands (4, -3, 8) mm from where it is taken to stand.
pub(crate) fn seen_from_elsewhere(seed: u64) -> String {
    let tracker = Isometry3::translation(0.004, -0.003, 0.008);
    table(40, seed, true, &tips(), seen(&bare_arm(), tracker))
}

/// It was written as `camera_shift(camera)`, which the gap of a camera took for that camera's own axes: a camera of which nothing
/// was wrong stood elsewhere. With some seeds it was a doubt between itself and itself with its turn.
#[test]
fn a_tracker_that_stands_elsewhere_is_no_camera() {
    for seed in 0..4 {
        let found = answer(&seen_from_elsewhere(seed)).unwrap();
        assert_eq!(found.verdict, Verdict::Named, "{seed}: {:?}", found.effects);
    }
    let (text, robot) = (seen_from_elsewhere(0), bare_arm());
    let found = answer(&text).unwrap();
    let effect = &found.effects[0];
    assert_eq!((effect.name.as_str(), effect.at.as_str()), ("camera_shift", "camera"));
    let [line] = &found.model.added[..] else { panic!("{:?}", found.model.added) };
    assert!(line.starts_with("effect camera_shift(tracker) { x = 0.00"), "{line}");
    let again = knowing(&text, &robot, line).unwrap().finding;
    assert_eq!(again.verdict, Verdict::NothingMissing, "{:?}", again.effects);
    // A camera of the scene, and what sees things in the hand, say nothing of the tip.
    for of in ["camera", "object_tracker"] {
        let aside = knowing(&text, &robot, &line.replace("tracker", of)).unwrap().finding;
        assert_eq!(aside.effects[0].name, "camera_shift", "{of}");
        let told = |note: &&String| note.contains(&format!("({of})"));
        let note = aside.notes.iter().find(told).unwrap();
        assert!(note.contains("left aside") && note.contains("(tracker)"), "{note}");
    }
}

/// Of an arm whose tool was 3.7 mm off "numbers of the model are off, nothing else is missing" was said where all numbers of the
/// geometry left a little less of thirteen poses than the tool's alone.
#[test]
fn a_tool_that_is_off_is_named_and_not_told_as_geometry() {
    let robot = bare_arm();
    for seed in 0..4 {
        let read = |q: &[f64], chance: &mut StdRng| -> Vec<f64> {
            let tip = robot.link_poses(q, 0.0).unwrap()[robot.tip()];
            let tip = tip * Point3::new(0.002, -0.001, 0.003);
            tip.iter().map(|value| value + 1e-4 * normal(chance)).collect()
        };
        let found = answer(&table(40, seed, false, &tips(), read)).unwrap();
        assert_eq!(found.verdict, Verdict::Named, "{seed}: {:?}", found.identified);
        assert_eq!(found.effects[0].name, "tool_offset", "{seed}");
    }
}

/// Each was listed as often as it is tried, with other numbers free beside it: "camera x" three times.
#[test]
fn a_size_that_would_have_been_seen_is_told_once() {
    let text = table(30, 1, true, &tips(), seen(&bare_arm(), Isometry3::identity()));
    let visible = answer(&text).unwrap().smallest_visible;
    let told = |i: usize| (&visible[i].name, &visible[i].at, &visible[i].parameter);
    for i in 0..visible.len() {
        assert!((0..i).all(|before| told(before) != told(i)), "{:?}", told(i));
    }
    assert!(visible.iter().any(|seen| seen.name == "camera_shift"));
}

#[test]
fn a_load_is_weighed_in_fixed_poses() {
    let com = Vector3::new(0.01, -0.02, 0.05);
    let robot = bare_arm();
    // About the tip's frame, which is where the flange's link is.
    let payload = Inertial { mass: 1.2, com, inertia: Matrix3::zeros() };
    let text = table(20, 3, true, &torques(), weighed(&robot, payload));
    let found = answer(&text).unwrap();
    assert_eq!(found.verdict, Verdict::Named, "{:?}", found.effects);
    assert!((number(&found, "payload", "mass") - 1.2).abs() < 0.05);
    assert!(found.gap.shrink_heldout > 0.9, "{:?}", found.gap);
}

#[test]
fn nothing_is_found_in_poses_of_the_arm_as_it_is() {
    let robot = bare_arm();
    for seed in 0..12 {
        let text = table(30, seed, true, &tips(), seen(&robot, Isometry3::identity()));
        let found = answer(&text).unwrap();
        assert_eq!(found.verdict, Verdict::NothingMissing, "tips {seed}: {:?}", found.effects);
        assert!(found.identified.is_empty(), "tips {seed}: {:?}", found.identified);
        let nothing = Inertial { mass: 0.0, com: Vector3::zeros(), inertia: Matrix3::zeros() };
        let text = table(20, seed, true, &torques(), weighed(&robot, nothing));
        let found = answer(&text).unwrap();
        assert_eq!(found.verdict, Verdict::NothingMissing, "torques {seed}: {:?}", found.effects);
    }
}

#[test]
fn poses_that_say_too_little_are_refused() {
    let text = table(8, 1, true, &tips(), seen(&bare_arm(), Isometry3::identity()));
    let refused = answer(&text).unwrap_err();
    assert!(refused.what.contains("5 poses are too few"), "{refused:?}");
    assert!(refused.help.contains("20 poses or more"), "{refused:?}");
}
