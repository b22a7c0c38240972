//! What the joints and fingers do, tick by tick: hold, follow a path, keep a speed, obey a stream, brake.
//!
//! Joint positions count turns here, in rad; sessions, actions and the wire are other files' business.

use std::sync::Arc;

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::arm::ticked::Plant;
use crate::arm::{DeviceError, Feedback};
use crate::motion::robot::Robot;
use crate::motion::trajectory::{Limits, Trajectory};

use super::drive::Drive;

/// Time between two commands to the joints, s.
pub(super) const TICK: f64 = 0.002;
/// How fast stopped joints slow down, rad/s²: a little under the arm's own limit.
const BRAKE: f64 = 4.0;
/// A path ends this long after its last command, s.
const SETTLE: f64 = 0.2;
/// How fast a path that is paused comes to rest and back to its pace: its rate changes by so much a second.
const PAUSING: f64 = 3.0;
/// A joint this far behind its command is a fault, rad: 5 deg, as the user guide's safety table says.
const FOLLOWING: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A joint this far behind is warned of, rad: 3 deg, by the same table.
pub(super) const WARNING: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Fingers that move less than this in [`FINGER_LOOK`] rest, m.
const FINGERS_STILL: f64 = 3e-4;
const FINGER_LOOK: f64 = 0.1;
/// Fastest fingers, m/s, and the most a pad presses with when nobody says, N (chosen: what holds a full
/// jar; Kinova's controller has no command for force).
pub(super) const FINGER_SPEED: f64 = 0.15;
const FINGER_FORCE: f64 = 60.0;
/// How much slower twists are followed near a singularity: damping of the inverse, m and rad.
const DAMPING: f64 = 1e-3;

/// What the joints are doing.
#[derive(Debug, Clone)]
pub(super) enum Motion {
    /// They hold.
    Hold,
    /// They follow a path.
    Path(Path),
    /// They keep speeds, rad/s.
    Speeds(Vec<f64>),
    /// The tool keeps a twist, m/s and rad/s.
    Twist {
        /// Linear, then angular.
        twist: Vector6<f64>,
        /// Whether in the tool's axes, else the base's.
        in_tool: bool,
        /// Whether it comes of a wrench.
        is_pushed: bool,
    },
    /// They slow down and then hold.
    Brake,
    /// They do what each cycle asks of them.
    Stream(Vec<Drive>),
    /// They hold until this time of the arm, s.
    Wait(f64),
}

/// A path being followed.
#[derive(Debug, Clone)]
pub(super) struct Path {
    trajectory: Trajectory,
    /// When each waypoint is passed, s along the path.
    marks: Vec<f64>,
    passed: usize,
    along: f64,
    rate: f64,
    is_paused: bool,
}

/// What happened during a tick.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Happened {
    /// The path, or the wait, is over.
    Arrived,
    /// This waypoint was passed.
    Passed(usize),
    /// The fingers came to rest.
    FingersRest,
    /// This joint (from 0) did not follow.
    LeftBehind(usize),
    /// This joint (from 0) was led where it cannot be or as fast as it cannot be, and its bit for that.
    OverLimit(usize, u32),
    /// The plant failed.
    Broken(String),
}

/// The fingers.
#[derive(Debug, Clone, Copy)]
struct Fingers {
    goal: f64,
    speed: f64,
    is_moving: bool,
    /// Opening at the last look, m, and when that was, s.
    look: (f64, f64),
}

/// Joints and fingers of a plant.
pub(super) struct Servo {
    pub(super) robot: Arc<Robot>,
    plant: Box<dyn Plant>,
    pub(super) limits: Limits,
    /// The tool is kept to this speed, m/s, in what the base commands itself.
    tool_speed: f64,
    motion: Motion,
    fingers: Fingers,
    /// What the plant last said.
    pub(super) report: Feedback,
    /// Joint positions sent last, rad.
    pub(super) q_cmd: Vec<f64>,
    pub(super) dq_cmd: Vec<f64>,
    /// How fast a stream of positions leads the joints, rad/s, smoothed.
    pub(super) led: Vec<f64>,
    pub(super) is_ideal: bool,
    /// The arm's time, s.
    pub(super) time: f64,
}

/// Returns a speed the fingers can have, m/s.
fn held(speed: f64) -> f64 {
    speed.clamp(0.02, FINGER_SPEED)
}

/// Returns where the tool is, m in the base.
fn tool_at(robot: &Robot, q: &[f64]) -> Vector3<f64> {
    robot
        .forward_tool(q)
        .map_or_else(|_| Vector3::zeros(), |tool| tool.isometry().translation.vector)
}

/// Returns the share of joint speeds, rad/s, that keeps the tool to a speed, m/s; at most 1.
fn share_within(robot: &Robot, q: &[f64], dq: &[f64], speed: f64) -> f64 {
    if speed == f64::INFINITY {
        return 1.0;
    }
    let next: Vec<f64> = q.iter().zip(dq).map(|(q, dq)| q + dq * TICK).collect();
    let fast = (tool_at(robot, &next) - tool_at(robot, q)).norm() / TICK;
    if fast > speed { speed / fast } else { 1.0 }
}

impl Servo {
    pub(super) fn new(robot: Arc<Robot>, mut plant: Box<dyn Plant>) -> Self {
        let report = plant.report();
        let fingers = Fingers {
            goal: report.opening,
            speed: 0.0,
            is_moving: false,
            look: (report.opening, 0.0),
        };
        Self {
            limits: Limits::of(&robot),
            tool_speed: f64::INFINITY,
            q_cmd: report.q.clone(),
            dq_cmd: vec![0.0; report.q.len()],
            led: vec![0.0; report.q.len()],
            is_ideal: plant.is_ideal(),
            motion: Motion::Hold,
            time: 0.0,
            robot,
            plant,
            fingers,
            report,
        }
    }

    /// Returns what the joints are doing.
    pub(super) fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Returns whether joints or fingers move or are about to.
    pub(super) fn is_busy(&self) -> bool {
        !matches!(self.motion, Motion::Hold) || self.fingers.is_moving
    }

    /// Returns whether the fingers were stopped on their way to where they were sent.
    pub(super) fn is_stalled(&self) -> bool {
        !self.fingers.is_moving && (self.report.opening - self.fingers.goal).abs() > 3e-3
    }

    /// Returns whether the fingers were last sent to this opening, m, at about this speed, m/s.
    pub(super) fn is_aimed_at(&self, opening: f64, speed: f64) -> bool {
        let is_as_fast = (self.fingers.speed - held(speed)).abs() < 0.1 * FINGER_SPEED;
        (self.fingers.goal - opening).abs() < 1e-4 && is_as_fast
    }

    /// Stops the fingers where they are.
    pub(super) fn stop_fingers(&mut self) -> Result<(), DeviceError> {
        if self.fingers.is_moving { self.aim(self.report.opening, FINGER_SPEED) } else { Ok(()) }
    }

    /// Returns the speed of the fingers while they move, m/s.
    pub(super) fn finger_speed(&self) -> f64 {
        if self.fingers.is_moving { self.fingers.speed } else { 0.0 }
    }

    /// Follows a trajectory that begins at the last command; `marks` are the times of its waypoints, s.
    pub(super) fn follow(&mut self, trajectory: Trajectory, marks: Vec<f64>) {
        let path = Path { trajectory, marks, passed: 0, along: 0.0, rate: 1.0, is_paused: false };
        self.motion = Motion::Path(path);
    }

    /// Keeps joint speeds, rad/s, each held to its limit.
    pub(super) fn keep_speeds(&mut self, speeds: Vec<f64>) {
        self.motion = Motion::Speeds(speeds);
    }

    /// Keeps a twist of the tool, m/s and rad/s.
    pub(super) fn keep_twist(&mut self, twist: Vector6<f64>, in_tool: bool, is_pushed: bool) {
        self.motion = Motion::Twist { twist, in_tool, is_pushed };
    }

    /// Holds for so many seconds, then says it has arrived.
    pub(super) fn wait(&mut self, seconds: f64) {
        self.motion = Motion::Wait(self.time + seconds);
    }

    /// Does what a cycle asks of the joints.
    pub(super) fn stream(&mut self, drives: Vec<Drive>) {
        if !matches!(self.motion, Motion::Stream(_)) {
            self.led.fill(0.0);
        }
        self.motion = Motion::Stream(drives);
    }

    /// Slows down and holds.
    pub(super) fn brake(&mut self) {
        if !matches!(self.motion, Motion::Hold) {
            self.motion = Motion::Brake;
        }
    }

    /// Holds where the joints are, wherever they were sent; fingers stop on their way.
    pub(super) fn hold_here(&mut self) {
        self.q_cmd.clone_from(&self.report.q);
        self.dq_cmd.fill(0.0);
        self.motion = Motion::Hold;
        // A plant that takes no commands any more has nothing left to be told; the fault stands.
        let _ = self.plant.command(&self.q_cmd, &self.dq_cmd);
        let _ = self.stop_fingers();
    }

    /// Returns how far each joint is behind its command, rad.
    pub(super) fn behind(&self) -> impl Iterator<Item = f64> + '_ {
        self.q_cmd.iter().zip(&self.report.q).map(|(q_cmd, q)| (q_cmd - q).abs())
    }

    /// Lets joints that were told speeds and torques hold: nobody says any more how long.
    pub(super) fn hold_driven(&mut self) {
        if let Motion::Stream(drives) = &mut self.motion {
            for drive in drives.iter_mut().filter(|drive| !matches!(drive, Drive::Position(_))) {
                *drive = Drive::Speed(0.0);
            }
        }
    }

    /// Pauses a path or lets it go on; returns whether there is one.
    pub(super) fn pause(&mut self, is_paused: bool) -> bool {
        if let Motion::Path(path) = &mut self.motion {
            path.is_paused = is_paused;
            return true;
        }
        false
    }

    /// Sends the fingers to an opening, m, at a speed, m/s.
    pub(super) fn aim(&mut self, opening: f64, speed: f64) -> Result<(), DeviceError> {
        let speed = held(speed);
        self.plant.aim(opening, speed, FINGER_FORCE)?;
        // Fingers that are sent elsewhere on their way are looked at when they would have been.
        let look = if self.fingers.is_moving {
            self.fingers.look
        } else {
            (self.report.opening, self.time)
        };
        self.fingers = Fingers { goal: opening, speed, is_moving: true, look };
        Ok(())
    }

    /// Lets one tick pass.
    pub(super) fn tick(&mut self) -> Vec<Happened> {
        let mut happened = Vec::new();
        if let Some((q, dq)) = self.order(&mut happened) {
            // What no joint could follow is not sent to it.
            let far = |(q, at): (&f64, &f64)| (q - at).abs() > FOLLOWING;
            if let Some(joint) = q.iter().zip(&self.report.q).position(far) {
                happened.push(Happened::LeftBehind(joint));
            } else if let Some(over) = self.over_limit(&q) {
                happened.push(over);
            } else {
                if let Err(error) = self.plant.command(&q, &dq) {
                    happened.push(Happened::Broken(error.to_string()));
                }
                (self.q_cmd, self.dq_cmd) = (q, dq);
            }
        }
        if let Err(error) = self.plant.advance(TICK) {
            happened.push(Happened::Broken(error.to_string()));
        }
        self.time += TICK;
        self.report = self.plant.report();
        let behind = self.behind().position(|by| by > FOLLOWING);
        happened.extend(behind.map(Happened::LeftBehind));
        if self.fingers.is_moving && self.time - self.fingers.look.1 >= FINGER_LOOK {
            if (self.report.opening - self.fingers.look.0).abs() < FINGERS_STILL {
                self.fingers.is_moving = false;
                happened.push(Happened::FingersRest);
            }
            self.fingers.look = (self.report.opening, self.time);
        }
        happened
    }

    /// Works out the next command of the joints, and moves the motion on.
    fn order(&mut self, happened: &mut Vec<Happened>) -> Option<(Vec<f64>, Vec<f64>)> {
        match &mut self.motion {
            Motion::Hold => None,
            Motion::Wait(until) => {
                if self.time >= *until {
                    self.motion = Motion::Hold;
                    happened.push(Happened::Arrived);
                }
                None
            }
            Motion::Path(path) => {
                let share = if self.tool_speed.is_finite() {
                    let at = path.trajectory.sample(path.along);
                    share_within(&self.robot, &at.q, &at.dq, self.tool_speed)
                } else {
                    1.0
                };
                let wanted = if path.is_paused { 0.0 } else { share };
                let most = PAUSING * TICK;
                path.rate += (wanted - path.rate).clamp(-most, most);
                path.along += path.rate * TICK;
                while path.marks.get(path.passed).is_some_and(|mark| path.along >= *mark) {
                    happened.push(Happened::Passed(path.passed));
                    path.passed += 1;
                }
                let duration = path.trajectory.duration();
                let at = path.trajectory.sample(path.along.min(duration));
                let rate = if path.along < duration { path.rate } else { 0.0 };
                let order = (at.q, at.dq.iter().map(|dq| dq * rate).collect());
                if path.along >= duration + SETTLE {
                    self.motion = Motion::Hold;
                    happened.push(Happened::Arrived);
                }
                Some(order)
            }
            Motion::Speeds(speeds) => {
                let speeds = speeds.clone();
                Some(self.ramped(&speeds))
            }
            Motion::Twist { twist, in_tool, .. } => {
                let (twist, in_tool) = (*twist, *in_tool);
                let speeds = self.speeds_of(twist, in_tool);
                Some(self.ramped_together(&speeds))
            }
            Motion::Brake => {
                let fastest = self.dq_cmd.iter().fold(0.0_f64, |most, dq| most.max(dq.abs()));
                let left =
                    if fastest > 0.0 { (1.0 - BRAKE * TICK / fastest).max(0.0) } else { 0.0 };
                let dq: Vec<f64> = self.dq_cmd.iter().map(|dq| dq * left).collect();
                let q = self.q_cmd.iter().zip(&dq).map(|(q, dq)| q + dq * TICK).collect();
                if left <= 0.0 {
                    self.motion = Motion::Hold;
                }
                Some((q, dq))
            }
            Motion::Stream(drives) => {
                let drives = drives.clone();
                Some(self.driven(&drives))
            }
        }
    }

    /// Returns the command one tick nearer to some joint speeds, within speeds, accelerations and ranges.
    fn ramped(&self, speeds: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let share = share_within(&self.robot, &self.q_cmd, speeds, self.tool_speed);
        let mut dq = Vec::with_capacity(speeds.len());
        let mut q = Vec::with_capacity(speeds.len());
        for (i, speed) in speeds.iter().enumerate() {
            let most = self.limits.acceleration[i] * TICK;
            let wanted = speed * share;
            let wanted = wanted.clamp(-self.limits.velocity[i], self.limits.velocity[i]);
            let speed = self.dq_cmd[i] + (wanted - self.dq_cmd[i]).clamp(-most, most);
            let speed = self.braked(i, speed);
            q.push(self.q_cmd[i] + speed * TICK);
            dq.push(speed);
        }
        (q, dq)
    }

    /// As [`Self::ramped`], of joints that lead the tool together: what holds one back holds back all, so that the tool goes where it is led.
    fn ramped_together(&self, speeds: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let within = |(i, speed): (usize, &f64)| {
            let most = self.limits.velocity[i];
            let held = self.braked(i, speed.clamp(-most, most));
            if *speed == 0.0 { 1.0 } else { held / speed }
        };
        let slowest = share_within(&self.robot, &self.q_cmd, speeds, self.tool_speed);
        let share = speeds.iter().enumerate().map(within).fold(slowest, f64::min);
        let changes: Vec<f64> =
            speeds.iter().zip(&self.dq_cmd).map(|(speed, dq)| speed * share - dq).collect();
        let most = changes.iter().zip(&self.limits.acceleration);
        let share = most.map(|(change, most)| most * TICK / change.abs()).fold(1.0, f64::min);
        let next = self.dq_cmd.iter().zip(&changes).enumerate();
        // A joint at the end of its range is braked in time, whatever that does to the others.
        let dq: Vec<f64> =
            next.map(|(i, (dq, change))| self.braked(i, dq + change * share)).collect();
        let q = self.q_cmd.iter().zip(&dq).map(|(q, dq)| q + dq * TICK).collect();
        (q, dq)
    }

    /// Returns the speed of a joint (from 0), rad/s, that is braked in time at the end of its range.
    pub(super) fn braked(&self, joint: usize, speed: f64) -> f64 {
        let (q, range) = (self.q_cmd[joint], &self.robot.joints()[joint]);
        let room = if speed > 0.0 { range.upper - q } else { q - range.lower };
        if !room.is_finite() {
            return speed;
        }
        let fastest = (2.0 * 0.9 * self.limits.acceleration[joint] * room.max(0.0)).sqrt();
        speed.clamp(-fastest, fastest)
    }

    /// Keeps the tool to a speed, m/s, in what the base commands itself.
    pub(super) fn keep_tool_within(&mut self, speed: f64) {
        self.tool_speed = speed;
    }

    /// Returns where the tool was last sent, and where it will be in so many seconds if nothing changes, m
    /// in the base.
    pub(super) fn tool_ahead(&self, seconds: f64) -> (Vector3<f64>, Vector3<f64>) {
        let soon: Vec<f64> =
            self.q_cmd.iter().zip(&self.dq_cmd).map(|(q, dq)| q + dq * seconds).collect();
        (tool_at(&self.robot, &self.q_cmd), tool_at(&self.robot, &soon))
    }

    /// Returns the joint speeds of a twist of the tool, damped near singularities.
    fn speeds_of(&self, twist: Vector6<f64>, in_tool: bool) -> Vec<f64> {
        let still = vec![0.0; self.q_cmd.len()];
        let (Ok(flange), Ok(jacobian)) =
            (self.robot.forward(&self.q_cmd), self.robot.jacobian(&self.q_cmd))
        else {
            return still;
        };
        let rotation = flange.isometry().rotation;
        let (mut linear, mut angular) =
            (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
        if in_tool {
            (linear, angular) = (rotation * linear, rotation * angular);
        }
        // The Jacobian is about the flange; the tool's origin moves with its lever.
        let lever = rotation * self.robot.flange_from_tool().isometry().translation.vector;
        let linear = linear - angular.cross(&lever);
        let wanted = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        let normal = &jacobian * jacobian.transpose() + Matrix6::identity() * DAMPING;
        match normal.lu().solve(&wanted) {
            Some(weights) => (jacobian.transpose() * weights).iter().copied().collect(),
            None => still,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::plant::Ideal;
    use super::*;

    /// A tool that was led faster than a joint can turn went another way.
    #[test]
    fn what_holds_one_joint_back_holds_back_all() {
        let robot = Arc::new(Robot::gen3());
        let home = robot.pose("home").unwrap().to_vec();
        let mut servo = Servo::new(robot, Box::new(Ideal::new(&home)));
        let fastest = servo.limits.velocity[0];
        let asked = [2.0 * fastest, 0.1, -0.2, 0.0, 0.3, 0.1, 0.1];
        for _ in 0..500 {
            (servo.q_cmd, servo.dq_cmd) = servo.ramped_together(&asked);
            let share = servo.dq_cmd[0] / asked[0];
            let off = servo.dq_cmd.iter().zip(asked).map(|(dq, asked)| (dq - share * asked).abs());
            assert!(off.fold(0.0, f64::max) < 1e-9, "{:?}", servo.dq_cmd);
        }
        assert!((servo.dq_cmd[0] - fastest).abs() < 1e-9, "{:?}", servo.dq_cmd);
    }
}
