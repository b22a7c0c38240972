//! `trueup export RUN --rrd FILE`, read back by a small reader of the format: frames, protobuf, tables of Arrow. That
//! Rerun's own reader says the same is seen with `benches/peers/read_rrd.py`.

use std::collections::BTreeMap;
use std::fs;

use arrow_array::cast::AsArray;
use arrow_array::types::{DurationNanosecondType, Float32Type, Float64Type, UInt8Type, UInt64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_ipc::reader::StreamReader;
use prost::Message;
use trueup::rrd::messages::{ArrowMsg, RrdFooter, SetStoreInfo};
use trueup::rrd::{CHUNK, END, MAGIC, STORE, TIMELINE, VERSION};

use super::export::{RUN, with_rows};
use crate::program::Scratch;

/// A chunk, and at which byte its message's body stands.
struct Chunk {
    entity: String,
    id: Vec<u8>,
    rows: RecordBatch,
    at: (u64, u64),
}

impl Chunk {
    /// Returns the items of a component in one row.
    fn items(&self, component: &str, row: usize) -> ArrayRef {
        self.rows.column_by_name(component).expect(component).as_list::<i32>().value(row)
    }

    /// Returns the time of a row, s.
    fn time(&self, row: usize) -> f64 {
        let times = self.rows.column_by_name(TIMELINE).unwrap();
        times.as_primitive::<DurationNanosecondType>().value(row) as f64 / 1e9
    }

    fn is_static(&self) -> bool {
        self.rows.column_by_name(TIMELINE).is_none()
    }
}

struct File {
    store: SetStoreInfo,
    chunks: Vec<Chunk>,
    footer: RrdFooter,
}

impl File {
    fn read(bytes: &[u8]) -> Self {
        assert_eq!(bytes[..4], MAGIC);
        assert_eq!(bytes[4..8], VERSION);
        assert_eq!(bytes[8..12], [0, 2, 0, 0]);
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let (mut store, mut chunks, mut at) = (None, Vec::new(), 12);
        loop {
            let (kind, length) = (word(at), usize::try_from(word(at + 8)).unwrap());
            let body = &bytes[at + 16..at + 16 + length];
            let place = (at as u64 + 16, length as u64);
            at += 16 + length;
            match kind {
                STORE => store = Some(SetStoreInfo::decode(body).unwrap()),
                CHUNK => chunks.push(chunk(body, place)),
                END => {
                    let last = &bytes[at..];
                    assert_eq!((last.len(), &last[20..28]), (32, &b"RRF2FOOT"[..]));
                    assert_eq!((word(at), word(at + 8)), place);
                    let footer = RrdFooter::decode(body).unwrap();
                    return Self { store: store.unwrap(), chunks, footer };
                }
                other => panic!("a message of kind {other}"),
            }
        }
    }

    fn of<'a>(&'a self, entity: &str) -> impl Iterator<Item = &'a Chunk> + use<'a> {
        let entity = entity.to_owned();
        self.chunks.iter().filter(move |chunk| chunk.entity == entity)
    }

    /// Returns the only chunk of an entity with times, or without.
    fn one<'a>(&'a self, entity: &str, is_static: bool) -> &'a Chunk {
        let mut found = self.of(entity).filter(|chunk| chunk.is_static() == is_static);
        let one = found.next().unwrap_or_else(|| panic!("{entity}"));
        assert!(found.next().is_none(), "{entity} is there twice");
        one
    }
}

fn table(stream: &[u8]) -> RecordBatch {
    let mut batches = StreamReader::try_new(stream, None).unwrap();
    let batch = batches.next().unwrap().unwrap();
    assert!(batches.next().is_none());
    batch
}

fn chunk(body: &[u8], at: (u64, u64)) -> Chunk {
    let message = ArrowMsg::decode(body).unwrap();
    assert_eq!((message.compression, message.encoding), (1, 1));
    assert_eq!(message.uncompressed_size, message.payload.len() as u64);
    let rows = table(&message.payload);
    let metadata = rows.schema_ref().metadata().clone();
    let id = message.chunk_id.unwrap();
    let name = format!("chunk_{:016X}{:016x}", id.time_ns(), id.inc());
    assert_eq!(metadata["rerun:id"], name);
    let id = [id.time_ns().to_be_bytes(), id.inc().to_be_bytes()].concat();
    let chunk = Chunk { entity: metadata["rerun:entity_path"].clone(), id, rows, at };
    assert_eq!(message.is_static, Some(chunk.is_static()));
    chunk
}

fn exported(name: &str) -> (Scratch, Vec<u8>) {
    let scratch = Scratch::new(name);
    with_rows(&scratch);
    let said = scratch.trueup(&["export", RUN, "--rrd", "run.rrd"]);
    assert_eq!(said.code, 0, "{said:?}");
    // The run was written by hand: its tool is nowhere near where its joints would have it.
    assert!(said.err.contains("links are left out"), "{said:?}");
    let bytes = fs::read(scratch.path("run.rrd")).unwrap();
    (scratch, bytes)
}

#[test]
fn a_recording_for_rerun_holds_what_the_run_holds() {
    let (scratch, bytes) = exported("export-rrd");
    let file = File::read(&bytes);
    let run = trueup::workcell::archive::load(&scratch.path(RUN)).unwrap();
    let count = |entity: &str| {
        let timed = file.of(entity).filter(|chunk| !chunk.is_static());
        timed.map(|chunk| chunk.rows.num_rows()).sum::<usize>()
    };
    let steps = run.steps.len();
    for (entity, rows) in [
        ("/joints/position_rad", 500),
        ("/joints/velocity_rad_per_s", 500),
        ("/joints/torque_Nm", 500),
        ("/joints/command_rad", 500),
        ("/gripper/opening_m", 500),
        ("/scale/mass_kg", 500),
        ("/scene/measured/tool", steps),
        ("/scene/measured/jar", steps),
        ("/scene/twin/cup", steps),
        ("/camera/real", 1),
        ("/film/real", 2),
        ("/film/twin", 1),
        ("/water/twin_mL", 2),
        ("/fluents/expected", steps),
        ("/fluents/twin", steps),
        ("/fluents/measured", steps),
        ("/margins/measured/m", steps),
        ("/agreement", steps),
        ("/steps", 2 * steps),
    ] {
        assert_eq!(count(entity), rows, "{entity}");
    }
    let name = file.one("/__properties", true).items("RecordingInfo:name", 0);
    assert_eq!(name.as_string::<i32>().value(0), run.task);
    let info = file.store.info.as_ref().unwrap();
    let store = info.store_id.as_ref().unwrap();
    assert_eq!(store.application_id.as_ref().unwrap().id, "trueup");
    let about = file.one("/about", true).items("TextDocument:text", 0);
    assert!(about.as_string::<i32>().value(0).contains("| `/joints/position_rad`"));
}

#[test]
fn its_values_are_those_of_the_run() {
    let (scratch, bytes) = exported("export-rrd-values");
    let file = File::read(&bytes);
    let run = trueup::workcell::archive::load(&scratch.path(RUN)).unwrap();
    let joints = file.one("/joints/position_rad", false);
    for row in [0, 123, 499] {
        let time = joints.time(row);
        assert!((time - 0.01 * row as f64).abs() < 1e-9);
        let q = joints.items("Scalars:scalars", row);
        let q = q.as_primitive::<Float64Type>().values();
        assert!((q[0] - time).abs() < 1e-9 && (q[1] - 0.25).abs() < 1e-12, "{q:?}");
    }
    let names = file.one("/joints/torque_Nm", true).items("SeriesLines:names", 0);
    assert_eq!(
        names.as_string::<i32>().iter().flatten().collect::<Vec<_>>(),
        ["joint_1", "joint_2"]
    );
    let (step, jar) = (&run.steps[0], file.one("/scene/measured/jar", false));
    assert!((jar.time(0) - step.measured.time).abs() < 1e-9);
    let pose = step.measured.object("jar").unwrap().world_from_object.unwrap();
    let at = jar.items("Transform3D:translation", 0);
    let at = at.as_fixed_size_list().value(0);
    let wanted = pose.origin().map(|x| x as f32);
    assert_eq!(at.as_primitive::<Float32Type>().values()[..], wanted.as_slice()[..]);
    let turned = jar.items("Transform3D:quaternion", 0);
    let turned = turned.as_fixed_size_list().value(0);
    let wanted = pose.rotation().coords.map(|x| x as f32);
    assert_eq!(turned.as_primitive::<Float32Type>().values()[..], wanted.as_slice()[..]);
    let picture = file.one("/camera/real", false).items("EncodedImage:blob", 0);
    let blob = picture.as_list::<i32>().value(0);
    assert_eq!(blob.as_primitive::<UInt8Type>().values()[..], b"a picture"[..]);
    let water = file.one("/water/twin_mL", false).items("Scalars:scalars", 1);
    assert_eq!(water.as_primitive::<Float64Type>().values()[..], [149.0, 1.0, 0.0]);
    fluents_are_as_in(&file, &run);
    let log = file.one("/steps", false);
    let text = log.items("TextLog:text", 0);
    let wanted = format!("step 1: {}", step.action);
    assert_eq!(text.as_string::<i32>().value(0), wanted);
    assert!((log.time(0) - step.interval_s[0]).abs() < 1e-9);
}

/// A rail's way was drawn among angles, as rad.
#[test]
fn a_joint_that_slides_is_in_m() {
    let scratch = Scratch::new("export-rrd-rail");
    with_rows(&scratch);
    let rows = "t[s],q_cmd_1[rad],q_cmd_2[m],q_1[rad],q_2[m],dq_1[rad/s],dq_2[m/s],tau_1[N*m],tau_2[N]\n\
                0,1,0.2,1,0.25,0,0.1,2,30\n0.01,1,0.2,1,0.3,0,0.1,2,30\n";
    scratch.file(&format!("{RUN}/arm.csv"), rows);
    let said = scratch.trueup(&["export", RUN, "--rrd", "run.rrd"]);
    assert_eq!(said.code, 0, "{said:?}");
    let file = File::read(&fs::read(scratch.path("run.rrd")).unwrap());
    for (entity, joint, value) in [
        ("/joints/position_rad", "joint_1", 1.0),
        ("/joints/position_m", "joint_2", 0.3),
        ("/joints/velocity_m_per_s", "joint_2", 0.1),
        ("/joints/torque_Nm", "joint_1", 2.0),
        ("/joints/force_N", "joint_2", 30.0),
        ("/joints/command_m", "joint_2", 0.2),
    ] {
        let names = file.one(entity, true).items("SeriesLines:names", 0);
        assert_eq!(names.as_string::<i32>().iter().flatten().collect::<Vec<_>>(), [joint]);
        let shown = file.one(entity, false).items("Scalars:scalars", 1);
        let shown = shown.as_primitive::<Float64Type>().values();
        assert!(shown.len() == 1 && (shown[0] - value).abs() < 1e-12, "{entity}: {shown:?}");
    }
}

/// 1 and 0 as measured, NaN where nobody knows.
fn fluents_are_as_in(file: &File, run: &trueup::workcell::Run) {
    let names = file.one("/fluents/measured", true).items("SeriesLines:names", 0);
    let names: Vec<&str> = names.as_string::<i32>().iter().flatten().collect();
    let measured = file.one("/fluents/measured", false);
    let mut n_unknown = 0;
    for (n, step) in run.steps.iter().enumerate() {
        let row = measured.items("Scalars:scalars", n);
        let row = row.as_primitive::<Float64Type>().values();
        for (name, value) in names.iter().zip(row) {
            let fluent = step.fluents.iter().find(|fluent| fluent.name == *name);
            if let Some(truth) = fluent.and_then(|fluent| fluent.measured) {
                assert!((value - f64::from(u8::from(truth))).abs() < 1e-12);
            } else {
                assert!(value.is_nan(), "{name} after step {}", step.number);
                n_unknown += 1;
            }
        }
    }
    assert!(n_unknown > 0, "the first step judges no `above`");
}

/// A reader that jumps to a stretch of time must find it where the list at the end says.
#[test]
fn the_list_at_the_end_says_where_every_chunk_is() {
    let (_scratch, bytes) = exported("export-rrd-footer");
    let file = File::read(&bytes);
    let [manifest] = &file.footer.manifests[..] else { panic!("one recording") };
    let list = table(manifest.data.as_ref().unwrap().payload());
    let count = |name: &str, row: usize| {
        list.column_by_name(name).unwrap().as_primitive::<UInt64Type>().value(row)
    };
    assert_eq!(list.num_rows(), file.chunks.len());
    let mut ids = BTreeMap::new();
    for (n, chunk) in file.chunks.iter().enumerate() {
        let entity = list.column_by_name("chunk_entity_path").unwrap();
        assert_eq!(entity.as_string::<i32>().value(n), chunk.entity);
        let id = list.column_by_name("chunk_id").unwrap().as_fixed_size_binary().value(n);
        assert_eq!(id, chunk.id);
        assert_eq!((count("chunk_byte_offset", n), count("chunk_byte_size", n)), chunk.at);
        assert_eq!(count("chunk_num_rows", n), chunk.rows.num_rows() as u64);
        let start = list.column_by_name("arm_time:start").unwrap();
        assert_eq!(start.is_null(n), chunk.is_static());
        if !chunk.is_static() {
            let start = start.as_primitive::<DurationNanosecondType>().value(n) as f64 / 1e9;
            assert!((start - chunk.time(0)).abs() < 1e-9, "{}", chunk.entity);
        }
        let rows = chunk.rows.column_by_name("rerun.controls.RowId").unwrap();
        let rows = rows.as_fixed_size_binary();
        let names = (0..rows.len()).map(|row| rows.value(row).to_vec());
        for name in names.chain([chunk.id.clone()]) {
            assert!(ids.insert(name, n).is_none(), "a name is there twice");
        }
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let (scratch, bytes) = exported("export-rrd-twice");
    assert_eq!(scratch.trueup(&["export", RUN, "--rrd", "again.rrd"]).code, 0);
    assert!(fs::read(scratch.path("again.rrd")).unwrap() == bytes);
}
