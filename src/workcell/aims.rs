//! What a call is there for, before anything is done for it: whether it takes, whether it pours.

use crate::execution::uses;
use crate::execution::walk::Texts as _;
use crate::graph::{Decides, Graph, Node, NodeKind, Terminal};

use super::{Aims, WorkCell};

impl WorkCell {
    /// Returns what a call does whichever way it is done, as long as nothing fails.
    pub fn aims(&self, graph: &Graph) -> Aims {
        let does = |is_it: fn(&str) -> bool| {
            let is_of = |terminal: &Terminal| {
                let name = terminal.script.as_deref();
                name.and_then(|name| self.setup.stdlib.script(name)).is_some_and(is_it)
            };
            is_sure(graph, graph.root(), &is_of)
        };
        Aims { holds: does(uses::takes), pours: does(uses::pours) }
    }
}

/// Whether every way through a node passes a terminal of some kind.
fn is_sure(graph: &Graph, node: &Node, is_of: &dyn Fn(&Terminal) -> bool) -> bool {
    let below = |id| is_sure(graph, graph.node(id), is_of);
    match &node.kind {
        NodeKind::Terminal(terminal) => is_of(terminal),
        NodeKind::And(and) => and.children.iter().any(|id| below(*id)),
        NodeKind::Or(or) => {
            let mut branches = or.branches.iter().map(|branch| branch.node);
            match (or.via, &or.decides) {
                (Some(via), _) => branches.nth(via).is_some_and(below),
                // The first is what is done until something fails.
                (None, Decides::Recovery) => branches.next().is_some_and(below),
                (None, Decides::Repetition(_)) => branches.any(below),
                (None, _) => branches.all(below),
            }
        }
    }
}
