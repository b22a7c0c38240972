//! What a rehearsal decided, so that the performance decides the same.
//!
//! In the twin every choice and every plan is recorded in the order the scripts asked for them; on the
//! arm the same scripts ask again and are given the same answers. A plan that no simulation survived is
//! therefore never run. A script that asks for something else than in the rehearsal is off the tape,
//! and the step fails rather than improvises.

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

    /// Records a decision; does nothing when playing.
    pub fn record(&mut self, entry: Entry) {
        if !self.playing {
            self.entries.push(entry);
        }
    }
}
