//! A quiz over stored runs: a picture, a question, and what geometry says, the hardest last.

use std::fmt::Write as _;
use std::sync::Arc;

use crate::http::{Request, encoded};
use crate::report::html::escaped;
use crate::teach::quiz::{self, Item};
use crate::trace::StepRecord;
use crate::workcell::archive::Entry;
use crate::workcell::{Run, picture};

use super::answering;
use super::frame::View;
use super::overview::progress;
use super::site::Site;
use super::step::{At, When, pictures};

/// The page of one question.
pub(super) fn view(site: &Site, request: &Request) -> View {
    let seed = request.asked("seed").and_then(|seed| seed.parse().ok()).unwrap_or(site.seed);
    let at: usize = request.asked("at").and_then(|at| at.parse().ok()).unwrap_or(1).max(1);
    let runs = site.run_index.runs();
    let items = ordered(&runs, seed);
    let mut main = "<h1>Quiz</h1>\n".to_owned();
    let Some(item) = items.get(at - 1) else {
        main += if items.is_empty() {
            "<p>No stored run has both a question and a picture. A run made with <code>trueup run</code> or \
             <code>trueup -c</code> has.</p>\n"
        } else {
            "<p>That was the last question.</p>\n"
        };
        if !items.is_empty() {
            let _ = writeln!(
                main,
                "<p><a class=\"button\" href=\"/quiz?seed={}\">Another order</a></p>",
                seed.wrapping_add(1)
            );
        }
        main += &progress(site);
        return View::new("Quiz", "/quiz", main);
    };
    let (entry, run) = &runs[item.run];
    let (step, row) = (&run.steps[item.step], &run.steps[item.step].fluents[item.row]);
    let path = |at: usize| format!("/quiz?seed={seed}&at={at}");
    let _ = writeln!(
        main,
        "<p class=\"soft\">question {at} of {}, the hardest last · run {}, after step {}</p>",
        items.len(),
        entry.number,
        step.number
    );
    let when = At { number: step.number, when: When::After };
    main += &pictures(&entry.dir, &entry.name, when, &|_| true);
    let by = site.by();
    let is_it = |one: &&crate::teach::answers::Answered| {
        one.by == by && one.run == entry.name && one.step == step.number && one.fluent == row.name
    };
    let answers = site.answers();
    let is_told = request.asked("told").is_some();
    let said = answers.iter().rev().find(is_it).filter(|_| is_told);
    if let Some(one) = said {
        let _ = writeln!(
            main,
            "<section class=\"card\">{}<p><a class=\"button strong\" id=\"following\" data-key=\"Enter\" \
             href=\"{}\">next question <kbd>Enter</kbd></a> <a href=\"/run/{}/{}/after\">the whole step</a></p>\
             </section>",
            answering::beside(site, entry, run, one),
            escaped(&path(at + 1)),
            encoded(&entry.name),
            step.number
        );
    } else {
        let back = format!("{}&told=1", path(at));
        let _ = writeln!(
            main,
            "<section class=\"card ask\" aria-labelledby=\"question\">{}<p><a class=\"quiet\" id=\"following\" \
             href=\"{}\">skip it</a></p></section>",
            answering::ask(&entry.name, step.number, row, &back),
            escaped(&path(at + 1))
        );
    }
    main += &progress(site);
    let mut view = View::new(format!("Quiz, question {at}"), "/quiz", main);
    view.says = row.ask.clone().unwrap_or_default();
    view
}

/// Returns all questions that have a picture, easy ones first.
fn ordered(runs: &[(Entry, Arc<Run>)], seed: u64) -> Vec<Item> {
    let steps: Vec<&[StepRecord]> = runs.iter().map(|(_, run)| run.steps.as_slice()).collect();
    let has_picture = |run: usize, step: &StepRecord| {
        let name = format!("{:02}-after-real", step.number);
        picture::file(&runs[run].0.dir, &name).is_file()
    };
    quiz::ordered(&steps, &has_picture, seed)
}
