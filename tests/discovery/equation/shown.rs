//! What shows a planted effect of an equation: the channel, the state, and points that lie on the law that was planted.

use trueup::discovery::Why;
use trueup::discovery::equation::Outcome;
use trueup::discovery::finding::Verdict;

use super::ask;
use super::planted::{CART, cart};

/// The only plot of an effect.
#[track_caller]
fn shown<'a>(outcome: &'a Outcome, name: &str) -> &'a Why {
    let own: Vec<&Why> = outcome.whys.iter().filter(|why| why.name == name).collect();
    assert_eq!(own.len(), 1, "{:#?}", outcome.finding);
    own[0]
}

/// The root mean square of what points miss a law by, as a part of the law's own; and that both kinds of data are there.
#[track_caller]
fn missed(why: &Why, law: impl Fn(f64) -> f64) -> f64 {
    assert!(why.rows.iter().any(|row| row.held_out) && why.rows.iter().any(|row| !row.held_out));
    let square = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        why.rows.iter().map(|row| of(row.left, law(row.state)).powi(2)).sum()
    };
    (square(&|left, law| left - law) / square(&|_, law| law)).sqrt()
}

#[test]
fn dry_friction_is_shown_as_a_jump_of_the_acceleration_over_the_speed() {
    let outcome = ask(CART, &cart(|_, _, v| -0.3 * v.signum(), |u| u)).unwrap();
    let why = shown(&outcome, "dry_friction");
    assert_eq!((why.at.as_str(), why.channel.as_str(), why.state.as_str()), ("v", "v'", "v"));
    // Means over a reversal lie between both sides.
    let away: Vec<_> = why.rows.iter().filter(|row| row.state.abs() > 0.2).copied().collect();
    let away = Why { rows: away, ..why.clone() };
    let part = missed(&away, |v| -0.3 * v.signum());
    assert!(part < 0.3, "{part}");
    assert!(why.mean_over.is_some_and(|span| span > 0.0 && span < 1.5), "{:?}", why.mean_over);
    let slow = why.curve.first().zip(why.curve.last()).unwrap();
    assert!((slow.0.1 - 0.3).abs() < 0.03 && (slow.1.1 + 0.3).abs() < 0.03, "{slow:?}");
}

#[test]
fn two_effects_are_shown_each_without_the_other() {
    let outcome = ask(CART, &cart(|_, q, v| -0.3 * v.signum() - 0.2 * q * q * q, |u| u)).unwrap();
    assert_eq!(outcome.finding.verdict, Verdict::Several, "{:#?}", outcome.finding);
    let why = shown(&outcome, "cubic_stiffness");
    assert_eq!((why.channel.as_str(), why.state.as_str()), ("v'", "q"));
    let part = missed(why, |q| -0.2 * q * q * q);
    assert!(part < 0.3, "{part}");
    let why = shown(&outcome, "dry_friction");
    assert_eq!((why.channel.as_str(), why.state.as_str()), ("v'", "v"));
}

#[test]
fn a_dead_zone_is_shown_over_the_input() {
    let dead = |u: f64| u - u.clamp(-0.3, 0.3);
    let outcome = ask(CART, &cart(|_, _, _| 0.0, dead)).unwrap();
    let why = shown(&outcome, "input_deadzone");
    assert_eq!((why.channel.as_str(), why.state.as_str()), ("v'", "u"));
    let part = missed(why, |u| -2.0 * u.clamp(-0.3, 0.3));
    assert!(part < 0.4, "{part}");
}
