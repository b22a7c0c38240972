//! What people keep in the arm besides sequences and zones: users, actions, snapshots.

use crate::kortex::messages::base::{
    Action, ActionHandle, ActionList, ActionParameters, ConfigurationChange,
    ConfigurationNotificationEvent, FullUserProfile, PasswordChange, RequestedActionType, UserList,
    UserProfile, UserProfileList,
};
use crate::kortex::messages::common::UserProfileHandle;
use crate::kortex::messages::motion::{
    ConstrainedJointAngles, ConstrainedPose, Finger, Gripper, GripperCommand, GripperMode,
};
use crate::kortex::messages::sequence::{Snapshot, SnapshotType};
use crate::kortex::rpc::base as call;

use super::call::{Answer, Ask, done, say};
use super::controller::Controller;
use super::error::Refused;
use super::paths::wire_pose;

use ConfigurationNotificationEvent as Event;

impl Controller {
    /// The calls about users; `None` for any other.
    pub(super) fn user_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        Some(match ask.rpc {
            call::CREATE_USER_PROFILE => ask.read().and_then(|asked: FullUserProfile| {
                let handle = self.sessions.add_user(asked)?;
                let change = ConfigurationChange::UserProfileHandle(handle.clone());
                self.tell_change(ask, Event::Created, change);
                say(&handle)
            }),
            call::UPDATE_USER_PROFILE => ask.read().and_then(|asked: UserProfile| {
                let handle = self.sessions.change_user(asked)?;
                let change = ConfigurationChange::UserProfileHandle(handle);
                self.tell_change(ask, Event::Updated, change);
                done()
            }),
            call::DELETE_USER_PROFILE => ask.read().and_then(|handle: UserProfileHandle| {
                self.sessions.remove_user(&handle)?;
                let change = ConfigurationChange::UserProfileHandle(handle);
                self.tell_change(ask, Event::Deleted, change);
                done()
            }),
            call::READ_USER_PROFILE => {
                ask.read().and_then(|handle| say(&self.sessions.user(&handle)?.clone()))
            }
            call::CHANGE_PASSWORD => ask.read().and_then(|asked: PasswordChange| {
                self.sessions.change_password(&asked)?;
                done()
            }),
            call::READ_ALL_USER_PROFILES => {
                say(&UserProfileList { user_profiles: self.sessions.users() })
            }
            call::READ_ALL_USERS => {
                let handles = self.sessions.users().into_iter().filter_map(|user| user.handle);
                say(&UserList { user_handles: handles.collect() })
            }
            _ => return None,
        })
    }

    /// The calls about stored actions; `None` for any other.
    pub(super) fn action_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        Some(match ask.rpc {
            call::READ_ALL_ACTIONS => ask.read().and_then(|asked: RequestedActionType| {
                say(&ActionList { action_list: self.actions.of_type(asked.action_type) })
            }),
            call::READ_ACTION => ask
                .read()
                .and_then(|handle: ActionHandle| say(self.actions.find(handle.identifier)?)),
            call::CREATE_ACTION => ask.read().and_then(|action| {
                let handle = self.store_action(ask, action)?;
                say(&handle)
            }),
            call::UPDATE_ACTION => ask.read().and_then(|action| {
                let handle = self.actions.update(action)?;
                self.tell_change(ask, Event::Updated, ConfigurationChange::ActionHandle(handle));
                done()
            }),
            call::DELETE_ACTION => ask.read().and_then(|handle: ActionHandle| {
                self.actions.remove(handle.identifier)?;
                self.tell_change(ask, Event::Deleted, ConfigurationChange::ActionHandle(handle));
                done()
            }),
            call::TAKE_SNAPSHOT => ask.read().and_then(|asked| self.take_snapshot(ask, &asked)),
            _ => return None,
        })
    }

    fn store_action(&mut self, ask: &Ask<'_>, action: Action) -> Result<ActionHandle, Refused> {
        let handle = self.actions.store(action)?;
        let change = ConfigurationChange::ActionHandle(handle.clone());
        self.tell_change(ask, Event::Created, change);
        Ok(handle)
    }

    /// Stores where the arm is as actions that lead there; their names are chosen here.
    pub(super) fn take_snapshot(&mut self, ask: &Ask<'_>, asked: &Snapshot) -> Answer {
        let joints = || {
            let reach = ConstrainedJointAngles {
                joint_angles: Some(self.joint_angles()),
                constraint: None,
            };
            ActionParameters::ReachJointAngles(reach)
        };
        let pose = || {
            let pose = Some(wire_pose(&self.tool()));
            ActionParameters::ReachPose(ConstrainedPose { target_pose: pose, constraint: None })
        };
        let gripper = || {
            let closed = 1.0 - self.servo.report.opening / self.robot.max_opening();
            let value = closed.clamp(0.0, 1.0) as f32;
            ActionParameters::SendGripperCommand(GripperCommand {
                mode: GripperMode::Position as i32,
                gripper: Some(Gripper { finger: vec![Finger { finger_identifier: 1, value }] }),
                duration: 0,
            })
        };
        let seen = match SnapshotType::try_from(asked.snapshot_type) {
            Ok(SnapshotType::CartesianPosition) => vec![pose()],
            Ok(SnapshotType::JointPosition) => vec![joints()],
            Ok(SnapshotType::Gripper) => vec![gripper()],
            Ok(SnapshotType::Combined) => vec![pose(), gripper()],
            _ => return Err(Refused::NoSnapshot),
        };
        for parameters in seen {
            let name = format!("Snapshot at {:.1} s", self.servo.time);
            let parameters = Some(parameters);
            let action = Action { name, parameters, ..Action::default() };
            self.store_action(ask, action)?;
        }
        done()
    }
}
