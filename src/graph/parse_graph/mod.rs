//! Parse graphs: one choice at every Or, written out as the steps an executor walks.
//!
//! A parse graph is a value: it is stored, compared, and matched node by node with another by path. The
//! conditions of a task are spread over its steps (`needs` before its first, `gives` after its last), so
//! whoever walks the steps checks everything without looking at the tree.

mod realise;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::fluent::{self, Question};
use super::{Does, Pause, Role};
use crate::language::ast::{Allen, Expr, Remedy, Span};
use crate::language::text;

pub(super) use realise::{Taken, realise};

/// One way a graph can be carried out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParseGraph {
    /// The call, defaults filled in.
    pub call: String,
    /// What was chosen, in the order met from the top.
    pub choices: Vec<Choice>,
    /// What to do, in order.
    pub steps: Vec<Step>,
    /// When steps and sub-tasks are to lie relative to each other, by path.
    pub timings: Vec<Timing>,
    /// What to do when a step fails; steps point into this list.
    pub recoveries: Vec<RecoveryPlan>,
    /// Natural logarithm of the probability of these choices under the priors, given the guards.
    pub log_p: f64,
}

/// One branch taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Path of the Or.
    pub node: String,
    /// Name of the branch.
    pub branch: String,
    /// What learnt counts hang on: `pick/either.side`.
    pub key: String,
    /// Fingerprint of the branch's text, hexadecimal: JSON numbers lose such digits elsewhere.
    pub text: String,
    /// Its probability among the branches that were possible.
    pub p: f64,
    /// The branches that were possible.
    pub possible: Vec<String>,
    /// Whether people choose here, so that outcomes count.
    pub is_free: bool,
    /// Whether a person asked for this branch, with `via`. Records of older programs do not say.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_asked: bool,
    /// What a decided Or took for granted: the condition, and whether it was known to be so.
    pub assumed: Option<Assumption>,
}

/// A condition that decided a branch before the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Assumption {
    /// The condition.
    pub expr: Expr,
    /// The condition as text.
    pub text: String,
    /// What it was taken to be.
    pub value: bool,
    /// Whether somebody knew, or it was a guess.
    pub is_known: bool,
}

/// A condition that a step must meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// As text, arguments filled in: `above(jar, cup)`.
    pub text: String,
    /// The condition, closed.
    pub expr: Expr,
    /// Path of the node that asks for it.
    pub owner: String,
    /// What it is to that node.
    pub role: Role,
    /// The questions it puts to a person or a model.
    pub asks: Vec<Question>,
}

/// One terminal, ready to be carried out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Its path in the graph.
    pub path: String,
    /// `grasp(jar, side)`.
    pub text: String,
    /// What it does.
    pub does: Does,
    /// The rhai script it runs, for an action.
    pub script: Option<String>,
    /// The time it may take, s: its own limit.
    pub limit: Option<f64>,
    /// The time the tasks around it may take, outermost first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<TimeLimit>,
    /// Checked before, outermost task first.
    pub needs: Vec<Condition>,
    /// Must hold throughout: `keeps` and `while`.
    pub keeps: Vec<Condition>,
    /// Checked after, innermost first. A `check` asks its fluent here.
    pub gives: Vec<Condition>,
    /// Any of them ends the step when it becomes true.
    pub untils: Vec<Condition>,
    /// Any of them true on arrival: the step is not needed and is passed over.
    pub unless: Vec<Condition>,
    /// Indices into [`ParseGraph::recoveries`], innermost first.
    pub recoveries: Vec<usize>,
    /// Path of the `together` it is part of, innermost.
    pub together: Option<String>,
    /// A breakpoint in the text stands before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause: Option<Pause>,
    /// The bytes it came from, in the file of the task `within`.
    pub span: Span,
    /// The task it is written in.
    pub within: String,
}

/// The time a task may take, from the beginning of its first step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimeLimit {
    /// Path of the task.
    pub owner: String,
    /// As a call: `pick(jar)`.
    pub text: String,
    /// How long, s.
    pub seconds: f64,
}

/// A temporal relation by path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// First.
    pub a: String,
    /// Which.
    pub relation: Allen,
    /// Second.
    pub b: String,
    /// By how much, s.
    pub by: Option<f64>,
}

/// An `on failure` clause, arguments filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecoveryPlan {
    /// Path of its Or.
    pub path: String,
    /// Whose failure, as text; any when `None`.
    pub of: Option<String>,
    /// Path of the node whose steps it covers.
    pub covers: String,
    /// What to do first.
    pub steps: Vec<Step>,
    /// What then.
    pub remedy: Option<Remedy>,
}

/// Steps of two parse graphs that are the same node, by index, and those that are in one alone.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Matched {
    /// In both: index in the first, index in the second.
    pub both: Vec<(usize, usize)>,
    /// In the first alone.
    pub only_first: Vec<usize>,
    /// In the second alone.
    pub only_second: Vec<usize>,
}

impl ParseGraph {
    /// Returns the branch taken at the Or of that path.
    pub fn branch(&self, node: &str) -> Option<&str> {
        self.choices.iter().find(|c| c.node == node).map(|c| c.branch.as_str())
    }

    /// Returns the choices that people make, as pins for another parse of the same graph.
    pub fn pins(&self) -> BTreeMap<String, String> {
        let free = self.choices.iter().filter(|choice| choice.is_free);
        free.map(|choice| (choice.node.clone(), choice.branch.clone())).collect()
    }

    /// Returns the indices of the steps at or below a path.
    pub fn steps_of(&self, path: &str) -> impl Iterator<Item = usize> {
        let inside =
            self.steps.iter().enumerate().filter(move |(_, s)| is_at_or_below(&s.path, path));
        inside.map(|(i, _)| i)
    }

    /// Matches the steps of two parse graphs by path: the twin's and the arm's.
    ///
    /// Structural differences (another branch, a shorter run) are told apart, never folded into a score.
    pub fn matched(&self, other: &Self) -> Matched {
        let mut matched = Matched::default();
        for (i, step) in self.steps.iter().enumerate() {
            match other.steps.iter().position(|theirs| theirs.path == step.path) {
                Some(j) => matched.both.push((i, j)),
                None => matched.only_first.push(i),
            }
        }
        let is_lone = |j: &usize| matched.both.iter().all(|(_, theirs)| theirs != j);
        matched.only_second = (0..other.steps.len()).filter(is_lone).collect();
        matched
    }

    /// Returns every fluent the steps speak of, once each, as text: the fluent vector of 5.2.
    pub fn fluents(&self) -> Vec<Expr> {
        let mut found: Vec<Expr> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for step in &self.steps {
            for condition in step.needs.iter().chain(&step.keeps).chain(&step.gives) {
                for (atom, _) in fluent::atoms(&condition.expr) {
                    if seen.insert(text::expr(atom)) {
                        found.push(atom.clone());
                    }
                }
            }
        }
        found
    }
}

/// Returns whether `path` is `above` or lies below it.
pub fn is_at_or_below(path: &str, above: &str) -> bool {
    path.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with(['/', '.']))
}
