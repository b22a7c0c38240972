//! A free motion from one configuration to another, by the means that was chosen: a search, or policies.

use super::budget::Budget;
use super::collision::CollisionWorld;
use super::cone::Cone;
use super::error::Error;
use super::ik::Solver;
use super::rmpflow;
use super::rrt::{self, Path, Settings};

/// How free motions are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Means {
    /// A path is searched, made shorter and certified ([`rrt`]).
    #[default]
    Rrt,
    /// The arm is pulled to its goal and pushed away from obstacles, along a searched path where that does not lead there; where
    /// neither does, that path is taken, and says so ([`rmpflow`]).
    Rmpflow,
}

/// Finds a path from `start` to any of `goals`, inside the joint limits, free of collision and, if a cone is given, inside
/// it all the way.
///
/// # Errors
///
/// As [`rrt::plan`] and [`rmpflow::plan`].
#[expect(clippy::too_many_arguments, reason = "a problem, how to solve it, and what it may cost")]
pub fn plan(
    means: Means,
    solver: &Solver<'_>,
    world: &CollisionWorld<'_>,
    start: &[f64],
    goals: &[Vec<f64>],
    cone: Option<&Cone>,
    settings: &Settings,
    budget: &Budget<'_>,
) -> Result<Path, Error> {
    let plan = match means {
        Means::Rrt => rrt::plan,
        Means::Rmpflow => rmpflow::plan,
    };
    plan(solver, world, start, goals, cone, settings, budget)
}
