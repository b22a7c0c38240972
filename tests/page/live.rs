//! A run that waits for the page, with nothing but the two ends of it: the wishes and the words.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use trueup::arm::Cancel;
use trueup::execution::conduct::{Ahead, Conductor, Dial, Part, Stated, Word};
use trueup::page::{Lead, Live, Options, Page, Watch};
use trueup::trace::{Event, Observer};
use trueup::workcell::archive;

use super::{get, host, post};
use crate::program::Scratch;
use crate::repl::kept;

fn part(path: &str, label: &str, first: usize, last: usize) -> Part {
    Part { path: path.into(), label: label.into(), is_branch: false, first, last }
}

/// Step `number` of five: the second to the fourth are `pick(jar)`.
fn ahead(number: usize) -> Ahead {
    let mut parts = vec![part("pour", "pour(jar, cup)", 1, 5)];
    if (2..=4).contains(&number) {
        parts.push(part("pour/pick", "pick(jar)", 2, 4));
    }
    let stated =
        |text: &str, asks| Stated { text: text.into(), truth: Some(false), margin: None, asks };
    Ahead {
        number,
        of: 5,
        path: format!("pour/{number}"),
        action: format!("act({number})"),
        place: Some("tasks/std.task:188".into()),
        script: None,
        parts,
        needs: vec![stated("gripper.open", false)],
        keeps: Vec::new(),
        gives: vec![stated("holding(jar)", true)],
        mark: None,
        later: Vec::new(),
    }
}

struct Cell {
    page: Page,
    live: Arc<Live>,
    cancel: Cancel,
    dial: Dial,
}

fn cell(name: &str) -> Cell {
    let scratch = Scratch::new(name);
    let (cancel, dial) = (Cancel::default(), Dial::default());
    let live = Arc::new(Live::new("pour(jar, cup)".into(), cancel.clone(), dial.clone()));
    let options = Options {
        root: scratch.path("runs"),
        answers: scratch.path("answers.jsonl"),
        port: 0,
        seed: 1,
        place: Box::new(|_| None),
    };
    Cell { page: Page::open(options, Some(live.clone())).unwrap(), live, cancel, dial }
}

/// Walks the five steps as the workcell does; returns those that were begun.
pub(crate) fn walk(live: &Arc<Live>) -> thread::JoinHandle<Vec<usize>> {
    let live = live.clone();
    thread::spawn(move || {
        let (mut lead, mut watch) = (Lead::new(live.clone()), Watch(live));
        let mut begun = Vec::new();
        for number in 1..=5 {
            if lead.before(&ahead(number)) == Word::Stop {
                break;
            }
            begun.push(number);
            let Ahead { of, action, path, .. } = ahead(number);
            watch.event(&Event::StepStart { number, of, action, path });
        }
        begun
    })
}

/// Waits until the run waits before a step, and returns what the page then shows.
fn waits_before(host: &str, number: usize) -> String {
    for _ in 0..400 {
        let now = get(host, "/live.json").json();
        if now["waits"]["before"]["number"] == number {
            return get(host, "/live").text();
        }
        thread::sleep(Duration::from_millis(10));
    }
    panic!("the run never waits before step {number}: {}", get(host, "/live.json").text());
}

#[test]
fn next_over_and_continue_lead_the_run() {
    let cell = cell("page-live");
    let host = host(&cell.page);
    assert!(get(&host, "/live").text().contains("the run has not begun"));
    assert_eq!(post(&host, "/live", "word=next").status, 409, "nothing waits yet");
    let run = walk(&cell.live);
    let first = waits_before(&host, 1);
    for part in [
        "Next, step 1 of 5",
        "gripper.open   (not yet)",
        "not the emergency stop",
        "tasks/std.task:188",
    ] {
        assert!(first.contains(part), "{part} is missing: {first}");
    }
    // What a question will ask is not told before.
    assert!(first.contains("<li>holding(jar)</li>"), "{first}");
    assert_eq!(post(&host, "/live", "word=next").header("location").unwrap(), "/live");
    let second = waits_before(&host, 2);
    assert!(second.contains("over <span class=\"call\">pick(jar)</span>, to step 4"), "{second}");
    post(&host, "/live", "word=over");
    waits_before(&host, 5);
    assert_eq!(post(&host, "/live", "word=speed&percent=25").status, 303);
    assert_eq!(cell.dial.percent(), 25);
    assert_eq!(post(&host, "/live", "word=speed&percent=0").status, 400);
    post(&host, "/live", "word=continue");
    assert_eq!(run.join().unwrap(), [1, 2, 3, 4, 5]);
    cell.live.ended("done: pour(jar, cup)");
    let end = get(&host, "/live").text();
    assert!(end.contains("done: pour(jar, cup)") && !end.contains("id=\"go-next\""), "{end}");
}

#[test]
fn a_breakpoint_set_by_name_pauses_what_goes_on() {
    let cell = cell("page-breakpoints");
    let host = host(&cell.page);
    assert!(!get(&host, "/live").text().contains("pause before"));
    let early = post(&host, "/live", "word=break&step=Quatsch");
    assert_eq!(early.status, 409, "nobody knows yet what there will be");
    assert!(early.text().starts_with("nothing is planned yet"), "{}", early.text());
    let run = walk(&cell.live);
    let first = waits_before(&host, 1);
    assert!(first.contains("pause before") && first.contains("continue to the end"), "{first}");
    assert_eq!(post(&host, "/live", "word=break&step=act").status, 303);
    let refused = post(&host, "/live", "word=break&step=akt");
    assert_eq!(
        (refused.status, refused.text().trim()),
        (400, "no step from here on is called akt: did you mean act?")
    );
    let refused = post(&host, "/live", "word=break&step=Quatsch").text();
    assert!(refused.starts_with("no step from here on is called Quatsch;"), "{refused}");
    assert_eq!(post(&host, "/live", "word=break&step=+").status, 400);
    post(&host, "/live", "word=break&step=4");
    post(&host, "/live", "word=clear&step=act");
    assert_eq!(get(&host, "/live.json").json()["stops"], serde_json::json!(["4"]));
    post(&host, "/live", "word=continue");
    let fourth = waits_before(&host, 4);
    assert_eq!(post(&host, "/live", "word=break&step=3").status, 400, "that is over");
    assert!(fourth.contains("Paused at <span class=\"call\">4</span>"), "{fourth}");
    assert!(fourth.contains("continue to the next breakpoint"), "{fourth}");
    post(&host, "/live", "word=clear&step=4");
    post(&host, "/live", "word=continue");
    assert_eq!(run.join().unwrap(), [1, 2, 3, 4, 5]);
}

/// A picture is shown once the recorder, which is told first, has written it.
#[test]
fn a_picture_of_a_live_run_is_shown_when_it_is_whole() {
    let cell = cell("page-pictures");
    let host = host(&cell.page);
    let scratch = Scratch::new("page-pictures-run");
    let (mut lead, mut watch) = (Lead::new(cell.live.clone()), Watch(cell.live.clone()));
    lead.begins("pour(jar, cup)", Some(&scratch.path("runs/now-pour")));
    let picture = |name: &str| {
        scratch.file(&format!("runs/now-pour/frames/{name}.png"), "a picture");
        Event::picture(name, &image::RgbImage::new(1, 1))
    };
    let address = "/run/now-pour/frames/01-before-real.png";
    let event = picture("01-before-real");
    assert_eq!(get(&host, address).status, 404, "it may still be written");
    watch.event(&event);
    assert_eq!(get(&host, address).status, 200);
    assert!(get(&host, "/live").text().contains(address));
    assert!(!get(&host, "/live").text().contains("01-before-twin.png"));
}

#[test]
fn after_a_step_that_failed_the_run_waits_before_anything_is_done_about_it() {
    let cell = cell("page-failed");
    let host = host(&cell.page);
    let scratch = Scratch::new("page-failed-run");
    kept::lay_out(&scratch);
    let run = archive::load(&scratch.path("runs/20260102-110000-pour")).unwrap();
    let (done, failed) = (run.steps[0].clone(), run.steps[1].clone());
    let live = cell.live.clone();
    let led = thread::spawn(move || {
        let mut lead = Lead::new(live);
        let first = (lead.before(&ahead(1)), lead.after(&ahead(1), &done));
        (first, lead.before(&ahead(2)), lead.after(&ahead(2), &failed))
    });
    waits_before(&host, 1);
    post(&host, "/live", "word=next");
    waits_before(&host, 2);
    post(&host, "/live", "word=next");
    let waits = || get(&host, "/live.json").json()["waits"]["failed"]["number"] == 2;
    while !waits() {
        thread::sleep(Duration::from_millis(10));
    }
    let shown = get(&host, "/live").text();
    assert!(shown.contains("Step 2 failed") && !shown.contains("id=\"go-over\""), "{shown}");
    post(&host, "/live", "word=stop");
    assert_eq!(led.join().unwrap(), ((Word::Go, Word::Go), Word::Go, Word::Stop));
}

#[test]
fn stop_is_heeded_while_the_run_waits() {
    let cell = cell("page-stop");
    let host = host(&cell.page);
    let run = walk(&cell.live);
    waits_before(&host, 1);
    post(&host, "/live", "word=next");
    waits_before(&host, 2);
    post(&host, "/live", "word=stop");
    assert_eq!(run.join().unwrap(), [1]);
    assert!(cell.cancel.is_cancelled());
}
