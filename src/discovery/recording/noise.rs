//! The noise of a measured column, from the column itself.
//!
//! A motion is smooth from sample to sample, noise is not: a high difference takes the motion away and
//! leaves noise of known gain. The median of its size is not moved by a few steps or outliers. A converter whose steps are
//! coarser than the noise hides it; then the rounding is the noise.

/// `median(|x|)` of a normal distribution of standard deviation 1.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;

/// Returns the standard deviation of the white noise in `values` or of their rounding, in their unit, taken at `time`, s.
///
/// 0 for values without either. A repeated sample (a logger faster than the
/// sensor) would look like less noise than there is; such samples are skipped.
pub fn estimate(time: &[f64], values: &[f64]) -> f64 {
    white(time, values).max(rounding(values))
}

/// The same for a motion that is to be smoothed by as much. Where a converter's steps are as coarse as the noise, differences take
/// a few sizes only and their median jumps from one to the next, up to a half off either way, also where the motion goes by many
/// steps from row to row; their mean does not.
pub fn estimate_of_motion(time: &[f64], values: &[f64]) -> f64 {
    let rounding = rounding(values);
    let sizes = differences(time, values);
    let middle = middle_of(&sizes);
    if rounding <= 0.0 || middle > STEPPED * rounding {
        let spread = spread_of(&sizes);
        // Stamps that are wrong now and then are in the spread, and less in the middle. Smoothed by a tenth too little, accelerations are
        // some twenty times as wrong as they need be; by a tenth too much, the turns of a joint that sticks are blurred.
        let agree = spread < AGREE * middle && middle < AGREE * spread;
        return if agree { spread } else { middle }.max(rounding);
    }
    let samples: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).collect();
    let sizes: Vec<f64> = samples.windows(5).map(fourth_difference).collect();
    spread_of(&sizes).max(rounding)
}

/// By which factor the middle half of the sizes and nearly all of them may differ in what they say of the noise. Chosen: of steps
/// they differ by 1.15 at most, of an arm's log in which one stamp in twenty is wrong by 1.25 to 1.7.
const AGREE: f64 = 1.2;

/// Mean size of the middle half of normal noise of standard deviation 1.
const MIDDLE_OF_NORMAL: f64 = 0.693_36;

/// Returns the standard deviation of normal noise, from the middle half of the sizes of its differences; 0 for fewer than two.
fn middle_of(sizes: &[f64]) -> f64 {
    if sizes.len() < 2 {
        return 0.0;
    }
    let mut sizes = sizes.to_vec();
    sizes.sort_by(f64::total_cmp);
    let middle = &sizes[sizes.len() / 4..sizes.len() - sizes.len() / 4];
    middle.iter().sum::<f64>() / middle.len() as f64 / MIDDLE_OF_NORMAL
}

/// Returns the standard deviation of noise that may come in steps, from the sizes of its differences.
fn spread_of(sizes: &[f64]) -> f64 {
    let mut squares: Vec<f64> = sizes.iter().map(|size| size * size).collect();
    squares.sort_by(f64::total_cmp);
    let kept = squares.len() - squares.len() / 50;
    let rms = |of: &[f64]| (of.iter().sum::<f64>() / of.len().max(1) as f64).sqrt();
    // Errors that come in steps have no tails, and are no larger than all of them together.
    (rms(&squares[..kept]) / WITHOUT_WILD).min(rms(&squares))
}

/// What is left of a normal error without its largest fiftieth has this standard deviation.
const WITHOUT_WILD: f64 = 0.9346;

/// Noise larger than this many times the rounding of its converter hides its steps.
const STEPPED: f64 = 2.5;

/// The same for residuals that are to be weighed as if each row were independent: the error of a coarse reading stays about
/// the same until the reading changes, so that so many rows say as much as one.
pub fn estimate_per_row(time: &[f64], values: &[f64]) -> f64 {
    let (white, rounding) = (white(time, values), rounding(values));
    if rounding <= white {
        return white;
    }
    let changes = values.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.0).count();
    rounding * (values.len() as f64 / changes.max(1) as f64).sqrt()
}

/// Returns the standard deviation of the rounding of a coarse reading, 0 for a fine one.
fn rounding(values: &[f64]) -> f64 {
    let all = || values.windows(2).map(|w| (w[1] - w[0]).abs());
    let steps = || all().filter(|step| *step > 0.0);
    let (least, most) = steps().fold((f64::INFINITY, 0.0_f64), |(l, m), s| (l.min(s), m.max(s)));
    let near = |step: &f64| *step < 1.5 * least;
    // Only where the least step is often taken is it the step of a converter; what always goes one step is a ramp.
    let is_often = steps().filter(near).count() * 20 > steps().count();
    let is_ramp = steps().count() == all().count() && near(&most);
    if is_often && !is_ramp && values.len() >= 6 { least / 12.0_f64.sqrt() } else { 0.0 }
}

/// The white noise alone, 0 for fewer than six values.
fn white(time: &[f64], values: &[f64]) -> f64 {
    median_of(&differences(time, values))
}

/// Returns the sizes of the fourth differences of what was read, repeated samples left out.
fn differences(time: &[f64], values: &[f64]) -> Vec<f64> {
    let mut distinct: Vec<(f64, f64)> = Vec::with_capacity(values.len());
    for (&time, &value) in time.iter().zip(values) {
        if distinct.last().is_none_or(|(_, last)| last.to_bits() != value.to_bits()) {
            distinct.push((time, value));
        }
    }
    // A column that hardly ever changes is a constant or a coarse step, not a smooth signal.
    if distinct.len() * 2 <= values.len() {
        distinct = time.iter().copied().zip(values.iter().copied()).collect();
    }
    distinct.windows(5).map(fourth_difference).collect()
}

/// Returns the standard deviation of normal noise, from the sizes of its differences; 0 for fewer than two.
fn median_of(sizes: &[f64]) -> f64 {
    if sizes.len() < 2 {
        return 0.0;
    }
    let (mut sizes, middle) = (sizes.to_vec(), sizes.len() / 2);
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    *median / MEDIAN_OF_NORMAL
}

/// Returns how rough a motion is where it is fastest, in its unit: there the clock counts most, at rest not at all.
pub fn roughness_in_motion(time: &[f64], values: &[f64]) -> f64 {
    let samples: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).collect();
    let speed = |s: &[(f64, f64)]| (s[4].1 - s[0].1).abs() / (s[4].0 - s[0].0).max(1e-12);
    let mut windows: Vec<(f64, f64)> =
        samples.windows(5).map(|s| (speed(s), fourth_difference(s))).collect();
    windows.sort_by(|a, b| b.0.total_cmp(&a.0));
    windows.truncate(windows.len().div_ceil(4));
    windows.sort_by(|a, b| a.1.total_cmp(&b.1));
    windows.get(windows.len() / 2).map_or(0.0, |(_, size)| size / MEDIAN_OF_NORMAL)
}

/// Returns the size of the fourth divided difference of five samples, on a scale on which white noise of
/// variance 1 has variance 1.
fn fourth_difference(samples: &[(f64, f64)]) -> f64 {
    // Times in units of the window, so that rows too near to each other stay finite.
    let span = samples[4].0 - samples[0].0;
    let (mut sum, mut gain) = (0.0, 0.0);
    for (i, (time, value)) in samples.iter().enumerate() {
        let others = samples.iter().enumerate().filter(|(j, _)| *j != i);
        let product: f64 = others.map(|(_, (other, _))| (time - other) / span).product();
        let weight = if product.abs() > 1e-9 { 1.0 / product } else { 1e9 };
        sum += weight * value;
        gain += weight * weight;
    }
    sum.abs() / gain.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    #[test]
    fn the_noise_on_a_smooth_motion_is_found_to_a_tenth() {
        let mut rng = StdRng::seed_from_u64(7);
        let time: Vec<f64> = (0..2000).map(f64::from).collect();
        let values: Vec<f64> = (0..2000)
            .map(|i| {
                // Twelve uniform numbers make a normal one to three digits.
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                (f64::from(i) * 0.02).sin() + 0.003 * normal
            })
            .collect();
        let found = estimate(&time, &values);
        assert!((found / 0.003 - 1.0).abs() < 0.1, "{found}");
    }

    /// A fifth of a step of noise before the converter, read a thousand times a second: the median of what differences there are is
    /// up to a half off.
    #[test]
    fn noise_of_the_size_of_a_step_is_found_to_a_tenth() {
        let mut rng = StdRng::seed_from_u64(3);
        let time: Vec<f64> = (0..12_000).map(|i| f64::from(i) * 1e-3).collect();
        for speed in [0.4, 0.7, 1.1] {
            let read = |t: &f64| {
                let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                ((speed * t).sin() / 1e-4 + 0.2 * normal).round() * 1e-4
            };
            let values: Vec<f64> = time.iter().map(read).collect();
            let noise = 1e-4 * (1.0 / 12.0 + 0.04_f64).sqrt();
            let found = estimate_of_motion(&time, &values);
            assert!((found / noise - 1.0).abs() < 0.1, "{speed}: {found} for {noise}");
        }
    }

    /// An encoder of 17 bits at 200 rows a second goes by fifty steps from row to row, never by one: its rounding was found a third too
    /// small or a quarter too large, by which of two sizes stood in the middle.
    #[test]
    fn rounding_of_a_motion_by_many_steps_is_found() {
        let step = std::f64::consts::TAU / f64::from(1 << 17);
        let time: Vec<f64> = (0..1600).map(|i| f64::from(i) * 5e-3).collect();
        for k in 0..12 {
            let (speed, phase) = (0.6 + 0.07 * f64::from(k), 0.5 * f64::from(k));
            let angle = |t: &f64| 0.5 * (speed * t + phase).sin() + 0.3 * (1.7 * t).cos();
            let values: Vec<f64> = time.iter().map(|t| (angle(t) / step).round() * step).collect();
            let found = estimate_of_motion(&time, &values) / (step / 12.0_f64.sqrt());
            assert!((0.9..1.2).contains(&found), "{speed}: {found}");
        }
    }

    /// One stamp in twenty of a real arm's log is off by a few hundredths of a step: that is no noise of its angles.
    #[test]
    fn stamps_that_are_wrong_now_and_then_are_no_noise() {
        let mut rng = StdRng::seed_from_u64(9);
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let (mut time, mut values) = (Vec::new(), Vec::new());
        for i in 0..4000 {
            let at = f64::from(i) * 0.01;
            let late = if i % 20 == 7 { 6e-4 } else { 0.0 };
            time.push(at);
            values.push((1.1 * (at + late)).sin() + 5e-5 * normal());
        }
        let found = estimate_of_motion(&time, &values);
        assert!((0.8..1.4).contains(&(found / 5e-5)), "{found}");
    }

    #[test]
    fn a_motion_without_noise_has_none() {
        let time: Vec<f64> = (0..500).map(|i| f64::from(i) * 0.01).collect();
        let values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        assert!(estimate(&time, &values) < 1e-8);
        assert!(estimate(&[0.0, 1.0], &[1.0, 2.0]) < 1e-12);
        let ramp: Vec<f64> = (0..50).map(|k| 0.01 * f64::from(k)).collect();
        assert!(estimate(&ramp, &ramp) < 1e-12);
    }

    #[test]
    fn a_motion_at_uneven_times_has_none_either() {
        let time: Vec<f64> =
            (0..500).map(|i| f64::from(i) * 0.01 + 0.002 * f64::from(i * i % 7)).collect();
        let values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        assert!(estimate(&time, &values) < 1e-7);
    }

    #[test]
    fn the_rounding_of_a_coarse_reading_is_its_noise() {
        let time: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let coarse: Vec<f64> = time.iter().map(|t| ((3.0 * t).sin() / 0.1).round() * 0.1).collect();
        let rounding = 0.1 / 12.0_f64.sqrt();
        assert!((estimate(&time, &coarse) / rounding - 1.0).abs() < 1e-6);
        // Five rows or so say as much as one.
        let per_row = estimate_per_row(&time, &coarse);
        assert!((1.5..4.0).contains(&(per_row / rounding)), "{per_row}");
    }
}
