//! Which cells of a channel are readings of their own.
//!
//! A word that is broken on its way shows ten thousand newton metres in one row; a sensor that is slower than the log stands in
//! several rows with one reading; a tracker that has lost its marker tells its last place over and over. None of this is an effect
//! of the arm. Such rows are marked as not read ([`Channel::unread`]): nothing judges them, and what needs a value in every row
//! gets one from those around. The readings beside them stay.
//!
//! Real effects are sudden, too (collisions, friction that lets go, a limit, play), and coarse readings repeat honestly. So strong
//! evidence is asked for: more than anything else of that sensor many times over, and back within three rows; or all columns of a
//! sensor to the last digit, though it tells finer differences than it goes from one reading to the next.

use std::collections::BTreeSet;
use std::ops::Range;

use super::channels::{Channel, Data, Quantity};
use super::note::Note;
use super::sensor::Sensor;
use super::spline::Spline;
use crate::discovery::recording::{Error, Recording, Segment, noise};
use crate::motion::robot::JointLimits;
use crate::units::Dimension;

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
pub(super) const USUAL: f64 = 0.95;

/// However little moved, no wild cell is nearer than this to the middle of its column: three turns, rad, and further than an arm
/// reaches, m.
const NO_ANGLE: f64 = 20.0;
const NO_PLACE: f64 = 10.0;

/// How long before and after a row the arm must have moved, s, by how much at least, rad or m, and by how many times the noise.
const AROUND: f64 = 0.1;
const MOVES: f64 = 1e-3;
const MOVES_BEYOND_NOISE: f64 = 5.0;

/// A sensor has stopped if it shows one reading for more than so many rows while the arm moves, and then jumps.
const STOPPED_ROWS: usize = 10;

/// Between positions that are this near to each other, s, an arm moves smoothly: far less than a period of the fastest motion.
const NEAR: f64 = 0.03;

/// Longer between two positions, s, nobody knows how an arm moved.
const LONGEST_GAP: f64 = 0.5;

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
    pub(super) fn leave_out(&mut self, rows: &[usize]) {
        self.unread.resize(self.values.len(), false);
        for row in rows {
            self.unread[*row] = true;
        }
    }

    /// Returns the stretches of rows at which it was not read.
    fn gaps(&self) -> Vec<Range<usize>> {
        let mut gaps: Vec<Range<usize>> = Vec::new();
        for row in (0..self.values.len()).filter(|row| !self.is_read(*row)) {
            match gaps.last_mut() {
                Some(gap) if gap.end == row => gap.end += 1,
                _ => gaps.push(row..row + 1),
            }
        }
        gaps
    }

    /// Gives the rows at which it was not read values from those around: a motion is smooth, a torque may jump.
    pub(super) fn fill(&mut self, time: &[f64]) {
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
    /// Leaves out blank cells: of two sensors in one table each may have rows of its own.
    ///
    /// # Errors
    ///
    /// An [`Error`] for positions that are missing for so long that nobody knows how the arm moved.
    pub(super) fn leave_out_blank(&mut self, recording: &Recording) -> Result<(), Error> {
        let mut columns = Vec::new();
        for channel in &mut self.channels {
            let all = channel.values.iter().enumerate();
            let blank = all.filter(|(_, value)| value.is_nan()).map(|(row, _)| row);
            let rows: Vec<usize> = blank.collect();
            if rows.is_empty() {
                continue;
            }
            channel.leave_out(&rows);
            let is_long = |gap: &Range<usize>| {
                let [from, to] = gap_ends(gap, &self.time);
                let is_at_end = gap.start == 0 || gap.end == self.time.len();
                to - from > if is_at_end { NEAR } else { LONGEST_GAP }
            };
            if channel.quantity == Quantity::Position && channel.gaps().iter().any(is_long) {
                recording.group(channel.quantity.stem(), self.n, Dimension::ANGLE)?;
            }
            channel.fill(&self.time);
            columns.push((channel.name.clone(), rows.len()));
        }
        if !columns.is_empty() {
            self.notes.push(Note::Blank { recording: recording.name.clone(), columns });
        }
        Ok(())
    }

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

    /// Leaves out rows in which a sensor that is read less often than the log is written shows its last reading once more.
    pub(super) fn leave_out_held(&mut self, name: &str) {
        let moves = self.moving();
        for quantity in SENSORS {
            let own = self.channels.iter().filter(|channel| channel.quantity == quantity);
            let sensor = Sensor::of(own);
            let Some(every) = sensor.every(&moves) else {
                self.leave_out_stopped(quantity, &moves, name);
                continue;
            };
            let is_held = |run: &Range<usize>| run.len() <= every || sensor.is_all(run, &moves);
            let held = sensor.runs().into_iter().filter(is_held);
            let again: Vec<usize> = held.flat_map(|run| sensor.again(&run)).collect();
            let rows = sensor.rows.len();
            self.mark(quantity, &again);
            let (recording, stem) = (name.to_owned(), quantity.stem());
            self.notes.push(Note::Held { recording, stem, new: rows - again.len(), rows });
        }
    }

    /// Leaves out rows in which a sensor shows its last reading though the arm moves on. How it moves, the positions say: of those
    /// themselves nobody knows whether the arm stuck.
    fn leave_out_stopped(&mut self, quantity: Quantity, moves: &[bool], name: &str) {
        if quantity == Quantity::Position || !self.has(Quantity::Position) {
            return;
        }
        let own = self.channels.iter().filter(|channel| channel.quantity == quantity);
        let sensor = Sensor::of(own);
        let is_stopped = |run: &Range<usize>| {
            let is_long = run.len() > STOPPED_ROWS && sensor.is_all(run, moves);
            // What a drive or a gauge gives at most it may well give for long.
            let may_be_limit = quantity != Quantity::Tip && sensor.is_at_limits(run);
            is_long && !may_be_limit && sensor.jumps_after(run)
        };
        let mut runs = sensor.runs();
        runs.retain(is_stopped);
        if runs.is_empty() || !sensor.is_fine() {
            return;
        }
        let again: Vec<usize> = runs.iter().flat_map(|run| sensor.again(run)).collect();
        let span =
            |run: &Range<usize>| [run.start, run.end - 1].map(|at| self.time[sensor.rows[at]]);
        let spans = runs.iter().map(span).collect();
        self.mark(quantity, &again);
        let (recording, stem) = (name.to_owned(), quantity.stem());
        self.notes.push(Note::Stopped { recording, stem, spans, rows: again.len() });
    }

    /// Leaves out the torques of rows in which the arm leaned on something: nobody knows how hard.
    pub(super) fn leave_out_contacts(&mut self, recording: &Recording) {
        let rows_of = |contact: &Segment| {
            let from = self.time.partition_point(|t| *t < contact.from);
            let to = self.time.partition_point(|t| *t <= contact.to);
            from..to.max(from)
        };
        let contacts = recording.sidecar.contacts.iter();
        let met = contacts.map(|contact| (contact, rows_of(contact)));
        let met: Vec<_> = met.filter(|(_, rows)| !rows.is_empty()).collect();
        if met.is_empty() || !self.has(Quantity::Torque) {
            return;
        }
        let rows: BTreeSet<usize> = met.iter().flat_map(|(_, rows)| rows.clone()).collect();
        let rows: Vec<usize> = rows.into_iter().collect();
        let spans = met.iter().map(|(what, _)| (what.name.clone(), [what.from, what.to]));
        let (recording, spans) = (recording.name.clone(), spans.collect());
        self.mark(Quantity::Torque, &rows);
        self.notes.push(Note::Contacts { recording, spans, rows: rows.len() });
    }

    /// Returns the rows at which the motion is a guess, because the nearest positions on either side are too far apart; empty
    /// where there are none.
    pub(super) fn blind(&self) -> Vec<bool> {
        let mut blind = Vec::new();
        let time = &self.time;
        for joint in self.channels.iter().filter(|c| c.quantity == Quantity::Position) {
            for gap in joint.gaps() {
                let [from, to] = gap_ends(&gap, time);
                if to - from > NEAR {
                    let more = if to - from > AROUND { AROUND } else { 0.0 };
                    blind.resize(time.len(), false);
                    let is_inside = |t: f64| t > from - more && t < to + more;
                    blind.iter_mut().zip(time).for_each(|(blind, t)| *blind |= is_inside(*t));
                }
            }
        }
        blind
    }

    /// Marks rows of a sensor as not read, in all its columns.
    fn mark(&mut self, quantity: Quantity, rows: &[usize]) {
        for channel in self.channels.iter_mut().filter(|channel| channel.quantity == quantity) {
            channel.leave_out(rows);
            channel.fill(&self.time);
        }
    }

    /// Returns whether some joint moves about each row, as measured or, where nobody measured, as commanded.
    fn moving(&self) -> Vec<bool> {
        let time = &self.time;
        let measured = self.channels.iter().filter(|c| c.quantity == Quantity::Position);
        let mut joints: Vec<&[f64]> = measured.map(|channel| &channel.values[..]).collect();
        if joints.is_empty() {
            joints = self.commands.iter().map(Vec::as_slice).collect();
        }
        let least = |values: &[f64]| MOVES_BEYOND_NOISE * noise::estimate(time, values);
        let least: Vec<f64> = joints.iter().map(|values| least(values).max(MOVES)).collect();
        let moves = |now: &f64| {
            let from = time.partition_point(|t| *t < now - AROUND);
            let to = time.partition_point(|t| *t <= now + AROUND) - 1;
            joints.iter().zip(&least).any(|(q, least)| (q[to] - q[from]).abs() > *least)
        };
        time.iter().map(moves).collect()
    }
}

/// Returns when the rows before and after a gap were taken, or the first and the last row where there are none, s.
fn gap_ends(gap: &Range<usize>, time: &[f64]) -> [f64; 2] {
    [time[gap.start.saturating_sub(1)], time[gap.end.min(time.len() - 1)]]
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
pub(super) fn part_of(values: impl Iterator<Item = f64>, part: f64) -> f64 {
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
            for row in rows {
                channel.values[row] = 9999.0;
            }
            channel.fill(&time);
            assert!((channel.values[300] - whole.values[300]).abs() < error, "{quantity:?}");
            assert!((channel.values[0] - whole.values[1]).abs() < 1e-12, "{quantity:?}");
            assert!((channel.values[999] - whole.values[998]).abs() < 1e-12, "{quantity:?}");
            assert!(!channel.is_read(301) && channel.is_read(302), "{quantity:?}");
            assert_eq!(channel.readings(&time).0.len(), 996, "{quantity:?}");
        }
    }

    /// A recording of two joints that turn, with torques of both; `torque` says what is read of a torque in a row.
    fn turning(torque: impl Fn(usize, &dyn Fn(usize) -> f64) -> f64) -> Data {
        let jitter = |row: usize| ((row * row) as f64).sin();
        let mut channels = Vec::new();
        for joint in 0..2 {
            let speed = 1.0 + 0.5 * joint as f64;
            channels.push(reads(Quantity::Position, joint, |t| (speed * t).sin()));
            let true_torque =
                |row: usize| 9.0 * (0.01 * speed * row as f64).cos() + 0.05 * jitter(row + joint);
            let mut channel = reads(Quantity::Torque, joint, |_| 0.0);
            let rows = channel.values.iter_mut().enumerate();
            rows.for_each(|(row, value)| *value = torque(row, &true_torque));
            channels.push(channel);
        }
        let time = (0..1000).map(|row| f64::from(row) * 0.01).collect();
        let (commands, notes) = (Vec::new(), Vec::new());
        Data { n: 2, time, commands, channels, notes, are_currents: false, of_currents: false }
    }

    /// Which rows of the second joint's torque are readings.
    fn read_of(data: &Data) -> Vec<usize> {
        (0..1000).filter(|row| data.channels[3].is_read(*row)).collect()
    }

    #[test]
    fn of_a_sensor_slower_than_the_log_each_reading_counts_once() {
        for every in [2, 4] {
            let mut data = turning(|row, torque| torque(row - row % every));
            data.leave_out_held("log");
            let expected: Vec<usize> = (0..1000).step_by(every).collect();
            assert_eq!(read_of(&data), expected, "every {every}");
            assert!(data.channels[0].unread.is_empty(), "every {every}");
            assert_eq!(data.notes.len(), 1, "every {every}");
        }
        // 60 readings in 100 rows.
        let mut data = turning(|row, torque| torque(row * 3 / 5 * 5 / 3));
        data.leave_out_held("log");
        assert_eq!(read_of(&data).len(), 600);
    }

    #[test]
    fn a_coarse_sensor_and_one_that_is_read_in_every_row_are_held_nowhere() {
        let coarse = |row: usize, torque: &dyn Fn(usize) -> f64| (torque(row) / 2.0).round() * 2.0;
        let mut all = [turning(coarse), turning(|row, torque| torque(row))];
        // A joint whose torque ends at a limit, beside one whose torque does not.
        all[1].channels[3].values.iter_mut().for_each(|tau| *tau = tau.clamp(-4.0, 4.0));
        for data in &mut all {
            data.leave_out_held("log");
            assert_eq!(read_of(data).len(), 1000);
            assert!(data.notes.is_empty());
        }
    }

    /// The torques of both joints stay as they are for a quarter of a second, while both turn on.
    #[test]
    fn a_sensor_that_stops_for_a_while_is_not_read_there() {
        let stopped = |row: usize| if (400..425).contains(&row) { 400 } else { row };
        let mut data = turning(|row, torque| torque(stopped(row)));
        data.leave_out_held("log");
        let expected: Vec<usize> = (0..1000).filter(|row| !(401..425).contains(row)).collect();
        assert_eq!(read_of(&data), expected);
        assert!(matches!(&data.notes[..], [Note::Stopped { rows: 24, .. }]), "{:?}", data.notes);
    }

    /// Both drives give all they have for a while, and then play lets go; or nothing moves.
    #[test]
    fn drives_at_their_limits_and_an_arm_at_rest_have_not_stopped() {
        let mut data =
            turning(|row, torque| if (400..425).contains(&row) { 50.0 } else { torque(row) });
        data.leave_out_held("log");
        assert_eq!(read_of(&data).len(), 1000);
        let stopped = |row: usize| if (400..425).contains(&row) { 400 } else { row };
        let mut data = turning(|row, torque| torque(stopped(row)));
        let joints = data.channels.iter_mut().filter(|c| c.quantity == Quantity::Position);
        joints.for_each(|channel| channel.values[380..440].fill(0.5));
        data.leave_out_held("log");
        assert_eq!(read_of(&data).len(), 1000);
    }

    /// What nobody measured of a motion for a while is a guess, and so is what was measured of it nearby.
    #[test]
    fn rows_without_a_motion_are_blind_and_single_ones_are_not() {
        let mut data = turning(|row, torque| torque(row));
        data.channels[0].leave_out(&[100]);
        assert!(data.blind().is_empty());
        data.channels[0].leave_out(&[200, 201, 202, 203]);
        let blind = data.blind();
        let rows: Vec<usize> = (0..1000).filter(|row| blind[*row]).collect();
        assert_eq!(rows, [200, 201, 202, 203]);
        data.channels[2].leave_out(&(500..530).collect::<Vec<usize>>());
        assert_eq!(data.blind().iter().filter(|is_blind| **is_blind).count(), 4 + 30 + 20);
    }
}
