//! Two ways to find free motions on the public problems of `MotionBenchMaker`, with the grasps for the Gen3.
//!
//! `cargo run --release --example motion_problems [DATA] [N]`: the first `N` problems of each set (default 2) in
//! `DATA` (`panda.json` and `gen3_goals.json`; default `../shared/data/public/motionbenchmaker`).
//!
//! A line for each set and means: how many problems are solved, of those how many motions touch nothing at 500
//! configurations a radian; medians of the time to plan (ms), of it for a step of the policies (µs), and to time (ms); means
//! of the motion's duration (s), length (rad) and jerk (root of the mean square, rad/s³).

#![expect(
    clippy::unwrap_used,
    reason = "a failed unwrap here is a file or an argument that is not what it says"
)]
#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::path::PathBuf;
use std::time::Instant;

use trueup::motion::free::{Means, plan};
use trueup::motion::ik::Solver;
use trueup::motion::polyline::{l2, mix};
use trueup::motion::rrt::Settings;
use trueup::motion::trajectory::{Limits, Trajectory};
use trueup::motion::{Budget, Robot};

#[path = "../tests/motion/problems.rs"]
mod problems;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let data = arguments.next().unwrap_or_else(|| "../shared/data/public/motionbenchmaker".into());
    let of_each = arguments.next().map_or(2, |n| n.parse().unwrap());
    let folder = PathBuf::from(data);
    if !folder.join("gen3_goals.json").exists() {
        println!("skipped: {} is not here", folder.display());
        return;
    }
    let robot = Robot::gen3();
    println!(
        "set                  means    solved      free  plan/ms step/us  time/ms  duration/s length/rad jerk"
    );
    for (set, problems) in problems::problems(&folder, &robot, of_each) {
        for means in [Means::Rrt, Means::Rmpflow] {
            println!("{set:20} {means:<8?} {}", Tried::on(&robot, &problems, means).line());
        }
    }
}

/// What came of the problems of a set.
#[derive(Default)]
struct Tried {
    posed: usize,
    free: usize,
    plan_ms: Vec<f64>,
    step_us: Vec<f64>,
    time_ms: Vec<f64>,
    duration: f64,
    length: f64,
    jerk: f64,
}

impl Tried {
    fn on(robot: &Robot, problems: &[problems::Problem<'_>], means: Means) -> Self {
        let solver = Solver::new(robot);
        let (home, limits) = (robot.pose("home").unwrap(), Limits::of(robot));
        let (run, settings) = (Budget::new(|| false), Settings::default());
        let mut tried = Self { posed: problems.len(), ..Self::default() };
        for problem in problems {
            let (world, goals) = (&problem.world, &problem.goals);
            let begin = Instant::now();
            let Ok(path) = plan(means, &solver, world, home, goals, None, &settings, &run) else {
                println!("  not solved: {}", problem.name);
                continue;
            };
            let planned = begin.elapsed().as_secs_f64();
            tried.plan_ms.push(planned * 1e3);
            if means == Means::Rmpflow {
                tried.step_us.push(planned * 1e6 / path.samples.max(1) as f64);
            }
            let begin = Instant::now();
            let timed = Trajectory::through_corners(&path.corners, &limits, 0.2, &|a, b| {
                world.certify(a, b)
            });
            tried.time_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            let timed = timed.unwrap();
            tried.free += usize::from(path.corners.windows(2).all(|edge| {
                let n = (l2(&edge[0], &edge[1]) * 500.0).ceil().max(1.0) as usize;
                (0..=n).all(|k| world.free(&mix(&edge[0], &edge[1], k as f64 / n as f64)))
            }));
            tried.duration += timed.duration();
            tried.length += path.length();
            tried.jerk += jerk(&timed);
        }
        tried
    }

    fn line(mut self) -> String {
        let n = self.plan_ms.len().max(1) as f64;
        let median = |list: &mut Vec<f64>| {
            list.sort_by(f64::total_cmp);
            list.get(list.len() / 2).copied().unwrap_or(0.0)
        };
        format!(
            "{:3} of {:3} {:5} {:10.2} {:7.1} {:8.2} {:11.2} {:10.2} {:5.1}",
            self.plan_ms.len(),
            self.posed,
            self.free,
            median(&mut self.plan_ms),
            median(&mut self.step_us),
            median(&mut self.time_ms),
            self.duration / n,
            self.length / n,
            self.jerk / n
        )
    }
}

/// The root of the mean square of the jerk, rad/s³, Euclidean over the joints, by differences at 1 kHz.
fn jerk(timed: &Trajectory) -> f64 {
    let n = (timed.duration() * 1e3).ceil() as usize;
    let accelerations: Vec<Vec<f64>> = (0..=n).map(|k| timed.sample(k as f64 * 1e-3).ddq).collect();
    let squares = accelerations.windows(2).map(|pair| (l2(&pair[0], &pair[1]) * 1e3).powi(2));
    (squares.sum::<f64>() / n.max(1) as f64).sqrt()
}
