//! The noise of a measured column, from the column itself.
//!
//! A motion is smooth from sample to sample, noise is not: a high difference takes the motion away and
//! leaves noise of known gain. The median of its size is not moved by a few steps or outliers.

/// Coefficients of the fourth difference; white noise of variance 1 leaves it with the sum of their
/// squares, 70.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
const FOURTH_GAIN: f64 = 70.0;

/// `median(|x|)` of a normal distribution of standard deviation 1.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// Returns the standard deviation of the white noise in evenly sampled `values`, in their unit.
///
/// 0 for fewer than six values or values without noise. A repeated sample (a logger faster than the
/// sensor) would look like less noise than there is; such samples are skipped.
pub fn estimate(values: &[f64]) -> f64 {
    let mut distinct = Vec::with_capacity(values.len());
    for &value in values {
        if distinct.last().is_none_or(|last: &f64| last.to_bits() != value.to_bits()) {
            distinct.push(value);
        }
    }
    // A column that hardly ever changes is a constant or a coarse step, not a smooth signal.
    let values = if distinct.len() * 2 > values.len() { &distinct[..] } else { values };
    let mut sizes: Vec<f64> = values
        .windows(5)
        .map(|window| window.iter().zip(FOURTH).map(|(value, c)| c * value).sum::<f64>().abs())
        .collect();
    if sizes.len() < 2 {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    *median / MEDIAN_OF_NORMAL / FOURTH_GAIN.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    #[test]
    fn the_noise_on_a_smooth_motion_is_found_to_a_tenth() {
        let mut rng = StdRng::seed_from_u64(7);
        let values: Vec<f64> = (0..2000)
            .map(|i| {
                // Twelve uniform numbers make a normal one to three digits.
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                (f64::from(i) * 0.02).sin() + 0.003 * normal
            })
            .collect();
        let found = estimate(&values);
        assert!((found / 0.003 - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn a_motion_without_noise_has_none() {
        let values: Vec<f64> = (0..500).map(|i| (f64::from(i) * 0.01).sin()).collect();
        assert!(estimate(&values) < 1e-8);
        assert!(estimate(&[1.0, 2.0]) < 1e-12);
    }
}
