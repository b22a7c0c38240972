//! Rehearse, choose, perform, recover: until the task is done or given up.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use crate::execution::done::Done;
use crate::execution::timing::Past;
use crate::graph::{self, Graph, ParseGraph};
use crate::language::ast::Remedy;
use crate::trace::{Event, StepFailure, Unmet};
use crate::units::Dimension;
use crate::world::WorldState;

use super::filming::Shown;
use super::perform::Failed;
use super::rehearse::{Candidate, Rehearsal, Rehearsals};
use super::roles::tell;
use super::run::UnderWay;
use super::{Ending, Error, InTwin, Tried, WorkCell, wording};

/// How often in one attempt the rest is planned again because the arm found things otherwise than rehearsed.
const AGAIN: usize = 3;
/// Width of a rehearsal's picture for who looks on, px.
const WIDTH_OF_REHEARSAL: u32 = 240;

impl WorkCell {
    /// Rehearses and performs until the task is done or given up.
    pub(super) fn attempt(&mut self, on: &mut UnderWay<'_>) -> Result<(), Error> {
        self.audience.phase("plan", wording::choosing());
        let candidates = self.candidates_from(on.graph, on.start)?;
        self.scripts.context().set_past(Past::default());
        let mut tried_branches = BTreeMap::new();
        let mut used: BTreeMap<String, u32> = BTreeMap::new();
        let mut best = match self.rehearse(&candidates, on) {
            Err(none @ Error::NoSurvivor { .. }) => self.rehearse_others(&candidates, none, on)?,
            found => found?,
        };
        let mut again = 0;
        loop {
            self.audience.phase("execute", wording::arm_moves(self.setup.robot_name == "twin"));
            let failed = self.perform(on, &best);
            let Some(Failed { index, reason, plan_again }) = failed? else {
                on.run.outcome = Ending::Success;
                return Ok(());
            };
            // Whoever is told of steps has been told why.
            self.audience.detail(&wording::step_failed(&reason));
            let pg = &best.candidate.pg;
            if plan_again && again < AGAIN {
                again += 1;
                self.audience.note(wording::planning_again());
                match self.rehearse(&self.of_variants(pg, index), on) {
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
                on.run.reason = Some(reason);
                return Ok(());
            };
            let plan = self.recovery_now(on.graph, pg, recovery)?;
            *used.entry(plan.path.clone()).or_default() += 1;
            self.audience.note(&wording::recovering(&plan.path));
            if let Err(error) = self.carry_out(&plan.steps, on) {
                on.run.reason = Some(wording::recovery_failed(&reason, &error));
                return if ends_the_run(&error) { Err(error) } else { Ok(()) };
            }
            match plan.remedy {
                Some(Remedy::Retry { other, .. }) => {
                    let from = if other {
                        self.other_branch(on.graph, pg, index, &mut tried_branches)?
                    } else {
                        None
                    };
                    let (pg, from) = from.unwrap_or_else(|| (pg.clone(), first_of(pg, index)));
                    best = self.rehearse(&self.of_variants(&pg, from), on)?;
                }
                Some(Remedy::Abort(why)) => {
                    on.run.reason = Some(match why {
                        Some(why) => format!("{reason}; {why}"),
                        None => reason,
                    });
                    return Ok(());
                }
                None => {
                    on.run.reason = Some(reason);
                    return Ok(());
                }
            }
        }
    }

    /// Returns the candidates of a first attempt: the likeliest parse graphs, each with its best ways and
    /// with others.
    pub(super) fn candidates_from(
        &mut self,
        graph: &Graph,
        start: &WorldState,
    ) -> Result<Vec<Candidate>, Error> {
        let n = self.setup.candidates;
        let pgs = self.parses(graph, start, n.div_ceil(2))?;
        Ok((0..n)
            .map(|i| Candidate { pg: pgs[i % pgs.len()].clone(), from: 0, variant: i / pgs.len() })
            .collect())
    }

    /// Rehearses, where none of the likeliest parse graphs succeeds, as many less likely ones.
    fn rehearse_others(
        &mut self,
        tried: &[Candidate],
        none: Error,
        on: &mut UnderWay<'_>,
    ) -> Result<Rehearsal, Error> {
        let mut others = self.parses(on.graph, on.start, tried.len())?;
        others.retain(|pg| tried.iter().all(|candidate| candidate.pg != *pg));
        let others: Vec<Candidate> =
            others.into_iter().map(|pg| Candidate { pg, from: 0, variant: 0 }).collect();
        if others.is_empty() {
            return Err(none);
        }
        self.audience.note(wording::other_plans());
        self.rehearse(&others, on).map_err(|error| none.or_farther(error))
    }

    /// The rest of a parse graph from a step on, with every set of choices.
    pub(super) fn of_variants(&self, pg: &ParseGraph, from: usize) -> Vec<Candidate> {
        let all = 0..self.setup.candidates;
        all.map(|variant| Candidate { pg: pg.clone(), from, variant }).collect()
    }

    /// Rehearses candidates from the present and returns the best survivor.
    fn rehearse(
        &mut self,
        candidates: &[Candidate],
        on: &mut UnderWay<'_>,
    ) -> Result<Rehearsal, Error> {
        let begin = self.now();
        let n = candidates.len();
        let rehearsing = wording::rehearsing(n, &self.model.known.names());
        self.audience.phase("simulate", &rehearsing);
        for (name, why) in &self.model.known.aside {
            self.audience.note(&wording::effect_left_out(name, why));
        }
        let state = self.state()?;
        let q = self.scripts.context().planned_q()?.to_vec();
        let memory = self.scripts.context().memory().clone();
        let past = self.scripts.context().past().clone();
        let shown = self.audience.sees_rehearsals.then(|| Shown {
            album: on.album.jobs(),
            camera: self.camera().resized(WIDTH_OF_REHEARSAL).0,
            number: 0,
            of: n,
            name: String::new(),
        });
        let finished = Mutex::new(0_usize);
        let tried = Rehearsals {
            cell: &self.model.cell,
            look: &self.model.look,
            settings: &self.model.settings,
            stdlib: &self.setup.stdlib,
            library: &self.setup.library,
            state: &state,
            start: on.start,
            q: &q,
            memory: &memory,
            past: &past,
            seed: self.setup.seed,
            cancel: &self.controls.cancel,
            shown,
            is_filmed: on.filming.is_some(),
        }
        .all(candidates, &|_| {
            let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
            *finished += 1;
            tell(
                &self.audience.fan,
                &Event::Progress {
                    what: "rehearsals".into(),
                    fraction: *finished as f64 / n as f64,
                },
            );
        })?;
        on.run.timing_s.simulate += self.now() - begin;
        on.run.rehearsals.extend(tried.iter().map(summary));
        for line in told(&tried) {
            self.audience.detail(&line);
        }
        if let Some(best) = tried.first() {
            let succeeded = tried.iter().filter(|rehearsal| rehearsal.worth.success).count();
            let branches = best.candidate.branches();
            let plans = (succeeded, tried.len());
            self.audience.note(&wording::plans(plans, &branches, &summary(best)));
        }
        let Some(best) = tried.into_iter().next() else {
            return Err(Error::NothingToDo);
        };
        match best.failure() {
            None => Ok(best),
            Some((index, failure)) => Err(Error::NoSurvivor {
                tried: n,
                reached: index,
                step: best.candidate.pg.steps[index].text.clone(),
                failure: Box::new(failure.clone()),
                water: self.water_in(best.steps.last(), failure),
            }),
        }
    }

    /// Returns where the twin's water was after a step that failed for an amount of it.
    fn water_in(&self, step: Option<&Done>, failure: &StepFailure) -> Option<InTwin> {
        let is_volume = |unmet: &Unmet| {
            unmet.margin.is_some_and(|margin| margin.dimension == Dimension::VOLUME)
        };
        let state = &step.filter(|_| failure.cause.unmet().is_some_and(is_volume))?.state;
        let vessels = state.objects.iter().filter(|object| self.is_vessel(&object.name));
        let vessels = vessels.filter_map(|object| Some((object.name.clone(), object.water?)));
        Some(InTwin { vessels: vessels.collect(), spilt: state.spilt? })
    }

    /// Carries out the steps of a recovery: rehearsed first, like everything that moves the arm.
    fn carry_out(&mut self, steps: &[graph::Step], on: &mut UnderWay<'_>) -> Result<(), Error> {
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
        let candidates: Vec<Candidate> =
            (0..2).map(|variant| Candidate { pg: pg.clone(), from: 0, variant }).collect();
        let best = self.rehearse(&candidates, on)?;
        self.perform(on, &best)?;
        Ok(())
    }
}

/// Whether nothing more is done in a run after an error, also in a recovery: a person said stop, a device failed, or nothing can be kept.
fn ends_the_run(error: &Error) -> bool {
    match error {
        Error::Action(error) => error.ends_the_walk(),
        error => matches!(error, Error::Unrecorded { .. }),
    }
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
            .map(|(index, failure)| format!("{}: {failure}", pg.steps[index].text)),
        brushed: rehearsal
            .brushed
            .as_ref()
            .map(|(index, brushed)| wording::brushed(&pg.steps[*index].text, brushed)),
    }
}

/// How each candidate went; those of one branch that went alike share a line.
fn told(tried: &[Rehearsal]) -> Vec<String> {
    let mut lines: Vec<(String, String, String)> = Vec::new();
    for rehearsal in tried {
        let tried = summary(rehearsal);
        let (branches, variant) = (rehearsal.candidate.branches(), format!(" #{}", tried.variant));
        let went = wording::went(&tried);
        match lines.last_mut() {
            Some((of, variants, before)) if *of == branches && *before == went => {
                variants.push_str(&variant);
            }
            _ => lines.push((branches, variant, went)),
        }
    }
    let lines = lines.iter();
    lines.map(|(branches, variants, went)| wording::twin_line(branches, variants, went)).collect()
}
