//! What the service says and does of `cyclic`; what it keeps is in [`super::super::cyclic`].

use super::super::call::{Answer, Ask, Fault, done, say};
use super::super::controller::Controller;
use super::super::cyclic::{
    EMERGENCY_STOP_ACTIVATED, FOLLOWING_ERROR, INITIALIZED, JOINT_FAULT, OBJECT_DETECTED,
    POS_REACHED, SERVOING, SILENT,
};
use super::super::drive::Drive;
use super::super::error::Refused;
use super::super::paths::wire_pose;
use super::super::servo::{FINGER_SPEED, TICK, WARNING};
use crate::kortex::degrees;
use crate::kortex::messages::base::ServoingMode;
use crate::kortex::messages::config::ActuatorMode;
use crate::kortex::messages::cyclic::{
    ActuatorCommand, ActuatorCustomData, ActuatorFeedback, BaseFeedback, Command, CustomData,
    Feedback, GripperCyclicFeedback, InterconnectFeedback, MotorCommand, MotorFeedback,
    ToolCommand, ToolFeedback,
};
use crate::kortex::rpc::base_cyclic as call;

impl Controller {
    pub(in crate::emulator) fn cyclic_service(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc {
            call::REFRESH_FEEDBACK => say(&self.feedback(0)),
            call::REFRESH_CUSTOM_DATA => {
                let asked: CustomData = ask.read()?;
                let frame_id = asked.frame_id;
                let each = ActuatorCustomData { command_id: frame_id };
                let actuators_custom_data = vec![each; self.robot.n_joints()];
                say(&CustomData { frame_id, actuators_custom_data })
            }
            call::REFRESH => {
                let command: Command = ask.read()?;
                self.refresh(&command, ask.now)?;
                say(&self.feedback(command.frame_id))
            }
            _ => {
                let command: Command = ask.read()?;
                self.refresh(&command, ask.now)?;
                done()
            }
        }
    }

    fn refresh(&mut self, command: &Command, now: f64) -> Result<(), Refused> {
        if self.mode != ServoingMode::LowLevel {
            return Err(Refused::NotLowLevel);
        }
        let n = self.robot.n_joints();
        if command.actuators.len() != n {
            return Err(Refused::CommandCount);
        }
        let numbers = |actuator: &ActuatorCommand| {
            [actuator.position, actuator.velocity, actuator.torque_joint]
                .iter()
                .all(|x| x.is_finite())
        };
        if !command.actuators.iter().all(numbers) {
            return Err(Refused::NotANumber);
        }
        if !self.stream.is_new(command.frame_id, self.servo.time) {
            return Ok(());
        }
        self.sessions.keep(now);
        let sent = command.actuators.iter().zip(&self.servo.q_cmd).enumerate();
        let drives =
            sent.map(|(joint, (actuator, &near))| match self.config.actuator_mode(joint) {
                ActuatorMode::Position => {
                    Drive::Position(degrees::from_wire(actuator.position, near))
                }
                ActuatorMode::Velocity => Drive::Speed(f64::from(actuator.velocity).to_radians()),
                ActuatorMode::Torque | ActuatorMode::TorqueHighVelocity => {
                    Drive::Torque(f64::from(actuator.torque_joint))
                }
                // What a current does depends on the motor, whose constants are not published.
                ActuatorMode::None | ActuatorMode::Current | ActuatorMode::Custom => {
                    Drive::Speed(0.0)
                }
            });
        let drives: Vec<Drive> = drives.collect();
        self.servo.stream(drives);
        let gripper = command.interconnect.as_ref().and_then(|all| all.tool_command.as_ref());
        if let Some(ToolCommand::GripperCommand(gripper)) = gripper
            && let Some(motor) = gripper.motor_cmd.first()
        {
            self.move_fingers(motor)?;
        }
        Ok(())
    }

    fn move_fingers(&mut self, motor: &MotorCommand) -> Result<(), Refused> {
        let speed = f64::from(motor.velocity.abs().min(100.0)) / 100.0 * FINGER_SPEED;
        if speed <= 0.0 {
            return self.servo.stop_fingers().map_err(Refused::Failed);
        }
        if !motor.position.is_finite() {
            return Ok(());
        }
        let share = f64::from(motor.position.clamp(0.0, 100.0)) / 100.0;
        let opening = (1.0 - share) * self.robot.max_opening();
        // Sent every cycle; only another goal or another speed is news.
        if self.servo.is_aimed_at(opening, speed) {
            return Ok(());
        }
        self.servo.aim(opening, speed).map_err(Refused::Failed)
    }

    /// Leaves low-level servoing when commands stopped coming, or stays in it with every joint held.
    pub(in crate::emulator) fn mind_silence(&mut self) {
        if self.mode != ServoingMode::LowLevel {
            return;
        }
        if self.servo.time > self.stream.until {
            self.stream.starved += 1;
            self.set_mode(ServoingMode::SingleLevel);
        } else if self.servo.time > self.stream.heard + SILENT {
            self.servo.hold_driven();
        }
    }

    /// Returns what the arm says of itself.
    pub(in crate::emulator) fn feedback(&self, frame_id: u32) -> Feedback {
        let report = &self.servo.report;
        let behind: Vec<f64> = self.servo.behind().collect();
        let actuators = (0..report.q.len()).map(|i| ActuatorFeedback {
            command_id: frame_id,
            status_flags: SERVOING,
            jitter_comm: (TICK * 1e6) as u32,
            position: degrees::to_wire(report.q[i]),
            velocity: report.dq[i].to_degrees() as f32,
            torque: -report.tau[i] as f32,
            voltage: 24.0,
            temperature_motor: 35.0,
            temperature_core: 40.0,
            fault_bank_a: match self.fault {
                Some(Fault::Following(joint)) if joint == i => FOLLOWING_ERROR,
                Some(Fault::Limit(joint, bit)) if joint == i => bit,
                _ => 0,
            },
            warning_bank_a: if behind[i] > WARNING { FOLLOWING_ERROR } else { 0 },
            ..ActuatorFeedback::default()
        });
        Feedback {
            frame_id,
            base: Some(self.base_feedback()),
            actuators: actuators.collect(),
            interconnect: (!self.chance.is_gripper_gone()).then(|| self.interconnect_feedback()),
        }
    }

    fn base_feedback(&self) -> BaseFeedback {
        let tool = wire_pose(&self.tool());
        let sent = self.robot.forward_tool(&self.servo.q_cmd);
        let sent = sent.map_or_else(|_| tool.clone(), |pose| wire_pose(pose.isometry()));
        let twist = self.robot.jacobian(&self.servo.report.q).map(|jacobian| {
            let dq = nalgebra::DVector::from_column_slice(&self.servo.report.dq);
            jacobian * dq
        });
        let twist = twist.unwrap_or_else(|_| nalgebra::Vector6::zeros());
        let holder = self.sessions.holder().map_or(0, |session| u32::from(session.id));
        BaseFeedback {
            active_state_connection_identifier: holder,
            active_state: self.arm_state() as i32,
            arm_voltage: 24.0,
            arm_current: 1.0,
            temperature_cpu: 45.0,
            temperature_ambient: 25.0,
            imu_acceleration_z: 9.81,
            tool_pose_x: tool.x,
            tool_pose_y: tool.y,
            tool_pose_z: tool.z,
            tool_pose_theta_x: tool.theta_x,
            tool_pose_theta_y: tool.theta_y,
            tool_pose_theta_z: tool.theta_z,
            tool_twist_linear_x: twist[0] as f32,
            tool_twist_linear_y: twist[1] as f32,
            tool_twist_linear_z: twist[2] as f32,
            tool_twist_angular_x: twist[3].to_degrees() as f32,
            tool_twist_angular_y: twist[4].to_degrees() as f32,
            tool_twist_angular_z: twist[5].to_degrees() as f32,
            fault_bank_a: match self.fault {
                None => 0,
                Some(Fault::EmergencyStop) => EMERGENCY_STOP_ACTIVATED,
                Some(_) => JOINT_FAULT,
            },
            commanded_tool_pose_x: sent.x,
            commanded_tool_pose_y: sent.y,
            commanded_tool_pose_z: sent.z,
            commanded_tool_pose_theta_x: sent.theta_x,
            commanded_tool_pose_theta_y: sent.theta_y,
            commanded_tool_pose_theta_z: sent.theta_z,
            ..BaseFeedback::default()
        }
    }

    fn interconnect_feedback(&self) -> InterconnectFeedback {
        let opening = self.servo.report.opening;
        let closed = 1.0 - (opening / self.robot.max_opening()).clamp(0.0, 1.0);
        let motor = MotorFeedback {
            motor_id: 1,
            position: (closed * 100.0) as f32,
            velocity: (self.servo.finger_speed() / FINGER_SPEED * 100.0) as f32,
            voltage: 24.0,
            temperature_motor: 30.0,
            ..MotorFeedback::default()
        };
        let status_flags = match (self.servo.finger_speed() > 0.0, self.servo.is_stalled()) {
            (true, _) => INITIALIZED,
            (false, true) => INITIALIZED | OBJECT_DETECTED,
            (false, false) => INITIALIZED | POS_REACHED,
        };
        let gripper = GripperCyclicFeedback {
            status_flags,
            motor: vec![motor],
            ..GripperCyclicFeedback::default()
        };
        InterconnectFeedback {
            voltage: 24.0,
            temperature_core: 35.0,
            tool_feedback: Some(ToolFeedback::GripperFeedback(gripper)),
            ..InterconnectFeedback::default()
        }
    }
}
