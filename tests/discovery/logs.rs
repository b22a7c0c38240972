//! Logs as real arms leave them: no controller known, friction of two kinds in every joint, rotors that the
//! model has not, a logger that writes samples twice and whose clock jitters. What was planted is
//! written here; the torques come from the general algorithms of `motion`, not from those under test.

use std::fmt::Write as _;

use trueup::discovery::finding::{Effect, Finding, Value, Verdict};
use trueup::discovery::recording::{Map, Recording};
use trueup::discovery::{Options, Subject, investigate};
use trueup::motion::Robot;
use trueup::motion::dynamics::{Bodies, Dynamics};

use super::{bare_arm, folder};

/// Coulomb, N·m, and viscous friction, N·m·s/rad, of each joint.
const FRICTION: [[f64; 2]; 7] =
    [[1.2, 0.9], [2.1, 1.4], [0.8, 0.5], [1.5, 1.1], [0.6, 0.4], [0.7, 0.6], [0.5, 0.3]];

/// Inertia of joint 2's rotor, kg·m².
const ROTOR: f64 = 0.5;

/// Offset of each joint's torque sensor, N·m.
const OFFSET: [f64; 7] = [0.3, -0.5, 0.2, 0.45, -0.25, 0.15, -0.1];

/// What a log is like.
#[expect(clippy::struct_excessive_bools, reason = "each is one thing that a log may have")]
#[derive(Clone, Copy, Default)]
struct Logger {
    friction: bool,
    stutters: bool,
    /// Link 3 weighs 0.25 kg more than its file says.
    heavier: bool,
    offsets: bool,
    /// Motor currents in the place of torques.
    currents: bool,
    /// How large the coloured noise of the torques is, correlated over ten rows, N·m.
    coloured: f64,
    /// The steps in which angles, rad, and torques, N·m, are read; 0 for fine ones.
    steps: [f64; 2],
    /// A row in twelve is lost.
    loses: bool,
    /// How late torques are read, s.
    late: f64,
    /// A controller with known gains drives the arm.
    driven: bool,
    /// Dry friction is larger by this part forwards, and smaller backwards.
    lopsided: f64,
    /// A spring at joint 2 that is at rest at -1 rad, N·m/rad.
    spring: f64,
    /// A mass 3 cm beside the tip's axis and 6 cm ahead, kg.
    load: f64,
    /// It sits further out by this along every axis of the tip, m.
    further: f64,
}

/// Gains of the controller on position, N·m/rad, and speed, N·m·s/rad.
const GAINS: [[f64; 7]; 2] = [
    [2000.0, 2000.0, 2000.0, 2000.0, 500.0, 500.0, 500.0],
    [100.0, 100.0, 100.0, 100.0, 50.0, 50.0, 50.0],
];

/// What the drives turn an ampere into, N·m/A.
const DRIVES: [f64; 7] = [11.0, 9.5, 10.2, 8.8, 5.5, 6.1, 4.9];

/// A number that looks like chance, nearly normal with standard deviation 1.
fn chance(i: usize) -> f64 {
    let one = |k: usize| ((k as f64 * 12.9898 + 4.1414).sin() * 43758.547).rem_euclid(1.0);
    (0..12).map(|k| one(12 * i + k)).sum::<f64>() - 6.0
}

/// Angles, rad, speeds and accelerations at a time, s; `motion` chooses the phases.
fn moves(motion: usize, t: f64) -> [[f64; 7]; 3] {
    let [mut q, mut dq, mut ddq] = [[0.0; 7]; 3];
    for j in 0..7 {
        q[j] = 0.3 * j as f64 - 0.8;
        for k in 1..=3 {
            let w = 0.55 * k as f64 + 0.04 * j as f64;
            let phase = 1.3 * (motion * 5 + j * 3 + k) as f64;
            let (sine, cosine) = (w * t + phase).sin_cos();
            let size = 0.45 / k as f64;
            q[j] += size * sine;
            dq[j] += size * w * cosine;
            ddq[j] -= size * w * w * sine;
        }
    }
    [q, dq, ddq]
}

/// Torque against a joint's speed, N·m.
fn friction(joint: usize, dq: f64, lopsided: f64) -> f64 {
    let [dry, fluid] = FRICTION[joint];
    dry * (1.0 + lopsided * dq.signum()) * (dq / 2e-3).tanh() + fluid * dq
}

/// Returns what a controller with gravity fed forward was asked for, row by row, so that it made the motion: the equation
/// `kp e + kd de/dt + gravity(q + e) = tau` of how far the arm is behind, solved step by step.
fn commands(dynamics: &Dynamics, logger: Logger, motion: usize) -> Vec<[f64; 7]> {
    let mut behind: Option<[f64; 7]> = None;
    let mut asked = Vec::new();
    for tick in 0..12_000 {
        let [q, dq, ddq] = moves(motion, f64::from(tick) * 1e-3);
        let mut tau = dynamics.inverse(&q, &dq, &ddq).unwrap();
        if logger.friction {
            tau[1] += ROTOR * ddq[1];
            (0..7).for_each(|j| tau[j] += friction(j, dq[j], logger.lopsided));
        }
        let held = |at: &[f64; 7]| dynamics.inverse(at, &[0.0; 7], &[0.0; 7]).unwrap();
        let first = || {
            let weight = held(&q);
            std::array::from_fn(|j| (tau[j] - weight[j]) / GAINS[0][j])
        };
        let now = behind.unwrap_or_else(first);
        let command = std::array::from_fn(|j| q[j] + now[j]);
        if tick % 10 == 0 {
            asked.push(command);
        }
        let weight = held(&command);
        let rate = |j: usize| (tau[j] - weight[j] - GAINS[0][j] * now[j]) / GAINS[1][j];
        behind = Some(std::array::from_fn(|j| now[j] + 1e-3 * rate(j)));
    }
    asked
}

/// Twelve seconds at 100 Hz; `motion` chooses the phases.
fn log(logger: Logger, motion: usize) -> Recording {
    let mut urdf = std::fs::read_to_string(folder().join("gen3_bare.urdf")).unwrap();
    if logger.heavier {
        let link = urdf.find("\"half_arm_2_link\"").unwrap();
        let (before, after) = urdf.split_at(link);
        urdf = format!("{before}{}", after.replacen("1.1636", "1.4136", 1));
    }
    if logger.load > 0.0 {
        let load = format!(
            r#"<link name="load"><inertial><mass value="{}"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
            <joint name="holds" type="fixed"><parent link="end_effector_link"/><child link="load"/><origin xyz="{} {} {}"/></joint>
            </robot>"#,
            logger.load,
            0.03 + logger.further,
            logger.further,
            0.06 + logger.further
        );
        urdf = urdf.replace("</robot>", &load);
    }
    let robot = Robot::from_urdf(&urdf, Some("end_effector_link")).unwrap();
    let dynamics = Dynamics::new(&robot, Bodies::All);
    let effort = if logger.currents { ("current", "A") } else { ("tau", "N*m") };
    let names = [("q", "rad"), ("dq", "rad/s"), effort].into_iter();
    let mut text = "t[s]".to_owned();
    for (name, unit) in names {
        for joint in 1..=7 {
            let _ = write!(text, ",{name}_{joint}[{unit}]");
        }
    }
    let asked = if logger.driven { commands(&dynamics, logger, motion) } else { Vec::new() };
    for joint in (1..=7).filter(|_| logger.driven) {
        let _ = write!(text, ",q_cmd_{joint}[rad]");
    }
    text.push('\n');
    let mut last = String::new();
    let mut coloured = [0.0; 7];
    for row in 0..1200 {
        let t = row as f64 * 0.01;
        let [q, dq, ddq] = moves(motion, t - logger.late);
        let mut tau = dynamics.inverse(&q, &dq, &ddq).unwrap();
        if logger.friction {
            tau[1] += ROTOR * ddq[1];
            (0..7).for_each(|j| tau[j] += friction(j, dq[j], logger.lopsided));
        }
        tau[1] += logger.spring * (q[1] + 1.0);
        if logger.offsets {
            (0..7).for_each(|j| tau[j] += OFFSET[j]);
        }
        for (j, noise) in coloured.iter_mut().enumerate() {
            let kick = logger.coloured * chance(900_000 + (motion * 1200 + row) * 7 + j);
            *noise = 0.9 * *noise + (1.0_f64 - 0.81).sqrt() * kick;
            tau[j] += *noise;
        }
        if logger.loses && chance(700_000 + motion * 1200 + row) > 1.4 {
            continue;
        }
        let [q, dq, _] = moves(motion, t);
        let mut values = String::new();
        let groups: [(&[f64], f64); 3] = [(&q, 2e-5), (&dq, 2e-3), (tau.as_slice(), 0.05)];
        for (group, (measured, noise)) in groups.into_iter().enumerate() {
            for (j, value) in measured.iter().enumerate() {
                let noise = noise * chance(((motion * 1200 + row) * 3 + group) * 7 + j);
                let by = if group == 2 && logger.currents { DRIVES[j] } else { 1.0 };
                let step = [logger.steps[0], 0.0, logger.steps[1]][group];
                let read = (value + noise) / by;
                let read = if step > 0.0 { (read / step).round() * step } else { read };
                let _ = write!(values, ",{read:.7}");
            }
        }
        for command in asked.get(row).into_iter().flatten() {
            let _ = write!(values, ",{command:.7}");
        }
        let mut stamp = t;
        if logger.stutters {
            stamp += 4e-4 * chance(500_000 + motion * 1200 + row).clamp(-3.0, 3.0);
            if row % 17 == 9 {
                values.clone_from(&last);
            }
        }
        last.clone_from(&values);
        let _ = writeln!(text, "{stamp:.6}{values}");
    }
    let sidecar = if logger.driven {
        format!(
            r#"{{"torque_sensor": "motor", "noise": {{"q_rad": 2e-5, "dq_rad_s": 2e-3, "tau_nm": 0.05}}, "controller":
            {{"type": "pd_with_gravity", "kp_nm_per_rad": {:?}, "kd_nm_s_per_rad": {:?}}}}}"#,
            GAINS[0], GAINS[1]
        )
    } else {
        r#"{"torque_sensor": "motor"}"#.to_owned()
    };
    Recording::read("log", &text, Some(("sidecar", &sidecar)), &Map::default()).unwrap()
}

fn found(logger: Logger) -> Finding {
    let recordings = [log(logger, 0), log(logger, 1)];
    let robot = bare_arm();
    let arm = Subject::Arm(&robot, &[]);
    investigate(&recordings, arm, &Options::default(), &mut |_, _| {}).unwrap().finding
}

fn number(effect: &Effect, name: &str) -> f64 {
    match &effect.parameters[name].value {
        Value::Number(value) => *value,
        other @ Value::Vector(_) => panic!("{other:?}"),
    }
}

/// Currents, and nobody says what an ampere is worth: joints whose motion tells it have both frictions, in newton metres.
#[test]
fn friction_is_found_in_motor_currents() {
    let finding = found(Logger { friction: true, currents: true, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::Several, "{:?}", finding.effects);
    let note = finding.notes.iter().find(|note| note.starts_with("torques are currents")).unwrap();
    let told = note.split_once("joint by joint ").unwrap().1.split_once(" N·m/A").unwrap().0;
    let mut known = 0;
    for (j, told) in told.split(", ").enumerate() {
        let Some((told, _)) = told.split_once(" ± ") else { continue };
        let told: f64 = told.parse().unwrap();
        known += 1;
        assert!((told / DRIVES[j] - 1.0).abs() < 0.05, "joint {}: {told}", j + 1);
        let at = format!("joint_{}", j + 1);
        for (name, value) in
            [("coulomb_friction", FRICTION[j][0]), ("viscous_friction", FRICTION[j][1])]
        {
            let effect = finding.effects.iter().find(|e| e.name == name && e.at == at);
            let effect = effect.unwrap_or_else(|| panic!("no {name} at {at}"));
            let parameter = if name == "coulomb_friction" { "torque" } else { "coefficient" };
            let found = number(effect, parameter);
            assert!((found / value - 1.0).abs() < 0.1, "{name} {at}: {found} for {value}");
        }
    }
    assert!(known >= 3, "{told}");
    let usual = ["coulomb_friction", "viscous_friction", "armature"];
    assert!(finding.effects.iter().all(|effect| usual.contains(&effect.name.as_str())));
}

/// A kilogram in the hand was taken for constants of half their size, and was not told itself.
#[test]
fn a_load_is_told_beside_what_an_ampere_is_worth() {
    let finding = found(Logger { load: 1.0, currents: true, ..Logger::default() });
    let note = finding.notes.iter().find(|note| note.starts_with("torques are currents")).unwrap();
    assert!(note.contains("beside a load of "), "{note}");
    let told = note.split_once("joint by joint ").unwrap().1.split_once(" N·m/A").unwrap().0;
    for (j, told) in told.split(", ").enumerate().take(6) {
        let (told, _) = told.split_once(" ± ").unwrap();
        let told: f64 = told.parse().unwrap();
        assert!((told / DRIVES[j] - 1.0).abs() < 0.05, "joint {}: {told}", j + 1);
    }
    let payload = finding.effects.iter().find(|effect| effect.name == "payload");
    let payload = payload.unwrap_or_else(|| panic!("{:?}", finding.effects));
    let mass = number(payload, "mass");
    assert!((mass - 1.0).abs() < 0.05, "{mass}");
    // It is no surer than what an ampere is worth.
    let std = &payload.parameters["mass"].std;
    assert!(matches!(std, Value::Number(std) if *std > 0.005), "{std:?}");
}

/// The controller is known, but friction of two kinds in seven joints is more than a simulation with it tells apart.
#[test]
fn friction_everywhere_is_named_beside_a_controller() {
    let finding = found(Logger { friction: true, driven: true, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::Several, "{:?}", finding.effects);
    for (j, own) in FRICTION.iter().enumerate() {
        let at = format!("joint_{}", j + 1);
        let laws = [("coulomb_friction", "torque"), ("viscous_friction", "coefficient")];
        for ((name, parameter), value) in laws.into_iter().zip(own) {
            let effect = finding.effects.iter().find(|e| e.name == name && e.at == at);
            let effect = effect.unwrap_or_else(|| panic!("no {name} at {at}"));
            let found = number(effect, parameter);
            assert!((found / value - 1.0).abs() < 0.05, "{name} {at}: {found} for {value}");
        }
    }
    let told = |words: &str| finding.notes.iter().any(|note| note.contains(words));
    assert!(told("along the measured motion"), "{:?}", finding.notes);
    assert!(!told("no controller is known"), "{:?}", finding.notes);
    assert!(finding.effects.iter().all(|effect| effect.stability <= 1.0));
}

/// Friction that differs by a hundredth from one direction to the other is plain friction, one that differs by a tenth is not.
#[test]
fn a_general_law_of_friction_is_more_than_its_special_case() {
    for (lopsided, is_general) in [(0.005, false), (0.1, true)] {
        let finding = found(Logger { friction: true, lopsided, ..Logger::default() });
        let joint_2 =
            |name: &str| finding.effects.iter().any(|e| e.name == name && e.at == "joint_2");
        let is_told = joint_2("asymmetric_friction") || joint_2("torque_offset");
        assert_eq!(is_told, is_general, "{lopsided}: {:?}", finding.effects);
        assert!(!joint_2("stribeck_friction"), "{lopsided}: {:?}", finding.effects);
    }
}

#[test]
fn a_stuttering_log_of_a_known_arm_raises_no_alarm() {
    let finding = found(Logger { stutters: true, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:?}", finding.effects);
    assert!((finding.gap.before.heldout - 1.0).abs() < 0.1, "{:?}", finding.gap);
    let told = |words: &str| finding.notes.iter().any(|note| note.contains(words));
    assert!(told("71 of 1200 rows repeat"), "{:?}", finding.notes);
    assert!(told("an even clock is used"), "{:?}", finding.notes);
}

/// Torques are read 3.5 ms late, rows are 10 ms apart: no effect of its own, and no friction.
#[test]
fn torques_that_are_a_little_late_are_no_friction() {
    let late = Logger { late: 3.5e-3, ..Logger::default() };
    let finding = found(late);
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{:?}", finding.effects);
    let told = finding.notes.iter().find_map(|note| note.strip_prefix("torques are read "));
    let told: f64 = told.and_then(|note| note.split(' ').next()?.parse().ok()).unwrap_or(f64::NAN);
    assert!((told - 3.5).abs() < 0.6, "{told} ms: {:?}", finding.notes);
    let finding = found(Logger { friction: true, ..late });
    for (j, [_, fluid]) in FRICTION.iter().enumerate() {
        let at = format!("joint_{}", j + 1);
        let is_it = |e: &&Effect| e.name == "viscous_friction" && e.at == at;
        let effect = finding.effects.iter().find(is_it).unwrap_or_else(|| panic!("{at}"));
        let found = number(effect, "coefficient");
        assert!((found / fluid - 1.0).abs() < 0.05, "{at}: {found} for {fluid}");
    }
}

/// Errors of measurement, alone and mixed.
#[test]
fn how_an_arm_is_measured_is_no_effect() {
    let plain = Logger::default();
    let controls = [
        ("coloured", Logger { coloured: 0.15, ..plain }),
        ("coarse angles", Logger { steps: [1e-3, 0.0], ..plain }),
        ("coarse torques", Logger { steps: [0.0, 0.5], ..plain }),
        ("coloured, lost rows", Logger { coloured: 0.1, loses: true, ..plain }),
        ("coarse, stutters", Logger { steps: [3e-4, 0.2], stutters: true, ..plain }),
        ("all", Logger { coloured: 0.1, steps: [3e-4, 0.2], loses: true, stutters: true, ..plain }),
    ];
    for (name, logger) in controls {
        let finding = found(logger);
        assert_eq!(finding.verdict, Verdict::NothingMissing, "{name}: {finding:#?}");
    }
}

#[test]
fn friction_of_both_kinds_in_every_joint_and_a_rotor_are_told_apart() {
    let finding = found(Logger { friction: true, stutters: true, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::Several, "{:?}", finding.effects);
    let at = |name: &str, seat: &str| {
        let found = finding.effects.iter().find(|e| e.name == name && e.at == seat);
        found.unwrap_or_else(|| panic!("no {name} at {seat} in {:?}", finding.effects))
    };
    for (j, [dry, fluid]) in FRICTION.iter().enumerate() {
        let seat = format!("joint_{}", j + 1);
        let torque = number(at("coulomb_friction", &seat), "torque");
        assert!((torque / dry - 1.0).abs() < 0.05, "{seat}: {torque} N·m");
        let coefficient = number(at("viscous_friction", &seat), "coefficient");
        assert!((coefficient / fluid - 1.0).abs() < 0.1, "{seat}: {coefficient} N·m·s/rad");
    }
    let rotor = number(at("armature", "joint_2"), "inertia");
    assert!((rotor / ROTOR - 1.0).abs() < 0.1, "{rotor} kg·m²");
    assert_eq!(finding.effects.len(), 15, "{:?}", finding.effects);
    assert!(finding.gap.after.heldout < 1.1, "{:?}", finding.gap);
}

#[test]
fn a_link_that_is_heavier_than_its_file_says_is_named() {
    let finding = found(Logger { heavier: true, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::Named, "{:?}", finding.effects);
    let effect = &finding.effects[0];
    assert_eq!((effect.name.as_str(), effect.at.as_str()), ("link_mass", "joint_3"));
    let mass = number(effect, "mass");
    assert!((mass - 0.25).abs() < 0.03, "{mass} kg");
}

#[test]
fn friction_and_offsets_everywhere_beside_a_link_that_is_heavier_leave_nothing_to_stand_in() {
    let everything = Logger {
        friction: true,
        stutters: true,
        heavier: true,
        offsets: true,
        ..Logger::default()
    };
    let finding = found(everything);
    assert_eq!(finding.verdict, Verdict::Several, "{:?}", finding.effects);
    let at = |name: &str, joint: usize, parameter: &str| {
        let seat = format!("joint_{joint}");
        let found = finding.effects.iter().find(|e| e.name == name && e.at == seat);
        number(found.unwrap_or_else(|| panic!("no {name} at {seat}: {finding:#?}")), parameter)
    };
    for (j, [dry, fluid]) in FRICTION.iter().enumerate() {
        let near = |name: &str, parameter: &str, truth: f64, off: f64| {
            let value = at(name, j + 1, parameter);
            assert!((value - truth).abs() < off, "{name} {}: {value} for {truth}", j + 1);
        };
        near("coulomb_friction", "torque", *dry, 0.05 * dry);
        near("viscous_friction", "coefficient", *fluid, 0.1 * fluid);
        near("torque_offset", "torque", OFFSET[j], 0.05);
    }
    assert!((at("armature", 2, "inertia") / ROTOR - 1.0).abs() < 0.1);
    assert!((at("link_mass", 3, "mass") - 0.25).abs() < 0.05);
    assert_eq!(finding.effects.len(), 7 * 3 + 2, "{:#?}", finding.effects);
    assert!(finding.gap.after.heldout < 1.1, "{:?}", finding.gap);
}

/// Other links would take most of it, each a little, and what is left of it would look like many effects.
#[test]
fn a_load_beside_the_axis_is_one_effect() {
    let finding = found(Logger { load: 1.3, ..Logger::default() });
    assert_eq!(finding.verdict, Verdict::Named, "{:#?}", finding.effects);
    assert_eq!(finding.effects[0].name, "payload");
    let mass = number(&finding.effects[0], "mass");
    assert!((mass - 1.3).abs() < 0.013, "{mass} kg");
    assert!(finding.identified.is_empty(), "{:?}", finding.identified);
}

/// Links and load share the weight; on a light wrist the load's inertia, and a load of less than nothing on both, would have to
/// be paid for by its mass.
#[test]
fn a_load_that_one_recording_alone_bears_is_as_heavy_as_it_is_said_to_be_sure() {
    let robot = bare_arm();
    for (load, further, bears) in [(1.3, 0.0, 1), (1.5, 0.1, 1), (1.5, 0.1, 0)] {
        let loaded = Logger { load, further, ..Logger::default() };
        let of = |k: usize| log(if k == bears { loaded } else { Logger::default() }, k);
        let arm = Subject::Arm(&robot, &[]);
        let options = Options::default();
        let found = investigate(&[of(0), of(1)], arm, &options, &mut |_, _| {}).unwrap();
        let finding = found.finding;
        assert_eq!(finding.verdict, Verdict::DifferentMachines, "{finding:#?}");
        let [one] = &finding.effects[..] else { panic!("{}: {finding:#?}", finding.reason) };
        assert_eq!((one.name.as_str(), one.at.as_str()), ("payload", "tool"));
        let (mass, std) = (number(one, "mass"), &one.parameters["mass"].std);
        let Value::Number(std) = std else { panic!("{std:?}") };
        assert!((mass - load).abs() < 3.0 * std, "{mass} +- {std} kg for {load}");
        assert!(*std < 0.02 * load, "{mass} +- {std} kg");
        let (com, std) = (&one.parameters["com"].value, &one.parameters["com"].std);
        let (Value::Vector(com), Value::Vector(std)) = (com, std) else { panic!("{com:?}") };
        for (axis, at) in [0.03, 0.0, 0.06].into_iter().enumerate() {
            let off = (com[axis] - at - further).abs();
            assert!(off < 3.0 * std[axis], "{com:?} +- {std:?} m for {at} + {further}");
        }
    }
}

#[test]
fn a_spring_is_one_effect() {
    let finding = found(Logger { spring: 20.0, ..Logger::default() });
    let effects = &finding.effects;
    assert!(effects.iter().all(|e| e.at == "joint_2"), "{effects:#?}");
    let spring = effects.iter().find(|effect| effect.name == "linear_stiffness").unwrap();
    let coefficient = number(spring, "coefficient");
    assert!((coefficient - 20.0).abs() < 0.2, "{coefficient} N*m/rad");
    assert!(finding.identified.is_empty(), "{:?}", finding.identified);
}
