//! A model that answers the questions of a run beside geometry, looking at the pictures after each step.
//!
//! While it is waited for the arm holds still. Its answers are kept and scored; what the run does rests on
//! measurements alone.

use image::RgbImage;

use crate::execution::walk::Walker;
use crate::graph::Graph;
use crate::vqa::{Endpoint, On, Picture, Reply, Said};
use crate::world::fluent::score;

use super::{Error, Run, WorkCell};

impl WorkCell {
    /// Lets a model answer the questions of the runs to come.
    pub fn answered_by(&mut self, model: Endpoint) {
        self.model = Some(model);
    }

    /// Finds out what the model can do, before anything moves; without a model does nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Model`] when nobody answers at its address.
    pub(super) fn probe_model(&mut self, graph: &Graph, run: &mut Run) -> Result<(), Error> {
        let Some(model) = self.model.clone() else { return Ok(()) };
        self.phase("ask", &format!("probing {} at {}", model.model(), model.base()));
        if !model.base().is_loopback() {
            let host = model.base().host();
            self.note(&format!("the pictures of this run leave this machine: they go to {host}"));
        }
        let questions = self.questions(graph)?;
        let cancel = self.cancel.clone();
        let probed = model.probe(&questions, &|| cancel.is_cancelled());
        let probe = probed.map_err(|trouble| Error::Model {
            endpoint: model.base().to_string(),
            why: trouble.to_string(),
        })?;
        if !probe.sees {
            self.note("the model cannot tell red from blue: it does not see the pictures");
        }
        if !probe.keeps_form {
            self.note(
                "the server does not enforce the form of a reply; what cannot be read is unparsed",
            );
        }
        run.probe = Some(probe);
        Ok(())
    }

    /// Returns the questions that the likeliest way of carrying out a call puts.
    fn questions(&self, graph: &Graph) -> Result<Vec<String>, Error> {
        let start = self.state()?;
        let scene = self.cell.scene.clone();
        let walker = Walker::new(&self.scripts, &self.stdlib, &self.library, &scene, &start);
        let fluents = self.parses(graph, &start, 1)?.into_iter().flat_map(|pg| pg.fluents());
        let mut questions: Vec<String> = Vec::new();
        for question in fluents.filter_map(|fluent| walker.question(&fluent)) {
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
        real: Option<&RgbImage>,
        twin: Option<&RgbImage>,
    ) -> bool {
        let Some(model) = self.model.clone() else { return false };
        let Some(answers) = run.questions.last_mut().filter(|asked| !asked.is_empty()) else {
            return false;
        };
        let shown = [(On::Real, real), (On::Twin, twin)].into_iter();
        let pictures: Vec<(On, Picture)> =
            shown.filter_map(|(on, image)| Some((on, Picture::photo(image?)))).collect();
        let questions: Vec<&str> = answers.iter().map(|answer| answer.question.as_str()).collect();
        self.phase("ask", &format!("{} looks, the arm holds still", model.model()));
        let cancel = self.cancel.clone();
        let replies = model.ask_all(&questions, &pictures, &|| cancel.is_cancelled());
        let told = summary(&replies);
        for (which, reply) in replies {
            answers[which].by.push(reply);
        }
        let settled = |on: On| -> Vec<Option<bool>> {
            answers.iter().map(|answer| answer.settled(on).map(|(truth, _)| truth)).collect()
        };
        let score = score(&settled(On::Twin), &settled(On::Real));
        self.note(&format!(
            "{told}; with its answers twin and photograph differ in {} of {}: P = {:.2}",
            score.hamming, score.known, score.p
        ));
        true
    }
}

/// Words what came back: how many answers, how many that cannot be read, how long it took.
fn summary(replies: &[(usize, Reply)]) -> String {
    let unparsed = replies.iter().filter(|(_, reply)| reply.answer == Said::Unparsed);
    let (unparsed, first) = (unparsed.clone().count(), unparsed.clone().next());
    let seconds: f64 = replies.iter().map(|(_, reply)| reply.latency_s).sum();
    let why = first.and_then(|(_, reply)| reply.why.as_deref());
    let why = why.map(|why| format!(" ({why}), geometry's stand")).unwrap_or_default();
    format!("the model: {} answers in {seconds:.1} s, {unparsed} unparsed{why}", replies.len())
}
