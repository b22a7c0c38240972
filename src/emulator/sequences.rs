//! Sequences: actions stored in an order and played one after another, with what is told of them.
//!
//! The tasks of one group are played at the same time by an arm; here they are played one after another,
//! in the order of the list.

use crate::kortex::messages::sequence::{Sequence, SequenceHandle};

use super::call::Peer;
use super::error::Refused;

/// Stored sequences and the one that is played.
#[derive(Debug, Clone, Default)]
pub(super) struct Sequences {
    pub(super) stored: Vec<Sequence>,
    last: u32,
    pub(super) playing: Option<Playing>,
}

/// The sequence that is played, and for whom.
#[derive(Debug, Clone)]
pub(super) struct Playing {
    pub(super) sequence: Sequence,
    /// The task that runs, from 0; as many as there are once the last is over.
    pub(super) task: usize,
    pub(super) session: u16,
    pub(super) peer: Peer,
}

impl Sequences {
    /// Returns whether a sequence is played.
    pub(super) fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    pub(super) fn at(&self, handle: &SequenceHandle) -> Result<usize, Refused> {
        let is = |sequence: &Sequence| {
            sequence.handle.as_ref().is_some_and(|own| own.identifier == handle.identifier)
        };
        let found = self.stored.iter().position(is);
        found.ok_or(Refused::NoSequence)
    }

    pub(super) fn store(&mut self, mut sequence: Sequence) -> SequenceHandle {
        self.last += 1;
        let handle = SequenceHandle { identifier: self.last, permission: 7 };
        sequence.handle = Some(handle.clone());
        self.stored.push(sequence);
        handle
    }
}
