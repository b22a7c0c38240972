//! What a fluent is worth in a state: truth, value, limit and signed margin.
//!
//! A comparison gives a margin, positive when it holds: `a <= b` by `b − a`, `a == c within t` by
//! `t − |a − c|`. `and` is as good as its worst part, `or` as its best, `not` turns the sign: the
//! robustness of signal temporal logic. Millimetres and degrees are not compared with each other; each
//! margin is divided by the tolerance of its own term to find the worst, and shown in its own unit.
//!
//! Unknown is an answer: a position nobody saw makes what depends on it unknown, and so does a margin
//! smaller than two standard deviations. A false part still makes `and` false.
//!
//! Nothing here panics on a program's mistakes: the reading carries an [`Error`].
//!
//! Source: Donzé and Maler, "Robust satisfaction of temporal logic over real-valued signals",
//! FORMATS 2010; the score is Eq. 8 of Zeng, Zhao and Wu.

mod builtin;
mod eval;
mod reading;
mod region;
mod rim;
mod score;
mod wording;

use std::collections::BTreeMap;

use crate::language::Library;
use crate::language::ast::{Expr, FluentItem, Item, Program};
use crate::units::Quantity;
use crate::world::{Region, Scene, WorldState};

pub use reading::{Direction, Error, Reading, Term};
pub use rim::{lowest_of, rim_centre};
pub use score::{Score, score};

/// Where the bodies of a program's fluents are looked up.
pub trait Fluents {
    /// Returns the fluent of that name.
    fn fluent(&self, name: &str) -> Option<&FluentItem>;
}

impl Fluents for Program {
    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        self.items.iter().rev().find_map(|item| match item {
            Item::Fluent(fluent) if fluent.name.text == name => Some(fluent),
            _ => None,
        })
    }
}

impl Fluents for Library {
    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        Some(self.fluent(name)?.0)
    }
}

/// An answer from outside the state, with a margin where there is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fact {
    /// Whether it is so; `None` when nobody knows.
    pub truth: Option<bool>,
    /// By how much, positive when it is so.
    pub margin: Option<Quantity>,
}

/// What a state does not tell: contacts that physics knows, reach that planning knows, what a camera sees.
///
/// Every answer may be left out; then the state's own notion counts, or the fluent is unknown.
pub trait Facts {
    /// Whether two things touch; `gripper` and `table` are things.
    fn contact(&self, _a: &str, _b: &str) -> Option<bool> {
        None
    }
    /// Whether the arm can get at an object, from a side if one is named.
    fn reachable(&self, _object: &str, _face: Option<&str>) -> Option<Fact> {
        None
    }
    /// Whether the camera sees an object.
    fn visible(&self, _object: &str) -> Option<bool> {
        None
    }
    /// The speed of an object, m/s.
    fn speed(&self, _object: &str) -> Option<f64> {
        None
    }
    /// How far something held went round in the water of a vessel since the run began, rad.
    fn stirred(&self, _vessel: &str) -> Option<f64> {
        None
    }
    /// Whether somebody was pulling at a thing when the fingers let it go, the last time they did.
    fn handed(&self, _thing: &str) -> Option<bool> {
        None
    }
    /// The share of a thing's top over which a tool was led, touching it, since the run began.
    fn swept(&self, _thing: &str) -> Option<f64> {
        None
    }
    /// The widest opening of the gripper, m.
    fn stroke(&self) -> f64 {
        0.085
    }
}

/// Nothing is known beyond the state.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoFacts;

impl Facts for NoFacts {}

/// Evaluates expressions in one state.
#[derive(Clone, Copy)]
pub struct Evaluator<'a> {
    /// What is known beforehand.
    pub scene: &'a Scene,
    /// What is so now.
    pub state: &'a WorldState,
    /// What was so when the run began: `filled(o)`.
    pub start: &'a WorldState,
    /// The program's fluents.
    pub fluents: &'a dyn Fluents,
    /// Values of `let` names.
    pub bindings: &'a BTreeMap<String, Quantity>,
    /// What the state does not tell.
    pub facts: &'a dyn Facts,
}

impl Evaluator<'_> {
    /// Returns what a condition is worth. Mistakes in it are in [`Reading::error`], with truth unknown.
    pub fn read(&self, condition: &Expr) -> Reading {
        eval::truth(self, condition, 0).unwrap_or_else(|error| Reading::wrong(condition, error))
    }

    /// Returns the region that an expression names: `table`, `left_of(cup)`; `None` when it names none.
    pub fn region(&self, expr: &Expr) -> Option<Region> {
        let value = eval::value(self, expr, 0).ok()?;
        region::of(self, &(expr, value)).ok()
    }

    /// Returns what a quantity is worth, `None` when nobody knows.
    ///
    /// # Errors
    ///
    /// [`Error`] for names and units that do not fit, and for an expression that is no quantity.
    pub fn quantity(&self, expr: &Expr) -> Result<Option<Quantity>, Error> {
        let measure = eval::measure(self, expr, 0)?;
        Ok(measure.value.map(|value| Quantity { value, dimension: measure.dimension }))
    }
}
