//! Round what is in the way: straight stretches along two axes, as few as will do, and of those the shortest way.
//!
//! Geometry of a plane only; who asks says which stretches are free.
//!
//! Source: Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1, 1959.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use nalgebra::Vector2;

/// How far apart the lines are along which a way may go, m. Chosen: what is pushed is 4 to 9 cm wide; with half of it a
/// search costs four times as much, with twice as much gaps that are 10 cm wider than the thing are missed.
const LINES: f64 = 0.05;
/// What a turn costs in micrometres of way: more than any way over a table is long.
const TURN: u64 = 100_000_000;

/// Where a way is: which line across each axis, and along which of the two it came.
type Node = (usize, usize, usize);

/// Returns the ends of the stretches from `from` to `to` along two unit vectors square to each other, nowhere farther than
/// `reach` m from `from` along either; `None` where no way is free.
pub(super) fn detour(
    from: Vector2<f64>,
    to: Vector2<f64>,
    axes: [Vector2<f64>; 2],
    reach: f64,
    is_free: &dyn Fn(Vector2<f64>, Vector2<f64>) -> bool,
) -> Option<Vec<Vector2<f64>>> {
    let by = axes.map(|axis| (to - from).dot(&axis));
    let lines = by.map(|by| lines(by, reach));
    let at = |node: Node| from + axes[0] * lines[0][node.0] + axes[1] * lines[1][node.1];
    let index = |axis: usize, place: f64| {
        lines[axis].iter().position(|line| line.total_cmp(&place).is_eq())
    };
    let (begin, end) = ((index(0, 0.0)?, index(1, 0.0)?), (index(0, by[0])?, index(1, by[1])?));
    let mut open = BinaryHeap::new();
    let mut best: BTreeMap<Node, (u64, Option<Node>)> = BTreeMap::new();
    for along in 0..2 {
        best.insert((begin.0, begin.1, along), (0, None));
        open.push(Reverse((0_u64, (begin.0, begin.1, along))));
    }
    while let Some(Reverse((cost, node))) = open.pop() {
        if (node.0, node.1) == end {
            return Some(corners(&best, node).into_iter().map(at).collect());
        }
        if best.get(&node).is_some_and(|(least, _)| *least < cost) {
            continue;
        }
        for next in beside(node, [lines[0].len(), lines[1].len()]) {
            let turn = if next.2 == node.2 { 0 } else { TURN };
            let through = cost + turn + (1e6 * (at(next) - at(node)).norm()).round() as u64;
            let is_better = best.get(&next).is_none_or(|(least, _)| through < *least);
            if is_better && is_free(at(node), at(next)) {
                best.insert(next, (through, Some(node)));
                open.push(Reverse((through, next)));
            }
        }
    }
    None
}

/// Returns places along an axis, sorted, the start at 0 and the end among them, m.
fn lines(end: f64, reach: f64) -> Vec<f64> {
    let most = (reach / LINES).floor() as i32;
    let mut lines: Vec<f64> = (-most..=most).map(|k| f64::from(k) * LINES).collect();
    lines.push(end);
    lines.sort_by(f64::total_cmp);
    lines.dedup();
    lines
}

/// Returns the four neighbours of a node that there are, and how one comes to them.
fn beside((u, v, _): Node, counts: [usize; 2]) -> impl Iterator<Item = Node> {
    let all = [(u.wrapping_sub(1), v, 0), (u + 1, v, 0), (u, v.wrapping_sub(1), 1), (u, v + 1, 1)];
    all.into_iter().filter(move |(u, v, _)| *u < counts[0] && *v < counts[1])
}

/// Returns where the way to a node turns, the start left out and the node last.
fn corners(best: &BTreeMap<Node, (u64, Option<Node>)>, end: Node) -> Vec<Node> {
    let mut corners = vec![end];
    let mut node = end;
    while let Some((_, Some(before))) = best.get(&node) {
        if before.2 != node.2 && best.get(before).is_some_and(|(_, first)| first.is_some()) {
            corners.push(*before);
        }
        node = *before;
    }
    corners.reverse();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ways(to: [f64; 2], wall: &dyn Fn(Vector2<f64>) -> bool) -> Option<Vec<[f64; 2]>> {
        let is_free = |a: Vector2<f64>, b: Vector2<f64>| {
            (0..=10).all(|k| !wall(a + (b - a) * (f64::from(k) / 10.0)))
        };
        let axes = [Vector2::x(), Vector2::y()];
        let found = detour(Vector2::zeros(), to.into(), axes, 0.5, &is_free)?;
        let tenths = |x: f64| (x * 1e4).round() / 1e4;
        Some(found.into_iter().map(|p| [tenths(p.x), tenths(p.y)]).collect())
    }

    #[test]
    fn where_nothing_is_in_the_way_it_is_straight_or_turns_once() {
        assert_eq!(ways([0.33, 0.0], &|_| false), Some(vec![[0.33, 0.0]]));
        assert_eq!(ways([0.12, 0.2], &|_| false).map(|way| way.len()), Some(2));
    }

    #[test]
    fn a_wall_is_gone_round_on_its_shorter_side() {
        let wall = |p: Vector2<f64>| (0.08..0.12).contains(&p.x) && (-0.4..0.17).contains(&p.y);
        assert_eq!(ways([0.3, 0.0], &wall), Some(vec![[0.0, 0.2], [0.3, 0.2], [0.3, 0.0]]));
    }

    #[test]
    fn through_a_wall_there_is_no_way() {
        assert_eq!(ways([0.3, 0.0], &|p| (0.08..0.12).contains(&p.x)), None);
    }
}
