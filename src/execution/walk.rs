//! Walks a parse graph: requires, acts, promises.
//!
//! One walker serves the twin and the arm. Before a step its needs must hold, after it what it gives must
//! be true; what must hold throughout or ends it early is read while it runs ([`super::during`]) and once
//! more at its end. Every fluent of the parse graph is read after every step. A condition nobody can judge
//! does not stop a step, and is recorded as unknown; what to do about a failure is for whoever called.

use std::collections::BTreeMap;

use crate::graph::{Condition, Does, Interval, ParseGraph, Step, is_at_or_below};
use crate::language::Library;
use crate::language::ast::{BinaryOp, Expr, ExprKind};
use crate::language::text;
use crate::trace::{Cause, Line, Outcome, Place, StepFailure, Unmet};
use crate::world::{Scene, WorldState};

use super::context::Brushed;
use super::decisions::Ended;
use super::done::{Done, FluentReading};
use super::during::{Cut, During, Held, unmet};
use super::error::ActionError;
use super::reader::{Reader, question};
use super::refusal::Mistake;
use super::script::{ScriptError, ScriptValue, Scripts};
use super::together;

/// Where an action's script is looked up.
pub trait Texts {
    /// Returns the script of that file name.
    fn script(&self, name: &str) -> Option<&str>;
}

/// Carries out steps on one action context.
pub struct Walker<'a> {
    pub(super) scripts: &'a mut Scripts,
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
    pub(super) broken: Option<StepFailure>,
    /// Whether that is no more than that it does not fit what was rehearsed.
    pub(super) plan_again: bool,
    /// When it was done, if not from its beginning until now.
    pub(super) interval: Option<[f64; 2]>,
    /// The path of what an `until` ended: the step itself or something around it.
    pub(super) over: Option<String>,
    /// What held before it began, so that nothing was done.
    pub(super) not_needed: Option<String>,
    pub(super) held: Vec<Held>,
    pub(super) lines: Vec<Line>,
}

impl<'a> Walker<'a> {
    /// Walks on this action context; `start` is the world when the run began.
    pub fn new(
        scripts: &'a mut Scripts,
        texts: &'a dyn Texts,
        library: &'a Library,
        scene: &'a Scene,
        start: &'a WorldState,
    ) -> Self {
        Self { scripts, texts, library, scene, start }
    }

    /// Reads what is known now; until it is done nothing is done.
    pub fn reader(&mut self) -> Reader<'_> {
        Reader::new(self.scripts, self.library, self.scene, self.start)
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
        let ahead = self.scripts.context().past().ahead.remove(&index);
        let done = match (ahead, together::group(pg, index)) {
            (Some(done), _) => Ok(done),
            (None, Some(group)) => self.group(pg, &group, watched),
            (None, None) => self.alone(pg, index, watched, &[]),
        };
        if done.as_ref().map_or(true, |done| done.outcome != Outcome::Success) {
            self.scripts.context().past().ahead.clear();
        }
        done
    }

    /// Returns what free motions moved farthest since this was asked last, if they moved anything.
    pub fn take_brushed(&mut self) -> Option<Brushed> {
        self.scripts.context().take_brushed()
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
        let before = self.scripts.context().state()?;
        let begin = before.time;
        let mut end = End::default();
        let pace = self.scripts.context().pace();
        let deadlines = self.scripts.context().past().deadlines(pg, index, begin, pace);
        let paces = self.scripts.context().past().paces.clone();
        let begun = self.scripts.context().begin_step(&step.path);
        let rehearsed = match begun {
            Ok(rehearsed) => rehearsed,
            Err(off) => {
                end.broken = Some(Cause::from(off).into());
                end.plan_again = true;
                return self.done(pg, index, begin, watched, end);
            }
        };
        let needless = needless(&self.reader(), step, &before, rehearsed);
        match needless {
            Ok(None) => {}
            Ok(Some(condition)) => {
                self.scripts.context().ended_on_arrival();
                end.over = Some(condition.owner.clone());
                end.not_needed = Some(condition.text.clone());
                let promised = promised(&self.reader(), &given(step, end.over.as_deref()), &before);
                end.broken = promised.map(StepFailure::from);
                return self.done(pg, index, begin, watched, end);
            }
            Err(unmet) => {
                end.broken = Some(Cause::NotDoneAlready(unmet).into());
                end.plan_again = true;
                return self.done(pg, index, begin, watched, end);
            }
        }
        let needed = self.reader().unmet(&step.needs, &before);
        if let Some(unmet) = needed {
            end.broken = Some(Cause::Needs(unmet).into());
            return self.done(pg, index, begin, watched, end);
        }
        let scene = self.scripts.context().cell().scene.clone();
        let stroke = self.scripts.context().cell().robot.max_opening();
        let during = During::new(step, self.library, scene, self.start.clone(), begin, stroke)
            .within(deadlines, paces)
            .as_rehearsed(rehearsed);
        self.scripts.context().watch_over(during);
        let acted = self.act(step);
        // A step that is cut short leaves them for `interrupted`.
        if acted.as_ref().map_or_else(|error| !error.ends_the_walk(), |()| true) {
            end.lines = self.scripts.context().script_lines();
        }
        let during = self.scripts.context().watched_over();
        if let Err(error) = acted {
            end.plan_again = error.can_be_planned_again();
            match self.gave_up(step, error) {
                Ok(failure) => end.broken = failure,
                Err(error) => return Err(error),
            }
        }
        let after = self.scripts.context().state()?;
        if let Some(mut during) = during {
            if let Some(Cut::Ended { until }) = during.cut() {
                end.over = step.untils.get(*until).map(|until| until.owner.clone());
            }
            let reader = self.reader();
            for condition in &step.keeps {
                during.at_end(condition, &reader.read(&condition.expr, &after), after.time);
            }
            end.broken = end.broken.or_else(|| during.overdue(after.time).map(StepFailure::from));
            end.held = during.held();
        }
        end.broken = end.broken.or_else(|| {
            let lost = |unmet| Cause::Lost { unmet, after_s: None };
            let reader = self.reader();
            promised(&reader, &given(step, end.over.as_deref()), &after)
                .or_else(|| reader.unmet(&step.keeps, &after).map(lost))
                .or_else(|| still_false(&reader, pg, index, end.over.as_deref(), &after))
                .map(StepFailure::from)
        });
        self.done(pg, index, begin, watched, end)
    }

    /// Returns why an action gave up; `None` when it was over, which is no failure.
    ///
    /// # Errors
    ///
    /// A wish to stop, and what a device said.
    pub(super) fn gave_up(
        &self,
        step: &Step,
        error: ScriptError,
    ) -> Result<Option<StepFailure>, ActionError> {
        let at = |script: &str, line| Place {
            script: script.to_owned(),
            line,
            called_from: self.called_from(step),
        };
        match error {
            ScriptError::Action { error, .. } if error.ends_the_walk() => Err(error),
            ScriptError::Action { error: ActionError::Ended, .. } => Ok(None),
            ScriptError::Action { error: ActionError::Broken(cause), .. } => {
                Ok(Some(StepFailure::from(*cause)))
            }
            ScriptError::Action { error, line } => {
                let place = line.zip(step.script.as_ref()).map(|(line, file)| at(file, line));
                Ok(Some(StepFailure { cause: error.into(), place }))
            }
            ScriptError::Wrong { file, line, mistake } => Ok(Some(StepFailure {
                cause: Cause::Script(mistake.to_string()),
                place: Some(at(&file, line)),
            })),
        }
    }

    /// Returns the line of the task that calls a step.
    fn called_from(&self, step: &Step) -> Option<String> {
        let (_, source) = self.library.callable(&step.within)?;
        Some(source.place(step.span))
    }

    pub(super) fn act(&mut self, step: &Step) -> Result<(), ScriptError> {
        let (Some(file), Does::Action { args, .. }) = (&step.script, &step.does) else {
            return Ok(());
        };
        let Some(script) = self.texts.script(file) else {
            return Err(ScriptError::Wrong {
                file: file.clone(),
                line: 0,
                mistake: Mistake::NoScript,
            });
        };
        let state = self.scripts.context().state().map_err(at_nowhere)?;
        let mut values = BTreeMap::new();
        for argument in args {
            values.insert(argument.name.clone(), self.value(&argument.value, &state));
        }
        self.scripts.run(file, script, &values)
    }

    /// Returns what a script is given for an argument: a name stays a name, anything else is worked out.
    fn value(&mut self, expr: &Expr, state: &WorldState) -> ScriptValue {
        match &expr.kind {
            ExprKind::Name(name) => ScriptValue::Name(name.clone()),
            ExprKind::Text(text) => ScriptValue::Name(text.clone()),
            ExprKind::Bool(truth) => ScriptValue::Truth(*truth),
            ExprKind::Literal(quantity) => ScriptValue::Number(quantity.value),
            _ => {
                let reader = self.reader();
                if let Some(region) = reader.region(expr, state) {
                    return ScriptValue::Region(region);
                }
                match reader.quantity(expr, state) {
                    Some(quantity) => ScriptValue::Number(quantity.value),
                    None => match reader.read(expr, state).truth {
                        Some(truth) => ScriptValue::Truth(truth),
                        // Nobody knows what it is worth; the script is told what it is.
                        None => ScriptValue::Name(text::expr(expr)),
                    },
                }
            }
        }
    }

    /// Returns what is known at the end of a step that a person or a device cut short: of an arm that says no more, what it said last.
    ///
    /// # Errors
    ///
    /// When the arm has said nothing yet.
    pub fn interrupted(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        begin: f64,
        watched: &[Expr],
        why: &ActionError,
    ) -> Result<Done, ActionError> {
        let lines = self.scripts.context().script_lines();
        // What was on its way when it was cut short is in doubt before anything is read.
        self.scripts.context().body().cut_short();
        let owes = self.scripts.context().body().arm().owes_stop();
        let cause = match why {
            ActionError::Stopped if owes => Cause::StopUnanswered,
            why => why.clone().into(),
        };
        let broken = Some(cause.into());
        let end = End { stopped: true, broken, lines, ..End::default() };
        self.done(pg, index, begin, watched, end)
    }

    pub(super) fn done(
        &mut self,
        pg: &ParseGraph,
        index: usize,
        begin: f64,
        watched: &[Expr],
        end: End,
    ) -> Result<Done, ActionError> {
        let step = &pg.steps[index];
        let state = if end.stopped {
            self.scripts.context().state_left()?
        } else {
            self.scripts.context().state()?
        };
        let End { stopped, broken, plan_again, interval, over, not_needed, held, lines } = end;
        let mut failure = broken;
        let interval = interval.unwrap_or([begin, state.time]);
        if failure.is_none() {
            let mut context = self.scripts.context();
            let [from, to] = interval;
            context.past().done(&step.path, Interval { from, to });
            failure = context.past().broken(pg, index).map(|late| Cause::Mistimed(late).into());
        }
        let outcome = match (stopped, &failure) {
            (true, _) => Outcome::Stopped,
            (false, Some(_)) => Outcome::Failure,
            (false, None) => Outcome::Success,
        };
        // A step that did not end by itself promises nothing.
        let promised = if stopped { Vec::new() } else { given(step, over.as_deref()) };
        let (library, scene) = (self.library, self.scene);
        let reader = self.reader();
        let fluents = watched
            .iter()
            .map(|expr| {
                let text = text::expr(expr);
                let expected = promised.iter().find_map(|given| promise(&given.expr, &text));
                let ask = question(expr, library, scene);
                FluentReading { expected, ask, reading: reader.read(expr, &state), text }
            })
            .collect();
        let plan_again = plan_again && outcome == Outcome::Failure;
        Ok(Done {
            index,
            outcome,
            not_needed,
            failure,
            plan_again,
            interval,
            fluents,
            held,
            lines,
            state,
        })
    }
}

/// Returns what makes a step end before anything is done, if something does; `Err` says why arm and
/// rehearsal differ in that.
fn needless<'s>(
    reader: &Reader<'_>,
    step: &'s Step,
    state: &WorldState,
    rehearsed: Option<Ended>,
) -> Result<Option<&'s Condition>, Unmet> {
    let all = step.unless.iter().chain(&step.untils);
    let mut readings = all.map(|c| (c, reader.read(&c.expr, state))).collect::<Vec<_>>();
    readings.sort_by_key(|(_, reading)| match reading.truth {
        Some(true) => 0,
        None => 1,
        Some(false) => 2,
    });
    let Some((condition, reading)) = readings.first() else { return Ok(None) };
    match (reading.truth, rehearsed == Some(Ended::OnArrival)) {
        (Some(true), _) | (None, true) => Ok(Some(*condition)),
        (_, false) => Ok(None),
        (Some(false), true) => Err(unmet(condition, reading)),
    }
}

/// Says what a step should have made true and did not.
pub(super) fn promised(
    reader: &Reader<'_>,
    gives: &[Condition],
    state: &WorldState,
) -> Option<Cause> {
    reader.unmet(gives, state).map(Cause::Promise)
}

/// Says what was to end a step, or the block or task that ends with it, and is known to be false still.
fn still_false(
    reader: &Reader<'_>,
    pg: &ParseGraph,
    index: usize,
    over: Option<&str>,
    state: &WorldState,
) -> Option<Cause> {
    if over.is_some() {
        return None;
    }
    let is_last = |c: &&Condition| pg.steps_of(&c.owner).last() == Some(index);
    let ends: Vec<_> = pg.steps[index].untils.iter().filter(is_last).cloned().collect();
    // Any one of them is enough.
    let readings: Vec<_> = ends.iter().map(|c| reader.read(&c.expr, state)).collect();
    if readings.iter().any(|reading| reading.truth != Some(false)) {
        return None;
    }
    let (condition, reading) = ends.iter().zip(&readings).next()?;
    Some(Cause::Unfinished(unmet(condition, reading)))
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
