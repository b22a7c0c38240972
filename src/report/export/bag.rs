//! A run as an MCAP file that Foxglove, Rerun and ROS 2 read: joints, gripper, scale, poses and pictures as the
//! usual messages of ROS 2; steps and fluents as JSON.
//!
//! `trueup gap` reads the joints of such a file as it reads `arm.csv`. Sources: the MCAP specification 0; Foxglove's
//! schema `foxglove.Log`.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use serde_json::{Value, json};

use crate::trace::{FluentRow, StepRecord};
use crate::workcell::picture;
use crate::world::WorldState;

use super::ros::{
    COMPRESSED_IMAGE, CompressedImage, FLOAT64, Float64, Header, JOINT_STATE, JointState, Stamp,
    TF_MESSAGE, TfMessage, TransformStamped, cdr,
};
use super::rows::{self, Rows};
use super::{Error, Material};

/// Foxglove's level of a message that is no warning.
const INFO: u8 = 2;
/// As [`INFO`], of one that is.
const WARNING: u8 = 3;

/// The topics of pictures, and whose they are.
const CAMERAS: [(&str, &str); 2] =
    [("/camera/real/compressed", "real"), ("/camera/twin/compressed", "twin")];

/// As [`CAMERAS`], of the small pictures while the arm moves.
const FILMS: [(&str, &str); 2] =
    [("/film/real/compressed", "real"), ("/film/twin/compressed", "twin")];

/// A message that is not yet in the file.
struct Message {
    topic: &'static str,
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
    written(&messages)
}

/// A picture, JPEG or PNG.
fn image(topic: &'static str, time: f64, data: Vec<u8>) -> Result<Message, Error> {
    let format = if data.starts_with(b"\x89PNG") { "png" } else { "jpeg" };
    let image = CompressedImage { header: header(time, "camera"), format, data };
    Ok(Message { topic, at: nanoseconds(time), data: cdr(&image)? })
}

/// The small pictures while the arm moved, and the water in the twin.
fn film(material: &Material<'_>, messages: &mut Vec<Message>) -> Result<(), Error> {
    for moment in &material.film.moments {
        for (topic, whose) in FILMS {
            if let Some(data) = (material.still)(moment.number, whose) {
                messages.push(image(topic, moment.time, data)?);
            }
        }
        let water = material.film.vessels.iter().zip(&moment.water_ml);
        let water: BTreeMap<String, f64> =
            water.map(|(name, ml)| (format!("{name}_ml"), *ml)).collect();
        push_json(
            messages,
            "/twin/water",
            moment.time,
            &json!({"step": moment.step, "water": water}),
        )?;
    }
    Ok(())
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
        messages.push(Message { topic: "/joint_states", at, data: measured });
        if !command.is_empty() {
            let data = cdr(&state(command, Vec::new(), Vec::new()))?;
            messages.push(Message { topic: "/joint_commands", at, data });
        }
        for (topic, column) in [("/gripper/opening", opening), ("/scale/mass", mass)] {
            if let Some(value) = column.and_then(|i| row.get(i).copied()) {
                messages.push(Message { topic, at, data: cdr(&Float64 { data: value })? });
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
    Ok(Message { topic: "/tf", at: nanoseconds(state.time), data: cdr(&TfMessage { transforms })? })
}

/// The beginning and the end of a step, and the fluents after it.
fn steps(step: &StepRecord, messages: &mut Vec<Message>) -> Result<(), Error> {
    let [begin, end] = step.interval_s;
    let mut log = |time: f64, level: u8, text: String| {
        let Stamp { sec, nanosec } = stamp(time);
        let line = json!({
            "timestamp": {"sec": sec, "nsec": nanosec}, "level": level, "message": text,
            "name": "trueup", "file": step.path, "line": 0,
        });
        push_json(messages, "/steps", time, &line)
    };
    log(begin, INFO, format!("step {}: {}", step.number, step.action))?;
    match &step.reason {
        None => log(end, INFO, format!("step {} done", step.number))?,
        Some(reason) => log(end, WARNING, format!("step {} failed: {reason}", step.number))?,
    }
    let fluents: BTreeMap<&str, Value> =
        step.fluents.iter().map(|row| (row.name.as_str(), fluent(row))).collect();
    let told = json!({"step": step.number, "action": step.action, "fluents": fluents});
    push_json(messages, "/fluents", end, &told)
}

fn fluent(row: &FluentRow) -> Value {
    json!({
        "expected": row.expected, "twin": row.twin, "measured": row.measured,
        "margin": row.margin, "twin_margin": row.twin_margin,
    })
}

fn push_json(
    messages: &mut Vec<Message>,
    topic: &'static str,
    time: f64,
    value: &Value,
) -> Result<(), Error> {
    let data = serde_json::to_vec(value).map_err(|error| Error::Format(error.to_string()))?;
    messages.push(Message { topic, at: nanoseconds(time), data });
    Ok(())
}

/// A topic: its name, and the name, encoding and text of its schema, and the encoding of its messages.
fn channel(topic: &str) -> (&'static str, &'static str, String, &'static str) {
    let ros =
        |(name, definition): (&'static str, &str)| (name, "ros2msg", definition.to_owned(), "cdr");
    match topic {
        "/joint_states" | "/joint_commands" => ros(JOINT_STATE),
        "/gripper/opening" | "/scale/mass" => ros(FLOAT64),
        "/tf" => ros(TF_MESSAGE),
        "/steps" => {
            let schema = json!({"title": "foxglove.Log", "type": "object", "properties": {
                "timestamp": {"type": "object", "title": "time",
                    "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
                "level": {"type": "integer"}, "message": {"type": "string"},
                "name": {"type": "string"}, "file": {"type": "string"}, "line": {"type": "integer"},
            }});
            ("foxglove.Log", "jsonschema", schema.to_string(), "json")
        }
        "/fluents" => {
            let schema = json!({"title": "trueup.Fluents", "type": "object", "properties": {
                "step": {"type": "integer"}, "action": {"type": "string"},
                "fluents": {"type": "object", "additionalProperties": {"type": "object", "properties": {
                    "expected": {"type": ["boolean", "null"]}, "twin": {"type": ["boolean", "null"]},
                    "measured": {"type": ["boolean", "null"]},
                    "margin": {}, "twin_margin": {},
                }}},
            }});
            ("trueup.Fluents", "jsonschema", schema.to_string(), "json")
        }
        "/twin/water" => {
            let schema = json!({"title": "trueup.Water", "type": "object", "properties": {
                "step": {"type": "integer"},
                "water": {"type": "object", "additionalProperties": {"type": "number"}},
            }});
            ("trueup.Water", "jsonschema", schema.to_string(), "json")
        }
        _ => ros(COMPRESSED_IMAGE),
    }
}

fn written(messages: &[Message]) -> Result<Vec<u8>, Error> {
    let wrong = |error: mcap::McapError| Error::Format(error.to_string());
    let mut bytes = Cursor::new(Vec::new());
    let library = concat!("trueup ", env!("CARGO_PKG_VERSION"));
    let options = WriteOptions::new().profile("ros2").library(library);
    let mut writer = mcap::Writer::with_options(&mut bytes, options).map_err(wrong)?;
    let mut channels: BTreeMap<&str, (u16, u32)> = BTreeMap::new();
    for message in messages {
        if !channels.contains_key(message.topic) {
            let (name, encoding, definition, of_messages) = channel(message.topic);
            let schema = writer.add_schema(name, encoding, definition.as_bytes()).map_err(wrong)?;
            let id = writer
                .add_channel(schema, message.topic, of_messages, &BTreeMap::new())
                .map_err(wrong)?;
            channels.insert(message.topic, (id, 0));
        }
        let Some((channel_id, sequence)) = channels.get_mut(message.topic) else { continue };
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: message.at,
            publish_time: message.at,
        };
        *sequence += 1;
        writer.write_to_known_channel(&header, &message.data).map_err(wrong)?;
    }
    writer.finish().map_err(wrong)?;
    drop(writer);
    Ok(bytes.into_inner())
}
