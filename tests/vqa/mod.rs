//! The model behind an endpoint: what is sent, what a reply comes to, and what answers are worth.

mod program;
mod score;
mod server;

use image::{Rgb, RgbImage};
use serde_json::Value;
use trueup::monitor::questionnaire::Answer;
use trueup::vqa::{Endpoint, On, Patience, Picture, Reply, Said, Settings};

use server::Server;

pub(crate) fn no_time() -> f64 {
    0.0
}

pub(crate) fn endpoint(server: &Server, model: &str) -> Endpoint {
    endpoint_at(&server.base(), model)
}

pub(crate) fn endpoint_at(base: &str, model: &str) -> Endpoint {
    Endpoint::new(Settings {
        base: base.parse().unwrap(),
        model: model.to_owned(),
        key: Some("secret-key".to_owned()),
        patience: Patience { connect_s: 2.0, reply_s: 0.4, whole_s: 60.0, pause_s: 0.0 },
        logprobs: model == "logprobs",
        clock: no_time,
    })
}

fn photo() -> Picture {
    Picture::photo(&RgbImage::from_pixel(64, 36, Rgb([120, 60, 30])))
}

fn ask(server: &Server, model: &str) -> Reply {
    let question = "Is the transparent jar above the blue cup?";
    endpoint(server, model).ask(question, On::Real, &photo(), &|| false)
}

/// The table of what a reply comes to. Nothing that says neither is ever a yes or a no.
#[test]
fn a_reply_comes_to_what_it_says_and_to_nothing_else() {
    let server = Server::start();
    for (model, said, why, tries) in [
        ("yes", Said::Yes, "", 1),
        ("no", Said::No, "", 1),
        ("fenced", Said::Yes, "", 1),
        ("unsure", Said::Unsure, "", 1),
        ("word-yes", Said::Yes, "", 1),
        ("word-no", Said::No, "", 1),
        ("hedged", Said::Unparsed, "prose: `It looks as if", 1),
        ("nothing", Said::Unparsed, "prose: `The gripper is now holding nothing.`", 1),
        ("thinking", Said::Unparsed, "empty: the model used up its tokens first", 1),
        ("cut", Said::Unparsed, "JSON cut short", 1),
        ("refusal", Said::Unparsed, "refused: I cannot help with that.", 1),
        ("proxy", Said::Unparsed, "not JSON, it begins `<html>", 1),
        ("missing", Said::Unparsed, "status 404: model `missing` not found", 1),
        ("image", Said::Unparsed, "status 400: invalid image input", 1),
        ("loading", Said::Yes, "", 2),
        ("busy", Said::Unparsed, "status 503: overloaded", 2),
        ("slow", Said::Unparsed, "no answer within 0.4 s", 2),
    ] {
        let reply = ask(&server, model);
        assert_eq!((reply.answer, reply.tries), (said, tries), "{model}: {reply:?}");
        let told = reply.why.clone().unwrap_or_default();
        assert!(told.starts_with(why) && told.is_empty() == why.is_empty(), "{model}: {told}");
        assert_eq!(reply.by, format!("vlm:{model}"));
        assert_eq!(reply.request_sha256.len(), 64);
        assert!(!format!("{reply:?}").contains("secret-key"), "{model}");
    }
    server.check();
    assert!(server.seen().iter().all(|seen| seen.key == "Bearer secret-key"));
}

#[test]
fn nobody_at_the_address_is_asked_twice_and_is_no_answer() {
    // A port that was free a moment ago.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let gone = endpoint_at(&format!("http://127.0.0.1:{port}/v1"), "yes");
    let reply = gone.ask("Is it?", On::Twin, &photo(), &|| false);
    assert_eq!((reply.answer, reply.tries, reply.on), (Said::Unparsed, 2, On::Twin));
    assert!(reply.why.unwrap().starts_with("no answer: "));
    assert!(gone.probe(&[], &|| false).is_err());
}

/// The evidence before the answer, the picture before the question, and the schema where all read it.
#[test]
fn the_requests_are_the_ones_that_were_agreed() {
    let server = Server::start();
    ask(&server, "yes");
    ask(&server, "logprobs");
    let model = endpoint(&server, "sees");
    model.propose("What there is to call.", "put it away", &|| false).unwrap();
    for (seen, golden) in
        server.seen().iter().zip(["question.json", "logprobs.json", "sentence.json"])
    {
        let mut body = seen.body.clone();
        if let Some(from) = body.find("base64,") {
            let end = from + body[from..].find('"').unwrap();
            body.replace_range(from + 7..end, "…");
        }
        let path = format!("{}/tests/vqa/golden/{golden}", env!("CARGO_MANIFEST_DIR"));
        let agreed = std::fs::read_to_string(&path).unwrap_or_default();
        // Laid out over lines in the file; the order of the fields counts.
        let agreed: String = agreed.lines().map(str::trim_start).collect();
        assert_eq!(body, agreed, "{golden}");
    }
}

#[test]
fn a_picture_is_sent_whole_and_no_larger_than_models_look_at() {
    let large = Picture::photo(&RgbImage::new(1280, 720));
    assert_eq!((large.sent.taken_px, large.sent.sent_px), ([1280, 720], [1024, 576]));
    assert_eq!(large.sent.media, "image/jpeg");
    let tall = Picture::photo(&RgbImage::new(3, 2000));
    assert_eq!(tall.sent.sent_px, [2, 1024]);
    assert_eq!(photo().sent.sent_px, [64, 36]);
}

#[test]
fn the_probability_of_yes_is_that_of_the_answer_and_not_of_the_evidence() {
    let server = Server::start();
    let reply = ask(&server, "logprobs");
    assert_eq!(reply.answer, Said::Yes);
    // 0.6 of 0.6 + 0.2; the alternative of probability 0 adds nothing.
    assert!((reply.p_yes.unwrap() - 0.75).abs() < 1e-12, "{:?}", reply.p_yes);
    assert_eq!(ask(&server, "yes").p_yes, None);
}

#[test]
fn a_probe_tells_who_looks_from_who_does_not() {
    let server = Server::start();
    let questions = ["Is the jar above the cup?".to_owned()];
    let probe = |model: &str| endpoint(&server, model).probe(&questions, &|| false).unwrap();
    let good = probe("sees");
    assert!(good.sees && good.keeps_form, "{good:?}");
    assert_eq!(good.models, ["sees", "essay"]);
    assert_eq!(good.blank[0].answer, Said::Unsure);
    let blind = probe("yes");
    assert!(!blind.sees && blind.keeps_form, "always yes: {blind:?}");
    assert_eq!(blind.blank[0].answer, Said::Yes);
    let loose = probe("essay");
    assert!(!loose.sees && !loose.keeps_form, "{loose:?}");
    // The form that a word alone keeps is not the one that was asked for.
    assert!(!probe("word-yes").keeps_form);
    server.check();
}

#[test]
fn all_questions_of_one_picture_come_before_the_next_picture() {
    let server = Server::start();
    let model = endpoint(&server, "sees");
    let red = Picture::exact(&RgbImage::from_pixel(8, 8, Rgb([200, 0, 0])));
    let blue = Picture::exact(&RgbImage::from_pixel(8, 8, Rgb([0, 0, 200])));
    let replies = model.ask_all(&["a?", "b?"], &[(On::Real, red), (On::Twin, blue)], &|| false);
    let told: Vec<_> = replies.iter().map(|(i, reply)| (*i, reply.on, reply.answer)).collect();
    let expected = [
        (0, On::Real, Said::Yes),
        (1, On::Real, Said::Yes),
        (0, On::Twin, Said::No),
        (1, On::Twin, Said::No),
    ];
    assert_eq!(told, expected);
}

/// A wish to stop does not wait for a model that thinks.
#[test]
fn a_stop_ends_the_waiting_and_what_was_not_asked_is_unparsed() {
    let server = Server::start();
    let slow = endpoint(&server, "slow");
    let replies = slow.ask_all(&["a?", "b?", "c?"], &[(On::Real, photo())], &|| true);
    assert_eq!(replies.len(), 3);
    assert!(replies.iter().all(|(_, reply)| reply.answer == Said::Unparsed && reply.tries == 0));
    assert!(replies[0].1.why.as_deref() == Some("stopped by a person"));
    assert!(server.seen().is_empty());
    // Asked already, and thinking: the reply is not waited for.
    let reply = slow.ask("a?", On::Real, &photo(), &|| true);
    assert_eq!((reply.why.as_deref(), reply.tries), (Some("stopped by a person"), 1));
}

/// When the time for all questions is over, the rest are not asked.
#[test]
fn a_questionnaire_has_an_end() {
    use std::sync::atomic::{AtomicU32, Ordering};
    static NOW: AtomicU32 = AtomicU32::new(0);
    let server = Server::start();
    let model = Endpoint::new(Settings {
        base: server.base().parse().unwrap(),
        model: "yes".into(),
        key: None,
        patience: Patience { whole_s: 25.0, pause_s: 0.0, ..Patience::default() },
        logprobs: false,
        // Every look at the clock is ten seconds later.
        clock: || f64::from(NOW.fetch_add(10, Ordering::SeqCst)),
    });
    let replies = model.ask_all(&["a?", "b?", "c?"], &[(On::Real, photo())], &|| false);
    let told: Vec<_> = replies.iter().map(|(_, reply)| reply.answer).collect();
    assert_eq!(told, [Said::Yes, Said::Unparsed, Said::Unparsed]);
    assert_eq!(replies[2].1.why.as_deref(), Some("not asked: 25 s are over"));
    assert_eq!(server.seen().len(), 1);
}

/// A model first, then geometry, then nobody: an answer that cannot be read is never a no.
#[test]
fn what_a_model_leaves_open_falls_to_geometry() {
    let server = Server::start();
    let with = |models: &[&str], measured: Option<bool>| Answer {
        question: "Is it?".into(),
        fluent: "above(jar, cup)".into(),
        twin: None,
        measured,
        by: models.iter().map(|model| ask(&server, model)).collect(),
    };
    let settled =
        |answer: &Answer, on: On| answer.settled(on).map(|(truth, by)| (truth, by.to_owned()));
    let of = |models: &[&str], measured| settled(&with(models, measured), On::Real);
    assert_eq!(of(&["no"], Some(true)), Some((false, "vlm:no".into())));
    assert_eq!(of(&["nothing"], Some(true)), Some((true, "geometry".into())));
    assert_eq!(of(&["unsure", "yes"], Some(false)), Some((true, "vlm:yes".into())));
    assert_eq!(of(&["nothing"], None), None, "a person would have to be asked");
    assert_eq!(settled(&with(&["no"], Some(true)), On::Twin), None, "another picture");
}

#[test]
fn a_reply_is_kept_and_read_again() {
    let server = Server::start();
    let reply = ask(&server, "fenced");
    let text = serde_json::to_value(&reply).unwrap();
    assert_eq!(serde_json::from_value::<Reply>(text.clone()).unwrap(), reply);
    assert_eq!(text["answer"], "yes");
    assert_eq!(text["evidence"], "a jar");
    assert_eq!(text["on"], "real");
    assert_ne!(text["raw"], Value::Null);
}
