//! A graph as a text of the language, from which the same graph is built again.
//!
//! A graph holds every call with its arguments filled in; a text says a task once. So each task, action and
//! fluent is read off all the places where it stands (`steps`), and what differs from place to place is the
//! parameter it came from (`common`). The text is then read and built, and compared with the graph: what a
//! text cannot say is an error, never left out in silence. Documentation and sentences of the text that a graph
//! was built from are no part of a graph.

mod common;
mod slots;
mod steps;

use std::collections::BTreeMap;

use serde_json::Value;

use super::super::{And, Decides, Does, Error, Form, Graph, Node, NodeKind, Or, Terminal, build};
use super::error::Unsaid;
use super::{Learnt, to_json, wording, words};
use crate::language::ast::{
    ActionItem, Call, Conditions, Expr, ExprKind, FluentItem, Name, Param, Span, TaskItem, Text,
};
use crate::language::bind::{self, Scope};
use crate::language::{parse, text};
use crate::units::Quantity;
use common::{Instance, in_common};
use steps::Steps;

/// Returns a text of the language whose graph this is: fluents, actions, tasks, and the call.
///
/// Places in a text and what learnt counts hang on ([`super::super::Branch::text`]) are those of the new text.
///
/// # Errors
///
/// [`Error::Text`] when no text says this graph, with the first difference.
pub fn to_task(graph: &Graph) -> Result<String, Error> {
    let steps = Steps::of(graph);
    let mut items = Vec::new();
    items.extend(fluents(graph)?.iter().map(text::fluent));
    items.extend(actions(graph)?.iter().map(text::action));
    items.extend(tasks(graph, &steps)?.iter().map(text::task));
    let mut call = graph.call.clone();
    if !matches!(&graph.root().kind, NodeKind::And(And { form: Form::Task(_), .. })) {
        call = steps.call(graph.root())?.0;
    }
    items.push(format!("{}\n", text::call(&call)));
    let notes: Vec<String> = uneven(graph).iter().map(|note| format!("// {note}")).collect();
    if !notes.is_empty() {
        items.insert(0, format!("{}\n", notes.join("\n")));
    }
    let written = items.join("\n");
    let (program, wrong) = parse(&written);
    if let Some(first) = wrong.first() {
        return Err(Error::Text(Unsaid::Refused(first.message.clone())));
    }
    let again = build(&program, &call).map_err(|problems| {
        let first = problems.first().map_or_else(String::new, |problem| problem.message.clone());
        Error::Text(Unsaid::Refused(first))
    })?;
    match difference(graph, &again) {
        None => Ok(written),
        Some(difference) => Err(Error::Text(difference)),
    }
}

/// What a text cannot say of a graph and a run does not need: shares of the values of an argument.
fn uneven(graph: &Graph) -> Vec<String> {
    let mut notes = Vec::new();
    for node in graph.nodes() {
        let NodeKind::Or(Or { decides: Decides::Argument(param), branches, .. }) = &node.kind
        else {
            continue;
        };
        let even = 1.0 / branches.len() as f64;
        if branches.iter().any(|branch| (branch.prior - even).abs() > 1e-9) {
            let shares: Vec<String> =
                branches.iter().map(|b| format!("{} {:.2}", b.name, b.prior)).collect();
            notes.push(wording::uneven_shares(&node.path, param, &shares));
        }
    }
    notes
}

fn tasks(graph: &Graph, steps: &Steps<'_>) -> Result<Vec<TaskItem>, Error> {
    let mut found: Vec<(String, Vec<Instance<TaskItem>>)> = Vec::new();
    for node in graph.nodes() {
        let NodeKind::And(And { form: Form::Task(call), causes, limit, .. }) = &node.kind else {
            continue;
        };
        let params = params(&graph.signatures.callables, call);
        let item = TaskItem {
            doc: Vec::new(),
            was: steps.old_names(node, call),
            name: name(&call.name.text),
            params: params.clone(),
            say: Vec::new(),
            conditions: Conditions {
                needs: causes.needs.clone(),
                keeps: causes.keeps.clone(),
                gives: causes.gives.clone(),
            },
            limit: limit.map(steps::seconds),
            steps: steps.body(node)?,
            recoveries: steps.recoveries(node)?,
            span: Span::default(),
        };
        gather(&mut found, Instance { item, scope: scope(&params, call) });
    }
    // What is called stands before what calls it.
    found.reverse();
    let all = found.into_iter().map(|(name, all)| one(&name, all, &steps.lets));
    all.collect()
}

fn actions(graph: &Graph) -> Result<Vec<ActionItem>, Error> {
    let mut found = Vec::new();
    for node in graph.nodes() {
        let NodeKind::Terminal(Terminal {
            does: Does::Action { name: action, args }, causes, ..
        }) = &node.kind
        else {
            continue;
        };
        let NodeKind::Terminal(terminal) = &node.kind else { continue };
        let call = steps::labelled_call(node, action, args);
        let params = match graph.signatures.callables.get(action) {
            Some(params) => params.clone(),
            None => args.iter().map(|arg| param(&arg.name, &arg.value)).collect(),
        };
        let item = ActionItem {
            doc: Vec::new(),
            was: Vec::new(),
            name: name(action),
            params: params.clone(),
            say: Vec::new(),
            conditions: Conditions {
                needs: causes.needs.clone(),
                keeps: causes.keeps.clone(),
                gives: causes.gives.clone(),
            },
            script: terminal.script.clone().map(|script| (script, Span::default())),
            limit: terminal.limit.map(steps::seconds),
            span: Span::default(),
        };
        gather(&mut found, Instance { item, scope: scope(&params, &call) });
    }
    found.into_iter().map(|(name, all)| one(&name, all, &BTreeMap::new())).collect()
}

fn fluents(graph: &Graph) -> Result<Vec<FluentItem>, Error> {
    let mut found = Vec::new();
    for node in &graph.fluents {
        let Some(body) = &node.body else { continue };
        let ExprKind::Call(call) = words::expr(&node.text)?.kind else { continue };
        let params = params(&graph.signatures.fluents, &call);
        let ask = node.template.as_ref().or(node.ask.as_ref());
        let item = FluentItem {
            doc: Vec::new(),
            name: call.name.clone(),
            params: params.clone(),
            body: words::expr(body)?,
            ask: ask.map(|ask| Text { text: ask.clone(), span: Span::default() }),
            span: Span::default(),
        };
        gather(&mut found, Instance { item, scope: scope(&params, &call) });
    }
    found.into_iter().map(|(name, all)| one(&name, all, &BTreeMap::new())).collect()
}

/// An item that has a name.
trait Named {
    fn named(&self) -> &str;
}

impl Named for TaskItem {
    fn named(&self) -> &str {
        &self.name.text
    }
}

impl Named for ActionItem {
    fn named(&self) -> &str {
        &self.name.text
    }
}

impl Named for FluentItem {
    fn named(&self) -> &str {
        &self.name.text
    }
}

fn gather<T: Named>(found: &mut Vec<(String, Vec<Instance<T>>)>, instance: Instance<T>) {
    match found.iter_mut().find(|(name, _)| name == instance.item.named()) {
        Some((_, all)) => all.push(instance),
        None => found.push((instance.item.named().to_owned(), vec![instance])),
    }
}

fn one<T: slots::Slots>(
    name: &str,
    all: Vec<Instance<T>>,
    lets: &BTreeMap<String, String>,
) -> Result<T, Error> {
    let several = Unsaid::SeveralWays { name: name.to_owned() };
    in_common(all, lets).ok_or(Error::Text(several))
}

fn name(text: &str) -> Name {
    Name { text: text.to_owned(), span: Span::default() }
}

/// The parameters of something that is called: as noted, or as its arguments would have them.
fn params(known: &BTreeMap<String, Vec<Param>>, call: &Call) -> Vec<Param> {
    if let Some(params) = known.get(&call.name.text) {
        return params.clone();
    }
    let letters = ('a'..='z').map(String::from);
    let each = call.args.iter().zip(letters).filter_map(|(arg, letter)| {
        let name = arg.name.as_ref().map_or(letter, |name| name.text.clone());
        Some(param(&name, arg.values.first()?))
    });
    each.collect()
}

/// A parameter of a type that the value has.
fn param(called: &str, value: &Expr) -> Param {
    let ty = match &value.kind {
        ExprKind::Literal(Quantity { dimension, .. }) => dimension.name().unwrap_or("Number"),
        ExprKind::Bool(_) => "Bool",
        ExprKind::Text(_) => "Text",
        ExprKind::Name(name) if name == "side" || name == "top" => "Face",
        _ => crate::language::builtins::OBJECT,
    };
    Param { name: name(called), ty: name(ty), default: None }
}

/// What each parameter is worth in one call; defaults in terms of those before them are filled in.
fn scope(params: &[Param], call: &Call) -> Scope {
    let mut scope = Scope::new();
    for bound in bind::arguments("", params, call).unwrap_or_default() {
        let Some(value) = bound.values.into_iter().next() else { continue };
        let value = if bound.default { bind::fill(&value, &scope) } else { value };
        scope.insert(bound.name, value);
    }
    scope
}

/// Returns the first thing that two graphs do not share: where they were read, what a drawing says and what
/// learnt counts hang on apart.
fn difference(a: &Graph, b: &Graph) -> Option<Unsaid> {
    let parts = |graph: &Graph| {
        let mut all = BTreeMap::new();
        let json = to_json(graph, &Learnt::default());
        let list = |key: &str| json[key].as_array().cloned().unwrap_or_default();
        for mut node in list("nodes") {
            let id = node["id"].as_str().unwrap_or_default().to_owned();
            if let Some(fields) = node.as_object_mut() {
                for of_the_text in ["span", "text", "label", "p", "prior", "asks"] {
                    fields.remove(of_the_text);
                }
            }
            all.insert(format!("`{id}`"), node);
        }
        for edge in list("edges") {
            all.insert(relation_words(&edge), edge);
        }
        all
    };
    let (one, other) = (parts(a), parts(b));
    for (what, value) in &one {
        match other.get(what) {
            None => return Some(Unsaid::Lost { what: what.clone() }),
            Some(there) if there != value => {
                let (would_be, is) = (short(there, value), short(value, there));
                return Some(Unsaid::Other { what: what.clone(), would_be, is });
            }
            Some(_) => {}
        }
    }
    if let Some(more) = other.keys().find(|what| !one.contains_key(*what)) {
        return Some(Unsaid::Added { what: more.clone() });
    }
    a.nodes().iter().find_map(|node| uneven_choice(node, b.find(&node.path)?))
}

fn relation_words(edge: &Value) -> String {
    let end = |key: &str| edge[key].as_str().unwrap_or_default().to_owned();
    match edge["rel"].as_str() {
        None => format!("`{}` below `{}`", end("to"), end("from")),
        Some(rel) => format!("`{}` {rel} `{}`{}", end("a"), end("b"), edge["negated"]),
    }
}

/// The fields of `value` that are other in `there`.
fn short(value: &Value, there: &Value) -> String {
    let fields = value.as_object().into_iter().flatten();
    let other = fields.filter(|(key, field)| there.get(key) != Some(*field));
    let words: Vec<String> = other.map(|(key, field)| format!("{key} {field}")).collect();
    if words.is_empty() { "without that".into() } else { words.join(", ") }
}

fn uneven_choice(node: &Node, there: &Node) -> Option<Unsaid> {
    let (NodeKind::Or(a), NodeKind::Or(b)) = (&node.kind, &there.kind) else { return None };
    if matches!(a.decides, Decides::Argument(_)) {
        return None;
    }
    let mut pairs = a.branches.iter().zip(&b.branches);
    let off = pairs.find(|(x, y)| (x.prior - y.prior).abs() > 1e-9);
    off.map(|(x, y)| Unsaid::Prior { branch: x.name.clone(), would_be: y.prior, is: x.prior })
}
