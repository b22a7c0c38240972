//! A vision-language model that answers the questions of fluents from pictures, and how well anybody
//! answers them.
//!
//! The model sits behind an endpoint that speaks `POST …/chat/completions` ([`Endpoint`]; llama.cpp's server,
//! Ollama, vLLM and hosted ones do). What it says is read strictly ([`reply`]): yes, no, unsure, or unparsed
//! with the reason, and unparsed is never taken for a yes or a no. Nothing here moves or commands anything;
//! [`score`] only counts.
//!
//! Source of the questions and of precision, recall and consistency: Zeng, Zhao and Wu, Table 3.

mod endpoint;
mod error;
mod picture;
mod probe;
mod request;
mod wording;
pub mod reply;
pub mod score;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use endpoint::{Endpoint, Patience, Settings};
pub use error::{Unanswered, Unread};
pub use picture::{Picture, Sent};
pub use probe::{Blank, Check, Probe};
pub use reply::Said;

/// Which world a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum On {
    /// The table, photographed.
    #[default]
    Real,
    /// The same moment drawn from the twin.
    Twin,
}

impl On {
    /// Returns `real` or `twin`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "real",
            Self::Twin => "twin",
        }
    }
}

/// What a model answered to one question about one picture, with everything that is needed to ask again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// Who: `vlm:NAME`.
    pub by: String,
    /// Which picture.
    pub on: On,
    /// What it comes to.
    pub answer: Said,
    /// Why it comes to nothing, when it is unparsed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// What the model says it saw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<String>,
    /// The reply as it came, up to 2,000 characters.
    pub raw: String,
    /// SHA-256 of the request's body.
    pub request_sha256: String,
    /// How long it took, all tries together, s.
    pub latency_s: f64,
    /// How often it was asked.
    pub tries: u32,
    /// `p(yes) / (p(yes) + p(no))` of the answer's token, where the server tells. Models are overconfident:
    /// it is reported and decides nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_yes: Option<f64>,
    /// The picture as it was sent.
    pub picture: Sent,
}

/// A line of the file `vqa.jsonl` in a run folder: a model asked about pictures that are kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Line {
    /// What the model showed it can do before it was asked.
    Probe(Probe),
    /// One answer.
    Answer {
        /// The number of the step after which the picture was taken.
        step: usize,
        /// The fluent: `above(jar, cup)`.
        fluent: String,
        /// The question as it was put.
        question: String,
        /// What came back.
        reply: Reply,
    },
}

/// The file of [`Line`]s in a run folder.
pub const FILE: &str = "vqa.jsonl";

/// Reads what models were asked about a run after it was over; what cannot be read is passed over.
///
/// # Errors
///
/// What the file system says.
pub fn read(run_dir: &Path) -> std::io::Result<Vec<Line>> {
    crate::lines::read(&run_dir.join(FILE)).map(|(lines, _)| lines)
}
