//! What no step explains, over runs: a table for a terminal and one for a page.

use std::fmt::Write as _;

use crate::monitor::changes::{Change, Count, Kind};

use super::html::escaped;
use super::{Style, why};

/// Most rows of what is not in the twin.
const MOST: usize = 12;

/// Most names of what both have.
const NAMES: usize = 4;

/// Words what no step explains, over so many runs.
pub fn people(changes: &[Change], runs: usize, style: Style) -> String {
    let mut text = String::new();
    let (shared, own): (Vec<&Change>, Vec<&Change>) =
        changes.iter().partition(|change| change.kind == Kind::Undeclared);
    let _ =
        writeln!(text, "fluents of {} beside their twins, steps matched by name", several(runs));
    if own.is_empty() {
        let _ = writeln!(
            text,
            "  every change was declared by a step, or happened in the twin as well"
        );
    } else {
        let cells: Vec<[String; 4]> = own.iter().take(MOST).map(|change| cells(change)).collect();
        let head = ["not explained", "arm", "twin", "after step"].map(str::to_owned);
        let wide = |at: usize| {
            let long = |row: &[String; 4]| row[at].chars().count();
            cells.iter().chain([&head]).map(long).max().unwrap_or(0)
        };
        let widths = [wide(0), wide(1), wide(2), wide(3)];
        let line = |row: &[String; 4]| {
            let padded = row.iter().zip(widths).map(|(cell, wide)| format!("{cell:<wide$}"));
            padded.collect::<Vec<_>>().join("   ")
        };
        let _ = writeln!(text, "  {}", style.dim(line(&head).trim_end()));
        for (row, change) in cells.iter().zip(&own) {
            let _ = writeln!(text, "  {}   {}", line(row), name(change.kind));
        }
        if own.len() > MOST {
            let _ = writeln!(text, "  and {} more; `--json` has them all", own.len() - MOST);
        }
    }
    if !shared.is_empty() {
        let mut names: Vec<&str> = Vec::new();
        for change in &shared {
            if !names.contains(&change.fluent.as_str()) {
                names.push(&change.fluent);
            }
        }
        let rest = if names.len() > NAMES { ", …" } else { "" };
        names.truncate(NAMES);
        let line = format!(
            "  {} happened in both and are not declared in the tasks: {}{rest}",
            changes_of(shared.len()),
            names.join(", ")
        );
        let _ = writeln!(text, "{}", style.dim(&line));
    }
    text
}

/// Returns the same as a section of a page; empty without changes.
pub fn table(changes: &[Change], runs: usize) -> String {
    if changes.is_empty() {
        return String::new();
    }
    let mut rows = String::new();
    for change in changes {
        let [what, measured, twin, step] = cells(change).map(|cell| escaped(&cell));
        let _ = writeln!(
            rows,
            "<tr><td>{what}</td><td>{measured}</td><td>{twin}</td><td>{step}</td><td>{}</td></tr>",
            name(change.kind)
        );
    }
    format!(
        "<section class=\"card\"><h2>What no step explains, in {}</h2>\n<table><thead><tr><th>fluent</th>\
         <th>arm</th><th>twin</th><th>after step</th><th>which is</th></tr></thead>\n<tbody>\n{rows}</tbody>\
         </table></section>\n",
        several(runs)
    )
}

fn cells(change: &Change) -> [String; 4] {
    let size = change.margin.as_ref().map_or_else(String::new, |m| format!(" by {}", why::size(m)));
    let what = match (change.kind, change.becomes) {
        (Kind::Failed, true) => format!("{} should be true, is false{size}", change.fluent),
        (Kind::Failed, false) => format!("{} should be false, is true{size}", change.fluent),
        (_, becomes) => format!("{} becomes {becomes}{size}", change.fluent),
    };
    let count = |count: Count| format!("{} of {}", count.had, count.of);
    let step = format!("{} {}", change.number, change.step);
    [what, count(change.measured), count(change.twin), step]
}

fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Missing => "missing effect: not in the twin",
        Kind::Failed => "failed effect: declared, did not come about",
        Kind::Phantom => "phantom effect: in the twin only",
        Kind::Undeclared => "undeclared effect: the twin has it, no `gives` says so",
    }
}

fn several(runs: usize) -> String {
    if runs == 1 { "1 run".into() } else { format!("{runs} runs") }
}

fn changes_of(n: usize) -> String {
    if n == 1 { "1 change".into() } else { format!("{n} changes") }
}
