//! Stepping at the prompt with a real run under it: a stop keeps the names, and what is paused has the arm.

use std::io::{BufRead, Cursor, Read};
use std::sync::Mutex;
use std::sync::atomic::AtomicUsize;

use trueup::arm::Cancel;
use trueup::execution::calibrate::Switches;
use trueup::lab::{LabSettings, Spot};
use trueup::language::ast::Step;
use trueup::language::{Source, text};
use trueup::motion::free::Means;
use trueup::repl::{Hands, Leave, run_on};
use trueup::report::{Failure, Style};
use trueup::trace::Nobody;
use trueup::workcell::{CANDIDATES, Ending, Options, Run, Stdlib, WorkCell};

use crate::program::Scratch;
use crate::workcell::dry;

/// A laboratory that is as assumed, so that regression 3 can be spared.
fn cell() -> WorkCell {
    WorkCell::open(options()).unwrap()
}

pub(super) fn options() -> Options {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    Options {
        robot: "lab".into(),
        scene: Some(dry()),
        script: None,
        lab,
        stdlib: Stdlib::embedded(),
        seed: 1,
        switches: Switches { offset: false, ..Switches::default() },
        candidates: CANDIDATES,
        means: Means::default(),
        is_real_time: false,
        clock: || 0.0,
    }
}

/// What a call at the prompt does.
pub(super) type Work<'a> = dyn Fn(&mut WorkCell, &Step) -> Result<Run, Failure> + Sync + 'a;

/// Carries out a step typed at a prompt, without keeping the run.
pub(super) fn carry_out(cell: &mut WorkCell, step: &Step) -> Result<Run, Failure> {
    let call = cell.define(&Source::new("prompt", text::step(step)), std::slice::from_ref(step));
    let run = cell.run(&call, None, Box::new(Nobody));
    run.map_err(|error| Failure::no("test", error.to_string()))
}

/// A prompt over a cell, without a terminal.
pub(super) fn talk(cell: WorkCell, scratch: &Scratch, work: &Work<'_>, input: &mut dyn BufRead) {
    let record = scratch.path("runs");
    let presses = AtomicUsize::new(0);
    let hands = Hands {
        propose: None,
        perform: work,
        gap: &|_| Ok(()),
        topics: &[],
        open: &|_, _| Err(Failure::input("test", "no other robot here")),
        real: "lab",
        record: &record,
        home: None,
        presses: &presses,
        leave: &Leave::default(),
        is_sure: false,
    };
    let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
    run_on(cell, style, hands, input).unwrap();
}

/// Types lines at a prompt; returns what was carried out and how it ended.
fn typed(
    scratch: &Scratch,
    cell: WorkCell,
    input: &mut dyn BufRead,
) -> Vec<(String, Ending, usize)> {
    let done = Mutex::new(Vec::new());
    let work = |cell: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        let run = carry_out(cell, step)?;
        done.lock().unwrap().push((text::step(step), run.outcome, run.steps.len()));
        Ok(run)
    };
    talk(cell, scratch, &work, input);
    done.into_inner().unwrap()
}

/// Lines that somebody types, pressing Ctrl-C while one of them is waited for.
struct Pressing {
    lines: Vec<&'static str>,
    press_before: &'static str,
    cancel: Cancel,
    line: Vec<u8>,
}

impl Read for Pressing {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        unreachable!("lines are taken from the buffer")
    }
}

impl BufRead for Pressing {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.line.is_empty() && !self.lines.is_empty() {
            let line = self.lines.remove(0);
            if line == self.press_before {
                self.cancel.cancel();
            }
            self.line = format!("{line}\n").into_bytes();
        }
        Ok(&self.line)
    }

    fn consume(&mut self, amount: usize) {
        self.line.drain(..amount);
    }
}

/// Ctrl-C while a paused run waits for a word: the run ends, and the next line is the prompt's.
#[test]
fn a_stop_swallows_no_line() {
    let cell = cell();
    let mut input = Pressing {
        lines: vec![":step look() look()", "check visible(jar)", "check visible(cup)"],
        press_before: "check visible(jar)",
        cancel: cell.cancel(),
        line: Vec::new(),
    };
    let done = typed(&Scratch::new("repl-press"), cell, &mut input);
    let done: Vec<_> = done.iter().map(|(call, end, n)| (call.as_str(), *end, *n)).collect();
    assert_eq!(
        done,
        [
            ("look() then look()", Ending::Stopped, 0),
            ("check visible(jar)", Ending::Success, 1),
            ("check visible(cup)", Ending::Success, 1),
        ]
    );
}

#[test]
fn a_stop_while_stepping_keeps_the_names_and_the_arm_is_there_for_the_next_line() {
    let scratch = Scratch::new("repl-step");
    let lines = "let view = jar\n\
                 :step look() look()\n\
                 pick(jar)\n\
                 next\n\
                 :stop\n\
                 check visible(view)\n\
                 :step look()\n";
    let done = typed(&scratch, cell(), &mut Cursor::new(lines.to_owned()));
    let done: Vec<_> = done.iter().map(|(call, end, n)| (call.as_str(), *end, *n)).collect();
    assert_eq!(
        done,
        [
            // The call in between was refused: the paused run has the arm.
            ("look() then look()", Ending::Stopped, 1),
            ("check visible(jar)", Ending::Success, 1),
            // Input that ends is a wish to stop, and nothing hangs.
            ("look()", Ending::Stopped, 0),
        ]
    );
}
