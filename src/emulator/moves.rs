//! The calls of `Base` that move something: actions, paths, speeds, twists, fingers.

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::kortex::degrees;
use crate::kortex::messages::base::{
    Action, ActionEvent, ActionHandle, ActionParameters, ActionType, ServoingMode,
    ServoingModeInformation,
};
use crate::kortex::messages::config::ControlMode;
use crate::kortex::messages::motion::{
    CartesianTrajectoryConstraint, ConstrainedJointAngle, ConstrainedJointAngles,
    ConstrainedOrientation, ConstrainedPose, ConstrainedPosition, GripperCommand, GripperMode,
    JointSpeeds, JointTrajectoryConstraint, Pose as WirePose, TwistCommand,
};
use crate::kortex::messages::trajectory::{
    PreComputedJointTrajectory, TrajectoryErrorElement, TrajectoryErrorReport, WaypointKind,
    WaypointList, WaypointValidationReport,
};
use crate::kortex::refusal;
use crate::motion::trajectory::Trajectory;

use super::actions::action_type;
use super::call::{Answer, Ask, Fault, done, say};
use super::controller::Controller;
use super::error::Refused;
use super::paths::{Pace, Planner, Timed, arranged, is_of_tool, placed, tool_pose, wire_pose};
use super::servo::FINGER_SPEED;

impl Controller {
    pub(super) fn execute_stored(&mut self, ask: &Ask<'_>, handle: &ActionHandle) -> Answer {
        let action = self.actions.find(handle.identifier)?.clone();
        let handle = action.handle.clone();
        self.execute(ask, action, handle)
    }

    /// Executes what an action refers to; a reference to a reference may lead back to itself.
    fn execute_referred(&mut self, ask: &Ask<'_>, handle: &ActionHandle) -> Answer {
        let found = self.actions.find(handle.identifier)?;
        if matches!(found.parameters, Some(ActionParameters::ExecuteAction(_))) {
            return Err(Refused::ReferredTwice);
        }
        self.execute_stored(ask, handle)
    }

    pub(super) fn execute(
        &mut self,
        ask: &Ask<'_>,
        action: Action,
        handle: Option<ActionHandle>,
    ) -> Answer {
        let Some(parameters) = action.parameters else {
            return Err(Refused::UnknownAction);
        };
        let kind = action_type(&parameters);
        match parameters {
            ActionParameters::ReachPose(goal) => self.reach_pose(ask, &goal, handle),
            ActionParameters::ReachJointAngles(goal) => self.reach_joints(ask, &goal, handle),
            ActionParameters::ExecuteWaypointList(list) => {
                self.follow_waypoints(ask, &list, handle)
            }
            ActionParameters::PlayPreComputedTrajectory(path) => self.play(ask, &path, handle),
            ActionParameters::SendTwistCommand(twist) => self.keep_twist(ask, &twist),
            ActionParameters::SendJointSpeeds(speeds) => self.keep_speeds(ask, &speeds),
            ActionParameters::SendWrenchCommand(wrench) => self.push(ask, &wrench),
            ActionParameters::ToggleAdmittanceMode(mode) => self.set_admittance(ask, mode),
            ActionParameters::Snapshot(snapshot) => self.take_snapshot(ask, &snapshot),
            ActionParameters::ExecuteSequence(handle) => self.play_sequence(ask, &handle),
            ActionParameters::ExecuteAction(handle) => self.execute_referred(ask, &handle),
            ActionParameters::SendGripperCommand(command) => {
                self.may_command(ask)?;
                self.must_rest()?;
                self.grip(&command)?;
                self.begin(ask, kind, handle);
                done()
            }
            ActionParameters::Delay(delay) => {
                self.may_command(ask)?;
                self.must_rest()?;
                self.begin(ask, ActionType::TimeDelay, handle);
                self.servo.wait(f64::from(delay.duration));
                done()
            }
            ActionParameters::StopAction(()) => {
                self.stop_all(refusal::CONTROL_MANUAL_STOP);
                done()
            }
            ActionParameters::ApplyEmergencyStop(()) => {
                self.fail(Fault::EmergencyStop);
                done()
            }
            ActionParameters::ClearFaults(()) => {
                self.clear_fault();
                done()
            }
        }
    }

    pub(super) fn pause(&mut self, is_paused: bool) -> Answer {
        if !self.actions.is_running() || !self.servo.pause(is_paused) {
            return Err(Refused::NothingToPause);
        }
        if is_paused {
            self.tell_action(ActionEvent::Pause, 0, Vec::new());
        }
        done()
    }

    fn planner<'a>(&'a self, mode: i32, from: &'a [f64]) -> Planner<'a> {
        Planner { robot: &self.robot, soft: self.config.soft(mode), from }
    }

    /// Plans from where the joints were last sent, under the limits of a control mode.
    fn plan<T>(&self, mode: i32, plan: impl FnOnce(&Planner<'_>) -> T) -> T {
        let from = self.servo.q_cmd.clone();
        plan(&self.planner(mode, &from))
    }

    pub(super) fn reach_joints(
        &mut self,
        ask: &Ask<'_>,
        goal: &ConstrainedJointAngles,
        handle: Option<ActionHandle>,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        let angles: Vec<f32> = self.servo.q_cmd.iter().map(|&q| degrees::to_wire(q)).collect();
        let asked = goal.joint_angles.as_ref().map_or(&[][..], |list| &list.joint_angles[..]);
        if asked.len() != angles.len() {
            return Err(Refused::JointCount);
        }
        let angles = arranged(asked, angles)?;
        self.go_to(ask, &angles, goal.constraint.as_ref(), handle)
    }

    pub(super) fn reach_one_joint(
        &mut self,
        ask: &Ask<'_>,
        goal: &ConstrainedJointAngle,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        let mut angles: Vec<f32> = self.servo.q_cmd.iter().map(|&q| degrees::to_wire(q)).collect();
        *self.one_of(&mut angles, goal.joint_identifier)? = goal.value;
        self.go_to(ask, &angles, goal.constraint.as_ref(), None)
    }

    fn one_of<'a>(&self, list: &'a mut [f32], joint: u32) -> Result<&'a mut f32, Refused> {
        let n = self.robot.n_joints();
        let found = list.get_mut(joint as usize);
        found.ok_or_else(|| Refused::NoJoint { last: n - 1 })
    }

    fn go_to(
        &mut self,
        ask: &Ask<'_>,
        angles: &[f32],
        constraint: Option<&JointTrajectoryConstraint>,
        handle: Option<ActionHandle>,
    ) -> Answer {
        if !angles.iter().all(|angle| angle.is_finite()) {
            return Err(Refused::NotANumber);
        }
        let pace = Pace::of_joints(constraint)?;
        let planned = self.plan(4, |planner| planner.joints(angles, pace));
        let trajectory = planned.map_err(Refused::JointsUnplanned)?;
        self.begin_path(ask, ActionType::ReachJointAngles, handle, trajectory, Vec::new());
        done()
    }

    pub(super) fn reach_pose(
        &mut self,
        ask: &Ask<'_>,
        goal: &ConstrainedPose,
        handle: Option<ActionHandle>,
    ) -> Answer {
        let pose = goal.target_pose.as_ref().ok_or(Refused::NoTargetPose)?;
        let pose = tool_pose(pose).ok_or(Refused::NotANumber)?;
        self.go_along(ask, &pose, goal.constraint.as_ref(), handle)
    }

    pub(super) fn reach_position(&mut self, ask: &Ask<'_>, goal: &ConstrainedPosition) -> Answer {
        let position = goal.target_position.clone().unwrap_or_default();
        let now = wire_pose(&self.tool());
        let there = WirePose { x: position.x, y: position.y, z: position.z, ..now };
        let goal =
            ConstrainedPose { target_pose: Some(there), constraint: goal.constraint.clone() };
        self.reach_pose(ask, &goal, None)
    }

    pub(super) fn reach_orientation(
        &mut self,
        ask: &Ask<'_>,
        goal: &ConstrainedOrientation,
    ) -> Answer {
        let turn = goal.target_orientation.clone().unwrap_or_default();
        let now = wire_pose(&self.tool());
        let there =
            WirePose { theta_x: turn.theta_x, theta_y: turn.theta_y, theta_z: turn.theta_z, ..now };
        let goal =
            ConstrainedPose { target_pose: Some(there), constraint: goal.constraint.clone() };
        self.reach_pose(ask, &goal, None)
    }

    fn go_along(
        &mut self,
        ask: &Ask<'_>,
        pose: &Isometry3<f64>,
        constraint: Option<&CartesianTrajectoryConstraint>,
        handle: Option<ActionHandle>,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        let pace = Pace::of_tool(constraint, self.config.tool_speeds(5))?;
        let trajectory =
            self.plan(5, |planner| planner.line(pose, pace)).map_err(Refused::LineUnplanned)?;
        self.begin_path(ask, ActionType::ReachPose, handle, trajectory, Vec::new());
        done()
    }

    /// Checks a list of waypoints and remembers what is wrong with it.
    fn waypoints(&mut self, list: &WaypointList) -> Result<Timed, Vec<TrajectoryErrorElement>> {
        let mut planned = self.plan(4, |planner| planner.waypoints(list));
        if let Some(error) = self.chance.refuses(list) {
            planned = Err(vec![error]);
        }
        self.config.last_report = TrajectoryErrorReport {
            trajectory_error_elements: planned.as_ref().err().cloned().unwrap_or_default(),
        };
        planned
    }

    pub(super) fn validate(&mut self, list: &WaypointList) -> Answer {
        let valid = self.waypoints(list).is_ok();
        say(&WaypointValidationReport {
            trajectory_error_report: Some(self.config.last_report.clone()),
            optimal_waypoint_list: (valid && list.use_optimal_blending).then(|| list.clone()),
        })
    }

    pub(super) fn follow_waypoints(
        &mut self,
        ask: &Ask<'_>,
        list: &WaypointList,
        handle: Option<ActionHandle>,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        let kind = ActionType::ExecuteWaypointList;
        let first = list.waypoints.first().and_then(|waypoint| waypoint.kind.as_ref());
        self.is_cartesian = matches!(first, Some(WaypointKind::CartesianWaypoint(_)));
        match self.waypoints(list) {
            Ok((trajectory, marks)) => self.begin_path(ask, kind, handle, trajectory, marks),
            // The call is taken; that the path is not, is told by the action.
            Err(_) => self.begin_nothing(ask, kind, handle),
        }
        done()
    }

    pub(super) fn play(
        &mut self,
        ask: &Ask<'_>,
        path: &PreComputedJointTrajectory,
        handle: Option<ActionHandle>,
    ) -> Answer {
        self.may_command(ask)?;
        self.must_rest()?;
        let trajectory = self.pre_computed(path)?;
        self.begin_path(ask, ActionType::PlayPreComputedTrajectory, handle, trajectory, Vec::new());
        done()
    }

    fn pre_computed(&self, path: &PreComputedJointTrajectory) -> Result<Trajectory, Refused> {
        let elements = &path.trajectory_elements;
        if elements.len() < 2 || elements.len() > 100_000 {
            return Err(Refused::PointCount);
        }
        let n = self.robot.n_joints();
        let mut times = Vec::with_capacity(elements.len());
        let mut points: Vec<Vec<f64>> = Vec::with_capacity(elements.len());
        for (at, element) in elements.iter().enumerate() {
            if element.joint_angles.len() != n {
                return Err(Refused::JointCount);
            }
            let time = f64::from(element.time_from_start);
            if (time - at as f64 * 1e-3).abs() > 2e-4 + time * 1e-6 {
                return Err(Refused::TimeStep);
            }
            let near = points.last().unwrap_or(&self.servo.q_cmd);
            let angles = element.joint_angles.iter().zip(near);
            points.push(angles.map(|(&angle, &near)| degrees::from_wire(angle, near)).collect());
            // The index is exact where an f32 of seconds is not.
            times.push(at as f64 * 1e-3);
        }
        let off = points[0].iter().zip(&self.servo.q_cmd).map(|(a, b)| (a - b).abs());
        if off.fold(0.0, f64::max) > 1.0_f64.to_radians() {
            return Err(Refused::StartsElsewhere);
        }
        points[0].clone_from(&self.servo.q_cmd);
        Trajectory::from_points(&times, &points).map_err(Refused::Motion)
    }

    pub(super) fn keep_speeds(&mut self, ask: &Ask<'_>, asked: &JointSpeeds) -> Answer {
        self.may_command(ask)?;
        self.no_action()?;
        let named = asked.joint_speeds.iter().map(|speed| (speed.joint_identifier, speed.value));
        let speeds = placed(&named.collect::<Vec<_>>(), vec![0.0; self.robot.n_joints()])?;
        if !speeds.iter().all(|speed| speed.is_finite()) {
            return Err(Refused::NotANumber);
        }
        let most = &self.config.soft(1).joint_speed_limits;
        let speeds = speeds.iter().zip(most);
        let speeds = speeds.map(|(v, most)| f64::from(v.clamp(-most, *most)).to_radians());
        self.servo.keep_speeds(speeds.collect());
        done()
    }

    pub(super) fn keep_twist(&mut self, ask: &Ask<'_>, asked: &TwistCommand) -> Answer {
        self.may_command(ask)?;
        self.no_action()?;
        let in_tool = is_of_tool(asked.reference_frame)?;
        let twist = asked.twist.clone().unwrap_or_default();
        let linear = [twist.linear_x, twist.linear_y, twist.linear_z].map(f64::from);
        let angular = [twist.angular_x, twist.angular_y, twist.angular_z]
            .map(|degrees| f64::from(degrees).to_radians());
        if !linear.iter().chain(&angular).all(|speed| speed.is_finite()) {
            return Err(Refused::NotANumber);
        }
        let (v, w) = self.config.tool_speeds(ControlMode::CartesianJoystick as i32);
        let (linear, angular) = (Vector3::from(linear), Vector3::from(angular));
        let share = (v / linear.norm()).min(w / angular.norm()).min(1.0);
        let twist = Vector6::from_iterator(linear.iter().chain(&angular).map(|x| x * share));
        self.servo.keep_twist(twist, in_tool, false);
        done()
    }

    /// Moves the fingers; the caller has asked whether it may.
    pub(super) fn grip(&mut self, command: &GripperCommand) -> Result<(), Refused> {
        let widest = self.robot.max_opening();
        let finger = command.gripper.as_ref().and_then(|gripper| gripper.finger.first());
        let value = f64::from(finger.ok_or(Refused::NoFinger)?.value);
        if !value.is_finite() {
            return Err(Refused::NotANumber);
        }
        let (opening, speed) = match GripperMode::try_from(command.mode) {
            Ok(GripperMode::Position) if (0.0..=1.0).contains(&value) => {
                ((1.0 - value) * widest, FINGER_SPEED)
            }
            Ok(GripperMode::Speed) if value.abs() <= 1.0 => {
                let speed = value.abs() * FINGER_SPEED;
                let goal = match value {
                    v if v > 0.0 => widest,
                    v if v < 0.0 => 0.0,
                    _ => self.servo.report.opening,
                };
                (goal, speed)
            }
            Ok(GripperMode::Force) => return Err(Refused::NoForceMode),
            Ok(GripperMode::Unspecified) | Err(_) => return Err(Refused::NoGripperMode),
            Ok(_) => return Err(Refused::FingerValue),
        };
        let sent = self.servo.aim(opening, speed);
        sent.map_err(Refused::Failed)
    }

    pub(super) fn set_servoing_mode(
        &mut self,
        ask: &Ask<'_>,
        asked: &ServoingModeInformation,
    ) -> Answer {
        match ServoingMode::try_from(asked.servoing_mode) {
            // Clients say this before they clear the faults; nothing moves by it.
            Ok(ServoingMode::SingleLevel) if self.fault.is_some() => {
                self.set_mode(ServoingMode::SingleLevel);
            }
            Ok(ServoingMode::SingleLevel) => {
                self.may_move(ask)?;
                self.set_mode(ServoingMode::SingleLevel);
            }
            Ok(ServoingMode::LowLevel) => {
                self.may_move(ask)?;
                self.must_rest()?;
                self.stream.expect(self.servo.time);
                self.set_mode(ServoingMode::LowLevel);
            }
            _ => return Err(Refused::UnknownServoing),
        }
        done()
    }
}
