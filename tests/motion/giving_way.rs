//! Motions among things that move: they arrive without touching, within limits; without being told they would touch.

use nalgebra::{Isometry3, Vector3};
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::giving_way::GivingWay;
use trueup::motion::rmpflow::{STEP, Target};
use trueup::motion::solid::Solid;
use trueup::motion::trajectory::{Limits, Sample};
use trueup::motion::{Error, Robot};
use trueup::twin::{Settings, Twin};
use trueup::world::{Pose, Shape};

use crate::twin;

/// A ball that moves on straight ahead, as a head or a fist may.
#[derive(Clone, Copy)]
struct Ball {
    radius: f64,
    /// Where it is at first, m, and how fast it goes, m/s.
    from: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Ball {
    fn at(&self, time: f64) -> Obstacle {
        let at = self.from + self.velocity * time;
        Obstacle::new("ball", Solid::Sphere { radius: self.radius }, Isometry3::from(at))
    }

    /// Crosses where the tool's point is on a share of the straight motion between two configurations, at `time`, at
    /// `speed` m/s in the direction `way`: along the arm's own way back, outwards, up.
    fn meets(
        robot: &Robot,
        [start, goal]: [&[f64]; 2],
        (share, time): (f64, f64),
        (radius, speed, way): (f64, f64, [f64; 3]),
    ) -> Self {
        let q: Vec<f64> = start.iter().zip(goal).map(|(a, b)| a + share * (b - a)).collect();
        let at = robot.forward(&q).unwrap().origin();
        let out = Vector3::new(at.x, at.y, 0.0).normalize();
        let back = Vector3::z().cross(&out) * -1.0;
        let velocity = (back * way[0] + out * way[1] + Vector3::z() * way[2]).normalize() * speed;
        Self { radius, from: Vector3::new(at.x, at.y, at.z) - velocity * time, velocity }
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

/// Goes to `goal` for `seconds`, told of the ball `every` so many ticks, each time as it was `late` s before.
fn goes(
    robot: &Robot,
    [start, goal]: [&[f64]; 2],
    ball: Ball,
    seconds: f64,
    told: Option<(usize, f64)>,
) -> Went {
    let world = CollisionWorld::new(robot).with(&[ball.at(0.0)]);
    let limits = Limits::of(robot);
    let mut motion = GivingWay::new(&world, &limits, start).unwrap();
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
            motion.sees(now - late, &[ball.at(now - late)]).unwrap();
        }
        let at = motion.tick(&target).unwrap();
        let around = CollisionWorld::new(robot).with(&[ball.at(motion.time())]);
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
fn a_ball_that_crosses_the_way_is_gone_round_by_an_arm_that_is_told_of_it() {
    let robot = Robot::gen3();
    let (start, goal) = start_and_goal(&robot);
    let ends = [&start[..], &goal[..]];
    // Head-on, head-on and rising, from below, from above.
    let ways = [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let (mut tried, mut would_touch) = (0, 0);
    for (share, time) in [(0.5, 1.5), (0.5, 2.5), (0.7, 2.0)] {
        for (radius, speed) in [(0.06, 0.1), (0.06, 0.2), (0.1, 0.3)] {
            for way in ways {
                let ball = Ball::meets(&robot, ends, (share, time), (radius, speed, way));
                let at_first = CollisionWorld::new(&robot).with(&[ball.at(0.0)]).distance(&start);
                if at_first < 0.05 {
                    continue;
                }
                // Thirty pictures a second, each 50 ms old.
                let told = goes(&robot, ends, ball, 9.0, Some((10, 0.05)));
                let case = format!("{share} {time} {radius} {speed} {way:?}");
                assert!(told.least > 0.0, "{case}: {} m", told.least);
                assert!(told.off < 0.01, "{case}: {} m from its target", told.off);
                assert!(told.shares.iter().all(|share| *share <= 1.0 + 1e-9), "{:?}", told.shares);
                tried += 1;
                would_touch += u32::from(goes(&robot, ends, ball, 9.0, None).least < 0.0);
            }
        }
    }
    assert!(tried >= 20 && 3 * would_touch >= tried, "{would_touch} of {tried} in the way");
}

#[test]
fn what_is_not_seen_any_more_is_still_kept_away_from_and_what_is_new_as_well() {
    let robot = Robot::gen3();
    let (start, goal) = start_and_goal(&robot);
    let world = CollisionWorld::new(&robot);
    let target = Target {
        tip: *robot.forward(&goal).unwrap().isometry(),
        posture: goal.clone(),
        upright: None,
    };
    let ball = Ball::meets(&robot, [&start, &goal], (0.5, 1.0), (0.08, 0.3, [0.0, 0.0, -1.0]));
    let mut motion = GivingWay::new(&world, &Limits::of(&robot), &start).unwrap();
    // Seen for a tenth of a second, at first, and never again: it is expected where it would have come to rest.
    let rests = ball.at(0.1 + 0.5);
    let mut least = f64::INFINITY;
    for k in 0..1800 {
        let now = motion.time();
        if k % 10 == 0 && now < 0.105 {
            motion.sees(now, &[ball.at(now)]).unwrap();
        }
        let at = motion.tick(&target).unwrap();
        if now > 0.6 {
            least = least.min(
                CollisionWorld::new(&robot).with(std::slice::from_ref(&rests)).distance(&at.q),
            );
        }
    }
    assert!(least > 0.0, "{least} m");
    let nowhere = Obstacle::new(
        "ball",
        Solid::Sphere { radius: 0.1 },
        Isometry3::translation(f64::NAN, 0.0, 0.0),
    );
    assert!(matches!(motion.sees(9.0, &[nowhere]), Err(Error::Sight { .. })));
    assert!(matches!(motion.sees(0.05, &[ball.at(0.05)]), Err(Error::Sight { .. })));
    assert!(matches!(
        GivingWay::new(&world, &Limits::of(&robot), &[0.0; 3]),
        Err(Error::WrongLength { .. })
    ));
}

/// The arm of the twin follows what is sent, and is told what the twin says of a tall box that slides across the table.
#[test]
fn a_box_that_slides_across_the_table_of_the_twin_is_let_pass() {
    let robot = twin::gen3();
    let shape = Shape::Cuboid { size: Vector3::new(0.08, 0.08, 0.6) };
    let scene = twin::scene(vec![twin::solid("box", shape.clone(), 0.5)]);
    let start = twin::HOME.to_vec();
    let mut goal = start.clone();
    goal[0] += 1.2;
    let mut settings = Settings::for_arm(&robot);
    settings.friction.table_object = 0.0;
    let target =
        Target { tip: *robot.forward(&goal).unwrap().isometry(), posture: goal, upright: None };
    // Nothing holds it on a table that leans a little, so much m/s².
    let goes = |x: f64, leans: f64, is_told: bool| {
        let placed = [("box", twin::at(x, 0.38, 0.0), 0.0)];
        let mut settings = settings.clone();
        settings.gravity.y = -leans;
        let mut twin = Twin::new(&robot, &scene, &twin::state(&start, &placed), settings).unwrap();
        let boxed = |twin: &Twin| {
            let state = twin.state();
            let pose = state.object("box").unwrap().world_from_object.unwrap();
            Obstacle::of_object("box", &shape, 0.0, Pose::new(*pose.isometry()))
        };
        let world = CollisionWorld::new(&robot);
        let world = if is_told { world.with(&boxed(&twin)) } else { world };
        let mut motion = GivingWay::new(&world, &Limits::of(&robot), &start).unwrap();
        let mut least = f64::INFINITY;
        for k in 0..2400 {
            if is_told && k % 10 == 0 {
                motion.sees(motion.time(), &boxed(&twin)).unwrap();
            }
            let at = motion.tick(&target).unwrap();
            twin.command(&at.q, &at.dq).unwrap();
            while twin.time() < motion.time() {
                twin.step().unwrap();
            }
            if k % 3 == 0 {
                let around = CollisionWorld::new(&robot).with(&boxed(&twin));
                least = least.min(around.distance(&twin.q()));
            }
        }
        let off = robot.forward(&twin.q()).unwrap().origin() - target.tip.translation.vector;
        (least, off.norm())
    };
    for (x, leans) in [(0.31, 0.1), (0.31, 0.2), (0.22, 0.3)] {
        let (least, off) = goes(x, leans, true);
        assert!(least > 0.0 && off < 0.02, "{x} {leans}: {least} m, {off} m from its target");
        let (least, _) = goes(x, leans, false);
        assert!(least < 0.0, "{x} {leans}: it was never in the way, {least} m");
    }
}
