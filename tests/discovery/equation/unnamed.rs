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
        finding.notes.iter().any(|n| n.contains("outside nobody knows")),
        "{:?}",
        finding.notes
    );
    assert!(outcome.text.contains("v_unknown*max(q - v_unknown_shape, 0)"), "{}", outcome.text);
}

/// A kick once in the data fitted and once, elsewhere, in the data held out: no law of the state predicts it.
#[test]
fn what_does_not_come_again_gets_no_formula() {
    let made = |seed: u32| {
        let kick =
            move |t: f64| if (t - 3.0 - 4.0 * f64::from(seed)).abs() < 0.4 { 6.0 } else { 0.0 };
        record(
            350,
            0.04,
            seed,
            2e-4,
            &[0.0, 0.0],
            |t, u, x| vec![x[1], 2.0 * u - 0.5 * x[1] + kick(t)],
            |_, x| x[0],
            |t| wiggle(t, f64::from(seed)),
        )
    };
    let finding = ask(CART, &[made(1), made(2)]).unwrap().finding;
    assert_eq!(finding.verdict, Verdict::Unknown, "{finding:#?}");
    assert!(finding.effects.is_empty(), "{finding:#?}");
    assert!(finding.reason.contains("none is given"), "{}", finding.reason);
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

/// At one speed, friction that grows with it and friction that does not are the same.
#[test]
fn a_doubt_that_an_input_can_settle_comes_with_that_input() {
    let made = |seed: u32| {
        record(
            300,
            0.02,
            seed,
            2e-3,
            &[1.0],
            |_, u, x| vec![2.0 * u - 0.5 * x[0] - 0.2 * x[0] * x[0].abs()],
            |_, x| x[0],
            |t| if t < 2.0 { 0.35 } else { 0.35 + 0.01 * wiggle(t, f64::from(seed)) },
        )
    };
    let model =
        "model m {\n    input u\n    state v = free\n    v' = 2*u - 0.5*v\n    output y = v\n}\n";
    let outcome = ask(model, &[made(1), made(2)]).unwrap();
    let finding = &outcome.finding;
    assert_eq!(finding.verdict, Verdict::Ambiguous, "{finding:#?}");
    assert!(finding.effects.len() > 1 && finding.effects.iter().all(|e| e.indistinguishable));
    let next = finding.next_experiment.as_ref().unwrap();
    assert!(!next.why.is_empty());
}
