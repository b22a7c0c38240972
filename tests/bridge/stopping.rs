//! An arm behind a bridge is brought to rest and held, whatever ends its motion; one that is held up is not pushed on.

use std::sync::{Arc, Mutex};

use serde_json::{Value, json};
use trueup::arm::limits::{Cleared, Limits};
use trueup::arm::{Arm as _, Cancel, DeviceError};
use trueup::bridge::BridgeArm;
use trueup::motion::Robot;
use trueup::motion::trajectory::{Limits as Speeds, Trajectory};
use trueup::world::Pose;

use super::answers::connect;
use super::reality::serve;

/// An arm that is where it was sent, but for a wall that the first joint cannot pass, at `wall` rad; and what was asked.
fn arm(robot: &Robot, wall: f64) -> (BridgeArm, Arc<Mutex<Vec<Value>>>) {
    flawed(robot, wall, |_, told| told)
}

/// As [`arm`], where `flaw` makes of the answer to each step, by its number from 1, what is sent.
fn flawed(
    robot: &Robot,
    wall: f64,
    mut flaw: impl FnMut(usize, String) -> String + Send + 'static,
) -> (BridgeArm, Arc<Mutex<Vec<Value>>>) {
    let names: Vec<String> = robot.joints().iter().map(|joint| joint.name.clone()).collect();
    let home = robot.pose("home").unwrap().to_vec();
    let (mut sent, mut q, mut t) = (home.clone(), home, 0.0);
    let (joints, none) = (names.clone(), vec![0.0; names.len()]);
    let mut steps = 0;
    let (place, asked) = serve(move |request| {
        if request.get("hello").is_some() {
            return Some(json!({"hello": 1, "joints": joints}).to_string());
        }
        if let Some(step) = request.get("step") {
            steps += 1;
            t += step["dt"].as_f64().unwrap();
            if let Some(to) = step["q"].as_array() {
                sent = to.iter().map(|to| to.as_f64().unwrap()).collect();
            }
        }
        if request.get("stop").is_some() {
            sent.clone_from(&q);
        }
        q.clone_from(&sent);
        q[0] = q[0].min(wall);
        let told = json!({"t": t, "q": q, "dq": none, "tau": none, "opening": 0.08}).to_string();
        Some(if request.get("step").is_some() { flaw(steps, told) } else { told })
    });
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    (connect(&place, "robot", &names).unwrap().arm, asked)
}

/// The way from home to `by` rad farther in the first joint.
fn turned(robot: &Robot, by: f64) -> Cleared {
    let home = robot.pose("home").unwrap().to_vec();
    let mut end = home.clone();
    end[0] += by;
    let path = [home.clone(), end];
    let trajectory = Trajectory::through_points(&path, &Speeds::of(robot)).unwrap();
    Limits::default().clear(robot, &Pose::identity(), trajectory, &home).unwrap()
}

fn is_stop(request: &Value) -> bool {
    request.get("stop").is_some()
}

/// What the first joint was sent to, in order, rad.
fn sent(asked: &[Value]) -> Vec<f64> {
    asked.iter().filter_map(|request| request["step"]["q"][0].as_f64()).collect()
}

#[test]
fn ctrl_c_brakes_within_the_limits_and_then_stops() {
    let robot = Robot::gen3();
    let (mut arm, asked) = arm(&robot, f64::INFINITY);
    let (cleared, cancel) = (turned(&robot, 1.0), Cancel::default());
    let mut ticks = 0;
    let stopped = arm.follow(&cleared, &cancel, &mut |_| {
        ticks += 1;
        if ticks == 150 {
            cancel.cancel();
        }
    });
    assert_eq!(stopped, Err(DeviceError::Stopped));
    let here = arm.feedback().unwrap();
    assert!(here.q.iter().zip(&here.q_cmd).all(|(q, to)| (q - to).abs() < 1e-9), "{here:?}");
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().filter(|asked| is_stop(asked)).count(), 1);
    assert!(is_stop(asked.last().unwrap()));
    assert_braked(&asked);
}

/// Before the stop the command has come to rest: its last step is smaller than a twentieth of its largest.
fn assert_braked(asked: &[Value]) {
    let sent = sent(asked);
    let steps: Vec<f64> = sent.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let largest = steps.iter().copied().fold(0.0, f64::max);
    assert!(largest > 1e-3 && steps.last().unwrap() < &(0.05 * largest), "{steps:?}");
}

/// The step of a motion that is answered badly: the arm is on its way.
const BAD: usize = 150;

fn refusal() -> String {
    json!({"error": "motor 3 is too warm", "help": "let it cool"}).to_string()
}

/// An answer with a number that is none.
fn unreal(told: &str) -> String {
    told.replace(r#""opening":0.08"#, r#""opening":NaN"#)
}

/// `stop` was the first that came after it, to an arm that ran at 1.2 rad/s.
#[test]
fn an_arm_is_braked_after_one_answer_that_says_no() {
    let robot = Robot::gen3();
    let says_no = |step: usize, told: String| if step == BAD { refusal() } else { told };
    let (mut arm, asked) = flawed(&robot, f64::INFINITY, says_no);
    let error = arm.follow(&turned(&robot, 1.0), &Cancel::default(), &mut |_| {}).unwrap_err();
    assert_eq!(error.to_string(), "the bridge refused `step`: motor 3 is too warm");
    {
        let asked = asked.lock().unwrap();
        assert_eq!(asked.iter().filter(|asked| is_stop(asked)).count(), 1);
        assert!(is_stop(asked.last().unwrap()));
        assert_braked(&asked);
    }
    // The connection is as good as before.
    assert!(!arm.is_lost());
    arm.wait(0.01, &Cancel::default(), &mut |_| {}).unwrap();
}

#[test]
fn an_arm_is_braked_after_one_answer_that_cannot_be() {
    let robot = Robot::gen3();
    let no_number = |step: usize, told: String| if step == BAD { unreal(&told) } else { told };
    let (mut arm, asked) = flawed(&robot, f64::INFINITY, no_number);
    let error = arm.follow(&turned(&robot, 1.0), &Cancel::default(), &mut |_| {}).unwrap_err();
    assert_eq!(error.to_string(), "`opening` in the answer to `step` is no finite number");
    // Then nothing more is asked.
    assert!(arm.is_lost());
    assert_eq!(arm.wait(0.01, &Cancel::default(), &mut |_| {}), Err(error));
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().filter(|asked| is_stop(asked)).count(), 1);
    assert!(is_stop(asked.last().unwrap()));
    assert_braked(&asked);
}

/// A joint whose sign was turned for one answer was told to be stuck.
#[test]
fn a_joint_that_leaps_is_no_joint_that_does_not_follow() {
    let robot = Robot::gen3();
    let mirrored = |step: usize, told: String| {
        let mut told: Value = serde_json::from_str(&told).unwrap();
        if step == BAD {
            told["q"][0] = json!(-told["q"][0].as_f64().unwrap());
        }
        told.to_string()
    };
    let (mut arm, asked) = flawed(&robot, f64::INFINITY, mirrored);
    let error = arm.follow(&turned(&robot, 1.0), &Cancel::default(), &mut |_| {}).unwrap_err();
    let what = error.to_string();
    assert!(what.starts_with("`q` of joint 1 in the answer to `step` changed by"), "{what}");
    assert!(what.ends_with("deg within 4 ms: it turns at 80 deg/s at most"), "{what}");
    assert!(!error.is_limit());
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().filter(|asked| is_stop(asked)).count(), 1);
    assert_braked(&asked);
}

/// So was an arm of which one answer was told again and again: by it the arm moves, and is where it was.
#[test]
fn an_answer_that_is_told_again_and_again_is_not_believed() {
    let robot = Robot::gen3();
    let mut first = None;
    let again = move |step: usize, told: String| {
        let mut told: Value = serde_json::from_str(&told).unwrap();
        if step >= BAD {
            told["q"] = first.get_or_insert_with(|| told["q"].clone()).clone();
            told["dq"][0] = json!(1.2);
        }
        told.to_string()
    };
    let (mut arm, asked) = flawed(&robot, f64::INFINITY, again);
    let error = arm.follow(&turned(&robot, 1.0), &Cancel::default(), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("the server's numbers do not change"), "{error}");
    assert!(!error.is_limit());
    assert_eq!(asked.lock().unwrap().iter().filter(|asked| is_stop(asked)).count(), 1);
}

/// Nor is there anything to brake with where every answer is bad.
#[test]
fn an_arm_is_stopped_at_once_after_a_second_bad_answer() {
    let robot = Robot::gen3();
    let all: [fn(&str) -> String; 2] = [|_| refusal(), unreal];
    for bad in all {
        let from_then =
            move |step: usize, told: String| if step >= BAD { bad(&told) } else { told };
        let (mut arm, asked) = flawed(&robot, f64::INFINITY, from_then);
        let error = arm.follow(&turned(&robot, 1.0), &Cancel::default(), &mut |_| {}).unwrap_err();
        assert!(error.to_string().contains("`step`"), "{error}");
        let asked = asked.lock().unwrap();
        assert_eq!(sent(&asked).len(), BAD + 1);
        assert_eq!(asked.iter().filter(|asked| is_stop(asked)).count(), 1);
        assert!(is_stop(asked.last().unwrap()));
    }
}

/// What was wrong while the arm was braked for Ctrl-C had it stopped on its way.
#[test]
fn one_bad_answer_while_the_arm_is_braked_does_not_end_the_braking() {
    let robot = Robot::gen3();
    let says_no = |step: usize, told: String| if step == BAD + 5 { refusal() } else { told };
    let (mut arm, asked) = flawed(&robot, f64::INFINITY, says_no);
    let (cleared, cancel) = (turned(&robot, 1.0), Cancel::default());
    let mut ticks = 0;
    let error = arm.follow(&cleared, &cancel, &mut |_| {
        ticks += 1;
        if ticks == BAD {
            cancel.cancel();
        }
    });
    assert!(error.unwrap_err().to_string().contains("refused"));
    assert_braked(&asked.lock().unwrap());
}

/// What ends only one motion is gone on from: nothing is sent but commands.
#[test]
fn a_motion_that_is_cut_short_is_braked_and_not_stopped() {
    let robot = Robot::gen3();
    let (mut arm, asked) = arm(&robot, f64::INFINITY);
    let all = Cancel::default();
    let one = all.child().child();
    let mut ticks = 0;
    let stopped = arm.follow(&turned(&robot, 1.0), &one, &mut |_| {
        ticks += 1;
        if ticks == 100 {
            one.cancel();
        }
    });
    assert_eq!(stopped, Err(DeviceError::Stopped));
    assert!(!asked.lock().unwrap().iter().any(is_stop));
    all.cancel();
    assert_eq!(arm.wait(0.1, &one, &mut |_| {}), Err(DeviceError::Stopped));
    assert_eq!(asked.lock().unwrap().iter().filter(|asked| is_stop(asked)).count(), 1);
}

/// It passed its step as done, and the next motion hid it: a motion rests for less than the time after which a joint is called stuck.
#[test]
fn a_motion_is_not_over_before_the_arm_has_come() {
    let robot = Robot::gen3();
    let begin = robot.pose("home").unwrap()[0];
    // Stuck for the last 0.21 rad of the way, which are the slowest.
    let (mut arm, asked) = arm(&robot, begin + 0.29);
    let error = arm.follow(&turned(&robot, 0.5), &Cancel::default(), &mut |_| {}).unwrap_err();
    assert!(matches!(error, DeviceError::FollowingError { joint: 1, .. }), "{error:?}");
    assert_eq!(asked.lock().unwrap().iter().filter(|asked| is_stop(asked)).count(), 1);
}

/// A servo that is late, as one without feed-forward is, is not stuck.
#[test]
fn a_servo_that_is_late_is_waited_for() {
    let robot = Robot::gen3();
    let names: Vec<String> = robot.joints().iter().map(|joint| joint.name.clone()).collect();
    let mut q = robot.pose("home").unwrap().to_vec();
    let (mut sent, mut t, joints) = (q.clone(), 0.0, names.clone());
    let (place, _) = serve(move |request| {
        if request.get("hello").is_some() {
            return Some(json!({"hello": 1, "joints": joints}).to_string());
        }
        let dt = request["step"]["dt"].as_f64().unwrap_or(0.0);
        if let Some(to) = request["step"]["q"].as_array() {
            sent = to.iter().map(|to| to.as_f64().unwrap()).collect();
        }
        t += dt;
        // A first-order lag of 0.15 s.
        q.iter_mut().zip(&sent).for_each(|(q, to)| *q += (to - *q) * dt / 0.15);
        let none = vec![0.0; q.len()];
        Some(json!({"t": t, "q": q, "dq": none, "tau": none, "opening": 0.08}).to_string())
    });
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut arm = connect(&place, "robot", &names).unwrap().arm;
    let mut most = 0.0_f64;
    arm.follow(&turned(&robot, 2.0), &Cancel::default(), &mut |feedback| {
        most = most.max((feedback.q_cmd[0] - feedback.q[0]).abs());
    })
    .unwrap();
    assert!(most > 0.15, "{most} rad were nothing to bear");
}

/// An arm whose fingers, from 80 mm open on, give way by `gives` m at once and go where they are sent 0.6 s later; something of 30 mm is between them.
fn with_late_fingers(robot: &Robot, gives: f64) -> (BridgeArm, Arc<Mutex<Vec<Value>>>) {
    let names: Vec<String> = robot.joints().iter().map(|joint| joint.name.clone()).collect();
    let (q, joints) = (robot.pose("home").unwrap().to_vec(), names.clone());
    let (mut t, mut opening, mut begins) = (0.0, 0.08, f64::INFINITY);
    let (place, asked) = serve(move |request| {
        if request.get("hello").is_some() {
            return Some(json!({"hello": 1, "joints": joints}).to_string());
        }
        t += request["step"]["dt"].as_f64().unwrap_or(0.0);
        if request["step"]["grip"].is_object() {
            begins = t + 0.6;
            opening += gives;
        }
        if t > begins {
            opening = f64::max(0.03, opening - 0.004 * 0.1);
        }
        let none = vec![0.0; q.len()];
        Some(json!({"t": t, "q": q, "dq": none, "tau": none, "opening": opening}).to_string())
    });
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    (connect(&place, "robot", &names).unwrap().arm, asked)
}

/// Fingers that had not begun after 0.3 s counted as stopped by something.
#[test]
fn fingers_may_begin_late_and_are_not_waited_for_twice() {
    let robot = Robot::gen3();
    let (mut arm, asked) = with_late_fingers(&robot, 0.0);
    let close = Limits::default().clear_grip(&robot, 0.0, 0.1, 20.0).unwrap();
    let mut close = || arm.grip(&close, &Cancel::default(), &mut |_| {}).unwrap();
    let grip = close();
    assert!(grip.stalled && (grip.opening - 0.03).abs() < 1e-9, "{grip:?}");
    let before = asked.lock().unwrap().len();
    assert!(close().stalled);
    let steps = asked.lock().unwrap().len() - before;
    assert_eq!(steps, 75, "three tenths of a second");
}

/// Fingers that moved at all had begun, and then rested: they were waited for no longer.
#[test]
fn fingers_that_give_the_wrong_way_have_not_begun() {
    let robot = Robot::gen3();
    let (mut arm, _) = with_late_fingers(&robot, 5e-4);
    let close = Limits::default().clear_grip(&robot, 0.0, 0.1, 20.0).unwrap();
    let grip = arm.grip(&close, &Cancel::default(), &mut |_| {}).unwrap();
    assert!((grip.opening - 0.03).abs() < 1e-9, "{grip:?}");
}

#[test]
fn an_arm_that_is_held_up_is_stopped_and_does_not_leap_when_it_is_free() {
    let robot = Robot::gen3();
    let begin = robot.pose("home").unwrap()[0];
    let wall = begin + 0.3;
    let (mut arm, asked) = arm(&robot, wall);
    let error = arm.follow(&turned(&robot, 1.5), &Cancel::default(), &mut |_| {}).unwrap_err();
    let DeviceError::FollowingError { joint: 1, error_deg, .. } = error else {
        panic!("{error:?}")
    };
    // It was noticed on the way: the command goes on for 1.2 rad behind the wall.
    assert!((11.0..50.0).contains(&error_deg), "{error_deg}");
    assert_eq!(asked.lock().unwrap().iter().filter(|asked| is_stop(asked)).count(), 1);
    // The command is where the arm is, and was so before the stop.
    assert!((arm.feedback().unwrap().q_cmd[0] - wall).abs() < 1e-9);
    assert!((sent(&asked.lock().unwrap()).last().unwrap() - wall).abs() < 1e-9);
}
