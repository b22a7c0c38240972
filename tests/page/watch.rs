//! A run that is looked at while it goes on: what the page shows of it, and that it waits for nobody.

use std::sync::Arc;
use std::time::{Duration, Instant};

use trueup::page::{Onlooker, Options, Page, Screen};
use trueup::trace::{Event, Observer, Still, Tryout};
use trueup::workcell::archive;

use super::{get, host};
use crate::program::Scratch;
use crate::repl::kept;

/// A page that shows a run, and who watches the run for it.
pub(super) fn watched(scratch: &Scratch) -> (Page, Arc<Screen>, Onlooker) {
    let screen = Arc::new(Screen::default());
    screen.begin("pour(jar, cup)");
    let page = Page::watch(options(scratch), screen.clone()).unwrap();
    (page, screen.clone(), Onlooker(screen))
}

fn options(scratch: &Scratch) -> Options {
    Options {
        root: scratch.path("runs"),
        answers: scratch.path("runs/answers.jsonl"),
        port: 0,
        seed: 1,
        place: Box::new(|_| None),
    }
}

/// A moment of a pour.
pub(super) fn still(number: usize, cup_ml: f64, picture: &[u8]) -> Event {
    let picture = picture.to_vec();
    Event::Still(Arc::new(Still {
        number,
        time: 0.2 * number as f64,
        step: 8,
        real: Some(picture.clone()),
        twin: Some(picture),
        water: vec![("jar".into(), (150.0 - cup_ml) * 1e-6), ("cup".into(), cup_ml * 1e-6)],
        spilt: 0.0,
    }))
}

fn tryout(number: usize, went: Option<Result<(), String>>) -> Event {
    let (name, picture) = (format!("level_side #{number}"), Some(vec![9; 4]));
    Event::Tryout(Arc::new(Tryout { number, of: 4, name, picture, went }))
}

#[test]
fn the_page_shows_pictures_fluents_water_and_rehearsals_as_they_come() {
    let scratch = Scratch::new("page-watch");
    kept::lay_out(&scratch);
    let (page, screen, mut onlooker) = watched(&scratch);
    let host = host(&page);
    assert_eq!(get(&host, "/watch/real.jpg").status, 404, "there is none yet");
    let before = get(&host, "/watch").text();
    assert!(before.contains("None is measured before the first step has ended"), "{before}");
    assert!(before.contains("http-equiv=\"refresh\""), "without scripts it reads itself again");

    onlooker.event(&tryout(1, None));
    onlooker.event(&tryout(2, Some(Err("the jar <slipped>".into()))));
    onlooker.event(&still(1, 0.0, &[1; 5]));
    onlooker.event(&still(2, 60.0, &[2; 5]));
    let run = archive::load(&scratch.path("runs/20260102-110000-pour")).unwrap();
    onlooker.event(&Event::StepEnd { record: Box::new(run.steps[0].clone()) });
    let shown = get(&host, "/watch/state?after=0").text();
    assert!(
        shown.contains("failed: the jar &lt;slipped&gt;") && shown.contains("goes on"),
        "{shown}"
    );
    assert!(shown.contains("cup 60 mL") && shown.contains("jar 90 mL"), "{shown}");
    assert!(!shown.contains("spilt"), "what is not there is not drawn: {shown}");
    let row = run.steps[0].fluents.iter().find(|row| row.measured == Some(true)).unwrap();
    assert!(shown.contains(&row.name.replace('>', "&gt;")), "{shown}");
    assert_eq!(get(&host, "/watch/twin.jpg?n=2").body, [2; 5]);
    assert_eq!(get(&host, "/watch/tryout/2.jpg").body, [9; 4]);
    assert_eq!(get(&host, "/watch/tryout/3.jpg").status, 404);
    let version = shown.split("data-version=\"").nth(1).unwrap().split('"').next().unwrap();
    assert_eq!(get(&host, &format!("/watch/state?after={version}")).status, 204, "nothing new");

    // Rehearsals of another attempt take the place of those before.
    onlooker.event(&tryout(1, Some(Ok(()))));
    onlooker.event(&tryout(1, None));
    assert!(!get(&host, "/watch/state").text().contains("slipped"));

    scratch.file("runs/now/report.html", "<p>the report</p>");
    screen.ended("done: pour(jar, cup)", Some(scratch.path("runs/now/report.html")));
    let over = get(&host, "/watch").text();
    assert!(over.contains("done: pour(jar, cup)") && over.contains("data-over"), "{over}");
    assert!(over.contains("href=\"/watch/report.html\"") && !over.contains("refresh"), "{over}");
    assert_eq!(get(&host, "/watch/report.html").text(), "<p>the report</p>");
}

#[test]
fn at_a_prompt_one_run_follows_the_other_until_it_is_left() {
    let scratch = Scratch::new("page-watch-prompt");
    let screen = Arc::new(Screen::of_prompt());
    let page = Page::watch(options(&scratch), screen.clone()).unwrap();
    let host = host(&page);
    assert!(get(&host, "/watch").text().contains("Nothing runs yet"));
    for task in ["pick(jar)", "place(jar)"] {
        screen.begin(task);
        screen.ended(&format!("done: {task}"), None);
        let shown = get(&host, "/watch").text();
        assert!(
            shown.contains(&format!("done: {task}")) && !shown.contains("data-over"),
            "{shown}"
        );
    }
    screen.part();
    assert!(get(&host, "/watch").text().contains("data-over"));
}

#[test]
#[expect(clippy::disallowed_methods, reason = "how long somebody is waited for is what is tested")]
fn a_run_that_ends_waits_for_a_browser_that_looks_and_for_no_other() {
    let scratch = Scratch::new("page-watch-end");
    let (page, screen, _onlooker) = watched(&scratch);
    let host = host(&page);
    screen.ended("done", None);
    let begin = Instant::now();
    screen.part();
    assert!(begin.elapsed() < Duration::from_secs(1), "nobody looks");
    get(&host, "/watch/state?after=0");
    let waits = std::thread::spawn(move || screen.part());
    // What it has is told with the next question.
    let shown = get(&host, "/watch/state").text();
    let version =
        shown.split("data-version=\"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    get(&host, &format!("/watch/state?after={version}"));
    let begin = Instant::now();
    waits.join().unwrap();
    assert!(begin.elapsed() < Duration::from_secs(2), "the browser has the end");
}
