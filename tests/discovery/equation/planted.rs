//! Effects that were planted.

use trueup::discovery::equation::{Error, Outcome};
use trueup::discovery::finding::{Value, Verdict};
use trueup::discovery::recording::Recording;

use super::{ask, record, wiggle};

pub(super) const CART: &str = "\
/// A cart on a rail.
model cart {
    input  u                  // force
    param  gain = 2, damping = 0.5
    state  q = free, v = free
    q' = v                    // how it moves
    v' = gain*u - damping*v   // Newton
    output y = q
}
";

/// Two recordings of a cart with another force on it.
pub(super) fn cart(
    extra: impl Fn(f64, f64, f64) -> f64 + Copy,
    input: impl Fn(f64) -> f64 + Copy,
) -> [Recording; 2] {
    let made = |seed: u32| {
        record(
            350,
            0.04,
            seed,
            2e-4,
            &[0.0, 0.0],
            |_, u, x| vec![x[1], 2.0 * input(u) - 0.5 * x[1] + extra(u, x[0], x[1])],
            |_, x| x[0],
            |t| wiggle(t, f64::from(seed)),
        )
    };
    [made(1), made(2)]
}

/// The value of an effect's parameter.
fn value(outcome: &Outcome, effect: &str, at: &str, parameter: &str) -> f64 {
    let found = outcome.finding.effects.iter().find(|e| e.name == effect && e.at == at);
    let found = found.unwrap_or_else(|| panic!("{:#?}", outcome.finding));
    match found.parameters[parameter].value {
        Value::Number(value) => value,
        Value::Vector(_) => panic!("a vector"),
    }
}

#[track_caller]
fn named(outcome: &Outcome, effect: &str, at: &str, parameter: &str, truth: f64, part: f64) {
    assert_eq!(outcome.finding.verdict, Verdict::Named, "{:#?}", outcome.finding);
    let found = value(outcome, effect, at, parameter);
    assert!((found / truth - 1.0).abs() < part, "{effect}({at}): {found}, truth {truth}");
    assert!(outcome.finding.gap.shrink_heldout > 0.9, "{:?}", outcome.finding.gap);
}

#[test]
fn a_cart_as_modelled_lacks_nothing() {
    let outcome = ask(CART, &cart(|_, _, _| 0.0, |u| u)).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::NothingMissing, "{:#?}", outcome.finding);
    assert!(outcome.finding.effects.is_empty());
    assert_eq!(outcome.text, CART);
}

#[test]
fn dry_friction_is_named_and_once_written_nothing_is_missing() {
    let recordings = cart(|_, _, v| -0.3 * v.signum(), |u| u);
    let outcome = ask(CART, &recordings).unwrap();
    named(&outcome, "dry_friction", "v", "coefficient", 0.3, 0.05);
    assert!(outcome.text.contains("- v_dry*sign(v)   // Newton"), "{}", outcome.text);
    assert!(outcome.text.contains("// how it moves"), "comments stay");
    assert!(
        outcome.finding.model.diff.contains("+    param v_dry"),
        "{}",
        outcome.finding.model.diff
    );
    let again = ask(&outcome.text, &recordings).unwrap();
    assert_eq!(again.finding.verdict, Verdict::NothingMissing, "{:#?}", again.finding);
}

#[test]
fn drag_and_stiffness_are_told_from_each_other() {
    let outcome = ask(CART, &cart(|_, _, v| -0.2 * v * v.abs(), |u| u)).unwrap();
    named(&outcome, "quadratic_drag", "v", "coefficient", 0.2, 0.05);
    let outcome = ask(CART, &cart(|_, q, _| -0.4 * q, |u| u)).unwrap();
    named(&outcome, "linear_stiffness", "q", "coefficient", 0.4, 0.05);
}

#[test]
fn a_dead_zone_of_the_input_is_named() {
    let dead = |u: f64| u - u.clamp(-0.3, 0.3);
    let outcome = ask(CART, &cart(|_, _, _| 0.0, dead)).unwrap();
    named(&outcome, "input_deadzone", "u", "width", 0.3, 0.05);
}

#[test]
fn two_effects_at_once_are_both_named() {
    let outcome = ask(CART, &cart(|_, q, v| -0.3 * v.signum() - 0.2 * q * q * q, |u| u)).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::Several, "{:#?}", outcome.finding);
    assert_eq!(outcome.finding.effects.len(), 2, "{:#?}", outcome.finding);
    assert!((value(&outcome, "dry_friction", "v", "coefficient") / 0.3 - 1.0).abs() < 0.1);
    assert!((value(&outcome, "cubic_stiffness", "q", "coefficient") / 0.2 - 1.0).abs() < 0.1);
    // More general forms explain a hair more in every draw, and take none of them.
    let shares: Vec<f64> = outcome.finding.effects.iter().map(|e| e.stability).collect();
    assert!(shares.iter().all(|share| (0.5..=1.0).contains(share)), "{shares:?}");
}

#[test]
fn a_tank_that_runs_over_is_named_though_nothing_of_it_is_known() {
    let made = |seed: u32| {
        record(
            600,
            1.0,
            seed,
            5e-3,
            &[1.0],
            |_, u, x| {
                let rate = 0.3 * u - 0.2 * x[0].max(0.0).sqrt();
                vec![if x[0] >= 4.0 { rate.min(0.0) } else { rate }]
            },
            |_, x| x[0],
            |t| 1.2 + 0.6 * wiggle(0.02 * t, f64::from(seed)),
        )
    };
    let model = "model tank {\n    input u\n    param inflow = free, outflow = free\n    state h = free\n    \
                 h' = inflow*u - outflow*sqrt(h)\n    output y = h\n}\n";
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    let names: Vec<&str> = outcome.finding.effects.iter().map(|e| e.name.as_str()).collect();
    assert!(names.contains(&"overflow"), "{:#?}", outcome.finding);
    assert!((value(&outcome, "overflow", "h", "level") / 4.0 - 1.0).abs() < 0.1);
}

/// A gain before and after a linear model is the same to whoever sees both ends.
#[test]
fn gains_before_and_after_a_linear_model_cannot_be_told_apart() {
    let made = |seed: u32| {
        record(
            500,
            0.05,
            seed,
            1e-3,
            &[0.0],
            |_, u, x| vec![(1.2 * u - x[0]) / 0.8],
            |_, x| x[0],
            |t| wiggle(t, f64::from(seed)),
        )
    };
    let model =
        "model lag {\n    input u\n    state x = free\n    x' = (u - x)/0.8\n    output y = x\n}\n";
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::Ambiguous, "{:#?}", outcome.finding);
    let mut names: Vec<&str> = outcome.finding.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    assert!(names.contains(&"input_gain") && names.contains(&"output_gain"), "{names:?}");
    assert!(outcome.finding.next_experiment.is_some());
}

/// Something that never turns round does not tell dry friction from an offset of what drives it; that it is
/// dragged back by the square of its speed is sure all the same, and is all that is written.
#[test]
fn a_doubt_beside_a_sure_effect_is_told_and_has_its_experiment() {
    let made = |seed: u32| {
        record(
            400,
            0.04,
            seed,
            1e-3,
            &[2.0],
            |_, u, x| vec![2.0 * u - 0.8 * x[0].signum() - 0.5 * x[0] * x[0].abs()],
            |_, x| x[0],
            |t| 1.5 + 0.4 * wiggle(t, f64::from(seed)),
        )
    };
    let model = "model fan {\n    input u\n    state q = 0, v = free\n    q' = v\n    v' = 2*u\n    output y = v\n}\n";
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    let named = |doubtful: bool| -> Vec<&str> {
        let of = finding.effects.iter().filter(|e| e.indistinguishable == doubtful);
        of.map(|e| e.name.as_str()).collect()
    };
    assert_eq!(named(false), ["quadratic_drag"]);
    let doubtful = named(true);
    assert!(
        doubtful.contains(&"dry_friction") && doubtful.contains(&"input_offset"),
        "{doubtful:?}"
    );
    let drag = value(&outcome, "quadratic_drag", "v", "coefficient");
    assert!((drag / 0.5 - 1.0).abs() < 0.05, "{drag}");
    assert!(outcome.text.contains("drag*v*abs(v)") && !outcome.text.contains("sign("));
    // No push in the recorded range turns it round; one that goes both ways does.
    let why = &finding.next_experiment.as_ref().unwrap().why;
    assert!(why.contains("standard deviations"), "{why}");
    let planned = outcome.experiment.as_deref().unwrap();
    let lowest = planned.lines().skip(1).filter_map(|l| l.split(',').nth(1)?.parse::<f64>().ok());
    assert!(lowest.fold(f64::INFINITY, f64::min) < 0.0, "{planned}");
}

#[test]
fn a_model_that_blows_up_and_one_with_mistakes_are_errors() {
    let recordings = cart(|_, _, _| 0.0, |u| u);
    let runaway =
        "model m {\n    input u\n    state x = 1\n    x' = 5*x^2 + u\n    output y = x\n}\n";
    let error = ask(runaway, &recordings).unwrap_err();
    assert!(matches!(error, Error::BlowUp { .. }), "{error}");
    // Any model runs away on what no sensor shows: it is the table's.
    let mut absurd = recordings.clone();
    let column = absurd[0].columns.iter_mut().find(|column| column.name == "u").unwrap();
    column.values.iter_mut().skip(40).for_each(|value| *value = 1e18);
    let Error::Recording(error) = ask(CART, &absurd).unwrap_err() else { panic!() };
    assert!(error.what.contains("more than any sensor shows"), "{error:?}");
    assert!(error.place.ends_with("column `u`") && error.what.contains("1e18"), "{error:?}");
    let mistaken = CART.replace("gain*u", "gian*u");
    let Error::Model { diagnostics } = ask(&mistaken, &recordings).unwrap_err() else { panic!() };
    assert_eq!(diagnostics[0].code, "task::unknown_name");
    assert_eq!(diagnostics[0].help.as_deref(), Some("did you mean `gain`?"));
    let elsewhere = CART.replace("output y", "output z");
    let Error::Recording(error) = ask(&elsewhere, &recordings).unwrap_err() else { panic!() };
    assert!(error.what.contains("no column `z`"), "{error:?}");
    assert!(matches!(ask("scene s { }", &recordings), Err(Error::NoModel { .. })));
}

/// Noise above a hundredth of the signal kept an integrating model in stretches of a tenth of the recording, each from a first value
/// of its own, and those took away what an offset gathers.
#[test]
fn what_gathers_over_a_whole_recording_is_seen_through_its_noise() {
    let model = "model m {\n input u\n state x = free\n x' = 0.5*u\n output y = x\n}\n";
    let made = |seed: u32| {
        record(
            400,
            0.1,
            seed,
            0.017,
            &[0.0],
            |_, u, _| vec![0.5 * (u + 0.0025)],
            |_, x| x[0],
            |t| wiggle(t, f64::from(seed)),
        )
    };
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::Named, "{:#?}", outcome.finding);
    let found = value(&outcome, "input_offset", "u", "value");
    assert!((found - 0.0025).abs() < 8e-4, "{found}");
    let in_segments = outcome.finding.notes.iter().find(|note| note.contains("segments"));
    assert_eq!(in_segments, None, "the whole recordings are followed");
}

/// Of an input that came late to what only gathers it, the sensor was called late, in no doubt: what the input had been before the
/// first row was guessed, and the guess was wrong.
#[test]
fn a_late_input_of_what_only_gathers_may_be_a_late_sensor() {
    let model = "model m {\n input u\n param gain = free ~ 5\n state z = free, v = free\n z' = v\n v' = gain*u\n output y = z\n}\n";
    let made = |seed: u32| {
        // Another value in every row, and 0.6 before the first.
        let input = move |t: f64| {
            let row = (t / 0.05 + 1e-6).floor();
            let drawn = (row * 12.9898 + f64::from(seed) * 78.233).sin() * 437.585;
            if row < 0.0 { 0.6 } else { 2.0 * (drawn - drawn.floor()) - 1.0 }
        };
        let rates = move |t: f64, _: f64, x: &[f64]| vec![x[1], 6.0 * input(t - 0.1)];
        record(400, 0.05, seed, 0.01, &[0.0, 0.0], rates, |_, x| x[0], input)
    };
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::Ambiguous, "{:#?}", outcome.finding);
    for (effect, at) in [("input_delay", "u"), ("sensor_delay", "y")] {
        let delay = value(&outcome, effect, at, "delay");
        assert!((delay - 0.1).abs() < 0.02, "{effect}: {delay} s");
    }
}
