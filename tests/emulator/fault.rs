//! What an emulated arm does in fault, and how it is got out of it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use trueup::arm::ticked::Plant;
use trueup::arm::{DeviceError, Feedback};
use trueup::emulator::{Emulator, Options};
use trueup::kortex::degrees;
use trueup::kortex::link::{Datagrams, Link};
use trueup::kortex::messages::base::{ArmStateInformation, ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::common::ArmState;
use trueup::kortex::messages::cyclic::{ActuatorCommand, Command, Feedback as Told};
use trueup::kortex::messages::motion::{JointSpeed, JointSpeeds};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{base, base_cyclic};
use trueup::motion::robot::Robot;

use super::{admin, eager, emulator, link};
use crate::kitchen::HOME;

const SOON: Duration = Duration::from_secs(5);

fn mode(mode: ServoingMode) -> ServoingModeInformation {
    ServoingModeInformation { servoing_mode: mode as i32 }
}

fn state(link: &Link) -> ArmState {
    let told: ArmStateInformation = link.call(base::GET_ARM_STATE, &()).unwrap();
    told.active_state()
}

fn told(link: &Link) -> Told {
    link.call(base_cyclic::REFRESH_FEEDBACK, &()).unwrap()
}

/// A cycle that holds the arm where it is told to be but for joint 1, which is sent `turn` deg further.
fn cycle(from: &Told, frame_id: u32, turn: f32) -> Command {
    let actuators = from.actuators.iter().enumerate().map(|(i, actuator)| ActuatorCommand {
        command_id: frame_id,
        position: actuator.position + if i == 0 { turn } else { 0.0 },
        ..ActuatorCommand::default()
    });
    Command { frame_id, actuators: actuators.collect(), interconnect: None }
}

#[test]
fn a_step_of_40_deg_is_a_fault_and_the_joint_does_not_travel() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let () = link.call(base::SET_SERVOING_MODE, &mode(ServoingMode::LowLevel)).unwrap();
    let here: Told = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), SOON).unwrap();
    let _: Told = cyclic.call(base_cyclic::REFRESH, &cycle(&here, 1, 0.0), SOON).unwrap();
    let _: Told = cyclic.call(base_cyclic::REFRESH, &cycle(&here, 2, 40.0), SOON).unwrap();
    emulator.clock().sleep(0.5);
    assert_eq!(state(&link), ArmState::InFault);
    let after = told(&link);
    assert!((after.actuators[0].position - here.actuators[0].position).abs() < 0.01, "{after:?}");
    assert_eq!(after.actuators[0].fault_bank_a, 1);
    // Clients set the mode before they clear the faults: that is answered, streaming is not.
    let () = link.call(base::SET_SERVOING_MODE, &mode(ServoingMode::SingleLevel)).unwrap();
    let low = link.call::<()>(base::SET_SERVOING_MODE, &mode(ServoingMode::LowLevel)).unwrap_err();
    assert!(low.is_refusal(refusal::ROBOT_IN_FAULT), "{low}");
    let () = link.call(base::CLEAR_FAULTS, &()).unwrap();
    emulator.clock().sleep(0.1);
    assert_eq!(state(&link), ArmState::ServoingReady);
    assert!((told(&link).actuators[0].position - here.actuators[0].position).abs() < 0.01);
}

/// A joint was followed far beyond its range, without a word.
#[test]
fn a_stream_beyond_a_joint_s_range_is_a_fault_that_names_the_joint() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let () = link.call(base::SET_SERVOING_MODE, &mode(ServoingMode::LowLevel)).unwrap();
    let here: Told = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), SOON).unwrap();
    // Joint 2 is at 15 deg, and its range ends at 128.3 deg.
    for frame_id in 1..60 {
        let mut command = cycle(&here, frame_id, 0.0);
        command.actuators[1].position += 3.0 * frame_id as f32;
        if cyclic.call::<Told>(base_cyclic::REFRESH, &command, SOON).is_err() {
            break;
        }
        emulator.clock().sleep(0.06);
    }
    assert_eq!(state(&link), ArmState::InFault);
    let after = told(&link);
    assert_eq!(after.base.unwrap().fault_bank_a, 16);
    let banks: Vec<u32> = after.actuators.iter().map(|joint| joint.fault_bank_a).collect();
    assert_eq!(banks, [0, 4, 0, 0, 0, 0, 0]);
    assert!((120.0..128.5).contains(&after.actuators[1].position), "{:?}", after.actuators[1]);
}

/// An arm whose first joint meets something at an angle, rad, and is where it is sent otherwise.
struct Pressed {
    q: Vec<f64>,
    table: f64,
    /// The most it was ever sent to, rad.
    sent: Arc<Mutex<f64>>,
}

impl Plant for Pressed {
    fn command(&mut self, q: &[f64], _dq: &[f64]) -> Result<(), DeviceError> {
        self.q = q.to_vec();
        let mut sent = self.sent.lock().unwrap();
        *sent = sent.max(q[0]);
        Ok(())
    }

    fn aim(&mut self, _opening: f64, _speed: f64, _force: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn advance(&mut self, _seconds: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn report(&mut self) -> Feedback {
        let mut q = self.q.clone();
        q[0] = q[0].min(self.table);
        let n = q.len();
        let (q_cmd, dq, tau) = (Vec::new(), vec![0.0; n], vec![0.0; n]);
        Feedback { time: 0.0, q_cmd, q, dq, tau, opening: 0.085, mass: None, moving: Vec::new() }
    }
}

#[test]
fn an_arm_pressed_on_the_table_warns_at_3_deg_faults_at_5_and_can_be_driven_away() {
    let sent = Arc::new(Mutex::new(0.0));
    let plant = Pressed { q: HOME.to_vec(), table: 0.02, sent: sent.clone() };
    let robot = Arc::new(Robot::gen3());
    let emulator = Emulator::start(robot, Box::new(plant), &Options::default()).unwrap();
    let clock = emulator.clock();
    let link = link(&emulator);
    let go = |value: f32| {
        let speed = JointSpeed { joint_identifier: 0, value, duration: 0 };
        link.call::<()>(
            base::SEND_JOINT_SPEEDS_COMMAND,
            &JointSpeeds { joint_speeds: vec![speed], duration: 0 },
        )
    };
    go(4.0).unwrap();
    let mut warned = false;
    while state(&link) != ArmState::InFault {
        warned |= told(&link).actuators[0].warning_bank_a == 1;
        clock.sleep(0.005);
        assert!(clock.now() < 60.0, "it never faulted");
    }
    let deepest = *sent.lock().unwrap();
    assert!(deepest < 0.02 + 5.1_f64.to_radians(), "it was sent to {deepest} rad");
    // Half a second of the arm's time lies between the two.
    assert!(warned, "it faulted without a warning");
    assert!((f64::from(told(&link).actuators[0].position).to_radians() - 0.02).abs() < 1e-3);
    let () = link.call(base::CLEAR_FAULTS, &()).unwrap();
    clock.sleep(0.2);
    assert_eq!(state(&link), ArmState::ServoingReady, "it is in fault again at once");
    assert_eq!(told(&link).actuators[0].warning_bank_a, 0);
    go(-5.0).unwrap();
    clock.sleep(0.5);
    let () = link.call(base::STOP, &()).unwrap();
    let away = degrees::from_wire(told(&link).actuators[0].position, 0.0);
    assert!(away < 0.01, "{away} rad");
}

#[test]
fn a_connection_that_never_logs_in_is_closed_and_may_not_send_for_long() {
    let emulator = emulator(&Options { login: 0.2, ..eager() });
    let known = link(&emulator);
    let mut silent = TcpStream::connect(emulator.tcp()).unwrap();
    silent.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    assert_eq!(silent.read(&mut [0; 16]).unwrap_or(0), 0);
    // One that has logged in may be silent: its keep-alive goes on.
    assert_eq!(state(&known), ArmState::ServoingReady);
}

#[test]
fn a_stranger_may_send_64_kb_and_no_more() {
    let emulator = emulator(&Options { login: 3600.0, ..eager() });
    let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
    stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    // A frame of 1 MB is announced, and begun.
    let mut begin = trueup::kortex::frame::MAGIC.to_vec();
    begin.extend_from_slice(&(1_u32 << 20).to_be_bytes());
    stream.write_all(&begin).unwrap();
    let mut sent = 0;
    while stream.write_all(&[0; 4096]).is_ok() && sent < 1 << 20 {
        sent += 4096;
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(sent < 1 << 20, "all of it was taken");
}
