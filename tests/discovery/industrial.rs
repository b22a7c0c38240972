//! A real arm's logs: a `UR10e` without its controller, its torques worked out from motor currents; read in place and
//! skipped where the folder is absent.
//!
//! What a textbook identification finds (rows low-passed at 6 Hz, least squares over all numbers of the links near the
//! maker's, friction of both kinds, an offset and a rotor at every joint): viscous 18.3, 18.0, 8.7, 3.0, 2.1 and
//! 2.9 N·m·s/rad, dry 13.7, 15.0, 5.7, 2.3, 2.9 and 2.4 N·m.

use trueup::discovery::finding::{Effect, Finding, Value, Verdict};
use trueup::discovery::recording::{Error, Map, Recording};
use trueup::discovery::{Investigation, Options, Subject, investigate};
use trueup::motion::Robot;

use crate::absent::public;

const VISCOUS: [f64; 6] = [18.3, 18.0, 8.7, 3.0, 2.1, 2.9];
const DRY: [f64; 6] = [13.7, 15.0, 5.7, 2.3, 2.9, 2.4];

fn found(files: &[&str]) -> Option<Finding> {
    changed(files, |_| {})
}

/// What is found once every row has been changed.
fn changed(files: &[&str], change: impl Fn(&mut [f64])) -> Option<Finding> {
    answered(files, change).map(|found| found.unwrap().finding)
}

/// What is answered once every row has been changed: time, then angles, speeds and torques of six joints.
fn answered(files: &[&str], change: impl Fn(&mut [f64])) -> Option<Result<Investigation, Error>> {
    let read = |name: &&str| {
        let path = public(&format!("ur10e_excitation/{name}"))?;
        let text = std::fs::read_to_string(path).unwrap();
        let (head, rows) = text.split_once('\n').unwrap();
        let row = |line: &str| {
            let mut row: Vec<f64> =
                line.split(',').map(|cell| cell.trim().parse().unwrap()).collect();
            change(&mut row);
            let cells: Vec<String> = row.iter().map(f64::to_string).collect();
            cells.join(",")
        };
        let rows: Vec<String> = rows.lines().map(row).collect();
        let text = format!("{head}\n{}\n", rows.join("\n"));
        Some(Recording::read(name, &text, None, &Map::default()).unwrap())
    };
    let recordings: Option<Vec<Recording>> = files.iter().map(read).collect();
    let robot = Robot::from_file(&public("ur10e_excitation/ur10e.urdf")?, None).unwrap();
    let arm = Subject::Arm(&robot, &[]);
    Some(investigate(&recordings?, arm, &Options::default(), &mut |_, _| {}))
}

fn number(effect: &Effect, name: &str) -> f64 {
    match effect.parameters.get(name).map(|parameter| &parameter.value) {
        Some(Value::Number(value)) => *value,
        other => panic!("{other:?} in {effect:?}"),
    }
}

/// The friction of a real arm is as large as what its links need: torques of the other sign do not just mirror the model.
#[test]
fn torques_of_the_other_sign_are_told() {
    let turned = |files: &[&str], which: std::ops::Range<usize>| {
        let change = |row: &mut [f64]| row[which.clone()].iter_mut().for_each(|tau| *tau *= -1.0);
        Some(answered(files, change)?.map(|found| found.finding.reason).unwrap_err())
    };
    let Some(error) = turned(&["u14.csv", "u15.csv"], 13..19) else { return };
    for joint in 1..=6 {
        assert!(error.what.contains(&format!("`tau_{joint}`")), "{error:?}");
    }
    assert!(error.help.contains("sign") && error.place == "u14.csv", "{error:?}");
    let Some(error) = turned(&["u14.csv", "l14.csv"], 16..17) else { return };
    assert!(error.what.starts_with("`tau_4` runs against"), "{error:?}");
}

/// A clock in milliseconds is so long that only its beginning would be looked at, where the arm rests.
#[test]
fn milliseconds_called_seconds_are_told() {
    let Some(answer) = answered(&["u14.csv", "u15.csv"], |row| row[0] *= 1e3) else { return };
    let error = answer.map(|found| found.finding.reason).unwrap_err();
    assert!(error.what.starts_with("`t` looks like milliseconds"), "{error:?}");
}

/// As they are, the speeds of these logs are within 0.4 % of the change of the angles.
#[test]
fn stamps_of_another_rate_are_told() {
    for files in [["u14.csv", "u15.csv"], ["ptp.csv", "l14.csv"]] {
        let Some(answer) = answered(&files, |row| row[0] *= 0.93) else { return };
        let error = answer.map(|found| found.finding.reason).unwrap_err();
        assert!(error.what.starts_with("`dq_n` is 0.9"), "{error:?}");
        assert!(error.what.contains("each of the 6 joints"), "{error:?}");
    }
}

/// In the second loaded excitation the load sits turned by half a turn.
#[test]
fn a_load_that_hangs_otherwise_is_another_machine() {
    let Some(finding) = found(&["l14.csv", "l15.csv"]) else { return };
    assert_eq!(finding.verdict, Verdict::DifferentMachines, "{finding:#?}");
    assert!(finding.reason.contains("the moment of the load along z"), "{}", finding.reason);
    assert!(finding.effects.is_empty() && finding.model.added.is_empty(), "{finding:#?}");
}

#[test]
fn an_industrial_arm_rubs_in_two_ways_in_every_joint_and_nothing_else_is_invented() {
    let Some(finding) = found(&["u14.csv", "u15.csv", "ptp.csv"]) else { return };
    for joint in 0..6 {
        let seat = format!("joint_{}", joint + 1);
        let at = |name: &str| finding.effects.iter().find(|e| e.name == name && e.at == seat);
        let fluid = at("viscous_friction").unwrap_or_else(|| panic!("{seat}: {finding:#?}"));
        let dry = at("coulomb_friction").unwrap_or_else(|| panic!("{seat}: {finding:#?}"));
        let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 0.15;
        assert!(near(number(fluid, "coefficient"), VISCOUS[joint]), "{fluid:?}");
        assert!(near(number(dry, "torque"), DRY[joint]), "{dry:?}");
    }
    assert_eq!(finding.effects.len(), 12, "{:#?}", finding.effects);
    assert!(finding.effects.iter().all(|effect| effect.stability > 0.8), "{:#?}", finding.effects);
    // Links and rotors are numbers of the model, which a maker's file has wrong or not at all.
    let kinds: Vec<&str> = finding.identified.iter().map(|off| off.name.as_str()).collect();
    assert!(
        kinds.contains(&"inertial") && kinds.contains(&"armature"),
        "{:#?}",
        finding.identified
    );
    let rotors = finding.identified.iter().filter(|off| off.name == "armature");
    assert!(
        rotors
            .clone()
            .all(|off| off.file == 0.0 && off.value > 3.0 * off.std && off.unit == "kg*m^2")
    );
    let is_written =
        |at: &str| finding.model.added.iter().any(|line| line.contains(&format!("armature({at}")));
    assert!(rotors.clone().all(|off| is_written(&off.at)), "{:#?}", finding.model.added);
}

/// Joint 6 stands still in half of the recording that is held out, and friction holds it there with anything up to its level: taken for
/// motion, that was a spring, a wave, friction of three kinds and a link of -4.6 kg.
#[test]
fn what_holds_joints_that_stand_still_is_not_taken_for_effects() {
    let Some(finding) = found(&["jan31u.csv", "ptp.csv"]) else { return };
    let names = finding.effects.iter().map(|effect| (effect.name.as_str(), effect.at.as_str()));
    let mut names: Vec<(&str, &str)> = names.collect();
    names.sort_unstable();
    let joints = ["joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6"];
    let kinds = ["coulomb_friction", "viscous_friction"];
    let expected: Vec<_> = kinds.into_iter().flat_map(|k| joints.map(|at| (k, at))).collect();
    assert_eq!(names, expected, "{:#?}", finding.effects);
    assert!(finding.gap.after.heldout < 2.0, "{:?}", finding.gap);
    assert!(finding.notes.iter().any(|note| note.contains("`tau_6` in 18")), "{:?}", finding.notes);
}

/// A sensor that shows a sixth more, on top of a real arm whose links weigh otherwise than their file says.
#[test]
fn a_gain_of_one_sensor_is_told_from_links_that_are_heavier() {
    let files = ["u14.csv", "u15.csv", "ptp.csv"];
    let Some(finding) = changed(&files, |row| row[15] *= 1.16) else { return };
    let common = ["viscous_friction", "coulomb_friction"];
    let others = finding.effects.iter().filter(|e| !common.contains(&e.name.as_str()));
    let others: Vec<&Effect> = others.collect();
    let [one] = others[..] else { panic!("{others:#?}") };
    assert_eq!((one.name.as_str(), one.at.as_str()), ("torque_gain", "joint_3"));
    assert!((number(one, "gain") / 1.16 - 1.0).abs() < 0.05, "{one:?}");
    assert!(one.alternatives.iter().any(|other| other.name == "actuator_gain"), "{one:?}");
}

/// The angles of two joints in each other's columns.
#[test]
fn a_model_that_does_not_fit_is_told_with_where_and_no_list() {
    let swapped = |row: &mut [f64]| {
        row.swap(2, 3);
        row.swap(8, 9);
    };
    let Some(finding) = changed(&["u14.csv", "ptp.csv"], swapped) else { return };
    assert_eq!(finding.verdict, Verdict::ModelInadequate, "{finding:#?}");
    assert!(finding.effects.is_empty() && finding.model.added.is_empty(), "{finding:#?}");
    assert!(finding.reason.contains("most of it at tau_2"), "{}", finding.reason);
    let hint = "what is left at tau_2 depends most on ";
    assert!(finding.notes.iter().any(|note| note.starts_with(hint)), "{:?}", finding.notes);
}

/// A load in both, and links that the file does not know well: a spring of 11 N*m/rad and a load explain what is held out as well, and
/// what was fitted much less. Taken for those, it came to a link of -4.1 kg.
#[test]
fn links_are_not_left_to_a_spring_that_only_what_is_held_out_allows() {
    let Some(finding) = found(&["jan31l.csv", "l14.csv"]) else { return };
    let of = |name: &str| finding.effects.iter().filter(|e| e.name == name).count();
    assert_eq!((of("coulomb_friction"), of("viscous_friction")), (6, 6), "{:#?}", finding.effects);
    assert_eq!(of("link_mass") + of("linear_stiffness"), 0, "{:#?}", finding.effects);
    let load = finding.effects.iter().find(|effect| effect.name == "payload").expect("a load");
    // Borne in both recordings, it is told from the last link's own mass by the file alone.
    assert!((1.9..2.9).contains(&number(load, "mass")), "{load:?}");
    assert!(finding.identified.iter().any(|off| off.name == "inertial"), "{finding:#?}");
}

/// The load is quoted as 2.6 kg; links and friction are the arm's own, whichever recording bears it.
#[test]
fn what_a_loaded_arm_bears_more_is_named() {
    for (files, loaded) in [
        (["u14.csv", "l14.csv"], "l14.csv"),
        (["l14.csv", "u14.csv"], "l14.csv"),
        (["jan31u.csv", "jan31l.csv"], "jan31l.csv"),
    ] {
        let Some(finding) = found(&files) else { return };
        assert_eq!(finding.verdict, Verdict::DifferentMachines, "{finding:#?}");
        let [one] = &finding.effects[..] else { panic!("{files:?}: {:#?}", finding.effects) };
        assert_eq!((one.name.as_str(), one.at.as_str()), ("payload", "tool"));
        let mass = number(one, "mass");
        assert!((2.4..2.6).contains(&mass), "{files:?}: {mass} kg");
        assert!(one.stability > 0.9 && finding.gap.shrink_heldout > 0.7, "{one:?}");
        assert!(finding.reason.starts_with(loaded), "{}", finding.reason);
    }
}
