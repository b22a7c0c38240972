//! Whether the straight joint motion between two configurations is free everywhere, not only at samples.
//!
//! Eight intervals are looked at together, each part of the robot larger by what it can move in half an interval: what is
//! clear then is clear all through it, and what is not is halved. Where spheres are too coarse to tell, the solids
//! themselves are asked.
//!
//! Source: conservative advancement; Schwarzer, Saha and Latombe, "Adaptive dynamic collision checking", T-RO 2005.

use super::batch::Question;
use super::budget::Budget;
use super::collision::CollisionWorld;
use super::error::Error;
use super::lanes::LANES;
use super::nearest::Look;
use super::polyline::{mix, mix_into};

/// What must be left over the margin everywhere, m.
pub(super) const LEFT: f64 = 1e-4;
/// A motion that hugs an obstacle for its whole length would take thousands of intervals.
const PATIENCE: usize = 3000;
/// Where no point moves farther in half an interval, m, the solids are asked instead of the spheres.
const FINE: f64 = 0.004;

impl CollisionWorld<'_> {
    /// Returns whether the straight joint motion from `from` to `to` is free, not only at samples: an
    /// interval counts once the clearance at its middle exceeds what any point can move on it.
    ///
    /// Everywhere on the way at least 0.1 mm is left over the margin: what comes nearer is refused,
    /// and so is what takes too many intervals to tell.
    pub fn certify(&self, from: &[f64], to: &[f64]) -> bool {
        // Patience alone bounds it.
        self.certify_within(from, to, &Budget::of(u64::MAX, || false)).unwrap_or(false)
    }

    /// As [`Self::certify`], on a budget.
    ///
    /// # Errors
    ///
    /// [`Error::Spent`] and [`Error::Cancelled`] when the budget ends it.
    pub fn certify_within(
        &self,
        from: &[f64],
        to: &[f64],
        budget: &Budget<'_>,
    ) -> Result<bool, Error> {
        let batch = self.batch();
        let whole = self.displacement(from, to);
        if !whole.is_finite() {
            return Ok(false);
        }
        let bends = batch.bends(from, to);
        let room = self.margin() + LEFT;
        let part = 1.0 / LANES as f64;
        // Middles of intervals that are not known to be free, and half their lengths.
        let mut open: Vec<(f64, f64)> =
            (0..LANES).rev().map(|k| (part * (k as f64 + 0.5), 0.5 * part)).collect();
        let mut looked = 0;
        while let Some(&last) = open.last() {
            looked += 1;
            budget.spend(batch.cost())?;
            let few = open.split_off(open.len().saturating_sub(LANES));
            let (mut at, mut half) = ([last.0; LANES], [last.1; LANES]);
            for (lane, interval) in few.iter().enumerate() {
                (at[lane], half[lane]) = *interval;
            }
            let flagged =
                batch.flagged(&Question { from, to, at, room, half, bends: &bends, all: true });
            if flagged != 0 && looked > PATIENCE {
                return Ok(false);
            }
            for (lane, &(middle, half)) in few.iter().enumerate() {
                if flagged & (1 << lane) == 0 {
                    continue;
                }
                if batch.is_exact() && whole * half < LEFT {
                    return Ok(false);
                }
                if batch.is_exact() || whole * half > FINE {
                    let quarter = 0.5 * half;
                    open.extend([(middle + quarter, quarter), (middle - quarter, quarter)]);
                    continue;
                }
                let ends = [middle - half, middle + half].map(|t| mix(from, to, t));
                if !self.certify_solids(&ends[0], &ends[1], budget)? {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// As [`Self::certify_within`], with the solids themselves, one configuration at a time.
    fn certify_solids(&self, from: &[f64], to: &[f64], budget: &Budget<'_>) -> Result<bool, Error> {
        let cost = self.cost();
        let whole = self.displacement(from, to);
        let mut stack = vec![(0.0, 1.0)];
        let mut looked = 0;
        let mut q = from.to_vec();
        while let Some((low, high)) = stack.pop() {
            looked += 1;
            budget.spend(cost)?;
            let middle = 0.5 * (low + high);
            let moved = whole * 0.5 * (high - low);
            // What is farther than anything moves does not matter, nor how deep it is in.
            let within = self.margin() + LEFT + moved;
            mix_into(&mut q, from, to, middle);
            let nearest = self.nearest_at(&q, within, Look::TillOverlap);
            let clear =
                nearest.map_or(f64::INFINITY, |(distance, ..)| distance) - self.margin() - LEFT;
            if clear <= 0.0 {
                return Ok(false);
            }
            if moved > clear {
                if moved < LEFT || looked > PATIENCE {
                    return Ok(false);
                }
                stack.push((middle, high));
                stack.push((low, middle));
            }
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::super::batch::tests::{of_spheres, scene};
    use super::*;
    use crate::motion::Robot;
    use crate::motion::descent::random_configuration;

    /// Nothing of a stretch that is called free touches anything, and little that is free is refused.
    #[test]
    fn what_is_certified_is_free_all_along() {
        let mut random = StdRng::seed_from_u64(6);
        for robot in [Robot::gen3(), of_spheres()] {
            let (mut certain, mut refused, mut missed) = (0, 0, 0);
            for _ in 0..20 {
                let world = scene(&robot, &mut random);
                for _ in 0..250 {
                    let from = random_configuration(&robot, &mut random);
                    let to = random_configuration(&robot, &mut random);
                    let to = mix(&from, &to, random.random_range(0.02..0.4));
                    let mut along = (0..=40).map(|k| mix(&from, &to, f64::from(k) / 40.0));
                    if world.certify(&from, &to) {
                        assert!(along.all(|q| world.free(&q)), "{from:?} {to:?}");
                        certain += 1;
                    } else {
                        missed +=
                            usize::from(along.all(|q| world.is_clear(&q, world.margin() + 0.003)));
                        refused += 1;
                    }
                }
            }
            assert!(certain > 300 && refused > 300, "{certain} {refused}");
            // Between 41 looks something may touch that they do not see.
            assert!(missed * 50 < refused, "{missed} of {refused}");
        }
    }
}
