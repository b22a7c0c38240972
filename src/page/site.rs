//! Everything the page knows between requests.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::http::Response;
use crate::report::why::Question;
use crate::teach::answers::{self, Answer, Answered, TRAINEE};
use crate::trace::StepRecord;
use crate::workcell::Run;
use crate::workcell::archive::Entry;

use super::live::Live;
use super::run_index::RunIndex;
use super::screen::Screen;
use super::{Options, Place};

/// The run that a page shows beside those that are kept.
#[derive(Default)]
pub(super) struct Shown {
    /// Stepped from the page.
    pub(super) live: Option<Arc<Live>>,
    /// Looked at only.
    pub(super) screen: Option<Arc<Screen>>,
}

/// Everything the page knows between requests.
pub(super) struct Site {
    pub(super) run_index: RunIndex,
    pub(super) live: Option<Arc<Live>>,
    /// A run that is looked at while it goes on.
    pub(super) screen: Option<Arc<Screen>>,
    pub(super) seed: u64,
    answers: PathBuf,
    place: Place,
    /// Who answers: `person:trainee`, or `person:trainee:anna`.
    by: Mutex<String>,
    /// Whether questions are asked before geometry's answers are shown.
    asks: AtomicBool,
    /// Steps whose answers someone has seen, by person, run and number: they are not asked about them any
    /// more.
    seen: Mutex<BTreeSet<(String, String, usize)>>,
}

impl Site {
    pub(super) fn new(options: Options, shown: Shown) -> Self {
        let Shown { live, screen } = shown;
        let Options { root, answers, port: _, seed, place } = options;
        Self {
            run_index: RunIndex::new(root),
            live,
            screen,
            seed,
            answers,
            place,
            by: Mutex::new(TRAINEE.to_owned()),
            asks: AtomicBool::new(true),
            seen: Mutex::default(),
        }
    }

    /// Whether a picture is written to its end: those of a run that goes on are told of one by one.
    pub(super) fn is_whole(&self, run: &str, name: &str) -> bool {
        let now = self.live.as_ref().map(|live| live.now());
        now.filter(|now| now.run() == Some(run)).is_none_or(|now| now.pictures.contains(name))
    }

    /// Returns the folder of a run that is kept or being made.
    pub(super) fn dir(&self, run: &str) -> Option<PathBuf> {
        let kept = self.run_index.entry(run).map(|entry| entry.dir);
        let now = || self.live.as_ref().map(|live| live.now());
        kept.or_else(|| now().filter(|now| now.run() == Some(run)).and_then(|now| now.dir))
    }

    /// Asks questions before geometry's answers are shown, or no longer.
    pub(super) fn ask(&self, asks: bool) {
        self.asks.store(asks, Ordering::SeqCst);
    }

    /// Takes answers from a trainee of that name from now on.
    pub(super) fn answered_by(&self, name: &str) {
        *self.by.lock().unwrap_or_else(PoisonError::into_inner) = trainee(name);
    }

    /// Returns who answers.
    pub(super) fn by(&self) -> String {
        self.by.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether questions are asked before geometry's answers are shown.
    pub(super) fn asks(&self) -> bool {
        self.asks.load(Ordering::SeqCst)
    }

    /// Remembers that whoever answers now has seen the answers of a step.
    pub(super) fn saw(&self, run: &str, number: usize) {
        let by = self.by();
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.insert((by, run.to_owned(), number));
    }

    /// Whether whoever answers now has seen the answers of a step.
    pub(super) fn has_seen(&self, run: &str, number: usize) -> bool {
        let by = self.by();
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.contains(&(by, run.to_owned(), number))
    }

    /// Returns all answers there are, the oldest first.
    pub(super) fn answers(&self) -> Vec<Answered> {
        answers::read(&self.answers).map(|(answers, _)| answers).unwrap_or_default()
    }

    /// Keeps an answer to the question of a fluent after a step.
    pub(super) fn keep(
        &self,
        run: &str,
        step: &StepRecord,
        fluent: &str,
        answer: Answer,
    ) -> Result<(), Response> {
        let row = step.fluents.iter().find(|row| row.name == fluent);
        let answered = row.and_then(|row| Answered::new(&self.by(), run, step, row, answer));
        let Some(answered) = answered else {
            return Err(Response::text(404, "that step has no such question"));
        };
        answers::append(&self.answers, &answered)
            .map_err(|error| Response::text(500, &format!("the answer cannot be kept: {error}")))
    }

    /// Asks [`crate::report::why`] something about a run.
    pub(super) fn why<T>(
        &self,
        entry: &Entry,
        run: &Run,
        fluent: &str,
        ask: impl FnOnce(&Question<'_>) -> T,
    ) -> T {
        let earlier = self.run_index.earlier(entry, run);
        let number = Some(entry.number);
        ask(&Question { run, number, fluent: Some(fluent), earlier: &earlier, place: &*self.place })
    }
}

/// Returns how a trainee is called in the file of answers: never like an expert.
fn trainee(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '.' | '\'');
    let name: String = name.trim().chars().filter(|c| plain(*c)).take(40).collect();
    if name.is_empty() { TRAINEE.to_owned() } else { format!("{TRAINEE}:{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trainee_stays_a_trainee_by_any_name() {
        assert_eq!(trainee(" Anna "), "person:trainee:Anna");
        assert_eq!(trainee("person:expert\n"), "person:trainee:personexpert");
        assert_eq!(trainee("  "), "person:trainee");
    }
}
