//! What a logger does to the rows of an arm: samples written twice, and a clock that jitters.
//!
//! Neither is an effect of the arm. A repeated sample is a jump of the motion that never happened, and a
//! row stamped half a millisecond late at 1 rad/s is an angle wrong by half a milliradian; both would be
//! accelerations of tens of rad/s².

use super::channels::{Channel, Quantity};
use crate::discovery::recording::noise;

/// Finds the rows that say something new: those in which some channel differs from the row before.
///
/// Where most rows repeat the arm stands still, and every row counts.
pub(super) fn fresh(channels: &[Channel], rows: usize) -> Vec<bool> {
    let again = |row: usize, c: &Channel| c.values[row].to_bits() == c.values[row - 1].to_bits();
    let mut fresh: Vec<bool> =
        (0..rows).map(|row| row == 0 || !channels.iter().all(|c| again(row, c))).collect();
    if fresh.iter().filter(|is_new| **is_new).count() * 2 < rows {
        fresh.fill(true);
    }
    fresh
}

/// An even clock must make the motion this many times smoother to be believed.
const SMOOTHER: f64 = 2.0;

/// Returns times at even steps if the motion says that the samples were taken so, whatever the stamps say.
///
/// Rows that are missing stay missing. `None` where the stamps fit the motion as well.
pub(super) fn even_clock(time: &[f64], channels: &[Channel]) -> Option<Vec<f64>> {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.len() < 8 {
        return None;
    }
    steps.sort_by(f64::total_cmp);
    let typical = steps[steps.len() / 2];
    if steps[steps.len() - 1] - steps[0] < 1e-3 * typical {
        return None;
    }
    // Whole steps since the first row; the step is what makes the last one come out right.
    let mut count = 0.0;
    let mut counts = vec![0.0];
    for pair in time.windows(2) {
        count += ((pair[1] - pair[0]) / typical).round().max(1.0);
        counts.push(count);
    }
    let (first, last) = (time[0], time[time.len() - 1]);
    let step = (last - first) / count;
    let even: Vec<f64> = counts.iter().map(|count| first + count * step).collect();
    // A clock that jitters stays near; one that wanders is another matter.
    if even.iter().zip(time).any(|(even, stamp)| (even - stamp).abs() > 2.0 * step) {
        return None;
    }
    let roughness = |time: &[f64]| -> f64 {
        let moving = channels.iter().filter(|c| c.quantity == Quantity::Position);
        moving.map(|c| noise::roughness_in_motion(time, &c.values).powi(2)).sum::<f64>()
    };
    (roughness(&even) * SMOOTHER.powi(2) < roughness(time)).then_some(even)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(values: Vec<f64>) -> Channel {
        Channel { quantity: Quantity::Position, index: 0, name: "q_1".into(), values, noise: 1e-5 }
    }

    /// A number between -1 and 1 that looks like chance.
    fn scatter(i: usize) -> f64 {
        let x = (i as f64 * 12.9898).sin() * 43758.547;
        2.0 * (x - x.floor()) - 1.0
    }

    #[test]
    fn a_sample_written_twice_is_not_fresh_and_an_arm_at_rest_is() {
        let moving = [channel(vec![0.0, 0.1, 0.1, 0.3, 0.4])];
        assert_eq!(fresh(&moving, 5), [true, true, false, true, true]);
        let resting = [channel(vec![0.2; 5])];
        assert_eq!(fresh(&resting, 5), [true; 5]);
    }

    #[test]
    fn the_motion_tells_a_jittering_clock_from_jittering_samples() {
        let even: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.01).collect();
        let stamps: Vec<f64> =
            even.iter().enumerate().map(|(i, t)| t + 5e-4 * scatter(i)).collect();
        let swing = |time: &[f64]| vec![channel(time.iter().map(|t| (2.0 * t).sin()).collect())];
        let found = even_clock(&stamps, &swing(&even)).expect("samples were even");
        let worst = found.iter().zip(&even).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 6e-4, "{worst}");
        assert_eq!(even_clock(&stamps, &swing(&stamps)), None);
    }

    #[test]
    fn a_row_that_is_missing_stays_missing() {
        let even: Vec<f64> =
            (0..400).filter(|i| i % 37 != 5).map(|i| f64::from(i) * 0.01).collect();
        let stamps: Vec<f64> =
            even.iter().enumerate().map(|(i, t)| t + 5e-4 * scatter(i)).collect();
        let swing = vec![channel(even.iter().map(|t| (2.0 * t).sin()).collect())];
        let found = even_clock(&stamps, &swing).expect("samples were even");
        assert!(found.iter().zip(&even).all(|(a, b)| (a - b).abs() < 6e-4));
    }
}
