//! The client as an `Arm`, against the emulator: motions, fingers, stops, and what networks and arms do on
//! bad days.

use std::sync::Arc;
use std::time::Duration;

use trueup::arm::limits::{Cleared, Limits as Gate};
use trueup::arm::{Arm, Cancel, DeviceError, Feedback};
use trueup::emulator::{Emulator, Ideal, Options, Pace};
use trueup::execution::cell::{Cell, Pads};
use trueup::kortex::arm::{KortexArm, Options as Client};
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::link::Login;
use trueup::kortex::messages::common::ArmState;
use trueup::kortex::messages::motion::{JointSpeed, JointSpeeds};
use trueup::kortex::rpc::base;
use trueup::motion::free::Means;
use trueup::motion::robot::Robot;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::twin::Settings;

use crate::kitchen::{self, HOME};

use super::{admin, eager, emulator};

fn cell() -> Cell {
    let robot = Arc::new(Robot::gen3());
    let pads = Pads::of(&Settings::for_arm(&robot));
    Cell {
        robot,
        scene: Arc::new(kitchen::scene()),
        limits: Gate::default(),
        pads,
        means: Means::default(),
    }
}

pub(super) fn client(emulator: &Emulator) -> Client {
    Client {
        host: "127.0.0.1".into(),
        port: emulator.tcp().port(),
        stream: None,
        login: admin(),
        rate: 40.0,
        timeout: Duration::from_secs(10),
        // Patient: a busy machine lets nobody run for a while.
        patience: Duration::from_secs(10),
        near: HOME.to_vec(),
        max_opening: 0.085,
        clock: emulator.clock(),
    }
}

fn connect(emulator: &Emulator) -> KortexArm {
    KortexArm::connect(client(emulator)).unwrap()
}

/// A motion from `q` with joint 1 turned by `turn` rad, at a share of the robot's limits.
pub(super) fn turned(q: &[f64], turn: f64, share: f64) -> (Cleared, Vec<f64>) {
    let cell = cell();
    let mut end = q.to_vec();
    end[0] += turn;
    let path = [q.to_vec(), end.clone()];
    let limits = Limits::of(&cell.robot).scaled(share, share);
    let timed = Trajectory::through_points(&path, &limits).unwrap();
    (cell.clear(timed, q).unwrap(), end)
}

pub(super) fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn nobody() -> impl FnMut(&Feedback) {
    |_| {}
}

#[test]
fn following_ends_where_asked_along_the_trajectory() {
    let emulator = emulator(&Options::default());
    let mut arm = connect(&emulator);
    let first = arm.feedback().unwrap();
    // Joint 3 is at half a turn, where 180 and -180 deg meet.
    assert!(largest(&first.q, &HOME) < 1e-6, "{:?}", first.q);
    assert!((first.opening - 0.085).abs() < 1e-6);
    let (cleared, end) = turned(&HOME, 1.2, 1.0);
    let mut ticks: Vec<Feedback> = Vec::new();
    arm.follow(&cleared, &Cancel::default(), &mut |tick| ticks.push(tick.clone())).unwrap();
    let last = arm.feedback().unwrap();
    assert!(largest(&last.q, &end) < 1e-5, "{:?}", last.q);
    assert!(largest(&last.q_cmd, &end) < 1e-12);
    assert!(ticks.windows(2).all(|pair| pair[1].time >= pair[0].time));
    // The robot's limits are the hard ones, so the path is a little slower than asked at most.
    let took = last.time - first.time;
    let asked = cleared.trajectory().duration();
    assert!((asked..1.2 * asked + 2.5).contains(&took), "{took} s for {asked} s");
    let middle = &ticks[ticks.len() / 2];
    assert!((0.1..1.15).contains(&middle.q[0]), "{} rad halfway", middle.q[0]);
}

#[test]
fn a_joint_goes_the_short_way_through_a_whole_turn() {
    let emulator = emulator(&eager());
    let mut arm = connect(&emulator);
    let mut q = HOME.to_vec();
    // Three times a third of a turn and a bit: over 360 deg and on, never back.
    for _ in 0..4 {
        let (cleared, end) = turned(&q, 1.8, 1.0);
        let mut least = f64::INFINITY;
        arm.follow(&cleared, &Cancel::default(), &mut |tick| least = least.min(tick.q[0])).unwrap();
        assert!(least > q[0] - 0.01, "it went back to {least} from {}", q[0]);
        q = end;
    }
    assert!((arm.feedback().unwrap().q[0] - 7.2).abs() < 1e-4);
}

#[test]
fn soft_limits_slow_a_path_down_instead_of_having_it_refused() {
    let emulator = emulator(&Options { soft: 0.25, ..eager() });
    let mut arm = connect(&emulator);
    assert!((arm.about().soft.velocity[0] - 0.349).abs() < 1e-3);
    let (cleared, end) = turned(&HOME, 0.6, 1.0);
    let mut fastest = 0.0_f64;
    arm.follow(&cleared, &Cancel::default(), &mut |tick| fastest = fastest.max(tick.dq[0]))
        .unwrap();
    assert!(fastest < 0.36, "{fastest} rad/s");
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-5);
}

#[test]
fn a_refused_path_is_told_with_joint_waypoint_and_limit_and_nothing_moves() {
    let faults = "refuse=1".parse().unwrap();
    let emulator = emulator(&Options { faults, ..eager() });
    let mut arm = connect(&emulator);
    let (cleared, _) = turned(&HOME, 0.5, 0.5);
    let error = arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("the arm refuses the path: joint 1 would accelerate at 999.0 deg/s²"),
        "{text}"
    );
    assert!(text.contains("allowed is -1.0 to 1.0 deg/s²"), "{text}");
    assert!(largest(&arm.feedback().unwrap().q, &HOME) < 1e-6);
}

#[test]
fn a_wish_to_stop_brings_it_to_rest_and_it_goes_on_from_there() {
    let emulator = emulator(&eager());
    let mut arm = connect(&emulator);
    let (cleared, end) = turned(&HOME, 1.6, 0.5);
    let cancel = Cancel::default();
    let stopped = arm.follow(&cleared, &cancel, &mut |tick| {
        if tick.q[0] > 0.4 {
            cancel.cancel();
        }
    });
    assert_eq!(stopped, Err(DeviceError::Stopped));
    let rest = arm.feedback().unwrap();
    assert!(rest.dq.iter().all(|dq| dq.abs() < 0.02), "{:?}", rest.dq);
    assert!(rest.q[0] < end[0] - 0.1, "it ran on to {}", rest.q[0]);
    assert!(largest(&rest.q, &rest.q_cmd) < 1e-4);
    assert_eq!(arm.wait(0.1, &cancel, &mut nobody()), Err(DeviceError::Stopped));
    cancel.clear();
    let (on, end) = turned(&rest.q_cmd, -0.2, 0.5);
    arm.follow(&on, &cancel, &mut nobody()).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
}

#[test]
fn fingers_go_where_they_are_sent_unless_something_is_between_them() {
    let plant = Ideal::new(&HOME).with_object(0.065);
    let emulator = Emulator::start(Arc::new(Robot::gen3()), Box::new(plant), &eager()).unwrap();
    let mut arm = connect(&emulator);
    let cell = cell();
    let fingers = |opening| cell.clear_grip(opening, 0.06, 30.0).unwrap();
    let never = Cancel::default();
    let grip = arm.grip(&fingers(0.075), &never, &mut nobody()).unwrap();
    assert!(!grip.stalled && (grip.opening - 0.075).abs() < 1e-3, "{grip:?}");
    let grip = arm.grip(&fingers(0.0), &never, &mut nobody()).unwrap();
    assert!(grip.stalled && (grip.opening - 0.065).abs() < 1e-3, "{grip:?}");
    let grip = arm.grip(&fingers(0.085), &never, &mut nobody()).unwrap();
    assert!(!grip.stalled && grip.opening > 0.084, "{grip:?}");
}

#[test]
fn waiting_lets_the_arms_time_pass() {
    let emulator = emulator(&eager());
    let mut arm = connect(&emulator);
    let before = arm.feedback().unwrap();
    let mut ticks = 0;
    arm.wait(1.0, &Cancel::default(), &mut |_| ticks += 1).unwrap();
    let after = arm.feedback().unwrap();
    assert!(after.time - before.time >= 1.0);
    // An eager arm's second is short: what is asked for in between depends on the machine.
    assert!(ticks >= 1);
    assert!(largest(&after.q, &before.q) < 1e-9);
}

#[test]
fn an_emergency_stop_on_the_way_is_an_error_with_advice_and_can_be_cleared() {
    let faults = "estop=500ms".parse().unwrap();
    let emulator = emulator(&Options { faults, pace: Pace::Real, ..Options::default() });
    let mut arm = connect(&emulator);
    let (cleared, _) = turned(&HOME, 1.6, 0.3);
    let error = arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    let DeviceError::Refused { what, help } = &error else { panic!("{error:?}") };
    assert!(what.contains("emergency stop"), "{what}");
    assert!(help.contains("clear the faults"), "{help}");
    assert_eq!(arm.state().unwrap(), ArmState::InFault);
    arm.clear_faults().unwrap();
    assert_eq!(arm.state().unwrap(), ArmState::ServoingReady);
    let from = arm.feedback().unwrap().q_cmd;
    let (on, end) = turned(&from, 0.1, 0.5);
    arm.follow(&on, &Cancel::default(), &mut nobody()).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-4);
}

#[test]
fn a_motion_whose_end_is_never_told_ends_when_the_joints_are_there() {
    let faults = "hush=1".parse().unwrap();
    let emulator = emulator(&Options { faults, ..eager() });
    let mut arm = connect(&emulator);
    let (cleared, end) = turned(&HOME, 0.3, 1.0);
    arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap();
    assert!(largest(&arm.feedback().unwrap().q, &end) < 1e-5);
}

#[test]
fn a_motion_the_arm_gives_up_is_told_with_its_reason() {
    let faults = "abort=1".parse().unwrap();
    let emulator = emulator(&Options { faults, ..eager() });
    let mut arm = connect(&emulator);
    let (cleared, end) = turned(&HOME, 1.0, 0.5);
    let error = arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    assert!(error.to_string().contains("CONTROL_WAYPOINT_TRAJECTORY_ABORTED 140"), "{error}");
    assert!(arm.feedback().unwrap().q[0] < end[0] - 0.5);
}

#[test]
fn a_lost_connection_stops_the_arm_and_the_next_question_opens_it_again() {
    let faults = "cut=1500ms".parse().unwrap();
    let emulator = emulator(&Options { faults, pace: Pace::Real, ..Options::default() });
    let mut arm = connect(&emulator);
    let (cleared, end) = turned(&HOME, 1.6, 0.2);
    let error = arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    let DeviceError::Refused { what, help } = &error else { panic!("{error:?}") };
    assert!(what.contains("the connection to the arm is gone"), "{what}");
    assert!(help.contains("connects again"), "{help}");
    let again = arm.feedback().unwrap();
    assert!(again.q[0] < end[0] - 0.2, "it was not stopped");
    Wall.sleep(0.5);
    let later = arm.feedback().unwrap();
    assert!(largest(&later.q, &again.q) < 0.2, "it still moves");
    assert!(emulator.status().opened >= 2);
}

#[test]
fn a_session_the_arm_has_forgotten_ends_the_motion_and_is_opened_anew_by_the_next_question() {
    let faults = "forget=1500ms".parse().unwrap();
    let emulator = emulator(&Options { faults, pace: Pace::Real, ..Options::default() });
    let mut arm = connect(&emulator);
    let (cleared, end) = turned(&HOME, 1.6, 0.2);
    let error = arm.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("session"), "{text}");
    let again = arm.feedback().unwrap();
    assert!(again.q[0] < end[0] - 0.2, "it was not stopped");
    assert!(emulator.status().opened >= 2);
}

#[test]
fn an_arm_that_someone_else_moves_is_not_taken_over() {
    let emulator = emulator(&Options::default());
    let other = super::link(&emulator);
    let spin = JointSpeed { joint_identifier: 0, value: 5.0, duration: 0 };
    let spin = JointSpeeds { joint_speeds: vec![spin], duration: 0 };
    let () = other.call(base::SEND_JOINT_SPEEDS_COMMAND, &spin).unwrap();
    let error = KortexArm::connect(client(&emulator)).unwrap_err();
    let DeviceError::Refused { what, help } = &error else { panic!("{error:?}") };
    assert!(what.contains("someone else moves the arm now: TCP 127.0.0.1"), "{what}");
    assert!(help.contains("trueup kortex stop"), "{help}");
    let () = other.call(base::STOP, &()).unwrap();
    Wall.sleep(0.5);
    KortexArm::connect(client(&emulator)).unwrap();
}

#[test]
fn a_second_client_is_told_that_someone_else_commands() {
    let emulator = emulator(&eager());
    let (mut first, mut second) = (connect(&emulator), connect(&emulator));
    assert_eq!(second.about().connected.len(), 2);
    let (cleared, _) = turned(&HOME, 0.2, 1.0);
    first.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap();
    let from = second.feedback().unwrap().q;
    let (cleared, _) = turned(&from, 0.2, 1.0);
    let error = second.follow(&cleared, &Cancel::default(), &mut nobody()).unwrap_err();
    assert!(error.to_string().contains("someone else commands the arm"), "{error}");
}

#[test]
fn nobody_there_is_told_and_a_password_is_never_printed() {
    let emulator = emulator(&eager());
    let mut options = client(&emulator);
    drop(emulator);
    options.timeout = Duration::from_secs(1);
    let error = KortexArm::connect(options).unwrap_err();
    let DeviceError::Refused { what, help } = &error else { panic!("{error:?}") };
    assert!(what.contains("no arm answers at 127.0.0.1:"), "{what}");
    assert!(help.contains("192.168.1.10"), "{help}");
    let login = Login { user: "admin".into(), password: "secret".into() };
    assert!(!format!("{login:?}").contains("secret"));
}
