//! Regression 3 on an arm whose errors are planted: it is judged where the arm was not looked at.

use nalgebra::{UnitQuaternion, Vector3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use trueup::alignment::Error;
use trueup::execution::calibrate::arm::{ArmFit, Priors, Stop, fit_arm};
use trueup::motion::robot::Robot;
use trueup::world::frame::{Base, Tool, World};
use trueup::world::{Camera, Intrinsics, Pixel, Pose};

fn camera() -> Camera {
    let mut k = Intrinsics::centred(930.0, 1280, 720);
    k.k1 = -0.08;
    Camera::looking(k, Vector3::new(1.25, 0.05, 0.85), Vector3::new(0.6, 0.0, 0.05))
}

fn within(random: &mut StdRng, most: f64) -> f64 {
    (2.0 * random.random::<f64>() - 1.0) * most
}

/// The arm as it really is, drawn from a seed.
struct Real {
    robot: Robot,
    world_from_base: Pose<World, Base>,
}

impl Real {
    fn drawn(random: &mut StdRng) -> Self {
        let zeros: Vec<f64> = (0..7).map(|_| within(random, 0.015)).collect();
        let tool = Vector3::from_fn(|_, _| within(random, 0.004));
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, within(random, 0.02));
        let shift = Vector3::new(within(random, 0.012), within(random, 0.012), 0.0);
        Self {
            robot: Robot::gen3().with_zero_offsets(&zeros).with_tool_shift(tool),
            world_from_base: Pose::from_parts(shift, turn),
        }
    }

    fn tool(&self, q: &[f64]) -> Pose<World, Tool> {
        self.world_from_base * self.robot.forward_tool(q).unwrap()
    }
}

/// A posture over the table: the elbow up, the hand anywhere in front.
fn posture(random: &mut StdRng) -> Vec<f64> {
    let middle = [0.0, 0.5, 3.1, -1.8, 0.0, 0.8, 1.6];
    let reach = [0.5, 0.3, 0.3, 0.3, 0.8, 0.5, 0.5];
    middle.iter().zip(reach).map(|(middle, reach)| middle + within(random, reach)).collect()
}

/// Fourteen stops at which the ball is seen with 0.2 px of noise.
fn stops(real: &Real, random: &mut StdRng) -> Vec<Stop> {
    let marker = real.robot.marker_in_flange().unwrap();
    (0..14)
        .map(|_| {
            let q = posture(random);
            let ball = real.world_from_base * (real.robot.forward(&q).unwrap() * marker);
            let seen = camera().project(ball).unwrap();
            let pixel = Pixel::new(seen.u + within(random, 0.35), seen.v + within(random, 0.35));
            Stop { q, pixel, sigma: 0.2 }
        })
        .collect()
}

fn fitted(stops: &[Stop]) -> Result<ArmFit, Error> {
    let nominal = Robot::gen3();
    let marker = nominal.marker_in_flange().unwrap();
    fit_arm(&nominal, Pose::identity(), marker, &camera(), stops, &Priors::default())
}

/// Where a fit says the tool is.
fn said(fit: &ArmFit, q: &[f64]) -> Pose<World, Tool> {
    let robot = Robot::gen3().with_zero_offsets(&fit.zeros).with_tool_shift(fit.tool_shift);
    let world_from_base: Pose<World, Base> = Pose::identity();
    fit.reported_from_real.inverse() * (world_from_base * robot.forward_tool(q).unwrap())
}

#[test]
fn the_tool_is_known_where_the_arm_was_not_looked_at() {
    let nominal = Robot::gen3();
    let (mut before, mut after, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..12 {
        let mut random = StdRng::seed_from_u64(seed);
        let real = Real::drawn(&mut random);
        let fit = fitted(&stops(&real, &mut random)).unwrap();
        assert!(fit.rms_px < 0.5 && fit.rms_before_px > 3.0, "{fit:?}");
        for _ in 0..20 {
            let q = posture(&mut random);
            let there = real.tool(&q).origin();
            before += (nominal.forward_tool(&q).unwrap().origin() - there).norm_squared();
            after += (said(&fit, &q).origin() - there).norm_squared();
            count += 1.0;
        }
    }
    let (before, after) = (f64::sqrt(before / count), f64::sqrt(after / count));
    assert!(before > 0.010, "the planted errors are no errors: {before} m");
    assert!(after < 0.0025, "{before} m before, {after} m after");
}

#[test]
fn a_wrong_sighting_is_named_and_too_few_are_refused() {
    let mut random = StdRng::seed_from_u64(3);
    let real = Real::drawn(&mut random);
    let mut seen = stops(&real, &mut random);
    seen[5].pixel.u += 30.0;
    let fit = fitted(&seen).unwrap();
    assert_eq!(fit.outliers, [5]);
    assert!(matches!(fitted(&seen[..5]), Err(Error::TooFew { needed: 6, given: 5, .. })));
    seen[2].pixel.v = f64::NAN;
    assert!(matches!(fitted(&seen), Err(Error::NotFinite { row: 2, .. })));
}
