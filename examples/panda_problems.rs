//! Planning for the Panda on the public problems of `MotionBenchMaker`, by VAMP's conventions, to be run beside VAMP itself.
//!
//! `cargo run --release --example panda_problems URDF [DATA] [RUNS] [SEEDS]`: `URDF` is VAMP's `panda_spherized.urdf`, 59
//! spheres, with `panda.srdf` beside it; `DATA` holds `panda.json` (default `../shared/data/public/motionbenchmaker`). Cylinders
//! are capsules, in the set `box` boxes. `benches/peers/vamp_motion.py` runs VAMP on the same problems.
//!
//! A line for each set and one for all: problems solved; of the least of `RUNS` (default 3) times to plan, simplify and certify
//! a path (ms) the median and what 95 % are below; medians of the length (rad) over seeds 0 to `SEEDS` (default 4); how many
//! of the paths touch something at 500 configurations a radian.

#![expect(
    clippy::unwrap_used,
    reason = "a failed unwrap here is a file or an argument that is not what it says"
)]
#![expect(clippy::print_stdout, reason = "its output is what it is for")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use trueup::motion::collision::{CollisionWorld, Obstacle};
use trueup::motion::ik::Solver;
use trueup::motion::polyline::{l2, mix};
use trueup::motion::rrt::{Settings, plan};
use trueup::motion::solid::Solid;
use trueup::motion::{Budget, Robot};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(urdf) = arguments.next().map(PathBuf::from) else {
        println!("skipped: no panda_spherized.urdf of VAMP is named");
        return;
    };
    let data = arguments.next().unwrap_or_else(|| "../shared/data/public/motionbenchmaker".into());
    let mut number = |default: u64| arguments.next().map_or(default, |n| n.parse().unwrap());
    let (runs, seeds) = (number(3), number(4));
    let text = std::fs::read_to_string(Path::new(&data).join("panda.json")).unwrap();
    let problems: Problems = serde_json::from_str(&text).unwrap();
    let robot = robot(&urdf);
    println!("set                  solved  median/ms   95 %/ms  length/rad  touching");
    let mut all = Tried::default();
    for (set, problems) in &problems.sets {
        let mut tried = Tried::default();
        for problem in problems {
            tried.solve(&robot, set, problem, runs, seeds);
        }
        println!("{set:20} {}", tried.line());
        all.add(tried);
    }
    println!("{:20} {}", "all", all.line());
}

/// Reads VAMP's robot, with the pairs that its `panda.srdf` leaves out.
fn robot(urdf: &Path) -> Robot {
    let pairs = std::fs::read_to_string(urdf.with_file_name("panda.srdf")).unwrap();
    let mut side = "tip = \"panda_link8\"\n".to_owned();
    for line in pairs.lines().filter(|line| line.contains("<disable_collisions")) {
        let link = |key: &str| line.split(&format!("{key}=\"")).nth(1)?.split('"').next();
        let (first, second) = (link("link1").unwrap(), link("link2").unwrap());
        writeln!(side, "[[unchecked]]\nlink = \"{first}\"\nwith = [\"{second}\"]").unwrap();
    }
    Robot::from_urdf_with(&std::fs::read_to_string(urdf).unwrap(), &side, None).unwrap()
}

/// What came of problems.
#[derive(Default)]
struct Tried {
    posed: usize,
    solved: usize,
    plan_ms: Vec<f64>,
    length: Vec<f64>,
    touching: usize,
}

impl Tried {
    fn solve(&mut self, robot: &Robot, set: &str, problem: &Problem, runs: u64, seeds: u64) {
        let mut world = CollisionWorld::new(robot);
        for thing in &problem.obstacles {
            world.add(&thing.obstacle(set == "box"));
        }
        let solver = Solver::new(robot);
        let (goals, budget) = ([problem.goal.clone()], Budget::new(|| false));
        for seed in 0..seeds {
            self.posed += 1;
            let settings = Settings { seed, ..Settings::default() };
            let mut least = f64::INFINITY;
            let mut found = None;
            for _ in 0..runs {
                let begin = Instant::now();
                found =
                    plan(&solver, &world, &problem.start, &goals, None, &settings, &budget).ok();
                least = least.min(begin.elapsed().as_secs_f64() * 1e3);
            }
            let Some(path) = found else { continue };
            self.solved += 1;
            self.plan_ms.push(least);
            self.length.push(path.length());
            let is_free = path.corners.windows(2).all(|edge| {
                let n = (l2(&edge[0], &edge[1]) * 500.0).ceil().max(1.0) as usize;
                (0..=n).all(|k| world.free(&mix(&edge[0], &edge[1], k as f64 / n as f64)))
            });
            self.touching += usize::from(!is_free);
        }
    }

    fn add(&mut self, other: Self) {
        self.posed += other.posed;
        self.solved += other.solved;
        self.plan_ms.extend(other.plan_ms);
        self.length.extend(other.length);
        self.touching += other.touching;
    }

    fn line(&mut self) -> String {
        let at = |list: &mut Vec<f64>, share: f64| {
            list.sort_by(f64::total_cmp);
            list.get((share * list.len() as f64) as usize).copied().unwrap_or(f64::NAN)
        };
        format!(
            "{:4} of {:4} {:8.3} {:9.3} {:9.2} {:9}",
            self.solved,
            self.posed,
            at(&mut self.plan_ms, 0.5),
            at(&mut self.plan_ms, 0.95),
            at(&mut self.length, 0.5),
            self.touching,
        )
    }
}

#[derive(Deserialize)]
struct Problems {
    sets: BTreeMap<String, Vec<Problem>>,
}

#[derive(Deserialize)]
struct Problem {
    start: Vec<f64>,
    goal: Vec<f64>,
    obstacles: Vec<Thing>,
}

#[derive(Deserialize)]
struct Thing {
    name: String,
    pos: [f64; 3],
    quat_xyzw: [f64; 4],
    half_extents: Option<[f64; 3]>,
    length: Option<f64>,
    radius: Option<f64>,
}

impl Thing {
    /// Returns it as VAMP takes it.
    fn obstacle(&self, are_boxes: bool) -> Obstacle {
        let [x, y, z, w] = self.quat_xyzw;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let solid = match (self.half_extents, self.radius, self.length) {
            (Some(half), ..) => Solid::Cuboid { half: Vector3::from(half) },
            (None, Some(radius), Some(length)) if are_boxes => {
                Solid::Cuboid { half: Vector3::new(radius, radius, length / 2.0) }
            }
            (None, Some(radius), Some(length)) => Solid::Capsule { radius, half: length / 2.0 },
            _ => panic!("{} has no size", self.name),
        };
        let at = Isometry3::from_parts(Vector3::from(self.pos).into(), turn);
        Obstacle::new(&self.name, solid, at)
    }
}
