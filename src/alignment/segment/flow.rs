//! The smallest cut through a graph, as the largest flow from a source to a sink. What nodes and links mean is the
//! caller's.
//!
//! Source: Dinitz, "Algorithm for solution of a problem of maximum flow", 1970; Ford and Fulkerson, 1956.

/// A maximal flow on a graph with a source and a sink, by Dinitz's blocking flows.
pub(super) struct Flow {
    /// Per arc: where it leads and what it can still carry; arc `k ^ 1` is its reverse.
    arcs: Vec<(usize, f64)>,
    out: Vec<Vec<usize>>,
    source: usize,
    sink: usize,
}

impl Flow {
    pub(super) fn new(n: usize) -> Self {
        Self { arcs: Vec::new(), out: vec![Vec::new(); n + 2], source: n, sink: n + 1 }
    }

    fn arc(&mut self, from: usize, to: usize, there: f64, back: f64) {
        self.out[from].push(self.arcs.len());
        self.arcs.push((to, there));
        self.out[to].push(self.arcs.len());
        self.arcs.push((from, back));
    }

    /// A positive preference ties a node to the source, a negative one to the sink.
    pub(super) fn terminal(&mut self, node: usize, preference: f64) {
        if preference > 0.0 {
            self.arc(self.source, node, preference, 0.0);
        } else {
            self.arc(node, self.sink, -preference, 0.0);
        }
    }

    pub(super) fn link(&mut self, a: usize, b: usize, capacity: f64) {
        self.arc(a, b, capacity, capacity);
    }

    /// Saturates the graph and returns, for each node, whether the source still reaches it.
    pub(super) fn source_side(mut self) -> Vec<bool> {
        // What rounding leaves of a capacity counts as none.
        const LEAST: f64 = 1e-9;
        let n = self.out.len();
        loop {
            let mut level = vec![usize::MAX; n];
            level[self.source] = 0;
            let mut queue = vec![self.source];
            let mut head = 0;
            while head < queue.len() {
                let node = queue[head];
                head += 1;
                for &arc in &self.out[node] {
                    let (to, left) = self.arcs[arc];
                    if left > LEAST && level[to] == usize::MAX {
                        level[to] = level[node] + 1;
                        queue.push(to);
                    }
                }
            }
            if level[self.sink] == usize::MAX {
                return (0..n - 2).map(|node| level[node] != usize::MAX).collect();
            }
            // Walk forward along the levels, push the least that fits, step back from dead ends.
            let mut next = vec![0_usize; n];
            let mut path: Vec<usize> = Vec::new();
            let mut node = self.source;
            loop {
                if node == self.sink {
                    let least = path.iter().map(|&a| self.arcs[a].1).fold(f64::INFINITY, f64::min);
                    let mut back = 0;
                    for (k, &arc) in path.iter().enumerate().rev() {
                        self.arcs[arc].1 -= least;
                        self.arcs[arc ^ 1].1 += least;
                        if self.arcs[arc].1 <= LEAST {
                            back = k;
                        }
                    }
                    node = self.arcs[path[back] ^ 1].0;
                    path.truncate(back);
                    continue;
                }
                if let Some(&arc) = self.out[node].get(next[node]) {
                    let (to, left) = self.arcs[arc];
                    if left > LEAST && level[to] == level[node] + 1 {
                        path.push(arc);
                        node = to;
                    } else {
                        next[node] += 1;
                    }
                } else if let Some(arc) = path.pop() {
                    level[node] = usize::MAX;
                    node = self.arcs[arc ^ 1].0;
                    next[node] += 1;
                } else {
                    break;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
