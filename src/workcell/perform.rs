//! A rehearsal, carried out on the arm: step by step, compared and recorded after each.

use crate::execution::tape::Tape;
use crate::execution::trace::{Event, Outcome, StepRecord};
use crate::execution::walk::{Done, Walker};
use crate::graph::{Graph, ParseGraph};
use crate::monitor::questionnaire;
use crate::monitor::{self, Comparison};
use crate::world::WorldState;

use super::lead::Turn;
use super::rehearse::Rehearsal;
use super::run::{SharedRecorder, keep};
use super::{Error, Run, WorkCell, picture};

/// A step that failed.
pub(super) struct Failed {
    /// Which step of the parse graph.
    pub(super) index: usize,
    /// What, and why.
    pub(super) reason: String,
    /// Whether planning the rest again from where the arm is may help.
    pub(super) plan_again: bool,
}

impl WorkCell {
    /// Performs a rehearsal on the arm; returns the step that failed and why, if one did. The time a person
    /// thought is not the arm's.
    pub(super) fn perform(
        &mut self,
        graph: &Graph,
        rehearsal: &Rehearsal,
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<Option<Failed>, Error> {
        let (begin, waited) = (self.now(), self.waited());
        let failed = self.steps_of(graph, rehearsal, start, run, recorder);
        let waited = self.waited() - waited;
        run.timing_s.waiting += waited;
        run.timing_s.execute += self.now() - begin - waited;
        failed
    }

    fn steps_of(
        &mut self,
        graph: &Graph,
        rehearsal: &Rehearsal,
        start: &WorldState,
        run: &mut Run,
        recorder: Option<&SharedRecorder>,
    ) -> Result<Option<Failed>, Error> {
        let pg = &rehearsal.candidate.pg;
        run.parse_graphs.push(pg.clone());
        self.scripts.stage().set_tape(rehearsal.tape.rewound());
        let scene = self.cell.scene.clone();
        let watched = pg.fluents();
        let mut failed = None;
        for (k, index) in (rehearsal.candidate.from..pg.steps.len()).enumerate() {
            let number = run.steps.len() + 1;
            let turn = Turn { graph, pg, index, number, follows: k > 0, start };
            // Whoever is asked sees what there is before the step.
            self.photo_for_run(&format!("{number:02}-before-real"))?;
            let before = if k == 0 { &rehearsal.start } else { &rehearsal.views[k - 1] };
            self.twin_picture(&format!("{number:02}-before-twin"), before);
            let ahead = self.ask_before(&turn)?;
            self.open_gate(ahead.as_ref(), &pg.steps[index]);
            self.tell(&Event::StepStart {
                number,
                of: run.steps.len() + pg.steps.len() - index,
                action: pg.steps[index].text.clone(),
                path: pg.steps[index].path.clone(),
            });
            let begin = self.state()?.time;
            let (done, cut_short) = {
                let mut walker =
                    Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, start);
                match walker.step(pg, index, &watched) {
                    Ok(done) => (done, None),
                    // The step is recorded as far as it came.
                    Err(error) => {
                        (walker.interrupted(pg, index, begin, &watched, &error)?, Some(error))
                    }
                }
            };
            self.scripts.stage().set_gate(None);
            let twin = rehearsal.steps.get(k);
            let comparison = monitor::compare(twin.map_or(&[], |t| &t.fluents), &done.fluents);
            if done.outcome != Outcome::Success {
                let reason = done.reason.clone().unwrap_or_default();
                let step = &pg.steps[index];
                failed = Some(Failed {
                    index,
                    reason: format!("{}: {reason}", step.text),
                    // What goes on beside other things cannot be taken up in its middle.
                    plan_again: done.plan_again && step.together.is_none(),
                });
            }
            run.questions.push(questionnaire::by_geometry(&comparison.rows));
            let planned_q = self.scripts.stage().planned_q().to_vec();
            let record = StepRecord { planned_q, ..record(pg, number, done, comparison, twin) };
            self.tell(&Event::StepEnd { record: Box::new(record.clone()) });
            let (memory, past) = {
                let mut stage = self.scripts.stage();
                (stage.memory().clone(), stage.past().clone())
            };
            self.moments.keep(number, memory, past);
            run.steps.push(record);
            keep(run, recorder)?;
            let real = self.photo_for_run(&picture::after(number, "real"))?;
            let twin = rehearsal
                .views
                .get(k)
                .map(|view| self.twin_picture(&picture::after(number, "twin"), view));
            if cut_short.is_none() && self.ask_model(run, real.as_ref(), twin.as_ref()) {
                keep(run, recorder)?;
            }
            let asked = self.ask_after(&turn, ahead, run.steps.last());
            if let Some(error) = cut_short {
                return Err(error.into());
            }
            asked?;
            if failed.is_some() {
                break;
            }
        }
        self.scripts.stage().set_tape(Tape::recording());
        Ok(failed)
    }
}

fn record(
    pg: &ParseGraph,
    number: usize,
    done: Done,
    comparison: Comparison,
    twin: Option<&Done>,
) -> StepRecord {
    let step = &pg.steps[done.index];
    let during = monitor::during(twin.map_or(&[], |twin| &twin.held), &done.held);
    StepRecord {
        number,
        path: step.path.clone(),
        action: step.text.clone(),
        outcome: done.outcome,
        reason: done.reason,
        interval_s: done.interval,
        fluents: comparison.rows,
        during,
        lines: done.lines,
        planned_q: Vec::new(),
        hamming: comparison.score.hamming,
        score: comparison.score.p,
        measured: done.state,
        twin: twin.map(|twin| twin.state.clone()),
    }
}
