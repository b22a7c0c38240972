//! Actions: the stored ones, the one that runs, and what is told about it.
//!
//! The arm knows a few by name; everything that takes time and ends is one, started by whichever call. What
//! is told: preprocessing, start, waypoints passed, then end or abort.

use crate::execution::kortex::degrees;
use crate::execution::kortex::messages::base::{
    Action, ActionEvent, ActionHandle, ActionNotification, ActionParameters, ActionType,
    TrajectoryInfo, TrajectoryInfoType,
};
use crate::execution::kortex::messages::motion::{ConstrainedJointAngles, JointAngle, JointAngles};
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc;
use crate::motion::robot::Robot;
use crate::motion::trajectory::Trajectory;

use super::controller::{Ask, Controller, No};
use super::sessions::Session;

/// Handles of actions people make begin here.
const OWN: u32 = 10_000;
/// Handles of actions that were never stored.
const PASSING: u32 = 0;

/// Stored actions and the running one.
#[derive(Debug, Clone)]
pub(super) struct Actions {
    stored: Vec<Action>,
    next: u32,
    running: Option<ActionHandle>,
}

impl Actions {
    /// Knows the named poses of a robot, as the arm does out of the box.
    pub(super) fn of(robot: &Robot) -> Self {
        let named = [("Retract", "retract", 1), ("Home", "home", 2), ("Zero", "zero", 4)];
        let stored = named.into_iter().filter_map(|(name, pose, identifier)| {
            let q = robot.pose(pose).ok()?;
            let joint_angles = q.iter().zip(0..).map(|(&angle, joint)| JointAngle {
                joint_identifier: joint,
                value: degrees::to_wire(angle),
            });
            let reach = ConstrainedJointAngles {
                joint_angles: Some(JointAngles { joint_angles: joint_angles.collect() }),
                constraint: None,
            };
            let handle = ActionHandle {
                identifier,
                action_type: ActionType::ReachJointAngles as i32,
                permission: 1,
            };
            Some(Action {
                handle: Some(handle),
                name: name.to_owned(),
                application_data: String::new(),
                parameters: Some(ActionParameters::ReachJointAngles(reach)),
            })
        });
        Self { stored: stored.collect(), next: OWN, running: None }
    }

    /// Returns what kind of action runs, if one does.
    pub(super) fn kind(&self) -> Option<ActionType> {
        self.running.as_ref().map(ActionHandle::action_type)
    }

    /// Returns whether an action runs.
    pub(super) fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Returns the stored actions of a type; 0 stands for all.
    pub(super) fn of_type(&self, kind: i32) -> Vec<Action> {
        let is = |action: &&Action| {
            kind == 0 || action.handle.as_ref().is_some_and(|handle| handle.action_type == kind)
        };
        self.stored.iter().filter(is).cloned().collect()
    }

    /// Returns the stored action with this handle.
    pub(super) fn find(&self, identifier: u32) -> Result<&Action, No> {
        let is = |action: &&Action| {
            action.handle.as_ref().is_some_and(|handle| handle.identifier == identifier)
        };
        let found = self.stored.iter().find(is);
        found.ok_or_else(|| No::device(refusal::ENTITY_NOT_FOUND, "action not found"))
    }

    /// Stores an action and returns its handle.
    pub(super) fn store(&mut self, mut action: Action) -> Result<ActionHandle, No> {
        let Some(parameters) = &action.parameters else {
            return Err(No::device(refusal::UNSUPPORTED_ACTION, "unsupported action"));
        };
        let handle = ActionHandle {
            identifier: self.next,
            action_type: action_type(parameters) as i32,
            permission: 7,
        };
        self.next += 1;
        action.handle = Some(handle.clone());
        self.stored.push(action);
        Ok(handle)
    }

    /// Puts an action in the place of the one with its handle.
    pub(super) fn update(&mut self, mut action: Action) -> Result<ActionHandle, No> {
        let identifier = action.handle.as_ref().map_or(0, |handle| handle.identifier);
        let Some(parameters) = &action.parameters else {
            return Err(No::device(refusal::UNSUPPORTED_ACTION, "unsupported action"));
        };
        let handle = self.find(identifier)?.handle.clone().unwrap_or_default();
        if handle.permission & 4 == 0 {
            return Err(No::device(refusal::UPDATE_PERMISSION_DENIED, "default actions stay"));
        }
        let handle = ActionHandle { action_type: action_type(parameters) as i32, ..handle };
        action.handle = Some(handle.clone());
        let is = |stored: &&mut Action| {
            stored.handle.as_ref().is_some_and(|own| own.identifier == identifier)
        };
        if let Some(stored) = self.stored.iter_mut().find(is) {
            *stored = action;
        }
        Ok(handle)
    }

    /// Removes a stored action that someone made.
    pub(super) fn remove(&mut self, identifier: u32) -> Result<(), No> {
        let own =
            self.find(identifier)?.handle.as_ref().is_some_and(|handle| handle.permission & 4 != 0);
        if !own {
            return Err(No::device(refusal::DELETE_PERMISSION_DENIED, "default actions stay"));
        }
        self.stored.retain(|a| a.handle.as_ref().is_none_or(|h| h.identifier != identifier));
        Ok(())
    }
}

/// Returns the type of what an action does.
pub(super) fn action_type(parameters: &ActionParameters) -> ActionType {
    match parameters {
        ActionParameters::SendTwistCommand(_) => ActionType::SendTwistCommand,
        ActionParameters::SendWrenchCommand(_) => ActionType::SendWrenchCommand,
        ActionParameters::SendJointSpeeds(_) => ActionType::SendJointSpeeds,
        ActionParameters::ReachPose(_) => ActionType::ReachPose,
        ActionParameters::ReachJointAngles(_) => ActionType::ReachJointAngles,
        ActionParameters::ToggleAdmittanceMode(_) => ActionType::ToggleAdmittanceMode,
        ActionParameters::Snapshot(_) => ActionType::Snapshot,
        ActionParameters::ApplyEmergencyStop(()) => ActionType::ApplyEmergencyStop,
        ActionParameters::ClearFaults(()) => ActionType::ClearFaults,
        ActionParameters::Delay(_) => ActionType::TimeDelay,
        ActionParameters::ExecuteAction(_) => ActionType::ExecuteAction,
        ActionParameters::SendGripperCommand(_) => ActionType::SendGripperCommand,
        ActionParameters::StopAction(()) => ActionType::StopAction,
        ActionParameters::PlayPreComputedTrajectory(_) => ActionType::PlayPreComputedTrajectory,
        ActionParameters::ExecuteSequence(_) => ActionType::ExecuteSequence,
        ActionParameters::ExecuteWaypointList(_) => ActionType::ExecuteWaypointList,
    }
}

impl Controller {
    /// Says no while something else moves.
    pub(super) fn must_rest(&self) -> Result<(), No> {
        if self.actions.running.is_some() || self.is_moving() {
            let word = "a movement is in progress";
            return Err(No::device(refusal::ROBOT_MOVEMENT_IN_PROGRESS, word));
        }
        Ok(())
    }

    /// Begins an action that follows a trajectory, `marks` being the times of its waypoints, s.
    pub(super) fn begin_path(
        &mut self,
        ask: &Ask<'_>,
        kind: ActionType,
        handle: Option<ActionHandle>,
        trajectory: Trajectory,
        marks: Vec<f64>,
    ) {
        self.begin(ask, kind, handle);
        self.servo.follow(trajectory, marks);
    }

    /// Says no while an action runs.
    pub(super) fn no_action(&self) -> Result<(), No> {
        if self.actions.is_running() {
            let word = "an action is in progress";
            return Err(No::device(refusal::ROBOT_MOVEMENT_IN_PROGRESS, word));
        }
        Ok(())
    }

    /// Notes that an action begins and tells so; the caller sets things moving.
    pub(super) fn begin(&mut self, ask: &Ask<'_>, kind: ActionType, handle: Option<ActionHandle>) {
        let passing = ActionHandle { identifier: PASSING, action_type: kind as i32, permission: 0 };
        self.actions.running = Some(handle.unwrap_or(passing));
        if kind == ActionType::ExecuteWaypointList {
            self.tell_action(ActionEvent::PreprocessStart, 0, Vec::new());
            self.tell_action(ActionEvent::PreprocessEnd, 0, Vec::new());
        }
        self.tell_action(ActionEvent::Start, 0, Vec::new());
        self.sessions.keep(ask.now);
    }

    /// The motion of the running action is over.
    pub(super) fn action_arrived(&mut self) {
        if self.actions.running.is_some() {
            self.tell_action(ActionEvent::End, 0, Vec::new());
            self.actions.running = None;
        }
    }

    /// The fingers came to rest: the end of an action that moved only them.
    pub(super) fn fingers_rest(&mut self) {
        let only_fingers = self
            .actions
            .running
            .as_ref()
            .is_some_and(|handle| handle.action_type == ActionType::SendGripperCommand as i32);
        if only_fingers {
            self.action_arrived();
        }
    }

    /// The path passed a waypoint.
    pub(super) fn waypoint_passed(&mut self, waypoint: usize) {
        let info = TrajectoryInfo {
            trajectory_info_type: TrajectoryInfoType::WaypointReached as i32,
            waypoint_index: waypoint as u32,
            joint_index: 0,
        };
        self.tell_action(ActionEvent::Feedback, 0, vec![info]);
    }

    /// The running action, if there is one, is given up for this reason, and the sequence it is part of.
    pub(super) fn abort_action(&mut self, sub_code: u16) {
        if self.actions.running.is_some() {
            self.tell_action(ActionEvent::Abort, sub_code, Vec::new());
            self.actions.running = None;
        }
        self.abort_sequence(sub_code);
    }

    /// Tells what the running action does.
    pub(super) fn tell_action(
        &mut self,
        event: ActionEvent,
        sub_code: u16,
        info: Vec<TrajectoryInfo>,
    ) {
        if self.chance.hushes() {
            return;
        }
        let holder = self.sessions.holder();
        let told = ActionNotification {
            action_event: event as i32,
            handle: self.actions.running.clone(),
            timestamp: Some(self.timestamp()),
            user_handle: holder.map(Session::user_handle),
            abort_details: i32::from(sub_code),
            connection: holder.map(Session::connection),
            trajectory_info: info,
        };
        self.topics.tell(rpc::base::ON_ACTION_TOPIC, &told);
    }
}
