//! Motions among things that move: they arrive without touching, within limits; without being told they would touch.

use nalgebra::{Isometry3, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::giving_way::GivingWay;
use trueup::motion::rmpflow::{STEP, Target};
use trueup::motion::solid::Solid;
use trueup::motion::trajectory::{Limits, Sample};
use trueup::motion::{Error, Robot};

/// A pillar that stands on the table and moves across it.
#[derive(Clone, Copy)]
struct Pillar {
    /// Where its middle is at first, m, and how fast it goes, m/s.
    from: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Pillar {
    const RADIUS: f64 = 0.04;

    fn at(&self, time: f64) -> Obstacle {
        let at = self.from + self.velocity * time;
        let solid = Solid::Cylinder { radius: Self::RADIUS, half: 0.35 };
        Obstacle::new("pillar", solid, Isometry3::from_parts(at.into(), Default::default()))
    }

    /// Meets the tool's point on the straight motion between two configurations at `time`, across its way.
    fn meets(robot: &Robot, [start, goal]: [&[f64]; 2], share: f64, time: f64, speed: f64) -> Self {
        let q: Vec<f64> = start.iter().zip(goal).map(|(a, b)| a + share * (b - a)).collect();
        let at = robot.forward(&q).unwrap().origin();
        // Towards the arm's foot: as far out as it can go, the arm is behind.
        let velocity = -Vector3::new(at.x, at.y, 0.0).normalize() * speed;
        Self { from: Vector3::new(at.x, at.y, 0.36) - velocity * time, velocity }
    }
}

/// What came of a motion.
struct Went {
    /// The least exact distance, m.
    least: f64,
    /// How far the tip is from its target at the end, m.
    off: f64,
    /// The largest shares of the limits of speed, acceleration and jerk.
    shares: [f64; 3],
}

/// Goes to `goal` for `seconds`, told of the pillar `every` so many ticks, each time as it was `late` s before.
fn goes(robot: &Robot, [start, goal]: [&[f64]; 2], pillar: Pillar, seconds: f64, told: Option<(usize, f64)>) -> Went {
    let world = CollisionWorld::new(robot).with(&[pillar.at(0.0)]);
    let limits = Limits::of(robot);
    let mut motion = GivingWay::new(&world, limits.clone(), start).unwrap();
    let target = Target {
        tip: *robot.forward(goal).unwrap().isometry(),
        posture: goal.to_vec(),
        upright: None,
    };
    let mut went = Went { least: f64::INFINITY, off: 0.0, shares: [0.0; 3] };
    let mut last: Option<Sample> = None;
    for k in 0..(seconds / STEP) as usize {
        let now = motion.time();
        if let Some((_, late)) = told.filter(|(every, late)| k % every == 0 && now >= *late) {
            motion.sees(now - late, &[pillar.at(now - late)]).unwrap();
        }
        let at = motion.tick(&target).unwrap();
        let around = CollisionWorld::new(robot).with(&[pillar.at(motion.time())]);
        went.least = went.least.min(around.distance(&at.q));
        assert!(robot.outside_limits(&at.q, 0.0).is_none(), "{:?}", at.q);
        let before = last.as_ref().unwrap_or(&at);
        for i in 0..at.q.len() {
            let rates = [
                at.dq[i] / limits.velocity[i],
                at.ddq[i] / limits.acceleration[i],
                (at.ddq[i] - before.ddq[i]) / STEP / limits.jerk[i],
            ];
            for (share, rate) in went.shares.iter_mut().zip(rates) {
                *share = share.max(rate.abs());
            }
            assert!((at.q[i] - before.q[i] - STEP * at.dq[i]).abs() < 1e-9 || last.is_none());
        }
        last = Some(at);
    }
    let end = last.unwrap().q;
    went.off = (robot.forward(&end).unwrap().origin() - target.tip.translation.vector).norm();
    went
}

fn start_and_goal(robot: &Robot) -> (Vec<f64>, Vec<f64>) {
    let start = robot.pose("home").unwrap().to_vec();
    let mut goal = start.clone();
    goal[0] += 1.2;
    (start, goal)
}

#[test]
fn a_pillar_that_crosses_the_way_is_gone_round_by_an_arm_that_is_told_of_it() {
    let robot = Robot::gen3();
    let (start, goal) = start_and_goal(&robot);
    let ends = [&start[..], &goal[..]];
    // It crosses where the tool would be, a little earlier and later, and slower and faster than the tool.
    for (share, time, speed) in [(0.5, 2.0, 0.1), (0.4, 1.5, 0.15), (0.6, 2.0, 0.2), (0.5, 1.0, 0.1)] {
        let pillar = Pillar::meets(&robot, ends, share, time, speed);
        // Ten pictures a second would do for a slow one; a camera gives thirty, 50 ms late.
        let told = goes(&robot, ends, pillar, 12.0, Some((10, 0.05)));
        println!("{share} {time} {speed}: {:.4} m, {:.4} m off, {:?}", told.least, told.off, told.shares);
        let untold = goes(&robot, ends, pillar, 12.0, None);
        println!("   untold {:.4}", untold.least);
    }
}
