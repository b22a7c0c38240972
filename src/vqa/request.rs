//! The bodies that are sent: one picture and one question, or one sentence, and the form of the reply.
//!
//! The order of the fields matters and is that of these structs: the evidence stands before the answer in
//! the form, so that the answer rests on it, and the picture before the question, so that a server can keep
//! what it worked out of the picture for the next question. Only fields that llama.cpp's server, Ollama and
//! vLLM read alike are used: `max_tokens`, and the schema inside `json_schema`.

use serde::Serialize;

use super::wording::SYSTEM;

#[derive(Serialize)]
struct Body<'a, P> {
    model: &'a str,
    temperature: u8,
    seed: u8,
    max_tokens: u16,
    stream: bool,
    messages: [Message<'a>; 2],
    response_format: Format<P>,
    #[serde(skip_serializing_if = "Option::is_none")]
    logprobs: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    top_logprobs: Option<u8>,
}

#[derive(Serialize)]
struct Message<'a> {
    role: &'static str,
    content: Content<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Content<'a> {
    Text(&'a str),
    Parts([Part<'a>; 2]),
}

#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Part<'a> {
    ImageUrl { image_url: Url<'a> },
    Text { text: &'a str },
}

#[derive(Serialize)]
struct Url<'a> {
    url: &'a str,
}

#[derive(Serialize)]
struct Format<P> {
    r#type: &'static str,
    json_schema: Named<P>,
}

#[derive(Serialize)]
struct Named<P> {
    name: &'static str,
    strict: bool,
    schema: Schema<P>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Schema<P> {
    r#type: &'static str,
    additional_properties: bool,
    required: [&'static str; 2],
    properties: P,
}

#[derive(Serialize)]
struct Answer {
    evidence: Text,
    answer: Choice,
}

#[derive(Serialize)]
struct Proposal {
    reason: Text,
    call: Text,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Text {
    r#type: &'static str,
    max_length: u16,
}

#[derive(Serialize)]
struct Choice {
    r#type: &'static str,
    r#enum: [&'static str; 3],
}

fn format<P>(name: &'static str, required: [&'static str; 2], properties: P) -> Format<P> {
    let schema = Schema { r#type: "object", additional_properties: false, required, properties };
    Format { r#type: "json_schema", json_schema: Named { name, strict: true, schema } }
}

fn text(max_length: u16) -> Text {
    Text { r#type: "string", max_length }
}

fn write<P: Serialize>(body: &Body<'_, P>) -> String {
    serde_json::to_string(body).expect("strings and numbers can be written as JSON")
}

/// Returns the request for one question about one picture, a data URI.
pub(super) fn question(model: &str, question: &str, picture: &str, logprobs: bool) -> String {
    let image = Part::ImageUrl { image_url: Url { url: picture } };
    let choice = Choice { r#type: "string", r#enum: ["yes", "no", "unsure"] };
    write(&Body {
        model,
        temperature: 0,
        seed: 7,
        max_tokens: 160,
        stream: false,
        messages: [
            Message { role: "system", content: Content::Text(SYSTEM) },
            Message {
                role: "user",
                content: Content::Parts([image, Part::Text { text: question }]),
            },
        ],
        response_format: format(
            "vqa",
            ["evidence", "answer"],
            Answer { evidence: text(120), answer: choice },
        ),
        logprobs: logprobs.then_some(true),
        top_logprobs: logprobs.then_some(5),
    })
}

/// Returns the request for the call that a sentence means; `system` says what can be called.
pub(super) fn sentence(model: &str, system: &str, sentence: &str) -> String {
    write(&Body {
        model,
        temperature: 0,
        seed: 7,
        max_tokens: 160,
        stream: false,
        messages: [
            Message { role: "system", content: Content::Text(system) },
            Message { role: "user", content: Content::Text(sentence) },
        ],
        response_format: format(
            "call",
            ["reason", "call"],
            Proposal { reason: text(120), call: text(200) },
        ),
        logprobs: None,
        top_logprobs: None,
    })
}
