//! Rehearse, choose, perform, recover: until the task is done or given up.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use crate::execution::stage::ActionError;
use crate::execution::timing::Past;
use crate::execution::trace::Event;
use crate::graph::{self, Graph, ParseGraph};
use crate::language::ast::Remedy;
use crate::world::WorldState;

use super::perform::Failed;
use super::rehearse::{Candidate, Rehearsal, Rehearsals};
use super::run::SharedRecorder;
use super::{Ending, Error, Run, Tried, WorkCell, tell};

/// How many candidates are rehearsed for one attempt.
pub(super) const CANDIDATES: usize = 4;
/// How often in one attempt the rest is planned again because the arm found things otherwise than rehearsed.
const AGAIN: usize = 3;

impl WorkCell {
    /// Rehearses and performs until the task is done or given up.
    pub(super) fn attempt(
        &mut self,
        graph: &Graph,
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<(), Error> {
        let begin = self.now();
        self.phase("plan", "choosing parse graphs");
        let candidates = self.candidates_from(graph, start)?;
        run.timing_s.plan += self.now() - begin;
        self.scripts.stage().set_past(Past::default());
        let mut tried_branches = BTreeMap::new();
        let mut used: BTreeMap<String, u32> = BTreeMap::new();
        let mut best = self.rehearse(candidates, start, run)?;
        let mut again = 0;
        loop {
            self.phase("execute", "the arm moves");
            let failed = self.perform(graph, &best, start, run, recorder);
            let Some(Failed { index, reason, plan_again }) = failed? else {
                run.outcome = Ending::Success;
                return Ok(());
            };
            self.note(&format!("step failed: {reason}"));
            let pg = &best.candidate.pg;
            if plan_again && again < AGAIN {
                again += 1;
                self.note("planning the rest again from where the arm is");
                match self.rehearse(of_variants(pg, index), start, run) {
                    Ok(rest) => {
                        best = rest;
                        continue;
                    }
                    // What survives no rehearsal is not tried; what was to be done about a failure is.
                    Err(Error::NoSurvivor { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
            let recovery = recovery(pg, index, &used);
            let Some(recovery) = recovery else {
                run.reason = Some(reason);
                return Ok(());
            };
            let plan = self.recovery_now(graph, pg, recovery)?;
            *used.entry(plan.path.clone()).or_default() += 1;
            self.note(&format!("recovering: {}", plan.path));
            if let Err(error) = self.carry_out(graph, &plan.steps, start, run, recorder) {
                let stopped =
                    matches!(error, Error::Action(ActionError::Stopped) | Error::Unrecorded { .. });
                run.reason = Some(format!("{reason}; then the recovery failed: {error}"));
                return if stopped { Err(error) } else { Ok(()) };
            }
            match plan.remedy {
                Some(Remedy::Retry { other, .. }) => {
                    let from = if other {
                        self.other_branch(graph, pg, index, &mut tried_branches)?
                    } else {
                        None
                    };
                    let (pg, from) = from.unwrap_or_else(|| (pg.clone(), first_of(pg, index)));
                    best = self.rehearse(of_variants(&pg, from), start, run)?;
                }
                Some(Remedy::Abort(why)) => {
                    run.reason = Some(match why {
                        Some(why) => format!("{reason}; {why}"),
                        None => reason,
                    });
                    return Ok(());
                }
                None => {
                    run.reason = Some(reason);
                    return Ok(());
                }
            }
        }
    }

    /// Returns the candidates of a first attempt: the likeliest parse graphs, each with its best ways and
    /// with others.
    pub(super) fn candidates_from(
        &self,
        graph: &Graph,
        start: &WorldState,
    ) -> Result<Vec<Candidate>, Error> {
        let pgs = self.parses(graph, start, CANDIDATES / 2)?;
        Ok((0..CANDIDATES)
            .map(|i| Candidate { pg: pgs[i % pgs.len()].clone(), from: 0, variant: i / pgs.len() })
            .collect())
    }

    /// Rehearses candidates from the present and returns the best survivor.
    fn rehearse(
        &mut self,
        candidates: Vec<Candidate>,
        start: &WorldState,
        run: &mut Run,
    ) -> Result<Rehearsal, Error> {
        let begin = self.now();
        let n = candidates.len();
        self.phase("simulate", &format!("{n} candidates in the twin{}", self.known.words()));
        for (name, why) in &self.known.aside {
            self.note(&format!("effect {name} is left out: {why}"));
        }
        let state = self.state()?;
        let q = self.scripts.stage().planned_q().to_vec();
        let memory = self.scripts.stage().memory().clone();
        let past = self.scripts.stage().past().clone();
        let finished = Mutex::new(0_usize);
        let tried = Rehearsals {
            cell: &self.cell,
            look: &self.look,
            settings: &self.settings,
            stdlib: &self.stdlib,
            library: &self.library,
            state: &state,
            start,
            q: &q,
            memory: &memory,
            past: &past,
            seed: self.seed,
            cancel: &self.cancel,
        }
        .all(candidates, &|_| {
            let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
            *finished += 1;
            tell(
                &self.fan,
                &Event::Progress {
                    what: "rehearsals".into(),
                    fraction: *finished as f64 / n as f64,
                },
            );
        })?;
        run.timing_s.simulate += self.now() - begin;
        run.rehearsals.extend(tried.iter().map(summary));
        for line in told(&tried) {
            self.note(&line);
        }
        let Some(best) = tried.into_iter().next() else {
            return Err(Error::NothingToDo);
        };
        match best.failure() {
            None => Ok(best),
            Some((index, reason)) => Err(Error::NoSurvivor {
                tried: n,
                step: best.candidate.pg.steps[index].text.clone(),
                reason: reason.to_owned(),
            }),
        }
    }

    /// Carries out the steps of a recovery: rehearsed first, like everything that moves the arm.
    fn carry_out(
        &mut self,
        graph: &Graph,
        steps: &[graph::Step],
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<(), Error> {
        if steps.is_empty() {
            return Ok(());
        }
        let pg = ParseGraph {
            call: "recovery".into(),
            choices: Vec::new(),
            steps: steps.to_vec(),
            timings: Vec::new(),
            recoveries: Vec::new(),
            log_p: 0.0,
        };
        let candidates =
            (0..2).map(|variant| Candidate { pg: pg.clone(), from: 0, variant }).collect();
        let best = self.rehearse(candidates, start, run)?;
        self.perform(graph, &best, start, run, recorder)?;
        Ok(())
    }
}

/// The rest of a parse graph from a step on, with every set of choices.
fn of_variants(pg: &ParseGraph, from: usize) -> Vec<Candidate> {
    (0..CANDIDATES).map(|variant| Candidate { pg: pg.clone(), from, variant }).collect()
}

/// Returns the innermost recovery in force for a step that still has tries left.
fn recovery(pg: &ParseGraph, index: usize, used: &BTreeMap<String, u32>) -> Option<usize> {
    pg.steps[index].recoveries.iter().copied().find(|&at| {
        let plan = &pg.recoveries[at];
        let most = match plan.remedy {
            Some(Remedy::Retry { times, .. }) => times,
            _ => 1,
        };
        used.get(&plan.path).copied().unwrap_or(0) < most
    })
}

/// Returns the first step of the smallest sub-task that holds a step, to be done again.
fn first_of(pg: &ParseGraph, index: usize) -> usize {
    let path = &pg.steps[index].path;
    let above = path.rsplit_once('/').map_or(path.as_str(), |(above, _)| above);
    pg.steps_of(above).next().unwrap_or(index)
}

fn summary(rehearsal: &Rehearsal) -> Tried {
    let pg = &rehearsal.candidate.pg;
    let choices = pg.choices.iter().map(|c| format!("{}={}", c.node, c.branch)).collect();
    Tried {
        choices,
        variant: rehearsal.candidate.variant,
        success: rehearsal.worth.success,
        spilt_ml: rehearsal.worth.spilt * 1e6,
        time_s: rehearsal.worth.time,
        failed: rehearsal
            .failure()
            .map(|(index, reason)| format!("{}: {reason}", pg.steps[index].text)),
    }
}

/// How each candidate went; those of one branch that went alike share a line.
fn told(tried: &[Rehearsal]) -> Vec<String> {
    let mut lines: Vec<(String, String, String)> = Vec::new();
    for rehearsal in tried {
        let tried = summary(rehearsal);
        let free = rehearsal.candidate.pg.choices.iter().filter(|c| c.is_free);
        let branches: Vec<_> = free.map(|c| c.branch.as_str()).collect();
        let (branches, variant) = (branches.join(" "), format!(" #{}", tried.variant));
        let went = match tried.failed {
            None => format!(
                "survived, {:.1} mL spilt, {:.0} s on the arm",
                tried.spilt_ml, tried.time_s
            ),
            Some(why) => format!("failed at {why}"),
        };
        match lines.last_mut() {
            Some((of, variants, before)) if *of == branches && *before == went => {
                variants.push_str(&variant);
            }
            _ => lines.push((branches, variant, went)),
        }
    }
    let line = |(branches, variants, went)| format!("twin: {branches}{variants} {went}");
    lines.into_iter().map(line).collect()
}
