//! A rehearsal, carried out on the arm: step by step, compared and recorded after each.

use crate::execution::decisions::DecisionLog;
use crate::execution::done::Done;
use crate::execution::uses;
use crate::execution::walk::{Texts as _, Walker};
use crate::graph::{Does, ParseGraph};
use crate::language::text;
use crate::monitor::questionnaire;
use crate::monitor::{self, Comparison};
use crate::trace::{Call, Event, Outcome, StepRecord};

use super::album::Pending;
use super::lead::Turn;
use super::rehearse::Rehearsal;
use super::run::UnderWay;
use super::{Error, WorkCell, picture};

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
        on: &mut UnderWay<'_>,
        rehearsal: &Rehearsal,
    ) -> Result<Option<Failed>, Error> {
        let (begin, waited) = (self.now(), self.waited());
        let failed = self.steps_of(on, rehearsal);
        let waited = self.waited() - waited;
        on.run.timing_s.waiting += waited;
        on.run.timing_s.execute += self.now() - begin - waited;
        failed
    }

    fn steps_of(
        &mut self,
        on: &mut UnderWay<'_>,
        rehearsal: &Rehearsal,
    ) -> Result<Option<Failed>, Error> {
        let pg = &rehearsal.candidate.pg;
        on.run.parse_graphs.push(pg.clone());
        let aims = on.run.aims.get_or_insert_default();
        for script in
            pg.steps.iter().filter_map(|step| self.setup.stdlib.script(step.script.as_ref()?))
        {
            aims.holds |= uses::takes(script);
            aims.pours |= uses::pours(script);
        }
        self.scripts.context().set_log(rehearsal.log.rewound());
        let scene = self.model.cell.scene.clone();
        let watched = pg.fluents();
        let mut failed = None;
        for (k, index) in (rehearsal.candidate.from..pg.steps.len()).enumerate() {
            let number = on.run.steps.len() + 1;
            let turn = Turn { graph: on.graph, pg, index, number, follows: k > 0, start: on.start };
            self.show_before(on, rehearsal, k, number)?;
            let ahead = self.ask_before(&turn)?;
            self.open_gate(ahead.as_ref(), &pg.steps[index]);
            let begin = self.state()?.time;
            self.audience.tell(&Event::StepStart {
                number,
                of: on.run.steps.len() + pg.steps.len() - index,
                action: pg.steps[index].text.clone(),
                path: pg.steps[index].path.clone(),
            });
            if let Some(filming) = &on.filming {
                let glimpses = rehearsal.glimpses.get(k).map_or(&[][..], Vec::as_slice);
                filming.begin(number, begin, &self.camera(), glimpses);
            }
            let (done, cut_short) = {
                let mut walker = Walker::new(
                    &mut self.scripts,
                    &self.setup.stdlib,
                    &self.setup.library,
                    &scene,
                    on.start,
                );
                match walker.step(pg, index, &watched) {
                    Ok(done) => (done, None),
                    // The step is recorded as far as it came; what cut it short is told, whatever is said after it.
                    Err(error) => {
                        let done = walker.interrupted(pg, index, begin, &watched, &error);
                        (done.map_err(|_| error.clone())?, Some(error))
                    }
                }
            };
            if let Some(filming) = &on.filming {
                filming.end();
            }
            self.scripts.context().set_gate(None);
            let twin = rehearsal.steps.get(k);
            let comparison = monitor::compare(twin.map_or(&[], |t| &t.fluents), &done.fluents);
            if done.outcome != Outcome::Success {
                let step = &pg.steps[index];
                let why = done.failure.as_ref().map(ToString::to_string).unwrap_or_default();
                failed = Some(Failed {
                    index,
                    reason: format!("{}: {why}", step.text),
                    // What goes on beside other things cannot be taken up in its middle.
                    plan_again: done.plan_again && step.together.is_none(),
                });
            }
            on.run.questions.push(questionnaire::by_geometry(&comparison.rows));
            // An arm that was stopped and does not answer is where it was measured last.
            let planned_q = self.scripts.context().planned_q().map(<[f64]>::to_vec);
            let planned_q = planned_q.unwrap_or_default();
            let record = StepRecord { planned_q, ..record(pg, number, done, comparison, twin) };
            self.audience.tell(&Event::StepEnd { record: Box::new(record.clone()) });
            let (memory, past) = {
                let mut context = self.scripts.context();
                (context.memory().clone(), context.past().clone())
            };
            self.experience.moments.keep(number, memory, past);
            on.run.steps.push(record);
            on.keep()?;
            let shown = self.show_after(on, rehearsal, (k, number), begin);
            if cut_short.is_none() {
                let [real, twin] = shown?;
                if self.ask_model(on.run, real, twin) {
                    on.keep()?;
                }
            }
            let asked = self.ask_after(&turn, ahead, on.run.steps.last());
            if let Some(error) = cut_short {
                return Err(error.into());
            }
            asked?;
            if failed.is_some() {
                break;
            }
        }
        self.scripts.context().set_log(DecisionLog::recording());
        Ok(failed)
    }

    /// Takes the pictures before step `number`, which is number `k` of a rehearsal. What nobody can have touched
    /// since the step before looks as it did after it; whoever leads the run has the pictures before being asked.
    fn show_before(
        &mut self,
        on: &UnderWay<'_>,
        rehearsal: &Rehearsal,
        k: usize,
        number: usize,
    ) -> Result<(), Error> {
        let is_led = self.audience.lead.is_some();
        if k > 0 && !is_led {
            for whose in ["real", "twin"] {
                on.album.again(picture::before(number, whose), picture::after(number - 1, whose));
            }
            return Ok(());
        }
        let view = if k == 0 { &rehearsal.start } else { &rehearsal.views[k - 1] };
        let real = self.shoot()?.map(|shot| on.album.add(picture::before(number, "real"), shot));
        let twin = on.album.add(picture::before(number, "twin"), self.shoot_twin(view));
        if is_led {
            real.map(Pending::wait);
            twin.wait();
        }
        Ok(())
    }

    /// Takes the pictures after step `number`, which is number `k` of a rehearsal, began at `begin`, s, and was recorded; of
    /// camera and twin. After a step in which no time passed all looks as before it, and is drawn again only where a model is
    /// to see it.
    fn show_after(
        &mut self,
        on: &UnderWay<'_>,
        rehearsal: &Rehearsal,
        (k, number): (usize, usize),
        begin: f64,
    ) -> Result<[Option<Pending>; 2], Error> {
        let name = |whose| picture::after(number, whose);
        let same = |whose| on.album.same(name(whose), picture::before(number, whose));
        let may_share = self.audience.answerer.is_none();
        // When the pictures before the step were taken.
        let since = match &on.run.steps[..] {
            [.., last, _] if k > 0 && self.audience.lead.is_none() => last.interval_s[1],
            _ => begin,
        };
        let ended = on.run.steps.last().map(|now| now.interval_s[1]);
        let is_still = may_share && ended.is_some_and(|ended| ended <= since);
        // The shutter opens all the same: the noise of a picture is that of its number.
        let real = match self.shoot()? {
            Some(_) if is_still => {
                same("real");
                None
            }
            shot => shot.map(|shot| on.album.add(name("real"), shot)),
        };
        let views = &rehearsal.views;
        let before = match k.checked_sub(1) {
            Some(last) => views.get(last),
            None => Some(&rehearsal.start),
        };
        let twin = match views.get(k) {
            Some(view) if may_share && before == Some(view) => {
                same("twin");
                None
            }
            view => view.map(|view| on.album.add(name("twin"), self.shoot_twin(view))),
        };
        Ok([real, twin])
    }
}

/// Returns the action that a step calls, if it calls one.
fn call(does: &Does) -> Option<Call> {
    let Does::Action { name, args } = does else { return None };
    let args = args.iter().map(|arg| (arg.name.clone(), text::expr(&arg.value)));
    Some(Call { name: name.clone(), args: args.collect() })
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
        call: call(&step.does),
        outcome: done.outcome,
        not_needed: done.not_needed,
        reason: done.failure.as_ref().map(ToString::to_string),
        failure: done.failure,
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
