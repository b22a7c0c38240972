//! Twists, speeds and durations that an arm cannot keep: slowed down where it slows down, refused where it refuses.

use nalgebra::{DVector, Vector3};
use trueup::emulator::Options;
use trueup::kortex::link::LinkError;
use trueup::kortex::messages::cyclic::Feedback;
use trueup::kortex::messages::motion::{
    CartesianConstraint, CartesianSpeed, CartesianTrajectoryConstraint, ConstrainedJointAngle,
    ConstrainedPose, Finger, Gripper, GripperCommand, JointSpeed, JointSpeeds,
    JointTrajectoryConstraint, JointTrajectoryConstraintType, Pose, Twist, TwistCommand,
};
use trueup::kortex::refusal;
use trueup::kortex::rpc::{base as call, base_cyclic};
use trueup::motion::robot::Robot;

use super::{eager, emulator, link};

/// 2 m/s along y went at 0.85 m/s, and at 0.44 m/s downward beside that: each joint was held to its own limit.
#[test]
fn a_twist_above_the_limits_is_slowed_down_and_keeps_its_direction() {
    let twists = [
        (Vector3::new(-1.0, 0.0, 0.0), Twist { linear_x: -2.0, ..Twist::default() }),
        (Vector3::new(0.0, 1.0, 0.0), Twist { linear_y: 2.0, ..Twist::default() }),
    ];
    for (along, twist) in twists {
        let emulator = emulator(&Options::default());
        let link = link(&emulator);
        let command = TwistCommand { reference_frame: 3, twist: Some(twist), duration: 0 };
        let () = link.call(call::SEND_TWIST_COMMAND, &command).unwrap();
        emulator.clock().sleep(0.4);
        let told: Feedback = link.call(base_cyclic::REFRESH_FEEDBACK, &()).unwrap();
        let radians = |degrees: f32| f64::from(degrees).to_radians();
        let q: Vec<f64> = told.actuators.iter().map(|joint| radians(joint.position)).collect();
        let dq = told.actuators.iter().map(|joint| radians(joint.velocity));
        let moves = Robot::gen3().jacobian(&q).unwrap() * DVector::from_iterator(q.len(), dq);
        let linear = Vector3::new(moves[0], moves[1], moves[2]);
        let turning = Vector3::new(moves[3], moves[4], moves[5]).norm();
        let speed = linear.dot(&along);
        // Where a joint limits it, or while it still gathers speed, it is slower than the arm's 0.5 m/s.
        assert!((0.1..0.505).contains(&speed), "{moves}");
        assert!((linear - along * speed).norm() < 0.02 && turning < 0.05, "{moves}");
    }
}

#[test]
fn what_cannot_be_kept_is_refused_with_the_number_of_its_reason() {
    use JointTrajectoryConstraintType::{Duration, Speed};
    let emulator = emulator(&eager());
    let link = link(&emulator);
    let no = |told: Result<(), LinkError>, why: u16| {
        let told = told.unwrap_err();
        assert!(told.is_refusal(why), "{told} is not {why}");
    };

    for (to, kind, value, why) in [
        (40.0, Duration, 0.1, refusal::CONTROL_INVALID_DURATION),
        (40.0, Duration, -1.0, refusal::CONTROL_INVALID_DURATION),
        (40.0, Speed, -5.0, refusal::CONTROL_INVALID_SPEED),
        (40.0, Speed, f32::NAN, refusal::INVALID_PARAM),
        (f32::NAN, Speed, 5.0, refusal::INVALID_PARAM),
    ] {
        let constraint = Some(JointTrajectoryConstraint { r#type: kind as i32, value });
        let goal = ConstrainedJointAngle { joint_identifier: 0, value: to, constraint };
        no(link.call(call::PLAY_SELECTED_JOINT_TRAJECTORY, &goal), why);
    }

    let here: Pose = link.call(call::GET_MEASURED_CARTESIAN_POSE, &()).unwrap();
    let there = |kind| ConstrainedPose {
        target_pose: Some(Pose { z: here.z + 0.05, ..here.clone() }),
        constraint: Some(CartesianTrajectoryConstraint { kind: Some(kind) }),
    };
    let soon = there(CartesianConstraint::Duration(0.05));
    let refused = link.call(call::PLAY_CARTESIAN_TRAJECTORY, &soon);
    no(refused, refusal::CONTROL_INVALID_DURATION);
    let back = CartesianSpeed { translation: -0.1, orientation: 10.0 };
    let back = there(CartesianConstraint::Speed(back));
    no(link.call(call::PLAY_CARTESIAN_TRAJECTORY, &back), refusal::CONTROL_INVALID_SPEED);

    let twist = Some(Twist { linear_z: 0.05, ..Twist::default() });
    let nowhere = TwistCommand { reference_frame: 9, twist, duration: 0 };
    no(link.call(call::SEND_TWIST_COMMAND, &nowhere), refusal::INVALID_PARAM);
    let twice = [1.0, -1.0].map(|value| JointSpeed { joint_identifier: 2, value, duration: 0 });
    let twice = JointSpeeds { joint_speeds: twice.to_vec(), duration: 0 };
    no(link.call(call::SEND_JOINT_SPEEDS_COMMAND, &twice), refusal::INVALID_PARAM);

    for (mode, value, word) in [(0, 0.5, "no such mode"), (3, f32::NAN, "not a number")] {
        let gripper = Some(Gripper { finger: vec![Finger { finger_identifier: 1, value }] });
        let command = GripperCommand { mode, gripper, duration: 0 };
        let refused = link.call::<()>(call::SEND_GRIPPER_COMMAND, &command).unwrap_err();
        assert!(refused.to_string().contains(word), "{refused}");
    }
}
