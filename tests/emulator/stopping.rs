//! Stops that are believed when the arm rests, and streams that end there.

use std::sync::Arc;
use std::time::Duration;

use trueup::arm::ticked::Plant;
use trueup::arm::{Arm, Cancel, DeviceError, Feedback};
use trueup::emulator::{Emulator, Options};
use trueup::kortex::arm::{KortexArm, Options as Client};
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::link::{Datagrams, LinkError};
use trueup::kortex::messages::base::{ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::cyclic::{ActuatorCommand, Command, Feedback as Told};
use trueup::kortex::messages::motion::{JointSpeed, JointSpeeds};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{base, base_cyclic};
use trueup::kortex::stream::Cyclic;
use trueup::kortex::supervisor::{Stopped, Supervisor};
use trueup::motion::robot::Robot;

use super::arm::{client, largest, turned};
use super::soak::streaming;
use super::{admin, emulator, link};
use crate::kitchen::HOME;

fn scratch(emulator: &Emulator) -> Supervisor {
    Supervisor::open("127.0.0.1", emulator.tcp().port(), &admin(), Duration::from_secs(10)).unwrap()
}

fn spin() -> JointSpeeds {
    let speed = JointSpeed { joint_identifier: 0, value: 5.0, duration: 0 };
    JointSpeeds { joint_speeds: vec![speed], duration: 0 }
}

#[test]
fn a_stop_ends_a_stream_that_would_go_on_and_the_stream_does_not_come_back() {
    let emulator = emulator(&Options::default());
    let mut arm = streaming(&emulator);
    let scratch = scratch(&emulator);
    let (cleared, end) = turned(&HOME, 1.6, 0.1);
    let mut stopped = None;
    std::thread::scope(|scope| {
        let (moving, moves) = std::sync::mpsc::channel();
        let stopping = scope.spawn(move || {
            moves.recv().unwrap();
            scratch.stop(2.0).unwrap()
        });
        let followed = arm.follow(&cleared, &Cancel::default(), &mut |tick: &Feedback| {
            if tick.q[0] > 0.05 {
                let _ = moving.send(());
            }
        });
        // A machine that was just then busy may ask the arm back once, and is stopped more loudly.
        let DeviceError::Refused { what, .. } = followed.unwrap_err() else { panic!("no reason") };
        let loudly = what.contains("emergency stop") || what.contains("fault");
        assert!(loudly || what.contains("someone else stopped the arm"), "{what}");
        stopped = Some(stopping.join().unwrap());
    });
    assert!(stopped.is_some());
    let rest = arm.feedback().unwrap();
    assert!(rest.q[0] < end[0] - 0.5, "it went on to {}", rest.q[0]);
    Wall.sleep(0.3);
    assert!(largest(&arm.feedback().unwrap().q, &rest.q) < 1e-6, "it moves again");
    let told: ServoingModeInformation = link(&emulator).call(base::GET_SERVOING_MODE, &()).unwrap();
    assert_eq!(told.servoing_mode(), ServoingMode::SingleLevel);
}

#[test]
fn a_vendors_stream_is_refused_after_a_stop() {
    let emulator = emulator(&Options::default());
    let link = link(&emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let soon = Duration::from_secs(5);
    let told: Told = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon).unwrap();
    let low = ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 };
    let () = link.call(base::SET_SERVOING_MODE, &low).unwrap();
    let actuators = told.actuators.iter().map(|actuator| ActuatorCommand {
        position: actuator.position,
        ..ActuatorCommand::default()
    });
    let command = Command { frame_id: 1, actuators: actuators.collect(), interconnect: None };
    let _: Told = cyclic.call(base_cyclic::REFRESH, &command, soon).unwrap();
    let () = link.call(base::STOP, &()).unwrap();
    let refused = cyclic.call::<Told>(base_cyclic::REFRESH, &command, soon).unwrap_err();
    assert!(refused.is_refusal(refusal::WRONG_SERVOING_MODE), "{refused}");
}

#[test]
fn an_arm_that_does_not_obey_a_stop_is_stopped_by_its_emergency_stop() {
    let faults = "deaf=0s".parse().unwrap();
    let emulator = emulator(&Options { faults, ..Options::default() });
    let other = link(&emulator);
    let () = other.call(base::SEND_JOINT_SPEEDS_COMMAND, &spin()).unwrap();
    Wall.sleep(0.1);
    assert_eq!(scratch(&emulator).stop(0.1).unwrap(), Stopped::Emergency);
    let refused = other.call::<()>(base::SEND_JOINT_SPEEDS_COMMAND, &spin()).unwrap_err();
    assert!(refused.is_refusal(refusal::ROBOT_IN_EMERGENCY_STOP), "{refused}");
}

/// An arm whose first joint turns whatever it is told.
struct Runaway(f64);

impl Plant for Runaway {
    fn command(&mut self, _q: &[f64], _dq: &[f64]) -> Result<(), DeviceError> {
        Ok(())
    }

    fn aim(&mut self, _opening: f64, _speed: f64, _force: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn advance(&mut self, seconds: f64) -> Result<(), DeviceError> {
        self.0 += 0.3 * seconds;
        Ok(())
    }

    fn report(&mut self) -> Feedback {
        let mut q = HOME.to_vec();
        q[0] += self.0;
        let n = q.len();
        let mut dq = vec![0.0; n];
        dq[0] = 0.3;
        let (q_cmd, tau) = (Vec::new(), vec![0.0; n]);
        Feedback { time: 0.0, q_cmd, q, dq, tau, opening: 0.085, mass: None, moving: Vec::new() }
    }
}

#[test]
fn an_arm_that_still_moves_is_not_called_stopped() {
    let robot = Arc::new(Robot::gen3());
    let emulator = Emulator::start(robot, Box::new(Runaway(0.0)), &Options::default()).unwrap();
    let error = scratch(&emulator).stop(0.0).unwrap_err();
    assert!(error.to_string().contains("the arm still moves"), "{error}");
    assert!(error.help().contains("press the emergency stop button"), "{}", error.help());
}

#[test]
fn what_streams_is_measured_by_holding_the_arm_where_it_is() {
    let emulator = emulator(&Options::default());
    let udp = emulator.udp().port();
    let held = scratch(&emulator).hold("127.0.0.1", udp, &admin(), 1.0, &Cancel::default());
    let beat = held.unwrap();
    assert!(beat.sent > 10 && beat.answered > 0, "{beat:?}");
    // A second and the rest at its end, or longer where the machine is busy.
    assert!(beat.sent as f64 * beat.intervals.mean() > 1.0, "{beat:?}");
    let (taken, _, starved) = emulator.status().streamed;
    assert!(taken > 10 && taken <= beat.sent && starved == 0, "{taken} taken of {beat:?}");
}

#[test]
fn a_stream_that_was_left_alone_too_long_is_not_taken_up_again() {
    // The arm leaves low-level servoing at once, and the client may not ask it back after so long.
    let faults = "stall=700ms@1500ms".parse().unwrap();
    let emulator = emulator(&Options { patience: 0.1, faults, ..Options::default() });
    let stream = Some(Cyclic::at(emulator.udp().port()));
    let mut arm = KortexArm::connect(Client { stream, ..client(&emulator) }).unwrap();
    let (cleared, end) = turned(&HOME, 1.6, 0.1);
    let error = arm.follow(&cleared, &Cancel::default(), &mut |_| {}).unwrap_err();
    let what = error.to_string();
    // Which of the two was silent too long depends on the machine.
    assert!(
        what.contains("nothing was heard of the arm")
            || what.contains("stood for")
            || what.contains("this computer sent nothing"),
        "{what}"
    );
    assert!(arm.feedback().unwrap().q[0] < end[0] - 0.5);
}

#[test]
fn requests_lost_in_mid_motion_are_told_after_a_few_and_not_after_every_time_out() {
    // Nothing is answered any more, from the middle of a motion on.
    let faults = "stall=3600s@3s".parse().unwrap();
    let emulator = emulator(&Options { faults, ..Options::default() });
    let options = Client {
        patience: Duration::from_millis(600),
        // Every answer at rest may take so long; if every call did, it would be told after minutes.
        timeout: Duration::from_secs(30),
        clock: Arc::new(Wall),
        ..client(&emulator)
    };
    let mut arm = KortexArm::connect(options).unwrap();
    let (cleared, _) = turned(&HOME, 1.6, 0.1);
    let error = arm.follow(&cleared, &Cancel::default(), &mut |_| {}).unwrap_err();
    let DeviceError::Refused { what, help } = &error else { panic!("{error:?}") };
    assert!(what.contains("nothing was heard of the arm for 0.6 s while it moved"), "{what}");
    assert!(help.contains("check the cable"), "{help}");
    // And whoever stops it now is not held up either.
    arm.stop();
}

#[test]
fn a_stall_is_told_as_a_stall_and_not_as_a_stop_by_someone() {
    // The arm stops by itself after 2 s without its commander; the client was told to wait longer than that.
    let faults = "stall=3s@1500ms".parse().unwrap();
    let emulator = emulator(&Options { faults, ..Options::default() });
    let clock = Arc::new(Wall);
    let mut arm = KortexArm::connect(Client { clock, ..client(&emulator) }).unwrap();
    let (cleared, _) = turned(&HOME, 1.6, 0.1);
    let error = arm.follow(&cleared, &Cancel::default(), &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("nothing was heard of the arm for"), "{error}");
}

#[test]
fn a_gripper_that_reports_nothing_is_told_and_has_no_opening_of_inf_mm() {
    let faults = "gripper=0s".parse().unwrap();
    let gone = emulator(&Options { faults, ..Options::default() });
    let connected = KortexArm::connect(client(&gone));
    let DeviceError::Refused { what, help } = connected.unwrap_err() else { panic!("no reason") };
    assert_eq!(what, "the gripper does not report its opening");
    assert!(help.contains("plug"), "{help}");
    // On the way it ends the motion, and the arm is stopped.
    let faults = "gripper=3s".parse().unwrap();
    let leaving = emulator(&Options { faults, ..Options::default() });
    let mut arm = KortexArm::connect(client(&leaving)).unwrap();
    let (cleared, end) = turned(&HOME, 1.6, 0.1);
    let error = arm.follow(&cleared, &Cancel::default(), &mut |tick| {
        assert!(tick.opening.is_finite());
    });
    assert!(error.unwrap_err().to_string().contains("does not report its opening"));
    let told: Told = link(&leaving).call(base_cyclic::REFRESH_FEEDBACK, &()).unwrap();
    assert!(f64::from(told.actuators[0].position).to_radians() < end[0] - 0.5);
    assert!(matches!(arm.feedback(), Err(DeviceError::Refused { .. })));
}

#[test]
fn a_link_error_of_the_gripper_says_what_would_help() {
    assert!(LinkError::NoGripper.help().contains("restart the arm"));
}
