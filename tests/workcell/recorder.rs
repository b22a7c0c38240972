//! The run folder: made whole or not at all, and readable whenever the run breaks off.

use std::fs;

use trueup::arm::Feedback;
use trueup::discovery::recording::{Map, Recording};
use trueup::report::Style;
use trueup::report::record::again;
use trueup::trace::{Event, Observer};
use trueup::units::{Dimension, parse_column};
use trueup::workcell::record::Recorder;
use trueup::workcell::{Run, State, Stdlib, archive, picture};
use trueup::world::{ObjectState, Pose, WorldState};

use crate::program::Scratch;

fn tick(time: f64) -> Event {
    let values = |x: f64| vec![x; 7];
    Event::Tick(Feedback {
        time,
        q_cmd: values(0.1),
        q: values(0.2),
        dq: values(0.3),
        tau: values(-0.4),
        opening: 0.085,
        mass: None,
        moving: Vec::new(),
    })
}

#[test]
fn runs_of_one_second_get_folders_of_their_own() {
    let scratch = Scratch::new("recorder-names");
    let root = scratch.path("deep/runs");
    let names: Vec<String> = (0..3)
        .map(|_| {
            let recorder = Recorder::create(&root, "20260101-000000", "pour(jar)/..").unwrap();
            recorder.dir().file_name().unwrap().to_string_lossy().into_owned()
        })
        .collect();
    // A task's name is no path.
    let name = "20260101-000000-pour-jar----";
    assert_eq!(names, [name.to_owned(), format!("{name}-2"), format!("{name}-3")]);
}

#[test]
fn what_cannot_be_made_is_said_with_its_path() {
    let scratch = Scratch::new("recorder-refused");
    scratch.file("file", "");
    let (path, error) = Recorder::create(&scratch.path("file/runs"), "now", "x").unwrap_err();
    assert!(path.ends_with("file/runs"), "{}", path.display());
    assert!(!error.to_string().is_empty());
    assert_eq!(scratch.everything(), ["file"]);
}

/// Events are on disk as they happen: a reader that comes before the end finds every one of them.
#[test]
fn events_are_on_disk_at_once_and_ticks_at_a_hundred_a_second() {
    let scratch = Scratch::new("recorder-events");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    let dir = recorder.dir().to_path_buf();
    for n in 0..5 {
        recorder.event(&Event::note(format!("line \"{n}\"\n")));
        let text = fs::read_to_string(dir.join("events.jsonl")).unwrap();
        assert_eq!(text.lines().count(), n + 1);
        let last: Event = serde_json::from_str(text.lines().last().unwrap()).unwrap();
        assert_eq!(last, Event::note(format!("line \"{n}\"\n")));
    }
    for k in 0..250 {
        recorder.event(&tick(0.004 * f64::from(k)));
    }
    recorder.save(&serde_json::json!({"half": false})).unwrap();
    let text = fs::read_to_string(dir.join("arm.csv")).unwrap();
    let header: Vec<_> =
        text.lines().next().unwrap().split(',').map(|name| parse_column(name).unwrap()).collect();
    assert_eq!(header.len(), 1 + 4 * 7 + 1);
    let rows = text.lines().count() - 1;
    // A row every third tick, 12 ms: the first that is 10 ms after the last.
    assert_eq!(rows, 84, "rows in a second");
    assert!(text.lines().all(|line| line.split(',').count() == header.len()));
    let kept = fs::read_to_string(dir.join("run.json")).unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(&kept).unwrap()["half"], false);
    assert!(!dir.join("run.json.part").exists());
}

/// A rail's way was recorded as an angle, and its force as a torque.
#[test]
fn what_slides_is_recorded_in_metres_and_read_again() {
    let scratch = Scratch::new("recorder-rail");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    recorder.slide(vec![true, false]);
    for k in 0..9 {
        recorder.event(&tick(0.01 * f64::from(k)));
    }
    recorder.save(&serde_json::json!({})).unwrap();
    let text = fs::read_to_string(recorder.dir().join("arm.csv")).unwrap();
    for column in ["q_cmd_1[m]", "q_1[m]", "q_2[rad]", "dq_1[m/s]", "tau_1[N]", "tau_2[N*m]"] {
        assert!(text.contains(&format!(",{column},")), "{column}: {text}");
    }
    let read = Recording::read("arm.csv", &text, None, &Map::default()).unwrap();
    for (stem, dimension) in [("q", Dimension::ANGLE), ("tau", Dimension::TORQUE)] {
        assert_eq!(read.group(stem, 7, dimension).unwrap().unwrap().len(), 7);
    }
    let mut sliding = [false; 7];
    let told = read.check_joints(&sliding).unwrap_err().what;
    assert!(told.contains("`q_1` is in m, but it must be an angle"), "{told}");
    sliding[0] = true;
    read.check_joints(&sliding).unwrap();
}

/// A picture that could not be written is told when the run is saved, not lost.
#[test]
fn what_could_not_be_written_is_told() {
    let scratch = Scratch::new("recorder-trouble");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    fs::remove_dir(recorder.dir().join("frames")).unwrap();
    let image = image::RgbImage::new(4, 4);
    recorder.event(&Event::picture("01-before-real", &image));
    assert!(recorder.save(&serde_json::json!({})).is_err());
    assert!(recorder.save(&serde_json::json!({})).is_ok(), "told once; the rest is kept");
}

/// Of a run whose last document did not fit either, `replay` said that its program had ended before it did.
#[test]
fn why_it_was_recorded_no_further_is_kept_where_a_line_fits() {
    let scratch = Scratch::new("recorder-no-room");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    let dir = recorder.dir().to_path_buf();
    recorder.save(&Run { state: State::Running, ..Run::so_far("home()", &[]) }).unwrap();
    recorder.event(&Event::note("looking"));
    assert_eq!(archive::load(&dir).unwrap().reason, None);
    fs::remove_dir(dir.join("frames")).unwrap();
    recorder.event(&Event::picture("01-before-real", &image::RgbImage::new(4, 4)));
    drop(recorder);
    let run = archive::load(&dir).unwrap();
    let reason = run.reason.clone().unwrap();
    assert!(reason.starts_with("the run could not be recorded any further: "), "{reason}");
    let told = again(("1", dir.as_path()), &run, None, Style::plain()).unwrap();
    assert!(told.contains(&reason) && told.contains("it was cut off: nothing is kept"), "{told}");
}

/// A picture that is asked for by two names is kept once and found by both.
#[test]
fn one_picture_by_two_names_is_there_twice() {
    let scratch = Scratch::new("recorder-pictures");
    let mut recorder = Recorder::create(&scratch.path("runs"), "now", "x").unwrap();
    let image = image::RgbImage::from_pixel(4, 4, image::Rgb([1, 2, 3]));
    let event = Event::picture("01-after-real", &image);
    let Event::Picture { jpeg, .. } = event.clone() else { unreachable!("a picture is asked for") };
    recorder.event(&event);
    recorder.event(&Event::Picture { name: "02-before-real".into(), jpeg });
    for name in ["01-after-real", "02-before-real"] {
        let kept = image::open(picture::file(recorder.dir(), name)).unwrap().to_rgb8();
        // A JPEG file has a grey to a level or two.
        assert!(kept.iter().zip(image.iter()).all(|(a, b)| a.abs_diff(*b) <= 2), "{kept:?}");
    }
    assert!(recorder.save(&serde_json::json!({})).is_ok());
}

/// What nobody knows is `null` in JSON and infinite when it is read again.
#[test]
fn an_object_nobody_has_seen_is_read_back_as_it_was() {
    let state = WorldState {
        time: 1.0,
        q: vec![0.5],
        opening: 0.01,
        world_from_tool: Pose::identity(),
        held: None,
        objects: vec![ObjectState {
            name: "jar".into(),
            world_from_object: None,
            std: f64::INFINITY,
            water: None,
        }],
        spilt: None,
        unknown: Vec::new(),
    };
    let text = serde_json::to_string(&state).unwrap();
    assert!(text.contains("\"std\":null"), "{text}");
    assert_eq!(serde_json::from_str::<WorldState>(&text).unwrap(), state);
}

/// A user's folder comes before what is embedded, file by file.
#[test]
fn a_folder_overrides_the_stdlib_file_by_file() {
    let scratch = Scratch::new("stdlib-folder");
    scratch.file("mine/actions/grasp.rhai", "arm.close(o, 5.0 * N);\n");
    scratch.file("mine/tasks/extra.task", "task wave() { home() }\n");
    scratch.file("mine/notes.txt", "not a part of it");
    let embedded = Stdlib::embedded();
    let mine = embedded.clone().with_folder(&scratch.path("mine")).unwrap();
    assert_eq!(mine.file("actions/grasp.rhai"), Some("arm.close(o, 5.0 * N);\n"));
    assert_eq!(mine.file("actions/lift.rhai"), embedded.file("actions/lift.rhai"));
    assert_eq!(mine.file("notes.txt"), None);
    let names = |stdlib: &Stdlib| -> Vec<String> {
        stdlib.tasks().map(|(path, _)| path.to_owned()).collect()
    };
    let mut added = names(&mine);
    added.retain(|path| !names(&embedded).contains(path));
    assert_eq!(added, ["tasks/extra.task"]);
    let (path, _) = embedded.with_folder(&scratch.path("gone")).unwrap_err();
    assert!(path.ends_with("gone"));
}
