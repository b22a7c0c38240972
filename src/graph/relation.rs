//! The relations that run across the tree: when (temporal), what changes what (causal), and where (spatial).
//!
//! A temporal relation is declared in the text and *checked* from measured intervals; nothing here
//! assumes that it held.
//!
//! Source: Allen, "Maintaining knowledge about temporal intervals", CACM 26, 1983.

use serde::{Deserialize, Serialize};

use super::NodeId;
use crate::language::ast::Allen;

/// When something began and ended, s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Began, s.
    pub from: f64,
    /// Ended, s.
    pub to: f64,
}

impl Interval {
    /// Returns the interval that just covers both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { from: self.from.min(other.from), to: self.to.max(other.to) }
    }
}

/// What a fluent is to a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Must hold before.
    Needs,
    /// Must hold throughout.
    Keeps,
    /// Holds afterwards.
    Gives,
    /// Is asked.
    Checks,
    /// Ends the step when true.
    Until,
    /// Decides whether a branch is possible.
    Guard,
}

impl Role {
    /// Returns the word of the language.
    pub fn word(self) -> &'static str {
        match self {
            Self::Needs => "needs",
            Self::Keeps => "keeps",
            Self::Gives => "gives",
            Self::Checks => "checks",
            Self::Until => "until",
            Self::Guard => "when",
        }
    }
}

/// One relation.
#[derive(Debug, Clone, PartialEq)]
pub enum Relation {
    /// `a` stands in Allen's relation to `b`.
    Temporal {
        /// First.
        a: NodeId,
        /// Which.
        allen: Allen,
        /// Second.
        b: NodeId,
        /// By how much, s.
        by: Option<f64>,
    },
    /// A node needs, keeps or gives a fluent.
    Causal {
        /// The node.
        node: NodeId,
        /// What the fluent is to it.
        role: Role,
        /// Index into [`super::Graph::fluents`].
        fluent: usize,
        /// Whether it is the fluent's negation.
        negated: bool,
    },
    /// A fluent relates objects in space.
    Spatial {
        /// Index into [`super::Graph::fluents`].
        fluent: usize,
        /// The objects, in the order of the arguments.
        objects: Vec<String>,
    },
}

/// Returns how far two measured intervals are from standing in a relation, s; 0 when they do.
///
/// Without `by`, "before", "overlaps" and "during" ask for order alone. With it, the gap or the overlap has to
/// be `by`, and what is done during something has to begin `by` after it. Equalities ("meets", "starts") count their whole difference: a caller allows for its own clock.
pub fn time_error(a: Interval, allen: Allen, b: Interval, by: Option<f64>) -> f64 {
    let after = |later: f64, earlier: f64| (earlier - later).max(0.0);
    match (allen, by) {
        (Allen::Before, None) => after(b.from, a.to),
        (Allen::Before, Some(by)) => (b.from - a.to - by).abs(),
        (Allen::Meets, _) => (b.from - a.to).abs(),
        (Allen::Overlaps, by) => {
            let order = after(b.from, a.from) + after(b.to, a.to);
            let overlap = a.to - b.from;
            order + by.map_or_else(|| (-overlap).max(0.0), |by| (overlap - by).abs())
        }
        (Allen::Starts, _) => (a.from - b.from).abs() + after(b.to, a.to),
        (Allen::During, None) => after(a.from, b.from) + after(b.to, a.to),
        (Allen::During, Some(by)) => (a.from - b.from - by).abs() + after(b.to, a.to),
        (Allen::Finishes, _) => (a.to - b.to).abs() + after(a.from, b.from),
        (Allen::Equals, _) => (a.from - b.from).abs() + (a.to - b.to).abs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn over(from: f64, to: f64) -> Interval {
        Interval { from, to }
    }

    /// Pairs of intervals for which each relation holds exactly, and how far off a shifted one is.
    #[test]
    fn each_relation_is_zero_where_it_holds_and_grows_with_the_error() {
        let b = over(2.0, 4.0);
        for (allen, a, by) in [
            (Allen::Before, over(0.0, 1.5), None),
            (Allen::Before, over(0.0, 1.5), Some(0.5)),
            (Allen::Meets, over(0.0, 2.0), None),
            (Allen::Overlaps, over(1.0, 2.5), None),
            (Allen::Overlaps, over(1.0, 2.5), Some(0.5)),
            (Allen::Starts, over(2.0, 3.0), None),
            (Allen::During, over(2.5, 3.5), None),
            (Allen::During, over(2.5, 3.5), Some(0.5)),
            (Allen::Finishes, over(3.0, 4.0), None),
            (Allen::Equals, over(2.0, 4.0), None),
        ] {
            assert!(time_error(a, allen, b, by).abs() < 1e-12, "{allen:?}");
            let far = over(a.from + 10.0, a.to + 10.0);
            let farther = over(a.from + 11.0, a.to + 11.0);
            let (near, away) = (time_error(far, allen, b, by), time_error(farther, allen, b, by));
            assert!(near > 0.0 && away > near, "{allen:?}: {near} then {away}");
        }
    }

    #[test]
    fn an_overlap_of_the_wrong_length_is_off_by_the_difference() {
        let e = time_error(over(0.0, 2.2), Allen::Overlaps, over(2.0, 4.0), Some(0.3));
        assert!((e - 0.1).abs() < 1e-12);
    }
}
