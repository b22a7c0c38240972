//! How well questions are answered, in words: the paper's Table 3, and a row for each kind of question.

use std::collections::BTreeMap;

use crate::vqa::score::{GEOMETRY, Group, Row, Table};
use crate::vqa::{Probe, Said};

use super::grid::{Form, Grid};

/// Returns the table in a form; `probes` are what models said of a blank picture, `command` repeats it all.
pub fn table(table: &Table, probes: &[Probe], command: &str, form: Form) -> String {
    match form {
        Form::Csv => details(table, form).form(form),
        Form::Markdown if table.groups.is_empty() => bases(table).form(form),
        Form::Markdown => [paper(table).form(form), details(table, form).form(form)].join("\n\n"),
        Form::Text => {
            let mut text = String::new();
            if table.groups.is_empty() {
                text += "no answers to score yet\n\n";
                text += &bases(table).form(form);
                text += "\n\n";
            } else {
                text += &paper(table).form(form);
                text += "\n\n";
                text += &details(table, form).form(form);
                text += "\n\n";
            }
            text += &notes(table, probes).join("\n");
            text + "\nagain: " + command
        }
    }
}

/// What there is to answer.
fn bases(table: &Table) -> Grid {
    let mut grid = Grid::new(2, &["question", "where", "n", "yes"]);
    for base in &table.bases {
        let (on, n) = (base.on.name().to_owned(), base.n.to_string());
        grid.rows.push(vec![base.question.clone(), on, n, base.yes.to_string()]);
    }
    grid
}

/// Everything together, as the paper has it.
pub(super) fn paper(table: &Table) -> Grid {
    let mut grid = Grid::new(
        1,
        &[
            "answered by",
            "real P",
            "R",
            "F1",
            "simulation P",
            "R",
            "F1",
            "overall P",
            "R",
            "F1",
            "consistency",
        ],
    );
    for group in table.groups.iter().filter(|group| group.question.is_none()) {
        let mut cells = vec![group.by.clone()];
        for on in ["real", "twin", "both"] {
            let row = group.rows.iter().find(|row| row.on == on);
            let of = |value: fn(&Row) -> Option<f64>| percent(row.and_then(value));
            cells.extend([of(|r| r.precision), of(|r| r.recall), of(|r| r.f1)]);
        }
        cells.push(percent(group.agreement.share));
        grid.rows.push(cells);
    }
    grid
}

/// One line a kind of question, who answers and which picture.
fn details(table: &Table, form: Form) -> Grid {
    let mut grid = Grid::new(
        3,
        &[
            "question",
            "answered by",
            "where",
            "n",
            "yes",
            "P",
            "R",
            "F1",
            "95% F1",
            "unsure",
            "unparsed",
            "pairs",
            "agree twin/real",
            "kappa",
        ],
    );
    for group in &table.groups {
        for (i, row) in group.rows.iter().enumerate() {
            // A table for programs says everything in every row.
            let is_first = i == 0 || form == Form::Csv;
            let digits = if form == Form::Csv { 4 } else { 2 };
            grid.rows.push(line(group, row, is_first, digits));
        }
    }
    grid
}

fn line(group: &Group, row: &Row, is_first: bool, digits: usize) -> Vec<String> {
    let number = |value: Option<f64>| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let first = |text: String| if is_first { text } else { String::new() };
    let agreement = group.agreement;
    vec![
        first(group.question.clone().unwrap_or_else(|| "all".to_owned())),
        first(group.by.clone()),
        row.on.to_owned(),
        row.n.to_string(),
        number(row.base_rate),
        number(row.precision),
        number(row.recall),
        number(row.f1),
        row.f1_95.map_or_else(
            || "-".to_owned(),
            |[low, high]| format!("{low:.digits$}-{high:.digits$}"),
        ),
        row.counts.unsure.to_string(),
        row.counts.unparsed.to_string(),
        first(agreement.pairs.to_string()),
        first(number(agreement.share)),
        first(number(agreement.kappa)),
    ]
}

fn notes(table: &Table, probes: &[Probe]) -> Vec<String> {
    let truth: Vec<String> =
        table.truth_by.iter().map(|(by, count)| format!("{count} by {by}")).collect();
    let truth = if truth.is_empty() { "none".to_owned() } else { truth.join(", ") };
    let mut notes = vec![
        "the positive class is yes; unsure and unparsed lower recall and never enter precision"
            .to_owned(),
        format!(
            "{} questions about pictures of {} {}; true answers: {truth}; {} without one are left out",
            table.questions,
            table.laboratories,
            if table.laboratories == 1 { "laboratory" } else { "laboratories" },
            table.without_truth
        ),
    ];
    if !table.groups.iter().any(|group| group.by == GEOMETRY) && !table.truth_by.is_empty() {
        notes.push(
            "geometry is the truth here and is not judged by itself; `trueup vqa label RUN` gives it a judge"
                .to_owned(),
        );
    }
    match table.laboratories {
        0 | 1 => notes.push("intervals need runs of at least two seeds".to_owned()),
        few @ 2..10 => notes.push(format!(
            "intervals drawn from {few} laboratories come out too narrow; ten or more say something"
        )),
        _ => {}
    }
    for probe in probes {
        let mut said: BTreeMap<&str, usize> = BTreeMap::new();
        for blank in &probe.blank {
            *said.entry(blank.answer.name()).or_default() += 1;
        }
        let said: Vec<String> =
            said.iter().map(|(word, count)| format!("{count} {word}")).collect();
        notes.push(format!("vlm:{} on a blank picture: {}", probe.model, said.join(", ")));
    }
    notes
}

/// Words what a probe found.
pub fn probe(probe: &Probe) -> String {
    let mut lines = vec![format!("{} at {}", probe.model, probe.endpoint)];
    let models =
        if probe.models.is_empty() { "not told".to_owned() } else { probe.models.join(", ") };
    lines.push(format!("models served: {models}"));
    for check in &probe.checks {
        let expected =
            check.expected.map_or(String::new(), |said| format!(", expected {}", said.name()));
        let why = check.why.as_ref().map_or(String::new(), |why| format!(" ({why})"));
        lines.push(format!(
            "{}  {}{why}{expected}, {:.2} s",
            check.question,
            check.answer.name(),
            check.latency_s
        ));
    }
    lines.push(if probe.sees {
        "it tells red from blue: it sees the picture".to_owned()
    } else {
        "it does not tell red from blue: its answers say nothing about a picture".to_owned()
    });
    lines.push(if probe.keeps_form {
        "the form of a reply is enforced".to_owned()
    } else {
        "the form of a reply is not enforced: expect unparsed answers".to_owned()
    });
    for blank in &probe.blank {
        lines.push(format!("blank picture: {}  {}", blank.question, blank.answer.name()));
    }
    let guesses = probe.blank.iter().filter(|blank| blank.answer.truth().is_some()).count();
    if guesses > 0 {
        lines.push(format!(
            "{guesses} of {} questions are answered {} or {} where nothing is to be seen: it guesses",
            probe.blank.len(),
            Said::Yes.name(),
            Said::No.name()
        ));
    }
    lines.join("\n")
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{:.1} %", value * 100.0))
}
