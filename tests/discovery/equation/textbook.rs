//! The models of the standard library: clean, and true to the machines they are of.

use trueup::discovery::equation::compile::compile;
use trueup::discovery::equation::model_in;
use trueup::discovery::finding::Verdict;
use trueup::discovery::recording::{Map, Recording};

use super::{ask, table, wiggle};

const MODELS: [(&str, &str); 10] = [
    ("cart_pole", include_str!("../../../stdlib/models/cart_pole.task")),
    ("dc_motor", include_str!("../../../stdlib/models/dc_motor.task")),
    ("emps", include_str!("../../../stdlib/models/emps.task")),
    ("heater", include_str!("../../../stdlib/models/heater.task")),
    ("joint_drive", include_str!("../../../stdlib/models/joint_drive.task")),
    ("mass_spring_damper", include_str!("../../../stdlib/models/mass_spring_damper.task")),
    ("pendulum", include_str!("../../../stdlib/models/pendulum.task")),
    ("servo", include_str!("../../../stdlib/models/servo.task")),
    ("tank", include_str!("../../../stdlib/models/tank.task")),
    ("tanks", include_str!("../../../stdlib/models/tanks.task")),
];

fn text(name: &str) -> &'static str {
    MODELS.iter().find(|(n, _)| *n == name).unwrap().1
}

#[test]
fn every_model_is_clean_and_has_units_for_what_it_measures() {
    for (name, text) in MODELS {
        let model = model_in(text, name).unwrap_or_else(|| panic!("{name}"));
        assert!(!model.doc.is_empty(), "{name} says what it is");
        let compiled = compile(&model).unwrap_or_else(|found| panic!("{name}: {found:#?}"));
        if name != "heater" {
            assert!(compiled.outputs.iter().all(|o| o.dimension.is_some()), "{name}");
        }
    }
}

/// A machine that is as its model says: its numbers are found, and nothing is missing.
#[track_caller]
fn finds(
    name: &str,
    columns: &str,
    start: &[f64],
    rates: impl Fn(f64, &[f64]) -> Vec<f64> + Copy,
    measure: impl Fn(&[f64]) -> f64 + Copy,
    input: impl Fn(f64) -> f64 + Copy,
    numbers: &[(&str, f64)],
) {
    let made = |seed: u32| {
        let input = |t: f64| input(t + 10.0 * f64::from(seed));
        let text =
            table(300, 0.03, seed, 1e-3, start, |_, u, x| rates(u, x), |_, x| measure(x), input);
        let text = text.replace("t[s],u,y", columns);
        Recording::read(&format!("{name} {seed}"), &text, None, &Map::default()).unwrap()
    };
    let finding = ask(text(name), &[made(1), made(2)]).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::NothingMissing, "{name}: {finding:#?}");
    let fitted = finding.notes.iter().find_map(|n| n.strip_prefix("fitted to the recordings: "));
    let fitted = fitted.unwrap_or_else(|| panic!("{finding:#?}"));
    for (parameter, truth) in numbers {
        let found = fitted.split(", ").find_map(|p| p.strip_prefix(&format!("{parameter} = ")));
        let found = found.and_then(|p| p.split(' ').next()?.parse::<f64>().ok());
        let found = found.unwrap_or_else(|| panic!("{parameter}: {fitted}"));
        assert!((found / truth - 1.0).abs() < 0.03, "{parameter}: {found}, truth {truth}");
    }
}

#[test]
fn a_pendulum_gives_its_length_and_mass() {
    let rates = |u: f64, x: &[f64]| vec![x[1], -9.80665 / 0.4 * x[0].sin() + u / (0.3 * 0.16)];
    let numbers = [("length", 0.4), ("mass", 0.3)];
    let push = |t: f64| 0.3 * wiggle(t, 0.0);
    finds("pendulum", "t[s],u[N*m],q[rad]", &[0.2, 0.0], rates, |x| x[0], push, &numbers);
}

#[test]
fn an_oscillator_a_motor_and_a_servo_give_theirs() {
    let rates = |u: f64, x: &[f64]| vec![x[1], u - 14.0 * x[0] - 0.8 * x[1]];
    let numbers = [("stiffness", 14.0), ("damping", 0.8)];
    let push = |t: f64| 4.0 * wiggle(t, 0.0);
    let columns = "t[s],u[N],q[m]";
    finds("mass_spring_damper", columns, &[0.0, 0.0], rates, |x| x[0], push, &numbers);

    let rates = |u: f64, x: &[f64]| vec![x[1], (0.05 * (u - 0.05 * x[1]) - 0.0003 * x[1]) / 0.0008];
    let numbers = [("inertia", 0.0008), ("damping", 0.0003)];
    let columns = "t[s],u[V],w[rad/s]";
    finds("dc_motor", columns, &[0.0, 0.0], rates, |x| x[1], |t| wiggle(t, 0.0), &numbers);

    let rates = |u: f64, x: &[f64]| vec![x[1], 80.0 * (u - x[0]) - 11.0 * x[1]];
    let numbers = [("stiffness", 80.0), ("damping", 11.0)];
    let columns = "t[s],u[rad],q[rad]";
    finds("servo", columns, &[0.0, 0.0], rates, |x| x[0], |t| wiggle(t, 0.0), &numbers);
}

#[test]
fn a_tank_and_a_heater_give_theirs() {
    let rates = |u: f64, x: &[f64]| vec![0.8 * u - 0.9 * x[0].max(0.0).sqrt()];
    let push = |t: f64| 1.5 + 0.6 * wiggle(t, 0.0);
    let numbers = [("inflow", 0.8), ("outflow", 0.9)];
    finds("tank", "t[s],u[V],level[m]", &[1.0], rates, |x| x[0], push, &numbers);

    let rates = |u: f64, x: &[f64]| vec![3.0 * u - 0.7 * x[0]];
    let numbers = [("gain", 3.0), ("loss", 0.7)];
    finds("heater", "t[s],u,y", &[1.0], rates, |x| x[0], push, &numbers);
}

/// Most models name what is measured after the state it is: a sensor of it can be wrong all the same.
#[test]
fn a_sensor_that_bears_the_name_of_its_state_can_drift() {
    let made = |seed: u32| {
        let push = |t: f64| 4.0 * wiggle(t, f64::from(seed));
        let rates = |_: f64, u: f64, x: &[f64]| vec![x[1], u - 14.0 * x[0] - 0.8 * x[1]];
        let sensor = |t: f64, x: &[f64]| x[0] + 0.02 * t;
        let text = table(300, 0.03, seed, 1e-3, &[0.0, 0.0], rates, sensor, push);
        let text = text.replace("t[s],u,y", "t[s],u[N],q[m]");
        Recording::read(&format!("drifting {seed}"), &text, None, &Map::default()).unwrap()
    };
    let outcome = ask(text("mass_spring_damper"), &[made(1), made(2)]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Named, "{finding:#?}");
    let effect = &finding.effects[0];
    assert_eq!((effect.name.as_str(), effect.at.as_str()), ("output_drift", "q"));
    assert!(outcome.text.contains("output q = q + q_drift*t"), "{}", outcome.text);
}

/// Cart and pole keep their energy when nothing pushes: the equations of the text are those of Lagrange.
#[test]
fn a_cart_with_a_pole_keeps_its_energy() {
    use trueup::discovery::equation::columns::Data;
    use trueup::discovery::equation::simulate::{Hold, Scheme, simulate};
    let compiled = compile(&model_in(text("cart_pole"), "cart_pole").unwrap()).unwrap();
    let n = 400;
    let data = Data {
        name: String::new(),
        time: (0..n).map(|i| f64::from(i) * 0.01).collect(),
        step: 0.01,
        inputs: vec![vec![0.0; n as usize]],
        outputs: vec![vec![0.0; n as usize]; 2],
        noise: vec![0.0; 2],
        begins: true,
    };
    let (m, p, l, g) = (1.3, 0.4, 0.6, 9.80665);
    let energy = |x: &[f64]| {
        let (v, q, w) = (x[1], x[2], x[3]);
        let (px, py) = (v + l * w * q.cos(), l * w * q.sin());
        0.5 * m * v * v + 0.5 * p * (px * px + py * py) - p * g * l * q.cos()
    };
    let start = [0.0, 0.5, 1.2, -0.7];
    let free: Vec<Option<f64>> = start.iter().copied().map(Some).collect();
    let params: Vec<f64> = compiled
        .params
        .iter()
        .map(|param| match param.name.as_str() {
            "cart" => m,
            "pole" => p,
            _ => l,
        })
        .collect();
    let scheme = Scheme { hold: Hold::Zero, substeps: 4, shift: 0.0 };
    let mut out = vec![0.0; 2 * n as usize];
    let end = simulate(&compiled, &data, 0..n as usize, scheme, &params, &free, &mut out).unwrap();
    assert!((energy(&end) / energy(&start) - 1.0).abs() < 1e-8, "{end:?}");
    assert!(out.iter().step_by(2).any(|x| x.abs() > 0.05), "it moved");
}
