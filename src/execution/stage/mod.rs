//! What an action script acts upon: one arm, what is known of the world, and the tape of decisions.
//!
//! The same words serve the twin and the arm. In the twin they plan and record; on the arm they play what
//! the twin survived, through [`super::limits`]. Both work with the cell as the regressions found it. The
//! words are bound to rhai in [`super::script`]; planning itself is in [`super::plan`].
//!
//! `body` is what a stage needs of an arm; `ask` looks, plans and chooses, `motion` moves the arm, `hand`
//! the fingers.

mod ask;
mod body;
mod hand;
mod motion;

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};

use rand::SeedableRng;
use rand::rngs::StdRng;
use rhai::Dynamic;

use crate::motion::budget::Budget;
use crate::motion::robot::Robot;
use crate::twin::Settings;
use crate::world::{Scene, WorldState};

use super::arm::Cancel;
use super::beside::{Openings, Order};
use super::bounds::{self, ACTS, MEMORIES, NOTES, PLANS};
use super::calibrate::Calibration;
use super::conduct::Dial;
use super::during::During;
use super::limits::Limits;
use super::lines::{Gate, Line, Running};
use super::plan::NoWay;
use super::tape::{Ended, Entry, OffTape, Tape};
use super::timing::Past;
use super::trace::Event;

pub use body::{ActionError, Body, Watcher};

/// What never changes while actions run: the cell as it is declared, or as the regressions found it.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The arm model.
    pub robot: Arc<Robot>,
    /// What is known beforehand.
    pub scene: Arc<Scene>,
    /// Bounds on every motion.
    pub limits: Limits,
    /// How the finger pads hold.
    pub pads: Pads,
}

/// What is known of how the finger pads hold a thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pads {
    /// Coefficient of friction on what is held.
    pub friction: f64,
    /// How fast a thing creeps along them the way its weight pulls, m/s.
    pub creep: f64,
}

impl Pads {
    /// Takes what the twin is built with.
    pub fn of(settings: &Settings) -> Self {
        let friction = &settings.friction;
        Self { friction: friction.pad_object, creep: friction.pad_creep }
    }
}

/// What actions remember for later actions, by name.
pub type Memory = BTreeMap<String, Dynamic>;

/// One arm, one belief, one tape.
pub struct Stage {
    /// As the regressions in force found it.
    cell: Cell,
    /// As its files say.
    declared: Cell,
    body: Box<dyn Body>,
    tape: Tape,
    chance: StdRng,
    /// Which of several equally planned candidates this is; 0 always takes the best way.
    variant: usize,
    /// Where the plan has the arm, as the arm itself says it, rad.
    q: Vec<f64>,
    /// Joint torques with an empty hand, beyond the model, N·m.
    tare: Option<Vec<f64>>,
    /// How far the arm may be from where it says, m; plans leave so much more room around objects.
    doubt: f64,
    memory: Memory,
    /// What must hold, and what ends the step, while one runs.
    during: Option<During>,
    /// How far the rehearsal of this step turned the hand by measuring, as a share of the path.
    turned: Option<f64>,
    /// Whether the step before ended sooner than its script.
    was_cut: bool,
    past: Past,
    /// What a script wants done beside a motion, while it is asked.
    orders: Option<Vec<Order>>,
    /// How far the fingers were open, while something is done beside a motion.
    openings: Option<Openings>,
    /// The script that runs, and what of it acted.
    running: Running,
    /// Who may hold the arm before a line of it.
    gate: Option<Gate>,
    cancel: Cancel,
    /// What all planning may still cost, and the arm time by which it is over; for rehearsals.
    allowance: Option<Allowance>,
    dial: Dial,
    watcher: Watcher,
}

/// What a stage may still do.
struct Allowance {
    planning: Arc<Budget<'static>>,
    /// Arm time at which it ends, s.
    until: f64,
    /// What it was given, s.
    seconds: f64,
}

impl Stage {
    /// Puts a body on stage where the plan has it at `q` (rad).
    pub fn new(
        cell: Cell,
        body: Box<dyn Body>,
        q: Vec<f64>,
        tape: Tape,
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
            declared: cell.clone(),
            cell,
            body,
            tape,
            chance,
            variant,
            q,
            tare: None,
            doubt: 0.0,
            memory: Memory::new(),
            during: None,
            turned: None,
            was_cut: false,
            past: Past::default(),
            orders: None,
            openings: None,
            running: Running::default(),
            gate: None,
            cancel,
            allowance: None,
            dial: Dial::default(),
            watcher,
        }
    }

    /// Lets a dial slow the arm down from now on.
    pub fn obey(&mut self, dial: Dial) {
        self.dial = dial;
    }

    /// Allows so much arm time from now on, s, and so much planning altogether, in units of [`Budget`]; without
    /// this there is no end to the time, and each plan has a budget of its own.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn allow(&mut self, seconds: f64, planning: u64) -> Result<(), ActionError> {
        let until = self.body.arm().feedback()?.time + seconds;
        let cancel = self.cancel.clone();
        let planning = Arc::new(Budget::of(planning, move || cancel.is_cancelled()));
        self.allowance = Some(Allowance { planning, until, seconds });
        Ok(())
    }

    /// Returns what the next plan may cost.
    pub(super) fn budget(&self) -> Arc<Budget<'static>> {
        if let Some(allowance) = &self.allowance {
            return allowance.planning.clone();
        }
        let cancel = self.cancel.clone();
        Arc::new(Budget::new(move || cancel.is_cancelled()))
    }

    /// Says no to what would take `seconds` and end after the time that is allowed.
    pub(super) fn in_time(&mut self, seconds: f64) -> Result<(), ActionError> {
        let Some(Allowance { until, seconds: allowed, .. }) = self.allowance else { return Ok(()) };
        let left = until - self.body.arm().feedback()?.time;
        if seconds.is_nan() || seconds > left {
            return Err(ActionError::Broken(format!(
                "it is not over within {allowed} s of arm time"
            )));
        }
        Ok(())
    }

    /// Returns the wish to stop that this stage obeys.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// Returns the constants, as the regressions in force found them.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// Returns the constants as their files declare them.
    pub fn declared(&self) -> &Cell {
        &self.declared
    }

    /// Puts regressions in force: from now on everything is planned for the arm as they found it.
    ///
    /// # Errors
    ///
    /// When the arm does not answer.
    pub fn calibrate(&mut self, calibration: Calibration) -> Result<(), ActionError> {
        self.cell = calibration.cell(&self.declared);
        self.body.calibrate(calibration, &self.cell);
        self.find_arm()
    }

    /// Returns where the plan has the arm, rad.
    pub fn planned_q(&self) -> &[f64] {
        &self.q
    }

    /// Lets the plan begin where the arm was last sent.
    pub fn find_arm(&mut self) -> Result<(), ActionError> {
        let mut q = self.body.arm().feedback()?.q_cmd;
        // A stop may leave a joint, or what is read of it, a hair past its range: plans begin inside.
        for (q, limit) in q.iter_mut().zip(self.cell.robot.joints()) {
            if (*q - q.clamp(limit.lower, limit.upper)).abs() < self.cell.limits.jump {
                *q = q.clamp(limit.lower + 1e-6, limit.upper - 1e-6);
            }
        }
        self.q = q;
        Ok(())
    }

    /// Sets how far the arm may be from where it says, m.
    pub fn doubt_arm(&mut self, doubt: f64) {
        self.doubt = doubt;
    }

    /// Returns what was decided so far.
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// Plays these decisions from now on, or records new ones.
    pub fn set_tape(&mut self, tape: Tape) {
        self.tape = tape;
    }

    /// Returns what actions remember.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Puts other memories in place.
    pub fn set_memory(&mut self, memory: Memory) {
        self.memory = memory;
    }

    /// Returns what is known of the times of this run's steps.
    pub fn past(&mut self) -> &mut Past {
        &mut self.past
    }

    /// Puts the times of a run in place: none when it begins, those so far when it is rehearsed further.
    pub fn set_past(&mut self, past: Past) {
        self.past = past;
    }

    /// Lets someone hold the arm before the lines of scripts that act, or nobody.
    pub fn set_gate(&mut self, gate: Option<Gate>) {
        self.gate = gate;
    }

    /// Begins a script: the lines of it that act are kept until [`Self::script_lines`].
    pub(super) fn script_begins(&mut self, file: &str, text: &str) -> Result<(), ActionError> {
        let since = self.body.arm().feedback()?.time;
        self.running = Running::new(file, text, since);
        Ok(())
    }

    /// Takes note of a line that acts; returns who is to be asked before it, and what about.
    pub(super) fn line_begins(
        &mut self,
        line: usize,
        does: String,
    ) -> Result<Option<(Gate, Line, WorldState)>, ActionError> {
        if self.running.acted() >= ACTS {
            let words = format!("a script may act {ACTS} times, and this one goes on");
            return Err(ActionError::Refused(words));
        }
        let now = self.body.arm().feedback()?.time;
        let line = self.running.acts(line, does, now);
        // What is only asked for, to be done beside a motion, does not happen yet.
        let Some(gate) = self.gate.clone().filter(|_| self.orders.is_none()) else {
            return Ok(None);
        };
        Ok(Some((gate, line, self.state()?)))
    }

    /// Returns the lines of the last script that acted.
    pub(super) fn script_lines(&mut self) -> Vec<Line> {
        std::mem::take(&mut self.running).lines()
    }

    /// Lets arm time stand still while a person is asked, or go on.
    pub fn waits(&mut self, on: bool) -> Result<(), ActionError> {
        Ok(self.body.waits(on)?)
    }

    /// From now on scripts are asked what they want done beside a motion, and nothing is done.
    pub fn take_orders(&mut self) {
        self.orders = Some(Vec::new());
    }

    /// Ends that, and returns what they want.
    pub fn orders(&mut self) -> Vec<Order> {
        self.orders.take().unwrap_or_default()
    }

    /// Takes note of the fingers' opening at every tick, or no longer.
    pub fn note_openings(&mut self, openings: Option<Openings>) {
        self.openings = openings;
    }

    /// Begins the step of that path on the tape; returns when the rehearsal saw what ends it come true.
    pub fn begin_step(&mut self, path: &str) -> Result<Option<Ended>, OffTape> {
        let rehearsed = self.tape.begin(path, std::mem::take(&mut self.was_cut))?;
        self.turned = rehearsed.turned;
        Ok(rehearsed.ended)
    }

    /// Ends the step that just began, since what ends it is true already.
    pub fn ended_on_arrival(&mut self) {
        self.tape.record(Entry::Ended(Ended::OnArrival));
        self.was_cut = true;
    }

    /// Puts conditions in force for everything the arm does from now on.
    pub fn watch_over(&mut self, during: During) {
        self.during = Some(during);
    }

    /// Puts them out of force, and returns how they fared.
    pub fn watched_over(&mut self) -> Option<During> {
        let during = self.during.take();
        self.was_cut |= during.as_ref().is_some_and(|during| during.cut().is_some());
        during
    }

    /// Counts a plan that the script asks for.
    ///
    /// # Errors
    ///
    /// When it asks for too many.
    pub(super) fn script_plans(&mut self) -> Result<(), ActionError> {
        if self.running.plans() > PLANS {
            let words = format!("a script may ask for {PLANS} plans, and this one goes on");
            return Err(ActionError::Refused(words));
        }
        Ok(())
    }

    /// `note(text)`, and what a script prints: told to whoever watches, of many the first.
    pub fn note(&mut self, text: &str) {
        let (most, _) = NOTES;
        let text = match self.running.notes() {
            n if n <= most => bounds::short(text),
            n if n == most + 1 => format!("{most} notes of this script are told, and no more"),
            _ => return,
        };
        self.tell(&Event::Note { text });
    }

    /// `remember(name, value)`.
    ///
    /// # Errors
    ///
    /// For too many things, too large ones, and what is not a value.
    pub fn remember(&mut self, name: &str, value: Dynamic) -> Result<(), ActionError> {
        let value = bounds::memory(name, value)?;
        let (most, _) = MEMORIES;
        if self.memory.len() >= most && !self.memory.contains_key(name) {
            let words = format!("actions remember {most} things already, and no more");
            return Err(ActionError::Refused(words));
        }
        self.memory.insert(name.to_owned(), value);
        Ok(())
    }

    /// `recall(name)`.
    pub fn recall(&self, name: &str) -> Result<Dynamic, ActionError> {
        self.memory
            .get(name)
            .cloned()
            .ok_or_else(|| ActionError::Refused(format!("no earlier action remembered a `{name}`")))
    }

    /// Lends the body.
    pub fn body(&mut self) -> &mut dyn Body {
        self.body.as_mut()
    }

    /// Returns the world as far as it is known now.
    pub fn state(&mut self) -> Result<WorldState, ActionError> {
        Ok(self.body.state()?)
    }

    /// Tells whoever watches.
    pub fn tell(&self, event: &Event) {
        self.watcher.lock().unwrap_or_else(PoisonError::into_inner).event(event);
    }

    /// Returns how the arm can get at `o`: nothing, or why not.
    pub fn reachable(&mut self, o: &str) -> Result<(), NoWay> {
        match self.planner() {
            Ok(planner) => planner.reachable(o),
            // An arm that does not answer is a device error the next step will tell.
            Err(_) => Ok(()),
        }
    }

    /// Returns the joint positions the arm itself reports, rad.
    pub fn reported_q(&mut self) -> Result<Vec<f64>, ActionError> {
        Ok(self.body.arm().feedback()?.q)
    }
}
