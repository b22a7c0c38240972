//! The answers of `robot fk | ik | dynamics | plan`, as the program's JSON has them.
//!
//! Text in, data out: the command line reads files and prints. Clocks are the caller's as well: where an
//! answer holds a time, a function that tells it is an argument.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::motion::Error;
use crate::motion::budget::Budget;
use crate::motion::collision::{CollisionWorld, Obstacle};
use crate::motion::dynamics::{Bodies, Dynamics};
use crate::motion::free::{self, Means};
use crate::motion::ik::{Options, Solver};
use crate::motion::polyline::l2;
use crate::motion::robot::Robot;
use crate::motion::rrt::Settings;
use crate::motion::solid::Solid;
use crate::motion::trajectory::{Limits, Trajectory};
use crate::world::frame::{Base, Flange, Object, Pose};

/// How far apart the instants of a planned trajectory are reported, s.
const REPORT_STEP: f64 = 0.01;
/// So many instants are reported at most: a very slow robot's are farther apart.
const REPORTED: f64 = 20_000.0;
/// Places and sizes are taken up to this, m: no arm is moved in a space larger than that, and no number of this
/// size is lost in another's rounding.
const FARTHEST: f64 = 1e3;
/// A side is no shorter than this, m.
const SMALLEST: f64 = 1e-6;
/// So many goals and so many obstacles are taken.
const GOALS: usize = 10_000;
const OBSTACLES: usize = 10_000;
/// Longest cut along an edge when a corner is rounded, rad.
const MAX_CUT: f64 = 0.2;

/// `robot fk`.
#[derive(Debug, Clone, Serialize)]
pub struct FkAnswer {
    /// One per row of `q`.
    pub poses: Vec<TipPose>,
}

/// Where a link is.
#[derive(Debug, Clone, Serialize)]
pub struct TipPose {
    /// The link's name.
    pub tip: String,
    /// Its origin in base coordinates, m.
    pub xyz_m: [f64; 3],
    /// Its rotation.
    pub quat_wxyz: [f64; 4],
}

/// `robot ik`.
#[derive(Debug, Clone, Serialize)]
pub struct IkAnswer {
    /// One per pose.
    pub solutions: Vec<IkSolution>,
}

/// What was found for one pose.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum IkSolution {
    /// Joint positions that reach it.
    Found {
        /// Always true.
        found: bool,
        /// Joint positions, rad.
        q_rad: Vec<f64>,
        /// How far the tip is off, m.
        position_error_m: f64,
        /// By how much it is turned, rad.
        rotation_error_rad: f64,
        /// How long it took, µs.
        time_us: f64,
    },
    /// None do.
    NotFound {
        /// Always false.
        found: bool,
        /// `out_of_reach`, `limits` or `collision`.
        reason: &'static str,
        /// How near the tip comes with the wanted orientation, m.
        nearest_m: f64,
    },
}

/// `robot dynamics`.
#[derive(Debug, Clone, Serialize)]
pub struct DynamicsAnswer {
    /// One per row of `q`.
    pub rows: Vec<DynamicsRow>,
}

/// Torques and inertia at one configuration.
#[derive(Debug, Clone, Serialize)]
pub struct DynamicsRow {
    /// Torques that hold the arm still, N·m.
    pub gravity_nm: Vec<f64>,
    /// Mass matrix, kg·m².
    pub mass_matrix: Vec<Vec<f64>>,
}

/// A planning problem, as its file has it.
#[derive(Debug, Clone, Deserialize)]
pub struct Problem {
    /// Start, rad.
    pub start: Vec<f64>,
    /// Goals, rad; any will do.
    pub goals: Vec<Vec<f64>>,
    /// What stands in the way.
    #[serde(default)]
    pub obstacles: Vec<ProblemObstacle>,
}

/// An obstacle of a planning problem.
#[derive(Debug, Clone, Deserialize)]
pub struct ProblemObstacle {
    /// What messages call it.
    pub name: Option<String>,
    /// `box`, `sphere` or `cylinder`.
    pub shape: String,
    /// Its centre in base coordinates; cylinders stand along its z axis.
    pub pose: Pose<Base, Object>,
    /// A box: edges along x, y, z; a sphere: radius; a cylinder: radius and height. m.
    pub size_m: Vec<f64>,
}

/// `robot plan`.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum PlanAnswer {
    /// A path and its timing.
    Found {
        /// Always true.
        found: bool,
        /// Corners of the path, rad; straight joint motions between them are free of collision.
        path_rad: Vec<Vec<f64>>,
        /// When the trajectory is nearest to each corner, s.
        time_s: Vec<f64>,
        /// The timed motion; corners are rounded where that is free.
        trajectory: TrajectoryAnswer,
        /// How long planning and timing took, µs.
        planning_time_us: f64,
        /// How long the search, what made its path shorter and its certificate took, µs: without timing the motion.
        time_us: f64,
        /// Length of the path, rad (Euclidean over the joints).
        length_rad: f64,
        /// Smallest distance to anything along the trajectory, m; absent when nothing can be touched.
        min_clearance_m: Option<f64>,
        /// Which of the goals is reached.
        goal: usize,
    },
    /// None was found.
    NotFound {
        /// Always false.
        found: bool,
        /// Why.
        reason: String,
    },
}

/// Joints over time.
#[derive(Debug, Clone, Serialize)]
pub struct TrajectoryAnswer {
    /// Instants, s.
    pub t_s: Vec<f64>,
    /// Positions at each, rad.
    pub q_rad: Vec<Vec<f64>>,
}

/// Answers `robot fk`.
///
/// # Errors
///
/// [`Error::WrongLength`] or [`Error::NotFinite`].
pub fn fk(robot: &Robot, rows: &[Vec<f64>]) -> Result<FkAnswer, Error> {
    let tip = &robot.links()[robot.tip()].name;
    let poses = rows
        .iter()
        .map(|q| {
            let pose = robot.forward(q)?;
            let (t, r) = (pose.origin(), pose.rotation());
            Ok(TipPose {
                tip: tip.clone(),
                xyz_m: [t.x, t.y, t.z],
                quat_wxyz: [r.w, r.i, r.j, r.k],
            })
        })
        .collect::<Result<_, Error>>()?;
    Ok(FkAnswer { poses })
}

/// Answers `robot ik`: for each pose the solution nearest to `near`, or to the middle of the joints'
/// ranges if that is empty. `now_us` tells the time, µs.
pub fn ik(
    robot: &Robot,
    poses: &[Pose<Base, Flange>],
    near: &[f64],
    seed: u64,
    now_us: &mut dyn FnMut() -> f64,
) -> IkAnswer {
    let solver = Solver::new(robot);
    let options = Options { seed, ..Options::near(near) };
    let solutions = poses
        .iter()
        .map(|pose| {
            let begin = now_us();
            let result = solver.solve(pose, &options, &|_| true);
            let time_us = now_us() - begin;
            match result {
                Ok(mut all) => {
                    let q_rad = all.swap_remove(0);
                    let reached = Pose::<Base, Flange>::new(robot.forward_unchecked(&q_rad));
                    IkSolution::Found {
                        found: true,
                        position_error_m: (reached.origin() - pose.origin()).norm(),
                        rotation_error_rad: reached.rotation().angle_to(&pose.rotation()),
                        q_rad,
                        time_us,
                    }
                }
                Err(why) => IkSolution::NotFound {
                    found: false,
                    reason: why.reason.word(),
                    nearest_m: why.nearest,
                },
            }
        })
        .collect();
    IkAnswer { solutions }
}

/// Answers `robot dynamics`, by default for the links up to the tip: the Gen3 without its gripper.
///
/// # Errors
///
/// [`Error::WrongLength`] or [`Error::NotFinite`].
pub fn dynamics(robot: &Robot, bodies: Bodies, rows: &[Vec<f64>]) -> Result<DynamicsAnswer, Error> {
    let dynamics = Dynamics::new(robot, bodies);
    let rows = rows
        .iter()
        .map(|q| {
            let mass = dynamics.mass_matrix(q)?;
            Ok(DynamicsRow {
                gravity_nm: dynamics.gravity_torques(q)?.as_slice().to_vec(),
                mass_matrix: mass.row_iter().map(|row| row.iter().copied().collect()).collect(),
            })
        })
        .collect::<Result<_, Error>>()?;
    Ok(DynamicsAnswer { rows })
}

/// Answers `robot plan`. `now_us` tells the time, µs.
///
/// # Errors
///
/// [`Error::Input`] for an obstacle that makes no sense; [`Error::WrongLength`], [`Error::NotFinite`] and
/// [`Error::TooFar`] for configurations that do not fit; [`Error::Cancelled`]. That no path exists, or none was
/// found within the budget, is an answer.
pub fn plan(
    robot: &Robot,
    problem: &Problem,
    means: Means,
    settings: &Settings,
    budget: &Budget<'_>,
    now_us: &mut dyn FnMut() -> f64,
) -> Result<PlanAnswer, Error> {
    let solver = Solver::new(robot);
    problem.check(robot)?;
    let world = problem.world(robot)?;
    let begin = now_us();
    let (start, goals) = (&problem.start, &problem.goals);
    let path = free::plan(means, &solver, &world, start, goals, None, settings, budget);
    let path = match path {
        Ok(path) => path,
        Err(
            error @ (Error::NoPath { .. }
            | Error::Spent { .. }
            | Error::Collision { .. }
            | Error::Limit { .. }
            | Error::Tilted { .. }),
        ) => return Ok(PlanAnswer::NotFound { found: false, reason: error.to_string() }),
        Err(error) => return Err(error),
    };
    let time_us = now_us() - begin;
    let limits = Limits::of(robot);
    // A corner that there is no time left to look at is stopped at.
    let is_free = |a: &[f64], b: &[f64]| world.certify_within(a, b, budget).unwrap_or(false);
    let timed = Trajectory::through_corners(&path.corners, &limits, MAX_CUT, &is_free)?;
    let planning_time_us = now_us() - begin;
    let (t_s, q_rad) = timed.sampled(REPORT_STEP.max(timed.duration() / REPORTED));
    let least = q_rad.iter().map(|q| world.distance(q)).fold(f64::INFINITY, f64::min);
    Ok(PlanAnswer::Found {
        found: true,
        time_s: passing_times(&path.corners, &t_s, &q_rad),
        length_rad: path.length(),
        goal: path.goal,
        path_rad: path.corners,
        trajectory: TrajectoryAnswer { t_s, q_rad },
        planning_time_us,
        time_us,
        min_clearance_m: least.is_finite().then_some(least),
    })
}

/// Returns for each corner when the samples are nearest to it, in order.
fn passing_times(corners: &[Vec<f64>], t: &[f64], q: &[Vec<f64>]) -> Vec<f64> {
    let mut from = 0;
    corners
        .iter()
        .enumerate()
        .map(|(i, corner)| {
            if i + 1 == corners.len() {
                return *t.last().expect("a trajectory has samples");
            }
            let nearest = (from..q.len())
                .min_by(|&a, &b| l2(&q[a], corner).total_cmp(&l2(&q[b], corner)))
                .unwrap_or(from);
            from = nearest;
            t[nearest]
        })
        .collect()
}

impl Problem {
    /// Reads a problem from JSON.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] with the line and column of what is wrong.
    pub fn parse(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| Error::Input {
            what: format!("the planning problem is not valid: {error}"),
        })
    }

    /// Checks that start and goals are joint positions, and not too many.
    fn check(&self, robot: &Robot) -> Result<(), Error> {
        let said = |which: &str, error: &Error| Error::Input { what: format!("{which}: {error}") };
        robot.check(&self.start).map_err(|error| said("start", &error))?;
        if self.goals.is_empty() {
            return Err(Error::Input { what: "goals: there is none".into() });
        }
        if self.goals.len() > GOALS {
            let what = format!("goals: {} are given; {GOALS} can be", self.goals.len());
            return Err(Error::Input { what });
        }
        for (index, goal) in self.goals.iter().enumerate() {
            let which = format!("goal {}", index + 1);
            robot.check(goal).map_err(|error| said(&which, &error))?;
        }
        Ok(())
    }

    /// Returns the robot among the problem's obstacles.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] for a shape that is not known or a size that does not fit it.
    pub fn world<'a>(&self, robot: &'a Robot) -> Result<CollisionWorld<'a>, Error> {
        if self.obstacles.len() > OBSTACLES {
            let what = format!("obstacles: {} are given; {OBSTACLES} can be", self.obstacles.len());
            return Err(Error::Input { what });
        }
        let mut obstacles = Vec::with_capacity(self.obstacles.len());
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            let name = obstacle
                .name
                .clone()
                .unwrap_or_else(|| format!("{} {}", obstacle.shape, index + 1));
            let fail =
                |what: String| Err(Error::Input { what: format!("obstacle {name}: {what}") });
            let sizes = SMALLEST..=FARTHEST;
            if let Some(bad) = obstacle.size_m.iter().find(|size| !sizes.contains(*size)) {
                return fail(format!("a size of {bad:?} m; {SMALLEST:?} m to {FARTHEST} m can be"));
            }
            let at = obstacle.pose.origin();
            if let Some(far) = at.iter().find(|x| !x.is_finite() || x.abs() > FARTHEST) {
                return fail(format!(
                    "it is at {far:?} m; up to {FARTHEST} m from the base can be"
                ));
            }
            let solid = match (obstacle.shape.as_str(), &obstacle.size_m[..]) {
                ("box", &[x, y, z]) => Solid::Cuboid { half: Vector3::new(x, y, z) / 2.0 },
                ("sphere", &[radius]) => Solid::Sphere { radius },
                ("cylinder", &[radius, height]) => Solid::Cylinder { radius, half: height / 2.0 },
                ("box" | "sphere" | "cylinder", sizes) => {
                    return fail(format!(
                        "{} sizes; a box has 3 (x, y, z), a sphere 1 (radius), a cylinder 2 (radius, height)",
                        sizes.len()
                    ));
                }
                (other, _) => {
                    return fail(format!("the shape {other} is not box, sphere or cylinder"));
                }
            };
            obstacles.push(Obstacle::new(&name, solid, *obstacle.pose.isometry()));
        }
        Ok(CollisionWorld::new(robot).with(&obstacles))
    }
}

/// Reads rows of numbers: comma-separated values, one row a line, with or without a header line. With a
/// header, the columns named in `columns` are taken (units in brackets may follow a name); without, or
/// when the header has none of these names, there must be just so many columns. Blank lines and `#` lines
/// are passed over.
///
/// # Errors
///
/// [`Error::Input`] with the line of what is wrong.
pub fn rows(text: &str, columns: &[&str]) -> Result<Vec<Vec<f64>>, Error> {
    let fail = |what: String| Err(Error::Input { what });
    let mut picks: Option<Vec<usize>> = None;
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let header = rows.is_empty()
            && picks.is_none()
            && cells.iter().all(|cell| cell.parse::<f64>().is_err());
        if header {
            let names: Vec<&str> =
                cells.iter().map(|cell| cell.split('[').next().unwrap_or(cell).trim()).collect();
            let found: Vec<usize> = columns
                .iter()
                .filter_map(|wanted| names.iter().position(|name| same_name(name, wanted)))
                .collect();
            picks = Some(match found.len() {
                n if n == columns.len() => found,
                0 if names.len() == columns.len() => (0..columns.len()).collect(),
                _ => {
                    return fail(format!(
                        "line {}: the header needs the columns {}",
                        index + 1,
                        columns.join(", ")
                    ));
                }
            });
            continue;
        }
        let picked: Vec<usize> = picks.clone().unwrap_or_else(|| (0..cells.len()).collect());
        if picks.is_none() && cells.len() != columns.len() {
            return fail(format!(
                "line {}: {} numbers where {} are needed ({})",
                index + 1,
                cells.len(),
                columns.len(),
                columns.join(", ")
            ));
        }
        let mut row = Vec::with_capacity(picked.len());
        for &column in &picked {
            let Some(cell) = cells.get(column) else {
                return fail(format!("line {}: it has only {} columns", index + 1, cells.len()));
            };
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => row.push(value),
                _ => return fail(format!("line {}: {cell:?} is not a finite number", index + 1)),
            }
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return fail("there are no numbers in it".into());
    }
    Ok(rows)
}

/// Reads rows of joint positions for a robot: columns `q1` … `qn` (or `q_1[rad]`), rad.
///
/// # Errors
///
/// As [`rows`].
pub fn joint_rows(robot: &Robot, text: &str) -> Result<Vec<Vec<f64>>, Error> {
    let names: Vec<String> = (1..=robot.n_joints()).map(|i| format!("q{i}")).collect();
    rows(text, &names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Reads rows of poses: columns `x`, `y`, `z` (m), `qw`, `qx`, `qy`, `qz`.
///
/// # Errors
///
/// As [`rows`], and for a quaternion that is no rotation.
pub fn pose_rows(text: &str) -> Result<Vec<Pose<Base, Flange>>, Error> {
    rows(text, &["x", "y", "z", "qw", "qx", "qy", "qz"])?
        .iter()
        .enumerate()
        .map(|(index, row)| {
            if let Some(far) = row[..3].iter().find(|x| x.abs() > FARTHEST) {
                let what = format!(
                    "pose {}: it is at {far:?} m; up to {FARTHEST} m from the base can be",
                    index + 1
                );
                return Err(Error::Input { what });
            }
            let q = Quaternion::new(row[3], row[4], row[5], row[6]);
            if (q.norm() - 1.0).abs() > 1e-2 {
                let what = format!(
                    "pose {}: the quaternion qw, qx, qy, qz has length {:.4}, not 1",
                    index + 1,
                    q.norm()
                );
                return Err(Error::Input { what });
            }
            Ok(Pose::new(Isometry3::from_parts(
                Translation3::new(row[0], row[1], row[2]),
                UnitQuaternion::from_quaternion(q),
            )))
        })
        .collect()
}

/// Whether a column's name is the wanted one, up to case, `_`, and a leading `p` for positions.
fn same_name(name: &str, wanted: &str) -> bool {
    let plain = |s: &str| s.to_lowercase().replace('_', "");
    let (name, wanted) = (plain(name), plain(wanted));
    name == wanted || name == format!("p{wanted}")
}
