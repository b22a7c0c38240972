//! What is known now: fluents and quantities read against the world, and what only arm and twin can answer.
//!
//! While a [`Reader`] is at work it has the action context to itself; no script runs and nobody else may touch the arm.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::MutexGuard;

use crate::fluent::{Evaluator, Fact, Facts, Reading};
use crate::graph::{Condition, fluent};
use crate::language::Library;
use crate::language::ast::Expr;
use crate::trace::{NoWay, Unmet, Why};
use crate::units::{Dimension, Quantity};
use crate::world::{Region, Scene, WorldState};

use super::context::ActionContext;
use super::during::unmet;
use super::script::Scripts;

/// Facts that only a body knows.
struct BodyFacts<'s>(RefCell<MutexGuard<'s, ActionContext>>);

impl Facts for BodyFacts<'_> {
    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        self.0.borrow_mut().body().contact(a, b)
    }

    fn reachable(&self, o: &str, face: Option<&str>) -> Option<Fact> {
        let reach = self.0.borrow_mut().reachable(o, face);
        let margin = match &reach {
            Err(NoWay { why: Why::OutOfReach { nearest }, .. }) => {
                Some(Quantity { value: -nearest, dimension: Dimension::LENGTH })
            }
            _ => None,
        };
        // What nobody has seen is neither in reach nor out of it, nor what was not looked into to the end.
        let unknown = matches!(
            &reach,
            Err(NoWay { why: Why::NotSeen(_) | Why::NotWithin(_) | Why::Stopped, .. })
        );
        Some(Fact { truth: (!unknown).then_some(reach.is_ok()), margin })
    }

    fn stirred(&self, vessel: &str) -> Option<f64> {
        self.0.borrow_mut().past().worked.stirred(vessel)
    }

    fn handed(&self, thing: &str) -> Option<bool> {
        self.0.borrow_mut().past().worked.handed(thing)
    }

    fn swept(&self, thing: &str) -> Option<f64> {
        let mut context = self.0.borrow_mut();
        let scene = context.cell().scene.clone();
        context.past().worked.swept(scene.object(thing)?)
    }

    fn stroke(&self) -> f64 {
        self.0.borrow_mut().cell().robot.max_opening()
    }
}

/// Reads closed expressions of a library against the world as it is now.
pub struct Reader<'a> {
    facts: BodyFacts<'a>,
    library: &'a Library,
    scene: &'a Scene,
    /// The world when the run began, for `filled`.
    start: &'a WorldState,
}

impl<'a> Reader<'a> {
    /// Reads what stands on this action context; `start` is the world when the run began.
    pub fn new(
        scripts: &'a mut Scripts,
        library: &'a Library,
        scene: &'a Scene,
        start: &'a WorldState,
    ) -> Self {
        Self { facts: BodyFacts(RefCell::new(scripts.context())), library, scene, start }
    }

    /// Reads one closed expression now.
    pub fn read(&self, expr: &Expr, state: &WorldState) -> Reading {
        self.evaluate(state, |evaluator| evaluator.read(expr))
    }

    /// Returns what a closed quantity is worth now; `None` when nobody knows, or it is none.
    pub fn quantity(&self, expr: &Expr, state: &WorldState) -> Option<Quantity> {
        self.evaluate(state, |evaluator| evaluator.quantity(expr)).ok().flatten()
    }

    /// Returns the region that a closed expression names, such as `left_of(cup)`; `None` when it names none.
    pub fn region(&self, expr: &Expr, state: &WorldState) -> Option<Region> {
        self.evaluate(state, |evaluator| evaluator.region(expr))
    }

    /// Returns why the arm does not get at an object, from a face where one is named; `None` when it does.
    pub fn why_unreachable(&self, object: &str, face: Option<&str>) -> Option<Why> {
        self.facts.0.borrow_mut().reachable(object, face).err().map(|no| no.why)
    }

    fn evaluate<T>(&self, state: &WorldState, ask: impl FnOnce(&Evaluator<'_>) -> T) -> T {
        ask(&Evaluator {
            scene: self.scene,
            state,
            start: self.start,
            fluents: self.library,
            bindings: &BTreeMap::new(),
            facts: &self.facts,
        })
    }

    /// Returns the first condition that is false, with its margin.
    pub fn unmet(&self, conditions: &[Condition], state: &WorldState) -> Option<Unmet> {
        conditions.iter().find_map(|condition| {
            let reading = self.read(&condition.expr, state);
            if reading.truth != Some(false) {
                return None;
            }
            Some(unmet(condition, &reading))
        })
    }
}

/// Returns the question that a fluent puts to people and models, with the looks of its objects.
pub fn question(expr: &Expr, library: &Library, scene: &Scene) -> Option<String> {
    let questions = fluent::questions(expr, library);
    questions.first().map(|question| {
        question.with(|name| {
            let object = scene.object(name);
            object.map_or_else(|| name.to_owned(), |object| object.looks.clone())
        })
    })
}
