//! Paths of corners in joint space: distances, lengths, points along them.

/// Euclidean distance of two configurations, rad.
pub fn l2(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Returns the point a share `t` of the way from `a` to `b`.
pub fn mix(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| mixed(*a, *b, t)).collect()
}

/// Returns the number a share `t` of the way from `a` to `b`.
#[inline]
pub(super) fn mixed(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

/// As [`mix`], into memory that is there already.
pub(super) fn mix_into(into: &mut [f64], a: &[f64], b: &[f64], t: f64) {
    for ((x, a), b) in into.iter_mut().zip(a).zip(b) {
        *x = mixed(*a, *b, t);
    }
}

/// The length of a path, rad.
pub(super) fn length(corners: &[Vec<f64>]) -> f64 {
    corners.windows(2).map(|edge| l2(&edge[0], &edge[1])).sum()
}

/// Returns the edge and the configuration `along` rad from the start of a polyline.
pub(super) fn point_at(corners: &[Vec<f64>], along: f64) -> (usize, Vec<f64>) {
    let mut left = along;
    for edge in 0..corners.len() - 1 {
        let size = l2(&corners[edge], &corners[edge + 1]);
        if left <= size || edge + 2 == corners.len() {
            let t = if size > 0.0 { (left / size).min(1.0) } else { 0.0 };
            return (edge, mix(&corners[edge], &corners[edge + 1], t));
        }
        left -= size;
    }
    (0, corners[0].clone())
}
