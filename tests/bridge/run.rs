//! A run over a bridge: the embedded laboratory, met as a stranger's simulator, gives the run it gives at home.

use std::sync::mpsc;

use serde_json::{Value, json};
use trueup::arm::Cancel;
use trueup::bridge;
use trueup::lab::LabSettings;
use trueup::report::{self, Style};
use trueup::trace::Nobody;
use trueup::workcell::{Devices, Ending, Options, WorkCell};

use super::answers::wanted;
use super::reality::{Reality, serve};
use crate::program::Scratch;
use crate::workcell::{call, dry, plain};

fn read(scratch: &Scratch, out: &str) -> Value {
    let _ = scratch;
    serde_json::from_str(out).unwrap()
}

#[test]
fn a_pick_over_a_bridge_is_the_pick_of_the_laboratory_behind_it() {
    let scratch = Scratch::new("bridge-run");
    scratch.file("dry.task", &dry().text);
    let mut reality = Reality::new(Some(dry()), LabSettings::default(), 3);
    let (place, asked) = serve(move |request| Some(reality.answer(request)));
    let robot = format!("bridge://{place}");
    let run = |robot: &str| {
        let args =
            ["-c", "pick(jar)", "--scene", "dry.task", "--seed", "3", "--robot", robot, "--json"];
        let done = scratch.trueup(&args);
        assert_eq!(done.code, 0, "{}{}", done.out, done.err);
        read(&scratch, &done.out)
    };
    let (over, home) = (run(&robot), run("lab"));
    assert_eq!(over["robot"], robot.as_str());
    assert_eq!(over["outcome"], "success");
    // The same laboratory, the same seed: what was measured after each step is the same.
    let measured = |run: &Value| -> Vec<Value> {
        let steps = run["steps"].as_array().unwrap();
        steps.iter().map(|step| step["measured"]["q"].clone()).collect()
    };
    assert_eq!(measured(&over), measured(&home));
    let asked = asked.lock().unwrap();
    let steps = asked.iter().filter(|request| request.get("step").is_some()).count();
    assert!(steps > 1000, "{steps} control periods");
}

/// Only "the bridge refused `feedback`" was told: no step, no run folder.
#[test]
fn a_bridge_that_refuses_all_while_the_arm_moves_leaves_a_run_with_its_step() {
    let scratch = Scratch::new("bridge-refuses");
    scratch.file("dry.task", &dry().text);
    let mut reality = Reality::new(Some(dry()), LabSettings::default(), 3);
    let mut begin: Vec<f64> = Vec::new();
    let mut steps = 0;
    let (place, _) = serve(move |request| {
        // From a while after the arm left where it stood.
        if let Some(q) = request["step"]["q"].as_array() {
            let q: Vec<f64> = q.iter().map(|q| q.as_f64().unwrap()).collect();
            if begin.is_empty() {
                begin.clone_from(&q);
            }
            let has_left = q.iter().zip(&begin).any(|(q, from)| (q - from).abs() > 0.01);
            steps += usize::from(steps > 0 || has_left);
        }
        let asked = |word: &str| request.get(word).is_some();
        if steps > 25 && (asked("step") || asked("feedback") || asked("stop")) {
            return Some(json!({"error": "motor 3 is too warm", "help": "wait"}).to_string());
        }
        Some(reality.answer(request))
    });
    let robot = format!("bridge://{place}");
    let args = ["-c", "pick(jar)", "--scene", "dry.task", "--seed", "3", "--robot", robot.as_str()];
    let done = scratch.trueup(&[&args[..], &["--without-regression", "3", "--json"]].concat());
    assert_eq!(done.code, 4, "{}{}", done.out, done.err);
    let run = read(&scratch, &done.out);
    assert_eq!(run["reason"], "the bridge refused `step`: motor 3 is too warm");
    let step = run["steps"].as_array().unwrap().last().unwrap();
    assert_eq!(step["reason"], run["reason"]);
    let interval = &step["interval_s"];
    assert!(interval[1].as_f64().unwrap() > interval[0].as_f64().unwrap() + 0.1, "{interval}");
    assert!(scratch.path(run["run_dir"].as_str().unwrap()).join("run.json").is_file());
}

/// The arm could not be moved any more: "the path begins 1.8 deg from where joint 6 is", whatever was called.
#[test]
fn after_a_stop_that_is_answered_late_the_next_motion_begins_where_the_arm_is() {
    let (wish, (free, is_free)) = (Cancel::default(), mpsc::channel::<()>());
    let mut reality = Reality::new(Some(dry()), plain().lab, 1);
    let (cancel, mut begin, mut hangs) = (wish.clone(), Vec::<f64>::new(), true);
    let (place, _) = serve(move |request| {
        let answer = reality.answer(request);
        if let Some(q) = request["step"]["q"].as_array() {
            let q: Vec<f64> = q.iter().map(|q| q.as_f64().unwrap()).collect();
            if begin.is_empty() {
                begin.clone_from(&q);
            }
            let is_on_its_way = q.iter().zip(&begin).any(|(q, from)| (q - from).abs() > 0.1);
            if is_on_its_way && std::mem::take(&mut hangs) {
                wish.cancel();
                let _ = is_free.recv();
            }
        }
        Some(answer)
    });
    let options = Options { robot: "bridge".into(), scene: Some(dry()), ..plain() };
    let mut home = Vec::new();
    let mut cell = WorkCell::open_with(options, |robot, scene, _| {
        home = robot.pose("retract").unwrap().to_vec();
        let names: Vec<&str> = robot.joints().iter().map(|joint| joint.name.as_str()).collect();
        let wanted = wanted(&scene.robot, &names);
        let bridged = bridge::connect(&place, wanted, cancel.clone()).unwrap();
        let camera = Box::new(bridged.camera.unwrap());
        let (arm, cancel) = (Box::new(bridged.arm), cancel.clone());
        Ok(Devices { arm, camera, scales: None, limits: None, cancel })
    })
    .unwrap();
    let run = cell.run(&call("pick(jar)"), None, Box::new(Nobody)).unwrap();
    // Nothing says that the arm holds before it has answered.
    assert_eq!((run.outcome, run.stop_unanswered), (Ending::Stopped, true));
    let style = Style { json: false, quiet: true, verbose: false, colour: false, bars: false };
    let said = report::run::ending(&run, style);
    assert!(said.contains("asked to stop and has not answered yet"), "{said}");
    let reason = run.steps.last().unwrap().reason.as_deref();
    assert_eq!(reason, Some("asked to stop; the arm has not answered yet"));
    free.send(()).unwrap();
    cancel.clear();
    let run = cell.run(&call("home()"), None, Box::new(Nobody)).unwrap();
    assert_eq!((run.outcome, run.stop_unanswered), (Ending::Success, false), "{:?}", run.reason);
    let q = &run.steps.last().unwrap().measured.q;
    assert!(q.iter().zip(&home).all(|(q, home)| (q - home).abs() < 0.05), "{q:?}");
}

/// A device that fails while a recovery runs ended the call as a failure, code 1, and at the prompt lines went on moving the arm.
#[test]
fn an_arm_that_is_lost_in_a_recovery_is_not_available() {
    let scratch = Scratch::new("bridge-recovery");
    scratch.file("dry.task", &dry().text);
    let mut reality = Reality::new(Some(dry()), LabSettings::default(), 3);
    let (mut was_closed, mut is_over) = (false, false);
    let (place, _) = serve(move |request| {
        let mut request = request.clone();
        if let Some(opening) = request["step"]["grip"]["opening"].as_f64() {
            // The fingers do not close, so nothing is held; what comes to them next is the recovery's.
            is_over |= was_closed && opening > 0.01;
            was_closed |= opening <= 0.01;
            if was_closed {
                request["step"]["grip"] = Value::Null;
            }
        }
        let is_motion = request.get("step").is_some() || request.get("stop").is_some();
        if is_over && is_motion {
            return Some(json!({"error": "motor 3 is too warm", "help": "wait"}).to_string());
        }
        Some(reality.answer(&request))
    });
    let robot = format!("bridge://{place}");
    let args = ["-c", "pick(jar)", "--scene", "dry.task", "--seed", "3", "--robot", robot.as_str()];
    let done = scratch.trueup(&[&args[..], &["--without-regression", "3", "--json"]].concat());
    assert_eq!(done.code, 4, "{}{}", done.out, done.err);
    let run = read(&scratch, &done.out);
    assert_eq!((&run["outcome"], &run["device_help"]), (&json!("unavailable"), &json!("wait")));
    let reason = run["reason"].as_str().unwrap();
    assert!(reason.starts_with("grasp(jar"), "{reason}");
    assert!(reason.ends_with("the bridge refused `step`: motor 3 is too warm"), "{reason}");
}

#[test]
fn addresses_that_are_not_whole_are_said_before_anything_is_asked() {
    let scratch = Scratch::new("bridge-address");
    for robot in
        ["bridge://", "bridge://host", "bridge://host:", "bridge://:5000", "bridge://h:99999"]
    {
        let said = scratch.trueup(&["-c", "pick(jar)", "--robot", robot]);
        assert_eq!(said.code, 2, "{robot}: {}", said.err);
        assert!(said.err.contains("bridge://HOST:PORT"), "{}", said.err);
    }
    let nobody = scratch.trueup(&["-c", "pick(jar)", "--robot", "bridge://127.0.0.1:1"]);
    assert_ne!(nobody.code, 0);
    assert!(nobody.err.contains("no bridge at 127.0.0.1:1"), "{}", nobody.err);
    assert!(nobody.err.contains("start the server first"), "{}", nobody.err);
}

/// It was `away`, and so were all others that answered something that cannot be worked with.
#[test]
fn a_doctor_tells_a_bridge_that_answers_from_one_that_is_away() {
    let scratch = Scratch::new("bridge-refused");
    let hello = json!({"hello": 1, "joints": ["a", "b"], "camera": null}).to_string();
    let (place, _) = serve(move |_| Some(hello.clone()));
    let robot = format!("bridge://{place}");
    let said = scratch.trueup(&["doctor", "--robot", robot.as_str()]);
    assert_eq!(said.code, 1, "{}", said.out);
    let arm = format!("arm       wrong {robot} answers, and cannot be worked with: the bridge has");
    assert!(said.out.lines().any(|told| told.starts_with(&arm)), "{}", said.out);
    let camera = "camera    none  not asked: the bridge cannot be worked with";
    assert!(said.out.lines().any(|told| told == camera), "{}", said.out);
}

/// The arm was told to be away for it.
#[test]
fn a_doctor_tells_a_photograph_that_is_none_as_the_camera_s() {
    let scratch = Scratch::new("bridge-no-png");
    let mut reality = Reality::new(None, LabSettings::default(), 3);
    let (place, _) = serve(move |request| {
        let is_photo = request.get("photo").is_some();
        Some(if is_photo { json!({"image": "?"}).to_string() } else { reality.answer(request) })
    });
    let robot = format!("bridge://{place}");
    let said = scratch.trueup(&["doctor", "--robot", robot.as_str()]);
    assert_eq!(said.code, 1, "{}", said.out);
    let begins = |line: &str| said.out.lines().any(|told| told.starts_with(line));
    assert!(begins(&format!("arm       ok    {robot}: 7 joints; q")), "{}", said.out);
    assert!(
        begins("camera    wrong behind the bridge: the answer to `photo` cannot be read"),
        "{}",
        said.out
    );
    assert!(begins("scales    none  the bridge's, not asked"), "{}", said.out);
}

/// Of scales that the bridge might have had it said that `--scales-at` names some.
#[test]
fn a_doctor_says_that_the_bridge_is_away() {
    let scratch = Scratch::new("bridge-away");
    let said = scratch.trueup(&["doctor", "--robot", "bridge://127.0.0.1:1"]);
    assert_eq!(said.code, 4, "{}", said.out);
    for what in ["camera", "scales"] {
        let line = format!("{what:<9} none  not asked: the bridge is away");
        assert!(said.out.lines().any(|told| told == line), "{line}: {}", said.out);
    }
}
