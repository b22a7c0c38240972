//! What a reply comes to: yes, no, unsure, or unparsed with the reason.
//!
//! Servers are known to drop the schema and answer 200 with prose (llama.cpp issues 19051, 24097, 24144), so
//! nothing is taken on trust. A reply counts when it is the JSON that was asked for, or begins with the one
//! word and takes nothing back. Scoring "not no" as yes, as a common scorer does, would make an empty reply a
//! yes.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Unanswered, Unread};

/// What a reply comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Said {
    /// It is so.
    Yes,
    /// It is not so.
    No,
    /// The picture does not tell.
    Unsure,
    /// Nothing that can be read: neither yes nor no.
    Unparsed,
}

impl Said {
    /// Returns the answer that a reading of a fluent amounts to.
    pub fn of(truth: Option<bool>) -> Self {
        match truth {
            Some(true) => Self::Yes,
            Some(false) => Self::No,
            None => Self::Unsure,
        }
    }

    /// Returns whether it says yes or no, and which.
    pub fn truth(self) -> Option<bool> {
        match self {
            Self::Yes => Some(true),
            Self::No => Some(false),
            Self::Unsure | Self::Unparsed => None,
        }
    }

    /// Returns `yes`, `no`, `unsure` or `unparsed`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::No => "no",
            Self::Unsure => "unsure",
            Self::Unparsed => "unparsed",
        }
    }

    fn named(word: &str) -> Option<Self> {
        match word.trim().to_ascii_lowercase().as_str() {
            "yes" => Some(Self::Yes),
            "no" => Some(Self::No),
            "unsure" => Some(Self::Unsure),
            _ => None,
        }
    }
}

/// What was read from a reply.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What it comes to.
    pub said: Said,
    /// Why it comes to nothing.
    pub why: Option<Unanswered>,
    /// What the model says it saw.
    pub evidence: Option<String>,
    /// Whether the reply had the form that was asked for.
    pub in_form: bool,
    /// `p(yes) / (p(yes) + p(no))`, where the server tells.
    pub p_yes: Option<f64>,
    /// What the model wrote, or what came instead of it.
    pub raw: String,
}

impl Verdict {
    fn unparsed(why: impl Into<Unanswered>, raw: &str) -> Self {
        Self {
            said: Said::Unparsed,
            why: Some(why.into()),
            evidence: None,
            in_form: false,
            p_yes: None,
            raw: excerpt(raw, 2000),
        }
    }

    /// The verdict when nothing came at all.
    pub fn nothing(why: Unanswered) -> Self {
        Self::unparsed(why, "")
    }
}

/// The part of a chat completion that counts.
struct Completion {
    text: String,
    is_cut: bool,
    p_yes: Option<f64>,
}

/// Reads the reply to a question.
pub fn verdict(status: u16, body: &[u8]) -> Verdict {
    let whole = String::from_utf8_lossy(body);
    let completion = match completion(status, &whole) {
        Ok(completion) => completion,
        Err(why) => return Verdict::unparsed(why, &whole),
    };
    let Completion { text, is_cut, p_yes } = completion;
    let bare = unfenced(text.trim());
    if bare.is_empty() {
        let why = if is_cut { Unread::UsedUp } else { Unread::Empty };
        return Verdict::unparsed(why, &text);
    }
    let read =
        if bare.starts_with('{') { document(bare) } else { word(bare).map(|said| (said, None)) };
    match read {
        Ok((said, evidence)) => Verdict {
            said,
            why: None,
            evidence,
            in_form: bare.starts_with('{'),
            p_yes,
            raw: excerpt(&text, 2000),
        },
        Err(why) => Verdict::unparsed(why, &text),
    }
}

/// Reads the reply to a sentence: the call that the model proposes, as text; an empty one proposes nothing.
///
/// # Errors
///
/// Why there is nothing to read.
pub fn proposal(status: u16, body: &[u8]) -> Result<String, Unread> {
    let completion = completion(status, &String::from_utf8_lossy(body))?;
    let bare = unfenced(completion.text.trim());
    let read: Value = serde_json::from_str(bare).map_err(|_| Unread::NoProposal)?;
    let call = read["call"].as_str().ok_or(Unread::NoCall)?;
    Ok(call.trim().to_owned())
}

/// Takes a chat completion out of an answer of a server.
fn completion(status: u16, body: &str) -> Result<Completion, Unread> {
    let read: Option<Value> = serde_json::from_str(body).ok();
    if status != 200 {
        let told = read.as_ref().and_then(|read| {
            let error = &read["error"];
            error["message"].as_str().or(error.as_str()).map(|text| excerpt(text, 120))
        });
        let told = told.unwrap_or_else(|| excerpt(body, 60));
        return Err(Unread::Status { status, told });
    }
    let Some(read) = read else {
        return Err(Unread::NoJson(excerpt(body, 40)));
    };
    let choice = &read["choices"][0];
    let message = &choice["message"];
    if let Some(refusal) = message["refusal"].as_str().filter(|text| !text.is_empty()) {
        return Err(Unread::Refused(excerpt(refusal, 120)));
    }
    if choice.is_null() {
        return Err(Unread::NoChoice);
    }
    Ok(Completion {
        text: message["content"].as_str().unwrap_or_default().to_owned(),
        is_cut: choice["finish_reason"] == "length",
        p_yes: p_yes(&choice["logprobs"]["content"]),
    })
}

/// Takes a code fence off.
fn unfenced(text: &str) -> &str {
    let inside = text.strip_prefix("```").and_then(|rest| rest.strip_suffix("```"));
    let Some(inside) = inside else { return text };
    let inside = inside.strip_prefix("json").unwrap_or(inside);
    inside.trim()
}

type Read = (Said, Option<String>);

fn document(text: &str) -> Result<Read, Unread> {
    let read: Value = serde_json::from_str(text).map_err(|error| {
        if error.is_eof() { Unread::CutShort } else { Unread::Malformed(error.to_string()) }
    })?;
    let answer = read["answer"].as_str().ok_or(Unread::NoAnswer)?;
    let said = Said::named(answer);
    let said = said.ok_or_else(|| Unread::OtherWord(excerpt(answer, 40)))?;
    Ok((said, read["evidence"].as_str().map(ToOwned::to_owned)))
}

/// Words after the first that take it back or leave it open.
const HEDGES: &[&str] = &[
    "but",
    "however",
    "unclear",
    "although",
    "though",
    "unsure",
    "uncertain",
    "maybe",
    "perhaps",
    "possibly",
    "cannot",
    "can't",
    "yes",
    "no",
];

/// Reads prose: the leading word, alone or before a mark, with nothing after it that takes it back.
fn word(text: &str) -> Result<Said, Unread> {
    let prose = || Unread::Prose(excerpt(text, 60));
    let end = text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len());
    let said = Said::named(&text[..end]).ok_or_else(prose)?;
    let rest = &text[end..];
    if !rest.is_empty() && !rest.starts_with(['.', ',', '!', ';', ':', '\n']) {
        return Err(prose());
    }
    let lower = rest.to_lowercase();
    let mut words = lower.split(|c: char| !c.is_alphanumeric() && c != '\'');
    match words.find(|word| HEDGES.contains(word)) {
        Some(hedge) => Err(Unread::Hedged { said, hedge: hedge.to_owned() }),
        None => Ok(said),
    }
}

/// Finds the token that is the answer, the last that is one of the words, and compares its alternatives.
fn p_yes(tokens: &Value) -> Option<f64> {
    let bare = |token: &Value| {
        let text = token["token"].as_str().unwrap_or_default();
        text.trim_matches(|c: char| !c.is_ascii_alphabetic()).to_ascii_lowercase()
    };
    let is_answer = |token: &&Value| Said::named(&bare(token)).is_some();
    let answer = tokens.as_array()?.iter().rev().find(is_answer)?;
    let (mut yes, mut no) = (0.0, 0.0);
    for other in answer["top_logprobs"].as_array()? {
        // Some servers write minus infinity as null.
        let p = other["logprob"].as_f64().map_or(0.0, f64::exp);
        match bare(other).as_str() {
            "yes" => yes += p,
            "no" => no += p,
            _ => {}
        }
    }
    (yes + no > 0.0).then(|| yes / (yes + no))
}

/// Returns the beginning of a text on one line.
fn excerpt(text: &str, most: usize) -> String {
    let line = text.trim().replace(['\n', '\r'], " ");
    match line.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line,
    }
}
