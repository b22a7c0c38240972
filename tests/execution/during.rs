//! What holds while a step runs: planted conditions, each in both outcomes, with times and distances
//! against the arm's own ticks.

use std::sync::{Arc, Mutex};

use trueup::arm::{Cancel, Feedback};
use trueup::execution::context::ActionContext;
use trueup::execution::decisions::DecisionLog;
use trueup::execution::during::{LATE, PERIOD};
use trueup::execution::error::ActionError;
use trueup::execution::script::Scripts;
use trueup::execution::twin_arm::TwinBody;
use trueup::execution::walk::Walker;
use trueup::trace::Outcome;
use trueup::units::Unit;
use trueup::workcell::Stdlib;

use super::walked::{AHEAD, Eyes, Ticks, Walked, plan, tool_at_home, walk, walk_slowly, walk_with};
use crate::kitchen;

/// Where the tool is in each tick: arm time s, x and z m.
fn tool(ticks: &[Feedback]) -> Vec<(f64, f64, f64)> {
    let robot = crate::twin::gen3();
    let at = |f: &Feedback| {
        let tool = robot.forward_tool(&f.q).unwrap().origin();
        (f.time, tool.x, tool.z)
    };
    ticks.iter().map(at).collect()
}

/// When `value` first reaches `limit`, by straight lines between ticks, s from the first.
fn crossing(ticks: &[(f64, f64)], limit: f64) -> f64 {
    let rises = ticks.last().unwrap().1 > ticks[0].1;
    let past = |v: f64| if rises { v >= limit } else { v <= limit };
    let k = ticks.iter().position(|(_, v)| past(*v)).expect("it is reached");
    let ((t0, v0), (t1, v1)) = (ticks[k - 1], ticks[k]);
    t0 + (limit - v0) / (v1 - v0) * (t1 - t0) - ticks[0].0
}

fn heights(ticks: &[Feedback]) -> Vec<(f64, f64)> {
    tool(ticks).into_iter().map(|(t, _, z)| (t, z)).collect()
}

fn is_at_rest(feedback: &Feedback) -> bool {
    feedback.dq.iter().all(|dq| dq.abs() < 0.03)
}

/// The length that stands in a text after the last `word`, m.
fn length_after(text: &str, word: &str) -> f64 {
    let rest = &text[text.rfind(word).unwrap_or_else(|| panic!("{text}")) + word.len()..];
    let mut words = rest.split([' ', ')', ',']);
    let (number, unit) = (words.next().unwrap(), words.next().unwrap());
    let unit = Unit::parse(unit).unwrap_or_else(|_| panic!("{text}"));
    number.parse::<f64>().unwrap_or_else(|_| panic!("{text}")) * unit.factor
}

/// The seconds that stand in a text before `word`.
fn seconds_before(text: &str, word: &str) -> f64 {
    let before = &text[..text.find(word).unwrap_or_else(|| panic!("{text}"))];
    let number = before.rsplit(' ').next().unwrap();
    number.parse().unwrap_or_else(|_| panic!("{text}"))
}

fn home_height() -> f64 {
    tool_at_home().z
}

#[test]
fn a_while_that_holds_tells_its_smallest_margin_and_when() {
    let limit = home_height() + 0.20;
    let walked = walk(&format!("{{ rise(by: 10 cm) while height(gripper) <= {limit:.4} m }}"));
    let done = walked.step(0);
    assert_eq!(done.outcome, Outcome::Success, "{:?}", done.failure);
    let held = &done.held[0];
    // The tool ends 10 cm under the limit, and was nowhere nearer to it.
    let least = held.least.unwrap().value;
    let highest = heights(&walked.ticks).iter().map(|(_, z)| *z).fold(f64::MIN, f64::max);
    let rounding = 5e-5;
    assert!((least - (limit - highest)).abs() < 2e-4 + rounding, "{least} {}", limit - highest);
    assert!((least - 0.10).abs() < 2e-3, "{least}");
    let at = held.least_at.unwrap();
    assert!(at > 0.5 * (done.interval[1] - done.interval[0]), "{at} of {:?}", done.interval);
    assert_eq!(held.became_true, None);
}

#[test]
fn a_while_that_breaks_stops_the_arm_within_one_period_of_the_crossing() {
    let limit = home_height() + 0.05;
    let walked = walk(&format!("{{ rise(by: 15 cm) while height(gripper) <= {limit:.6} m }}"));
    let done = walked.step(0);
    assert_eq!(done.outcome, Outcome::Failure);
    let reason = walked.reason(0);
    assert!(reason.starts_with("it lost `height(gripper) <= "), "{reason}");
    let ticks = heights(&walked.ticks);
    let crossed = crossing(&ticks, limit) + 0.004;
    let told = length_after(&reason, "limit ");
    assert!((told - limit).abs() < 1e-3, "{reason}");
    let noticed = seconds_before(&reason, " s into the step");
    assert!(
        noticed >= crossed - 0.006 && noticed <= crossed + PERIOD + 0.009,
        "{noticed} {crossed}"
    );
    // Brought to rest: what was gained after that is the way of braking, not the other 10 cm.
    let end = walked.ticks.last().unwrap();
    assert!(is_at_rest(end), "{:?}", end.dq);
    let over = ticks.last().unwrap().1 - limit;
    assert!(over > 0.0 && over < 0.02, "{over} m past the limit");
}

#[test]
fn an_until_ends_the_step_as_a_success_and_what_follows_in_the_script_is_left_out() {
    let limit = home_height() + 0.04;
    let walked = walk(&format!(
        "{{ twice(by: 8 cm) until height(gripper) >= {limit:.6} m  pause(time: 0.1 s) }}"
    ));
    let done = walked.step(0);
    assert_eq!(done.outcome, Outcome::Success, "{:?}", done.failure);
    let moved: Vec<_> =
        walked.ticks.iter().filter(|f| f.time <= done.interval[1]).cloned().collect();
    let ticks = heights(&moved);
    let crossed = crossing(&ticks, limit) + 0.004;
    let at = done.held[0].became_true.unwrap();
    assert!(at >= crossed - 0.001 && at <= crossed + PERIOD + 0.005, "{at} {crossed}");
    assert!(!done.held[0].by_rehearsal);
    assert_eq!(done.not_needed, None);
    assert!(ticks.last().unwrap().1 < limit + 0.02, "neither the rest of it nor the second rise");
    assert_eq!(walked.step(1).outcome, Outcome::Success);
}

#[test]
fn an_until_that_never_comes_true_fails_the_step_with_how_far_it_was() {
    let limit = home_height() + 0.12;
    let walked = walk(&format!("{{ rise(by: 10 cm) until height(gripper) >= {limit:.6} m }}"));
    assert_eq!(walked.step(0).outcome, Outcome::Failure);
    let reason = walked.reason(0);
    assert!(reason.starts_with("it came to its end before `height(gripper) >= "), "{reason}");
    let by = length_after(&reason, "false by ");
    assert!((by - 0.02).abs() < 0.002, "2 cm are missing: {reason}");
}

#[test]
fn what_ends_it_already_on_arrival_moves_nothing_and_leaves_the_tasks_promise_asked() {
    let low = home_height() - 0.01;
    let walked = walk(&format!("{{ rise(by: 10 cm) until height(gripper) >= {low:.6} m }}"));
    assert_eq!(walked.step(0).outcome, Outcome::Success, "{:?}", walked.reason(0));
    assert!(walked.ticks.is_empty());
    assert!(walked.step(0).not_needed.as_ref().unwrap().starts_with("height(gripper) >= "));
    let high = home_height() + 0.05;
    let walked = walk(&format!(
        "{{ gives height(gripper) >= {high:.6} m
            rise(by: 10 cm) until height(gripper) >= {low:.6} m }}"
    ));
    assert_eq!(walked.step(0).outcome, Outcome::Failure);
    assert!(walked.reason(0).starts_with("it promised "), "{}", walked.reason(0));
}

/// The action keeps its own condition, the block around it another, the task a third: the first to break
/// is the one that is told.
#[test]
fn keeps_of_everything_around_a_step_are_in_force() {
    let home = home_height();
    let (low, high) = (home - 0.06, home - 0.03);
    for (task, block, told) in [(low, high, high), (high, low, high), (low, low - 0.01, low)] {
        let walked = walk(&format!(
            "{{ keeps height(gripper) >= {task:.6} m
                {{ dip(by: -10 cm) }} while height(gripper) >= {block:.6} m }}"
        ));
        assert_eq!(walked.step(0).outcome, Outcome::Failure);
        let limit = length_after(&walked.reason(0), "limit ");
        assert!((limit - told).abs() < 1e-3, "{} not {told}", walked.reason(0));
        assert_eq!(walked.step(0).held.len(), 3, "its own, the block's and the task's");
    }
    let walked = walk(&format!(
        "{{ keeps height(gripper) >= {low:.6} m  {{ dip(by: -4 cm) }} while opening() >= 0 mm }}"
    ));
    assert_eq!(walked.step(0).outcome, Outcome::Success, "{}", walked.reason(0));
}

#[test]
fn a_limit_stops_its_action_and_a_tasks_limit_counts_from_its_first_step() {
    let walked = walk("{ pause(time: 3 s) }");
    assert_eq!(walked.step(0).outcome, Outcome::Failure);
    let reason = walked.reason(0);
    assert!(reason.starts_with("pause(time: 3 s) has taken 1.0"), "{reason}");
    assert!(reason.ends_with("s, and its limit is 1 s"), "{reason}");
    let [from, to] = walked.step(0).interval;
    assert!(to - from > 1.0 && to - from < 1.0 + PERIOD + 0.02, "{}", to - from);

    let walked = walk("{ pause(time: 0.9 s) }");
    assert_eq!(walked.step(0).outcome, Outcome::Success);

    let walked = walk("{ limit 2 s  pause(time: 0.9 s)  pause(time: 0.9 s)  pause(time: 0.9 s) }");
    let ended: Vec<_> = walked.steps.iter().map(|s| s.as_ref().unwrap().outcome).collect();
    assert_eq!(ended, [Outcome::Success, Outcome::Success, Outcome::Failure]);
    let reason = walked.reason(2);
    assert!(
        reason.starts_with("t() has taken 2.0") && reason.ends_with("its limit is 2 s"),
        "{reason}"
    );
    let took = walked.step(2).interval[1] - walked.step(0).interval[0];
    assert!(took > 2.0 && took < 2.0 + PERIOD + 0.02, "{took}");
}

/// `slow 5` once failed the first step that took longer than its limit: 30 s of it went by before the arm was half way.
#[test]
fn a_limit_stretches_as_the_dial_slows_the_arm_down() {
    let walked = walk_slowly("{ pause(time: 3 s) }", &[20]);
    assert_eq!(walked.step(0).outcome, Outcome::Success, "{}", walked.reason(0));
    let walked = walk_slowly("{ pause(time: 3 s) }", &[50]);
    let reason = walked.reason(0);
    assert!(reason.starts_with("pause(time: 3 s) has taken 2.0"), "{reason}");
    assert!(reason.ends_with("its limit is 1 s at full speed, 2 s at 0.50 of it"), "{reason}");
    // A task's limit counts each second as fast as it went by.
    let walked = walk_slowly(
        "{ limit 2 s  pause(time: 0.9 s)  pause(time: 3 s)  pause(time: 0.7 s)  pause(time: 0.9 s) }",
        &[100, 10, 100],
    );
    let ended: Vec<_> = walked.steps.iter().map(|s| s.as_ref().unwrap().outcome).collect();
    let well = Outcome::Success;
    assert_eq!(ended, [well, well, well, Outcome::Failure], "{}", walked.reason(2));
    let reason = walked.reason(3);
    assert!(reason.starts_with("t() has taken 4.") && reason.contains("2 s at full speed, "));
}

#[test]
fn what_nobody_knows_stops_nothing() {
    // Nobody measures how fast the jar moves, and planning whether it is in reach takes too long.
    let walked = walk(
        "{ rise(by: 5 cm) while speed(jar) <= 1 mm/s
           rise(by: -5 cm) while not reachable(jar) or reachable(jar) }",
    );
    for index in 0..2 {
        assert_eq!(walked.step(index).outcome, Outcome::Success, "{}", walked.reason(index));
    }
    assert_eq!(walked.step(0).held[0].least, None);
}

#[test]
fn a_wish_to_stop_is_told_from_a_broken_condition() {
    let cancel = Cancel::default();
    cancel.cancel();
    let walked = walk_with(
        "{ rise(by: 5 cm) while opening() >= 0 mm }",
        DecisionLog::recording(),
        Eyes::Twins,
        &cancel,
    );
    assert_eq!(walked.steps[0].as_ref().unwrap_err(), &ActionError::Stopped);
}

/// The tool goes 12 cm towards the jar and ends after 4 cm, by its distance from the jar.
fn towards(then: &str) -> String {
    let near = AHEAD - 0.04;
    format!("{{ ahead(by: 12 cm) until distance(gripper, jar) <= {near:.6} m  {then} }}")
}

#[test]
fn where_nobody_can_measure_it_the_arm_ends_where_the_rehearsal_did() {
    let body = towards("rise(by: 5 cm)");
    let rehearsed = walk(&body);
    assert_eq!(rehearsed.step(0).outcome, Outcome::Success, "{}", rehearsed.reason(0));
    let in_twin = rehearsed.step(0).held[0].became_true.unwrap();
    let blind = walk_with(&body, rehearsed.log.rewound(), Eyes::Blind, &Cancel::default());
    for index in 0..2 {
        assert_eq!(blind.step(index).outcome, Outcome::Success, "{}", blind.reason(index));
    }
    let held = &blind.step(0).held[0];
    assert!(held.by_rehearsal);
    assert!(
        (held.became_true.unwrap() - in_twin).abs() < PERIOD,
        "{held:?}, in the twin {in_twin}"
    );
    let off = |(a, b): (&f64, &f64)| (a - b).abs();
    let apart = blind.q.iter().zip(&rehearsed.q).map(off).fold(0.0, f64::max);
    assert!(apart < 1e-3, "the same way from there on: {apart} rad");
}

/// The jar is measured 1 cm nearer than it was rehearsed: the step ends sooner, and the arm is led to where
/// the next rehearsed path begins.
#[test]
fn as_measured_it_may_end_sooner_than_rehearsed() {
    let body = towards("rise(by: 5 cm)");
    let rehearsed = walk(&body);
    let sooner = walk_with(&body, rehearsed.log.rewound(), Eyes::Nearer(0.01), &Cancel::default());
    for index in 0..2 {
        assert_eq!(sooner.step(index).outcome, Outcome::Success, "{}", sooner.reason(index));
    }
    let (early, twin) = (&sooner.step(0).held[0], &rehearsed.step(0).held[0]);
    assert!(!early.by_rehearsal);
    let gained = twin.became_true.unwrap() - early.became_true.unwrap();
    assert!(gained >= PERIOD, "{gained} s sooner");
    let off = |(a, b): (&f64, &f64)| (a - b).abs();
    let apart = sooner.q.iter().zip(&rehearsed.q).map(off).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{apart} rad");
}

/// Measured 5 cm farther: what was to become true in the rehearsal does not, and the arm does not go on
/// beyond what was rehearsed.
#[test]
fn as_measured_it_may_not_end_much_later_than_rehearsed() {
    let body = towards("rise(by: 5 cm)");
    let rehearsed = walk(&body);
    let late = walk_with(&body, rehearsed.log.rewound(), Eyes::Nearer(-0.05), &Cancel::default());
    assert_eq!(late.step(0).outcome, Outcome::Failure);
    let reason = late.reason(0);
    assert!(reason.contains("later than it was true in the rehearsal"), "{reason}");
    let over = seconds_before(&reason, " s later than");
    assert!(over > LATE && over <= LATE + PERIOD + 0.01, "{reason}");
}

/// Kept in the rehearsal and broken on the arm, whose eyes have the jar 2 cm nearer: the arm stops there.
#[test]
fn what_the_twin_kept_the_arm_may_break() {
    let near = AHEAD - 0.05;
    let body = format!("{{ ahead(by: 4 cm) while distance(gripper, jar) >= {near:.6} m }}");
    let rehearsed = walk(&body);
    assert_eq!(rehearsed.step(0).outcome, Outcome::Success, "{}", rehearsed.reason(0));
    let least = |walked: &Walked| walked.step(0).held[0].least.unwrap().value;
    assert!((least(&rehearsed) - 0.01).abs() < 2e-3, "{}", least(&rehearsed));
    let broken = walk_with(&body, rehearsed.log.rewound(), Eyes::Nearer(0.02), &Cancel::default());
    assert_eq!(broken.step(0).outcome, Outcome::Failure);
    assert!(broken.reason(0).starts_with("it lost `distance(gripper, jar) >= "));
    assert!(least(&broken) < 0.0);
    assert!(is_at_rest(broken.ticks.last().unwrap()));
}

/// Picking up, carrying over the cup and putting down, in the twin and without water: what the library's own
/// actions keep holds all the while, inside their limits.
#[test]
fn the_library_keeps_what_it_says() {
    let (library, pg) =
        plan("task t() { pick(jar) via level_side  move_over(jar, cup)  place(jar) }", "t()");
    let cell = super::cell();
    let mut state = super::state(&kitchen::HOME, [0.60, 0.10, 0.3]);
    state.object_mut("cup").unwrap().world_from_object =
        Some(trueup::world::Pose::upright(0.58, -0.22, 0.0, 0.0));
    state.opening = 0.085;
    let body = Box::new(TwinBody::new(super::twin(&cell.scene, &state)));
    let scene = cell.scene.clone();
    let watcher = Arc::new(Mutex::new(Ticks::default()));
    let (q, cancel) = (kitchen::HOME.to_vec(), Cancel::default());
    let mut scripts = Scripts::new(ActionContext::new(
        cell,
        body,
        q,
        DecisionLog::recording(),
        (1, 0),
        cancel,
        watcher,
    ));
    let start = scripts.context().state().unwrap();
    let texts = Stdlib::embedded();
    let mut walker = Walker::new(&mut scripts, &texts, &library, &scene, &start);
    let mut levels = 0;
    for index in 0..pg.steps.len() {
        let done = walker.step(&pg, index, &[]).unwrap();
        assert_eq!(done.outcome, Outcome::Success, "{}: {:?}", pg.steps[index].text, done.failure);
        for held in done.held.iter().filter(|held| held.text.contains("level(jar)")) {
            assert!(held.least.unwrap().value > 0.0, "{held:?}");
            levels += 1;
        }
    }
    assert_eq!(levels, 2, "while it is carried over and while it is carried back");
}
