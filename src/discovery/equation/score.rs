//! How well residuals speak for a model: likelihood with noise of unknown size that may be coloured.
//!
//! What a model leaves out makes residuals that follow each other; a thousand of those are not a thousand
//! pieces of evidence. Their effective number comes from their autocorrelation time.
//!
//! Source: Schwarz, "Estimating the Dimension of a Model", 1978 (BIC); Geyer, "Practical Markov Chain
//! Monte Carlo", 1992, §3.3 (initial positive sequence).

/// The part of a series that is independent, above 0 and at most 1.
pub fn whiteness(residuals: &[f64]) -> f64 {
    let n = residuals.len();
    if n < 8 {
        return 1.0;
    }
    let mean = super::columns::mean(residuals);
    let r: Vec<f64> = residuals.iter().map(|v| v - mean).collect();
    let c0: f64 = r.iter().map(|v| v * v).sum();
    if c0 <= 0.0 || !c0.is_finite() {
        return 1.0;
    }
    let rho = |k: usize| r[k..].iter().zip(&r).map(|(a, b)| a * b).sum::<f64>() / c0;
    let mut sum = 0.0;
    let mut k = 1;
    while k + 1 < n / 2 {
        let pair = rho(k) + rho(k + 1);
        if pair <= 0.05 {
            break;
        }
        sum += pair;
        k += 2;
    }
    (1.0 / (1.0 + 2.0 * sum)).clamp(2.0 / n as f64, 1.0)
}

/// Twice the logarithm of the likelihood ratio of two fits with residual sums `before` and `after`, by
/// output, with `effective` independent residuals each. `floors` are mean squares below which nothing is
/// gained.
pub fn twice_log_ratio(
    before: &[(f64, usize)],
    after: &[(f64, usize)],
    effective: &[f64],
    floors: &[f64],
) -> f64 {
    before
        .iter()
        .zip(after)
        .zip(effective.iter().zip(floors))
        .map(|((b, a), (n, floor))| {
            let ms = |(ss, n): &(f64, usize)| ss / (*n).max(1) as f64 + floor;
            n * (ms(b) / ms(a)).ln()
        })
        .sum()
}

/// The strongest lines of a residual's spectrum, Hz, at most `n`, strongest first; only lines that stand
/// well above what is around them.
pub fn lines(time: &[f64], residuals: &[f64], n: usize) -> Vec<f64> {
    let m = residuals.len().min(time.len());
    if m < 32 {
        return Vec::new();
    }
    let duration = time[m - 1] - time[0];
    let n_frequencies = (m / 2).min(1500);
    let mean = super::columns::mean(&residuals[..m]);
    let step = time[1] - time[0];
    let power: Vec<f64> = (1..n_frequencies)
        .map(|k| {
            let w = std::f64::consts::TAU * k as f64 / duration;
            // Even rows turn the pointer by the same angle; rows need not be even.
            let (turn_sin, turn_cos) = (w * step).sin_cos();
            let (mut c, mut s) = (0.0, 0.0);
            let (mut sin, mut cos) = (0.0_f64, 1.0_f64);
            for i in 0..m {
                if i > 0 && i % 64 != 0 && (time[i] - time[i - 1] - step).abs() < 1e-6 * step {
                    (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
                } else {
                    (sin, cos) = (w * (time[i] - time[0])).sin_cos();
                }
                c += (residuals[i] - mean) * cos;
                s += (residuals[i] - mean) * sin;
            }
            c * c + s * s
        })
        .collect();
    let mut peaks: Vec<(f64, f64)> = (1..power.len().saturating_sub(1))
        .filter(|&i| power[i] > power[i - 1] && power[i] >= power[i + 1])
        .filter(|&i| {
            let around: Vec<f64> = (i.saturating_sub(12)..(i + 13).min(power.len()))
                .filter(|j| j.abs_diff(i) > 2)
                .map(|j| power[j])
                .collect();
            power[i] > 8.0 * super::columns::mean(&around)
        })
        .map(|i| (power[i], (i + 1) as f64 / duration))
        .collect();
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    peaks.into_iter().take(n).map(|(_, f)| f).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_residuals_all_count_and_slow_ones_hardly() {
        let white: Vec<f64> = (0..2000_u32)
            .scan(12345_u32, |s, _| {
                *s = s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                Some(f64::from(*s >> 8) / f64::from(1 << 24) - 0.5)
            })
            .collect();
        assert!(whiteness(&white) > 0.8, "{}", whiteness(&white));
        let slow: Vec<f64> = (0..2000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        assert!(whiteness(&slow) < 0.02, "{}", whiteness(&slow));
    }

    #[test]
    fn a_hum_is_a_line() {
        let time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.01).collect();
        let hum: Vec<f64> = time.iter().map(|t| (std::f64::consts::TAU * 7.3 * t).sin()).collect();
        let found = lines(&time, &hum, 2);
        assert!((found[0] - 7.3).abs() < 0.11, "{found:?}");
    }
}
