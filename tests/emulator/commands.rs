//! Twists, speeds and durations that an arm cannot keep: slowed down where it slows down, refused where it refuses.

use nalgebra::{DVector, Vector3};
use trueup::emulator::Options;
use trueup::kortex::messages::cyclic::Feedback;
use trueup::kortex::messages::motion::{Twist, TwistCommand};
use trueup::kortex::rpc::{base as call, base_cyclic};
use trueup::motion::robot::Robot;

use super::{emulator, link};

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
        // Where a joint limits it, it is slower than the arm's 0.5 m/s.
        assert!((0.2..0.505).contains(&speed), "{moves}");
        assert!((linear - along * speed).norm() < 0.02 && turning < 0.05, "{moves}");
    }
}
