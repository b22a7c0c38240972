//! Configurations grown from roots, as a search by samples grows them.
//!
//! Nothing here knows what is in the way.

use rand::RngExt;
use rand::rngs::StdRng;

use super::robot::Robot;

/// Configurations grown from some roots, each knowing the one it grew from.
pub(super) struct Tree {
    /// One after the other.
    nodes: Vec<f64>,
    parents: Vec<Option<usize>>,
    /// Numbers of a configuration.
    n: usize,
}

impl Tree {
    pub(super) fn rooted<'q>(roots: impl IntoIterator<Item = &'q Vec<f64>>) -> Self {
        let mut tree = Self { nodes: Vec::new(), parents: Vec::new(), n: 1 };
        for root in roots {
            tree.n = root.len();
            tree.nodes.extend_from_slice(root);
            tree.parents.push(None);
        }
        tree
    }

    pub(super) fn len(&self) -> usize {
        self.parents.len()
    }

    pub(super) fn node(&self, at: usize) -> &[f64] {
        &self.nodes[at * self.n..(at + 1) * self.n]
    }

    pub(super) fn nearest(&self, q: &[f64]) -> usize {
        let mut best = (f64::INFINITY, 0);
        for (at, node) in self.nodes.chunks_exact(self.n).enumerate() {
            let mut gap = 0.0;
            for (a, b) in node.iter().zip(q) {
                gap += (a - b) * (a - b);
            }
            if gap < best.0 {
                best = (gap, at);
            }
        }
        best.1
    }

    pub(super) fn push(&mut self, q: &[f64], parent: usize) -> usize {
        self.nodes.extend_from_slice(q);
        self.parents.push(Some(parent));
        self.len() - 1
    }

    /// Returns the way from a node back to its root.
    pub(super) fn trace(&self, from: usize) -> Vec<Vec<f64>> {
        let mut way = Vec::new();
        let mut at = Some(from);
        while let Some(node) = at {
            way.push(self.node(node).to_vec());
            at = self.parents[node];
        }
        way
    }
}

/// Draws a configuration beside one of a tree's own: any distance from a hundredth of a step to half of one is as likely.
///
/// Where hardly any way leads out, what is drawn from all over lies in the wrong direction nearly always.
pub(super) fn beside(robot: &Robot, tree: &Tree, random: &mut StdRng) -> Vec<f64> {
    let node = tree.node(random.random_range(0..tree.len()));
    let reach = 10.0_f64.powf(random.random_range(-2.3..-0.3));
    let moved =
        robot.joints().iter().zip(node).map(|(joint, x)| {
            (x + random.random_range(-reach..reach)).clamp(joint.lower, joint.upper)
        });
    moved.collect()
}
