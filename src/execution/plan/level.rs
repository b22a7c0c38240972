//! Whether what is in the hand stays upright while the joints go straight from one position to another.
//!
//! An arm reaches most poses on several branches. Between some of them no way keeps a thing upright, and a search for one ends
//! only when it gives up; the straight line between such branches tips the thing over.

use std::f64::consts::FRAC_PI_4;

use super::Planner;
use super::follow::distance;

/// What a way costs for each rad that the joint that turns most has to go, 1/rad: the unit of the others.
const TRAVEL_COST: f64 = 1.0;
/// What a place costs towards which the joints' straight line tips what is held over, in rad of travel: it lies on a branch of the arm
/// to which nothing is carried level. Chosen: more than half a turn of the hand, 3.1 rad, which the branch where the arm is may ask
/// for; other values were not tried.
const TIPPED_COST: f64 = 4.0;
/// What is tilted further than this from upright is tipped over, rad. Chosen: of the lines to the first four joint positions of every
/// place that a `UR5e` looked at in four puts, hand down, each tilted by 2 deg at most or by 90 and more.
const TIPPED: f64 = FRAC_PI_4;
/// So many parts of a line are looked at. Chosen: joints went 22 deg and less in each of them there.
const PARTS: usize = 8;

impl Planner {
    /// What the way to a joint position costs, rad.
    pub(super) fn travel(&self, q: &[f64]) -> f64 {
        let tipped = f64::from(u8::from(self.is_tipped_towards(q)));
        TRAVEL_COST * distance(q, &self.q) + TIPPED_COST * tipped
    }

    /// Whether the straight line of the joints from where the arm is to `q`, rad, tips what is in the hand over, though it is
    /// upright at both ends.
    fn is_tipped_towards(&self, q: &[f64]) -> bool {
        let Some(cone) = self.cone(Some(TIPPED)) else { return false };
        let is_tipped = |part: usize| {
            let share = part as f64 / PARTS as f64;
            let between: Vec<f64> =
                self.q.iter().zip(q).map(|(from, to)| from + share * (to - from)).collect();
            !cone.holds(self.robot(), &between)
        };
        !is_tipped(0) && !is_tipped(PARTS) && (1..PARTS).any(is_tipped)
    }
}
