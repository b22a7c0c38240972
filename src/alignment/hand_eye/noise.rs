//! The noise of the robot's poses, in turn and in shift, from what is left of the pictures.
//!
//! The residuals of a picture have the covariance `C + θ₁ D₁ + θ₂ D₂`: the corners' part, which is known, and the robot's, whose two
//! variances are wanted. They are those of greatest likelihood, reached by Fisher's scoring: every direction counts by how well it
//! is known, so that a board's uncertain distance does not hide a robot that is bad across the line of sight. (Squares less
//! what the corners explain, the simple way, came out as nothing in one of ten drawings of the noise.)
//!
//! Source: Rao and Kleffe, *Estimation of Variance Components and Applications*, 1988, §2.4 and §8.3.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

use super::types::Noise;

/// A robot does not repeat itself better than this, rad and m: 10 µm, and the same at 0.5 m.
pub(super) const FINEST: Noise = Noise { rotation: 2e-5, position: 1e-5 };
/// A variance changes by this factor at most in a round, so that a poor start is no trap. Chosen.
const STEP: f64 = 16.0;

/// Returns a better estimate of the noise from residuals and the corners' part of their covariances. `left` is the share of the
/// residuals that the fit's parameters have not taken.
pub(super) fn better(pictures: &[(Vector6<f64>, Matrix6<f64>)], noise: Noise, left: f64) -> Noise {
    let parts = [part(0), part(3)];
    let (mut information, mut seen) = (Matrix2::zeros(), Vector2::zeros());
    for (e, corners) in pictures {
        let covariance =
            corners + parts[0] * noise.rotation.powi(2) + parts[1] * noise.position.powi(2);
        let Some(weight) = covariance.cholesky().map(|c| c.inverse()) else { return noise };
        let we = weight * e;
        for (k, a) in parts.iter().enumerate() {
            let of_k = weight * a * weight;
            seen[k] += we.dot(&(a * we)) / left - (of_k * corners).trace();
            for (l, b) in parts.iter().enumerate() {
                information[(k, l)] += (of_k * b).trace();
            }
        }
    }
    let Some(inverse) = information.try_inverse() else { return noise };
    let variance = inverse * seen;
    let std = |value: f64, before: f64, least: f64| {
        let (low, high) = (before * before / STEP, before * before * STEP);
        value.clamp(low, high).max(least * least).sqrt()
    };
    Noise {
        rotation: std(variance[0], noise.rotation, FINEST.rotation),
        position: std(variance[1], noise.position, FINEST.position),
    }
}

/// A variance of 1 in three of the six.
fn part(from: usize) -> Matrix6<f64> {
    let mut part = Matrix6::zeros();
    for k in from..from + 3 {
        part[(k, k)] = 1.0;
    }
    part
}
