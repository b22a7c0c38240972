//! Actions: the stored ones, the one that runs, and what is told about it.
//!
//! The arm knows a few by name; everything that takes time and ends is one, started by whichever call. What
//! is told: preprocessing, start, waypoints passed, then end or abort.

use crate::kortex::degrees;
use crate::kortex::messages::base::{Action, ActionHandle, ActionParameters, ActionType};
use crate::kortex::messages::motion::{ConstrainedJointAngles, JointAngle, JointAngles};
use crate::motion::robot::Robot;

use super::error::Refused;

/// Handles of actions people make begin here.
const OWN: u32 = 10_000;
/// Handles of actions that were never stored.
pub(super) const PASSING: u32 = 0;

/// Stored actions and the running one.
#[derive(Debug, Clone)]
pub(super) struct Actions {
    stored: Vec<Action>,
    next: u32,
    pub(super) running: Option<ActionHandle>,
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
    pub(super) fn find(&self, identifier: u32) -> Result<&Action, Refused> {
        let is = |action: &&Action| {
            action.handle.as_ref().is_some_and(|handle| handle.identifier == identifier)
        };
        let found = self.stored.iter().find(is);
        found.ok_or(Refused::NoSuchAction)
    }

    /// Stores an action and returns its handle.
    pub(super) fn store(&mut self, mut action: Action) -> Result<ActionHandle, Refused> {
        let Some(parameters) = &action.parameters else {
            return Err(Refused::UnknownAction);
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
    pub(super) fn update(&mut self, mut action: Action) -> Result<ActionHandle, Refused> {
        let identifier = action.handle.as_ref().map_or(0, |handle| handle.identifier);
        let Some(parameters) = &action.parameters else {
            return Err(Refused::UnknownAction);
        };
        let handle = self.find(identifier)?.handle.clone().unwrap_or_default();
        if handle.permission & 4 == 0 {
            return Err(Refused::DefaultNotChanged);
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
    pub(super) fn remove(&mut self, identifier: u32) -> Result<(), Refused> {
        let own =
            self.find(identifier)?.handle.as_ref().is_some_and(|handle| handle.permission & 4 != 0);
        if !own {
            return Err(Refused::DefaultNotDeleted);
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
