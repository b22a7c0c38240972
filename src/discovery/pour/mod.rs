//! A pour against its recording: what the jar held, and what ran on from its lip.
//!
//! The recording says how far the vessel was tilted, what a scale under the other one read, and how far
//! inside that one's mouth the lip was. `flow` is the model: water above the lip runs out, nearly at once.
//! Its pace, a delay, and how level the grasp was are estimated along with any effects.

mod pour_finding;
mod pour_record;
mod flow;
mod gap;
mod wording;

pub use pour_finding::investigate;
pub use pour_record::Pour;
