//! Torques of an arm with a load in its hand, or with links that its file does not know well, and one thing more, by the general
//! algorithms of dynamics: each is named with its size, and nothing stands for the two together.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Vector3};
use trueup::discovery::finding::{Finding, Value};
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::dynamics::{Bodies, Dynamics, GRAVITY};
use trueup::motion::{Inertial, Robot};

use crate::kitchen;

/// What is hidden beside the load.
#[derive(Clone, Copy, Default)]
struct Hidden {
    /// A spring at joint 2, N·m/rad.
    spring: f64,
    /// Where it rests, rad.
    rest: f64,
    /// Whether the torque sensors sit between gear and link.
    is_link: bool,
    /// Joint 4 stands at its encoder plus this, rad.
    zero: f64,
    /// The sensor of joint 4 shows so much more than there is, a part of it.
    gain: f64,
    /// Dry friction of joint 3, N·m.
    dry: f64,
    /// The base leans by roll and pitch, rad.
    tilt: [f64; 2],
    /// Whether the file's numbers of every link are off.
    is_off: bool,
    /// Whether the hand is empty.
    is_empty: bool,
    /// Noise of the torques, N·m; 0.08 where none is said.
    noise: f64,
}

const MASS: f64 = 1.2;
const COM: [f64; 3] = [0.01, -0.03, 0.09];

/// By which part each link of the arm is heavier than its file says, and by how much its centre lies elsewhere, m.
const OFF: [(f64, [f64; 3]); 7] = [
    (0.08, [0.0084, -0.0112, 0.014]),
    (-0.09, [-0.014, 0.0168, 0.0056]),
    (0.11, [0.0126, -0.0084, -0.0168]),
    (-0.07, [-0.0112, 0.0154, 0.0098]),
    (0.10, [0.0168, 0.007, -0.0126]),
    (-0.06, [-0.007, -0.014, 0.0112]),
    (0.05, [0.0098, -0.0126, 0.0084]),
];

/// How the inertial numbers of a link begin in the file.
const BEGINS: &str = "<inertial><origin xyz=\"";

/// The arm whose links are not as its file says.
fn as_built() -> Robot {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stdlib/robots/gen3_2f85");
    let file = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let text = file("gen3_2f85.urdf");
    let mut parts = text.split(BEGINS);
    // What stands before the base, and the base.
    let mut built = format!("{}{BEGINS}{}", parts.next().unwrap(), parts.next().unwrap());
    let mut links = OFF.iter();
    for part in parts {
        let (place, rest) = part.split_once("\"/><mass value=\"").unwrap();
        let (mass, rest) = rest.split_once('"').unwrap();
        let (heavier, by) = links.next().copied().unwrap_or_default();
        let mass = mass.parse::<f64>().unwrap() * (1.0 + heavier);
        let place: Vec<f64> = place.split(' ').map(|value| value.parse().unwrap()).collect();
        let [x, y, z] = std::array::from_fn(|k| place[k] + by[k]);
        write!(built, "{BEGINS}{x} {y} {z}\"/><mass value=\"{mass}\"{rest}").unwrap();
    }
    Robot::from_urdf_with(&built, &file("robot.toml"), None).unwrap()
}

/// 12 s in which every joint swings.
fn recording(hidden: Hidden, seed: u64) -> Recording {
    let robot = if hidden.is_off { as_built() } else { Robot::gen3() };
    let [roll, pitch] = hidden.tilt;
    let gravity = Rotation3::from_euler_angles(roll, pitch, 0.0)
        .inverse_transform_vector(&Vector3::new(0.0, 0.0, -GRAVITY));
    let inertia = Matrix3::from_diagonal(&Vector3::repeat(4e-4));
    let load = Inertial { mass: MASS, com: Vector3::from(COM), inertia };
    let arm = Dynamics::new(&robot, Bodies::All).with_gravity(gravity);
    let arm = if hidden.is_empty { arm } else { arm.with_payload(load) };
    let mut state = seed;
    let mut chance = move || {
        let mut sum = 0.0;
        for _ in 0..4 {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            sum += (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5;
        }
        sum * 3.0_f64.sqrt()
    };
    let noise = if hidden.noise > 0.0 { hidden.noise } else { 0.08 };
    let mut csv = "t[s]".to_owned();
    for (name, unit) in [("q", "rad"), ("dq", "rad/s"), ("tau", "N*m")] {
        for joint in 1..=7 {
            write!(csv, ",{name}_{joint}[{unit}]").unwrap();
        }
    }
    csv.push('\n');
    for row in 0..1200 {
        let t = f64::from(row) * 0.01;
        let (mut q, mut dq, mut ddq) = (kitchen::HOME, [0.0; 7], [0.0; 7]);
        for j in 0..7 {
            let (size, rate) = (0.5 - 0.02 * j as f64, 0.8 + 0.17 * j as f64);
            let phase = j as f64 + 0.7 * (seed % 7) as f64;
            q[j] += size * (rate * t + phase).sin();
            dq[j] = size * rate * (rate * t + phase).cos();
            ddq[j] = -size * rate * rate * (rate * t + phase).sin();
        }
        let tau = arm.inverse(&q, &dq, &ddq).unwrap();
        write!(csv, "{t:.3}").unwrap();
        for (j, q) in q.iter().enumerate() {
            let read = q - if j == 3 { hidden.zero } else { 0.0 };
            write!(csv, ",{:.6}", read + 5e-5 * chance()).unwrap();
        }
        for dq in dq {
            write!(csv, ",{:.6}", dq + 1e-3 * chance()).unwrap();
        }
        for j in 0..7 {
            let spring = if j == 1 { hidden.spring * (q[j] - hidden.rest) } else { 0.0 };
            let dry = if j == 2 { hidden.dry * dq[j].signum() } else { 0.0 };
            let gain = if j == 3 { 1.0 + hidden.gain } else { 1.0 };
            write!(csv, ",{:.5}", gain * (tau[j] + spring + dry) + noise * chance()).unwrap();
        }
        csv.push('\n');
    }
    let sidecar = if hidden.is_link {
        r#"{"torque_sensor": "link"}"#
    } else {
        r#"{"torque_sensor": "motor"}"#
    };
    let name = format!("loaded {seed}");
    Recording::read(&name, &csv, Some(("sidecar", sidecar)), &Map::default()).unwrap()
}

/// Finds the load and this effect, and no other; returns the effect's numbers.
fn beside_the_load(hidden: Hidden, name: &str, at: &str, number: &str) -> Vec<f64> {
    let robot = Robot::gen3();
    let recordings = [recording(hidden, 1), recording(hidden, 2)];
    let subject = Subject::Arm(&robot, &[]);
    let found = investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap();
    let finding = found.finding;
    let named = |name: &str, at: &str| -> Vec<f64> {
        let is = |found: &&trueup::discovery::finding::Effect| found.name == name && found.at == at;
        let found = finding.effects.iter().find(is);
        let found = found.unwrap_or_else(|| panic!("no {name}: {:#?}", finding.effects));
        let values = found.parameters.iter().filter(|(own, _)| own.contains(number));
        values
            .filter_map(|(_, parameter)| match &parameter.value {
                Value::Number(value) => Some(*value),
                Value::Vector(_) => None,
            })
            .collect()
    };
    let other = named(name, at);
    // A spring that rests elsewhere is a spring and an offset.
    let n_effects = if hidden.rest.abs() > 0.0 { 3 } else { 2 };
    assert_eq!(finding.effects.len(), n_effects, "{:#?}", finding.effects);
    let mass = mass(&finding);
    assert!((mass - MASS).abs() < 0.01, "{mass} kg");
    other
}

fn mass(finding: &Finding) -> f64 {
    let load = finding.effects.iter().find(|effect| effect.name == "payload");
    let load = load.unwrap_or_else(|| panic!("no load: {:#?}", finding.effects));
    match &load.parameters["mass"].value {
        Value::Number(value) => *value,
        Value::Vector(values) => panic!("{values:?}"),
    }
}

#[test]
fn a_load_beside_a_spring_is_no_other_links() {
    let hidden = Hidden { spring: 20.0, ..Hidden::default() };
    let found = beside_the_load(hidden, "linear_stiffness", "joint_2", "coefficient");
    assert!((found[0] - 20.0).abs() < 0.2, "{found:?} N·m/rad");
}

/// A spring whose rest is not at the joint's zero was a loop of hysteresis as wide as one could be.
#[test]
fn a_spring_that_rests_elsewhere_is_no_hysteresis() {
    let hidden = Hidden { spring: 8.0, rest: -0.9, ..Hidden::default() };
    let found = beside_the_load(hidden, "linear_stiffness", "joint_2", "coefficient");
    assert!((found[0] - 8.0).abs() < 0.2, "{found:?} N·m/rad");
    let found = beside_the_load(hidden, "torque_offset", "joint_2", "torque");
    assert!((found[0] - 7.2).abs() < 0.3, "{found:?} N·m");
}

/// A cable across a joint pulls past the gear: a sensor between gear and link reads it as one in the motor does. Such a spring was
/// never named, and what was left said that the model does not fit.
#[test]
fn a_sensor_between_gear_and_link_reads_a_spring() {
    let hidden = Hidden { spring: 20.0, is_link: true, ..Hidden::default() };
    let found = beside_the_load(hidden, "linear_stiffness", "joint_2", "coefficient");
    assert!((found[0] - 20.0).abs() < 0.2, "{found:?} N·m/rad");
}

#[test]
fn a_load_beside_a_sensor_s_gain_is_told_with_it() {
    let hidden = Hidden { gain: 0.06, ..Hidden::default() };
    let found = beside_the_load(hidden, "torque_gain", "joint_4", "gain");
    assert!((found[0] - 1.06).abs() < 0.003, "{found:?}");
}

/// A load on a joint that stands elsewhere, or on a base that leans, pulls elsewhere than the file's bodies do.
#[test]
fn a_load_is_borne_by_the_arm_as_it_stands() {
    let hidden = Hidden { zero: 0.02, ..Hidden::default() };
    let found = beside_the_load(hidden, "joint_zero_offset", "joint_4", "angle");
    assert!((found[0] - 0.02).abs() < 0.001, "{found:?} rad");
    let hidden = Hidden { tilt: [0.03, -0.02], ..Hidden::default() };
    let found = beside_the_load(hidden, "base_tilt", "base", "");
    assert!((found[0] + 0.02).abs() < 0.001 || (found[0] - 0.03).abs() < 0.001, "{found:?} rad");
}

/// What a base that leans pulls is in proportion to no speed; torques that are read late by as little look like it, which they are not.
#[test]
fn a_base_that_leans_is_not_read_late() {
    let robot = Robot::gen3();
    let hidden = Hidden { tilt: [0.0, 0.06], noise: 0.03, is_empty: true, ..Hidden::default() };
    let recordings = [recording(hidden, 1), recording(hidden, 2)];
    let subject = Subject::Arm(&robot, &[]);
    let found = investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap();
    let finding = found.finding;
    let names: Vec<&str> = finding.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!(names, ["base_tilt"], "{finding:#?}");
    assert!(finding.notes.iter().all(|note| !note.contains("late")), "{:?}", finding.notes);
}

/// Fitted to both recordings at once, friction that is another in each lands between, as sure as any.
#[test]
fn friction_that_changed_between_two_recordings_is_told_of_each() {
    let robot = Robot::gen3();
    let of = |dry, seed| recording(Hidden { dry, ..Hidden::default() }, seed);
    let notes = |recordings: [Recording; 2]| {
        let subject = Subject::Arm(&robot, &[]);
        let found = investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap();
        let differs = |note: &String| note.contains("differs between the recordings");
        let notes = found.finding.notes.into_iter();
        notes.filter(differs).collect::<Vec<String>>()
    };
    let told = notes([of(1.5, 1), of(1.62, 2)]);
    let [note] = &told[..] else { panic!("{told:?}") };
    assert!(note.starts_with("the dry friction of joint 3"), "{note}");
    assert!(note.contains("1.5 N*m in loaded 1, 1.6 N*m in loaded 2"), "{note}");
    assert!(notes([of(1.5, 1), of(1.5, 2)]).is_empty());
}

/// What is said of an arm whose links are off: effects by name and place, each with its first number and how sure that is.
fn of_an_arm_that_is_off(hidden: Hidden) -> Vec<(String, String, f64, f64)> {
    let robot = Robot::gen3();
    let hidden = Hidden { is_off: true, ..hidden };
    let recordings = [recording(hidden, 1), recording(hidden, 2)];
    let subject = Subject::Arm(&robot, &[]);
    let found = investigate(&recordings, subject, &Options::default(), &mut |_, _| {}).unwrap();
    assert!(!found.finding.identified.is_empty(), "{:#?}", found.finding);
    let of = |effect: &trueup::discovery::finding::Effect| {
        let number = ["mass", "coefficient", "gain", "torque"]
            .into_iter()
            .find_map(|name| effect.parameters.get(name));
        let (Value::Number(value), Value::Number(std)) =
            number.map(|number| (&number.value, &number.std)).unwrap()
        else {
            panic!("{effect:?}")
        };
        (effect.name.clone(), effect.at.clone(), *value, *std)
    };
    let mut told: Vec<_> = found.finding.effects.iter().map(of).collect();
    told.sort_by(|a, b| a.0.cmp(&b.0));
    told
}

/// Links that are off and a gain were ten effects.
#[test]
fn what_is_missing_beside_links_that_are_off_is_told_with_them() {
    assert!(of_an_arm_that_is_off(Hidden { is_empty: true, ..Hidden::default() }).is_empty());
    let is = |told: &(String, String, f64, f64), name: &str, at: &str, value: f64, near: f64| {
        assert_eq!((&told.0[..], &told.1[..]), (name, at), "{told:?}");
        assert!((told.2 - value).abs() < near, "{told:?}, not {value}");
        assert!((told.2 - value).abs() < 4.0 * told.3, "{told:?}, not {value}");
    };
    let hidden = Hidden { spring: 15.0, rest: -0.5, is_empty: true, ..Hidden::default() };
    let told = of_an_arm_that_is_off(hidden);
    assert_eq!(told.len(), 2, "{told:#?}");
    is(&told[0], "linear_stiffness", "joint_2", 15.0, 0.8);
    is(&told[1], "torque_offset", "joint_2", 7.5, 0.4);
    let told = of_an_arm_that_is_off(Hidden { gain: 0.12, is_empty: true, ..Hidden::default() });
    assert_eq!(told.len(), 1, "{told:#?}");
    is(&told[0], "torque_gain", "joint_4", 1.12, 0.01);
}

/// Links share the weight of a load, so none of it is surer than they are: it was told to a third of a gram, and 0.3 kg too little.
#[test]
fn a_load_beside_links_that_are_off_is_as_sure_as_they_are() {
    let told = of_an_arm_that_is_off(Hidden::default());
    let [(name, at, mass, std)] = &told[..] else { panic!("{told:#?}") };
    assert_eq!((&name[..], &at[..]), ("payload", "tool"));
    assert!((mass - MASS).abs() < 3.0 * std, "{mass} kg ± {std}");
    assert!((mass - MASS).abs() < 0.15 && *std > 0.01, "{mass} kg ± {std}");
}
