//! Torques of an arm that takes a vessel, pours from it and leaves it, by the general algorithms of dynamics; what
//! the recordings make of a vessel of another weight.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Vector3};
use trueup::discovery::finding::{Finding, Value, Verdict};
use trueup::discovery::recording::{Map, Recording, Segment};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::{Inertial, Robot};

use crate::kitchen;

/// What is hidden.
#[derive(Clone, Copy, Default)]
struct Hidden {
    /// The vessel is so much heavier than told, kg.
    heavier: f64,
    /// Error of the torque sensor in joint 4, N·m.
    offset: f64,
    /// Joint 2 stands at its encoder plus this, rad.
    zero: f64,
}

const TOLD: f64 = 0.16;
const COM: [f64; 3] = [0.01, -0.04, 0.13];

/// A path of 18 s: taken between 4 and 5 s, poured from between 9 and 12 s, left between 15 and 16 s.
fn carried(hidden: Hidden, seed: u64) -> Recording {
    let robot = Robot::gen3();
    let mut state = seed;
    let mut chance = move || {
        let mut sum = 0.0;
        for _ in 0..4 {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            sum += (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5;
        }
        sum * 3.0_f64.sqrt()
    };
    let contents = |t: f64| 0.15 * (1.0 - ((t - 9.0) / 3.0).clamp(0.0, 1.0));
    let mut csv = "t[s]".to_owned();
    for (name, unit) in [("q", "rad"), ("tau", "N*m")] {
        for joint in 1..=7 {
            write!(csv, ",{name}_{joint}[{unit}]").unwrap();
        }
    }
    csv.push('\n');
    for row in 0..1800 {
        let t = f64::from(row) * 0.01;
        let (mut q, mut dq, mut ddq) = (kitchen::HOME, [0.0; 7], [0.0; 7]);
        for j in 0..7 {
            let (size, rate) = (0.3 - 0.02 * j as f64, 0.5 + 0.13 * j as f64);
            let phase = j as f64 + 0.1 * (seed % 7) as f64;
            q[j] += size * (rate * t + phase).sin();
            dq[j] = size * rate * (rate * t + phase).cos();
            ddq[j] = -size * rate * rate * (rate * t + phase).sin();
        }
        let mut arm = Dynamics::new(&robot, Bodies::All);
        if (4.5..15.5).contains(&t) {
            let mass = TOLD + hidden.heavier + contents(t);
            let inertia = Matrix3::from_diagonal(&Vector3::repeat(4e-4));
            arm = arm.with_payload(Inertial { mass, com: Vector3::from(COM), inertia });
        }
        let tau = arm.inverse(&q, &dq, &ddq).unwrap();
        write!(csv, "{t:.3}").unwrap();
        for (j, q) in q.iter().enumerate() {
            let read = q - if j == 1 { hidden.zero } else { 0.0 };
            write!(csv, ",{:.6}", read + 5e-5 * chance()).unwrap();
        }
        for j in 0..7 {
            let offset = if j == 3 { hidden.offset } else { 0.0 };
            write!(csv, ",{:.5}", tau[j] + offset + 0.08 * chance()).unwrap();
        }
        csv.push('\n');
    }
    let sidecar = format!(
        r#"{{"torque_sensor": "link", "carried": [{{"object": "jar", "taken_s": [4, 5], "left_s": [15, 16],
            "mass_kg": {TOLD}, "contents_kg": [[9, 0.15], [12, 0]], "com_m": {COM:?}}}]}}"#
    );
    let name = format!("carried {seed}");
    Recording::read(&name, &csv, Some(("sidecar", &sidecar)), &Map::default()).unwrap()
}

fn found(hidden: Hidden) -> Finding {
    let robot = Robot::gen3();
    let recordings = [carried(hidden, 1), carried(hidden, 2)];
    let subject = Subject::Arm(&robot, &[]);
    investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap().finding
}

/// The value of a parameter of an effect that must be there.
fn number(finding: &Finding, effect: (&str, &str), name: &str) -> f64 {
    let is = |found: &&trueup::discovery::finding::Effect| (&*found.name, &*found.at) == effect;
    let found = finding.effects.iter().find(is);
    let found = found.unwrap_or_else(|| panic!("no {effect:?}: {:#?}", finding.effects));
    match &found.parameters[name].value {
        Value::Number(value) => *value,
        Value::Vector(values) => panic!("{values:?}"),
    }
}

#[test]
fn a_vessel_that_weighs_what_was_told_is_no_gap_although_it_comes_and_goes() {
    let finding = found(Hidden::default());
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    let seen = finding.smallest_visible.iter().find(|v| v.name == "object_mass").unwrap();
    assert!(seen.at == "jar" && (5e-3..0.02).contains(&seen.least), "{seen:?}");
}

#[test]
fn a_heavier_vessel_is_named_with_its_mass_also_beside_a_sensor_that_is_off() {
    let finding = found(Hidden { heavier: 0.08, ..Hidden::default() });
    assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
    let mass = number(&finding, ("object_mass", "jar"), "mass");
    assert!((mass - 0.24).abs() < 0.006, "{mass} kg");
    assert!(finding.model.added[0].starts_with("effect object_mass(jar) { mass = 0.2"));

    let finding = found(Hidden { heavier: 0.08, offset: 0.25, zero: 0.0 });
    assert_eq!(finding.verdict, Verdict::Several, "{:#?}", finding.effects);
    assert_eq!(finding.effects.len(), 2, "{:#?}", finding.effects);
    let mass = number(&finding, ("object_mass", "jar"), "mass");
    let offset = number(&finding, ("torque_offset", "joint_4"), "torque");
    assert!((mass - 0.24).abs() < 0.01, "{mass} kg");
    assert!((offset - 0.25).abs() < 0.02, "{offset} N·m");
}

#[test]
fn a_joint_that_stands_elsewhere_than_its_encoder_says_shows_in_what_the_links_weigh() {
    let finding = found(Hidden { zero: 0.012, ..Hidden::default() });
    let zero = number(&finding, ("joint_zero_offset", "joint_2"), "angle");
    assert!((zero - 0.012).abs() < 0.001, "{zero} rad");
}

/// What a run's calibration knows of the encoders is in the sidecar, and is no gap any more.
#[test]
fn a_zero_that_the_sidecar_says_is_no_gap() {
    let robot = Robot::gen3();
    let mut recordings =
        [1, 2].map(|seed| carried(Hidden { zero: 0.012, ..Hidden::default() }, seed));
    for recording in &mut recordings {
        recording.sidecar.zero_offset = vec![0.0, 0.012, 0.0, 0.0, 0.0, 0.0, 0.0];
    }
    let subject = Subject::Arm(&robot, &[]);
    let found = |recordings: &[Recording]| {
        investigate(recordings, subject, &Options::default(), &mut |_, _| {})
    };
    let finding = found(&recordings).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);

    recordings[0].sidecar.zero_offset.pop();
    let error = found(&recordings).unwrap_err();
    assert!(error.what.contains("`zero_offset_rad` has 6 values"), "{error:?}");
    let degrees = Some(("a.json", r#"{"zero_offset_rad": [0, 12.0]}"#));
    let csv = "t[s],q_1[rad]\n0,0\n1,0\n2,0\n";
    let error = Recording::read("a", csv, degrees, &Map::default()).unwrap_err();
    assert!(error.what.contains("zero_offset_rad"), "{error:?}");
}

/// An arm that wiped or pushed a drawer shut was told to check the signs of its columns.
#[test]
fn torques_while_the_arm_presses_are_not_judged() {
    let robot = Robot::gen3();
    let mut recordings = [1, 2].map(|seed| carried(Hidden::default(), seed));
    for recording in &mut recordings {
        let pressed = Segment { name: "rub(plate)".into(), from: 5.9, to: 8.1 };
        recording.sidecar.contacts.push(pressed);
        let tau = recording.columns.iter_mut().find(|column| column.name == "tau_2").unwrap();
        for (value, t) in tau.values.iter_mut().zip(&recording.time) {
            *value += if (6.0..8.0).contains(t) { 3.0 } else { 0.0 };
        }
    }
    let subject = Subject::Arm(&robot, &[]);
    let finding = investigate(&recordings, subject, &Options::default(), &mut |_, _| {});
    let finding = finding.unwrap().finding;
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:#?}", finding.effects);
    let said = |note: &String| note.contains("from 5.9 s to 8.1 s (rub(plate))");
    assert!(finding.notes.iter().any(said), "{:#?}", finding.notes);

    // Where nothing else is left, the torques are not what is missing.
    for recording in &mut recordings {
        recording.sidecar.contacts[0].to = 100.0;
        recording.sidecar.contacts[0].from = 0.0;
    }
    let error = investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap_err();
    assert!(error.what.contains("pushed, pulled or pressed"), "{error:?}");
}

#[test]
fn times_that_go_back_are_told() {
    let text = r#"{"carried": [{"object": "jar", "taken_s": [5, 4], "left_s": [15, 16], "mass_kg": 0.1,
                    "com_m": [0, 0, 0.1]}]}"#;
    let csv = "t[s],q_1[rad]\n0,0\n1,0\n2,0\n";
    let error = Recording::read("a", csv, Some(("a.json", text)), &Map::default()).unwrap_err();
    assert!(error.what.contains("jar") && error.what.contains("go back"), "{error:?}");
}

#[test]
fn a_vessel_a_sensor_and_an_encoder_at_once_are_told_apart() {
    let finding = found(Hidden { heavier: 0.08, offset: 0.25, zero: 0.012 });
    assert_eq!(finding.verdict, Verdict::Several, "{:#?}", finding.effects);
    assert_eq!(finding.effects.len(), 3, "{:#?}", finding.effects);
    let mass = number(&finding, ("object_mass", "jar"), "mass");
    let offset = number(&finding, ("torque_offset", "joint_4"), "torque");
    let zero = number(&finding, ("joint_zero_offset", "joint_2"), "angle");
    assert!((mass - 0.24).abs() < 0.01, "{mass} kg");
    assert!((offset - 0.25).abs() < 0.03, "{offset} N·m");
    assert!((zero - 0.012).abs() < 0.002, "{zero} rad");
}
