//! Which cells of a channel are readings of their own.
//!
//! A word that is broken on its way shows ten thousand newton metres in one row. That is no effect of the arm. Such rows are marked
//! as not read ([`Channel::unread`]): nothing judges them, and what needs a value in every row gets one from those around. The
//! readings beside them stay.
//!
//! Real effects are sudden, too (collisions, friction that lets go, a limit, play). So strong evidence is asked for: more than
//! anything else of that sensor many times over, and back within three rows.

use super::channels::{Channel, Data, Quantity};
use super::note::Note;
use super::spline::Spline;
use crate::discovery::recording::Recording;
use crate::motion::robot::JointLimits;

/// Wild cells follow each other in so many rows at most: a collision or a jolt lasts longer, or shows far less.
const WILD_ROWS: usize = 3;

/// A column of which more than one cell in so many is out of place is another matter.
const WILD_SHARE: usize = 20;

/// A wild cell is so many times larger than what the largest column of its sensor usually shows; fewer times, where it is also so
/// many times what the joint's drive can do.
const BEYOND_ALL: f64 = 30.0;
const BEYOND_USUAL: f64 = 10.0;
const BEYOND_LIMIT: f64 = 3.0;

/// What a column usually shows is what it shows in this part of its rows.
const USUAL: f64 = 0.95;

/// However little moved, no wild cell is nearer than this to the middle of its column: three turns, rad, and further than an arm
/// reaches, m.
const NO_ANGLE: f64 = 20.0;
const NO_PLACE: f64 = 10.0;

const SENSORS: [Quantity; 4] =
    [Quantity::Position, Quantity::Speed, Quantity::Torque, Quantity::Tip];

impl Channel {
    /// Returns whether a row is a reading of its own.
    pub fn is_read(&self, row: usize) -> bool {
        self.unread.get(row) != Some(&true)
    }

    /// Returns when it was read, s, and what.
    pub fn readings(&self, time: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let rows = (0..self.values.len()).filter(|row| self.is_read(*row));
        rows.map(|row| (time[row], self.values[row])).unzip()
    }

    /// Marks rows as not read.
    fn leave_out(&mut self, rows: &[usize]) {
        self.unread.resize(self.values.len(), false);
        rows.iter().for_each(|row| self.unread[*row] = true);
    }

    /// Gives the rows at which it was not read values from those around: a motion is smooth, a torque may jump.
    fn fill(&mut self, time: &[f64]) {
        let (at, read) = self.readings(time);
        let (Some(first), Some(last)) = (read.first(), read.last()) else { return };
        let is_motion = matches!(self.quantity, Quantity::Position | Quantity::Speed);
        let curve = (is_motion && at.len() > 1).then(|| Spline::through(&at, &read));
        let (mut next, mut hint) = (0, 0);
        for (row, t) in time.iter().enumerate() {
            if self.is_read(row) {
                next += 1;
            } else if next == 0 || next == at.len() {
                self.values[row] = if next == 0 { *first } else { *last };
            } else if let Some(curve) = &curve {
                self.values[row] = curve.at(*t, &mut hint).0;
            } else {
                let part = (t - at[next - 1]) / (at[next] - at[next - 1]);
                self.values[row] = read[next - 1] + part * (read[next] - read[next - 1]);
            }
        }
    }
}

impl Data {
    /// Leaves out single cells that are far outside anything else their sensor shows; `limits` are those of the joints.
    pub(super) fn leave_out_wild(&mut self, recording: &Recording, limits: &[JointLimits]) {
        let mut columns = Vec::new();
        for quantity in SENSORS {
            let own = self.channels.iter().filter(|channel| channel.quantity == quantity);
            let usual = own.map(|c| part_of(c.values.iter().map(|v| v.abs()), USUAL));
            let usual = usual.fold(0.0, f64::max);
            let are_currents = self.are_currents && quantity == Quantity::Torque;
            for channel in self.channels.iter_mut().filter(|c| c.quantity == quantity) {
                let own = limits.get(channel.index).filter(|_| !are_currents);
                let rows = wild(&channel.values, far(quantity, usual, own));
                if rows.is_empty() {
                    continue;
                }
                channel.leave_out(&rows);
                channel.fill(&self.time);
                let lines = rows.iter().filter_map(|row| recording.lines.get(*row).copied());
                let times = rows.iter().map(|row| self.time[*row]);
                columns.push((channel.name.clone(), lines.collect(), times.collect()));
            }
        }
        if !columns.is_empty() {
            self.notes.push(Note::Wild { recording: recording.name.clone(), columns });
        }
    }
}

/// Returns how far from the middle of its column a cell of a sensor is wild. `usual` is what the largest column of the sensor
/// usually shows at most, SI; `limits` are those of the joint, where there are any.
fn far(quantity: Quantity, usual: f64, limits: Option<&JointLimits>) -> f64 {
    let all = BEYOND_ALL * usual;
    let far = match (quantity, limits) {
        (Quantity::Torque, Some(joint)) if joint.effort.is_finite() => {
            (BEYOND_USUAL * usual).max(BEYOND_LIMIT * joint.effort)
        }
        (Quantity::Speed, Some(joint)) => all.max(BEYOND_LIMIT * joint.velocity),
        (Quantity::Torque | Quantity::Speed, _) => all,
        (Quantity::Position, _) => all.max(NO_ANGLE),
        (Quantity::Tip, _) => all.max(NO_PLACE),
    };
    if far > 0.0 { far } else { f64::INFINITY }
}

/// Returns the rows in which a column is further than `far` from its middle, and back within a few.
fn wild(values: &[f64], far: f64) -> Vec<usize> {
    let middle = part_of(values.iter().copied(), 0.5);
    let is_far = |row: &usize| (values[*row] - middle).abs() > far;
    let mut found = Vec::new();
    let mut row = 0;
    while row < values.len() {
        let length = (row..values.len()).take_while(is_far).count();
        if (1..=WILD_ROWS).contains(&length) {
            found.extend(row..row + length);
        }
        row += length.max(1);
    }
    if found.len() * WILD_SHARE > values.len() { Vec::new() } else { found }
}

/// Returns the number below which this part of numbers is; 0 of none.
fn part_of(values: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let at = (part * sorted.len() as f64) as usize;
    sorted.get(at.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a channel reads of a value for every time.
    fn reads(quantity: Quantity, index: usize, value: impl Fn(f64) -> f64) -> Channel {
        let values = (0..1000).map(|row| value(f64::from(row) * 0.01)).collect();
        let name = format!("{}_{}", quantity.stem(), index + 1);
        Channel { quantity, index, name, values, noise: 0.0, unread: Vec::new() }
    }

    #[test]
    fn a_cell_far_outside_all_others_is_wild_and_a_longer_one_is_not() {
        let mut values: Vec<f64> = (0..400).map(|row| (0.05 * f64::from(row)).sin()).collect();
        for row in [0, 17, 18, 399] {
            values[row] = if row == 17 { -9999.0 } else { 9999.0 };
        }
        values[200..210].fill(9999.0);
        assert_eq!(wild(&values, 30.0), [0, 17, 18, 399]);
        // Every tenth cell: another matter.
        values.iter_mut().step_by(10).for_each(|value| *value = 9999.0);
        assert!(wild(&values, 30.0).is_empty());
    }

    /// A jolt of ten times the usual torque, for a row: what a sensor may show in a collision.
    #[test]
    fn a_jolt_is_not_wild() {
        let usual = 20.0;
        let channel = reads(Quantity::Torque, 0, |t| {
            20.0 * t.sin() + if (t - 5.0).abs() < 1e-3 { 200.0 } else { 0.0 }
        });
        assert!(wild(&channel.values, far(Quantity::Torque, usual, None)).is_empty());
        assert!(far(Quantity::Torque, 0.0, None).is_infinite());
    }

    #[test]
    fn a_row_that_was_not_read_has_a_value_from_those_around() {
        let time: Vec<f64> = (0..1000).map(|row| f64::from(row) * 0.01).collect();
        for (quantity, error) in [(Quantity::Position, 1e-7), (Quantity::Torque, 1e-3)] {
            let whole = reads(quantity, 0, f64::sin);
            let mut channel = whole.clone();
            let rows = [0, 300, 301, 999];
            channel.leave_out(&rows);
            rows.iter().for_each(|row| channel.values[*row] = 9999.0);
            channel.fill(&time);
            assert!((channel.values[300] - whole.values[300]).abs() < error, "{quantity:?}");
            assert!((channel.values[0] - whole.values[1]).abs() < 1e-12, "{quantity:?}");
            assert!((channel.values[999] - whole.values[998]).abs() < 1e-12, "{quantity:?}");
            assert!(!channel.is_read(301) && channel.is_read(302), "{quantity:?}");
            assert_eq!(channel.readings(&time).0.len(), 996, "{quantity:?}");
        }
    }
}
