//! The graph for Graphviz, and what a DOT file says of a graph.
//!
//! The attribute names are those of the authors' own program (`STC`, `AO`, `name`); `weight` and `id` are
//! added. A drawing keeps the shape of a graph and not what its conditions are made of, so what is read
//! back is a [`Sketch`]: nodes, edges, weights.
//!
//! Source: github.com/BinRoot/STCAOG for the attributes.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::super::{Error, Graph, NodeId, NodeKind, Relation, Role};
use super::error::Unread;
use super::kind;
use crate::language::text;

/// Returns the graph for Graphviz: `dot -Tsvg`.
pub fn to_dot(graph: &Graph) -> String {
    let mut out =
        String::from("digraph stcaog {\n  rankdir=LR;\n  node [fontname=\"sans-serif\"];\n");
    let name = |id: &NodeId| format!("n{}", id.0);
    for node in graph.nodes() {
        let (shape, style) = match &node.kind {
            NodeKind::And(_) => ("box", "filled,rounded"),
            NodeKind::Or(_) => ("diamond", "bold"),
            NodeKind::Terminal(_) => ("box", "solid"),
        };
        let (id, path) = (name(&node.id), quoted(&node.path));
        let (ao, label) = (kind(node), quoted(&node.label));
        let _ = writeln!(
            out,
            "  {id} [id={path}, name={label}, label={label}, STC=\"T\", AO=\"{ao}\", shape={shape}, style=\"{style}\"];"
        );
    }
    for (i, fluent) in graph.fluents.iter().enumerate() {
        let (id, label) = (quoted(&fluent.id), quoted(&fluent.text));
        let _ = writeln!(
            out,
            "  f{i} [id={id}, name={label}, label={label}, STC=\"F\", AO=\"leaf\", shape=oval];"
        );
    }
    for node in graph.nodes() {
        for (order, below) in graph.below(node).iter().enumerate() {
            let weight = match &node.kind {
                NodeKind::Or(or) if or.decides.is_free() => {
                    format!(", weight={p}, label=\"{p}\"", p = or.branches[order].prior)
                }
                _ => String::new(),
            };
            let _ = writeln!(out, "  {} -> {} [STC=\"T\"{weight}];", name(&node.id), name(below));
        }
    }
    for relation in &graph.relations {
        let _ = match relation {
            Relation::Temporal { a, allen, b, .. } => writeln!(
                out,
                "  {} -> {} [STC=\"T\", label=\"{}\", color=gray, constraint=false];",
                name(a),
                name(b),
                text::allen(*allen)
            ),
            Relation::Causal { node, role, fluent, negated } => {
                let not = if *negated { " not" } else { "" };
                let ends = if *role == Role::Gives { "" } else { ", dir=back" };
                writeln!(
                    out,
                    "  {} -> f{fluent} [STC=\"C\", label=\"{}{not}\", style=dashed{ends}];",
                    name(node),
                    role.word()
                )
            }
            Relation::Spatial { .. } => Ok(()),
        };
    }
    out.push_str("}\n");
    out
}

/// The shape of a graph: what a DOT file holds of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sketch {
    /// Nodes by id: `STC`, `AO` and `name`.
    pub nodes: BTreeMap<String, [String; 3]>,
    /// Edges in order: from, to, `STC`, label, weight.
    pub edges: Vec<SketchEdge>,
}

/// An edge of a [`Sketch`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SketchEdge {
    /// Id of the node it leaves.
    pub from: String,
    /// Id of the node it reaches.
    pub to: String,
    /// `T` or `C`.
    pub stc: String,
    /// What it says; empty for a plain edge of the tree.
    pub label: String,
    /// The probability of a branch.
    pub weight: Option<f64>,
}

impl Sketch {
    /// Returns the shape of a graph.
    pub fn of(graph: &Graph) -> Self {
        let mut sketch = Self::default();
        for node in graph.nodes() {
            let said = ["T".into(), kind(node).into(), node.label.clone()];
            sketch.nodes.insert(node.path.clone(), said);
        }
        for fluent in &graph.fluents {
            let said = ["F".into(), "leaf".into(), fluent.text.clone()];
            sketch.nodes.insert(fluent.id.clone(), said);
        }
        for node in graph.nodes() {
            for (order, below) in graph.below(node).iter().enumerate() {
                let weight = match &node.kind {
                    NodeKind::Or(or) if or.decides.is_free() => Some(or.branches[order].prior),
                    _ => None,
                };
                sketch.edges.push(SketchEdge {
                    from: node.path.clone(),
                    to: graph.node(*below).path.clone(),
                    stc: "T".into(),
                    label: weight.map(|p| p.to_string()).unwrap_or_default(),
                    weight,
                });
            }
        }
        for relation in &graph.relations {
            let path = |id: &NodeId| graph.node(*id).path.clone();
            let (from, to, stc, label) = match relation {
                Relation::Temporal { a, allen, b, .. } => {
                    (path(a), path(b), "T", text::allen(*allen).to_owned())
                }
                Relation::Causal { node, role, fluent, negated } => {
                    let not = if *negated { " not" } else { "" };
                    let to = graph.fluents[*fluent].id.clone();
                    (path(node), to, "C", format!("{}{not}", role.word()))
                }
                Relation::Spatial { .. } => continue,
            };
            sketch.edges.push(SketchEdge { from, to, stc: stc.into(), label, weight: None });
        }
        sketch
    }

    /// Reads a DOT file with these attributes: one statement a line, as [`to_dot`] and the authors write.
    ///
    /// # Errors
    ///
    /// [`Error::Exchange`] with the line that is no statement, or that names a node nobody declared.
    pub fn from_dot(dot: &str) -> Result<Self, Error> {
        let mut sketch = Self::default();
        let mut ids: BTreeMap<&str, String> = BTreeMap::new();
        let mut edges = Vec::new();
        for (i, line) in dot.lines().enumerate() {
            let line = line.trim().trim_end_matches(';');
            let Some((head, attributes)) = line.split_once('[') else { continue };
            let at = i + 1;
            let attributes =
                attributes.strip_suffix(']').ok_or(Error::Exchange(Unread::OpenBracket(at)))?;
            let attributes =
                read_attributes(attributes).ok_or(Error::Exchange(Unread::Attributes(at)))?;
            let get = |name: &str| attributes.get(name).cloned().unwrap_or_default();
            let head = head.trim();
            if let Some((from, to)) = head.split_once("->") {
                edges.push((from.trim(), to.trim(), attributes));
            } else if attributes.contains_key("STC") {
                // Without an `id`, the name in the file is the node's.
                let id = attributes.get("id").cloned().unwrap_or_else(|| head.to_owned());
                ids.insert(head, id.clone());
                sketch.nodes.insert(id, [get("STC"), get("AO"), get("name")]);
            }
        }
        for (from, to, attributes) in edges {
            let end = |name: &str| {
                let lost = || Error::Exchange(Unread::NoNode { id: name.to_owned() });
                ids.get(name).cloned().ok_or_else(lost)
            };
            let get = |name: &str| attributes.get(name).cloned().unwrap_or_default();
            sketch.edges.push(SketchEdge {
                from: end(from)?,
                to: end(to)?,
                stc: get("STC"),
                label: get("label"),
                weight: attributes.get("weight").and_then(|weight| weight.parse().ok()),
            });
        }
        Ok(sketch)
    }
}

/// Reads `name="value", name=value`.
fn read_attributes(text: &str) -> Option<BTreeMap<String, String>> {
    let mut found = BTreeMap::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let (name, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let (value, left) = if let Some(quoted) = after.strip_prefix('"') {
            let mut value = String::new();
            let mut chars = quoted.char_indices();
            let end = loop {
                match chars.next()? {
                    (_, '\\') => value.push(chars.next()?.1),
                    (at, '"') => break at,
                    (_, c) => value.push(c),
                }
            };
            (value, &quoted[end + 1..])
        } else {
            let end = after.find(',').unwrap_or(after.len());
            (after[..end].trim().to_owned(), &after[end..])
        };
        found.insert(name.trim().to_owned(), value);
        rest = left.trim_start().trim_start_matches(',').trim_start();
    }
    Some(found)
}

/// Writes a DOT string: quotes and backslashes escaped.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', " "))
}
