//! The corners of the convex hull of points in a plane: one of them is the farthest from wherever one looks.
//!
//! What lies inside the polygon of the points that reach farthest in eight directions is no corner, and is left out before
//! the others are put in order: a maker's mesh has a hundred thousand points.
//!
//! Source: Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979; Akl and Toussaint, "A fast convex
//! hull algorithm", 1978.

use std::f64::consts::TAU;

use nalgebra::Vector2;

/// In so many directions the points that reach farthest are found first, as Akl and Toussaint do it with four.
const DIRECTIONS: usize = 8;

/// Returns the corners of the hull in the order in which they were given; of points in one place the last.
pub(super) fn corners(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut order = outer(points);
    order.sort_unstable_by(|&a, &b| {
        let (p, q) = (&points[a], &points[b]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(b.cmp(&a))
    });
    order.dedup_by(|next, kept| points[*next] == points[*kept]);
    let mut found: Vec<usize> = Vec::new();
    if order.len() < 3 {
        found.clone_from(&order);
    } else {
        go_round(points, order.iter().copied(), &mut found);
        go_round(points, order.iter().rev().copied(), &mut found);
    }
    found.sort_unstable();
    found.into_iter().map(|i| points[i]).collect()
}

/// Adds the corners of one side of the hull, from the first of ordered points to the one before the last.
fn go_round(points: &[Vector2<f64>], order: impl Iterator<Item = usize>, found: &mut Vec<usize>) {
    let begin = found.len();
    for i in order {
        while let [.., a, b] = found[begin..]
            && (points[b] - points[a]).perp(&(points[i] - points[a])) <= 0.0
        {
            found.pop();
        }
        found.push(i);
    }
    found.pop();
}

/// Returns the indices of the points that are not inside the polygon of those that reach farthest.
fn outer(points: &[Vector2<f64>]) -> Vec<usize> {
    let directions: [Vector2<f64>; DIRECTIONS] = std::array::from_fn(|k| {
        let (sin, cos) = (TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        Vector2::new(cos, sin)
    });
    let mut reach = [(f64::NEG_INFINITY, Vector2::zeros()); DIRECTIONS];
    for point in points {
        for ((most, at), along) in reach.iter_mut().zip(&directions) {
            let far = along.dot(point);
            if far > *most {
                (*most, *at) = (far, *point);
            }
        }
    }
    let mut edges = Vec::with_capacity(DIRECTIONS);
    for (k, (_, from)) in reach.iter().enumerate() {
        let (_, to) = reach[(k + 1) % DIRECTIONS];
        if to != *from {
            edges.push((*from, to - from));
        }
    }
    let is_inside = |point: &Vector2<f64>| {
        !edges.is_empty() && edges.iter().all(|(from, along)| along.perp(&(point - from)) > 0.0)
    };
    (0..points.len()).filter(|&i| !is_inside(&points[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of points, those on its edge twice, in no order.
    fn disc() -> Vec<Vector2<f64>> {
        let point = |k: u32| {
            let (ring, step) = ((k * 7) % 5, (k * 11) % 32);
            let (sin, cos) = (TAU * f64::from(step) / 32.0).sin_cos();
            Vector2::new(cos, 0.7 * sin) * f64::from(ring + 1)
        };
        (0..160).chain(0..160).map(point).collect()
    }

    #[test]
    fn the_farthest_point_is_a_corner_and_of_equals_the_same_one() {
        let points = disc();
        let found = corners(&points);
        assert_eq!(found.len(), 32);
        for at in [[0.0, 0.0], [0.3, -0.1], [-2.0, 1.0], [9.0, 0.0]].map(Vector2::from) {
            let farthest = |points: &[Vector2<f64>]| {
                let far = |p: &Vector2<f64>| (p - at).norm_squared();
                points.iter().copied().max_by(|a, b| far(a).total_cmp(&far(b)))
            };
            assert_eq!(farthest(&found), farthest(&points));
        }
    }

    #[test]
    fn points_in_a_line_or_in_one_place_have_two_corners_or_one() {
        let line: Vec<_> = (0..9).map(|k| Vector2::new(f64::from(k), 2.0 * f64::from(k))).collect();
        assert_eq!(corners(&line), [line[0], line[8]]);
        assert_eq!(corners(&[line[3]; 5]), [line[3]]);
        assert!(corners(&[]).is_empty());
    }
}
