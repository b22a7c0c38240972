//! Joints told speeds and torques in low-level servoing move as their law says.

use std::time::Duration;

use trueup::emulator::Emulator;
use trueup::kortex::link::{Datagrams, Link, LinkError};
use trueup::kortex::messages::base::{ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::config::{ActuatorMode, ActuatorModeInformation};
use trueup::kortex::messages::cyclic::{ActuatorCommand, Command, Feedback};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{actuator_config, base, base_cyclic};
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::robot::Robot;

use super::{admin, eager, emulator, link};
use crate::kitchen::HOME;

const SOON: Duration = Duration::from_secs(2);

/// An arm whose joint (from 0) is in a mode, and its stream.
struct Driven {
    emulator: Emulator,
    link: Link,
    cyclic: Datagrams,
    command: Command,
    joint: usize,
    mode: ActuatorMode,
}

impl Driven {
    fn new(joint: usize, mode: ActuatorMode) -> Self {
        let emulator = emulator(&eager());
        let link = link(&emulator);
        let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
        let told: Feedback = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), SOON).unwrap();
        let actuators = told.actuators.iter().map(|actuator| ActuatorCommand {
            flags: 1,
            position: actuator.position,
            ..ActuatorCommand::default()
        });
        let command = Command { frame_id: 0, actuators: actuators.collect(), interconnect: None };
        let mut driven = Self { emulator, link, cyclic, command, joint, mode };
        driven.engage();
        driven
    }

    /// Enters low-level servoing and sets the joint's mode.
    fn engage(&mut self) {
        let low = ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 };
        let () = self.link.call(base::SET_SERVOING_MODE, &low).unwrap();
        let asked = ActuatorModeInformation { control_mode: self.mode as i32 };
        let device = self.joint as u8 + 1;
        let () = self.link.call_device(actuator_config::SET_CONTROL_MODE, device, &asked).unwrap();
    }

    /// Sends one cycle and lets a hundredth of a second pass; returns the joint's position, deg, and speed,
    /// deg/s.
    fn cycle(&mut self, velocity: f32, torque_joint: f32) -> (f32, f32) {
        self.command.frame_id += 1;
        let one = &mut self.command.actuators[self.joint];
        (one.velocity, one.torque_joint) = (velocity, torque_joint);
        let told = loop {
            match self.cyclic.call::<Feedback>(base_cyclic::REFRESH, &self.command, SOON) {
                Ok(told) => break told,
                // A machine that pauses for a tenth of a second is told so, as by an arm.
                Err(LinkError::Refused(no)) => {
                    assert_eq!(no.sub_code, refusal::WRONG_SERVOING_MODE);
                    self.engage();
                }
                Err(other) => panic!("{other}"),
            }
        };
        self.emulator.clock().sleep(0.01);
        let now = &told.actuators[self.joint];
        self.command.actuators[self.joint].position = now.position;
        (now.position, now.velocity)
    }
}

#[test]
fn a_joint_told_a_speed_keeps_it_and_the_others_hold() {
    let mut arm = Driven::new(6, ActuatorMode::Velocity);
    let mut last = (0.0, 0.0);
    for _ in 0..60 {
        last = arm.cycle(10.0, 0.0);
    }
    assert!((last.1 - 10.0).abs() < 0.1, "{last:?}");
    assert!(last.0 > 92.0, "{last:?}");
}

#[test]
fn a_torque_about_a_vertical_axis_ends_in_the_speed_friction_allows() {
    // Joint 1 carries no weight: torque against 1 N·m·s/rad of friction.
    let mut arm = Driven::new(0, ActuatorMode::Torque);
    let mut speed = 0.0;
    for _ in 0..600 {
        speed = arm.cycle(0.0, 0.2).1;
    }
    assert!((speed.to_radians() - 0.2).abs() < 0.01, "{} rad/s", speed.to_radians());
}

#[test]
fn a_joint_falls_without_torque_and_is_held_by_its_weight_s_torque() {
    let robot = Robot::gen3();
    let weight = Dynamics::new(&robot, Bodies::All).gravity_torques(&HOME).unwrap()[1];
    let mut held = Driven::new(1, ActuatorMode::Torque);
    let mut falling = Driven::new(1, ActuatorMode::Torque);
    let (mut at, mut fell) = (0.0, 0.0);
    for _ in 0..30 {
        at = held.cycle(0.0, weight as f32).0;
        fell = falling.cycle(0.0, 0.0).0;
    }
    assert!((at - 15.0).abs() < 0.5, "held at {at} deg");
    let way = f64::from(fell - 15.0) * -weight.signum();
    assert!(way > 1.0, "fell {way} deg the way its weight of {weight} N·m pulls");
}
