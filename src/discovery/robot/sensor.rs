//! One sensor of several columns: where it shows something new and where its last reading again.

use std::ops::Range;

use super::cells::{USUAL, part_of};
use super::channels::Channel;

/// A sensor is fine if it typically goes so many of its least steps from one reading to the next: a coarse one repeats honestly.
const FINE: f64 = 8.0;

/// So many readings tell how often a sensor is read.
const ENOUGH: usize = 20;

/// A sensor that goes so many times further at once than it hardly ever does has been elsewhere meanwhile.
const JUMPS: f64 = 2.0;

/// All columns of one sensor, at the rows at which all of them were read.
pub(super) struct Sensor<'c> {
    columns: Vec<&'c [f64]>,
    pub(super) rows: Vec<usize>,
    /// Whether it shows what it showed before, to the last digit, for each of the rows.
    again: Vec<bool>,
    /// How far each column goes from one reading to the next where it goes at all, in order of size.
    steps: Vec<Vec<f64>>,
}

impl<'c> Sensor<'c> {
    pub(super) fn of(channels: impl Iterator<Item = &'c Channel>) -> Self {
        let channels: Vec<&Channel> = channels.collect();
        let columns: Vec<&[f64]> = channels.iter().map(|channel| &channel.values[..]).collect();
        let all = 0..channels.first().map_or(0, |channel| channel.values.len());
        let rows: Vec<usize> = all.filter(|row| channels.iter().all(|c| c.is_read(*row))).collect();
        let is_same = |pair: &[usize]| {
            columns.iter().all(|values| values[pair[0]].to_bits() == values[pair[1]].to_bits())
        };
        let first = rows.first().map(|_| false);
        let again = first.into_iter().chain(rows.windows(2).map(is_same)).collect();
        let steps_of = |values: &&[f64]| {
            let steps = rows.windows(2).map(|pair| (values[pair[1]] - values[pair[0]]).abs());
            let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
            steps.sort_by(f64::total_cmp);
            steps
        };
        let steps = columns.iter().map(steps_of).collect();
        Self { columns, rows, again, steps }
    }

    /// Returns the stretches that hold one reading each, counted in rows of its own.
    pub(super) fn runs(&self) -> Vec<Range<usize>> {
        let mut starts: Vec<usize> = (0..self.again.len()).filter(|at| !self.again[*at]).collect();
        starts.push(self.again.len());
        starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
    }

    /// Returns the rows of a stretch that repeat its first.
    pub(super) fn again(&self, run: &Range<usize>) -> Vec<usize> {
        self.rows[run.start + 1..run.end].to_vec()
    }

    /// Returns whether something is so in all rows of a stretch.
    pub(super) fn is_all(&self, run: &Range<usize>, is_so: &[bool]) -> bool {
        self.rows[run.clone()].iter().all(|row| is_so[*row])
    }

    /// Returns whether every column shows the least or the most that it shows anywhere.
    pub(super) fn is_at_limits(&self, run: &Range<usize>) -> bool {
        let at = self.rows[run.start];
        self.columns.iter().all(|values| {
            let own = || self.rows.iter().map(|row| values[*row]);
            own().all(|value| value <= values[at]) || own().all(|value| value >= values[at])
        })
    }

    /// Returns whether some column goes much further after a stretch than it hardly ever does from one reading to the next.
    pub(super) fn jumps_after(&self, run: &Range<usize>) -> bool {
        let Some(next) = self.rows.get(run.end) else { return false };
        let at = self.rows[run.start];
        self.columns.iter().zip(&self.steps).any(|(values, steps)| {
            let most = part_of(steps.iter().copied(), USUAL);
            (values[*next] - values[at]).abs() > JUMPS * most
        })
    }

    /// Returns whether it tells finer differences than it goes from one reading to the next.
    pub(super) fn is_fine(&self) -> bool {
        self.steps
            .iter()
            .any(|steps| steps.len() >= ENOUGH && steps[steps.len() / 2] > FINE * steps[0])
    }

    /// Returns after how many rows at most a reading is followed by a new one, where it is not read in every row: as regularly as a
    /// clock of its own lets it. `moves` says at which rows the arm moves.
    pub(super) fn every(&self, moves: &[bool]) -> Option<usize> {
        let moving = self.runs().into_iter().filter(|run| self.is_all(run, moves));
        let lengths: Vec<usize> = moving.map(|run| run.len()).collect();
        let total: usize = lengths.iter().sum();
        // A reading may repeat by chance: no more than one in five does.
        if lengths.len() < ENOUGH || 5 * total < 6 * lengths.len() || !self.is_fine() {
            return None;
        }
        let usual = total / lengths.len();
        let regular = lengths.iter().filter(|length| (usual..=usual + 1).contains(*length));
        (10 * regular.sum::<usize>() >= 9 * total).then_some(usual + 1)
    }
}
