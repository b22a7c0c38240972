//! Real machines; read in place and skipped where the folder is absent.

use trueup::discovery::equation::{Options, investigate};
use trueup::discovery::finding::{Finding, Value, Verdict};
use trueup::discovery::recording::{Map, Recording};

use super::ask;
use crate::absent::public;

fn text(file: &str) -> Option<String> {
    Some(std::fs::read_to_string(public(file)?).unwrap())
}

fn read(file: &str, map: &str) -> Option<Recording> {
    Some(Recording::read(file, &text(file)?, None, &Map::parse(map).unwrap()).unwrap())
}

/// The value of an effect's one parameter.
fn number(finding: &Finding, name: &str, at: &str, parameter: &str) -> f64 {
    let effect = finding.effects.iter().find(|e| e.name == name && e.at == at);
    match effect.and_then(|e| e.parameters.get(parameter)).map(|p| &p.value) {
        Some(Value::Number(value)) => *value,
        _ => panic!("{finding:#?}"),
    }
}

/// Whether a number is within this part of what was published.
fn near(found: f64, published: f64, part: f64) -> bool {
    (found / published - 1.0).abs() < part
}

#[test]
fn the_cascaded_tanks_overflow() {
    let map = "t_s=t[s],u_pump_V=u[V],y_lower_tank_level_V=y[V]";
    let files = ["cascaded_tanks/train.csv", "cascaded_tanks/test.csv"];
    let [Some(train), Some(test)] = files.map(|file| read(file, map)) else { return };
    let outcome = ask(include_str!("../../../stdlib/models/tanks.task"), &[train, test]).unwrap();
    let finding = &outcome.finding;
    assert!(
        finding.effects.iter().any(|e| e.name == "overflow" && e.at == "upper"),
        "{finding:#?}"
    );
    // What is spilt is seen where it goes to: the upper level is not measured.
    let spilt =
        outcome.whys.iter().find(|why| why.name == "overflow" && why.at == "upper").unwrap();
    assert_eq!((spilt.channel.as_str(), spilt.state.as_str()), ("lower'", "upper"));
    // Published with a physical overflow: 0.18 V; the linear approximation 0.75 V. The spread is 2.17 V.
    assert!(finding.gap.after.heldout * 2.17 < 0.30, "{:?}", finding.gap);
}

#[test]
fn the_positioning_system_rubs() {
    let map = "t_s=t[s],q_meas_m=q[m],u_control_V=u[V]";
    let files = ["emps/train.csv", "emps/test_pulses.csv"];
    let [Some(train), Some(test)] = files.map(|file| read(file, map)) else { return };
    let outcome = ask(include_str!("../../../stdlib/models/emps.task"), &[train, test]).unwrap();
    let finding = &outcome.finding;
    let number = |name, parameter| number(finding, name, "v", parameter);
    // Published, by mass: viscous 1.752 forward and 2.527 1/s backward (a worn screw), dry 0.2117 and
    // 0.2168 m/s², which are one number here.
    let near = |found, published| near(found, published, 0.12);
    assert!(near(number("asymmetric_damping", "forward"), 1.752));
    assert!(near(number("asymmetric_damping", "backward"), 2.527));
    assert!(near(number("dry_friction", "coefficient"), 0.2142));
    assert_eq!(finding.effects.len(), 2, "{finding:#?}");
    assert!(finding.gap.after.heldout < 0.03, "{:?}", finding.gap);
}

/// Ten runs of the Gen3's joint 7, each at one speed, never turning round. The first half second is left out, in
/// which the loop is still settling.
#[test]
fn the_gen3_s_joint_7_rubs_and_the_constant_part_is_a_doubt() {
    let file = "kinova_gen3_joint7_friction/constant_velocity_runs.csv";
    let Some(text) = text(file) else { return };
    let steady = |line: &&str| {
        let mut cells = line.split(',');
        cells.nth(1).is_some_and(|sample| sample.parse::<u32>().is_ok_and(|n| n > 500))
            && cells.next_back() != Some("inf")
    };
    let rows: Vec<&str> = text.lines().take(1).chain(text.lines().skip(1).filter(steady)).collect();
    let ask = |torque: &str| {
        let map = format!("{torque}=tau[N*m],dq_rad_per_s=v[rad/s],sample=t[ms]");
        let map = Map::parse(&map).unwrap();
        let runs = Recording::read_runs(file, &rows.join("\n"), None, &map).unwrap();
        assert_eq!(runs.len(), 10);
        ask(include_str!("../../../stdlib/models/joint_drive.task"), &runs).unwrap().finding
    };
    // Published, on the same observer's torque (a torque that brakes): dry 1.597 N·m, fluid 0.784 N·m·s/rad; the
    // square of the speed is not supported.
    let observed = ask("tau_friction_observer_Nm");
    let of = |name, parameter| -number(&observed, name, "v", parameter);
    assert!(near(of("coulomb_friction", "torque"), 1.597, 0.03), "{observed:#?}");
    // Published without the slowest runs, which rub more than a straight line and flatten it: by least squares through
    // all rows that are fitted it is 0.696 N·m·s/rad.
    assert!(near(of("viscous_friction", "coefficient"), 0.784, 0.15), "{observed:#?}");
    assert!(near(of("viscous_friction", "coefficient"), 0.696, 0.03), "{observed:#?}");
    assert!(observed.effects.iter().all(|e| !e.name.contains("quadratic")), "{observed:#?}");
    // What an offset of the speed acts through is worth both.
    let fluid = observed.effects.iter().find(|e| e.name == "viscous_friction").unwrap();
    assert!(fluid.evidence.delta_bic > 60.0 && fluid.heldout_share > 0.5, "{fluid:#?}");
    // On the commanded torque the constant may as well be an offset of its sensor: it never turns round.
    let commanded = ask("tau_cmd_Nm");
    assert_eq!(commanded.verdict, Verdict::Ambiguous, "{commanded:#?}");
    let doubtful =
        |name: &str| commanded.effects.iter().any(|e| e.name == name && e.indistinguishable);
    assert!(doubtful("coulomb_friction") && doubtful("output_offset"), "{commanded:#?}");
    let fluid = commanded.effects.iter().find(|e| e.name == "viscous_friction").unwrap();
    assert!(!fluid.indistinguishable && commanded.next_experiment.is_some(), "{commanded:#?}");
}

/// Whether only drag of one kind or the other is named, or the doubt between the two.
fn is_drag(finding: &Finding) -> bool {
    let names = ["linear_damping", "quadratic_drag"];
    let is_said = matches!(finding.verdict, Verdict::Named | Verdict::Ambiguous);
    let is_one = finding.effects.len() == 1 || finding.effects.iter().all(|e| e.indistinguishable);
    is_said && is_one && finding.effects.iter().all(|e| names.contains(&e.name.as_str()))
}

/// What is found on one drop of a ball and judged on the other, both ways.
fn dropped(ball: &str) -> Option<[Finding; 2]> {
    let model = text("falling_balls/ball.task")?;
    let drop = |i: u32| {
        let file = format!("falling_balls/{ball}_{i}.csv");
        Some(Recording::read(&file, &text(&file)?, None, &Map::default()).unwrap())
    };
    let (one, other) = (drop(1)?, drop(2)?);
    let ways = [[one.clone(), other.clone()], [other, one]];
    Some(ways.map(|drops| ask(&model, &drops).unwrap().finding))
}

/// De Silva, Higdon, Brunton, Kutz, 2020: linear drag fits best, the square nearly as well. What falls never turns
/// round, so it has no spring and no loop.
#[test]
fn light_balls_are_dragged_by_the_air() {
    for ball in ["tennis_ball", "volleyball", "green_basketball", "whiffle_ball_1"] {
        let Some(found) = dropped(ball) else { return };
        for finding in found {
            assert!(is_drag(&finding), "{ball}: {finding:#?}");
        }
    }
}

/// Its drag is below the errors of the video, which are smooth in time, and of its scale, which is another one in
/// each drop.
#[test]
fn a_golf_ball_falls_freely() {
    let Some(found) = dropped("golf_ball") else { return };
    for finding in found {
        assert_eq!(finding.verdict, Verdict::NothingMissing, "{finding:#?}");
    }
}

/// Schmidt and Lipson, 2009. Every twelfth sample is missing, and in one swing damping hardly shows.
#[test]
fn a_pendulum_is_damped() {
    let map = "t_scaled=t[s],theta_rad=q[rad],omega_rad_per_tscaled=w[rad/s]";
    let Some(swing) = read("schmidt_lipson_pendulum/single_pendulum.csv", map) else { return };
    let Some(model) = text("schmidt_lipson_pendulum/pendulum.task") else { return };
    let options = Options { holdout: 0.4, ..Options::default() };
    let outcome = investigate("pendulum.task", &model, "", &[swing], &options, &mut |_, _| {});
    let finding = outcome.unwrap().finding;
    assert!(is_drag(&finding), "{finding:#?}");
    assert!(finding.gap.after.heldout < 0.1, "{:?}", finding.gap);
}
