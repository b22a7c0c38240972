//! What has no name gets a formula; nothing missing says what would have been seen; a doubt gets an
//! experiment.

use trueup::discovery::equation::Outcome;
use trueup::discovery::finding::Verdict;

use super::planted::{CART, cart};
use super::{ask, record, wiggle};

/// The number before a word of an equation.
fn factor(equation: &str, word: &str) -> f64 {
    let (before, _) = equation.split_once(word).unwrap_or_else(|| panic!("{equation}"));
    let number = before.rsplit([' ', '(']).next().unwrap();
    number.trim_end_matches('*').parse().unwrap_or_else(|_| panic!("{equation}"))
}

#[test]
fn a_spring_that_begins_within_the_way_has_no_name_but_a_formula() {
    let outcome = ask(CART, &cart(|_, q, _| -3.0 * (q - 0.5).max(0.0), |u| u)).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    let [effect] = finding.effects.as_slice() else { panic!("{finding:#?}") };
    assert_eq!((effect.name.as_str(), effect.at.as_str()), ("unknown", "v"));
    assert!((factor(&effect.equation, "max(q - 0.") + 3.0).abs() < 0.1, "{}", effect.equation);
    assert!(finding.gap.shrink_heldout > 0.9, "{:?}", finding.gap);
    assert!(
        finding.notes.iter().any(|n| n.contains("outside that range it is not known")),
        "{:?}",
        finding.notes
    );
    assert!(outcome.text.contains("v_unknown*max(q - v_unknown_shape, 0)"), "{}", outcome.text);
}

#[test]
fn nothing_missing_says_what_would_have_been_seen() {
    let outcome = ask(CART, &cart(|_, _, _| 0.0, |u| u)).unwrap();
    let visible = &outcome.finding.smallest_visible;
    let least = |name: &str| {
        let found = visible.iter().find(|v| v.name == name);
        found.unwrap_or_else(|| panic!("{visible:#?}")).least
    };
    let dry = least("dry_friction");
    assert!(dry > 1e-6 && dry < 1e-2, "{dry}");
    // Twice that is found indeed, and a fifth of it is not.
    let with =
        |size: f64| -> Outcome { ask(CART, &cart(|_, _, v| -size * v.signum(), |u| u)).unwrap() };
    let found = with(2.0 * dry).finding;
    assert_eq!(found.verdict, Verdict::Named, "{found:#?}");
    assert_eq!(found.effects[0].name, "dry_friction");
    assert_eq!(with(0.2 * dry).finding.verdict, Verdict::NothingMissing);
    // A constant added to a position that begins anywhere is seen by nobody.
    assert!(outcome.finding.notes.iter().any(|n| n.contains("output_offset(y)")));
}

/// A machine that is another one when it is judged: what explains one recording does not predict the other.
#[test]
fn a_formula_that_does_not_predict_is_refused() {
    let [train, _] = cart(|_, q, _| 0.8 * (2.0 * q).cos(), |u| u);
    let [_, changed] = cart(|_, q, _| -0.8 * (2.0 * q).cos(), |u| u);
    let outcome = ask(CART, &[train, changed]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert!(finding.effects.is_empty(), "{finding:#?}");
    assert!(finding.reason.contains("none is given"), "{}", finding.reason);
    assert_eq!(outcome.text, CART);
}

/// Moved slowly, what is late and what lags are the same; steps tell them apart.
#[test]
fn a_doubt_that_an_input_can_settle_comes_with_that_input() {
    let made = |seed: u32| {
        let slow = move |t: f64| (0.15 * t + f64::from(seed)).sin();
        record(
            400,
            0.05,
            seed,
            1e-2,
            &[0.0],
            move |t, _, x| vec![(slow(t - 0.2) - x[0]) / 0.5],
            |_, x| x[0],
            slow,
        )
    };
    let model =
        "model m {\n    input u\n    state x = free\n    x' = (u - x)/0.5\n    output y = x\n}\n";
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    assert!(finding.effects.len() > 1 && finding.effects.iter().all(|e| e.indistinguishable));
    let next = finding.next_experiment.as_ref().unwrap();
    assert!(next.why.contains("standard deviations"), "{}", next.why);
    let csv = outcome.experiment.as_ref().unwrap();
    assert!(csv.starts_with("t[s],u\n") && csv.lines().count() > 300, "{csv:.80}");
}

/// `r: V/A` was told in kg*m^2/A^2/s^3.
#[test]
fn a_number_of_the_model_is_told_in_its_units() {
    let model = "model m {\n input u: A\n param r: V/A = free ~ 1, tau = 2 s\n state x: V = free\n x' = (r*u - x)/tau\n output y: V = x\n}\n";
    let made = |seed: u32| {
        let input = move |t: f64| wiggle(t, f64::from(seed));
        let rates = |_: f64, u: f64, x: &[f64]| vec![(2.0 * u - x[0]) / 2.0];
        record(300, 0.05, seed, 1e-3, &[0.0], rates, |_, x| x[0], input)
    };
    let notes = ask(model, &[made(1), made(2)]).unwrap().finding.notes;
    let told = notes.iter().find(|note| note.contains("r = ")).unwrap();
    assert!(told.contains("V/A") && !told.contains("kg"), "{told}");
}
