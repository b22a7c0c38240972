//! Lets a conductor decide between the steps of a performance and before the lines of their scripts, where the
//! arm may be left standing.

use std::path::Path;
use std::sync::{Arc, Mutex};

use crate::execution::conduct::{Ahead, Conductor, Word, unsafe_hold};
use crate::execution::error::ActionError;
use crate::execution::lines::Gate;
use crate::execution::reader::Reader;
use crate::execution::wording::inside_together;
use crate::graph::{Graph, ParseGraph, Step};
use crate::monitor;
use crate::trace::Line;
use crate::trace::StepRecord;
use crate::world::WorldState;

use super::leader::{Lead, SharedLead, lock};
use super::{Error, WorkCell, wording};

/// A step that is about to be carried out.
pub(super) struct Turn<'a> {
    /// The graph it is from.
    pub(super) graph: &'a Graph,
    /// The choices it is from.
    pub(super) pg: &'a ParseGraph,
    /// Which step of these.
    pub(super) index: usize,
    /// Its place in the run, from 1.
    pub(super) number: usize,
    /// Whether the step before it in `pg` was carried out just now.
    pub(super) follows: bool,
    /// The world when the run began.
    pub(super) start: &'a WorldState,
}

impl WorkCell {
    /// Lets someone decide between the steps of the next run.
    pub fn led_by(&mut self, conductor: Box<dyn Conductor>) {
        self.audience.lead = Some(Lead::new(conductor, self.setup.clock));
    }

    /// Lets the next run go on by itself.
    pub fn led_by_nobody(&mut self) {
        self.audience.lead = None;
    }

    /// Returns whether whoever leads the next run tells of its steps.
    pub fn is_told(&self) -> bool {
        self.audience.lead.as_ref().is_some_and(|lead| lock(lead).conductor.tells())
    }

    /// Tells whoever leads that a run begins.
    pub(super) fn lead_begins(&mut self, task: &str, run_dir: Option<&str>) {
        // A run that ended in a panic may have left its own.
        self.scripts.context().set_gate(None);
        if let Some(lead) = &self.audience.lead {
            lock(lead).conductor.begins(task, run_dir.map(Path::new));
        }
    }

    /// Asks before a step, where the arm may be left standing; `None` when nobody leads the run.
    ///
    /// # Errors
    ///
    /// [`ActionError::Stopped`] when the run is to end here.
    pub(super) fn ask_before(&mut self, turn: &Turn<'_>) -> Result<Option<Ahead>, Error> {
        let step = &turn.pg.steps[turn.index];
        let Some(lead) = self.audience.lead.clone() else {
            if step.pause.is_some() {
                self.audience.note(&wording::break_passed(turn.number, &step.text));
            }
            return Ok(None);
        };
        // Whoever stopped it is asked nothing any more.
        self.heed(Word::Go)?;
        let (ahead, why) = self.ahead(turn)?;
        let word = match why {
            Some(why) => {
                lock(&lead).conductor.passing(&ahead, &why);
                Word::Go
            }
            None => self.waiting(&lead, |lead| match lead.catch_up() {
                Word::Go => lead.conductor.before(&ahead),
                Word::Stop => Word::Stop,
            })?,
        };
        self.heed(word).map(|()| Some(ahead))
    }

    /// Asks after a step, now or at the next place where the arm may be left standing.
    ///
    /// # Errors
    ///
    /// [`ActionError::Stopped`] when the run is to end here.
    pub(super) fn ask_after(
        &mut self,
        turn: &Turn<'_>,
        ahead: Option<Ahead>,
        record: Option<&StepRecord>,
    ) -> Result<(), Error> {
        let (Some(ahead), Some(record)) = (ahead, record) else { return Ok(()) };
        let Some(lead) = self.audience.lead.clone() else { return Ok(()) };
        lock(&lead).pending.push((ahead, record.clone()));
        let steps = &turn.pg.steps;
        let (done, next) = (&steps[turn.index], steps.get(turn.index + 1));
        let why = unsafe_hold(Some(done), next, &record.measured, &self.model.cell.scene);
        let word = match why {
            None => self.waiting(&lead, Lead::catch_up)?,
            Some(_) => Word::Go,
        };
        self.heed(word)
    }

    /// Lets whoever leads hold the arm before the lines of a step's script, where it can be left standing.
    pub(super) fn open_gate(&mut self, ahead: Option<&Ahead>, step: &Step) {
        let gate = ahead.zip(self.audience.lead.clone()).map(|(ahead, lead)| {
            let (ahead, scene) = (ahead.clone(), self.model.cell.scene.clone());
            let is_together = step.together.is_some();
            let gate: Gate = Arc::new(Mutex::new(move |line: &Line, state: &WorldState| {
                let why = if is_together {
                    Some(inside_together())
                } else {
                    unsafe_hold(None, None, state, &scene)
                };
                lock(&lead).asking(|lead| lead.conductor.within(&ahead, line, why.as_deref()))
            }));
            gate
        });
        self.scripts.context().set_gate(gate);
    }

    /// Ends the lead: whatever was not asked yet is asked now, the run being over. Returns how long it was
    /// waited for in all, s.
    pub(super) fn lead_ends(&mut self) -> f64 {
        let Some(lead) = self.audience.lead.take() else { return 0.0 };
        let mut lead = lock(&lead);
        lead.asking(Lead::catch_up);
        lead.waited
    }

    /// Returns how long whoever leads has been waited for so far, s.
    pub(super) fn waited(&self) -> f64 {
        self.audience.lead.as_ref().map_or(0.0, |lead| lock(lead).waited)
    }

    /// Asks something, while arm time stands still.
    fn waiting(
        &mut self,
        lead: &SharedLead,
        ask: impl FnOnce(&mut Lead) -> Word,
    ) -> Result<Word, Error> {
        Ok(self.scripts.waiting(|| lock(lead).asking(ask))?)
    }

    fn heed(&self, word: Word) -> Result<(), Error> {
        if word == Word::Stop || self.controls.cancel.is_cancelled() {
            return Err(ActionError::Stopped.into());
        }
        Ok(())
    }

    /// Describes a step with what its conditions are worth now, and says why the arm cannot be left
    /// standing before it, if so.
    fn ahead(&mut self, turn: &Turn<'_>) -> Result<(Ahead, Option<String>), Error> {
        let Turn { graph, pg, index, number, start, .. } = *turn;
        let state = self.state()?;
        let scene = self.model.cell.scene.clone();
        let reader = Reader::new(&mut self.scripts, &self.setup.library, &scene, start);
        let judge = |condition: &crate::graph::Condition| {
            let reading = reader.read(&condition.expr, &state);
            (reading.truth, reading.margin.map(monitor::measure))
        };
        let label = |path: &str| {
            let node = graph.find(path)?;
            Some(node.label.clone())
        };
        let mut ahead = Ahead::of(pg, index, number, &judge, &label);
        let step = &pg.steps[index];
        let written = self.setup.library.callable(&step.within);
        ahead.place = written.map(|(_, source)| source.place(step.span));
        if let (Some(mark), Some(when)) =
            (&mut ahead.mark, step.pause.as_ref().and_then(|pause| pause.when.as_ref()))
        {
            mark.holds = reader.read(when, &state).truth != Some(false);
        }
        let before = turn.follows.then(|| &pg.steps[index - 1]);
        let why = unsafe_hold(before, Some(step), &state, &scene);
        Ok((ahead, why))
    }
}
