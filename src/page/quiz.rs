//! A quiz over stored runs: a picture, a question, and what geometry says, the hardest last.
//!
//! Questions come in three thirds by how far their margin is from zero beside others of the same unit, and
//! in a seeded order within each. What geometry cannot tell comes at the very end, and is not counted.

use std::fmt::Write as _;
use std::sync::Arc;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;

use crate::execution::trace::FluentRow;
use crate::http::{Request, encoded};
use crate::report::html::escaped;
use crate::workcell::Run;
use crate::workcell::archive::Entry;

use super::answering;
use super::frame::View;
use super::overview::progress;
use super::site::{Site, picture_file};
use super::step::{At, When, pictures};

/// One question of the quiz.
struct Item {
    /// Which of the runs.
    run: usize,
    /// Which of its steps, from 0.
    step: usize,
    /// Which of that step's fluents, from 0.
    row: usize,
}

/// The page of one question.
pub(super) fn view(site: &Site, request: &Request) -> View {
    let seed = request.asked("seed").and_then(|seed| seed.parse().ok()).unwrap_or(site.seed);
    let at: usize = request.asked("at").and_then(|at| at.parse().ok()).unwrap_or(1).max(1);
    let runs = site.shelf.runs();
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
    let mut found: Vec<(Item, &FluentRow)> = Vec::new();
    for (r, (entry, run)) in runs.iter().enumerate() {
        for (s, step) in run.steps.iter().enumerate() {
            let name = format!("{:02}-after-real", step.number);
            if !picture_file(&entry.dir, &name).is_file() {
                continue;
            }
            let asked = step.fluents.iter().enumerate().filter(|(_, row)| row.ask.is_some());
            found.extend(asked.map(|(f, row)| (Item { run: r, step: s, row: f }, row)));
        }
    }
    let rows: Vec<&FluentRow> = found.iter().map(|(_, row)| *row).collect();
    let mut thirds: [Vec<Item>; 4] = Default::default();
    for (item, row) in found {
        thirds[hardness(row, &rows)].push(item);
    }
    let mut chance = StdRng::seed_from_u64(seed);
    for third in &mut thirds {
        third.shuffle(&mut chance);
    }
    thirds.into_iter().flatten().collect()
}

/// Returns how hard a question is, from 0: how many thirds of the margins of its unit are further from zero.
/// What is yes or no without any margin is easy, what nobody can tell is hardest.
fn hardness(row: &FluentRow, rows: &[&FluentRow]) -> usize {
    if row.measured.is_none() {
        return 3;
    }
    let Some(margin) = &row.margin else { return 0 };
    let others = rows.iter().filter_map(|other| other.margin.as_ref());
    let same: Vec<f64> =
        others.filter(|other| other.unit == margin.unit).map(|other| other.value.abs()).collect();
    let further = same.iter().filter(|size| **size > margin.value.abs()).count();
    (3 * further / same.len().max(1)).min(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::execution::trace::Measure;

    fn row(margin: Option<f64>, measured: Option<bool>) -> FluentRow {
        FluentRow {
            name: "above(jar, cup)".into(),
            expected: None,
            twin: measured,
            measured,
            margin: margin.map(|value| Measure { value, unit: "m".into() }),
            twin_margin: None,
            ask: Some("Is it?".into()),
            why: None,
            std: None,
            direction: None,
            terms: Vec::new(),
        }
    }

    #[test]
    fn margins_near_zero_are_hard_and_unknown_is_hardest() {
        let sizes = [0.09, -0.08, 0.07, 0.03, -0.02, 0.001].map(|m| row(Some(m), Some(m > 0.0)));
        let rows: Vec<&FluentRow> = sizes.iter().collect();
        let hard: Vec<usize> = rows.iter().map(|row| hardness(row, &rows)).collect();
        assert_eq!(hard, [0, 0, 1, 1, 2, 2]);
        assert_eq!(hardness(&row(None, Some(true)), &rows), 0);
        assert_eq!(hardness(&row(Some(0.5), None), &rows), 3);
    }
}
