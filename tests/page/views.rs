//! What each view shows, what it does not give away, and who is turned away.

use super::{get, host, post, post_from, raw, served};
use crate::program::Scratch;

const RUN: &str = "20260102-110000-pour";

#[test]
fn the_list_leads_to_every_run_and_a_run_to_every_step() {
    let scratch = Scratch::new("page-list");
    let page = served(&scratch);
    let host = host(&page);
    let list = get(&host, "/");
    assert_eq!(list.status, 200);
    assert!(list.text().contains(&format!("href=\"/run/{RUN}/1/before\"")), "{}", list.text());
    assert_eq!(
        get(&host, &format!("/run/{RUN}")).header("location").unwrap(),
        format!("/run/{RUN}/1/before")
    );
    for (path, parts) in [
        (
            "1/before",
            [
                "01-before-real.png",
                "id=\"following\" href=\"/run/20260102-110000-pour/1/after\"",
                "lift(jar, by: 12 cm)",
            ],
        ),
        (
            "2/after",
            [
                "02-after-twin.png",
                "class=\"lit\" data-path=\"pour/4-move_over\"",
                "class=\"around\" data-path=\"pour\"",
            ],
        ),
    ] {
        let step = get(&host, &format!("/run/{RUN}/{path}"));
        assert_eq!(step.status, 200);
        for part in parts {
            assert!(step.text().contains(part), "{path} lacks {part}: {}", step.text());
        }
    }
    let picture = get(&host, &format!("/run/{RUN}/frames/02-after-real.png"));
    let kept =
        std::fs::read(scratch.path(&format!("runs/{RUN}/frames/02-after-real.png"))).unwrap();
    assert_eq!((picture.status, picture.body), (200, kept));
    for missing in
        ["/run/9", "/run/nothing/1/after", &format!("/run/{RUN}/7/after"), "/nothing", "/live"]
    {
        let answer = get(&host, missing);
        assert!(matches!(answer.status, 404 | 303), "{missing}: {}", answer.status);
    }
    assert!(get(&host, "/run/nothing/1/after").text().contains("no such run"));
}

/// Nothing of geometry's answer to a question is on the page before the answer.
#[test]
fn questions_are_asked_blind_and_then_set_beside_geometry() {
    let scratch = Scratch::new("page-blind");
    let page = served(&scratch);
    let host = host(&page);
    let path = format!("/run/{RUN}/2/after");
    let before = get(&host, &path).text();
    assert!(before.contains("Has the robot already picked up the transparent jar?"), "{before}");
    for given_away in ["31 mm", "expected", "✗ failed", "it promised", "disagree on"] {
        let shown = before.split("How the run ended").next().unwrap();
        assert!(!shown.contains(given_away), "{given_away} is given away: {shown}");
    }
    let answer = |fluent: &str, said: &str| {
        let form = format!("run={RUN}&step=2&fluent={fluent}&answer={said}&back={path}");
        let sent = post(&host, "/answer", &form);
        assert_eq!(
            (sent.status, sent.header("location")),
            (303, Some(path.clone())),
            "{}",
            sent.text()
        );
    };
    answer("holding%28jar%29", "yes");
    let between = get(&host, &path).text();
    assert!(
        between.contains("You said yes, and so does geometry")
            && between.contains("question 2 of 2")
    );
    assert!(!between.contains("31 mm"), "{between}");
    answer("above%28jar%2C+cup%29", "yes");
    let after = get(&host, &path).text();
    for part in [
        "Your answer: yes. Measured: no (-31 mm ± 1 mm). Both are kept.",
        "hint 1: how close it is",
        "hint 2: which way",
        "hint 3: what to try",
        "disagree on 1 of 2",
        "<td class=\"number\">-31 mm ± 1 mm",
        "jar 31 mm to the camera's right",
        "✗ failed",
        "?why=above%28jar%2C%20cup%29#why",
    ] {
        assert!(after.contains(part), "{part} is missing: {after}");
    }
    let why = get(&host, &format!("{path}?why=above%28jar%2C%20cup%29")).text();
    assert!(why.contains("tasks/std.task:29") && why.contains("limit 35 mm"), "{why}");
    let kept = std::fs::read_to_string(scratch.path("runs/answers.jsonl")).unwrap();
    assert_eq!(kept.lines().count(), 2);
    assert!(kept.lines().all(|line| line.contains("\"by\":\"person:trainee\"")), "{kept}");
    let progress = get(&host, "/api/progress").json();
    assert_eq!(progress["progress"][0]["fluent"], "above");
    assert_eq!(
        (&progress["progress"][0]["right"], &progress["progress"][0]["of"]),
        (&0.into(), &1.into())
    );
    assert!(get(&host, "/").text().contains("1 of 1"));
}

#[test]
fn whoever_only_looks_is_not_asked() {
    let scratch = Scratch::new("page-look");
    let page = served(&scratch);
    let host = host(&page);
    let path = format!("/run/{RUN}/2/after");
    assert_eq!(post(&host, "/show", &format!("run={RUN}&step=2&back={path}")).status, 303);
    let shown = get(&host, &path).text();
    assert!(shown.contains("-31 mm") && !shown.contains("id=\"question\""), "{shown}");
    assert!(get(&host, &format!("/run/{RUN}/1/after")).text().contains("id=\"question\""));
    post(&host, "/asks", "asks=no&back=/");
    assert!(!get(&host, &format!("/run/{RUN}/1/after")).text().contains("id=\"question\""));
    assert!(!scratch.path("runs/answers.jsonl").exists());
}

#[test]
fn a_quiz_has_an_order_of_its_own_and_counts_per_person() {
    let scratch = Scratch::new("page-quiz");
    let page = served(&scratch);
    let host = host(&page);
    let questions = |seed: u32| -> Vec<String> {
        let each = (1..=30).map_while(|at| {
            let text = get(&host, &format!("/quiz?seed={seed}&at={at}")).text();
            let question = text.split("<h2 id=\"question\">").nth(1)?.split('<').next()?.to_owned();
            let place = text.split("hardest last").nth(1)?.split("</p>").next()?.to_owned();
            Some(format!("{question}{place}"))
        });
        each.collect()
    };
    let (one, again) = (questions(1), questions(1));
    assert!(one.len() >= 3 && one == again, "{one:?}");
    let mut sorted = [one.clone(), questions(2)];
    for all in &mut sorted {
        all.sort();
    }
    assert_eq!(sorted[0], sorted[1], "another seed asks the same questions");
    let text = get(&host, "/quiz?seed=1&at=1").text();
    assert!(!text.contains("geometry:") && !text.contains("You said"));
    post(&host, "/who", "name=Anna&back=/quiz");
    let form: Vec<String> = ["run", "step", "fluent", "back"]
        .iter()
        .map(|name| {
            let value = text.split(&format!("name=\"{name}\" value=\"")).nth(1).unwrap();
            let value = value.split('"').next().unwrap().replace("&amp;", "&");
            format!("{name}={}", trueup::http::encoded(&value))
        })
        .collect();
    let sent = post(&host, "/answer", &format!("{}&answer=yes", form.join("&")));
    assert_eq!(sent.header("location").unwrap(), "/quiz?seed=1&at=1&told=1");
    let told = get(&host, "/quiz?seed=1&at=1&told=1").text();
    assert!(told.contains("You said yes") && told.contains("next question"), "{told}");
    assert!(told.contains("<td>Anna"), "{told}");
}

#[test]
fn the_same_is_there_as_json() {
    let scratch = Scratch::new("page-json");
    let page = served(&scratch);
    let host = host(&page);
    let runs = get(&host, "/api/runs").json();
    assert_eq!(runs["runs"].as_array().unwrap().len(), 3);
    let replayed = scratch.trueup(&["replay", "3", "--step", "2", "--json"]).json();
    assert_eq!(get(&host, "/api/run/3/2").json(), replayed);
    assert_eq!(get(&host, "/api/run/3").json(), scratch.trueup(&["replay", "3", "--json"]).json());
    let why = get(&host, "/api/run/3/2/why?fluent=above(jar,%20cup)").json();
    assert!(why["why"].as_str().unwrap().contains("is false by 31 mm"), "{why}");
    assert_eq!(why["hints"].as_array().unwrap().len(), 3);
}

#[test]
fn other_pages_and_other_paths_are_turned_away() {
    let scratch = Scratch::new("page-guard");
    let page = served(&scratch);
    let host = host(&page);
    scratch.file("secret.txt", "not for you");
    let port = host.split(':').nth(1).unwrap();
    for name in [
        "evil.example",
        &format!("evil.example:{port}"),
        "127.0.0.1",
        &format!("127.0.0.1.evil.example:{port}"),
    ] {
        assert_eq!(
            raw(&host, &format!("GET / HTTP/1.1\r\nHost: {name}\r\n\r\n")).status,
            403,
            "{name}"
        );
    }
    assert_eq!(raw(&host, "GET / HTTP/1.1\r\n\r\n").status, 403);
    assert_eq!(
        raw(&host, &format!("GET / HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n")).status,
        200
    );
    for origin in ["", "Origin: http://evil.example\r\n", "Origin: null\r\n"] {
        let form = format!("run={RUN}&step=2&fluent=holding%28jar%29&answer=yes");
        assert_eq!(post_from(&host, "/answer", &form, origin).status, 403, "{origin}");
    }
    assert!(!scratch.path("runs/answers.jsonl").exists());
    for path in [
        "/../secret.txt",
        "/run/../secret.txt",
        "/run/..%2f..%2fsecret.txt/1/after",
        &format!("/run/{RUN}/frames/..%2f..%2f..%2fsecret.txt"),
        &format!("/run/{RUN}/frames/../../../secret.txt"),
        &format!("/run/{RUN}/frames/%2e%2e/run.json"),
        &format!("/run/{RUN}/frames/02-after-real"),
        "/run/../frames/02-after-real.png",
        "/run//frames/02-after-real.png",
        "/api/run/..%2f..",
    ] {
        let answer = get(&host, path);
        assert_eq!(answer.status, 404, "{path}");
        assert!(!answer.text().contains("not for you"), "{path}");
    }
    let elsewhere = post(&host, "/asks", "asks=yes&back=//evil.example");
    assert_eq!(elsewhere.header("location").unwrap(), "/");
    let list = get(&host, "/");
    assert!(list.header("content-security-policy").unwrap().contains("default-src 'none'"));
    for outside in ["http://", "https://", "<script>", "style=", "onclick"] {
        assert!(!list.text().contains(outside), "{outside}");
    }
    assert!(
        post(&host, "/answer", "run=3").status == 400
            && post(&host, "/live", "word=next").status == 404
    );
}

#[test]
fn the_page_ends_with_its_owner() {
    let scratch = Scratch::new("page-end");
    let page = served(&scratch);
    let host = host(&page);
    assert!(host.starts_with("127.0.0.1:"));
    drop(page);
    assert!(std::net::TcpStream::connect(&host).is_err());
}
