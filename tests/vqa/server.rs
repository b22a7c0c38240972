//! A model server for tests: the name of the model picks how it behaves, and every request is checked to be
//! one that llama.cpp's server, Ollama and vLLM would all understand.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use base64::Engine as _;
use serde_json::{Value, json};

/// Answers until the test process ends.
pub(crate) struct Server {
    address: SocketAddr,
    seen: Arc<Mutex<Vec<Seen>>>,
}

/// A request as it came.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) path: String,
    pub(crate) key: String,
    pub(crate) body: String,
    /// What is wrong with it.
    pub(crate) wrong: Vec<String>,
}

impl Server {
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let seen: Arc<Mutex<Vec<Seen>>> = Arc::default();
        let keep = seen.clone();
        thread::spawn(move || {
            for stream in listener.incoming() {
                let keep = keep.clone();
                thread::spawn(move || answer(stream.unwrap(), &keep));
            }
        });
        Self { address, seen }
    }

    /// Returns its address up to `/v1`.
    pub(crate) fn base(&self) -> String {
        format!("http://{}/v1", self.address)
    }

    /// Returns the questions that were put so far.
    pub(crate) fn seen(&self) -> Vec<Seen> {
        let seen = self.seen.lock().unwrap();
        seen.iter().filter(|seen| seen.path.ends_with("/completions")).cloned().collect()
    }

    /// Fails if any request was one that some server would not understand.
    pub(crate) fn check(&self) {
        for seen in self.seen() {
            assert_eq!(seen.wrong, Vec::<String>::new(), "{}", seen.path);
        }
    }
}

fn answer(mut stream: TcpStream, keep: &Mutex<Vec<Seen>>) {
    let Some((head, body)) = read(&mut stream) else { return };
    let path = head.split(' ').nth(1).unwrap_or_default().to_owned();
    let lines = head.lines().filter_map(|line| line.split_once(": "));
    let headers: BTreeMap<String, &str> =
        lines.map(|(name, value)| (name.to_lowercase(), value)).collect();
    let key = headers.get("authorization").copied().unwrap_or_default().to_owned();
    let asked: Value = serde_json::from_str(&body).unwrap_or_default();
    let earlier = {
        let mut keep = keep.lock().unwrap();
        let same = |seen: &&Seen| seen.body == body;
        let earlier = keep.iter().filter(same).count();
        let wrong = if path.ends_with("/completions") { wrong(&asked) } else { Vec::new() };
        keep.push(Seen { path: path.clone(), key, body, wrong });
        earlier
    };
    let (status, text) = if path.ends_with("/models") {
        (200, json!({"object": "list", "data": [{"id": "sees"}, {"id": "essay"}]}).to_string())
    } else {
        behave(&asked, earlier)
    };
    let kind = if text.starts_with('<') { "text/html" } else { "application/json" };
    let _ = write!(
        stream,
        "HTTP/1.1 {status} Status\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{text}",
        text.len()
    );
}

fn read(stream: &mut TcpStream) -> Option<(String, String)> {
    let mut got = Vec::new();
    let mut part = [0; 16_384];
    let end = loop {
        if let Some(at) = got.windows(4).position(|four| four == b"\r\n\r\n") {
            break at;
        }
        let n = stream.read(&mut part).ok().filter(|n| *n > 0)?;
        got.extend_from_slice(&part[..n]);
    };
    let head = String::from_utf8(got[..end].to_vec()).unwrap();
    let length = head.lines().find_map(|line| {
        let (name, value) = line.split_once(": ")?;
        name.eq_ignore_ascii_case("content-length").then(|| value.parse::<usize>().unwrap())
    });
    let mut body = got.split_off(end + 4);
    while body.len() < length.unwrap_or(0) {
        let n = stream.read(&mut part).ok().filter(|n| *n > 0)?;
        body.extend_from_slice(&part[..n]);
    }
    Some((head, String::from_utf8(body).unwrap()))
}

/// What a request lacks.
fn wrong(asked: &Value) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut must = |holds: bool, what: &str| {
        if !holds {
            wrong.push(what.to_owned());
        }
    };
    must(asked["max_tokens"].is_u64(), "max_tokens is missing");
    must(
        asked.get("max_completion_tokens").is_none(),
        "Ollama does not know max_completion_tokens",
    );
    must(asked["stream"] == json!(false), "a stream was asked for");
    let format = &asked["response_format"];
    must(format["type"] == "json_schema", "the form is no schema");
    must(
        format["json_schema"]["schema"]["type"] == "object",
        "the schema is not inside json_schema",
    );
    must(format.get("schema").is_none(), "llama.cpp does not read a schema beside json_schema");
    if format["json_schema"]["name"] == "vqa" {
        let parts = asked["messages"][1]["content"].as_array().cloned().unwrap_or_default();
        let kinds: Vec<&str> = parts.iter().filter_map(|part| part["type"].as_str()).collect();
        must(kinds == ["image_url", "text"], "not one picture and then one question");
        let uri = parts[0]["image_url"]["url"].as_str().unwrap_or_default().to_owned();
        let (head, data) = uri.split_once(";base64,").unwrap_or_default();
        let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap_or_default();
        let is_picture = match head {
            "data:image/png" => bytes.starts_with(b"\x89PNG\r\n"),
            "data:image/jpeg" => bytes.starts_with(&[0xff, 0xd8, 0xff]),
            _ => false,
        };
        must(is_picture, "no picture in a data URI");
        let picture = image::load_from_memory(&bytes).ok();
        must(
            picture.is_some_and(|picture| picture.width().max(picture.height()) <= 1024),
            "a picture larger than 1024 px",
        );
    }
    wrong
}

/// Status and body of the reply, by the name of the model; `earlier` is how often the very same was asked.
fn behave(asked: &Value, earlier: usize) -> (u16, String) {
    let model = asked["model"].as_str().unwrap_or_default();
    let said = |content: &str| choice(&json!({"content": content}), "stop");
    let form =
        |answer: &str| said(&format!("{{\"evidence\": \"as seen\", \"answer\": \"{answer}\"}}"));
    let text = match model {
        "loading" if earlier.is_multiple_of(2) => {
            return (503, json!({"error": {"message": "Loading model"}}).to_string());
        }
        "yes" | "loading" => form("yes"),
        "no" => form("no"),
        "fenced" => said("```json\n{\"evidence\": \"a jar\", \"answer\": \"yes\"}\n```"),
        "unsure" => form("unsure"),
        "word-yes" => said("Yes."),
        "word-no" => said("No, the jar is beside the cup."),
        "hedged" => said("It looks as if it is not clearly above the cup, but yes"),
        "nothing" => said("The gripper is now holding nothing."),
        "thinking" => choice(&json!({"content": "", "reasoning_content": "Let me see"}), "length"),
        "cut" => choice(&json!({"content": "{\"evidence\": \"the jar is"}), "length"),
        "refusal" => {
            choice(&json!({"content": null, "refusal": "I cannot help with that."}), "stop")
        }
        "proxy" => return (200, "<html><body>Sign in to the network</body></html>".to_owned()),
        "missing" => {
            return (404, json!({"error": {"message": "model `missing` not found"}}).to_string());
        }
        "image" => return (400, json!({"error": {"message": "invalid image input"}}).to_string()),
        "busy" => return (503, json!({"error": "overloaded"}).to_string()),
        "slow" => {
            thread::sleep(Duration::from_millis(1500));
            form("yes")
        }
        "logprobs" => logprobs(),
        "essay" => said("The picture shows two fields of colour. In the first paragraph,"),
        "sees" => return (200, looks(asked)),
        _ => {
            return (
                404,
                json!({"error": {"message": format!("model `{model}` not found")}}).to_string(),
            );
        }
    };
    (200, text)
}

fn choice(message: &Value, finish: &str) -> String {
    json!({"model": "fixture", "choices": [{"index": 0, "message": message, "finish_reason": finish}]})
        .to_string()
}

fn logprobs() -> String {
    let token = |text: &str, others: &[(&str, f64)]| {
        let top: Vec<Value> =
            others.iter().map(|(t, p)| json!({"token": t, "logprob": p.ln()})).collect();
        json!({"token": text, "logprob": -0.1, "top_logprobs": top})
    };
    let mut reply: Value = serde_json::from_str(&choice(
        &json!({"content": "{\"evidence\": \"no cloth\", \"answer\": \"yes\"}"}),
        "stop",
    ))
    .unwrap();
    // `no` in the evidence is not the answer: the last such token is.
    reply["choices"][0]["logprobs"] = json!({"content": [
        token("no", &[("no", 0.9), ("yes", 0.05)]),
        token(" cloth", &[]),
        token("yes", &[("yes", 0.6), ("Yes", 0.0), ("no", 0.2), ("unsure", 0.2)]),
        token("\"}", &[]),
    ]});
    reply.to_string()
}

/// A model that looks: red on the left is a yes, as is any picture that is red at all; grey is unsure. For a
/// sentence it proposes what the sentence says after "call".
fn looks(asked: &Value) -> String {
    let content = &asked["messages"][1]["content"];
    if let Some(sentence) = content.as_str() {
        let call = sentence.split_once("call ").map_or("", |(_, call)| call).to_owned();
        let call = if call.is_empty() || call.contains('(') { call } else { call + "()" };
        let reply = json!({"reason": "said so", "call": call}).to_string();
        return choice(&json!({ "content": reply }), "stop");
    }
    let uri = content[0]["image_url"]["url"].as_str().unwrap();
    let data = uri.split_once(";base64,").unwrap().1;
    let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap();
    let picture = image::load_from_memory(&bytes).unwrap().to_rgb8();
    let [red, _, blue] = picture.get_pixel(picture.width() / 4, picture.height() / 2).0;
    let answer = match i32::from(red) - i32::from(blue) {
        40.. => "yes",
        ..=-40 => "no",
        _ => "unsure",
    };
    let reply = format!("{{\"evidence\": \"left is {red} red\", \"answer\": \"{answer}\"}}");
    choice(&json!({ "content": reply }), "stop")
}
