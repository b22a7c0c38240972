//! Where the wall time of a run goes: nearly all of it belongs to a phase.
//!
//! "291.7 s: 25.0 perceiving, 0.0 planning, 2.2 simulating, 7.5 on the arm" was said on a busy machine: what was missing was
//! the drawing of the run's pictures, for which the end of a run waits.

use std::sync::atomic::{AtomicU64, Ordering};

use trueup::trace::Nobody;
use trueup::workcell::{Ending, Options, WorkCell};

use super::{call, dry, plain};

static READINGS: AtomicU64 = AtomicU64::new(0);

/// A clock that each reading moves by a second.
fn clock() -> f64 {
    READINGS.fetch_add(1, Ordering::SeqCst) as f64
}

#[test]
fn no_time_of_a_run_is_in_no_phase() {
    let mut cell = WorkCell::open(Options { clock, scene: Some(dry()), ..plain() }).unwrap();
    let run = cell.run(&call("home()"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success, "{:?}", run.reason);
    let time = run.timing_s;
    assert!(time.pictures > 0.0 && time.plan > 0.0, "{time:?}");
    let phases = time.perceive + time.plan + time.simulate + time.execute + time.pictures;
    // A reading before the first phase, and one behind the last.
    let aside = time.total - phases - time.waiting;
    assert!((-1e-9..=2.0 + 1e-9).contains(&aside), "{time:?}");
}
