//! Tries parse graphs in the twin, several at a time, and ranks what survives.
//!
//! They are tried two at a time, likeliest first, until one does all it promised and spills nothing: the
//! rest could only be a little faster. Each candidate is one parse graph and one set of choices inside its scripts. A rehearsal starts from
//! the world as it is believed to be, runs the same scripts as the arm will, with rigid bodies and water,
//! and ends with every decision in a decision log.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use crate::arm::Cancel;
use crate::execution::cell::Cell;
use crate::execution::context::{ActionContext, Brushed, Memory};
use crate::execution::decisions::DecisionLog;
use crate::execution::error::ActionError;
use crate::execution::refusal::Refusal;
use crate::execution::script::Scripts;
use crate::execution::timing::Past;
use crate::execution::twin_arm::TwinBody;
use crate::execution::{done::Done, walk::Walker};
use crate::graph::ParseGraph;
use crate::language::Library;
use crate::motion::budget;
use crate::trace::{Cause, Event, Observer, Outcome, StepFailure};
use crate::twin::render::{ArmLook, View};
use crate::twin::{Person, Settings, Twin};
use crate::world::{Scene, WorldState};

use super::filming::{Glances, Glimpse, Shown};
use super::stdlib::Stdlib;
use super::strain::Meter;

/// Arm time after which a rehearsal is given up, s: a pour takes 30 s.
const LONGEST: f64 = 1200.0;
/// What a rehearsal may plan, in units of [`budget::Budget`]: a few times what one search may cost.
const PLANNED: u64 = 3 * budget::USUAL;

/// How many candidates are rehearsed at once, whatever the machine has: which one wins must not depend on it. The
/// best ways of the two likeliest parse graphs come first, one for each of two processors.
const AT_ONCE: usize = 2;

/// One parse graph with one set of choices.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// What is to be done.
    pub pg: ParseGraph,
    /// From which step on.
    pub from: usize,
    /// Which set of choices: 0 takes the best way everywhere.
    pub variant: usize,
}

impl Candidate {
    /// Returns the branches that were free to choose.
    pub fn branches(&self) -> String {
        let free = self.pg.choices.iter().filter(|choice| choice.is_free);
        free.map(|choice| choice.branch.as_str()).collect::<Vec<_>>().join(" ")
    }
}

/// What a rehearsal is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worth {
    /// Whether every step did what it promised.
    pub success: bool,
    /// Water on the table at the end, m³.
    pub spilt: f64,
    /// How far a free motion moved something that it was not to touch, m.
    pub brushed: f64,
    /// How far it came, from 0 to 1.
    pub progress: f64,
    /// Arm time it took, s.
    pub time: f64,
}

impl Worth {
    /// Returns whether nothing could be better but the time.
    fn is_clean(&self) -> bool {
        self.success && self.brushed <= 0.0 && self.spilt <= 0.0
    }

    /// Returns one number to sort by, less is better: success, then what was brushed, then spill, then time.
    fn cost(&self) -> f64 {
        let failed = if self.success { 0.0 } else { 1e6 * (2.0 - self.progress) };
        // What is brushed in the twin may be knocked over by the arm: more than any rehearsal takes and any vessel spills.
        let is_brushed = self.success && self.brushed > 0.0;
        let brushed = if is_brushed { 1e5 * (1.0 + self.brushed) } else { 0.0 };
        // A millilitre on the table is worth a quarter of a minute.
        failed + brushed + self.spilt * 1e6 * 15.0 + self.time
    }
}

/// One candidate carried out in the twin.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// What was tried.
    pub candidate: Candidate,
    /// How each step went, from `candidate.from` on.
    pub steps: Vec<Done>,
    /// What the twin looked like before the first step.
    pub start: View,
    /// What the twin looked like after each step.
    pub views: Vec<View>,
    /// What it looked like during each step, for the film.
    pub glimpses: Vec<Vec<Glimpse>>,
    /// Every decision.
    pub log: DecisionLog,
    /// What a free motion moved farthest that it was not to touch, and in which step.
    pub brushed: Option<(usize, Brushed)>,
    /// What it is worth.
    pub worth: Worth,
}

impl Rehearsal {
    /// Returns the step that failed and why.
    pub fn failure(&self) -> Option<(usize, &StepFailure)> {
        let last = self.steps.last()?;
        last.failure.as_ref().map(|failure| (last.index, failure))
    }
}

/// Who watches a rehearsal.
struct Watch {
    glances: Glances,
    meter: Meter,
}

impl Observer for Watch {
    fn event(&mut self, event: &Event) {
        self.glances.event(event);
        self.meter.event(event);
    }
}

/// What every rehearsal shares.
pub struct Rehearsals<'a> {
    /// Robot, scene, limits.
    pub cell: &'a Cell,
    /// How the arm looks.
    pub look: &'a ArmLook,
    /// The twin's settings.
    pub settings: &'a Settings,
    /// Scripts.
    pub stdlib: &'a Stdlib,
    /// Tasks, actions, fluents.
    pub library: &'a Library,
    /// The world as it is believed to be.
    pub state: &'a WorldState,
    /// The world when the run began.
    pub start: &'a WorldState,
    /// Where the plan has the arm, rad.
    pub q: &'a [f64],
    /// What actions before this remember.
    pub memory: &'a Memory,
    /// When the steps before this were done.
    pub past: &'a Past,
    /// All chance comes from this.
    pub seed: u64,
    /// Stops all of them.
    pub cancel: &'a Cancel,
    /// Who is shown them, if anybody: as the first, before it has a name.
    pub shown: Option<Shown>,
    /// Whether what they look like on the way is kept, for the film of the run.
    pub is_filmed: bool,
}

/// Somebody who takes what is held out as soon as it is: what a rehearsal plans for. That nobody comes is not rehearsed.
fn expected(scene: &Scene) -> Person {
    /// From the offer to the pull, s, and how hard, N: the middle of what the laboratory draws is as good as another.
    const USUAL: (f64, f64) = (1.0, 12.0);
    let base = scene.world_from_base.origin();
    Person::new(scene.handing(), base, USUAL.0, USUAL.1, true)
}

impl Rehearsals<'_> {
    /// Rehearses candidates until one is clean and returns those that were tried, best first; `done` is told after
    /// each.
    ///
    /// # Errors
    ///
    /// Only when a person stopped it or the twin itself cannot be built.
    pub fn all(
        &self,
        candidates: &[Candidate],
        done: &(dyn Fn(&Rehearsal) + Sync),
    ) -> Result<Vec<Rehearsal>, ActionError> {
        let mut tried: Vec<Rehearsal> = Vec::new();
        for (at, few) in candidates.chunks(AT_ONCE).enumerate() {
            let few: Result<Vec<Rehearsal>, ActionError> = few
                .par_iter()
                .enumerate()
                .map(|(k, candidate)| {
                    let rehearsal = self.one(candidate.clone(), at * AT_ONCE + k + 1)?;
                    done(&rehearsal);
                    Ok(rehearsal)
                })
                .collect();
            tried.extend(few?);
            if tried.iter().any(|rehearsal| rehearsal.worth.is_clean()) {
                break;
            }
        }
        tried.sort_by(|a, b| a.worth.cost().total_cmp(&b.worth.cost()));
        Ok(tried)
    }

    fn one(&self, candidate: Candidate, number: usize) -> Result<Rehearsal, ActionError> {
        let settings = Settings { seed: self.seed, ..self.settings.clone() };
        // The plan knows better than the encoders where the arm is.
        let state = WorldState { q: self.q.to_vec(), ..self.state.clone() };
        let failed = |error| ActionError::from(Refusal::NoTwin(error));
        let mut twin =
            Twin::new(&self.cell.robot, &self.cell.scene, &state, settings).map_err(failed)?;
        twin.meets(expected(&self.cell.scene));
        if state.held.is_some() {
            // The fingers take hold in the first tenths of a second.
            twin.run(0.3).map_err(failed)?;
        }
        let twin = Arc::new(Mutex::new(twin));
        let shown = self.shown.clone().map(|shown| {
            let name = format!("{} #{}", candidate.branches(), candidate.variant);
            Shown { number, name: name.trim().to_owned(), ..shown }
        });
        let (look, is_filmed) = (self.look.clone(), self.is_filmed);
        let glances = Glances::new(twin.clone(), look, shown.clone(), is_filmed);
        let meter = Meter::new(twin.clone(), &self.cell.robot);
        let watch = Arc::new(Mutex::new(Watch { glances, meter }));
        let context = ActionContext::new(
            self.cell.clone(),
            Box::new(TwinBody::new(twin.clone())),
            self.q.to_vec(),
            DecisionLog::recording(),
            (self.seed, candidate.variant),
            self.cancel.clone(),
            watch.clone(),
        );
        let mut scripts = Scripts::new(context);
        scripts.context().allow(LONGEST, PLANNED)?;
        scripts.context().set_memory(self.memory.clone());
        scripts.context().set_past(self.past.clone());
        let scene = self.cell.scene.clone();
        let mut walker = Walker::new(&mut scripts, self.stdlib, self.library, &scene, self.start);
        let watched = candidate.pg.fluents();
        let start =
            super::picture::view(&twin.lock().unwrap_or_else(PoisonError::into_inner), self.look);
        let (mut steps, mut views, mut glimpses) = (Vec::new(), Vec::new(), Vec::new());
        let (mut success, mut brushed) = (true, None::<(usize, Brushed)>);
        let next_step = || {
            let time = twin.lock().unwrap_or_else(PoisonError::into_inner).time();
            let mut watch = watch.lock().unwrap_or_else(PoisonError::into_inner);
            (watch.glances.next_step(time), watch.meter.take())
        };
        next_step();
        for index in candidate.from..candidate.pg.steps.len() {
            let mut step = walker.step(&candidate.pg, index, &watched)?;
            let (glimpsed, overload) = next_step();
            if let Some(overload) = overload.filter(|_| step.outcome == Outcome::Success) {
                step.outcome = Outcome::Failure;
                step.failure = Some(Cause::Overloaded(overload).into());
            }
            if let Some(found) = walker.take_brushed()
                && brushed.as_ref().is_none_or(|(_, known)| found.by > known.by)
            {
                brushed = Some((index, found));
            }
            success = step.outcome == Outcome::Success;
            steps.push(step);
            glimpses.push(glimpsed);
            let twin = twin.lock().unwrap_or_else(PoisonError::into_inner);
            views.push(super::picture::view(&twin, self.look));
            if !success {
                break;
            }
        }
        let state = scripts.context().state()?;
        let planned = candidate.pg.steps.len().saturating_sub(candidate.from).max(1);
        let worth = Worth {
            success,
            brushed: brushed.as_ref().map_or(0.0, |(_, brushed)| brushed.by),
            spilt: state.spilt.unwrap_or(0.0),
            progress: steps.len() as f64 / planned as f64,
            time: state.time - self.state.time,
        };
        let log = scripts.context().log().clone();
        let rehearsal = Rehearsal { candidate, steps, start, views, glimpses, log, brushed, worth };
        if let Some(shown) = shown {
            let failed = rehearsal.failure().map(|(_, failure)| failure.to_string());
            shown.tell(rehearsal.views.last().cloned(), Some(failed.map_or(Ok(()), Err)));
        }
        Ok(rehearsal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand that brushed a can in the twin knocked it over on the table.
    #[test]
    fn a_plan_that_brushes_something_is_worse_than_one_that_does_not_and_better_than_one_that_fails()
     {
        let clean = Worth { success: true, spilt: 0.0, brushed: 0.0, progress: 1.0, time: 11.0 };
        let slow = Worth { spilt: 50e-6, time: LONGEST, ..clean };
        let brushes = Worth { brushed: 0.004, ..clean };
        let topples = Worth { brushed: 0.2, ..clean };
        let fails = Worth { success: false, progress: 0.9, ..clean };
        let ranked = [clean, slow, brushes, topples, fails].map(|worth| worth.cost());
        assert!(ranked.is_sorted_by(|a, b| a < b), "{ranked:?}");
        assert!(clean.is_clean() && !brushes.is_clean());
    }
}
