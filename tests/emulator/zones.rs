//! Protection zones: kept as they were made, told when the tool comes near, and heeded by what the base commands.

use prost::Message;

use trueup::emulator::Emulator;
use trueup::kortex::link::Link;
use trueup::kortex::messages::base::{Action, ActionEvent, ActionParameters};
use trueup::kortex::messages::common::{RotationMatrix, RotationMatrixRow};
use trueup::kortex::messages::motion::{ConstrainedPose, Pose, Twist, TwistCommand};
use trueup::kortex::messages::sequence::{
    CartesianLimitation, Point, ProtectionZone, ProtectionZoneEvent, ProtectionZoneHandle,
    ProtectionZoneList, ProtectionZoneNotification, ZoneShape,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::base as call;

use super::{eager, emulator, link, until_over};

fn tool(link: &Link) -> Pose {
    link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap()
}

/// A wall, 10 cm thick, whose near face is `away` m in front of the tool.
fn wall(at: &Pose, away: f32) -> ProtectionZone {
    let shape = ZoneShape {
        shape_type: 3,
        origin: Some(Point { x: at.x + away + 0.05, y: at.y, z: at.z }),
        dimensions: vec![0.1, 0.8, 0.8],
        ..ZoneShape::default()
    };
    ProtectionZone {
        name: "a wall".into(),
        is_enabled: true,
        shape: Some(shape),
        ..ProtectionZone::default()
    }
}

fn slow(translation: f32) -> Vec<CartesianLimitation> {
    vec![CartesianLimitation { r#type: 3, translation, orientation: 0.0 }]
}

/// Sends a twist along x, m/s, for so many seconds; returns the fastest the tool was for certain beyond `from`, m/s.
///
/// The arm's time goes on while the tool's place is asked for, so that a place has a time before it and one after.
fn forward(emulator: &Emulator, link: &Link, speed: f32, seconds: f64, from: f32) -> f32 {
    let twist = Twist { linear_x: speed, ..Twist::default() };
    let command = TwistCommand { reference_frame: 3, twist: Some(twist), duration: 0 };
    let () = link.call(call::SEND_TWIST_COMMAND, &command).unwrap();
    let clock = emulator.clock();
    let until = clock.now() + seconds;
    let (mut asked, mut before) = (clock.now(), tool(link).x);
    let mut fastest = 0.0_f32;
    while clock.now() < until {
        clock.sleep(0.25);
        let asking = clock.now();
        let now = tool(link).x;
        if before > from {
            fastest = fastest.max((now - before).abs() / (clock.now() - asked) as f32);
        }
        (asked, before) = (asking, now);
    }
    fastest
}

fn told(link: &Link, handle: u16) -> Vec<ProtectionZoneEvent> {
    let notes = link.notes(handle);
    let read = notes.iter().map(|note| ProtectionZoneNotification::decode(&note.payload[..]));
    read.map(|note| note.unwrap().event()).collect()
}

#[test]
fn zones_are_kept_as_they_were_made_and_what_is_no_shape_is_refused() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let zone = wall(&tool(&link), 0.3);
    let handle: ProtectionZoneHandle = link.call(call::CREATE_PROTECTION_ZONE, &zone).unwrap();
    let all: ProtectionZoneList = link.call(call::READ_ALL_PROTECTION_ZONES, &()).unwrap();
    assert_eq!(all.protection_zones.len(), 1);
    let kept: ProtectionZone = link.call(call::READ_PROTECTION_ZONE, &handle).unwrap();
    assert_eq!(kept, ProtectionZone { handle: Some(handle.clone()), ..zone.clone() });
    let row = |a, b, c| Some(RotationMatrixRow { column1: a, column2: b, column3: c });
    let squashed = RotationMatrix {
        row1: row(1.0, 0.0, 0.0),
        row2: row(0.0, 0.5, 0.0),
        row3: row(0.0, 0.0, 1.0),
    };
    let shape = zone.shape.clone().unwrap();
    let flat = ZoneShape { dimensions: vec![0.05], ..shape.clone() };
    let squashed = ZoneShape { orientation: Some(squashed), ..shape };
    for shape in [flat, squashed] {
        let wrong = ProtectionZone { shape: Some(shape), ..zone.clone() };
        let refused = link.call::<()>(call::CREATE_PROTECTION_ZONE, &wrong).unwrap_err();
        assert!(refused.is_refusal(refusal::INVALID_PARAM), "{refused}");
    }
    let () = link.call(call::DELETE_PROTECTION_ZONE, &handle).unwrap();
    let all: ProtectionZoneList = link.call(call::READ_ALL_PROTECTION_ZONES, &()).unwrap();
    assert!(all.protection_zones.is_empty());
}

#[test]
fn the_tool_is_slow_near_a_zone_stops_before_it_and_may_go_back() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let topic = link.subscribe(call::ON_PROTECTION_ZONE_TOPIC).unwrap();
    let start = tool(&link);
    let mut zone = wall(&start, 0.12);
    zone.shape.as_mut().unwrap().envelope_thickness = 0.06;
    zone.envelope_limitations = slow(0.03);
    let _: ProtectionZoneHandle = link.call(call::CREATE_PROTECTION_ZONE, &zone).unwrap();
    let near = start.x + 0.07;
    let fastest = forward(&emulator, &link, 0.1, 6.0, near);
    let end = tool(&link).x;
    assert!(end < start.x + 0.12, "the tool went {} m in", end - start.x - 0.12);
    assert!(end > start.x + 0.10, "it stopped {} m before", start.x + 0.12 - end);
    assert!(fastest < 0.035, "{fastest} m/s in the envelope");
    assert_eq!(told(&link, topic), [ProtectionZoneEvent::Reached]);
    forward(&emulator, &link, -0.1, 3.0, f32::INFINITY);
    assert!(tool(&link).x < near, "it cannot leave");
    assert_eq!(told(&link, topic), [ProtectionZoneEvent::Exited]);
}

#[test]
fn an_action_into_a_zone_is_given_up_before_it_and_one_that_is_only_slow_is_entered() {
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let topic = link.subscribe(call::ON_PROTECTION_ZONE_TOPIC).unwrap();
    let actions = link.subscribe(call::ON_ACTION_TOPIC).unwrap();
    let start = tool(&link);
    let zone = wall(&start, 0.1);
    let handle: ProtectionZoneHandle = link.call(call::CREATE_PROTECTION_ZONE, &zone).unwrap();
    let goal = Pose { x: start.x + 0.13, ..start.clone() };
    let reach = ConstrainedPose { target_pose: Some(goal.clone()), constraint: None };
    let reach =
        Action { parameters: Some(ActionParameters::ReachPose(reach)), ..Action::default() };
    let () = link.call(call::EXECUTE_ACTION, &reach).unwrap();
    let over = until_over(&emulator, &link, actions);
    let given_up = (ActionEvent::Abort, i32::from(refusal::CONTROL_OUTSIDE_WORKSPACE));
    assert_eq!(*over.last().unwrap(), given_up);
    emulator.clock().sleep(1.0);
    assert!(tool(&link).x < start.x + 0.1);
    let open = ProtectionZone { handle: Some(handle), limitations: slow(0.05), ..zone };
    let () = link.call(call::UPDATE_PROTECTION_ZONE, &open).unwrap();
    let () = link.call(call::EXECUTE_ACTION, &reach).unwrap();
    assert_eq!(until_over(&emulator, &link, actions).last().unwrap().0, ActionEvent::End);
    assert!((tool(&link).x - goal.x).abs() < 1e-3);
    assert_eq!(told(&link, topic), [ProtectionZoneEvent::Entered]);
}
