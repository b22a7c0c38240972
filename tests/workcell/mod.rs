//! The work cell end to end: stopped runs, missed grasps, and the folder that a run leaves.

mod again;
mod archive;
mod drawer;
mod during;
mod film;
mod fork;
mod given;
mod lines;
mod links;
mod passing;
mod places;
mod poured;
mod recovery;
mod commanded;
mod conduct;
mod corrected;
mod recorder;
mod matching;
mod shapes;
mod spots;
mod timing;
mod tools;
mod trials;
mod turned;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use trueup::arm::Cancel;
use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::ast::{Call, Step};
use trueup::language::{Source, parse_line};
use trueup::motion::free::Means;
use trueup::trace::{Event, Nobody, Observer, Outcome};
use trueup::workcell::record::Recorder;
use trueup::workcell::{CANDIDATES, Ending, Options, Run, State, Stdlib, WorkCell};

use crate::program::Scratch;

fn no_time() -> f64 {
    0.0
}

fn options(lab: LabSettings, seed: u64) -> Options {
    Options {
        robot: "lab".into(),
        scene: None,
        script: None,
        lab,
        stdlib: Stdlib::embedded(),
        seed,
        switches: Switches::default(),
        candidates: CANDIDATES,
        means: Means::default(),
        is_real_time: false,
        clock: no_time,
    }
}

/// A laboratory that is as assumed, so that regression 3 can be spared, with places that do.
pub(crate) fn plain() -> Options {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    Options { switches: Switches { offset: false, ..Switches::default() }, ..options(lab, 1) }
}

/// The kitchen with nothing in its vessels: what is not about water is simulated far sooner without.
pub(crate) fn dry() -> Source {
    let stdlib = Stdlib::embedded();
    let kitchen = stdlib.tasks().find(|(path, _)| path.ends_with("kitchen.task"));
    let text = kitchen.expect("the stdlib has a kitchen").1;
    let dry = text.replace(" filled 150 mL", "");
    assert_ne!(dry, text, "the kitchen says what its jar is filled with");
    let text = dry.replace("scene kitchen", "scene dry_kitchen");
    Source::new("dry.task", text)
}

pub(crate) fn call(text: &str) -> Call {
    match parse_line(text).0 {
        Some(Step::Act(act)) => act.call,
        other => panic!("{text} is no call: {other:?}"),
    }
}

/// Presses Ctrl-C when something has happened often enough.
struct Press {
    cancel: Cancel,
    on: fn(&Event) -> bool,
    left: usize,
}

impl Observer for Press {
    fn event(&mut self, event: &Event) {
        if (self.on)(event) {
            self.left = self.left.saturating_sub(1);
            if self.left == 0 {
                self.cancel.cancel();
            }
        }
    }
}

/// Runs a call into a folder of its own.
fn recorded(
    cell: &mut WorkCell,
    scratch: &Scratch,
    text: &str,
    watcher: Box<dyn Observer + Send>,
) -> (Run, PathBuf) {
    let recorder = Recorder::create(&scratch.path("runs"), "now", "test").unwrap();
    let folder = recorder.dir().to_path_buf();
    (cell.run(&call(text), Some(recorder), watcher).unwrap(), folder)
}

fn kept(folder: &std::path::Path) -> Run {
    serde_json::from_str(&fs::read_to_string(folder.join("run.json")).unwrap()).unwrap()
}

/// Ctrl-C while the arm moves: the run is stopped, recorded whole, and the cell goes on from there.
#[test]
fn a_stop_in_a_step_is_recorded_and_the_cell_goes_on() {
    let scratch = Scratch::new("workcell-stop");
    let mut cell = WorkCell::open(plain()).unwrap();
    let press =
        Press { cancel: cell.cancel(), on: |event| matches!(event, Event::Tick(_)), left: 150 };
    let (run, folder) = recorded(&mut cell, &scratch, "pick(jar)", Box::new(press));
    assert_eq!((run.outcome, run.reached), (Ending::Stopped, false));
    let last = run.steps.last().unwrap();
    assert!(last.action.starts_with("approach(jar"), "{}", last.action);
    assert_eq!(last.outcome, Outcome::Stopped);
    assert!(last.interval_s[1] > last.interval_s[0], "it had begun: {:?}", last.interval_s);
    assert!(!last.fluents.is_empty() && last.fluents.iter().all(|row| row.expected.is_none()));
    let whole = kept(&folder);
    assert_eq!((whole.outcome, whole.steps.len()), (run.outcome, run.steps.len()));
    let made = whole.setting.unwrap();
    assert_eq!((made.name.as_str(), made.robot.as_str()), ("kitchen", "gen3_2f85"));
    assert!(!folder.join("run.json.part").exists());
    // The arm is at rest, and was not sent anywhere afterwards.
    let text = fs::read_to_string(folder.join("arm.csv")).unwrap();
    let numbers =
        |line: &str| -> Vec<f64> { line.split(',').map(|x| x.parse().unwrap()).collect() };
    let end = numbers(text.lines().last().unwrap());
    assert!(end[15..22].iter().all(|dq| dq.abs() < 0.03), "{:?}", &end[15..22]);
    assert!(run.water.unwrap().spilt_ml < 0.5);

    // The wish is still there: nothing moves before it is forgotten.
    let (run, folder) = recorded(&mut cell, &scratch, "home()", Box::new(Nobody));
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 0));
    assert_eq!(kept(&folder), run);
    assert_eq!(fs::read_to_string(folder.join("arm.csv")).unwrap(), "");
    cell.cancel().clear();
    let (run, _) = recorded(&mut cell, &scratch, "home()", Box::new(Nobody));
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
}

/// Has a mistake in it when it has seen so many ticks.
struct Mistaken(usize);

impl Observer for Mistaken {
    fn event(&mut self, event: &Event) {
        if matches!(event, Event::Tick(_)) {
            self.0 = self.0.checked_sub(1).expect("no mistake");
        }
    }
}

/// A mistake of the program's own while the arm moves: the arm is brought to rest, the record is whole, and
/// the next call begins where the arm is.
#[test]
fn a_panic_in_a_run_stops_the_arm_and_keeps_the_record() {
    let scratch = Scratch::new("workcell-panic");
    let mut cell = WorkCell::open(plain()).unwrap();
    let recorder = Recorder::create(&scratch.path("runs"), "now", "test").unwrap();
    let folder = recorder.dir().to_path_buf();
    let ran = catch_unwind(AssertUnwindSafe(|| {
        cell.run(&call("home()"), Some(recorder), Box::new(Mistaken(150)))
    }));
    assert!(ran.is_err(), "whoever called is told");
    let run = kept(&folder);
    assert_eq!((run.state, run.outcome), (State::Ended, Ending::Stopped));
    assert!(run.reason.unwrap().contains("the arm was brought to rest"));
    let (run, _) = recorded(&mut cell, &scratch, "home()", Box::new(Nobody));
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
}

/// Ctrl-C during the touch-off, before there is any step.
#[test]
fn a_stop_while_calibrating_leaves_a_whole_run_without_steps() {
    let scratch = Scratch::new("workcell-stop-early");
    let mut cell = WorkCell::open(options(LabSettings::default(), 1)).unwrap();
    let press =
        Press { cancel: cell.cancel(), on: |event| matches!(event, Event::Tick(_)), left: 40 };
    let (run, folder) = recorded(&mut cell, &scratch, "pick(jar)", Box::new(press));
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 0));
    assert_eq!(kept(&folder), run);
}

/// Ctrl-C while a photograph is looked at, which took as long as there were things in it, minutes on a machine that is busy.
#[test]
fn a_stop_while_perceiving_is_heard_before_everything_is_found() {
    let scratch = Scratch::new("workcell-stop-look");
    let mut cell = WorkCell::open(plain()).unwrap();
    let is_perceiving =
        |event: &Event| matches!(event, Event::Phase { name, .. } if name == "perceive");
    let press = Press { cancel: cell.cancel(), on: is_perceiving, left: 1 };
    let (run, folder) = recorded(&mut cell, &scratch, "pick(jar)", Box::new(press));
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 0));
    assert_eq!(run.start, None, "nothing was found");
    assert_eq!(kept(&folder), run);
    // "Nothing in the picture looks like it" was said of a jar that nobody had looked for.
    cell.cancel().clear();
    assert_eq!(cell.hindrance(&call("pour(jar, cup)")), None);
}

/// Whether nothing was spilt is not known during a run; the kitchen scales know at its end.
#[test]
fn the_scales_have_the_last_word_on_the_water() {
    let script = "task glance() { gives dry(most: 5 mL)  look() }\n";
    let options = Options { script: Some(Source::new("glance.task", script)), ..plain() };
    let mut cell = WorkCell::open(options).unwrap();
    let run = cell.run(&call("glance()"), None, Box::new(Nobody)).unwrap();
    assert_eq!((run.outcome, run.reached), (Ending::Success, true), "{:?}", run.reason);
    let dry =
        run.steps.last().unwrap().fluents.iter().find(|row| row.name.starts_with("dry")).unwrap();
    assert_eq!((dry.twin, dry.measured), (Some(true), None), "in the run nobody measured it");
    assert_eq!(run.run_dir, None);
}

#[test]
fn a_need_that_is_false_is_said_before_anything_moves() {
    let script = "task hurry() { needs height(jar) >= 10 cm  home() }\n";
    let options = Options { script: Some(Source::new("hurry.task", script)), ..plain() };
    let mut cell = WorkCell::open(options).unwrap();
    let before = cell.state().unwrap();
    let error = cell.run(&call("hurry()"), None, Box::new(Nobody)).unwrap_err().to_string();
    assert!(error.contains("height(jar) >= 10 cm") && error.contains("10 cm"), "{error}");
    let after = cell.state().unwrap();
    assert_eq!((after.q, after.time), (before.q, before.time));
}
