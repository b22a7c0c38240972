//! Which straight stretches lead to a place over points of a plane, when asking whether a stretch can be gone is dear.
//!
//! A shortest way is looked for as if everything that was never asked about could be gone; who asks about its stretches closes
//! those that cannot, and looks again (lazy shortest paths: Dellin and Srinivasa, "A unifying formalism for shortest path
//! problems with expensive edge evaluations via lazy best-first search over paths with edge selectors", ICAPS 2016). Every
//! stretch costs its length and as much again for being one, so that few long ones are preferred.

use std::collections::BTreeSet;

use nalgebra::Vector2;

/// What beginning a stretch costs, as length, m. Chosen: longer than the way round anything on a table, so that fewer stretches
/// always win.
const STRETCH: f64 = 2.0;

/// Points of a plane, the first being where the way begins.
pub(super) struct Roadmap {
    points: Vec<Vector2<f64>>,
    /// What it costs to end at a point, m; `None` where the way may not end.
    ends: Vec<Option<f64>>,
    closed: BTreeSet<(usize, usize)>,
}

impl Roadmap {
    pub(super) fn new(from: Vector2<f64>) -> Self {
        Self { points: vec![from], ends: vec![None], closed: BTreeSet::new() }
    }

    /// Adds a point that the way may pass, or, for what `ends` costs as m of way, end at.
    pub(super) fn add(&mut self, point: Vector2<f64>, ends: Option<f64>) {
        self.points.push(point);
        self.ends.push(ends);
    }

    pub(super) fn point(&self, k: usize) -> Vector2<f64> {
        self.points[k]
    }

    /// Takes a stretch out for good.
    pub(super) fn close(&mut self, from: usize, to: usize) {
        self.closed.insert((from, to));
    }

    /// Lets no way end at a point any more.
    pub(super) fn ends_elsewhere(&mut self, k: usize) {
        self.ends[k] = None;
    }

    /// Whether there is a point left where a way may end.
    pub(super) fn has_ends(&self) -> bool {
        self.ends.iter().any(Option::is_some)
    }

    /// Returns the cheapest way by the points it turns at, its beginning first; `is_open` says whether a stretch is worth
    /// asking about.
    pub(super) fn way(&self, is_open: &mut dyn FnMut(usize, usize) -> bool) -> Option<Vec<usize>> {
        let n = self.points.len();
        let mut cost = vec![f64::INFINITY; n];
        let mut before: Vec<Option<usize>> = vec![None; n];
        let mut settled = vec![false; n];
        cost[0] = 0.0;
        let mut best: Option<(f64, usize)> = None;
        loop {
            let open = (0..n).filter(|k| !settled[*k] && cost[*k].is_finite());
            let Some(at) = open.min_by(|a, b| cost[*a].total_cmp(&cost[*b])) else { break };
            settled[at] = true;
            if best.is_some_and(|(least, _)| cost[at] >= least) {
                break;
            }
            if let Some(end) = self.ends[at].filter(|_| at != 0) {
                let whole = cost[at] + end;
                best = best.filter(|(least, _)| *least <= whole).or(Some((whole, at)));
            }
            for to in (0..n).filter(|to| *to != at) {
                let through = cost[at] + STRETCH + (self.points[to] - self.points[at]).norm();
                let is_better = !settled[to] && through < cost[to];
                if is_better && !self.closed.contains(&(at, to)) && is_open(at, to) {
                    cost[to] = through;
                    before[to] = Some(at);
                }
            }
        }
        let (_, end) = best?;
        let back = std::iter::successors(Some(end), |k| before[*k]);
        let mut way: Vec<usize> = back.collect();
        way.reverse();
        Some(way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points 10 cm apart from (0, 0) to (0.4, 0.4), the way to end at one of them.
    fn lattice(to: [i32; 2]) -> Roadmap {
        let mut roadmap = Roadmap::new(Vector2::zeros());
        for x in 0..5 {
            for y in 0..5 {
                let point = Vector2::new(0.1 * f64::from(x), 0.1 * f64::from(y));
                roadmap.add(point, ([x, y] == to).then_some(0.0));
            }
        }
        roadmap
    }

    fn tenths(roadmap: &Roadmap, way: &[usize]) -> Vec<[i32; 2]> {
        let point = |k: &usize| roadmap.point(*k).map(|x| (10.0 * x).round() as i32).into();
        way.iter().map(point).collect()
    }

    #[test]
    fn where_everything_is_open_it_is_one_stretch() {
        let roadmap = lattice([3, 2]);
        let way = roadmap.way(&mut |_, _| true).unwrap();
        assert_eq!(tenths(&roadmap, &way), [[0, 0], [3, 2]]);
    }

    #[test]
    fn along_axes_it_turns_once_and_round_a_closed_stretch_oftener() {
        let mut roadmap = lattice([3, 2]);
        let points = roadmap.points.clone();
        let mut along = |a: usize, b: usize| {
            let by = points[b] - points[a];
            by.norm() > 1e-9 && (by.x.abs() < 1e-9 || by.y.abs() < 1e-9)
        };
        let way = roadmap.way(&mut along).unwrap();
        assert_eq!(way.len(), 3, "{:?}", tenths(&roadmap, &way));
        // Whatever comes to the end is closed but from one neighbour below it.
        let end = way[2];
        let below = (0..points.len()).filter(|k| tenths(&roadmap, &[*k]) == [[3, 1]]);
        let below: Vec<usize> = below.collect();
        for k in (0..points.len()).filter(|k| !below.contains(k)) {
            roadmap.close(k, end);
        }
        let way = roadmap.way(&mut along).unwrap();
        assert_eq!(tenths(&roadmap, &way)[way.len() - 2..], [[3, 1], [3, 2]]);
        assert_eq!(way.len(), 4);
    }

    #[test]
    fn where_it_may_not_end_any_more_there_is_no_way() {
        let mut roadmap = lattice([4, 4]);
        let end = *roadmap.way(&mut |_, _| true).unwrap().last().unwrap();
        roadmap.ends_elsewhere(end);
        assert!(!roadmap.has_ends() && roadmap.way(&mut |_, _| true).is_none());
    }

    #[test]
    fn a_good_end_is_worth_a_longer_way() {
        let mut roadmap = lattice([4, 4]);
        roadmap.add(Vector2::new(0.05, 0.0), Some(1.0));
        let way = roadmap.way(&mut |_, _| true).unwrap();
        assert_eq!(tenths(&roadmap, &way)[1], [4, 4]);
    }
}
