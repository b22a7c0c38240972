//! A trajectory → waypoints the arm takes, and the arm's report → what is wrong with which.
//!
//! The arm is sent positions and durations; what it does in between is its own affair, so points are close.
//! The first is where the trajectory begins, with half a second to get there: that is how `ros_kortex`
//! sends paths, and durations much shorter are refused.

use std::fmt;

use crate::motion::trajectory::{Limits, Trajectory};

use super::degrees;
use super::messages::trajectory::{
    AngularWaypoint, TrajectoryErrorElement, TrajectoryErrorReport, TrajectoryErrorType, Waypoint,
    WaypointKind, WaypointList,
};

/// Time the arm is given to get to the first point, s.
pub(super) const LEAD: f64 = 0.5;
/// Time between two points, s, unless that makes too many.
const STEP: f64 = 0.05;
/// The most points of a path; about 1000 are taken.
const MOST: f64 = 900.0;

/// Returns a trajectory slowed down, where it must be, to what the arm allows, and its waypoints.
pub(super) fn of(trajectory: &Trajectory, soft: &Limits) -> (Trajectory, WaypointList) {
    let step = STEP.max(trajectory.duration() / MOST);
    let (times, points) = trajectory.sampled(step);
    // What the arm makes of the points is likely a smooth curve through them, which swings out a little.
    let curve = if trajectory.duration() > step {
        Trajectory::from_points(&times, &points).unwrap_or_else(|_| trajectory.clone())
    } else {
        trajectory.clone()
    };
    let (mut speed, mut acceleration) = trajectory.worst(soft, 0.01);
    let swung = curve.worst(soft, 0.01);
    (speed, acceleration) = (speed.max(swung.0), acceleration.max(swung.1));
    let slower = speed.max(acceleration.sqrt());
    let slower = if slower > 0.999 { slower * 1.01 } else { 1.0 };
    let mut before = -LEAD / slower;
    let waypoints = times.iter().zip(&points).map(|(&time, q)| {
        let duration = (time - before) * slower;
        before = time;
        let waypoint = AngularWaypoint {
            angles: degrees::speeds_to_wire(q),
            maximum_velocities: Vec::new(),
            duration: duration as f32,
        };
        Waypoint { name: String::new(), kind: Some(WaypointKind::AngularWaypoint(waypoint)) }
    });
    let list = WaypointList { waypoints: waypoints.collect(), ..WaypointList::default() };
    (trajectory.clone().slowed(slower), list)
}

/// What the arm has against a path: the first thing, and how many more there are.
#[derive(Debug)]
pub(super) struct PathRefused {
    first: TrajectoryErrorElement,
    more: usize,
    /// How many waypoints the path has.
    n: usize,
}

impl PathRefused {
    /// Reads the report on a path of `n` waypoints; `None` when nothing is wrong with it.
    pub(super) fn of(report: &TrajectoryErrorReport, n: usize) -> Option<Self> {
        let errors = &report.trajectory_error_elements;
        Some(Self { first: errors.first()?.clone(), more: errors.len() - 1, n })
    }
}

impl fmt::Display for PathRefused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use TrajectoryErrorType as Kind;
        let (error, n) = (&self.first, self.n);
        let at = format!("at waypoint {} of {n}", error.waypoint_index + 1);
        let joint = format!("joint {}", error.index + 1);
        let (value, least, most) = (error.error_value, error.min_value, error.max_value);
        let between = |unit: &str| format!("allowed is {least:.1} to {most:.1} {unit}");
        f.write_str("the arm refuses the path: ")?;
        match error.error_type() {
            Kind::InvalidJointSpeed | Kind::LargeSpeed => {
                let allowed = between("deg/s");
                write!(f, "{joint} would turn at {value:.1} deg/s {at}; {allowed}")
            }
            Kind::InvalidAcceleration => {
                let allowed = between("deg/s²");
                write!(f, "{joint} would accelerate at {value:.1} deg/s² {at}; {allowed}")
            }
            Kind::InvalidJointPosition => {
                write!(f, "{joint} would go to {value:.1} deg {at}; {}", between("deg"))
            }
            Kind::InvalidDuration => {
                write!(f, "{value:.3} s are given {at}; at least {least:.3} s are needed")
            }
            Kind::ActuatorCountMismatch => {
                write!(f, "it has another number of joints than the arm {at}")
            }
            Kind::InvalidTrajectorySize => write!(f, "it has {n} waypoints, too many or none"),
            Kind::OutsideWorkspace => write!(f, "it leaves the arm's workspace {at}"),
            Kind::WrongStartingPoint => write!(f, "it does not begin where the arm is"),
            other => write!(f, "{other:?} {at}, value {value:.3}, {}", between("")),
        }?;
        if !error.message.is_empty() {
            write!(f, " (\"{}\")", error.message)?;
        }
        match self.more {
            0 => Ok(()),
            1 => write!(f, "; and one thing more"),
            more => write!(f, "; and {more} things more"),
        }
    }
}
