//! A task call → the graph of everything it might do.
//!
//! Every call is expanded where it stands, with its arguments filled in, so a task that is called twice
//! appears twice and each place has a path of its own. Loops are unrolled up to their bound. All problems
//! are collected; recursion is one of them, since a graph that never ends cannot be planned.

mod condition;
mod error;
mod steps;
mod text_of;

use std::collections::{BTreeMap, BTreeSet};

use super::{
    And, Argument, Causes, Definitions, Does, Form, Graph, Holding, Node, NodeId, NodeKind,
    Problem, Relation, Signatures, Terminal, is_at_or_below,
};
use crate::language::ast::{Arg, Call, Conditions, Expr, Hold, Name, Param, Span};
use crate::language::bind::{self, Scope};
use crate::language::text;
use error::Obstacle;

/// More nodes than a person could follow, and far fewer than memory holds: loops inside loops.
const MOST_NODES: usize = 20_000;

/// Tasks inside tasks; each is gone into by recursion, and its path names all of them.
const DEEPEST: usize = 200;

/// Builds the And-Or graph of a call: `pour(jar, cup)`.
///
/// Objects are given by name; nothing here asks whether they exist. Every argument and default is filled
/// in, and stays an expression until a state gives it a value.
///
/// # Errors
///
/// All problems found: a name nobody defines, arguments that do not fit, a task that calls itself, a step
/// that could not be read, a `timing` about a label nobody carries, priors that are no probabilities.
pub fn build(definitions: &dyn Definitions, call: &Call) -> Result<Graph, Vec<Problem>> {
    let mut builder = Builder {
        definitions,
        nodes: Vec::new(),
        relations: Vec::new(),
        conditions: Vec::new(),
        problems: Vec::new(),
        stack: Vec::new(),
        paths: BTreeSet::new(),
        objects: BTreeSet::new(),
        lets: BTreeSet::new(),
        files: BTreeMap::new(),
        signatures: Signatures::default(),
    };
    let place =
        Place { parent: None, path: String::new(), key: String::new(), within: String::new() };
    let name = call.name.text.clone();
    let request = Request { call, via: &[], label: None, holding: Holding::default() };
    let root = builder.invoke(&request, &Scope::new(), &place, &name);
    let Some(root) = root.filter(|_| builder.problems.is_empty()) else {
        let mut seen = Vec::new();
        // A loop meets the same problem once a round; a person needs it once.
        for problem in builder.problems {
            if !seen.contains(&problem) {
                seen.push(problem);
            }
        }
        return Err(seen);
    };
    let (fluents, causal) = builder.fluents();
    builder.relations.extend(causal);
    let call = match &builder.nodes[root.idx()].kind {
        NodeKind::And(And { form: Form::Task(call), .. }) => call.clone(),
        _ => call.clone(),
    };
    Ok(Graph {
        nodes: builder.nodes,
        root,
        call,
        relations: builder.relations,
        fluents,
        files: builder.files,
        signatures: builder.signatures,
    })
}

/// Where the next node goes.
#[derive(Clone)]
struct Place {
    parent: Option<NodeId>,
    path: String,
    key: String,
    within: String,
}

/// A call on its way to becoming a node.
struct Request<'a> {
    call: &'a Call,
    /// Branches to take inside it.
    via: &'a [Name],
    label: Option<&'a Name>,
    holding: Holding,
}

struct Builder<'d> {
    definitions: &'d dyn Definitions,
    nodes: Vec<Node>,
    relations: Vec<Relation>,
    /// Conditions met on the way: which node, in what role, what.
    conditions: Vec<(NodeId, super::Role, Expr)>,
    problems: Vec<Problem>,
    /// The tasks being expanded, outermost first.
    stack: Vec<String>,
    paths: BTreeSet<String>,
    objects: BTreeSet<String>,
    lets: BTreeSet<String>,
    files: BTreeMap<String, String>,
    signatures: Signatures,
}

impl Builder<'_> {
    fn problem(&mut self, what: &Obstacle, span: Span, within: &str) {
        self.problems.push(Problem {
            code: what.code(),
            message: what.to_string(),
            span,
            within: within.to_owned(),
            help: what.help(),
        });
    }

    /// Makes a node below `place` with `segment` at the end of its path, still without content.
    ///
    /// Returns it with the place for what goes below it.
    fn open(&mut self, place: &Place, segment: &str, label: String, span: Span) -> (NodeId, Place) {
        self.open_as(place, &["/", segment].concat(), label, span)
    }

    /// As [`Self::open`] with the separator in `tail`: `/either`, or `.side` for a branch.
    fn open_as(&mut self, place: &Place, tail: &str, label: String, span: Span) -> (NodeId, Place) {
        let tail = if place.path.is_empty() { tail.trim_start_matches('/') } else { tail };
        let mut suffix = String::new();
        for n in 2.. {
            if self.paths.insert(format!("{}{tail}{suffix}", place.path)) {
                break;
            }
            suffix = format!("#{n}");
        }
        let path = format!("{}{tail}{suffix}", place.path);
        let key = format!("{}{tail}{suffix}", place.key);
        let id = NodeId(u32::try_from(self.nodes.len()).expect("bounded by MOST_NODES"));
        self.nodes.push(Node {
            id,
            path: path.clone(),
            key: key.clone(),
            label,
            span,
            within: place.within.clone(),
            parent: place.parent,
            pause: None,
            kind: NodeKind::And(And::empty(Form::Skip)),
        });
        (id, Place { parent: Some(id), path, key, within: place.within.clone() })
    }

    fn set(&mut self, id: NodeId, kind: NodeKind) {
        self.nodes[id.idx()].kind = kind;
    }

    fn is_full(&mut self, span: Span, within: &str) -> bool {
        if self.stack.len() >= DEEPEST {
            self.problem(&Obstacle::TooDeep { most: DEEPEST }, span, within);
            return true;
        }
        if self.nodes.len() < MOST_NODES {
            return false;
        }
        self.problem(&Obstacle::TooLarge { most: MOST_NODES }, span, within);
        true
    }

    /// Expands a call to a task or an action below `place`.
    fn invoke(
        &mut self,
        request: &Request<'_>,
        scope: &Scope,
        place: &Place,
        segment: &str,
    ) -> Option<NodeId> {
        let call = request.call;
        let name = &call.name.text;
        if self.is_full(call.span, &place.within) {
            return None;
        }
        let definitions = self.definitions;
        let (params, kind) = match (definitions.task(name), definitions.action(name)) {
            (Some(task), _) => (&task.params, "task"),
            (None, Some(action)) => (&action.params, "action"),
            (None, None) => {
                let unknown = Obstacle::Unknown { name: name.clone() };
                self.problem(&unknown, call.name.span, &place.within);
                return None;
            }
        };
        if self.stack.iter().any(|running| running == name) {
            let mut ring = self.stack.clone();
            ring.push(name.clone());
            let recursion = Obstacle::Recursion { name: name.clone(), ring };
            self.problem(&recursion, call.span, &place.within);
            return None;
        }
        if let Some(file) = definitions.file_of(name) {
            self.files.insert(name.clone(), file.to_owned());
        }
        self.signatures.callables.entry(name.clone()).or_insert_with(|| params.clone());
        let mut bound = match bind::arguments(&format!("{kind} `{name}`"), params, call) {
            Ok(bound) => bound,
            Err(bind::Misfit { message, span, help }) => {
                self.problem(&Obstacle::Arguments { message, help }, span, &place.within);
                return None;
            }
        };
        for b in bound.iter_mut().filter(|b| !b.default) {
            b.values = b.values.iter().map(|value| bind::fill(value, scope)).collect();
        }
        let before = self.nodes.len();
        let tail = ["/", segment].concat();
        let made = self.choose(request, params, &bound, &Scope::new(), place, &tail);
        for branch in request.via {
            self.pin(branch, before, call, place);
        }
        made
    }

    /// Pins the outermost choices among the nodes from `first` on that have this branch.
    fn pin(&mut self, branch: &Name, first: usize, call: &Call, place: &Place) {
        let mut known: Vec<String> = Vec::new();
        let mut pinned: Vec<String> = Vec::new();
        for node in &mut self.nodes[first..] {
            let NodeKind::Or(or) = &mut node.kind else { continue };
            if !or.decides.is_free() || pinned.iter().any(|above| is_at_or_below(&node.path, above))
            {
                continue;
            }
            match or.branches.iter().position(|b| b.name == branch.text) {
                Some(at) => {
                    or.via = Some(at);
                    pinned.push(node.path.clone());
                }
                None => known.extend(or.branches.iter().map(|b| b.name.clone())),
            }
        }
        if pinned.is_empty() {
            let (call, span) = (call.name.text.clone(), branch.span);
            let missing = Obstacle::NoBranch { call, branch: branch.text.clone(), known };
            self.problem(&missing, span, &place.within);
        }
    }

    /// Makes an Or for the first parameter that has alternatives, and goes on below each of them.
    fn choose(
        &mut self,
        request: &Request<'_>,
        params: &[Param],
        bound: &[bind::Bound],
        chosen: &Scope,
        place: &Place,
        tail: &str,
    ) -> Option<NodeId> {
        let mut chosen = chosen.clone();
        for (i, b) in bound.iter().enumerate().skip(chosen.len()) {
            if b.values.len() > 1 {
                return self.argument_or(request, params, (bound, i), &chosen, place, tail);
            }
            let value = b.values.first()?;
            let value = if b.default { bind::fill(value, &chosen) } else { value.clone() };
            chosen.insert(b.name.clone(), value);
        }
        for param in params {
            let is_object = !condition::QUANTITIES.contains(&param.ty.text.as_str());
            if let (true, Some(Expr { kind: crate::language::ast::ExprKind::Name(name), .. })) =
                (is_object, chosen.get(&param.name.text))
            {
                self.objects.insert(name.clone());
            }
        }
        let definitions = self.definitions;
        let name = &request.call.name.text;
        if definitions.task(name).is_some() {
            self.task(request, params, &chosen, place, tail)
        } else {
            self.action(request, params, &chosen, place, tail)
        }
    }

    fn task(
        &mut self,
        request: &Request<'_>,
        params: &[Param],
        chosen: &Scope,
        place: &Place,
        tail: &str,
    ) -> Option<NodeId> {
        let definitions = self.definitions;
        let task = definitions.task(&request.call.name.text)?;
        let name = &task.name.text;
        let call = closed_call(request.call, params, chosen);
        let label = text::call(&call);
        let (id, mut inside) = self.open_as(place, tail, label, request.call.span);
        inside.key.clone_from(name);
        inside.within.clone_from(name);
        self.stack.push(name.clone());
        let mut scope = chosen.clone();
        let children = self.sequence(&task.steps, &mut scope, &inside);
        let recoveries = self.recoveries(&task.recoveries, &scope, &inside);
        self.stack.pop();
        let causes = self.causes(id, &task.conditions, chosen);
        self.note_holding(id, &request.holding);
        let and = And {
            form: Form::Task(call),
            children,
            causes,
            holding: request.holding.clone(),
            recoveries,
            limit: task.limit.map(|limit| limit.quantity.value),
        };
        self.set(id, NodeKind::And(and));
        Some(id)
    }

    fn action(
        &mut self,
        request: &Request<'_>,
        params: &[Param],
        chosen: &Scope,
        place: &Place,
        tail: &str,
    ) -> Option<NodeId> {
        let definitions = self.definitions;
        let action = definitions.action(&request.call.name.text)?;
        let label = text::call(&closed_call(request.call, params, chosen));
        let (id, _) = self.open_as(place, tail, label, request.call.span);
        let args = params.iter().filter_map(|param| {
            let value = chosen.get(&param.name.text)?.clone();
            Some(Argument { name: param.name.text.clone(), text: text::expr(&value), value })
        });
        let does = Does::Action { name: action.name.text.clone(), args: args.collect() };
        let causes = self.causes(id, &action.conditions, chosen);
        self.note_holding(id, &request.holding);
        let terminal = Terminal {
            does,
            causes,
            holding: request.holding.clone(),
            script: action.script.as_ref().map(|(script, _)| script.clone()),
            limit: action.limit.map(|limit| limit.quantity.value),
        };
        self.set(id, NodeKind::Terminal(terminal));
        Some(id)
    }

    fn causes(&mut self, id: NodeId, conditions: &Conditions, scope: &Scope) -> Causes {
        use super::Role;
        let fill = |all: &[Expr]| all.iter().map(|e| bind::fill(e, scope)).collect::<Vec<_>>();
        let causes = Causes {
            needs: fill(&conditions.needs),
            keeps: fill(&conditions.keeps),
            gives: fill(&conditions.gives),
        };
        for (role, all) in [
            (Role::Needs, &causes.needs),
            (Role::Keeps, &causes.keeps),
            (Role::Gives, &causes.gives),
        ] {
            self.conditions.extend(all.iter().map(|e| (id, role, e.clone())));
        }
        causes
    }

    fn note_holding(&mut self, id: NodeId, holding: &Holding) {
        use super::Role;
        let whiles = holding.whiles.iter().map(|e| (id, Role::Keeps, e.clone()));
        let untils = holding.untils.iter().map(|e| (id, Role::Until, e.clone()));
        self.conditions.extend(whiles.chain(untils));
    }
}

impl And {
    /// Returns an And without children or conditions.
    pub(super) fn empty(form: Form) -> Self {
        Self {
            form,
            children: Vec::new(),
            causes: Causes::default(),
            holding: Holding::default(),
            recoveries: Vec::new(),
            limit: None,
        }
    }
}

/// Fills in `while` and `until`.
fn holding(holds: &[Hold], scope: &Scope) -> Holding {
    let mut holding = Holding::default();
    for hold in holds {
        match hold {
            Hold::While(e) => holding.whiles.push(bind::fill(e, scope)),
            Hold::Until(e) => holding.untils.push(bind::fill(e, scope)),
        }
    }
    holding
}

/// Returns the call with every parameter that the caller named or that has a default, in order: objects
/// bare, the rest by name.
fn closed_call(call: &Call, params: &[Param], chosen: &Scope) -> Call {
    // A bare argument stays bare, as its caller wrote it; behind one that is named it needs its name.
    let bare = call.args.iter().take_while(|arg| arg.name.is_none()).count();
    let args = params.iter().enumerate().filter_map(|(i, param)| {
        let value = chosen.get(&param.name.text)?.clone();
        let name = (i >= bare).then(|| param.name.clone());
        Some(Arg { name, span: value.span, values: vec![value] })
    });
    Call { name: call.name.clone(), args: args.collect(), span: call.span }
}
