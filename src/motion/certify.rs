//! Whether the straight joint motion between two configurations is free everywhere, not only at samples.

use super::budget::Budget;
use super::collision::CollisionWorld;
use super::error::Error;
use super::nearest::Look;
use super::polyline::mix_into;

impl CollisionWorld<'_> {
    /// Returns whether the straight joint motion from `from` to `to` is free, not only at samples: an
    /// interval counts once the clearance at its middle exceeds what any point can move on it.
    ///
    /// Everywhere on the way at least 0.1 mm is left over the margin: what comes nearer is refused,
    /// and so is what takes too many intervals to tell.
    ///
    /// Source: conservative advancement; Schwarzer, Saha and Latombe, "Adaptive dynamic collision
    /// checking", T-RO 2005.
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
        const LEFT: f64 = 1e-4;
        // A motion that hugs an obstacle for its whole length would take thousands of intervals.
        const PATIENCE: usize = 3000;
        let cost = self.cost();
        let whole = self.displacement(from, to);
        let mut stack = vec![(0.0, 1.0)];
        budget.spend(2 * cost)?;
        if !self.free(from) || !self.free(to) {
            return Ok(false);
        }
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
