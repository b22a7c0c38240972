//! How a fluent fared before: earlier in the same run, and after the same step of earlier runs.

use std::fmt::Write as _;

use crate::trace::{FluentRow, Measure, StepRecord};
use crate::workcell::Run;

use super::super::run::people;
use super::Question;

/// From how many runs on a margin that keeps its sign may be called a bias.
const ENOUGH_RUNS: usize = 3;

pub(super) fn in_this_run(run: &Run, step: &StepRecord, row: &FluentRow) -> String {
    let mut text = format!("after step {} {}", step.number, step.action);
    match row.expected {
        Some(wanted) => {
            let wanted = if wanted { "true" } else { "false" };
            let _ = write!(text, ", which should have made it {wanted}");
        }
        None => text += ", which promised nothing about it",
    }
    let margin = row.twin_margin.as_ref().map(|m| format!(" ({})", people(m))).unwrap_or_default();
    let twin = match row.twin {
        Some(true) => format!("true{margin}"),
        Some(false) => format!("false too{margin}"),
        None => String::new(),
    };
    if twin.is_empty() {
        text += "; the twin had nothing to say of it";
    } else {
        let _ = write!(text, "; the twin had it {twin}");
    }
    if row.measured == Some(false) {
        let before = run.steps.iter().take_while(|earlier| earlier.number < step.number);
        let was = before.filter(|earlier| {
            earlier.fluents.iter().any(|r| r.name == row.name && r.measured == Some(true))
        });
        match was.last() {
            Some(earlier) => {
                let _ = write!(text, "; it was last true after step {}", earlier.number);
            }
            None => text += "; it was never true in this run",
        }
    }
    text
}

/// The same fluent after the same step, in earlier runs.
pub(super) fn history(
    question: &Question<'_>,
    step: &StepRecord,
    row: &FluentRow,
) -> Option<String> {
    let same = |run: &Run| -> Option<FluentRow> {
        let there = run.steps.iter().find(|s| s.path == step.path)?;
        there.fluents.iter().find(|r| r.name == row.name).cloned()
    };
    let rows: Vec<FluentRow> = question.earlier.iter().filter_map(|(_, run)| same(run)).collect();
    if rows.is_empty() {
        return None;
    }
    let count = |truth| rows.iter().filter(|row| row.measured == truth).count();
    let runs = if rows.len() == 1 { "run" } else { "runs" };
    let mut text = format!(
        "in {} earlier {runs} this step ended with it true {}, false {}, unknown {}",
        rows.len(),
        times(count(Some(true))),
        times(count(Some(false))),
        times(count(None))
    );
    let unit = row.margin.as_ref().map(|margin| margin.unit.as_str())?;
    let margins: Vec<f64> = rows
        .iter()
        .chain([row])
        .filter_map(|row| row.margin.as_ref())
        .filter(|margin| margin.unit == unit)
        .map(|margin| margin.value)
        .collect();
    if margins.len() < 2 {
        return Some(text);
    }
    let at = |value: f64| people(&Measure { value, unit: unit.to_owned() });
    let least = margins.iter().copied().fold(f64::INFINITY, f64::min);
    let most = margins.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let _ = write!(text, "; with this one the margins are {} to {}", at(least), at(most));
    if is_bias(&margins) {
        text += ": a bias, not chance";
    }
    Some(text)
}

/// Whether margins of one sign are further from zero than their scatter explains: the mean is beyond two
/// standard errors.
fn is_bias(margins: &[f64]) -> bool {
    let n = margins.len() as f64;
    let mean = margins.iter().sum::<f64>() / n;
    let spread = margins.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    margins.len() >= ENOUGH_RUNS
        && margins.iter().all(|margin| *margin < 0.0)
        && mean.abs() > 2.0 * (spread / n).sqrt()
}

fn times(n: usize) -> String {
    match n {
        0 => "never".to_owned(),
        1 => "once".to_owned(),
        n => format!("{n} times"),
    }
}
