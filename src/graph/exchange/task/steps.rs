//! From the nodes of a graph back to the steps they came from, arguments filled in.

use std::collections::{BTreeMap, BTreeSet};

use super::super::super::{
    And, Argument, Branch, Decides, Does, Error, Form, Graph, Holding, Node, NodeId, NodeKind, Or,
    Relation, Terminal, is_at_or_below,
};
use super::super::error::{Oddity, Unsaid};
use super::super::{plain, words};
use super::name;
use crate::language::ast::{
    self, Act, Arg, Block, Break, Call, Either, Expr, Hold, If, Literal, Name, Recovery, Repeat,
    Span, Step, Text, Timing, Together,
};
use crate::language::text;
use crate::units::{Dimension, Quantity};

/// Reads steps off a graph.
pub(super) struct Steps<'g> {
    graph: &'g Graph,
    /// Values by the names they have in the graph, where each is one of its own → as a text names them.
    pub(super) lets: BTreeMap<String, String>,
    /// Nodes that some `timing` speaks of.
    timed: BTreeSet<NodeId>,
    /// `via` of the calls that carry one.
    via: BTreeMap<NodeId, Vec<Name>>,
}

/// What a step needs to be, and is not.
fn odd(node: &Node, why: Oddity) -> Error {
    Error::Text(Unsaid::Odd { node: node.path.clone(), why })
}

/// `limit 20 s`.
pub(super) fn seconds(value: f64) -> Literal {
    let dimension = Dimension { time: 1, ..Dimension::default() };
    Literal { quantity: Quantity { value, dimension }, span: Span::default() }
}

/// The call of an action as its place shows it; the label knows which arguments are bare.
pub(super) fn labelled_call(node: &Node, action: &str, args: &[Argument]) -> Call {
    let fits = |call: &Call| {
        call.name.text == action
            && call.args.len() == args.len()
            && call.args.iter().zip(args).all(|(said, arg)| {
                said.name.as_ref().is_none_or(|name| name.text == arg.name)
                    && said.values.first().map(text::expr).as_ref() == Some(&arg.text)
            })
    };
    words::call(&node.label).ok().filter(fits).unwrap_or_else(|| Call {
        name: name(action),
        args: args
            .iter()
            .map(|arg| Arg {
                name: Some(name(&arg.name)),
                values: vec![arg.value.clone()],
                span: Span::default(),
            })
            .collect(),
        span: Span::default(),
    })
}

impl<'g> Steps<'g> {
    pub(super) fn of(graph: &'g Graph) -> Self {
        let mut steps =
            Self { graph, lets: BTreeMap::new(), timed: BTreeSet::new(), via: BTreeMap::new() };
        for node in graph.nodes() {
            if let NodeKind::Terminal(Terminal { does: Does::Let { name, .. }, .. }) = &node.kind {
                let local = steps.segment(node);
                let local = local.strip_prefix("let_").unwrap_or(name);
                steps.lets.insert(name.clone(), local.to_owned());
            }
        }
        for relation in &graph.relations {
            if let Relation::Temporal { a, b, .. } = relation
                && steps.is_strand(*a)
            {
                steps.timed.extend([*a, *b]);
            }
        }
        steps.pins(graph.root().id);
        steps
    }

    /// Whether a node goes on beside others.
    fn is_strand(&self, id: NodeId) -> bool {
        let parent = self.graph.node(id).parent.map(|parent| &self.graph.node(parent).kind);
        matches!(parent, Some(NodeKind::And(And { form: Form::Together, .. })))
    }

    /// The end of a node's path beyond its parent's, with its `/` or `.`, without a number that only counts.
    fn tail(&self, node: &'g Node) -> &'g str {
        let above = node.parent.map_or("", |parent| self.graph.node(parent).path.as_str());
        let tail = node.path.strip_prefix(above).unwrap_or(&node.path);
        match tail.rsplit_once('#') {
            Some((tail, n)) if n.bytes().all(|b| b.is_ascii_digit()) => tail,
            _ => tail,
        }
    }

    /// What a step is called in its path: its label, or the name of what it calls.
    fn segment(&self, node: &'g Node) -> &'g str {
        self.tail(node).trim_start_matches('/').split('/').next().unwrap_or_default()
    }

    /// Notes which calls carry a `via`: the outermost ones that pin what is pinned below them, and no more.
    fn pins(&mut self, from: NodeId) {
        let graph = self.graph;
        for id in graph.below(graph.node(from)) {
            let node = graph.node(id);
            let inside = |node: &&Node| is_at_or_below(&node.path, &graph.node(id).path);
            let is_call = matches!(
                &node.kind,
                NodeKind::And(And { form: Form::Task(_), .. })
                    | NodeKind::Or(Or { decides: Decides::Argument(_), .. })
            );
            let is_value = matches!(
                &graph.node(from).kind,
                NodeKind::Or(Or { decides: Decides::Argument(_), .. })
            );
            let pinned = |branch: &str| -> Vec<NodeId> {
                let all = graph.nodes().iter().filter(inside).filter(|node| match &node.kind {
                    NodeKind::Or(or) => or.via.is_some_and(|at| or.branches[at].name == branch),
                    _ => false,
                });
                all.map(|node| node.id).collect()
            };
            let branches: BTreeSet<&str> = graph
                .nodes()
                .iter()
                .filter(inside)
                .filter_map(|node| match &node.kind {
                    NodeKind::Or(or) => Some(or.branches[or.via?].name.as_str()),
                    _ => None,
                })
                .collect();
            if is_call && !is_value {
                let carried: Vec<Name> = branches
                    .iter()
                    .filter(|branch| pinned(branch) == would_pin(graph, node, branch))
                    .map(|branch| name(branch))
                    .collect();
                if carried.len() == branches.len() {
                    if !carried.is_empty() {
                        self.via.insert(id, carried);
                    }
                    continue;
                }
            }
            if !branches.is_empty() {
                self.pins(id);
            }
        }
    }

    /// `#[was("old")]` of a task, as the branches inside it remember.
    pub(super) fn old_names(&self, task: &Node, call: &Call) -> Vec<Text> {
        let mut found: Vec<Text> = Vec::new();
        let own = &call.name.text;
        let inside = self.graph.nodes().iter().filter(|node| node.within == *own);
        for node in inside.filter(|node| is_at_or_below(&node.path, &task.path)) {
            let NodeKind::Or(or) = &node.kind else { continue };
            for branch in &or.branches {
                let Some(below) = branch.key.strip_prefix(own.as_str()) else { continue };
                for old in branch.was.iter().filter_map(|old| old.strip_suffix(below)) {
                    if old != own && found.iter().all(|known| known.text != old) {
                        found.push(Text { text: old.to_owned(), span: Span::default() });
                    }
                }
            }
        }
        found
    }

    /// The steps of a task.
    pub(super) fn body(&self, task: &'g Node) -> Result<Vec<Step>, Error> {
        match &task.kind {
            NodeKind::And(and) => self.steps(&and.children),
            _ => Err(odd(task, Oddity::NoTask)),
        }
    }

    /// The `on failure` clauses of a task or a block.
    pub(super) fn recoveries(&self, node: &'g Node) -> Result<Vec<Recovery>, Error> {
        let NodeKind::And(And { recoveries, .. }) = &node.kind else { return Ok(Vec::new()) };
        let each = recoveries.iter().map(|id| {
            let node = self.graph.node(*id);
            let taken = match &node.kind {
                NodeKind::Or(or) => or.branches.get(1).map(|taken| self.graph.node(taken.node)),
                _ => None,
            };
            match taken.map(|taken| &taken.kind) {
                Some(NodeKind::And(And {
                    form: Form::Recovery { of, remedy }, children, ..
                })) => Ok(Recovery {
                    of: of.clone(),
                    steps: self.steps(children)?,
                    remedy: remedy.clone(),
                    span: Span::default(),
                }),
                _ => Err(odd(node, Oddity::NoRemedy)),
            }
        });
        each.collect()
    }

    fn steps(&self, children: &[NodeId]) -> Result<Vec<Step>, Error> {
        let mut steps = Vec::new();
        for id in children {
            let node = self.graph.node(*id);
            if let Some(pause) = &node.pause {
                steps.push(Step::Break(Break { when: pause.when.clone(), span: Span::default() }));
            }
            steps.push(self.step(node)?);
        }
        Ok(steps)
    }

    fn step(&self, node: &'g Node) -> Result<Step, Error> {
        let span = Span::default();
        Ok(match &node.kind {
            NodeKind::Terminal(Terminal { does: Does::Check(what), .. }) => {
                Step::Check(what.clone(), span)
            }
            NodeKind::Terminal(Terminal { does: Does::Let { name: unique, value }, .. }) => {
                let local = self.lets.get(unique).unwrap_or(unique);
                Step::Let(name(local), value.clone(), span)
            }
            NodeKind::Terminal(_)
            | NodeKind::And(And { form: Form::Task(_), .. })
            | NodeKind::Or(Or { decides: Decides::Argument(_), .. }) => self.act(node)?,
            NodeKind::Or(Or { decides: Decides::Choice, branches, .. }) => {
                Step::Either(Either { branches: self.branches(node, branches)?, span })
            }
            NodeKind::Or(Or { decides: Decides::Condition(condition), branches, .. }) => {
                let [then, otherwise] = branches.as_slice() else {
                    return Err(odd(node, Oddity::NotTwoBranches));
                };
                let otherwise = self.graph.node(otherwise.node);
                let skipped =
                    matches!(&otherwise.kind, NodeKind::And(And { form: Form::Skip, .. }));
                Step::If(If {
                    condition: condition.clone(),
                    then: self.block(self.graph.node(then.node))?,
                    otherwise: (!skipped).then(|| self.block(otherwise)).transpose()?,
                    span,
                })
            }
            NodeKind::Or(_) => return Err(odd(node, Oddity::Misplaced)),
            NodeKind::And(and) => match &and.form {
                Form::Together => self.together(&and.children)?,
                Form::Repeat => self.repeat(node, &and.children)?,
                Form::Sequence => {
                    let mut block = self.block(node)?;
                    let label = self.segment(node);
                    block.label = (label != "block").then(|| name(label));
                    Step::Block(block)
                }
                _ => return Err(odd(node, Oddity::Misplaced)),
            },
        })
    }

    /// A block without its label.
    fn block(&self, node: &'g Node) -> Result<Block, Error> {
        let NodeKind::And(And { form: Form::Sequence | Form::Skip, children, holding, .. }) =
            &node.kind
        else {
            return Err(odd(node, Oddity::NoBlock));
        };
        Ok(Block {
            steps: self.steps(children)?,
            recoveries: self.recoveries(node)?,
            holds: holds(holding),
            label: None,
            span: Span::default(),
        })
    }

    fn branches(&self, node: &Node, all: &[Branch]) -> Result<Vec<ast::Branch>, Error> {
        let Some(first) = all.first().filter(|_| all.len() > 1) else {
            return Err(odd(node, Oddity::NoChoice));
        };
        let even = all.iter().all(|branch| (branch.prior - first.prior).abs() < 1e-12);
        let each = all.iter().map(|branch| {
            // `pick/either.side` was `pick/either.left`: what differs is the branch's own name.
            let stem = branch.key.strip_suffix(branch.name.as_str()).unwrap_or(&branch.key);
            let was = branch.was.iter().filter_map(|old| old.strip_prefix(stem));
            Ok(ast::Branch {
                name: name(&branch.name),
                was: was.map(|old| Text { text: old.to_owned(), span: Span::default() }).collect(),
                prior: (!even).then_some(plain(branch.prior)),
                when: branch.guard.clone(),
                block: self.block(self.graph.node(branch.node))?,
            })
        });
        each.collect()
    }

    /// A loop: its rounds are the same, so the first says them all.
    fn repeat(&self, node: &'g Node, children: &[NodeId]) -> Result<Step, Error> {
        let Some(first) = children.first() else {
            return Err(odd(node, Oddity::NoRounds));
        };
        let block = self.block(self.graph.node(*first))?;
        let until = match children.last().map(|last| &self.graph.node(*last).kind) {
            Some(NodeKind::Terminal(Terminal { does: Does::Check(until), .. })) => {
                Some(until.clone())
            }
            _ => None,
        };
        let times = match until {
            None => children.len(),
            Some(_) => 1 + children.get(1).map_or(0, |next| self.rounds(*next)),
        };
        let times = u32::try_from(times).unwrap_or(u32::MAX);
        Ok(Step::Repeat(Repeat { times, block, until, span: Span::default() }))
    }

    /// How many rounds are below an Or between being done and going round again.
    fn rounds(&self, id: NodeId) -> usize {
        let NodeKind::Or(Or { decides: Decides::Repetition(_), branches, .. }) =
            &self.graph.node(id).kind
        else {
            return 0;
        };
        let again = branches.get(1).map(|again| &self.graph.node(again.node).kind);
        let Some(NodeKind::And(again)) = again else { return 0 };
        1 + again.children.get(1).map_or(0, |next| self.rounds(*next))
    }

    fn together(&self, children: &[NodeId]) -> Result<Step, Error> {
        let mut steps = Vec::new();
        for id in children {
            let strand = self.graph.node(*id);
            let step = match &strand.kind {
                NodeKind::And(And { form: Form::Sequence, children, .. })
                    if self.segment(strand) == "then" && children.len() > 1 =>
                {
                    Step::Sequence(self.steps(children)?, Span::default())
                }
                _ => self.step(strand)?,
            };
            steps.push(step);
        }
        let timings = self.graph.relations.iter().filter_map(|relation| match relation {
            Relation::Temporal { a, allen, b, by } if children.contains(a) => Some(Timing {
                a: name(self.segment(self.graph.node(*a))),
                relation: *allen,
                b: name(self.segment(self.graph.node(*b))),
                by: by.map(seconds),
                span: Span::default(),
            }),
            _ => None,
        });
        let timings = timings.collect();
        Ok(Step::Together(Together { steps, timings, span: Span::default() }))
    }

    fn act(&self, node: &'g Node) -> Result<Step, Error> {
        let (call, holding) = self.call(node)?;
        let said = self.segment(node);
        let label = (said != call.name.text || self.timed.contains(&node.id)).then(|| name(said));
        Ok(Step::Act(Act {
            call,
            via: self.via.get(&node.id).cloned().unwrap_or_default(),
            holds: holds(holding),
            label,
            span: Span::default(),
        }))
    }

    /// The call that a node came from; where an argument has several values, with all of them.
    pub(super) fn call(&self, node: &'g Node) -> Result<(Call, &'g Holding), Error> {
        match &node.kind {
            NodeKind::And(And { form: Form::Task(call), holding, .. }) => {
                Ok((call.clone(), holding))
            }
            NodeKind::Terminal(Terminal { does: Does::Action { name, args }, holding, .. }) => {
                Ok((labelled_call(node, name, args), holding))
            }
            NodeKind::Or(Or { decides: Decides::Argument(param), branches, .. }) => {
                let Some(first) = branches.first() else {
                    return Err(odd(node, Oddity::NoValues));
                };
                let below = self.graph.node(first.node);
                let (mut call, holding) = self.call(below)?;
                let value = |branch: &Branch| words::expr(&branch.name);
                let values: Vec<Expr> = branches.iter().map(value).collect::<Result<_, _>>()?;
                let at = self.position(&call, param, &first.name);
                let arg = at.and_then(|at| call.args.get_mut(at));
                let Some(arg) = arg else {
                    return Err(odd(node, Oddity::NoArgument));
                };
                arg.values = values;
                Ok((call, holding))
            }
            _ => Err(odd(node, Oddity::NoCall)),
        }
    }

    /// Which argument of a call a parameter is.
    fn position(&self, call: &Call, param: &str, value: &str) -> Option<usize> {
        let named = call
            .args
            .iter()
            .position(|arg| arg.name.as_ref().is_some_and(|name| name.text == param));
        let declared = self.graph.signatures.callables.get(&call.name.text);
        let bare = || {
            let at = declared?.iter().position(|p| p.name.text == param)?;
            call.args.get(at).is_some_and(|arg| arg.name.is_none()).then_some(at)
        };
        let alike = || {
            call.args.iter().position(|arg| {
                arg.name.is_none() && arg.values.first().map(text::expr).as_deref() == Some(value)
            })
        };
        named.or_else(bare).or_else(alike)
    }
}

/// The choices that `via` would pin on the call of a node: the outermost that have the branch.
fn would_pin(graph: &Graph, call: &Node, branch: &str) -> Vec<NodeId> {
    let mut pinned: Vec<&Node> = Vec::new();
    for node in graph.nodes().iter().filter(|node| is_at_or_below(&node.path, &call.path)) {
        let NodeKind::Or(or) = &node.kind else { continue };
        let has = or.decides.is_free() && or.branches.iter().any(|b| b.name == branch);
        if has && pinned.iter().all(|above| !is_at_or_below(&node.path, &above.path)) {
            pinned.push(node);
        }
    }
    pinned.iter().map(|node| node.id).collect()
}

fn holds(holding: &Holding) -> Vec<Hold> {
    let whiles = holding.whiles.iter().cloned().map(Hold::While);
    whiles.chain(holding.untils.iter().cloned().map(Hold::Until)).collect()
}
