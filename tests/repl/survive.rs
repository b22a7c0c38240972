//! What the prompt keeps when a line goes wrong: errors, panics, Ctrl-C once, Ctrl-C twice.

use std::io::Cursor;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use trueup::execution::calibrate::Switches;
use trueup::lab::LabSettings;
use trueup::language::ast::Step;
use trueup::language::text;
use trueup::motion::free::Means;
use trueup::repl::{Hands, Leave, run_on};
use trueup::report::{Failure, Style};
use trueup::workcell::{CANDIDATES, Ending, Options, Run, Stdlib, WorkCell};

use super::kept;
use crate::program::Scratch;

fn cell() -> WorkCell {
    let options = Options {
        robot: "lab".into(),
        scene: None,
        script: None,
        lab: LabSettings::perfect(),
        stdlib: Stdlib::embedded(),
        seed: 1,
        switches: Switches::default(),
        candidates: CANDIDATES,
        means: Means::default(),
        is_real_time: false,
        clock: || 0.0,
    };
    WorkCell::open(options).unwrap()
}

/// What a call at the prompt does here.
type Work<'a> = dyn Fn(&mut WorkCell, &Step) -> Result<Run, Failure> + Sync + 'a;

fn typed(work: &Work<'_>, presses: &AtomicUsize, lines: &str) {
    let hands = Hands {
        propose: None,
        perform: work,
        gap: &|_| Ok(()),
        topics: &[],
        open: &|_, _| Err(Failure::input("test", "no other robot here")),
        real: "lab",
        record: Path::new("no-such-folder"),
        home: None,
        presses,
        leave: &Leave::default(),
        is_sure: false,
    };
    let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
    run_on(cell(), style, hands, &mut Cursor::new(lines.to_owned())).unwrap();
}

#[test]
fn a_panic_costs_its_line_and_no_name() {
    let seen = Mutex::new(Vec::new());
    let work = |_: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        let mut seen = seen.lock().unwrap();
        seen.push(text::step(step));
        let count = seen.len();
        drop(seen);
        assert!(count != 1, "planted, so that the prompt has something to survive");
        Err(Failure::no("test", "done"))
    };
    let presses = AtomicUsize::new(0);
    let lines =
        "let dose = 40 mL\npour(jar, cup, amount: dose)\npour(jar, cup, amount: dose)\nplace(it)\n";
    typed(&work, &presses, lines);
    let poured = "pour(jar, cup, amount: 40 mL)";
    assert_eq!(*seen.lock().unwrap(), [poured, poured, "place(jar)"]);
}

/// "Again" was nothing that is called so, whatever had been done before.
#[test]
fn again_is_the_last_call_once_more_and_is_asked() {
    let seen = Mutex::new(Vec::new());
    let work = |_: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        seen.lock().unwrap().push(text::step(step));
        Ok(Run::so_far(&text::step(step), &[]))
    };
    let presses = AtomicUsize::new(0);
    typed(&work, &presses, "again\ny\nhome()\nlook()\nagain\ny\ndo it once more\ny\nagain\nn\n");
    assert_eq!(*seen.lock().unwrap(), ["home()", "look()", "look()", "look()"]);
}

#[test]
fn names_outlive_every_kind_of_error() {
    let seen = Mutex::new(Vec::new());
    let work = |_: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        seen.lock().unwrap().push(text::step(step));
        Err(Failure::no("test", "it did not work"))
    };
    let presses = AtomicUsize::new(0);
    let lines = "let dose = 40 mL\npour(jar,,)\npour(jug, cup)\nlet dose = 3 cm + 2 mL\n!1 +\n:nothing\n\
                 no sentence like this\n}\npour(jar, cup, amount: dose)\npour(jar, cup, amount: dose)\n";
    typed(&work, &presses, lines);
    assert_eq!(*seen.lock().unwrap(), ["pour(jar, cup, amount: 40 mL)"; 2]);
}

/// `:save` wrote a pour that was stopped, and the place that failed for it, as if both had been made.
#[test]
fn what_was_stopped_or_failed_is_saved_as_a_remark() {
    let work = |_: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        let mut run = kept::pour("level_side", 0.1, 0.01, 0.001);
        run.outcome = match text::step(step).split('(').next() {
            Some("pour") => Ending::Stopped,
            Some("place") => Ending::Failure,
            _ => Ending::Success,
        };
        Ok(run)
    };
    let scratch = Scratch::new("repl-save");
    let (none, some) = (scratch.path("none.task"), scratch.path("some.task"));
    let lines = format!(
        "pour(jar, cup)\n:save {}\npick(jar)\nplace(jar)\n:save {}\n",
        none.display(),
        some.display()
    );
    typed(&work, &AtomicUsize::new(0), &lines);
    assert!(!none.exists());
    let saved = std::fs::read_to_string(&some).unwrap();
    let calls = "// stopped: pour(jar, cup)\npick(jar)\n// failed: place(jar)\n";
    assert!(saved.ends_with(calls), "{saved}");
}

/// Ctrl-C once: the work sees the wish, ends by itself, and the next line begins without it.
#[test]
fn one_interrupt_is_a_wish_that_the_work_follows() {
    let presses = AtomicUsize::new(0);
    let calls = AtomicUsize::new(0);
    let work = |cell: &mut WorkCell, _: &Step| -> Result<Run, Failure> {
        let cancel = cell.cancel();
        assert!(!cancel.is_cancelled(), "a wish from an earlier line is still there");
        calls.fetch_add(1, Ordering::SeqCst);
        // As the program's handler does.
        presses.fetch_add(1, Ordering::SeqCst);
        cancel.cancel();
        Err(Failure::stopped("stopped; the arm holds its position"))
    };
    typed(&work, &presses, "pick(jar)\npick(jar)\n!loop { }\npick(jar)\n");
    assert_eq!(calls.load(Ordering::SeqCst), 3);
}

/// The second line is answered while the first winds down; reading the third lets that end.
struct Typist<'a> {
    lines: Vec<&'static str>,
    release: &'a AtomicBool,
    wound_down: &'a AtomicBool,
    calls: &'a AtomicUsize,
    begun: Vec<u8>,
}
impl std::io::Read for Typist<'_> {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        unreachable!("lines are taken from the buffer")
    }
}
impl std::io::BufRead for Typist<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.begun.is_empty() && !self.lines.is_empty() {
            let line = self.lines.remove(0);
            if line.starts_with("place") && self.lines.is_empty() {
                assert!(!self.wound_down.load(Ordering::SeqCst), "the prompt waited");
                assert_eq!(self.calls.load(Ordering::SeqCst), 1, "the cell was lent twice");
                self.release.store(true, Ordering::SeqCst);
                while !self.wound_down.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                // The cell comes back right after.
                std::thread::sleep(Duration::from_millis(200));
            }
            self.begun = format!("{line}\n").into_bytes();
        }
        Ok(&self.begun)
    }
    fn consume(&mut self, amount: usize) {
        self.begun.drain(..amount);
    }
}

/// Ctrl-C twice: the prompt is back while the work still winds down; what needs the cell says so, what
/// needs none is answered, and when the work has come back the cell is used again.
#[test]
fn two_interrupts_bring_the_prompt_back_at_once() {
    let presses = AtomicUsize::new(0);
    let (calls, wound_down) = (AtomicUsize::new(0), AtomicBool::new(false));
    let release = AtomicBool::new(false);
    let work = |cell: &mut WorkCell, step: &Step| -> Result<Run, Failure> {
        calls.fetch_add(1, Ordering::SeqCst);
        if text::step(step) == "pick(jar)" {
            presses.fetch_add(2, Ordering::SeqCst);
            cell.cancel().cancel();
            while !release.load(Ordering::SeqCst) {
                std::thread::sleep(Duration::from_millis(1));
            }
            wound_down.store(true, Ordering::SeqCst);
        }
        Err(Failure::no("test", "done"))
    };
    let mut typist = Typist {
        lines: vec!["pick(jar)", "place(cup)", ":tasks", "place(it)"],
        release: &release,
        wound_down: &wound_down,
        calls: &calls,
        begun: Vec::new(),
    };
    let hands = Hands {
        propose: None,
        perform: &work,
        gap: &|_| Ok(()),
        topics: &[],
        open: &|_, _| Err(Failure::input("test", "no other robot here")),
        real: "lab",
        record: Path::new("no-such-folder"),
        home: None,
        presses: &presses,
        leave: &Leave::default(),
        is_sure: false,
    };
    let style = Style { json: true, quiet: true, verbose: false, colour: false, bars: false };
    run_on(cell(), style, hands, &mut typist).unwrap();
    assert_eq!(calls.load(Ordering::SeqCst), 2, "the last line found the cell again");
}
