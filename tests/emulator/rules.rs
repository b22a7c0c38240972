//! What the controller refuses, whom it lets command, and what stops a movement.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use trueup::emulator::{Faults, Options, Pace};
use trueup::kortex::clock::{Clock as _, Wall};
use trueup::kortex::frame::{Decoder, Frame, MAGIC};
use trueup::kortex::link::{Link, LinkError, Login};
use trueup::kortex::messages::base::{ActionEvent, ArmStateInformation};
use trueup::kortex::messages::common::ArmState;
use trueup::kortex::messages::config::{
    ControlModeInformation, JointSpeedSoftLimits, KinematicLimits,
};
use trueup::kortex::messages::motion::{
    ConstrainedJointAngles, Finger, Gripper, GripperCommand, GripperMode, GripperRequest,
    JointAngle, JointAngles, JointSpeed, JointSpeeds,
};
use trueup::kortex::messages::session::CreateSessionInfo;
use trueup::kortex::messages::trajectory::{
    AngularWaypoint, TrajectoryErrorType, Waypoint, WaypointKind, WaypointList,
    WaypointValidationReport,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{self, base as call, control_config};

use prost::Message;

use super::{admin, eager, emulator, link, until_over};

fn speed(joint: u32, value: f32) -> JointSpeeds {
    let speed = JointSpeed { joint_identifier: joint, value, duration: 0 };
    JointSpeeds { joint_speeds: vec![speed], duration: 0 }
}

fn home_but(joint: usize, degrees: f32) -> [f32; 7] {
    let mut angles = [0.0, 15.0, 180.0, 230.0, 0.0, 55.0, 90.0];
    angles[joint] = degrees;
    angles
}

fn waypoints(list: &[([f32; 7], f32)]) -> WaypointList {
    let waypoints = list.iter().map(|(angles, duration)| {
        let waypoint = AngularWaypoint {
            angles: angles.to_vec(),
            maximum_velocities: Vec::new(),
            duration: *duration,
        };
        Waypoint { name: String::new(), kind: Some(WaypointKind::AngularWaypoint(waypoint)) }
    });
    WaypointList { waypoints: waypoints.collect(), ..WaypointList::default() }
}

#[test]
fn wrong_user_wrong_password_and_no_session_are_told_apart() {
    let emulator = emulator(&eager());
    let open = |user: &str, password: &str| {
        let login = Login { user: user.into(), password: password.into() };
        Link::open(emulator.tcp(), &login, Duration::from_secs(5)).unwrap_err()
    };
    assert!(open("nobody", "admin").is_refusal(refusal::USER_NOT_FOUND));
    let wrong = open("admin", "guess");
    assert!(wrong.is_refusal(refusal::INVALID_PASSWORD));
    assert!(wrong.help().contains("KORTEX_PASSWORD"), "{}", wrong.help());
    // A frame of a session that never was.
    let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let frame = Frame::request(call::GET_ARM_STATE, 0, 77, 1, Vec::new());
    stream.write_all(&frame.encode_stream().unwrap()).unwrap();
    let answer = next(&mut stream);
    assert_eq!(answer.header.sub_error, refusal::INVALID_SESSION);
    assert_eq!(answer.header.message, 1);
}

fn next(stream: &mut TcpStream) -> Frame {
    let mut decoder = Decoder::default();
    let mut buffer = [0; 4096];
    loop {
        if let Some(frame) = decoder.next_frame().unwrap() {
            return frame;
        }
        let n = stream.read(&mut buffer).unwrap();
        assert!(n > 0, "the connection was closed");
        decoder.push(&buffer[..n]);
    }
}

/// Nothing was answered, and a client waited out its time.
#[test]
fn a_frame_of_another_header_version_is_answered_so() {
    let emulator = emulator(&eager());
    let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let frame = Frame::request(call::GET_ARM_STATE, 0, 77, 5, Vec::new());
    let mut bytes = frame.encode_stream().unwrap();
    // Twelve bytes before the frame, then header, length and word: of its four bytes the last has version and kind.
    assert_eq!(bytes[18], 0x11);
    bytes[18] = 0x21;
    stream.write_all(&bytes).unwrap();
    let answer = next(&mut stream).header;
    let told = (answer.sub_error, answer.session, answer.message);
    assert_eq!(told, (refusal::INCOMPATIBLE_HEADER_VERSION, 77, 5));
}

#[test]
fn rubbish_ends_its_own_connection_and_nobody_elses() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    for rubbish in [&b"GET / HTTP/1.1\r\n\r\n"[..], &[&MAGIC[..], &[0xff; 4]].concat()] {
        let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream.write_all(rubbish).unwrap();
        // Closed with what was not read may show as a reset.
        assert_eq!(stream.read(&mut [0; 16]).unwrap_or(0), 0);
    }
    let state: ArmStateInformation = link.call(call::GET_ARM_STATE, &()).unwrap();
    assert_eq!(state.active_state(), ArmState::ServoingReady);
}

#[test]
fn a_path_that_breaks_a_limit_is_refused_with_joint_waypoint_value_and_limit() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let first = |list: &WaypointList| {
        let report: WaypointValidationReport =
            link.call(call::VALIDATE_WAYPOINT_LIST, list).unwrap();
        report.trajectory_error_report.unwrap().trajectory_error_elements.swap_remove(0)
    };
    // 100 deg in 1 s with joint 1.
    let fast = first(&waypoints(&[(home_but(0, 0.0), 1.0), (home_but(0, 100.0), 1.0)]));
    assert_eq!(fast.error_type(), TrajectoryErrorType::InvalidJointSpeed);
    assert_eq!((fast.index, fast.waypoint_index), (0, 1));
    assert!((fast.error_value - 100.0).abs() < 0.1 && (fast.max_value - 80.0).abs() < 0.1);
    // Joint 2 goes to 130 deg at most.
    let far = first(&waypoints(&[(home_but(1, 135.0), 9.0)]));
    assert_eq!(far.error_type(), TrajectoryErrorType::InvalidJointPosition);
    assert_eq!(far.index, 1);
    assert!((far.max_value - 128.34).abs() < 0.1, "{}", far.max_value);
    // 9 deg forth and back in a tenth of a second each is slow enough but too sudden.
    let sudden = first(&waypoints(&[(home_but(4, 6.0), 0.1), (home_but(4, 0.0), 0.1)]));
    assert_eq!(sudden.error_type(), TrajectoryErrorType::InvalidAcceleration);
    let short = first(&waypoints(&[(home_but(4, 0.0), 0.0)]));
    assert_eq!(short.error_type(), TrajectoryErrorType::InvalidDuration);
    let none = first(&WaypointList::default());
    assert_eq!(none.error_type(), TrajectoryErrorType::InvalidTrajectorySize);
    // Executed all the same, the action is given up before anything moves.
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let list = waypoints(&[(home_but(1, 135.0), 9.0)]);
    let () = link.call(call::EXECUTE_WAYPOINT_TRAJECTORY, &list).unwrap();
    let told = until_over(&emulator, &link, handle);
    let expected = [
        (ActionEvent::PreprocessStart, 0),
        (ActionEvent::PreprocessAbort, refusal::METHOD_FAILED),
        (ActionEvent::Abort, refusal::CONTROL_WAYPOINT_TRAJECTORY_ABORTED),
    ];
    assert_eq!(told, expected.map(|(event, why)| (event, i32::from(why))));
}

#[test]
fn soft_limits_are_read_set_and_obeyed() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let slow = JointSpeedSoftLimits { control_mode: 4, joint_speed_soft_limits: vec![10.0; 7] };
    let () = link.call(control_config::SET_JOINT_SPEED_SOFT_LIMITS, &slow).unwrap();
    let mode = ControlModeInformation { control_mode: 4 };
    let limits: KinematicLimits =
        link.call(control_config::GET_KINEMATIC_SOFT_LIMITS, &mode).unwrap();
    assert_eq!(limits.joint_speed_limits, vec![10.0; 7]);
    let report: WaypointValidationReport =
        link.call(call::VALIDATE_WAYPOINT_LIST, &waypoints(&[(home_but(0, 20.0), 1.0)])).unwrap();
    assert!(!report.trajectory_error_report.unwrap().trajectory_error_elements.is_empty());
    let fast = JointSpeedSoftLimits { control_mode: 4, joint_speed_soft_limits: vec![100.0; 7] };
    let refused = link.call::<()>(control_config::SET_JOINT_SPEED_SOFT_LIMITS, &fast).unwrap_err();
    assert!(refused.is_refusal(refusal::VALUE_IS_ABOVE_MAXIMUM), "{refused}");
}

#[test]
fn an_emergency_stop_holds_until_it_is_cleared() {
    let emulator = emulator(&eager());
    let clock = emulator.clock();
    let link = link(&emulator);
    let () = link.call(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 20.0)).unwrap();
    clock.sleep(0.5);
    let () = link.call(call::APPLY_EMERGENCY_STOP, &()).unwrap();
    let state: ArmStateInformation = link.call(call::GET_ARM_STATE, &()).unwrap();
    assert_eq!(state.active_state(), ArmState::InFault);
    let refused = link.call::<()>(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 20.0)).unwrap_err();
    assert!(refused.is_refusal(refusal::ROBOT_IN_EMERGENCY_STOP), "{refused}");
    let () = link.call(call::CLEAR_FAULTS, &()).unwrap();
    let () = link.call(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 20.0)).unwrap();
}

#[test]
fn a_second_client_may_look_but_not_command() {
    let emulator = emulator(&eager());
    let (first, second) = (link(&emulator), link(&emulator));
    let () = first.call(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 5.0)).unwrap();
    let refused = second.call::<()>(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 5.0)).unwrap_err();
    assert!(refused.is_refusal(refusal::SESSION_NOT_IN_CONTROL), "{refused}");
    let _: JointAngles = second.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
    // Anyone may stop the arm.
    let () = second.call(call::STOP, &()).unwrap();
    // Control is free as soon as its holder is gone.
    drop(first);
    let () = second.call(call::SEND_JOINT_SPEEDS_COMMAND, &speed(0, 5.0)).unwrap();
}

#[test]
fn a_movement_stops_when_its_commander_falls_silent() {
    let emulator = emulator(&Options::default());
    let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let login = CreateSessionInfo {
        username: "admin".into(),
        session_inactivity_timeout: 60_000,
        password: "admin".into(),
        connection_inactivity_timeout: 300,
    };
    let hello = Frame::request(rpc::session::CREATE_SESSION, 0, 0, 1, login.encode_to_vec());
    stream.write_all(&hello.encode_stream().unwrap()).unwrap();
    let session = next(&mut stream).header.session;
    let go = speed(0, 20.0).encode_to_vec();
    let go = Frame::request(call::SEND_JOINT_SPEEDS_COMMAND, 0, session, 2, go);
    stream.write_all(&go.encode_stream().unwrap()).unwrap();
    assert_eq!(next(&mut stream).header.error, 0);
    // No sign of life from here on; another client watches.
    let watching = link(&emulator);
    let angle = || {
        let all: JointAngles = watching.call(call::GET_MEASURED_JOINT_ANGLES, &()).unwrap();
        all.joint_angles[0].value
    };
    Wall.sleep(1.5);
    let stopped = angle();
    assert!(stopped > 1.0, "it did not move: {stopped}");
    Wall.sleep(0.3);
    assert!((angle() - stopped).abs() < 1e-3, "it still moves");
}

#[test]
fn a_session_that_is_silent_is_closed() {
    let emulator = emulator(&Options::default());
    let mut stream = TcpStream::connect(emulator.tcp()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    let login = CreateSessionInfo {
        username: "admin".into(),
        session_inactivity_timeout: 100,
        password: "admin".into(),
        connection_inactivity_timeout: 100,
    };
    let hello = Frame::request(rpc::session::CREATE_SESSION, 0, 0, 1, login.encode_to_vec());
    stream.write_all(&hello.encode_stream().unwrap()).unwrap();
    let session = next(&mut stream).header.session;
    Wall.sleep(0.5);
    let late = Frame::request(rpc::session::KEEP_ALIVE, 0, session, 2, Vec::new());
    stream.write_all(&late.encode_stream().unwrap()).unwrap();
    assert_eq!(next(&mut stream).header.sub_error, refusal::INVALID_SESSION);
    assert_eq!(emulator.status().sessions, 0);
}

#[test]
fn an_action_is_refused_while_another_runs_and_aborted_by_a_stop() {
    let emulator = emulator(&Options { pace: Pace::Real, ..Options::default() });
    let link = link(&emulator);
    let handle = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let far = home_but(0, 90.0);
    let angles =
        far.iter().zip(0..).map(|(&value, joint)| JointAngle { joint_identifier: joint, value });
    let goal = ConstrainedJointAngles {
        joint_angles: Some(JointAngles { joint_angles: angles.collect() }),
        constraint: None,
    };
    let () = link.call(call::PLAY_JOINT_TRAJECTORY, &goal).unwrap();
    let refused = link.call::<()>(call::PLAY_JOINT_TRAJECTORY, &goal).unwrap_err();
    assert!(refused.is_refusal(refusal::ROBOT_MOVEMENT_IN_PROGRESS), "{refused}");
    let () = link.call(call::STOP, &()).unwrap();
    let told = until_over(&emulator, &link, handle);
    let abort = (ActionEvent::Abort, i32::from(refusal::CONTROL_MANUAL_STOP));
    assert_eq!(told.last(), Some(&abort));
}

#[test]
fn the_gripper_closes_by_position_and_opens_by_a_positive_speed() {
    let emulator = emulator(&eager());
    let clock = emulator.clock();
    let link = link(&emulator);
    let send = |mode: GripperMode, value: f32| {
        let finger = Finger { finger_identifier: 1, value };
        let gripper = Gripper { finger: vec![finger] };
        let command = GripperCommand { mode: mode as i32, gripper: Some(gripper), duration: 0 };
        link.call::<()>(call::SEND_GRIPPER_COMMAND, &command)
    };
    let position = || {
        let asked = GripperRequest { mode: GripperMode::Position as i32 };
        let told: Gripper = link.call(call::GET_MEASURED_GRIPPER_MOVEMENT, &asked).unwrap();
        told.finger[0].value
    };
    send(GripperMode::Position, 0.6).unwrap();
    clock.sleep(1.5);
    assert!((position() - 0.6).abs() < 0.01, "{}", position());
    send(GripperMode::Speed, 0.5).unwrap();
    clock.sleep(1.5);
    assert!(position() < 0.01, "{}", position());
    assert!(send(GripperMode::Force, 0.5).unwrap_err().is_refusal(refusal::UNIMPLEMENTED));
    assert!(send(GripperMode::Position, 1.5).unwrap_err().is_refusal(refusal::INVALID_PARAM));
}

#[test]
fn faults_on_demand_are_read_and_mistakes_in_them_are_told() {
    let faults: Faults = "drop=0.01, stall=3s@10s,delay=20ms,estop=2s".parse().unwrap();
    assert_eq!((faults.drop, faults.stall, faults.stall_at), (0.01, 3.0, 10.0));
    assert_eq!((faults.delay, faults.estop), (Duration::from_millis(20), Some(2.0)));
    for (text, word) in [
        ("drop=2", "a share from 0 to 1"),
        ("stall=3", "a time such as 3s or 20ms"),
        ("flood=1", "there is no fault `flood`"),
        ("drop", "NAME=VALUE"),
    ] {
        let error = text.parse::<Faults>().unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn unknown_refusals_stalls_and_cut_connections_are_clear_errors() {
    let with = |text: &str| {
        let faults = text.parse().unwrap();
        emulator(&Options { faults, ..eager() })
    };
    let garbled = with("unknown=1");
    let error = Link::open(garbled.tcp(), &admin(), Duration::from_secs(2)).unwrap_err();
    assert!(error.to_string().contains("sub-code 999"), "{error}");

    let stalled = with("stall=60s@0s");
    let error = Link::open(stalled.tcp(), &admin(), Duration::from_millis(300)).unwrap_err();
    assert!(matches!(error, LinkError::Silent { milliseconds: 300, .. }), "{error}");

    let cut = with("cut=100ms");
    let link = link(&cut);
    Wall.sleep(0.5);
    let error = link.call::<()>(call::GET_ARM_STATE, &()).unwrap_err();
    assert!(error.is_lost(), "{error}");
}
