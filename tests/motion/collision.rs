//! What touches what.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::motion::Robot;
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::solid::Solid;
use trueup::world::{Pose, Shape};

fn table() -> Obstacle {
    let half = Vector3::new(0.6, 0.4, 0.01);
    Obstacle::new("table", Solid::Cuboid { half }, Isometry3::translation(0.5, 0.0, -0.01))
}

#[test]
fn the_named_poses_are_free_and_as_clear_as_the_model_was_measured_to_be() {
    let robot = Robot::gen3();
    let world = CollisionWorld::new(&robot).with(&[table()]);
    for name in ["zero", "home", "retract"] {
        let clearance = world.clearance(robot.pose(name).unwrap()).unwrap();
        assert!(clearance.distance > 0.015, "{name}: {clearance:?}");
    }
    // half_arm_1 to forearm at retract: 20 mm between the fitted capsules.
    let retract = CollisionWorld::new(&robot).clearance(robot.pose("retract").unwrap()).unwrap();
    assert_eq!(
        (retract.first.as_str(), retract.second.as_str()),
        ("half_arm_1_link", "forearm_link")
    );
    assert!((retract.distance - 0.020).abs() < 0.001, "{retract:?}");
}

#[test]
fn the_arm_straight_down_hits_the_table() {
    let robot = Robot::gen3();
    let world = CollisionWorld::new(&robot).with(&[table()]);
    let q = [0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(!world.free(&q));
    let clearance = world.clearance(&q).unwrap();
    assert!(clearance.distance < 0.0 && clearance.second == "table", "{clearance:?}");
}

/// Flange straight up at zero: a ball over the fingers is as far as the drawing says.
#[test]
fn a_ball_over_the_gripper_is_as_far_as_the_drawing_says() {
    let robot = Robot::gen3();
    let mut world = CollisionWorld::new(&robot);
    let tip = robot.forward(&[0.0; 7]).unwrap().origin();
    // The jaws end 0.1336 - 0.0136 + 0.03235 m past the flange.
    let end = 0.1336 - 0.0136 + 0.032_35;
    let at = Isometry3::from(tip + Vector3::new(0.0425, 0.0, end + 0.15));
    world.add(&Obstacle::new("ball", Solid::Sphere { radius: 0.1 }, at));
    let clearance = world.clearance(&[0.0; 7]).unwrap();
    assert!((clearance.distance - 0.05).abs() < 1e-9, "{clearance:?}");
    assert_eq!(clearance.first, "left_jaw_link");
    // With the jaws closed the nearest point moves inwards, away from the ball's lowest point.
    world.set_opening(0.0);
    assert!(world.clearance(&[0.0; 7]).unwrap().distance > 0.05);
    world.ignore_gripper("ball");
    assert!(world.clearance(&[0.0; 7]).unwrap().distance > 0.1);
}

#[test]
fn what_is_held_collides_and_what_is_let_go_does_not() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap();
    let mut world = CollisionWorld::new(&robot);
    let flange = robot.forward(home).unwrap();
    let post = Isometry3::translation(flange.origin().x + 0.40, 0.0, flange.origin().z);
    world.add(&Obstacle::new("post", Solid::Cylinder { radius: 0.02, half: 0.3 }, post));
    assert!(world.free(home));
    let jar = Shape::Cylinder { radius: 0.04, height: 0.4 };
    world.attach(
        "jar",
        &jar,
        Pose::from_parts(
            Vector3::new(0.0, 0.0, 0.12),
            flange.rotation().inverse() * flange.rotation(),
        ),
    );
    assert!(!world.free(home));
    assert_eq!(world.clearance(home).unwrap().first, "jar");
    world.detach();
    assert!(world.free(home));
}

#[test]
fn a_certified_motion_is_free_at_every_sample_and_a_thin_wall_is_not_missed() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap().to_vec();
    let mut turned = home.clone();
    turned[0] += 1.5;
    let mut world = CollisionWorld::new(&robot);
    assert!(world.certify(&home, &turned));
    // A sheet of 2 mm, 30 cm wide, across the way.
    let wall = Solid::Cuboid { half: Vector3::new(0.15, 0.001, 0.15) };
    let across = Isometry3::translation(0.5, 0.0, 0.43)
        * nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.0);
    let about = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.75);
    world.add(&Obstacle::new("wall", wall, about * across));
    assert!(world.free(&home) && world.free(&turned));
    assert!(!world.certify(&home, &turned));
}

/// Beside a table and a wall 6 of 836 of these once took over a second each, and some never ended.
#[test]
fn any_configuration_beside_a_table_and_a_wall_has_a_distance_at_once() {
    let robot = Robot::gen3();
    let half = Vector3::new(0.01, 0.4, 0.4);
    let wall =
        Obstacle::new("wall", Solid::Cuboid { half }, Isometry3::translation(0.75, 0.0, 0.4));
    let world = CollisionWorld::new(&robot).with(&[table(), wall]);
    let (mut random, mut deep) = (StdRng::seed_from_u64(836), 0);
    for _ in 0..836 {
        let q: Vec<f64> = robot
            .joints()
            .iter()
            .map(|joint| random.random_range(joint.lower.max(-PI)..joint.upper.min(PI)))
            .collect();
        let distance = world.distance(&q);
        assert_eq!(distance > 0.0, world.free(&q), "{q:?}: {distance}");
        let clearance = world.clearance_or_overlap(&q).unwrap();
        let said = clearance.distance;
        assert_eq!(distance > 0.0, said > 0.0, "{q:?}: {distance} {clearance:?}");
        assert!(said <= 0.0 || (said - distance).abs() < 1e-12, "{q:?}: {distance} {clearance:?}");
        assert!(distance.is_finite() && distance > -1.0, "{q:?}: {distance}");
        deep += usize::from(distance < -0.05);
    }
    assert!(deep > 50, "{deep}");
}
