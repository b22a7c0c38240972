//! Parse graphs: one choice at every Or, written out as the steps an executor walks.
//!
//! A parse graph is a value: it is stored, compared, and matched node by node with another by path. The
//! conditions of a task are spread over its steps (`needs` before its first, `gives` after its last), so
//! whoever walks the steps checks everything without looking at the tree.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::bind;
use super::fluent::{self, Question};
use super::{
    And, Argument, Decides, Definitions, Does, Form, Graph, Node, NodeId, NodeKind, Pause,
    Relation, Role,
};
use crate::language::ast::{Allen, Call, Expr, Remedy, Span};
use crate::language::text;

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

/// A branch taken at an Or: which one and how likely it was.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Taken {
    pub(super) node: NodeId,
    pub(super) branch: usize,
    pub(super) p: f64,
    pub(super) possible: Vec<usize>,
    pub(super) known: bool,
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

/// Writes out what was chosen.
pub(super) fn realise(
    graph: &Graph,
    definitions: &dyn Definitions,
    taken: &BTreeMap<NodeId, Taken>,
) -> ParseGraph {
    let mut writer = Writer {
        graph,
        definitions,
        taken,
        steps: Vec::new(),
        choices: Vec::new(),
        recoveries: Vec::new(),
        reached: Vec::new(),
        log_p: 0.0,
        is_nominal: true,
    };
    writer.walk(graph.root(), &Context::default());
    let Writer { steps, choices, recoveries, reached, log_p, .. } = writer;
    let path = |id: NodeId| graph.node(id).path.clone();
    let timings = graph.relations.iter().filter_map(|relation| match relation {
        Relation::Temporal { a, allen, b, by } if reached.contains(a) && reached.contains(b) => {
            Some(Timing { a: path(*a), relation: *allen, b: path(*b), by: *by })
        }
        _ => None,
    });
    ParseGraph {
        call: text::call(&graph.call),
        choices,
        steps,
        timings: timings.collect(),
        recoveries,
        log_p,
    }
}

/// What the nodes above lay upon a step.
#[derive(Clone, Default)]
struct Context {
    keeps: Vec<Condition>,
    untils: Vec<Condition>,
    unless: Vec<Condition>,
    limits: Vec<TimeLimit>,
    /// Recoveries in force, outermost first, and how many calls were open when each began.
    recoveries: Vec<(usize, NodeId, usize)>,
    /// The calls above, outermost first.
    calls: Vec<(String, Vec<Argument>)>,
    together: Option<String>,
}

struct Writer<'a> {
    graph: &'a Graph,
    definitions: &'a dyn Definitions,
    taken: &'a BTreeMap<NodeId, Taken>,
    steps: Vec<Step>,
    choices: Vec<Choice>,
    recoveries: Vec<RecoveryPlan>,
    reached: Vec<NodeId>,
    log_p: f64,
    /// Off while a recovery is written: it is not part of the nominal derivation.
    is_nominal: bool,
}

impl Writer<'_> {
    fn walk(&mut self, node: &Node, context: &Context) {
        if self.is_nominal {
            self.reached.push(node.id);
        }
        let first = self.steps.len();
        self.enter(node, context);
        // What stops before a sub-task stops before its first step.
        if let (Some(pause), Some(step)) = (&node.pause, self.steps.get_mut(first)) {
            step.pause = Some(pause.clone());
        }
    }

    fn enter(&mut self, node: &Node, context: &Context) {
        match &node.kind {
            NodeKind::And(and) => self.and(node, and, context),
            NodeKind::Or(or) => {
                let Some(taken) = self.taken.get(&node.id) else { return };
                let branch = &or.branches[taken.branch];
                self.choose(node, or, taken);
                let mut context = context.clone();
                if let Decides::Repetition(until) = &or.decides {
                    context.unless.push(self.condition(node, Role::Until, until));
                }
                self.walk(self.graph.node(branch.node), &context);
            }
            NodeKind::Terminal(_) => self.terminal(node, context),
        }
    }

    fn choose(&mut self, node: &Node, or: &super::Or, taken: &Taken) {
        if !self.is_nominal {
            return;
        }
        let branch = &or.branches[taken.branch];
        let assumed = match &or.decides {
            Decides::Condition(expr) => Some(Assumption {
                expr: expr.clone(),
                text: text::expr(expr),
                value: taken.branch == 0,
                is_known: taken.known,
            }),
            _ => None,
        };
        self.log_p += taken.p.ln();
        self.choices.push(Choice {
            node: node.path.clone(),
            branch: branch.name.clone(),
            key: branch.key.clone(),
            text: super::outcome::fingerprint(branch.text),
            p: taken.p,
            possible: taken.possible.iter().map(|b| or.branches[*b].name.clone()).collect(),
            is_free: or.decides.is_free(),
            assumed,
        });
    }

    fn and(&mut self, node: &Node, and: &And, context: &Context) {
        let mut inside = context.clone();
        if let Form::Task(call) = &and.form {
            inside.calls.push((call.name.text.clone(), arguments_of(call, self.definitions)));
        }
        if let Some(seconds) = and.limit {
            let (owner, text) = (node.path.clone(), node.label.clone());
            inside.limits.push(TimeLimit { owner, text, seconds });
        }
        if and.form == Form::Together {
            inside.together = Some(node.path.clone());
        }
        for recovery in &and.recoveries {
            if let Some((idx, taken)) = self.recovery(node, *recovery, context) {
                inside.recoveries.push((idx, taken, inside.calls.len()));
            }
        }
        for e in &and.causes.keeps {
            inside.keeps.push(self.condition(node, Role::Keeps, e));
        }
        for e in &and.holding.whiles {
            inside.keeps.push(self.condition(node, Role::Keeps, e));
        }
        for e in &and.holding.untils {
            let until = self.condition(node, Role::Until, e);
            // What finishes the whole also makes the steps still to come needless.
            inside.untils.push(until.clone());
            inside.unless.push(until);
        }
        let first = self.steps.len();
        for child in &and.children {
            self.walk(self.graph.node(*child), &inside);
        }
        let (needs, gives) = (&and.causes.needs, &and.causes.gives);
        if self.steps.len() == first {
            // Nothing was left to do; what the task promises is asked all the same.
            for e in needs.iter().chain(gives) {
                let gives = vec![self.condition(node, Role::Checks, e)];
                let does = Does::Check(e.clone());
                let label = format!("check {}", text::expr(e));
                self.steps.push(Step { gives, ..step(node, label, does, &inside) });
            }
            return;
        }
        let needs: Vec<_> = needs.iter().map(|e| self.condition(node, Role::Needs, e)).collect();
        let gives: Vec<_> = gives.iter().map(|e| self.condition(node, Role::Gives, e)).collect();
        self.steps[first].needs.splice(0..0, needs);
        if let Some(last) = self.steps.last_mut() {
            last.gives.extend(gives);
        }
    }

    fn terminal(&mut self, node: &Node, context: &Context) {
        let NodeKind::Terminal(terminal) = &node.kind else { return };
        let mut inside = context.clone();
        if let Does::Action { name, args } = &terminal.does {
            inside.calls.push((name.clone(), args.clone()));
        }
        let conditions = |role, all: &[Expr]| -> Vec<Condition> {
            all.iter().map(|e| self.condition(node, role, e)).collect()
        };
        let mut made = step(node, node.label.clone(), terminal.does.clone(), &inside);
        made.needs = conditions(Role::Needs, &terminal.causes.needs);
        made.keeps.extend(conditions(Role::Keeps, &terminal.causes.keeps));
        made.keeps.extend(conditions(Role::Keeps, &terminal.holding.whiles));
        made.gives = conditions(Role::Gives, &terminal.causes.gives);
        made.untils.extend(conditions(Role::Until, &terminal.holding.untils));
        if let Does::Check(what) = &terminal.does {
            made.gives = conditions(Role::Checks, std::slice::from_ref(what));
        }
        made.script.clone_from(&terminal.script);
        made.limit = terminal.limit;
        let in_force = inside.recoveries.iter().rev().filter(|(idx, taken, depth)| {
            let of = match &self.graph.node(*taken).kind {
                NodeKind::And(And { form: Form::Recovery { of, .. }, .. }) => of.as_ref(),
                _ => None,
            };
            debug_assert!(*idx < self.recoveries.len(), "a recovery is written before its steps");
            of.is_none_or(|of| {
                inside.calls[*depth..].iter().any(|(name, args)| bind::matches(of, name, args))
            })
        });
        made.recoveries = in_force.map(|(idx, ..)| *idx).collect();
        self.steps.push(made);
    }

    /// Writes out one `on failure` clause, and returns where it is and the node of what it does.
    fn recovery(&mut self, above: &Node, id: NodeId, context: &Context) -> Option<(usize, NodeId)> {
        let node = self.graph.node(id);
        let NodeKind::Or(or) = &node.kind else { return None };
        let taken = or.branches.iter().find(|branch| branch.name == "taken")?.node;
        let NodeKind::And(and) = &self.graph.node(taken).kind else { return None };
        let Form::Recovery { of, remedy } = &and.form else { return None };
        // A recovery is not itself watched by what was being recovered from, nor kept to its conditions.
        let context = Context { calls: context.calls.clone(), ..Context::default() };
        let mut writer = Writer {
            steps: Vec::new(),
            choices: Vec::new(),
            recoveries: Vec::new(),
            reached: Vec::new(),
            is_nominal: false,
            ..*self
        };
        for child in &and.children {
            writer.walk(self.graph.node(*child), &context);
        }
        let mut steps = writer.steps;
        for step in &mut steps {
            // `on failure` inside a recovery's own tasks would point into another list.
            step.recoveries.clear();
        }
        self.recoveries.push(RecoveryPlan {
            path: node.path.clone(),
            of: of.as_ref().map(text::call),
            covers: above.path.clone(),
            steps,
            remedy: remedy.clone(),
        });
        Some((self.recoveries.len() - 1, taken))
    }

    fn condition(&self, node: &Node, role: Role, expr: &Expr) -> Condition {
        Condition {
            text: text::expr(expr),
            expr: expr.clone(),
            owner: node.path.clone(),
            role,
            asks: fluent::questions(expr, self.definitions),
        }
    }
}

fn step(node: &Node, text: String, does: Does, context: &Context) -> Step {
    Step {
        path: node.path.clone(),
        text,
        does,
        script: None,
        limit: None,
        limits: context.limits.clone(),
        needs: Vec::new(),
        keeps: context.keeps.clone(),
        gives: Vec::new(),
        untils: context.untils.clone(),
        unless: context.unless.clone(),
        recoveries: Vec::new(),
        together: context.together.clone(),
        pause: None,
        span: node.span,
        within: node.within.clone(),
    }
}

/// The arguments of a closed call by the names of the task's parameters, in whose order they stand.
fn arguments_of(call: &Call, definitions: &dyn Definitions) -> Vec<Argument> {
    let params = definitions.task(&call.name.text).map(|task| task.params.as_slice());
    let names = params.unwrap_or_default().iter().map(|param| param.name.text.clone());
    let all = names.zip(&call.args).filter_map(|(name, arg)| {
        let value = arg.values.first()?.clone();
        Some(Argument { name, text: text::expr(&value), value })
    });
    all.collect()
}
