//! Convex outlines in the plane: what a mesh covers of the table, and how far beside it a point is.

use nalgebra::Vector2;

/// Returns the convex polygon around points, against the clock (monotone chain).
pub(super) fn polygon(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm() < 1e-9);
    if points.len() < 3 {
        return points;
    }
    let mut around: Vec<Vector2<f64>> = Vec::new();
    for half in [points.clone(), points.into_iter().rev().collect()] {
        let from = around.len();
        for p in half {
            while around.len() >= from + 2 {
                let (a, b) = (around[around.len() - 2], around[around.len() - 1]);
                if (b - a).perp(&(p - a)) > 0.0 {
                    break;
                }
                around.pop();
            }
            around.push(p);
        }
        around.pop();
    }
    around
}

/// Returns how far a point is outside a convex polygon given against the clock, m; negative inside, infinite where there is
/// no area.
pub(super) fn beyond(polygon: &[Vector2<f64>], p: Vector2<f64>) -> f64 {
    if polygon.len() < 3 {
        return f64::INFINITY;
    }
    let (mut signed, mut apart) = (f64::NEG_INFINITY, f64::INFINITY);
    for (i, a) in polygon.iter().enumerate() {
        let along = polygon[(i + 1) % polygon.len()] - a;
        signed = signed.max(-along.perp(&(p - a)) / along.norm().max(1e-12));
        let t = ((p - a).dot(&along) / along.norm_squared().max(1e-18)).clamp(0.0, 1.0);
        apart = apart.min((a + along * t - p).norm());
    }
    if signed > 0.0 { apart } else { signed }
}
