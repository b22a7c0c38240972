//! A ROS 2 bag in MCAP → a recording: the `sensor_msgs/msg/JointState` messages of an arm.
//!
//! Joints keep the names the bag gives them (`q_shoulder`, `dq_shoulder`, `tau_shoulder`) until
//! [`Recording::number_joints`] gives them the numbers of a robot. Topics whose name speaks of a command
//! become `q_cmd_…`. Metadata may hold the sidecar, as those of a run that was exported do. Sources: the MCAP
//! specification 0, OMG CDR 1.0, `sensor_msgs` of ROS 2.

use std::collections::BTreeMap;

use byteorder::{BigEndian, LittleEndian};
use serde::Deserialize;

use super::sidecar::{self, is_exported};
use super::{BagFlaw, BrokenBag, BrokenMessage, Error, Flaw};
use super::{Column, MOST_VALUES, Map, Recording, Sidecar, records, too_much, wording};
use crate::units;

/// The one message that is read.
const JOINT_STATE: &str = "sensor_msgs/msg/JointState";

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Deserialize)]
struct Stamp {
    sec: i32,
    nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Deserialize)]
struct Header {
    stamp: Stamp,
    #[serde(rename = "frame_id")]
    _frame: String,
}

/// `sensor_msgs/msg/JointState`: rad or m, rad/s or m/s, N·m or N; a list may be empty.
#[derive(Debug, Deserialize)]
struct JointState {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

/// One quantity of one joint over time.
type Series = Vec<(f64, f64)>;

/// The joint states of a bag, gathered from its files one after the other: a bag may be split.
#[derive(Debug, Default)]
pub struct Bag {
    /// Every quantity of every joint over time, s since the epoch.
    series: BTreeMap<String, Series>,
    /// Topics, and the kind of message of each.
    topics: BTreeMap<String, String>,
    /// Values in all series.
    n_values: usize,
    /// Whether a message bears no stamp.
    is_unstamped: bool,
    /// The text of the sidecar that it brings.
    told: Option<String>,
}

impl Bag {
    /// Adds what is in a file of the bag; `name` is the file's, for errors.
    ///
    /// # Errors
    ///
    /// An [`Error`] for bytes that are no MCAP file, a message that cannot be read, or more values than are read.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let broken = |why: BrokenBag| Flaw::Bag(BagFlaw::Broken(why)).at(name);
        records::items(bytes, broken, |item| match item {
            records::Item::Message(message) => self.take(name, &message),
            records::Item::Metadata(mut told) => {
                if told.name == sidecar::METADATA {
                    self.told = told.metadata.remove(sidecar::TEXT);
                }
                Ok(())
            }
        })
    }

    /// Adds a message, if it is a joint state.
    fn take(&mut self, name: &str, message: &records::Message<'_>) -> Result<(), Error> {
        let channel = &message.channel;
        let schema = channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
        if !self.topics.contains_key(&channel.topic) {
            self.topics.insert(channel.topic.clone(), schema.to_owned());
        }
        if schema != JOINT_STATE || channel.message_encoding != "cdr" {
            return Ok(());
        }
        let state = joint_state(message.data).map_err(|why| {
            let flaw = BagFlaw::Message { sequence: message.sequence, why };
            Flaw::Bag(flaw).at(format!("{name}, topic {}", channel.topic))
        })?;
        let stamp =
            f64::from(state.header.stamp.sec) + f64::from(state.header.stamp.nanosec) * 1e-9;
        let time = if stamp > 0.0 {
            stamp
        } else {
            self.is_unstamped = true;
            message.log_time as f64 * 1e-9
        };
        let stems = if is_command(&channel.topic) {
            ["q_cmd", "dq_cmd", "tau_cmd"]
        } else {
            ["q", "dq", "tau"]
        };
        let lists = [&state.position, &state.velocity, &state.effort];
        for (stem, list) in stems.into_iter().zip(lists) {
            for (joint, value) in state.name.iter().zip(list) {
                if value.is_finite() {
                    let series = self.series.entry(format!("{stem}_{joint}")).or_default();
                    series.push((time, *value));
                    self.n_values += 1;
                }
            }
        }
        if self.n_values > MOST_VALUES { Err(too_much(name, self.n_values)) } else { Ok(()) }
    }

    /// Makes one recording of it all; `name` is the bag's, the sidecar and the map are as for [`Recording::read`]. A sidecar
    /// that was exported is another file's where the bag brings its own.
    ///
    /// # Errors
    ///
    /// An [`Error`] for a bag without joint states, a column that the map renames and the bag does not have, or a sidecar
    /// that is not one.
    pub fn recording(
        mut self,
        name: &str,
        sidecar: Option<(&str, &str)>,
        map: &Map,
    ) -> Result<Recording, Error> {
        let own = self.told.take();
        let beside = sidecar.filter(|(_, text)| own.is_none() || !is_exported(text));
        let own = own.filter(|_| beside.is_none());
        let told = match &own {
            Some(text) => Sidecar::read(name, text)?,
            None => Sidecar::beside(beside)?,
        };
        let (series, mut notes) = self.in_order(name)?;
        let headers: Vec<String> = series.keys().cloned().collect();
        if let Some(theirs) = map.unused(&headers) {
            let flaw = BagFlaw::NotRenamed { theirs: theirs.to_owned(), headers };
            return Err(Flaw::Bag(flaw).at(name));
        }
        // The clock is that of the measured quantity with most samples; the others are read off at its times.
        let measured = series.iter().filter(|(name, _)| !is_held(name));
        let Some((_, clock)) = measured.max_by_key(|(_, samples)| samples.len()) else {
            return Err(Flaw::Bag(BagFlaw::OnlyCommands).at(name));
        };
        let (begin, end) = overlap(&series);
        let time: Vec<f64> =
            clock.iter().map(|sample| sample.0).filter(|t| (begin..=end).contains(t)).collect();
        if time.len() < 3 {
            return Err(Flaw::Bag(BagFlaw::TooFewStates(time.len())).at(name));
        }
        // A topic that was heard once has a value at every time as well.
        if time.len().saturating_mul(series.len()) > MOST_VALUES {
            return Err(too_much(name, time.len() * series.len()));
        }
        let outside = clock.len() - time.len();
        if outside > 0 {
            notes.push(wording::not_every_topic(name, outside));
        }
        let columns = series.iter().map(|(header, samples)| {
            let values = time.iter().map(|t| at(samples, *t, is_held(header))).collect();
            let plain = units::Column { name: header.clone(), unit: None };
            let (column, _) = map.apply(header, plain);
            Column {
                name: column.name,
                unit: column.unit,
                values,
                bad: Vec::new(),
                n_bad: 0,
                is_one_of_several: false,
            }
        });
        let columns = columns.collect();
        let first = time[0];
        // What the bag itself tells is told by its own clock.
        let sidecar = if own.is_some() { told.later(-first) } else { told };
        let time = time.into_iter().map(|t| t - first).collect();
        Ok(Recording { name: name.into(), time, lines: Vec::new(), columns, sidecar, notes })
    }

    /// Returns every series with time increasing, and what was assumed or left out.
    fn in_order(mut self, name: &str) -> Result<(BTreeMap<String, Series>, Vec<String>), Error> {
        if self.series.is_empty() {
            let told = |(topic, schema): (&String, &String)| format!("{topic} ({schema})");
            let topics = self.topics.iter().map(told).collect();
            return Err(Flaw::Bag(BagFlaw::NoJointStates { wanted: JOINT_STATE, topics }).at(name));
        }
        let mut notes = Vec::new();
        if self.is_unstamped {
            notes.push(wording::without_stamp(name));
        }
        let mut repeated = 0;
        for samples in self.series.values_mut() {
            samples.sort_by(|a, b| a.0.total_cmp(&b.0));
            let before = samples.len();
            samples.dedup_by(|later, earlier| later.0 <= earlier.0);
            repeated = repeated.max(before - samples.len());
        }
        if repeated > 0 {
            notes.push(wording::messages_repeat(name, repeated));
        }
        Ok((self.series, notes))
    }
}

/// Returns whether a topic holds what was asked of the arm rather than what it did.
fn is_command(topic: &str) -> bool {
    let topic = topic.to_ascii_lowercase();
    ["command", "cmd", "desired", "reference", "target"].iter().any(|word| topic.contains(word))
}

/// Decodes one message: four bytes that say the byte order, then the fields.
fn joint_state(data: &[u8]) -> Result<JointState, BrokenMessage> {
    let (Some(kind), Some(body)) = (data.get(..2), data.get(4..)) else {
        return Err(BrokenMessage::Short(data.len()));
    };
    let decoded = match kind {
        [0, 0] => cdr_encoding::from_bytes::<JointState, BigEndian>(body),
        [0, 1] => cdr_encoding::from_bytes::<JointState, LittleEndian>(body),
        _ => return Err(BrokenMessage::Encoding(kind.to_vec())),
    };
    decoded.map(|(state, _)| state).map_err(|error| BrokenMessage::Unread(error.to_string()))
}

/// Returns from when to when every series has samples; the last command holds until there is another.
fn overlap(series: &BTreeMap<String, Series>) -> (f64, f64) {
    let mut inside = (f64::NEG_INFINITY, f64::INFINITY);
    for (name, samples) in series {
        inside.0 = inside.0.max(samples[0].0);
        if !is_held(name) {
            inside.1 = inside.1.min(samples[samples.len() - 1].0);
        }
    }
    inside
}

/// Returns whether a series is of commands, which hold until the next one.
fn is_held(name: &str) -> bool {
    ["q_cmd_", "dq_cmd_", "tau_cmd_"].iter().any(|stem| name.starts_with(stem))
}

/// Returns a series at a time inside it: the last value (`held`), or between the two around it.
fn at(samples: &[(f64, f64)], time: f64, held: bool) -> f64 {
    let after = samples.partition_point(|sample| sample.0 <= time);
    let before = samples[after.saturating_sub(1)];
    match samples.get(after) {
        Some(next) if !held && next.0 > before.0 => {
            before.1 + (time - before.0) / (next.0 - before.0) * (next.1 - before.1)
        }
        _ => before.1,
    }
}
