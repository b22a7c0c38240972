//! One moment of a run, before or after a step: pictures, questions, fluents, and the graph with the step lit.

use std::fmt::Write as _;
use std::path::Path;

use crate::files::read;
use crate::graph::Condition;
use crate::http::encoded;
use crate::report::Style;
use crate::report::html::{self, escaped};
use crate::report::{run::ending, why};
use crate::teach::answers::Answered;
use crate::trace::{Outcome, StepRecord};
use crate::workcell::archive::Entry;
use crate::workcell::{Run, picture};

use super::answering::{Questions, turn};
use super::frame::View;
use super::site::Site;

/// Before or after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum When {
    Before,
    After,
}

impl When {
    pub(super) fn parse(word: &str) -> Option<Self> {
        match word {
            "before" => Some(Self::Before),
            "after" => Some(Self::After),
            _ => None,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::After => "after",
        }
    }
}

/// One stop of the slider.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct At {
    pub(super) number: usize,
    pub(super) when: When,
}

impl At {
    pub(super) fn path(self, run: &str) -> String {
        format!("/run/{}/{}/{}", encoded(run), self.number, self.when.word())
    }
}

/// Words without colours.
const PLAIN: Style =
    Style { json: false, quiet: false, verbose: false, colour: false, bars: false };

/// A run that ended before its first step.
fn nothing_done(run: &Run) -> View {
    let (task, how) = (escaped(&run.task), escaped(&ending(run, PLAIN)));
    View::new(&run.task, "/", format!("<h1>{task}</h1>\n<pre>{how}</pre>\n"))
}

/// A moment of a run that is kept.
pub(super) fn view(site: &Site, entry: &Entry, at: At, why: Option<&str>) -> View {
    let Some(run) = site.run_index.run(&entry.dir) else {
        return View::missing(
            "This run cannot be read",
            "Its `run.json` is not one, or not whole.",
        );
    };
    if run.steps.is_empty() {
        return nothing_done(&run);
    }
    let Some(step) = run.steps.iter().find(|step| step.number == at.number) else {
        let help = format!("It has {} steps.", run.steps.len());
        return View::missing("The run has no such step", &help);
    };
    let here = at.path(&entry.name);
    let is_whole = |name: &str| site.is_whole(&entry.name, name);
    let moment = Moment {
        site,
        entry,
        run: &run,
        step,
        at,
        here: &here,
        answers: site.answers(),
        is_whole: &is_whole,
    };
    let mut main = format!(
        "<h1 class=\"call\">{} <small>run {}, {}, with {}, seed {}</small></h1>\n",
        escaped(&run.task),
        entry.number,
        escaped(&entry.name),
        escaped(&run.robot),
        run.seed
    );
    if let Some(live) = site.live.as_ref().filter(|live| live.now().run() == Some(&entry.name)) {
        let _ = writeln!(
            main,
            "<p class=\"banner\">Looking at step {} of the live run; the arm does not move for it. It is \
             now {}. <a href=\"/live\">Back to now</a></p>",
            at.number,
            escaped(&live.now().doing)
        );
    }
    main += &moment.transport();
    main += &moment.body(why);
    let _ = writeln!(
        main,
        "<details class=\"card\" id=\"ending\"><summary>How the run ended</summary><pre>{}</pre></details>",
        escaped(&ending(&run, PLAIN))
    );
    let title = format!("step {} {}: {}", at.number, at.when.word(), run.task);
    let mut view = View::new(title, "", main);
    view.says =
        format!("{} step {} of {}: {}", at.when.word(), at.number, run.steps.len(), step.action);
    view.soon = moment.soon();
    view
}

/// One moment of a run, to be shown.
pub(super) struct Moment<'a> {
    pub(super) site: &'a Site,
    pub(super) entry: &'a Entry,
    pub(super) run: &'a Run,
    pub(super) step: &'a StepRecord,
    pub(super) at: At,
    /// The path of the page it is on.
    pub(super) here: &'a str,
    /// All answers there are.
    pub(super) answers: Vec<Answered>,
    /// Says of a picture whether it is whole.
    pub(super) is_whole: &'a dyn Fn(&str) -> bool,
}

impl Moment<'_> {
    fn questions<'b>(&'b self, step: &'b StepRecord) -> Questions<'b> {
        Questions::of(self.site, &self.answers, (self.entry, self.run), step)
    }

    /// The stops of the slider, in order.
    fn stops(&self) -> Vec<At> {
        let whens = [When::Before, When::After];
        let steps = self.run.steps.iter();
        steps.flat_map(|step| whens.map(|when| At { number: step.number, when })).collect()
    }

    /// The slider, what it does without scripts, and the list of steps.
    fn transport(&self) -> String {
        let stops = self.stops();
        let here = stops.iter().position(|stop| *stop == self.at).unwrap_or(0);
        let link = |i: Option<usize>, id: &str, said: &str| match i.and_then(|i| stops.get(i)) {
            Some(stop) => format!(
                "<a class=\"button\" id=\"{id}\" href=\"{}\">{said}</a>",
                escaped(&stop.path(&self.entry.name))
            ),
            None => format!("<span class=\"button off\" id=\"{id}\">{said}</span>"),
        };
        let mut text = format!(
            "<nav class=\"transport\" aria-label=\"steps\">\n<div class=\"bar\">{}\
             <label class=\"js slider\"><span class=\"aside\">moment of the run</span>\
             <input type=\"range\" id=\"slider\" min=\"0\" max=\"{}\" value=\"{here}\" data-run=\"/run/{}\" \
             data-numbers=\"{}\" aria-valuetext=\"{} step {}\"></label>{}</div>\n\
             <p class=\"where\">{} step {} of {}: <b class=\"call\">{}</b></p>\n<ol class=\"steps\">\n",
            link(here.checked_sub(1), "previous", "<span aria-hidden=\"true\">←</span> back"),
            stops.len().saturating_sub(1),
            encoded(&self.entry.name),
            self.run.steps.iter().map(|s| s.number.to_string()).collect::<Vec<_>>().join(" "),
            self.at.when.word(),
            self.at.number,
            link(Some(here + 1), "following", "forward <span aria-hidden=\"true\">→</span>"),
            self.at.when.word(),
            self.at.number,
            self.run.steps.len(),
            escaped(&self.step.action)
        );
        for step in &self.run.steps {
            let questions = self.questions(step);
            // How a step ended would give answers away.
            let sign = match (questions.open.is_empty(), step.outcome) {
                (false, _) => "",
                (true, Outcome::Success) if !step.was_carried_out() => "–",
                (true, Outcome::Success) => "✓",
                (true, Outcome::Failure) => "✗",
                (true, Outcome::Stopped) => "◦",
            };
            let current = if step.number == self.at.number { " aria-current=\"step\"" } else { "" };
            let at = At { number: step.number, when: When::After };
            let _ = writeln!(
                text,
                "<li><a href=\"{}\" title=\"{}\"{current}>{}<span>{sign}</span></a></li>",
                escaped(&at.path(&self.entry.name)),
                escaped(&step.action),
                step.number
            );
        }
        text += "</ol>\n</nav>\n";
        text
    }

    /// Pictures, questions, fluents, and the graph.
    pub(super) fn body(&self, why: Option<&str>) -> String {
        let mut text = pictures(&self.entry.dir, &self.entry.name, self.at, self.is_whole);
        match self.at.when {
            When::Before => text += &self.before(),
            When::After => {
                let questions = self.questions(self.step);
                text += &self.after(&questions);
                if let Some(fluent) = why {
                    text += &self.why(fluent, questions.open.is_empty());
                }
            }
        }
        let current = Some((self.step.path.as_str(), self.step.action.as_str()));
        text += &graph(&self.entry.dir, current, &self.trail());
        text
    }

    /// What the step needs, keeps and gives, as planned.
    fn before(&self) -> String {
        let plans = self.run.parse_graphs.iter().rev();
        let planned = plans
            .flat_map(|pg| &pg.steps)
            .find(|step| step.path == self.step.path && step.text == self.step.action);
        let Some(planned) = planned else { return String::new() };
        let list = |all: &[Condition]| {
            let each = all.iter().map(|condition| condition.text.clone());
            each.collect::<Vec<_>>()
        };
        format!(
            "<section class=\"card\"><h2>What step {} is to do</h2>\n{}</section>\n",
            self.step.number,
            conditions(&list(&planned.needs), &list(&planned.keeps), &list(&planned.gives))
        )
    }

    /// The questions; and all there is to know of the step, once it would give nothing away.
    fn after(&self, questions: &Questions<'_>) -> String {
        let mut text = questions.card(self.site, self.here);
        if !questions.open.is_empty() {
            return text;
        }
        self.site.saw(&self.entry.name, self.step.number);
        let _ = write!(
            text,
            "<section class=\"card\"><h2>What is true after step {}: {}</h2>\n{}",
            self.step.number,
            html::outcome(self.step),
            html::score(self.step)
        );
        if let Some(reason) = &self.step.reason {
            let _ = writeln!(text, "<p><b>{}</b></p>", escaped(reason));
        }
        let earlier = self.run.steps.iter().take_while(|step| step.number < self.step.number);
        let before = earlier.last().map_or(&[][..], |step| &step.fluents);
        let more = |row: &crate::trace::FluentRow| {
            Some(format!("{}?why={}#why", self.here, encoded(&row.name)))
        };
        text += &html::fluents(&self.step.fluents, before, &more);
        text += "<p class=\"soft\">The name of a fluent leads to why it is so.</p>\n";
        if !self.site.asks() {
            text += &turn(true, self.here);
        }
        text += "</section>\n";
        text
    }

    fn why(&self, fluent: &str, may_tell: bool) -> String {
        if !may_tell {
            return String::new();
        }
        let told = self
            .site
            .why(self.entry, self.run, fluent, |question| why::of_step(question, self.at.number));
        let told = told.unwrap_or_else(|failure| failure.message);
        format!(
            "<section class=\"card\" id=\"why\" tabindex=\"-1\"><h2>Why <span class=\"call\">{}</span></h2>\n\
             <pre>{}</pre>\n<p><a href=\"{}\">Close</a></p></section>\n",
            escaped(fluent),
            escaped(&told),
            escaped(self.here)
        )
    }

    /// The steps up to here and how they ended, where that gives nothing away.
    fn trail(&self) -> Vec<(String, &'static str)> {
        let so_far = self.run.steps.iter().filter(|step| step.number < self.at.number);
        let class = |step: &StepRecord| {
            let questions = self.questions(step);
            match step.outcome {
                _ if !questions.open.is_empty() || !step.was_carried_out() => "passed",
                Outcome::Success => "done",
                Outcome::Failure | Outcome::Stopped => "failed",
            }
        };
        so_far.map(|step| (step.path.clone(), class(step))).collect()
    }

    /// Pictures of the next stop and of the one before.
    fn soon(&self) -> Vec<String> {
        let stops = self.stops();
        let here = stops.iter().position(|stop| *stop == self.at).unwrap_or(0);
        let near = [here + 1, here.wrapping_sub(1), here + 2];
        let near = near.iter().filter_map(|i| stops.get(*i));
        let names = near.flat_map(|at| ["real", "twin"].map(|whose| name(*at, whose)));
        names.map(|name| address(&self.entry.dir, &self.entry.name, &name)).collect()
    }
}

/// The name of a picture without ending, as the recorder gives it.
fn name(at: At, whose: &str) -> String {
    format!("{:02}-{}-{whose}", at.number, at.when.word())
}

/// Where a picture of the run in folder `dir` is to be had.
fn address(dir: &Path, run: &str, name: &str) -> String {
    let file = picture::file(dir, name);
    let file = file.file_name().unwrap_or_default().to_string_lossy();
    format!("/run/{}/frames/{file}", encoded(run))
}

/// The pictures of a moment; `is_whole` says of a name whether its file is written by now.
pub(super) fn pictures(dir: &Path, run: &str, at: At, is_whole: &dyn Fn(&str) -> bool) -> String {
    html::pictures(at.when.word(), &|whose| {
        let name = name(at, whose);
        let is_there = is_whole(&name) && picture::file(dir, &name).is_file();
        is_there.then(|| address(dir, run, &name))
    })
}

/// The run's graph with a node lit, and the steps before it marked.
pub(super) fn graph(
    dir: &Path,
    lit: Option<(&str, &str)>,
    trail: &[(String, &'static str)],
) -> String {
    let Ok(drawing) = read::text(&dir.join("graph.svg")) else { return String::new() };
    let mark = |path: &str| match lit {
        Some((lit, _)) if lit == path => Some("lit"),
        Some((lit, _))
            if lit.strip_prefix(path).is_some_and(|rest| rest.starts_with(['/', '.'])) =>
        {
            Some("around")
        }
        _ => trail.iter().rfind(|(done, _)| done == path).map(|(_, class)| *class),
    };
    let said = match lit {
        Some((_, action)) => format!("; framed: <span class=\"call\">{}</span>", escaped(action)),
        None => String::new(),
    };
    format!(
        "<section class=\"card\"><h2>Where this is in the task{said}</h2>\n{}</section>\n",
        html::graph(&drawing, &mark)
    )
}

/// A list of lines.
pub(super) fn list(class: &str, lines: &[String]) -> String {
    let each: Vec<String> = lines.iter().map(|line| escaped(line)).collect();
    format!("<ul class=\"{class}\"><li>{}</li></ul>", each.join("</li><li>"))
}

/// What a step needs, keeps and gives.
pub(super) fn conditions(needs: &[String], keeps: &[String], gives: &[String]) -> String {
    let kinds = [("needs", needs), ("keeps", keeps), ("makes true", gives)];
    let mut text = String::new();
    for (word, all) in kinds.iter().filter(|(_, all)| !all.is_empty()) {
        let _ = writeln!(text, "<dt>{word}<dd>{}", list("call", all));
    }
    match text.as_str() {
        "" => "<p class=\"soft\">It needs nothing and promises nothing.</p>\n".to_owned(),
        text => format!("<dl class=\"conditions\">\n{text}</dl>\n"),
    }
}
