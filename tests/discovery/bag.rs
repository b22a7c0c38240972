//! ROS 2 bags: what was written is read, and what cannot be read is told.

use std::collections::BTreeMap;
use std::io::Cursor;

use byteorder::LittleEndian;
use mcap::records::{MessageHeader, Metadata};
use serde::Serialize;
use trueup::discovery::recording::sidecar::{METADATA, TEXT, TorqueSensor};
use trueup::discovery::recording::{Bag, Map, Recording, Sidecar};
use trueup::units::Dimension;

use super::{bare_arm, recording};

#[derive(Serialize)]
struct JointState {
    stamp: (i32, u32),
    frame: String,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

/// One message: topic, time in s, joints, position, velocity, effort.
type Said<'a> = (&'a str, f64, &'a [String], Vec<f64>, Vec<f64>, Vec<f64>);

fn bag(schema: &str, messages: &[Said<'_>]) -> Vec<u8> {
    bag_with(schema, messages, None)
}

/// As [`bag`], with the text of a sidecar.
fn bag_with(schema: &str, messages: &[Said<'_>], told: Option<&str>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
    for (sequence, (topic, time, names, position, velocity, effort)) in messages.iter().enumerate()
    {
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let state = JointState {
            stamp: (time.floor() as i32, ((time - time.floor()) * 1e9).round() as u32),
            frame: "base_link".into(),
            name: names.to_vec(),
            position: position.clone(),
            velocity: velocity.clone(),
            effort: effort.clone(),
        };
        let mut data = vec![0, 1, 0, 0];
        data.extend(cdr_encoding::to_vec::<_, LittleEndian>(&state).unwrap());
        let time = (time * 1e9) as u64;
        let sequence = sequence as u32;
        let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    if let Some(text) = told {
        let metadata = BTreeMap::from([(TEXT.to_owned(), text.to_owned())]);
        writer.write_metadata(&Metadata { name: METADATA.into(), metadata }).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// A bag in MCAP of a joint `elbow`, at q = t: so many states at 100 Hz from `begin`, s, on.
pub(crate) fn of_an_elbow(begin: f64, states: u32) -> Vec<u8> {
    let names = ["elbow".to_owned()];
    let said = |i: u32| {
        let t = begin + f64::from(i) * 0.01;
        ("/joint_states", t, &names[..], vec![t], vec![], vec![])
    };
    let messages: Vec<Said<'_>> = (0..states).map(said).collect();
    bag("sensor_msgs/msg/JointState", &messages)
}

fn read(bytes: &[u8]) -> Result<Recording, trueup::discovery::recording::Error> {
    Recording::read_bag("arm.mcap", bytes, None, &Map::default())
}

/// A recording written as a bag, joints in another order, is the same recording.
#[test]
fn a_bag_of_an_arm_reads_as_its_table_does() {
    let table = recording("coulomb_a");
    let joints: Vec<String> = bare_arm().joints().iter().map(|joint| joint.name.clone()).collect();
    // Alphabetical or not, the names decide.
    let order = [3_usize, 0, 6, 1, 5, 2, 4];
    let names: Vec<String> = order.iter().map(|j| joints[*j].clone()).collect();
    let group = |stem: &str, dimension| table.group(stem, 7, dimension).unwrap().unwrap();
    let (q, dq) = (group("q", Dimension::ANGLE), group("dq", Dimension::ANGULAR_SPEED));
    let (tau, cmd) = (group("tau", Dimension::TORQUE), group("q_cmd", Dimension::ANGLE));
    let mut messages: Vec<Said<'_>> = Vec::new();
    for (row, t) in table.time.iter().enumerate() {
        let at = |columns: &[&[f64]]| order.iter().map(|j| columns[*j][row]).collect::<Vec<f64>>();
        let time = 1_700_000_000.0 + t;
        messages.push(("/joint_commands", time, &names, at(&cmd), vec![], vec![]));
        messages.push(("/joint_states", time, &names, at(&q), at(&dq), at(&tau)));
    }
    let mut read = read(&bag("sensor_msgs/msg/JointState", &messages)).unwrap();
    read.number_joints(&joints);
    assert_eq!(read.n_rows(), table.n_rows());
    let far =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(far(&read.time, &table.time) < 1e-6);
    for column in &table.columns {
        let Some((_, number)) = column.name.rsplit_once('_') else { continue };
        if number.parse::<usize>().is_ok() {
            let other = read.columns.iter().find(|other| other.name == column.name);
            let other = other.unwrap_or_else(|| panic!("no {}", column.name));
            assert!(far(&other.values, &column.values) < 1e-9, "{}", column.name);
        }
    }
}

/// Commands come less often than states: the last one holds, and rows before the first are left out.
#[test]
fn a_command_holds_until_the_next() {
    let names = ["elbow".to_owned()];
    let mut messages: Vec<Said<'_>> = (0..100)
        .map(|i| {
            let t = 1.0 + f64::from(i) * 0.01;
            ("/joint_states", t, &names[..], vec![t], vec![], vec![])
        })
        .collect();
    messages.push(("/arm/desired", 1.205, &names, vec![5.0], vec![], vec![]));
    messages.push(("/arm/desired", 1.505, &names, vec![6.0], vec![], vec![]));
    let read = read(&bag("sensor_msgs/msg/JointState", &messages)).unwrap();
    assert_eq!(read.n_rows(), 79);
    let command = read.column("q_cmd_elbow", Dimension::ANGLE).unwrap();
    assert_eq!(command.iter().filter(|value| (**value - 5.0).abs() < 1e-12).count(), 30);
    assert_eq!(command.iter().filter(|value| (**value - 6.0).abs() < 1e-12).count(), 49);
    assert!(read.notes.iter().any(|note| note.contains("21 rows")), "{:?}", read.notes);
}

/// A run that was exported was not what its own recording was: who carried what had stayed behind.
#[test]
fn a_bag_brings_what_is_known_of_it_by_its_own_clock() {
    let names = ["elbow".to_owned()];
    let said = |i: u32| {
        let t = 5.0 + f64::from(i) * 0.01;
        ("/joint_states", t, &names[..], vec![t], vec![], vec![])
    };
    let messages: Vec<Said<'_>> = (0..20).map(said).collect();
    let text = r#"{"torque_sensor": "link", "segments": [{"name": "lift", "from_s": 5.04, "to_s": 5.1}],
        "contacts": [{"name": "rub", "from_s": 5.06, "to_s": 5.08}],
        "carried": [{"object": "jar", "taken_s": [5.02, 5.04], "left_s": [5.1, 5.12], "mass_kg": 0.1,
                     "contents_kg": [[5.05, 0.2]], "com_m": [0, 0, 0.1]}]}"#;
    let bytes = bag_with("sensor_msgs/msg/JointState", &messages, Some(text));
    let read = |beside: Option<(&str, &str)>| {
        Recording::read_bag("arm.mcap", &bytes, beside, &Map::default()).unwrap().sidecar
    };
    let own = read(None);
    assert_eq!(own.torque_sensor, TorqueSensor::Link);
    let jar = &own.carried[0];
    let [lift, rub] = [&own.segments[0], &own.contacts[0]];
    let times = [jar.taken_s[0], jar.left_s[1], jar.contents_kg[0][0], lift.from, rub.to];
    for (time, wanted) in times.into_iter().zip([0.02, 0.12, 0.05, 0.04, 0.08]) {
        assert!((time - wanted).abs() < 1e-6, "{times:?}");
    }
    assert_eq!(Sidecar::read("arm.json", &own.text()).unwrap(), own);
    // What somebody wrote beside it is taken at its word, what was exported there belongs to a table.
    assert!(read(Some(("arm.json", "{}"))).carried.is_empty());
    assert_eq!(read(Some(("arm.json", &Sidecar::default().text()))), own);
}

/// `ros2 bag record` splits a long bag; the parts are one recording, in whatever order they come.
#[test]
fn a_split_bag_is_one_recording() {
    let whole = read(&of_an_elbow(1.0, 20)).unwrap();
    let mut parts = Bag::default();
    parts.add("arm_1.mcap", &of_an_elbow(1.1, 10)).unwrap();
    parts.add("arm_0.mcap", &of_an_elbow(1.0, 10)).unwrap();
    let read = parts.recording("arm.mcap", None, &Map::default()).unwrap();
    assert_eq!((read.n_rows(), &read.notes), (20, &whole.notes));
    let apart = read.time.iter().zip(&whole.time).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-6, "{:?}", read.time);
    let error = Bag::default().add("arm_0.mcap", b"t[s],q_1[rad]\n").unwrap_err();
    assert!(error.place.contains("arm_0.mcap"), "{error}");
}

#[test]
fn what_is_no_bag_of_an_arm_is_told() {
    let error = read(b"t[s],q_1[rad]\n").unwrap_err();
    assert!(error.what.contains("MCAP"), "{error}");
    let names = ["elbow".to_owned()];
    let one: Vec<Said<'_>> = vec![("/scan", 1.0, &names, vec![0.0], vec![], vec![])];
    let error = read(&bag("sensor_msgs/msg/LaserScan", &one)).unwrap_err();
    assert!(error.help.contains("/scan (sensor_msgs/msg/LaserScan)"), "{}", error.help);
    let whole = bag("sensor_msgs/msg/JointState", &one);
    let error = read(&whole).unwrap_err();
    assert!(error.what.contains("only 1 joint states"), "{error}");
    // A bag cut off at any byte is an error or less data, never a panic.
    for end in 0..whole.len() {
        let _ = read(&whole[..end]);
    }
}
