//! How evenly commands left: the times between them, counted, and what they come to.

use std::collections::BTreeMap;

use crate::arm::Pacing;

use super::beat::{Beat, PERIOD};

/// Times are counted in steps of this, s: a hundredth of the period.
const STEP: f64 = PERIOD / 100.0;
/// What is longer is counted as this many steps, 10 s; the longest is kept beside.
const MOST_STEPS: f64 = 1e6;

/// Times between two commands, counted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Intervals {
    counts: BTreeMap<u32, u64>,
    n: u64,
    sum: f64,
    longest: f64,
    missed: u64,
}

impl Intervals {
    /// Counts a time between two commands, s.
    pub fn add(&mut self, interval: f64) {
        let steps = (interval / STEP).round().clamp(0.0, MOST_STEPS);
        *self.counts.entry(steps as u32).or_default() += 1;
        self.n += 1;
        self.sum += interval;
        self.longest = self.longest.max(interval);
        // A command 1.6 periods after the last one stands for two.
        self.missed += ((interval / PERIOD).round() - 1.0).clamp(0.0, MOST_STEPS) as u64;
    }

    /// Adds the times of another stream.
    pub fn add_all(&mut self, other: &Self) {
        for (&steps, &count) in &other.counts {
            *self.counts.entry(steps).or_default() += count;
        }
        self.n += other.n;
        self.sum += other.sum;
        self.longest = self.longest.max(other.longest);
        self.missed += other.missed;
    }

    /// Returns the time that this share of all times is no longer than, s; 0 when nothing was counted.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = (share * self.n as f64).ceil().max(1.0) as u64;
        let mut passed = 0;
        for (&steps, &count) in &self.counts {
            passed += count;
            if passed >= wanted {
                return f64::from(steps) * STEP;
            }
        }
        0.0
    }

    /// Returns the mean time, s; 0 when nothing was counted.
    pub fn mean(&self) -> f64 {
        if self.n == 0 { 0.0 } else { self.sum / self.n as f64 }
    }

    /// Returns the longest time, s.
    pub fn longest(&self) -> f64 {
        self.longest
    }

    /// Returns how many periods passed without a command.
    pub fn missed(&self) -> u64 {
        self.missed
    }
}

impl From<&Beat> for Pacing {
    fn from(beat: &Beat) -> Self {
        let times = &beat.intervals;
        let mean = times.mean();
        Self {
            sent: beat.sent,
            answered: beat.answered,
            rate_hz: if mean > 0.0 { 1.0 / mean } else { 0.0 },
            median_s: times.quantile(0.5),
            p99_s: times.quantile(0.99),
            worst_s: times.longest(),
            missed: times.missed(),
            held: beat.held,
            left: beat.left,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_of_16_ms_shows_as_62_hz_and_15_missed_periods_a_command() {
        let mut beat = Beat::default();
        for _ in 0..100 {
            beat.intervals.add(0.016);
        }
        let told = Pacing::from(&beat);
        assert!((told.rate_hz - 62.5).abs() < 1e-6, "{told:?}");
        assert_eq!(told.missed, 1500);
        assert!((told.median_s - 0.016).abs() < STEP && (told.p99_s - 0.016).abs() < STEP);
    }

    #[test]
    fn one_late_command_in_a_hundred_is_the_worst_and_not_the_p99() {
        let mut times = Intervals::default();
        for _ in 0..99 {
            times.add(0.001);
        }
        let mut late = Intervals::default();
        late.add(0.040);
        times.add_all(&late);
        assert!((times.quantile(0.5) - 0.001).abs() < STEP);
        assert!((times.quantile(0.99) - 0.001).abs() < STEP);
        assert!((times.quantile(1.0) - 0.040).abs() < STEP);
        assert!((times.longest() - 0.040).abs() < 1e-12);
        assert_eq!(times.missed(), 39);
        assert!(Intervals::default().quantile(0.5).abs() < 1e-12);
    }
}
