//! Lines are straight, and a pour keeps its lip where it is.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use trueup::motion::cartesian::{line, turn_about};
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Error, Robot};
use trueup::world::{Point, Pose};

#[test]
fn the_flange_keeps_to_a_straight_line_also_between_the_points() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap();
    let from = robot.forward(home).unwrap();
    let shift = Vector3::new(0.1, -0.15, -0.12);
    let to = Pose::from_parts(from.origin() + shift, from.rotation());
    let points = line(&robot, home, &to).unwrap();
    assert!((robot.forward(points.last().unwrap()).unwrap().origin() - to.origin()).norm() < 1e-9);
    let trajectory = Trajectory::through_points(&points, &Limits::of(&robot)).unwrap();
    for k in 0..=500 {
        let q = trajectory.sample(trajectory.duration() * f64::from(k) / 500.0).q;
        let pose = robot.forward(&q).unwrap();
        let off = (pose.origin() - from.origin()).cross(&shift.normalize()).norm();
        assert!(off < 2e-6, "{off} m off the line");
        assert!(pose.rotation().angle_to(&from.rotation()) < 1e-5);
    }
}

#[test]
fn the_lip_stays_where_it_is_while_the_jar_turns() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap();
    let lip = Point::new(0.03, -0.05, 0.17);
    let fixed = (robot.forward(home).unwrap() * lip).coords();
    let before = robot.forward(home).unwrap().rotation();
    let axis = Vector3::x_axis();
    let points = turn_about(&robot, home, lip, axis, 1.8).unwrap();
    let mut last: Option<Vec<f64>> = None;
    for q in &points {
        assert!(((robot.forward(q).unwrap() * lip).coords() - fixed).norm() < 1e-9);
        assert!(robot.outside_limits(q, 0.0).is_none());
        if let Some(last) = last {
            assert!(q.iter().zip(&last).all(|(a, b)| (a - b).abs() < 0.1));
        }
        last = Some(q.clone());
    }
    let turned = robot.forward(points.last().unwrap()).unwrap().rotation() * before.inverse();
    assert!((turned.angle() - 1.8).abs() < 1e-9);
    assert!(turned.axis().unwrap().dot(&axis) > 1.0 - 1e-9);
}

/// Lines from anywhere to anywhere near: what is timed through their points stays in the joints' ranges, also between
/// the points, where a joint comes to its end on the way; nearly all of them.
#[test]
fn what_is_timed_along_a_line_stays_in_the_joints_ranges() {
    let robot = Robot::gen3();
    let limits = Limits::of(&robot);
    let mut random = StdRng::seed_from_u64(5);
    let (mut gone, mut beyond) = (0, Vec::new());
    for _ in 0..500 {
        let q: Vec<f64> = robot
            .joints()
            .iter()
            .map(|joint| random.random_range(joint.lower.max(-PI)..joint.upper.min(PI)))
            .collect();
        let from = robot.forward(&q).unwrap();
        let mut off = || random.random_range(-0.3..0.3);
        let to =
            Pose::from_parts(from.origin() + Vector3::new(off(), off(), off()), from.rotation());
        let Ok(points) = line(&robot, &q, &to) else { continue };
        gone += 1;
        let timed = Trajectory::through_points(&points, &limits).unwrap();
        let (_, sampled) = timed.sampled(0.005);
        let excess = |q: &Vec<f64>| {
            let joints = robot.joints().iter().zip(q);
            joints.map(|(joint, q)| (q - joint.upper).max(joint.lower - q)).fold(f64::MIN, f64::max)
        };
        let worst = sampled.iter().map(excess).fold(f64::MIN, f64::max);
        if worst > 1e-9 {
            beyond.push(worst.to_degrees());
        }
    }
    assert!(gone > 200, "{gone}");
    // Where nothing but the end of a range solves a point, the curve may still swing over it, and the gate refuses it.
    assert!(beyond.len() * 100 < gone && beyond.iter().all(|deg| *deg < 0.05), "{beyond:?}");
}

#[test]
fn a_line_out_of_reach_says_how_far_it_came() {
    let robot = Robot::gen3();
    let home = robot.pose("home").unwrap();
    let from = robot.forward(home).unwrap();
    let to = Pose::from_parts(from.origin() + Vector3::new(1.0, 0.0, 0.0), from.rotation());
    let Err(Error::Cartesian { fraction, why }) = line(&robot, home, &to) else {
        panic!("it is out of reach");
    };
    // Flange at 0.457 m, level and 0.15 m over the shoulder; the wrist reaches about 0.73 m.
    assert!(fraction > 0.2 && fraction < 0.6, "{fraction}: {why}");
    let still = line(&robot, home, &from).unwrap();
    assert_eq!(still.first().unwrap(), home);
}
