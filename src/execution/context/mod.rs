//! What an action script acts upon: one arm, what is known of the world, and the log of decisions.
//!
//! The same words serve the twin and the arm. In the twin they plan and record; on the arm they play what
//! the twin survived, through [`crate::arm::limits`]. Both work with the cell as the regressions found it. The
//! words are bound to rhai in [`super::script`]; planning itself is in [`super::plan`].
//!
//! `ask` looks, plans and chooses, `motion` moves the arm, `driving` carries each motion out, `brushed` tells what a free motion moved,
//! `moving` past what moves by itself, `cartesian` its tool in the world, `feel` until something is felt, `hand` the fingers.

mod ask;
mod brushed;
mod cartesian;
mod driving;
mod feel;
mod hand;
mod motion;
mod moving;
mod offer;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, PoisonError};

use rand::SeedableRng;
use rand::rngs::StdRng;
use rhai::Dynamic;

use crate::motion::budget::Budget;
use crate::trace::{Cause, Deed, Event, Line, NoWay};
use crate::world::WorldState;

use super::beside::{Openings, Order};
use super::body::{Body, Watcher};
use super::bounds::{self, ACTS, MEMORIES, NOTES, PLANS};
use super::calibration::Calibration;
use super::cell::Cell;
use super::conduct::Dial;
use super::decisions::{DecisionLog, Ended, Entry, NotInLog};
use super::during::During;
use super::error::ActionError;
use super::lines::{Gate, Running};
use super::refusal::Refusal;
use super::timing::Past;
use super::wording;
use crate::arm::{Cancel, Feedback};

pub use brushed::Brushed;

/// An arm whose joints are slower rests, rad/s: as where it is brought to rest.
const RESTS: f64 = 0.01;

/// What actions remember for later actions, by name.
pub type Memory = BTreeMap<String, Dynamic>;

/// One arm, one belief, one decision log: what scripts act upon.
pub struct ActionContext {
    body: Box<dyn Body>,
    setting: Setting,
    run: RunState,
    step: StepState,
    /// What all planning may still cost, and the arm time by which it is over; for rehearsals.
    allowance: Option<Allowance>,
}

/// What an action context works in: the same from its first step to its last, but for the regressions.
struct Setting {
    /// As the regressions in force found it.
    cell: Cell,
    /// As its files say.
    declared: Cell,
    cancel: Cancel,
    dial: Dial,
    watcher: Watcher,
}

/// What the run so far has left behind.
struct RunState {
    log: DecisionLog,
    chance: StdRng,
    /// Which of several equally planned candidates this is; 0 always takes the best way.
    variant: usize,
    /// Where the plan has the arm, as the arm itself says it, rad.
    q: Vec<f64>,
    /// Whether the arm may have been left elsewhere: it could not be asked, or was still to come to rest.
    is_astray: bool,
    /// Joint torques with an empty hand, beyond the model, N·m.
    tare: Option<Vec<f64>>,
    memory: Memory,
    /// Whether the step before ended sooner than its script.
    was_cut: bool,
    /// Whether the arm stands where it came to feel something, and not where a plan ended.
    felt: bool,
    /// Joint torques beyond the model's at rest before something was felt last, N·m.
    rest: Option<Vec<f64>>,
    past: Past,
    /// What free motions moved farthest since that was asked last.
    brushed: Option<Brushed>,
    /// What moves by itself near the arm.
    around: moving::Around,
    /// What of it reached the arm while the arm moved, as far as that was told.
    touched: BTreeSet<String>,
}

/// What holds while one step goes on, and for no other.
#[derive(Default)]
struct StepState {
    /// How far the arm may be from where it says, m; plans leave so much more room around objects.
    doubt: f64,
    /// What must hold, and what ends the step, while one runs.
    during: Option<During>,
    /// How far the rehearsal of this step turned the hand by measuring, as a share of the path.
    turned: Option<f64>,
    /// What a script wants done beside a motion, while it is asked.
    orders: Option<Vec<Order>>,
    /// How far the fingers were open, while something is done beside a motion.
    openings: Option<Openings>,
    /// The script that runs, and what of it acted.
    running: Running,
    /// Who may hold the arm before a line of it.
    gate: Option<Gate>,
}

/// What an action context may still do.
struct Allowance {
    planning: Arc<Budget<'static>>,
    /// Arm time at which it ends, s.
    until: f64,
    /// What it was given, s.
    seconds: f64,
}

impl ActionContext {
    /// Puts a body in a context where the plan has it at `q` (rad).
    pub fn new(
        cell: Cell,
        body: Box<dyn Body>,
        q: Vec<f64>,
        log: DecisionLog,
        chance: (u64, usize),
        cancel: Cancel,
        watcher: Watcher,
    ) -> Self {
        let (seed, variant) = chance;
        // A number of its own for planning: reality, which may be given the same seed, must not draw from the
        // same stream. The constants are the square roots of 2 and 3.
        let mixed = (seed ^ 0x6A09_E667_F3BC_C908)
            .wrapping_mul(0xBB67_AE85_84CA_A73B)
            .wrapping_add(variant as u64);
        let chance = StdRng::seed_from_u64(mixed);
        Self {
            body,
            setting: Setting {
                declared: cell.clone(),
                cell,
                cancel,
                dial: Dial::default(),
                watcher,
            },
            run: RunState {
                log,
                chance,
                variant,
                q,
                is_astray: false,
                tare: None,
                memory: Memory::new(),
                was_cut: false,
                felt: false,
                rest: None,
                past: Past::default(),
                brushed: None,
                around: moving::Around::default(),
                touched: BTreeSet::new(),
            },
            step: StepState::default(),
            allowance: None,
        }
    }

    /// Lets a dial slow the arm down from now on.
    pub fn obey(&mut self, dial: Dial) {
        self.setting.dial = dial;
    }

    /// Returns the share of full speed that the arm is held to now.
    pub fn pace(&self) -> f64 {
        self.setting.cell.limits.pace / self.setting.dial.stretch()
    }

    /// Allows so much arm time from now on, s, and so much planning altogether, in units of [`Budget`]; without
    /// this there is no end to the time, and each plan has a budget of its own.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn allow(&mut self, seconds: f64, planning: u64) -> Result<(), ActionError> {
        let until = self.body.arm().feedback()?.time + seconds;
        let cancel = self.setting.cancel.clone();
        let planning = Arc::new(Budget::of(planning, move || cancel.is_cancelled()));
        self.allowance = Some(Allowance { planning, until, seconds });
        Ok(())
    }

    /// Returns what the next plan may cost.
    pub(super) fn budget(&self) -> Arc<Budget<'static>> {
        if let Some(allowance) = &self.allowance {
            return allowance.planning.clone();
        }
        let cancel = self.setting.cancel.clone();
        Arc::new(Budget::new(move || cancel.is_cancelled()))
    }

    /// Says no to what would take `seconds` and end after the time that is allowed.
    pub(super) fn in_time(&mut self, seconds: f64) -> Result<(), ActionError> {
        let Some(Allowance { until, seconds: allowed, .. }) = self.allowance else { return Ok(()) };
        let left = until - self.body.arm().feedback()?.time;
        if seconds.is_nan() || seconds > left {
            return Err(ActionError::Broken(Box::new(Cause::Endless { allowed_s: allowed })));
        }
        Ok(())
    }

    /// Returns the wish to stop that this action context obeys.
    pub fn cancel(&self) -> &Cancel {
        &self.setting.cancel
    }

    /// Returns the constants, as the regressions in force found them.
    pub fn cell(&self) -> &Cell {
        &self.setting.cell
    }

    /// Returns the constants as their files declare them.
    pub fn declared(&self) -> &Cell {
        &self.setting.declared
    }

    /// Puts regressions in force: from now on everything is planned for the arm as they found it.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn calibrate(&mut self, calibration: Calibration) -> Result<(), ActionError> {
        self.setting.cell = calibration.cell(&self.setting.declared);
        self.body.calibrate(calibration, &self.setting.cell);
        self.find_arm()
    }

    /// Returns where the plan has the arm, rad: where the arm is, if it was left elsewhere.
    ///
    /// # Errors
    ///
    /// When the arm has to be asked for that and does not answer.
    pub fn planned_q(&mut self) -> Result<&[f64], ActionError> {
        self.found()?;
        Ok(&self.run.q)
    }

    /// Finds the arm where it may have been left elsewhere than the plan has it: nothing is planned or begun from there.
    pub(super) fn found(&mut self) -> Result<(), ActionError> {
        if self.run.is_astray { self.find_arm() } else { Ok(()) }
    }

    /// Lets the plan begin where a motion ended as it was sent, rad.
    pub(super) fn came_to(&mut self, q: &[f64]) {
        q.clone_into(&mut self.run.q);
        self.run.is_astray = false;
    }

    /// Lets the plan begin where the arm was last sent.
    ///
    /// # Errors
    ///
    /// When the arm does not answer: it is asked again before the plan goes on from anywhere.
    pub fn find_arm(&mut self) -> Result<(), ActionError> {
        self.run.is_astray = true;
        let Feedback { q_cmd: mut q, dq, .. } = self.body.arm().feedback()?;
        // A stop may leave a joint, or what is read of it, a hair past its range: plans begin inside.
        for (q, limit) in q.iter_mut().zip(self.setting.cell.robot.joints()) {
            if (*q - q.clamp(limit.lower, limit.upper)).abs() < self.setting.cell.limits.jump {
                *q = q.clamp(limit.lower + 1e-6, limit.upper - 1e-6);
            }
        }
        self.run.q = q;
        // One that has just been stopped may not rest yet.
        let moves = dq.iter().any(|dq| dq.abs() >= RESTS);
        self.run.is_astray = moves || self.setting.cancel.is_cancelled();
        Ok(())
    }

    /// Does something while the arm may be `doubt` m from where it says.
    pub fn doubting<T>(&mut self, doubt: f64, does: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.step.doubt, doubt);
        let done = does(self);
        self.step.doubt = before;
        done
    }

    /// Returns what was decided so far.
    pub fn log(&self) -> &DecisionLog {
        &self.run.log
    }

    /// Plays these decisions from now on, or records new ones.
    pub fn set_log(&mut self, log: DecisionLog) {
        self.run.log = log;
    }

    /// Returns what actions remember.
    pub fn memory(&self) -> &Memory {
        &self.run.memory
    }

    /// Puts other memories in place.
    pub fn set_memory(&mut self, memory: Memory) {
        self.run.memory = memory;
    }

    /// Returns what is known of the times of this run's steps.
    pub fn past(&mut self) -> &mut Past {
        &mut self.run.past
    }

    /// Puts the times of a run in place: none when it begins, those so far when it is rehearsed further.
    pub fn set_past(&mut self, past: Past) {
        self.run.past = past;
    }

    /// Lets someone hold the arm before the lines of scripts that act, or nobody.
    pub fn set_gate(&mut self, gate: Option<Gate>) {
        self.step.gate = gate;
    }

    /// Begins a script: the lines of it that act are kept until [`Self::script_lines`].
    pub(super) fn script_begins(&mut self, file: &str, text: &str) -> Result<(), ActionError> {
        let since = self.body.arm().feedback()?.time;
        self.step.running = Running::new(file, text, since);
        Ok(())
    }

    /// Takes note of a line that acts; returns who is to be asked before it, and what about.
    pub(super) fn line_begins(
        &mut self,
        line: usize,
        does: String,
        deed: Option<Deed>,
    ) -> Result<Option<(Gate, Line, WorldState)>, ActionError> {
        if self.step.running.acted() >= ACTS {
            return Err(Refusal::Acts { most: ACTS }.into());
        }
        let now = self.body.arm().feedback()?.time;
        let line = self.step.running.acts(line, does, deed, now);
        // What is only asked for, to be done beside a motion, does not happen yet.
        let Some(gate) = self.step.gate.clone().filter(|_| self.step.orders.is_none()) else {
            return Ok(None);
        };
        Ok(Some((gate, line, self.state()?)))
    }

    /// Returns the lines of the last script that acted.
    pub(super) fn script_lines(&mut self) -> Vec<Line> {
        std::mem::take(&mut self.step.running).lines()
    }

    /// Lets arm time stand still while a person is asked, or go on.
    pub(super) fn waits(&mut self, on: bool) -> Result<(), ActionError> {
        Ok(self.body.waits(on)?)
    }

    /// From now on scripts are asked what they want done beside a motion, and nothing is done.
    pub(super) fn take_orders(&mut self) {
        self.step.orders = Some(Vec::new());
    }

    /// Ends that, and returns what they want.
    pub(super) fn orders(&mut self) -> Vec<Order> {
        self.step.orders.take().unwrap_or_default()
    }

    /// Takes note of the fingers' opening at every tick, or no longer.
    pub(super) fn note_openings(&mut self, openings: Option<Openings>) {
        self.step.openings = openings;
    }

    /// Begins the step of that path in the decision log; returns when the rehearsal saw what ends it come true.
    pub fn begin_step(&mut self, path: &str) -> Result<Option<Ended>, NotInLog> {
        let rehearsed = self.run.log.begin(path, std::mem::take(&mut self.run.was_cut))?;
        self.step.turned = rehearsed.turned;
        Ok(rehearsed.ended)
    }

    /// Ends the step that just began, since what ends it is true already.
    pub fn ended_on_arrival(&mut self) {
        self.run.log.record(Entry::Ended(Ended::OnArrival));
        self.run.was_cut = true;
    }

    /// Puts conditions in force for everything the arm does from now on.
    pub fn watch_over(&mut self, during: During) {
        self.step.during = Some(during);
    }

    /// Puts them out of force, and returns how they fared.
    pub fn watched_over(&mut self) -> Option<During> {
        let during = self.step.during.take();
        self.run.was_cut |= during.as_ref().is_some_and(|during| during.cut().is_some());
        during
    }

    /// Counts a plan that the script asks for.
    ///
    /// # Errors
    ///
    /// When it asks for too many.
    pub(super) fn script_plans(&mut self) -> Result<(), ActionError> {
        if self.step.running.plans() > PLANS {
            return Err(Refusal::Plans { most: PLANS }.into());
        }
        Ok(())
    }

    /// `note(text)`, and what a script prints: told to whoever watches, of many the first.
    pub fn note(&mut self, text: &str) {
        let (most, _) = NOTES;
        let text = match self.step.running.notes() {
            n if n <= most => bounds::short(text),
            n if n == most + 1 => wording::notes_end(most),
            _ => return,
        };
        self.tell(&Event::note(text));
    }

    /// `remember(name, value)`.
    ///
    /// # Errors
    ///
    /// For too many things, too large ones, and what is not a value.
    pub fn remember(&mut self, name: &str, value: Dynamic) -> Result<(), ActionError> {
        let value = bounds::memory(name, value)?;
        let (most, _) = MEMORIES;
        if self.run.memory.len() >= most && !self.run.memory.contains_key(name) {
            return Err(Refusal::Memories { most }.into());
        }
        self.run.memory.insert(name.to_owned(), value);
        Ok(())
    }

    /// `recall(name)`.
    pub fn recall(&self, name: &str) -> Result<Dynamic, ActionError> {
        self.run
            .memory
            .get(name)
            .cloned()
            .ok_or_else(|| ActionError::NotRemembered(name.to_owned()))
    }

    /// Lends the body.
    pub fn body(&mut self) -> &mut dyn Body {
        self.body.as_mut()
    }

    /// Returns the world as far as it is known now.
    pub fn state(&mut self) -> Result<WorldState, ActionError> {
        Ok(self.body.state()?)
    }

    /// Returns the world as [`Self::state`] does, or as it was known last where the arm says no more where it is.
    ///
    /// # Errors
    ///
    /// When the arm has never said so.
    pub(super) fn state_left(&mut self) -> Result<WorldState, ActionError> {
        let known = self.body.state();
        known.or_else(|error| self.body.last_state().ok_or_else(|| error.into()))
    }

    /// Tells whoever watches.
    pub fn tell(&self, event: &Event) {
        self.setting.watcher.lock().unwrap_or_else(PoisonError::into_inner).event(event);
    }

    /// Returns how the arm can get at `o`, from a face where one is named: nothing, or why not.
    pub fn reachable(&mut self, o: &str, face: Option<&str>) -> Result<(), NoWay> {
        match self.planner() {
            Ok(planner) => planner.reachable(o, face),
            // An arm that does not answer is a device error the next step will tell.
            Err(_) => Ok(()),
        }
    }

    /// Returns the joint positions the arm itself reports, rad.
    pub fn reported_q(&mut self) -> Result<Vec<f64>, ActionError> {
        Ok(self.body.arm().feedback()?.q)
    }
}
