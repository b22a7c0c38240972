//! A model at a web address: asked one question at a time, never for longer than somebody holding an arm
//! still is willing to wait.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use crate::http::{Address, Answer, Broken, Client, Limits, Trouble};
use crate::lines;

use super::reply::{self, Verdict};
use super::{On, Picture, Reply, Unanswered, request};

/// The longest reply that is read, bytes.
const LONGEST: u64 = 4 << 20;
/// What may be over a moment later.
const PASSING: [u16; 5] = [429, 500, 502, 503, 504];
/// How often a wish to stop is looked for, ms.
const LOOK: u64 = 50;

/// How long is waited, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patience {
    /// For a connection.
    pub connect_s: f64,
    /// For one reply. Models without a graphics card need a minute.
    pub reply_s: f64,
    /// For all questions after one step.
    pub whole_s: f64,
    /// Before asking once more.
    pub pause_s: f64,
}

impl Default for Patience {
    fn default() -> Self {
        Self { connect_s: 2.0, reply_s: 20.0, whole_s: 60.0, pause_s: 0.5 }
    }
}

/// Where a model is and how it is asked.
#[derive(Clone)]
pub struct Settings {
    /// Up to and including `/v1`.
    pub base: Address,
    /// The model's name, as the server knows it.
    pub model: String,
    /// Sent as `Authorization: Bearer`; never written anywhere.
    pub key: Option<String>,
    /// How long is waited.
    pub patience: Patience,
    /// Whether the probabilities of tokens are asked for.
    pub logprobs: bool,
    /// Returns seconds since some instant.
    pub clock: fn() -> f64,
}

/// A model at a web address.
#[derive(Clone)]
pub struct Endpoint {
    settings: Settings,
    client: Client,
}

/// Whoever is asked whether to stop waiting.
type Stopped<'a> = &'a dyn Fn() -> bool;

impl Endpoint {
    /// Asks nobody yet.
    pub fn new(settings: Settings) -> Self {
        let Patience { connect_s, reply_s, .. } = settings.patience;
        let limits = Limits { connect_s, reply_s, longest: LONGEST };
        let client = Client::new(limits, &settings.base);
        Self { settings, client }
    }

    /// Returns where it is.
    pub fn base(&self) -> &Address {
        &self.settings.base
    }

    /// Returns the model's name.
    pub fn model(&self) -> &str {
        &self.settings.model
    }

    /// Returns the same endpoint with another model.
    #[must_use]
    pub fn with_model(mut self, model: &str) -> Self {
        model.clone_into(&mut self.settings.model);
        self
    }

    /// Returns who answers: `vlm:NAME`.
    pub fn by(&self) -> String {
        format!("vlm:{}", self.settings.model)
    }

    /// Returns how long is waited.
    pub fn patience(&self) -> Patience {
        self.settings.patience
    }

    /// Returns the names of the models that are served.
    ///
    /// # Errors
    ///
    /// When nobody answers, or not with a list.
    pub fn models(&self) -> Result<Vec<String>, Trouble> {
        let address = self.settings.base.join("models");
        let answer = self.client.get(&address, Some(self.key()))?;
        if answer.status != 200 {
            return Err(Broken::Status { address, status: answer.status }.into());
        }
        let read: serde_json::Value =
            serde_json::from_slice(&answer.body).map_err(|_| Broken::NotJson(address))?;
        let names = read["data"].as_array().into_iter().flatten();
        Ok(names.filter_map(|model| Some(model["id"].as_str()?.to_owned())).collect())
    }

    /// Puts one question about one picture.
    pub fn ask(&self, question: &str, on: On, picture: &Picture, stopped: Stopped<'_>) -> Reply {
        let (reply, _) = self.ask_closely(question, on, picture, stopped);
        reply
    }

    /// Puts one question, and says as well whether the reply had the form that was asked for.
    pub(super) fn ask_closely(
        &self,
        question: &str,
        on: On,
        picture: &Picture,
        stopped: Stopped<'_>,
    ) -> (Reply, bool) {
        let Settings { model, logprobs, clock, .. } = &self.settings;
        let body = request::question(model, question, &picture.uri, *logprobs);
        let begin = clock();
        let (came, tries) = self.exchange(&body, stopped);
        let verdict = match came {
            Ok(Answer { status, body }) => reply::verdict(status, &body),
            Err(why) => Verdict::nothing(why),
        };
        let in_form = verdict.in_form;
        let reply = self.reply(on, picture, verdict, &body, clock() - begin, tries);
        (reply, in_form)
    }

    /// Puts questions about the pictures of one moment, all of one picture before the next, and gives up
    /// when the time for all of them is over: what was not asked is unparsed.
    pub fn ask_all(
        &self,
        questions: &[&str],
        pictures: &[(On, Picture)],
        stopped: Stopped<'_>,
    ) -> Vec<(usize, Reply)> {
        let Settings { patience, clock, .. } = &self.settings;
        let begin = clock();
        let mut replies = Vec::new();
        for (on, picture) in pictures {
            for (i, question) in questions.iter().enumerate() {
                let late = clock() - begin > patience.whole_s;
                let why = match (stopped(), late) {
                    (true, _) => Some(Unanswered::Stopped),
                    (false, true) => Some(Unanswered::NotAsked(patience.whole_s)),
                    (false, false) => None,
                };
                let reply = match why {
                    None => self.ask(question, *on, picture, stopped),
                    Some(why) => self.reply(*on, picture, Verdict::nothing(why), "", 0.0, 0),
                };
                replies.push((i, reply));
            }
        }
        replies
    }

    /// Asks which call a sentence means; `system` says what there is to call. An empty text is no call.
    ///
    /// # Errors
    ///
    /// Why there is nothing to read.
    pub fn propose(
        &self,
        system: &str,
        sentence: &str,
        stopped: Stopped<'_>,
    ) -> Result<String, Unanswered> {
        let body = request::sentence(&self.settings.model, system, sentence);
        let Answer { status, body } = self.exchange(&body, stopped).0?;
        Ok(reply::proposal(status, &body)?)
    }

    fn reply(
        &self,
        on: On,
        picture: &Picture,
        verdict: Verdict,
        body: &str,
        latency_s: f64,
        tries: u32,
    ) -> Reply {
        let Verdict { said, why, evidence, p_yes, raw, .. } = verdict;
        Reply {
            by: self.by(),
            on,
            answer: said,
            why: why.map(|why| why.to_string()),
            evidence,
            raw,
            request_sha256: lines::fingerprint(&[body]),
            latency_s,
            tries,
            p_yes,
            picture: picture.sent.clone(),
        }
    }

    fn key(&self) -> &str {
        // Servers on this machine want some key and look at none.
        self.settings.key.as_deref().unwrap_or("none")
    }

    /// Sends a request, once more when what went wrong may pass; returns how often it was sent.
    fn exchange(&self, body: &str, stopped: Stopped<'_>) -> (Result<Answer, Unanswered>, u32) {
        let mut tries = 0;
        loop {
            tries += 1;
            let came = self.once(body, stopped);
            let may_pass = match &came {
                Ok(Ok(answer)) => PASSING.contains(&answer.status),
                Ok(Err(Trouble::Unreachable(_) | Trouble::Late(_))) => true,
                Ok(Err(Trouble::Broken(_))) | Err(_) => false,
            };
            if !may_pass || tries == 2 {
                let came = came.and_then(|came| came.map_err(Unanswered::from));
                return (came, tries);
            }
            thread::sleep(Duration::from_secs_f64(self.settings.patience.pause_s));
        }
    }

    /// Sends a request on a thread of its own, so that whoever waits can be stopped; a reply that comes
    /// after that is dropped.
    fn once(
        &self,
        body: &str,
        stopped: Stopped<'_>,
    ) -> Result<Result<Answer, Trouble>, Unanswered> {
        let (tell, told) = channel();
        let (client, body) = (self.client.clone(), body.to_owned());
        let address = self.settings.base.join("chat/completions");
        let key = self.key().to_owned();
        thread::spawn(move || {
            // Whoever was stopped meanwhile does not listen any more.
            let _ = tell.send(client.post(&address, &body, &key));
        });
        loop {
            match told.recv_timeout(Duration::from_millis(LOOK)) {
                Ok(came) => return Ok(came),
                Err(RecvTimeoutError::Timeout) if stopped() => {
                    return Err(Unanswered::Stopped);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Unanswered::BrokeOff);
                }
            }
        }
    }
}
