//! Every call there is a name for is answered, and what the vendor's examples send is answered so that each
//! would come to its end.

use prost::Message;

use trueup::emulator::{Emulator, Options};
use trueup::kortex::link::{Datagrams, Link, LinkError};
use trueup::kortex::messages::base::{ActionEvent, ServoingMode, ServoingModeInformation};
use trueup::kortex::messages::cyclic::{
    ActuatorCommand, Command, Feedback, GripperCyclicCommand, InterconnectCommand, MotorCommand,
    ToolCommand, ToolFeedback,
};
use trueup::kortex::messages::motion::{IkData, JointAngle, JointAngles, Pose};
use trueup::kortex::messages::trajectory::{
    AngularWaypoint, CartesianWaypoint, Waypoint, WaypointKind, WaypointList,
    WaypointValidationReport,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{self, Rpc, base as call, base_cyclic};

use super::{admin, eager, emulator, link, until_over};

/// Service and function numbers of what the notes on the protocol list for `Base` (their section 5).
const LISTED: &[u16] = &[
    48, 47, 44, 43, 42, 50, 49, 51, 112, 145, 146, 126, 115, 233, 234, 124, 125, 109, 110, 111,
    197, 226, 235, 207, 132, 133, 121, 120, 187, 118, 136, 137, 139, 152, 153, 175, 151, 150, 171,
    198, 224, 20, 24, 15, 17, 162, 223, 166, 97, 98, 99, 100, 101, 102, 103, 104, 105, 106, 107,
    154, 164, 174, 176,
];

#[test]
fn every_call_of_the_protocols_lists_has_a_name_here() {
    let missing = |service: u16, functions: &[u16]| {
        let unknown = functions.iter().filter(|&&function| Rpc::find(service, function).is_none());
        unknown.copied().collect::<Vec<u16>>()
    };
    assert_eq!(missing(1, &[1, 2, 3, 4]), [0_u16; 0]);
    assert_eq!(missing(2, LISTED), [0_u16; 0]);
    assert_eq!(missing(3, &[1, 2, 3, 4]), [0_u16; 0]);
    assert_eq!(missing(9, &[3, 4, 5, 6, 7, 8, 9, 12, 23, 28]), [0_u16; 0]);
    assert_eq!(missing(10, &[6, 7, 24, 25, 26]), [0_u16; 0]);
    let control: Vec<u16> = (1..=32).filter(|function| !matches!(function, 11 | 12)).collect();
    assert_eq!(missing(16, &control), [0_u16; 0]);
    assert_eq!(missing(23, &[1]), [0_u16; 0]);
}

#[test]
fn no_call_with_a_name_is_answered_as_unknown() {
    let emulator = emulator(&eager());
    for rpc in rpc::ALL {
        // These end the session they are called in, and are tried elsewhere.
        let ends = [rpc::session::CREATE_SESSION, rpc::session::CLOSE_SESSION, call::REBOOT];
        if ends.contains(rpc) {
            continue;
        }
        // A session each, so that nothing one call did keeps another from being answered.
        let link = link(&emulator);
        let answered = link.call_device::<()>(*rpc, u8::from(rpc.service == 10), &());
        match answered {
            Ok(()) => {}
            Err(LinkError::Refused(no)) => {
                let unknown = [refusal::UNSUPPORTED_METHOD, refusal::UNSUPPORTED_SERVICE];
                assert!(!unknown.contains(&no.sub_code), "{rpc}: {no}");
            }
            Err(error) => panic!("{rpc}: {error}"),
        }
        let () = link.call(call::CLEAR_FAULTS, &()).unwrap();
        let () = link.call(call::STOP, &()).unwrap();
    }
}

fn degrees(angles: &[f32]) -> Vec<JointAngle> {
    // The vendor's sequence and kinematics examples leave the joints' names out.
    angles.iter().map(|&value| JointAngle { joint_identifier: 0, value }).collect()
}

/// Lets the arm follow a list and returns the last thing told of it.
fn follow(emulator: &Emulator, link: &Link, list: &WaypointList) -> ActionEvent {
    let report: WaypointValidationReport = link.call(call::VALIDATE_WAYPOINT_LIST, list).unwrap();
    let wrong = report.trajectory_error_report.unwrap().trajectory_error_elements;
    assert!(wrong.is_empty(), "{wrong:?}");
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let () = link.call(call::EXECUTE_WAYPOINT_TRAJECTORY, list).unwrap();
    until_over(emulator, link, handle).last().unwrap().0
}

#[test]
fn the_waypoints_of_the_vendors_cartesian_example_are_valid_and_reached() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let points: [[f32; 4]; 7] = [
        [0.7, 0.0, 0.5, 0.0],
        [0.7, 0.0, 0.33, 0.1],
        [0.7, 0.48, 0.33, 0.1],
        [0.61, 0.22, 0.4, 0.1],
        [0.7, 0.48, 0.33, 0.1],
        [0.63, -0.22, 0.45, 0.1],
        [0.65, 0.05, 0.33, 0.0],
    ];
    let waypoint = |[x, y, z, blending_radius]: [f32; 4]| {
        let pose = Pose { x, y, z, theta_x: 90.0, theta_y: 0.0, theta_z: 90.0 };
        let waypoint = CartesianWaypoint {
            pose: Some(pose),
            reference_frame: 3,
            blending_radius,
            ..CartesianWaypoint::default()
        };
        Waypoint { name: String::new(), kind: Some(WaypointKind::CartesianWaypoint(waypoint)) }
    };
    let waypoints: Vec<Waypoint> = points.into_iter().map(waypoint).collect();
    for use_optimal_blending in [false, true] {
        let list =
            WaypointList { waypoints: waypoints.clone(), duration: 0.0, use_optimal_blending };
        assert_eq!(follow(&emulator, &link, &list), ActionEvent::End);
    }
    let pose: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!((pose.x - 0.65).abs() < 1e-3 && (pose.z - 0.33).abs() < 1e-3, "{pose:?}");
}

#[test]
fn the_waypoints_of_the_vendors_angular_example_are_valid_and_reached() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let points: [[f32; 7]; 7] = [
        [360.0, 35.6, 180.7, 281.8, 0.8, 23.8, 88.9],
        [359.6, 49.1, 181.0, 272.1, 0.3, 47.0, 89.1],
        [320.5, 76.5, 166.5, 335.5, 293.4, 46.1, 165.6],
        [335.6, 38.8, 177.0, 266.1, 323.9, 49.7, 117.3],
        [320.4, 76.5, 166.5, 335.5, 293.4, 46.1, 165.6],
        [28.8, 36.7, 174.7, 273.2, 40.8, 39.5, 59.8],
        [360.0, 45.6, 171.0, 251.9, 352.2, 54.3, 101.0],
    ];
    let waypoints = points.iter().enumerate().map(|(at, angles)| {
        // Five seconds each, and thirty where the example gives the small joints more time.
        let duration = if matches!(at, 4 | 6) { 30.0 } else { 5.0 };
        let waypoint =
            AngularWaypoint { angles: angles.to_vec(), maximum_velocities: Vec::new(), duration };
        Waypoint { name: String::new(), kind: Some(WaypointKind::AngularWaypoint(waypoint)) }
    });
    let list = WaypointList { waypoints: waypoints.collect(), ..WaypointList::default() };
    let report: WaypointValidationReport = link.call(call::VALIDATE_WAYPOINT_LIST, &list).unwrap();
    assert!(report.trajectory_error_report.unwrap().trajectory_error_elements.is_empty());
    // The whole takes 85 s of the arm's time; that it begins is enough here.
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let () = link.call(call::EXECUTE_WAYPOINT_TRAJECTORY, &list).unwrap();
    let () = link.call(call::STOP, &()).unwrap();
    let told = until_over(&emulator, &link, handle);
    assert!(told.iter().any(|(event, _)| *event == ActionEvent::Start), "{told:?}");
}

#[test]
fn kinematics_forth_and_back_find_the_arm_where_it_is_without_the_joints_names() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let now: JointAngles = link.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
    let values: Vec<f32> = now.joint_angles.iter().map(|angle| angle.value).collect();
    let unnamed = JointAngles { joint_angles: degrees(&values) };
    let pose: Pose = link.call(call::COMPUTE_FORWARD_KINEMATICS, &unnamed).unwrap();
    let measured: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    assert!((pose.x - measured.x).abs() < 1e-5 && (pose.z - measured.z).abs() < 1e-5);
    let guess: Vec<f32> = values.iter().map(|value| value - 1.0).collect();
    let guess = Some(JointAngles { joint_angles: degrees(&guess) });
    let asked = IkData { cartesian_pose: Some(pose), guess };
    let found: JointAngles = link.call(call::COMPUTE_INVERSE_KINEMATICS, &asked).unwrap();
    for (found, value) in found.joint_angles.iter().zip(values) {
        let off = (found.value - value + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 2.0, "joint {}: {} for {value}", found.joint_identifier, found.value);
    }
}

/// The vendor's gripper example over UDP: a position and a speed every cycle, frames that are not counted.
#[test]
fn the_fingers_follow_a_proportional_loop_whose_frames_are_all_number_zero() {
    let emulator = emulator(&Options { patience: 5.0, ..Options::default() });
    let link = link(&emulator);
    let mut cyclic = Datagrams::open(emulator.udp(), &admin()).unwrap();
    let soon = std::time::Duration::from_secs(2);
    let told: Feedback = cyclic.call(base_cyclic::REFRESH_FEEDBACK, &(), soon).unwrap();
    let low = ServoingModeInformation { servoing_mode: ServoingMode::LowLevel as i32 };
    let () = link.call(call::SET_SERVOING_MODE, &low).unwrap();
    let closed = |told: &Feedback| {
        let tool = told.interconnect.as_ref().unwrap().tool_feedback.clone();
        let Some(ToolFeedback::GripperFeedback(gripper)) = tool else { panic!("no gripper") };
        gripper.motor[0].position
    };
    let actuators = told.actuators.iter().map(|actuator| ActuatorCommand {
        position: actuator.position,
        ..ActuatorCommand::default()
    });
    let mut command = Command { frame_id: 0, actuators: actuators.collect(), interconnect: None };
    let mut send = |position: f32, velocity: f32| -> Feedback {
        let motor = MotorCommand { motor_id: 0, position, velocity, force: 100.0 };
        let gripper = GripperCyclicCommand { motor_cmd: vec![motor], ..Default::default() };
        command.interconnect = Some(InterconnectCommand {
            tool_command: Some(ToolCommand::GripperCommand(gripper)),
            ..InterconnectCommand::default()
        });
        cyclic.call(base_cyclic::REFRESH, &command, soon).unwrap()
    };
    for target in [80.0_f32, 30.0] {
        let mut now = closed(&send(target, 0.0));
        let mut cycles = 0;
        while (target - now).abs() >= 1.5 {
            now = closed(&send(target, (2.0 * (target - now).abs()).min(100.0)));
            cycles += 1;
            assert!(cycles < 200_000, "the fingers are at {now} per cent, not at {target}");
        }
        send(target, 0.0);
    }
    let single = ServoingModeInformation { servoing_mode: ServoingMode::SingleLevel as i32 };
    let () = link.call(call::SET_SERVOING_MODE, &single).unwrap();
}

#[test]
fn a_list_of_waypoints_too_long_to_be_read_is_refused_and_the_next_call_answered() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let list = WaypointList { waypoints: vec![Waypoint::default(); 5000], ..Default::default() };
    assert!(list.encoded_len() > 5000);
    let report: WaypointValidationReport = link.call(call::VALIDATE_WAYPOINT_LIST, &list).unwrap();
    assert_eq!(report.trajectory_error_report.unwrap().trajectory_error_elements.len(), 1);
    let () = link.call(call::GET_ARM_STATE, &()).unwrap();
}
