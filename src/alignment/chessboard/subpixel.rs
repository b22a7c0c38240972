//! A corner to a fraction of a pixel: the place that all gradients around it are at right angles to.
//!
//! At every pixel of an edge that runs through the corner `c`, the gradient `g` is normal to the way from it:
//! `gᵀ(p - c) = 0`. The least-squares solution is `c = (Σ w g gᵀ)⁻¹ Σ w g gᵀ p`, found anew around itself until
//! it rests. Whether what is there is a corner of a board at all, [`lopsided`] tells.
//!
//! Source: Förstner and Gülch, "A fast operator for detection and precise location of distinct points, corners and
//! centres of circular features", ISPRS 1987.

use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

use crate::alignment::plane::Plane;

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

/// Returns how far what is around a place is from being the same at half a turn, as a part of its contrast: 0 of a corner of a board
/// however it is turned, tilted and blurred, and also where the light falls off across it; near 1 where it is half something else.
///
/// At half a turn `I(c + d) = I(c - d)`; light that falls off by `a + bᵀd` leaves a difference of `bᵀd` times what is there, and
/// a veil that does so `bᵀd` alone. Both are fitted and taken off.
pub(super) fn lopsided(grey: &Plane, at: Vector2<f64>, radius: f64) -> f64 {
    let n = radius.ceil() as i64;
    let look = |d: Vector2<f64>| f64::from(grey.sample(at.x + d.x, at.y + d.y));
    let mut pairs: Vec<(Vector2<f64>, f64, f64)> = Vec::new();
    for dy in 0..=n {
        for dx in -n..=n {
            let d = Vector2::new(dx as f64, dy as f64);
            // Of two opposite ones the one that comes later.
            if d.norm() <= radius && (dy > 0 || dx > 0) {
                let (a, b) = (look(d), look(-d));
                pairs.push((d, a - b, 0.5 * (a + b)));
            }
        }
    }
    let count = pairs.len().max(1) as f64;
    let mean = pairs.iter().map(|pair| pair.2).sum::<f64>() / count;
    let basis = |d: &Vector2<f64>, even: f64| Vector4::new(d.x, d.y, d.x * even, d.y * even);
    let (mut square, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for (d, odd, even) in &pairs {
        let b = basis(d, even - mean);
        square += b * b.transpose();
        right += b * *odd;
    }
    let falls = square.try_inverse().map_or(Vector4::zeros(), |inverse| inverse * right);
    let odd = pairs.iter().map(|(d, odd, even)| (odd - falls.dot(&basis(d, even - mean))).powi(2));
    let odd = 0.25 * odd.sum::<f64>();
    let even = pairs.iter().map(|pair| (pair.2 - mean).powi(2)).sum::<f64>();
    (odd / (odd + even).max(f64::MIN_POSITIVE)).sqrt()
}
