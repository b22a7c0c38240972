//! From the branches that were taken to the steps that an executor walks.

use std::collections::BTreeMap;

use super::super::bind;
use super::super::fluent;
use super::super::{
    And, Argument, Decides, Definitions, Does, Form, Graph, Node, NodeId, NodeKind, Or, Relation,
    Role, outcome,
};
use super::{Assumption, Choice, Condition, ParseGraph, RecoveryPlan, Step, TimeLimit, Timing};
use crate::language::ast::{Call, Expr};
use crate::language::text;

/// A branch taken at an Or: which one and how likely it was.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Taken {
    pub(in super::super) node: NodeId,
    pub(in super::super) branch: usize,
    pub(in super::super) p: f64,
    pub(in super::super) possible: Vec<usize>,
    pub(in super::super) known: bool,
}

/// Writes out what was chosen.
pub(in super::super) fn realise(
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

    fn choose(&mut self, node: &Node, or: &Or, taken: &Taken) {
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
            text: outcome::fingerprint(branch.text),
            p: taken.p,
            possible: taken.possible.iter().map(|b| or.branches[*b].name.clone()).collect(),
            is_free: or.decides.is_free(),
            is_asked: or.via == Some(taken.branch),
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
