//! The graph as a probabilistic grammar of its terminals, for tools that parse with one.
//!
//! The notation is that of the Natural Language Toolkit's grammars, which the generalized Earley parser reads:
//! `A -> B C [0.7] | 'word' [0.3]`, the first line the start. A sentence of the grammar is a sequence of actions
//! and checks. What goes on together stands in the order written; what is done after a failure is no part of the
//! plan and is left out; what a condition decides is as likely as not, since a grammar knows no conditions.
//!
//! Source: Qi, Jia, Zhu, "Generalized Earley Parser", ICML 2018.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::super::{And, Decides, Graph, Node, NodeId, NodeKind, Or};

/// Returns the grammar, one rule a line.
pub fn to_pcfg(graph: &Graph) -> String {
    let names = names(graph);
    let mut text = super::wording::grammar_of(&graph.root().label);
    let mut open = vec![graph.root()];
    let mut done = BTreeSet::new();
    while let Some(node) = open.pop() {
        if !done.insert(node.id) {
            continue;
        }
        let below = planned(graph, node);
        let word = |node: &Node| match &node.kind {
            NodeKind::Terminal(_) => format!("'{}'", node.label.replace('\'', "’")),
            _ => names[&node.id].clone(),
        };
        let _ = write!(text, "{} ->", names[&node.id]);
        match &node.kind {
            NodeKind::Or(or) => {
                for (i, (node, share)) in below.iter().zip(shares(or)).enumerate() {
                    let bar = if i == 0 { "" } else { " |" };
                    let _ = write!(text, "{bar} {} [{}]", word(node), super::plain(share));
                }
            }
            NodeKind::And(_) => {
                for node in &below {
                    let _ = write!(text, " {}", word(node));
                }
                text += " [1.0]";
            }
            // Only a graph that is one action has this line.
            NodeKind::Terminal(_) => {
                let _ = write!(text, " {} [1.0]", word(node));
            }
        }
        text.push('\n');
        let deeper = below.into_iter().rev();
        open.extend(deeper.filter(|node| !matches!(node.kind, NodeKind::Terminal(_))));
    }
    text
}

/// The nodes below that are done when nothing fails.
fn planned<'g>(graph: &'g Graph, node: &Node) -> Vec<&'g Node> {
    let ids: Vec<NodeId> = match &node.kind {
        NodeKind::And(And { children, .. }) => children.clone(),
        _ => graph.below(node),
    };
    ids.into_iter().map(|id| graph.node(id)).collect()
}

/// How likely each branch is.
fn shares(or: &Or) -> Vec<f64> {
    match or.decides {
        Decides::Choice | Decides::Argument(_) => or.branches.iter().map(|b| b.prior).collect(),
        _ => vec![1.0 / or.branches.len() as f64; or.branches.len()],
    }
}

/// A name for each node of letters, digits and lines, which is all that such a grammar takes.
fn names(graph: &Graph) -> BTreeMap<NodeId, String> {
    let mut taken = BTreeSet::new();
    let mut names = BTreeMap::new();
    for node in graph.nodes() {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let stem: String = node.path.chars().map(plain).collect();
        let mut name = stem.clone();
        for n in 2.. {
            if taken.insert(name.clone()) {
                break;
            }
            name = format!("{stem}_{n}");
        }
        names.insert(node.id, name);
    }
    names
}
