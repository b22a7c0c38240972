//! The smallest cut through a graph, as the largest flow from a source to a sink. What nodes and links mean is the
//! caller's.
//!
//! Two trees grow through what can still carry something, one from the source and one from the sink. Where they touch,
//! the path between is filled, and what has lost its way to a root looks for another; the trees are kept from one path to
//! the next. On grids, where paths are short, that is much quicker than finding all shortest paths anew after each round.
//!
//! Source: Boykov and Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy minimization in
//! vision", PAMI 2004, with the marks of its section 3.2.2; Ford and Fulkerson, 1956.

use std::collections::VecDeque;

/// What rounding leaves of a capacity counts as none.
const LEAST: f64 = 1e-9;

/// How a node hangs in a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parent {
    /// It is in no tree.
    None,
    /// The source, or the sink, itself.
    Root,
    /// It has lost its parent and looks for another.
    Orphan,
    /// By the arc that leads to its parent.
    Arc(usize),
}

/// A graph with a source and a sink.
pub(super) struct Flow {
    /// What a node can still take from the source, or, negative, give to the sink.
    terminal: Vec<f64>,
    /// Two nodes and what may flow between them either way.
    links: Vec<(usize, usize, f64)>,
}

impl Flow {
    pub(super) fn new(n: usize) -> Self {
        Self { terminal: vec![0.0; n], links: Vec::new() }
    }

    /// A positive preference ties a node to the source, a negative one to the sink.
    pub(super) fn terminal(&mut self, node: usize, preference: f64) {
        self.terminal[node] += preference;
    }

    pub(super) fn link(&mut self, a: usize, b: usize, capacity: f64) {
        self.links.push((a, b, capacity));
    }

    /// Saturates the graph and returns, for each node, whether the source still reaches it.
    pub(super) fn source_side(self) -> Vec<bool> {
        let mut trees = Trees::of(self);
        trees.saturate();
        trees.nodes.iter().map(|n| !n.is_sinks && n.parent != Parent::None).collect()
    }
}

/// An arc: where it leads, which arc leads back, and what it can still carry.
struct Arc {
    to: usize,
    back: usize,
    left: f64,
}

struct Node {
    parent: Parent,
    /// Whether it is in the sink's tree, if in any.
    is_sinks: bool,
    /// Whether it waits for its neighbours to be looked at.
    is_active: bool,
    /// When it was last known how far its root is, and how far that was.
    known: usize,
    far: usize,
}

struct Trees {
    terminal: Vec<f64>,
    /// The arcs of a node are those from its number's entry to the next one's.
    first: Vec<usize>,
    arcs: Vec<Arc>,
    nodes: Vec<Node>,
    active: VecDeque<usize>,
    orphans: VecDeque<usize>,
    time: usize,
}

impl Trees {
    fn of(flow: Flow) -> Self {
        let n = flow.terminal.len();
        let mut first = vec![0; n + 1];
        for &(a, b, _) in &flow.links {
            first[a + 1] += 1;
            first[b + 1] += 1;
        }
        for node in 0..n {
            first[node + 1] += first[node];
        }
        let mut next = first.clone();
        let mut arcs: Vec<Arc> =
            (0..2 * flow.links.len()).map(|_| Arc { to: 0, back: 0, left: 0.0 }).collect();
        for &(a, b, left) in &flow.links {
            let (there, back) = (next[a], next[b]);
            (next[a], next[b]) = (there + 1, back + 1);
            arcs[there] = Arc { to: b, back, left };
            arcs[back] = Arc { to: a, back: there, left };
        }
        let node = |preference: &f64| Node {
            parent: if preference.abs() > LEAST { Parent::Root } else { Parent::None },
            is_sinks: *preference < 0.0,
            is_active: preference.abs() > LEAST,
            known: 0,
            far: 1,
        };
        let nodes: Vec<Node> = flow.terminal.iter().map(node).collect();
        let active = (0..n).filter(|&i| nodes[i].is_active).collect();
        let orphans = VecDeque::new();
        Self { terminal: flow.terminal, first, arcs, nodes, active, orphans, time: 0 }
    }

    fn activate(&mut self, node: usize) {
        if !self.nodes[node].is_active {
            self.nodes[node].is_active = true;
            self.active.push_back(node);
        }
    }

    /// What can still flow along an arc of a node away from the source, if the node is the source's, or else towards the
    /// sink.
    fn left(&self, arc: usize, is_sinks: bool) -> f64 {
        if is_sinks { self.arcs[self.arcs[arc].back].left } else { self.arcs[arc].left }
    }

    fn saturate(&mut self) {
        while let Some(node) = self.active.pop_front() {
            self.nodes[node].is_active = false;
            // A node stays at its turn as long as paths run through it.
            while self.nodes[node].parent != Parent::None
                && let Some(arc) = self.grow(node)
            {
                self.time += 1;
                self.fill(arc);
                while let Some(orphan) = self.orphans.pop_front() {
                    self.adopt(orphan);
                }
            }
        }
    }

    /// Lets a tree grow from a node; returns an arc from the source's tree to the sink's, where they touch.
    fn grow(&mut self, node: usize) -> Option<usize> {
        let is_sinks = self.nodes[node].is_sinks;
        let (known, far) = (self.nodes[node].known, self.nodes[node].far);
        for arc in self.first[node]..self.first[node + 1] {
            if self.left(arc, is_sinks) <= LEAST {
                continue;
            }
            let (to, back) = (self.arcs[arc].to, self.arcs[arc].back);
            let other = &mut self.nodes[to];
            if other.parent == Parent::None {
                (other.parent, other.is_sinks) = (Parent::Arc(back), is_sinks);
                (other.known, other.far) = (known, far + 1);
                self.activate(to);
            } else if other.is_sinks != is_sinks {
                return Some(if is_sinks { back } else { arc });
            } else if other.known <= known && other.far > far && other.parent != Parent::Root {
                // A shorter way to the root.
                (other.parent, other.known, other.far) = (Parent::Arc(back), known, far + 1);
            }
        }
        None
    }

    /// The arcs from a node up to its root, each in the direction of the flow, and the node at the root.
    fn way(&self, mut node: usize) -> (Vec<usize>, usize) {
        let mut arcs = Vec::new();
        while let Parent::Arc(up) = self.nodes[node].parent {
            arcs.push(if self.nodes[node].is_sinks { up } else { self.arcs[up].back });
            node = self.arcs[up].to;
        }
        (arcs, node)
    }

    /// Sends as much as fits along the path through an arc between the trees.
    fn fill(&mut self, middle: usize) {
        let (from, to) = (self.arcs[self.arcs[middle].back].to, self.arcs[middle].to);
        let ((before, first), (after, last)) = (self.way(from), self.way(to));
        let all = || before.iter().chain(&after).copied();
        let ends = self.terminal[first].min(-self.terminal[last]).min(self.arcs[middle].left);
        let most = all().map(|arc| self.arcs[arc].left).fold(ends, f64::min);
        for arc in all().chain([middle]) {
            let back = self.arcs[arc].back;
            self.arcs[arc].left -= most;
            self.arcs[back].left += most;
        }
        self.terminal[first] -= most;
        self.terminal[last] += most;
        // Below a full arc hangs what has no way to its root any more: in the source's tree its end, else its beginning.
        for &arc in &before {
            if self.arcs[arc].left <= LEAST {
                self.bereave(self.arcs[arc].to);
            }
        }
        for &arc in &after {
            if self.arcs[arc].left <= LEAST {
                self.bereave(self.arcs[self.arcs[arc].back].to);
            }
        }
        for end in [first, last] {
            if self.terminal[end].abs() <= LEAST {
                self.bereave(end);
            }
        }
    }

    fn bereave(&mut self, node: usize) {
        self.nodes[node].parent = Parent::Orphan;
        self.orphans.push_front(node);
    }

    /// How far a node's root is, if it has one; what is found out on the way is marked.
    fn far(&mut self, from: usize) -> Option<usize> {
        let (mut node, mut steps) = (from, 0);
        loop {
            if self.nodes[node].known == self.time {
                steps += self.nodes[node].far;
                break;
            }
            steps += 1;
            match self.nodes[node].parent {
                Parent::Arc(up) => node = self.arcs[up].to,
                Parent::Root => {
                    (self.nodes[node].known, self.nodes[node].far) = (self.time, 1);
                    break;
                }
                Parent::None | Parent::Orphan => return None,
            }
        }
        let (mut node, mut far) = (from, steps);
        while self.nodes[node].known != self.time {
            (self.nodes[node].known, self.nodes[node].far) = (self.time, far);
            let Parent::Arc(up) = self.nodes[node].parent else { break };
            (node, far) = (self.arcs[up].to, far - 1);
        }
        Some(steps)
    }

    /// Finds an orphan another parent in its tree, the one nearest to the root; without one it leaves the tree.
    fn adopt(&mut self, orphan: usize) {
        let is_sinks = self.nodes[orphan].is_sinks;
        let around = self.first[orphan]..self.first[orphan + 1];
        let mut best: Option<(usize, usize)> = None;
        for arc in around.clone() {
            // Towards the orphan in the source's tree, from it in the sink's.
            let to = self.arcs[arc].to;
            if self.left(arc, !is_sinks) > LEAST
                && self.nodes[to].is_sinks == is_sinks
                && self.nodes[to].parent != Parent::None
                && let Some(far) = self.far(to)
                && best.is_none_or(|b| far < b.0)
            {
                best = Some((far, arc));
            }
        }
        if let Some((far, arc)) = best {
            let node = &mut self.nodes[orphan];
            (node.parent, node.known, node.far) = (Parent::Arc(arc), self.time, far + 1);
            return;
        }
        self.nodes[orphan].parent = Parent::None;
        for arc in around {
            let to = self.arcs[arc].to;
            if self.nodes[to].is_sinks != is_sinks || self.nodes[to].parent == Parent::None {
                continue;
            }
            if self.left(arc, !is_sinks) > LEAST {
                self.activate(to);
            }
            if let Parent::Arc(up) = self.nodes[to].parent
                && self.arcs[up].to == orphan
            {
                self.nodes[to].parent = Parent::Orphan;
                self.orphans.push_back(to);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    /// The minimal cut of a small graph, by hand: the two weak links part it.
    #[test]
    fn a_cut_goes_through_the_weak_links() {
        let mut flow = Flow::new(4);
        flow.terminal(0, 10.0);
        flow.terminal(3, -10.0);
        flow.link(0, 1, 5.0);
        flow.link(1, 2, 1.0);
        flow.link(2, 3, 5.0);
        flow.link(0, 2, 0.5);
        assert_eq!(flow.source_side(), vec![true, true, false, false]);
    }

    /// Paths of Ford and Fulkerson, the first that is found each time: slow and plain.
    fn plain(terminal: &[f64], links: &[(usize, usize, f64)]) -> Vec<bool> {
        let n = terminal.len();
        let mut left = vec![vec![0.0; n + 2]; n + 2];
        for (i, preference) in terminal.iter().enumerate() {
            left[n][i] = preference.max(0.0);
            left[i][n + 1] = (-preference).max(0.0);
        }
        for &(a, b, capacity) in links {
            left[a][b] += capacity;
            left[b][a] += capacity;
        }
        loop {
            let mut from = vec![usize::MAX; n + 2];
            from[n] = n;
            let mut reached = vec![n];
            let mut head = 0;
            while head < reached.len() {
                let node = reached[head];
                head += 1;
                for to in 0..n + 2 {
                    if from[to] == usize::MAX && left[node][to] > LEAST {
                        from[to] = node;
                        reached.push(to);
                    }
                }
            }
            if from[n + 1] == usize::MAX {
                return (0..n).map(|i| from[i] != usize::MAX).collect();
            }
            let mut path = vec![n + 1];
            while path[path.len() - 1] != n {
                path.push(from[path[path.len() - 1]]);
            }
            let least = path.windows(2).map(|p| left[p[1]][p[0]]).fold(f64::INFINITY, f64::min);
            for pair in path.windows(2) {
                left[pair[1]][pair[0]] -= least;
                left[pair[0]][pair[1]] += least;
            }
        }
    }

    /// What the source reaches at the end is the same for every largest flow.
    #[test]
    fn grids_are_cut_as_by_plain_paths() {
        let mut chance = StdRng::seed_from_u64(7);
        for round in 0..60 {
            let (cols, rows) = (2 + round % 7, 2 + round % 5);
            let n = cols * rows;
            let terminal: Vec<f64> = (0..n).map(|_| 8.0 * chance.random::<f64>() - 4.0).collect();
            let mut links = Vec::new();
            for i in 0..n {
                let (x, y) = (i % cols, i / cols);
                let beside = [(x + 1 < cols, i + 1), (y + 1 < rows, i + cols)];
                for (_, to) in beside.into_iter().filter(|b| b.0) {
                    links.push((i, to, 2.0 * chance.random::<f64>()));
                }
                if x + 1 < cols && y + 1 < rows {
                    links.push((i, i + cols + 1, chance.random::<f64>()));
                }
            }
            let mut flow = Flow::new(n);
            for (i, preference) in terminal.iter().enumerate() {
                flow.terminal(i, *preference);
            }
            for &(a, b, capacity) in &links {
                flow.link(a, b, capacity);
            }
            assert_eq!(flow.source_side(), plain(&terminal, &links), "{cols} x {rows}");
        }
    }
}
