//! How long lines move an arm that is not simulated; and the twin that takes its place, as things stand.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use trueup::language::ast::Step;
use trueup::language::text;
use trueup::report::Failure;
use trueup::trace::Nobody;
use trueup::workcell::{Ending, Options, Run, WorkCell};

use super::step::{options, talk};
use crate::program::Scratch;

static SECONDS: AtomicU64 = AtomicU64::new(0);

fn clock() -> f64 {
    SECONDS.load(Ordering::SeqCst) as f64
}

/// A cell whose arm counts as a real one: its name is no simulation's.
fn bench() -> WorkCell {
    WorkCell::open(Options { robot: "bench".into(), clock, ..options() }).unwrap()
}

/// Types lines; returns which robot was asked for what. Each call takes `minutes` of the clock after it, and
/// `home()` meets a device that fails.
fn asked(lines: &str, minutes: u64) -> Vec<String> {
    let done = Mutex::new(Vec::new());
    let work = |cell: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        done.lock().unwrap().push(format!("{} {}", cell.robot_name(), text::step(step)));
        if text::step(step) == "home()" {
            return Err(Failure::unavailable("device", "the arm reports a fault"));
        }
        Err(Failure::no("test", "done"))
    };
    // Time goes on while a line is waited for, not while one is carried out.
    let lines = lines.split_inclusive('\n').map(str::to_owned).collect();
    talk(
        bench(),
        &Scratch::new("repl-lease"),
        &work,
        &mut Slow { lines, minutes, line: Vec::new() },
    );
    done.into_inner().unwrap()
}

/// Somebody who takes so long for each line.
struct Slow {
    lines: Vec<String>,
    minutes: u64,
    line: Vec<u8>,
}

impl std::io::Read for Slow {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        unreachable!("lines are taken from the buffer")
    }
}

impl std::io::BufRead for Slow {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.line.is_empty() && !self.lines.is_empty() {
            self.line = self.lines.remove(0).into_bytes();
            SECONDS.fetch_add(60 * self.minutes, Ordering::SeqCst);
        }
        Ok(&self.line)
    }

    fn consume(&mut self, amount: usize) {
        self.line.drain(..amount);
    }
}

/// One after the other: they share a clock.
#[test]
fn leave_to_move_an_arm_ends_with_idle_time_and_with_a_fault() {
    let lines = ":confirm none\nlook()\nlook()\n";
    assert_eq!(asked(lines, 9), ["bench look()", "bench look()"]);
    // The first line after a quarter of an hour is done by nobody; the rest are the twin's.
    assert_eq!(asked(lines, 15), ["twin look()", "twin look()"]);
    assert_eq!(asked("look()\nlook()\n", 15), ["twin look()"]);
    let lines = ":confirm none\nlook()\nhome()\nlook()\n:real\nlook()\n:real\nyes\nlook()\n";
    assert_eq!(
        asked(lines, 1),
        ["bench look()", "bench home()", "twin look()", "twin look()", "bench look()"],
        "only a typed yes gives the leave again"
    );
}

#[test]
fn the_twin_begins_where_things_are_known_to_be() {
    let mut cell = WorkCell::open(options()).unwrap();
    let (mut nothing, unlike) = cell.twin().unwrap();
    assert_eq!(
        (nothing.known_objects(), unlike),
        (Vec::new(), Vec::new()),
        "before the first look"
    );

    let call = |text: &str| match trueup::language::parse_line(text).0 {
        Some(Step::Act(act)) => act.call,
        other => panic!("{text}: {other:?}"),
    };
    let run = cell.run(&call("home()"), None, Box::new(Nobody)).unwrap();
    assert_eq!(run.outcome, Ending::Success);
    let here = cell.state().unwrap();
    let (mut twin, unlike) = cell.twin().unwrap();
    assert_eq!((twin.known_objects().len(), unlike.len()), (2, 0));
    let there = twin.state().unwrap();
    for (a, b) in here.q.iter().zip(&there.q) {
        assert!((a - b).abs() < 2e-3, "the arm stands where it stood: {:?} {:?}", here.q, there.q);
    }
    // What it is believed to be is what its own camera sees.
    twin.perceive().unwrap();
    let seen = twin.state().unwrap();
    for object in &here.objects {
        let place = |state: &trueup::world::WorldState| {
            state.object(&object.name).unwrap().world_from_object.unwrap().origin()
        };
        assert!((place(&seen) - place(&here)).norm() < 3e-3, "{}", object.name);
    }
}
