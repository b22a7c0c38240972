//! What is asked of the joints → a trajectory the servo can follow, or what is wrong with it.
//!
//! Waypoints are checked as the arm does: counts, durations, ranges, speeds and accelerations against the
//! soft limits. How the arm itself goes from one angular waypoint to the next is not published; here it is
//! a cubic spline through all of them. Cartesian waypoints are straight lines that end at rest: blending
//! radii are checked and not used.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::kortex::degrees;
use crate::kortex::messages::common::CartesianReferenceFrame;
use crate::kortex::messages::config::KinematicLimits;
use crate::kortex::messages::motion::{
    CartesianConstraint, CartesianTrajectoryConstraint, JointAngle, JointTrajectoryConstraint,
    JointTrajectoryConstraintType, Pose as WirePose,
};
use crate::kortex::messages::trajectory::{
    AngularWaypoint, CartesianWaypoint, TrajectoryErrorElement, WaypointKind, WaypointList,
};
use crate::motion::cartesian;
use crate::motion::robot::Robot;
use crate::motion::trajectory::{Limits, Trajectory};
use crate::world::Pose;
use crate::world::frame::{Base, Flange};

use super::error::Refused;
use super::unplanned::{Unplanned, Wrong};

/// The most waypoints in a list (an issue of the vendor's repository says about 1000).
const MOST: usize = 1000;
/// The shortest time between two angular waypoints, s: what `ros_kortex` found to be taken.
const SHORTEST: f32 = 0.01;
/// Rounding of the wire's f32 and of a spline between waypoints, as a factor.
const SLACK: f64 = 1.02;

/// A trajectory with the times of its waypoints, s.
pub(super) type Timed = (Trajectory, Vec<f64>);

/// Plans and checks for one robot in one place.
pub(super) struct Planner<'a> {
    pub(super) robot: &'a Robot,
    /// The limits in force, deg/s and m/s.
    pub(super) soft: &'a KinematicLimits,
    /// Where the joints were last sent, rad.
    pub(super) from: &'a [f64],
}

fn wrong(why: &Wrong, waypoint: usize) -> TrajectoryErrorElement {
    TrajectoryErrorElement {
        error_type: why.kind() as i32,
        waypoint_index: waypoint as u32,
        message: why.to_string(),
        ..TrajectoryErrorElement::default()
    }
}

/// An error about one joint (from 0), with its value and limits.
fn wrong_joint(
    why: &Wrong,
    waypoint: usize,
    joint: usize,
    value: f64,
    (least, most): (f64, f64),
) -> TrajectoryErrorElement {
    TrajectoryErrorElement {
        index: joint as u32,
        error_value: value as f32,
        min_value: least as f32,
        max_value: most as f32,
        ..wrong(why, waypoint)
    }
}

impl Planner<'_> {
    /// Checks a list of waypoints and makes a trajectory of it.
    pub(super) fn waypoints(
        &self,
        list: &WaypointList,
    ) -> Result<Timed, Vec<TrajectoryErrorElement>> {
        let n = list.waypoints.len();
        if n == 0 || n > MOST {
            return Err(vec![wrong(&Wrong::Count { n, most: MOST }, 0)]);
        }
        let mut angular = Vec::new();
        let mut cartesian = Vec::new();
        for waypoint in &list.waypoints {
            match &waypoint.kind {
                Some(WaypointKind::AngularWaypoint(waypoint)) => angular.push(waypoint),
                Some(WaypointKind::CartesianWaypoint(waypoint)) => cartesian.push(waypoint),
                None => {}
            }
        }
        match (angular.len(), cartesian.len()) {
            (all, 0) if all == n => self.angular(&angular),
            (0, all) if all == n => self.cartesian(&cartesian),
            _ => Err(vec![wrong(&Wrong::Mixed, 0)]),
        }
    }

    fn angular(&self, list: &[&AngularWaypoint]) -> Result<Timed, Vec<TrajectoryErrorElement>> {
        let n = self.from.len();
        let mut errors = Vec::new();
        let mut points = vec![self.from.to_vec()];
        let mut times = vec![0.0];
        for (at, waypoint) in list.iter().enumerate() {
            if waypoint.angles.len() != n {
                let given = waypoint.angles.len();
                return Err(vec![wrong(&Wrong::JointCount { given, n }, at)]);
            }
            if !waypoint.angles.iter().chain([&waypoint.duration]).all(|x| x.is_finite()) {
                return Err(vec![wrong(&Wrong::NotANumber, at)]);
            }
            let duration = f64::from(waypoint.duration);
            if waypoint.duration < SHORTEST * 0.999 {
                let mut error = wrong(&Wrong::Duration, at);
                (error.error_value, error.min_value) = (waypoint.duration, SHORTEST);
                return Err(vec![error]);
            }
            let before = points.last().expect("it begins with where the arm is");
            let q = self.turned(&waypoint.angles, before);
            for (i, joint) in self.robot.joints().iter().enumerate() {
                let speed = ((q[i] - before[i]) / duration).to_degrees();
                let most = f64::from(self.soft.joint_speed_limits[i]);
                let range = (joint.lower.to_degrees(), joint.upper.to_degrees());
                let value = q[i].to_degrees();
                if value < range.0 - 1e-3 || value > range.1 + 1e-3 {
                    errors.push(wrong_joint(&Wrong::JointPosition, at, i, value, range));
                }
                if speed.abs() > most * SLACK {
                    errors.push(wrong_joint(&Wrong::JointSpeed, at, i, speed, (-most, most)));
                }
            }
            times.push(times.last().copied().unwrap_or(0.0) + duration);
            points.push(q);
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let trajectory = Trajectory::from_points(&times, &points)
            .map_err(|error| vec![wrong(&Wrong::Untimed(error), 0)])?;
        let errors = self.accelerations(&trajectory, &times);
        if errors.is_empty() { Ok((trajectory, times.split_off(1))) } else { Err(errors) }
    }

    /// Returns what is too sudden at the waypoints; between two, a cubic's acceleration is between theirs.
    fn accelerations(&self, trajectory: &Trajectory, times: &[f64]) -> Vec<TrajectoryErrorElement> {
        let mut errors = Vec::new();
        for (at, &time) in times.iter().enumerate() {
            let sample = trajectory.sample(time.min(trajectory.duration() * (1.0 - 1e-9)));
            for (i, ddq) in sample.ddq.iter().enumerate() {
                let most = f64::from(self.soft.joint_acceleration_limits[i]);
                let value = ddq.to_degrees();
                if value.abs() > most * SLACK {
                    errors.push(wrong_joint(
                        &Wrong::JointAcceleration,
                        at.saturating_sub(1),
                        i,
                        value,
                        (-most, most),
                    ));
                }
            }
        }
        errors
    }

    fn cartesian(&self, list: &[&CartesianWaypoint]) -> Result<Timed, Vec<TrajectoryErrorElement>> {
        let mut from = self.from.to_vec();
        let mut whole: Option<Trajectory> = None;
        let mut marks = Vec::new();
        for (at, waypoint) in list.iter().enumerate() {
            if at + 1 == list.len() && waypoint.blending_radius > 0.0 {
                return Err(vec![wrong(&Wrong::Blends, at)]);
            }
            if !matches!(waypoint.reference_frame, 0 | 1 | 3) {
                return Err(vec![wrong(&Wrong::Frame, at)]);
            }
            let Some(pose) = waypoint.pose.as_ref().and_then(tool_pose) else {
                return Err(vec![wrong(&Wrong::NoPose, at)]);
            };
            let linear = within(waypoint.maximum_linear_velocity, self.soft.twist_linear)
                .ok_or_else(|| vec![wrong(&Wrong::LinearSpeed, at)])?;
            let angular = within(waypoint.maximum_angular_velocity, self.soft.twist_angular)
                .ok_or_else(|| vec![wrong(&Wrong::AngularSpeed, at)])?;
            let piece = Planner { from: &from, ..*self }
                .line(&pose, Pace::Speed(linear, angular))
                .map_err(|why| vec![wrong(&Wrong::Unplanned(why), at)])?;
            from = piece.ends().1;
            let next = match whole {
                None => Ok(piece),
                Some(whole) => whole.then(&piece),
            };
            let next = next.map_err(|error| vec![wrong(&Wrong::Untimed(error), at)])?;
            marks.push(next.duration());
            whole = Some(next);
        }
        whole.map(|whole| (whole, marks)).ok_or_else(Vec::new)
    }

    /// Goes to joint angles of the wire, deg, each the short way where it may turn without end.
    pub(super) fn joints(&self, angles: &[f32], pace: Pace) -> Result<Trajectory, Unplanned> {
        let goal = self.turned(angles, self.from);
        if let Some(joint) = self.robot.outside_limits(&goal, 1e-4) {
            return Err(Unplanned::OutOfRange(joint));
        }
        let limits = self.limits();
        let corners = [self.from.to_vec(), goal];
        let trajectory = Trajectory::through_corners(&corners, &limits, 0.0, &|_, _| true)?;
        match pace {
            Pace::Duration(seconds) => lasting(trajectory, seconds),
            Pace::JointSpeed(speed) => {
                let most = Limits { velocity: vec![speed; self.from.len()], ..limits };
                let slower = trajectory.worst(&most, 0.01).0;
                Ok(trajectory.slowed(slower.max(1.0)))
            }
            Pace::Speed(..) | Pace::Any => Ok(trajectory),
        }
    }

    /// Goes along a line to a pose of the tool in the base.
    pub(super) fn line(&self, tool: &Isometry3<f64>, pace: Pace) -> Result<Trajectory, Unplanned> {
        let flange: Pose<Base, Flange> =
            Pose::new(tool * self.robot.flange_from_tool().isometry().inverse());
        let points = cartesian::line(self.robot, self.from, &flange)?;
        let trajectory = Trajectory::through_points(&points, &self.limits())?;
        let (linear, angular) = self.fastest(&trajectory);
        let (v, w) = if let Pace::Speed(v, w) = pace { (v, w) } else { tool_speeds(self.soft) };
        let soonest = trajectory.slowed((linear / v).max(angular / w).max(1.0));
        if let Pace::Duration(seconds) = pace { lasting(soonest, seconds) } else { Ok(soonest) }
    }

    /// Returns the highest speeds of the tool, m/s and rad/s.
    fn fastest(&self, trajectory: &Trajectory) -> (f64, f64) {
        let steps = (trajectory.duration() / 0.01).ceil() as usize;
        let mut most = (0.0_f64, 0.0_f64);
        let mut before: Option<Isometry3<f64>> = None;
        for step in 0..=steps {
            let q = trajectory.sample(step as f64 * 0.01).q;
            let Ok(tool) = self.robot.forward_tool(&q) else { break };
            let now = *tool.isometry();
            if let Some(before) = before {
                most.0 =
                    most.0.max((now.translation.vector - before.translation.vector).norm() / 0.01);
                most.1 = most.1.max(now.rotation.angle_to(&before.rotation) / 0.01);
            }
            before = Some(now);
        }
        most
    }

    /// Returns angles of the wire, deg, as positions near `near`, rad.
    fn turned(&self, angles: &[f32], near: &[f64]) -> Vec<f64> {
        let joints = self.robot.joints().iter().zip(angles.iter().zip(near));
        joints
            .map(|(joint, (&angle, &near))| {
                // A joint with a range has one turn only, whatever is nearer.
                let near = if joint.continuous { near } else { 0.0 };
                degrees::from_wire(angle, near)
            })
            .collect()
    }

    /// Returns the soft limits in the program's units.
    fn limits(&self) -> Limits {
        let inside = |list: &[f32]| list.iter().map(|&x| f64::from(x).to_radians()).collect();
        Limits::new(
            inside(&self.soft.joint_speed_limits),
            inside(&self.soft.joint_acceleration_limits),
        )
    }
}

/// Slows a trajectory down until it takes so many seconds.
fn lasting(soonest: Trajectory, seconds: f64) -> Result<Trajectory, Unplanned> {
    let slower = seconds / soonest.duration().max(1e-3);
    if slower < 0.999 {
        return Err(Unplanned::TooSoon(soonest.duration()));
    }
    Ok(soonest.slowed(slower.max(1.0)))
}

/// Returns the limits of the tool's speed, m/s and rad/s.
pub(super) fn tool_speeds(limits: &KinematicLimits) -> (f64, f64) {
    (f64::from(limits.twist_linear), f64::from(limits.twist_angular).to_radians())
}

/// Returns a list's angles, deg, joint by joint; those it does not name stay as they are in `angles`.
pub(super) fn arranged(list: &[JointAngle], angles: Vec<f32>) -> Result<Vec<f32>, Refused> {
    let named = list.iter().map(|angle| (angle.joint_identifier, angle.value));
    placed(&named.collect::<Vec<_>>(), angles)
}

/// Puts values of joints, by their names, in their places; those of joints that are not named stay.
///
/// A list that names every joint 0, as one does that leaves the names out, is in the arm's order: so the
/// vendor's sequence and kinematics examples send theirs.
pub(super) fn placed(list: &[(u32, f32)], mut values: Vec<f32>) -> Result<Vec<f32>, Refused> {
    if list.len() == values.len() && list.iter().all(|(joint, _)| *joint == 0) {
        return Ok(list.iter().map(|(_, value)| *value).collect());
    }
    let last = values.len().saturating_sub(1);
    let mut is_told = vec![false; values.len()];
    for &(joint, value) in list {
        let at = joint as usize;
        *values.get_mut(at).ok_or(Refused::NoJoint { last })? = value;
        if std::mem::replace(&mut is_told[at], true) {
            return Err(Refused::JointTwice { joint: at });
        }
    }
    Ok(values)
}

/// How fast.
#[derive(Debug, Clone, Copy)]
pub(super) enum Pace {
    /// As fast as the limits allow.
    Any,
    /// In so many seconds.
    Duration(f64),
    /// Every joint at most so fast, rad/s.
    JointSpeed(f64),
    /// The tool at most so fast, m/s and rad/s.
    Speed(f64, f64),
}

impl Pace {
    /// Reads how fast joints are to go.
    pub(super) fn of_joints(
        constraint: Option<&JointTrajectoryConstraint>,
    ) -> Result<Self, Refused> {
        let Some(constraint) = constraint else { return Ok(Self::Any) };
        let pace = match JointTrajectoryConstraintType::try_from(constraint.r#type) {
            Ok(JointTrajectoryConstraintType::Duration) => {
                some(constraint.value, Refused::NegativeDuration)?.map(Self::Duration)
            }
            Ok(JointTrajectoryConstraintType::Speed) => {
                let speed = some(constraint.value, Refused::NegativeSpeed)?;
                speed.map(|speed| Self::JointSpeed(speed.to_radians()))
            }
            _ => None,
        };
        Ok(pace.unwrap_or(Self::Any))
    }

    /// Reads how fast the tool is to go; its speeds are at most `v`, m/s, and `w`, rad/s.
    pub(super) fn of_tool(
        constraint: Option<&CartesianTrajectoryConstraint>,
        (v, w): (f64, f64),
    ) -> Result<Self, Refused> {
        Ok(match constraint.and_then(|constraint| constraint.kind.as_ref()) {
            Some(CartesianConstraint::Duration(seconds)) => {
                let duration = some(*seconds, Refused::NegativeDuration)?;
                duration.map_or(Self::Speed(v, w), Self::Duration)
            }
            Some(CartesianConstraint::Speed(speed)) => {
                let linear = some(speed.translation, Refused::NegativeSpeed)?;
                let angular = some(speed.orientation, Refused::NegativeSpeed)?;
                let angular = angular.map_or(w, |angular| angular.to_radians().min(w));
                Self::Speed(linear.map_or(v, |linear| linear.min(v)), angular)
            }
            None => Self::Speed(v, w),
        })
    }
}

/// Returns a number of a constraint; 0, as one that is left out is, constrains nothing.
fn some(value: f32, negative: Refused) -> Result<Option<f64>, Refused> {
    if !value.is_finite() {
        return Err(Refused::NotANumber);
    }
    if value < 0.0 {
        return Err(negative);
    }
    Ok((value > 0.0).then(|| f64::from(value)))
}

/// Returns a speed of the wire if it is within its limit, as m/s or rad/s; 0 stands for the limit.
fn within(speed: f32, limit: f32) -> Option<f64> {
    let is_angle = limit > 10.0;
    let asked = if speed == 0.0 { limit } else { speed };
    let inside = |x: f32| if is_angle { f64::from(x).to_radians() } else { f64::from(x) };
    (asked > 0.0 && asked <= limit * 1.001).then(|| inside(asked))
}

/// Returns whether a frame is the tool's; mixed and base differ in what is turned about, not in their axes.
pub(super) fn is_of_tool(frame: i32) -> Result<bool, Refused> {
    let frame = CartesianReferenceFrame::try_from(frame).map_err(|_| Refused::NoFrame)?;
    Ok(frame == CartesianReferenceFrame::Tool)
}

/// Returns a pose of the wire as an isometry: extrinsic X, Y, Z in deg.
pub(super) fn tool_pose(pose: &WirePose) -> Option<Isometry3<f64>> {
    let numbers = [pose.x, pose.y, pose.z, pose.theta_x, pose.theta_y, pose.theta_z];
    if !numbers.iter().all(|number| number.is_finite()) {
        return None;
    }
    let [x, y, z, a, b, c] = numbers.map(f64::from);
    let turn = UnitQuaternion::from_euler_angles(a.to_radians(), b.to_radians(), c.to_radians());
    Some(Isometry3::from_parts(Translation3::new(x, y, z), turn))
}

/// Returns an isometry as a pose of the wire.
pub(super) fn wire_pose(pose: &Isometry3<f64>) -> WirePose {
    let (a, b, c) = pose.rotation.euler_angles();
    let at = pose.translation.vector;
    WirePose {
        x: at.x as f32,
        y: at.y as f32,
        z: at.z as f32,
        theta_x: a.to_degrees() as f32,
        theta_y: b.to_degrees() as f32,
        theta_z: c.to_degrees() as f32,
    }
}
