//! Which straight joint motions are free, as a search asks it: at eight configurations at a time, spread over the whole way.
//!
//! A motion is raked: the first look takes eight configurations from its whole length, the next eight lie a little before
//! them, and so on, so that a collision anywhere is met early. What a look at spheres flags is asked of the solids
//! themselves where the spheres are larger. Between two looks nothing is known: see [`CollisionWorld::certify`].
//!
//! Source: Thomason, Kingston and Kavraki, "Motions in microseconds via vectorized sampling-based planning", ICRA 2024.

use super::batch::Question;
use super::budget::Budget;
use super::collision::CollisionWorld;
use super::cone::Cone;
use super::error::Error;
use super::lanes::LANES;
use super::polyline::mix_into;
use super::robot::Robot;

/// A straight motion that takes more looks than this is not tried: it is no motion of an arm. Chosen: the farthest motion
/// of the Gen3 takes some 1500.
const LONGEST: f64 = 200_000.0;

/// Looks at motions for one search.
pub(super) struct Motions<'s> {
    pub(super) robot: &'s Robot,
    pub(super) world: &'s CollisionWorld<'s>,
    pub(super) cone: Option<&'s Cone>,
    /// Distance asked for beyond the world's margin, m.
    pub(super) pad: f64,
    /// Farthest any point of the robot may move between two looks, m.
    pub(super) resolution: f64,
    /// Whether a motion must be free between the looks as well.
    pub(super) is_certain: bool,
    pub(super) budget: &'s Budget<'s>,
    /// Configurations looked at so far.
    pub(super) checks: usize,
    /// Memory for a configuration on the way.
    between: Vec<f64>,
}

/// Returns the least whole number that is no smaller; of numbers from 0 on. Rounding is a call where processors may be old.
fn whole_above(x: f64) -> usize {
    let below = x as usize;
    below + usize::from((below as f64) < x)
}

impl<'s> Motions<'s> {
    pub(super) fn new(
        robot: &'s Robot,
        world: &'s CollisionWorld<'s>,
        cone: Option<&'s Cone>,
        (pad, resolution): (f64, f64),
        budget: &'s Budget<'s>,
    ) -> Self {
        let between = vec![0.0; robot.n_joints()];
        Self { robot, world, cone, pad, resolution, is_certain: false, budget, checks: 0, between }
    }

    /// Returns whether the straight motion is free wherever it is looked at, its end among these; its start is not.
    ///
    /// # Errors
    ///
    /// [`Error::Spent`] and [`Error::Cancelled`] when the budget ends it.
    pub(super) fn are_free(&mut self, from: &[f64], to: &[f64]) -> Result<bool, Error> {
        let moved = self.world.displacement(from, to);
        let looks = moved / self.resolution;
        if looks.is_nan() || looks > LONGEST {
            return Ok(false);
        }
        // Rounded up twice; the least whole number of rounds is one.
        let rounds = (whole_above(looks).div_ceil(LANES)).max(1);
        for round in 0..rounds {
            let back = round as f64 / rounds as f64;
            let at = std::array::from_fn(|lane| (lane as f64 + 1.0 - back) / LANES as f64);
            if !self.eight_free(from, to, at)? {
                return Ok(false);
            }
        }
        Ok(!self.is_certain || self.world.certify_within(from, to, self.budget)?)
    }

    fn eight_free(&mut self, from: &[f64], to: &[f64], at: [f64; LANES]) -> Result<bool, Error> {
        let batch = self.world.batch();
        self.budget.spend(batch.cost())?;
        self.checks += LANES;
        let room = self.world.margin() + self.pad;
        let all = !batch.is_exact();
        let mut flagged =
            batch.flagged(&Question { from, to, at, room, half: [0.0; LANES], bends: &[], all });
        if flagged != 0 && batch.is_exact() {
            return Ok(false);
        }
        while flagged != 0 {
            let lane = flagged.trailing_zeros() as usize;
            flagged &= flagged - 1;
            self.budget.spend(self.world.cost())?;
            mix_into(&mut self.between, from, to, at[lane]);
            if !self.world.is_clear(&self.between, room) {
                return Ok(false);
            }
        }
        let Some(cone) = self.cone else { return Ok(true) };
        for t in at {
            mix_into(&mut self.between, from, to, t);
            if !cone.holds(self.robot, &self.between) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}
