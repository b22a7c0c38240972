//! What a rehearsal decided, so that the performance decides the same.
//!
//! In the twin every choice and every plan is recorded in the order the scripts asked for them; on the
//! arm the same scripts ask again and are given the same answers. A plan that no simulation survived is
//! therefore never run. A script that asks for something else than in the rehearsal is not in the decision log,
//! and the step fails rather than improvises.
//!
//! The decision log is cut into steps, so that a step which ends sooner on the arm than it did in the twin (an
//! `until` that came true, as measured) leaves nothing behind for the next one.

use std::fmt;

use super::plan::{Grasp, Placement, Pour, Push, Stir, Wipe};

/// One decision.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The ways to grasp that were found, best first.
    Grasps(Vec<Grasp>),
    /// The ways to pour that were found, best first.
    Pours(Vec<Pour>),
    /// The ways to put an object down that were found, best first.
    Placements(Vec<Placement>),
    /// The ways to push an object that were found, best first.
    Pushes(Vec<Push>),
    /// The ways to stir that were found, best first.
    Stirs(Vec<Stir>),
    /// The ways to wipe that were found, best first.
    Wipes(Vec<Wipe>),
    /// Which of several was taken.
    Choice(usize),
    /// A joint path, rad.
    Path(Vec<Vec<f64>>),
    /// How far a way went that ended where something was felt, m.
    Felt(f64),
    /// A step of that path in the graph begins.
    Begin(String),
    /// What ends the step became true.
    Ended(Ended),
    /// How far the step turned the hand along a path where measuring decides how far, as a share of it.
    Turned(f64),
}

/// What the rehearsal says of a step as a whole, when it is played.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rehearsed {
    /// When what ends it became true, if it did.
    pub ended: Option<Ended>,
    /// How far it turned the hand by measuring, if it did.
    pub turned: Option<f64>,
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
pub struct DecisionLog {
    entries: Vec<Entry>,
    at: usize,
    playing: bool,
}

/// The script asked for something the rehearsal did not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the step went differently than rehearsed: it asked for {asked} where the rehearsal had {had}"
)]
pub struct NotInLog {
    /// What was asked for.
    pub asked: Kind,
    /// What the rehearsal had at this place.
    pub had: Kind,
}

/// What a script asks the decision log for, and what may stand there instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Ways to take an object.
    Grasps,
    /// Ways to pour.
    Pours,
    /// Ways to put an object down.
    Placements,
    /// Ways to push an object.
    Pushes,
    /// Ways to stir.
    Stirs,
    /// Ways to wipe.
    Wipes,
    /// One of several.
    Choice,
    /// What the twin said.
    Answer,
    /// A joint path.
    Path,
    /// How far a way went until something was felt.
    Felt,
    /// The beginning of a step.
    Begin,
    /// When a step was over.
    Ended,
    /// How far measuring turned the hand.
    Turned,
    /// Nothing more.
    Nothing,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grasps => "ways to grasp",
            Self::Pours => "ways to pour",
            Self::Placements => "ways to put down",
            Self::Pushes => "ways to push",
            Self::Stirs => "ways to stir",
            Self::Wipes => "ways to wipe",
            Self::Choice => "a choice",
            Self::Answer => "a yes or no",
            Self::Path => "a path",
            Self::Felt => "a touch",
            Self::Begin => "the next step",
            Self::Ended => "the end of the step",
            Self::Turned => "a turn by measuring",
            Self::Nothing => "ended",
        })
    }
}

impl Entry {
    /// Whether it says something of its step as a whole, and is no answer to a question.
    fn is_remark(&self) -> bool {
        matches!(self, Self::Ended(_) | Self::Turned(_))
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Grasps(_) => Kind::Grasps,
            Self::Pours(_) => Kind::Pours,
            Self::Placements(_) => Kind::Placements,
            Self::Pushes(_) => Kind::Pushes,
            Self::Stirs(_) => Kind::Stirs,
            Self::Wipes(_) => Kind::Wipes,
            Self::Choice(_) => Kind::Choice,
            Self::Path(_) => Kind::Path,
            Self::Felt(_) => Kind::Felt,
            Self::Begin(_) => Kind::Begin,
            Self::Ended(_) => Kind::Ended,
            Self::Turned(_) => Kind::Turned,
        }
    }
}

impl DecisionLog {
    /// Returns an empty decision log that records.
    pub fn recording() -> Self {
        Self::default()
    }

    /// Returns these decisions, rewound, to be played.
    #[must_use]
    pub fn rewound(&self) -> Self {
        Self { entries: self.entries.clone(), at: 0, playing: true }
    }

    /// Returns whether decisions come from the decision log.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Returns the next decision when playing; `None` when recording.
    ///
    /// # Errors
    ///
    /// [`NotInLog`] when the decision log is at its end or `wanted` refuses the next entry.
    pub fn next<T>(
        &mut self,
        asked: Kind,
        wanted: impl FnOnce(&Entry) -> Option<T>,
    ) -> Result<Option<T>, NotInLog> {
        if !self.playing {
            return Ok(None);
        }
        while self.entries.get(self.at).is_some_and(|entry| matches!(entry, Entry::Turned(_))) {
            self.at += 1;
        }
        let Some(entry) = self.entries.get(self.at) else {
            return Err(NotInLog { asked, had: Kind::Nothing });
        };
        let value = wanted(entry).ok_or(NotInLog { asked, had: entry.kind() })?;
        self.at += 1;
        Ok(Some(value))
    }

    /// Begins a step; when playing, returns what the rehearsal says of it.
    ///
    /// # Errors
    ///
    /// [`NotInLog`] when the rehearsal had no such step from here on, or when decisions of the step before
    /// are left over although nothing `may_skip` them.
    pub fn begin(&mut self, path: &str, may_skip: bool) -> Result<Rehearsed, NotInLog> {
        if !self.playing {
            self.entries.push(Entry::Begin(path.to_owned()));
            return Ok(Rehearsed::default());
        }
        let asked = Kind::Begin;
        let left = &self.entries[self.at.min(self.entries.len())..];
        let is_it = |entry: &Entry| matches!(entry, Entry::Begin(at) if at == path);
        let next = left.iter().position(is_it).ok_or(NotInLog { asked, had: Kind::Nothing })?;
        let unused = left[..next].iter().find(|entry| !entry.is_remark());
        if let (Some(unused), false) = (unused, may_skip) {
            return Err(NotInLog { asked, had: unused.kind() });
        }
        self.at += next + 1;
        let mut rehearsed = Rehearsed::default();
        let own = self.entries[self.at..].iter();
        for entry in own.take_while(|entry| !matches!(entry, Entry::Begin(_))) {
            match entry {
                Entry::Ended(ended) => rehearsed.ended = rehearsed.ended.or(Some(*ended)),
                Entry::Turned(share) => {
                    rehearsed.turned =
                        Some(rehearsed.turned.map_or(*share, |t: f64| t.max(*share)));
                }
                _ => {}
            }
        }
        Ok(rehearsed)
    }

    /// Records a decision; does nothing when playing.
    pub fn record(&mut self, entry: Entry) {
        if !self.playing {
            self.entries.push(entry);
        }
    }
}
