//! What the arm keeps and what is played from it: sequences, snapshots, users; wrenches; a restart.

use prost::Message;

use trueup::emulator::Emulator;
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::link::{Link, LinkError, Login};
use trueup::kortex::messages::base::{
    Action, ActionHandle, ActionList, ActionParameters, ActionType, OperatingMode,
    OperatingModeInformation, PasswordChange, RequestedActionType, UserList,
};
use trueup::kortex::messages::config::ControlMode;
use trueup::kortex::messages::force::{
    Admittance, AdmittanceMode, BaseControlMode, Wrench, WrenchCommand, WrenchMode,
};
use trueup::kortex::messages::motion::{
    ConstrainedJointAngles, JointAngle, JointAngles, JointSpeed, JointSpeeds, Pose,
};
use trueup::kortex::messages::sequence::{
    Sequence, SequenceEvent, SequenceHandle, SequenceInfoNotification, SequenceTask, Snapshot,
    SnapshotType,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::base as call;

use super::{admin, eager, emulator, link};

/// An action that turns joint 1 so far, deg, from where all joints are at home.
fn turn(degrees: f32) -> Action {
    let home = [degrees, 15.0, 180.0, 230.0, 0.0, 55.0, 90.0];
    let angles = home.iter().map(|&value| JointAngle { joint_identifier: 0, value });
    let reach = ConstrainedJointAngles {
        joint_angles: Some(JointAngles { joint_angles: angles.collect() }),
        constraint: None,
    };
    Action { parameters: Some(ActionParameters::ReachJointAngles(reach)), ..Action::default() }
}

fn sequence(actions: &[Action]) -> Sequence {
    let tasks = actions.iter().zip(0..).map(|(action, group)| SequenceTask {
        group_identifier: group,
        action: Some(action.clone()),
        application_data: String::new(),
    });
    Sequence { name: "two turns".into(), tasks: tasks.collect(), ..Sequence::default() }
}

/// What is told of a sequence until it is over.
fn played(emulator: &Emulator, link: &Link, handle: u16) -> Vec<(SequenceEvent, u32, i32)> {
    let clock = emulator.clock();
    let late = clock.now() + 60.0;
    let mut told = Vec::new();
    while clock.now() < late {
        for note in link.notes(handle) {
            let note = SequenceInfoNotification::decode(&note.payload[..]).unwrap();
            told.push((note.event_identifier(), note.task_index, note.abort_details));
        }
        let is_over = |event: &SequenceEvent| {
            matches!(event, SequenceEvent::Completed | SequenceEvent::Aborted)
        };
        if told.iter().any(|(event, _, _)| is_over(event)) {
            return told;
        }
        clock.sleep(0.02);
    }
    panic!("the sequence never ended: {told:?}");
}

fn joint_1(link: &Link) -> f32 {
    let all: JointAngles = link.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
    all.joint_angles[0].value
}

#[test]
fn a_sequence_is_stored_played_task_by_task_and_told() {
    use SequenceEvent::{Completed, Started, TaskCompleted, TaskStarted};
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let topic = link.subscribe(call::ON_SEQUENCE_INFO_TOPIC).unwrap();
    let two = sequence(&[turn(20.0), turn(350.0)]);
    let handle: SequenceHandle = link.call(call::CREATE_SEQUENCE, &two).unwrap();
    let () = link.call(call::PLAY_SEQUENCE, &handle).unwrap();
    let told: Vec<(SequenceEvent, u32)> =
        played(&emulator, &link, topic).into_iter().map(|(event, task, _)| (event, task)).collect();
    assert_eq!(
        told,
        [
            (Started, 0),
            (TaskStarted, 0),
            (TaskCompleted, 0),
            (TaskStarted, 1),
            (TaskCompleted, 1),
            (Completed, 2)
        ]
    );
    assert!((joint_1(&link) - 350.0).abs() < 0.1, "{}", joint_1(&link));
    let kept: Sequence = link.call(call::READ_SEQUENCE, &handle).unwrap();
    assert_eq!((kept.name.as_str(), kept.tasks.len()), ("two turns", 2));
    let () = link.call(call::DELETE_SEQUENCE, &handle).unwrap();
    let gone = link.call::<()>(call::PLAY_SEQUENCE, &handle).unwrap_err();
    assert!(gone.is_refusal(refusal::ENTITY_NOT_FOUND), "{gone}");
}

#[test]
fn a_sequence_that_is_stopped_or_cannot_go_on_is_told_as_aborted() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let topic = link.subscribe(call::ON_SEQUENCE_INFO_TOPIC).unwrap();
    // Joint 2 goes to 128 deg at most: the second task cannot be begun.
    let mut far = turn(0.0);
    if let Some(ActionParameters::ReachJointAngles(reach)) = &mut far.parameters {
        reach.joint_angles.as_mut().unwrap().joint_angles[1].value = 140.0;
    }
    let bad = sequence(&[turn(5.0), far]);
    let handle: SequenceHandle = link.call(call::CREATE_SEQUENCE, &bad).unwrap();
    let () = link.call(call::PLAY_SEQUENCE, &handle).unwrap();
    let last = *played(&emulator, &link, topic).last().unwrap();
    let limit = i32::from(refusal::CONTROL_JOINT_POSITION_LIMIT);
    assert_eq!(last, (SequenceEvent::Aborted, 1, limit));
    let long = sequence(&[turn(170.0), turn(0.0)]);
    let handle: SequenceHandle = link.call(call::CREATE_SEQUENCE, &long).unwrap();
    let () = link.call(call::PLAY_SEQUENCE, &handle).unwrap();
    let again = link.call::<()>(call::PLAY_SEQUENCE, &handle).unwrap_err();
    assert!(again.is_refusal(refusal::ROBOT_MOVEMENT_IN_PROGRESS), "{again}");
    let () = link.call(call::STOP_SEQUENCE, &()).unwrap();
    let last = *played(&emulator, &link, topic).last().unwrap();
    assert_eq!(last, (SequenceEvent::Aborted, 0, i32::from(refusal::CONTROL_MANUAL_STOP)));
}

#[test]
fn actions_that_refer_to_themselves_are_refused_not_followed_for_ever() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    // The first handle that is given away is 10000.
    let own = ActionHandle { identifier: 10_000, ..ActionHandle::default() };
    let circle = Action {
        parameters: Some(ActionParameters::ExecuteAction(own.clone())),
        ..Action::default()
    };
    let made: ActionHandle = link.call(call::CREATE_ACTION, &circle).unwrap();
    assert_eq!(made.identifier, own.identifier);
    let refused = link.call::<()>(call::EXECUTE_ACTION_FROM_REFERENCE, &made).unwrap_err();
    assert!(refused.is_refusal(refusal::INVALID_PARAM), "{refused}");
    // Sequences cannot be nested either.
    let inner = SequenceHandle { identifier: 1, permission: 0 };
    let nested =
        Action { parameters: Some(ActionParameters::ExecuteSequence(inner)), ..Action::default() };
    let handle: SequenceHandle = link.call(call::CREATE_SEQUENCE, &sequence(&[nested])).unwrap();
    assert_eq!(handle.identifier, 1);
    let topic = link.subscribe(call::ON_SEQUENCE_INFO_TOPIC).unwrap();
    let () = link.call(call::PLAY_SEQUENCE, &handle).unwrap();
    assert_eq!(played(&emulator, &link, topic).last().unwrap().0, SequenceEvent::Aborted);
}

#[test]
fn a_snapshot_is_an_action_that_leads_back() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let asked = Snapshot { snapshot_type: SnapshotType::JointPosition as i32 };
    let () = link.call(call::TAKE_SNAPSHOT, &asked).unwrap();
    let kind = RequestedActionType { action_type: ActionType::ReachJointAngles as i32 };
    let all: ActionList = link.call(call::READ_ALL_ACTIONS, &kind).unwrap();
    let taken = all.action_list.last().unwrap();
    assert!(taken.name.starts_with("Snapshot"), "{}", taken.name);
    let Some(ActionParameters::ReachJointAngles(reach)) = &taken.parameters else {
        panic!("{taken:?}")
    };
    let now: JointAngles = link.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
    assert_eq!(reach.joint_angles.as_ref(), Some(&now));
}

#[test]
fn a_wrench_drifts_the_tool_along_it_and_control_modes_are_told() {
    let emulator = emulator(&eager());
    let clock = emulator.clock();
    let link = link(&emulator);
    let mode = || {
        let told: BaseControlMode = link.call(call::GET_CONTROL_MODE, &()).unwrap();
        told.mode
    };
    assert_eq!(mode(), ControlMode::Idle as i32);
    let before: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    let push = WrenchCommand {
        reference_frame: 3,
        mode: WrenchMode::Normal as i32,
        wrench: Some(Wrench { force_z: 10.0, ..Wrench::default() }),
        duration: 0,
    };
    let () = link.call(call::SEND_WRENCH_COMMAND, &push).unwrap();
    assert_eq!(mode(), ControlMode::ForceControl as i32);
    clock.sleep(1.0);
    let () = link.call(call::STOP, &()).unwrap();
    clock.sleep(1.0);
    let after: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!(after.z - before.z > 0.03, "it rose by {} m", after.z - before.z);
    let soft = Admittance { admittance_mode: AdmittanceMode::Joint as i32 };
    let () = link.call(call::SET_ADMITTANCE, &soft).unwrap();
    assert_eq!(mode(), ControlMode::JointAdmittance as i32);
    let off = Admittance { admittance_mode: AdmittanceMode::Disabled as i32 };
    let () = link.call(call::SET_ADMITTANCE, &off).unwrap();
    assert_eq!(mode(), ControlMode::Idle as i32);
}

#[test]
fn an_arm_in_maintenance_does_not_move_until_it_runs_again() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let set = |mode: OperatingMode| {
        let asked = OperatingModeInformation { operating_mode: mode as i32, device_handle: None };
        link.call::<()>(call::SET_OPERATING_MODE, &asked)
    };
    let slow = JointSpeed { joint_identifier: 0, value: 5.0, duration: 0 };
    let slow = JointSpeeds { joint_speeds: vec![slow], duration: 0 };
    let go = || link.call::<()>(call::SEND_JOINT_SPEEDS_COMMAND, &slow);
    set(OperatingMode::Maintenance).unwrap();
    assert!(go().unwrap_err().is_refusal(refusal::ROBOT_IN_MAINTENANCE));
    set(OperatingMode::Run).unwrap();
    go().unwrap();
    assert!(set(OperatingMode::Update).unwrap_err().is_refusal(refusal::UNSUPPORTED_OPTION));
}

#[test]
fn passwords_are_changed_by_who_knows_the_old_one() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let users: UserList = link.call(call::READ_ALL_USERS, &()).unwrap();
    let change = |old: &str, new: &str| PasswordChange {
        handle: users.user_handles.first().cloned(),
        old_password: old.into(),
        new_password: new.into(),
    };
    let wrong = link.call::<()>(call::CHANGE_PASSWORD, &change("guess", "new")).unwrap_err();
    assert!(wrong.is_refusal(refusal::INVALID_PASSWORD), "{wrong}");
    let () = link.call(call::CHANGE_PASSWORD, &change("admin", "new")).unwrap();
    let soon = std::time::Duration::from_secs(5);
    assert!(Link::open(emulator.tcp(), &admin(), soon).is_err());
    Link::open(emulator.tcp(), &Login { user: "admin".into(), password: "new".into() }, soon)
        .unwrap();
}

#[test]
fn an_arm_that_starts_anew_answers_first_then_nobody_and_then_everybody() {
    let emulator = emulator(&eager());
    let first = link(&emulator);
    let () = first.call(call::REBOOT, &()).unwrap();
    let until = Wall.now() + 5.0;
    let mut lost = first.call::<()>(call::GET_ARM_STATE, &());
    while Wall.now() < until && !matches!(lost, Err(LinkError::Lost(_))) {
        lost = first.call::<()>(call::GET_ARM_STATE, &());
    }
    assert!(lost.unwrap_err().is_lost());
    let open = || Link::open(emulator.tcp(), &admin(), std::time::Duration::from_secs(1));
    let mut again = open();
    let until = Wall.now() + 20.0;
    while Wall.now() < until && again.is_err() {
        Wall.sleep(0.1);
        again = open();
    }
    let () = again.unwrap().call(call::GET_ARM_STATE, &()).unwrap();
    assert_eq!(emulator.status().sessions, 0);
}
