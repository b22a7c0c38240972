//! What a rehearsal decided, so that the performance decides the same.
//!
//! In the twin every choice and every plan is recorded in the order the scripts asked for them; on the
//! arm the same scripts ask again and are given the same answers. A plan that no simulation survived is
//! therefore never run. A script that asks for something else than in the rehearsal is off the tape,
//! and the step fails rather than improvises.
//!
//! The tape is cut into steps, so that a step which ends sooner on the arm than it did in the twin (an
//! `until` that came true, as measured) leaves nothing behind for the next one.

use super::plan::{Grasp, Placement, Pour};

/// One decision.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The ways to grasp that were found, best first.
    Grasps(Vec<Grasp>),
    /// The ways to pour that were found, best first.
    Pours(Vec<Pour>),
    /// The ways to put an object down that were found, best first.
    Placements(Vec<Placement>),
    /// Which of several was taken.
    Choice(usize),
    /// A joint path, rad.
    Path(Vec<Vec<f64>>),
    /// A step of that path in the graph begins.
    Begin(String),
    /// What ends the step became true.
    Ended(Ended),
}

/// When what ends a step became true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ended {
    /// Before anything was done.
    OnArrival,
    /// While the arm moved or waited.
    During {
        /// In which of the step's motions, from 0.
        motion: usize,
        /// How far into it, as a share of the time it was to take.
        along: f64,
    },
}

/// Decisions in order, being recorded or played.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tape {
    entries: Vec<Entry>,
    at: usize,
    playing: bool,
}

/// The script asked for something the rehearsal did not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the step went differently than rehearsed: it asked for {asked} where the rehearsal had {had}"
)]
pub struct OffTape {
    /// What was asked for.
    pub asked: &'static str,
    /// What the rehearsal had at this place.
    pub had: &'static str,
}

impl Entry {
    fn kind(&self) -> &'static str {
        match self {
            Self::Grasps(_) => "ways to grasp",
            Self::Pours(_) => "ways to pour",
            Self::Placements(_) => "ways to put down",
            Self::Choice(_) => "a choice",
            Self::Path(_) => "a path",
            Self::Begin(_) => "the next step",
            Self::Ended(_) => "the end of the step",
        }
    }
}

impl Tape {
    /// Returns an empty tape that records.
    pub fn recording() -> Self {
        Self::default()
    }

    /// Returns these decisions, rewound, to be played.
    #[must_use]
    pub fn rewound(&self) -> Self {
        Self { entries: self.entries.clone(), at: 0, playing: true }
    }

    /// Returns whether decisions come from the tape.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Returns the next decision when playing; `None` when recording.
    ///
    /// # Errors
    ///
    /// [`OffTape`] when the tape is at its end or `wanted` refuses the next entry.
    pub fn next<T>(
        &mut self,
        asked: &'static str,
        wanted: impl FnOnce(&Entry) -> Option<T>,
    ) -> Result<Option<T>, OffTape> {
        if !self.playing {
            return Ok(None);
        }
        let Some(entry) = self.entries.get(self.at) else {
            return Err(OffTape { asked, had: "ended" });
        };
        let value = wanted(entry).ok_or(OffTape { asked, had: entry.kind() })?;
        self.at += 1;
        Ok(Some(value))
    }

    /// Begins a step; when playing, returns when what ends it became true in the rehearsal, if it did.
    ///
    /// # Errors
    ///
    /// [`OffTape`] when the rehearsal had no such step from here on, or when decisions of the step before
    /// are left over although nothing `may_skip` them.
    pub fn begin(&mut self, path: &str, may_skip: bool) -> Result<Option<Ended>, OffTape> {
        if !self.playing {
            self.entries.push(Entry::Begin(path.to_owned()));
            return Ok(None);
        }
        let asked = "the next step";
        let left = &self.entries[self.at.min(self.entries.len())..];
        let is_it = |entry: &Entry| matches!(entry, Entry::Begin(at) if at == path);
        let next = left.iter().position(is_it).ok_or(OffTape { asked, had: "ended" })?;
        let unused = left[..next].iter().find(|entry| !matches!(entry, Entry::Ended(_)));
        if let (Some(unused), false) = (unused, may_skip) {
            return Err(OffTape { asked, had: unused.kind() });
        }
        self.at += next + 1;
        let own = self.entries[self.at..].iter();
        Ok(own.take_while(|entry| !matches!(entry, Entry::Begin(_))).find_map(
            |entry| match entry {
                Entry::Ended(ended) => Some(*ended),
                _ => None,
            },
        ))
    }

    /// Records a decision; does nothing when playing.
    pub fn record(&mut self, entry: Entry) {
        if !self.playing {
            self.entries.push(entry);
        }
    }
}
