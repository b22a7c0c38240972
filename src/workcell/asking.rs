//! A model that answers the questions of a run beside geometry, looking at the pictures after each step.
//!
//! While it is waited for the arm holds still. Its answers are kept and scored; what the run does rests on
//! measurements alone.

use crate::execution::reader::question;
use crate::fluent::score;
use crate::graph::Graph;
use crate::vqa::{Endpoint, On, Picture};

use super::album::Pending;
use super::{Error, Run, WorkCell, wording};

impl WorkCell {
    /// Lets a model answer the questions of the runs to come.
    pub fn answered_by(&mut self, model: Endpoint) {
        self.audience.answerer = Some(model);
    }

    /// Finds out what the model can do, before anything moves; without a model does nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Model`] when nobody answers at its address.
    pub(super) fn probe_model(&mut self, graph: &Graph, run: &mut Run) -> Result<(), Error> {
        let Some(model) = self.audience.answerer.clone() else { return Ok(()) };
        self.audience.phase("ask", &wording::probing(&model));
        if !model.base().is_loopback() {
            self.audience.note(&wording::pictures_leave(&model.base().host()));
        }
        let questions = self.questions(graph)?;
        let cancel = self.controls.cancel.clone();
        let probed = model.probe(&questions, &|| cancel.is_cancelled());
        let probe = probed
            .map_err(|trouble| Error::Model { endpoint: model.base().to_string(), why: trouble })?;
        if !probe.sees {
            self.audience.note(wording::model_is_blind());
        }
        if !probe.keeps_form {
            self.audience.note(wording::form_is_free());
        }
        run.probe = Some(probe);
        Ok(())
    }

    /// Returns the questions that the likeliest way of carrying out a call puts.
    fn questions(&mut self, graph: &Graph) -> Result<Vec<String>, Error> {
        let start = self.state()?;
        let scene = self.model.cell.scene.clone();
        let fluents = self.parses(graph, &start, 1)?.into_iter().flat_map(|pg| pg.fluents());
        let asked = |fluent| question(&fluent, &self.setup.library, &scene);
        let mut questions: Vec<String> = Vec::new();
        for question in fluents.filter_map(asked) {
            if !questions.contains(&question) {
                questions.push(question);
            }
        }
        Ok(questions)
    }

    /// Puts the questions of the last step to the model; returns whether anything was asked.
    pub(super) fn ask_model(
        &mut self,
        run: &mut Run,
        real: Option<Pending>,
        twin: Option<Pending>,
    ) -> bool {
        let Some(model) = self.audience.answerer.clone() else { return false };
        let Some(answers) = run.questions.last_mut().filter(|asked| !asked.is_empty()) else {
            return false;
        };
        let shown = [(On::Real, real), (On::Twin, twin)].into_iter();
        let pictures: Vec<(On, Picture)> =
            shown.filter_map(|(on, image)| Some((on, Picture::photo(&image?.wait()?)))).collect();
        let questions: Vec<&str> = answers.iter().map(|answer| answer.question.as_str()).collect();
        self.audience.phase("ask", &wording::model_looks(&model));
        let cancel = self.controls.cancel.clone();
        let replies = model.ask_all(&questions, &pictures, &|| cancel.is_cancelled());
        let told = wording::replies(&replies);
        for (which, reply) in replies {
            answers[which].by.push(reply);
        }
        let settled = |on: On| -> Vec<Option<bool>> {
            answers.iter().map(|answer| answer.settled(on).map(|(truth, _)| truth)).collect()
        };
        let score = score(&settled(On::Twin), &settled(On::Real));
        self.audience.note(&wording::model_answered(&told, &score));
        true
    }
}
