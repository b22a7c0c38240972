//! What a model shows it can do before it is believed: whether it looks at the picture, whether the form of
//! its replies is enforced, and what it says of a picture that shows nothing.

use image::{Rgb, RgbImage};
use serde::{Deserialize, Serialize};

use crate::http::Trouble;

use super::endpoint::Endpoint;
use super::wording::{ESSAY, RED};
use super::{On, Picture, Said};

/// Width and height of a made picture, px.
const SIZE: (u32, u32) = (256, 144);

/// What came of probing a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// Where it is.
    pub endpoint: String,
    /// Its name.
    pub model: String,
    /// The models that are served, as far as the server tells.
    pub models: Vec<String>,
    /// Whether it told red from blue, on a picture and on its mirror.
    pub sees: bool,
    /// Whether the form of the reply survived being asked for an essay.
    pub keeps_form: bool,
    /// What was asked to find that out.
    pub checks: Vec<Check>,
    /// What it says of an even grey: who says yes or no there is not looking.
    pub blank: Vec<Blank>,
}

/// One question of a probe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The question.
    pub question: String,
    /// The right answer, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Said>,
    /// The answer.
    pub answer: Said,
    /// Why it is unparsed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// How long it took, s.
    pub latency_s: f64,
}

/// What is said of an even grey.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blank {
    /// The question.
    pub question: String,
    /// The answer.
    pub answer: Said,
}

impl Endpoint {
    /// Probes the model, with the questions it is going to be asked.
    ///
    /// # Errors
    ///
    /// When nobody answers at the address. A server that does not list its models is none the worse.
    pub fn probe(
        &self,
        questions: &[String],
        stopped: &dyn Fn() -> bool,
    ) -> Result<Probe, Trouble> {
        let models = match self.models() {
            Ok(models) => models,
            Err(Trouble::Broken(_)) => Vec::new(),
            Err(trouble) => return Err(trouble),
        };
        let red_left = halves([200, 30, 30], [30, 60, 200]);
        let blue_left = halves([30, 60, 200], [200, 30, 30]);
        let mut checks = Vec::new();
        let mut keeps_form = false;
        for (question, picture, expected) in [
            (RED, &red_left, Some(Said::Yes)),
            (RED, &blue_left, Some(Said::No)),
            (ESSAY, &red_left, None),
        ] {
            let picture = Picture::exact(picture);
            let (reply, in_form) = self.ask_closely(question, On::Real, &picture, stopped);
            keeps_form = in_form;
            checks.push(Check {
                question: question.to_owned(),
                expected,
                answer: reply.answer,
                why: reply.why,
                latency_s: reply.latency_s,
            });
        }
        let grey = Picture::exact(&RgbImage::from_pixel(SIZE.0, SIZE.1, Rgb([128; 3])));
        let blank = questions.iter().map(|question| Blank {
            question: question.clone(),
            answer: self.ask(question, On::Real, &grey, stopped).answer,
        });
        let blank = blank.collect();
        Ok(Probe {
            endpoint: self.base().to_string(),
            model: self.model().to_owned(),
            models,
            sees: checks.iter().all(|c| c.expected.is_none_or(|expected| c.answer == expected)),
            keeps_form,
            checks,
            blank,
        })
    }
}

fn halves(left: [u8; 3], right: [u8; 3]) -> RgbImage {
    RgbImage::from_fn(SIZE.0, SIZE.1, |u, _| Rgb(if u < SIZE.0 / 2 { left } else { right }))
}
