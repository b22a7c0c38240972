//! What a recording says of an arm, channel by channel, each with its noise.

use std::collections::BTreeMap;

use crate::units::Dimension;

use super::super::recording::{Error, Recording, noise, sidecar::PerChannel};
use super::error::Misfit;
use super::note::Note;
use super::rows;
use crate::motion::robot::JointLimits;

/// What a channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Joint positions as the encoders read them, rad; m of a joint that slides.
    Position,
    /// Joint speeds, rad/s or m/s.
    Speed,
    /// Joint torques, N·m, or forces, N.
    Torque,
    /// The tip in the base's frame as a tracker sees it, m.
    Tip,
}

impl Quantity {
    /// Returns the stem of the channel's names and the seat of its delay.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Position => "q",
            Self::Speed => "dq",
            Self::Torque => "tau",
            Self::Tip => "tcp",
        }
    }

    /// Returns the SI unit, of a joint that slides or of one that turns.
    pub fn unit(self, slides: bool) -> &'static str {
        match (self, slides) {
            (Self::Position, false) => "rad",
            (Self::Position, true) | (Self::Tip, _) => "m",
            (Self::Speed, false) => "rad/s",
            (Self::Speed, true) => "m/s",
            (Self::Torque, false) => "N*m",
            (Self::Torque, true) => "N",
        }
    }
}

/// One measured column.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// What it measures.
    pub quantity: Quantity,
    /// Which joint, or which axis of the tip, from 0.
    pub index: usize,
    /// `tau_4`, `tcp_x`.
    pub name: String,
    /// Measured values in SI.
    pub values: Vec<f64>,
    /// Standard deviation of the noise, SI; 0 of a torque sensor that never changes, until all recordings are read.
    pub noise: f64,
    /// Rows at which it was not read: they have values from those around, and are not judged. Empty where it was read in every row.
    pub unread: Vec<bool>,
}

impl Channel {
    /// Returns whether it is a torque sensor that never changes.
    fn is_still(&self) -> bool {
        let is_same = |pair: &[f64]| (pair[1] - pair[0]).abs() <= 0.0;
        self.quantity == Quantity::Torque && self.values.windows(2).all(is_same)
    }
}

/// A recording of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Number of joints.
    pub n: usize,
    /// When each row was taken, s.
    pub time: Vec<f64>,
    /// Commanded joint positions, one list per joint, rad; empty when not recorded.
    pub commands: Vec<Vec<f64>>,
    /// Everything measured.
    pub channels: Vec<Channel>,
    /// What was assumed.
    pub notes: Vec<Note>,
    /// Whether the torques were measured as currents, without the constants of the drives.
    pub are_currents: bool,
    /// Whether the torques were measured as currents at all.
    pub of_currents: bool,
}

impl Data {
    /// Takes an arm's channels out of a recording; `limits` are those of its `n` joints.
    ///
    /// # Errors
    ///
    /// [`Error`] for a group of columns that is not complete, a cell that is not a number, a wrong
    /// unit, or a recording that holds nothing of an arm.
    pub fn new(recording: &Recording, n: usize, limits: &[JointLimits]) -> Result<Self, Error> {
        let mut data = Self::columns(recording, n, true)?;
        data.leave_out_blank(recording)?;
        data.drop_unmeasured(&recording.name);
        data.leave_out_wild(recording, limits);
        data.drop_repeats(&recording.name);
        data.leave_out_held(&recording.name);
        data.leave_out_contacts(recording);
        data.set_clock(&recording.name);
        data.estimate_noise();
        let levels = &recording.sidecar.noise;
        if levels.q_rad.is_none() && levels.tau_nm.is_none() && levels.tcp_m.is_none() {
            data.notes.push(Note::NoiseEstimated { recording: recording.name.clone() });
        }
        Ok(data)
    }

    /// Takes an arm's channels out of a recording in which each row is a pose at rest: no row says anything of the next,
    /// and a noise that is not given stays 0.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn at_rest(recording: &Recording, n: usize) -> Result<Self, Error> {
        Self::columns(recording, n, false)
    }

    /// Takes an arm's channels out of a recording as they are; angles of a motion without jumps of whole turns, and what was measured
    /// of it NaN where cells are blank.
    fn columns(recording: &Recording, n: usize, moves: bool) -> Result<Self, Error> {
        let unwrapped = |values: &[f64]| if moves { unwrapped(values) } else { values.to_vec() };
        let group = |stem: &str, dimension| recording.group(stem, n, dimension);
        let measured = |stem: &str, dimension| {
            if moves {
                recording.group_with_blanks(stem, n, dimension)
            } else {
                group(stem, dimension)
            }
        };
        for stem in ["q_cmd", "q", "dq", "tau"] {
            let given = recording.group_len(stem);
            if given > n {
                return Err(Misfit::TooManyColumns { stem, given, n }.at(&recording.name));
            }
        }
        let commands: Vec<Vec<f64>> = group("q_cmd", Dimension::ANGLE)?
            .map(|columns| columns.iter().map(|values| unwrapped(values)).collect())
            .unwrap_or_default();
        let levels = &recording.sidecar.noise;
        let currents = currents(recording);
        let constants = &recording.sidecar.torque_constant;
        if let Some(constants) =
            constants.as_ref().filter(|constants| constants.of(n - 1).is_none())
        {
            let given = constants.values().len();
            return Err(Misfit::TorqueConstants { given, n }.at(&recording.name));
        }
        let kinds = [
            (Quantity::Position, Dimension::ANGLE, &levels.q_rad),
            (Quantity::Speed, Dimension::ANGULAR_SPEED, &levels.dq_rad_s),
            (Quantity::Torque, Dimension::TORQUE, &levels.tau_nm),
        ];
        let mut channels = Vec::new();
        for (quantity, dimension, level) in kinds {
            let of_current = currents.filter(|_| quantity == Quantity::Torque);
            let columns = match of_current {
                Some(stem) => measured(stem, Dimension::CURRENT)?,
                None => measured(quantity.stem(), dimension)?,
            };
            let Some(columns) = columns else { continue };
            for (index, values) in columns.into_iter().enumerate() {
                let mut values = values.to_vec();
                if quantity == Quantity::Position {
                    values = unwrapped(&values);
                    if let Some(command) = commands.get(index) {
                        near(&mut values, command);
                    }
                }
                if let (Some(_), Some(by)) = (of_current, constants) {
                    let by = by.of(index).unwrap_or(1.0);
                    for value in &mut values {
                        *value *= by;
                    }
                }
                let name = format!("{}_{}", quantity.stem(), index + 1);
                channels.push(channel(quantity, index, name, values, level.as_ref()));
            }
        }
        let axes = ["tcp_x", "tcp_y", "tcp_z"];
        if axes.iter().any(|name| recording.has(name)) {
            for (index, name) in axes.into_iter().enumerate() {
                let values = if moves {
                    recording.column_with_blanks(name, Dimension::LENGTH)?.to_vec()
                } else {
                    recording.column(name, Dimension::LENGTH)?.to_vec()
                };
                let level = levels.tcp_m.as_ref();
                channels.push(channel(Quantity::Tip, index, name.into(), values, level));
            }
        }
        let any_motion =
            !commands.is_empty() || channels.iter().any(|c| c.quantity == Quantity::Position);
        if channels.is_empty() || !any_motion {
            let columns = recording.columns.iter().map(|c| c.name.clone()).take(30).collect();
            let missing = if channels.is_empty() {
                Misfit::NothingMeasured { columns }
            } else {
                Misfit::NoMotion { columns }
            };
            return Err(missing.at(format!("{}:1", recording.name)));
        }
        let time = recording.time.clone();
        let of_currents = currents.is_some();
        let are_currents = of_currents && constants.is_none();
        Ok(Self { n, time, commands, channels, notes: Vec::new(), are_currents, of_currents })
    }

    /// Leaves out torques, speeds or a tip that never change while the arm moves: some loggers write zeros for
    /// what they do not measure.
    fn drop_unmeasured(&mut self, name: &str) {
        let is_constant = |c: &Channel| c.values.iter().all(|v| (v - c.values[0]).abs() <= 0.0);
        let group = |quantity| self.channels.iter().filter(move |c| c.quantity == quantity);
        let moved = self.commands.iter().map(Vec::as_slice);
        let mut moved = moved.chain(group(Quantity::Position).map(|c| &c.values[..]));
        if !moved.any(|values| values.iter().any(|v| (v - values[0]).abs() > 0.05)) {
            return;
        }
        for quantity in [Quantity::Speed, Quantity::Torque, Quantity::Tip] {
            let mut columns = self.channels.iter().filter(|c| c.quantity == quantity).peekable();
            if columns.peek().is_some() && columns.all(is_constant) {
                self.channels.retain(|c| c.quantity != quantity);
                self.notes.push(Note::Unmeasured { recording: name.into(), stem: quantity.stem() });
            }
        }
    }

    /// Leaves out rows that the logger wrote twice.
    fn drop_repeats(&mut self, name: &str) {
        let rows = self.n_rows();
        let fresh = rows::fresh(&self.channels, rows);
        let repeats = fresh.iter().filter(|is_new| !**is_new).count();
        if repeats == 0 {
            return;
        }
        for unread in self.channels.iter_mut().map(|channel| &mut channel.unread) {
            keep(unread, &fresh);
        }
        let measured = self.channels.iter_mut().map(|channel| &mut channel.values);
        for values in measured.chain(&mut self.commands).chain([&mut self.time]) {
            keep(values, &fresh);
        }
        self.notes.push(Note::Repeats { recording: name.into(), repeats, rows });
    }

    /// Takes the samples to be evenly spaced where the motion says so and the stamps do not.
    fn set_clock(&mut self, name: &str) {
        let Some(even) = rows::even_clock(&self.time, &self.channels) else { return };
        let off = even.iter().zip(&self.time).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let off = (off / even.len() as f64).sqrt();
        self.time = even;
        self.notes.push(Note::Jitter { recording: name.into(), off });
    }

    /// Judges the noise of channels for which none is given.
    fn estimate_noise(&mut self) {
        let is_told = |channel: &Channel| channel.noise > 0.0 || channel.is_still();
        for channel in self.channels.iter_mut().filter(|channel| !is_told(channel)) {
            // Never less than the step in which the values are written.
            let scale = channel.values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            // What is compared with a motion that is measured itself, row by row.
            let is_compared = matches!(channel.quantity, Quantity::Torque | Quantity::Tip);
            let estimate = match channel.quantity {
                _ if is_compared => noise::estimate_per_row,
                Quantity::Position => noise::estimate_of_motion,
                _ => noise::estimate,
            };
            let (time, values) = channel.readings(&self.time);
            let noise = estimate(&time, &values);
            channel.noise = noise.max(scale * 1e-6).max(1e-9);
        }
    }

    /// Returns the number of rows.
    pub fn n_rows(&self) -> usize {
        self.time.len()
    }

    /// Returns whether a quantity was recorded.
    pub fn has(&self, quantity: Quantity) -> bool {
        self.channels.iter().any(|channel| channel.quantity == quantity)
    }

    /// Returns the measured values of a joint's channel.
    pub fn measured(&self, quantity: Quantity, index: usize) -> Option<&[f64]> {
        let found = self.channels.iter().find(|c| c.quantity == quantity && c.index == index);
        found.map(|channel| &channel.values[..])
    }

    /// Returns at how many rows a joint's torque sensor shows more than `limit`, N·m, either way, and how many rows it has.
    pub fn above(&self, joint: usize, limit: f64) -> (usize, usize) {
        let shown = self.measured(Quantity::Torque, joint).unwrap_or(&[]);
        (shown.iter().filter(|tau| tau.abs() > limit).count(), shown.len())
    }
}

/// The noise of a channel of which nothing is said is this many times larger.
pub(super) const SILENT: f64 = 1e9;

/// Gives torque sensors that never change in a recording, which tells nothing of their noise, the noise that they have in the
/// others. Of one that never changes at all nothing is said.
pub(super) fn settle_noise<'a>(recordings: impl Iterator<Item = &'a mut Data>) {
    let mut recordings: Vec<&mut Data> = recordings.collect();
    let mut known: BTreeMap<String, f64> = BTreeMap::new();
    for channel in recordings.iter().flat_map(|data| &data.channels) {
        let noise = known.entry(channel.name.clone()).or_default();
        *noise = noise.max(channel.noise);
    }
    for data in &mut recordings {
        for channel in data.channels.iter_mut().filter(|channel| channel.noise <= 0.0) {
            let noise = known.get(&channel.name).copied().filter(|noise| *noise > 0.0);
            if noise.is_none() {
                data.notes.push(Note::NeverChanges { channel: channel.name.clone() });
            }
            channel.noise = noise.unwrap_or(SILENT);
        }
    }
}

/// Returns the stem of the columns that hold motor currents in the place of torques, if there are any.
fn currents(recording: &Recording) -> Option<&'static str> {
    let unit_of = |name: &str| {
        let column = recording.columns.iter().find(|column| column.name == name)?;
        Some(column.unit.map(|unit| unit.dimension))
    };
    match (unit_of("tau_1"), unit_of("current_1")) {
        (Some(Some(Dimension::CURRENT)), _) => Some("tau"),
        (None, Some(_)) => Some("current"),
        _ => None,
    }
}

fn channel(
    quantity: Quantity,
    index: usize,
    name: String,
    values: Vec<f64>,
    level: Option<&PerChannel>,
) -> Channel {
    // 0 stands for a noise that is not known yet.
    let noise = level.and_then(|level| level.of(index)).unwrap_or(0.0);
    Channel { quantity, index, name, values, noise, unread: Vec::new() }
}

/// Keeps the rows that are to be kept; of a list without rows there are none to keep.
fn keep<T>(values: &mut Vec<T>, is_kept: &[bool]) {
    let mut is_kept = is_kept.iter();
    values.retain(|_| *is_kept.next().unwrap_or(&true));
}

/// Takes jumps of a whole turn out of an angle.
pub(super) fn unwrapped(values: &[f64]) -> Vec<f64> {
    use std::f64::consts::{PI, TAU};
    let mut turns = 0.0;
    let mut last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    values
        .iter()
        .map(|&value| {
            if value - last > PI {
                turns -= TAU;
            } else if last - value > PI {
                turns += TAU;
            }
            if value.is_finite() {
                last = value;
            }
            value + turns
        })
        .collect()
}

/// Moves an angle by whole turns so that its first value is next to another's.
fn near(values: &mut [f64], other: &[f64]) {
    use std::f64::consts::TAU;
    let first = values.iter().position(|value| value.is_finite()).unwrap_or(0);
    let turns = ((other[first] - values[first]) / TAU).round() * TAU;
    for value in values {
        *value += turns;
    }
}
