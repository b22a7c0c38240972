//! Service 2, `Base`: what most clients use.

use nalgebra::Isometry3;

use crate::kortex::degrees;
use crate::kortex::messages::base::{
    ActuatorInformation, ArmStateInformation, ConfigurationChange, ConfigurationChangeNotification,
    ConfigurationNotificationEvent, FirmwareBundleVersions, OperatingModeInformation,
    ServoingModeInformation,
};
use crate::kortex::messages::common::NotificationHandle;
use crate::kortex::messages::force::BaseControlMode;
use crate::kortex::messages::motion::{
    Finger, Gripper, GripperMode, GripperRequest, IkData, JointAngle, JointAngles, JointSpeed,
    JointSpeeds,
};
use crate::kortex::refusal;
use crate::kortex::rpc::base as call;
use crate::motion::ik::Solver;
use crate::world::Pose;

use super::call::{Answer, Ask, Fault, done, say};
use super::controller::Controller;
use super::error::Refused;
use super::force::base_number;
use super::paths::{arranged, tool_pose, wire_pose};
use super::servo::FINGER_SPEED;
use super::sessions::Session;

impl Controller {
    pub(super) fn base_service(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc {
            call::EXECUTE_ACTION => self.execute(ask, ask.read()?, None),
            call::EXECUTE_ACTION_FROM_REFERENCE => self.execute_stored(ask, &ask.read()?),
            call::PLAY_JOINT_TRAJECTORY => self.reach_joints(ask, &ask.read()?, None),
            call::PLAY_SELECTED_JOINT_TRAJECTORY => self.reach_one_joint(ask, &ask.read()?),
            call::PLAY_CARTESIAN_TRAJECTORY => self.reach_pose(ask, &ask.read()?, None),
            call::PLAY_CARTESIAN_TRAJECTORY_POSITION => self.reach_position(ask, &ask.read()?),
            call::PLAY_CARTESIAN_TRAJECTORY_ORIENTATION => {
                self.reach_orientation(ask, &ask.read()?)
            }
            call::PLAY_PRE_COMPUTED_JOINT_TRAJECTORY => self.play(ask, &ask.read()?, None),
            call::EXECUTE_WAYPOINT_TRAJECTORY => self.follow_waypoints(ask, &ask.read()?, None),
            call::VALIDATE_WAYPOINT_LIST => self.validate(&ask.read()?),
            call::GET_TRAJECTORY_ERROR_REPORT => say(&self.config.last_report),
            call::STOP_ACTION | call::STOP => {
                if !self.chance.is_deaf() {
                    self.stop_all(refusal::CONTROL_MANUAL_STOP);
                }
                done()
            }
            call::PAUSE_ACTION => self.pause(true),
            call::RESUME_ACTION => self.pause(false),
            call::APPLY_EMERGENCY_STOP => {
                self.fail(Fault::EmergencyStop);
                done()
            }
            call::CLEAR_FAULTS => {
                self.clear_fault();
                done()
            }
            call::SEND_JOINT_SPEEDS_COMMAND | call::SEND_JOINT_SPEEDS_JOYSTICK_COMMAND => {
                self.keep_speeds(ask, &ask.read()?)
            }
            call::SEND_SELECTED_JOINT_SPEED_COMMAND
            | call::SEND_SELECTED_JOINT_SPEED_JOYSTICK_COMMAND => {
                let one: JointSpeed = ask.read()?;
                self.keep_speeds(ask, &JointSpeeds { joint_speeds: vec![one], duration: 0 })
            }
            call::SEND_TWIST_COMMAND | call::SEND_TWIST_JOYSTICK_COMMAND => {
                self.keep_twist(ask, &ask.read()?)
            }
            call::SEND_GRIPPER_COMMAND => {
                self.may_move(ask)?;
                self.grip(&ask.read()?)?;
                done()
            }
            call::SET_SERVOING_MODE => self.set_servoing_mode(ask, &ask.read()?),
            call::SEND_WRENCH_COMMAND | call::SEND_WRENCH_JOYSTICK_COMMAND => {
                self.push(ask, &ask.read()?)
            }
            call::SET_ADMITTANCE => self.read_admittance(ask),
            call::SET_OPERATING_MODE => self.set_operating_mode(ask, &ask.read()?),
            call::REBOOT => {
                self.sessions.take(ask.session, self.is_moving(), ask.now)?;
                self.reboot();
                done()
            }
            _ => self.base_store(ask),
        }
    }

    /// Calls about what the arm keeps for people.
    fn base_store(&mut self, ask: &Ask<'_>) -> Answer {
        let answer = self.action_calls(ask).or_else(|| self.sequence_calls(ask));
        let answer = answer.or_else(|| self.zone_calls(ask)).or_else(|| self.user_calls(ask));
        let answer = answer.or_else(|| self.bridge_calls(ask));
        answer.unwrap_or_else(|| self.base_facts(ask))
    }

    /// Calls that move nothing.
    fn base_facts(&mut self, ask: &Ask<'_>) -> Answer {
        match ask.rpc {
            call::GET_MEASURED_JOINT_ANGLES => say(&self.joint_angles()),
            call::GET_MEASURED_CARTESIAN_POSE => say(&wire_pose(&self.tool())),
            call::COMPUTE_FORWARD_KINEMATICS => self.forward(&ask.read()?),
            call::COMPUTE_INVERSE_KINEMATICS => self.inverse(&ask.read()?),
            call::GET_MEASURED_GRIPPER_MOVEMENT => self.measure_gripper(&ask.read()?),
            call::GET_SERVOING_MODE => {
                say(&ServoingModeInformation { servoing_mode: self.mode as i32 })
            }
            call::GET_ARM_STATE => say(&ArmStateInformation {
                active_state: self.arm_state() as i32,
                connection: self.sessions.holder().map(Session::connection),
            }),
            call::GET_OPERATING_MODE => say(&OperatingModeInformation {
                operating_mode: self.operating as i32,
                device_handle: None,
            }),
            call::GET_ACTUATOR_COUNT => {
                say(&ActuatorInformation { count: self.robot.n_joints() as u32 })
            }
            call::GET_PRODUCT_CONFIGURATION => say(&self.config.product),
            call::GET_FIRMWARE_BUNDLE_VERSIONS => say(&FirmwareBundleVersions {
                main_bundle_version: super::config::FIRMWARE.to_owned(),
                components_versions: Vec::new(),
            }),
            call::GET_CONTROL_MODE => {
                say(&BaseControlMode { mode: base_number(self.control_mode()) })
            }
            // Nobody has a joystick here, and no wireless network is in reach: two empty lists.
            call::GET_ALL_CONNECTED_CONTROLLERS | call::GET_AVAILABLE_WIFI => done(),
            call::UNSUBSCRIBE => {
                let handle: NotificationHandle = ask.read()?;
                self.topics.unsubscribe(ask.session, handle.identifier)?;
                done()
            }
            topic if topic.name.contains("OnNotification") => say(&NotificationHandle {
                identifier: self.topics.subscribe(ask.session, ask.peer, topic),
            }),
            _ => Err(Refused::NotEmulated),
        }
    }

    /// Tells that something the arm keeps is new, another or gone.
    pub(super) fn tell_change(
        &mut self,
        ask: &Ask<'_>,
        event: ConfigurationNotificationEvent,
        change: ConfigurationChange,
    ) {
        let session = self.sessions.find(ask.session);
        let told = ConfigurationChangeNotification {
            event: event as i32,
            timestamp: Some(self.timestamp()),
            user_handle: session.map(Session::user_handle),
            change: Some(change),
            connection: session.map(Session::connection),
        };
        self.topics.tell(call::ON_CONFIGURATION_CHANGE_TOPIC, &told);
    }

    fn measure_gripper(&mut self, asked: &GripperRequest) -> Answer {
        let value = match GripperMode::try_from(asked.mode) {
            Ok(GripperMode::Position) => 1.0 - self.servo.report.opening / self.robot.max_opening(),
            Ok(GripperMode::Speed) => self.servo.finger_speed() / FINGER_SPEED,
            _ => return Err(Refused::NotImplemented),
        };
        let finger = Finger { finger_identifier: 1, value: value.clamp(0.0, 1.0) as f32 };
        say(&Gripper { finger: vec![finger] })
    }

    /// Returns where the joints are.
    pub(super) fn joint_angles(&self) -> JointAngles {
        let joint_angles =
            self.servo.report.q.iter().zip(0..).map(|(&q, joint)| JointAngle {
                joint_identifier: joint,
                value: degrees::to_wire(q),
            });
        JointAngles { joint_angles: joint_angles.collect() }
    }

    /// Returns the pose of the tool in the base, as the encoders say.
    pub(super) fn tool(&self) -> Isometry3<f64> {
        let pose = self.robot.forward_tool(&self.servo.report.q);
        pose.map_or_else(|_| Isometry3::identity(), |pose| *pose.isometry())
    }

    fn forward(&self, asked: &JointAngles) -> Answer {
        let angles = arranged(&asked.joint_angles, vec![0.0; self.robot.n_joints()])?;
        let q: Vec<f64> = angles.iter().map(|&angle| f64::from(angle).to_radians()).collect();
        let pose = self.robot.forward_tool(&q);
        let pose = pose.map_err(Refused::Motion)?;
        say(&wire_pose(pose.isometry()))
    }

    fn inverse(&self, asked: &IkData) -> Answer {
        let pose = asked.cartesian_pose.as_ref().and_then(tool_pose);
        let pose = pose.ok_or(Refused::NoPose)?;
        let guess = asked.guess.as_ref().map_or(&[][..], |guess| &guess.joint_angles[..]);
        let now = self.servo.q_cmd.iter().map(|&q| degrees::to_wire(q)).collect();
        let near = arranged(guess, now)?;
        let near: Vec<f64> = near.iter().map(|&angle| degrees::from_wire(angle, 0.0)).collect();
        let flange = Pose::new(pose * self.robot.flange_from_tool().isometry().inverse());
        let found = Solver::new(&self.robot)
            .nearest(&flange, &near)
            .map_err(|none| Refused::NoSolution(none.reason))?;
        let joint_angles = found
            .iter()
            .zip(0..)
            .map(|(&q, joint)| JointAngle { joint_identifier: joint, value: degrees::to_wire(q) });
        say(&JointAngles { joint_angles: joint_angles.collect() })
    }
}
