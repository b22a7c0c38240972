//! One contract for every `Arm`: the twin's and the lab's are met through the trait and must do the same.

use std::sync::{Arc, Mutex};

use nalgebra::Vector3;
use trueup::arm::limits::{Cleared, ClearedGrip};
use trueup::arm::{Arm, Cancel, DeviceError, Feedback, Grip};
use trueup::execution::body::Body;
use trueup::execution::cell::Cell;
use trueup::execution::lab_arm;
use trueup::execution::plan::side_pose;
use trueup::execution::twin_arm::TwinBody;
use trueup::lab::{Lab, LabSettings, Spot};
use trueup::motion::ik::Solver;
use trueup::motion::trajectory::{Limits, Trajectory};

use crate::kitchen::HOME;

use super::{cell, state, twin};

/// Where the jar stands and the fingers wait around it.
const JAR: [f64; 3] = [0.62, 0.0, 0.0];
/// The jar's width, m.
const WIDTH: f64 = 0.065;

/// Returns the joint positions with the level fingers around the jar, rad.
fn around_the_jar(cell: &Cell) -> Vec<f64> {
    let tool = side_pose(Vector3::new(JAR[0], JAR[1], 0.085), 0.0, 0.0);
    let base_from_tool = cell.scene.world_from_base.inverse() * tool;
    let tip = base_from_tool * cell.robot.flange_from_tool().inverse();
    Solver::new(&cell.robot).nearest(&tip, &HOME).unwrap()
}

/// Every arm there is, waiting at `q` with the jar at `JAR`.
fn arms(cell: &Cell, q: &[f64]) -> Vec<(&'static str, Box<dyn Arm>)> {
    let world = twin(&cell.scene, &state(q, JAR));
    let lab = |mut settings: LabSettings| -> Box<dyn Arm> {
        let spot = |[x_m, y_m, yaw_rad]: [f64; 3]| Spot { x_m, y_m, yaw_rad };
        settings.placement.fixed.insert("jar".into(), spot(JAR));
        settings.placement.fixed.insert("cup".into(), spot([0.45, 0.33, 0.0]));
        settings.start.q_rad = q.to_vec();
        let lab = Lab::new(&cell.robot, &cell.scene, settings, 3).unwrap();
        Box::new(lab_arm::connect(Arc::new(Mutex::new(lab)), &cell.robot))
    };
    // Where the tool really is when the joints say so is regression 3's affair, not the contract's.
    let mut straight = LabSettings::default();
    (straight.switches.zero_offsets, straight.switches.tool_offset) = (false, false);
    vec![
        ("twin", Box::new(OfBody(TwinBody::new(world)))),
        ("perfect lab", lab(LabSettings::perfect())),
        ("lab", lab(straight)),
    ]
}

/// The arm of a body, as the action context borrows it.
struct OfBody<B: Body>(B);

impl<B: Body> Arm for OfBody<B> {
    fn feedback(&mut self) -> Result<Feedback, DeviceError> {
        self.0.arm().feedback()
    }

    fn follow(
        &mut self,
        trajectory: &Cleared,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.0.arm().follow(trajectory, cancel, watch)
    }

    fn grip(
        &mut self,
        grip: &ClearedGrip,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<Grip, DeviceError> {
        self.0.arm().grip(grip, cancel, watch)
    }

    fn wait(
        &mut self,
        seconds: f64,
        cancel: &Cancel,
        watch: &mut dyn FnMut(&Feedback),
    ) -> Result<(), DeviceError> {
        self.0.arm().wait(seconds, cancel, watch)
    }

    fn send_fingers(&mut self, grip: &ClearedGrip, after: f64) -> Result<(), DeviceError> {
        self.0.arm().send_fingers(grip, after)
    }

    fn stop(&mut self) {
        self.0.arm().stop();
    }
}

/// A motion from `q` with joint 1 turned by `turn` rad, timed at the robot's own limits and cleared.
fn turned(cell: &Cell, q: &[f64], turn: f64) -> (Cleared, Vec<f64>) {
    let mut end = q.to_vec();
    end[0] += turn;
    let path = [q.to_vec(), end.clone()];
    let timed = Trajectory::through_points(&path, &Limits::of(&cell.robot)).unwrap();
    (cell.clear(timed, q).unwrap(), end)
}

/// The fingers sent to `opening` m, gently.
fn fingers(cell: &Cell, opening: f64) -> ClearedGrip {
    cell.clear_grip(opening, 0.06, 30.0).unwrap()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Friction, give and a late command leave less than this between command and reading at rest, rad.
const SETTLED: f64 = 0.006;

#[test]
fn following_ends_where_asked_and_tells_every_tick() {
    let cell = cell();
    for (name, mut arm) in arms(&cell, &HOME) {
        let first = arm.feedback().unwrap();
        for (what, values) in
            [("q", &first.q), ("dq", &first.dq), ("tau", &first.tau), ("q_cmd", &first.q_cmd)]
        {
            assert_eq!(values.len(), 7, "{name}: {what}");
            assert!(values.iter().all(|value| value.is_finite()), "{name}: {what}");
        }
        assert!((first.opening - 0.085).abs() < 2e-3, "{name}: {}", first.opening);
        assert!(largest(&first.q, &HOME) < SETTLED, "{name}");

        let (cleared, end) = turned(&cell, &HOME, 0.5);
        let duration = cleared.trajectory().duration();
        let mut ticks: Vec<Feedback> = Vec::new();
        arm.follow(&cleared, &Cancel::default(), &mut |tick| ticks.push(tick.clone())).unwrap();
        let last = arm.feedback().unwrap();
        assert!(largest(&last.q, &end) < SETTLED, "{name}: {:?}", last.q);
        assert!(largest(&last.q_cmd, &end) < 1e-9, "{name}");
        assert!(last.dq.iter().all(|dq| dq.abs() < 0.02), "{name}: {:?}", last.dq);
        assert!(last.time - first.time >= duration, "{name}");
        assert!(ticks.len() as f64 >= 100.0 * duration, "{name}: {} ticks", ticks.len());
        assert!(ticks.windows(2).all(|pair| pair[1].time > pair[0].time), "{name}");
        assert_eq!(ticks.last().unwrap().q_cmd, last.q_cmd, "{name}");
        // It goes along the trajectory, not merely to its end.
        let middle = &ticks[ticks.len() / 2];
        let way = middle.q[0] - HOME[0];
        assert!((0.05..0.48).contains(&way), "{name}: {way} rad halfway");
        assert!(ticks.iter().all(|tick| largest(&tick.q, &tick.q_cmd) < 0.08), "{name}");
    }
}

#[test]
fn waiting_lets_time_pass_and_nothing_else() {
    let cell = cell();
    for (name, mut arm) in arms(&cell, &HOME) {
        arm.wait(0.3, &Cancel::default(), &mut |_| {}).unwrap();
        let before = arm.feedback().unwrap();
        let mut ticks = 0;
        arm.wait(0.5, &Cancel::default(), &mut |_| ticks += 1).unwrap();
        let after = arm.feedback().unwrap();
        assert!(
            (after.time - before.time - 0.5).abs() < 0.01,
            "{name}: {}",
            after.time - before.time
        );
        assert!(ticks >= 50, "{name}: {ticks}");
        assert_eq!(after.q_cmd, before.q_cmd, "{name}");
        assert!(largest(&after.q, &before.q) < 1e-3, "{name}");
    }
}

#[test]
fn fingers_go_where_they_are_sent_unless_something_is_between_them() {
    let cell = cell();
    let never = Cancel::default();
    for (name, mut arm) in arms(&cell, &HOME) {
        let grip = arm.grip(&fingers(&cell, 0.02), &never, &mut |_| {}).unwrap();
        assert!(!grip.stalled && (grip.opening - 0.02).abs() < 2e-3, "{name}: {grip:?}");
        let grip = arm.grip(&fingers(&cell, 0.08), &never, &mut |_| {}).unwrap();
        assert!(!grip.stalled && (grip.opening - 0.08).abs() < 2e-3, "{name}: {grip:?}");
    }
    let q = around_the_jar(&cell);
    for (name, mut arm) in arms(&cell, &q) {
        let grip = arm.grip(&fingers(&cell, 0.0), &never, &mut |_| {}).unwrap();
        assert!(grip.stalled && (grip.opening - WIDTH).abs() < 4e-3, "{name}: {grip:?}");
        let shown = arm.feedback().unwrap().opening;
        assert!((shown - grip.opening).abs() < 2e-3, "{name}: {shown}");
        let grip = arm.grip(&fingers(&cell, 0.085), &never, &mut |_| {}).unwrap();
        assert!(!grip.stalled && grip.opening > 0.08, "{name}: {grip:?}");
    }
}

/// A wish to stop in the middle of a motion: slowed down within the limits, at rest, held; never back.
#[test]
fn a_stop_brings_the_arm_to_rest_and_holds_it() {
    let cell = cell();
    let limits = Limits::of(&cell.robot);
    for (name, mut arm) in arms(&cell, &HOME) {
        let (cleared, end) = turned(&cell, &HOME, 1.6);
        let cancel = Cancel::default();
        let mut ticks: Vec<Feedback> = Vec::new();
        let halfway = cleared.trajectory().duration() / 2.0;
        let begin = arm.feedback().unwrap().time;
        let stopped = arm.follow(&cleared, &cancel, &mut |tick| {
            if tick.time - begin > halfway {
                cancel.cancel();
            }
            ticks.push(tick.clone());
        });
        assert_eq!(stopped, Err(DeviceError::Stopped), "{name}");
        let rest = arm.feedback().unwrap();
        let called = ticks.iter().find(|tick| tick.time - begin > halfway).unwrap();
        assert!(called.dq[0] > 0.5, "{name}: it was moving at {} rad/s", called.dq[0]);
        assert!(rest.dq.iter().all(|dq| dq.abs() < 0.03), "{name}: {:?}", rest.dq);
        let ran_on = rest.q[0] - called.q[0];
        // v²/2a at the limits is the least there can be; the servo's lag and latency add a little.
        let least = called.dq[0].powi(2) / (2.0 * limits.acceleration[0]);
        assert!(
            (0.8 * least..least + 0.12).contains(&ran_on),
            "{name}: {ran_on} rad, least {least}"
        );
        assert!(rest.q[0] < end[0] - 0.1, "{name}");
        let furthest = ticks.iter().map(|tick| tick.q[0]).fold(f64::NEG_INFINITY, f64::max);
        assert!(furthest - rest.q[0] < 3e-3, "{name}: it swung back by {}", furthest - rest.q[0]);
        for pair in ticks.windows(2) {
            let jump = largest(&pair[0].q_cmd, &pair[1].q_cmd);
            assert!(
                jump < 1.1 * limits.velocity[0] * 0.004,
                "{name}: the command jumped {jump} rad"
            );
        }
        assert_eq!(rest.q_cmd, ticks.last().unwrap().q_cmd, "{name}");

        // It holds, and it can be sent on from there once the wish is forgotten.
        assert_eq!(arm.wait(0.1, &cancel, &mut |_| {}), Err(DeviceError::Stopped), "{name}");
        cancel.clear();
        arm.wait(0.5, &cancel, &mut |_| {}).unwrap();
        let held = arm.feedback().unwrap();
        assert!(largest(&held.q, &rest.q) < SETTLED, "{name}");
        let (on, end) = turned(&cell, &held.q_cmd, -0.2);
        arm.follow(&on, &cancel, &mut |_| {}).unwrap();
        assert!(largest(&arm.feedback().unwrap().q, &end) < SETTLED, "{name}");
    }
}

#[test]
fn asked_to_stop_beforehand_nothing_moves() {
    let cell = cell();
    let cancel = Cancel::default();
    cancel.cancel();
    for (name, mut arm) in arms(&cell, &HOME) {
        let before = arm.feedback().unwrap();
        let (cleared, _) = turned(&cell, &HOME, 0.5);
        let mut nobody = |_: &Feedback| {};
        assert_eq!(arm.follow(&cleared, &cancel, &mut nobody), Err(DeviceError::Stopped), "{name}");
        assert_eq!(arm.wait(1.0, &cancel, &mut nobody), Err(DeviceError::Stopped), "{name}");
        arm.stop();
        let after = arm.feedback().unwrap();
        assert!(largest(&after.q, &before.q) < 1e-3, "{name}");
        assert!(largest(&after.q_cmd, &before.q_cmd) < 1e-12, "{name}");
        assert!(after.time - before.time < 1.5, "{name}");
    }
}

/// The twin steps the same whether its arm is held directly or through a body.
#[test]
fn a_body_lends_the_very_arm_of_its_twin() {
    let cell = cell();
    let shared = twin(&cell.scene, &state(&HOME, JAR));
    let mut body = TwinBody::new(shared.clone());
    body.arm().wait(0.1, &Cancel::default(), &mut |_| {}).unwrap();
    let time = shared.lock().unwrap().time();
    assert!((time - 0.1).abs() < 0.005, "{time}");
    assert_eq!(body.state().unwrap().time.to_bits(), time.to_bits());
}

/// Where somebody took something nobody knows, in the twin either, until a look shows it standing.
#[test]
fn what_was_given_is_nowhere_in_the_twin_until_it_is_seen_standing() {
    let cell = cell();
    let mut body = TwinBody::new(twin(&cell.scene, &state(&HOME, JAR)));
    body.arm().wait(0.2, &Cancel::default(), &mut |_| {}).unwrap();
    let has_place = |body: &mut TwinBody| {
        let (now, feedback) = (body.state().unwrap(), body.arm().feedback().unwrap());
        let seen = body.sight().state(&feedback);
        [now, seen].map(|state| state.object("jar").unwrap().world_from_object.is_some())
    };
    assert_eq!(has_place(&mut body), [true; 2]);
    body.given("jar");
    assert_eq!(has_place(&mut body), [false; 2]);
    assert!(body.state().unwrap().object("cup").unwrap().world_from_object.is_some());
    body.look().unwrap();
    assert_eq!(has_place(&mut body), [true; 2], "nobody took it: it stands on the table");
}
