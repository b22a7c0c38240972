//! Motions of the tip along a line or about a point: dense joint positions on one branch of the arm.
//!
//! Every point is solved exactly; what redundancy there is goes into moving the joints least. A motion
//! that would need a jump, or leaves the limits, ends there and says how far it came.
//!
//! Source: Siciliano et al., *Robotics*, 2009, §3.5 (pseudo-inverse) and §3.7.1 (position and orientation
//! in closed loop).

use nalgebra::{DMatrix, Isometry3, Matrix6xX, Translation3, Unit, UnitQuaternion, Vector3};

use super::error::Error;
use super::fault::Stop;
use super::frames::Frame;
use super::kinematics::{frame_error, pose_error};
use super::robot::Robot;
use crate::world::frame::{Base, Flange, Point, Pose};

/// Farthest the tip moves between two points, m.
const STEP: f64 = 0.005;
/// Farthest it turns between two points, rad.
const TURN: f64 = 0.02;
/// A joint that moves more than this between two points has jumped, rad.
const JUMP: f64 = 0.25;
/// So far from the ends of their ranges joints are kept where they can be, rad. Derived: a joint that is stopped from
/// [`JUMP`] a point to nothing makes a cubic spline swing over by less than a tenth of that.
const SWING: f64 = 0.1 * JUMP;
/// What begins nearer to an end than that goes away from it by so much a point, rad.
const BACK: f64 = 0.1 * SWING;
/// A point is reached when position (m) and rotation (rad) are off by less.
const EXACT: f64 = 1e-10;

/// Moves the tip in a straight line to `target`, turning evenly on the way, from joint positions `q`.
///
/// # Errors
///
/// [`Error::Cartesian`] with the share of the way that can be gone; [`Error::WrongLength`], [`Error::NotFinite`].
pub fn line(robot: &Robot, q: &[f64], target: &Pose<Base, Flange>) -> Result<Vec<Vec<f64>>, Error> {
    let from = *robot.forward(q)?.isometry();
    let to = *target.isometry();
    let error = pose_error(&from, &to);
    let (far, turn) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
    let axis = Unit::try_new(error.fixed_rows::<3>(3).into_owned(), 1e-12);
    follow(robot, q, steps(far, turn), &|share| {
        let shift =
            from.translation.vector + share * (to.translation.vector - from.translation.vector);
        let turned = axis.map_or(from.rotation, |axis| {
            UnitQuaternion::from_axis_angle(&axis, share * turn) * from.rotation
        });
        Isometry3::from_parts(Translation3::from(shift), turned)
    })
}

/// Turns the tip by `angle` rad about an axis of the base through a point that is fixed to the flange:
/// pouring about a vessel's lip. The point stays where it is.
///
/// # Errors
///
/// As [`line()`].
pub fn turn_about(
    robot: &Robot,
    q: &[f64],
    point_in_flange: Point<Flange>,
    axis_in_base: Unit<Vector3<f64>>,
    angle: f64,
) -> Result<Vec<Vec<f64>>, Error> {
    let from = *robot.forward(q)?.isometry();
    let local = nalgebra::Point3::from(point_in_flange.coords());
    let fixed = from * local;
    let lever = point_in_flange.coords().norm();
    follow(robot, q, steps(lever * angle.abs(), angle.abs()), &|share| {
        let rotation =
            UnitQuaternion::from_axis_angle(&axis_in_base, share * angle) * from.rotation;
        // p(θ) = P - R(θ) l.
        let shift = fixed.coords - rotation * local.coords;
        Isometry3::from_parts(Translation3::from(shift), rotation)
    })
}

/// Moves the tip through `poses`, one point each, from joint positions `q`, which need not be at the
/// first.
///
/// # Errors
///
/// As [`line()`].
pub fn through(
    robot: &Robot,
    q: &[f64],
    poses: &[Pose<Base, Flange>],
) -> Result<Vec<Vec<f64>>, Error> {
    robot.check(q)?;
    let mut points = vec![q.to_vec()];
    for pose in poses {
        let last = points.last().expect("it begins with one").clone();
        match line(robot, &last, pose) {
            Ok(way) => points.extend(way.into_iter().skip(1)),
            Err(Error::Cartesian { why, .. }) => {
                let fraction = points.len() as f64 / (points.len() + poses.len()) as f64;
                return Err(Error::Cartesian { fraction, why });
            }
            Err(other) => return Err(other),
        }
    }
    Ok(points)
}

fn steps(far: f64, turn: f64) -> usize {
    (far / STEP).max(turn / TURN).ceil().max(1.0) as usize
}

/// Tracks `pose(share)` for shares 0 to 1 by Newton's method from one point to the next.
fn follow(
    robot: &Robot,
    q: &[f64],
    steps: usize,
    pose: &dyn Fn(f64) -> Isometry3<f64>,
) -> Result<Vec<Vec<f64>>, Error> {
    let mut points = vec![q.to_vec()];
    for k in 1..=steps {
        let share = k as f64 / steps as f64;
        let last = points.last().expect("it begins with one");
        let next = step_to(robot, last, &pose(share))
            .map_err(|why| Error::Cartesian { fraction: (k - 1) as f64 / steps as f64, why })?;
        points.push(next);
    }
    Ok(points)
}

/// Solves one point near the last, inside the joints' ranges: where it can be with room for what a smooth curve
/// through the points swings over, else up to their ends.
fn step_to(robot: &Robot, last: &[f64], target: &Isometry3<f64>) -> Result<Vec<f64>, Stop> {
    let ranges = |room: f64| -> Vec<[f64; 2]> {
        let joints = robot.joints().iter().zip(last);
        joints
            .map(|(joint, &at)| {
                let (low, high) = (joint.lower + room, joint.upper - room);
                [low.min(at + BACK).max(joint.lower), high.max(at - BACK).min(joint.upper)]
            })
            .collect()
    };
    step_within(robot, last, target, &ranges(SWING))
        .or_else(|_| step_within(robot, last, target, &ranges(0.0)))
}

/// The shortest way there, and back inside the ranges (rad) if it leaves them.
fn step_within(
    robot: &Robot,
    last: &[f64],
    target: &Isometry3<f64>,
    ranges: &[[f64; 2]],
) -> Result<Vec<f64>, Stop> {
    let n = robot.n_joints();
    let at_its_end = |i: usize| Stop::AtLimit { joint: robot.joints()[i].name.clone() };
    // Joints that would leave their range are held at its end, one more at each attempt.
    let mut held: Vec<Option<f64>> = vec![None; n];
    for _ in 0..=n {
        let Some(q) = newton(robot, last, target, &held) else {
            let at_limit = held.iter().position(Option::is_some);
            return Err(at_limit.map_or(Stop::Singular, at_its_end));
        };
        let outside = (0..n).find(|&i| q[i] < ranges[i][0] - 1e-9 || q[i] > ranges[i][1] + 1e-9);
        if let Some(i) = outside {
            if held[i].is_some() {
                return Err(at_its_end(i));
            }
            held[i] = Some(q[i].clamp(ranges[i][0], ranges[i][1]));
            continue;
        }
        let jump = q.iter().zip(last).position(|(a, b)| (a - b).abs() > JUMP);
        return match jump {
            Some(i) => Err(Stop::Jump { joint: robot.joints()[i].name.clone() }),
            None => Ok(q),
        };
    }
    Err(Stop::AllAtLimits)
}

fn newton(
    robot: &Robot,
    last: &[f64],
    target: &Isometry3<f64>,
    held: &[Option<f64>],
) -> Option<Vec<f64>> {
    let n = robot.n_joints();
    let mut q: Vec<f64> = last.iter().zip(held).map(|(q, held)| held.unwrap_or(*q)).collect();
    let mut jacobian = Matrix6xX::zeros(n);
    let goal = Frame::of(target);
    for _ in 0..20 {
        let tip = robot.jacobian_into(&q, jacobian.as_mut_slice());
        let error = frame_error(&tip, &goal);
        if error.amax() < EXACT {
            return Some(q);
        }
        for (i, _) in held.iter().enumerate().filter(|(_, held)| held.is_some()) {
            jacobian.column_mut(i).fill(0.0);
        }
        // q += Jᵀ (J Jᵀ + λ)⁻¹ e: the least change of the joints; λ fades with the error.
        let mut square: DMatrix<f64> = DMatrix::zeros(6, 6);
        let transposed = jacobian.transpose();
        jacobian.mul_to(&transposed, &mut square);
        let damping = 1e-2 * error.norm_squared() + 1e-13;
        for i in 0..6 {
            square[(i, i)] += damping;
        }
        let weights = square.cholesky()?.solve(&error);
        let step = transposed * weights;
        for i in 0..n {
            q[i] += step[i].clamp(-0.3, 0.3);
        }
    }
    None
}
