//! Stepping at the prompt with a real run under it: a stop keeps the names, and what is paused has the arm.

use std::io::Cursor;
use std::sync::Mutex;
use std::sync::atomic::AtomicUsize;

use trueup::execution::calibrate::Switches;
use trueup::execution::trace::Nobody;
use trueup::lab::{LabSettings, Spot};
use trueup::language::ast::Step;
use trueup::language::{Source, text};
use trueup::repl::{Hands, run_on};
use trueup::report::{Failure, Style};
use trueup::workcell::{Ending, Options, Run, Stdlib, WorkCell};

use crate::program::Desk;

/// A laboratory that is as assumed, so that regression 3 can be spared.
fn cell() -> WorkCell {
    let mut lab = LabSettings::perfect();
    for (name, x_m, y_m) in [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)] {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    let options = Options {
        robot: "lab".into(),
        scene: None,
        script: None,
        lab,
        stdlib: Stdlib::embedded(),
        seed: 1,
        switches: Switches { offset: false, ..Switches::default() },
        clock: || 0.0,
    };
    WorkCell::open(options).unwrap()
}

/// Types lines at a prompt; returns what was carried out and how it ended.
fn typed(desk: &Desk, lines: &str) -> Vec<(String, Ending, usize)> {
    let done = Mutex::new(Vec::new());
    let work = |cell: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        let call =
            cell.define(&Source::new("prompt", text::step(step)), std::slice::from_ref(step));
        let run = cell
            .run(&call, None, Box::new(Nobody))
            .map_err(|error| Failure::no("test", error.to_string()))?;
        done.lock().unwrap().push((text::step(step), run.outcome, run.steps.len()));
        Ok(run)
    };
    let record = desk.path("runs");
    let presses = AtomicUsize::new(0);
    let hands = Hands {
        propose: None,
        perform: &work,
        gap: &|_| Ok(()),
        open: &|_| Err(Failure::input("test", "no other robot here")),
        real: "lab",
        record: &record,
        home: None,
        presses: &presses,
    };
    let style = Style { json: true, quiet: true, colour: false, bars: false };
    run_on(cell(), style, hands, &mut Cursor::new(lines.to_owned())).unwrap();
    done.into_inner().unwrap()
}

#[test]
fn a_stop_while_stepping_keeps_the_names_and_the_arm_is_there_for_the_next_line() {
    let desk = Desk::new("repl-step");
    let lines = "let view = jar\n\
                 :step look() look()\n\
                 pick(jar)\n\
                 next\n\
                 :stop\n\
                 check visible(view)\n\
                 :step look()\n";
    let done = typed(&desk, lines);
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
