//! The one gate before an arm: what is refused, with which numbers, and that there is no way round it.

use std::fs;
use std::path::Path;

use trueup::arm::limits::LimitError;
use trueup::execution::cell::Cell;
use trueup::motion::trajectory::{self, Trajectory};

use crate::kitchen::HOME;

use super::cell;

/// `HOME` with one joint (from 1) turned to `value` rad.
fn with(joint: usize, value: f64) -> Vec<f64> {
    let mut q = HOME.to_vec();
    q[joint - 1] = value;
    q
}

/// Home to `q` in `seconds`.
fn to(q: &[f64], seconds: f64) -> Trajectory {
    Trajectory::from_points(&[0.0, seconds], &[HOME.to_vec(), q.to_vec()]).unwrap()
}

fn refused(cell: &Cell, trajectory: Trajectory) -> LimitError {
    cell.clear(trajectory, &HOME).unwrap_err()
}

#[test]
fn what_is_timed_inside_the_robots_limits_is_cleared_unchanged() {
    let cell = cell();
    let limits = trajectory::Limits::of(&cell.robot);
    let path = [HOME.to_vec(), with(1, 0.8), with(2, 0.6)];
    let timed = Trajectory::through_corners(&path, &limits, 0.1, &|_, _| true).unwrap();
    let cleared = cell.clear(timed.clone(), &HOME).unwrap();
    assert_eq!(cleared.trajectory(), &timed);
    // Staying where it is takes no time and is a motion like any other.
    assert!(cell.clear(Trajectory::resting(&HOME), &HOME).is_ok());
}

#[test]
fn too_much_speed_is_refused_with_the_joint_and_both_numbers() {
    let cell = cell();
    // A cubic from rest to rest is fastest in its middle: 1.5 times the mean.
    let limit = cell.robot.joints()[0].velocity;
    let turn = 2.0;
    let at_limit = 1.5 * turn / limit;
    assert!(cell.clear(to(&with(1, turn), 1.05 * at_limit), &HOME).is_ok());
    match refused(&cell, to(&with(1, turn), 0.85 * at_limit)) {
        LimitError::Speed { joint, value_deg_s, limit_deg_s, time_s } => {
            assert_eq!(joint, 1);
            assert!((limit_deg_s - limit.to_degrees()).abs() < 1e-9);
            assert!(value_deg_s > 1.02 * limit_deg_s, "{value_deg_s} against {limit_deg_s}");
            assert!(time_s > 0.0 && time_s < 0.85 * at_limit);
        }
        other => panic!("{other}"),
    }
}

/// Slow enough all the way, and still a jerk: a cubic's acceleration at its ends is 6 turns over time squared.
#[test]
fn too_much_acceleration_is_refused() {
    let cell = cell();
    let limit = cell.robot.joints()[0].acceleration;
    let (turn, seconds) = (0.2, 0.4);
    match refused(&cell, to(&with(1, turn), seconds)) {
        LimitError::Acceleration { joint, value_deg_s2, limit_deg_s2, .. } => {
            assert_eq!(joint, 1);
            let expected = (6.0 * turn / (seconds * seconds)).to_degrees();
            assert!((value_deg_s2 - expected).abs() < 1e-6, "{value_deg_s2} against {expected}");
            assert!((limit_deg_s2 - limit.to_degrees()).abs() < 1e-9);
        }
        other => panic!("{other}"),
    }
    assert!(cell.clear(to(&with(1, turn), 0.6), &HOME).is_ok());
}

#[test]
fn what_the_fingers_cannot_or_may_not_do_is_refused() {
    let cell = cell();
    let ask = |opening, speed, force| cell.clear_grip(opening, speed, force);
    let fine = ask(0.02, 0.06, 40.0).unwrap();
    let kept = [fine.opening(), fine.speed(), fine.force()];
    assert!(kept.iter().zip([0.02, 0.06, 40.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{kept:?}");
    assert!(ask(0.0, 0.0, 0.0).is_ok() && ask(cell.robot.max_opening(), 0.06, 40.0).is_ok());
    for (opening, speed, force, unit) in [
        (0.1, 0.06, 40.0, "m"),
        (-0.001, 0.06, 40.0, "m"),
        (f64::NAN, 0.06, 40.0, "m"),
        (0.02, 0.5, 40.0, "m/s"),
        (0.02, f64::NAN, 40.0, "m/s"),
        (0.02, 0.06, 500.0, "N"),
        (0.02, 0.06, -1.0, "N"),
        (0.02, 0.06, f64::INFINITY, "N"),
    ] {
        match ask(opening, speed, force).unwrap_err() {
            LimitError::Fingers { what, .. } => assert_eq!(what.unit(), unit),
            other => panic!("{other}"),
        }
    }
}

#[test]
fn a_joint_out_of_its_range_is_refused_and_a_continuous_one_has_none() {
    let cell = cell();
    let upper = cell.robot.joints()[5].upper;
    assert!(cell.clear(to(&with(6, upper), 9.0), &HOME).is_ok());
    match refused(&cell, to(&with(6, upper + 0.01), 9.0)) {
        LimitError::Range { joint, value_deg, upper_deg, .. } => {
            assert_eq!(joint, 6);
            assert!(value_deg > upper_deg && (upper_deg - upper.to_degrees()).abs() < 1e-9);
        }
        other => panic!("{other}"),
    }
    // Joint 7 turns round and round.
    assert!(cell.clear(to(&with(7, 9.0), 30.0), &HOME).is_ok());
}

/// A path that does not begin where the arm was last sent would be a jump.
#[test]
fn a_jump_at_the_start_is_refused() {
    let cell = cell();
    let there = Trajectory::from_points(&[0.0, 5.0], &[with(4, -2.2), with(4, -2.0)]).unwrap();
    match refused(&cell, there.clone()) {
        LimitError::Jump { joint, jump_deg } => {
            assert_eq!(joint, 4);
            let jump = (-2.2 - HOME[3]).abs().to_degrees();
            assert!((jump_deg - jump).abs() < 1e-9, "{jump_deg} against {jump}");
        }
        other => panic!("{other}"),
    }
    assert!(cell.clear(there, &with(4, -2.2)).is_ok());
}

/// What begins a little beside the last command was sent as a step: joint 7 of a hand that held a leaning jar by 0.008 rad in one tick.
#[test]
fn what_begins_beside_the_last_command_is_led_to_within_the_limits() {
    let cell = cell();
    let limits = trajectory::Limits::of(&cell.robot);
    for (joint, off) in [(7, 0.008), (7, -0.019), (2, 0.004), (2, 2e-5)] {
        let from = with(joint, HOME[joint - 1] - off);
        let timed = to(&with(1, 0.3), 4.0);
        let cleared = cell.clear(timed.clone(), &from).unwrap();
        let (whole, led) = (cleared.trajectory(), cleared.led());
        assert!(led > 0.0 && led < 0.35, "{off} rad in {led} s");
        assert!((whole.duration() - timed.duration() - led).abs() < 1e-12);
        let (begin, end) = whole.ends();
        let apart =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart(&begin, &from) < 1e-12 && apart(&end, &timed.ends().1) < 1e-12);
        assert!(apart(&whole.sample(led + 1.0).q, &timed.sample(1.0).q) < 1e-9);
        // As it is sent: the first tick holds the last command.
        let tick = 0.004;
        let ticks = (whole.duration() / tick) as usize;
        let sent: Vec<Vec<f64>> = (0..=ticks).map(|k| whole.sample(k as f64 * tick).q).collect();
        let held = [vec![from.clone()], sent].concat();
        for three in held.windows(3) {
            for (i, most) in limits.acceleration.iter().enumerate() {
                let push = (three[2][i] - 2.0 * three[1][i] + three[0][i]) / (tick * tick);
                assert!(push.abs() < 1.02 * most, "joint {}: {push} of {most} rad/s²", i + 1);
            }
        }
    }
    assert!(cell.clear(to(&with(1, 0.3), 4.0), &HOME).unwrap().led().abs() < 1e-15);
    let none = cell.clear(to(&with(1, 0.3), 4.0), &[f64::NAN; 7]).unwrap_err();
    assert!(matches!(none, LimitError::NotFinite { .. }), "{none}");
}

/// A stop may leave a joint a hair past the end of its range.
#[test]
fn a_joint_beyond_its_range_is_led_back_and_no_further_out() {
    let cell = cell();
    let upper = cell.robot.joints()[5].upper;
    let from_end =
        |to: f64| Trajectory::from_points(&[0.0, 5.0], &[with(6, upper), with(6, to)]).unwrap();
    assert!(cell.clear(from_end(upper - 0.2), &with(6, upper + 0.01)).unwrap().led() > 0.0);
    let out = cell.clear(from_end(upper + 0.005), &with(6, upper + 0.01)).unwrap_err();
    assert!(matches!(out, LimitError::Range { .. }), "{out}");
}

/// An arm that is led is sent where its speeds lead it, and nowhere else.
#[test]
fn a_led_command_that_its_speeds_do_not_lead_to_is_refused() {
    let cell = cell();
    let period = 0.004;
    let tick = |way: f64, speed: f64| {
        let mut order = [HOME.to_vec(), vec![0.0; 7]];
        order[0][6] += way;
        order[1][6] = speed;
        let from = [&HOME[..], &[0.0; 7][..]];
        let base = &cell.scene.world_from_base;
        cell.limits.clear_tick(&cell.robot, base, order, from, (0.0, period))
    };
    let speed = cell.robot.joints()[6].acceleration * period;
    assert!(tick(0.5 * period * speed, speed).is_ok());
    assert!(tick(0.0, 0.0).is_ok());
    for speed in [0.0, speed] {
        let step = tick(0.003, speed);
        assert!(matches!(step, Err(LimitError::Jump { joint: 7, .. })), "{step:?}");
    }
}

#[test]
fn a_tool_in_the_table_is_refused_with_its_height() {
    let cell = cell();
    // Leaning forward from home brings the tool down to the table and through it.
    match refused(&cell, to(&with(2, 1.3), 20.0)) {
        LimitError::Floor { height_mm, floor_mm, .. } => {
            assert!(height_mm < floor_mm && (floor_mm - 5.0).abs() < 1e-9, "{height_mm}");
        }
        other => panic!("{other}"),
    }
}

/// An arm pressed on the table by hand can be brought up again, and goes no lower than it is.
#[test]
fn a_tool_below_the_floor_may_rise_and_not_sink() {
    let cell = cell();
    let height = |q: &[f64]| cell.tool_pose(q).origin().z;
    let lean = |turn: f64| with(2, turn);
    // Leaning forward until the tool is between the table and the floor of the limits.
    let low = (0..4000).map(|k| lean(0.3 + 2.5e-4 * f64::from(k)));
    let low = low.into_iter().find(|q| height(q) < 0.8 * cell.limits.floor).unwrap();
    let to = |by: f64| {
        let mut end = low.clone();
        end[1] += by;
        Trajectory::from_points(&[0.0, 4.0], &[low.clone(), end]).unwrap()
    };
    assert!(cell.clear(to(-0.3), &low).is_ok());
    let sinks = cell.clear(to(0.01), &low).unwrap_err();
    assert!(matches!(sinks, LimitError::Floor { .. }), "{sinks}");
}

#[test]
fn what_is_not_a_number_is_refused() {
    let cell = cell();
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = refused(&cell, Trajectory::resting(&with(1, wrong)));
        let said = matches!(error, LimitError::NotFinite { .. } | LimitError::Jump { .. });
        assert!(said, "{wrong}: {error}");
    }
    let nan = refused(&cell, Trajectory::resting(&[f64::NAN; 7]));
    assert!(matches!(nan, LimitError::NotFinite { .. }), "{nan}");
}

/// What is cleared has private fields, so only its own file can fill them; and in that file only the two
/// functions that check do. That a file elsewhere does not compile is a test of `limits.rs` itself.
#[test]
fn only_clear_makes_something_cleared() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut makers = Vec::new();
    let mut open = vec![src.clone()];
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            if path.extension().is_none_or(|ending| ending != "rs") {
                continue;
            }
            for line in fs::read_to_string(&path).unwrap().lines() {
                let code = line.split("//").next().unwrap();
                let makes = (code.contains("Cleared {") || code.contains("ClearedGrip {"))
                    && !code.contains("struct")
                    && !code.contains("impl");
                if makes {
                    makers.push((
                        path.strip_prefix(&src).unwrap().to_owned(),
                        code.trim().to_owned(),
                    ));
                }
            }
        }
    }
    let gate = std::path::PathBuf::from("arm/limits.rs");
    makers.sort();
    assert_eq!(
        makers,
        [
            (gate.clone(), "Ok(Cleared { trajectory, led })".to_owned()),
            (gate, "Ok(ClearedGrip { opening, speed, force })".to_owned()),
        ]
    );
}
