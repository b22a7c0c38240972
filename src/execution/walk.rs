//! Walks a parse graph: requires, acts, promises.
//!
//! One walker serves the twin and the arm. Before a step its needs must hold, after it what it gives must
//! be true; what must hold throughout or ends it early is read while it runs ([`super::during`]) and once
//! more at its end. Every fluent of the parse graph is read after every step. A condition nobody can judge
//! does not stop a step, and is recorded as unknown; what to do about a failure is for whoever called.

use std::collections::BTreeMap;

use crate::graph::{Condition, Does, Interval, ParseGraph, Step, fluent, is_at_or_below};
use crate::language::Library;
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::text;
use crate::units::{Dimension, Quantity};
use crate::world::fluent::{Evaluator, Fact, Facts, Reading};
use crate::world::{Scene, WorldState};

use super::during::{Cut, During, Held, false_by};
use super::lines::Line;
use super::plan::{NoWay, Why};
use super::script::{ScriptError, ScriptValue, Scripts};
use super::stage::ActionError;
use super::tape::Ended;
use super::together;
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
    /// Whether it failed because it does not fit what was rehearsed, so that planning it again may help.
    pub plan_again: bool,
    /// Start and end in arm time, s.
    pub interval: [f64; 2],
    /// Every fluent of the parse graph, in its order.
    pub fluents: Vec<FluentReading>,
    /// How the conditions fared that were in force while it ran.
    pub held: Vec<Held>,
    /// The lines of its script that acted.
    pub lines: Vec<Line>,
    /// The world after it.
    pub state: WorldState,
}

/// Carries out steps on one stage.
pub struct Walker<'a> {
    pub(super) scripts: &'a Scripts,
    pub(super) texts: &'a dyn Texts,
    library: &'a Library,
    scene: &'a Scene,
    /// The world when the run began, for `filled`.
    start: &'a WorldState,
}

/// How a step came to its end.
#[derive(Default)]
pub(super) struct End {
    /// A person or a device stopped it.
    pub(super) stopped: bool,
    /// What is wrong.
    pub(super) broken: Option<String>,
    /// Whether that is no more than that it does not fit what was rehearsed.
    pub(super) plan_again: bool,
    /// When it was done, if not from its beginning until now.
    pub(super) interval: Option<[f64; 2]>,
    /// The path of what an `until` ended: the step itself or something around it.
    pub(super) over: Option<String>,
    pub(super) held: Vec<Held>,
    pub(super) lines: Vec<Line>,
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
        // What nobody has seen is neither in reach nor out of it, nor what was not looked into to the end.
        let unknown = matches!(
            &reach,
            Err(NoWay { why: Why::NotSeen(_) | Why::NotWithin(_) | Why::Stopped, .. })
        );
        Some(Fact { truth: (!unknown).then_some(reach.is_ok()), margin })
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
        let ahead = self.scripts.stage().past().ahead.remove(&index);
        let done = match (ahead, together::group(pg, index)) {
            (Some(done), _) => Ok(done),
            (None, Some(group)) => self.group(pg, &group, watched),
            (None, None) => self.alone(pg, index, watched, &[]),
        };
        if done.as_ref().map_or(true, |done| done.outcome != Outcome::Success) {
            self.scripts.stage().past().ahead.clear();
        }
        done
    }

    /// Carries out one step with nothing beside it but conditions that must hold throughout.
    pub(super) fn alone(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        watched: &[Expr],
        beside: &[Condition],
    ) -> Result<Done, ActionError> {
        let mut step = pg.steps[index].clone();
        step.keeps.extend_from_slice(beside);
        let step = &step;
        let before = self.scripts.stage().state()?;
        let begin = before.time;
        let mut end = End::default();
        let pace = self.scripts.stage().cell().limits.pace;
        let deadlines = self.scripts.stage().past().deadlines(pg, index, begin, pace);
        let rehearsed = match self.scripts.stage().begin_step(&step.path) {
            Ok(rehearsed) => rehearsed,
            Err(off) => {
                end.broken = Some(off.to_string());
                end.plan_again = true;
                return self.done(pg, index, begin, watched, end);
            }
        };
        match self.needless(step, &before, rehearsed) {
            Ok(None) => {}
            Ok(Some(owner)) => {
                self.scripts.stage().ended_on_arrival();
                end.over = Some(owner);
                end.broken = self.promised(&given(step, end.over.as_deref()), &before);
                return self.done(pg, index, begin, watched, end);
            }
            Err(reason) => {
                end.broken = Some(reason);
                end.plan_again = true;
                return self.done(pg, index, begin, watched, end);
            }
        }
        if let Some(unmet) = self.unmet(&step.needs, &before) {
            end.broken = Some(format!("it needs {unmet}"));
            return self.done(pg, index, begin, watched, end);
        }
        let scene = self.scripts.stage().cell().scene.clone();
        let stroke = self.scripts.stage().cell().robot.max_opening();
        let during = During::new(step, self.library, scene, self.start.clone(), begin, stroke)
            .within(deadlines)
            .as_rehearsed(rehearsed);
        self.scripts.stage().watch_over(during);
        let acted = self.act(step);
        // A step that is cut short leaves them for `interrupted`.
        if acted.as_ref().map_or_else(|error| !error.ends_the_walk(), |()| true) {
            end.lines = self.scripts.stage().script_lines();
        }
        let during = self.scripts.stage().watched_over();
        if let Err(error) = acted {
            end.plan_again = error.can_be_planned_again();
            match self.gave_up(step, error) {
                Ok(reason) => end.broken = reason,
                Err(error) => return Err(error),
            }
        }
        let after = self.scripts.stage().state()?;
        if let Some(mut during) = during {
            if let Some(Cut::Ended { until }) = during.cut() {
                end.over = step.untils.get(*until).map(|until| until.owner.clone());
            }
            for condition in &step.keeps {
                during.at_end(condition, &self.read(&condition.expr, &after), after.time);
            }
            end.broken = end.broken.or_else(|| during.overdue(after.time));
            end.held = during.held();
        }
        end.broken = end.broken.or_else(|| {
            self.promised(&given(step, end.over.as_deref()), &after)
                .or_else(|| self.unmet(&step.keeps, &after).map(|lost| format!("it lost {lost}")))
                .or_else(|| self.still_false(pg, index, end.over.as_deref(), &after))
        });
        self.done(pg, index, begin, watched, end)
    }

    /// Returns whose end is reached before anything is done, if a step's is; `Err` says why arm and
    /// rehearsal differ in that.
    fn needless(
        &self,
        step: &Step,
        state: &WorldState,
        rehearsed: Option<Ended>,
    ) -> Result<Option<String>, String> {
        let all = || step.unless.iter().chain(&step.untils);
        let mut readings = all().map(|c| (c, self.read(&c.expr, state))).collect::<Vec<_>>();
        readings.sort_by_key(|(_, reading)| match reading.truth {
            Some(true) => 0,
            None => 1,
            Some(false) => 2,
        });
        let Some((condition, reading)) = readings.first() else { return Ok(None) };
        match (reading.truth, rehearsed == Some(Ended::OnArrival)) {
            (Some(true), _) | (None, true) => Ok(Some(condition.owner.clone())),
            (_, false) => Ok(None),
            (Some(false), true) => {
                let false_by = false_by(condition, reading);
                Err(format!(
                    "in the rehearsal there was nothing to do here; now there is: {false_by}"
                ))
            }
        }
    }

    /// Says what a step should have made true and did not.
    pub(super) fn promised(&self, gives: &[Condition], state: &WorldState) -> Option<String> {
        self.unmet(gives, state).map(|unmet| format!("it should have made true {unmet}"))
    }

    /// Says what was to end a step, or the block or task that ends with it, and is known to be false still.
    fn still_false(
        &self,
        pg: &ParseGraph,
        index: usize,
        over: Option<&str>,
        state: &WorldState,
    ) -> Option<String> {
        if over.is_some() {
            return None;
        }
        let is_last = |c: &&Condition| pg.steps_of(&c.owner).last() == Some(index);
        let ends: Vec<_> = pg.steps[index].untils.iter().filter(is_last).cloned().collect();
        // Any one of them is enough.
        let readings: Vec<_> = ends.iter().map(|c| self.read(&c.expr, state)).collect();
        if readings.iter().any(|reading| reading.truth != Some(false)) {
            return None;
        }
        let (condition, reading) = ends.iter().zip(&readings).next()?;
        Some(format!("it came to its end before {}", false_by(condition, reading)))
    }

    /// Words why an action gave up; `None` when it was over, which is no failure.
    ///
    /// # Errors
    ///
    /// A wish to stop, and what a device said.
    pub(super) fn gave_up(
        &self,
        step: &Step,
        error: ScriptError,
    ) -> Result<Option<String>, ActionError> {
        match error {
            ScriptError::Action { error, .. } if error.ends_the_walk() => Err(error),
            ScriptError::Action { error: ActionError::Ended, .. } => Ok(None),
            ScriptError::Action { error: ActionError::Broken(words), .. } => Ok(Some(words)),
            ScriptError::Action { error, line } => Ok(Some(match (line, &step.script) {
                (Some(line), Some(file)) => {
                    format!("{error} ({file}:{line}{})", self.called_from(step))
                }
                _ => error.to_string(),
            })),
            wrong @ ScriptError::Wrong { .. } => {
                Ok(Some(format!("{wrong}{}", self.called_from(step))))
            }
        }
    }

    /// Returns the line of the task that calls a step, as the end of a sentence.
    fn called_from(&self, step: &Step) -> String {
        let written = self.library.callable(&step.within);
        written.map_or_else(String::new, |(_, source)| {
            format!(", called from {}", source.place(step.span))
        })
    }

    pub(super) fn act(&mut self, step: &Step) -> Result<(), ScriptError> {
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
        let lines = self.scripts.stage().script_lines();
        let end = End { stopped: true, broken: Some(why.to_string()), lines, ..End::default() };
        self.done(pg, index, begin, watched, end)
    }

    /// Returns the first condition that is false, with its margin, in words.
    pub fn unmet(&self, conditions: &[Condition], state: &WorldState) -> Option<String> {
        conditions.iter().find_map(|condition| {
            let reading = self.read(&condition.expr, state);
            if reading.truth != Some(false) {
                return None;
            }
            Some(false_by(condition, &reading))
        })
    }

    pub(super) fn done(
        &self,
        pg: &ParseGraph,
        index: usize,
        begin: f64,
        watched: &[Expr],
        end: End,
    ) -> Result<Done, ActionError> {
        let step = &pg.steps[index];
        let state = self.scripts.stage().state()?;
        let End { stopped, broken: mut reason, plan_again, over, held, lines, interval } = end;
        let interval = interval.unwrap_or([begin, state.time]);
        if reason.is_none() {
            let mut stage = self.scripts.stage();
            let [from, to] = interval;
            stage.past().done(&step.path, Interval { from, to });
            reason = stage.past().broken(pg, index);
        }
        let outcome = match (stopped, &reason) {
            (true, _) => Outcome::Stopped,
            (false, Some(_)) => Outcome::Failure,
            (false, None) => Outcome::Success,
        };
        // A step that did not end by itself promises nothing.
        let promised = if stopped { Vec::new() } else { given(step, over.as_deref()) };
        let fluents = watched
            .iter()
            .map(|expr| {
                let text = text::expr(expr);
                let expected = promised.iter().find_map(|given| promise(&given.expr, &text));
                let ask = self.question(expr);
                FluentReading { expected, ask, reading: self.read(expr, &state), text }
            })
            .collect();
        let plan_again = plan_again && outcome == Outcome::Failure;
        Ok(Done { index, outcome, reason, plan_again, interval, fluents, held, lines, state })
    }

    /// Returns the question that a fluent puts to people and models, with the looks of its objects.
    pub fn question(&self, expr: &Expr) -> Option<String> {
        let questions = fluent::questions(expr, self.library);
        questions.first().map(|question| {
            question.with(|name| {
                let object = self.scene.object(name);
                object.map_or_else(|| name.to_owned(), |object| object.looks.clone())
            })
        })
    }
}

/// Returns what a step has to make true: what an `until` ended promises nothing more, what lies around it
/// does.
fn given(step: &Step, over: Option<&str>) -> Vec<Condition> {
    let stands = |given: &&Condition| {
        over.is_none_or(|over| given.owner != over && is_at_or_below(over, &given.owner))
    };
    step.gives.iter().filter(stands).cloned().collect()
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
