//! The questions of stored runs with all their answers and, where somebody knows it, the truth.
//!
//! The truth is an expert's label where there is one, else geometry's reading, which says nothing below twice
//! its standard deviation. A trainee's answer and a model's are never the truth.

use std::collections::BTreeMap;

use crate::teach::answers::{Answer, Answered, EXPERT, is_expert};
use crate::trace::{FluentRow, Measure, StepRecord};
use crate::vqa::score::{Case, GEOMETRY};
use crate::vqa::{Line, On, Said};

use super::Run;

/// A run that is over, with what was answered about it elsewhere.
pub struct Kept<'a> {
    /// The name of its folder.
    pub name: &'a str,
    /// The run.
    pub run: &'a Run,
    /// What models were asked afterwards.
    pub lines: &'a [Line],
    /// What people answered, about any run.
    pub people: &'a [Answered],
}

/// Returns every question of a run about every picture.
pub fn cases(kept: &Kept<'_>) -> Vec<Case> {
    let mut found = Vec::new();
    for (i, step) in kept.run.steps.iter().enumerate() {
        for row in step.fluents.iter().filter(|row| row.ask.is_some()) {
            for on in [On::Real, On::Twin] {
                // A step that was not rehearsed has no picture of the twin.
                if on == On::Real || step.twin.is_some() {
                    found.push(case(kept, i, step, row, on));
                }
            }
        }
    }
    found
}

fn case(kept: &Kept<'_>, i: usize, step: &StepRecord, row: &FluentRow, on: On) -> Case {
    let geometry = geometry(row, on);
    let mut answers = BTreeMap::from([(GEOMETRY.to_owned(), Said::of(geometry))]);
    let mut label = None;
    let about = |answered: &&Answered| {
        answered.run == kept.name
            && answered.step == step.number
            && answered.fluent == row.name
            && answered.on == on
    };
    for answered in kept.people.iter().filter(about) {
        if is_expert(&answered.by) {
            // The last label counts: an expert may think again.
            label = Some(answered.answer);
        } else {
            // The first answer counts: it was given blind.
            answers.entry(answered.by.clone()).or_insert_with(|| said(answered.answer));
        }
    }
    let during = kept.run.questions.get(i).into_iter().flatten();
    let during = during.filter(|asked| asked.fluent == row.name).flat_map(|asked| asked.by.iter());
    let after = kept.lines.iter().filter_map(|line| match line {
        Line::Answer { step: number, fluent, reply, .. }
            if *number == step.number && *fluent == row.name =>
        {
            Some(reply)
        }
        _ => None,
    });
    for reply in during.chain(after).filter(|reply| reply.on == on) {
        answers.insert(reply.by.clone(), reply.answer);
    }
    let (truth, truth_by) = match label {
        // An expert who cannot tell either leaves the picture without a truth.
        Some(answer) => (said(answer).truth(), EXPERT),
        None => (geometry, GEOMETRY),
    };
    Case {
        question: row.name.split('(').next().unwrap_or_default().to_owned(),
        moment: format!("{}/{}/{}", kept.name, step.number, row.name),
        seed: kept.run.seed,
        on,
        truth,
        truth_by,
        answers,
    }
}

/// What geometry says where it may: not within twice the standard deviation of its margin.
fn geometry(row: &FluentRow, on: On) -> Option<bool> {
    match on {
        On::Twin => row.twin,
        On::Real => {
            let size = |measure: &Option<Measure>| measure.as_ref().map(|m| m.value.abs());
            let is_close = match (size(&row.margin), size(&row.std)) {
                (Some(margin), Some(std)) => margin < 2.0 * std,
                _ => false,
            };
            row.measured.filter(|_| !is_close)
        }
    }
}

fn said(answer: Answer) -> Said {
    match answer {
        Answer::Yes => Said::Yes,
        Answer::No => Said::No,
        Answer::CannotTell => Said::Unsure,
    }
}
