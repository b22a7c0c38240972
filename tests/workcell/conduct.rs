//! Someone decides between the steps of a performance: on the lab's arm, with real motions.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use nalgebra::{Isometry3, Vector3};
use trueup::arm::Cancel;
use trueup::execution::conduct::{Ahead, Conductor, Dial, Word, unsafe_hold};
use trueup::graph::Step;
use trueup::language::Source;
use trueup::language::ast::{Expr, ExprKind, Span};
use trueup::trace::{Event, Observer, StepRecord};
use trueup::workcell::{Ending, Options, Run, WorkCell};
use trueup::world::Pose;

use super::{call, plain};
use crate::kitchen;

/// What was asked, and how often the arm had been commanded by then.
type Asked = Arc<Mutex<Vec<(String, usize)>>>;

/// Counts the arm's control ticks.
struct Ticks(Arc<AtomicUsize>);

impl Observer for Ticks {
    fn event(&mut self, event: &Event) {
        if matches!(event, Event::Tick(_)) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
    }
}

/// Notes everything it is asked, and does one thing before one step.
struct Baton {
    asked: Asked,
    ticks: Arc<AtomicUsize>,
    at: usize,
    then: Box<dyn FnMut() -> Word + Send>,
}

impl Baton {
    fn note(&self, what: String) {
        self.asked.lock().unwrap().push((what, self.ticks.load(Ordering::SeqCst)));
    }
}

impl Conductor for Baton {
    fn before(&mut self, ahead: &Ahead) -> Word {
        self.note(format!("before {} of {} {}", ahead.number, ahead.of, ahead.path));
        if ahead.number == self.at { (self.then)() } else { Word::Go }
    }

    fn after(&mut self, ahead: &Ahead, record: &StepRecord) -> Word {
        assert_eq!((ahead.number, &ahead.path), (record.number, &record.path));
        self.note(format!("after {}", record.number));
        Word::Go
    }
}

/// Keeps what is noted, and stops the run that goes past a breakpoint.
struct Notes {
    notes: Arc<Mutex<Vec<String>>>,
    cancel: Cancel,
}

impl Observer for Notes {
    fn event(&mut self, event: &Event) {
        if let Event::Note { text, .. } = event {
            self.notes.lock().unwrap().push(text.clone());
            if text.contains("`break`") {
                self.cancel.cancel();
            }
        }
    }
}

/// Presses Ctrl-C once a picture of that name is drawn.
struct Presses {
    picture: &'static str,
    cancel: Cancel,
}

impl Observer for Presses {
    fn event(&mut self, event: &Event) {
        if matches!(event, Event::Picture { name, .. } if name == self.picture) {
            self.cancel.cancel();
        }
    }
}

const TOUR: &str = "task tour() { home()  come() }  task come() { approach(jar) }\n\
                    task marked() { break look() }\n";

fn cell() -> WorkCell {
    let script = Some(Source::new("tour.task", TOUR));
    WorkCell::open(Options { script, ..plain() }).unwrap()
}

/// Performs the tour; `then` happens before step `at`.
fn tour(
    cell: &mut WorkCell,
    at: usize,
    then: impl FnMut() -> Word + Send + 'static,
) -> (Run, Vec<(String, usize)>) {
    let (asked, ticks) = (Asked::default(), Arc::<AtomicUsize>::default());
    let baton = Baton { asked: asked.clone(), ticks: ticks.clone(), at, then: Box::new(then) };
    cell.led_by(Box::new(baton));
    let run = cell.run(&call("tour()"), None, Box::new(Ticks(ticks))).unwrap();
    let asked = asked.lock().unwrap().clone();
    (run, asked)
}

#[test]
fn a_performance_asks_between_its_steps_and_stops_when_told() {
    let mut cell = cell();
    let (run, asked) = tour(&mut cell, 0, || Word::Go);
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let words: Vec<_> = asked.iter().map(|(what, _)| what.as_str()).collect();
    // Rehearsals went before, of which two were enough, and asked nobody.
    assert_eq!(run.rehearsals.len(), 2);
    assert_eq!(
        words,
        ["before 1 of 2 tour/home", "after 1", "before 2 of 2 tour/come/approach", "after 2"]
    );
    // The arm holds still from what a step came to until the next may begin.
    assert_eq!(asked[1].1, asked[2].1, "{asked:?}");
    assert!(asked[3].1 > asked[2].1, "{asked:?}");

    let (run, asked) = tour(&mut cell, 2, || Word::Stop);
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 1));
    assert_eq!(asked.last().unwrap().0, "before 2 of 2 tour/come/approach");
    let held = cell.state().unwrap();

    // Ctrl-C while somebody is asked is a wish to stop, whatever is answered.
    let cancel: Cancel = cell.cancel();
    let press = cancel.clone();
    let (run, _) = tour(&mut cell, 1, move || {
        press.cancel();
        Word::Go
    });
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 0));
    let still = cell.state().unwrap();
    assert_eq!((still.q, still.time), (held.q, held.time), "nothing has moved");
    cancel.clear();

    // Ctrl-C between two steps: nobody is asked about the second, whose prompt stayed when the run was over.
    let (asked, then) = (Asked::default(), Box::new(|| Word::Go));
    cell.led_by(Box::new(Baton { asked: asked.clone(), ticks: Arc::default(), at: 0, then }));
    let presses = Presses { picture: "02-before-twin", cancel: cancel.clone() };
    let run = cell.run(&call("tour()"), None, Box::new(presses)).unwrap();
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 1));
    assert_eq!(asked.lock().unwrap().last().unwrap().0, "after 1");
    cancel.clear();

    // Nobody leads any more; a `break` says that it does not pause.
    let notes = Arc::new(Mutex::new(Vec::new()));
    let watcher = Notes { notes: notes.clone(), cancel: cell.cancel() };
    let run = cell.run(&call("marked()"), None, Box::new(watcher)).unwrap();
    assert_eq!(run.outcome, Ending::Stopped);
    let notes = notes.lock().unwrap().join("\n");
    assert!(notes.contains("a `break` stands before step 1 look()"), "{notes}");
}

/// A step that does nothing, in a `together` or not.
fn step(together: Option<&str>) -> Step {
    let span = Span { from: 0, to: 0 };
    Step {
        path: "p".into(),
        text: "p()".into(),
        does: trueup::graph::Does::Check(Expr { kind: ExprKind::Bool(true), span }),
        script: None,
        limit: None,
        limits: Vec::new(),
        needs: Vec::new(),
        keeps: Vec::new(),
        gives: Vec::new(),
        untils: Vec::new(),
        unless: Vec::new(),
        recoveries: Vec::new(),
        together: together.map(str::to_owned),
        pause: None,
        span,
        within: String::new(),
    }
}

#[test]
fn an_arm_is_left_standing_only_where_nothing_can_run_out_and_nothing_is_half_done() {
    let scene = kitchen::scene();
    let mut state = kitchen::state([0.6, 0.1, 0.0], [0.6, -0.2, 0.0]);
    let safe = |before, next, state: &_| unsafe_hold(before, next, state, &scene);
    let (alone, a, b) = (step(None), step(Some("t/1")), step(Some("t/2")));
    assert_eq!(safe(Some(&alone), Some(&alone), &state), None);
    assert_eq!(safe(Some(&a), Some(&b), &state), None, "one `together` after another");
    assert_eq!(safe(None, Some(&a), &state), None, "before it begins");
    assert_eq!(safe(Some(&a), Some(&a), &state).unwrap(), "inside a `together`");
    let tilted = |degrees: f64| {
        let turn = Isometry3::rotation(Vector3::x() * f64::to_radians(degrees));
        Some(Pose::new(Isometry3::translation(0.6, 0.1, 0.2) * turn))
    };
    // What lies about tilted is not in the hand.
    state.objects[0].world_from_object = tilted(62.0);
    assert_eq!(safe(None, None, &state), None);
    state.held = Some("jar".into());
    assert_eq!(safe(None, None, &state).unwrap(), "the jar is tilted by 62 deg");
    state.objects[0].world_from_object = tilted(8.0);
    assert_eq!(safe(None, None, &state), None);
    state.objects[0].world_from_object = None;
    assert_eq!(safe(None, None, &state).unwrap(), "the tilt of the jar has not been measured");
}

#[test]
fn a_dial_only_ever_slows_down() {
    let dial = Dial::default();
    assert!((dial.stretch() - 1.0).abs() < 1e-12);
    dial.turn(0);
    assert_eq!(dial.percent(), 1);
    dial.turn(200);
    assert_eq!(dial.percent(), 100);
}
