//! A what-if in words: what was tried from a past step, and how it came out beside the run.

use std::fmt::Write as _;

use crate::trace::{Cause, Outcome};
use crate::workcell::fork::{Fork, ForkedStep};

use super::Style;

/// Words a what-if.
pub fn told(fork: &Fork, style: Style) -> String {
    let what = match &fork.call {
        Some(call) => call.clone(),
        None => format!("the rest of {}", fork.task),
    };
    let mut text = format!(
        "what if, from where step {} left off: {what}\n  in the twin only, best of {} rehearsals; the arm \
         does not move\n",
        fork.after, fork.tried
    );
    for step in &fork.steps {
        text += &line(step, fork.call.is_none(), style);
    }
    let end = if fork.success { "all of it would be done" } else { "it would not be done" };
    let _ =
        write!(text, "  {end}: {:.0} s of arm time, {:.1} mL spilt", fork.time_s, fork.spilt_ml);
    let recalls = fork.steps.iter().filter_map(|step| step.failure.as_ref());
    let recalls =
        recalls.into_iter().any(|failure| matches!(failure.cause, Cause::NotRemembered { .. }));
    if recalls && !fork.remembers {
        text += "\n  what actions remember for later ones is in no record: it is known for the last run of \
                 this session that did a step, so begin from a step before the one that finds it";
    }
    text
}

fn line(step: &ForkedStep, is_rest: bool, style: Style) -> String {
    let sign = match step.outcome {
        Outcome::Success if step.not_needed.is_some() => "–".to_owned(),
        Outcome::Success => style.green("✓"),
        Outcome::Failure => style.red("✗"),
        Outcome::Stopped => "◦".to_owned(),
    };
    let beside = match (step.same_as, step.otherwise.len()) {
        _ if !is_rest => String::new(),
        (None, _) => "the run did not come to it".to_owned(),
        (Some(_), 0) => format!("as in the run ({} fluents)", step.compared),
        (Some(_), n) => format!("{n} of {} fluents other than in the run", step.compared),
    };
    let head = format!("{:>2}  {:<44} {:>5.1} s   {beside}", step.number, step.action, step.took_s);
    let mut text = format!("{sign} {}\n", head.trim_end());
    if let Some(reason) = &step.reason {
        let _ = writeln!(text, "       {reason}");
    }
    for row in &step.otherwise {
        let word = |truth| if truth { "yes" } else { "no" };
        let _ = writeln!(
            text,
            "       {:<42} here {}, in the run {}",
            row.name,
            word(row.here),
            word(row.came)
        );
    }
    text
}
