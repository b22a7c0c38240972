//! The smallest distance among many pairs, looked for only as far as somebody wants to know.
//!
//! Which pairs are offered, and in which order, is not decided here.

use super::body::Body;
use super::distance::{distance_or_overlap, is_beyond, signed_distance};

/// How far pairs are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// All of them: the nearest, or the deepest.
    All,
    /// Until two overlap; how deep is not asked.
    TillOverlap,
    /// Until two are nearer than the limit; how near is not asked.
    TillNear,
}

/// The other side of a nearest pair, by its place among the parts or the obstacles.
#[derive(Debug, Clone, Copy)]
pub(super) enum Other {
    Part(usize),
    Obstacle(usize),
}

/// The smallest distance, m, and between which part and what.
pub(super) type Found = (f64, usize, Other);

/// A search for the smallest distance.
pub(super) struct Nearest {
    pub(super) best: Option<Found>,
    /// What is farther is of no interest any more, m.
    pub(super) bound: f64,
    limit: f64,
    until: Look,
}

impl Nearest {
    /// Returns a search below `limit` m.
    pub(super) fn below(limit: f64, until: Look) -> Self {
        Self { best: None, bound: limit, limit, until }
    }

    /// Looks at two bodies whose balls are near; returns whether that is enough.
    #[inline]
    pub(super) fn look(&mut self, first: usize, a: &Body, b: &Body, other: Other) -> bool {
        let (centre, radius) = a.bounds();
        if b.distance_to_ball(&centre, radius) > self.bound {
            return false;
        }
        let known = if self.until == Look::TillNear { is_beyond(a, b, self.bound) } else { None };
        if known == Some(true) {
            return false;
        }
        let distance = match self.until {
            Look::All => signed_distance(a, b),
            // How near is not asked.
            Look::TillNear if known == Some(false) => f64::NEG_INFINITY,
            _ => distance_or_overlap(a, b).unwrap_or(f64::NEG_INFINITY),
        };
        if self.best.is_none_or(|(least, ..)| distance < least) {
            self.best = Some((distance, first, other));
            self.bound = self.bound.min(distance);
        }
        match self.until {
            Look::All => false,
            Look::TillOverlap => distance <= 0.0,
            Look::TillNear => distance <= self.limit,
        }
    }
}
