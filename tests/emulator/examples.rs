//! What the vendor's own Python examples call, in their order: each must come to its end.

use trueup::kortex::link::{Datagrams, LinkError};
use trueup::kortex::messages::base::{
    Action, ActionEvent, ActionHandle, ActionList, ActionParameters, ActionType,
    ActuatorInformation, ArmStateInformation, ConfigurationChange, ConfigurationChangeNotification,
    FullUserProfile, RequestedActionType, ServoingMode, ServoingModeInformation, UserProfile,
};
use trueup::kortex::messages::common::{
    ArmState, DeviceHandle, DeviceType, NotificationHandle, UserProfileHandle,
};
use trueup::kortex::messages::config::{
    ActuatorMode, ActuatorModeInformation, CompleteProductConfiguration, DeviceHandles,
    DeviceTypeInformation, MacAddress, ModelId, SerialNumber,
};
use trueup::kortex::messages::cyclic::{ActuatorCommand, Command, Feedback};
use trueup::kortex::messages::motion::{
    ConstrainedJointAngles, ConstrainedPose, JointAngle, JointAngles, JointSpeed, JointSpeeds,
    Pose, Twist, TwistCommand,
};
use trueup::kortex::messages::trajectory::{
    AngularWaypoint, CartesianWaypoint, Waypoint, WaypointKind, WaypointList,
    WaypointValidationReport,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{
    actuator_config, base as call, base_cyclic, device_config, device_manager,
};

use prost::Message;

use super::{admin, eager, emulator, link, until_over};

fn single_level() -> ServoingModeInformation {
    ServoingModeInformation { servoing_mode: ServoingMode::SingleLevel as i32 }
}

fn low_level() -> ServoingModeInformation {
    ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 }
}

#[test]
fn a_session_tells_the_device_and_the_state() {
    let emulator = emulator(&eager());
    {
        let link = link(&emulator);
        let kind: DeviceTypeInformation = link.call(device_config::GET_DEVICE_TYPE, &()).unwrap();
        assert_eq!(kind.device_type(), DeviceType::Base);
        let state: ArmStateInformation = link.call(call::GET_ARM_STATE, &()).unwrap();
        assert_eq!(state.active_state(), ArmState::ServoingReady);
        assert_eq!(emulator.status().sessions, 1);
    }
    assert_eq!(emulator.status().sessions, 0, "the session is closed with its link");
}

#[test]
fn a_user_made_is_notified_and_a_second_of_its_name_is_refused() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let handle = link.subscribe(call::ON_CONFIGURATION_CHANGE_TOPIC).unwrap();
    let profile = UserProfile { username: "jcash".into(), ..UserProfile::default() };
    let full = FullUserProfile { user_profile: Some(profile), password: "pwd".into() };
    let made: UserProfileHandle = link.call(call::CREATE_USER_PROFILE, &full).unwrap();
    let again = link.call::<UserProfileHandle>(call::CREATE_USER_PROFILE, &full).unwrap_err();
    assert!(again.is_refusal(refusal::USERNAME_ALREADY_EXISTS), "{again}");
    let () = link.call(call::DELETE_USER_PROFILE, &made).unwrap();
    // What a call sets off is told before the next call is answered.
    let () = link.call(call::GET_ARM_STATE, &()).unwrap();
    let notes = link.notes(handle);
    assert_eq!(notes.len(), 2);
    let told = ConfigurationChangeNotification::decode(&notes[0].payload[..]).unwrap();
    assert_eq!(told.change, Some(ConfigurationChange::UserProfileHandle(made)));
    // After unsubscribing nothing more is told.
    let told = NotificationHandle { identifier: u32::from(handle) };
    let () = link.call(call::UNSUBSCRIBE, &told).unwrap();
    let _: UserProfileHandle = link.call(call::CREATE_USER_PROFILE, &full).unwrap();
    let () = link.call(call::GET_ARM_STATE, &()).unwrap();
    assert!(link.notes(handle).is_empty());
}

#[test]
fn every_device_answers_for_itself() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let all: DeviceHandles = link.call(device_manager::READ_ALL_DEVICES, &()).unwrap();
    let kinds: Vec<DeviceType> = all.device_handle.iter().map(DeviceHandle::device_type).collect();
    assert_eq!(kinds.iter().filter(|&&kind| kind == DeviceType::BigActuator).count(), 4);
    assert_eq!(kinds.iter().filter(|&&kind| kind == DeviceType::SmallActuator).count(), 3);
    let mut names = Vec::new();
    for device in &all.device_handle {
        let id = device.device_identifier as u8;
        let kind: DeviceTypeInformation =
            link.call_device(device_config::GET_DEVICE_TYPE, id, &()).unwrap();
        assert_eq!(kind.device_type(), device.device_type());
        let serial: SerialNumber =
            link.call_device(device_config::GET_SERIAL_NUMBER, id, &()).unwrap();
        let mac: MacAddress = link.call_device(device_config::GET_MAC_ADDRESS, id, &()).unwrap();
        assert_eq!(mac.mac_address.len(), 6);
        names.push(serial.serial_number);
        for call in [
            device_config::GET_FIRMWARE_VERSION,
            device_config::GET_BOOTLOADER_VERSION,
            device_config::GET_MODEL_NUMBER,
            device_config::GET_PART_NUMBER,
            device_config::GET_PART_NUMBER_REVISION,
        ] {
            let () = link.call_device(call, id, &()).unwrap();
        }
    }
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all.device_handle.len());
}

#[test]
fn home_and_a_pose_a_little_up_are_reached_and_notified() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let () = link.call(call::SET_SERVOING_MODE, &single_level()).unwrap();
    let kind = RequestedActionType { action_type: ActionType::ReachJointAngles as i32 };
    let actions: ActionList = link.call(call::READ_ALL_ACTIONS, &kind).unwrap();
    let home = actions.action_list.iter().find(|action| action.name == "Home").unwrap();
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let named: ActionHandle = home.handle.clone().unwrap();
    let () = link.call(call::EXECUTE_ACTION_FROM_REFERENCE, &named).unwrap();
    assert_eq!(until_over(&emulator, &link, handle).last().unwrap().0, ActionEvent::End);

    let feedback: Feedback = link.call(base_cyclic::REFRESH_FEEDBACK, &()).unwrap();
    let base = feedback.base.unwrap();
    // The tool at home, as the facts about the arm give it.
    assert!((base.tool_pose_x - 0.576_665).abs() < 1e-4, "{}", base.tool_pose_x);
    assert!((base.tool_pose_z - 0.433_724).abs() < 1e-4, "{}", base.tool_pose_z);
    let target = Pose {
        x: base.tool_pose_x,
        y: base.tool_pose_y - 0.1,
        z: base.tool_pose_z - 0.2,
        theta_x: base.tool_pose_theta_x,
        theta_y: base.tool_pose_theta_y,
        theta_z: base.tool_pose_theta_z,
    };
    let reach = ConstrainedPose { target_pose: Some(target.clone()), constraint: None };
    let action = Action {
        name: "example".into(),
        parameters: Some(ActionParameters::ReachPose(reach)),
        ..Action::default()
    };
    let () = link.call(call::EXECUTE_ACTION, &action).unwrap();
    let told = until_over(&emulator, &link, handle);
    assert_eq!(told[0].0, ActionEvent::Start);
    assert_eq!(told.last().unwrap().0, ActionEvent::End);
    let there: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!((there.y - target.y).abs() < 1e-3 && (there.z - target.z).abs() < 1e-3, "{there:?}");

    let count: ActuatorInformation = link.call(call::GET_ACTUATOR_COUNT, &()).unwrap();
    let zeros = (0..count.count).map(|joint| JointAngle { joint_identifier: joint, value: 0.0 });
    let zeros = JointAngles { joint_angles: zeros.collect() };
    let reach = ConstrainedJointAngles { joint_angles: Some(zeros), constraint: None };
    let action = Action {
        parameters: Some(ActionParameters::ReachJointAngles(reach.clone())),
        ..Action::default()
    };
    let () = link.call(call::EXECUTE_ACTION, &action).unwrap();
    until_over(&emulator, &link, handle);
    let angles: JointAngles = link.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
    for angle in &angles.joint_angles {
        assert!(angle.value < 0.01 || angle.value > 359.99, "{angle:?}");
    }
    // The deprecated way of saying the same is notified too.
    let () = link.call(call::PLAY_JOINT_TRAJECTORY, &reach).unwrap();
    assert_eq!(until_over(&emulator, &link, handle).last().unwrap().0, ActionEvent::End);
}

#[test]
fn a_twist_moves_the_tool_until_it_is_stopped() {
    let emulator = emulator(&eager());
    let clock = emulator.clock();
    let link = link(&emulator);
    let before: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    let twist = Twist { linear_z: 0.05, ..Twist::default() };
    // 3 is the base's frame.
    let command = TwistCommand { reference_frame: 3, twist: Some(twist), duration: 0 };
    let () = link.call(call::SEND_TWIST_COMMAND, &command).unwrap();
    clock.sleep(2.0);
    let () = link.call(call::STOP, &()).unwrap();
    clock.sleep(1.0);
    let after: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    let risen = after.z - before.z;
    // Two seconds at 50 mm/s and the way to a stop; how late the calls came is the machine's affair.
    assert!(risen > 0.08, "{risen}");
    assert!((after.x - before.x).abs() < 0.01 && (after.y - before.y).abs() < 0.01);
    clock.sleep(0.5);
    let still: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!((still.z - after.z).abs() < 1e-5);
}

#[test]
fn joint_speeds_turn_the_joints_they_name() {
    let emulator = emulator(&eager());
    let clock = emulator.clock();
    let link = link(&emulator);
    let angle = |joint: usize| {
        let all: JointAngles = link.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
        all.joint_angles[joint].value
    };
    let before = angle(3);
    let speed = JointSpeed { joint_identifier: 3, value: 10.0, duration: 0 };
    let speeds = JointSpeeds { joint_speeds: vec![speed], duration: 0 };
    let () = link.call(call::SEND_JOINT_SPEEDS_COMMAND, &speeds).unwrap();
    clock.sleep(1.0);
    let () = link.call(call::STOP, &()).unwrap();
    clock.sleep(0.5);
    assert!(angle(3) - before > 8.0, "{before} to {}", angle(3));
    assert!(angle(0) < 1e-3);
}

fn angular(angles: [f32; 7], duration: f32) -> Waypoint {
    let waypoint =
        AngularWaypoint { angles: angles.to_vec(), maximum_velocities: vec![], duration };
    Waypoint { name: String::new(), kind: Some(WaypointKind::AngularWaypoint(waypoint)) }
}

#[test]
fn waypoints_are_validated_followed_and_ticked_off() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let product: CompleteProductConfiguration =
        link.call(call::GET_PRODUCT_CONFIGURATION, &()).unwrap();
    assert_eq!(product.model(), ModelId::L53);
    let list = WaypointList {
        waypoints: vec![
            angular([10.0, 15.0, 180.0, 230.0, 0.0, 55.0, 90.0], 2.0),
            angular([350.0, 0.0, 180.0, 230.0, 20.0, 55.0, 90.0], 3.0),
            angular([0.0, 15.0, 180.0, 230.0, 0.0, 55.0, 90.0], 3.0),
        ],
        duration: 0.0,
        use_optimal_blending: false,
    };
    let report: WaypointValidationReport = link.call(call::VALIDATE_WAYPOINT_LIST, &list).unwrap();
    assert!(report.trajectory_error_report.unwrap().trajectory_error_elements.is_empty());
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let () = link.call(call::EXECUTE_WAYPOINT_TRAJECTORY, &list).unwrap();
    let told = until_over(&emulator, &link, handle);
    let events: Vec<ActionEvent> = told.iter().map(|(event, _)| *event).collect();
    assert_eq!(
        events,
        [
            ActionEvent::PreprocessStart,
            ActionEvent::PreprocessEnd,
            ActionEvent::Start,
            ActionEvent::Feedback,
            ActionEvent::Feedback,
            ActionEvent::Feedback,
            ActionEvent::End
        ]
    );

    let pose: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    let lines = [0.05_f32, 0.0].map(|up| {
        let waypoint = CartesianWaypoint {
            pose: Some(Pose { z: pose.z + up, ..pose.clone() }),
            reference_frame: 3,
            ..CartesianWaypoint::default()
        };
        Waypoint { name: String::new(), kind: Some(WaypointKind::CartesianWaypoint(waypoint)) }
    });
    let list = WaypointList { waypoints: lines.to_vec(), ..WaypointList::default() };
    let () = link.call(call::EXECUTE_WAYPOINT_TRAJECTORY, &list).unwrap();
    assert_eq!(until_over(&emulator, &link, handle).last().unwrap().0, ActionEvent::End);
    let back: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!((back.z - pose.z).abs() < 1e-4);
}

#[test]
fn the_torque_example_cycles_over_udp_and_returns_to_position_control() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let soon = std::time::Duration::from_secs(2);
    let feedback: Feedback = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon).unwrap();
    let mut command = Command {
        frame_id: 0,
        actuators: feedback
            .actuators
            .iter()
            .map(|actuator| ActuatorCommand {
                flags: 1,
                position: actuator.position,
                ..ActuatorCommand::default()
            })
            .collect(),
        interconnect: None,
    };
    let refused = cyclic.call::<Feedback>(base_cyclic::REFRESH, &command, soon).unwrap_err();
    assert!(refused.is_refusal(refusal::WRONG_SERVOING_MODE), "{refused}");
    let () = link.call(call::SET_SERVOING_MODE, &low_level()).unwrap();
    let _: Feedback = cyclic.call(base_cyclic::REFRESH, &command, soon).unwrap();
    let torque = ActuatorModeInformation { control_mode: ActuatorMode::Torque as i32 };
    let () = link.call_device(actuator_config::SET_CONTROL_MODE, 1, &torque).unwrap();
    for _ in 0..50 {
        command.frame_id += 1;
        match cyclic.call::<Feedback>(base_cyclic::REFRESH, &command, soon) {
            Ok(feedback) => {
                command.actuators[0].position = feedback.actuators[0].position;
                assert_eq!(feedback.frame_id, command.frame_id);
            }
            // A machine that pauses for a tenth of a second is told so, as by an arm.
            Err(LinkError::Refused(no)) => assert_eq!(no.sub_code, refusal::WRONG_SERVOING_MODE),
            Err(other) => panic!("{other}"),
        }
    }
    let position = ActuatorModeInformation { control_mode: ActuatorMode::Position as i32 };
    let () = link.call_device(actuator_config::SET_CONTROL_MODE, 1, &position).unwrap();
    let () = link.call(call::SET_SERVOING_MODE, &single_level()).unwrap();
}
