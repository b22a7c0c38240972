//! JSON → graph: what [`super::to_json`] writes, read back.
//!
//! What another program leaves out is what the rest says: a key is read off the path, a label off what the node
//! does, the kind of a relation off its name.
//!
//! Conditions and calls are texts of the language and are read by its parser, so a file that somebody
//! else wrote is held to the same rules.

use std::collections::BTreeMap;

use serde_json::Value;

use super::super::{
    And, Argument, Branch, Causes, Decides, Does, Error, FluentNode, Form, Graph, Holding, Node,
    NodeId, NodeKind, Or, Pause, Relation, Signatures, Terminal,
};
use super::VERSION;
use super::error::Unread;
use super::words::{allen, call, decides, expr, remedy, role, signatures};
use crate::language::ast::{Expr, Span};

/// Reads a graph that [`super::to_json`] wrote.
///
/// # Errors
///
/// [`Error::Exchange`] with what is missing or cannot be read, and where.
pub fn from_json(value: &Value) -> Result<Graph, Error> {
    if value["format"] != "stc-aog" || value["version"] != VERSION {
        return Err(wrong(Unread::Format));
    }
    let all = list(value, "nodes")?;
    let (fluents, tree): (Vec<&Value>, Vec<&Value>) = all.iter().partition(|n| n["stc"] == "F");
    let ids: BTreeMap<&str, NodeId> = tree
        .iter()
        .enumerate()
        .map(|(i, node)| Ok((text(node, "id")?, NodeId(i as u32))))
        .collect::<Result<_, Error>>()?;
    let mut below: BTreeMap<NodeId, Vec<(u64, NodeId)>> = BTreeMap::new();
    let mut parent: BTreeMap<NodeId, NodeId> = BTreeMap::new();
    let edges = list(value, "edges")?;
    for edge in edges.iter().filter(|edge| edge.get("from").is_some()) {
        let (from, to) = (end(&ids, edge, "from")?, end(&ids, edge, "to")?);
        below.entry(from).or_default().push((edge["order"].as_u64().unwrap_or(0), to));
        parent.insert(to, from);
    }
    for children in below.values_mut() {
        children.sort_unstable();
    }
    let mut files = BTreeMap::new();
    let mut nodes = Vec::new();
    for (i, node) in tree.iter().enumerate() {
        let id = NodeId(i as u32);
        let children: Vec<NodeId> =
            below.get(&id).into_iter().flatten().map(|(_, child)| *child).collect();
        let place = node["span"].as_array().map(Vec::as_slice).unwrap_or_default();
        let (key, within) = place_of(i, &tree, &ids, &parent)?;
        if let Some(file) = place.first().and_then(Value::as_str).filter(|file| **file != *within) {
            files.insert(
                if within.is_empty() { key.clone() } else { within.clone() },
                file.to_owned(),
            );
        }
        let byte = |at: usize| place.get(at).and_then(Value::as_u64).unwrap_or(0) as usize;
        let pause = match node.get("pause") {
            Some(pause) => Some(Pause { when: optional(pause, "when")?.map(expr).transpose()? }),
            None => None,
        };
        nodes.push(Node {
            id,
            path: text(node, "id")?.to_owned(),
            key,
            label: label(node)?,
            span: Span { from: byte(1), to: byte(2) },
            within,
            parent: parent.get(&id).copied(),
            pause,
            kind: kind(node, &children, &tree)?,
        });
    }
    let keys: Vec<String> = nodes.iter().map(|node| node.key.clone()).collect();
    for node in &mut nodes {
        if let NodeKind::Or(or) = &mut node.kind {
            for branch in &mut or.branches {
                branch.key.clone_from(&keys[branch.node.idx()]);
            }
        }
    }
    let root = text(value, "root")?;
    let called = optional(value, "call")?;
    let call = call(called.unwrap_or(&format!("{root}()")))?;
    let root = *ids.get(root).ok_or_else(|| wrong(Unread::Root))?;
    let fluents = fluents.into_iter().map(fluent).collect::<Result<Vec<_>, _>>()?;
    let mut relations = Vec::new();
    for edge in edges.iter().filter(|edge| edge.get("rel").is_some()) {
        relations.push(relation(edge, &ids, &fluents)?);
    }
    let signatures = Signatures {
        callables: signatures(value, "takes")?,
        fluents: signatures(value, "fluents_take")?,
    };
    Ok(Graph { nodes, root, call, relations, fluents, files, signatures })
}

/// The key of a node and the task it is written in; where the file does not say, as its path does.
fn place_of(
    at: usize,
    tree: &[&Value],
    ids: &BTreeMap<&str, NodeId>,
    parent: &BTreeMap<NodeId, NodeId>,
) -> Result<(String, String), Error> {
    let node = tree[at];
    let said = (optional(node, "key")?, optional(node, "within")?);
    if let (Some(key), Some(within)) = said {
        return Ok((key.to_owned(), within.to_owned()));
    }
    let path = text(node, "id")?;
    let id = ids[path];
    // A tree that goes round in a circle has no top to count from.
    let mut above = Vec::new();
    let mut next = parent.get(&id);
    while let Some(up) = next.filter(|up| !above.contains(*up)) {
        above.push(*up);
        next = parent.get(up);
    }
    let is_task = |id: &&NodeId| {
        let node = tree[id.0 as usize];
        node["form"] == "task" || parent.get(*id).is_none()
    };
    let Some(task) = above.iter().find(is_task) else {
        return Ok((path.to_owned(), String::new()));
    };
    let task = tree[task.0 as usize];
    let name = match optional(task, "call")? {
        Some(said) => call(said)?.name.text,
        None => text(task, "id")?.to_owned(),
    };
    let below = path.strip_prefix(text(task, "id")?).unwrap_or(path);
    Ok((
        said.0.map_or_else(|| format!("{name}{below}"), str::to_owned),
        said.1.map_or_else(|| name.clone(), str::to_owned),
    ))
}

/// What a drawing says in a node.
fn label(node: &Value) -> Result<String, Error> {
    if let Some(label) = optional(node, "label")?.or(optional(node, "call")?) {
        return Ok(label.to_owned());
    }
    if let Some(action) = optional(node, "action")? {
        let args: Vec<String> =
            arguments(node)?.into_iter().map(|arg| format!("{}: {}", arg.name, arg.text)).collect();
        return Ok(format!("{action}({})", args.join(", ")));
    }
    let path = text(node, "id")?;
    Ok(path.rsplit(['/', '.']).next().unwrap_or(path).to_owned())
}

fn wrong(what: Unread) -> Error {
    Error::Exchange(what)
}

fn text<'v>(value: &'v Value, key: &str) -> Result<&'v str, Error> {
    value[key]
        .as_str()
        .ok_or_else(|| wrong(Unread::Missing { key: key.to_owned(), part: short(value) }))
}

fn optional<'v>(value: &'v Value, key: &str) -> Result<Option<&'v str>, Error> {
    match value.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(_) => text(value, key).map(Some),
    }
}

fn list<'v>(value: &'v Value, key: &str) -> Result<&'v [Value], Error> {
    let list = value[key].as_array().map(Vec::as_slice);
    list.ok_or_else(|| wrong(Unread::NoList { key: key.to_owned(), part: short(value) }))
}

/// What a message calls a part of the file.
fn short(value: &Value) -> String {
    value["id"]
        .as_str()
        .map_or_else(|| value.to_string().chars().take(60).collect(), |id| format!("`{id}`"))
}

fn end(ids: &BTreeMap<&str, NodeId>, edge: &Value, key: &str) -> Result<NodeId, Error> {
    let id = text(edge, key)?;
    ids.get(id).copied().ok_or_else(|| wrong(Unread::NoNode { id: id.to_owned() }))
}

fn kind(node: &Value, children: &[NodeId], tree: &[&Value]) -> Result<NodeKind, Error> {
    let at = |id: &NodeId| tree[id.0 as usize];
    Ok(match text(node, "ao")? {
        "and" => {
            let is_recovery = |id: &&NodeId| at(id)["decides"] == "failure";
            let (recoveries, children): (Vec<&NodeId>, Vec<&NodeId>) =
                children.iter().partition(is_recovery);
            NodeKind::And(And {
                form: form(node)?,
                children: children.into_iter().copied().collect(),
                causes: causes(node)?,
                holding: holding(node)?,
                recoveries: recoveries.into_iter().copied().collect(),
                limit: node["limit_s"].as_f64(),
            })
        }
        "or" => {
            let branches: Vec<Branch> =
                children.iter().map(|child| branch(at(child), *child)).collect::<Result<_, _>>()?;
            let via = optional(node, "via")?;
            let via = via.and_then(|via| branches.iter().position(|b| b.name == via));
            let decides = decides(optional(node, "decides")?.unwrap_or("choice"))?;
            NodeKind::Or(Or {
                decides: decides.clone(),
                via,
                branches: settled(&decides, branches),
            })
        }
        "leaf" => NodeKind::Terminal(Terminal {
            does: does(node)?,
            causes: causes(node)?,
            holding: holding(node)?,
            script: optional(node, "script")?.map(str::to_owned),
            limit: node["limit_s"].as_f64(),
        }),
        other => return Err(wrong(Unread::Kind(other.to_owned()))),
    })
}

/// Branches that nobody chooses between have no prior in the file; of the others some may be missing.
fn settled(decides: &Decides, mut branches: Vec<Branch>) -> Vec<Branch> {
    let priors: &[f64] = match decides {
        Decides::Choice | Decides::Argument(_) => {
            let given: f64 = branches.iter().map(|b| b.prior).filter(|p| !p.is_nan()).sum();
            let open = branches.iter().filter(|b| b.prior.is_nan()).count();
            for branch in branches.iter_mut().filter(|b| b.prior.is_nan()) {
                branch.prior = (1.0 - given).max(0.0) / open as f64;
            }
            return branches;
        }
        Decides::Condition(_) => &[0.5, 0.5],
        Decides::Repetition(_) => &[0.0, 1.0],
        Decides::Recovery => &[1.0, 0.0],
    };
    for (branch, prior) in branches.iter_mut().zip(priors) {
        branch.prior = *prior;
    }
    branches
}

fn form(node: &Value) -> Result<Form, Error> {
    let Some(form) = optional(node, "form")? else {
        // In a file that names no forms, what stands behind a dot is a branch; the rest is called.
        let path = text(node, "id")?;
        if path.rfind('.') > path.rfind('/') {
            return Ok(Form::Sequence);
        }
        let label = label(node)?;
        return call(&label).or_else(|_| call(&format!("{label}()"))).map(Form::Task);
    };
    Ok(match form {
        "task" => Form::Task(call(text(node, "call")?)?),
        "sequence" => Form::Sequence,
        "together" => Form::Together,
        "repeat" => Form::Repeat,
        "skip" => Form::Skip,
        "recovery" => {
            let of = optional(node, "of")?.map(call).transpose()?;
            let remedy = optional(node, "remedy")?.map(remedy).transpose()?;
            Form::Recovery { of, remedy }
        }
        other => return Err(wrong(Unread::Form(other.to_owned()))),
    })
}

fn branch(node: &Value, id: NodeId) -> Result<Branch, Error> {
    let prior = &node["prior"];
    let share = prior["count"].as_f64().zip(prior["of"].as_f64()).map(|(count, of)| count / of);
    // Somebody else's file may have the counts alone.
    let share = node["p"].as_f64().or(share);
    let was = node["was"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let fingerprint = optional(node, "text")?.unwrap_or("0");
    Ok(Branch {
        name: optional(node, "branch")?.map_or_else(|| branch_name(node), str::to_owned),
        // What is missing shares the rest: see `settled`.
        prior: share.unwrap_or(f64::NAN),
        guard: optional(node, "guard")?.map(expr).transpose()?,
        // That of its node, once all are read.
        key: String::new(),
        was: was.map(str::to_owned).collect(),
        text: u64::from_str_radix(fingerprint, 16)
            .map_err(|_| wrong(Unread::Fingerprint(fingerprint.to_owned())))?,
        node: id,
    })
}

fn conditions(node: &Value, key: &str) -> Result<Vec<Expr>, Error> {
    let all = node[key].as_array().into_iter().flatten().filter_map(Value::as_str);
    all.map(expr).collect()
}

fn causes(node: &Value) -> Result<Causes, Error> {
    Ok(Causes {
        needs: conditions(node, "needs")?,
        keeps: conditions(node, "keeps")?,
        gives: conditions(node, "gives")?,
    })
}

fn holding(node: &Value) -> Result<Holding, Error> {
    Ok(Holding { whiles: conditions(node, "while")?, untils: conditions(node, "until")? })
}

fn does(node: &Value) -> Result<Does, Error> {
    if let Some(check) = optional(node, "check")? {
        return Ok(Does::Check(expr(check)?));
    }
    if let Some(set) = node.get("let") {
        let name = text(set, "name")?.to_owned();
        return Ok(Does::Let { name, value: expr(text(set, "value")?)? });
    }
    Ok(Does::Action { name: text(node, "action")?.to_owned(), args: arguments(node)? })
}

/// The arguments of an action, in the order of its parameters where the file gives one.
fn arguments(node: &Value) -> Result<Vec<Argument>, Error> {
    let given = node["args"].as_object();
    let order: Vec<&str> = match node["parameters"].as_array() {
        Some(order) => order.iter().filter_map(Value::as_str).collect(),
        None => given.into_iter().flat_map(|args| args.keys().map(String::as_str)).collect(),
    };
    let each = order.into_iter().map(|name| {
        // `$o`: what the caller gave for `o`.
        let said = text(&node["args"], name)?;
        let said = said.strip_prefix('$').unwrap_or(said);
        Ok(Argument { name: name.to_owned(), value: expr(said)?, text: said.to_owned() })
    });
    each.collect()
}

fn branch_name(node: &Value) -> String {
    let path = node["id"].as_str().unwrap_or_default();
    path.rsplit(['/', '.']).next().unwrap_or(path).to_owned()
}

fn fluent(node: &Value) -> Result<FluentNode, Error> {
    let id = text(node, "id")?.to_owned();
    let said = id.strip_prefix("f:").unwrap_or(&id).to_owned();
    let objects = node["objects"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let ask = optional(node, "ask")?;
    Ok(FluentNode {
        text: said,
        body: (node["defined"] != false)
            .then(|| text(node, "expr").map(str::to_owned))
            .transpose()?,
        ask: ask.map(str::to_owned),
        template: optional(node, "asks")?.or(ask).map(str::to_owned),
        objects: objects.map(str::to_owned).collect(),
        is_real: node["real"] == true,
        id,
    })
}

fn relation(
    edge: &Value,
    ids: &BTreeMap<&str, NodeId>,
    fluents: &[FluentNode],
) -> Result<Relation, Error> {
    let fluent = |key: &str| {
        let id = text(edge, key)?;
        let at = fluents.iter().position(|fluent| fluent.id == id);
        at.ok_or_else(|| wrong(Unread::NoFluent { id: id.to_owned() }))
    };
    let rel = text(edge, "rel")?;
    let part = optional(edge, "stc")?.unwrap_or(match rel {
        _ if allen(rel).is_ok() => "T",
        "over" => "S",
        _ => "C",
    });
    Ok(match part {
        "T" => Relation::Temporal {
            a: end(ids, edge, "a")?,
            allen: allen(rel)?,
            b: end(ids, edge, "b")?,
            by: edge["by_s"].as_f64(),
        },
        "C" => Relation::Causal {
            node: end(ids, edge, "a")?,
            role: role(rel)?,
            fluent: fluent("b")?,
            negated: edge["negated"] == true,
        },
        "S" => {
            let objects = list(edge, "objects")?.iter().filter_map(Value::as_str);
            Relation::Spatial {
                fluent: fluent("a")?,
                objects: objects.map(str::to_owned).collect(),
            }
        }
        other => return Err(wrong(Unread::Relation(other.to_owned()))),
    })
}
