//! Oscillators with what the field writes into them: Bouc and Wen's loop as in the benchmark of that name,
//! Stribeck's friction, Duffing's spring; and inputs that an actuator swallows in part.

use trueup::discovery::equation::Outcome;
use trueup::discovery::finding::{Value, Verdict};

use super::{ask, record, wiggle};

/// Nothing stands behind the last equation, so that a term and a new line meet there.
const OSCILLATOR: &str = "\
model m {
    input u
    param stiffness = free ~ 20, damping = free ~ 0.5
    state q = free, v = free
    q' = v
    v' = u - stiffness*q - damping*v
    output y = q
}
";

/// The parameters of the only effect, which is `kind` at `at`.
#[track_caller]
fn only(outcome: Outcome, kind: &str, at: &str) -> impl Fn(&str) -> f64 + use<> {
    let finding = outcome.finding;
    assert_eq!(finding.verdict, Verdict::Named, "{finding:#?}");
    let effect = finding.effects[0].clone();
    assert_eq!((effect.name.as_str(), effect.at.as_str()), (kind, at), "{finding:#?}");
    move |role| match effect.parameters[role].value {
        Value::Number(value) => value,
        Value::Vector(_) => panic!("a vector"),
    }
}

/// Thirty lines from 5 to 150 Hz.
fn multisine(t: f64, seed: f64) -> f64 {
    (0..30)
        .map(f64::from)
        .map(|i| (std::f64::consts::TAU * 5.0 * (1.0 + i) * t + seed * (1.0 + i * i)).sin())
        .sum()
}

/// Noël and Schoukens, "Hysteretic benchmark with a dynamic nonlinearity", 2016: their numbers, fewer rows.
#[test]
fn a_loop_of_bouc_and_wen_is_named_with_its_skew() {
    let (alpha, beta, gamma, delta) = (5e4, 1e3, 0.8, -1.1);
    let made = |seed: u32| {
        record(
            500,
            1.0 / 750.0,
            seed,
            8e-6,
            &[0.0; 3],
            |_, u, x| {
                let [q, v, z] = x else { panic!("three states") };
                let loop_rate = alpha * v - beta * (gamma * v.abs() * z + delta * v * z.abs());
                vec![*v, (u - 10.0 * v - 5e4 * q - z) / 2.0, loop_rate]
            },
            |_, x| x[0],
            |t| 13.0 * multisine(t, f64::from(seed)),
        )
    };
    let model = OSCILLATOR
        .replace("u - stiffness*q - damping*v", "(u - stiffness*q - damping*v)/2")
        .replace("free ~ 20", "free ~ 80000");
    let number = only(ask(&model, &[made(1), made(2)]).unwrap(), "hysteresis", "q");
    // Written with a force of its own size, `alpha` and `width` follow from `0.5/width = beta*gamma`.
    let width = 0.5 / (beta * gamma);
    assert!((number("width") / width - 1.0).abs() < 0.1, "{}", number("width"));
    assert!((number("alpha") / (alpha * width / 2.0) - 1.0).abs() < 0.1, "{}", number("alpha"));
    assert!((number("skew") - delta / gamma).abs() < 0.1, "{}", number("skew"));
}

/// Viscous and dry friction with a square of the speed nearly make Stribeck's curve.
#[test]
fn a_peak_of_friction_at_breakaway_is_named_beside_a_spring() {
    let (kinetic, stiction, velocity) = (1.0, 1.94, 0.456);
    let made = |seed: u32| {
        record(
            400,
            0.03,
            seed,
            1e-3,
            &[0.0, 0.0],
            |_, u, x| {
                let peak = (stiction - kinetic) * (-(x[1] / velocity).powi(2)).exp();
                vec![x[1], u - 14.0 * x[0] - 0.8 * x[1] - (kinetic + peak) * x[1].signum()]
            },
            |_, x| x[0],
            |t| 4.0 * wiggle(t, 1.7 * f64::from(seed)),
        )
    };
    let found = ask(OSCILLATOR, &[made(3), made(4)]).unwrap();
    let number = only(found, "stribeck_friction", "v");
    assert!((number("torque") / kinetic - 1.0).abs() < 0.05, "{}", number("torque"));
    assert!((number("stiction") / stiction - 1.0).abs() < 0.05, "{}", number("stiction"));
    assert!((number("velocity") / velocity - 1.0).abs() < 0.05, "{}", number("velocity"));
}

/// Wigren and Schoukens, "Three free data sets", 2013, the Silverbox: Duffing's oscillator, hardly any noise.
#[test]
fn a_hardening_spring_with_hardly_any_noise_is_named_and_nothing_else() {
    let (gain, stiffness, cubic) = (1.16e5, 1.84e5, 7e5);
    let made = |seed: u32| {
        record(
            500,
            1.0 / 610.0,
            seed,
            2e-4,
            &[0.0, 0.0],
            |_, u, x| vec![x[1], gain * u - stiffness * x[0] - 39.0 * x[1] - cubic * x[0].powi(3)],
            |_, x| x[0],
            |t| 0.012 * multisine(t, f64::from(seed)),
        )
    };
    let model = OSCILLATOR
        .replace("v' = u", "v' = gain*u")
        .replace("stiffness = free ~ 20", "gain = free ~ 100000, stiffness = free ~ 200000");
    let number = only(ask(&model, &[made(1), made(2)]).unwrap(), "cubic_stiffness", "q");
    assert!((number("coefficient") / cubic - 1.0).abs() < 0.05, "{}", number("coefficient"));
}

/// A pump that only pushes has a dead zone as well, though its command never changes sign.
#[test]
fn a_dead_zone_of_a_command_that_goes_one_way_is_named() {
    let made = |seed: u32| {
        record(
            500,
            0.05,
            seed,
            2e-3,
            &[1.0],
            |_, u, x| vec![(u - 0.7).max(0.0) - 0.6 * x[0]],
            |_, x| x[0],
            |t| 1.2 + 0.45 * wiggle(t, f64::from(seed)),
        )
    };
    let model = "model m {\n    input u\n    param loss = free\n    state x = free\n    x' = u - loss*x\n    output y = x\n}\n";
    let number = only(ask(model, &[made(1), made(2)]).unwrap(), "input_deadzone", "u");
    assert!((number("width") / 0.7 - 1.0).abs() < 0.05, "{}", number("width"));
}

/// A drive that goes at one speed after the other, never back: without friction an infinite inertia is nearest to
/// what it does, and what rubs could as well be an offset of the torque.
#[test]
fn of_a_drive_that_goes_one_way_the_inertia_stays_finite_and_dry_friction_is_a_doubt() {
    let made = |seed: u32| {
        let speed = 0.2 + 0.25 * f64::from(seed);
        record(
            300,
            0.01,
            seed,
            2e-3,
            &[speed],
            |_, u, x| vec![(u - 1.4 * x[0].signum() - 0.7 * x[0]) / 0.14],
            |_, x| x[0],
            |t| 1.4 + 0.7 * speed + 0.05 * wiggle(t, f64::from(seed)),
        )
    };
    let model = "model m {\n    input u\n    param inertia = free ~ 0.2\n    state q = 0, v = free\n    q' = v\n    v' = u/inertia\n    output y = v\n}\n";
    let recordings: Vec<_> = (1..=5).map(made).collect();
    let finding = ask(model, &recordings).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    assert!(finding.notes.iter().any(|note| note.contains("inertia runs off")), "{finding:#?}");
    let said: Vec<(&str, bool)> =
        finding.effects.iter().map(|e| (e.name.as_str(), e.indistinguishable)).collect();
    let expected = [("linear_damping", false), ("input_offset", true), ("dry_friction", true)];
    assert!(expected.iter().all(|e| said.contains(e)) && said.len() == 3, "{finding:#?}");
}

/// The line of a hum that drives the output stands there as well as in what is left.
#[test]
fn a_hum_that_drives_the_output_is_named() {
    let made = |seed: u32| {
        let input = move |t: f64| 3.0 * wiggle(t, f64::from(seed));
        let rates = |t: f64, u: f64, x: &[f64]| {
            let hum = 0.8 * (std::f64::consts::TAU * 1.7 * t + 0.4).sin();
            vec![x[1], u - 22.0 * x[0] - 0.7 * x[1] + hum]
        };
        record(400, 0.05, seed, 2e-4, &[0.1, 0.0], rates, |_, x| x[0], input)
    };
    let hum = only(ask(OSCILLATOR, &[made(1), made(2)]).unwrap(), "periodic_disturbance", "v");
    assert!((hum("amplitude") - 0.8).abs() < 0.05, "{}", hum("amplitude"));
    assert!((hum("frequency") - 1.7).abs() < 0.01, "{}", hum("frequency"));
}

/// Beside a damping that is free neither side is determined, and the difference of the two is.
#[test]
fn a_damping_of_one_side_beside_a_free_one_has_its_number() {
    let made = |seed: u32| {
        let input = move |t: f64| 3.0 * wiggle(t, f64::from(seed));
        let rates = |_: f64, u: f64, x: &[f64]| {
            vec![x[1], u - 22.0 * x[0] - 0.7 * x[1] - 0.8 * x[1].max(0.0)]
        };
        record(400, 0.05, seed, 2e-4, &[0.1, 0.0], rates, |_, x| x[0], input)
    };
    let outcome = ask(OSCILLATOR, &[made(1), made(2)]).unwrap();
    let sides = only(outcome, "asymmetric_damping", "v");
    assert!((sides("forward") - sides("backward") - 0.8).abs() < 0.08, "{}", sides("forward"));
}
