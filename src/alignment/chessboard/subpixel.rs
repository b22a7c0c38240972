//! A corner to a fraction of a pixel: the place that all gradients around it are at right angles to.
//!
//! At every pixel of an edge that runs through the corner `c`, the gradient `g` is normal to the way from it:
//! `gᵀ(p - c) = 0`. The least-squares solution is `c = (Σ w g gᵀ)⁻¹ Σ w g gᵀ p`, found anew around itself until
//! it rests.
//!
//! Source: Förstner and Gülch, "A fast operator for detection and precise location of distinct points, corners and
//! centres of circular features", ISPRS 1987.

use nalgebra::{Matrix2, Vector2};

use crate::alignment::picture::Plane;

/// Steps at most. It rests after five or so.
const STEPS: usize = 40;
/// The weight falls to `exp(-1)` at the rim, so that a pixel more or less there moves nothing. Chosen.
const FALL: f64 = 1.0;
/// A step below this is rest, px: a hundredth of what noise moves a corner by.
const REST: f64 = 1e-4;

/// Returns the corner near `start`, px of the plane, from pixels within `radius` px; `None` when it
/// leaves half of them or has no two edges.
pub(in crate::alignment) fn refine(
    grey: &Plane,
    start: Vector2<f64>,
    radius: f64,
) -> Option<Vector2<f64>> {
    let n = radius.ceil() as i64;
    let mut at = start;
    for _ in 0..STEPS {
        let (mut square, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for dy in -n..=n {
            for dx in -n..=n {
                let d = Vector2::new(dx as f64, dy as f64);
                let far = d.norm_squared() / (radius * radius);
                if far > 1.0 {
                    continue;
                }
                let p = at + d;
                let s = |u: f64, v: f64| f64::from(grey.sample(p.x + u, p.y + v));
                let g = Vector2::new(s(1.0, 0.0) - s(-1.0, 0.0), s(0.0, 1.0) - s(0.0, -1.0));
                let gg = g * g.transpose() * (-FALL * far).exp();
                square += gg;
                right += gg * d;
            }
        }
        let step = square.try_inverse()? * right;
        at += step;
        let gone = (at - start).norm();
        if gone.is_nan() || gone >= 0.5 * radius {
            return None;
        }
        if step.norm() < REST {
            break;
        }
    }
    Some(at)
}
