//! The questions after a step: asked blind, then set beside geometry's answer, with hints that help a little
//! more each.

use std::fmt::Write as _;

use crate::http::{Request, Response};
use crate::report::html::{self, escaped};
use crate::report::why;
use crate::teach::answers::{Answer, Answered};
use crate::trace::{FluentRow, StepRecord};
use crate::workcell::Run;
use crate::workcell::archive::Entry;

use super::site::Site;

/// The questions after one step, and where one is with them.
pub(super) struct Questions<'a> {
    entry: &'a Entry,
    run: &'a Run,
    step: &'a StepRecord,
    /// Those that nobody has answered, unless they were seen.
    pub(super) open: Vec<&'a FluentRow>,
    /// The last answer to each of the others.
    pub(super) answered: Vec<Answered>,
}

impl<'a> Questions<'a> {
    /// Looks up, among all answers there are, what was answered to the questions after a step.
    pub(super) fn of(
        site: &Site,
        answers: &[Answered],
        (entry, run): (&'a Entry, &'a Run),
        step: &'a StepRecord,
    ) -> Self {
        let by = site.by();
        let is_this = |one: &Answered| {
            one.by == by
                && one.run == entry.name
                && one.step == step.number
                && one.path == step.path
        };
        let kept: Vec<&Answered> = answers.iter().filter(|one| is_this(one)).collect();
        let may_ask = site.asks() && !site.has_seen(&entry.name, step.number);
        let (mut open, mut answered) = (Vec::new(), Vec::new());
        for row in step.fluents.iter().filter(|row| row.ask.is_some()) {
            match kept.iter().rev().find(|one| one.fluent == row.name) {
                Some(one) => answered.push((*one).clone()),
                None if may_ask => open.push(row),
                None => {}
            }
        }
        Self { entry, run, step, open, answered }
    }

    /// Returns the question that is asked now and what came of those before; `back` is where an answer
    /// leads.
    pub(super) fn card(&self, site: &Site, back: &str) -> String {
        let all = self.open.len() + self.answered.len();
        let mut text = String::new();
        if let Some(row) = self.open.first() {
            let _ = write!(
                text,
                "<section class=\"card ask\" aria-labelledby=\"question\">\n\
                 <p class=\"soft\">question {} of {all}, by the camera's picture; geometry's answers are \
                 shown when all are answered</p>\n{}\
                 <form method=\"post\" action=\"/show\"><input type=\"hidden\" name=\"run\" value=\"{}\">\
                 <input type=\"hidden\" name=\"step\" value=\"{}\"><input type=\"hidden\" name=\"back\" \
                 value=\"{}\"><button class=\"quiet\">Show the answers of this step instead</button></form>\n\
                 {}</section>\n",
                self.answered.len() + 1,
                ask(&self.entry.name, self.step.number, row, back),
                escaped(&self.entry.name),
                self.step.number,
                escaped(back),
                turn(false, back)
            );
        }
        if !self.answered.is_empty() {
            text += "<section class=\"card\"><h2>Your answers beside geometry's</h2>\n";
            for one in self.answered.iter().rev() {
                text += &beside(site, self.entry, self.run, one);
            }
            text += "</section>\n";
        }
        text
    }
}

/// A button that turns asking on or off.
pub(super) fn turn(on: bool, back: &str) -> String {
    let (value, said) =
        if on { ("yes", "Ask me before showing answers") } else { ("no", "Just look: never ask") };
    format!(
        "<form method=\"post\" action=\"/asks\"><input type=\"hidden\" name=\"back\" value=\"{}\">\
         <button class=\"quiet\" name=\"asks\" value=\"{value}\">{said}</button></form>\n",
        escaped(back)
    )
}

/// The question and its three buttons.
pub(super) fn ask(run: &str, step: usize, row: &FluentRow, back: &str) -> String {
    let question = row.ask.as_deref().unwrap_or(&row.name);
    let mut text = format!(
        "<h2 id=\"question\">{}</h2>\n<form method=\"post\" action=\"/answer\" class=\"buttons\">\n",
        escaped(question)
    );
    let step = step.to_string();
    let hidden = [("run", run), ("step", &step), ("fluent", &row.name), ("back", back)];
    for (name, value) in hidden {
        let _ =
            writeln!(text, "<input type=\"hidden\" name=\"{name}\" value=\"{}\">", escaped(value));
    }
    for (word, sign, key) in [("yes", "✓", "y"), ("no", "✗", "n"), ("can't tell", "?", "u")] {
        let _ = writeln!(
            text,
            "<button class=\"big\" id=\"say-{key}\" name=\"answer\" value=\"{word}\" data-key=\"{key}\" \
             aria-keyshortcuts=\"{key}\" aria-describedby=\"question\"><span aria-hidden=\"true\">{sign}</span> {word} \
             <kbd>{key}</kbd></button>"
        );
    }
    text += "</form>\n";
    text
}

/// An answer set beside geometry's, with the ladder of hints.
pub(super) fn beside(site: &Site, entry: &Entry, run: &Run, one: &Answered) -> String {
    let margin = html::margin(one.margin.as_ref(), one.std.as_ref());
    let margin = if margin.is_empty() { margin } else { format!(" ({margin})") };
    let (class, sign, verdict) = match (one.answer, one.geometry) {
        (said, Answer::CannotTell) => (
            "unknown",
            "?",
            format!(
                "You said {}. Geometry cannot tell{margin}, so it is not counted.",
                said.words()
            ),
        ),
        (said, is) if said == is => {
            ("yes", "✓", format!("You said {}, and so does geometry{margin}.", said.words()))
        }
        (Answer::CannotTell, is) => {
            ("unknown", "?", format!("You could not tell. Measured: {}{margin}.", is.words()))
        }
        (said, is) => (
            "no",
            "✗",
            format!(
                "Your answer: {}. Measured: {}{margin}. Both are kept.",
                said.words(),
                is.words()
            ),
        ),
    };
    let twin = match (one.twin, one.geometry) {
        (twin, is) if twin == is => String::new(),
        (twin, _) => format!(" The twin: {}.", twin.words()),
    };
    let mut text = format!(
        "<div class=\"beside {class}\"><p><b><span aria-hidden=\"true\">{sign}</span> {}</b><br>{verdict}{twin}</p>\n",
        escaped(&one.question)
    );
    let rungs = site.why(entry, run, &one.fluent, |question| why::hints(question, one.step));
    for (i, (about, rung)) in rungs.unwrap_or_default().iter().enumerate() {
        let _ = writeln!(
            text,
            "<details class=\"hint\" id=\"hint-{}-{}-{i}\"><summary>hint {}: {about}</summary><pre>{}</pre></details>",
            one.step,
            escaped(&one.fluent).replace(' ', ""),
            i + 1,
            escaped(rung)
        );
    }
    text += "</div>\n";
    text
}

/// Keeps an answer that was sent.
pub(super) fn keep(site: &Site, request: &Request) -> Result<(), Response> {
    let missing = |what: &str| Response::text(400, &format!("the answer lacks its {what}"));
    let run = request.sent("run").ok_or_else(|| missing("run"))?;
    let fluent = request.sent("fluent").ok_or_else(|| missing("fluent"))?;
    let answer = request.sent("answer").and_then(|word| Answer::parse(&word));
    let answer = answer.ok_or_else(|| Response::text(400, "say yes, no or can't tell"))?;
    let number: Option<usize> = request.sent("step").and_then(|step| step.parse().ok());
    let entry =
        site.run_index.entry(&run).ok_or_else(|| Response::text(404, "there is no such run"))?;
    let run = site
        .run_index
        .run(&entry.dir)
        .ok_or_else(|| Response::text(404, "the run cannot be read"))?;
    let step = run.steps.iter().find(|step| Some(step.number) == number);
    let step = step.ok_or_else(|| Response::text(404, "the run has no such step"))?;
    site.keep(&entry.name, step, &fluent, answer)
}
