//! A run as an MCAP file that Foxglove, Rerun and ROS 2 read, each topic one of the usual messages of ROS 2 with its
//! definition: a reader that knows no other kind opens all of it.
//!
//! `trueup gap` reads the joints of such a file as it reads `arm.csv`, with what the run says of them: a metadata record
//! `trueup.sidecar`, whose `json` is a sidecar. Sources: the MCAP specification 0; the MCAP registry, profile `ros2`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Cursor;

use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};

use crate::discovery::recording::sidecar;
use crate::trace::{FluentRow, Measure, StepRecord};
use crate::workcell::picture;
use crate::world::WorldState;

use super::ros::{
    COMPRESSED_IMAGE, CompressedImage, DIAGNOSTIC_ARRAY, DiagnosticArray, DiagnosticStatus,
    FLOAT64, Float64, Header, JOINT_STATE, JointState, KeyValue, LOG, Log, Stamp, TF_MESSAGE,
    TfMessage, TransformStamped, cdr,
};
use super::rows::{self, Rows};
use super::{Error, Material};

/// The level of a [`Log`] that is no warning.
const INFO: u8 = 20;
/// As [`INFO`], of one that is.
const WARN: u8 = 30;

/// The level of a [`DiagnosticStatus`] that is as it should be.
const OK: u8 = 0;
/// As [`OK`], of one that is not.
const AMISS: u8 = 1;
/// As [`OK`], of one that nothing is known of.
const STALE: u8 = 3;

/// What the topics of the water in the twin begin with; a vessel's name and its unit, mL, follow.
const WATER: &str = "/twin/water/";

/// The topics of pictures, and whose they are.
const CAMERAS: [(&str, &str); 2] =
    [("/camera/real/compressed", "real"), ("/camera/twin/compressed", "twin")];

/// As [`CAMERAS`], of the small pictures while the arm moves.
const FILMS: [(&str, &str); 2] =
    [("/film/real/compressed", "real"), ("/film/twin/compressed", "twin")];

/// A message that is not yet in the file.
struct Message {
    topic: Cow<'static, str>,
    /// When, ns.
    at: u64,
    data: Vec<u8>,
}

/// Returns an MCAP file of the run.
///
/// # Errors
///
/// When `arm.csv` is no table of numbers, or the file cannot be put together.
pub fn bag(material: &Material<'_>) -> Result<Vec<u8>, Error> {
    let mut messages = Vec::new();
    if !material.arm.is_empty() {
        joints(&Rows::read(material.arm)?, &mut messages)?;
    }
    if let Some(start) = &material.run.start {
        messages.push(poses(start)?);
    }
    for (k, step) in material.run.steps.iter().enumerate() {
        steps(step, &mut messages)?;
        messages.push(poses(&step.measured)?);
        let [begin, end] = step.interval_s;
        for (topic, whose) in CAMERAS {
            // What is seen before a later step is what was seen after the one before.
            let before = (k == 0).then(|| (picture::before(step.number, whose), begin));
            for (name, time) in
                before.into_iter().chain([(picture::after(step.number, whose), end)])
            {
                let Some(data) = (material.picture)(&name) else { continue };
                messages.push(image(topic, time, data)?);
            }
        }
    }
    film(material, &mut messages)?;
    messages.sort_by_key(|message| message.at);
    written(&messages, material.sidecar)
}

/// A picture, JPEG or PNG.
fn image(topic: &'static str, time: f64, data: Vec<u8>) -> Result<Message, Error> {
    let format = if data.starts_with(b"\x89PNG") { "png" } else { "jpeg" };
    let image = CompressedImage { header: header(time, "camera"), format, data };
    Ok(Message { topic: topic.into(), at: nanoseconds(time), data: cdr(&image)? })
}

/// The small pictures while the arm moved, and the water in the twin.
fn film(material: &Material<'_>, messages: &mut Vec<Message>) -> Result<(), Error> {
    for moment in &material.film.moments {
        for (topic, whose) in FILMS {
            if let Some(data) = (material.still)(moment.number, whose) {
                messages.push(image(topic, moment.time, data)?);
            }
        }
        for (name, ml) in material.film.vessels.iter().zip(&moment.water_ml) {
            let topic = format!("{WATER}{}_ml", topic_name(name)).into();
            let data = cdr(&Float64 { data: *ml })?;
            messages.push(Message { topic, at: nanoseconds(moment.time), data });
        }
    }
    Ok(())
}

/// Returns a name as a part of a topic, which ROS 2 spells with ASCII letters, digits and `_`.
fn topic_name(name: &str) -> String {
    let mut spelt = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() || c == '_' {
            spelt.push(c);
        } else {
            let _ = write!(spelt, "u{:x}", u32::from(c));
        }
    }
    spelt
}

fn nanoseconds(time: f64) -> u64 {
    (time.max(0.0) * 1e9).round() as u64
}

fn stamp(time: f64) -> Stamp {
    let at = nanoseconds(time);
    Stamp { sec: (at / 1_000_000_000) as i32, nanosec: (at % 1_000_000_000) as u32 }
}

fn header(time: f64, frame_id: &'static str) -> Header {
    Header { stamp: stamp(time), frame_id }
}

/// The rows of the arm's recording.
fn joints(arm: &Rows, messages: &mut Vec<Message>) -> Result<(), Error> {
    let groups = ["q", "dq", "tau", "q_cmd"].map(|stem| arm.group(stem));
    let names: Vec<String> = (1..=groups[0].len()).map(|n| format!("joint_{n}")).collect();
    let (opening, mass) = (arm.column("gripper"), arm.column("mass"));
    for row in &arm.rows {
        let time = rows::time(row);
        let at = nanoseconds(time);
        let [position, velocity, effort, command]: [Vec<f64>; 4] =
            std::array::from_fn(|g| rows::values(row, &groups[g]));
        let state = |position, velocity, effort| JointState {
            header: header(time, "base"),
            name: names.clone(),
            position,
            velocity,
            effort,
        };
        let measured = cdr(&state(position, velocity, effort))?;
        messages.push(Message { topic: "/joint_states".into(), at, data: measured });
        if !command.is_empty() {
            let data = cdr(&state(command, Vec::new(), Vec::new()))?;
            messages.push(Message { topic: "/joint_commands".into(), at, data });
        }
        for (topic, column) in [("/gripper/opening", opening), ("/scale/mass", mass)] {
            if let Some(value) = column.and_then(|i| row.get(i).copied()) {
                let data = cdr(&Float64 { data: value })?;
                messages.push(Message { topic: topic.into(), at, data });
            }
        }
    }
    Ok(())
}

/// Where tool and things were.
fn poses(state: &WorldState) -> Result<Message, Error> {
    let header = || header(state.time, "world");
    let tool = TransformStamped::new(header(), "tool", &state.world_from_tool);
    let things = state.objects.iter().filter_map(|object| {
        Some(TransformStamped::new(header(), &object.name, object.world_from_object.as_ref()?))
    });
    let transforms = std::iter::once(tool).chain(things).collect();
    let data = cdr(&TfMessage { transforms })?;
    Ok(Message { topic: "/tf".into(), at: nanoseconds(state.time), data })
}

/// The beginning and the end of a step, and the fluents after it.
fn steps(step: &StepRecord, messages: &mut Vec<Message>) -> Result<(), Error> {
    let [begin, end] = step.interval_s;
    let mut log = |time: f64, level: u8, msg: String| {
        let (name, function) = ("trueup", "");
        let line = Log {
            stamp: stamp(time),
            level,
            name,
            msg,
            file: step.path.clone(),
            function,
            line: 0,
        };
        messages.push(Message { topic: "/steps".into(), at: nanoseconds(time), data: cdr(&line)? });
        Ok::<(), Error>(())
    };
    log(begin, INFO, format!("step {}: {}", step.number, step.action))?;
    match &step.reason {
        None => log(end, INFO, format!("step {} done", step.number))?,
        Some(reason) => log(end, WARN, format!("step {} failed: {reason}", step.number))?,
    }
    let status = step.fluents.iter().map(|row| fluent(step.number, row)).collect();
    let told = DiagnosticArray { header: header(end, ""), status };
    messages.push(Message { topic: "/fluents".into(), at: nanoseconds(end), data: cdr(&told)? });
    Ok(())
}

/// A fluent after a step: amiss when it was measured otherwise than the plan expects, stale when it is unknown.
fn fluent(step: usize, row: &FluentRow) -> DiagnosticStatus {
    let level = match (row.expected, row.measured) {
        (_, None) => STALE,
        (Some(expected), Some(measured)) if expected != measured => AMISS,
        _ => OK,
    };
    let mut values = vec![KeyValue { key: "step".to_owned(), value: step.to_string() }];
    for (key, truth) in [("expected", row.expected), ("twin", row.twin), ("measured", row.measured)]
    {
        values.push(KeyValue { key: key.to_owned(), value: told(truth).to_owned() });
    }
    for (key, margin) in [("margin", &row.margin), ("twin_margin", &row.twin_margin)] {
        if let Some(Measure { value, unit }) = margin {
            values.push(KeyValue { key: format!("{key}[{unit}]"), value: value.to_string() });
        }
    }
    let (message, hardware_id) = (told(row.measured), "");
    DiagnosticStatus { level, name: row.name.clone(), message, hardware_id, values }
}

fn told(truth: Option<bool>) -> &'static str {
    match truth {
        Some(true) => "true",
        Some(false) => "false",
        None => "unknown",
    }
}

/// The message of a topic: its name and its definition.
fn message_of(topic: &str) -> (&'static str, &'static str) {
    match topic {
        "/joint_states" | "/joint_commands" => JOINT_STATE,
        "/gripper/opening" | "/scale/mass" => FLOAT64,
        "/tf" => TF_MESSAGE,
        "/steps" => LOG,
        "/fluents" => DIAGNOSTIC_ARRAY,
        water if water.starts_with(WATER) => FLOAT64,
        _ => COMPRESSED_IMAGE,
    }
}

fn written(messages: &[Message], sidecar: Option<&str>) -> Result<Vec<u8>, Error> {
    let wrong = |error: mcap::McapError| Error::Format(error.to_string());
    let mut bytes = Cursor::new(Vec::new());
    let library = concat!("trueup ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().profile("ros2").library(library);
    let mut writer = mcap::Writer::with_options(&mut bytes, options).map_err(wrong)?;
    let mut channels: BTreeMap<&str, (u16, u32)> = BTreeMap::new();
    for message in messages {
        let topic = message.topic.as_ref();
        if !channels.contains_key(topic) {
            let (name, definition) = message_of(topic);
            let schema =
                writer.add_schema(name, "ros2msg", definition.as_bytes()).map_err(wrong)?;
            let id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).map_err(wrong)?;
            channels.insert(topic, (id, 0));
        }
        let Some((channel_id, sequence)) = channels.get_mut(topic) else { continue };
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: message.at,
            publish_time: message.at,
        };
        *sequence += 1;
        writer.write_to_known_channel(&header, &message.data).map_err(wrong)?;
    }
    if let Some(text) = sidecar {
        let metadata = BTreeMap::from([(sidecar::TEXT.to_owned(), text.to_owned())]);
        let told = Metadata { name: sidecar::METADATA.to_owned(), metadata };
        writer.write_metadata(&told).map_err(wrong)?;
    }
    writer.finish().map_err(wrong)?;
    drop(writer);
    Ok(bytes.into_inner())
}
