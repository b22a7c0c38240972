//! JSON → graph: what [`super::to_json`] writes, read back.
//!
//! Conditions and calls are texts of the language and are read by its parser, so a file that somebody
//! else wrote is held to the same rules.

use std::collections::BTreeMap;

use serde_json::Value;

use super::super::{
    And, Argument, Branch, Causes, Decides, Does, Error, FluentNode, Form, Graph, Holding, Node,
    NodeId, NodeKind, Or, Pause, Relation, Role, Terminal,
};
use super::VERSION;
use crate::language::ast::{Allen, Call, Expr, ExprKind, Item, Remedy, Span, Step};
use crate::language::parse;

/// Reads a graph that [`super::to_json`] wrote.
///
/// # Errors
///
/// [`Error::Exchange`] with what is missing or cannot be read, and where.
pub fn from_json(value: &Value) -> Result<Graph, Error> {
    if value["format"] != "stc-aog" || value["version"] != VERSION {
        return Err(wrong("it is not a graph of `stc-aog`, version 1"));
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
        let place = list(node, "span")?;
        let within = text(node, "within")?.to_owned();
        let key = text(node, "key")?.to_owned();
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
            label: text(node, "label")?.to_owned(),
            span: Span { from: byte(1), to: byte(2) },
            within,
            parent: parent.get(&id).copied(),
            pause,
            kind: kind(node, &children, &tree)?,
        });
    }
    let root = *ids.get(text(value, "root")?).ok_or_else(|| wrong("the root is no node"))?;
    let fluents = fluents.into_iter().map(fluent).collect::<Result<Vec<_>, _>>()?;
    let mut relations = Vec::new();
    for edge in edges.iter().filter(|edge| edge.get("rel").is_some()) {
        relations.push(relation(edge, &ids, &fluents)?);
    }
    let call = call(text(value, "call")?)?;
    Ok(Graph { nodes, root, call, relations, fluents, files })
}

fn wrong(what: impl Into<String>) -> Error {
    Error::Exchange(what.into())
}

fn text<'v>(value: &'v Value, key: &str) -> Result<&'v str, Error> {
    value[key].as_str().ok_or_else(|| wrong(format!("`{key}` is missing in {}", short(value))))
}

fn optional<'v>(value: &'v Value, key: &str) -> Result<Option<&'v str>, Error> {
    match value.get(key) {
        None | Some(Value::Null) => Ok(None),
        Some(_) => text(value, key).map(Some),
    }
}

fn list<'v>(value: &'v Value, key: &str) -> Result<&'v [Value], Error> {
    let list = value[key].as_array().map(Vec::as_slice);
    list.ok_or_else(|| wrong(format!("`{key}` is no list in {}", short(value))))
}

/// What a message calls a part of the file.
fn short(value: &Value) -> String {
    value["id"]
        .as_str()
        .map_or_else(|| value.to_string().chars().take(60).collect(), |id| format!("`{id}`"))
}

fn end(ids: &BTreeMap<&str, NodeId>, edge: &Value, key: &str) -> Result<NodeId, Error> {
    let id = text(edge, key)?;
    ids.get(id).copied().ok_or_else(|| wrong(format!("an edge names `{id}`, which is no node")))
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
            let decides = decides(text(node, "decides")?)?;
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
        other => return Err(wrong(format!("a node is `and`, `or` or `leaf`, not `{other}`"))),
    })
}

/// Branches that nobody chooses between have no prior in the file.
fn settled(decides: &Decides, mut branches: Vec<Branch>) -> Vec<Branch> {
    let priors: &[f64] = match decides {
        Decides::Choice | Decides::Argument(_) => return branches,
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
    Ok(match text(node, "form")? {
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
        other => return Err(wrong(format!("there is no form `{other}`"))),
    })
}

fn decides(word: &str) -> Result<Decides, Error> {
    Ok(match word.split_once(' ') {
        Some(("argument", name)) => Decides::Argument(name.to_owned()),
        Some(("if", condition)) => Decides::Condition(expr(condition)?),
        Some(("until", condition)) => Decides::Repetition(expr(condition)?),
        None if word == "choice" => Decides::Choice,
        None if word == "failure" => Decides::Recovery,
        _ => return Err(wrong(format!("nothing decides by `{word}`"))),
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
        name: text(node, "branch")?.to_owned(),
        prior: share.unwrap_or(0.0),
        guard: optional(node, "guard")?.map(expr).transpose()?,
        key: text(node, "key")?.to_owned(),
        was: was.map(str::to_owned).collect(),
        text: u64::from_str_radix(fingerprint, 16)
            .map_err(|_| wrong(format!("`{fingerprint}` is no fingerprint")))?,
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
    let mut args = Vec::new();
    for name in list(node, "parameters")?.iter().filter_map(Value::as_str) {
        let said = text(&node["args"], name)?;
        args.push(Argument { name: name.to_owned(), value: expr(said)?, text: said.to_owned() });
    }
    Ok(Does::Action { name: text(node, "action")?.to_owned(), args })
}

fn fluent(node: &Value) -> Result<FluentNode, Error> {
    let id = text(node, "id")?.to_owned();
    let said = id.strip_prefix("f:").unwrap_or(&id).to_owned();
    let objects = list(node, "objects")?.iter().filter_map(Value::as_str).map(str::to_owned);
    Ok(FluentNode {
        text: said,
        body: (node["defined"] == true)
            .then(|| text(node, "expr").map(str::to_owned))
            .transpose()?,
        ask: optional(node, "ask")?.map(str::to_owned),
        objects: objects.collect(),
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
        at.ok_or_else(|| wrong(format!("an edge names `{id}`, which is no fluent")))
    };
    let rel = text(edge, "rel")?;
    Ok(match text(edge, "stc")? {
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
        other => return Err(wrong(format!("there is no relation `{other}`"))),
    })
}

fn allen(word: &str) -> Result<Allen, Error> {
    use Allen::{Before, During, Equals, Finishes, Meets, Overlaps, Starts};
    let all = [Before, Meets, Overlaps, Starts, During, Finishes, Equals];
    let found = all.into_iter().find(|relation| crate::language::text::allen(*relation) == word);
    found.ok_or_else(|| wrong(format!("there is no relation in time `{word}`")))
}

fn role(word: &str) -> Result<Role, Error> {
    use Role::{Checks, Gives, Guard, Keeps, Needs, Until};
    let all = [Needs, Keeps, Gives, Checks, Until, Guard];
    let found = all.into_iter().find(|role| role.word() == word);
    found.ok_or_else(|| wrong(format!("there is no role `{word}`")))
}

/// Reads a condition or a value as the language writes it.
fn expr(said: &str) -> Result<Expr, Error> {
    let (mut program, wrong_parts) = parse(&format!("fluent f() = {said}"));
    match program.items.pop() {
        Some(Item::Fluent(fluent))
            if wrong_parts.is_empty() && fluent.body.kind != ExprKind::Bad =>
        {
            Ok(fluent.body)
        }
        _ => Err(wrong(format!("`{said}` is no condition or value"))),
    }
}

fn call(said: &str) -> Result<Call, Error> {
    let (mut program, wrong_parts) = parse(said);
    match program.items.pop() {
        Some(Item::Run(Step::Act(act))) if wrong_parts.is_empty() => Ok(act.call),
        // `on failure of grasp`: any call of it.
        _ if is_name(said) => {
            let name = crate::language::ast::Name { text: said.to_owned(), span: Span::default() };
            Ok(Call { name, args: Vec::new(), span: Span::default() })
        }
        _ => Err(wrong(format!("`{said}` is no call"))),
    }
}

fn is_name(said: &str) -> bool {
    !said.is_empty() && said.chars().all(|c| c.is_alphanumeric() || c == '_')
}

fn remedy(said: &str) -> Result<Remedy, Error> {
    let (mut program, _) = parse(&format!("task t() {{ on failure {{ {said} }} }}"));
    match program.items.pop() {
        Some(Item::Task(mut task)) => task.recoveries.pop().and_then(|recovery| recovery.remedy),
        _ => None,
    }
    .ok_or_else(|| wrong(format!("`{said}` is no remedy")))
}
