//! Steps that go on at the same time: what can is done so, what cannot is refused, and the times are measured.

use trueup::arm::Cancel;
use trueup::execution::timing::SAME;
use trueup::trace::Outcome;

use super::walked::{Eyes, Walked, walk, walk_with};

/// How far the tool goes in 2 s and more.
const RISE: &str = "rise(by: 18 cm) as rising";

fn together(inside: &str) -> Walked {
    walk(&format!("{{ together {{ {inside} }} }}"))
}

fn interval(walked: &Walked, index: usize) -> [f64; 2] {
    walked.step(index).interval
}

/// The opening between the fingers at an arm time, m.
fn opening_at(walked: &Walked, time: f64) -> f64 {
    walked.ticks.iter().find(|tick| tick.time >= time).unwrap().opening
}

#[test]
fn fingers_open_while_the_arm_moves_and_begin_when_asked() {
    for by in [0.0, 0.5] {
        let walked = together(&format!(
            "{RISE}  spread() as opening  timing opening during rising by {by} s"
        ));
        for index in 0..2 {
            assert_eq!(walked.step(index).outcome, Outcome::Success, "{}", walked.reason(index));
        }
        let ([rise, risen], [open, opened]) = (interval(&walked, 0), interval(&walked, 1));
        assert!((open - rise - by).abs() < SAME, "{open} {rise}");
        assert!(opened < risen, "{opened} {risen}");
        // 2 cm to 8.5 cm at 6 cm/s.
        assert!((opened - open - 0.065 / 0.06).abs() < 0.25, "{} s", opened - open);
        // As the ticks have it: still closed when it begins, open when it has ended, the arm under way.
        assert!(opening_at(&walked, open) < 0.025);
        assert!(opening_at(&walked, opened) > 0.08);
        let half = 0.5 * (open + opened);
        let under_way = walked.ticks.iter().rfind(|tick| tick.time <= half).unwrap();
        assert!(under_way.dq.iter().any(|dq| dq.abs() > 0.05), "{:?}", under_way.dq);
    }
}

#[test]
fn the_arm_waits_where_it_is_to_begin_later() {
    let walked = together(&format!("{RISE}  spread() as opening  timing opening overlaps rising"));
    assert_eq!(walked.step(0).outcome, Outcome::Success, "{}", walked.reason(0));
    // The fingers need 1.1 s; half a second after they began the arm begins, and is not done before them.
    let walked = together(
        "spread() as opening  rise(by: 2 cm) as rising  timing rising during opening by 0.5 s",
    );
    let ([open, _], [rise, _]) = (interval(&walked, 0), interval(&walked, 1));
    assert!((rise - open - 0.5).abs() < SAME, "{open} {rise}");
}

#[test]
fn a_relation_that_does_not_hold_fails_the_step_with_the_times() {
    let walked = together(&format!("{RISE}  spread() as opening  timing opening equals rising"));
    assert_eq!(walked.step(0).outcome, Outcome::Success, "{}", walked.reason(0));
    assert_eq!(walked.step(1).outcome, Outcome::Failure);
    let reason = walked.reason(1);
    assert!(reason.starts_with("`opening equals rising` is off by "), "{reason}");
    let ([_, risen], [open, opened]) = (interval(&walked, 0), interval(&walked, 1));
    let told = format!("is off by {:.2} s", risen - opened);
    assert!(reason.contains(&told), "{told}: {reason}");
    assert!(reason.contains(&format!("to {:.2} s", opened - open)), "{reason}");
}

#[test]
fn before_and_meets_put_one_after_the_other() {
    let walked = together(
        "spread() as opening  rise(by: 2 cm) as rising  timing opening before rising by 0.3 s",
    );
    for index in 0..2 {
        assert_eq!(walked.step(index).outcome, Outcome::Success, "{}", walked.reason(index));
    }
    let ([_, opened], [rise, _]) = (interval(&walked, 0), interval(&walked, 1));
    assert!((rise - opened - 0.3).abs() < SAME, "{opened} {rise}");
    let walked =
        together("spread() as opening  rise(by: 2 cm) as rising  timing rising meets opening");
    assert_eq!(walked.step(1).outcome, Outcome::Success, "{}", walked.reason(1));
    let ([open, _], [_, risen]) = (interval(&walked, 0), interval(&walked, 1));
    assert!((open - risen).abs() < SAME, "{open} {risen}");
}

#[test]
fn two_that_need_the_arm_are_refused_and_nothing_moves() {
    let walked = together("rise(by: 2 cm)  ahead(by: 2 cm)");
    assert_eq!(walked.step(0).outcome, Outcome::Failure);
    assert_eq!(
        walked.reason(0),
        "rise(by: 2 cm) and ahead(by: 2 cm) cannot go on together: both need the arm"
    );
    assert!(walked.ticks.is_empty());
}

/// A strand of two steps, a picture beside them, and a condition of the fingers' step that is broken while the
/// arm moves.
#[test]
fn strands_looks_and_conditions_of_the_others() {
    let walked =
        together("{ rise(by: 3 cm) rise(by: 2 cm) } as rising  peek() as looking  spread()");
    assert_eq!(walked.steps.len(), 4);
    for index in 0..4 {
        assert_eq!(walked.step(index).outcome, Outcome::Success, "{}", walked.reason(index));
    }
    let [from, to] = interval(&walked, 2);
    assert!((from - interval(&walked, 0)[0]).abs() < SAME && (to - from).abs() < 1e-9);

    let walked = together(&format!("{RISE}  spread() while opening() <= 5 cm"));
    assert_eq!(walked.step(0).outcome, Outcome::Failure);
    assert!(walked.reason(0).starts_with("it lost `opening() <= 5 cm`"), "{}", walked.reason(0));
}

#[test]
fn a_performance_goes_as_its_rehearsal() {
    let body = "{ together { rise(by: 6 cm) as rising  spread() as opening
                             timing opening during rising by 0.2 s }
                  rise(by: -2 cm) }";
    let rehearsed = walk(body);
    let performed = walk_with(body, rehearsed.log.rewound(), Eyes::Blind, &Cancel::default());
    for index in 0..3 {
        let (a, b) = (performed.step(index), rehearsed.step(index));
        assert_eq!((a.outcome, b.outcome), (Outcome::Success, Outcome::Success), "{:?}", a.failure);
        let bits = |interval: [f64; 2]| interval.map(f64::to_bits);
        assert_eq!(bits(a.interval), bits(b.interval), "{:?} {:?}", a.interval, b.interval);
    }
}
