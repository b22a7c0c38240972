//! The graph in files: JSON (versioned) and the language itself ([`task`]), which are read back in full;
//! Graphviz DOT ([`dot`]); and a grammar for tools that parse with probabilities ([`pcfg`]).
//!
//! What is written and read again is written the same. Places in a text are kept for nodes, not for the
//! parts of their conditions.

pub mod dot;
mod error;
pub mod pcfg;
mod read;
pub mod task;
mod wording;
mod words;

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::{
    And, Branch, Causes, Decides, Does, Form, Graph, Holding, Node, NodeId, NodeKind, Or, Outcomes,
    Priors, Relation, Terminal,
};
use crate::language::ast::Param;
use crate::language::{assist, text};
pub use dot::to_dot;
pub use error::{Oddity, Unread, Unsaid};
pub use pcfg::to_pcfg;
pub use read::from_json;
pub use task::to_task;

/// The version of [`to_json`]'s format.
pub const VERSION: u32 = 1;

/// What is learnt, to be written beside what the text says.
#[derive(Debug, Clone, Copy, Default)]
pub struct Learnt<'a> {
    /// What came of earlier runs, twin and arm.
    pub outcomes: Option<&'a Outcomes>,
    /// Priors from demonstrations.
    pub priors: Option<&'a Priors>,
}

/// Returns the graph as JSON: `{"format": "stc-aog", "version": 1, "root": …, "nodes": […], "edges": […]}`.
///
/// Nodes are And, Or and leaf (`"stc": "T"`) and fluents (`"stc": "F"`). Edges are the tree's (`from`,
/// `to`, `order`), temporal (`"stc": "T"`), causal (`"C"`) and spatial (`"S"`).
pub fn to_json(graph: &Graph, learnt: &Learnt<'_>) -> Value {
    let mut nodes: Vec<Value> =
        graph.nodes().iter().map(|node| node_json(graph, node, learnt)).collect();
    let mut edges = Vec::new();
    for node in graph.nodes() {
        for (order, below) in graph.below(node).into_iter().enumerate() {
            edges.push(json!({"from": node.path, "to": graph.node(below).path, "order": order}));
        }
    }
    for fluent in &graph.fluents {
        let mut value = json!({
            "id": fluent.id, "stc": "F", "expr": fluent.body.as_ref().unwrap_or(&fluent.text),
            "defined": fluent.body.is_some(), "real": fluent.is_real, "objects": fluent.objects,
        });
        if let Some(ask) = &fluent.ask {
            value["ask"] = json!(ask);
        }
        if let Some(template) = &fluent.template {
            value["asks"] = json!(template);
        }
        nodes.push(value);
    }
    edges.extend(graph.relations.iter().map(|relation| relation_json(graph, relation)));
    json!({
        "format": "stc-aog", "version": VERSION, "root": graph.root().path,
        "call": text::call(&graph.call), "nodes": nodes, "edges": edges,
        "takes": signatures(&graph.signatures.callables),
        "fluents_take": signatures(&graph.signatures.fluents),
    })
}

/// `["lift(o: Graspable, by: Length = 12 cm)", …]`
fn signatures(all: &BTreeMap<String, Vec<Param>>) -> Vec<String> {
    all.iter().map(|(name, params)| assist::signature(name, params)).collect()
}

/// Ten pseudo-counts shared out; whole numbers are written as such.
fn count(prior: f64) -> Value {
    let count = (prior * 1e4).round() / 1e3;
    if count.fract() == 0.0 { json!(count as u64) } else { json!(count) }
}

/// A share without the dust that adding up to 1 leaves on it.
fn plain(share: f64) -> f64 {
    (share * 1e12).round() / 1e12
}

/// A node's entries.
#[derive(Default)]
struct Entries(Map<String, Value>);

impl Entries {
    fn put(&mut self, key: &str, entry: Value) {
        self.0.insert(key.to_owned(), entry);
    }

    /// Conditions as texts; a list of none is left out.
    fn put_conditions(&mut self, causes: &Causes, holding: &Holding) {
        let words = [
            ("needs", &causes.needs),
            ("keeps", &causes.keeps),
            ("gives", &causes.gives),
            ("while", &holding.whiles),
            ("until", &holding.untils),
        ];
        for (word, all) in words.into_iter().filter(|(_, all)| !all.is_empty()) {
            self.put(word, json!(all.iter().map(text::expr).collect::<Vec<_>>()));
        }
    }
}

fn node_json(graph: &Graph, node: &Node, learnt: &Learnt<'_>) -> Value {
    let mut entries = Entries::default();
    entries.put("id", json!(node.path));
    entries.put("ao", json!(kind(node)));
    entries.put("stc", json!("T"));
    entries.put("label", json!(node.label));
    entries.put("within", json!(node.within));
    entries.put("key", json!(node.key));
    if let Some(pause) = &node.pause {
        entries.put("pause", json!({ "when": pause.when.as_ref().map(text::expr) }));
    }
    let file = graph.files.get(&node.within).or_else(|| graph.files.get(&node.key));
    entries.put("span", json!([file.unwrap_or(&node.within), node.span.from, node.span.to]));
    if let Some((or, branch)) = branch_above(graph, node) {
        put_branch(&mut entries, or, branch, learnt);
    }
    match &node.kind {
        NodeKind::And(and) => put_and(&mut entries, and),
        NodeKind::Or(or) => {
            entries.put("decides", json!(decides_word(&or.decides)));
            if let Some(via) = or.via {
                entries.put("via", json!(or.branches[via].name));
            }
        }
        NodeKind::Terminal(terminal) => put_terminal(&mut entries, terminal),
    }
    Value::Object(entries.0)
}

/// What the choice above says of the branch that a node is.
fn put_branch(entries: &mut Entries, or: &Or, branch: &Branch, learnt: &Learnt<'_>) {
    entries.put("branch", json!(branch.name));
    if or.decides.is_free() {
        if !branch.was.is_empty() {
            entries.put("was", json!(branch.was));
        }
        let i = or.branches.iter().position(|b| b.node == branch.node).unwrap_or(0);
        let prior = learnt.priors.map_or(branch.prior, |priors| priors.of(or)[i]);
        entries.put("text", json!(super::outcome::fingerprint(branch.text)));
        entries.put("p", json!(prior));
        entries.put("prior", json!({"count": count(prior), "of": 10}));
        if let Some(outcomes) = learnt.outcomes {
            let pair = |domain| {
                let counts = outcomes.of(branch, domain);
                json!([counts.worked, counts.failed])
            };
            entries.put("success", json!({"real": pair("real"), "twin": pair("twin")}));
        }
    }
    if let Some(guard) = &branch.guard {
        entries.put("guard", json!(text::expr(guard)));
    }
}

fn put_and(entries: &mut Entries, and: &And) {
    entries.put_conditions(&and.causes, &and.holding);
    entries.put("form", json!(form_word(&and.form)));
    if let Form::Task(call) = &and.form {
        entries.put("call", json!(text::call(call)));
    }
    if let Form::Recovery { of, remedy } = &and.form {
        entries.put("of", json!(of.as_ref().map(text::call)));
        entries.put("remedy", json!(remedy.as_ref().map(text::remedy)));
    }
    if let Some(limit) = and.limit {
        entries.put("limit_s", json!(limit));
    }
}

fn put_terminal(entries: &mut Entries, terminal: &Terminal) {
    entries.put_conditions(&terminal.causes, &terminal.holding);
    match &terminal.does {
        Does::Action { name, args } => {
            let order: Vec<&str> = args.iter().map(|a| a.name.as_str()).collect();
            entries.put("parameters", json!(order));
            let args: Map<String, Value> =
                args.iter().map(|a| (a.name.clone(), json!(a.text))).collect();
            entries.put("action", json!(name));
            entries.put("args", Value::Object(args));
        }
        Does::Check(what) => entries.put("check", json!(text::expr(what))),
        Does::Let { name, value } => {
            entries.put("let", json!({"name": name, "value": text::expr(value)}));
        }
    }
    if let Some(script) = &terminal.script {
        entries.put("script", json!(script));
    }
    if let Some(limit) = terminal.limit {
        entries.put("limit_s", json!(limit));
    }
}

fn relation_json(graph: &Graph, relation: &Relation) -> Value {
    let path = |id: &NodeId| graph.node(*id).path.as_str();
    match relation {
        Relation::Temporal { a, allen, b, by } => {
            let mut value =
                json!({"stc": "T", "rel": text::allen(*allen), "a": path(a), "b": path(b)});
            if let Some(by) = by {
                value["by_s"] = json!(by);
            }
            value
        }
        Relation::Causal { node, role, fluent, negated } => json!({
            "stc": "C", "rel": role.word(), "a": path(node), "b": graph.fluents[*fluent].id,
            "negated": negated,
        }),
        Relation::Spatial { fluent, objects } => json!({
            "stc": "S", "rel": "over", "a": graph.fluents[*fluent].id, "objects": objects,
        }),
    }
}

/// Returns `and`, `or` or `leaf`.
fn kind(node: &Node) -> &'static str {
    match &node.kind {
        NodeKind::And(_) => "and",
        NodeKind::Or(_) => "or",
        NodeKind::Terminal(_) => "leaf",
    }
}

fn form_word(form: &Form) -> &'static str {
    match form {
        Form::Task(_) => "task",
        Form::Sequence => "sequence",
        Form::Together => "together",
        Form::Repeat => "repeat",
        Form::Skip => "skip",
        Form::Recovery { .. } => "recovery",
    }
}

fn decides_word(decides: &Decides) -> String {
    match decides {
        Decides::Choice => "choice".into(),
        Decides::Argument(name) => format!("argument {name}"),
        Decides::Condition(e) => format!("if {}", text::expr(e)),
        Decides::Repetition(e) => format!("until {}", text::expr(e)),
        Decides::Recovery => "failure".into(),
    }
}

fn branch_above<'g>(graph: &'g Graph, node: &Node) -> Option<(&'g Or, &'g Branch)> {
    let NodeKind::Or(or) = &graph.node(node.parent?).kind else { return None };
    Some((or, or.branches.iter().find(|branch| branch.node == node.id)?))
}
