//! A joint path as scripts hand it on: what the planner found, and what following it does to things.

use crate::trace::Deed;

/// A joint path in a script's hands.
#[derive(Clone)]
pub(super) struct Path {
    /// Joint positions, rad.
    pub(super) points: Vec<Vec<f64>>,
    /// What following it does to things.
    pub(super) deed: Option<Deed>,
}

impl Path {
    /// A path that does nothing to things.
    pub(super) fn plain(points: Vec<Vec<f64>>) -> Self {
        Self { points, deed: None }
    }

    /// A path that does something to things.
    pub(super) fn doing(points: Vec<Vec<f64>>, deed: Deed) -> Self {
        Self { points, deed: Some(deed) }
    }
}
