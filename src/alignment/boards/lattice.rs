//! Points in a picture that stand in a grid, told apart by column and row.
//!
//! From a point and two neighbours the grid is grown: every next point is looked for where those beside it put it, so that
//! perspective and a lens may bend the grid slowly.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector2;

/// A point may be off from where its neighbours put it by this part of the way to them.
const OFF: f64 = 0.3;
/// Neighbours of a first point that are tried as the grid's two directions: the eight around it.
const TRIED: usize = 8;

/// Which point stands at a column and a row.
pub(super) type Lattice = BTreeMap<(i32, i32), usize>;

/// Returns the largest grid among points.
pub(super) fn largest(points: &[Vector2<f64>]) -> Lattice {
    let mut best = Lattice::new();
    let middle = points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64;
    let mut firsts: Vec<usize> = (0..points.len()).collect();
    let far = |i: &usize| (points[*i] - middle).norm();
    firsts.sort_by(|a, b| far(a).total_cmp(&far(b)));
    for first in firsts {
        // Points that are in a large grid already lead to it again.
        if best.values().any(|i| *i == first) {
            continue;
        }
        let near = nearest(points, first, TRIED);
        for (k, &a) in near.iter().enumerate() {
            for &b in &near[k + 1..] {
                let (u, v) = (points[a] - points[first], points[b] - points[first]);
                // Two directions of about one length, not too narrow.
                let across = u.perp(&v).abs() / (u.norm() * v.norm()).max(f64::MIN_POSITIVE);
                if across < 0.3 || u.norm() > 2.5 * v.norm() || v.norm() > 2.5 * u.norm() {
                    continue;
                }
                let grown = grown(points, first, [u, v]);
                if grown.len() > best.len() {
                    best = grown;
                }
            }
        }
    }
    best
}

fn nearest(points: &[Vector2<f64>], of: usize, count: usize) -> Vec<usize> {
    let mut others: Vec<usize> = (0..points.len()).filter(|i| *i != of).collect();
    let far = |i: &usize| (points[*i] - points[of]).norm();
    others.sort_by(|a, b| far(a).total_cmp(&far(b)));
    others.truncate(count);
    others
}

fn grown(points: &[Vector2<f64>], first: usize, steps: [Vector2<f64>; 2]) -> Lattice {
    let mut grid = Lattice::from([((0, 0), first)]);
    let mut taken = vec![false; points.len()];
    taken[first] = true;
    let mut open = VecDeque::from([(0, 0, steps)]);
    while let Some((column, row, steps)) = open.pop_front() {
        let here = points[grid[&(column, row)]];
        for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1)] {
            let next = if axis == 0 { (column + sign, row) } else { (column, row + sign) };
            if grid.contains_key(&next) {
                continue;
            }
            let step = steps[axis] * f64::from(sign);
            let expected = here + step;
            let off = |i: &usize| (points[*i] - expected).norm();
            let found = (0..points.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
            if let Some(found) = found.filter(|i| !taken[*i] && off(i) < OFF * step.norm()) {
                taken[found] = true;
                grid.insert(next, found);
                // The step that was found; the other one as it was.
                let mut own = steps;
                own[axis] = (points[found] - here) * f64::from(sign);
                open.push_back((next.0, next.1, own));
            }
        }
    }
    grid
}
