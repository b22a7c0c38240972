//! A thing held in the hand against its recording: where it was seen, and where the hand was.
//!
//! While the fingers hold, the thing stands still in the hand's frame. How it was grasped differs from time
//! to time and is no effect: the mean place of every stretch is taken away. What then still moves has crept
//! (`slip`), was seen late, or was seen by a camera that stands elsewhere. How far the fingers were open says
//! how wide the thing is, where it was seen standing how high it is.

mod held_finding;
mod held_record;
mod gap;
mod slip;
mod shown;
mod wording;

pub use held_finding::investigate;
pub use held_record::Held;
