//! `trueup export`, `trueup new` and `trueup marks`: files for others, as others read them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;

use byteorder::LittleEndian;
use trueup::discovery::recording::{Map, Recording};
use trueup::units::Dimension;

use crate::program::Scratch;
use crate::repl::kept;

pub(super) const RUN: &str = "runs/20260101-100000-pour";

/// A run folder with a recording of two joints and a picture after its first step.
pub(super) fn with_rows(scratch: &Scratch) {
    kept::lay_out(scratch);
    let mut rows = String::from(
        "t[s],q_cmd_1[rad],q_cmd_2[rad],q_1[rad],q_2[rad],dq_1[rad/s],dq_2[rad/s],\
         tau_1[N*m],tau_2[N*m],gripper[m],mass[kg]\n",
    );
    for k in 0..500 {
        let t = 0.01 * f64::from(k);
        writeln!(rows, "{t},{t},0.5,{t},0.25,1,0,-2,{t},0.06,0.4").unwrap();
    }
    scratch.file(&format!("{RUN}/arm.csv"), rows);
    scratch.file(&format!("{RUN}/frames/01-after-real.png"), b"a picture");
    let table = "number,t[s],step,jar[mL],cup[mL],spilt[mL]\n1,0.200,1,150.00,0.00,0.00\n2,0.400,1,149.00,1.00,0.00\n";
    scratch.file(&format!("{RUN}/film/film.csv"), table);
    for name in ["0001-real", "0002-real", "0002-twin"] {
        scratch.file(&format!("{RUN}/film/{name}.jpg"), b"a picture");
    }
}

#[test]
fn an_exported_run_is_read_back_as_it_was() {
    let scratch = Scratch::new("export-mcap");
    with_rows(&scratch);
    let said = scratch.trueup(&["export", RUN, "--mcap", "run.mcap", "--csv", "run.csv"]);
    assert_eq!(said.code, 0, "{said:?}");
    let bytes = fs::read(scratch.path("run.mcap")).unwrap();
    let mut read = Recording::read_bag("run.mcap", &bytes, None, &Map::default()).unwrap();
    read.number_joints(&["joint_1".into(), "joint_2".into()]);
    assert_eq!(read.time.len(), 500);
    let group = |stem, dimension| read.group(stem, 2, dimension).unwrap().unwrap();
    let (q, tau) = (group("q", Dimension::ANGLE), group("tau", Dimension::TORQUE));
    for (k, time) in read.time.iter().enumerate() {
        assert!((q[0][k] - time).abs() < 1e-9 && (q[1][k] - 0.25).abs() < 1e-12);
        assert!((tau[0][k] + 2.0).abs() < 1e-12 && (tau[1][k] - time).abs() < 1e-9);
    }
    let mut topics: BTreeMap<String, usize> = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert!(!schema.data.is_empty(), "{} says what it is", message.channel.topic);
        // A reader of ROS 2 refuses a file that holds any other kind.
        let kinds = (schema.encoding.as_str(), message.channel.message_encoding.as_str());
        assert_eq!(kinds, ("ros2msg", "cdr"), "{}", message.channel.topic);
        *topics.entry(message.channel.topic.clone()).or_default() += 1;
    }
    let steps = trueup::workcell::archive::load(&scratch.path(RUN)).unwrap().steps.len();
    let count = |topic: &str| topics.get(topic).copied().unwrap_or_default();
    assert_eq!((count("/joint_states"), count("/joint_commands")), (500, 500), "{topics:?}");
    assert_eq!((count("/gripper/opening"), count("/scale/mass")), (500, 500), "{topics:?}");
    assert_eq!((count("/steps"), count("/fluents")), (2 * steps, steps), "{topics:?}");
    assert_eq!(count("/camera/real/compressed"), 1, "{topics:?}");
    assert_eq!(
        (count("/film/real/compressed"), count("/film/twin/compressed")),
        (2, 1),
        "{topics:?}"
    );
    for vessel in ["jar", "cup", "spilt"] {
        assert_eq!(count(&format!("/twin/water/{vessel}_ml")), 2, "{topics:?}");
    }
}

/// `rcl_interfaces/msg/Log`: stamp, level, name, message, file, function, line.
type Log = ((i32, u32), u8, String, String, String, String, u32);
/// `diagnostic_msgs/msg/DiagnosticArray`: stamp, frame; level, name, message, hardware and values of each.
type Diagnostics = ((i32, u32), String, Vec<(u8, String, String, String, Vec<(String, String)>)>);

/// The bodies of a topic's messages, in order.
fn bodies<T: serde::de::DeserializeOwned>(bytes: &[u8], topic: &str) -> Vec<T> {
    let messages = mcap::MessageStream::new(bytes).unwrap().map(Result::unwrap);
    let read = |data: &[u8]| cdr_encoding::from_bytes::<T, LittleEndian>(&data[4..]).unwrap().0;
    messages.filter(|m| m.channel.topic == topic).map(|m| read(&m.data)).collect()
}

/// `rosbags` and what is built on it could not open a file of ours, for steps and fluents were JSON.
#[test]
fn steps_fluents_and_water_are_messages_of_ros() {
    let scratch = Scratch::new("export-ros");
    with_rows(&scratch);
    assert_eq!(scratch.trueup(&["export", RUN, "--mcap", "run.mcap"]).code, 0);
    let bytes = fs::read(scratch.path("run.mcap")).unwrap();
    let run = trueup::workcell::archive::load(&scratch.path(RUN)).unwrap();
    let steps: Vec<Log> = bodies(&bytes, "/steps");
    let first = &run.steps[0];
    assert_eq!((steps[0].1, steps[0].2.as_str()), (20, "trueup"));
    assert_eq!(steps[0].3, format!("step {}: {}", first.number, first.action));
    assert_eq!(steps[0].4, first.path);
    let fluents: Vec<Diagnostics> = bodies(&bytes, "/fluents");
    assert_eq!(fluents.len(), run.steps.len());
    for (told, row) in fluents[0].2.iter().zip(&first.fluents) {
        assert_eq!(told.1, row.name);
        let value = |key: &str| {
            told.4.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
        };
        let words = match row.measured {
            Some(true) => "true",
            Some(false) => "false",
            None => "unknown",
        };
        assert_eq!((told.2.as_str(), value("measured")), (words, Some(words)));
        if let Some(margin) = &row.margin {
            let told = value(&format!("margin[{}]", margin.unit)).unwrap();
            assert_eq!(told, margin.value.to_string());
        }
    }
    let water: Vec<(f64,)> = bodies(&bytes, "/twin/water/jar_ml");
    let water: Vec<String> = water.iter().map(|(ml,)| ml.to_string()).collect();
    assert_eq!(water, ["150", "149"]);
}

/// A camera behind a bridge is not filmed where nobody looks on: the film was the twin beside an empty half, with no word of it.
#[test]
fn a_film_without_the_camera_says_so() {
    let scratch = Scratch::new("export-film");
    with_rows(&scratch);
    let said = scratch.trueup(&["export", RUN, "--mp4", "both.mp4"]);
    assert!(said.code == 0 && !said.err.contains("only the twin"), "{said:?}");
    for name in ["0001-real", "0002-real"] {
        fs::remove_file(scratch.path(&format!("{RUN}/film/{name}.jpg"))).unwrap();
    }
    let said = scratch.trueup(&["export", RUN, "--mp4", "twin.mp4"]);
    assert!(said.code == 0 && said.err.contains("only the twin is shown"), "{said:?}");
    assert!(said.err.contains("--live"), "{said:?}");
}

#[test]
fn the_table_has_the_step_and_the_fluents_beside_the_arm() {
    let scratch = Scratch::new("export-csv");
    with_rows(&scratch);
    assert_eq!(scratch.trueup(&["export", RUN, "--csv", "run.csv"]).code, 0);
    let run = trueup::workcell::archive::load(&scratch.path(RUN)).unwrap();
    let mut table = csv::Reader::from_path(scratch.path("run.csv")).unwrap();
    let names = table.headers().unwrap().clone();
    let column = |name: &str| names.iter().position(|known| known == name).unwrap();
    let (step, holding) = (column("step"), column("holding(jar)"));
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 500);
    let first = &run.steps[0];
    for row in &rows {
        let time: f64 = row[0].parse().unwrap();
        if time < first.interval_s[1] {
            assert_eq!(&row[holding], "", "nothing is known before the first step has ended");
        }
        if (first.interval_s[0]..first.interval_s[1]).contains(&time) {
            assert_eq!(&row[step], "1");
        }
    }
}

/// What `gap` is to know of a table lies beside it under the table's name, which may be another file's already.
#[test]
fn what_somebody_else_wrote_beside_a_table_stays() {
    let scratch = Scratch::new("export-beside");
    with_rows(&scratch);
    scratch.file("mine.json", "{}");
    let said = scratch.trueup(&["export", RUN, "--csv", "mine.csv"]);
    assert!(said.code == 0 && said.err.contains("mine.json is there"), "{said:?}");
    assert_eq!(fs::read_to_string(scratch.path("mine.json")).unwrap(), "{}");
}

#[test]
fn what_cannot_be_exported_says_what_helps() {
    let scratch = Scratch::new("export-wrong");
    with_rows(&scratch);
    for (args, words) in [
        (&["export", RUN][..], "--mcap run.mcap"),
        (&["export", "7", "--csv", "run.csv"], "trueup runs"),
    ] {
        let said = scratch.trueup(args);
        assert_eq!(said.code, 2, "{said:?}");
        assert!(said.err.contains(words), "{said:?}");
    }
    // A film called `.webp` was an MP4 file by another name.
    for (args, right) in [
        (&["export", RUN, "--csv", "run.csv", "--mp4", "film.webp"][..], "film.mp4"),
        (&["export", RUN, "--csv", "run"], "run.csv"),
        (&["marks", "--pdf", "dots.svg"], "dots.pdf"),
        (&["report", RUN, "-o", "page.pdf"], "page.html"),
    ] {
        let said = scratch.trueup(&[args, &["--json"]].concat());
        assert_eq!((said.code, said.error("code").as_str()), (2, "io::ending"), "{said:?}");
        assert!(said.error("help").contains(right), "{said:?}");
    }
    for file in ["run.csv", "film.webp", "run", "dots.svg", "page.pdf"] {
        assert!(!scratch.path(file).exists(), "{file}");
    }
    scratch.file(&format!("{RUN}/arm.csv"), "t[s],q_1[rad]\n0,here\n");
    let said = scratch.trueup(&["export", RUN, "--mcap", "run.mcap"]);
    assert_eq!(said.code, 2, "{said:?}");
    assert!(said.err.contains("line 2: `here` is not a number"), "{said:?}");
    assert!(!scratch.path("run.mcap").exists());
}

#[test]
fn a_new_file_passes_its_check_and_is_never_written_over() {
    let scratch = Scratch::new("cli-new");
    for kind in ["scene", "task"] {
        let name = format!("my_{kind}");
        let said = scratch.trueup(&["new", kind, &name]);
        assert_eq!(said.code, 0, "{said:?}");
        let file = format!("{name}.task");
        let checked = scratch.trueup(&["check", &file]);
        assert_eq!((checked.code, checked.err.as_str()), (0, ""), "{checked:?}");
        let laid = scratch.trueup(&["fmt", "--check", &file]);
        assert_eq!(laid.code, 0, "{laid:?}");
        scratch.file(&file, "// mine\n");
        assert_eq!(scratch.trueup(&["new", kind, &name]).code, 2);
        assert_eq!(fs::read_to_string(scratch.path(&file)).unwrap(), "// mine\n");
    }
    let said = scratch.trueup(&["new", "task", "2nd"]);
    assert!(said.code == 2 && said.err.contains("is not a name"), "{said:?}");
    assert!(!scratch.path("2nd.task").exists());
    let said = scratch.trueup(&["new", "task", "pour"]);
    assert!(said.code == 2 && said.err.contains("my_pour"), "{said:?}");
    assert!(!scratch.path("pour.task").exists());
}

#[test]
fn the_dots_of_a_scene_are_a_page_to_print() {
    let scratch = Scratch::new("cli-marks");
    let said = scratch.trueup(&["marks", "--pdf", "dots.pdf"]);
    assert!(said.code == 0 && said.out.contains("13 dots of `kitchen`"), "{said:?}");
    assert!(fs::read(scratch.path("dots.pdf")).unwrap().starts_with(b"%PDF-"));
}
