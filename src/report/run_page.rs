//! A run as one self-contained HTML page: pictures of both worlds, fluents with their margins, the graph, the
//! questions. It needs nothing from outside; without JavaScript every step is shown, one below the other,
//! and with it one slider goes through them.

use std::fmt::Write as _;

use crate::execution::trace::{FluentRow, Measure, Outcome, StepRecord};
use crate::monitor::questionnaire::Answer;
use crate::workcell::Run;

use super::run::{ending, people};
use super::{Style, escaped, why};

/// What a page is made of beside the run itself.
#[derive(Default)]
pub struct Material<'a> {
    /// The drawing of the graph, an SVG document.
    pub graph: Option<&'a str>,
    /// Returns a picture as a `data:` address, by its name without ending: `03-after-real`.
    pub picture: Option<Picture<'a>>,
}

/// A name to a `data:` address, where there is such a picture.
pub type Picture<'a> = &'a dyn Fn(&str) -> Option<String>;

const LOOK: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:1.5em auto;padding:0 1em;\
color:#222;background:#fff}pre{background:#f6f6f4;padding:1em;overflow-x:auto;font-size:13px;white-space:\
pre-wrap}table{border-collapse:collapse;width:100%;font-size:14px}td,th{text-align:left;padding:.15em .6em;\
border-bottom:1px solid #8884}.differs{background:#c332}.pair{display:flex;gap:.6em}.pair figure{margin:.4em \
0;flex:1;min-width:0}.pair img{width:100%}figcaption{font-size:13px}#go{position:sticky;top:0;background:\
inherit;padding:.4em 0;display:none}#go input{width:70%}.graph{overflow-x:auto;background:#fff}section{\
margin:1.5em 0}@media(prefers-color-scheme:dark){body{color:#ddd;background:#181818}pre{background:#222}}";

/// Shows one step at a time; what it does without is to show them all.
const SLIDE: &str = "const steps=[...document.querySelectorAll('section.step')],go=document.getElementById(\
'go'),at=go.querySelector('input'),says=go.querySelector('output');function show(){steps.forEach((s,i)=>\
{s.hidden=i!=at.value});says.value=steps[at.value].querySelector('h2').textContent}if(steps.length){go.style\
.display='block';at.max=steps.length-1;at.oninput=show;show()}";

/// Returns the page.
pub fn page(run: &Run, material: &Material<'_>) -> String {
    let plain = Style { json: false, quiet: false, colour: false, bars: false };
    let asked = why::Question { run, number: None, fluent: None, earlier: &[], place: &|_| None };
    let reason = why::why(&asked).unwrap_or_else(|failure| failure.message);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{task}</title>\
         <style>{LOOK}</style></head><body>\n<h1>{task}</h1>\n\
         <p>with {}, seed {}, version {}</p>\n<pre>{}</pre>\n<h2>Why</h2><pre>{}</pre>\n",
        escaped(&run.robot),
        run.seed,
        escaped(&run.version),
        escaped(&ending(run, plain)),
        escaped(&reason),
        task = escaped(&run.task),
    );
    text += "<div id=\"go\"><label>step <input type=\"range\" min=\"0\" value=\"0\"></label> \
             <output></output></div>\n";
    for (i, record) in run.steps.iter().enumerate() {
        let questions = run.questions.get(i).map_or(&[][..], Vec::as_slice);
        step(record, questions, material, &mut text);
    }
    if let Some(graph) = material.graph {
        // The drawing is a document of its own; in a page it begins at its root.
        let root = graph.find("<svg").map_or(graph, |at| &graph[at..]);
        let _ = writeln!(text, "<h2>Graph</h2><div class=\"graph\">{root}</div>");
    }
    let _ = writeln!(text, "<script>{SLIDE}</script></body></html>");
    text
}

fn step(record: &StepRecord, questions: &[Answer], material: &Material<'_>, text: &mut String) {
    let ended = match record.outcome {
        Outcome::Success => "done",
        Outcome::Failure => "failed",
        Outcome::Stopped => "stopped",
    };
    let _ = writeln!(
        text,
        "<section class=\"step\"><h2>{} {}: {ended}</h2>\n<p>{:.1} s of arm time; twin and measurement \
         differ in {} fluents, P = exp(-{}) = {:.2}</p>",
        record.number,
        escaped(&record.action),
        record.interval_s[1] - record.interval_s[0],
        record.hamming,
        record.hamming,
        record.score
    );
    if let Some(reason) = &record.reason {
        let _ = writeln!(text, "<p><b>{}</b></p>", escaped(reason));
    }
    for when in ["before", "after"] {
        pictures(record.number, when, material, text);
    }
    *text += "<table><tr><th>fluent<th>expected<th>twin<th>measured<th>margin<th>margin in the twin</tr>\n";
    for row in &record.fluents {
        fluent(row, text);
    }
    *text += "</table>\n";
    if !questions.is_empty() {
        *text += "<table><tr><th>question<th>twin<th>measured</tr>\n";
        for answer in questions {
            let _ = writeln!(
                text,
                "<tr><td>{}<td>{}<td>{}</tr>",
                escaped(&answer.question),
                told(answer.twin),
                told(answer.measured)
            );
        }
        *text += "</table>\n";
    }
    *text += "</section>\n";
}

fn pictures(number: usize, when: &str, material: &Material<'_>, text: &mut String) {
    let Some(picture) = material.picture else { return };
    let found: Vec<(&str, String)> = ["real", "twin"]
        .into_iter()
        .filter_map(|whose| Some((whose, picture(&format!("{number:02}-{when}-{whose}"))?)))
        .collect();
    if found.is_empty() {
        return;
    }
    *text += "<div class=\"pair\">";
    for (whose, address) in found {
        let _ = write!(
            text,
            "<figure><img alt=\"{when} the step, {whose}\" src=\"{address}\">\
             <figcaption>{when} the step, {whose}</figcaption></figure>"
        );
    }
    *text += "</div>\n";
}

fn fluent(row: &FluentRow, text: &mut String) {
    let differs = matches!((row.twin, row.measured), (Some(a), Some(b)) if a != b)
        || matches!((row.expected, row.measured), (Some(a), Some(b)) if a != b);
    let margin = |margin: Option<&Measure>| margin.map(people).unwrap_or_default();
    let std = row.std.as_ref().map(|std| {
        let size = people(std);
        format!(" ± {}", size.trim_start_matches('+'))
    });
    let _ = writeln!(
        text,
        "<tr{}><td>{}<td>{}<td>{}<td>{}<td>{}{}<td>{}</tr>",
        if differs { " class=\"differs\"" } else { "" },
        escaped(&row.name),
        row.expected.map_or("", |truth| told(Some(truth))),
        told(row.twin),
        told(row.measured),
        margin(row.margin.as_ref()),
        std.unwrap_or_default(),
        margin(row.twin_margin.as_ref()),
    );
}

fn told(truth: Option<bool>) -> &'static str {
    match truth {
        Some(true) => "yes",
        Some(false) => "no",
        None => "unknown",
    }
}
