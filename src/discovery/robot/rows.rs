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

/// How often steps are counted and their length is fitted anew.
const FITS: usize = 3;

/// How far an even clock follows each stamp: it forgets what it drifted by within some ten rows, and a stamp that is late by a step
/// moves it by a tenth.
const FOLLOWED: f64 = 0.1;

/// A row is missing if so many stamps in a row come late.
const LATE: usize = 3;

/// Returns how many whole steps each stamp is after the first, by a clock that follows the stamps: a stamp that is late by itself
/// adds no step.
fn whole_steps(time: &[f64], step: f64) -> Vec<f64> {
    let mut at = time[0];
    let mut count = 0.0;
    let mut counts = vec![count];
    for (row, stamp) in time.iter().enumerate().skip(1) {
        let since = |(later, next): (usize, &f64)| ((next - at) / step).round() - later as f64;
        let next = time[row..].iter().take(LATE).enumerate().map(since);
        let steps = next.fold(f64::INFINITY, f64::min).max(1.0);
        count += steps;
        counts.push(count);
        at += steps * step;
        // The first stamps say together where the clock begins.
        at += FOLLOWED.max(1.0 / (row + 1) as f64) * (stamp - at);
    }
    counts
}

/// Times over whole steps.
struct Line {
    /// s.
    start: f64,
    /// s.
    step: f64,
}

impl Line {
    /// Returns the line through stamps (s) that leaves least squares.
    fn through(counts: &[f64], time: &[f64]) -> Self {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (middle, at) = (mean(counts), mean(time));
        let pairs = || counts.iter().map(|count| count - middle).zip(time);
        let along: f64 = pairs().map(|(count, stamp)| count * (stamp - at)).sum();
        let step = along / pairs().map(|(count, _)| count * count).sum::<f64>();
        Self { start: at - step * middle, step }
    }
}

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
    // The step is that of all rows together, once it is known which are missing.
    let mut line = Line { start: time[0], step: typical };
    let mut counts = Vec::new();
    for _ in 0..FITS {
        counts = whole_steps(time, line.step);
        line = Line::through(&counts, time);
    }
    let even: Vec<f64> = counts.iter().map(|count| line.start + count * line.step).collect();
    let step = line.step;
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
        let (name, unread) = ("q_1".into(), Vec::new());
        Channel { quantity: Quantity::Position, index: 0, name, values, noise: 1e-5, unread }
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

    /// A stamp half a step late after one that is early once counted as a missing row, and everything after it came a step late.
    #[test]
    fn a_stamp_that_is_very_late_is_no_missing_row() {
        let even: Vec<f64> =
            (0..2000).filter(|i| i % 411 != 7).map(|i| f64::from(i) * 0.01).collect();
        // Three numbers of chance are nearly normal: 2 ms, and 6 ms at most.
        let late = |i: usize| 2e-3 * (scatter(i) + scatter(i + 7919) + scatter(i + 104_729));
        let mut stamps: Vec<f64> = even.iter().enumerate().map(|(i, t)| t + late(i)).collect();
        (stamps[800], stamps[801]) = (even[800] - 4e-3, even[801] + 4e-3);
        stamps.sort_by(f64::total_cmp);
        let swing = vec![channel(even.iter().map(|t| (2.0 * t).sin()).collect())];
        let found = even_clock(&stamps, &swing).expect("samples were even");
        assert!(found.iter().zip(&even).all(|(a, b)| (a - b).abs() < 5e-4));
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
