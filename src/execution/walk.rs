//! Walks a parse graph: requires, acts, promises.
//!
//! One walker serves the twin and the arm. Before a step its needs must hold, after it what it gives must
//! be true; what keeps it going or ends it early is read at its end. Every fluent of the parse graph is
//! read after every step. A condition nobody can judge does not stop a step, and is recorded as unknown;
//! what to do about a failure is for whoever called.

use std::collections::BTreeMap;

use crate::graph::{Condition, Does, ParseGraph, Step, fluent};
use crate::language::Library;
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::text;
use crate::units::{Dimension, Quantity};
use crate::world::fluent::{Evaluator, Fact, Facts, Reading};
use crate::world::{Scene, WorldState};

use super::plan::{NoWay, Why};
use super::script::{ScriptError, ScriptValue, Scripts};
use super::stage::ActionError;
use super::trace::Outcome;

/// Where an action's script is looked up.
pub trait Texts {
    /// Returns the script of that file name.
    fn script(&self, name: &str) -> Option<&str>;
}

/// What a fluent was worth after a step.
#[derive(Debug, Clone, PartialEq)]
pub struct FluentReading {
    /// As text: `holding(jar)`.
    pub text: String,
    /// What the plan says of it now, if anything.
    pub expected: Option<bool>,
    /// What it is.
    pub reading: Reading,
    /// Its question, if it has one.
    pub ask: Option<String>,
}

/// One step that was carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// Which step of the parse graph.
    pub index: usize,
    /// How it ended.
    pub outcome: Outcome,
    /// Why, when it did not succeed.
    pub reason: Option<String>,
    /// Start and end in arm time, s.
    pub interval: [f64; 2],
    /// Every fluent of the parse graph, in its order.
    pub fluents: Vec<FluentReading>,
    /// The world after it.
    pub state: WorldState,
}

/// Carries out steps on one stage.
pub struct Walker<'a> {
    scripts: &'a Scripts,
    texts: &'a dyn Texts,
    library: &'a Library,
    scene: &'a Scene,
    /// The world when the run began, for `filled`.
    start: &'a WorldState,
}

/// Facts that only a body knows.
struct BodyFacts<'a>(&'a Scripts);

impl Facts for BodyFacts<'_> {
    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        self.0.stage().body().contact(a, b)
    }

    fn reachable(&self, o: &str, _face: Option<&str>) -> Option<Fact> {
        let reach = self.0.stage().reachable(o);
        let margin = match &reach {
            Err(NoWay { why: Why::OutOfReach { nearest }, .. }) => {
                Some(Quantity { value: -nearest, dimension: Dimension::LENGTH })
            }
            _ => None,
        };
        // What nobody has seen is neither in reach nor out of it.
        let unseen = matches!(&reach, Err(NoWay { why: Why::NotSeen(_), .. }));
        Some(Fact { truth: (!unseen).then_some(reach.is_ok()), margin })
    }

    fn stroke(&self) -> f64 {
        self.0.stage().cell().robot.max_opening()
    }
}

impl<'a> Walker<'a> {
    /// Walks on this stage; `start` is the world when the run began.
    pub fn new(
        scripts: &'a Scripts,
        texts: &'a dyn Texts,
        library: &'a Library,
        scene: &'a Scene,
        start: &'a WorldState,
    ) -> Self {
        Self { scripts, texts, library, scene, start }
    }

    /// Reads one closed expression now.
    pub fn read(&self, expr: &Expr, state: &WorldState) -> Reading {
        self.evaluate(state, |evaluator| evaluator.read(expr))
    }

    /// Returns what a closed quantity is worth now; `None` when nobody knows, or it is none.
    pub fn quantity(&self, expr: &Expr, state: &WorldState) -> Option<Quantity> {
        self.evaluate(state, |evaluator| evaluator.quantity(expr)).ok().flatten()
    }

    fn evaluate<T>(&self, state: &WorldState, ask: impl FnOnce(&Evaluator<'_>) -> T) -> T {
        ask(&Evaluator {
            scene: self.scene,
            state,
            start: self.start,
            fluents: self.library,
            bindings: &BTreeMap::new(),
            facts: &BodyFacts(self.scripts),
        })
    }

    /// Carries out step `index` of `pg` and reads `watched` afterwards.
    ///
    /// # Errors
    ///
    /// Only [`ActionError::Stopped`] and device errors end the walk; everything else is an outcome.
    pub fn step(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        watched: &[Expr],
    ) -> Result<Done, ActionError> {
        let step = &pg.steps[index];
        let before = self.scripts.stage().state()?;
        let begin = before.time;
        if !step.unless.is_empty() && self.any(&step.unless, &before) {
            return self.done(step, index, begin, watched, Outcome::Success, None);
        }
        if let Some(unmet) = self.unmet(&step.needs, &before) {
            let reason = format!("it needs {unmet}");
            return self.done(step, index, begin, watched, Outcome::Failure, Some(reason));
        }
        if let Err(error) = self.act(step) {
            let reason = match error {
                ScriptError::Action { error: ActionError::Stopped, .. } => {
                    return Err(ActionError::Stopped);
                }
                ScriptError::Action { error: error @ ActionError::Device(_), .. } => {
                    return Err(error);
                }
                ScriptError::Action { error, line } => match (line, &step.script) {
                    (Some(line), Some(file)) => {
                        format!("{error} ({file}:{line}{})", self.called_from(step))
                    }
                    _ => error.to_string(),
                },
                wrong @ ScriptError::Wrong { .. } => format!("{wrong}{}", self.called_from(step)),
            };
            return self.done(step, index, begin, watched, Outcome::Failure, Some(reason));
        }
        let after = self.scripts.stage().state()?;
        let broken = self
            .unmet(&step.gives, &after)
            .map(|unmet| format!("it should have made true {unmet}"))
            .or_else(|| self.unmet(&step.keeps, &after).map(|unmet| format!("it lost {unmet}")));
        let outcome = if broken.is_some() { Outcome::Failure } else { Outcome::Success };
        self.done(step, index, begin, watched, outcome, broken)
    }

    /// Returns the line of the task that calls a step, as the end of a sentence.
    fn called_from(&self, step: &Step) -> String {
        let written = self.library.callable(&step.within);
        written.map_or_else(String::new, |(_, source)| {
            format!(", called from {}", source.place(step.span))
        })
    }

    fn act(&mut self, step: &Step) -> Result<(), ScriptError> {
        let (Some(file), Does::Action { args, .. }) = (&step.script, &step.does) else {
            return Ok(());
        };
        let Some(script) = self.texts.script(file) else {
            return Err(ScriptError::Wrong {
                file: file.clone(),
                line: 0,
                message: "there is no such script; actions look in `actions/` of the stdlib".into(),
            });
        };
        let state = self.scripts.stage().state().map_err(at_nowhere)?;
        let mut values = BTreeMap::new();
        for argument in args {
            values.insert(argument.name.clone(), self.value(&argument.value, &state));
        }
        self.scripts.run(file, script, &values)
    }

    /// Returns what a script is given for an argument: a name stays a name, anything else is worked out.
    fn value(&self, expr: &Expr, state: &WorldState) -> ScriptValue {
        match &expr.kind {
            ExprKind::Name(name) => ScriptValue::Name(name.clone()),
            ExprKind::Text(text) => ScriptValue::Name(text.clone()),
            ExprKind::Bool(truth) => ScriptValue::Truth(*truth),
            ExprKind::Literal(quantity) => ScriptValue::Number(quantity.value),
            _ => match self.evaluate(state, |evaluator| evaluator.quantity(expr)) {
                Ok(Some(quantity)) => ScriptValue::Number(quantity.value),
                _ => match self.read(expr, state).truth {
                    Some(truth) => ScriptValue::Truth(truth),
                    // Nobody knows what it is worth; the script is told what it is.
                    None => ScriptValue::Name(text::expr(expr)),
                },
            },
        }
    }

    fn any(&self, conditions: &[Condition], state: &WorldState) -> bool {
        conditions.iter().any(|c| self.read(&c.expr, state).truth == Some(true))
    }

    /// Returns what is known at the end of a step that a person or a device cut short.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn interrupted(
        &self,
        pg: &ParseGraph,
        index: usize,
        begin: f64,
        watched: &[Expr],
        why: &ActionError,
    ) -> Result<Done, ActionError> {
        let reason = Some(why.to_string());
        self.done(&pg.steps[index], index, begin, watched, Outcome::Stopped, reason)
    }

    /// Returns the first condition that is false, with its margin, in words.
    pub fn unmet(&self, conditions: &[Condition], state: &WorldState) -> Option<String> {
        conditions.iter().find_map(|condition| {
            let reading = self.read(&condition.expr, state);
            if reading.truth != Some(false) {
                return None;
            }
            // Of a long condition the part that decided is told.
            let term = if reading.term.is_empty() { &condition.text } else { &reading.term };
            Some(match reading.margin {
                Some(Quantity { value, dimension }) => {
                    let off = Quantity { value: value.abs(), dimension };
                    format!("`{term}`, which is false by {off}")
                }
                None => format!("`{term}`, which is false"),
            })
        })
    }

    fn done(
        &self,
        step: &Step,
        index: usize,
        begin: f64,
        watched: &[Expr],
        outcome: Outcome,
        reason: Option<String>,
    ) -> Result<Done, ActionError> {
        let state = self.scripts.stage().state()?;
        // A step that did not end by itself promises nothing.
        let promised = if outcome == Outcome::Stopped { &[][..] } else { &step.gives[..] };
        let fluents = watched
            .iter()
            .map(|expr| {
                let text = text::expr(expr);
                let expected = promised.iter().find_map(|given| promise(&given.expr, &text));
                let ask = self.question(expr);
                FluentReading { expected, ask, reading: self.read(expr, &state), text }
            })
            .collect();
        let interval = [begin, state.time];
        Ok(Done { index, outcome, reason, interval, fluents, state })
    }

    fn question(&self, expr: &Expr) -> Option<String> {
        let questions = fluent::questions(expr, self.library);
        questions.first().map(|question| {
            question.with(|name| {
                let object = self.scene.object(name);
                object.map_or_else(|| name.to_owned(), |object| object.looks.clone())
            })
        })
    }
}

/// Returns what a promise says of the fluent written `text`: `p and not q` says yes of `p` and no of `q`.
fn promise(given: &Expr, fluent: &str) -> Option<bool> {
    if text::expr(given) == fluent {
        return Some(true);
    }
    match &given.kind {
        ExprKind::Not(inner) => (text::expr(inner) == fluent).then_some(false),
        ExprKind::Binary(a, BinaryOp::And, b) => promise(a, fluent).or_else(|| promise(b, fluent)),
        _ => None,
    }
}

fn at_nowhere(error: ActionError) -> ScriptError {
    ScriptError::Action { error, line: None }
}
