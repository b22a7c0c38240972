//! A person holds the arm before a line of a script: nothing moves, and the time is nobody's but theirs.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use trueup::execution::conduct::{Ahead, Conductor, Word};
use trueup::trace::Line;
use trueup::trace::{Nobody, Outcome};
use trueup::workcell::{Ending, Options, WorkCell};

use super::{call, dry, plain};

static SECONDS: AtomicU64 = AtomicU64::new(0);

/// A clock that only a person's thinking moves.
fn clock() -> f64 {
    SECONDS.load(Ordering::SeqCst) as f64
}

/// Thinks for a minute before each line, and stops before one.
struct Thinker {
    lines: Arc<Mutex<Vec<String>>>,
    stop_at: usize,
}

impl Conductor for Thinker {
    fn before(&mut self, _: &Ahead) -> Word {
        SECONDS.fetch_add(60, Ordering::SeqCst);
        Word::Go
    }

    fn within(&mut self, ahead: &Ahead, line: &Line, why: Option<&str>) -> Word {
        assert_eq!(why, None, "nothing is held, so the arm can be left anywhere");
        SECONDS.fetch_add(60, Ordering::SeqCst);
        let mut lines = self.lines.lock().unwrap();
        lines.push(format!("{} {} {}", ahead.number, line.place(), line.does));
        if lines.len() == self.stop_at { Word::Stop } else { Word::Go }
    }
}

#[test]
fn lines_are_asked_about_recorded_and_thinking_is_no_arm_time() {
    let mut cell = WorkCell::open(Options { clock, scene: Some(dry()), ..plain() }).unwrap();
    let lines = Arc::new(Mutex::new(Vec::new()));
    cell.led_by(Box::new(Thinker { lines: lines.clone(), stop_at: 0 }));
    let run = cell.run(&call("home()"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let asked = lines.lock().unwrap().clone();
    assert_eq!(asked, ["1 home.rhai:2 move round everything in the way at 100 % of full speed"]);
    let kept = &run.steps[0].lines;
    assert_eq!(kept.len(), 1);
    assert_eq!(kept[0].text, "arm.move_to(twin.pose_named(\"retract\"));");
    assert_eq!((run.timing_s.waiting, run.timing_s.execute), (120.0, 0.0), "{:?}", run.timing_s);
    assert!(run.start.is_some() && !run.steps[0].planned_q.is_empty());

    // Stopped before the line: the step has begun, and the arm has not moved.
    let before = cell.state().unwrap();
    cell.led_by(Box::new(Thinker { lines: lines.clone(), stop_at: 2 }));
    let run = cell.run(&call("approach(jar)"), None, Box::new(Nobody)).unwrap();
    assert_eq!((run.outcome, run.steps.len()), (Ending::Stopped, 1));
    assert_eq!((run.steps[0].outcome, run.steps[0].lines.len()), (Outcome::Stopped, 1));
    let after = cell.state().unwrap();
    assert_eq!((after.q, after.time), (before.q, before.time));

    // Nobody leads the next run, and nobody is asked.
    let run = cell.run(&call("home()"), None, Box::new(Nobody)).unwrap();
    assert_eq!((run.outcome, lines.lock().unwrap().len()), (Ending::Success, 2));
    assert!(run.timing_s.waiting < 1e-9);
}
