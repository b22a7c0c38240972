//! A run that is looked at while it goes on: what the page shows of it now.
//!
//! [`Onlooker`] watches the run and only takes notes; the page reads them whenever it asks. Nothing here waits for a
//! browser, so a run goes as fast with one as without.

use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::trace::{Event, Observer, StepRecord, Still, Tryout};

/// How long a program that ends waits for the browser to take the end, s: a few times what a page takes to ask.
const PARTING: Duration = Duration::from_secs(3);
/// How long an answer takes to leave: many times what it needs.
const LAST_WORD: Duration = Duration::from_millis(150);

/// What the page shows now.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// Counts changes, so that the page knows when to look again.
    pub(super) version: u64,
    pub(super) task: String,
    /// What is going on, in words.
    pub(super) doing: String,
    /// The step that runs, and how many there are; 0 before the first.
    pub(super) step: (usize, usize),
    pub(super) still: Option<Arc<Still>>,
    /// The twin's vessels, and the water in them and beside them over the arm's time, mL.
    pub(super) vessels: Vec<String>,
    pub(super) water: Vec<(f64, Vec<f64>)>,
    /// Rehearsals of the last attempt, each with its last picture.
    pub(super) tryouts: Vec<Tryout>,
    /// Fluents as measured last, in the order they were met, each with the step that changed it last.
    pub(super) fluents: Vec<(String, Option<bool>, usize)>,
    /// How the run ended, in words.
    pub(super) ended: Option<String>,
    /// The report on it, once it is written.
    pub(super) report: Option<PathBuf>,
    /// Which run it is, so that pictures of two have different addresses.
    pub(super) run: usize,
    /// Whether more runs may come, as at a prompt.
    pub(super) goes_on: bool,
}

impl Seen {
    /// Whether nothing more comes.
    pub(super) fn is_over(&self) -> bool {
        self.ended.is_some() && !self.goes_on
    }
}

/// What a run that goes on and the page share.
#[derive(Default)]
pub struct Screen {
    seen: Mutex<Seen>,
    /// Whether somebody looks, and the version that was taken last.
    taken: Mutex<Option<u64>>,
    changed: Condvar,
}

impl Screen {
    /// Makes a screen on which one run after the other is shown, as at a prompt.
    pub fn of_prompt() -> Self {
        let screen = Self::default();
        screen.lock().goes_on = true;
        screen
    }

    /// Begins a run of a task; what was shown before is gone.
    pub fn begin(&self, task: &str) {
        self.change(|seen| {
            *seen = Seen {
                version: seen.version,
                task: task.to_owned(),
                run: seen.run + 1,
                goes_on: seen.goes_on,
                ..Seen::default()
            };
        });
    }

    /// Says how the run ended and where the report on it is.
    pub fn ended(&self, words: &str, report: Option<PathBuf>) {
        self.change(|seen| (seen.ended, seen.report) = (Some(words.to_owned()), report));
    }

    /// Waits until a browser that looks has taken what is shown now, but not for long; without one not at all.
    pub fn part(&self) {
        if self.lock().goes_on {
            self.change(|seen| seen.goes_on = false);
        }
        let now = self.now().version;
        let taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let is_behind = |taken: &mut Option<u64>| taken.is_some_and(|taken| taken < now);
        if taken.is_some() {
            drop(self.changed.wait_timeout_while(taken, PARTING, is_behind));
            // What was said last is on its way.
            std::thread::sleep(LAST_WORD);
        }
    }

    /// Returns what is shown now.
    pub(super) fn now(&self) -> Seen {
        self.lock().clone()
    }

    /// Takes note that a browser has all of a version.
    pub(super) fn took(&self, version: u64) {
        *self.taken.lock().unwrap_or_else(PoisonError::into_inner) = Some(version);
        self.changed.notify_all();
    }

    fn change(&self, change: impl FnOnce(&mut Seen)) {
        let mut seen = self.lock();
        change(&mut seen);
        seen.version += 1;
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Watches a run for the page.
pub struct Onlooker(pub Arc<Screen>);

impl Observer for Onlooker {
    fn event(&mut self, event: &Event) {
        match event {
            Event::Tick(_) | Event::Picture { .. } | Event::Note { .. } => {}
            Event::Phase { name, detail } => {
                self.0.change(|seen| seen.doing = format!("{name}: {detail}"));
            }
            Event::Progress { what, fraction } => {
                self.0.change(|seen| seen.doing = format!("{what} {:.0} %", fraction * 100.0));
            }
            Event::StepStart { number, of, action, .. } => self.0.change(|seen| {
                seen.step = (*number, *of);
                seen.doing = format!("step {number} of {of}: {action}");
            }),
            Event::StepEnd { record } => self.0.change(|seen| measured(seen, record)),
            Event::Still(still) => self.0.change(|seen| filmed(seen, still)),
            Event::Tryout(tryout) => self.0.change(|seen| tried(seen, tryout)),
        }
    }
}

/// Takes what was measured after a step; of what the step did not touch only what is known already.
fn measured(seen: &mut Seen, record: &StepRecord) {
    for row in &record.fluents {
        match seen.fluents.iter_mut().find(|(name, ..)| *name == row.name) {
            Some((_, truth, step)) if *truth != row.measured => {
                (*truth, *step) = (row.measured, record.number);
            }
            Some(_) => {}
            None => seen.fluents.push((row.name.clone(), row.measured, record.number)),
        }
    }
}

fn filmed(seen: &mut Seen, still: &Arc<Still>) {
    seen.still = Some(still.clone());
    if still.twin.is_none() {
        return;
    }
    let names = still.water.iter().map(|(name, _)| name.clone());
    seen.vessels = names.chain(["spilt".to_owned()]).collect();
    let volumes = still.water.iter().map(|(_, volume)| volume).chain([&still.spilt]);
    seen.water.push((still.time, volumes.map(|volume| volume * 1e6).collect()));
}

fn tried(seen: &mut Seen, tryout: &Tryout) {
    // The first of an attempt takes the place of those before.
    let is_again = |old: &Tryout| old.number == tryout.number && old.went.is_some();
    if tryout.went.is_none() && seen.tryouts.iter().any(is_again) {
        seen.tryouts.clear();
    }
    if let Some(old) = seen.tryouts.iter_mut().find(|old| old.number == tryout.number) {
        let before = old.picture.take();
        *old = tryout.clone();
        old.picture = tryout.picture.clone().or(before);
    } else {
        seen.tryouts.push(tryout.clone());
        seen.tryouts.sort_by_key(|tryout| tryout.number);
    }
}
