//! A run as one self-contained HTML page: pictures of both worlds, fluents with their margins, the course of the run over
//! time, the graph, the questions. It needs nothing from outside; without JavaScript every step is shown, one below the
//! other, and with it one slider goes through them and lights the step in the drawings.

use std::fmt::Write as _;

use crate::monitor::questionnaire::Answer;
use crate::trace::{FluentRow, StepRecord};
use crate::workcell::Run;
use crate::workcell::film::Film;

use super::html::{self, escaped};
use super::run::ending;
use super::{Style, course, plot, why};

/// What a page is made of beside the run itself.
#[derive(Default)]
pub struct Material<'a> {
    /// The drawing of the graph, an SVG document.
    pub graph: Option<&'a str>,
    /// The text of its `arm.csv`; empty when nothing was recorded.
    pub arm: &'a str,
    /// The table of its film.
    pub film: Film,
    /// Returns a picture as a `data:` address, by its name without ending: `03-after-real`.
    pub picture: Option<Picture<'a>>,
}

/// A name to a `data:` address, where there is such a picture.
pub type Picture<'a> = &'a dyn Fn(&str) -> Option<String>;

/// What the slider needs beside the look of every page.
const BAR: &str = "#go{position:sticky;top:0;z-index:1;background:var(--paper);padding:.5rem 0;display:none;\
border-bottom:1px solid var(--line)}#go label{display:flex;gap:.6em;align-items:center}#go input{flex:1;\
accent-color:var(--accent)}";

/// Shows one step at a time; what it does without is to show them all.
const SLIDE: &str = "const steps=[...document.querySelectorAll('section.step')],go=document.getElementById(\
'go'),at=go.querySelector('input'),says=go.querySelector('output');function show(){steps.forEach((s,i)=>\
{s.hidden=i!=at.value});const now=steps[at.value];says.value=now.querySelector('h2').textContent;document.\
querySelectorAll('.here').forEach(e=>e.classList.remove('here'));document.querySelectorAll('[data-step=\"'+now.\
dataset.number+'\"],.graph [data-path=\"'+CSS.escape(now.dataset.path)+'\"]').forEach(e=>e.classList.add('here'))}\
if(steps.length){go.style.display='block';at.max=steps.length-1;at.oninput=show;show();document.addEventListener(\
'click',e=>{const i=steps.findIndex(s=>s.dataset.number==e.target.dataset?.step);if(i>=0){at.value=i;show()}})}";

/// Returns the page.
pub fn page(run: &Run, material: &Material<'_>) -> String {
    let plain = Style { json: false, quiet: false, verbose: false, colour: false, bars: false };
    let asked = why::Question { run, number: None, fluent: None, earlier: &[], place: &|_| None };
    let reason = why::why(&asked).unwrap_or_else(|failure| failure.message);
    let mut text = format!(
        "<style>{BAR}{}{}</style>\n<h1 class=\"call\">{}</h1>\n\
         <p class=\"soft\">with {}, seed {}, version {}</p>\n<pre>{}</pre>\n\
         <section class=\"card\"><h2>Why</h2><pre>{}</pre></section>\n\
         <div id=\"go\"><label>step <input type=\"range\" min=\"0\" value=\"0\"></label> \
         <output></output></div>\n",
        plot::STYLE,
        course::STYLE,
        escaped(&run.task),
        escaped(&run.robot),
        run.seed,
        escaped(&run.version),
        escaped(&ending(run, plain)),
        escaped(&reason),
    );
    let course = course::drawings(run, material.arm, &material.film);
    let mut before: &[FluentRow] = &[];
    for (i, record) in run.steps.iter().enumerate() {
        let questions = run.questions.get(i).map_or(&[][..], Vec::as_slice);
        step(record, before, questions, material, &mut text);
        before = &record.fluents;
    }
    text += &course;
    if let Some(graph) = material.graph {
        let _ = write!(
            text,
            "<section class=\"card\"><h2>Graph</h2>\n{}</section>\n",
            html::graph(graph, &|_| None)
        );
    }
    html::with_script(&run.task, &text, SLIDE)
}

fn step(
    record: &StepRecord,
    before: &[FluentRow],
    questions: &[Answer],
    material: &Material<'_>,
    text: &mut String,
) {
    let _ = writeln!(
        text,
        "<section class=\"step card\" data-number=\"{}\" data-path=\"{}\"><h2>{} <span class=\"call\">{}</span>: \
         {}</h2>\n{}",
        record.number,
        escaped(&record.path),
        record.number,
        escaped(&record.action),
        html::outcome(record),
        html::score(record)
    );
    if let Some(reason) = &record.reason {
        let _ = writeln!(text, "<p><b>{}</b></p>", escaped(reason));
    }
    if let Some(picture) = material.picture {
        for when in ["before", "after"] {
            let named = |whose: &str| picture(&format!("{:02}-{when}-{whose}", record.number));
            *text += &html::pictures(when, &named);
        }
    }
    *text += &html::fluents(&record.fluents, before, &|_| None);
    if !questions.is_empty() {
        *text += "<h2>Questions, answered by geometry</h2>\n<div class=\"scroll\"><table><thead><tr>\
                  <th scope=\"col\">question<th scope=\"col\">twin<th scope=\"col\">measured";
        let has_model = questions.iter().any(|answer| !answer.by.is_empty());
        if has_model {
            *text += "<th scope=\"col\">by a model";
        }
        *text += "</tr></thead>\n<tbody>\n";
        for answer in questions {
            let _ = write!(
                text,
                "<tr><th scope=\"row\">{}<td>{}<td>{}",
                escaped(&answer.question),
                html::truth(answer.twin),
                html::truth(answer.measured)
            );
            if has_model {
                let said = answer.by.iter().map(|reply| {
                    let why = reply.why.as_ref().or(reply.evidence.as_ref());
                    let why = why.map(|why| format!(" ({why})")).unwrap_or_default();
                    escaped(&format!("{}: {}{why}", reply.on.name(), reply.answer.name()))
                });
                let _ = write!(text, "<td>{}", said.collect::<Vec<_>>().join("<br>"));
            }
            *text += "</tr>\n";
        }
        *text += "</tbody></table></div>\n";
    }
    *text += "</section>\n";
}
