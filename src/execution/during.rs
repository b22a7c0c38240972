//! What holds while a step runs: conditions and time limits, read as the arm moves.
//!
//! At a fixed rate of arm time the world is looked at as far as it can be known *without a picture*
//! ([`Sight`]), and the conditions in force are judged by the same evaluator as at a step's beginning and
//! end: `keeps` of every task around the step, `while`, `until`, `limit`. A broken condition or an exceeded
//! limit cuts the motion short, which is brought to rest as Ctrl-C would; so does an `until` that came
//! true, and then the step ends as it should. What nobody knows between pictures is unknown, and unknown
//! stops nothing.
//!
//! In the twin everything is known, so a rehearsal also says when an `until` comes true that no sensor of
//! the arm can tell, such as a volume while pouring; that time is in the decision log. On the arm the measured
//! world has the first word: the step ends as soon as what ends it is measured to be true, ends where the
//! rehearsal did when nobody can measure it, and fails when it is measured to be still false a little
//! later than that, for what comes after was never rehearsed.
//!
//! Method: sampled robustness of signal temporal logic; Donzé and Maler, FORMATS 2010.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::fluent::{Evaluator, Facts, Fluents, Reading};
use crate::graph::{Condition, Role, Step};
use crate::language::Library;
use crate::language::ast::{Expr, ExprKind, FluentItem};
use crate::units::Quantity;
use crate::world::{Scene, WorldState};

use super::body::Sight;
use super::decisions::Ended;
use super::error::ActionError;
use super::paces::Paces;
use crate::arm::Feedback;
use crate::trace::{Cause, Overdue, Unmet};

/// How often the conditions are read, s of arm time.
pub const PERIOD: f64 = 0.04;
/// How much later than in the rehearsal an `until` may be measured to come true, s of arm time; chosen.
pub const LATE: f64 = 0.3;

/// The time something may take.
#[derive(Debug, Clone, PartialEq)]
pub struct Deadline {
    /// Whose: `pick(jar)`.
    pub of: String,
    /// How long at full speed, s.
    pub seconds: f64,
    /// Since when, s of arm time.
    pub since: f64,
}

/// How one condition fared while a step ran.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// The condition as text.
    pub text: String,
    /// `Keeps` for `keeps` and `while`, `Until` for `until`.
    pub role: Role,
    /// Its margin when it was smallest, where it has one.
    pub least: Option<Quantity>,
    /// When that was, s from the step's beginning.
    pub least_at: Option<f64>,
    /// When an `until` became true, s from the step's beginning.
    pub became_true: Option<f64>,
    /// Whether that is the rehearsal's word, since nobody could measure it.
    pub by_rehearsal: bool,
}

/// Why a motion was cut short.
#[derive(Debug, Clone, PartialEq)]
pub enum Cut {
    /// What ends the step is true: which condition, by its place in the step.
    Ended {
        /// Index into the step's `untils`.
        until: usize,
    },
    /// A condition is broken or a limit exceeded.
    Broken(Cause),
}

impl From<Cut> for ActionError {
    fn from(cut: Cut) -> Self {
        match cut {
            Cut::Ended { .. } => Self::Ended,
            Cut::Broken(cause) => Self::Broken(Box::new(cause)),
        }
    }
}

/// One condition that is read again and again.
struct Watched {
    condition: Condition,
    held: Held,
    least_rank: f64,
    /// Whether a yes or no was false the last time.
    was_false: bool,
}

/// Where a motion stands.
struct Motion {
    sight: Box<dyn Sight>,
    /// Arm time of its first tick, s.
    began: Option<f64>,
    /// How much of it was over at its first tick, and how long it is to take altogether, s.
    over: f64,
    seconds: f64,
}

/// The conditions and limits in force during one step.
pub struct During {
    scene: Arc<Scene>,
    start: WorldState,
    fluents: Bodies,
    stroke: f64,
    begin: f64,
    watched: Vec<Watched>,
    deadlines: Vec<Deadline>,
    paces: Paces,
    /// When the rehearsal says an `until` came true.
    rehearsed: Option<Ended>,
    motion: Option<Motion>,
    /// How many motions have begun.
    motions: usize,
    /// When the conditions are read next, s of arm time.
    next: f64,
    cut: Option<Cut>,
    /// Where the cut lies, for the decision log.
    cut_at: Option<Ended>,
}

impl During {
    /// Watches over a step that begins at arm time `begin` (s); `stroke` is the gripper's, m.
    pub fn new(
        step: &Step,
        library: &Library,
        scene: Arc<Scene>,
        start: WorldState,
        begin: f64,
        stroke: f64,
    ) -> Self {
        let conditions = || step.keeps.iter().chain(&step.untils);
        let mut fluents = Bodies::default();
        conditions().for_each(|condition| fluents.add(&condition.expr, library));
        Self {
            scene,
            start,
            fluents,
            stroke,
            begin,
            watched: conditions().map(Watched::new).collect(),
            deadlines: Vec::new(),
            paces: Paces::default(),
            rehearsed: None,
            motion: None,
            motions: 0,
            next: begin,
            cut: None,
            cut_at: None,
        }
    }

    /// Puts time limits in force, counted by how fast the arm is held to move.
    #[must_use]
    pub fn within(self, deadlines: Vec<Deadline>, paces: Paces) -> Self {
        Self { deadlines, paces, ..self }
    }

    /// Says when the rehearsal saw an `until` come true.
    #[must_use]
    pub fn as_rehearsed(self, rehearsed: Option<Ended>) -> Self {
        Self { rehearsed, ..self }
    }

    /// Begins a motion, or a wait, that is to take `seconds`, or goes on with it when `over` s of it are over, less than
    /// none while the arm is led to where it begins; `paces` is how fast the arm is held to move by now.
    pub fn motion_begins(&mut self, sight: Box<dyn Sight>, over: f64, seconds: f64, paces: Paces) {
        self.paces = paces;
        self.motion = Some(Motion { sight, began: None, over, seconds });
    }

    /// Ends it.
    pub fn motion_ends(&mut self) {
        self.motion = None;
        self.motions += 1;
    }

    /// Does not count the motion that ended last: it led back to where the rehearsal goes on.
    pub fn uncount(&mut self) {
        self.motions = self.motions.saturating_sub(1);
    }

    /// Returns why the motion was cut short, if it was.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// Returns where what ends the step came true, as the decision log keeps it.
    pub fn ended(&self) -> Option<Ended> {
        self.cut_at
    }

    /// Returns how each condition fared.
    pub fn held(self) -> Vec<Held> {
        self.watched.into_iter().map(|watched| watched.held).collect()
    }

    /// Takes note of a condition as read at the step's end.
    pub fn at_end(&mut self, condition: &Condition, reading: &Reading, time: f64) {
        let since = time - self.begin;
        if let Some(watched) = self.watched.iter_mut().find(|w| w.condition == *condition) {
            watched.note(reading, since);
        }
    }

    /// Looks at one tick of the arm; returns whether the motion is to be brought to rest.
    pub fn sees(&mut self, feedback: &Feedback) -> bool {
        if self.cut.is_some() {
            return true;
        }
        let Some(motion) = &mut self.motion else { return false };
        let began = *motion.began.get_or_insert(feedback.time);
        if feedback.time + 1e-9 < self.next {
            return false;
        }
        // On a grid from the step's beginning, whatever the arm's own rate.
        let grid = ((feedback.time - self.begin + 1e-9) / PERIOD).floor();
        self.next = self.begin + (grid + 1.0) * PERIOD;
        let elapsed = motion.over + feedback.time - began;
        self.cut = self.judge(feedback, elapsed);
        if let (Some(Cut::Ended { .. }), Some(motion)) = (&self.cut, &self.motion) {
            let along = elapsed.max(0.0) / motion.seconds.max(1e-3);
            self.cut_at = Some(Ended::During { motion: self.motions, along });
        }
        self.cut.is_some()
    }

    fn judge(&mut self, feedback: &Feedback, elapsed: f64) -> Option<Cut> {
        let since = feedback.time - self.begin;
        // Without conditions the world need not be looked at.
        let readings = if self.watched.is_empty() { Vec::new() } else { self.read(feedback) };
        for (watched, reading) in self.watched.iter_mut().zip(&readings) {
            watched.note(reading, since);
        }
        self.ending(&readings, since, elapsed)
            .or_else(|| self.broken(&readings, since))
            .or_else(|| self.overdue(feedback.time).map(Cut::Broken))
    }

    /// Reads every condition at this tick.
    fn read(&mut self, feedback: &Feedback) -> Vec<Reading> {
        let Some(motion) = &mut self.motion else { return Vec::new() };
        let state = motion.sight.state(feedback);
        let facts = Glimpse { sight: motion.sight.as_ref(), stroke: self.stroke };
        let evaluator = Evaluator {
            scene: &self.scene,
            state: &state,
            start: &self.start,
            fluents: &self.fluents,
            bindings: &BTreeMap::new(),
            facts: &facts,
        };
        self.watched.iter().map(|watched| evaluator.read(&watched.condition.expr)).collect()
    }

    /// Whether what ends the step is true, as measured or as rehearsed.
    fn ending(&mut self, readings: &[Reading], since: f64, elapsed: f64) -> Option<Cut> {
        let mut due = None;
        if let (Some(Ended::During { motion, along }), Some(now)) = (self.rehearsed, &self.motion) {
            let over = elapsed - along * now.seconds;
            if motion == self.motions && over >= -1e-9 {
                due = Some(over);
            }
        }
        let untils =
            self.watched.iter_mut().zip(readings).filter(|(w, _)| w.held.role == Role::Until);
        let mut untils: Vec<_> = untils.collect();
        if let Some(until) = untils.iter().position(|(_, reading)| reading.truth == Some(true)) {
            untils[until].0.held.became_true = Some(since);
            return Some(Cut::Ended { until });
        }
        let over = due?;
        if let Some(until) = untils.iter().position(|(_, reading)| reading.truth.is_none()) {
            untils[until].0.held.became_true = Some(since);
            untils[until].0.held.by_rehearsal = true;
            return Some(Cut::Ended { until });
        }
        if over <= LATE {
            return None;
        }
        let (watched, reading) = untils.first()?;
        let unmet = unmet(&watched.condition, reading);
        Some(Cut::Broken(Cause::Late { unmet, after_s: since, late_s: over }))
    }

    /// The first condition that is broken.
    fn broken(&mut self, readings: &[Reading], since: f64) -> Option<Cut> {
        let keeps = self.watched.iter_mut().zip(readings);
        for (watched, reading) in keeps.filter(|(w, _)| w.held.role != Role::Until) {
            let is_false = reading.truth == Some(false);
            // A touch that is felt or not may flicker for one look; a number with a margin does not.
            let sure = reading.margin.is_some() || watched.was_false;
            watched.was_false = is_false;
            if is_false && sure {
                let unmet = unmet(&watched.condition, reading);
                return Some(Cut::Broken(Cause::Lost { unmet, after_s: Some(since) }));
            }
        }
        None
    }

    /// Says which limit is exceeded at arm time `now` (s), the first if any is.
    pub fn overdue(&self, now: f64) -> Option<Cause> {
        self.deadlines.iter().find_map(|limit| limit.exceeded(now, &self.paces))
    }
}

impl Deadline {
    /// Says whether it is exceeded at arm time `now` (s), the arm having been held to these paces.
    pub(super) fn exceeded(&self, now: f64, paces: &Paces) -> Option<Cause> {
        let counted = paces.unslowed(self.since, now);
        (counted > self.seconds + 1e-9).then(|| {
            let took_s = now - self.since;
            let (of, limit_s) = (self.of.clone(), self.seconds);
            Cause::Overdue(Overdue { of, took_s, limit_s, pace: counted / took_s })
        })
    }
}

impl Watched {
    fn new(condition: &Condition) -> Self {
        let held = Held {
            text: condition.text.clone(),
            role: condition.role,
            least: None,
            least_at: None,
            became_true: None,
            by_rehearsal: false,
        };
        Self { condition: condition.clone(), held, least_rank: f64::INFINITY, was_false: false }
    }

    /// Keeps the smallest margin; terms of different units are compared by their ranks.
    fn note(&mut self, reading: &Reading, since: f64) {
        if reading.margin.is_some() && reading.rank < self.least_rank {
            self.least_rank = reading.rank;
            self.held.least = reading.margin;
            self.held.least_at = Some(since);
        }
    }
}

/// Takes down that a condition is false, by how much, and with what numbers.
pub(super) fn unmet(condition: &Condition, reading: &Reading) -> Unmet {
    // Of a long condition the part that decided is told.
    let term = if reading.term.is_empty() { &condition.text } else { &reading.term };
    Unmet {
        condition: condition.text.clone(),
        term: term.clone(),
        margin: reading.margin,
        numbers: reading.value.zip(reading.limit),
    }
}

/// The bodies of the fluents that some conditions are made of.
#[derive(Default)]
struct Bodies(BTreeMap<String, FluentItem>);

impl Bodies {
    fn add(&mut self, expr: &Expr, library: &Library) {
        match &expr.kind {
            ExprKind::Call(call) => {
                call.args.iter().flat_map(|arg| &arg.values).for_each(|e| self.add(e, library));
                let name = &call.name.text;
                if let (false, Some((item, _))) = (self.0.contains_key(name), library.fluent(name))
                {
                    self.0.insert(name.clone(), item.clone());
                    let defaults = item.params.iter().filter_map(|param| param.default.as_ref());
                    defaults.chain([&item.body]).for_each(|e| self.add(e, library));
                }
            }
            ExprKind::Member(inner, _) | ExprKind::Not(inner) | ExprKind::Negate(inner) => {
                self.add(inner, library);
            }
            ExprKind::Binary(a, _, b) | ExprKind::Within(a, b) => {
                self.add(a, library);
                self.add(b, library);
            }
            ExprKind::Name(_)
            | ExprKind::Literal(_)
            | ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::Bad => {}
        }
    }
}

impl Fluents for Bodies {
    fn fluent(&self, name: &str) -> Option<&FluentItem> {
        self.0.get(name)
    }
}

/// Facts beside the state while the arm moves; whether something is reachable takes planning, which
/// there is no time for.
struct Glimpse<'a> {
    sight: &'a dyn Sight,
    stroke: f64,
}

impl Facts for Glimpse<'_> {
    fn contact(&self, a: &str, b: &str) -> Option<bool> {
        self.sight.contact(a, b)
    }

    fn stroke(&self) -> f64 {
        self.stroke
    }
}
