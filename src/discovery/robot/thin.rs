//! As many rows of a recording as a search needs; what it finds is judged on all of them.

use super::channels::{Channel, Quantity};
use super::plant::Course;

/// Rows closer than this say little more of an arm than every other of them, s.
const CLOSE: f64 = 0.008;

/// Rows that a search needs of one recording.
const ENOUGH: usize = 6000;

/// Length of the stretches taken of a long recording, s.
const STRETCH: f64 = 2.0;

impl Course {
    /// Returns the course with as many rows as a search needs.
    #[must_use]
    pub fn thinned(&self) -> Self {
        let time = &self.data.time;
        let rows = time.len();
        let step = (time[rows - 1] - time[0]) / (rows - 1).max(1) as f64;
        let every = ((CLOSE / step.max(1e-9)).ceil() as usize).max(1);
        let share = (ENOUGH as f64 / (rows / every).max(1) as f64).min(1.0);
        let is_kept = |row: usize| {
            let stretch = (time[row] - time[0]) / STRETCH;
            // Stretch k is taken where the share of those taken so far steps up.
            let taken = |k: f64| (k * share).floor();
            taken(stretch.floor() + 1.0) > taken(stretch.floor())
        };
        // Of rows that say the same, the first at which most of the sensors that are judged were read.
        let is_judged = |c: &&Channel| {
            self.closed_loop || matches!(c.quantity, Quantity::Torque | Quantity::Tip)
        };
        let judged: Vec<&Channel> = self.data.channels.iter().filter(is_judged).collect();
        let silent = |row: &usize| judged.iter().filter(|c| !c.is_read(*row)).count();
        let kept: Vec<usize> = (0..rows)
            .step_by(every)
            .filter(|row| is_kept(*row))
            .filter_map(|row| (row..(row + every).min(rows)).min_by_key(silent))
            .collect();
        if kept.len() == rows {
            return self.clone();
        }
        let mut thin = self.clone();
        let of = |values: &[f64]| kept.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        thin.data.time = of(time);
        for values in &mut thin.data.commands {
            *values = of(values);
        }
        for channel in &mut thin.data.channels {
            channel.values = of(&channel.values);
            if !channel.unread.is_empty() {
                channel.unread = kept.iter().map(|row| channel.unread[*row]).collect();
            }
        }
        let n = self.plant.n;
        if !self.in_doubt.is_empty() {
            let doubt = |row: &usize| self.in_doubt[row * n..(row + 1) * n].iter().copied();
            thin.in_doubt = kept.iter().flat_map(doubt).collect();
        }
        if !self.blind.is_empty() {
            thin.blind = kept.iter().map(|row| self.blind[*row]).collect();
        }
        thin.unseen = kept.iter().map(|row| self.unseen[*row]).collect();
        thin.first_row = kept.iter().filter(|row| **row < self.first_row).count();
        thin.last_row = kept.iter().filter(|row| **row < self.last_row).count();
        thin
    }
}
