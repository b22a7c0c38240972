//! The speed dial: motions take longer by what it says, and what it is at 100 % changes nothing.

use trueup::arm::Cancel;
use trueup::execution::conduct::Dial;
use trueup::execution::decisions::DecisionLog;

use crate::kitchen;

/// How long the twin's arm takes for a straight line of 5 cm, s, the dial at `percent`.
fn seconds(percent: Option<u8>) -> f64 {
    let mut scripts = super::scripts(&Cancel::default(), DecisionLog::recording());
    let mut context = scripts.context();
    if let Some(percent) = percent {
        let dial = Dial::default();
        dial.turn(percent);
        context.obey(dial);
    }
    let begin = context.state().unwrap().time;
    context.move_by([0.0, 0.0, 0.05], 0.5).unwrap();
    let end = context.state().unwrap();
    assert!(end.q.iter().zip(&kitchen::HOME).any(|(q, home)| (q - home).abs() > 0.02));
    end.time - begin
}

#[test]
fn a_slow_run_takes_as_much_longer_as_the_dial_says() {
    let (plain, full, quarter) = (seconds(None), seconds(Some(100)), seconds(Some(25)));
    assert!((plain - full).abs() < 1e-9, "{plain} s, {full} s");
    // What the arm is given to come to rest after a motion, 0.2 s, is not stretched.
    let stretch = (quarter - 0.2) / (full - 0.2);
    assert!((stretch - 4.0).abs() < 0.1, "{quarter} s after {full} s: {stretch} times");
}
