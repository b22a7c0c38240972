//! A run that is stepped from the page: what it is doing, and what the page wishes.
//!
//! [`Watch`] sees the run, [`Lead`] holds it between steps until there is a wish; the page reads [`Now`] and
//! leaves wishes. Neither moves the arm.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;

use crate::arm::Cancel;
use crate::execution::conduct::{Ahead, Conductor, Dial, Part, Word};
use crate::teach::stops::{self, Stops};
use crate::trace::{Event, Observer, Outcome, StepRecord};

/// How often who waits looks whether the run is to stop, ms.
const LOOK_UP: u64 = 50;
/// How many notes are shown.
const NOTES: usize = 6;

/// What a person wishes while the run waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// The next step, and then a pause.
    Next,
    /// All of the sub-task that is next, and then a pause.
    Over,
    /// On, to the next breakpoint or the end.
    Continue,
}

impl Wish {
    /// Reads `next`, `over` and `continue`.
    pub fn parse(word: &str) -> Option<Self> {
        match word {
            "next" => Some(Self::Next),
            "over" => Some(Self::Over),
            "continue" => Some(Self::Continue),
            _ => None,
        }
    }
}

/// Where a run waits.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Pause {
    /// Before a step.
    Before(Box<Ahead>),
    /// After a step that failed, before the task does what it says about that.
    Failed {
        /// Which.
        number: usize,
    },
}

/// What the run is doing now.
#[derive(Debug, Clone, Default)]
pub(super) struct Now {
    /// Counts changes, so that a page knows when to look again.
    pub(super) version: u64,
    /// The run folder.
    pub(super) dir: Option<PathBuf>,
    /// What is going on, in words.
    pub(super) doing: String,
    /// The last notes of the run.
    pub(super) notes: Vec<String>,
    /// The step that is carried out or was last, from 1; 0 before the first.
    pub(super) number: usize,
    /// How many steps there are as planned now.
    pub(super) of: usize,
    /// That step's path in the graph.
    pub(super) path: String,
    /// Whether that step is over.
    pub(super) is_done: bool,
    /// Where the run waits, while it waits.
    pub(super) waits: Option<Pause>,
    /// The step that is carried out, or comes next, with those after it; `None` before there is a plan.
    pub(super) ahead: Option<Box<Ahead>>,
    /// The breakpoint that it waits at.
    pub(super) stop: Option<String>,
    /// Why it did not wait where it was asked to.
    pub(super) passed: Option<String>,
    /// How the run ended, in words.
    pub(super) ended: Option<String>,
    /// Pictures that are on disk by now, by name.
    pub(super) pictures: BTreeSet<String>,
    wish: Option<Wish>,
}

impl Now {
    /// Returns the name of the run folder.
    pub(super) fn run(&self) -> Option<&str> {
        self.dir.as_deref()?.file_name()?.to_str()
    }
}

/// Why a breakpoint was not set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Unset {
    /// Nobody knows yet which steps there will be.
    NoPlan,
    /// No step of what is left of the run has this name; the nearest that one has, if one is near.
    NoStep(Option<String>),
}

/// What page and run share.
pub struct Live {
    task: String,
    cancel: Cancel,
    dial: Dial,
    stops: Stops,
    now: Mutex<Now>,
    changed: Condvar,
}

impl Live {
    /// A run of a task that has not begun; `cancel` stops it, `dial` slows it down.
    pub fn new(task: String, cancel: Cancel, dial: Dial) -> Self {
        let now = Now { doing: "the run has not begun".into(), ..Now::default() };
        let stops = Stops::default();
        Self { task, cancel, dial, stops, now: Mutex::new(now), changed: Condvar::new() }
    }

    /// Says how the run ended.
    pub fn ended(&self, words: &str) {
        self.change(|now| {
            now.ended = Some(words.to_owned());
            now.is_done = true;
            now.waits = None;
        });
    }

    /// Leaves a wish; `false` when the run does not wait for one.
    pub fn wish(&self, wish: Wish) -> bool {
        let mut now = self.lock();
        let waits = now.waits.is_some();
        if waits {
            now.wish = Some(wish);
            self.changed.notify_all();
        }
        waits
    }

    /// Asks for a controlled stop: the arm holds its position.
    pub fn stop(&self) {
        self.cancel.cancel();
        self.change(|now| {
            if now.ended.is_none() {
                now.doing = "stopping; the arm will hold its position".into();
            }
        });
    }

    /// Sets a breakpoint by name, path or number.
    ///
    /// # Errors
    ///
    /// That nothing it could name is planned.
    pub(super) fn set_stop(&self, name: &str) -> Result<(), Unset> {
        let ahead = self.lock().ahead.clone().ok_or(Unset::NoPlan)?;
        stops::check(name, &ahead).map_err(Unset::NoStep)?;
        self.stops.set(name);
        self.change(|_| {});
        Ok(())
    }

    /// Takes a breakpoint away.
    pub(super) fn clear_stop(&self, name: &str) {
        self.stops.clear(Some(name));
        self.change(|_| {});
    }

    /// Returns the breakpoints, in the order they were set.
    pub(super) fn stops(&self) -> Vec<String> {
        self.stops.all()
    }

    pub(super) fn task(&self) -> &str {
        &self.task
    }

    pub(super) fn dial(&self) -> &Dial {
        &self.dial
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Returns what is going on.
    pub(super) fn now(&self) -> Now {
        self.lock().clone()
    }

    fn change(&self, change: impl FnOnce(&mut Now)) {
        let mut now = self.lock();
        change(&mut now);
        now.version += 1;
    }

    fn lock(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Watches the run for the page.
pub struct Watch(pub Arc<Live>);

impl Observer for Watch {
    fn event(&mut self, event: &Event) {
        if matches!(event, Event::Tick(_) | Event::Still(_) | Event::Tryout(_)) {
            return;
        }
        self.0.change(|now| {
            match event {
                Event::Phase { name, detail } => now.doing = format!("{name}: {detail}"),
                Event::Progress { what, fraction } => {
                    now.doing = format!("{what} {:.0} %", fraction * 100.0);
                }
                Event::Note { text, .. } => {
                    now.notes.push(text.clone());
                    let surplus = now.notes.len().saturating_sub(NOTES);
                    now.notes.drain(..surplus);
                }
                Event::StepStart { number, of, action, path } => {
                    now.doing = format!("step {number} of {of}: {action}");
                    (now.number, now.of) = (*number, *of);
                    now.path.clone_from(path);
                    now.is_done = false;
                }
                Event::StepEnd { .. } => now.is_done = true,
                // The recorder is told before the page.
                Event::Picture { name, .. } => {
                    now.pictures.insert(name.clone());
                }
                Event::Tick(_) | Event::Still(_) | Event::Tryout(_) => {}
            }
        });
    }
}

/// Holds the run between steps until the page wishes otherwise.
pub struct Lead {
    live: Arc<Live>,
    /// Up to which step it goes on without a pause.
    until: usize,
}

impl Lead {
    /// Pauses before the first step.
    pub fn new(live: Arc<Live>) -> Self {
        Self { live, until: 0 }
    }

    fn comes(&self, ahead: &Ahead) {
        self.live.change(|now| now.ahead = Some(Box::new(ahead.clone())));
    }

    /// Waits at a place where the arm holds still; `None` when the run is to stop.
    fn wait(&self, at: Pause, stop: Option<String>, doing: String) -> Option<Wish> {
        self.live.change(|now| {
            now.doing = doing;
            now.waits = Some(at);
            now.passed = None;
            now.stop = stop;
            now.wish = None;
        });
        let mut now = self.live.lock();
        let wish = loop {
            if self.live.cancel.is_cancelled() {
                break None;
            }
            if let Some(wish) = now.wish.take() {
                break Some(wish);
            }
            let patience = Duration::from_millis(LOOK_UP);
            let woken = self.live.changed.wait_timeout(now, patience);
            now = woken.unwrap_or_else(PoisonError::into_inner).0;
        };
        now.waits = None;
        now.stop = None;
        now.version += 1;
        wish
    }
}

/// Returns the sub-task that `over` goes to the end of: the outermost that begins with the step, else the
/// innermost that it is inside of.
pub(super) fn sub_task(ahead: &Ahead) -> Option<&Part> {
    let is_more = |part: &&Part| !part.is_branch && part.last > ahead.number;
    let mut parts = ahead.inside().iter().filter(is_more);
    let begins = parts.clone().find(|part| part.first == ahead.number);
    begins.or_else(|| parts.next_back())
}

impl Conductor for Lead {
    fn before(&mut self, ahead: &Ahead) -> Word {
        self.comes(ahead);
        let stop = self.live.stops.hit(ahead);
        if ahead.number <= self.until && stop.is_none() {
            return Word::Go;
        }
        let doing = format!("waiting before step {} of {}", ahead.number, ahead.of);
        self.until = match self.wait(Pause::Before(Box::new(ahead.clone())), stop, doing) {
            None => return Word::Stop,
            Some(Wish::Next) => ahead.number,
            Some(Wish::Over) => sub_task(ahead).map_or(ahead.number, |part| part.last),
            Some(Wish::Continue) => usize::MAX,
        };
        Word::Go
    }

    fn after(&mut self, _ahead: &Ahead, record: &StepRecord) -> Word {
        if record.outcome != Outcome::Failure || self.until == usize::MAX {
            return Word::Go;
        }
        let number = record.number;
        let doing = format!("waiting after step {number}, which failed");
        match self.wait(Pause::Failed { number }, None, doing) {
            None => return Word::Stop,
            Some(Wish::Continue) => self.until = usize::MAX,
            // What is done about a failure is stepped too.
            Some(Wish::Next | Wish::Over) => self.until = number,
        }
        Word::Go
    }

    fn begins(&mut self, _task: &str, run_dir: Option<&Path>) {
        self.live.change(|now| now.dir = run_dir.map(Path::to_owned));
    }

    fn tells(&self) -> bool {
        true
    }

    fn passing(&mut self, ahead: &Ahead, why: &str) {
        self.comes(ahead);
        let stop = self.live.stops.hit(ahead);
        if ahead.number > self.until || stop.is_some() {
            // The pause that was wanted is made up for at the next place where it can be.
            self.until = self.until.min(ahead.number);
            let text = format!("no pause before step {}: {why}", ahead.number);
            self.live.change(|now| now.passed = Some(text));
        }
    }
}
