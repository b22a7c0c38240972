//! The paper's four questions, answered by geometry after each step.
//!
//! A question is the `ask` text of a fluent; whoever has the fluent has the answer, with a margin. People
//! and models answer the same questions elsewhere and are compared with these.

use serde::{Deserialize, Serialize};

use crate::trace::FluentRow;
use crate::vqa::{On, Reply};

/// One question after one step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The question as a person reads it.
    pub question: String,
    /// The fluent it asks about.
    pub fluent: String,
    /// Geometry's answer in the twin; `None` cannot be told.
    pub twin: Option<bool>,
    /// Geometry's answer from measurements; `None` cannot be told.
    pub measured: Option<bool>,
    /// What models answered, looking at the pictures after the step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by: Vec<Reply>,
}

impl Answer {
    /// Returns the answer on one picture and who gave it: a model that said yes or no, else geometry, else
    /// nobody, and a person would have to be asked.
    pub fn settled(&self, on: On) -> Option<(bool, &str)> {
        let mut said = self.by.iter().filter(|reply| reply.on == on);
        let model = said.find_map(|reply| Some((reply.answer.truth()?, reply.by.as_str())));
        let geometry = match on {
            On::Real => self.measured,
            On::Twin => self.twin,
        };
        model.or(geometry.map(|truth| (truth, "geometry")))
    }
}

/// Returns the questions of a step's fluents with geometry's answers.
pub fn by_geometry(rows: &[FluentRow]) -> Vec<Answer> {
    rows.iter()
        .filter_map(|row| {
            Some(Answer {
                question: row.ask.clone()?,
                fluent: row.name.clone(),
                twin: row.twin,
                measured: row.measured,
                by: Vec::new(),
            })
        })
        .collect()
}
