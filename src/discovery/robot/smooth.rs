//! A measured motion without its noise, for arms whose controller is not known.
//!
//! Whittaker's smoother: the curve that is near the samples and whose third differences are small. It has
//! no phase, keeps a quadratic exactly, and its strength is chosen so that what it takes away is as
//! large as the noise and no larger.
//!
//! Source: Eilers, "A Perfect Smoother", Anal. Chem. 75, 2003.

use super::data::{Data, Quantity};

/// Returns the joint's measured positions without noise, rad.
pub fn smoothed(data: &Data, joint: usize, values: &[f64]) -> Vec<f64> {
    let noise = data
        .channels
        .iter()
        .find(|c| c.quantity == Quantity::Position && c.index == joint)
        .map_or(0.0, |channel| channel.noise);
    whittaker(values, noise)
}

/// Smooths `values` until their root mean square change is about `noise`.
pub fn whittaker(values: &[f64], noise: f64) -> Vec<f64> {
    if values.len() < 8 || noise <= 0.0 {
        return values.to_vec();
    }
    let taken = |smooth: &[f64]| {
        let sum: f64 = smooth.iter().zip(values).map(|(s, v)| (s - v).powi(2)).sum();
        (sum / values.len() as f64).sqrt()
    };
    // The change grows with the strength; half-decades are fine enough, since the result hardly moves
    // within one. Beyond 10^6.5 the equations lose more digits than the smoothing wins.
    let mut best = values.to_vec();
    for half_decade in 0..16 {
        let strength = 10_f64.powf(f64::from(half_decade) * 0.5 - 1.0);
        let smooth = penalised(values, strength);
        if taken(&smooth) > noise {
            break;
        }
        best = smooth;
    }
    best
}

/// Solves `(I + λ D₃ᵀ D₃) z = y`, a system of seven diagonals, by Cholesky's method.
fn penalised(y: &[f64], strength: f64) -> Vec<f64> {
    const BAND: usize = 3;
    const THIRD: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
    let n = y.len();
    // Lower band: a[i][k] is entry (i, i - k).
    let mut a = vec![[0.0; BAND + 1]; n];
    for row in &mut a {
        row[0] = 1.0;
    }
    for start in 0..n - BAND {
        for i in 0..=BAND {
            for j in 0..=i {
                a[start + i][i - j] += strength * THIRD[i] * THIRD[j];
            }
        }
    }
    for i in 0..n {
        for k in (0..=BAND.min(i)).rev() {
            let j = i - k;
            let mut sum = a[i][k];
            for m in 1..=BAND {
                if k + m <= BAND && j >= m {
                    sum -= a[i][k + m] * a[j][m];
                }
            }
            a[i][k] = if k == 0 { sum.max(1e-300).sqrt() } else { sum / a[j][0] };
        }
    }
    let mut z = y.to_vec();
    for i in 0..n {
        for k in 1..=BAND.min(i) {
            z[i] -= a[i][k] * z[i - k];
        }
        z[i] /= a[i][0];
    }
    for i in (0..n).rev() {
        for k in 1..=BAND {
            if i + k < n {
                z[i] -= a[i + k][k] * z[i + k];
            }
        }
        z[i] /= a[i][0];
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_kept_and_a_zigzag_is_taken_away() {
        let parabola: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.01).powi(2)).collect();
        let smooth = penalised(&parabola, 1e4);
        assert!(smooth.iter().zip(&parabola).all(|(s, p)| (s - p).abs() < 1e-7));
        let rough: Vec<f64> = parabola
            .iter()
            .enumerate()
            .map(|(i, p)| p + if i % 2 == 0 { 1e-3 } else { -1e-3 })
            .collect();
        let smooth = whittaker(&rough, 1.1e-3);
        let off = smooth.iter().zip(&parabola).map(|(s, p)| (s - p).abs());
        // An end has neighbours on one side only; such rows are not judged either.
        let worst = off.skip(10).take(180).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst}");
    }
}
