//! A stop keeps the limits that motions keep: each robot's own accelerations, and jerks that reach them in 0.05 s.
//!
//! Every arm braked at 4 rad/s² from one command to the next: a Panda at twice the acceleration of its second joint.

use std::sync::{Arc, Mutex};

use trueup::arm::limits::Limits as Gate;
use trueup::arm::ticked::{Brake, Plant, Ticked};
use trueup::arm::{Arm as _, Cancel, DeviceError, Feedback};
use trueup::motion::Robot;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::workcell::Stdlib;
use trueup::world::Pose;

/// Commands are so far apart, s.
const PERIOD: f64 = 0.004;

/// What was sent to an arm, rad.
type Sent = Arc<Mutex<Vec<Vec<f64>>>>;

/// An arm that is where it was sent last.
struct There(Sent);

impl Plant for There {
    fn command(&mut self, q: &[f64], _dq: &[f64]) -> Result<(), DeviceError> {
        self.0.lock().unwrap().push(q.to_vec());
        Ok(())
    }

    fn aim(&mut self, _opening: f64, _speed: f64, _force: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn advance(&mut self, _seconds: f64) -> Result<(), DeviceError> {
        Ok(())
    }

    fn report(&mut self) -> Feedback {
        let q = self.0.lock().unwrap().last().unwrap().clone();
        let none = vec![0.0; q.len()];
        Feedback {
            time: 0.0,
            q_cmd: Vec::new(),
            q,
            dq: none.clone(),
            tau: none,
            opening: 0.085,
            mass: None,
            moving: Vec::new(),
        }
    }
}

fn robots() -> Vec<(&'static str, Robot)> {
    let read = |name| (name, Stdlib::embedded().robot(name).unwrap());
    ["gen3_2f85", "panda", "ur5e_2f85"].map(read).into()
}

/// Home and places so far from it, rad; joints that are not named stay.
fn corners(robot: &Robot, offsets: &[&[f64]]) -> Vec<Vec<f64>> {
    let home = robot.pose("home").unwrap();
    let moved = |off: &&[f64]| -> Vec<f64> {
        let off = off.iter().copied().chain(std::iter::repeat(0.0));
        home.iter().zip(off).map(|(q, off)| q + off).collect()
    };
    offsets.iter().map(moved).collect()
}

/// Follows a path and stops it at a tick; returns all that was sent until the arm rested, and after that three times more.
fn stopped(robot: &Robot, path: &[Vec<f64>], at: usize) -> Vec<Vec<f64>> {
    let timed = Trajectory::through_corners(path, &Limits::of(robot), 0.3, &|_, _| true).unwrap();
    let gate = Gate { floor: f64::NEG_INFINITY, ..Gate::default() };
    let cleared = gate.clear(robot, &Pose::identity(), timed, &path[0]).unwrap();
    let sent: Sent = Arc::new(Mutex::new(vec![path[0].clone()]));
    let mut arm = Ticked::new(There(sent.clone()), Brake::of(robot));
    let cancel = Cancel::default();
    let mut ticks = 0;
    let went = arm.follow(&cleared, &cancel, &mut |_| {
        ticks += 1;
        if ticks == at {
            cancel.cancel();
        }
    });
    assert_eq!(went, Err(DeviceError::Stopped));
    let mut sent = sent.lock().unwrap().clone();
    let last = sent[sent.len() - 1].clone();
    sent.extend(std::iter::repeat_n(last, 3));
    sent
}

/// Differences from one row to the next, over time.
fn rates(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let rate = |pair: &[Vec<f64>]| -> Vec<f64> {
        pair[1].iter().zip(&pair[0]).map(|(next, last)| (next - last) / PERIOD).collect()
    };
    rows.windows(2).map(rate).collect()
}

/// The largest share of a limit that any joint takes.
fn most(rows: &[Vec<f64>], limits: &[f64]) -> f64 {
    let shares = rows.iter().flat_map(|row| row.iter().zip(limits).map(|(x, most)| x.abs() / most));
    shares.fold(0.0, f64::max)
}

#[test]
fn a_stop_in_any_phase_of_a_motion_keeps_acceleration_and_jerk() {
    let offsets: [&[f64]; 4] = [
        &[],
        &[0.6, -0.5, 0.0, 0.1],
        &[1.2, -0.6, 0.2, 0.5, 0.3, -0.4],
        &[0.9, -0.1, 0.2, 0.2, 0.3, -0.4],
    ];
    for (name, robot) in robots() {
        let path = corners(&robot, &offsets);
        let limits = Limits::of(&robot);
        for at in (4..).step_by(23).take(14) {
            let sent = stopped(&robot, &path, at);
            let speeds = rates(&sent);
            let pushes = rates(&speeds);
            let jerks = rates(&pushes);
            let shares = [most(&pushes, &limits.acceleration), most(&jerks, &limits.jerk)];
            assert!(shares.iter().all(|share| *share < 1.02), "{name}, tick {at}: {shares:?}");
            // A joint that hardly pushes takes that back in the time of the one that pushes most.
            let fastest = most(&speeds, &limits.velocity);
            assert!(fastest < 1.05, "{name}, tick {at}: {fastest}");
            let rests = &speeds[speeds.len() - 3..];
            assert!(most(rests, &limits.velocity) < 1e-9, "{name}, tick {at}: {rests:?}");
        }
    }
}

/// A single joint at full speed takes `v / a`, and 0.05 s for its jerk.
#[test]
fn a_stop_takes_no_longer_than_the_limits_ask_for() {
    for (name, robot) in robots() {
        let path = corners(&robot, &[&[], &[2.4]]);
        let joint = &robot.joints()[0];
        let up = joint.velocity / joint.acceleration + 0.05;
        let at = (up / PERIOD) as usize + 10;
        let sent = stopped(&robot, &path, at);
        let braked = (sent.len() - 3 - 1 - at) as f64 * PERIOD;
        assert!((braked - up).abs() < 2.0 * PERIOD, "{name}: {braked} s, {up} s");
        // Half as far as at full speed.
        let way = sent[sent.len() - 1][0] - sent[at][0];
        assert!((way - 0.5 * joint.velocity * up).abs() < 0.02, "{name}: {way} rad");
    }
}
