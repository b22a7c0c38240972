//! The answer of `robot plan`: a path and its timing, as the program's JSON has them, and how they read.
//!
//! A problem in, data out: the command line reads files and prints. The clock is the caller's as well.

use std::fmt::Write as _;

use serde::Serialize;

use super::left_out::{self, LeftOut};
use super::problem::{Problem, to_goal};
use crate::motion::Error;
use crate::motion::budget::Budget;
use crate::motion::collision::CollisionWorld;
use crate::motion::fault::NoWay;
use crate::motion::free::{self, Means};
use crate::motion::ik::Solver;
use crate::motion::polyline::{l2, mix};
use crate::motion::robot::Robot;
use crate::motion::rrt::Settings;
use crate::motion::trajectory::{Limits, Trajectory};
use crate::units::significant;

/// How far apart the instants of a planned trajectory are reported, s.
const REPORT_STEP: f64 = 0.01;
/// So many instants are reported at most: a very slow robot's are farther apart.
const REPORTED: f64 = 20_000.0;
/// So many corners of a path are shown to people at most.
const SHOWN: usize = 12;
/// A path is searched for with so many samples in all unless another number is asked for. Chosen: what has none is given up within seconds.
pub const SAMPLES: usize = 150_000;
/// So many samples can be asked for. Chosen: what has been searched through fits into memory.
pub const MOST_SAMPLES: usize = 1_000_000;
/// Joints of one kind whose path is no longer than this do not move, rad or m: the last digit of an encoder.
const STILL: f64 = 1e-6;
/// Longest cut along an edge when a corner is rounded, rad.
const MAX_CUT: f64 = 0.2;

/// `robot plan`.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum PlanAnswer {
    /// A path and its timing.
    Found {
        /// Always true.
        found: bool,
        /// Corners of the path, rad, m where a joint slides; straight joint motions between them are free of collision.
        path_rad: Vec<Vec<f64>>,
        /// When the trajectory is nearest to each corner, s.
        time_s: Vec<f64>,
        /// The timed motion; corners are rounded where that is free.
        trajectory: TrajectoryAnswer,
        /// How long planning and timing took, µs.
        planning_time_us: f64,
        /// How long the search, what made its path shorter and its certificate took, µs: without timing the motion.
        time_us: f64,
        /// Length of the path, Euclidean over the joints: rad, m where a joint slides.
        length_rad: f64,
        /// Smallest distance to anything along the whole path and trajectory, m, to 0.1 mm; absent when nothing of it is
        /// checked or can be touched.
        min_clearance_m: Option<f64>,
        /// Which of the goals is reached, from 0.
        goal: usize,
        /// How many there are, for people.
        #[serde(skip)]
        n_goals: usize,
        /// Why policies did not arrive, where they were asked for and the path is a searched one instead.
        #[serde(skip_serializing_if = "Option::is_none")]
        policies_failed: Option<String>,
        /// What of the robot was not checked for collisions, and is in no distance.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        left_out: Vec<LeftOut>,
    },
    /// None was found.
    NotFound {
        /// Always false.
        found: bool,
        /// Why.
        reason: String,
        /// What would help, where more can be asked for.
        #[serde(skip_serializing_if = "Option::is_none")]
        help: Option<String>,
        /// What of the robot was not checked for collisions.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        left_out: Vec<LeftOut>,
    },
}

/// Says how to ask for more where `samples` led to no path.
fn more(error: &Error, samples: usize) -> Option<String> {
    let another = "another `--seed` searches elsewhere";
    match error {
        Error::NoPath { why: NoWay::NeverMet { .. }, .. } | Error::Spent { .. } => {
            if samples >= MOST_SAMPLES {
                return Some(another.to_owned());
            }
            let more = samples.saturating_mul(10).min(MOST_SAMPLES);
            Some(format!("`--samples {more}` searches longer, and {another}"))
        }
        Error::NoPath { .. } => Some("`--motion rrt` searches for a path instead".to_owned()),
        _ => None,
    }
}

impl PlanAnswer {
    /// Returns the answer for people: what the whole motion is like, and a dozen corners of its path at most. `sliding` says
    /// which joints slide.
    pub fn lines(&self, sliding: &[bool]) -> String {
        let (path, times, trajectory, took, least, goal, failed, left) = match self {
            Self::NotFound { found: _, reason, help, left_out: left } => {
                let help = help.as_ref().map(|help| format!("\nhelp: {help}"));
                let left = left_out::lines(left);
                return format!("{reason}{}{left}", help.unwrap_or_default());
            }
            Self::Found {
                path_rad: path,
                time_s: times,
                trajectory,
                planning_time_us: whole,
                time_us: search,
                min_clearance_m: least,
                goal,
                n_goals,
                policies_failed: failed,
                left_out: left,
                ..
            } => {
                let goal = to_goal(*goal, *n_goals);
                (path, times, trajectory, [whole, search], least, goal, failed, left)
            }
        };
        let [planning, search] = took.map(|us| significant(1e-3 * us, 3));
        let duration = trajectory.t_s.last().copied().unwrap_or(0.0);
        let mm = least.map(|least| significant(1e3 * least, 3));
        let clear = match (mm, left.is_empty()) {
            (Some(mm), true) => format!("comes to {mm} mm from anything"),
            (Some(mm), false) => format!("what is checked comes to {mm} mm from anything"),
            (None, true) => "can touch nothing".to_owned(),
            (None, false) => "nothing of it is checked for collisions".to_owned(),
        };
        let mut text = format!(
            "a path of {} corners to {goal}, {} long\n\
             the motion takes {} s and {clear}\n\
             planned in {planning} ms, of which the search took {search} ms\n",
            path.len(),
            length(path, sliding),
            significant(duration, 4),
        );
        if !left.is_empty() {
            let _ = writeln!(text, "{}", left_out::lines(left).trim_start());
        }
        if let Some(why) = failed {
            let _ = writeln!(text, "the path is a searched one, since by policies\n{why}");
        }
        let _ = writeln!(text, "\n{:>9}  joints, rad (m where one slides)", "time, s");
        let shown = path.len().min(SHOWN);
        for row in 0..shown {
            // The first, the last, and evenly between.
            let corner = row * (path.len() - 1) / (shown - 1).max(1);
            let _ = write!(text, "{:>9.3} ", times[corner]);
            for q in &path[corner] {
                let _ = write!(text, " {q:>9.4}");
            }
            text.push('\n');
        }
        let corners = if shown < path.len() { "all corners, and " } else { "" };
        let instants = trajectory.t_s.len();
        let _ = write!(text, "`--json` prints {corners}the trajectory at {instants} instants");
        text
    }
}

/// Words how long a path is: what turns in rad, what slides in m, and both where both move.
fn length(path: &[Vec<f64>], sliding: &[bool]) -> String {
    let of = |slides: bool| -> f64 {
        let edge = |ends: &[Vec<f64>]| {
            let moved = ends[0].iter().zip(&ends[1]).zip(sliding);
            let kind = moved.filter(|(_, is_sliding)| **is_sliding == slides);
            kind.map(|((a, b), _)| (b - a).powi(2)).sum::<f64>().sqrt()
        };
        path.windows(2).map(edge).sum()
    };
    let [turned, slid] = [false, true].map(of);
    let [rad, m] = [turned, slid].map(|length| significant(length, 4));
    match (turned > STILL, slid > STILL) {
        (true, true) => format!("{rad} rad and {m} m"),
        (false, true) => format!("{m} m"),
        (_, false) => format!("{rad} rad"),
    }
}

/// Joints over time.
#[derive(Debug, Clone, Serialize)]
pub struct TrajectoryAnswer {
    /// Instants, s.
    pub t_s: Vec<f64>,
    /// Positions at each, rad, m where a joint slides.
    pub q_rad: Vec<Vec<f64>>,
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
    let left_out = left_out::of_collisions(robot);
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
        ) => {
            let (reason, help) = (error.to_string(), more(&error, settings.max_samples));
            return Ok(PlanAnswer::NotFound { found: false, reason, help, left_out });
        }
        Err(error) => return Err(error),
    };
    let time_us = now_us() - begin;
    let limits = Limits::of(robot);
    // A corner that there is no time left to look at is stopped at.
    let is_free = |a: &[f64], b: &[f64]| world.certify_within(a, b, budget).unwrap_or(false);
    let timed = Trajectory::through_corners(&path.corners, &limits, MAX_CUT, &is_free)?;
    let planning_time_us = now_us() - begin;
    let (t_s, q_rad) = timed.sampled(REPORT_STEP.max(timed.duration() / REPORTED));
    let least = closest(&world, &path.corners, &timed, &t_s, &limits);
    Ok(PlanAnswer::Found {
        found: true,
        time_s: passing_times(&path.corners, &t_s, &q_rad),
        length_rad: path.length(),
        goal: path.goal,
        n_goals: goals.len(),
        policies_failed: path.policies_failed.map(|why| why.to_string()),
        path_rad: path.corners,
        trajectory: TrajectoryAnswer { t_s, q_rad },
        planning_time_us,
        time_us,
        min_clearance_m: least.is_finite().then_some(least),
        left_out,
    })
}

/// Returns the smallest distance along the path and along the timed motion, between their samples as well, m.
fn closest(
    world: &CollisionWorld<'_>,
    corners: &[Vec<f64>],
    timed: &Trajectory,
    instants: &[f64],
    limits: &Limits,
) -> f64 {
    let in_time = world.closest_approach(instants, &limits.acceleration, &|t| timed.sample(t).q);
    let places: Vec<f64> = (0..corners.len()).map(|corner| corner as f64).collect();
    let place = |s: f64| {
        let at = (s as usize).min(corners.len() - 1);
        let next = corners.get(at + 1);
        next.map_or_else(|| corners[at].clone(), |next| mix(&corners[at], next, s - at as f64))
    };
    let straight = vec![0.0; limits.acceleration.len()];
    in_time.min(world.closest_approach(&places, &straight, &place))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A plan was told by a hundred and forty rows, and all their times on one line.
    #[test]
    fn a_long_path_is_told_by_twelve_of_its_corners() {
        let found = |corners: usize, failed: Option<&str>| PlanAnswer::Found {
            found: true,
            path_rad: (0..corners).map(|k| vec![k as f64, -1.5]).collect(),
            time_s: (0..corners).map(|k| 0.5 * k as f64).collect(),
            trajectory: TrajectoryAnswer {
                t_s: (0..500).map(|k| 0.01 * f64::from(k)).collect(),
                q_rad: vec![vec![0.0, -1.5]; 500],
            },
            planning_time_us: 12_340.0,
            time_us: 8100.0,
            length_rad: 3.25,
            min_clearance_m: Some(0.003_03),
            goal: 1,
            n_goals: 2,
            policies_failed: failed.map(str::to_owned),
            left_out: Vec::new(),
        };
        let told = found(40, None).lines(&[false; 2]);
        assert!(told.contains("40 corners to goal 2 of 2,") && told.contains("3.03 mm"), "{told}");
        assert!(told.ends_with("`--json` prints all corners, and the trajectory at 500 instants"));
        let rows: Vec<&str> = told.lines().skip(5).collect();
        assert_eq!(rows.len(), SHOWN + 1, "{told}");
        assert_eq!(rows[0].split_whitespace().collect::<Vec<_>>(), ["0.000", "0.0000", "-1.5000"]);
        assert!(rows[SHOWN - 1].contains(" 39.0000"), "{told}");
        assert!(told.lines().all(|line| line.chars().count() <= 80), "{told}");
        assert_eq!(found(1, None).lines(&[false; 2]).lines().count(), 7);
        let told = found(2, Some("the motion grazes something")).lines(&[false; 2]);
        assert!(told.contains("since by policies\nthe motion grazes something\n\n"), "{told}");
    }

    /// "no path found with 24520 samples" was all, and no way to ask for more.
    #[test]
    fn no_path_says_how_to_search_longer() {
        let why = NoWay::NeverMet { start: 611, goal: 610 };
        let error = Error::NoPath { samples: 50_000, why };
        let help = more(&error, 50_000);
        let told = PlanAnswer::NotFound {
            found: false,
            reason: error.to_string(),
            help,
            left_out: Vec::new(),
        }
        .lines(&[]);
        assert!(told.starts_with("no path found with 50000 samples"), "{told}");
        assert!(told.contains("\nhelp: `--samples 500000` searches longer"), "{told}");
        assert!(told.contains("`--seed`"), "{told}");
        assert!(more(&error, SAMPLES).unwrap().starts_with("`--samples 1000000` "));
        let most = more(&error, MOST_SAMPLES).unwrap();
        assert!(!most.contains("--samples"), "{most}");
        let grazes = Error::NoPath { samples: 3, why: NoWay::Grazes };
        assert!(more(&grazes, SAMPLES).unwrap().contains("`--motion rrt`"));
        assert_eq!(more(&Error::NoGoal, SAMPLES), None);
    }

    /// 1.8 m along a rail were "1.8 rad long".
    #[test]
    fn a_path_is_as_long_as_its_joints_turn_and_slide() {
        let path = vec![vec![0.0, 0.5], vec![1.0, 0.5], vec![1.8, 0.5]];
        assert_eq!(length(&path, &[true, false]), "1.8 m");
        assert_eq!(length(&path, &[false, true]), "1.8 rad");
        let both = vec![vec![0.0, 0.5], vec![-1.5, 0.75]];
        assert_eq!(length(&both, &[false, true]), "1.5 rad and 0.25 m");
        assert_eq!(length(&path[..1], &[false; 2]), "0 rad");
    }
}
