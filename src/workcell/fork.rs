//! What if: from a past step of a run, the rest of it or another call is rehearsed and set beside what came.
//!
//! In the twin only: no device is asked for anything, and the arm does not move. What the twin begins with is
//! the world as it was measured after that step.

use serde::Serialize;

use crate::execution::done::Done;
use crate::graph::ParseGraph;
use crate::language::ast::Call;
use crate::language::text;
use crate::trace::{Outcome, StepFailure, StepRecord};

use super::error::WhatIf;
pub(super) use super::moments::Moments;
use super::rehearse::{Rehearsal, Rehearsals};
use super::{Error, Run, WorkCell};

/// One step of a what-if beside the same step of the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForkedStep {
    /// Its number: the first is one more than the step it begins after.
    pub number: usize,
    /// Its node's path in the graph.
    pub path: String,
    /// As a call.
    pub action: String,
    /// How it ended.
    pub outcome: Outcome,
    /// What held before it began, so that nothing was done.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_needed: Option<String>,
    /// Why, when it did not succeed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Why, when it did not succeed, with its numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<StepFailure>,
    /// How long it took, s of arm time.
    pub took_s: f64,
    /// The number of the same step in the run; `None` when the run had none after that place.
    pub same_as: Option<usize>,
    /// The fluents after it that both know.
    pub compared: usize,
    /// Those of them that came out otherwise than in the run.
    pub otherwise: Vec<Otherwise>,
}

/// A fluent that came out otherwise than in the run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Otherwise {
    /// As people read it.
    pub name: String,
    /// In the what-if.
    pub here: bool,
    /// As measured in the run.
    pub came: bool,
}

/// A what-if.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fork {
    /// The run's task.
    pub task: String,
    /// The step after which it begins.
    pub after: usize,
    /// What was rehearsed: the rest, or another call.
    pub call: Option<String>,
    /// The steps, as the best candidate carried them out.
    pub steps: Vec<ForkedStep>,
    /// Whether all of them did what they promise.
    pub success: bool,
    /// Water on the table at the end, mL.
    pub spilt_ml: f64,
    /// Arm time, s.
    pub time_s: f64,
    /// How many candidates were rehearsed.
    pub tried: usize,
    /// Whether what earlier actions remembered was at hand. No record holds it: only a run of this session
    /// has it, and a script that recalls something fails without.
    pub remembers: bool,
}

impl WorkCell {
    /// Rehearses the rest of a run after a step, or another call, from the world as it was measured then.
    ///
    /// # Errors
    ///
    /// [`Error::WhatIf`] when the run has no such step, nothing comes after it, or it is of another scene; what
    /// is wrong with the call; a wish to stop.
    pub fn fork(&mut self, run: &Run, after: usize, call: Option<&Call>) -> Result<Fork, Error> {
        let found = run.steps.iter().rposition(|step| step.number == after);
        let Some(at) = found else {
            let of = run.steps.len();
            return Err(WhatIf::NoStep { after, of }.into());
        };
        let step = &run.steps[at];
        let state = &step.measured;
        let unknown =
            state.objects.iter().find(|o| self.model.cell.scene.object(&o.name).is_none());
        let joints = self.model.cell.robot.n_joints();
        if let Some(object) = unknown {
            return Err(WhatIf::OtherScene(object.name.clone()).into());
        }
        if state.q.len() != joints {
            return Err(WhatIf::OtherArm.into());
        }
        let kept = self.experience.moments.of(run, after);
        let remembers = kept.is_some();
        let (memory, past) = kept.unwrap_or_default();
        let start = run.start.as_ref().unwrap_or(state);
        let q = if step.planned_q.len() == joints { &step.planned_q } else { &state.q };
        let candidates = match call {
            None => {
                let (pg, from) = rest(run, at)?;
                self.of_variants(pg, from)
            }
            Some(call) => {
                let graph = self.graph(call)?;
                self.candidates_from(&graph, state)?
            }
        };
        let tried = candidates.len();
        // The arm as it was found when it was sent there, which may have been another day.
        let cell = run.calibration.as_ref().map_or_else(
            || self.model.cell.clone(),
            |found| found.cell(self.scripts.context().declared()),
        );
        let best = Rehearsals {
            cell: &cell,
            look: &self.model.look,
            settings: &self.model.settings,
            stdlib: &self.setup.stdlib,
            library: &self.setup.library,
            state,
            // Another call begins its own run.
            start: if call.is_some() { state } else { start },
            q,
            memory: &memory,
            past: &past,
            seed: self.setup.seed,
            cancel: &self.controls.cancel,
            shown: None,
            is_filmed: false,
        }
        .all(&candidates, &|_| {})?
        .into_iter()
        .next()
        .ok_or(Error::NothingToDo)?;
        Ok(Fork {
            task: run.task.clone(),
            after,
            call: call.map(text::call),
            steps: beside(&best, after, &run.steps[at + 1..]),
            success: best.worth.success,
            spilt_ml: best.worth.spilt * 1e6,
            time_s: best.worth.time,
            tried,
            remembers,
        })
    }
}

/// The parse graph that a run performed at its step `at`, and the step of it that comes next.
fn rest(run: &Run, at: usize) -> Result<(&ParseGraph, usize), Error> {
    let none = || Error::from(WhatIf::NothingAfter(run.steps[at].number));
    let (pg, index) = place(&run.parse_graphs, &run.steps[..=at]).ok_or_else(none)?;
    if index + 1 >= pg.steps.len() {
        return Err(none());
    }
    Ok((pg, index + 1))
}

/// Returns where the last of these steps is in the parse graphs that were performed, one an attempt.
fn place<'a>(graphs: &'a [ParseGraph], steps: &[StepRecord]) -> Option<(&'a ParseGraph, usize)> {
    let (mut graph, mut next) = (0, 0);
    let mut last = None;
    for step in steps {
        let found = (graph..graphs.len()).find_map(|g| {
            let from = if g == graph { next } else { 0 };
            let rest = graphs[g].steps.get(from..)?;
            Some((g, from + rest.iter().position(|planned| planned.path == step.path)?))
        });
        last = found;
        if let Some((g, index)) = found {
            (graph, next) = (g, index + 1);
        }
    }
    last.map(|(g, index)| (&graphs[g], index))
}

/// Sets the steps of a rehearsal beside those of a run that have the same paths, in their order.
fn beside(rehearsal: &Rehearsal, after: usize, came: &[StepRecord]) -> Vec<ForkedStep> {
    let mut left = came;
    let steps = rehearsal.steps.iter().enumerate();
    steps
        .map(|(k, done)| {
            let planned = &rehearsal.candidate.pg.steps[done.index];
            let same = left.iter().position(|step| step.path == planned.path);
            let same = same.map(|at| {
                let step = &left[at];
                left = &left[at + 1..];
                step
            });
            let (compared, otherwise) = same.map_or((0, Vec::new()), |step| differ(done, step));
            ForkedStep {
                number: after + 1 + k,
                path: planned.path.clone(),
                action: planned.text.clone(),
                outcome: done.outcome,
                not_needed: done.not_needed.clone(),
                reason: done.failure.as_ref().map(ToString::to_string),
                failure: done.failure.clone(),
                took_s: done.interval[1] - done.interval[0],
                same_as: same.map(|step| step.number),
                compared,
                otherwise,
            }
        })
        .collect()
}

/// How many fluents both know, and those that differ.
fn differ(done: &Done, step: &StepRecord) -> (usize, Vec<Otherwise>) {
    let both = done.fluents.iter().filter_map(|fluent| {
        let row = step.fluents.iter().find(|row| row.name == fluent.text)?;
        let (here, came) = (fluent.reading.truth?, row.measured?);
        Some(Otherwise { name: fluent.text.clone(), here, came })
    });
    let both: Vec<Otherwise> = both.collect();
    let count = both.len();
    (count, both.into_iter().filter(|row| row.here != row.came).collect())
}
