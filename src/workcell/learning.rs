//! What earlier runs teach: which branches worked, kept in an append-only file per domain.
//!
//! A run says of a branch it took that it worked when its last step did, and that it failed for each step
//! in it that did. What happened on an arm is counted apart from what happened in the twin. Files are read
//! and written by the caller.

use crate::graph::outcome::Outcome;
use crate::graph::{Outcomes, ParseGraph, Priors};

use super::Run;
use crate::trace;

/// What is known from earlier runs.
#[derive(Debug, Clone, Default)]
pub struct Learnt {
    /// How often branches worked.
    pub outcomes: Outcomes,
    /// How people choose, where they have shown it.
    pub priors: Option<Priors>,
    /// Whose outcomes count: `real` or `twin`.
    pub domain: String,
    /// Whether to try branches in proportion to how likely they are the best, rather than the best known.
    pub explore: bool,
}

/// Returns whose outcomes a robot's runs are: `twin` for the simulation alone, else `real`.
pub fn domain(robot: &str) -> &'static str {
    if robot == "twin" { "twin" } else { "real" }
}

/// Returns the name of a domain's file: `outcomes-real.jsonl`.
pub fn file_name(domain: &str) -> String {
    format!("outcomes-{domain}.jsonl")
}

/// Returns what a run says of the branches it took, under the name `run`.
pub fn outcomes(run: &Run, name: &str) -> Vec<Outcome> {
    let mut found: Vec<Outcome> = Vec::new();
    let mut seen: Vec<String> = Vec::new();
    for pg in &run.parse_graphs {
        for choice in pg.choices.iter().filter(|choice| choice.is_free) {
            let branch = format!("{}.{}", choice.node, choice.branch);
            if seen.contains(&branch) {
                continue;
            }
            let told = tries(run, pg, &branch).into_iter().map(|worked| Outcome {
                branch: choice.key.clone(),
                text: choice.text.clone(),
                domain: domain(&run.robot).to_owned(),
                worked,
                run: name.to_owned(),
            });
            found.extend(told);
            seen.push(branch);
        }
    }
    found
}

/// Whether each try of a branch worked; a try that was cut short by a person is none, nor is one of which no
/// step was needed.
fn tries(run: &Run, pg: &ParseGraph, branch: &str) -> Vec<bool> {
    let Some(last) = pg.steps_of(branch).last().map(|at| pg.steps[at].path.as_str()) else {
        return Vec::new();
    };
    let inside = run.steps.iter().filter(|step| {
        step.path.strip_prefix(branch).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    });
    let (mut tries, mut was_begun) = (Vec::new(), false);
    for step in inside {
        was_begun |= step.was_carried_out();
        let worked = match step.outcome {
            trace::Outcome::Failure => Some(false),
            trace::Outcome::Success => (step.path == last).then_some(true),
            trace::Outcome::Stopped => None,
        };
        if let Some(worked) = worked
            && std::mem::take(&mut was_begun)
        {
            tries.push(worked);
        }
    }
    tries
}
