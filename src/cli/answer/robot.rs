//! The answers of `robot fk | ik | dynamics`, as the program's JSON has them.
//!
//! Text in, data out: the command line reads files and prints. Clocks are the caller's as well: where an
//! answer holds a time, a function that tells it is an argument.

use serde::Serialize;

use super::left_out;
use crate::motion::Error;
use crate::motion::dynamics::{Bodies, Dynamics};
use crate::motion::ik::{Options, Solver};
use crate::motion::robot::Robot;
use crate::world::frame::{Base, Flange, Pose};

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
        /// `out_of_reach`, `orientation`, `limits` or `collision`.
        reason: &'static str,
        /// How near the tip comes with the wanted orientation, m, or where the arm cannot have that with another; 0 where the
        /// orientation alone is what cannot be had.
        nearest_m: f64,
    },
}

/// `robot dynamics`.
#[derive(Debug, Clone, Serialize)]
pub struct DynamicsAnswer {
    /// One per row of `q`.
    pub rows: Vec<DynamicsRow>,
    /// What is to be known of them: parts without a mass.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// Torques and inertia at one configuration.
#[derive(Debug, Clone, Serialize)]
pub struct DynamicsRow {
    /// Torques that hold the arm still, N·m.
    pub gravity_nm: Vec<f64>,
    /// Mass matrix, kg·m².
    pub mass_matrix: Vec<Vec<f64>>,
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
    Ok(DynamicsAnswer { rows, notes: left_out::of_masses(robot, bodies) })
}
