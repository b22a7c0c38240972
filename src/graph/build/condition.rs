//! From the conditions met while building to fluent nodes and the relations that lead to them.

use std::collections::BTreeMap;

use super::Builder;
use crate::graph::{FluentNode, Relation, fluent};
use crate::language::ast::ExprKind;
use crate::language::text;

/// Types of parameters that are not things on the table.
pub(super) const QUANTITIES: &[&str] = &[
    "Length", "Angle", "Volume", "Time", "Mass", "Force", "Torque", "Speed", "Number", "Bool",
    "Text", "Face",
];

impl Builder<'_> {
    /// Returns every fluent once, in the order first met, and the causal and spatial relations.
    pub(super) fn fluents(&mut self) -> (Vec<FluentNode>, Vec<Relation>) {
        let mut conditions = std::mem::take(&mut self.conditions);
        // Tasks note their own conditions after those of their steps; a reader starts at the top.
        conditions.sort_by_key(|(node, role, _)| (*node, *role));
        let mut fluents: Vec<FluentNode> = Vec::new();
        let mut known: BTreeMap<String, usize> = BTreeMap::new();
        let mut relations = Vec::new();
        for (node, role, condition) in &conditions {
            for (atom, negated) in fluent::atoms(condition) {
                let idx = *known.entry(text::expr(atom)).or_insert_with(|| {
                    fluents.push(fluent::node(atom, self.definitions, &self.objects));
                    if let ExprKind::Call(call) = &atom.kind
                        && let Some(item) = self.definitions.fluent(&call.name.text)
                    {
                        let name = call.name.text.clone();
                        self.signatures.fluents.insert(name, item.params.clone());
                    }
                    fluents.len() - 1
                });
                let relation = Relation::Causal { node: *node, role: *role, fluent: idx, negated };
                let mut same_node = relations.iter().rev().take_while(
                    |r| matches!(r, Relation::Causal { node: other, .. } if other == node),
                );
                if !same_node.any(|r| *r == relation) {
                    relations.push(relation);
                }
            }
        }
        for (idx, fluent) in fluents.iter().enumerate() {
            if fluent.objects.len() > 1 {
                let objects = fluent.objects.clone();
                relations.push(Relation::Spatial { fluent: idx, objects });
            }
        }
        (fluents, relations)
    }
}
