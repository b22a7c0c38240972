//! What the service says and does of `actions`; what it keeps is in [`super::super::actions`].

use super::super::actions::PASSING;
use super::super::call::Ask;
use super::super::controller::Controller;
use super::super::error::Refused;
use super::super::sessions::Session;
use crate::kortex::messages::base::{
    ActionEvent, ActionHandle, ActionNotification, ActionType, TrajectoryInfo, TrajectoryInfoType,
};
use crate::kortex::{refusal, rpc};
use crate::motion::trajectory::Trajectory;

impl Controller {
    /// Says no while something else moves.
    pub(in crate::emulator) fn must_rest(&self) -> Result<(), Refused> {
        if self.actions.running.is_some() || self.is_moving() {
            return Err(Refused::Moving);
        }
        Ok(())
    }

    /// Begins an action that follows a trajectory, `marks` being the times of its waypoints, s.
    pub(in crate::emulator) fn begin_path(
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
    pub(in crate::emulator) fn no_action(&self) -> Result<(), Refused> {
        if self.actions.is_running() {
            return Err(Refused::Acting);
        }
        Ok(())
    }

    /// Notes that an action begins and tells so; the caller sets things moving.
    pub(in crate::emulator) fn begin(
        &mut self,
        ask: &Ask<'_>,
        kind: ActionType,
        handle: Option<ActionHandle>,
    ) {
        self.name_running(kind, handle);
        if kind == ActionType::ExecuteWaypointList {
            self.tell_action(ActionEvent::PreprocessStart, 0, Vec::new());
            self.tell_action(ActionEvent::PreprocessEnd, 0, Vec::new());
        }
        self.tell_action(ActionEvent::Start, 0, Vec::new());
        self.sessions.keep(ask.now);
    }

    /// Tells of an action that is given up before it begins.
    pub(in crate::emulator) fn begin_nothing(
        &mut self,
        ask: &Ask<'_>,
        kind: ActionType,
        handle: Option<ActionHandle>,
    ) {
        self.name_running(kind, handle);
        self.tell_action(ActionEvent::PreprocessStart, 0, Vec::new());
        self.tell_action(ActionEvent::PreprocessAbort, refusal::METHOD_FAILED, Vec::new());
        self.abort_action(refusal::CONTROL_WAYPOINT_TRAJECTORY_ABORTED);
        self.sessions.keep(ask.now);
    }

    /// Notes which action is told of from now on: a stored one by its handle, any other by what it does.
    fn name_running(&mut self, kind: ActionType, handle: Option<ActionHandle>) {
        let passing = ActionHandle { identifier: PASSING, action_type: kind as i32, permission: 0 };
        self.actions.running = Some(handle.unwrap_or(passing));
    }

    /// The motion of the running action is over.
    pub(in crate::emulator) fn action_arrived(&mut self) {
        if self.actions.running.is_some() {
            self.tell_action(ActionEvent::End, 0, Vec::new());
            self.actions.running = None;
        }
    }

    /// The fingers came to rest: the end of an action that moved only them.
    pub(in crate::emulator) fn fingers_rest(&mut self) {
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
    pub(in crate::emulator) fn waypoint_passed(&mut self, waypoint: usize) {
        let info = TrajectoryInfo {
            trajectory_info_type: TrajectoryInfoType::WaypointReached as i32,
            waypoint_index: waypoint as u32,
            joint_index: 0,
        };
        self.tell_action(ActionEvent::Feedback, 0, vec![info]);
    }

    /// The running action, if there is one, is given up for this reason, and the sequence it is part of.
    pub(in crate::emulator) fn abort_action(&mut self, sub_code: u16) {
        if self.actions.running.is_some() {
            self.tell_action(ActionEvent::Abort, sub_code, Vec::new());
            self.actions.running = None;
        }
        self.abort_sequence(sub_code);
    }

    /// Tells what the running action does.
    pub(in crate::emulator) fn tell_action(
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
